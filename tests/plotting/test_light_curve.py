"""Light curves: the band is two standard uncertainties, brighter is above, rows are in order."""

import numpy as np
import pytest
import xarray as xr

from gonio.plotting.sky import light_curve_figure


def curve(m, u, systematic=np.nan, names=("a", "b")):
    m = np.asarray(m, dtype=float)
    columns = {
        "magnitude": m,
        "uncertainty": np.full_like(m, u),
        "uncertainty_systematic": np.full_like(m, systematic),
        "phase_angle": np.linspace(90, 20, len(m)),
    }
    share = ("facet", "time"), np.full((len(names), len(m)), 1 / len(names))
    data = {name: ("time", values) for name, values in columns.items()} | {"share": share}
    return xr.Dataset(data, {"facet": list(names)}, {"band": "V", "system": "AB"})


def test_the_band_is_two_standard_uncertainties_of_both_parts():
    figure = light_curve_figure(curve([5.0, 6.0, 5.5], 0.3, 0.4), [3.0, 1.0, 2.0])
    top, bottom = figure.axes
    assert top.lines[0].get_xdata().tolist() == [1, 2, 3]
    assert top.lines[0].get_ydata().tolist() == [6.0, 5.5, 5.0]
    (band,) = top.collections
    corners = band.get_paths()[0].vertices
    assert (corners[:, 1].min(), corners[:, 1].max()) == pytest.approx((4.0, 7.0))
    assert top.yaxis_inverted()
    assert top.get_ylabel() == "V [mag, AB]"
    assert [line.get_label() for line in bottom.lines] == ["a", "b"]


def test_dark_times_are_gaps_and_one_part_has_no_panel_of_shares():
    figure = light_curve_figure(curve([5.0, np.inf, 5.5], np.nan, names=("a",)))
    (top,) = figure.axes
    assert np.isnan(top.lines[0].get_ydata()[1])
    with pytest.raises(ValueError, match="no light curve to draw"):
        light_curve_figure(curve([np.inf], np.nan))
    with pytest.raises(ValueError, match="8 names of facets have no room"):
        light_curve_figure(curve([5.0], 0.1, names=tuple("abcdefgh")))


def test_over_the_phase_angle_and_beside_observed_ones():
    figure = light_curve_figure(
        curve([5.0, 6.0], 0.3), None, np.array([5.1, np.nan]), np.array([0.1, np.nan]), over="phase"
    )
    assert figure.axes[-1].get_xlabel() == "phase angle [deg]"
    assert "observed" in figure.axes[0].get_legend_handles_labels()[1]
    dates = np.array(["2022-01-25T13:20", "2022-01-25T13:25"], dtype="datetime64[m]")
    assert light_curve_figure(curve([5.0, 6.0], 0.3), dates).axes[-1].get_xlabel() == "time (UTC)"

"""Values over wavelength or channel at directions of a scan."""

import numpy as np
import pytest

from gonio import catalogue, compare, join, plot, simulate

pytestmark = pytest.mark.xdist_group("figures")
WAVELENGTHS = [650.0, 450.0, 550.0]  # as a file may have them


def colours(coordinate="wavelength", labels=WAVELENGTHS):
    parts = {}
    for k, label in enumerate(labels):
        part = simulate(catalogue["lambert"], {"rho": np.pi * (1 + k)}, [10.0, 30.0, 50.0], np.arange(-60.0, 61, 20.0))
        parts[str(k)] = part.assign_coords({coordinate: ("direction", np.repeat(label, part.sizes["direction"]))})
    scan = join(parts).drop_vars("scan")
    scan["brdf"].values[(scan["theta_r"] == 40) & (scan["phi"] == 180)] *= 2
    scan["uncertainty"] = ("direction", 0.1 * scan["brdf"].values, {"units": "sr-1"})
    return scan


def dots(figure):
    return {line.get_label(): line for line in figure.axes[0].lines if line.get_marker() == "o"}


def test_the_values_at_a_direction_with_their_errors():
    figure = plot(colours(), kind="spectrum", at=(30.0, 20.0, 180.0))
    (line,) = dots(figure).values()
    assert line.get_xdata().tolist() == [450.0, 550.0, 650.0]
    np.testing.assert_allclose(line.get_ydata(), [2.0, 3.0, 1.0])
    bars = figure.axes[0].containers[0].lines[2][0].get_segments()
    np.testing.assert_allclose([np.ptp(bar[:, 1]) for bar in bars], [0.4, 0.6, 0.2])
    assert figure.axes[0].get_xlabel() == "wavelength [nm]"
    assert figure.axes[0].get_ylabel() == "BRDF [sr⁻¹]"
    assert figure.axes[0].get_yscale() == "linear"
    assert plot(colours(), kind="spectrum", scale="log").axes[0].get_yscale() == "log"


def test_without_a_direction_the_brightest_of_the_middle_incidence_angle():
    figure = plot(colours(), kind="spectrum")
    assert "θᵢ = 30°, θᵣ = 40°, φ = 180°" in figure.get_suptitle()
    assert "brightest direction" in figure.get_suptitle()
    np.testing.assert_allclose(next(iter(dots(figure).values())).get_ydata(), [4.0, 6.0, 2.0])
    two = plot(colours(), kind="spectrum", theta_i=[10, 50])
    assert len(dots(two)) == 2
    assert all("θᵣ = 40°" in label for label in dots(two))


def test_fits_run_through_the_values():
    scan = colours()
    rows = compare(scan, [catalogue["lambert"]], grouped={"rho": "wavelength"})
    figure = plot(scan, rows, "spectrum", at=[(10.0, 0.0, 0.0), (50.0, 20.0, 0.0)])
    fitted = [line for line in figure.axes[0].lines if line.get_label() == "lambert"]
    assert len(fitted) == 2
    for line in fitted:
        assert line.get_xdata().tolist() == [450.0, 550.0, 650.0]
        np.testing.assert_allclose(line.get_ydata(), [r * 8 / 7 for r in (2.0, 3.0, 1.0)], rtol=0.1)
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts.count("lambert") == 1


def test_channels_have_places_in_their_order_and_no_lines_between():
    scan = colours("channel", ["B", "R", "G"])
    rows = compare(scan, [catalogue["lambert"]], grouped={"rho": "channel"})
    figure = plot(scan, rows, "spectrum", at=(30.0, 20.0, 180.0))
    ax = figure.axes[0]
    assert [label.get_text() for label in ax.get_xticklabels()] == ["R", "G", "B"]
    (line,) = dots(figure).values()
    assert sorted(zip(line.get_xdata().tolist(), line.get_ydata().round(6).tolist(), strict=True)) == [
        (0, 2),
        (1, 3),
        (2, 1),
    ]
    (fitted,) = (one for one in ax.lines if one.get_label() == "lambert")
    assert fitted.get_linestyle() == "None"


def test_what_was_filled_is_hollow():
    scan = colours()
    scan["origin"] = ("direction", np.where(scan["wavelength"] == 550, 4, 1))
    figure = plot(scan, kind="spectrum")
    assert dots(figure)["filled"].get_markerfacecolor() == "white"
    assert dots(figure)["filled"].get_xdata().tolist() == [550.0]
    assert dots(figure)["measured"].get_xdata().tolist() == [450.0, 650.0]


def test_several_sets_beside_the_wavelength_show_the_first_and_say_so():
    scan = join({"a": colours(), "b": colours()})
    figure = plot(scan, kind="spectrum")
    assert "scan a" in figure.get_suptitle()
    assert len(next(iter(dots(figure).values())).get_xdata()) == 3


def test_what_has_no_spectrum_is_refused():
    one = colours().isel(direction=slice(0, 21))
    with pytest.raises(ValueError, match="and the scan has one: draw curves, or join the scans of all wavelengths"):
        plot(one, kind="spectrum")
    with pytest.raises(ValueError, match=r"no value at θᵢ = 30°, θᵣ = 25°.*nearest is at θᵢ = 30°, θᵣ = 20°, φ = 180°"):
        plot(colours(), kind="spectrum", at=(30.0, 25.0, 180.0))
    with pytest.raises(ValueError, match="8 directions are too many for one panel: name at most 7"):
        plot(colours(), kind="spectrum", at=[(30.0, 20.0, 180.0)] * 8)
    with pytest.raises(ValueError, match="leave --theta-i out"):
        plot(colours(), kind="spectrum", at=(30.0, 20.0, 180.0), theta_i=30.0)

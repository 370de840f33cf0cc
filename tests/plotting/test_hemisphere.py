"""Hemispheres as measured, transmission, gaps and fills: what a figure shows is what its words say."""

import numpy as np
import pytest
from matplotlib.text import Text

from gonio import catalogue, convert, read, resample, write
from gonio.app.views.figures import OF_FITS, draw
from gonio.comparison.ranking import compare
from gonio.fitting.certainty.profile import Profile
from gonio.measured.dataset import directions, make_scan
from gonio.plotting.curves import curves
from gonio.plotting.error_bars import error_bars
from gonio.plotting.panels import by_origin, with_gaps
from gonio.plotting.profiles import profiles
from gonio.plotting.style import save, symbol
from gonio.resampling.resample import Filling


def lobe(theta_i, theta_r, phi):
    return 0.1 + np.exp(-(((theta_r - theta_i) / 20) ** 2) - ((phi - 180) / 40) ** 2)


def half(most=180, **more):
    """A scan of the hemisphere from phi 0 to `most`."""
    theta_i, theta_r, phi = (
        a.ravel() for a in np.meshgrid([10.0, 40], np.arange(0, 86, 5.0), np.arange(0, most + 1, 15.0))
    )
    return make_scan(theta_i, theta_r, lobe(theta_i, theta_r, phi), phi, **more)


def in_plane(**more):
    theta_r = np.tile(np.arange(-60, 61, 10.0), 2)
    theta_i = np.repeat([10.0, 40.0], 13)
    return make_scan(theta_i, theta_r, 0.1 + np.exp(-(((theta_r - theta_i) / 20) ** 2)), **more)


def of_transmission(scan):
    return scan.assign_coords(mode=("direction", np.full(scan.sizes["direction"], "transmission")))


def texts(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def meshes(figure):
    return [c for ax in figure.axes if ax.name == "polar" for c in ax.collections if c.get_array() is not None]


def test_a_scan_of_the_hemisphere_is_drawn_as_measured():
    figure = draw("hemisphere", {"half": (half(), [])})
    said = texts(figure)
    assert "measured, θᵢ = 10°" in said
    assert "measured, θᵢ = 40°" in said
    values = np.ma.masked_invalid(meshes(figure)[1].get_array().reshape(361, 91))
    # rows are phi in steps of 1 deg, columns theta_r in steps of 89/90 deg; the peak is at (40, 180)
    azimuth, distance = np.unravel_index(np.ma.argmax(values), values.shape)
    assert azimuth == pytest.approx(180, abs=1)
    assert distance * 89 / 90 == pytest.approx(40, abs=1)
    assert values[200:350, 5:].mask.all()  # no direction beyond 180 deg was measured
    assert not values[10:170, :80].mask.any()


def test_the_model_stands_beside_what_was_measured_on_one_scale():
    scan = half()
    figure = draw("hemisphere", {"half": (scan, compare(scan, [catalogue["lambert"]]))})
    titles = [ax.get_title() for ax in figure.axes if ax.name == "polar"]
    assert titles == [f"{what}, θᵢ = {angle}°" for angle in (10, 40) for what in ("measured", "lambert")]
    assert len({(mesh.norm.vmin, mesh.norm.vmax) for mesh in meshes(figure)}) == 1
    assert len(figure.axes) == 5  # and one bar of colours


def test_a_scan_in_plane_has_no_hemisphere_and_says_so():
    with pytest.raises(ValueError, match="only of the plane of incidence, which covers no hemisphere"):
        draw("hemisphere", {"flat": (in_plane(), [])})
    scan = in_plane()
    figure = draw("hemisphere", {"flat": (scan, compare(scan, [catalogue["lambert"]]))})
    assert any("the scan itself is of the plane of incidence alone" in text for text in texts(figure))


def test_channels_and_turned_surfaces_show_the_first_by_name(tmp_path):
    scan = half(360, coordinates={"channel": np.tile(["R", "G"], half(360).sizes["direction"] // 2)})
    assert any("channel R" in text for text in texts(draw("hemisphere", {"a": (scan, [])})))
    turned = half(360, phi_i=np.full(half(360).sizes["direction"], 30.0))
    save(draw("hemisphere", {"a": (turned, [])}), tmp_path / "turned")


def test_files_with_an_interpolation_of_their_own_use_it(tmp_path):
    convert(
        half(360),
        tmp_path / "x.bsdf",
        "rgl",
        filling=Filling(("bilateral",), lambda p: np.full(p.sizes["direction"], 0.1), "a"),
    )
    figure = draw("hemisphere", {"x": (read(tmp_path / "x.bsdf"), [])})
    last = np.ma.masked_invalid(meshes(figure)[-2].get_array().reshape(361, 91))
    assert not last[:, :80].mask.any()


@pytest.mark.parametrize("kind", ["curves", "hemisphere"])
def test_transmission_is_named(kind):
    scan = of_transmission(half() if kind == "hemisphere" else in_plane())
    said = " ".join(texts(draw(kind, {"t": (scan, [])})))
    assert "BTDF [sr⁻¹]" in said
    assert "BRDF" not in said
    assert "transmission: θᵣ from the normal of the far side" in said


@pytest.mark.parametrize("kind", OF_FITS)
def test_a_figure_of_fits_needs_one(kind):
    with pytest.raises(ValueError, match=f"{kind} shows fits, and no model was fitted: name one with --models"):
        draw(kind, {"a": (in_plane(), [])})


def test_no_line_crosses_a_gap():
    theta_r, values = with_gaps(np.array([0.0, 5, 10, 20, 25]), np.arange(5.0))
    np.testing.assert_array_equal(theta_r, [0, 5, 10, np.nan, 20, 25])
    np.testing.assert_array_equal(values, [0, 1, 2, np.nan, 3, 4])
    for short in ([1.0], [1.0, 9.0]):
        np.testing.assert_array_equal(with_gaps(np.array(short), np.array(short))[0], short)


def test_what_was_filled_is_not_called_measured(tmp_path):
    scan, filling = in_plane(), Filling((), lambda p: np.full(p.sizes["direction"], 0.5), "lambert")
    wider = directions(make_scan(np.full(3, 10.0), [-70.0, 0.0, 70.0], np.zeros(3)))
    filled = resample(scan, wider, filling=filling)
    assert by_origin(filled.drop_vars("origin"), "measured") == {"measured": slice(None)}
    for data in (filled, filled.drop_vars("origin")):
        write(data, tmp_path / "x.nc", force=True)
        said = texts(curves(read(tmp_path / "x.nc"), {}))
        assert "measured and filled" in said or {"measured", "filled"} <= {*said}
        assert ("filled" in said) == ("origin" in data)


def test_one_model_is_not_stacked():
    one = {"lambert": {"a": [0.1, 0.2]}}
    assert error_bars(one, [10, 20], metric="nRMSE").axes[0].get_ylabel() == "nRMSE of lambert [1]"
    assert "stacked" in error_bars(one | {"ggx": {"a": [0.1, 0.2]}}, [10, 20], metric="nRMSE").axes[0].get_ylabel()


def test_profiles_over_decades_are_logarithmic():
    at, rise = np.array([0.001, 0.01, 0.1, 1.0, 10.0]), np.array([-3.0, -1.0, 0.0, 1.5, 3.0])
    wide = Profile("rho_d", "1", 0.1, 0.95, 2.0, at, rise, 0.01, 1.0, False, False)
    ax = profiles([wide], {"rho_d": 0.1}).axes[0]
    assert ax.get_xscale() == "log"
    assert ax.get_xlabel() == r"ρ$_\mathrm{d}$ [1]"


def test_symbols():
    assert [symbol(name) for name in ("ks", "sigma", "rho_s[30]", "alpha")] == ["ks", "σ", r"ρ$_\mathrm{s}$[30]", "α"]

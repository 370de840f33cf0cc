"""Every figure: labelled with units, nothing over anything else, PNG and SVG, and told apart without colour."""

import functools
import itertools
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.quiver import Quiver
from matplotlib.text import Text
from PIL import Image

from gonio import catalogue, join, published, read, simulate
from gonio.app.views.evaluation import surface
from gonio.app.views.figures import draw, draw_model, predictors
from gonio.comparison.ranking import compare
from gonio.fitting import Anneal
from gonio.fitting.certainty.band import band
from gonio.fitting.certainty.profile import Profile
from gonio.measured.dataset import make_scan
from gonio.plotting.curves import curves
from gonio.plotting.error_bars import error_bars
from gonio.plotting.hemisphere import hemisphere
from gonio.plotting.panels import panel_curves
from gonio.plotting.profiles import profiles
from gonio.plotting.spectra import spectra
from gonio.plotting.style import COLOURS, save, symbol
from gonio.results.view import View

pytestmark = pytest.mark.xdist_group("figures")  # one process, which fits and draws once
AT, RISE = np.array([30.0, 40.0, 50.0, 70.0, 90.0]), np.array([-3.0, -1.0, 0.0, 1.5, 3.0])
PROFILES = [
    Profile(name, unit, 50.0, 0.95, 2.0, AT, RISE, 35.0, 76.0, False, False)
    for name, unit in (("gamma", "deg"), ("kid", "a.u."), ("ks", "1"), ("kdd", "sr-1"), ("kd", "sr-1"))
]
NAMES = ("torrance-sparrow", "wang-2016", "cauchy-lorentz")


@pytest.fixture(scope="module")
def ranked():
    surface = published["Al"]
    model = catalogue[surface.model]
    scan = simulate(
        model, surface.values, [20.0, 30, 40, 50, 60, 70], np.arange(-80, 81, 4.0), noise=0.01, unit="a.u.", blocked=5
    )
    models = [catalogue[name] for name in NAMES]
    return {"Al": (scan, compare(scan, models, solver=Anneal(max_iterations=300), grouped={"ks": "theta_i"}))}


@pytest.fixture(scope="module")
def spectral():
    """Two fits at five wavelengths, and the same by scan and wavelength."""
    surface = published["Al"]
    model = catalogue[surface.model]
    theta_r = np.arange(-80, 81, 8.0)
    parts = {
        f"{w:g}": simulate(model, surface.values, [30.0, 50], theta_r, noise=0.02, wavelength=w, unit="a.u.")
        for w in (450.0, 500.0, 600.0, 700.0, 850.0)
    }
    scan = join(parts).drop_vars("scan")
    models = [catalogue[name] for name in ("torrance-sparrow", "cauchy-lorentz")]
    return {"Al": (scan, compare(scan, models, grouped={"sigma": "wavelength"}, held={"gamma": 47.0}))}


def figures(ranked, spectral):
    scan, rows = ranked["Al"]
    yield from (
        (kind, draw(kind, ranked)) for kind in ("curves", "residuals", "components", "hemisphere", "convergence")
    )
    yield "errors", draw("errors", ranked | {"Al again": ranked["Al"]})
    yield "spectra", draw("spectra", spectral)
    yield "bands", draw("curves", ranked, View(banded=True))
    yield "profiles", profiles(PROFILES, {"gamma": 9.0, "kid": 2.0, "ks": np.inf, "kdd": 1.0, "kd": 1.0}, title="Al")
    yield "normalised", curves(scan, predictors(rows), title="Al", normalised=True)
    polarised = surface(catalogue["priest-mueller"], {"ks": 1.0, "kd": 0.05, "sigma": 0.3}, "")
    for kind in ("curves", "hemisphere", "dolp"):
        yield f"model {kind}", draw_model(kind, polarised, [30.0, 60.0], (1, 0, 0, 0))
    yield "paper's model", draw_model("curves", surface(catalogue["cauchy-lorentz"], {}, "Al"), [20.0, 40.0, 70.0], ())
    yield "signed kernel", draw_model("curves", surface(catalogue["ross-li"], {"fgeo": 1.0}, ""), [40.0], ())
    yield "one curve", curves(scan.isel(direction=scan["theta_i"].values == 40), {}, title="Al")


@pytest.fixture(scope="module")
def every_figure(ranked, spectral):
    return list(figures(ranked, spectral))


def visible_texts(figure):
    """Every text on the page with its box in pixels."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer, texts = canvas.get_renderer(), figure.findobj(Text)
    hidden = _not_drawn(figure)  # after the texts were listed, which makes some of the ticks
    for text in texts:
        if text.get_visible() and text.get_text().strip() and id(text) not in hidden:
            box = text.get_window_extent(renderer)
            if box.width > 1:
                yield text.get_text(), box


def _not_drawn(figure):
    """Tick labels beyond the limits of their axis, and those of axes that are not shown, exist without being drawn."""
    hidden = set()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            ticks = (*axis.get_major_ticks(), *axis.get_minor_ticks())
            shown = {id(tick) for tick in axis._update_ticks()} if ax.get_visible() else set()
            hidden |= {id(label) for t in ticks if id(t) not in shown for label in (t.label1, t.label2)}
    return hidden


def test_nothing_overlaps(every_figure):
    for name, figure in every_figure:
        width, height = figure.get_size_inches() * figure.dpi
        boxes = list(visible_texts(figure))
        for text, box in boxes:
            inside = box.x0 >= -2 and box.y0 >= -2 and box.x1 <= width + 2 and box.y1 <= height + 2
            assert inside, (name, text)
        for (one, a), (other, b) in itertools.combinations(boxes, 2):
            wide = min(a.x1, b.x1) - max(a.x0, b.x0)
            high = min(a.y1, b.y1) - max(a.y0, b.y0)
            assert wide <= 1 or high <= 1, (name, one, other)


def test_axes_have_units(every_figure):
    for name, figure in every_figure:
        labels = [t for ax in figure.axes for t in (ax.get_xlabel(), ax.get_ylabel()) if t]
        assert labels, name
        units = ("[deg]", "[a.u.]", "[%]", "[1]", "[sr⁻¹]", "f / f(θᵢ)", "iteration", "angle θᵢ", "[nm]")
        for text in labels:
            assert any(unit in text for unit in units), (name, text)


def test_simulated_data_are_called_simulated(ranked):
    figure = draw("curves", ranked)
    texts = [t.get_text() for t in figure.findobj(Text)]
    assert "simulated" in texts
    assert "measured" not in texts


def test_models_keep_their_colour_and_differ_without_it(ranked):
    scan, rows = ranked["Al"]
    assert list(predictors(rows)) == sorted(NAMES)
    lines = curves(scan, predictors(rows)).axes[0].lines[1:4]
    assert len({line.get_color() for line in lines}) == 3
    assert len({str(line._dash_pattern) for line in lines}) == 3
    assert len(set(COLOURS)) == len(COLOURS)


def test_saved_as_png_and_svg(ranked, tmp_path):
    figure = draw("hemisphere", ranked)
    written = save(figure, tmp_path / "view")
    assert [path.name for path in written] == ["view.png", "view.svg"]
    with Image.open(written[0]) as picture:
        assert picture.size[0] > 500
    assert ET.parse(written[1]).getroot().tag.endswith("svg")
    with pytest.raises(FileExistsError, match="--force"):
        save(figure, tmp_path / "view")


def test_files_of_one_figure_are_laid_out_once(tmp_path, monkeypatch):
    figure = curves(make_scan([10.0, 10.0], [20.0, 30.0], [1.0, 2.0], [180.0, 180.0]), {}, title="two")
    engine, times = figure.get_layout_engine(), []
    real = engine.execute
    monkeypatch.setattr(engine, "execute", lambda drawn: (times.append(drawn), real(drawn)))
    save(figure, tmp_path / "two", (".png", ".svg", ".pdf"))
    assert times == [figure]
    assert figure.get_layout_engine() is engine  # whoever changes the figure and saves it again has room found anew


def test_spectra_show_every_fitted_value_with_its_uncertainty(spectral):
    """A panel for each parameter of either model, a line for each model, bars of one standard uncertainty."""
    figure = draw("spectra", spectral)
    panels = {ax.get_ylabel(): ax for ax in figure.axes}
    assert sorted(panels) == ["kd [a.u.]", "kdd [a.u.]", "kid [a.u.]", "ks [a.u.]", "σ [1]"]
    row = next(row for row in spectral["Al"][1] if row.model.name == "torrance-sparrow")
    for name, unit in (("kd", "a.u."), ("sigma", "1")):
        ax = panels[f"{symbol(name)} [{unit}]"]
        line = next(line for line in ax.lines if line.get_label() == "torrance-sparrow")
        values = row.solution.parameters()[name]["values"]
        np.testing.assert_array_equal(line.get_xdata(), [450, 500, 600, 700, 850])
        np.testing.assert_array_equal(line.get_ydata(), [v["value"] for v in values.values()])
        bars = next(b for b in ax.containers if np.isclose(b.lines[0].get_ydata()[0], values["450"]["value"]))
        ends = np.array([segment[:, 1] for segment in bars.lines[2][0].get_segments()])
        np.testing.assert_allclose(np.ptp(ends, axis=1) / 2, [v["uncertainty"] for v in values.values()])


def test_spectra_have_a_line_for_each_scan_and_mark_what_is_not_told():
    value = {"value": 1.0, "uncertainty": 0.1}
    known = {f"{scan},{w}": value for scan in "ab" for w in (500, 600)}
    parameters = {"rho": {"by": "scan,wavelength", "values": known, "unit": "1"}}
    figure = spectra({"lambert": parameters})
    labels = [t.get_text() for t in figure.legends[0].get_texts()]
    assert labels == ["lambert, scan a", "lambert, scan b"]
    known["a,600"] = {"value": 2.0, "uncertainty": np.inf}
    hollow = [line for line in spectra({"lambert": parameters}).axes[0].lines if line.get_markerfacecolor() == "white"]
    assert [line.get_ydata().tolist() for line in hollow] == [[2.0], []]
    crowd = {f"{scan},{w}": value for scan in "abcdefgh" for w in (500, 600)}
    with pytest.raises(ValueError, match="room for 7 lines"):
        spectra({"lambert": {"rho": {"by": "scan,wavelength", "values": crowd, "unit": "1"}}})
    with pytest.raises(ValueError, match="this fit has none"):
        spectra({"lambert": {"rho": {"value": 1.0, "uncertainty": 0.1, "unit": "1"}}})


def test_hemisphere_is_a_true_polar_view():
    """The specular lobe lies on the right at its own polar angle, and the view mirrors about the plane of incidence."""
    surface = published["Cu"]
    model = catalogue[surface.model]
    panel = {"Cu": (40.0, functools.partial(lambda values, g: model(g, values), surface.at(40.0)))}
    figure = hemisphere(panel, unit="a.u.")
    ax = figure.axes[0]
    assert ax.name == "polar"
    mesh = next(c for c in ax.collections if c.get_array() is not None)
    values = np.asarray(mesh.get_array())
    assert values.shape == (361, 91)
    azimuth, distance = np.unravel_index(np.argmax(values), values.shape)
    corners = mesh.get_coordinates()[azimuth, distance]
    assert np.cos(corners[0]) == pytest.approx(1.0)
    assert corners[1] == pytest.approx(40.75, abs=1.0)
    np.testing.assert_allclose(values[1:180], values[-2:-181:-1], rtol=1e-9)


def test_strokes_are_tangential_where_s_light_leaves():
    """At Brewster's angle, in the plane of incidence, light is fully s-polarised: strokes lie across the plane."""
    theta = float(np.degrees(np.arctan(1.5)))
    polarised = surface(catalogue["priest-mueller"], {"ks": 1.0, "sigma": 0.5}, "")
    figure = draw_model("dolp", polarised, [theta], (1, 0, 0, 0))
    strokes = next(c for c in figure.axes[0].collections if isinstance(c, Quiver))
    forward = np.abs(np.radians(0.0) - strokes.XY[:, 0]) < 1e-9
    assert forward.any()
    np.testing.assert_allclose(strokes.U[forward], 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(strokes.V[forward]), 1.0, rtol=1e-9)
    # to the left and right of the plane they mirror
    turned = {
        round(float(a), 6): u * v for (a, r), u, v in zip(strokes.XY, strokes.U, strokes.V, strict=True) if r == 55
    }
    for azimuth, slant in turned.items():
        if -azimuth in turned:
            assert turned[-azimuth] == pytest.approx(-slant, abs=1e-9)


def test_many_curves_and_channels_say_what_is_left_out(shared_scans):
    chosen, note = panel_curves(read(shared_scans / "jsss_mwir_copper.csv"))
    assert len(chosen) == 6
    assert note == "6 of 10 incidence angles"
    _, note = panel_curves(read(shared_scans / "rgl_paper_white.csv"))
    assert note == "channel B"


def test_refusals(ranked):
    out_of_plane = make_scan([10.0, 10.0], [20.0, 30.0], [1.0, 2.0], [90.0, 90.0])
    with pytest.raises(ValueError, match="no in-plane curve"):
        panel_curves(out_of_plane)
    with pytest.raises(ValueError, match="shows one scan"):
        draw("residuals", ranked | {"again": ranked["Al"]})
    scan, _ = ranked["Al"]
    exact = {"Al": (scan, compare(scan, [catalogue["lambert"]]))}
    with pytest.raises(ValueError, match="add --solver anneal"):
        draw("convergence", exact)
    parts = {f"{angle}": scan.isel(direction=scan["theta_i"].values == angle) for angle in (20, 30)}
    apart = {name: (part, compare(part, [catalogue["lambert"]])) for name, part in parts.items()}
    with pytest.raises(ValueError, match="no incidence angle in common"):
        draw("errors", apart)


def test_bars_and_bands_are_what_is_stated(ranked):
    """Bars reach one standard uncertainty from each point, the band the coverage factor times that of the fit."""
    scan, rows = ranked["Al"]
    best = {"Al": (scan, [row for row in rows if row.model.name == "cauchy-lorentz"])}
    ax = draw("curves", best, View(banded=True)).axes[0]
    (bars,) = (c for c in ax.collections if isinstance(c, LineCollection))
    curve = panel_curves(scan)[0][0]
    reach = [segment[1, 1] - segment[0, 1] for segment in bars.get_segments()]
    np.testing.assert_allclose(reach, 2 * curve.points["uncertainty"].values, rtol=1e-9)
    (shade,) = (c for c in ax.collections if isinstance(c, PolyCollection) and not isinstance(c, LineCollection))
    (row,) = best["Al"][1]
    shown = band(row.solution, curve.fine)
    top = (shown["brdf"] + row.solution.coverage_factor(0.95) * shown["uncertainty"]).max()
    assert shade.get_datalim(ax.transData).y1 == pytest.approx(float(top))
    with pytest.raises(ValueError, match="leave out --band"):
        draw("residuals", best, View(banded=True))


def test_a_profile_meets_its_level_at_the_ends():
    ax = profiles(PROFILES[:1], {"gamma": 9.0}).axes[0]
    curve = next(line for line in ax.lines if line.get_label() == "profile")
    level = next(line for line in ax.lines if line.get_label() == "95 % level").get_ydata()[0]
    assert level == 4.0
    at, rise = curve.get_data()
    assert np.interp(30.0, at, rise) == 9.0
    assert rise.min() == pytest.approx(0, abs=1e-3)
    parabola = next(line for line in ax.lines if line.get_label() == "standard uncertainty")
    np.testing.assert_allclose(parabola.get_ydata(), ((parabola.get_xdata() - 50) / 9) ** 2)


def test_error_bars_stack():
    errors = {"a": {"s": [0.1, 0.2]}, "b": {"s": [0.3, 0.4]}}
    ax = error_bars(errors, [30, 40], metric="nRMSE").axes[0]
    tops = sorted(round(p.get_y() + p.get_height(), 6) for p in ax.patches)
    assert tops == [0.1, 0.2, 0.4, 0.6]

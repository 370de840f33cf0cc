"""Every kind of figure for a column of a journal, 85 mm wide with text of 8 pt, compared with the pictures in `kept`.

All data are simulated. `make pictures` renews the pictures: look at each that git shows as changed.
"""

import itertools
import os
import re
import shutil
import zlib
from pathlib import Path

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.testing.compare import compare_images
from PIL import Image

from gonio import catalogue, join, plot, simulate
from gonio.app.views.evaluation import surface
from gonio.app.views.figures import draw, draw_model
from gonio.comparison.ranking import compare
from gonio.fitting import Anneal
from gonio.fitting.certainty.profile import Profile
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.plotting.difference import difference_figure
from gonio.plotting.page import Page, drawn_on
from gonio.plotting.page.room import visible_texts
from gonio.plotting.profiles import profiles
from gonio.plotting.style import house_style, save
from gonio.resampling.difference import difference
from gonio.results.view import View

pytestmark = pytest.mark.xdist_group("figures")
KEPT = Path(__file__).with_name("kept")
RENEW = "GONIO_RENEW_PICTURES"
COLUMN = {"size": "85x60mm", "font": 8, "dpi": 150}
# Root of the mean square of the difference of pixels, of 255. The same figure of the same Matplotlib and fonts gives
# below 0.1; another Matplotlib or FreeType, which shifts edges of letters by a part of a pixel, up to 6. A label or a
# curve of this size that is lost, or stands elsewhere, is more than 8 (test_the_comparison_sees_a_lost_label).
TOLERANCE = 7.0
VALUES = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.25, "index": 1.5}
ANGLES = np.arange(-75.0, 76.0, 5.0)


def in_plane(rho_d=0.1, seed=3):
    values = VALUES | {"rho_d": rho_d}
    return simulate(catalogue["ggx"], values, [10.0, 30.0, 50.0], ANGLES, noise=0.03, seed=seed)


@pytest.fixture(scope="module")
def ranked():
    scan = in_plane()
    spread = np.abs(0.03 * scan["brdf"].values)
    scan["uncertainty"] = ("direction", spread, {"units": "sr-1"})
    models = [catalogue["lambert"], catalogue["torrance-sparrow"]]
    return {"paint": (scan, compare(scan, models))}


def over(coordinate, labels):
    parts = {}
    for k, label in enumerate(labels):
        part = in_plane(0.05 + 0.05 * k, seed=k)
        parts[str(k)] = part.assign_coords({coordinate: ("direction", np.repeat(label, part.sizes["direction"]))})
    joined = join(parts).drop_vars("scan")
    joined["uncertainty"] = ("direction", 0.05 * joined["brdf"].values, {"units": "sr-1"})
    return joined


def hemisphere():
    theta_r, phi = (a.ravel() for a in np.meshgrid(np.arange(0.0, 86.0, 5.0), np.arange(0.0, 360.0, 10.0)))
    theta_i = np.full(theta_r.size, 30.0)
    values = catalogue["ggx"](Geometry.from_degrees(theta_i, theta_r, phi), VALUES)
    return make_scan(theta_i, theta_r, np.asarray(values), phi)


def wavelengths():
    scan = over("wavelength", [450.0, 500.0, 550.0, 600.0, 650.0])
    model = catalogue["torrance-sparrow"]
    return scan, compare(scan, [model], grouped=dict.fromkeys(model.weights, "wavelength"))


AT, RISE = np.array([30.0, 40.0, 50.0, 70.0, 90.0]), np.array([-3.0, -1.0, 0.0, 1.5, 3.0])
PROFILES = [
    Profile(name, unit, 50.0, 0.95, 2.0, AT, RISE, 35.0, 76.0, False, False)
    for name, unit in (("gamma", "deg"), ("kid", "sr-1"))
]


def alone(kind, *theta_i, scales=("linear", "log")):
    model = surface(catalogue["ggx"], {"rho_s": 0.5, "rho_d": 0.1, "width": 0.2}, "")
    return draw_model(kind, model, theta_i, (1.0, 0.0, 0.0, 0.0), scales)


def dolp():
    model = surface(catalogue["wellems"], {"ks": 1.0}, "")
    return draw_model("dolp", model, [50.0], (1.0, 0.0, 0.0, 0.0))


def annealed():
    scan, model = in_plane(), catalogue["torrance-sparrow"]
    rows = compare(scan, [model], solver=Anneal(max_iterations=60))
    return draw("convergence", {"paint": (scan, rows)})


def spectral(kind, **view):
    scan, rows = wavelengths()
    return draw(kind, {"paint": (scan, rows)}, View(**view))


def channels(kind, **view):
    return draw(kind, {"paint": (over("channel", ["R", "G", "B"]), [])}, View(**view))


FIGURES = {
    "curves": lambda ranked: draw("curves", ranked),
    "curves-log": lambda ranked: draw("curves", ranked, View(scales=("log",), theta_i=(30.0,))),
    "curves-of-two": lambda ranked: draw(
        "curves", {"paint": (ranked["paint"][0], []), "other": (in_plane(0.2, 4), [])}
    ),
    "curves-of-channels": lambda _: channels("curves", together=True, theta_i=(30.0,)),
    "residuals": lambda ranked: draw("residuals", ranked),
    "components": lambda ranked: draw("components", ranked),
    "errors": lambda ranked: draw("errors", ranked),
    "polar": lambda ranked: draw("polar", ranked, View(theta_i=(10.0, 50.0))),
    "polar-linear": lambda ranked: draw("polar", ranked, View(scales=("linear",), theta_i=(30.0,))),
    "polar-of-a-model": lambda _: alone("polar", 30.0, 60.0),
    "lobe": lambda ranked: draw("lobe", ranked, View(theta_i=(30.0,))),
    "lobe-log": lambda ranked: draw("lobe", ranked, View(theta_i=(50.0,), scales=("log",))),
    "lobe-measured": lambda _: draw("lobe", {"paint": (hemisphere(), [])}),
    "lobe-of-a-model": lambda _: alone("lobe", 30.0),
    "spectrum": lambda _: spectral("spectrum"),
    "spectrum-of-channels": lambda _: channels("spectrum", at=((30.0, 30.0, 180.0), (30.0, 0.0, 180.0))),
    "spectra": lambda _: spectral("spectra"),
    "hemisphere": lambda _: draw("hemisphere", {"paint": (hemisphere(), [])}),
    "model": lambda _: alone("curves", 30.0, 60.0),
    "dolp": lambda _: dolp(),
    "convergence": lambda _: annealed(),
    "profiles": lambda _: profiles(PROFILES, {"gamma": 9.0, "kid": 8.0}, title="paint"),
    "difference": lambda ranked: difference_figure(difference(in_plane(0.12, 4), ranked["paint"][0]), "a.csv", "b.csv"),
}


@pytest.fixture(scope="module")
def drawn(ranked, tmp_path_factory):
    """A figure by its name and its picture, each drawn once."""
    folder, found = tmp_path_factory.mktemp("drawn"), {}

    def of(name):
        if name not in found:
            with drawn_on(Page(**COLUMN)), house_style():
                figure = FIGURES[name](ranked)
                (path,) = save(figure, folder / name, (".png",))
            _few_colours(path)
            found[name] = figure, path
        return found[name]

    return of


def _few_colours(path):
    """The same picture in 64 colours, which takes a third of the space."""
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(64, dither=Image.Dither.NONE)
    small.save(path, optimize=True)


@pytest.mark.parametrize("name", FIGURES)
def test_a_figure_looks_as_it_did(drawn, name, tmp_path):
    _, path = drawn(name)
    kept = KEPT / f"{name}.png"
    if os.environ.get(RENEW):
        shutil.copyfile(path, kept)
    assert kept.exists(), f"make pictures draws {kept.name}"
    compared = shutil.copyfile(path, tmp_path / f"{name}.png")  # the comparison writes beside what it compares
    expected = shutil.copyfile(kept, tmp_path / f"{name}-kept.png")
    assert compare_images(str(expected), str(compared), TOLERANCE) is None


def test_the_comparison_sees_a_lost_label(drawn, tmp_path):
    _, path = drawn("curves-log")
    with Image.open(path) as picture:
        less = picture.convert("RGB")
    less.paste((255, 255, 255), (0, 0, 40, less.height))  # the label of the values and their scale
    less.save(tmp_path / "less.png")
    whole = shutil.copyfile(path, tmp_path / "whole.png")
    assert "RMS Value" in compare_images(str(whole), str(tmp_path / "less.png"), TOLERANCE)


def test_the_pictures_are_small_and_none_is_left_over():
    sizes = {path.stem: path.stat().st_size for path in KEPT.iterdir()}
    assert set(sizes) == {*FIGURES}
    assert max(sizes.values()) < 40_000


@pytest.mark.parametrize("name", FIGURES)
def test_no_text_is_over_another_or_cut_off(drawn, name):
    """At three times the resolution, where the boxes of letters are nearer to the letters."""
    figure, _ = drawn(name)
    with drawn_on(Page(**COLUMN)), house_style():
        figure.set_dpi(450)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        texts = list(visible_texts(figure, canvas.get_renderer()))
    width, height = figure.get_size_inches() * 450
    assert len(texts) > 4
    for text, box in texts:
        assert min(box.x0, box.y0) >= -6, text
        assert box.x1 <= width + 6, text
        assert box.y1 <= height + 6, text
    for (one, a), (other, b) in itertools.combinations(texts, 2):
        apart = min(a.x1, b.x1) - max(a.x0, b.x0) <= 5 or min(a.y1, b.y1) - max(a.y0, b.y0) <= 5  # 0.3 mm
        assert apart, (one, other)


@pytest.mark.parametrize("name", FIGURES)
def test_every_axis_has_a_unit(drawn, name):
    """In the label of the axis, of the bar of colours, or of an axis in space; [1] is the unit of a mere number."""
    figure, _ = drawn(name)
    words = " ".join(text for text, _ in visible_texts(figure, FigureCanvasAgg(figure).get_renderer()))
    found = set(re.findall(r"\[(.*?)\]", words))
    assert found, name
    assert found <= {"deg", "sr⁻¹", "nm", "%", "1"}, name
    for ax in figure.axes:
        if ax.name == "rectilinear" and not hasattr(ax, "_colorbar"):
            labels = [axis.get_label_text() for axis in (ax.xaxis, ax.yaxis)]
            unlabelled = {"", "iteration", "channel", "incidence angle θᵢ of each sample"}  # numbers, names, 10°
            assert all("[" in label or label in unlabelled for label in labels), labels


def test_a_pdf_has_text_of_8_pt_in_fonts_of_its_own(ranked, tmp_path):
    """Sizes as an editor of the file reads them, and a font program in the file for every font."""
    scan, rows = ranked["paint"]
    for kind in ("curves", "polar", "lobe"):
        path = tmp_path / f"{kind}.pdf"
        plot(scan, rows, kind, size=(85, 60), font=8, theta_i=30.0, out=path)
        data = path.read_bytes()
        fonts = re.findall(rb"/Type /FontDescriptor", data)
        assert fonts
        assert len(re.findall(rb"/FontFile2 \d+ 0 R", data)) == len(fonts)
        assert b"/Type3" not in data
        sizes = set()
        for stream in re.findall(rb"stream\r?\n(.*?)\r?\nendstream", data, re.DOTALL):
            try:
                sizes |= {float(size) for size in re.findall(rb"/F\d+ ([0-9.]+) Tf", zlib.decompress(stream))}
            except zlib.error:
                continue
        assert 8.0 in sizes, kind
        assert sizes <= {8.0, 5.6}, kind  # 5.6: exponents, by Matplotlib's rule of 0.7

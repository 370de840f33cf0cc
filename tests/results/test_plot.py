"""gonio.plot and Solution.plot: every figure of every kind of fit, on axes of one's own too, and reports as files."""

import re
import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.figure import Figure

import gonio
from gonio import Problem, catalogue, compare, fit
from gonio.plotting.style import svg
from results.conftest import HOSTILE, surface

KINDS = ("single", "joint", "grouped", "spectral")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("figure", ["curves", "residuals", "components", "hemisphere"])
def test_every_fit_is_drawn(fits, kind, figure):
    drawn = fits[kind].plot(figure)
    assert isinstance(drawn, Figure)
    assert len(drawn.axes) >= 2


def test_a_spectrum_is_drawn(fits):
    labels = [ax.get_ylabel() for ax in fits["spectral"].plot("spectra").axes]
    assert any("width" in label for label in labels)


def lines(ax):
    return {line.get_label(): line for line in ax.lines if not line.get_label().startswith("_")}


@pytest.mark.parametrize("kind", KINDS)
def test_on_axes_of_ones_own(fits, kind):
    solution = fits[kind]
    figure = Figure()
    ax = figure.subplots()
    assert solution.plot(ax=ax) is figure
    drawn = lines(ax)
    assert sum(label.startswith("θᵢ") for label in drawn) == 2
    dots = drawn[next(label for label in drawn if label.startswith("θᵢ"))]
    assert set(dots.get_ydata()) <= set(solution.scan["brdf"].values)
    assert solution.model.name in drawn
    other = figure.subfigures().subplots()
    assert solution.plot("residuals", ax=other) is figure
    residual = lines(other)[next(iter(lines(other)))]
    assert np.nanmax(np.abs(residual.get_ydata())) < 100


def test_several_fits_have_names_of_their_own(single):
    scan = surface()
    ranked = compare(scan, [catalogue["lambert"], catalogue["phong"]])
    ax = Figure().subplots()
    gonio.plot(scan, ranked, ax=ax)
    assert {"lambert", "phong"} <= set(lines(ax))
    ax = Figure().subplots()
    gonio.plot(scan, [single, single], ax=ax)
    assert {"ggx", "ggx (2)"} <= set(lines(ax))
    ax = Figure().subplots()
    gonio.plot(scan, {"mine": single}, ax=ax)
    assert "mine" in lines(ax)


def test_a_scan_alone_is_drawn():
    assert len(gonio.plot(surface()).axes) == 4
    ax = Figure().subplots()
    gonio.plot(surface(), ax=ax)
    assert set(lines(ax)) == {"θᵢ = 20°", "θᵢ = 50°"}


def test_what_cannot_be_drawn_is_refused(single):
    scan, ax = surface(), Figure().subplots()
    with pytest.raises(ValueError, match="no figure 'pie': choose one of curves, residuals, components"):
        gonio.plot(scan, single, "pie")
    with pytest.raises(ValueError, match="residuals shows fits: give a solution"):
        gonio.plot(scan, kind="residuals")
    with pytest.raises(ValueError, match="residuals shows fits: give a solution"):
        gonio.plot(scan, kind="residuals", ax=ax)
    with pytest.raises(ValueError, match="components has panels of its own: leave ax out, or draw curves or residuals"):
        gonio.plot(scan, single, "components", ax)
    with pytest.raises(TypeError, match="str is no fit"):
        gonio.plot(scan, "ggx")


def test_drawing_changes_no_setting_of_matplotlib(single):
    before = dict(mpl.rcParams)
    single.plot()
    single.plot(ax=Figure().subplots())
    assert dict(mpl.rcParams) == before


def test_a_report_is_a_page_with_its_figures(single, tmp_path):
    path = single.report(tmp_path / "report.html")
    page = path.read_text(encoding="utf-8")
    root = ET.fromstring(page.partition("\n")[2])
    assert len(root.findall(".//{http://www.w3.org/2000/svg}svg")) == 4  # conventions, two curves, residuals
    assert not re.search(r"(?:src|href)=.http", page)  # nothing is loaded; a citation may name its DOI
    with pytest.raises(FileExistsError):
        single.report(path)
    single.report(path, force=True)


def test_a_report_is_text(fits, tmp_path):
    joint = fits["joint"]
    joint.report(tmp_path / "report.txt")
    assert (tmp_path / "report.txt").read_text(encoding="utf-8") == f"{joint}\n"
    joint.report(tmp_path / "report.md")
    written = (tmp_path / "report.md").read_text(encoding="utf-8").splitlines()
    assert all(line.startswith("    ") for line in written if line)  # a block of code, in which no name is markup
    with pytest.raises(ValueError, match=r"written as .html, .pdf, .md or .txt"):
        joint.report(tmp_path / "report.docx")


def test_a_report_without_a_curve_in_plane_says_so(tmp_path):
    scan = surface()
    scan["phi"].values[:] = 90.0
    solution = fit(Problem(catalogue["lambert"], scan))
    page = solution.report(tmp_path / "report.html").read_text(encoding="utf-8")
    assert "No figure of curves: the scan holds no in-plane curve" in page


def test_hostile_names_break_no_figure(fits):
    for figure in (fits["joint"].plot(), fits["joint"].plot("components"), fits["joint"].plot("residuals")):
        ET.fromstring(svg(figure))
    renamed = {HOSTILE: fits["single"]}
    ET.fromstring(svg(gonio.plot(surface(), renamed)))

"""What every command that draws takes for print: the size, text, title, style and formats of its figures."""

import pytest
from PIL import Image

from gonio import catalogue, join, simulate, write

FIT = "fit s.csv --model lambert --out r --format pdf --size 85x60mm --font 8"
PLOT = "plot s.csv --models lambert --out f.svg"
DRAWING = {
    "plot": "plot s.csv --models lambert",
    "draw": "draw lambert --set rho=1",
    "diff": "diff s.csv s.csv",
}


@pytest.fixture
def here(tmp_path, monkeypatch):
    write(
        simulate(catalogue["lambert"], {"rho": 0.5}, [10.0, 40.0], range(-60, 61, 10), noise=0.01), tmp_path / "s.csv"
    )
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", DRAWING)
def test_a_figure_for_print(run, here, command):
    (here / "j.mplstyle").write_text("axes.grid: False\n")
    options = ["--size", "85x60mm", "--font", "8", "--dpi", "300", "--title", "Mine", "--style", "j.mplstyle"]
    for name in ("a.pdf", "b.PNG", "c.svg"):
        code, out, err = run(*DRAWING[command].split(), *options, "--out", name)
        assert (code, err) == (0, "")
        assert f"wrote {name}" in out
    assert {path.name for path in here.iterdir()} == {"s.csv", "j.mplstyle", "a.pdf", "b.PNG", "c.svg"}
    assert (here / "a.pdf").read_bytes().startswith(b"%PDF")
    with Image.open(here / "b.PNG") as picture:
        assert picture.size == (int(85 / 25.4 * 300), int(60 / 25.4 * 300))
        assert picture.info["dpi"] == pytest.approx((300, 300), abs=0.01)
    assert "Mine" in (here / "c.svg").read_text(encoding="utf-8")


@pytest.mark.parametrize("command", DRAWING)
def test_unknown_suffixes_are_refused_with_the_known(run, here, command):
    for name in ("x.jpg", "x.EPS", "x.pdff", "x.txt"):
        code, out, err = run(*DRAWING[command].split(), "--out", name)
        assert (code, out) == (1, "")
        assert (
            err == f"gonio: {name}: figures are written as .pdf, .png or .svg, not .{name[2:]}: choose one of these\n"
        )
    assert [path.name for path in here.iterdir()] == ["s.csv"]


@pytest.mark.parametrize("command", DRAWING)
def test_a_name_without_a_suffix_is_written_in_the_formats_that_are_named(run, here, command):
    assert run(*DRAWING[command].split(), "--format", "pdf,svg", "--out", "width-0.5")[0] == 0
    assert {path.name for path in here.iterdir()} == {"s.csv", "width-0.5.pdf", "width-0.5.svg"}


def test_a_fit_writes_its_figures_for_print(run, here):
    code, _, err = run(*FIT.split())
    assert code == 0, err
    assert {path.suffix for path in (here / "r").iterdir()} == {".pdf", ".nc", ".json", ".html"}


@pytest.mark.parametrize("model", ["--model lambert", "--model lambert,ggx"])
def test_a_page_without_room_is_refused_before_the_fit(run, here, model, monkeypatch):
    monkeypatch.setattr("gonio.app.commands.fit.answering.answer", lambda *_, **__: pytest.fail("the fit ran"))
    for options in ("--size 30x30mm", "--size 85x60mm --font 20", "--size 85x60mm --title " + "x" * 500):
        code, out, err = run("fit", "s.csv", *model.split(), "--out", "r", *options.split())
        assert (code, out, err.count("\n")) == (1, "", 1)
        assert "curves: the figure has no room on" in err
        assert "give a larger size" in err
    assert [path.name for path in here.iterdir()] == ["s.csv"]


def test_a_title_may_be_longer_than_the_name_of_a_file(run, here):
    code, _, err = run(*PLOT.split(), "--title", "long " * 60)
    assert code == 0, err


def test_a_figure_that_shows_nothing_of_a_scan_does_not_cost_the_fit(run, here):
    scan = simulate(catalogue["lambert"], {"rho": 0.5}, [10.0, 40.0], range(-60, 61, 10), noise=0.01)
    scan["phi"].values[:] = 90.0
    write(scan, here / "across.csv")
    code, _, err = run("fit", "across.csv", "--model", "lambert", "--out", "r")
    assert code == 0
    assert err.count("this figure is left out: the scan holds no in-plane curve to draw") == 3
    assert {path.name for path in (here / "r").iterdir()} == {"fit.json", "solution.nc", "report.html"}


def test_a_scan_of_several_wavelengths_is_drawn_over_them(run, here):
    parts = {
        f"{w:g}": simulate(catalogue["lambert"], {"rho": w / 1000}, [10.0, 40.0], range(-60, 61, 10), wavelength=w)
        for w in (400.0, 500.0, 600.0)
    }
    write(join(parts).drop_vars("scan"), here / "w.csv")
    command = ["plot", "w.csv", "--models", "lambert", "--figure", "spectrum", "--out", "f.svg", "--force"]
    for options, words in (
        ([], "θᵢ = 10°"),
        (["--at", "40,20,0"], "θᵢ = 40°, θᵣ = 20°, φ = 0°"),
        (["--at", "40,20"], "θᵢ = 40°, θᵣ = 20°, φ = 180°"),
        (["--theta-i", "40"], "brightest direction"),
    ):
        code, _, err = run(*command, *options)
        assert code == 0, err
        text = (here / "f.svg").read_text(encoding="utf-8")
        assert words in text
        assert "wavelength [nm]" in text
        assert "BRDF [sr⁻¹]" in text
    code, _, err = run(*command, "--at", "40,21,180")
    assert code == 1
    assert "no value at θᵢ = 40°, θᵣ = 21°, φ = 180°: the nearest is at θᵢ = 40°, θᵣ = 20°, φ = 180°" in err


def test_the_scale_and_the_angles_that_are_drawn(run, here):
    command = "plot s.csv --models lambert --out f.svg --force"
    for scale, rows in (("both", 2), ("log", 1), ("linear", 1)):
        assert run(*command.split(), "--scale", scale)[0] == 0
        text = (here / "f.svg").read_text(encoding="utf-8")
        assert text.count("BRDF [") == rows
        assert ("logarithmic" in text) == (rows == 2)
    assert run(*command.split(), "--theta-i", "40")[0] == 0
    text = (here / "f.svg").read_text(encoding="utf-8")
    assert "θᵢ = 40°" in text
    assert "θᵢ = 10°" not in text


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--theta-i 20", "the scan has no incidence angle of 20 deg: choose of 10, 40"),
        ("--theta-i 95", "is not a list of angles from 0 to below 90 deg"),
        ("--theta-i x", "an angle of --theta-i 'x' is 'x', not a number"),
        ("--figure errors --theta-i 10", "errors shows all incidence angles"),
        ("--figure errors --scale log", "errors has its own scales: leave --scale out, or draw curves,"),
        (
            "--figure residuals --scale log",
            "residuals has its own scales: leave --scale out, or draw curves, components, spectrum, polar or lobe",
        ),
        ("--at 10,10,180", "curves shows all directions: leave --at out, or draw spectrum"),
        ("--figure spectrum", "spectrum shows several wavelengths or channels, and the scan has one: draw curves"),
        ("--figure spectrum --at 10,10,180 --theta-i 10", "leave --theta-i out"),
        ("--figure spectrum --at 10,95,180", "theta_r = 95 in --at '10,95,180' is outside 0 to 90 deg"),
        ("--figure lobe --theta-i 10,40 --size 85x60mm --font 8", "lobe has room for 1 of 2 incidence angles"),
        ("--theta-i 10,40 --size 40x60mm --font 8", "curves has room for 1 of 2 incidence angles: name fewer"),
    ],
)
def test_a_scale_or_an_angle_that_a_figure_has_not(run, here, options, words):
    code, out, err = run(*PLOT.split(), *options.split())
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert words in err
    assert [path.name for path in here.iterdir()] == ["s.csv"]


@pytest.mark.parametrize("command", ["fit s.csv --model lambert --size 85x60mm", "diff s.csv s.csv --format pdf"])
def test_a_page_without_a_figure_is_refused(run, here, command):
    code, out, err = run(*command.split())
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "need --out" in err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--size 85x60", "a size of '85x60' is not of the form 85x60mm"),
        ("--font 0", "--font is 0: give a number from 4 to 72"),
        ("--dpi 1e9", "--dpi is 1e+09: give a number from 20 to 2400"),
        ("--style none.mplstyle", "none.mplstyle: there is no such style file"),
        ("--format jpg", "figures are not written as 'jpg': choose pdf, png or svg"),
    ],
)
@pytest.mark.parametrize("command", DRAWING)
def test_what_no_page_has_is_refused(run, here, command, options, words):
    code, out, err = run(*DRAWING[command].split(), *options.split(), "--out", "x.pdf")
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert words in err
    assert [path.name for path in here.iterdir()] == ["s.csv"]


def test_files_of_one_name_are_both_drawn(run, here):
    (here / "b").mkdir()
    write(simulate(catalogue["lambert"], {"rho": 0.9}, [10.0, 40.0], range(-60, 61, 10)), here / "b" / "s.csv")
    code, _, err = run("plot", "s.csv", "b/s.csv", "--models", "", "--out", "f.svg")
    assert code == 0, err
    assert "b/s.csv" in (here / "f.svg").read_text(encoding="utf-8")

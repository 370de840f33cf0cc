"""The file of a fit where a model may be named: eval, draw, plot, check and convert --fill."""

import json

import numpy as np
import pytest

from gonio import Geometry, Problem, catalogue, fit, join, read, simulate, write
from gonio.app.cli import main
from gonio.fitting import Solution
from gonio.measured.dataset import flatten, is_in_plane

HELD = {"index": 1.5, "extinction": 0.0}
ANGLES = np.arange(-70.0, 71, 10)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Scans at 450 and 650 nm, both in one file, and fits of one, of both, and by incidence angle."""
    folder = tmp_path_factory.mktemp("fits")
    ggx, scans = catalogue["ggx"], {}
    for k, wavelength in enumerate((450.0, 650.0)):
        values = {"rho_s": 0.3, "rho_d": 0.1 + 0.1 * k, "width": 0.2}
        scans[f"{k}"] = simulate(ggx, values, [20.0, 50.0], ANGLES, noise=0.01, wavelength=wavelength)
        write(scans[f"{k}"], folder / f"{wavelength:.0f}.csv")
    both = join(scans).drop_vars("scan")
    write(both, folder / "both.csv")
    fit(Problem(ggx, read(folder / "450.csv"), held=HELD)).save(folder / "one.nc")
    fit(Problem(ggx, both, held=HELD)).save(folder / "two.nc")
    fit(Problem(ggx, scans["0"], held=HELD, grouped={"rho_s": "theta_i"})).save(folder / "grouped.nc")
    return folder


@pytest.fixture
def run(folder, monkeypatch, capsys, tmp_path):
    def call(*arguments):
        monkeypatch.chdir(folder)
        monkeypatch.setattr("sys.argv", ["gonio", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out = capsys.readouterr()
        return ended.value.code, out.out, out.err

    return call


@pytest.mark.parametrize(
    ("name", "chosen"), [("one.nc", []), ("two.nc", ["--select", "wavelength=650"]), ("grouped.nc", [])]
)
def test_a_fit_is_evaluated(run, folder, name, chosen):
    code, out, _ = run("eval", name, "--at", "20,30,180;50,40,90", "--json", "-", *chosen)
    assert code == 0
    solution = Solution.load(folder / name)
    sets = {"wavelength": 650.0} if chosen else {}
    expected = solution.predict(Geometry.from_degrees([20.0, 50.0], [30.0, 40.0], [180.0, 90.0]), **sets)
    assert json.loads(out)["values"] == pytest.approx(expected.values.tolist(), rel=1e-9)
    assert json.loads(out)["unit"] == "1/sr"


REFUSED = {
    "holds 2 sets; choose one by --select wavelength=VALUE: 450, 650": ("eval", "two.nc", "--at", "20,30"),
    "no wavelength is 999": ("eval", "two.nc", "--at", "20,30", "--select", "wavelength=999"),
    "has no channel to select; it has wavelength": ("draw", "two.nc", "--select", "channel=R"),
    "has no wavelength to select; it has one set alone": (
        "eval",
        "one.nc",
        "--at",
        "1,1",
        "--select",
        "wavelength=450",
    ),
    "for theta_i = 20, 50; there is none for 30": ("eval", "grouped.nc", "--at", "30,30"),
    "a fit has its own values": ("eval", "one.nc", "--at", "20,30", "--set", "rho_s=1"),
    "450.csv: holds no fit": ("eval", "450.csv", "--at", "20,30"),
    "none.nc: there is no such file, and no model of that name": ("draw", "none.nc"),
    "folder/fit: there is no such file": ("check", "folder/fit"),
    "--select chooses a set of a fit": ("draw", "ggx", "--select", "wavelength=650"),
    "the fit is of wavelength 450.0, and the scan of 650.0": (
        *("convert", "650.csv", "new.bsdf", "--to", "zemax", "--fill", "one.nc"),
    ),
    "no model is called 'GGX'; did you mean ggx?": ("eval", "GGX", "--at", "20,30"),
    "no model is called 'Torance-Sparrow'; nearest: torrance-sparrow": (
        "plot",
        "450.csv",
        "--models",
        "Torance-Sparrow",
    ),
    "--blocked and --floor belong to a scan": ("plot", "one.nc", "--blocked", "3"),
}


@pytest.mark.parametrize("message", REFUSED)
def test_refused_in_one_line(run, message):
    code, _, err = run(*REFUSED[message])
    assert code == 1
    assert message in err
    assert err.count("\n") == 1
    assert err.count(", ") < 12  # and no list of the whole catalogue


@pytest.mark.parametrize(
    "arguments",
    [
        ("draw", "one.nc"),
        ("draw", "two.nc", "--figure", "hemisphere", "--select", "wavelength=450"),
        ("plot", "two.nc", "--figure", "residuals"),
        ("plot", "two.nc", "--figure", "spectra"),
        ("plot", "450.csv", "--models", "one.nc,lambert"),
        ("plot", "one.nc", "450.csv", "--models", "lambert,one.nc", "--figure", "errors"),
    ],
)
def test_a_fit_is_drawn(run, tmp_path, arguments):
    code, _, err = run(*arguments, "--out", tmp_path / "figure.svg")
    assert (code, err) == (0, "")
    text = (tmp_path / "figure.svg").read_text(encoding="utf-8")
    assert text.rstrip().endswith("</svg>")
    assert "ggx" in text or "spectra" in arguments


@pytest.mark.parametrize(
    ("scan", "options", "filler", "wavelength"),
    [
        ("450.csv", [], "one.nc", 450.0),
        ("450.csv", [], "two.nc", 450.0),
        ("both.csv", ["--select", "wavelength=650"], "two.nc", 650.0),
    ],
)
def test_gaps_are_filled_by_a_stored_fit(run, folder, tmp_path, scan, options, filler, wavelength):
    target = tmp_path / "new.bsdf"
    code, out, _ = run("convert", scan, target, "--to", "zemax", "--fill", filler, *options)
    assert code == 0
    assert f"filled by ggx fitted in {filler} with uniform weighting" in " ".join(out.split())
    filled = flatten(read(target))
    # next to the horizon the file has the values at some distance from it, as it says
    seen = ~is_in_plane(filled) & (filled["theta_i"].values < 89) & (filled["theta_r"].values < 89)
    filled = filled.isel(direction=np.flatnonzero(seen))
    solution = Solution.load(folder / filler)
    sets = {"wavelength": wavelength} if filler == "two.nc" else {}
    expected = solution.predict(filled.drop_vars("wavelength", errors="ignore"), **sets)
    assert filled.sizes["direction"] > 1000
    np.testing.assert_allclose(filled["brdf"], expected, rtol=1e-4)  # the digits that the file has


def test_check_takes_a_fit_too(run):
    code, out, _ = run("check", "two.nc")
    assert code == 0
    assert "two.nc, wavelength 450" in out

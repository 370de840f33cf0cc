"""Polarised readings on the command line: what info says, what is drawn, what is fitted, and what is refused."""

import json

import numpy as np
import pytest

from gonio import catalogue, read, simulate, write
from gonio.results.figures import plot

MODEL = catalogue["priest-mueller"]
TRUTH = {"ks": 0.6, "kd": 0.02, "sigma": 0.2, "index": 1.5, "extinction": 0.0}
INDEX = ("--model", "priest-mueller", "--hold", "extinction=0")


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    angles = [30.0, 60.0], np.arange(-70.0, 71, 10)
    write(simulate(MODEL, TRUTH, *angles, noise=0.01, seed=2, polarisation=("s", "p")), tmp_path / "sp.csv")
    write(simulate(MODEL, TRUTH, *angles, offset_noise=0.005, seed=3, polarisation=">q/i"), tmp_path / "dolp.csv")
    return tmp_path


def test_info_says_which_degree_it_is_and_how_to_have_it(run, here):
    out = " ".join(run("info", "dolp.csv")[1].split())
    assert "dolp.csv: tidy CSV, degree of linear polarisation" in out
    assert ">q/i: (s - p)/(s + p) of what leaves" in out
    assert "nothing wrong was found" in out
    out = " ".join(run("info", "sp.csv")[1].split())
    assert "--dolp takes it for the values, gonio plot --figure dolp draws it" in out
    taken = json.loads(run("info", "sp.csv", "--dolp", "--json", "-")[1])
    assert (taken["unit"], taken["quantity"], taken["points"]) == ("1", "degree of linear polarisation", 30)


@pytest.mark.parametrize("arguments", [("dolp.csv",), ("sp.csv", "--dolp"), ("sp.csv",)])
def test_an_index_is_fitted_to_a_degree_and_to_readings(run, here, arguments):
    code, out, err = run("fit", *arguments, *INDEX, "--json", "-", "--validate", "none")
    assert code == 0, err
    index = json.loads(out)["parameters"]["index"]
    assert abs(index["value"] - 1.5) < 2.5 * index["uncertainty"]


@pytest.mark.parametrize(
    "command",
    [
        "fit dolp.csv --model ggx",
        "plot dolp.csv --models ggx",
        "plot sp.csv --figure dolp --models ggx",
        "fit sp.csv --dolp --model lambert",
    ],
)
def test_a_model_without_polarisation_is_refused_with_those_that_know_it(run, here, command):
    code, out, err = run(*command.split())
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert "take a model with a Mueller matrix, such as priest-mueller or wellems" in err


def test_convert_keeps_what_a_scan_of_degrees_is(run, here):
    assert run("convert", "sp.csv", "taken.nc", "--dolp")[0] == 0
    assert read(here / "taken.nc")["brdf"].attrs["units"] == "1"
    assert set(read(here / "taken.nc")["polarisation"].values.tolist()) == {"q/i"}


def test_the_figure_is_of_the_measured_degree_beside_the_models(run, here):
    assert run("plot", "sp.csv", "--figure", "dolp", "--models", "priest-mueller", "--out", "a.svg")[0] == 0
    assert "DoLP" in (here / "a.svg").read_text(encoding="utf-8")
    scan = read(here / "sp.csv")
    figure = plot(scan, kind="dolp")
    ax = figure.axes[0]
    s, p = (scan["brdf"].values[(scan["polarisation"].values == w) & (scan["theta_i"].values == 30.0)] for w in "sp")
    dots = next(line for line in ax.lines if line.get_label() == "simulated")
    np.testing.assert_allclose(dots.get_ydata(), (s - p) / (s + p), rtol=1e-9)
    assert ax.get_yscale() == "linear"
    assert ax.get_ylabel() == "DoLP"


def test_residuals_of_a_degree_are_differences(here):
    scan = read(here / "dolp.csv")
    from gonio import fit

    found = fit(scan, [MODEL], held={"extinction": 0.0})
    ax = found.plot("residuals").axes[0]
    assert ax.get_ylabel() == "model − data"
    line = next(line for line in ax.lines if line.get_label() == "priest-mueller")
    here_30 = scan["theta_i"].values == 30.0
    np.testing.assert_allclose(line.get_ydata(), found.residuals.values[here_30], atol=1e-12)
    with pytest.raises(ValueError, match="polar shows no degrees of polarisation: draw curves"):
        found.plot("polar")


def test_over_the_hemisphere_it_is_a_map_with_the_models_beside_it():
    from gonio.measured.dataset import make_scan
    from gonio.measured.instrument import Acceptance, Instrument

    i, r, phi, state = (
        a.ravel()
        for a in np.meshgrid([60.0], np.arange(0.0, 81, 20), np.arange(0.0, 360, 45), [">s", ">p"], indexing="ij")
    )
    scan = make_scan(i, r, np.ones(len(i)), phi, coordinates={"polarisation": state.astype(str)})
    scan["brdf"].values[:] = Acceptance.of(Instrument(), scan).brdf(MODEL, TRUTH)
    from gonio import fit

    found = fit(scan, [MODEL], held={"extinction": 0.0})
    figure = plot(scan, found, "dolp")
    titles = [ax.get_title() for ax in figure.axes]
    assert "measured, θᵢ = 60°" in titles
    assert "priest-mueller, θᵢ = 60°" in titles
    mesh = figure.axes[titles.index("priest-mueller, θᵢ = 60°")].collections[0]
    assert 0.9 < float(np.nanmax(mesh.get_array())) <= 1.0  # near Brewster's angle all that leaves is s

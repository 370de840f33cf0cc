"""What a conversion with a fitted model writes and says: grazing incidence, how much is a model, how far it is off."""

import numpy as np
import pytest

from gonio import catalogue, read, simulate, write
from gonio.measured.dataset import make_scan

GRIDS = ["rgl", "zemax", "lighttools", "integra", "ssdd", "speos-brdf"]


@pytest.fixture
def in_plane(tmp_path, monkeypatch):
    """A scan in the plane of incidence up to theta_i 60 deg, of a lobe and faint wings."""
    monkeypatch.chdir(tmp_path)
    values = {"rho_s": 0.3, "rho_d": 0.02, "width": 0.15, "index": 1.5, "extinction": 0.0}
    write(simulate(catalogue["ggx"], values, [20.0, 40.0, 60.0], np.arange(-80, 81, 5.0)), tmp_path / "scan.csv")
    return tmp_path


def spoken(text):
    return " ".join(text.split())


@pytest.mark.parametrize("kind", GRIDS)
def test_a_file_filled_by_a_model_goes_on_to_grazing_incidence(kind, run, in_plane, coarse_tables):
    code, out, err = run("convert", "scan.csv", "x", "--to", kind, "--fill", "symmetry,ggx", "--weighting", "log")
    assert code == 0, err
    theta_i = np.unique(np.round(read(in_plane / "x")["theta_i"].values, 4))
    assert theta_i[0] == 0
    assert theta_i[-1] == pytest.approx(90, abs=1e-3)
    assert np.diff(theta_i)[theta_i[1:] > 60].max() < 5.001
    for measured in (20, 40, 60):
        assert np.abs(theta_i - measured).min() < 1e-3
    assert "incidence is measured at 20 to 60 deg alone: at all other angles" in spoken(out)
    assert "87.5, 88.25, 89, 90 deg) values are ggx's, or those that symmetry gives" in spoken(out)
    assert "mostly a model: " in spoken(out)
    assert "darkens the rim" not in spoken(out)
    assert "lg RMSE" in spoken(out) or "every value exact" in spoken(out)


def test_a_file_that_ends_before_is_told(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    angles = np.meshgrid([20.0, 40, 60], np.arange(0, 91, 10.0), np.arange(0, 360, 10.0), indexing="ij")
    theta_i, theta_r, phi = (v.ravel() for v in angles)
    write(make_scan(theta_i, theta_r, 0.1 + 0.1 * np.cos(np.radians(theta_r)), phi), tmp_path / "scan.csv")
    code, out, err = run("convert", "scan.csv", "x", "--to", "lighttools")
    assert code == 0, err
    assert "the file ends at theta_i 60 deg: beyond, a program that reads it repeats the last angle" in spoken(out)
    assert "mostly a model" not in out
    assert "reflectance of the file: 0.5" in spoken(out)


def test_the_error_names_the_wings_and_the_worst_place(run, in_plane, tmp_path):
    code, out, err = run("convert", "scan.csv", "x.bsdf", "--to", "zemax", "--fill", "symmetry,lambert")
    assert code == 0, err
    text = spoken(out)
    assert "as the file reads now: rms error" in text
    assert "; lg RMSE " in text
    assert "; largest " in text
    assert "at 99 directions of the data" in text


def test_the_grid_of_another_file_is_filled_as_asked(run, in_plane, monkeypatch):
    """Most directions of the other file lie outside the scan: the model fills them, and then the grid."""
    monkeypatch.setattr("gonio.formats.rgl.layout.SIZE", 16)
    fill = ("--fill", "symmetry,ggx", "--weighting", "log")
    assert run("convert", "scan.csv", "other.bsdf", "--to", "rgl", *fill)[0] == 0
    code, _, err = run("convert", "scan.csv", "x.bsdf", "--to", "rgl", "--onto", "other.bsdf", *fill)
    assert code == 0, err
    found = read(in_plane / "x.bsdf")
    above = found["theta_r"].values <= 90
    assert np.isfinite(found["brdf"].values[..., above] if found["theta_r"].ndim == 3 else found["brdf"].values).all()


def test_advice_is_not_what_was_tried(run, in_plane):
    code, _, err = run("convert", "scan.csv", "x", "--to", "ssdd", "--fill", "symmetry")
    assert code == 1
    assert "symmetry does not reach them; add a model, as in --fill symmetry,MODEL" in err

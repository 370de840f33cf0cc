"""KAIST's Mueller tables: synthetic files; tests/test_rgl_peer.py holds them against Mitsuba 3."""

import numpy as np
import pytest

from gonio import Geometry, read
from gonio.door.tensor_file import Fields, write_fields
from gonio.files import FormatError
from gonio.formats import recognise
from gonio.formats.pbsdf import FORMAT
from gonio.measured.dataset import flatten
from samples import pbsdf as samples
from samples import rgl


@pytest.fixture
def path(tmp_path):
    out = tmp_path / "a.pbsdf"
    write_fields(out, samples.fields())
    return out


def test_layout(path):
    scan = read(path)
    stored = samples.fields()["M"]
    assert recognise(path) is FORMAT
    assert scan["brdf"].dims == ("wavelength", "theta_h", "theta_d", "phi_d")
    assert scan["wavelength"].values.tolist() == [450, 500, 550, 600, 650]
    assert scan["theta_h"].values.tolist() == [0, 20, 45, 85]
    assert scan["theta_d"].values.tolist() == [0, 30, 60, 88]
    assert scan["phi_d"].values.tolist() == [180, 270, 0, 90]
    where = {"wavelength": 1, "theta_h": 2, "theta_d": 1, "phi_d": 3}
    assert float(scan["brdf"].isel(where)) == stored[3, 1, 2, 1, 0, 0]
    element = scan["mueller"].isel(where | {"stokes_out": 2, "stokes_in": 1})
    assert float(element) == stored[3, 1, 2, 1, 2, 1]
    assert "left out the last phi_d, which is the first one again" in scan.attrs["history"]


def test_directions_have_these_half_vectors(path):
    flat = flatten(read(path).drop_vars("mueller").isel(wavelength=0, phi_d=slice(1, None)))
    g = Geometry.from_degrees(*(flat[a].values for a in ("theta_i", "theta_r", "phi")))
    good = np.isfinite(flat["brdf"].values)
    assert good.sum() > 10
    halves = np.degrees(np.arccos(np.clip(g.cos_alpha, -1, 1)))[good]
    assert set(np.round(halves, 3)) <= {0, 20, 45, 85}
    differences = np.degrees(np.arccos(np.clip(g.cos_beta, -1, 1)))[good]
    assert set(np.round(differences, 3)) <= {0, 30, 60, 88}


def test_values_stand_above_the_horizon_only(path):
    scan = read(path)
    above = (scan["theta_i"] <= 90 + 1e-9) & (scan["theta_r"] <= 90 + 1e-9)
    expected = above.broadcast_like(scan["brdf"]).transpose(*scan["brdf"].dims).values
    np.testing.assert_array_equal(np.isfinite(scan["brdf"].values), expected)
    assert not expected.all()


def test_nothing_is_copied(path):
    """The matrices are a view into the file; so is element 00 where the file marks what is below the horizon."""
    assert not read(path)["mueller"].values.flags.owndata
    scan = read(path)
    fields = samples.fields()
    below = ((scan["theta_i"] > 90) | (scan["theta_r"] > 90)).transpose("phi_d", "theta_d", "theta_h").values
    fields["M"][:-1][below] = np.nan
    write_fields(path, fields)
    assert not read(path)["brdf"].values.flags.owndata
    np.testing.assert_array_equal(read(path)["brdf"].values, scan["brdf"].values)


def test_azimuths_of_a_half_circle_stay(tmp_path):
    path = tmp_path / "a.pbsdf"
    write_fields(path, samples.VARIANTS["half"]())
    assert read(path)["phi_d"].values.tolist() == [0, 30, 60, 90, 120, 150]


def test_every_fault_names_the_field_and_its_byte(path):
    good = samples.fields()
    infinite = good["M"].copy()
    infinite[1, 1, 1, 1, 0, 0] = np.inf
    cases = [
        ("M", 0, "its shape is .*, not .* as the other fields say", {"theta_h": good["theta_h"][:, :3]}),
        ("M", 0, "element 00 is infinite", {"M": infinite}),
        ("M", 0, "every brdf value is zero or missing", {"M": 0 * good["M"]}),
        ("M", 0, "every brdf value is zero or missing", {"M": np.nan * good["M"]}),
        ("theta_d", 4, "a value is 30.0, outside 0 to 90 deg in radians", {"theta_d": np.float32([[0, 30, 60, 80]])}),
        ("phi_d", 8, "not above the one before", {"phi_d": np.float32([[0, 2, 1, 3, 4]])}),
        ("theta_h", 0, "not one row", {"theta_h": good["theta_h"].T}),
        ("theta_h", 4, "a value is nan", {"theta_h": np.float32([[0, np.nan, 0.5, 1]])}),
        ("wvls", 2, "not above the one before", {"wvls": np.uint16([450, 450, 550, 600, 650])}),
        ("wvls", 0, "float32 of shape", {"wvls": np.float32([450, 500, 550, 600, 650])}),
    ]
    for name, offset, message, changes in cases:
        write_fields(path, good | changes)
        with pytest.raises(FormatError, match=message) as caught:
            read(path)
        assert caught.value.where == f"byte {Fields(path).starts[name] + offset}", name


def test_the_two_formats_of_the_container_are_told_apart(path, tmp_path):
    for other in rgl.samples(tmp_path):
        assert recognise(other).name == "rgl"
        assert not FORMAT.recognises(other.read_bytes()[:4096])
    assert recognise(path).name == "pbsdf"

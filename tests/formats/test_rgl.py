"""RGL files: the real ones beside the project, synthetic ones of every variant, and files that gonio lays out."""

import math
import struct

import numpy as np
import pytest
import xarray as xr

from gonio import convert, read, write
from gonio.door.tensor_file import Fields, write_fields
from gonio.files import FormatError
from gonio.formats import recognise
from gonio.formats.rgl.adaptive import Warp
from gonio.formats.rgl.file import FORMAT, evaluate
from gonio.formats.rgl.layout import SIZE
from gonio.formats.rgl.scan import X, Y
from gonio.measured.dataset import flatten, make_scan
from samples import rgl as samples

SINGLE = 2**-23  # relative spacing of what the files store
REAL = ("cg_sunflower", "colodur_napoli_4f", "paper_white", "satin_rosaline")


@pytest.fixture(params=REAL)
def real(request, shared_scans):
    return shared_scans.parent / "files" / "rgl" / f"{request.param}_rgb.bsdf"


@pytest.fixture(params=samples.VARIANTS)
def synthetic(request, tmp_path):
    path = tmp_path / f"{request.param}.bsdf"
    write_fields(path, samples.VARIANTS[request.param]())
    return path


def brute_force(fields, turn, incidence, row, column):
    """theta_h [rad] and its azimuth of one node, by bisection of integrals of the bilinear density over fine steps."""
    density = np.asarray(fields["vndf"][turn, incidence], dtype=float)
    steps = 4000
    rows, columns = density.shape
    size = next(v for n, v in fields.items() if n in ("rgb", "spectra")).shape[-1]

    def line(y):
        low = min(int(y * (rows - 1)), rows - 2)
        share = y * (rows - 1) - low
        return (1 - share) * density[low] + share * density[low + 1]

    def place(heights, share):
        fine = np.linspace(0, 1, steps + 1)
        values = np.interp(fine, np.linspace(0, 1, len(heights)), heights)
        cumulated = np.concatenate([[0], np.cumsum(values[1:] + values[:-1])])
        return np.interp(share * cumulated[-1], cumulated, fine)

    y = place([line(v).dot(np.r_[0.5, np.ones(columns - 2), 0.5]) for v in np.linspace(0, 1, rows)], row / (size - 1))
    x = place(line(y), column / (size - 1))
    return x**2 * math.pi / 2, (2 * y - 1) * math.pi


def test_nodes_lie_where_the_density_says():
    """The warp of one slice against numerical integration; 4000 steps over 7 cells leave 1e-5 of the square."""
    fields = samples.VARIANTS["turned_rgb"]()
    x, y = Warp(fields["vndf"].reshape(-1, *fields["vndf"].shape[2:])).nodes((5, 5))
    for turn, incidence, row, column in ((0, 0, 1, 1), (1, 2, 3, 2), (4, 3, 2, 4), (3, 1, 0, 3)):
        theta_h, azimuth = brute_force(fields, turn, incidence, row, column)
        k = turn * 4 + incidence
        assert x[k, row, column] ** 2 * math.pi / 2 == pytest.approx(theta_h, abs=1e-4)
        assert (2 * y[k, row, column] - 1) * math.pi == pytest.approx(azimuth, abs=1e-4)


def test_reads_the_real_files(real):
    assert recognise(real) is FORMAT
    scan = read(real)
    assert scan["brdf"].dims == ("channel", "theta_i", Y, X)
    assert scan["channel"].values.tolist() == ["R", "G", "B"]
    assert scan["theta_i"].size == 8
    assert scan["theta_i"].values[0] == 0
    assert scan["theta_i"].values[-1] == pytest.approx(90, abs=1e-5)
    assert scan.attrs["stored"] == "BRDF x cos(theta_r)"
    assert scan.attrs["symmetry"] == "isotropic"
    grazing = int((scan["theta_r"] == 90.001).sum())
    assert grazing > 0
    assert f"{grazing} nodes beyond 89.99 deg count as below the horizon" in scan.attrs["history"]
    assert not ((scan["theta_r"] > 89.99) & (scan["theta_r"] < 90.001)).any()
    known = (scan["theta_r"] <= 89.99).broadcast_like(scan["brdf"]).transpose(*scan["brdf"].dims)
    np.testing.assert_array_equal(np.isfinite(scan["brdf"].values), known.values)


def test_the_description_is_provenance(shared_scans):
    path = shared_scans.parent / "files" / "rgl" / "paper_white_rgb.bsdf"
    assert read(path).attrs["provenance"] == "White A4 paper (160 gsm)"


def test_a_real_file_is_written_back_byte_for_byte(real, tmp_path):
    out = tmp_path / "again.bsdf"
    FORMAT.write(read(real), out)
    assert out.read_bytes() == real.read_bytes()


def test_conversion_of_a_real_file_to_its_own_format_is_exact(shared_scans, tmp_path):
    real = shared_scans.parent / "files" / "rgl" / "paper_white_rgb.bsdf"
    out = tmp_path / "again.bsdf"
    convert(read(real), out, to="rgl")
    assert out.read_bytes() == real.read_bytes()


def test_a_real_file_survives_a_stay_in_netcdf(real, tmp_path):
    write(read(real), tmp_path / "a.nc")
    FORMAT.write(read(tmp_path / "a.nc"), tmp_path / "again.bsdf")
    assert (tmp_path / "again.bsdf").read_bytes() == real.read_bytes()


def test_every_variant_is_written_back(synthetic, tmp_path):
    out = tmp_path / "again.bsdf"
    scan = read(synthetic)
    FORMAT.write(scan, out)
    again, first = Fields(out).arrays, Fields(synthetic).arrays
    assert again.keys() == first.keys()
    for name, values in first.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)
    xr.testing.assert_identical(read(out).drop_attrs(), scan.drop_attrs())


def test_what_the_variants_are_read_as(tmp_path):
    found = {path.stem: read(path) for path in samples.samples(tmp_path)}
    sizes = {name: dict(zip(scan["brdf"].dims, scan["brdf"].shape, strict=True)) for name, scan in found.items()}
    grid = {Y: 5, X: 5}
    assert sizes["isotropic_rgb"] == {"channel": 3, "theta_i": 4, **grid}
    assert sizes["isotropic_spectral"] == {"wavelength": 4, "theta_i": 4, **grid}
    assert sizes["turned_rgb"] == {"channel": 3, "phi_i": 5, "theta_i": 4, **grid}
    assert sizes["turned_spectral"] == {"wavelength": 2, "phi_i": 4, "theta_i": 4, **grid}
    assert sizes["grey"] == {"theta_i": 4, **grid}
    assert found["isotropic_spectral"]["wavelength"].values.tolist() == [450.0, 500.5, 610.0, 700.0]
    assert found["isotropic_rgb"]["theta_i"].values.tolist() == [0.0, 31.0, 64.0, 88.0]
    assert found["turned_rgb"]["phi_i"].values.tolist() == [-180.0, -100.0, 0.0, 70.0, 180.0]
    assert found["turned_rgb"].attrs["symmetry"] == "anisotropic"


def test_nodes_evaluate_to_themselves(synthetic):
    """Except at the pole and the seam of the half vector, and of phi_i, where several nodes are one direction."""
    scan = read(synthetic)
    inner = scan.isel({Y: slice(1, -1), X: slice(1, None)} | ({"phi_i": slice(-1)} if "phi_i" in scan.dims else {}))
    flat = flatten(inner)
    one = flatten(inner.isel({d: 0 for d in scan["brdf"].dims if d in ("channel", "wavelength")}))
    phi_i = one["phi_i"].values if "phi_i" in one.coords else 0.0
    found = evaluate(scan, one["theta_i"].values, one["theta_r"].values, one["phi"].values, phi_i)
    np.testing.assert_allclose(
        found.ravel(), flat["brdf"].values, rtol=1e-5
    )  # incidences are single precision, written short


def test_evaluate_gives_nothing_below_the_horizon_or_outside_the_incidences(tmp_path):
    path = tmp_path / "a.bsdf"
    write_fields(path, samples.VARIANTS["isotropic_rgb"]() | {"theta_i": np.float32([0.2, 0.4, 0.6, 0.8])})
    scan = read(path)
    found = evaluate(scan, [20, 20, 20, 5, 60], [30, 90, 91, 30, 30], [10] * 5)
    assert np.isfinite(found).tolist() == [[True, False, False, False, False]] * 3


def test_one_channel_alone_is_evaluated(tmp_path):
    path = tmp_path / "a.bsdf"
    write_fields(path, samples.VARIANTS["isotropic_rgb"]())
    scan = read(path)
    angles = samples.directions(20)
    np.testing.assert_array_equal(evaluate(scan.isel(channel=1), *angles), evaluate(scan, *angles)[1])


def test_changed_values_are_what_is_evaluated_and_written(tmp_path):
    path, out = tmp_path / "a.bsdf", tmp_path / "b.bsdf"
    write_fields(path, samples.VARIANTS["turned_spectral"]())
    scan = read(path)
    doubled = scan.assign(brdf=(2 * scan["brdf"]).assign_attrs(units="sr-1"))
    angles = samples.directions(200, steepest=60)
    ratio = evaluate(doubled, *angles) / evaluate(scan, *angles)
    np.testing.assert_allclose(ratio, 2, rtol=1e-12)
    FORMAT.write(doubled, out)
    np.testing.assert_allclose(read(out)["brdf"], doubled["brdf"], rtol=2 * SINGLE)
    np.testing.assert_array_equal(Fields(out).arrays["vndf"], Fields(path).arrays["vndf"])


def test_masked_nodes_are_gaps_between_directions_too(tmp_path):
    path = tmp_path / "a.bsdf"
    write_fields(path, samples.VARIANTS["isotropic_rgb"]())
    scan = read(path)
    gone = scan.assign(brdf=scan["brdf"].where(scan["theta_i"] < 50).assign_attrs(units="sr-1"))
    found = evaluate(gone, [20, 50], [10, 10], [100, 100])
    assert np.isfinite(found).tolist() == [[True, False]] * 3


def test_the_twins_agree(shared_scans):
    """A renderer's values on a 1 deg grid: equal but at the mirror direction itself, where the azimuth of the half
    vector is what rounding made it and the file has a value for each.
    """
    for name in REAL:
        scan = read(shared_scans.parent / "files" / "rgl" / f"{name}_rgb.bsdf")
        twin = read(shared_scans / f"rgl_{name}.csv")
        found = evaluate(scan, twin["theta_i"].values, twin["theta_r"].values, twin["phi"].values)
        channel = np.searchsorted(["B", "G", "R"], twin["channel"].values)
        found = found[::-1][channel, np.arange(twin.sizes["direction"])]
        mirror = (twin["theta_r"].values == twin["theta_i"].values) & (twin["phi"].values == 180)
        error = np.abs(found - twin["brdf"].values)
        digits = 0.6e-6 * np.abs(twin["brdf"].values) * 10  # six digits are printed
        rounding = 1e-5 * np.abs(twin["brdf"].values).max()  # as in tests/test_rgl_peer.py
        assert (error <= digits + rounding)[~mirror].all(), name
        assert mirror.sum() == 18
        assert (error[mirror] <= 0.08 * twin["brdf"].values[mirror]).all(), name


@pytest.mark.parametrize("name", samples.LAID_OUT)
def test_laid_out_scans_keep_their_values(name, tmp_path):
    path = tmp_path / "a.bsdf"
    scan = samples.LAID_OUT[name]()
    FORMAT.write(scan, path)
    found = read(path)
    for angle in ("theta_i", "theta_r", "phi", *(["phi_i"] if "turned" in name else [])):
        np.testing.assert_array_equal(found[angle], scan[angle])
    kept = found["theta_r"] <= 89.99
    dims = found["brdf"].dims
    expected = scan["brdf"].where(kept).transpose(*dims)
    np.testing.assert_allclose(found["brdf"].values, expected.values, rtol=SINGLE)
    stored = Fields(path).arrays
    for tensor, value in (("sigma", 1.0), ("ndf", 4.0), ("jacobian", 1)):
        assert (stored[tensor] == value).all(), tensor  # constant in azimuth, and 1 with the jacobian and without
    assert stored["luminance"].min() > 0
    assert stored["luminance"].shape[-1] == SIZE


@pytest.mark.parametrize("name", ["laid_out_rgb", "laid_out_turned_rgb"])
def test_laid_out_scans_are_smooth_between_the_nodes(name, tmp_path):
    """Against the function itself: a few per cent, from steps of 20 deg in theta_i and 60 to 100 in phi_i."""
    path = tmp_path / "a.bsdf"
    FORMAT.write(samples.LAID_OUT[name](), path)
    angles = samples.directions(2000, steepest=80)
    expected = samples.lobe(*angles[:3], angles[3] if "turned" in name else 0.0)
    error = evaluate(read(path), *angles)[0] / expected - 1
    assert np.sqrt(np.mean(error**2)) < (0.1 if "turned" in name else 0.02)


def test_an_anisotropic_layout_goes_round_the_whole_circle():
    ones = np.ones(3)
    onto = FORMAT.layout(make_scan(30 * ones, 0 * ones, ones, 0 * ones, phi_i=[10.0, 190.0, 270.0]))
    assert {-180, -170, -90, 10, 180} <= set(onto["phi_i"].values.tolist())
    assert np.diff(onto["phi_i"].values).max() <= 15 + 1e-5
    assert onto["theta_i"].values.tolist() == [30.0]


def test_many_incidence_angles_become_even_ones():
    angles = np.linspace(0, 89.5, 200)
    onto = FORMAT.layout(make_scan(angles, angles, angles))
    assert onto["theta_i"].size == 31
    assert onto["theta_i"].values[[0, -1]].tolist() == [0, 89]


def test_channels_of_another_order_are_stored_in_that_of_the_file(tmp_path):
    scan, path = samples.laid_out(), tmp_path / "a.bsdf"
    FORMAT.write(scan.isel(channel=[2, 0, 1]), path)
    again = read(path)
    assert again["channel"].values.tolist() == ["R", "G", "B"]
    ordered = scan["brdf"].sel(channel=["R", "G", "B"]).transpose(*again["brdf"].dims)
    np.testing.assert_allclose(again["brdf"].values, ordered.values, rtol=1e-7)  # the file holds single precision


def test_what_cannot_be_written_is_refused(tmp_path):
    path = tmp_path / "a.bsdf"
    scan = samples.laid_out()
    cases = {
        "no tensor_theta_i; use gonio.convert": make_scan([10.0], [10.0], [0.1]),
        "channels R, G and B, not X, Y, Z": scan.assign_coords(channel=["X", "Y", "Z"]),
        "R, G and B together, not G alone": scan.isel(channel=1),
        "no gaps": scan.assign(brdf=scan["brdf"].where(scan["theta_r"] > 20).assign_attrs(units="sr-1")),
        "flatten it": scan.isel(theta_i=slice(2)),
        "values beyond 3e38": scan.assign(brdf=(1e39 * scan["brdf"]).assign_attrs(units="sr-1")),
    }
    for message, case in cases.items():
        with pytest.raises(ValueError, match=message):
            FORMAT.write(case, path)
    assert not path.exists()


def damaged(tmp_path, **changes):
    path = tmp_path / "damaged.bsdf"
    fields = samples.VARIANTS["isotropic_spectral"]() | changes
    write_fields(path, {name: values for name, values in fields.items() if values is not None})
    return path


def test_every_fault_names_the_field_and_its_byte(tmp_path):
    good = samples.VARIANTS["isotropic_spectral"]()
    infinite = good["spectra"].copy()
    infinite[0, 1, 2, 3, 4] = np.inf
    negative = good["vndf"].copy()
    negative[0, 0, 0, 3] = -1
    blank = good["vndf"].copy()
    blank[0, 2] = 0
    cases = [
        ("spectra", 4 * (4 * 25 + 2 * 25 + 3 * 5 + 4), "a value is inf, not finite", {"spectra": infinite}),
        ("spectra", 0, "every brdf value is zero", {"spectra": 0 * good["spectra"]}),
        ("spectra", 0, "it has 4 wavelengths, and the field wavelengths 2", {"wavelengths": np.float32([400, 500])}),
        ("wavelengths", 8, "not above the one before", {"wavelengths": np.float32([400, 500, 500, 600])}),
        ("vndf", 12, "a value is -1.0, not a finite positive number", {"vndf": negative}),
        ("vndf", 2 * 4 * 48, "slice 2 is zero everywhere", {"vndf": blank}),
        ("vndf", 0, "it holds .* incidences where phi_i and theta_i have", {"vndf": good["vndf"][:, :3]}),
        ("vndf", 0, "is no grid", {"vndf": good["vndf"][..., :1]}),
        ("theta_i", 4, "outside 0 to pi/2", {"theta_i": np.float32([0, 30, 60, 80])}),
        ("theta_i", 8, "not above the one before", {"theta_i": np.float32([0, 0.5, 0.5, 0.7])}),
        ("theta_i", 0, "a value is nan", {"theta_i": np.float32([np.nan, 0.5, 0.6, 0.7])}),
        ("phi_i", 0, "outside -pi to pi", {"phi_i": np.float32([4])}),
        ("sigma", 0, "float64 of shape .* where 2 dimensions of float32", {"sigma": np.ones((2, 2))}),
        ("luminance", 0, "its shape is", {"luminance": good["luminance"][..., :3]}),
    ]
    for name, offset, message, changes in cases:
        path = damaged(tmp_path, **changes)
        with pytest.raises(FormatError, match=message) as caught:
            FORMAT.read(path)
        assert caught.value.where == f"byte {Fields(path).starts[name] + offset}", name
    with pytest.raises(FormatError, match="byte 0: there is no field ndf; there are 'version'"):
        FORMAT.read(damaged(tmp_path, ndf=None))


def test_an_unknown_field_is_left_out_with_a_word(tmp_path):
    scan = read(damaged(tmp_path, temperature=np.float32([20])))
    assert "left out fields that gonio does not know: 'temperature'" in scan.attrs["history"]


def test_a_grey_file_whose_channels_differ_is_refused(tmp_path):
    path = tmp_path / "a.bsdf"
    write_fields(path, samples.VARIANTS["isotropic_rgb"]() | {"grey": np.ones(1, dtype=np.uint8)})
    with pytest.raises(FormatError, match="said to be grey, and its channels differ"):
        read(path)


def test_a_scan_without_channels_is_written_grey(tmp_path):
    path = tmp_path / "a.bsdf"
    FORMAT.write(samples.laid_out().isel(channel=0, drop=True), path)
    stored = Fields(path).arrays["rgb"]
    assert (stored == stored[:, :, :1]).all()
    assert read(path)["brdf"].dims == ("theta_i", Y, X)


def test_an_empty_description_stays_empty(tmp_path):
    path = tmp_path / "a.bsdf"
    FORMAT.write(samples.laid_out().assign_attrs(provenance=""), path)
    assert Fields(path).arrays["description"].shape == (0,)
    assert read(path).attrs["provenance"] == ""


def test_a_single_wavelength_is_written_as_one(tmp_path):
    path = tmp_path / "a.bsdf"
    FORMAT.write(samples.laid_out(wavelengths=(450.0, 550.0)).isel(wavelength=1), path)
    assert read(path)["wavelength"].values.tolist() == [550.0]


def test_sizes_that_the_file_does_not_have(tmp_path):
    path = tmp_path / "a.bsdf"
    content = bytearray(damaged(tmp_path).read_bytes())
    at = content.index(b"phi_i") + 5 + 2 + 1 + 8
    for size in (2**62, 2**63, 2**32, 0):
        content[at : at + 8] = struct.pack("<Q", size)
        path.write_bytes(bytes(content))
        with pytest.raises(FormatError, match=r"byte \d+: .*phi_i"):
            FORMAT.read(path)


def test_other_containers_are_not_taken_for_one(tmp_path):
    for head in (b"tensor_file\0", b"vndf", b"Symmetry PlaneSymmetrical"):
        assert not FORMAT.recognises(head)

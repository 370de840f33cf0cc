"""SSDD files: against a second reading by the index formula of the specification, and numbers worked out by hand."""

import math
import struct
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.measured.coordinates import SYSTEMS, grid
from gonio.measured.dataset import make_scan
from gonio.resampling.resample import resample
from samples import ssdd

DIRECTION = {  # PARAM0, PARAM1, PARAM2, PARAM3 of each system as gonio's own axes
    "spherical": ("theta_i", "phi_i", "theta_r", "phi"),
    "specular": ("theta_i", "phi_i", "theta_s", "phi_s"),
    "half_difference": ("theta_h", "phi_h", "theta_d", "phi_d"),
}


def saved(folder: Path, text: str | bytes) -> Path:
    path = folder / "file.ssdd"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def table(system: str, lists: list[list[float]], colours: str = "monochrome", width: int = 1) -> str:
    """A file whose values count up in the file's order: 1, 2, 3, .."""
    count = math.prod(map(len, lists))
    rows = [" ".join(str(1 + width * k + c) for c in range(width)) for k in range(count)]
    named = [f"PARAM{k}_LIST {' '.join(map(str, v))}" for k, v in enumerate(lists)]
    head = ["VERSION 0.3", "DATA_TYPE brdf", f"COLOR_MODEL {colours}", f"PARAM_TYPE {system}_coordinate_system"]
    return "\n".join([*head, *named, "DATA ascii", *rows, ""])


@pytest.mark.parametrize("system", DIRECTION)
@pytest.mark.parametrize(("colours", "width"), [("monochrome", 1), ("rgb", 3), ("xyz", 3)])
def test_every_value_lies_where_the_index_formula_says(system, colours, width, tmp_path):
    lists = [[0, 20, 40], [0, 90, 180, 270], [5, 30], [0, 90, 180, 270]]
    scan = read(saved(tmp_path, table(system, lists, colours, width)))
    seen = 0
    for i0, i1, i2, i3 in np.ndindex(3, 4, 2, 4):
        index = i0 + 3 * i1 + 3 * 4 * i2 + 3 * 4 * 2 * i3
        params = [lists[0][i0], lists[1][i1], lists[2][i2], lists[3][i3]]
        if system == "spherical":
            params[3] = (params[3] - params[1]) % 360  # the file's azimuth of the reflected light is absolute
        node = scan.sel(dict(zip(DIRECTION[system], params, strict=True)))
        if node["theta_r"] > 90 or node["theta_i"] > 90:
            assert np.isnan(node["brdf"]).all()
            continue
        expected = 1 + width * index + np.arange(width)
        np.testing.assert_array_equal(np.atleast_1d(node["brdf"].values), expected)
        seen += 1
    assert seen > 40
    if width > 1:
        assert "".join(scan["channel"].values) == colours.upper()
    assert scan["mode"].item() == "reflection"
    assert scan["brdf"].attrs["units"] == "sr-1"


def test_binary_is_float32_little_endian(tmp_path):
    head = "VERSION 0.3\nDATA_TYPE btdf\nCOLOR_MODEL spectrum\nWAVELENGTH_LIST 500 600\n"
    head += "PARAM_TYPE spherical_coordinate_system\nPARAM0_LIST 10\nPARAM2_LIST 20 30\nPARAM3_LIST 180\nDATA binary\n"
    scan = read(saved(tmp_path, head.encode() + struct.pack("<4f", 0.1, 0.2, 0.3, 0.4)))
    expected = np.array([[0.1, 0.3], [0.2, 0.4]], dtype=np.float32).astype(float)
    np.testing.assert_array_equal(scan["brdf"].squeeze().values, expected)
    assert scan["wavelength"].values.tolist() == [500, 600]
    assert scan["wavelength"].attrs["units"] == "nm"
    assert scan["mode"].item() == "transmission"


def test_reductions_of_the_half_angles_are_filled_in(tmp_path):
    def phi_d(reduction, nodes):
        text = table("half_difference", [[0], [0], [30], nodes]).replace("PARAM1_LIST 0\n", "")
        scan = read(saved(tmp_path, text.replace("PARAM0", f"REDUCTION_TYPE {reduction}\nPARAM0")))
        return dict(zip(scan["phi_d"].values.tolist(), scan["brdf"].values.ravel().tolist(), strict=True))

    both = "bilateral_symmetry reciprocity"
    assert phi_d(both, [0, 30, 90]) == {0: 1, 30: 2, 90: 3, 150: 2, 180: 1}
    assert phi_d("reciprocity", [0, 90, 180]) == {0: 1, 90: 2, 180: 3, 270: 2, 360: 3}
    assert phi_d("reciprocity", [0, 45, 90, 135]) == {0: 1, 45: 2, 90: 3, 135: 4}  # gonio's grids have the period
    assert phi_d("bilateral_symmetry", [0, 45, 180]) == {0: 1, 45: 2, 180: 3}  # and mirror a half


def test_distorted_angles_lead_from_the_mirror_direction_to_the_rim(tmp_path):
    text = table("distorted_spherical", [[30], [0], [0, 45, 90], [0, 90, 180]]).replace("PARAM1_LIST 0\n", "")
    scan = read(saved(tmp_path, text))
    by_value = {int(v): k for k, v in enumerate(scan["brdf"].values)}
    angles = [(scan["theta_r"].values[by_value[n]], scan["phi"].values[by_value[n]]) for n in range(1, 10)]
    expected = [(30, 180), (30, 0), (90, 0)]  # azimuth 0: half way to the rim is 45 - 15, towards the light
    expected += [(30, 180), (math.hypot(15, 45), 180 - math.degrees(math.atan2(45, 15))), (90, 90)]
    expected += [(30, 180), (60, 180), (90, 180)]
    np.testing.assert_allclose(np.array(angles)[:, 0], np.array(expected)[:, 0], atol=1e-9)
    turn = (np.array(angles)[:, 1] - np.array(expected)[:, 1] + 180) % 360 - 180
    np.testing.assert_allclose(turn, 0, atol=1e-9)


def test_offsets_move_the_centre(tmp_path):
    text = table("specular", [[0, 60], [0], [0, 10], [0, 180]]).replace("PARAM1_LIST 0\n", "")
    scan = read(saved(tmp_path, text.replace("DATA ascii", "PARAM4_LIST 0 -24.8\nDATA ascii")))
    by_value = {int(v): float(t) for v, t in zip(scan["brdf"].values, scan["theta_r"].values, strict=True)}
    assert [by_value[n] for n in (1, 2, 4, 8)] == pytest.approx([0, 35.2, 25.2, 45.2], abs=1e-9)


@pytest.mark.parametrize("name", ["specular", "turned", "half", "both", "binary"])
def test_round_trip_is_exact(name, tmp_path):
    path = next(p for p in ssdd.samples(tmp_path) if p.stem == name)
    scan = read(path)
    again = tmp_path / "again.ssdd"
    assert write(scan, again).name == "ssdd"
    found = read(again.rename(tmp_path / "again.whatever"))
    xr.testing.assert_equal(found, scan)
    assert found.attrs["provenance"] == scan.attrs["provenance"]


def test_two_modes_on_one_grid_are_a_dimension_and_specular_tables_are_named(tmp_path):
    scan = read(next(p for p in ssdd.samples(tmp_path) if p.stem == "both"))
    assert scan["brdf"].dims == ("mode", "channel", "theta_i", "theta_s", "phi_s")
    assert scan["mode"].values.tolist() == ["reflection", "transmission"]
    rows = [list(map(float, line.split())) for line in ssdd.VARIANTS["both.ssdd"].splitlines() if line[:1].isdigit()]
    assert scan["brdf"].sel(mode="transmission", channel="B", theta_i=45, theta_s=0, phi_s=0).item() == rows[18 + 1][2]
    assert "specular reflectance is left out" in scan.attrs["history"]


def test_blocks_that_differ_are_flat(tmp_path):
    scan = read(next(p for p in ssdd.samples(tmp_path) if p.stem == "refracted"))
    assert scan["brdf"].dims == ("direction",)
    assert set(scan["channel"].values.tolist()) == {"R", "G", "B", "mono"}
    assert set(zip(scan["mode"].values.tolist(), scan["channel"].values.tolist(), strict=True)) == {
        ("transmission", "mono"),
        *(("reflection", c) for c in "RGB"),
    }
    assert "different colour models" in scan.attrs["history"]


def test_a_file_of_specular_tables_alone(tmp_path):
    scan = read(next(p for p in ssdd.samples(tmp_path) if p.stem == "mirror"))
    assert scan["brdf"].attrs["units"] == "a.u."
    assert scan.attrs["quantity"] == "specular transmittance"
    rows = [list(map(float, line.split())) for line in ssdd.VARIANTS["mirror.ssdd"].splitlines() if line[:1].isdigit()]
    np.testing.assert_array_equal(scan["brdf"].values.reshape(3, 3), np.array(rows).T)
    np.testing.assert_array_equal(scan["theta_r"].values[:3], [0, 30, 60])


def dense(system: str, **axes) -> xr.Dataset:
    directions = grid(system, **axes)
    own = [a for a in SYSTEMS[system].axes if a in axes]
    values = np.random.default_rng(1).uniform(0.1, 1, [len(axes[a]) for a in own])
    scan = directions.assign(brdf=(own, values, {"units": "sr-1"}))
    below = (scan["theta_r"] > 90 + 1e-9) | (scan["theta_i"] > 90 + 1e-9)
    scan["brdf"] = scan["brdf"].where(~below).transpose(*own).assign_attrs(units="sr-1")
    return scan.assign_attrs(provenance="", history="")


@pytest.mark.parametrize(
    "scan",
    [
        dense("spherical", theta_i=[0, 30, 60.5], theta_r=[0, 45, 90], phi=[0, 90, 180]),
        dense("spherical", theta_i=[0, 30], theta_r=[0, 45], phi=[0, 120, 240], phi_i=[0, 120, 240]),
        dense("specular", theta_i=[0, 1 / 3], theta_s=[0, 45, 110], phi_s=np.arange(0, 361, 45.0)),
        dense("specular", theta_i=[0, 30], theta_s=[0, 45], phi_s=np.arange(0, 361, 45.0), phi_i=[0, 77]),
        dense("half-difference", theta_h=[0, 30, 80], theta_d=[0, 45, 80], phi_d=[0, 45, 90, 135]),
        dense("half-difference", theta_h=[0, 30], theta_d=[0, 45], phi_d=[0, 90, 180], phi_h=[0, 10]),
    ],
    ids=lambda s: "-".join(map(str, s["brdf"].dims)),
)
def test_grids_of_other_formats_are_written_as_they_are(scan, tmp_path):
    layout = formats()["ssdd"].layout(scan)
    assert layout.equals(scan.drop_vars("brdf"))
    write(scan, tmp_path / "a.ssdd")
    xr.testing.assert_equal(read(tmp_path / "a.ssdd").drop_vars("mode"), scan)


def test_large_float32_tables_are_binary_and_others_text(tmp_path):
    scan = dense(
        "specular", theta_i=np.arange(0, 81, 10.0), theta_s=np.arange(0, 91, 2.0), phi_s=np.arange(0, 361, 10.0)
    )
    single = scan.assign(brdf=scan["brdf"].astype(np.float32).astype(float).assign_attrs(units="sr-1"))
    assert single["brdf"].size > 10_000
    for given, mode in ((scan, b"DATA ascii"), (single, b"DATA binary")):
        path = tmp_path / f"{mode[-5:].decode()}.ssdd"
        write(given, path)
        assert mode in path.read_bytes()
        xr.testing.assert_equal(read(path).drop_vars("mode"), given)


def test_a_scattered_scan_gets_a_grid_about_the_mirror(tmp_path):
    theta_r = np.arange(0, 71, 10.0)
    scan = make_scan(np.full(8, 40.0), theta_r, np.full(8, 0.25), np.full(8, 180.0))
    on_grid = resample(scan, formats()["ssdd"].layout(scan))
    assert on_grid["brdf"].dims == ("theta_i", "theta_s", "phi_s")
    there = on_grid["brdf"].notnull() & (on_grid["theta_r"] > 1e-6)
    assert on_grid["theta_r"].where(there).max() == pytest.approx(70)
    assert set(on_grid["phi"].where(there).values[there.values].round(6)) == {180.0}
    with pytest.raises(ValueError, match="gaps"):
        write(on_grid, tmp_path / "a.ssdd")
    write(on_grid.assign(brdf=on_grid["brdf"].fillna(0.25).assign_attrs(units="sr-1")), tmp_path / "a.ssdd")
    assert np.nanmax(read(tmp_path / "a.ssdd")["brdf"]) == np.nanmin(read(tmp_path / "a.ssdd")["brdf"]) == 0.25


@pytest.mark.parametrize("suffix", [".ssdd", ".ddr", ".astm"])
def test_remarks_that_no_text_can_hold_are_cleaned(suffix, tmp_path):
    scan = dense("specular", theta_i=[0, 30], theta_s=[0, 45], phi_s=[0, 90, 180])
    write(scan.assign_attrs(provenance="\0\nsteel\x1b[0m, 2 mm \n"), tmp_path / f"a{suffix}")
    assert read(tmp_path / f"a{suffix}").attrs["provenance"] == "steel[0m, 2 mm"


def test_what_a_file_cannot_say_is_refused(tmp_path):
    scan = dense("specular", theta_i=[0, 30], theta_s=[0, 45], phi_s=[0, 90, 180])
    relative = scan.assign(brdf=scan["brdf"].assign_attrs(units="a.u."))
    for given, what in [
        (relative, "calibrate"),
        (scan.assign_coords(channel="vis"), "channels R, G, B"),
        (scan.expand_dims(side=["front", "back"]), "sets along"),
        (make_scan([10.0], [10.0], [1.0]), r"gonio\.convert"),
        (dense("spherical", theta_i=[0], theta_r=[0, 45], phi=[0, 120, 240], phi_i=[0, 50]), "shift with phi_i"),
    ]:
        with pytest.raises(ValueError, match=what):
            write(given, tmp_path / "a.ssdd")
    assert not (tmp_path / "a.ssdd").exists()


GOOD = table("specular", [[0, 30], [0], [0, 45], [0, 90, 180]])
DEFECTS = [
    ("VERSION 0.3", "VERSION x", "line 1", "VERSION and a number"),
    ("brdf", "bsdf", "line 2", "DATA_TYPE is 'bsdf'"),
    ("monochrome", "grey", "line 3", "COLOR_MODEL is 'grey'"),
    ("COLOR_MODEL monochrome\n", "", "line 8", "no COLOR_MODEL"),
    ("monochrome", "spectrum", "line 9", "without WAVELENGTH_LIST"),
    ("specular_coo", "polar_coo", "line 4", "PARAM_TYPE is"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST 30 0", "line 5", "do not ascend"),
    ("PARAM3_LIST 0 90", "PARAM3_LIST 0 1e-320", "line 8", "do not ascend by 1e-09"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST 0 nan", "line 5", "not a finite number"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST 0 3,5", "line 5", "decimal points"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST 0 -1", "line 5", "do not ascend"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST -1 30", "line 5", "outside 0 to 360"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST 0 91", "line 9", "beyond 90"),
    ("PARAM0_LIST 0 30", "PARAM0_LIST", "line 5", "empty"),
    ("PARAM0_LIST 0 30\n", "", "line 8", "no PARAM0_LIST"),
    ("PARAM0_LIST", "REDUCTION_TYPE reciprocity\nPARAM0_LIST", "line 10", "belongs to half_difference"),
    ("PARAM3_LIST 0 90 180", "REDUCTION_TYPE bilateral_symmetry\nPARAM3_LIST 0 90 200", "line 10", "beyond the 180"),
    ("DATA ascii", "PARAM4_LIST 0\nDATA ascii", "line 10", "as many angles"),
    ("DATA ascii", "DATA text", "line 9", "DATA is 'text'"),
    ("\n12\n", "\n", "line 20", "the file ends, in line 12 of the 12"),
    ("\n12\n", "\n12\n13\n", "line 22", "'13' where an entry"),
    ("\n5\n", "\n5 6\n", "line 14", "2 values where a colour has 1"),
    ("\n5\n", "\n1e999\n", "line 14", "not a finite number"),
    ("DATA ascii", "DATA binary", f"byte {GOOD.index('DATA ascii') + len('DATA binary ')}", "needs 48 bytes"),
    ("DATA_TYPE brdf", "", "line 3", "COLOR_MODEL monochrome"),
]


@pytest.mark.parametrize(("old", "new", "where", "what"), DEFECTS, ids=[d[3][:24] for d in DEFECTS])
def test_defects_are_named_with_their_place(old, new, where, what, tmp_path):
    assert old in GOOD
    with pytest.raises(FormatError, match=what) as error:
        formats()["ssdd"].read(saved(tmp_path, GOOD.replace(old, new, 1)))
    assert error.value.where == where
    assert "\n" not in str(error.value)


def test_promises_beyond_the_file_are_refused_before_they_are_kept(tmp_path):
    """A list of 10^5 angles in each of four places promises 10^20 values."""
    many = " ".join(str(k / 2000) for k in range(100_000))
    text = GOOD.replace("PARAM0_LIST 0 30", f"PARAM0_LIST {many}").replace("PARAM2_LIST 0 45", f"PARAM2_LIST {many}")
    with pytest.raises(FormatError, match="more than") as error:
        formats()["ssdd"].read(saved(tmp_path, text))
    assert error.value.where == "line 9"


def test_binary_values_that_are_no_numbers_are_named_with_their_byte(tmp_path):
    head = GOOD[: GOOD.index("DATA ascii")].encode() + b"DATA binary\n"
    values = np.ones(12, dtype="<f4")
    for bits in (0x7F800000, 0x7FC00000, 0x7F800001):  # infinity, NaN, and a NaN that asks for a signal
        values.view("<u4")[3] = bits
        with pytest.raises(FormatError, match=r"a value is (inf|nan)") as error:
            formats()["ssdd"].read(saved(tmp_path, head + values.tobytes()))
        assert error.value.where == f"byte {len(head) + 12}"
    values[:] = 0
    with pytest.raises(FormatError, match="every brdf value is zero"):
        formats()["ssdd"].read(saved(tmp_path, head + values.tobytes()))


def test_a_block_twice_is_refused(tmp_path):
    with pytest.raises(FormatError, match="a second block brdf") as error:
        formats()["ssdd"].read(saved(tmp_path, GOOD + GOOD.partition("\n")[2]))
    assert error.value.where == "line 22"


def test_found_by_content(tmp_path):
    for line_end in ("\n", "\r\n", "\r"):
        path = saved(tmp_path, "\ufeff# a remark\n".replace("\n", line_end) + GOOD.replace("\n", line_end))
        assert recognise(path).name == "ssdd"
        assert read(path).attrs["provenance"] == "a remark"
    for head in (b"VERSION 0.3\nSource Measured\n", b"VERSION 2\nDATA_TYPE brdf\n", b"# VERSION 0.3\nDATA_TYPE brdf\n"):
        assert not formats()["ssdd"].recognises(head)

"""ALTA's files: every parametrisation against vectors by its definition, round trips, intervals, and damage."""

from math import acos, cos, hypot, sin, sqrt

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats import formats, recognise
from gonio.measured.dataset import geometry, make_scan
from samples import alta, alta_binary

TEXT, BINARY = formats()["alta"], formats()["alta-binary"]
HEAD = "#DIM 3 1\n#PARAM_IN  ISOTROPIC_TV_TL_DPHI\n#PARAM_OUT INV_STERADIAN\n"
ROW = "0.5 0.25 3 0.125\n"


def written(tmp_path, content, name="scan.alta"):
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def polar(theta, phi):
    return np.array([sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)])


def about_half(theta_h, phi_h, theta_d, phi_d):
    """V and L: V is the difference vector turned by theta_H about y and phi_H about z, L its image in H."""
    x, y, z = polar(theta_d, phi_d)
    x, z = x * cos(theta_h) + z * sin(theta_h), z * cos(theta_h) - x * sin(theta_h)
    x, y = x * cos(phi_h) - y * sin(phi_h), x * sin(phi_h) + y * cos(phi_h)
    view, half = np.array([x, y, z]), polar(theta_h, phi_h)
    return view, 2 * (view @ half) * half - view


def projected(theta_l, a, b):
    theta = hypot(a, b)
    return np.array([a / theta * sin(theta), b / theta * sin(theta), cos(theta)]), polar(theta_l, 0)


DEFINITIONS = {
    "SPHERICAL_TL_PL_TV_PV": lambda a, b, c, d: (polar(c, d), polar(a, b)),
    "ISOTROPIC_TV_TL_DPHI": lambda a, b, c: (polar(a, 0), polar(b, c)),
    "ISOTROPIC_TL_TV_PROJ_DPHI": projected,
    "ISOTROPIC_TV_PROJ_DPHI": lambda a, b: projected(0, a, b),
    "RUSIN_TH_PH_TD_PD": about_half,
    "RUSIN_TH_TD_PD": lambda a, b, c: about_half(a, 0, b, c),
    "RUSIN_TH_TD": lambda a, b: about_half(a, 0, b, np.pi / 2),
    "COS_TH_TD": lambda a, b: about_half(acos(a), 0, acos(b), np.pi / 2),
    "CARTESIAN": lambda a, b, c, d, e, f: (np.array([a, b, c]), np.array([d, e, f])),
}
TURNED = ("SPHERICAL_TL_PL_TV_PV", "RUSIN_TH_PH_TD_PD", "CARTESIAN")


def drawn(name, rng):
    """Coordinates whose directions are above the horizon."""
    size = DEFINITIONS[name].__code__.co_argcount
    if name == "CARTESIAN":
        return [*polar(rng.uniform(0, 1.5), rng.uniform(-3, 3)), *polar(rng.uniform(0, 1.5), rng.uniform(-3, 3))]
    return rng.uniform(0.05, 0.7, size).tolist()


@pytest.mark.parametrize("name", DEFINITIONS)
def test_directions_are_the_vectors_of_the_definition(tmp_path, name):
    rng = np.random.default_rng(9)
    rows = [drawn(name, rng) for _ in range(50)]
    text = f"#DIM {len(rows[0])} 1\n#PARAM_IN {name}\n#PARAM_OUT INV_STERADIAN\n"
    scan = read(written(tmp_path, text + "".join(" ".join(map(repr, [*map(float, r), 0.5])) + "\n" for r in rows)))
    assert ("phi_i" in scan.coords) is (name in TURNED)
    g = geometry(scan)
    for k, row in enumerate(rows):
        view, light = DEFINITIONS[name](*row)
        found_light, found_view = np.array([g.x_i[k], g.y_i[k], g.z_i[k]]), np.array([g.x_r[k], g.y_r[k], g.z_r[k]])
        if name not in TURNED:  # the azimuth of the light is free
            turn = np.arctan2(light[1], light[0])
            light, view = (about_normal(v, -turn) for v in (light, view))
        np.testing.assert_allclose(found_light, light, atol=1e-11)  # angles are rounded to 1e-10 deg, 2e-12 rad
        np.testing.assert_allclose(found_view, view, atol=1e-11)


def about_normal(v, turn):
    return np.array([v[0] * cos(turn) - v[1] * sin(turn), v[0] * sin(turn) + v[1] * cos(turn), v[2]])


@pytest.mark.parametrize("kind", [TEXT, BINARY], ids=lambda f: f.name)
@pytest.mark.parametrize("module", [alta, alta_binary], ids=["from-text", "from-binary"])
def test_a_file_written_again_is_read_as_before(tmp_path, kind, module):
    for path in module.samples(tmp_path):
        scan = read(path)
        scan = scan.isel(direction=np.flatnonzero(np.isfinite(scan["brdf"].values)))
        if kind is BINARY:
            scan = scan.drop_vars(["brdf_lower", "brdf_upper"], errors="ignore")
        again = tmp_path / f"again_{path.stem}{kind.suffix}"
        write(scan, again)
        found = read(again)
        xr.testing.assert_equal(*(s.drop_vars("line", errors="ignore") for s in (found, scan)))
        assert found.attrs["provenance"] == scan.attrs["provenance"]
        assert found.attrs["history"].startswith(scan.attrs["history"])
        assert recognise(again) is kind


@pytest.mark.parametrize("kind", [TEXT, BINARY], ids=lambda f: f.name)
def test_angles_of_ten_decimals_survive_radians(tmp_path, kind):
    rng = np.random.default_rng(10)
    angles = [np.round(rng.uniform(0, top, 500), 10) for top in (90, 90, 359.9, 359.9)]
    scan = make_scan(*angles[:2], rng.random(500), angles[2], phi_i=angles[3])
    write(scan, tmp_path / f"scan{kind.suffix}")
    xr.testing.assert_equal(read(tmp_path / f"scan{kind.suffix}").drop_vars("line", errors="ignore"), scan)


def test_intervals_are_kept_about_the_first_value(tmp_path):
    half_width, ends = (next(p for p in alta.samples(tmp_path) if p.stem == n) for n in ("half_width", "ends"))
    scan = read(half_width)
    assert (scan["brdf_lower"].values[0], scan["brdf_upper"].values[0]) == (0.9, 1.1)
    scan = read(ends)
    np.testing.assert_array_equal(scan["brdf_lower"], [0.9, 1])
    np.testing.assert_array_equal(scan["brdf_upper"], [1.2, 4])
    assert "uncertainty" not in scan


def test_the_cosine_is_divided_out(tmp_path):
    scan = read(next(p for p in alta.samples(tmp_path) if p.stem == "cosine"))
    assert scan["brdf"].values[0] == pytest.approx(0.5 / cos(sqrt(0.2**2 + 0.3**2)), rel=1e-10)  # angles to 1e-10 deg
    assert np.isnan(scan["brdf"].values[1])
    assert "divided by cos(theta_r); 1 directions at the horizon have no value" in scan.attrs["history"]
    assert scan.attrs["stored"] == "BRDF x cos(theta_r)"


def test_colours_are_channels(tmp_path):
    scan = read(next(p for p in alta.samples(tmp_path) if p.stem == "spherical"))
    assert scan["channel"].values.tolist() == ["R", "R", "G", "G", "B", "B"]
    assert scan["brdf"].values.tolist() == [0.1, 0.4, 0.2, 0.5, 0.3, 0.6]
    several = read(next(p for p in alta.samples(tmp_path) if p.stem == "cosines"))
    assert several["channel"].values.tolist() == ["1", "1", "2", "2"]
    assert "took phi_d as 90 deg" in several.attrs["history"]


def test_what_lies_below_the_horizon_on_a_grid_is_left_out_with_a_word(tmp_path):
    scan = read(next(p for p in alta.samples(tmp_path) if p.stem == "half_width"))
    assert scan.sizes["direction"] == 1
    assert "left out 1 rows whose directions lie below the horizon" in scan.attrs["history"]


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        (HEAD + ROW + "0.5 0.25 3\n", "line 5", "has 3 numbers, not 4: coordinate 1"),
        (HEAD + ROW + "0.5 0.25 x 1\n", "line 5", "coordinate 3 is 'x'"),
        (HEAD + "0.5 0.25 nan 1\n", "line 4", "coordinate 3 is 'nan', not a finite number"),
        (HEAD + "0.5 0,25 3 1\n", "line 4", "write decimal points, not commas"),
        (HEAD + "30 45 180 1\n", "line 4", "30 45 180 is no ISOTROPIC_TV_TL_DPHI; ALTA's angles are in radians"),
        (HEAD + "0.5 1.6 3 1\n", "line 4", "theta_i is 91.6732 and theta_r 28.6479 deg: a direction lies below"),
        (HEAD + "0.5 0.25 3 0\n", "line 4", "every brdf value is zero"),
        (HEAD, "line 1", "holds no rows"),
        (
            HEAD.replace("ISOTROPIC_TV_TL_DPHI", "STARK_3D") + ROW,
            "line 2",
            "STARK_3D.*one of SPHERICAL_TL_PL_TV_PV.*data2data",
        ),
        (HEAD.replace("INV_STERADIAN", "ENERGY") + ROW, "line 3", "#PARAM_OUT is 'ENERGY': it must be one of INV_ST"),
        (HEAD.replace("#DIM 3 1", "#DIM 2 1") + ROW, "line 1", "says 2 coordinates, and ISOTROPIC_TV_TL_DPHI has 3"),
        (HEAD.replace("#DIM 3 1", "#DIM 3 4611686018427387904") + ROW, "line 1", "must be the numbers of coordinates"),
        (HEAD.replace("#DIM 3 1", "#DIM 3 2000") + ROW, "line 1", "says 2000 values, outside 1 to 1000"),
        (HEAD.replace("INV_STERADIAN", "RGB_COLOR") + ROW, "line 1", "says 1 values, and RGB_COLOR has 3"),
        (HEAD + "#VS 3\n" + ROW, "line 4", "#VS is '3': it must be a whole number from 0 to 2"),
        (HEAD + "#DIM 3 1\n" + ROW, "line 4", "#DIM occurs twice"),
        (HEAD.replace("#PARAM_IN  ISOTROPIC_TV_TL_DPHI\n", "") + ROW, "line 1", "there is no #PARAM_IN"),
        ("#DIM 2 1\n#PARAM_IN COS_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.5 1.01 1\n", "line 4", "0.5 1.01 is no COS_TH_TD"),
        ("#DIM 6 1\n#PARAM_IN CARTESIAN\n#PARAM_OUT INV_STERADIAN\n0 0 1 1 0 1 1\n", "line 4", "is no CARTESIAN"),
    ],
)
def test_damaged_text_is_named_with_its_line(tmp_path, text, where, what):
    with pytest.raises(FormatError, match=what) as error:
        read(written(tmp_path, text))
    assert error.value.where == where


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        (("#SAMPLE_COUNT 3", "#SAMPLE_COUNT 4611686018427387904"), "line 7", "#SAMPLE_COUNT is '46116860"),
        (
            ("#SAMPLE_COUNT 3", "#SAMPLE_COUNT 4"),
            "byte 169",
            "4 rows of 4 numbers needs 128 bytes, and the file has 109",
        ),
        (("#SAMPLE_COUNT 3", "#SAMPLE_COUNT 2"), "byte 233", "the 2 rows of #SAMPLE_COUNT are not followed by"),
        (("#ENDIAN little", "#ENDIAN middle"), "line 9", "#ENDIAN is 'middle': it must be little or big"),
        (("#PRECISION ieee754-double", "#PRECISION half"), "line 6", "#PRECISION is 'half': it must be ieee754-double"),
        (("#VERSION 0", "#VERSION 1"), "line 5", "#VERSION is '1': it must be 0"),
        (("#VS 0", "#VS 2"), "line 8", "save it as text"),
        (("#BEGIN_STREAM", "#BEGIN"), "byte 271", "has no #BEGIN_STREAM"),
        (("#VS 0", "1 2 3"), "line 8", "'1 2 3' is no line of a header"),
    ],
)
def test_damaged_binary_is_named_with_its_place(tmp_path, change, where, what):
    content = alta_binary.content("little").replace(*(c.encode() for c in change))
    with pytest.raises(FormatError, match=what) as error:
        read(written(tmp_path, content))
    assert error.value.where == where


def test_a_number_that_is_not_finite_is_named_with_its_byte(tmp_path):
    content = bytearray(alta_binary.content("big"))
    start = content.index(b"#BEGIN_STREAM\n") + len(b"#BEGIN_STREAM\n")
    content[start + 40 : start + 48] = np.array([np.inf], ">f8").tobytes()
    with pytest.raises(FormatError, match="not finite") as error:
        read(written(tmp_path, bytes(content)))
    assert error.value.where == f"byte {start + 40}"


@pytest.mark.parametrize(
    ("scan", "what"),
    [
        (make_scan([10], [5], [0.1], unit="a.u."), "calibrate the scan first"),
        (make_scan([10, 20], [5, 5], [0.1, np.nan]), "leave missing values out"),
        (make_scan([10, 10], [5, 5], [1, 2], coordinates={"channel": ["R", "vis"]}), "R G B or X Y Z, not R vis"),
        (make_scan([10, 10], [5, 5], [1, 2], coordinates={"scan": ["a", "b"]}), "select one scan"),
        (make_scan([10, 20], [5, 5], [1, 2], coordinates={"channel": ["1", "2"]}), "share their directions"),
        (
            make_scan([10], [5], [1], variables={"brdf_lower": ([np.nan], "1"), "brdf_upper": ([2.0], "1")}),
            "about every value or about none",
        ),
        (
            make_scan(
                [10, 10],
                [5, 5],
                [1, 2],
                coordinates={"channel": ["1", "2"]},
                variables={"brdf_lower": ([0.0, 1.0], "1"), "brdf_upper": ([2.0, 3.0], "1")},
            ),
            "about its first value only",
        ),
    ],
)
def test_what_cannot_be_written_is_refused_with_a_remedy(tmp_path, scan, what):
    with pytest.raises(ValueError, match=what):
        write(scan, tmp_path / "out.alta")

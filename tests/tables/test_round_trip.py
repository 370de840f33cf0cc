"""A scan written in every layout that the vocabulary allows, and read back equal, without a flag."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from gonio import read_table
from gonio.measured.dataset import make_scan, signed_theta_r
from workbooks import write as write_workbook

SETTINGS = settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], derandomize=True
)
SEPARATORS = [("\t", "."), ("\t", ","), (";", "."), (";", ","), (",", "."), ("|", "."), ("  ", "."), ("  ", ",")]
TITLES = ["", "Goniometer export v3\n", "Sample A2, black\nOperator: n. n.\n\n", "# measured 2026-03-01\n"]
THETA_I = ["theta_i{}", "AOI{}", "Incidence angle{}", "source zenith{}", "θi{}", "Einfallswinkel{}"]
THETA_R = ["theta_r{}", "AOS{}", "Scatter angle{}", "view_zenith{}", "Detector{}", "theta_s{}"]
DEGREES = ["", " [deg]", " (degrees)", " [°]", "_deg"]
RADIANS = [" [rad]", "_rad", " (radians)"]
# Headings of each quantity with the factor from the BRDF at a cosine of theta_r.
QUANTITIES = {
    "BRDF [1/sr]": lambda f, cos: f,
    "BSDF": lambda f, cos: f,
    "f_r (sr^-1)": lambda f, cos: f,
    "brdf_sr-1": lambda f, cos: f,
    "ccBRDF": lambda f, cos: f * cos,
    "BRDF*cos(theta_r) [1/sr]": lambda f, cos: f * cos,
    "Reflectance factor": lambda f, cos: f * math.pi,
    "BRF [%]": lambda f, cos: f * math.pi * 100,
    "log10(BRDF)": lambda f, cos: math.log10(f),
    "Radiant intensity per incident power [1/sr]": lambda f, cos: f * cos,
}
IN_MATRIX = {k: v for k, v in QUANTITIES.items() if "log" not in k}
UNCERTAINTIES = {
    "u": lambda u, f, factor: u * factor,
    "U (k=2)": lambda u, f, factor: 2 * u * factor,
    "u_rel [%]": lambda u, f, factor: 100 * u / f,
    "relative uncertainty": lambda u, f, factor: u / f,
}

angles = st.lists(st.sampled_from([7.5, 10.0, 30.0, 45.0, 60.0]), min_size=2, max_size=3, unique=True)
scatter = st.lists(st.sampled_from([-70.0, -42.5, -30.0, 0.0, 12.0, 33.0, 80.0]), min_size=3, max_size=5, unique=True)
values = st.floats(1e-4, 9.0).map(lambda f: float(f"{f:.6g}"))


@st.composite
def scans(draw):
    """Incidence angles, detector angles with one below zero, and a BRDF for each pair."""
    theta_i, theta_r = sorted(draw(angles)), sorted(draw(scatter.filter(lambda some: min(some) < 0)))
    brdf = np.array([[draw(values) for _ in theta_r] for _ in theta_i])
    return theta_i, theta_r, brdf


def text_of(value, mark):
    return f"{value:.14g}".replace(".", mark)


def written(folder, rows, title, way, encoding):
    """Rows of numbers and texts as a file of text."""
    separator, mark = way
    lines = (separator.join(c if isinstance(c, str) else text_of(c, mark) for c in row) for row in rows)
    path = folder / "table.txt"
    path.write_bytes((title + "\n".join(lines) + "\n").encode(encoding))
    return path


def assert_equal(scan, theta_i, theta_r, brdf, uncertainty=None):
    wanted = np.array([(i, r, brdf[a, b]) for a, i in enumerate(theta_i) for b, r in enumerate(theta_r)])
    found = np.column_stack([scan["theta_i"].values, signed_theta_r(scan), scan["brdf"].values])
    order = np.lexsort(found[:, 1::-1].T)
    np.testing.assert_allclose(found[order], wanted, rtol=1e-9, atol=1e-9)
    if uncertainty is not None:
        np.testing.assert_allclose(scan["uncertainty"].values[order], uncertainty.ravel(), rtol=1e-9)


# How a long table is written: separator and mark, title, encoding, headings, unit of angles, quantity, uncertainty.
WAYS = st.tuples(
    st.sampled_from(SEPARATORS),
    st.sampled_from(TITLES),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    st.sampled_from(THETA_I),
    st.sampled_from(THETA_R),
    st.sampled_from(DEGREES + RADIANS),
    st.sampled_from([*QUANTITIES]),
    st.sampled_from(["", *UNCERTAINTIES]),
    st.booleans(),
)


@SETTINGS
@given(scans(), WAYS)
def test_long(tmp_path, scan, how):
    theta_i, theta_r, brdf = scan
    way, title, encoding, of_i, of_r, unit, quantity, of_u, last_first = how
    if "log" in quantity and of_u in ("u", "U (k=2)"):
        of_u = "relative uncertainty"  # the uncertainty of a logarithm has a test of its own
    if "%" in quantity and "%" in of_u:
        of_u = ""  # percent of the value, or percentage points: that is asked
    scale = math.pi / 180 if unit in RADIANS else 1.0
    uncertainty = 0.01 * brdf + 1e-4
    rows = [[of_i.format(unit), of_r.format(unit), quantity, *([of_u] if of_u else [])]]
    for a, i in enumerate(theta_i):
        for b, r in enumerate(theta_r):
            f, cos = float(brdf[a, b]), math.cos(math.radians(r))
            value = QUANTITIES[quantity](f, cos)
            of_value = [UNCERTAINTIES[of_u](uncertainty[a, b], f, value / f)] if of_u else []
            rows.append([i * scale, r * scale, value, *of_value])
    if last_first:
        rows = [row[::-1] for row in rows]
    found = read_table(written(tmp_path, rows, title, way, encoding))
    assert_equal(found, theta_i, theta_r, brdf, uncertainty if of_u else None)


CORNERS = {
    "theta_r": ["detector angle [deg]", "AOS", "", "theta_r/theta_i", "θs \\ θi", "Streuwinkel"],
    "theta_i": ["AOI [deg]", "incidence angle", "", "Einfallswinkel/Detektorwinkel", "theta_i\\theta_r"],
}


@SETTINGS
@given(
    scans(),
    st.sampled_from(SEPARATORS[:6]),
    st.sampled_from(TITLES),
    st.tuples(st.sampled_from(["theta_r", "theta_i"]), st.integers(0, 4)),
    st.sampled_from(["{}", "{} deg", "{}°"]),
    st.sampled_from([*IN_MATRIX]),
)
def test_matrix(tmp_path, scan, way, title, corner, heading, quantity):
    theta_i, theta_r, brdf = scan
    rows_are, which = corner
    cells = np.array(
        [[QUANTITIES[quantity](brdf[a, b], math.cos(math.radians(r))) for b, r in enumerate(theta_r)]
         for a, _ in enumerate(theta_i)]
    )  # fmt: skip
    down, across = (theta_r, theta_i) if rows_are == "theta_r" else (theta_i, theta_r)
    cells = cells.T if rows_are == "theta_r" else cells
    heads = [heading.format(text_of(a, way[1])) if heading != "{}" else a for a in across]
    rows = [[CORNERS[rows_are][which], *heads], *([d, *line] for d, line in zip(down, cells.tolist(), strict=True))]
    found = read_table(written(tmp_path, rows, f"{title}{quantity}\n", way, "utf-8"))
    assert_equal(found, theta_i, theta_r, brdf)


LINES = ["AOI = {} deg", "Incidence angle: {}°", "theta_i {} deg", "# AOI={} deg", "AOI{sep}{}"]


@SETTINGS
@given(scans(), st.sampled_from(SEPARATORS[:6]), st.sampled_from(LINES), st.booleans(), st.sampled_from([*QUANTITIES]))
def test_blocks(tmp_path, scan, way, line, repeated, quantity):
    theta_i, theta_r, brdf = scan
    rows = [] if repeated else [["AOS [deg]", quantity]]
    for a, i in enumerate(theta_i):
        rows.append([line.format(text_of(i, way[1]), sep=way[0])])
        rows += [["AOS [deg]", quantity]] if repeated else []
        rows += [[r, QUANTITIES[quantity](brdf[a, b], math.cos(math.radians(r)))] for b, r in enumerate(theta_r)]
        rows.append([""])
    found = read_table(written(tmp_path, rows, "", way, "utf-8"))
    assert_equal(found, theta_i, theta_r, brdf)


NAMES = ["AOI {}", "{} deg", "{}", "theta_i={}", "{}°"]


@settings(SETTINGS, max_examples=12)  # each workbook is read in a process of its own
@given(scans(), st.sampled_from([".xlsx", ".ods", ".xls"]), st.sampled_from(NAMES), st.sampled_from([*QUANTITIES]))
def test_sheets(tmp_path, scan, suffix, name, quantity):
    theta_i, theta_r, brdf = scan
    sheets = {
        name.format(f"{i:g}"): [
            ["Sample 3"],
            [],
            ["detector angle", quantity, None],
            *([r, QUANTITIES[quantity](brdf[a, b], math.cos(math.radians(r))), None] for b, r in enumerate(theta_r)),
            [None, None, None],
        ]
        for a, i in enumerate(theta_i)
    }
    found = read_table(write_workbook(tmp_path / f"book{suffix}", {**sheets, "Notes": [["nothing", "here"]]}))
    assert_equal(found, theta_i, theta_r, brdf)


@pytest.mark.parametrize("names", [("450 nm", "550 nm"), ("wavelength 450 nm", "wavelength 550 nm")])
def test_a_matrix_a_wavelength(tmp_path, names):
    sheets = {
        name: [["detector", 10.0, 30.0], [-60.0, k, 2.0 * k], [20.0, 3.0 * k, 4.0 * k]]
        for k, name in enumerate(names, 1)
    }
    found = read_table(write_workbook(tmp_path / "book.xlsx", sheets))
    assert found["wavelength"].values.tolist() == [450] * 4 + [550] * 4
    assert found["brdf"].values.tolist() == [1, 2, 3, 4, 2, 4, 6, 8]
    lines = [[[name], *rows, [""]] for name, rows in sheets.items()]
    text = read_table(written(tmp_path, [row for part in lines for row in part], "", (",", "."), "utf-8"))
    np.testing.assert_array_equal(text["wavelength"].values, found["wavelength"].values)
    np.testing.assert_array_equal(text["brdf"].values, found["brdf"].values)


@settings(SETTINGS, max_examples=8)
@given(scans(), st.sampled_from([".xlsx", ".ods", ".xls"]), st.booleans())
def test_one_sheet_long_or_matrix(tmp_path, scan, suffix, matrix):
    theta_i, theta_r, brdf = scan
    if matrix:
        rows = [["detector", *theta_i], *([r, *brdf[:, b].tolist()] for b, r in enumerate(theta_r))]
    else:
        rows = [["AOI", "AOS", "BSDF"]]
        rows += [[i, r, float(brdf[a, b])] for a, i in enumerate(theta_i) for b, r in enumerate(theta_r)]
    found = read_table(write_workbook(tmp_path / f"book{suffix}", {"data": [["Sample 12"], [], *rows]}))
    assert_equal(found, theta_i, theta_r, brdf)


@SETTINGS
@given(scans(), st.sampled_from(SEPARATORS), st.sampled_from(["{} nm", "{}nm", "BRDF {} nm", "BRF_{}nm"]))
def test_one_column_a_wavelength(tmp_path, scan, way, heading):
    theta_i, theta_r, brdf = scan
    factor = math.pi if "BRF" in heading else 1.0
    of = {450.0: 1.0, 632.8: 2.0, 1064.0: 3.0}
    if way[0] == "  ":
        heading = heading.replace(" ", "_")
    rows = [["AOI", "AOS", *(heading.format(text_of(w, way[1])) for w in of)]]
    for a, i in enumerate(theta_i):
        rows += [[i, r, *(factor * k * brdf[a, b] for k in of.values())] for b, r in enumerate(theta_r)]
    found = read_table(written(tmp_path, rows, "", way, "utf-8"))
    for wavelength, k in of.items():
        part = found.isel(direction=np.flatnonzero(found["wavelength"].values == wavelength))
        assert_equal(part, theta_i, theta_r, k * brdf)


@SETTINGS
@given(scans(), st.sampled_from(["AOI,specular_offset", "AOI,arm", "elevation_in,elevation_out", "AOI,theta_r"]))
def test_other_angles(tmp_path, scan, heading):
    theta_i, theta_r, brdf = scan
    turned = {
        "AOI,specular_offset": lambda i, r: (i, r - i),
        "AOI,arm": lambda i, r: (i, r + i),
        "elevation_in,elevation_out": lambda i, r: (90 - i, 90 - r),
        "AOI,theta_r": lambda i, r: (i, -r),
    }[heading]
    rows = [[*heading.split(","), "BRDF"]]
    for a, i in enumerate(theta_i):
        rows += [[*turned(i, r), float(brdf[a, b])] for b, r in enumerate(theta_r)]
    path = written(tmp_path, rows, "", (",", "."), "utf-8")
    assert_equal(read_table(path, flip=heading == "AOI,theta_r"), theta_i, theta_r, brdf)


def test_the_azimuth_of_both_sides(tmp_path):
    truth = make_scan([30, 30, 30], [20, 40, 20], [0.1, 0.2, 0.3], [90, 45, 180], phi_i=[0, 10, 300])
    rows = [["theta_in", "phi_in", "theta_out", "phi_out", "BRDF"]]
    for i, p, r, d, f in zip(*(truth[n].values for n in ("theta_i", "phi_i", "theta_r", "phi", "brdf")), strict=True):
        rows.append([i, p, r, (p + d) % 360, f])
    found = read_table(written(tmp_path, rows, "", (";", ","), "utf-8"))
    for name in ("theta_i", "theta_r", "phi", "phi_i", "brdf"):
        np.testing.assert_allclose(found[name].values, truth[name].values, rtol=1e-12)

"""Files of optical constants: what is read, and every way in which one can be wrong."""

import contextlib
import os
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gonio.files import FormatError
from gonio.materials import constants, material
from gonio.materials.material import Material
from gonio.materials.reading import LARGEST_FILE, read_material

PAGE = """\
# a page of own numbers
REFERENCES: |
    A. Author. <a href="https://example.org">A metal of <i>no</i> name &amp; fame</a> (2000)
COMMENTS: "Room temperature"
DATA:
  - type: tabulated nk
    data: |
        0.4 0.5 2.0
        0.6 0.7 3.0
        1.0 1.1 6.0
SPECS:
    thermal_dispersion:
      - type: Schott formula
        coefficients: 1.86e-06 1.31e-08
"""
GLASS = """\
DATA:
  - type: formula 2
    wavelength_range: 0.3 2.5
    coefficients: 0 1.03961212 0.00600069867 0.231792344 0.0200179144 1.01046945 103.560653
"""
WITH_K = GLASS + "  - type: tabulated k\n    data: |\n        0.4 1e-8\n        0.7 3e-8\n"


def written(tmp_path, content, name="file.txt"):
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def refused(path, where, what):
    with pytest.raises(FormatError) as caught:
        read_material(path)
    assert caught.value.where == where
    assert what in str(caught.value)
    assert "\n" not in str(caught.value)
    return caught.value


def test_a_page_of_the_database(tmp_path):
    found = read_material(written(tmp_path, PAGE, "Metal.yml"))
    np.testing.assert_array_equal(found.wavelength_um, [0.4, 0.6, 1.0])
    assert found.at(0.6) == (0.7, 3.0)
    assert found.at(0.5) == pytest.approx((0.6, 2.5), rel=1e-15)
    assert found.cite == "A. Author. A metal of no name & fame (2000)"
    assert found.note == "Room temperature"
    assert (found.name, found.title) == ("Metal.yml", "Metal")
    assert found.where.endswith("Metal.yml")
    assert not found.lines


@pytest.mark.parametrize(
    "text",
    [
        "wavelength_um,n,k\n0.4,0.5,2\n0.6,0.7,3\n1,1.1,6\n",
        "\ufeffWavelength (nm)\tn\tk\r\n400\t0.5\t2\r\n600\t0.7\t3\r\n1000\t1.1\t6\r\n",
        "# own\n\n0.4 0.5 2.0\n 0.6   0.7  3.0\n1e0 1.1 6.0",
        "wl,n\n0.4,0.5\n0.6,0.7\n1.0,1.1\n\nwl,k\n0.4,2\n0.6,3\n1.0,6\n",
        "wl,k,n\n1.0,6,1.1\n0.6,3,0.7\n0.4,2,0.5\n",
        "# lambda_nm n k\n400 0.5 2\n600 0.7 3\n1000 1.1 6\n",
        "wavelength [µm] , n , k\n0.4 , 0.5 , 2\n0.6, 0.7, 3\n0.6, 0.7, 3\n1, 1.1, 6\n",
        PAGE.replace("        0.6 0.7 3.0\n", "\n        0.6   0.7\t3.0\n\n"),
        PAGE.replace("tabulated nk", "tabulated   nk").replace("DATA:", "DATA :"),
        "DATA:\n- {type: tabulated n, data: '0.4 0.5\n\n  0.6 0.7\n\n  1 1.1'}\n"
        "- {type: tabulated k, data: '0.4 2\n\n  0.6 3\n\n  1 6'}\n",
    ],
    ids=["commas", "windows-nm", "bare", "sections", "falling", "savetxt", "repeated", "blank", "spaced", "flow"],
)
@pytest.mark.parametrize("name", ["x.csv", "x.yml", "x"])
def test_the_same_metal_in_other_words(tmp_path, text, name):
    found, expected = read_material(written(tmp_path, text, name)), read_material(written(tmp_path, PAGE))
    for column in ("wavelength_um", "n", "k"):
        np.testing.assert_allclose(getattr(found, column), getattr(expected, column), rtol=1e-15)


def test_nodes_are_exact_and_700_nm_is_the_end_of_a_table_to_0_7_um(tmp_path):
    path = written(tmp_path, "wavelength_um n k\n0.41 1.7 0.3\n0.57 1.3 0.2\n0.7 1.1 0.7\n")
    found = read_material(path)
    n, k = found.at(found.wavelength_um)
    np.testing.assert_array_equal(n, [1.7, 1.3, 1.1])
    np.testing.assert_array_equal(k, [0.3, 0.2, 0.7])
    assert 700 * 1e-3 > 0.7
    assert found.at(700 * 1e-3) == (1.1, 0.7)
    assert constants(path, 700) == {"index": 1.1, "extinction": 0.7}
    assert constants(str(path), 410) == {"index": 1.7, "extinction": 0.3}


@pytest.mark.parametrize("wavelength_um", [0.399, 1.001, -1, 0, 1e300])
def test_outside_the_table_is_refused(tmp_path, wavelength_um):
    found = read_material(written(tmp_path, PAGE))
    with pytest.raises(ValueError, match=r"file.txt is known from 0.4 to 1 um, and .* is outside: nothing is extrapol"):
        found.at([0.5, wavelength_um])


@pytest.mark.parametrize("wavelength_um", [np.nan, np.inf, [0.5, -np.inf]])
def test_no_wavelength(tmp_path, wavelength_um):
    with pytest.raises(ValueError, match="not a number of um"):
        read_material(written(tmp_path, PAGE)).at(wavelength_um)


def test_one_row_is_one_line(tmp_path):
    found = read_material(written(tmp_path, "0.6328 1.5\n"))
    assert found.at(0.633) == (1.5, 0.0)
    with pytest.raises(ValueError, match=r"known at 0.6328 um only"):
        found.at(0.65)


def test_a_formula_is_exact_between_the_wavelengths_listed(tmp_path):
    found = read_material(written(tmp_path, GLASS, "N-BK7.yml"))
    assert found.at(0.5875618)[0] == pytest.approx(1.51680, abs=1e-5)
    assert (found.wavelength_um[0], found.wavelength_um[-1]) == (0.3, 2.5)
    assert found.at(0.5)[1] == 0
    assert "gives no k: taken as 0" in found.note
    np.testing.assert_allclose(found.at(found.wavelength_um)[0], found.n, rtol=1e-15)


def test_a_pole_between_the_wavelengths_looked_at_is_refused_when_asked_for(tmp_path):
    text = "DATA:\n  - type: formula 2\n    wavelength_range: 0.3 0.9\n    coefficients: 1 1e-9 0.25\n"
    found = read_material(written(tmp_path, text))
    assert found.at(0.6)[0] == pytest.approx(np.sqrt(2))
    with pytest.raises(ValueError, match=r"formula 2 gives no index at 0.5 um"):
        found.at([0.4, 0.5])


def test_formula_for_n_and_table_for_k(tmp_path):
    found = read_material(written(tmp_path, WITH_K))
    n, k = found.at(0.5875618)
    assert n == pytest.approx(1.51680, abs=1e-5)
    assert k == pytest.approx(1e-8 + 2e-8 * 0.1875618 / 0.3)
    assert (found.wavelength_um[0], found.wavelength_um[-1]) == (0.4, 0.7)
    assert "both known from 0.4 to 0.7 um only" in found.note
    with pytest.raises(ValueError, match=r"from 0.4 to 0.7 um"):
        found.at(0.8)


def test_older_pages_call_the_range_range(tmp_path):
    found = read_material(written(tmp_path, GLASS.replace("wavelength_range", "range")))
    assert found.at(0.5875618)[0] == pytest.approx(1.51680, abs=1e-5)


def test_n_and_k_at_different_wavelengths_are_both_exact(tmp_path):
    found = read_material(written(tmp_path, "wl,n\n0.4,1\n0.6,2\n0.8,1.5\nwl,k\n0.5,1\n0.7,3\n0.9,2\n"))
    np.testing.assert_allclose(found.wavelength_um, [0.5, 0.6, 0.7, 0.8])
    np.testing.assert_allclose(found.at([0.5, 0.6, 0.7, 0.8]), [[1.5, 2, 1.75, 1.5], [1, 2, 3, 2.5]])


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        (PAGE.replace("0.6 0.7 3.0", "0.6 0.7"), "line 9", "2 numbers where 3 are expected: wavelength, n, k"),
        (PAGE.replace("0.7", "nan"), "line 9", "'nan' is not a finite number"),
        (PAGE.replace("3.0", "1e999"), "line 9", "'1e999' is not a finite number"),
        (PAGE.replace("0.7", "1_0"), "line 9", "'1_0' is not a finite number"),
        (PAGE.replace("0.7", "-0.7"), "line 9", "n is -0.7: it must be above 0"),
        (PAGE.replace("0.7", "0"), "line 9", "n is 0: it must be above 0"),
        (PAGE.replace("3.0", "-3"), "line 9", "k is -3: it must be 0 or more"),
        (PAGE.replace("3.0", "3e200"), "line 9", "below 1e5"),
        (PAGE.replace("0.6 0", "-0.6 0"), "line 9", "the wavelength is -0.6 um"),
        (PAGE.replace("0.6 0", "2.6 0"), "line 10", "1 um follows 2.6 um: sort the rows"),
        (PAGE.replace("0.6 0", "0.4 0"), "line 9", "0.4 um occurs twice with different n"),
        (PAGE.replace("tabulated nk", "tabulated n2"), "line 6", "'tabulated n2' is none of tabulated nk"),
        (PAGE.replace("tabulated nk", "formula 10"), "line 6", "'formula 10' is none of"),
        (PAGE.replace("type: tab", "kind: tab"), "line 6", "needs type"),
        (PAGE.replace("data: |", "values: |"), "line 6", "needs data"),
        (PAGE.replace("tabulated nk", "[1]"), "line 6", "needs type"),
        (PAGE.replace("DATA:", "DATUM:"), "", "has no list DATA"),
        (PAGE.split("DATA:")[0] + "DATA: []\n", "", "has no list DATA"),
        (PAGE.split("DATA:")[0] + "DATA: 5\n", "", "has no list DATA"),
        ("DATA:\n  - 5\n", "line 2", "expected keys and values"),
        (PAGE + "DATA: []\n", "line 15", "the key DATA occurs twice"),
        (PAGE.replace("COMMENTS: ", "COMMENTS: [").replace("DATA:\n", "DATA:\n\t- x\n"), "line 5", "is no valid YAML"),
        ("DATA:\n  - type: 'x\n", "line 3", "is no valid YAML"),
        ("DATA:\n  - \x01\n", "", "is no valid YAML"),
        ("DATA: []\n---\nDATA: []\n", "line 2", "is no valid YAML"),
        (GLASS.replace("0.3 2.5", "2.5 0.3"), "line 3", "two rising wavelengths"),
        (GLASS.replace("0.3 2.5", "0.3"), "line 3", "two rising wavelengths"),
        (GLASS.replace("0.3 2.5", "0 2.5"), "line 3", "two rising wavelengths"),
        (GLASS.replace("0.3 2.5", "0.3 many"), "line 3", "'many' is not a finite number"),
        (GLASS.replace(" 103.560653", ""), "line 4", "formula 2 has 6 coefficients where it takes one and then pairs"),
        (GLASS.replace("103.560653", "inf"), "line 4", "'inf' is not a finite number"),
        (GLASS.replace("0 1.0396", "-9 1.0396"), "", "formula 2 gives no index at 0.3 um"),
        (GLASS + "  - type: tabulated n\n    data: |\n        0.4 1.5\n", "line 5", "gives n twice"),
        (
            GLASS + "  - type: tabulated k\n    data: |\n        3 0\n        4 0\n",
            "",
            "there is no wavelength with both",
        ),
        ("DATA:\n  - type: tabulated k\n    data: |\n        0.4 1\n", "", "gives k and no n"),
        ("DATA:\n  - type: tabulated nk\n    data: ''\n", "", "holds no row of n"),
    ],
)
def test_refused_pages(tmp_path, text, where, what):
    refused(written(tmp_path, text, "page.yml"), where, what)


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("wl,n\n0.4\n", "line 2", "1 cells where 2 are expected: wavelength, n"),
        ("wl,n\n0.4,1.5,0\n", "line 2", "3 cells where 2"),
        ("wl,n,k\n0.4,,0\n", "line 2", "n is '', not a finite number"),
        ("wl,n,k\n0.4,nan,0\n", "line 2", "n is 'nan', not a finite number"),
        ("wl,n,k\n0.4,1.5,1e999\n", "line 2", "k is '1e999', not a finite number"),
        ("wl,n\n0.4,-1.5\n", "line 2", "n is -1.5: it must be above 0"),
        ("wl,n\n0.4,1.5\nend,1\n", "line 3", "wavelength is 'end', not a finite number"),
        ("wl,n\n0.4,1.5\n0.6,1.5\n0.5,1.5\n", "line 4", "0.5 um follows 0.6 um: sort the rows"),
        ("wl,n\n0.4,1.5\nwl,n\n0.4,1.6\n", "line 4", "gives n in two sections"),
        ("wl,k\n0.4,1.5\n", "", "gives k and no n"),
        ("wl,n\n", "", "holds no row of numbers"),
        ("# nothing but this\n", "", "holds no row of numbers"),
        ("wl,n\n400,1.5\n", "line 2", "wavelength 400 without a unit, um or nm? Name it in the header: wavelength_nm"),
        ("0.4 1.5\n51 1.5\n", "line 2", "wavelength 51 without a unit"),
        ("wavelength_um,n\n0,1.5\n", "line 2", "the wavelength is 0 um"),
        ("wavelength_um,n\n1e300,1.5\n", "line 2", "must be above 0 and below 1e9"),
        ("energy_eV,n,k\n1,1,1\n", "line 1", "the header names 'energy'"),
        ("wavelength_cm-1,n,k\n1,1,1\n", "line 1", "the header names 'cm'"),
        ("wavelength_nm,eps1,eps2\n1,1,1\n", "line 1", "the header names 'eps1'"),
        ("wavelength_um_nm,n\n1,1\n", "line 1", "um and nm"),
        ("wl,n,n\n1,1,1\n", "line 1", "names n twice"),
        ("n,k\n1,1\n", "line 1", "no wavelength with n or k"),
        ("wl\n1\n", "line 1", "no wavelength with n or k"),
        ("wl;n\n0,4;1,5\n", "line 2", "3 cells where 2"),
        ("0.4;1.5\n", "line 1", "divide columns by commas, not semicolons"),
        ("0,4;1,5\n", "line 1", "write decimals with a point"),
        ("1 2 3 4\n", "line 1", "4 columns without a header"),
        ("theta_i_deg,theta_r_deg,brdf_sr-1\n30,10,1\n", "line 1", "the header names 'theta'"),
        ("{a: 1}\n", "line 1", "the header names 'a'"),
    ],
)
def test_refused_columns(tmp_path, text, where, what):
    refused(written(tmp_path, text), where, what)


@pytest.mark.parametrize(
    ("content", "where", "what"),
    [
        (b"", "", "is empty"),
        (b" \n\t\n", "", "is empty"),
        (b"0.4 1.5\n0.5 1.\xff\n", "line 2, byte 14", "is not UTF-8"),
        ("0.4 1.5\n".encode("utf-16-le"), "byte 1", "zero bytes"),
        (b"\x89HDF\r\n\x1a\n\0\0\0", "byte 8", "zero bytes"),
    ],
)
def test_refused_bytes(tmp_path, content, where, what):
    refused(written(tmp_path, content), where, what)


def test_what_is_no_file(tmp_path):
    refused(tmp_path, "", "is a directory")
    refused(tmp_path / "none.yml", "", "there is no such file")
    fifo = tmp_path / "fifo"
    os.mkfifo(fifo)
    refused(fifo, "", "is not a regular file")


BOMB = "DATA:\n- &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"- &{new} [{', '.join([f'*{old}'] * 9)}]\n" for old, new in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        (BOMB, "line 3", "holds a YAML alias"),
        ("DATA: &a\n- *a\n", "line 2", "holds a YAML alias"),
        ("DATA: " + "[" * 500 + "\n", "line 1", "nested more than 20 deep"),
        ("DATA:\n" + "- a\n" * 200_000, "line 99", "holds over 100000 entries"),
        ("DATA: " + "x" * LARGEST_FILE, "", "is larger than 10 MB"),
        ("0.4 1.5\n" * (LARGEST_FILE // 8 + 1), "", "is larger than 10 MB"),
        ("x" * 5_000_000, "line 1", "the header names"),
        (" " * 5_000_000 + "1\n", "line 1", "1 columns"),
    ],
    ids=["bomb", "loop", "deep", "many", "huge-yaml", "huge-table", "long-word", "blanks"],
)
def test_hostile_files_are_refused_quickly(tmp_path, text, where, what):
    path = written(tmp_path, text)
    start = time.perf_counter()
    with pytest.raises(FormatError, match=what) as caught:
        read_material(path)
    assert time.perf_counter() - start < 5
    assert caught.value.where.startswith(where)
    assert len(str(caught.value)) < 500 + len(str(path))


def test_tags_construct_nothing(tmp_path):
    text = PAGE.replace('"Room temperature"', "!!python/object/apply:os.getcwd []")
    assert read_material(written(tmp_path, text)).note == ""


def test_control_characters_of_remarks_are_dropped(tmp_path):
    found = read_material(written(tmp_path, "# red \x1b[31m\n0.4 1.5\n0.5 1.5\n"))
    assert found.note.startswith("red [31m")


def test_a_built_in_s_name_and_a_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written(tmp_path, "0.4 1.5\n0.8 1.5\n", "gold")
    written(tmp_path, "0.4 1.7\n0.8 1.7\n", "mine")
    assert material("gold").cite == "johnson1972"
    assert material("./gold").at(0.5) == (1.5, 0.0)
    assert material("mine").at(0.5) == (1.7, 0.0)


@settings(max_examples=60, deadline=None)
@given(
    rows=st.lists(
        st.tuples(st.floats(0.1, 50), st.floats(1e-3, 100), st.floats(0, 100)),
        min_size=2,
        max_size=12,
        unique_by=lambda r: r[0],
    ),
    part=st.floats(0, 1),
)
def test_interpolated_values_lie_between_their_neighbours(rows, part):
    w, n, k = np.array(sorted(rows)).T
    found = Material("test", "", "", "", w, n, k)
    asked = np.clip(w[0] + part * (w[-1] - w[0]), w[0], w[-1])
    right = min(max(np.searchsorted(w, asked), 1), len(w) - 1)
    for value, column in zip(found.at(asked), (n, k), strict=True):
        low, high = sorted(column[right - 1 : right + 1])
        assert low * (1 - 1e-12) <= value <= high * (1 + 1e-12)


@settings(max_examples=80, deadline=None)
@given(
    content=st.one_of(
        st.binary(max_size=300), st.text(max_size=300).map(lambda t: ("DATA:\n" + t).encode("utf-8", "ignore"))
    )
)
def test_any_bytes_are_read_or_refused(content, tmp_path_factory):
    path = tmp_path_factory.mktemp("any") / "x"
    path.write_bytes(content)
    with contextlib.suppress(FormatError):
        assert (read_material(path).n > 0).all()

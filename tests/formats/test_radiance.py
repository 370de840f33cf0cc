"""Radiance XML: what is read, written and refused. Radiance's own values are in test_radiance_peer.py."""

import re

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.files import FormatError
from gonio.formats.radiance import klems, sides
from gonio.formats.radiance.tensor_tree import to_disk, to_square
from gonio.formats.radiance.window import FORMAT, evaluate
from samples.radiance import BANDS, COARSE, TREE, WAVELENGTH, block, file, matrix, samples, texts


def written(folder, text):
    path = folder / "file.xml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def matrix_scan(folder, name="columns"):
    return read(written(folder, texts()[name]))


def test_columns_are_incident_rows_outgoing_and_sides_are_the_files(tmp_path):
    scan = matrix_scan(tmp_path)
    assert scan["brdf"].dims == ("mode", "side", "channel", "incident", "outgoing")
    assert scan["mode"].values.tolist() == ["reflection", "transmission"]
    assert scan["side"].values.tolist() == ["front", "back"]
    # Row 3, column 2 of the first matrix: outgoing patch 3, incident patch 2.
    assert scan["brdf"].sel(mode="reflection", side="front", channel="Visible")[2, 3] == (1 + 5 * 3 + 2) / 1000
    assert scan["brdf"].sel(mode="transmission", side="back", channel="Visible")[2, 3] == (101 + 5 * 3 + 2) / 1000
    assert np.isnan(scan["brdf"].sel(mode="transmission", side="front")).all()
    assert "have no data" in scan.attrs["history"]
    assert "Name: Glass & film" in scan.attrs["provenance"].splitlines()
    assert "a sample of Columns" in scan.attrs["provenance"].splitlines()


def test_rows_are_the_transpose(tmp_path):
    columns, rows = matrix_scan(tmp_path), matrix_scan(tmp_path, "rows")
    np.testing.assert_array_equal(rows["brdf"].values, columns["brdf"].values.swapaxes(-1, -2))


def test_patch_centres_and_the_mirror_direction(tmp_path):
    scan = matrix_scan(tmp_path)
    np.testing.assert_array_equal(scan["theta_i"], [0, 50, 50, 50, 50])
    np.testing.assert_array_equal(scan["phi_i"], [180, 180, 90, 0, 270])
    # A column and the row of the same number are mirror directions of each other, azimuth 180.
    np.testing.assert_array_equal(np.diag(scan["phi"]), 180.0)


def test_klems_full_is_the_published_basis():
    theta, azimuth = klems.FULL.centres()
    assert np.unique(theta).tolist() == [0, 10, 20, 30, 40, 50, 60, 70, 82.5]
    assert [b.size for b in klems.BASES] == [145, 77, 41]
    np.testing.assert_array_equal(klems.FULL.index(theta, azimuth), np.arange(145))
    assert klems.from_text(str(klems.HALF)) == klems.HALF


def test_borders_of_patches():
    basis = klems.Basis("Coarse", (0.0, 20.0), (1, 4), 80.0)
    theta = np.array([0, 19.999, 20, 50, 50, 50, 80, 80.001])
    azimuth = np.array([77, 123, 0, 44.9, 45.1, -44.9, 90, 0])
    np.testing.assert_array_equal(basis.index(theta, azimuth), [0, 0, 1, 1, 2, 1, 2, -1])


def test_a_direction_has_the_value_of_its_patch(tmp_path):
    scan = matrix_scan(tmp_path)
    # theta_i 50, phi_i 85 is in column 2 (azimuth 180 - 85); phi_r = 85 + 100 goes to azimuth -185: row 3.
    found = evaluate(scan, [50, 85, 50], [40, 40, 40], 100.0, 85.0)
    assert found.shape == (2, 2, 1, 3)
    assert found[0, 0, 0, 0] == (1 + 5 * 3 + 2) / 1000
    assert np.isnan(found[..., 1]).all()  # no patch reaches to 85 deg
    assert found[0, 0, 0, 2] == found[0, 0, 0, 0]


def test_visible_with_x_and_z_is_y(tmp_path):
    scan = matrix_scan(tmp_path, "colours")
    assert scan["channel"].values.tolist() == ["Y", "X", "Z"]
    assert matrix_scan(tmp_path, "nanometres")["wavelength"].values.tolist() == [550.0]


@pytest.mark.parametrize("name", [n for n in texts() if not n.startswith("tree")])
def test_matrices_come_back_exactly(name, tmp_path):
    scan = matrix_scan(tmp_path, name)
    assert write(scan, tmp_path / "again.xml") is FORMAT
    again = read(tmp_path / "again.xml")
    xr.testing.assert_equal(again, scan)
    assert set(scan.attrs["provenance"].splitlines()) <= set(again.attrs["provenance"].splitlines())
    assert again.attrs["incident_basis"] == scan.attrs["incident_basis"]


def test_layout_is_klems_full_and_what_is_written_on_it_comes_back(tmp_path):
    layout = FORMAT.layout(xr.Dataset({"brdf": ("direction", [1.0])}))
    assert layout.sizes == {"incident": 145, "outgoing": 145}
    values = np.cos(np.radians(layout["theta_i"])) * 0.1 + layout["phi"] / 3e3 + 0.01
    scan = layout.assign(brdf=(("incident", "outgoing"), values.values, {"units": "sr-1"}))
    FORMAT.write(scan.drop_attrs(deep=False), tmp_path / "lobe.xml")
    again = FORMAT.read(tmp_path / "lobe.xml")
    assert again["brdf"].dims[:2] == ("mode", "channel")
    assert again.attrs["history"] == "front and back are one surface, turned over: kept once"
    assert again["channel"].values.tolist() == ["Visible"]
    np.testing.assert_array_equal(again["brdf"].values.squeeze(), values)
    xr.testing.assert_identical(FORMAT.layout(again).coords.to_dataset(), layout.coords.to_dataset())


def directions_in(path):
    return re.findall("<WavelengthDataDirection>(.*?)<", path.read_text())


def test_an_opaque_sample_is_seen_on_both_sides_and_one_that_names_its_side_on_that(tmp_path):
    """Radiance shows Reflection Front on the back of a polygon, whose front is black where that is all."""
    layout = FORMAT.layout(xr.Dataset({"brdf": ("direction", [1.0])}))
    values = np.cos(np.radians(layout["theta_i"])) * 0.1 + np.sin(np.radians(layout["phi"] + 20)) / 30 + 0.01
    scan = layout.assign(brdf=(("incident", "outgoing"), values.values, {"units": "sr-1"})).drop_attrs(deep=False)
    FORMAT.write(scan, tmp_path / "both.xml")
    assert directions_in(tmp_path / "both.xml") == ["Reflection Front", "Reflection Back"]
    assert "back of a polygon" in FORMAT.remark(scan)
    FORMAT.write(FORMAT.read(tmp_path / "both.xml"), tmp_path / "again.xml")
    assert (tmp_path / "again.xml").read_text().count("<ScatteringData>") == 2
    FORMAT.write(scan.assign_coords(side="front"), tmp_path / "front.xml")
    assert directions_in(tmp_path / "front.xml") == ["Reflection Front"]
    assert "black" in FORMAT.remark(scan.assign_coords(side="front"))
    assert FORMAT.remark(scan.assign_coords(side="back")) == ""
    assert FORMAT.read(tmp_path / "front.xml")["side"].values.tolist() == ["front"]
    two = re.sub(
        "Reflection Back(.*?)<ScatteringData>\n[^,]*",
        r"Reflection Back\1<ScatteringData>\n0.5",
        (tmp_path / "both.xml").read_text(),
        flags=re.DOTALL,
    )
    (tmp_path / "two.xml").write_text(two)
    assert FORMAT.read(tmp_path / "two.xml")["side"].values.tolist() == ["front", "back"]  # sides that differ are two


def test_the_back_of_a_sample_is_the_front_turned_over_about_x():
    """A direction at azimuth a about the front's normal is at -a after half a turn about x."""
    theta, azimuth = klems.FULL.centres()
    matrix = np.cos(np.radians(azimuth[:, None] - 20)) * theta[:, None] + np.sin(np.radians(azimuth))
    expected = np.cos(np.radians(-azimuth[:, None] - 20)) * theta[:, None] + np.sin(np.radians(-azimuth))
    np.testing.assert_allclose(sides.turned_over(matrix, klems.FULL, klems.FULL), expected, atol=1e-12)


def test_remarks_that_xml_cannot_hold_are_changed_not_lost(tmp_path):
    scan = matrix_scan(tmp_path).assign_attrs(provenance="a--b --- <c> &\nName: x < y\n\x01", history="")
    write(scan, tmp_path / "again.xml")
    lines = read(tmp_path / "again.xml").attrs["provenance"].splitlines()
    assert lines[:2] == ["a- -b - - - <c> &", "?"]
    assert "Name: x < y" in lines


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.isel(incident=slice(3)), "no Klems basis"),
        (lambda s: s.rename(incident="direction"), "convert it"),
        (lambda s: s.where(s["brdf"] != 0.018), "cannot store a gap"),
        (lambda s: s.where(s["brdf"] < 0), "no value to write"),
        (lambda s: s.assign_coords(mode=["reflection", "sideways"]), "sideways"),
        (lambda s: s.rename(channel="scan"), "tell several scan apart"),
    ],
)
def test_what_cannot_be_written_says_what_to_do(change, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        write(change(matrix_scan(tmp_path)), tmp_path / "new.xml")
    assert not (tmp_path / "new.xml").exists()


def test_the_square_and_the_disk_are_each_others_inverse_and_keep_areas():
    a, b = np.random.default_rng(1).uniform(0, 1, (2, 20_000))
    radius, azimuth = to_disk(a, b)
    np.testing.assert_allclose(to_square(radius, azimuth), (a, b), atol=1e-14)
    # Equal areas: r^2 and the azimuth of uniform points are uniform; means within four standard errors.
    error = 4 / np.sqrt(12 * a.size)
    assert abs(np.mean(radius**2) - 0.5) < error
    assert abs(np.mean(azimuth % (2 * np.pi)) / (2 * np.pi) - 0.5) < error
    corner, mid = to_disk(np.array(1.0), np.array(1.0)), to_disk(np.array(0.5), np.array(1.0))
    assert (float(corner[0]), float(corner[1])) == (1.0, np.pi / 4)
    assert (float(mid[0]), float(mid[1])) == (1.0, np.pi / 2)


def test_tree_of_rank_3_by_hand(tmp_path):
    """First coordinate fastest among branches, slowest in a grid; the half beyond 1/2 is not used."""
    scan = read(written(tmp_path, texts()["tree3"]))
    front = scan.isel(direction=np.flatnonzero(scan["side"] == "front"))
    # Branches 0, 2, 4 are leaves, and of branch 6, a grid of 8, the first coordinate's two halves are both used.
    assert sorted(front["brdf"].values.tolist()) == [*(n / 100 for n in range(1, 9)), 0.1, 0.3, 0.5]
    assert sorted(set(front["level"].values.tolist())) == [1, 2]
    assert scan.attrs["symmetry"] == "isotropic"
    # Light to azimuth 0 at 80 deg: first coordinate (1 - sin 80)/2, low. w_r at 10 deg, phi_r - phi_i = 225 deg:
    # azimuth -45 in the square's frame (180 - 225), so b low and a high: branch with bit 1 and not bit 2, number 2.
    found = evaluate(scan, 80.0, 10.0, 225.0, 123.0)
    assert found.shape == (1, 2, 1)  # mode, side, channel
    assert found.ravel().tolist() == [0.25, 0.3]  # back, front


def test_tree_of_rank_4_by_hand(tmp_path):
    scan = read(written(tmp_path, texts()["tree4"]))
    assert scan.sizes["direction"] == 15 + 16
    assert scan.attrs["symmetry"] == "anisotropic"
    own = evaluate(scan, *(scan[n].values for n in ("theta_i", "theta_r", "phi", "phi_i")))
    np.testing.assert_array_equal(own.ravel(), scan["brdf"].values)


def test_a_tree_without_its_levels_is_not_evaluated(tmp_path):
    scan = read(written(tmp_path, texts()["tree3"])).drop_vars("level")
    with pytest.raises(ValueError, match="no Klems matrix"):
        evaluate(scan, 10.0, 10.0, 0.0)


def tree_file(data):
    return file("TensorTree3", "", WAVELENGTH.format(unit="Integral", name="Visible", blocks=block(FRONT, TREE, data)))


def matrix_file(blocks, bases=BANDS, name="Visible", unit="Integral"):
    return file("Columns", bases, WAVELENGTH.format(unit=unit, name=name, blocks=blocks))


FRONT = "Reflection Front"
GOOD = block(FRONT, COARSE, matrix(1))


def line_of(text, part):
    return text[: text.index(part)].count("\n") + 1


BAD = {
    "bad-number": (matrix_file(GOOD.replace("0.013", "0.0x3")), "0.0x3", "'0.0x3', not a finite number"),
    "infinite": (matrix_file(GOOD.replace("0.013", "1e999")), "1e999", "'1e999', not a finite number"),
    "nan": (matrix_file(GOOD.replace("0.013", "nan")), "nan", "'nan'"),
    "underscore": (matrix_file(GOOD.replace("0.013", "1_0")), "1_0", "'1_0'"),
    "decimal-commas": (matrix_file(GOOD.replace("0.0", "0,0")), "<ScatteringData>", "50 values, not 5 x 5; are there"),
    "too-few": (matrix_file(GOOD.replace("0.013,", "")), "<ScatteringData>", "24 values, not 5 x 5"),
    "zero": (matrix_file(block(FRONT, COARSE, "0 " * 25)), "<ScatteringData>", "every brdf value is zero"),
    "no-basis": (matrix_file(GOOD, bases=""), "<ColumnAngleBasis>", "'Coarse', which the file does not define"),
    "twice": (matrix_file(GOOD + "\n" + GOOD), "<WavelengthDataBlock>", "occurs twice"),
    "direction": (matrix_file(GOOD.replace(FRONT, "Up")), "<WavelengthDataDirection>", "'up', not Reflection"),
    "type": (matrix_file(GOOD.replace("BRDF", "BXXF")), "<ScatteringDataType>", "'BXXF'"),
    "structure": (matrix_file(GOOD).replace("Columns</I", "Heap</I"), "<IncidentData", "'Heap', not Columns"),
    "no-data": (matrix_file(""), "<Layer>", "no WavelengthDataBlock"),
    "negative-band": (
        matrix_file(GOOD, BANDS.replace(">80<", ">-80<")),
        "<ThetaBounds><LowerTheta>20",
        "from 20 to -80",
    ),
    "gap-between-bands": (
        matrix_file(GOOD, BANDS.replace("<LowerTheta>20", "<LowerTheta>25")),
        "<ThetaBounds><LowerTheta>25",
        "begin at 20",
    ),
    "huge-count": (
        matrix_file(GOOD, BANDS.replace(">4<", ">4611686018427387904<")),
        "<AngleBasisBlock><Theta>50",
        "nPhis is",
    ),
    "negative-count": (matrix_file(GOOD, BANDS.replace(">4<", ">-4<")), "<AngleBasisBlock><Theta>50", "nPhis is '-4'"),
    "wavelength": (matrix_file(GOOD, name="-5", unit="nm"), "<Wavelength unit", "a wavelength is -5"),
    "unclosed-tree": (tree_file("{ 0.1"), "</ScatteringData>", "ends before its last"),
    "no-tree": (tree_file(" "), "</ScatteringData>", "there is no tree"),
    "branches": (tree_file("{ { 1 } { 2 }\n}"), "}\n</Sc", "2 branches, not 8"),
    "tree-infinite": (tree_file("{ {1} {2}\n{ 1e999 } {1} {1} {1} {1} {1} }"), "{ 1e999", "'1e999', not a finite"),
    "tree-word": (tree_file("{ {1} {2}\n{ 1x } {1} {1} {1} {1} {1} }"), "{ 1x", "'1x', not a finite"),
    "tree-underscore": (tree_file("{ {1} {2}\n{ 1_0 } {1} {1} {1} {1} {1} }"), "{ 1_0", "'1_0', not a finite"),
    "grid": (tree_file("{ 1 2 3 }"), "{ 1 2 3 }", "3 values, not a power of 8"),
    "stray": (tree_file("{ 1 }\n}"), "}\n</Sc", "'}' without '{'"),
    "mixed": (tree_file("{ { 1 } 2 }"), "{ { 1 } 2 }", "'2' where"),
    "after": (tree_file("{ 1 }\n{ 1 }"), "{ 1 }\n</Sc", "more after the tree's end"),
    "no-xml": (matrix_file(GOOD).replace("</Layer>", ""), "</Optical>", "no well-formed XML"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_with_their_line(name, tmp_path):
    text, part, message = BAD[name]
    expected = text.rindex(part) if name == "twice" else text.index(part)
    line = text[:expected].count("\n") + 1
    with pytest.raises(FormatError) as caught:
        read(written(tmp_path, text))
    assert message in caught.value.what
    assert caught.value.where == f"line {line}"


BILLION = '<!DOCTYPE x [\n<!ENTITY a "aaaa">\n<!ENTITY b "&a;&a;">]>\n<WindowElement>&b;</WindowElement>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BILLION, "document type or entities"),
        ('<!DOCTYPE x SYSTEM "http://nowhere.invalid/x.dtd">\n<WindowElement/>', "document type or entities"),
        (tree_file("{" * 1_000_000 + "}" * 1_000_000), "braces are nested more than 15 deep"),
        (tree_file("{" * 20_000), "braces are nested more than 15 deep"),
        ("<WindowElement>" * 1_000_000, "elements are nested more than 40 deep"),
        ("<WindowElement>" + "<a/>" * 200_000, "more than 100000 elements"),
        ('<?xml version="1.0" encoding="utf-7"?>\n<WindowElement/>', "encod"),
        (b"<WindowElement>\xff</WindowElement>", "no well-formed XML"),
        ("<WindowElement a='" + "x" * 3_000_000, "a tag is longer than 1048576 bytes"),
        (matrix_file(block("Reflection Front", COARSE, "1 " * 100_000)), "longer than 5 x 5 values need"),
    ],
    ids=["entities", "external", "braces", "open-braces", "elements", "many", "encoding", "bytes", "tag", "text"],
)
def test_hostile_files_are_refused_at_once(text, message, tmp_path):
    with pytest.raises(FormatError, match=message) as caught:
        read(written(tmp_path, text))
    assert caught.value.where.startswith("line ")
    assert "\n" not in str(caught.value)


def test_the_same_file_in_other_clothes(tmp_path):
    text = texts()["columns"]
    expected = read(written(tmp_path, text))
    commented = text.replace("0.011, ", "0.011, <!-- a\nremark -->", 1)
    utf16 = text.replace('encoding="UTF-8"', 'encoding="UTF-16"').encode("utf-16")
    for other in (
        b"\xef\xbb\xbf" + text.encode(),
        text.replace("\n", "\r\n"),
        text.replace("\n", "\r"),
        commented,
        utf16,
    ):
        xr.testing.assert_equal(read(written(tmp_path, other)), expected)
    bad = commented.replace("0.024", "wrong", 1)
    with pytest.raises(FormatError, match=f"line {line_of(bad, 'wrong')}: "):
        read(written(tmp_path, bad))


def test_samples_are_read_and_recognised(tmp_path):
    for path in samples(tmp_path):
        assert "as Radiance XML" in read(path).attrs["history"]


def test_own_definition_of_a_known_basis_is_taken(tmp_path):
    text = texts()["columns"].replace("Coarse", "LBNL/Klems Quarter")
    scan = read(written(tmp_path, text))
    assert scan.sizes["incident"] == 5
    assert "took the file's own definition of LBNL/Klems Quarter" in scan.attrs["history"]


def test_chromaticities_are_left_out_with_a_word(tmp_path):
    more = WAVELENGTH.format(unit="Integral", name="CIE-u", blocks=GOOD)
    scan = read(written(tmp_path, matrix_file(GOOD).replace("</Layer>", more + "</Layer>")))
    assert "left out CIE-u, a chromaticity" in scan.attrs["history"]
    assert scan["channel"].values.tolist() == ["Visible"]


def test_tree_of_one_value_holds_everywhere(tmp_path):
    scan = read(written(tmp_path, tree_file("{ 0.25 }")))
    assert scan.sizes["direction"] == 1
    found = evaluate(scan, [0.0, 89.9, 90.0], [90.0, 0.0, 45.0], [0.0, 180.0, 300.0])
    np.testing.assert_array_equal(found.ravel(), 0.25)

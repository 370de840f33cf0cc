"""The BiRD universal format: the published example and schema, and every way in which a file can be wrong."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from jsonschema import Draft202012Validator, FormatChecker
from referencing import Registry, Resource

from gonio import read, write
from gonio.files import FormatError
from gonio.measured.dataset import make_scan
from places import FILES
from samples.bird import plain, samples, shortest

SHARED = FILES / "bird"
NO_JSON = "sample_holder_json_schema_v1.0.json"  # as published it has commas too many; it asks for nothing
needs_shared = pytest.mark.skipif(not SHARED.is_dir(), reason=f"no published files at {SHARED}")


@pytest.fixture(scope="module")
def validator():
    """The published schema, every reference of which is among the files beside it."""
    resources = []
    for path in sorted((SHARED / "schema").glob("*.json")):
        text = path.read_text(encoding="utf-8")
        if path.name == NO_JSON:
            text = re.sub(r",(\s*[}\]])", r"\1", text)
        content = json.JSONDecoder().raw_decode(text)[0]
        resources.append((content["$id"], Resource.from_contents(content)))
    registry = Registry().with_resources(resources)
    root = next(r.contents for name, r in resources if name.endswith("/brdf_json_schema_v1.0.json"))
    return Draft202012Validator(root, registry=registry, format_checker=FormatChecker())


def problems(validator, path):
    found = validator.iter_errors(json.loads(path.read_text(encoding="utf-8")))
    return [f"{error.json_path}: {error.message[:200]}" for error in found]


def written(folder, document):
    path = folder / "file.json"
    text = document if isinstance(document, str | bytes) else json.dumps(document, indent=1)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@needs_shared
def test_the_published_example(validator):
    scan = read(SHARED / "example.brdf")
    np.testing.assert_array_equal(scan["brdf"], [0.254, 0.263, 0.267, 0.273, 0.281, 0.295, 0.296, 0.301])
    assert scan["brdf"].attrs["units"] == "sr-1"
    np.testing.assert_array_equal(scan["wavelength"], [550, 550, 650, 650, 750, 750, 850, 850])
    np.testing.assert_array_equal(scan["theta_i"], 0)
    np.testing.assert_array_equal(scan["theta_r"], 10)
    np.testing.assert_array_equal(scan["phi"], 60)
    # Stokes (1, 1, 0, 0) is horizontal, s; the schema's own words.
    assert scan["polarisation"].values.tolist() == ["s", "p"] * 4
    np.testing.assert_array_equal(scan["sample_width"], 1)
    assert scan["sample_width"].attrs["units"] == "mm"
    assert scan.attrs["symmetry"] == "isotropic"
    lines = scan.attrs["provenance"].splitlines()
    for line in ("provenance.organization: Aalto University", "sample.name: SRT1", "license.type: BY-SA"):
        assert line in lines
    assert problems(validator, SHARED / "example.brdf") == []


@needs_shared
def test_the_example_comes_back_with_all_its_metadata(validator, tmp_path):
    scan = read(SHARED / "example.brdf")
    write(scan, tmp_path / "again.json")
    again = read(tmp_path / "again.json")
    xr.testing.assert_equal(again, scan)
    assert again.attrs["provenance"] == scan.attrs["provenance"]
    assert problems(validator, tmp_path / "again.json") == []
    ours, theirs = (json.loads(p.read_text()) for p in (tmp_path / "again.json", SHARED / "example.brdf"))
    del ours["metadata"]["adhoc_section"]
    assert ours["metadata"] == theirs["metadata"]


@needs_shared
def test_what_is_written_is_valid_and_comes_back(validator, tmp_path):
    scan = make_scan(
        [10, 10, 30, 30.5],
        [5, 10, 45.25, 89],
        [0.1, 0.0, 1 / 3, 2e-7],
        [0, 180, 90.5, 359],
        uncertainty=[0.01, 0.02, 0.03, 0.04],
        coordinates={"channel": ["R", "R", "G", "µ"], "polarisation": ["s>p", ">u", "1 0.5 0 0.25>s", "u>u"]},
        variables={
            "uncertainty_systematic": ([0.1, 0.2, 0.3, 0.4], "sr-1"),
            "mask": (np.array([0, 1, 0, 2], dtype=np.int8), "1"),
            "stage": (["a", "b", "a b", ""], "1"),
        },
        provenance="material: aluminium, ünpolished\nsource: a test",
        history="made by hand",
    )
    scan["polarisation"] = ("direction", ["s>p", "p>u", "1 0.5 0 0.25>s", "u>u"])
    write(scan, tmp_path / "new.json")
    assert problems(validator, tmp_path / "new.json") == []
    again = read(tmp_path / "new.json")
    xr.testing.assert_equal(again, scan.set_coords("polarisation"))
    assert again.attrs["provenance"] == scan.attrs["provenance"]
    assert again.attrs["history"].splitlines()[0] == "made by hand"
    assert again["mask"].dtype == np.int8
    assert again["uncertainty_systematic"].attrs["units"] == "sr-1"


@needs_shared
def test_grazing_directions_are_valid_in_radians(validator, tmp_path):
    scan = make_scan([90, 45], [0, 90], [1.0, 2.0], [0, 180], phi_i=[10, 350])
    write(scan, tmp_path / "new.json")
    assert problems(validator, tmp_path / "new.json") == []
    again = read(tmp_path / "new.json")
    for name in ("theta_i", "theta_r", "phi", "phi_i"):
        np.testing.assert_allclose(again[name], scan[name], atol=1e-13)
    assert again["theta_i"].values.tolist() == [90.0, 45.0]


@needs_shared
@pytest.mark.parametrize("name", ["ualoft_aeroglaze", "jsss_mwir_copper"])
def test_real_scans_are_valid(name, validator, shared_scans, tmp_path):
    found = sorted(shared_scans.glob(f"{name}*.csv"))
    assert found, f"no scan {name}"
    scan = read(found[0])
    write(scan, tmp_path / "new.json")
    assert problems(validator, tmp_path / "new.json") == []
    xr.testing.assert_equal(read(tmp_path / "new.json"), scan.drop_vars("line"))


def test_units_and_azimuths(tmp_path):
    scan = read(samples(tmp_path)[0])
    np.testing.assert_allclose(scan["wavelength"], [550, 550, 650, 650], rtol=1e-15)
    np.testing.assert_array_equal(scan["wavelength_r"], [550, 600, 650, 700])
    np.testing.assert_array_equal(scan["theta_r"], np.degrees([0, 0.5, 1, 1.5]))
    np.testing.assert_array_equal(scan["phi_i"], [0, 10, 350, 90])
    np.testing.assert_array_equal(scan["phi"], [180, 180, 20, 270])
    np.testing.assert_allclose(scan["uncertainty"], [0.0025, 0.01, 5e-8, 0.06], rtol=1e-15)
    assert scan["polarisation"].values.tolist() == ["s>s", "p>p", "u>u", "s>1 0.5 0.25 0"]
    assert scan["channel"].values.tolist() == ["R", "G", "B", "R"]
    assert scan["temperature"].attrs["units"] == "K"
    assert "percent of the BRDF" in scan.attrs["history"]
    short = read(samples(tmp_path)[1])
    np.testing.assert_array_equal(short["uncertainty"], 0.01)
    assert "constant uncertainty" in short.attrs["history"]


@pytest.mark.parametrize(
    ("scan", "message"),
    [
        (make_scan([1], [2], [np.nan]), "no missing and no negative"),
        (make_scan([1], [2], [-1.0]), "no missing and no negative"),
        (make_scan([1], [2], [1.0], unit="a.u."), "calibrate"),
        (
            make_scan([1], [2], [1.0], coordinates={"mode": ["transmission"]}),
            "of transmission, and .* of reflection alone",
        ),
        (make_scan([1], [2], [1.0], coordinates={"polarisation": ["diagonal"]}), "'diagonal'"),
        (make_scan([1], [2], [1.0], variables={"x": ([np.nan], "1")}), "x has missing values"),
    ],
)
def test_what_cannot_be_written(scan, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        write(scan, tmp_path / "new.json")
    assert list(tmp_path.iterdir()) == []


def changed(*steps_and_value):
    *steps, last, value = steps_and_value
    document = plain()
    at = document["data"]
    for step in steps:
        at = at[step]
    if value is None:
        del at[last]
    else:
        at[last] = value
    return json.dumps(document, indent=1)


BAD = {
    "no-data": ('{\n"metadata": {}, "theta_i": 1}', "{", "no object 'data'"),
    "no-brdf": (changed("BRDF", None), '"data"', "no object 'BRDF'"),
    "no-angle": (changed("phi_r", None), '"data"', "no object 'phi_r'"),
    "short": (changed("theta_i", "values", [1, 2]), '"values": [\n    1', "theta_i has 2 values, and the BRDF 4"),
    "empty": (changed("theta_i", "values", []), '"values": []', "empty list"),
    "no-list": (changed("theta_i", "values", 7), '"values": 7', "no list of values"),
    "text": (changed("BRDF", "values", 2, "x"), '"x"', "a value of BRDF is x"),
    "true": (changed("BRDF", "values", 2, True), "true", "a value of BRDF is True"),
    "beyond": (changed("theta_r", "values", 1, 1.6), "1.6", "theta_r is 91.6732 deg, outside 0 to 90"),
    "below": (changed("theta_i", "values", 1, -1.25), "-1.25", "theta_i is -1.25 deg"),
    "turn": (changed("phi_i", "values", 3, 361), "361", "phi_i is 361 deg, outside 0 to 360"),
    "unit": (changed("phi_i", "unit", "turn"), '"turn"', "unit 'turn'"),
    "unit-brdf": (changed("BRDF", "unit", "%"), '"unit": "%",\n   "values": [\n    0.25', "unit '%'"),
    "wave": (changed("wavelength_r", "values", 1, 0), "0,\n    650", "wavelength_r is 0"),
    "state": (changed("polarization_i", "values", 1, "x"), '"x"', "polarization_i is 'x'"),
    "stokes": (changed("polarization_r", "values", 1, [1, 2.5, 0, 0]), "[\n     1,\n     2.5", "not 1 and three"),
    "notation": (changed("polarization_i", "notation", "jones"), '"s"', "notation 'jones'"),
    "uncertain": (changed("uBRDF", "values", 3, -2), "-2", "an uncertainty is -2"),
    "adhoc": (changed("adhoc_variables", "temperature", "values", [1]), "[\n     1\n", "temperature has 1 values"),
    "taken": (
        changed("adhoc_variables", "brdf", {"unit": "1", "values": [1, 2, 3, 4]}),
        '{\n    "unit": "1"',
        "rename",
    ),
    "zero": (changed("BRDF", "values", [0, 0, 0, 0]), "[\n    0,\n    0,\n    0", "every brdf value is zero"),
    "overflow": (changed("wavelength_i", "values", 0, 1e308), "1e+308", "too large"),
    "infinite": (changed("BRDF", "values", 0, 1e308).replace("1e+308", "1e999"), "1e999", "BRDF is inf"),
    "nan": (changed("BRDF", "values", 0, float("nan")), "NaN", "NaN is no JSON number"),
    "infinity": (changed("BRDF", "values", 0, float("-inf")), "-Infinity", "-Infinity is no JSON"),
    "twice": (changed("BRDF", "values", 0, 1).replace('"uBRDF"', '"BRDF"'), None, "'BRDF' occurs twice"),
    "comma": (changed("BRDF", "values", 0, 1).replace('"unit": "%",', '"unit": "%"'), None, "no JSON"),
    "deep": (changed("BRDF", "values", 0, 77).replace("77", "[" * 900_000), None, "more than 64 deep"),
    "many": (changed("BRDF", "values", 0, 77).replace("77", "[],\n" * 1_000_000), None, "more than 1000000 lists"),
    "deepest": (changed("BRDF", "values", 0, 77).replace("77", "[" * 2_000_000), None, "more than 1000000 lists"),
    "deep-objects": ('{"metadata": {}, "theta_i": ' + '{"a":' * 900_000, "{", "more than 64 deep"),
    "huge-number": (changed("BRDF", "values", 0, 77).replace("77", "9" * 100_000), None, "BRDF is inf"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_with_their_line(name, tmp_path):
    text, part, message = BAD[name]
    with pytest.raises(FormatError) as caught:
        read(written(tmp_path, text))
    assert message in caught.value.what
    assert "\n" not in str(caught.value)
    if part is None:
        assert re.fullmatch(r"line \d+", caught.value.where)
    else:
        line = text[: text.index(part)].count("\n") + 1
        assert caught.value.where == f"line {line}"


def test_the_second_of_two_equal_names_is_the_place(tmp_path):
    text = '{\n"metadata": {},\n"data": {"theta_i": 1,\n"x": [{"theta_i": 2}],\n"theta_i": 3}}'
    with pytest.raises(FormatError, match="line 5: the name 'theta_i' occurs twice"):
        read(written(tmp_path, text))


def test_what_is_no_text_is_refused_with_its_byte(tmp_path):
    with pytest.raises(FormatError, match=r"byte 12: is not UTF-8"):
        read(written(tmp_path, b'{"theta_i": \xff}'))


def test_byte_order_mark_and_line_ends(tmp_path):
    text = json.dumps(shortest(), indent=1)
    expected = read(written(tmp_path, text))
    for other in ("\ufeff" + text, text.replace("\n", "\r\n"), text.replace("\n", "\r")):
        xr.testing.assert_equal(read(written(tmp_path, other)), expected)


def test_what_the_format_does_not_know_is_left_out_with_a_word(tmp_path):
    scan = read(written(tmp_path, changed("extra", {"unit": "1", "values": [1]})))
    assert "left out extra" in scan.attrs["history"]
    vectors = {"unit": "1", "values": [[1], [2], [3], [4]]}
    scan = read(written(tmp_path, changed("adhoc_variables", "vectors", vectors)))
    assert "left out vectors" in scan.attrs["history"]

"""Built-in metals: the published rows, what they reflect, and where they say nothing."""

import re
import tomllib
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest

from gonio.materials import Material, constants, material, materials
from gonio.optics.fresnel import unpolarised
from places import ROOT

TABLES = tomllib.loads(Path(__file__).with_name("tables.toml").read_text(encoding="utf-8"))["tables"]


def normal_reflectance(name, wavelength_um):
    n, k = materials[name].at(wavelength_um)
    return float(unpolarised(np.array(1.0), n, k))


def test_every_built_in_has_its_published_rows_and_the_reverse():
    assert set(materials) == set(TABLES)
    assert all(materials[name].cite == table["cite"] for name, table in TABLES.items())


@pytest.mark.parametrize("name", TABLES)
def test_lines_are_the_interpolated_table(name):
    built_in, table = materials[name], TABLES[name]
    for column, digits in (("n", built_in.n), ("k", built_in.k)):
        expected = np.interp(built_in.wavelength_um, table["wavelength_um"], table[column])
        np.testing.assert_allclose(digits, expected, rtol=5.1e-4)
    assert table["wavelength_um"][0] <= built_in.wavelength_um[0]
    assert built_in.wavelength_um[-1] <= table["wavelength_um"][-1]


@pytest.mark.parametrize("name", TABLES)
def test_source_is_named_and_in_the_bibliography(name):
    built_in = materials[name]
    assert f"{{{built_in.cite}," in (ROOT / "references.bib").read_text(encoding="utf-8")
    assert "refractiveindex.info" in built_in.where
    assert built_in.note
    assert built_in.title
    assert built_in.lines
    assert not built_in.beyond or materials[built_in.beyond].beyond == name


def test_every_data_file_is_found_without_a_list():
    found = {path.name for path in files("gonio.materials").iterdir() if path.name.endswith(".toml")}
    assert {f"{m.cite}.toml" for m in materials.values()} == found


@pytest.mark.parametrize(
    ("name", "wavelength_um", "low", "high"),
    [
        ("aluminium", 0.6328, 0.90, 0.92),
        ("aluminium", 1.064, 0.93, 0.96),
        ("aluminium", 10.6, 0.98, 0.99),
        ("copper", 0.6328, 0.91, 0.96),
        ("copper", 0.532, 0.55, 0.65),  # copper is red
        ("copper-infrared", 10.6, 0.98, 0.995),
        ("gold", 0.6328, 0.93, 0.96),
        ("gold", 0.488, 0.35, 0.50),  # gold is yellow
        ("gold-infrared", 10.6, 0.98, 0.995),
        ("silver", 0.6328, 0.97, 0.99),
        ("silver-infrared", 10.6, 0.99, 0.998),
        ("nickel", 0.6328, 0.65, 0.72),
        ("chromium", 0.6328, 0.53, 0.58),
        ("iron", 0.6328, 0.50, 0.58),
        ("titanium", 0.6328, 0.50, 0.65),
        ("tungsten-infrared", 10.6, 0.97, 0.99),
    ],
)
def test_normal_reflectance_is_the_metal_s(name, wavelength_um, low, high):
    assert low < normal_reflectance(name, wavelength_um) < high


def test_metals_reflect_more_in_the_infrared():
    for name in materials:
        if materials[name].beyond and name.endswith("-infrared"):
            assert normal_reflectance(name, 10.6) > normal_reflectance(materials[name].beyond, 0.6328)


def test_rounded_names_of_lasers_are_known():
    assert material("aluminium").at(0.633) == material("aluminium").at(0.6328)
    assert material("aluminium").at(3.3912) == material("aluminium").at(3.39)
    assert material("aluminium").at(10.591) == material("aluminium").at(10.6)


@pytest.mark.parametrize("wavelength_um", [0.5, 0.6339, 0.85, 1.55, 10.7, 0.1, 100])
def test_between_lines_is_refused_with_the_list(wavelength_um):
    expected = rf"0.488, 0.5145, 0.532, 0.6328, 1.064, 3.39, 10.6 um only, and {wavelength_um:g} um is none"
    with pytest.raises(ValueError, match=re.escape(expected)):
        materials["aluminium"].at(wavelength_um)


def test_refusal_names_the_other_lines_of_the_metal():
    with pytest.raises(ValueError, match="or copper-infrared, or give a file"):
        materials["copper"].at(10.6)
    with pytest.raises(ValueError, match="take one of them, or give a file"):
        materials["copper"].at(0.7)


def test_arrays_keep_their_shape():
    n, k = materials["gold"].at([[0.6328, 1.064], [0.532, 0.488]])
    assert n.shape == k.shape == (2, 2)
    assert n[0, 0] == 0.1838
    assert k[1, 1] == 1.838
    n, k = materials["gold"].at([])
    assert n.shape == k.shape == (0,)


def test_constants_are_the_parameters_of_models():
    assert constants("copper", 632.8) == {"index": 0.27, "extinction": 3.408}
    assert all(type(v) is float for v in constants("copper", np.float32(632.8)).values())


def test_unknown_name_offers_the_nearest():
    with pytest.raises(KeyError, match="no material is called 'coper'; nearest: copper"):
        material("coper")
    with pytest.raises(ValueError, match="there is no such file"):
        material("coper.yml")


def test_values_cannot_be_changed():
    with pytest.raises(ValueError, match="read-only"):
        materials["gold"].n[0] = 2


@pytest.mark.parametrize(
    ("wavelength_um", "n", "k"),
    [
        ([], [], []),
        ([0.5, 0.6], [1.0], [0.0]),
        ([0.6, 0.5], [1.0, 1.0], [0.0, 0.0]),
        ([0.5, 0.5], [1.0, 1.0], [0.0, 0.0]),
        ([0.5], [0.0], [0.0]),
        ([0.5], [1.0], [-1.0]),
        ([0.5], [np.nan], [0.0]),
        ([-0.5], [1.0], [0.0]),
        (0.5, 1.0, 0.0),
    ],
)
def test_no_table_of_optical_constants(wavelength_um, n, k):
    with pytest.raises(ValueError, match="test: wavelength"):
        Material("test", "", "", "", np.array(wavelength_um), np.array(n), np.array(k))

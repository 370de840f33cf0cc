"""Exported files as Radiance, Eradiate's kernel and Raysect computed them, against the models.

`make crosscheck` writes the files anew, runs the programs and rewrites the values in reference/peers.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck.export_files import ERADIATE, RADIANCE, RAYSECT
from gonio import Geometry
from gonio.exporting.source import identifier
from gonio.exporting.targets.radiance.cal import evaluated
from gonio.plausibility import hemispherical_reflectance

PEERS = Path(__file__).parents[1] / "reference" / "peers"
SINGLE = 1e-6  # of the value: Radiance's colours are in single precision
DROPPED = 1e-6  # 1/sr: Radiance drops less of a function (FTINY in fvect.h)
OWN_LOBE = 1e-4  # of the value, of metal and plastic, whose lobe the source widens


@functools.cache
def peer(program):
    return json.loads((PEERS / f"{program}_export.json").read_text(encoding="utf-8"))


def directions(program):
    pairs = peer(program)["columns"]["pairs"]
    light = np.concatenate([[p["light"]] * len(p["views"]) for p in pairs])
    return Geometry(*light.T, *np.concatenate([p["views"] for p in pairs]).T)


def radiance_columns():
    return [name for name in peer("radiance")["columns"] if name != "pairs"]


def test_every_case_was_run():
    assert {name.split()[0] for name in radiance_columns()} == set(RADIANCE)
    assert {side for name in radiance_columns() for side in name.split()[1:2]} == {"front", "back"}
    assert peer("eradiate")["surfaces"].keys() == ERADIATE.keys()
    assert peer("raysect")["surfaces"].keys() == RAYSECT.keys()


@pytest.mark.parametrize("column", radiance_columns())
def test_radiance_gives_the_model_on_both_sides_of_a_polygon(column):
    name, _, *channel = column.split()
    case = RADIANCE[name]
    expected = np.asarray(case.brdf(directions("radiance"), channel[0] if channel else next(iter(case.sets))))
    found = np.array(peer("radiance")["columns"][column])
    exact = "BRTDfunc" not in peer("radiance")["surfaces"][f"{name}.rad"]["file"]
    bound = OWN_LOBE * expected if exact else SINGLE * expected + DROPPED
    assert expected.shape == found.shape
    assert len(found) >= 90
    assert np.all(np.abs(found - expected) <= bound)


@pytest.mark.parametrize("name", [name for name, case in RADIANCE.items() if not case.by])
def test_written_materials_computed_by_numpy_are_what_radiance_computed(name):
    """So that the check of an export, which runs no Radiance, can be trusted."""
    files = peer("radiance")["surfaces"]
    names = [f"{name}.rad", f"{identifier(name)}.cal"]
    texts = [files[file]["file"] for file in names if file in files]
    found = evaluated(texts, directions("radiance"))
    expected = np.array(peer("radiance")["columns"][f"{name} front"])
    np.testing.assert_allclose(found, expected, rtol=OWN_LOBE if len(texts) == 1 else SINGLE, atol=DROPPED)


@pytest.mark.parametrize("name", ERADIATE)
def test_eradiates_kernel_gives_the_model(name):
    found = np.array(peer("eradiate")["columns"][name])
    np.testing.assert_allclose(found, ERADIATE[name].brdf(directions("eradiate")), rtol=1e-6)


@pytest.mark.parametrize("name", RAYSECT)
def test_raysect_gives_the_model_and_reflects_as_much(name):
    case, kept = RAYSECT[name], peer("raysect")["surfaces"][name]
    found = np.array(peer("raysect")["columns"][name])
    np.testing.assert_allclose(found, case.brdf(directions("raysect")), rtol=1e-8)  # nine digits are kept

    def exchanged(g):  # a ray sees the light of all directions: what a viewer at theta gets
        return np.asarray(case.brdf(Geometry(*g[3:], *g[:3])))

    for theta, mean, error in zip(kept["theta"], kept["reflectance"], kept["standard_error"], strict=True):
        expected = hemispherical_reflectance(exchanged, theta)
        assert abs(mean - expected) <= 3 * error + 1e-6  # seven digits are kept
        assert error < 0.01 * expected

"""Exported plugins in Mitsuba 3: what `make crosscheck` found, held to what the page promises; and its pictures."""

import json

import pytest

from places import ROOT

FOUND = json.loads((ROOT / "tests" / "reference" / "peers" / "mitsuba_plugin.json").read_text(encoding="utf-8"))
RENDERS = json.loads((ROOT / "benchmarks" / "renders.json").read_text(encoding="utf-8"))
MODELS = [name for name in FOUND["columns"] if name != "several sets"]


def test_twelve_models_were_run():
    assert len(MODELS) == 12
    assert FOUND["surfaces"].keys() == set(MODELS)


@pytest.mark.parametrize("name", MODELS)
def test_a_plugin_agrees(name):
    found = FOUND["columns"][name]
    assert found["eval"] <= 1e-6
    assert found["eval scalar"] <= 1e-6
    assert len(found["chi-square passed"]) == 3
    assert all(found["chi-square passed"])
    assert all(abs(z) <= 2 for z in found["furnace"])
    assert max(found["gradient"].values()) <= 1e-4  # what the step of finite differences leaves
    assert found["sphere sum"] <= 1e-3
    assert found["sphere rms"] <= 1e-3


def test_channels_wavelengths_and_polarisation():
    assert max(FOUND["columns"]["several sets"].values()) <= 1e-6


@pytest.mark.parametrize("surface", RENDERS["surfaces"])
def test_rendered_surfaces_reflect_as_their_models(surface):
    found = RENDERS["surfaces"][surface]
    for (model, _), (rendered, _) in zip(found["reflectance"], found["in Mitsuba"], strict=True):
        assert rendered == pytest.approx(model, rel=0.01)


def test_the_page_has_the_pictures():
    page = (ROOT / "docs" / "howto" / "mitsuba.md").read_text(encoding="utf-8")
    for name in ("anoblack-nite", "starlink-array"):
        picture = ROOT / "docs" / "images" / f"mitsuba-{name}.png"
        assert f"../images/{picture.name}" in page
        assert picture.stat().st_size < 150_000

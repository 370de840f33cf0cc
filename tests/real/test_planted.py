"""Mistakes planted in measured scans are found under their names, and measured scans as they are raise no alarm."""

import json

import numpy as np
import pytest

import planted
from gonio import read
from gonio.files import FormatError
from gonio.findings import NAMES, Corrections, check
from gonio.measured import dataset
from places import ROOT
from surfaces import DATA

ENOUGH = 7 / 8  # of the plants of a kind: what is asked of the whole
FILES = sorted(path for folder in ("scans", "files") for path in (DATA / folder).rglob("*") if path.is_file())
MENDING = {  # what mends each plant of the first strength, but for the two where no value brings the old ones back
    "sign-reversed": {"flip": True},
    "azimuth-mirrored": {"mirror_azimuth": True},
    "cosine-left-in": {"divide_cosine": True},
    "radians": {"radians": True},
    "percent": {"divide": "100"},
    "factor-pi": {"divide": "pi"},
    "reflectance-above-one": {"divide": "5"},
    "angle-zero-shifted": {"shift_theta_r": -1.0},
}


@pytest.mark.usefixtures("shared_scans")
@pytest.mark.parametrize("name", planted.PLANTS)
def test_planted_mistakes_are_found_by_name(name):
    plant = planted.PLANTS[name]
    cases = [(scan, strength) for scan in plant.scans for strength in plant.strengths]
    missed = [(s, k) for s, k in cases if name not in planted.names_in(plant.make(planted.load(s), k))]
    assert len(missed) <= (1 - ENOUGH) * len(cases), missed


@pytest.mark.usefixtures("shared_scans")
@pytest.mark.parametrize("name", MENDING)
def test_the_remedy_brings_the_scan_back(name):
    plant = planted.PLANTS[name]
    right = dataset.flatten(planted.load(plant.scans[0]))
    wrong = plant.make(right, plant.strengths[0])
    (finding,) = [f for f in check(wrong) if f.name == name]
    flag = f"--{next(iter(MENDING[name]))}".replace("_", "-")
    assert flag in finding.remedy
    mended = Corrections(**MENDING[name]).mended(wrong)
    assert name not in planted.names_in(mended)
    np.testing.assert_allclose(mended["brdf"].values, right["brdf"].values, rtol=1e-12)
    for angle in dataset.ANGLES:  # radians came with 6 decimals, 3e-5 deg; at the normal phi has no meaning
        here = right["theta_r"].values > 0 if angle == "phi" else slice(None)
        np.testing.assert_allclose(mended[angle].values[here], right[angle].values[here], atol=3e-5)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_measured_files_as_they_are_raise_no_alarm(path):
    try:
        scan = read(path)
    except FormatError:
        pytest.skip("no scan")
    assert planted.names_in(scan) == []


def test_the_record_holds_every_mistake_and_no_false_alarm():
    record = json.loads((ROOT / "benchmarks" / "planted.json").read_text(encoding="utf-8"))
    assert set(record["planted"]) == set(NAMES) == set(planted.PLANTS)
    assert all(row["found"] >= ENOUGH * row["of"] for row in record["planted"].values())
    assert record["alarms"] == {}

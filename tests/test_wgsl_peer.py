"""WGSL that gonio prints, as wgpu computed it (make crosscheck), against the models: every one."""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck.wgsl_files import values_of
from gonio import Geometry, catalogue
from gonio.exporting.subject import of_model
from gonio.exporting.targets.shaders.proof import SINGLE, largest_error

PEER = Path(__file__).parent / "reference" / "peers" / "wgsl.json"
# As in tests/exporting/test_shaders.py: the same driver's atan2, asin and acos, and 8 112 terms of a sum.
WORSE = {"alternate-torrance-sparrow": 4e-5, "oren-nayar": 8e-5, "modified-beckmann-kirchhoff": 2e-4}


@functools.cache
def peer():
    return json.loads(PEER.read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", catalogue)
def test_wgsl_gives_what_the_model_gives(name):
    columns = peer()["columns"]
    assert name in columns, f"{name} is newer than the values: run `make crosscheck`"
    geometry = Geometry(*np.array(columns["pairs"]).T)
    model = catalogue[name]
    expected = np.asarray(of_model(model, values_of(model)).brdf(geometry))
    assert largest_error(np.array(columns[name]), expected) < WORSE.get(name, SINGLE)

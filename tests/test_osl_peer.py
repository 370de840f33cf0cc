"""OSL that gonio prints, rendered by Blender's Cycles (tests/crosscheck/osl_peer.py), against the models."""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck.wgsl_files import values_of
from gonio import Geometry, catalogue
from gonio.exporting.subject import of_model
from gonio.exporting.targets.shaders.proof import SINGLE, largest_error

PEER = Path(__file__).parent / "reference" / "peers" / "osl.json"


@functools.cache
def columns():
    return json.loads(PEER.read_text(encoding="utf-8"))["columns"]


@pytest.mark.parametrize("name", catalogue)
def test_osl_gives_what_the_model_gives(name):
    assert name in columns(), f"{name} is newer than the values: run tests/crosscheck/osl_peer.py"
    geometry = Geometry.from_degrees(*np.array(columns()["pairs"], dtype=float).T)
    model = catalogue[name]
    brdf = np.asarray(of_model(model, values_of(model)).brdf(geometry))
    assert largest_error(np.array(columns()[name]), brdf * np.asarray(geometry.cos_i)) < SINGLE

"""The kernels of pydirectional, which crosscheck/pydirectional_peer.py computed and tests/reference/peers keeps."""

import json

import numpy as np
import pytest

from gonio import Geometry, catalogue
from places import ROOT


@pytest.mark.parametrize("weight", ["fvol", "fgeo"])
def test_the_kernels_at_a_hundred_pairs_of_directions(weight):
    """Terms of gonio are the kernels over pi; phi 180 is the forward side in both."""
    kept = json.loads((ROOT / "tests" / "reference" / "peers" / "pydirectional.json").read_text(encoding="utf-8"))
    columns = {name: np.array(column) for name, column in kept["columns"].items()}
    g = Geometry.from_degrees(columns["theta_i"], columns["theta_r"], columns["phi"])
    found = np.pi * catalogue["ross-li"](g, {weight: 1.0})
    assert len(found) == 100
    assert found == pytest.approx(columns[weight], abs=1e-12, rel=1e-12)


def test_the_printed_vectors():
    """As the specification prints them, gonio's terms times pi."""
    printed = {
        (30, 45, 180): ("-0.12831130", "-1.54109265"),
        (30, 45, 0): ("0.18286948", "-0.20754458"),
        (0, 45, 0): ("-0.04586203", "-1.10681918"),
        (60, 60, 90): ("0.24601774", "-1.50000000"),
    }
    for angles, values in printed.items():
        g = Geometry.from_degrees(*map(float, angles))
        found = tuple(f"{np.pi * catalogue['ross-li'](g, {w: 1.0}):.8f}" for w in ("fvol", "fgeo"))
        assert found == values

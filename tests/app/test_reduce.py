"""`gonio reduce` of raw readings: what it prints and writes, what it refuses, and that nothing gets lost on the way."""

import json

import numpy as np
import pytest

from gonio import read
from gonio.raw import read_readings
from gonio.reduction import Filling, Known, Reduction, Relative, flags, reduce
from places import SHARED

FOLDER = SHARED / "raw" / "blacklab"
needs_files = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no measured files at {FOLDER}")
STANDARD = 1.02086
CERTIFICATE = f"{STANDARD}:factor@0,45"
OVER = Reduction(fill=Filling("over"))


@needs_files
def test_exactly_what_was_saturated_and_shaded_is_flagged(run, tmp_path):
    path, out = FOLDER / "nite_invar_a_l631h.inp.txt", tmp_path / "nite.csv"
    stated = ("--fill", "over", "--standard", CERTIFICATE, "--standard-signal", 4.816609 * STANDARD)
    code, text, err = run("reduce", path, *stated, "--out", out, "--json", "-")
    assert code == 0, err
    found = json.loads(text)["flags"]
    assert [(f["flag"], f["line"], f["theta_i"], f["theta_r"], f["phi"]) for f in found] == [
        ("saturated", 90, 70.0, 75.0, 180.0),
        ("saturated", 91, 70.0, 70.0, 180.0),
        ("shaded", 117, 70.0, 58.0, 0.0),
    ]
    again = read(out)
    assert np.flatnonzero(again["mask"].values).tolist() == [85, 86, 112]
    assert again["mask"].values[[85, 86, 112]].tolist() == [4, 4, 5]
    assert np.isfinite(again["brdf"].values).all()
    clean = reduce(
        read_readings(FOLDER / "z307_al_a_l631h.inp.txt"), Relative.parsed(CERTIFICATE, Known(9.17872)), OVER
    )
    assert flags(clean) == []

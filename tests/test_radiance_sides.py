"""Radiance shows what a file calls the front on the back of a polygon: so an opaque sample is written for both sides."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from crosscheck.radiance_files import opaque
from gonio import read, write
from gonio.formats.radiance.window import evaluate

PEER = json.loads((Path(__file__).parent / "reference" / "peers" / "radiance_sides.json").read_text(encoding="utf-8"))
ABOUT, COLUMNS = PEER["about"], PEER["columns"]
ROUNDED = 1e-4  # relative: the source has a width of 0.1 deg, and the values five digits


def test_the_front_of_a_polygon_is_black_with_the_files_front_alone():
    assert COLUMNS["front alone | front"] == [0.0] * 3
    assert COLUMNS["back alone | back"] == [0.0] * 3
    assert min(COLUMNS["both sides | front"] + COLUMNS["both sides | back"]) > 0
    assert COLUMNS["both sides | front"] == pytest.approx(COLUMNS["front alone | back"], rel=ROUNDED)


def test_what_gonio_writes_of_an_opaque_sample_is_what_radiance_shows_on_both_sides(tmp_path):
    (tmp_path / "peer.xml").write_text(opaque(("Front", "Back")))
    scan = read(tmp_path / "peer.xml")
    assert "side" not in scan.coords
    write(scan, tmp_path / "own.xml")
    directions = re.findall("<WavelengthDataDirection>(.*?)<", (tmp_path / "own.xml").read_text())
    assert directions == ["Reflection Front", "Reflection Back"]
    theta_r = np.array(ABOUT["theta_r"])
    found = np.ravel(evaluate(read(tmp_path / "own.xml"), ABOUT["theta_i"], theta_r, 180.0))
    for side in ("front", "back"):
        np.testing.assert_allclose(found, COLUMNS[f"both sides | {side}"], rtol=ROUNDED)

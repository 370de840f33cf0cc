"""RGL and KAIST files as Mitsuba 3 evaluates them, at the pairs of directions that reference/peers/rgl.json keeps.

`make crosscheck` compares 10 000 pairs of every real file and 1 000 of every synthetic one, and rewrites the numbers.
Differences are relative to the largest f cos(theta_r) among a file's pairs: the bar is 1e-5, some eighty roundings of
single precision, in which Mitsuba computes; 4.5e-6 is the worst of all pairs, beside the narrow lobe of a vinyl film.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck.rgl_agreement import BAR, differences
from gonio import read
from samples import pbsdf, rgl

PEER = json.loads((Path(__file__).parent / "reference" / "peers" / "rgl.json").read_text(encoding="utf-8"))
REAL = ("cg_sunflower_rgb", "colodur_napoli_4f_rgb", "paper_white_rgb", "satin_rosaline_rgb")


def largest_difference(path, name):
    pairs, expected = (np.array(PEER["columns"][n]).T for n in (f"directions {name}", name))
    error, value = differences(path, pairs, expected)
    assert len(error) > 0.9 * len(pairs)
    return np.abs(error).max(), abs(error.sum()) / value.sum() / error.shape[1]


@pytest.mark.parametrize("name", REAL)
def test_real_files(name, shared_scans):
    worst, bias = largest_difference(shared_scans.parent / "files" / "rgl" / f"{name}.bsdf", name)
    assert len(PEER["columns"][name][0]) == 500
    assert worst <= BAR
    assert bias <= BAR / 10


def test_synthetic_files(tmp_path):
    """Anisotropic over the whole circle, a half and a quarter of it; spectral; and those that gonio lays out."""
    for path in [*rgl.samples(tmp_path), *rgl.written(tmp_path)]:
        worst, bias = largest_difference(path, path.stem)
        assert worst <= BAR, path.stem
        assert bias <= BAR / 10, path.stem


def test_mueller_matrices(tmp_path):
    """All sixteen elements at the nodes above the horizon, in the frames that the reader states."""
    for path in pbsdf.samples(tmp_path):
        index, expected = (np.array(PEER["columns"][n]) for n in (f"nodes {path.name}", path.name))
        table = read(path)["mueller"].isel(wavelength=0).transpose("phi_d", "theta_d", "theta_h", ...).values
        found = table[tuple(index)]
        assert found.shape == (len(index.T), 4, 4)
        np.testing.assert_allclose(found.ravel(), expected, rtol=0, atol=BAR * np.abs(expected).max())


def test_the_numbers_kept_are_those_of_every_file(tmp_path):
    names = [p.stem for p in (*rgl.samples(tmp_path), *rgl.written(tmp_path))]
    assert PEER["surfaces"].keys() == {*REAL, *names, *(f"{n}.pbsdf" for n in pbsdf.VARIANTS)}
    for name, surface in PEER["surfaces"].items():
        assert surface["largest_difference"] <= BAR, name

"""Radiance XML against Radiance's own library: 1 000 pairs of directions a file (make crosscheck makes the values).

Radiance's z points to the side that files call the back, so gonio's directions are Radiance's turned by half a turn
about x. The peer keeps values in single precision, and where they vary over the hemisphere moves each by up to 3e-4 of
itself; neighbouring patches differ by a hundred times that, so that a wrong patch is seen.
"""

import functools
import json
from pathlib import Path

import numpy as np
import pytest

from crosscheck.radiance_files import FILES
from gonio import read
from gonio.formats.radiance.window import evaluate

PEER = Path(__file__).parent / "reference" / "peers" / "radiance.json"
MOVED = 3e-4


@functools.cache
def peer():
    return json.loads(PEER.read_text(encoding="utf-8"))


def directions():
    """theta_i, theta_r, phi, phi_i in gonio's frame, whether the light is reflected, and whether it meets the front."""
    theta_in, phi_in, theta_out, phi_out = np.array(peer()["columns"]["directions"]) / 1000
    front, reflected = theta_in > 90, (theta_in > 90) == (theta_out > 90)
    theta_i, theta_r = (np.where(t > 90, 180 - t, t) for t in (theta_in, theta_out))
    return (theta_i, theta_r, (phi_in - phi_out) % 360, -phi_in % 360), reflected, front


@pytest.mark.parametrize("name", [*FILES, "bsdf2klems", "bsdf2ttree"])
def test_every_direction_has_radiances_value(name, tmp_path):
    path = tmp_path / "file.xml"
    path.write_text(FILES[name]() if name in FILES else peer()["surfaces"][name]["file"])
    scan = read(path)
    angles, reflected, front = directions()
    found = evaluate(scan, *angles)
    modes, sides = ("reflection", "transmission"), ("back", "front")
    if "incident" in scan.dims:
        found = found[..., 0, :]
        modes, sides = scan["mode"].values.tolist(), scan["side"].values.tolist()
    else:
        found = found.reshape(2, 2, -1)
    mode = np.where(reflected, modes.index("reflection"), modes.index("transmission"))
    side = np.where(front, sides.index("front"), sides.index("back"))
    found = found[mode, side, np.arange(len(front))]
    expected = np.array(peer()["columns"][name])
    assert found.shape == expected.shape == (1000,)
    error = found / expected - 1
    assert np.abs(error).max() <= MOVED
    assert abs(error.mean()) <= MOVED / 10  # the peer's moves have no preferred sign


def test_the_files_hold_every_kind():
    kinds = {bool(a) * 2 + bool(b) for a, b in zip(*directions()[1:], strict=True)}
    assert kinds == {0, 1, 2, 3}
    assert {*FILES, "bsdf2klems", "bsdf2ttree", "directions"} == peer()["columns"].keys()

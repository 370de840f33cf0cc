"""The Ross-Thick Li-Sparse kernels by pydirectional, for tests/albedo/test_peers.py. Knows nothing of gonio.

    python tests/crosscheck/pydirectional_peer.py       writes tests/reference/peers/pydirectional.json

pip install pydirectional (National Physical Laboratory, LGPL-3).
"""

import importlib.metadata

import numpy as np
from peers import write
from pydirectional import RTLSBRDF

PAIRS = 100


def main():
    rng = np.random.default_rng(4)
    sun, view, azimuth = rng.uniform(0, 75, PAIRS), rng.uniform(0, 75, PAIRS), rng.uniform(0, 360, PAIRS)
    sun[:4], view[:4], azimuth[:4] = (30, 30, 0, 60), (45, 45, 45, 60), (180, 0, 0, 90)
    kernels = [RTLSBRDF(s, v, raa=a) for s, v, a in zip(sun, view, azimuth, strict=True)]
    columns = {"theta_i": sun, "theta_r": view, "phi": azimuth}
    for name, term in (("fvol", "volumetric"), ("fgeo", "geometric")):
        columns[name] = [float(np.ravel(getattr(one, term))[0]) for one in kernels]
    about = {
        "peer": "pydirectional",
        "version": importlib.metadata.version("pydirectional"),
        "value": "kernel, without the factor 1/pi; its azimuth of 180 deg is the forward side",
    }
    write("pydirectional.json", about, {n: np.asarray(c).tolist() for n, c in columns.items()}, {"ross-li": {}})


if __name__ == "__main__":
    main()

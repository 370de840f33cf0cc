"""Lumos-Sat's ABg against gonio's, both in double precision from NumPy arrays of unit vectors."""

import numpy as np
from lumos.brdf.library import ABG

from figures import Figure, paired
from gonio import catalogue
from gonio.evaluation import evaluate

PAIRS = 1_000_000
LEVEL, KNEE, SLOPE = 0.01, 0.001, 2.0
VALUES = {"A": LEVEL, "B": KNEE, "g": SLOPE}


def directions(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    z, azimuth = random.uniform(0.01, 1, PAIRS), random.uniform(0, 2 * np.pi, PAIRS)
    across = np.sqrt(1 - z * z)
    return across * np.cos(azimuth), across * np.sin(azimuth), z


def measure() -> Figure:
    wi, wo = directions(0), directions(1)
    peer, out = ABG(LEVEL, KNEE, SLOPE), np.zeros(PAIRS)
    theirs = peer(wi, (0.0, 0.0, 1.0), wo)
    largest = 0.0
    found = {}
    for library in ("jax", "numpy"):

        def ours(library: str = library) -> np.ndarray:
            return evaluate(catalogue["abg"], wi, wo, VALUES, library=library, out=out)

        largest = max(largest, float(np.max(np.abs(ours() / theirs - 1))))
        found[library] = paired(ours, lambda: peer(wi, (0.0, 0.0, 1.0), wo))
    if largest > 1e-9:
        raise ValueError(f"the two differ by {largest:.1e} of the value")
    more = {"pairs": PAIRS, "precision": "float64", "largest_difference": largest}
    return Figure(
        "lumos_over_evaluation", found["jax"].ratio, details=more | {k: t.details() for k, t in found.items()}
    )

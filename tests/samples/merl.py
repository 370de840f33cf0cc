"""Small MERL tables, simulated."""

from pathlib import Path

import numpy as np

SCALES = np.array([1.0 / 1500.0, 1.15 / 1500.0, 1.66 / 1500.0])


def table(shape: tuple[int, int, int], numbers: np.ndarray) -> bytes:
    """The bytes of a table of these dimensions and numbers (3, theta_h, theta_d, phi_d)."""
    return np.array(shape, "<i4").tobytes() + np.asarray(numbers, "<f8").tobytes()


def samples(folder: Path) -> list[Path]:
    """A reciprocal table with invalid cells, and one that covers the whole circle."""
    rng = np.random.default_rng(1)
    paths = []
    for name, shape in (("reciprocal", (6, 5, 8)), ("all_round", (2, 1, 360))):
        numbers = rng.lognormal(3, 2, (3, *shape))
        numbers[rng.random(numbers.shape) < 0.1] = -1.0
        paths.append(folder / f"{name}.binary")
        paths[-1].write_bytes(table(shape, numbers))
    return paths

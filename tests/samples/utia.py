"""A table in the one size that UTIA's files have, simulated."""

from pathlib import Path

import numpy as np


def samples(folder: Path) -> list[Path]:
    numbers = np.random.default_rng(2).lognormal(0, 1, (3, 6, 48, 6, 48))
    numbers[1, 2, 3] *= -1  # some files hold negative values
    path = folder / "anisotropic.bin"
    path.write_bytes(numbers.astype("<f8").tobytes())
    return [path]

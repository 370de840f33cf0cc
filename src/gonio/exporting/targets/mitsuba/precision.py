"""Whether a formula keeps its digits in single precision, in which Mitsuba computes."""

import numpy as np
import numpy.typing as npt

from gonio.exporting.subject import Subject
from gonio.geometry import Geometry

ALLOWED = 1e-6  # relative error of single precision: some ten roundings
SEEN = 1e-6  # of the largest value: what is less light than this
PAIRS = 3_000
LEAST_COSINE = 0.01  # half of the cosines are below a quarter, where formulas lose most digits


def needs_double(subject: Subject) -> bool:
    """Whether rounding changes a value by more than ALLOWED, somewhere in the hemisphere."""
    geometry = _rounded_pairs()
    single = Geometry(*(np.asarray(c, dtype=np.float32) for c in geometry))
    for label, values in subject.sets.items():
        exact = np.asarray(subject.brdf(geometry, label))
        with np.errstate(all="ignore"):
            found = np.asarray(subject.model(single, {n: np.float32(v) for n, v in values.items()}), dtype=float)
            rounded = np.asarray(subject.model(geometry, {n: float(np.float32(v)) for n, v in values.items()}))
        if not relative_error(found, rounded, exact) <= ALLOWED:
            return True
    return False


def relative_error(found: npt.ArrayLike, expected: npt.ArrayLike, scale: npt.ArrayLike) -> float:
    """The largest difference over the value, or over SEEN of the largest value where it is less."""
    size = np.abs(np.asarray(scale))
    floor = np.maximum(size, SEEN * np.max(size, initial=1e-30))
    return float(np.max(np.abs(np.asarray(found) - np.asarray(expected)) / floor, initial=0.0))


def _rounded_pairs() -> Geometry:
    """Directions that single precision holds exactly, so that only the formula is rounded."""
    random = np.random.default_rng(11)
    vectors = []
    for _ in range(2):
        z = LEAST_COSINE + (1 - LEAST_COSINE) * random.random(PAIRS) ** 2
        azimuth = random.uniform(0, 2 * np.pi, PAIRS)
        sine = np.sqrt(1 - z**2)
        vectors += [sine * np.cos(azimuth), sine * np.sin(azimuth), z]
    return Geometry(*(c.astype(np.float32).astype(float) for c in vectors))

"""The nine dispersion formulas of refractiveindex.info, by their numbers there; wavelengths in um."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

MOST_COEFFICIENTS = 64  # the definitions name 17 at most


@dataclass(frozen=True)
class Formula:
    """One dispersion formula with its coefficients c1, c2, .. in the order of the database.

    Raises ValueError for a number that is none of the nine and for a count of coefficients that it cannot have.
    """

    number: int
    coefficients: tuple[float, ...]

    def __post_init__(self) -> None:
        if self.number not in _FORMULAS:
            raise ValueError(f"there is no formula {self.number}: refractiveindex.info numbers them 1 to 9")
        count = len(self.coefficients)
        _, fits, wanted = _FORMULAS[self.number]
        if not fits(count) or count > MOST_COEFFICIENTS:
            raise ValueError(f"{self} has {count} coefficients where it takes {wanted}")

    def __str__(self) -> str:
        return f"formula {self.number}"

    def __call__(self, wavelength_um: np.ndarray) -> np.ndarray:
        """Refractive index at wavelengths [um]; NaN or infinite where the formula has no real value."""
        with np.errstate(all="ignore"):
            return _FORMULAS[self.number][0](np.array(self.coefficients), np.asarray(wavelength_um, dtype=float))


def _powers(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Sum of c1 w^c2 over pairs."""
    return sum((a * w**b for a, b in zip(c[::2], c[1::2], strict=True)), start=np.zeros_like(w))


def _resonances(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Sum of c1 w^2/(w^2 - c2) over pairs."""
    return sum((a * w**2 / (w**2 - b) for a, b in zip(c[::2], c[1::2], strict=True)), start=np.zeros_like(w))


def _sellmeier(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    squared = c.copy()
    squared[2::2] **= 2
    return _sellmeier_2(squared, w)


def _sellmeier_2(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    return np.sqrt(1 + c[0] + _resonances(c[1:], w))


def _polynomial(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    return np.sqrt(c[0] + _powers(c[1:], w))


def _database(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Up to two terms c1 w^c2/(w^2 - c3^c4), then powers."""
    squared = c[0] + _powers(c[9:], w)
    for start in range(1, min(len(c), 9), 4):
        a, b, d, e = c[start : start + 4]
        squared = squared + a * w**b / (w**2 - d**e)
    return np.sqrt(squared)


def _cauchy(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    return c[0] + _powers(c[1:], w)


def _gas(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    pairs = zip(c[1::2], c[2::2], strict=True)
    return 1 + c[0] + sum((a / (b - w**-2) for a, b in pairs), start=np.zeros_like(w))


def _herzberger(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    c = np.pad(c, (0, 6 - len(c)))
    near = 1 / (w**2 - 0.028)
    return c[0] + c[1] * near + c[2] * near**2 + c[3] * w**2 + c[4] * w**4 + c[5] * w**6


def _retro(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    """(n^2 - 1)/(n^2 + 2) is a resonance and a square."""
    ratio = c[0] + _resonances(c[1:3], w) + c[3] * w**2
    return np.sqrt((1 + 2 * ratio) / (1 - ratio))


def _exotic(c: np.ndarray, w: np.ndarray) -> np.ndarray:
    shift = w - c[4]
    return np.sqrt(c[0] + c[1] / (w**2 - c[2]) + c[3] * shift / (shift**2 + c[5]))


def _pairs_after_one(count: int) -> bool:
    return count % 2 == 1


def _terms_then_pairs(count: int) -> bool:
    return count in (1, 5) or (count >= 9 and count % 2 == 1)


_Index = Callable[[np.ndarray, np.ndarray], np.ndarray]
_FORMULAS: dict[int, tuple[_Index, Callable[[int], bool], str]] = {
    1: (_sellmeier, _pairs_after_one, "one and then pairs"),
    2: (_sellmeier_2, _pairs_after_one, "one and then pairs"),
    3: (_polynomial, _pairs_after_one, "one and then pairs"),
    4: (_database, _terms_then_pairs, "one, up to two groups of four and then pairs"),
    5: (_cauchy, _pairs_after_one, "one and then pairs"),
    6: (_gas, _pairs_after_one, "one and then pairs"),
    7: (_herzberger, lambda count: 1 <= count <= 6, "one to six"),
    8: (_retro, lambda count: count == 4, "four"),
    9: (_exotic, lambda count: count == 6, "six"),
}

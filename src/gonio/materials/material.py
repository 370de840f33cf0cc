"""A material: its complex refractive index n + i k over the wavelength, with the source of every value."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from gonio.materials.formulas import Formula

# How far a wavelength may lie from a tabulated line and still mean it: 1 nm, or the relative part where that is more.
# Lasers are named by rounded wavelengths (3.39 um is 3.3912, 10.6 um is 10.591), and no table is known to 0.1 %.
LINE_UM = 1e-3
LINE_RELATIVE = 1e-3
ROUNDING = 1e-9  # relative: 700 nm turned into um must not fall outside a table that ends at 0.7 um


@dataclass(frozen=True, eq=False)
class Material:
    """n and k at increasing wavelengths [um]; what they mean between these is said by `formula` and `lines`.

    `formula` gives n exactly where the source is a dispersion formula; n and k hold its values at the wavelengths
    listed. `lines` says that the wavelengths stand alone, so that nothing is known between them; `beyond` names the
    built-in that has other lines of the same metal. `cite` is a citation key, or the references that a file names.
    Raises ValueError for arrays that are no table of optical constants.
    """

    name: str
    title: str
    cite: str
    where: str
    wavelength_um: np.ndarray
    n: np.ndarray
    k: np.ndarray
    note: str = ""
    lines: bool = False
    beyond: str = ""
    formula: Formula | None = None

    def __post_init__(self) -> None:
        w, n, k = (np.array(a, dtype=float) for a in (self.wavelength_um, self.n, self.k))
        if w.ndim != 1 or not w.size or not w.shape == n.shape == k.shape:
            raise ValueError(f"{self.name}: wavelength, n and k must be rows of numbers of one length")
        if not np.isfinite([w, n, k]).all() or w[0] <= 0 or (np.diff(w) <= 0).any() or (n <= 0).any() or (k < 0).any():
            raise ValueError(
                f"{self.name}: wavelengths must be positive and increase, n be positive and k not negative"
            )
        for name, values in (("wavelength_um", w), ("n", n), ("k", k)):
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    def at(self, wavelength_um: Any) -> tuple[Any, Any]:
        """(n, k) at wavelengths [um], in their shape; floats for a single number.

        Between tabulated wavelengths both are interpolated linearly and not by a spline: a spline overshoots beside an
        absorption edge, where k would become negative, and lets the noise of distant points in.
        Raises ValueError outside the table, and between the lines of a material that is known at lines only.
        """
        asked = np.asarray(wavelength_um, dtype=float)
        if not np.isfinite(asked).all():
            raise ValueError(f"{self.name}: a wavelength is {asked[~np.isfinite(asked)].flat[0]}, not a number of um")
        n, k = self._at_lines(asked) if self.lines or self.wavelength_um.size == 1 else self._between(asked)
        return (float(n), float(k)) if asked.ndim == 0 else (n, k)

    def _at_lines(self, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        distance = np.abs(asked[..., None] - self.wavelength_um)
        far = distance.min(axis=-1) > np.maximum(LINE_UM, LINE_RELATIVE * asked)
        if far.any():
            first, listed = asked[far].flat[0], ", ".join(f"{w:g}" for w in self.wavelength_um)
            between = self.wavelength_um[0] < first < self.wavelength_um[-1]
            other = f" or {self.beyond}" if self.beyond and not between else ""
            raise ValueError(
                f"{self.name} is known at {listed} um only, and {first:g} um is none of these: "
                f"take one of them{other}, or give a file with a table over that wavelength"
            )
        nearest = distance.argmin(axis=-1)
        return self.n[nearest], self.k[nearest]

    def _between(self, asked: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        low, high = self.wavelength_um[0], self.wavelength_um[-1]
        outside = (asked < low * (1 - ROUNDING)) | (asked > high * (1 + ROUNDING))
        if outside.any():
            raise ValueError(
                f"{self.name} is known from {low:g} to {high:g} um, and {asked[outside].flat[0]:g} um is outside: "
                "nothing is extrapolated; give a file that covers it"
            )
        inside = np.clip(asked, low, high)
        k = np.interp(inside, self.wavelength_um, self.k)
        n = self.formula(inside) if self.formula else np.interp(inside, self.wavelength_um, self.n)
        real = np.isfinite(n) & (n > 0)
        if not real.all():  # a pole of the formula between the wavelengths that were looked at when it was read
            raise ValueError(f"{self.name}: {self.formula} gives no index at {asked[~real].flat[0]:g} um")
        return n, k

"""The spectrum of Speos's anisotropic files: the scale of the tables, and wavelengths as one table times a spectrum.

anisotropic.py has the layout of the files and the formula (ansys_bsdf).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gonio.formats import hemispheres
from gonio.formats.hemispheres import SAME, Values, in_words
from gonio.formats.speos.tables import FLAT, SpeosTable, reciprocal


@dataclass(frozen=True)
class Spectrum:
    """The spectrum of one mode: the angles at which it was measured [deg], wavelengths [nm], and percentages / 100."""

    theta_i: float
    anisotropy: float
    nm: Values
    parts: Values

    @property
    def is_flat(self) -> bool:
        """Whether it has several wavelengths and is constant."""
        return len(self.nm) > 1 and bool((self.parts == self.parts[0]).all())


def rounded(ratio: float) -> float:
    """A ratio to the highest percentage with 12 digits, so that it survives being written as a percentage."""
    return float(f"{ratio:.12g}")


def scale_of(places: Sequence[tuple[float, float]], tables: Sequence[SpeosTable], spectrum: Spectrum) -> float:
    """The factor by which the integral of the tables, at the spectrum's angles, becomes 1.

    It is NaN where a table that is needed has no integral, and 0 where the tables and the spectrum are zero.
    """
    angles = np.array([anisotropy for anisotropy, _ in places])
    away = np.abs((angles - spectrum.anisotropy + 180) % 360 - 180)
    near = angles == angles[away.argmin()]
    theta_i = np.array([theta_i for _, theta_i in places])[near]
    integrals = np.array([t.integral for t in tables])[near]
    order = np.argsort(theta_i)
    lower = max(int(np.searchsorted(theta_i[order], spectrum.theta_i, side="right")) - 1, 0)
    on_node = theta_i[order][lower] >= spectrum.theta_i or lower + 1 == len(order)
    used = [reciprocal(integral) for integral in integrals[order][lower : lower + 1 if on_node else lower + 2].tolist()]
    if math.isnan(sum(used)):
        empty = not any(t.values.any() for t in tables) and not spectrum.parts.any()
        return 0.0 if empty else math.nan
    return float(np.interp(spectrum.theta_i, theta_i[order][lower : lower + len(used)], used))


def separated(brdf: xr.DataArray, first: int, title: str) -> tuple[Values, tuple[float, list[str]]]:
    """One table (theta_i, phi_i, theta_r, phi) for all wavelengths, and its spectrum: incidence [deg] and rows.

    Raises ValueError where the values at the wavelengths are not one table times a spectrum.
    """
    values, nodes = brdf.values, (brdf["theta_r"].values, brdf["phi"].values)
    integrals = np.array(
        [[hemispheres.integral(*nodes, part[k, first]) for k in range(part.shape[0])] for part in values]
    )
    lit = integrals.max(axis=0)
    if values.any() and not lit.any():
        raise ValueError(f"{title} scales by the light at one orientation, and at the first there is none")
    incidence = int(np.flatnonzero(lit)[0]) if lit.any() else 0
    reference = int(integrals[:, incidence].argmax())
    highest = 100 * float(integrals[reference, incidence])
    base_table = values[reference]
    nm = brdf["wavelength"].values
    if np.isnan(nm).all():
        nm, percent = np.array(FLAT), [highest, highest]
    else:
        ratios = [_ratio(base_table, part, title) for part in values]
        percent = [ratio * highest for ratio in ratios]
    rows = [in_words(pair).replace(" ", "\t") for pair in zip(nm.tolist(), percent, strict=True)]
    return base_table, (float(brdf["theta_i"].values[incidence]), rows)


def _ratio(base: Values, other: Values, title: str) -> float:
    """The factor from `base` to `other`, rounded where that is exact. Raises ValueError where there is none."""
    top = np.unravel_index(int(base.argmax()), base.shape)
    ratio = float(other[top] / base[top]) if base[top] else 1.0
    exact = rounded(ratio)
    if (base * exact == other).all():
        return exact
    if np.abs(base * ratio - other).max() > SAME * base.max():
        raise ValueError(
            f"{title} holds one table times a spectrum, and the wavelengths differ by more than a factor: "
            "select one wavelength, or write speos-brdf"
        )
    return ratio

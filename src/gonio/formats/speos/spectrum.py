"""The spectrum beside Speos's anisotropic tables: what it scales them by, and wavelengths as one table times it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gonio.formats import hemispheres
from gonio.formats.hemispheres import SAME, Values, in_words
from gonio.formats.speos.tables import FLAT, Table, reciprocal


@dataclass(frozen=True)
class Spectrum:
    """What scales the tables of one mode: where it was measured [deg], nm, and the parts of one."""

    theta_i: float
    anisotropy: float
    nm: Values
    parts: Values

    @property
    def is_flat(self) -> bool:
        return len(self.nm) > 1 and bool((self.parts == self.parts[0]).all())


def rounded(ratio: float) -> float:
    """A part of the highest percentage to 12 digits, so that it survives being written as a percentage."""
    return float(f"{ratio:.12g}")


def scale_of(places: Sequence[tuple[float, float]], tables: Sequence[Table], spectrum: Spectrum) -> float:
    """What makes the integral of the tables one at the spectrum's angles; NaN where there is nothing to scale by."""
    angles = np.array([anisotropy for anisotropy, _ in places])
    away = np.abs((angles - spectrum.anisotropy + 180) % 360 - 180)
    near = angles == angles[away.argmin()]
    theta_i = np.array([theta_i for _, theta_i in places])[near]
    integrals = np.array([t.integral for t in tables])[near]
    order = np.argsort(theta_i)
    left = max(int(np.searchsorted(theta_i[order], spectrum.theta_i, side="right")) - 1, 0)
    on_node = theta_i[order][left] >= spectrum.theta_i or left + 1 == len(order)
    used = [reciprocal(whole) for whole in integrals[order][left : left + 1 if on_node else left + 2].tolist()]
    if math.isnan(sum(used)):
        empty = not any(t.values.any() for t in tables) and not spectrum.parts.any()
        return 0.0 if empty else math.nan
    return float(np.interp(spectrum.theta_i, theta_i[order][left : left + len(used)], used))


def separated(brdf: xr.DataArray, first: int, title: str) -> tuple[Values, tuple[float, list[str]]]:
    """The table of one mode (theta_i, phi_i, theta_r, phi), and its spectrum: incidence [deg] and rows.

    Raises ValueError where the wavelengths are not one table times a spectrum.
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
    one = values[reference]
    nm = brdf["wavelength"].values
    if np.isnan(nm).all():
        nm, percent = np.array(FLAT), [highest, highest]
    else:
        ratios = [_ratio(one, part, title) for part in values]
        percent = [ratio * highest for ratio in ratios]
    rows = [in_words(pair).replace(" ", "\t") for pair in zip(nm.tolist(), percent, strict=True)]
    return one, (float(brdf["theta_i"].values[incidence]), rows)


def _ratio(one: Values, other: Values, title: str) -> float:
    """The number that makes `one` to `other`, exactly where there is such a number."""
    top = np.unravel_index(int(one.argmax()), one.shape)
    ratio = float(other[top] / one[top]) if one[top] else 1.0
    exact = rounded(ratio)
    if (one * exact == other).all():
        return exact
    if np.abs(one * ratio - other).max() > SAME * one.max():
        raise ValueError(
            f"{title} holds one table times a spectrum, and the wavelengths differ in more: "
            "select one wavelength, or write speos-brdf"
        )
    return ratio

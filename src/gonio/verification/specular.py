"""A mirror of known constants against Fresnel's equations (guo2023, Fig 6).

The whole mirrored beam is on the detector, so its reflectance is a ratio of powers, without solid angle or cosine:

    R = (V_s - d) / M_s / ((V_i - d) / M_i / tau),

with the dark d of the same range between those before and after, the monitor M where there is one, and the
transmittance tau of the filter in the incident beam.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.optics.fresnel import reflectances
from gonio.verification.delta import Deviation, Values, delta

MIRROR = 0.5  # deg from the mirror direction, within which a reading is one of the mirrored beam
STATES = ("s", "p", "unpolarised")


@dataclass(frozen=True)
class Mirrored:
    """Reflectances of a mirror with what theory gives, of one polarisation.

    theta_i [deg], measured, theory, uncertainty (n,): the last is the standard uncertainty of the readings' scatter.
    error (n,): by how much theory for light of s or p, the worse of both, differs from that for unpolarised light,
    relative: what an unknown polarisation leaves open.
    """

    polarisation: str
    theta_i: Values
    measured: Values
    theory: Values
    uncertainty: Values
    error: Values

    def deviation(self, expanded: float = math.nan) -> Deviation:
        """Delta over all incidence angles. expanded: relative, k = 2; without it twice the scatter of the readings."""
        scatter = 2 * float(np.sqrt(np.mean((self.uncertainty / self.measured) ** 2)))
        what = f"{self.polarisation}, theta_i from {self.theta_i.min():g} to {self.theta_i.max():g} deg"
        known = expanded if math.isfinite(expanded) else scatter
        return Deviation(what, len(self.theta_i), delta(self.measured, self.theory), known)


def specular(raw: xr.Dataset, n: float, k: float, transmittance: float | None = None) -> Mirrored:
    """The reflectances of a mirror of complex index n + ik from readings, as `gonio.acquisition.readings` gives them.

    transmittance: of the filter in the incident beam; None takes the attribute `filter_transmittance`, or 1 where the
    readings of the incident beam name no filter.
    Raises ValueError where there is no reading of the mirrored or of the incident beam, or the transmittance is not
    known.
    """
    last = _counting(raw)
    kinds = last["kind"].values
    forward = (kinds == "sample") & (last["phi"].values == 180)
    mirror = forward & (np.abs(last["theta_r"].values - last["theta_i"].values) <= MIRROR)
    incident = kinds == "incident"
    for rows, what in ((mirror, "at theta_r = theta_i"), (incident, "of the incident beam")):
        if not rows.any():
            raise ValueError(f"there is no reading {what}: plan them, with --incident and theta_r at each theta_i")
    if last["overload"].values[mirror | incident].any():
        raise ValueError("a reading of the beam is overloaded: give the bench a larger range, or a filter")
    tau = _transmittance(raw, last["filter"].values[incident], transmittance)
    net = _net_of_dark(last, raw) / _monitor(last)
    beam = float(np.mean(net[incident])) / tau
    theta_i = last["theta_i"].values[mirror]
    order = np.argsort(theta_i, kind="stable")
    measured = (net[mirror] / beam)[order]
    noise = (last["sd"].values / np.sqrt(last["samples"].values) / _monitor(last))[mirror][order] / beam
    state = str(raw["polarisation"].values[0])
    r_s, r_p, *_ = reflectances(np.cos(np.radians(theta_i[order])), n, k)
    theory = {"s": r_s, "p": r_p}.get(state, (r_s + r_p) / 2)
    return Mirrored(state, theta_i[order], measured, theory, noise, polarisation_error(theta_i[order], n, k))


def polarisation_error(theta_i: npt.ArrayLike, n: float, k: float) -> Values:
    """By how much (relative) the reflectance of s light differs from that of unpolarised light, (n,) at theta_i [deg].

    That of p light differs by as much the other way.
    """
    r_s, r_p, *_ = reflectances(np.cos(np.radians(np.asarray(theta_i, dtype=float))), n, k)
    error: Values = np.abs(r_s - r_p) / (r_s + r_p)
    return error


def _counting(raw: xr.Dataset) -> xr.Dataset:
    """Of repeated attempts the last; an attempt counts from 0 in each step."""
    attempt = raw["attempt"].values
    again = np.append(attempt[1:] > attempt[:-1], False)
    return raw.isel(reading=np.flatnonzero(~again))


def _transmittance(raw: xr.Dataset, filters: npt.NDArray[np.str_], given: float | None) -> float:
    stated = raw.attrs.get("filter_transmittance") if given is None else given
    if stated is None and not any(filters.tolist()):
        return 1.0
    if stated is None or not 0 < float(stated) <= 1:
        raise ValueError("the transmittance of the filter in the incident beam is not known: give --transmittance")
    return float(stated)


def _monitor(raw: xr.Dataset) -> Values:
    monitor: Values = raw["monitor"].values
    return monitor if np.isfinite(monitor).all() else np.ones(len(monitor))


def _net_of_dark(last: xr.Dataset, raw: xr.Dataset) -> Values:
    """Signals less the dark of the same range, linear in time between the darks around them."""
    net: Values = last["signal"].values.astype(float)
    for name in np.unique(last["range"].values):
        darks = (raw["kind"].values == "dark") & (raw["range"].values == name)
        rows = last["range"].values == name
        if not darks.any():
            raise ValueError(f"there is no dark in the range {name}: measure again, with darks")
        net[rows] -= np.interp(last["time"].values[rows], raw["time"].values[darks], raw["signal"].values[darks])
    return net

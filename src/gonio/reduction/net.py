"""Readings without what is not the sample's light, and what they are compared with."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.reduction.causes import Context
from gonio.reduction.readings import OF_SETS, of_kind, place
from gonio.reduction.settings import Reduction
from gonio.reduction.standards import Absolute, Relative
from gonio.reduction.steps.dark import Darks, background, darks
from gonio.reduction.steps.detector import Known, linearised, ratios, transmittances
from gonio.reduction.steps.drift import Drift, drift
from gonio.reduction.steps.filling import OVER, Filling, solid_angle
from gonio.reduction.steps.zeros import moved_arm, tilted

Values = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Corrected:
    """The readings (readings,) of a set: `plain` without dark and background, `net` without the detector too.

    noise: random standard uncertainty of `net`, NaN where none is stated. rows: those of the sample, of which
    theta_i, theta_r, phi and the signed theta_r (n,) [deg] are to the normal of the sample. lines: what was done.
    """

    raw: xr.Dataset
    rows: Rows
    plain: Values
    net: Values
    noise: Values
    dark: Darks
    drift: Drift
    theta_i: Values
    theta_r: Values
    phi: Values
    lines: tuple[str, ...]

    @property
    def signed(self) -> Values:
        """theta_r [deg] of the sample's readings, positive on the forward side."""
        return np.where(np.cos(np.radians(self.phi)) < 0, self.theta_r, -self.theta_r) + 0.0


def corrected(raw: xr.Dataset, how: Absolute | Relative, by: Reduction) -> Corrected:
    """The readings of one set without dark, background, nonlinearity, gain, filter and drift, and their directions."""
    dark = darks(raw)
    plain = raw["signal"].values - dark.value
    ground = background(raw, plain)
    plain = plain - ground.value
    straight = linearised(plain, by.nonlinearity, by.level)
    rows = of_kind(raw, "sample")
    reference = of_kind(raw, "incident" if isinstance(how, Absolute) else "standard")
    # An absolute measurement states the transmittance of the filter before the incident beam with that reading.
    behind = rows if isinstance(how, Absolute) else np.concatenate([rows, reference])
    divisor = ratios(raw, by.gains) * transmittances(raw, behind, by.filters)
    moved = drift(raw, straight / divisor, by.drift)
    divisor = divisor * moved.factor
    noise = np.hypot(raw["sd"].values / np.sqrt(raw["samples"].values), ground.uncertainty)
    theta_i, theta_r, phi = (raw[name].values[rows].astype(float) for name in ("theta_i", "theta_r", "phi"))
    theta_r, phi = moved_arm(theta_r, phi, by.zero)
    if any(by.tilt):
        theta_i, theta_r, phi = tilted(theta_i, theta_r, phi, *by.tilt)
    told = [dark.line, ground.line, moved.line, *_told(by)]
    lines = tuple(line for line in told if line)
    net, spread = straight / divisor, noise / np.abs(divisor)
    return Corrected(raw, rows, plain, net, spread, dark, moved, theta_i, theta_r, phi, lines)


def _told(by: Reduction) -> list[str]:
    gains, taus = (", ".join(f"{n} {k.value:g}" for n, k in known.items()) for known in (by.gains, by.filters))
    return [
        f"corrected a nonlinearity of {by.nonlinearity:g} a decade about {by.level:g}" if by.nonlinearity else "",
        f"divided by the ratios of ranges: {gains}" if gains else "",
        f"divided by the transmittances of filters: {taus}" if taus else "",
        f"corrected the zero of the arm, {by.zero:g} deg" if by.zero else "",
        f"corrected a tilt of {by.tilt[0]:g} deg along and {by.tilt[1]:g} deg across the plane" if any(by.tilt) else "",
    ]


@dataclass(frozen=True)
class Reference:
    """What the readings of the sample are compared with.

    scale: f = net scale/weight, a number or (n,). signal, uncertainty: the reading, net of dark, with its random
    standard uncertainty. certified (n,): the relative uncertainty of the certificate. own (n,): the random relative
    uncertainty of a standard that was read at each direction. row: of the reading, -1 where the user states it.
    at: its theta_i and signed theta_r [deg], NaN for the incident beam. lines: what was done.
    """

    scale: Values | float
    signal: float
    uncertainty: float
    certified: Values
    own: Values
    row: int
    at: tuple[float, float]
    lines: tuple[str, ...]


def compared(read: Corrected, how: Absolute | Relative, fill: Filling) -> Reference:
    """The reference of the readings of a set.

    Raises ValueError where there is none, where it is stated and read, where a reading of it is not above zero, and for
    a standard that was not read at a direction of its certificate.
    """
    return _incident(read, how, fill) if isinstance(how, Absolute) else _standard(read, how, fill)


def _mean(read: Corrected, rows: Rows, what: str) -> tuple[float, float]:
    """The mean net signal of some readings, and its random standard uncertainty (0 where none is stated)."""
    for row in rows[~(read.net[rows] > 0)].tolist():
        raise ValueError(f"{place(read.raw, row)}: the net signal of {what} is {read.net[row]:.4g}, not above zero")
    stated = np.sqrt(np.sum(np.nan_to_num(read.noise[rows]) ** 2)) / len(rows)
    scatter = np.std(read.net[rows], ddof=1) / np.sqrt(len(rows)) if len(rows) > 1 else 0.0
    return float(read.net[rows].mean()), float(max(stated, scatter))


def _incident(read: Corrected, how: Absolute, fill: Filling) -> Reference:
    rows = of_kind(read.raw, "incident")
    if (how.incident is None) is (not len(rows)):
        what = (
            "is stated and read: leave one out"
            if len(rows)
            else "is not known: read it, or state --absolute incident=V"
        )
        raise ValueError(f"the incident beam {what}")
    if (fill.kind == OVER) is (how.share is None):
        what = "needs the share of the beam that is seen: state --absolute share=VALUE"
        raise ValueError(f"--fill {fill} {what if fill.kind == OVER else 'has no share: leave it out of --absolute'}")
    signal, u = how.incident if how.incident is not None else _mean(read, rows, "the incident beam")
    omega = solid_angle(how.radius.value, how.distance.value)
    scale = how.tau.value / signal / omega / (how.share.value if how.share else 1.0)
    zero = np.zeros(len(read.rows))
    behind = f"{signal:.6g} behind a filter of {how.tau.value:g}"
    lines = (f"absolute: by the incident beam, {behind}, and a solid angle of {omega:.7g} sr",)
    return Reference(scale, signal, u, zero, zero, int(rows[0]) if len(rows) else -1, (np.nan, np.nan), lines)


def _standard(read: Corrected, how: Relative, fill: Filling) -> Reference:
    raw, rows = read.raw, of_kind(read.raw, "standard")
    if how.signal is not None and len(rows):
        raise ValueError(f"{place(raw, int(rows[0]))}: the standard was read, and its signal is stated: leave one out")
    if how.signal is None and not len(rows):
        raise ValueError(
            f"no reading of the standard is among the kinds {', '.join(sorted(set(raw['kind'].values.tolist())))}: "
            "read it, or state its signal without dark, --standard-signal V"
        )
    sets = {n: raw[n].values[read.rows[0]] for n in OF_SETS}
    sets = {n: v for n, v in sets.items() if v == v and v != ""}
    if how.signal is not None:
        if how.brdf is None:
            raise ValueError("--standard-signal belongs to one certified direction: state VALUE:factor@theta_i,theta_r")
        return _at_one(read, how, fill, how.brdf, (how.theta_i, abs(how.theta_r)), -1)
    places = {_place(raw, row) for row in rows.tolist()}
    if len(places) > 1:
        return _at_each(read, how, fill, sets)
    row = int(rows[0])
    known = how.at(*_place(raw, row), sets)
    if known is None:
        angles = ", ".join(f"{n} {v:g}" for n, v in zip(("theta_i", "theta_r", "phi"), _place(raw, row), strict=True))
        raise ValueError(
            f"{place(raw, row)}: the standard was read at {angles} deg, and has no certificate there: read it at its "
            "certified direction, or give its BRDF as a scan"
        )
    return _at_one(read, how, fill, known, _place(raw, row)[:2], row)


def _place(raw: xr.Dataset, row: int) -> tuple[float, float, float]:
    theta_i, theta_r, phi = (float(raw[n].values[row]) for n in ("theta_i", "theta_r", "phi"))
    return theta_i, theta_r, phi


def _at_one(
    read: Corrected, how: Relative, fill: Filling, known: Known, at: tuple[float, float], row: int
) -> Reference:
    """By one direction of the standard: f = f_std V/V_std g(standard)/g."""
    rows = of_kind(read.raw, "standard")
    signal, u = how.signal if how.signal is not None else _mean(read, rows, "the standard")
    value, uncertainty = known
    scale = value * float(fill.weight(*at)) / signal
    count = len(read.rows)
    where = f"theta_i {at[0]:g}, theta_r {at[1]:g} deg"
    lines = (f"relative: to a standard of f = {value:.7g} 1/sr at {where}, which read {signal:.6g}",)
    return Reference(scale, signal, u, np.full(count, uncertainty / value), np.zeros(count), row, at, lines)


def _at_each(read: Corrected, how: Relative, fill: Filling, sets: dict[str, float]) -> Reference:
    """Direction by direction, f = f_std V/V_std: cosines and fields of view cancel."""
    raw, rows = read.raw, of_kind(read.raw, "standard")
    at: dict[tuple[float, ...], list[int]] = {}
    for row in rows.tolist():
        at.setdefault(tuple(np.round(_place(raw, row), 3)), []).append(row)
    scale, certified, own = (np.zeros(len(read.rows)) for _ in range(3))
    weight = fill.weight(read.theta_i, read.theta_r)
    for k, row in enumerate(read.rows.tolist()):
        where = _place(raw, row)
        some, known = at.get(tuple(np.round(where, 3))), how.at(*where, sets)
        if some is None or known is None:
            lack = "the standard was not read" if some is None else "the standard has no certificate"
            angles = ", ".join(f"{n} {v:g}" for n, v in zip(("theta_i", "theta_r", "phi"), where, strict=True))
            raise ValueError(
                f"{place(raw, row)}: {lack} at {angles} deg: complete it, or read it at one direction alone"
            )
        signal, u = _mean(read, np.array(some), "the standard")
        scale[k], certified[k], own[k] = known.value / signal * weight[k], known.relative, u / signal
    signal = float(read.net[rows].mean())
    lines = (f"relative: to a standard that was read at each direction, {len(rows)} readings",)
    return Reference(scale, signal, 0.0, certified, own, -1, (np.nan, np.nan), lines)


def context(
    read: Corrected, reference: Reference, brdf: tuple[Values, Values], fill: Filling, how: Absolute | Relative,
    by: Reduction,
) -> Context:  # fmt: skip
    """What the causes need to know. brdf: the values (n,) [1/sr], and the signature that was taken from them."""
    raw, rows, row = read.raw, read.rows, reference.row
    several = len(read.dark.lines) > 1
    plain = read.plain[rows]
    return Context(
        net=np.where(plain == 0, 1e-12 * (np.abs(plain).max() or abs(reference.signal)), plain),
        brdf=brdf[0],
        theta_i=read.theta_i,
        signed=read.signed,
        fill=fill,
        how=how,
        reference=reference.signal if row < 0 else float(read.plain[row]),
        reference_uncertainty=reference.uncertainty * (1.0 if row < 0 else float(read.plain[row]) / reference.signal),
        reference_at=reference.at,
        certified=reference.certified,
        dark_names=tuple(f"dark[{line}]" for line in read.dark.lines) if several else ("dark",) * len(read.dark.sizes),
        dark_shares=read.dark.weights[:, rows],
        dark_sizes=read.dark.sizes,
        dark_reference=read.dark.weights[:, row] if row >= 0 else np.zeros(len(read.dark.sizes)),
        ranges=tuple(raw["range"].values[rows].tolist()),
        reference_range=str(raw["range"].values[row]) if row >= 0 else "",
        filters=tuple(raw["filter"].values[rows].tolist()),
        reference_filter=str(raw["filter"].values[row]) if row >= 0 else "",
        gains=by.gains,
        taus=by.filters,
        elapsed=read.drift.elapsed[rows],
        reference_elapsed=float(read.drift.elapsed[row]) if row >= 0 else 0.0,
        left=read.drift.left,
        polarised=np.full(len(rows), np.nan),
        stray=brdf[1],
    )

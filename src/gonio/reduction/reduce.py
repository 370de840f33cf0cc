"""From raw readings to a scan: every step on the readings of one set, in the order in which the light met the parts.

    V' = V - dark(t)                the dark between the readings before and after
    V' = V' - background            of a light trap, scaled by the flux
    V' = V'/(1 + a log10(V'/V0))    the detector's nonlinearity
    V' = V'/(gain tau drift)        its range, the filter before it, the source
    f  = V'/(V'_i/tau)/(Omega g)                absolute, or
    f  = f_std V'/V'_std g(standard)/g          relative to a standard, with g of `filling`

Nothing is clipped and nothing is left out: a reading that is no measurement of the sample gets a flag and a number in
the scan's mask.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import in_common, with_causes
from gonio.measured.dataset import ABSOLUTE, DIRECTIONS, MASK_MEANINGS, make_scan
from gonio.reduction import flags as flagging
from gonio.reduction.causes import NEIGHBOURS, parts, refuse_unknown
from gonio.reduction.net import Corrected, Reference, compared, context, corrected
from gonio.reduction.readings import LINE, OF_SETS, checked, of_kind, place
from gonio.reduction.settings import Reduction
from gonio.reduction.standards import Absolute, Relative
from gonio.reduction.steps.filling import Filling
from gonio.reduction.steps.signature import TOO_MUCH
from gonio.reduction.steps.unsteady import drifted

Values = npt.NDArray[np.float64]
Place = tuple[float, ...]
AS_STATED = Reduction()  # as the attributes of the readings say
GRAZING = 89.99  # deg, from which a cosine divides nothing


def reduce(raw: xr.Dataset, how: Absolute | Relative, by: Reduction = AS_STATED) -> xr.Dataset:
    """The scan of raw readings, one direction for each reading of the sample, in their order.

    raw: as `readings` declares it. how: what the readings are compared with. Equations: `filling` and the head of this
    file (NIST SP 250-48; JCGM 100 for the uncertainties). The scan has `brdf` [1/sr], `uncertainty` (random),
    `systematic` by cause, `mask` with the flags of single readings, and the attribute `flags`, a JSON list of them.
    Raises ValueError, with the line and the remedy, for a filling that nobody states, a standard without a certificate
    or a reading, a theta_r of 90 deg, and for what any of the steps refuses.
    """
    raw = checked(raw)
    fill = by.fill or Filling.parsed(str(raw.attrs.get("fill", "")))
    refuse_unknown(by.uncertainties)
    rows = of_kind(raw, "sample")
    if not len(rows):
        raise ValueError("there is no reading of a sample: mark them by kind = sample")
    _refuse_grazing(raw, rows)
    keys = [_key(key) for key in zip(*(raw[name].values.tolist() for name in OF_SETS), strict=True)]
    order = list(dict.fromkeys(keys[row] for row in rows.tolist()))
    ratios = _polarised(raw, how, by) if by.uncertainties.get("polarisation") else {}
    done = [_one_set(_of_set(raw, keys, key), fill, how, by, ratios) for key in order]
    scans = [scan for scan, _ in done]
    places = [row for key in order for row in rows.tolist() if keys[row] == key]
    scan = together(scans, places)
    found = [flag for _, some in done for flag in some]
    lines = list(dict.fromkeys(line for one in scans for line in one.attrs["history"].splitlines()))
    said = [f"flagged {flag['flag']}, line {flag['line']}: {flag['reason']}" for flag in found]
    return scan.assign_attrs(
        history="\n".join([*lines, *said]),
        provenance=str(raw.attrs.get("provenance", "")),
        flags=json.dumps(found),
        fill=str(fill),
    )


def flags(scan: xr.Dataset) -> list[dict[str, Any]]:
    """The flags of single readings that `reduce` gave a scan."""
    found: list[dict[str, Any]] = json.loads(str(scan.attrs.get("flags", "[]")))
    return found


def _key(key: tuple[Any, ...]) -> tuple[Any, ...]:
    """What a reading says of its set, None for what it does not say."""
    return tuple(None if k != k else k for k in key)


def _of_set(raw: xr.Dataset, keys: list[tuple[Any, ...]], key: tuple[Any, ...]) -> xr.Dataset:
    """The readings of one set, and those that say none, which belong to all."""
    own = [all(k in (None, "") or k == w for k, w in zip(of, key, strict=True)) for of in keys]
    exact = [of == key for of in keys]
    return raw.isel(reading=np.flatnonzero(np.where(raw["kind"].values == "sample", exact, own)))


def _places(scan: xr.Dataset) -> list[Place]:
    """The direction and wavelength of each value."""
    names = [n for n in (*DIRECTIONS, "wavelength") if n in scan.coords]
    return list(zip(*(np.round(scan[n].values, 3).tolist() for n in names), strict=True))


def _polarised(raw: xr.Dataset, how: Absolute | Relative, by: Reduction) -> dict[Place, float]:
    """The ratio f01/f00 = (f_s - f_p)/(f_s + f_p) at each direction that was read in s and in p."""
    sizes = {name: size for name, size in by.uncertainties.items() if name != "polarisation"}
    scan = reduce(raw, how, replace(by, uncertainties=sizes))
    states = scan["polarisation"].values.tolist() if "polarisation" in scan.coords else [""] * scan.sizes["direction"]
    found: dict[str, dict[Place, float]] = {"s": {}, "p": {}}
    for place_of, state, value in zip(_places(scan), states, scan["brdf"].values.tolist(), strict=True):
        found.setdefault(state, {})[place_of] = value
    s, p = found["s"], found["p"]
    return {at: (s[at] - p[at]) / (s[at] + p[at]) for at in s if at in p and s[at] + p[at] != 0} or {(): np.nan}


def _refuse_grazing(raw: xr.Dataset, rows: npt.NDArray[np.intp]) -> None:
    for name in ("theta_r", "theta_i"):
        for row in rows[raw[name].values[rows] >= GRAZING].tolist():
            raise ValueError(
                f"{place(raw, row)}: {name} is {raw[name].values[row]:g} deg, where nothing is seen and the cosine "
                "divides by zero: delete the reading"
            )


def _one_set(
    raw: xr.Dataset, fill: Filling, how: Absolute | Relative, by: Reduction, ratios: Mapping[Place, float]
) -> tuple[xr.Dataset, list[dict[str, Any]]]:
    """The scan of the readings of one set, and its flags."""
    read = corrected(raw, how, by)
    reference = compared(read, how, fill)
    weight = fill.weight(read.theta_i, read.theta_r)
    brdf = read.net[read.rows] * reference.scale / weight
    stray = np.zeros(len(brdf))
    if by.signature is not None:
        stray = by.signature.share(read.theta_i, read.signed)
    random = _random(read, reference, brdf, reference.scale / weight)
    found = [*_flags(read, brdf - stray, random, stray)]
    mask = np.zeros(len(brdf), dtype=np.int8)
    for flag in found:
        mask[flag.row] = mask[flag.row] or flag.code
    of = context(read, reference, (brdf - stray, stray), fill, how, by)
    if ratios:
        of = replace(
            of, polarised=np.array([ratios.get(at, np.nan) for at in _places(_scan(read, brdf, random, mask))])
        )
    changes = parts(of, by.uncertainties)
    # A reading of zero has no relative uncertainty: its shifts are those of a reading so small that it is zero too.
    net = read.net[read.rows]
    whole = np.where(net == 0, of.net * reference.scale / weight, brdf)
    shifts = {name: change * (brdf - stray if name == "stray" else whole) for name, change in changes.items()}
    scan = with_causes(_scan(read, brdf - stray, random, mask), shifts)
    where = [{n: float(scan[n].values[flag.row]) for n in ("theta_i", "theta_r", "phi")} for flag in found]
    line = raw[LINE].values[read.rows]
    records = [flagging.record(flag, int(line[flag.row]), at) for flag, at in zip(found, where, strict=True)]
    history = [*read.lines, *reference.lines, *_filled(fill), *_stray_line(by), *_alone(by, of.lone)]
    return scan.assign_attrs(history="\n".join(history)), records


def _filled(fill: Filling) -> list[str]:
    seen = {
        "under": "the whole spot is seen: divided by cos(theta_r)",
        "over": "a part of a wide beam is seen: divided by cos(theta_i)",
    }
    return [seen.get(fill.kind, f"a Gaussian beam and a field of view, {fill}: divided by kappa cos(theta_r)")]


def _alone(by: Reduction, count: int) -> list[str]:
    if not count or not {"zero", "tilt"} & set(by.uncertainties):
        return []
    return [f"{count} readings have no neighbour within {NEIGHBOURS:g} deg: zero and tilt move their cosine alone"]


def _stray_line(by: Reduction) -> list[str]:
    if by.signature is None:
        return []
    return [f"subtracted the signature of the instrument times {by.signature.specular:g}/cos(theta_r)"]


def _random(read: Corrected, reference: Reference, brdf: Values, per_signal: Values) -> Values:
    """The random standard uncertainty (n,) of the values, NaN where nothing states one. per_signal: f over signal."""
    return np.hypot(read.noise[read.rows] * np.abs(per_signal), np.nan_to_num(reference.own) * np.abs(brdf))


def _flags(read: Corrected, brdf: Values, random: Values, stray: Values) -> list[flagging.Flag]:
    raw, rows = read.raw, read.rows
    signal, sd = raw["signal"].values[rows], raw["sd"].values[rows]
    found = [*flagging.saturated(signal, sd, raw["overload"].values[rows] != 0), *flagging.negative(read.net[rows])]
    cut = {flag.row for flag in found if flag.name == "saturated"}
    in_plane = np.isclose(np.abs((read.phi + 90) % 180 - 90), 0)
    usable = np.array([bool(p) and k not in cut for k, p in enumerate(in_plane)], dtype=bool)
    some = np.flatnonzero(usable)
    for flag in flagging.shaded(read.theta_i[some], read.signed[some], brdf[some], random[some]):
        found.append(flagging.Flag(flag.name, int(some[flag.row]), flag.reason))
    found += drifted(read)
    for row in np.flatnonzero(stray > TOO_MUCH * np.abs(brdf + stray)).tolist():
        found.append(flagging.Flag("instrument", row, "more than a third of the value is the instrument's signature"))
    return sorted(found, key=lambda flag: flag.row)


def _scan(read: Corrected, brdf: Values, random: Values, mask: npt.NDArray[np.int8]) -> xr.Dataset:
    """The values as a scan, without systematic uncertainties."""
    raw, rows = read.raw, read.rows
    coordinates = {}
    for name in OF_SETS:
        values = raw[name].values[rows]
        is_number = values.dtype.kind == "f"
        if (np.isfinite(values) if is_number else values != "").all():
            coordinates[name] = values
    phi_i = raw["phi_i"].values[rows]
    scan = make_scan(
        read.theta_i,
        read.theta_r,
        brdf,
        read.phi,
        phi_i=phi_i if np.isfinite(phi_i).all() else None,
        uncertainty=random if np.isfinite(random).any() else None,
        unit=ABSOLUTE,
        coordinates=coordinates,
        variables={"net_signal": (read.net[rows], "1"), LINE: (raw[LINE].values[rows].astype(int), "1")},
    )
    described = {"flag_values": np.arange(len(MASK_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(MASK_MEANINGS)}
    return scan.assign(mask=("direction", mask, described | {"units": "1"}))


def together(
    scans: Sequence[xr.Dataset], order: npt.ArrayLike | None = None, names: Sequence[str] | None = None
) -> xr.Dataset:
    """Flat scans of one surface as one, without a coordinate that tells them apart; `order` rearranges the values.

    names: of the scans, by which the causes and flags that belong to one of them are told apart. Raises ValueError
    where some have a coordinate that others have not.
    """
    if len(scans) == 1:
        return scans[0]
    scans = in_common(scans, names)
    for name in dict.fromkeys(str(n) for scan in scans for n in scan.coords if n != "cause"):
        if not all(name in scan.coords for scan in scans):
            raise ValueError(f"some readings of the sample say their {name} and some do not: complete the column")
    if any("uncertainty" in scan for scan in scans):
        scans = [s if "uncertainty" in s else s.assign(uncertainty=s["brdf"] * np.nan) for s in scans]
    joined: xr.Dataset = xr.concat(
        list(scans), dim="direction", data_vars="minimal", coords="minimal", compat="equals", combine_attrs="override"
    )
    if names is None:
        return joined if order is None else joined.isel(direction=np.argsort(order, kind="stable"))
    of = [one | {"file": name} for name, scan in zip(names, scans, strict=True) for one in flags(scan)]
    past = [f"{name}: {line}" for name, s in zip(names, scans, strict=True) for line in s.attrs["history"].splitlines()]
    return joined.drop_vars(LINE, errors="ignore").assign_attrs(flags=json.dumps(of), history="\n".join(past))

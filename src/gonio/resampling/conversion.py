"""From any format to any other: what the target cannot hold is left out with a word or refused, never bent silently."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.files import replacing
from gonio.formats import writer
from gonio.formats.format import Format
from gonio.measured import dataset
from gonio.measured.dataset import HORIZON, PARAMETERISATION, SETS, add_history, flatten
from gonio.resampling.difference import STEEP, Difference, difference
from gonio.resampling.resample import Filling, is_on, parts, resample


@dataclass(frozen=True)
class Conversion:
    """What became of a scan on its way into a file.

    error: the file as it reads now against the scan, at the scan's own directions.
    """

    path: Path
    format: Format
    scan: xr.Dataset
    left_out: tuple[str, ...]
    error: Difference = field(repr=False)


def convert(
    scan: xr.Dataset,
    path: str | Path,
    to: str = "",
    *,
    impose: Sequence[str] = (),
    filling: Filling | None = None,
    force: bool = False,
) -> Conversion:
    """Write a scan in another format: reduced to what that can hold, resampled where it has a grid of its own.

    to: a format's name, where the suffix of `path` does not tell. `impose` and `filling` as for `resample`.
    Raises ValueError, with the remedy, where the format would have to lie: relative data in a format that has absolute
    ones, several wavelengths in one that has one, gaps in one that has none.
    """
    chosen = writer(path, to)
    assert chosen.write is not None
    kept, left_out = fitted_to(scan, chosen)
    ready = laid_out(kept, chosen, impose, filling)
    if chosen.layout is not None and ready is not kept:
        ready = add_history(ready, f"laid out as {chosen.title} stores it: {in_words(difference(ready, kept))}")
    if left_out:
        ready = add_history(ready, f"left out for {chosen.title}: {'; '.join(left_out)}")
    with replacing(path, force) as temporary:
        chosen.write(ready, temporary)
        found = chosen.read(temporary)
        if (own := dataset.unit(found)) != dataset.unit(kept):
            left_out.append(f"the unit: the file reads as {own}")
            kept = kept.assign(brdf=kept["brdf"].assign_attrs(units=own))
        error = difference(found, kept)
    return Conversion(Path(path), chosen, ready, tuple(left_out), error)


def in_words(error: Difference) -> str:
    """The error of a resampling in one line."""
    if not error.missing and not error.error.any():
        return "every value exact"
    text = f"rms error {100 * error.rms:.3g} % by solid angle, {100 * error.rms_steep:.3g} % within {STEEP:g} deg of "
    text += f"the normal; bias {100 * error.bias:.2g} %"
    return text + (f", {error.missing} of {error.missing + error.count} directions lost" if error.missing else "")


def fitted_to(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """The scan without what the format cannot hold, and what that was; ValueError where leaving it out would lie."""
    holds = target.holds
    left_out: list[str] = []
    if (quantity := scan.attrs.get("quantity", "")) != holds.quantity and (holds.quantity or target.layout is not None):
        what = f"the data are {quantity}" if quantity else "the data are a BRDF"
        raise ValueError(f"{what}, and {target.title} holds {holds.quantity or 'BRDFs'}: write another format")
    if dataset.unit(scan) == dataset.RELATIVE and not holds.relative:
        raise ValueError(
            f"the data are relative (a.u.), and {target.title} cannot say so: calibrate them, or write "
            f"{_that(lambda f: f.holds.relative)}"
        )
    if "mode" in scan.coords and not holds.transmission and (scan["mode"] == "transmission").any():
        if not (scan["mode"] == "reflection").any():
            raise ValueError(f"the data are of transmission, which {target.title} does not hold")
        scan = dataset.select(scan, {"mode": "reflection"})
        left_out.append("transmission")
    for name in (n for n in SETS if n in scan.coords and n not in holds.sets):
        values = np.unique(scan[name].values)
        if values.size > 1:
            raise ValueError(
                f"{target.title} holds one {name} and the data have {values.size}: choose with "
                f"--select {name}={values[0]}"
            )
        left_out.append(f"{name} {values[0]}")
        scan = scan.isel({name: 0}, drop=True) if name in scan.dims else scan.drop_vars(name)
    scan, gone = _without_turns(scan, target)
    left_out += gone
    if "mask" in scan and not {"*", "mask"} & set(holds.variables):
        masked = int((scan["mask"] != 0).sum())
        scan = scan.assign(brdf=scan["brdf"].where(scan["mask"] == 0).assign_attrs(scan["brdf"].attrs)).drop_vars(
            "mask"
        )
        left_out.append(f"the mask: {masked} masked values became gaps" if masked else "an empty mask")
    scan, gone = _without_variables(scan, target)
    return scan, left_out + gone


def _without_turns(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    if "phi_i" not in scan.coords or target.holds.anisotropic:
        return scan, []
    turns = np.unique(scan["phi_i"].values)
    if turns.size > 1:
        raise ValueError(
            f"the surface was turned to {turns.size} azimuths, and {target.title} holds an isotropic one: choose with "
            f"--select phi_i={turns[0]:g}, or write {_that(lambda f: f.holds.anisotropic)}"
        )
    scan = scan.isel(phi_i=0, drop=True) if "phi_i" in scan.dims else scan.drop_vars("phi_i")
    return scan, [f"the surface's azimuth, {turns[0]:g} deg"]


def _without_variables(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """Without other variables than the format holds, except those of its own parameterisation."""
    own = scan.attrs.get(PARAMETERISATION) == target.name
    if own or "*" in target.holds.variables:
        return scan, []
    gone = [str(n) for n in scan.data_vars if n not in ("brdf", "line", *target.holds.variables)]
    said = [n for n in gone if set(scan[n].dims) <= set(scan["brdf"].dims)]
    if PARAMETERISATION in scan.attrs and target.layout is None:
        scan = flatten(scan)
    return scan.drop_vars([n for n in gone if n in said and n in scan]), said


def laid_out(scan: xr.Dataset, target: Format, impose: Sequence[str], filling: Filling | None) -> xr.Dataset:
    """The scan at the directions that the format stores; ValueError where it needs values that are not there."""
    if target.layout is None:
        return _without_gaps(scan, target, impose, filling)
    onto = target.layout(scan)
    if is_on(scan, onto) and not impose and filling is None:
        ready = scan
    else:
        ready = resample(scan, onto, impose=impose, filling=filling)
        if "origin" in ready and not {"*", "origin"} & set(target.holds.variables):
            ready = ready.drop_vars("origin")
    if not target.holds.gaps:
        _refuse_gaps(ready, target)
    return ready


def _refuse_gaps(ready: xr.Dataset, target: Format) -> None:
    along = [d for d in ready["brdf"].dims if d not in SETS]
    there = ready["brdf"].notnull().any(along)  # a set without any value, such as a side never lit, is no gap
    above = ((ready["theta_r"] <= HORIZON) & (ready["theta_i"] <= HORIZON) & there).broadcast_like(ready["brdf"])
    gaps = int((np.isnan(ready["brdf"]) & above).sum())
    if gaps:
        raise ValueError(
            f"{target.title} stores a full grid, and {gaps} of its {int(above.sum())} values lie outside the data: "
            "fill them with --fill symmetry or --fill MODEL, which says so in the history, or write "
            f"{_that(lambda f: f.holds.gaps or f.layout is None)}"
        )


def _without_gaps(scan: xr.Dataset, target: Format, impose: Sequence[str], filling: Filling | None) -> xr.Dataset:
    """For a format of scattered directions: a gap is a direction that is not there."""
    if impose or filling is not None:
        if scan["brdf"].dims == ("direction",):  # each set at its own directions
            done = [resample(part, part, impose=impose, filling=filling) for _, part in parts(scan)]
            scan = xr.concat(done, dim="direction") if len(done) > 1 else done[0]
        else:
            scan = resample(scan, scan, impose=impose, filling=filling)
        scan = _without_variables(scan, target)[0]
    if target.holds.gaps:
        return scan
    flat = flatten(scan)
    known = np.isfinite(flat["brdf"].values)
    if known.all():
        return scan
    flat = flat.isel(direction=np.flatnonzero(known))
    return add_history(
        flat, f"left out {int((~known).sum())} directions without a value, which {target.title} cannot hold"
    )


def _that(wanted: Callable[[Format], bool]) -> str:
    """The names of the formats that can."""
    from gonio.formats import formats

    return " or ".join(f.name for f in formats().values() if f.write and wanted(f))

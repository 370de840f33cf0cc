"""What of a scan a format can hold: the rest is left out and named, or refused where the file would be false without.

Nothing is known here about any single format: `Format.holds` says what each can hold. What is only lost is left out
with a word, such as the number of a single wavelength. What would change the meaning of the numbers is refused: values
that are relative in a format of absolute ones, transmission in a format of reflection, one of several wavelengths as
the only one. Steps come in the order in which one can make the next needless: quantity and unit, then modes, then sets,
then channels and turns, then masks and other variables.
"""

from collections.abc import Callable, Sequence

import numpy as np
import xarray as xr

from gonio.formats.format import Format, Holds
from gonio.measured import dataset
from gonio.measured.causes import CAUSE
from gonio.measured.dataset import PARAMETERISATION, SETS, add_history, flatten


def fitted_to(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """The scan without what the format cannot hold, and what that was, in words such as "wavelength 650.0".

    `target.holds` says what it can hold, and nothing is known here about any single format.
    Raises ValueError where the file would say something false without it.
    """
    holds = target.holds
    left_out: list[str] = []
    # A list of directions that declares no quantity can hold any numbers. A format with a grid of its own holds a BRDF.
    if (quantity := scan.attrs.get("quantity", "")) != holds.quantity and (holds.quantity or target.layout is not None):
        raise ValueError(
            f"the data are {quantity or 'a BRDF'}, and {target.title} holds {holds.quantity or 'BRDFs'}: "
            "write another format"
        )
    _refuse_unit(scan, target)
    scan, removed = _in_known_modes(scan, target)
    left_out += removed
    # The number of a single wavelength can be left out. Which of several is wanted, only the user can say.
    kept = ("mode",) if holds.transmission and len(dataset.modes(scan)) == 1 else ()  # which the file says
    for name in (n for n in SETS if n in scan.coords and n not in (*holds.sets, *kept)):
        values = np.unique(scan[name].values)
        if values.size > 1:
            raise ValueError(
                f"{target.title} holds one {name} and the data have {values.size}: choose with "
                f"--select {name}={values[0]}"
            )
        left_out.append(f"{name} {values[0]}")
        scan = scan.isel({name: 0}, drop=True) if name in scan.dims else scan.drop_vars(name)
    scan, removed = _in_known_channels(scan, target)
    left_out += removed
    scan, removed = _without_turns(scan, target)
    left_out += removed
    if "mask" in scan and not {"*", "mask"} & set(holds.variables):
        # Without the mask a blocked or noisy reading would be read as a good one, so it becomes a gap.
        masked = int((scan["mask"] != 0).sum())
        scan = scan.assign(brdf=scan["brdf"].where(scan["mask"] == 0).assign_attrs(scan["brdf"].attrs)).drop_vars(
            "mask"
        )
        left_out.append(f"the mask: {masked} masked values became gaps" if masked else "an empty mask")
    scan, removed = without_variables(scan, target)
    return scan, left_out + removed


def _refuse_unit(scan: xr.Dataset, target: Format) -> None:
    """ValueError for values of another unit than the format can state."""
    holds = target.holds
    if dataset.is_degree(scan) and "*" not in holds.variables:
        raise ValueError(
            f"the data are degrees of polarisation, and {target.title} cannot say so: write "
            f"{formats_where(lambda f: '*' in f.holds.variables)}"
        )
    if dataset.unit(scan) == dataset.RELATIVE and not holds.relative:
        raise ValueError(
            f"the data are relative (a.u.), and {target.title} cannot say so: calibrate them, or write "
            f"{formats_where(lambda f: f.holds.relative)}"
        )


def _in_known_modes(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """The scan without the mode that the format cannot hold, and what that was.

    Raises ValueError where nothing would be left: transmission must never be read as reflection, nor the reverse.
    """
    found, known = dataset.modes(scan), target.holds.modes
    if found <= {*known}:
        return scan, []
    if not found & {*known}:
        (mode,), remedy = found, "write a format that holds it"
        if "mode" not in scan.coords:
            mode, remedy = f"{mode}, as they name no mode", "where light went through, add mode = transmission to them"
        raise ValueError(f"the data are of {mode}, and {target.title} holds {known[0]} alone: {remedy}")
    (other,) = found - {*known}
    return dataset.select(scan, {"mode": known[0]}), [other]


def _in_known_channels(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """The scan in channels that the format can name: one of another name is monochrome; ValueError for several.

    Where the format has no monochrome files, the values stand in each of its channels, which the history says.
    """
    holds, left_out = target.holds, []
    if holds.alone:
        return _stored_alone(scan, holds)
    if not holds.channels:
        return scan, []
    if "channel" in scan.coords:
        names = list(dict.fromkeys(map(str, scan["channel"].values.ravel())))
        if len(names) == 1 and (names[0],) not in holds.channels:
            left_out.append(f"channel {names[0]}")
            scan = scan.isel(channel=0, drop=True) if "channel" in scan.dims else scan.drop_vars("channel")
        elif in_order(names, holds.channels) is None:
            known = ", or ".join(", ".join(group) for group in holds.channels)
            raise ValueError(
                f"{target.title} holds the channels {known}, and the data have {', '.join(names)}: choose one with "
                f"--select channel={names[0]}"
            )
    if holds.monochrome or "channel" in scan.coords:
        return scan, left_out
    group = holds.channels[0]
    scan = add_history(_in_each(scan, group), f"the values stand in {', '.join(group)} alike")
    return scan, left_out


def _stored_alone(scan: xr.Dataset, holds: Holds) -> tuple[xr.Dataset, list[str]]:
    """The scan without its one wavelength or channel, which the format stores under another name.

    Of several, the history says when none is stored under that name.
    """
    spectral = {n: list(dict.fromkeys(scan[n].values.ravel().tolist())) for n in dataset.SPECTRAL if n in scan.coords}
    for n, values in spectral.items():
        if len(values) > 1 and holds.alone not in values and not set(holds.alone_among) <= set(values):
            line = f"no {n} is stored as {holds.alone}, and programs that read {holds.alone} alone find nothing"
            return add_history(scan, f"{line}: choose one with --select {n}={values[0]}"), []
    if not spectral or any(len(values) > 1 or values == [holds.alone] for values in spectral.values()):
        return scan, []
    others = {n: values[0] for n, values in spectral.items() if values != [holds.alone]}
    left_out = [f"{n} {value}, stored as {holds.alone}" for n, value in others.items()]
    for n in spectral:
        scan = scan.isel({n: 0}, drop=True) if n in scan.dims else scan.drop_vars(n)
    return scan, left_out


def in_order(names: Sequence[str], groups: Sequence[tuple[str, ...]]) -> tuple[str, ...] | None:
    """The group that these names are, in its own order; None where there is none."""
    return next((group for group in groups if sorted(group) == sorted(names)), None)


def _in_each(scan: xr.Dataset, channels: Sequence[str]) -> xr.Dataset:
    """The values of a scan without channels in each of several."""
    if scan["brdf"].dims == ("direction",):
        count = scan.sizes["direction"]
        parts = [scan.assign_coords(channel=("direction", np.full(count, name))) for name in channels]
        return xr.concat(parts, dim="direction", combine_attrs="override")
    along = [n for n, v in scan.data_vars.items() if v.dims == scan["brdf"].dims]
    return scan.assign({n: scan[n].expand_dims(channel=list(channels)) for n in along})


def _without_turns(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """Without phi_i where the format holds isotropic surfaces; ValueError for several, each a BRDF of its own."""
    if "phi_i" not in scan.coords or target.holds.anisotropic:
        return scan, []
    turns = np.unique(scan["phi_i"].values)
    if turns.size > 1:
        raise ValueError(
            f"the surface was turned to {turns.size} azimuths, and {target.title} holds an isotropic one: choose with "
            f"--select phi_i={turns[0]:g}, or write {formats_where(lambda f: f.holds.anisotropic)}"
        )
    scan = scan.isel(phi_i=0, drop=True) if "phi_i" in scan.dims else scan.drop_vars("phi_i")
    return scan, [f"the surface's azimuth, {turns[0]:g} deg"]


def without_variables(scan: xr.Dataset, target: Format) -> tuple[xr.Dataset, list[str]]:
    """Without other variables than the format holds, and the names of those, for the history.

    A file's own parameterisation may need further variables, such as tables on other dimensions. A scan that goes back
    into the same format keeps all of them. For another format those tables are not named as left out: they are no
    values of the scan's directions. Nor is `line`, the line of the file that a value came from.
    """
    is_same_format = scan.attrs.get(PARAMETERISATION) == target.name
    if is_same_format or "*" in target.holds.variables:
        return scan, []
    others = [str(n) for n in scan.data_vars if n not in ("brdf", "line", *target.holds.variables)]
    removed = [n for n in others if set(scan[n].dims) <= {*scan["brdf"].dims, CAUSE}]
    # Where the scan is resampled later, the parameterisation stays: it interpolates the scan as its format is read.
    if PARAMETERISATION in scan.attrs and target.layout is None:
        scan = flatten(scan)
    kept = scan.drop_vars([n for n in others if n in removed and n in scan])
    return kept.drop_vars(CAUSE, errors="ignore"), removed


def formats_where(wanted: Callable[[Format], bool]) -> str:
    """The names of the formats that can be written and of which something is true, for an error message."""
    from gonio.formats import formats

    return " or ".join(f.name for f in formats().values() if f.write and wanted(f))

"""From any format to any other: what the target cannot hold is left out and named, or refused, never changed silently.

Three steps, so that no writer of a format needs to decide anything:

1. `fitted_to` reduces the scan to what the format declares in `Format.holds`. What is only lost is left out and named
   (uncertainties, a mask, the number of a single wavelength). What would make the file say something false is refused
   (relative data as absolute, one of several wavelengths as the only one).
2. `laid_out` brings it to the directions that the format stores, by resample.py; a format without a layout stores the
   scan's own directions. Gaps stay gaps, are filled where the user asked for it, or are refused.
3. The format writes. The file is read again and compared with the scan after step 1 at the scan's own directions, so
   the error includes resampling, the digits of the file, and every mistake of writer and reader.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.files import replacing
from gonio.formats import writer
from gonio.formats.format import Format
from gonio.measured import dataset
from gonio.measured.dataset import HORIZON, SETS, add_history, flatten
from gonio.resampling.difference import STEEP, Difference, difference
from gonio.resampling.grazing import bounded, outside_data, to_grazing
from gonio.resampling.hemisphere import Reflectance, excessive, reflectances
from gonio.resampling.holdings import fitted_to, formats_where, in_order, without_variables
from gonio.resampling.means import means_over
from gonio.resampling.resample import MODELLED, Filling, is_on, resample
from gonio.resampling.sources import sets_of

ENDS = 80.0  # deg: a file that ends at a smaller incidence angle leaves much of a rim to the program that reads it
ROUNDING = 1e-12  # of a value, which changes of coordinates and of numbers to text leave
MOST_SETS = 3  # of a written file whose energy is looked at, those with the largest values


@dataclass(frozen=True)
class Conversion:
    """What became of a scan on its way into a file.

    scan: what was written, laid out for the format, with its history.
    left_out: what the file does not hold, in words.
    error: the file as it reads now against the scan, at the scan's own directions. It says nothing about others.
    reflectances: the directional-hemispherical reflectances of the file as it reads now, where its table has them.
    """

    path: Path
    format: Format
    scan: xr.Dataset
    left_out: tuple[str, ...]
    error: Difference = field(repr=False)
    reflectances: tuple[Reflectance, ...] = field(default=(), repr=False)

    @property
    def modelled(self) -> float:
        """The share of the values that a filling's function gave, such as a fitted model's."""
        return float(self.scan.attrs.get(MODELLED, 0.0))

    @property
    def last_incidence(self) -> float:
        """The largest incidence angle [deg] at which the file has a value."""
        theta_i = self.scan["theta_i"].broadcast_like(self.scan["brdf"]).where(self.scan["brdf"].notnull())
        return float(theta_i.max())


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

    Parameters
    ----------
    scan : xarray.Dataset
        The scan, as `gonio.read` gives it.
    path : str or Path
        Where the file is written.
    to : str
        The name of a format, where the suffix of `path` does not tell.
    impose : sequence of str
        Symmetries to impose, `reciprocity` or `bilateral`: each value becomes the mean over its images.
    filling : Filling, optional
        What may stand in gaps; without it gaps stay gaps.
    force : bool
        Whether a file that exists is replaced, and whether a table may scatter more light than falls on it.

    Returns
    -------
    Conversion
        The path and format, the scan as written, what was left out, and the error of the file as it reads back.

    Raises
    ------
    FileExistsError
        The file exists, and `force` is not set.
    ValueError
        The file would say something false: relative data in a format of absolute ones, several wavelengths in a format
        of one, gaps in a format without any, more light scattered than falls on it; or it cannot be read again. The
        message has the remedy, and nothing is written.

    """
    target = writer(path, to)
    assert target.write is not None
    reduced, left_out = fitted_to(scan, target)
    ready = laid_out(reduced, target, impose, filling)
    is_new = target.layout is not None and ready is not reduced
    # The history is part of the file, so the error that it states is that of the values before they are written.
    if is_new:
        ready = add_history(
            ready, f"laid out as {target.title} stores it: {in_words(difference(ready, reduced), target)}"
        )
    if target.remark is not None and (remark := target.remark(ready)):
        ready = add_history(ready, f"{target.title}: {remark}")
    if left_out:
        ready = add_history(ready, f"left out for {target.title}: {'; '.join(left_out)}")
    # Read back under its temporary name: a file that cannot be read never takes the place of one that can.
    with replacing(path, force) as temporary:
        target.write(ready, temporary)
        written = target.read(temporary)
        # A format may keep values and not their unit. The numbers can be compared all the same, under the file's unit.
        if (unit := dataset.unit(written)) != dataset.unit(reduced):
            left_out.append(f"the unit: the file reads as {unit}")
            reduced = reduced.assign(brdf=reduced["brdf"].assign_attrs(units=unit))
        error = difference(written, reduced)
        scattered = _reflectances(written)
        # A list of directions, or a table as it was, holds what was measured, right or wrong.
        if is_new and not force:
            _refuse_excess(target, scattered)
    return Conversion(Path(path), target, ready, tuple(left_out), error, tuple(scattered))


def _reflectances(written: xr.Dataset) -> list[Reflectance]:
    try:
        return reflectances(written, MOST_SETS)
    except ValueError:  # too many scattered directions
        return []


def _refuse_excess(target: Format, scattered: Sequence[Reflectance]) -> None:
    """ValueError for a file by which a surface would shine: in a renderer it never gets dark."""
    if (worst := excessive(scattered)) is not None:
        raise ValueError(
            f"the {target.title} would scatter {100 * worst.value:.4g} % of the light that falls on it, at "
            f"{worst.where}: check the unit of the data and what fills their gaps; --force writes it all the same"
        )


def in_words(error: Difference, target: Format | None = None) -> str:
    """The error of a resampling in one line: of what, and how many directions have no value any more.

    By solid angle the lobe counts most; lg RMSE and the largest relative error tell of the wings. target: the format
    that the values were laid out for, if any: one of means over patches has no value for a single direction.
    """
    against = " against the means over their patches" if target is not None and target.means is not None else ""
    compared = f"{error.count} directions of the data{against}"
    lost = f", {error.missing} of {error.missing + error.count} directions lost" if error.missing else ""
    if not error.error.any() or error.largest < ROUNDING:
        rounded = " to rounding" if error.error.any() else ""  # else to the last bit
        return f"every value exact{rounded}{f', at {compared}' if against or lost else ''}{lost}"
    text = f"rms error {100 * error.rms:.3g} % by solid angle, {100 * error.rms_steep:.3g} % within {STEEP:g} deg of "
    text += f"the normal; bias {100 * error.bias:.2g} %"
    text += f"; lg RMSE {error.log10_rmse:.2g}" if math.isfinite(error.log10_rmse) else ""
    if math.isfinite(error.largest):
        place = ", ".join(f"{name} {angle:.4g}" for name, angle in error.where.items())
        text += f"; largest {100 * error.largest:.3g} % at {place} deg"
    return f"{text}; at {compared}{lost}"


def laid_out(scan: xr.Dataset, target: Format, impose: Sequence[str], filling: Filling | None) -> xr.Dataset:
    """The scan at the directions that the format stores; the very scan where nothing has to be done.

    Raises ValueError where the format needs a value in every place and the scan has gaps there.
    """
    if target.layout is None:
        return _without_gaps(scan, target, impose, filling)
    if filling is None or filling.function is None:
        onto = target.layout(scan)
    else:
        onto, filling = to_grazing(scan, target, filling.function), bounded(filling)
    if is_on(scan, onto) and not impose and filling is None:
        ready = scan  # with its other variables and its parameterisation, which resampling would drop
    elif target.means is not None and not is_on(scan, onto):
        ready = means_over(scan, onto, target, impose, filling)
    else:
        ready = resample(scan, onto, impose=impose, filling=filling)
        # Few formats have a place for where each value came from. The history says how many came from where.
        if "origin" in ready and not {"*", "origin"} & set(target.holds.variables):
            ready = ready.drop_vars("origin")
    if not target.holds.gaps:
        _refuse_gaps(ready, target, filling)
    if filling is not None and filling.function is not None and (line := outside_data(scan, ready, filling)):
        ready = add_history(ready, line)
    if "channel" in ready.dims and (order := in_order(list(ready["channel"].values), target.holds.channels)):
        ready = ready if tuple(ready["channel"].values) == order else ready.sel(channel=list(order))
    return ready


def _refuse_gaps(ready: xr.Dataset, target: Format, filling: Filling | None) -> None:
    """ValueError, with what to do, if values above the horizon are missing."""
    grid_dims = [d for d in ready["brdf"].dims if d not in SETS]
    has_values = ready["brdf"].notnull().any(grid_dims)  # a set without any, such as a side never lit, has no gaps
    above = ((ready["theta_r"] <= HORIZON) & (ready["theta_i"] <= HORIZON) & has_values).broadcast_like(ready["brdf"])
    gaps = int((np.isnan(ready["brdf"]) & above).sum())
    if gaps:
        raise ValueError(
            f"{target.title} stores a full grid, and {gaps} of its {int(above.sum())} values lie outside the data: "
            f"{_remedy(filling)}write {formats_where(lambda f: f.holds.gaps or f.layout is None)}"
        )


def _remedy(filling: Filling | None) -> str:
    """What may fill the gaps that are left, without what was tried."""
    if filling is None or (not filling.symmetries and filling.function is None):
        return "fill them with --fill symmetry or --fill MODEL, which says so in the history, or "
    if filling.function is None:
        return (
            "symmetry does not reach them; add a model, as in --fill symmetry,MODEL, which says so in the history, or "
        )
    return f"{filling.name.split()[0]} has no value there; fill them with another model, or "


def _without_gaps(scan: xr.Dataset, target: Format, impose: Sequence[str], filling: Filling | None) -> xr.Dataset:
    """For a format of scattered directions: filled where asked for, and a remaining gap is a direction that is absent.

    Symmetries and fillings need a resampling, onto the scan's own directions. A format whose files can say that a value
    is missing gets the gaps as they are.
    """
    if impose or filling is not None:
        if scan["brdf"].dims == ("direction",):  # each set at its own directions
            resampled = [resample(part, part, impose=impose, filling=filling) for _, part in sets_of(scan)]
            scan = xr.concat(resampled, dim="direction") if len(resampled) > 1 else resampled[0]
        else:
            scan = resample(scan, scan, impose=impose, filling=filling)
        scan = without_variables(scan, target)[0]  # resampling may have added `origin`
    if target.holds.gaps:
        return scan
    flat = flatten(scan)
    finite = np.isfinite(flat["brdf"].values)
    if finite.all():
        return scan
    flat = flat.isel(direction=np.flatnonzero(finite))
    return add_history(
        flat, f"left out {int((~finite).sum())} directions without a value, which {target.title} cannot hold"
    )

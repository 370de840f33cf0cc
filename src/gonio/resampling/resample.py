"""A scan at other directions: measured values where they were measured, interpolated ones between, gaps elsewhere.

For each set of the scan (one wavelength, channel, mode, ..) and each wanted direction above the horizon:

1. the measured value, where the scan has that very direction (lookup.py);
2. else the interpolation between its directions (interpolation.py), or that of the file format the scan comes from;
3. with `impose`, the mean of that and of the values at its images under the symmetries;
4. else, in what is still a gap and with a `Filling`, the mean over its images, and last a function such as a model.

Images are the directions at which a surface with the symmetry has the same BRDF. Helmholtz reciprocity is
f(theta_i, theta_r, phi) = f(theta_r, theta_i, -phi), bilateral symmetry f(theta_i, theta_r, phi) = f(theta_i, theta_r,
-phi). A surface that was turned has phi_i changed with them. The reciprocal image of light that went through from the
front is light from the back: it is taken from that set, and where the scan has none there is no image.

Nothing is extrapolated but by a filling's function, and nothing is smoothed. Where each value came from is counted in
the history, and with a filling it is kept as the variable `origin`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.causes import SYSTEMATIC, TOTAL, cause_of, gathered, spread
from gonio.measured.dataset import AXES, DIRECTIONS, HORIZON, PARAMETERISATION, SETS, SPECTRAL
from gonio.resampling.interpolation import Targets, interpolator, targets_of
from gonio.resampling.lookup import Measured
from gonio.resampling.sources import SYMMETRIES, Sources

Values = npt.NDArray[np.float64]
Fill = Callable[[xr.Dataset], Values]  # the BRDF (n,) at the n directions of a flat scan, as a fitted model gives it

ORIGINS = ("missing", "measured", "interpolated", "by_symmetry", "filled")  # meanings of the variable `origin`
MODELLED = "share_modelled"  # attribute: the share of the values that a filling's function gave
MISSING, MEASURED, INTERPOLATED, BY_SYMMETRY, FILLED = range(len(ORIGINS))


@dataclass(frozen=True)
class Filling:
    """What may stand where a scan has no value: its images under symmetries first, then a function such as a model.

    Filling() fills nothing, and has the variable `origin` in the result.

    Parameters
    ----------
    symmetries : tuple of str
        `reciprocity`, `bilateral`.
    function : callable, optional
        Gives the BRDF (n,) at the n directions of a flat scan. Its values are taken as they are, in the scan's unit;
        NaN leaves the gap.
    name : str
        What the history calls the function.

    """

    symmetries: tuple[str, ...] = ()
    function: Fill | None = None
    name: str = ""


def resample(
    scan: xr.Dataset, onto: xr.Dataset, *, impose: Sequence[str] = (), filling: Filling | None = None
) -> xr.Dataset:
    """Interpolate the BRDF of a scan at other directions.

    Values at directions that both have are taken as they are. Between them is linear interpolation in the scan's own
    coordinates (`resampling.interpolation`), or the format's own where the scan carries one. Outside of the data and
    below the horizon is NaN. Masked values are gaps.

    Standard uncertainties are interpolated as the values are, u = sum_k w_k u_k, which takes those of neighbours as
    fully correlated: of independent ones sqrt(sum_k (w_k u_k)^2) would be less. So are the shifts by each cause, with
    their signs, for which it is exact; `uncertainty_systematic` is then the root of the sum of their squares. With
    `impose`, and for sets of more than MOST_LOOKED_UP values, the result has no uncertainties, which the history says.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan.
    onto : xarray.Dataset
        Directions: coordinates [deg] on a grid or on `direction`.
    impose : sequence of str
        Symmetries, `reciprocity` or `bilateral`: each value is the mean over the images of its direction.
    filling : Filling, optional
        What may stand in gaps; without it they stay.

    Returns
    -------
    xarray.Dataset
        `brdf` on the dimensions of `onto`, with channels, wavelengths or samples before them, and NaN where the scan
        has no such combination; on `direction` they follow one another. Variables other than brdf, its uncertainties
        and their causes are dropped. The history says how many values came about in which way.

    Raises
    ------
    ValueError
        A symmetry is not known, or the directions cannot be interpolated.

    """
    check_symmetries(impose, filling)
    if SYSTEMATIC in scan:
        scan = spread(scan).drop_vars(TOTAL, errors="ignore")  # the total follows from the causes
    directions = directions_of(onto)
    targets = targets_of(directions)
    # Grids such as the specular one have nodes below the horizon. They are no gaps: nothing fills or counts them.
    above = (targets.theta_i <= HORIZON) & (targets.theta_r <= HORIZON)
    rows = np.flatnonzero(above)
    columns: dict[str, list[Values]] = {}
    keys: list[dict[str, Any]] = []
    how = ""
    sources = Sources(without_masked(scan))
    for key, part in sources.sets:
        if not impose and filling is None and is_on(part, onto):
            of_set = _copied(part, _grid_dims(onto), rows)
        else:
            of_set, how = resampled(sources, len(keys), targets.part(rows), impose, filling)
        if filling is not None and filling.function is not None:
            fill(of_set, directions.isel(direction=rows), sources.labels[len(keys)], filling.function)
        keys.append(key)
        for name, column in of_set.items():
            columns.setdefault(name, []).append(_with_below_horizon(column, above))
    origins = np.concatenate(columns["origin"])[np.tile(above, len(keys))]
    if filling is None:
        del columns["origin"]
    # An uncertainty that only some of the sets have (a set may be too large to be looked up) is dropped for all.
    complete = {name: of_sets for name, of_sets in columns.items() if len(of_sets) == len(keys)}
    out = gathered(assembled(scan, onto, directions, keys, complete))
    if filling is not None and filling.function is not None and len(origins):
        out.attrs[MODELLED] = float((origins == FILLED).mean())
    line = _history_line(origins, len(rows), how, impose, filling) + without_uncertainties(scan, out)
    symmetries = (*impose, *(filling.symmetries if filling else ()))
    return dataset.add_history(out, line + (sources.without_exchange() if "reciprocity" in symmetries else ""))


def check_symmetries(impose: Sequence[str], filling: Filling | None) -> None:
    """Raises ValueError for a name that is not in SYMMETRIES."""
    for name in (*impose, *(filling.symmetries if filling else ())):
        if name not in SYMMETRIES:
            raise ValueError(f"no symmetry {name!r}: there are {', '.join(SYMMETRIES)}")


def _history_line(origins: Values, directions: int, how: str, impose: Sequence[str], filling: Filling | None) -> str:
    """How the values came about: `origins` are those of all sets above the horizon, `how` names the interpolation."""
    count = {name: int((origins == k).sum()) for k, name in enumerate(ORIGINS)}
    text = f"resampled onto {directions} directions: {count['measured']} values as measured"
    if count["interpolated"]:
        text += f", {count['interpolated']} interpolated {how}"
    if impose:
        text += f", averaged over {' and '.join(impose)}"
    if filling is not None and filling.symmetries:
        text += f", {count['by_symmetry']} filled by {' and '.join(filling.symmetries)}"
    if filling is not None and filling.function is not None:
        text += f", {count['filled']} filled by {filling.name}, not measured"
    return text + (f", {count['missing']} missing" if count["missing"] else "")


def uncertain(scan: xr.Dataset) -> list[str]:
    """The variables of a scan that say how uncertain its values are, each along the dimensions of brdf."""
    names = [str(n) for n in scan.data_vars if n in ("uncertainty", TOTAL) or cause_of(str(n))]
    return [n for n in names if set(scan[n].dims) == set(scan["brdf"].dims)]


def without_uncertainties(scan: xr.Dataset, out: xr.Dataset) -> str:
    """What the history says where a scan states uncertainties and what was made of it has none."""
    has_any = bool(uncertain(scan)) or SYSTEMATIC in scan
    return "; without the uncertainties" if has_any and not (uncertain(out) or SYSTEMATIC in out) else ""


def is_on(scan: xr.Dataset, onto: xr.Dataset) -> bool:
    """Whether the scan is on this very grid already: the same dimensions, and every angle equal to the last bit."""
    if {d for d in scan["brdf"].dims if d not in SETS} != set(_grid_dims(onto)):
        return False
    names = [n for n in DIRECTIONS if n in onto.variables]
    # The dimensions of each angle count, too: a grid where theta_r depends on one axis is not one where it is an axis.
    return all(n in scan.coords and scan[n].dims == onto[n].dims and scan[n].equals(onto[n]) for n in names)


def directions_of(onto: xr.Dataset) -> xr.Dataset:
    """The directions of a Dataset on one dimension, in the order of its own, the last dimension fastest."""
    names = [n for n in DIRECTIONS if n in onto.variables]
    dims = _grid_dims(onto)
    shape = tuple(onto.sizes[d] for d in dims)
    template = xr.DataArray(np.zeros(shape), dims=dims)
    full = {n: onto[n].drop_vars(onto[n].coords).broadcast_like(template).transpose(*dims).values for n in names}
    return xr.Dataset(coords={n: ("direction", v.ravel().astype(float), {"units": "degree"}) for n, v in full.items()})


def _grid_dims(onto: xr.Dataset) -> tuple[Any, ...]:
    """The dimensions along which directions differ."""
    return tuple(d for d in onto.dims if any(d in onto[n].dims for n in DIRECTIONS if n in onto.variables))


def without_masked(scan: xr.Dataset) -> xr.Dataset:
    """The scan with NaN for masked values: their places stay, so that nothing is interpolated across them."""
    if "mask" not in scan:
        return scan
    return scan.assign(brdf=scan["brdf"].where(scan["mask"] == 0).assign_attrs(scan["brdf"].attrs)).drop_vars("mask")


def _with_below_horizon(values: Values, above: npt.NDArray[np.bool_]) -> Values:
    """Values of the directions above the horizon put among all directions, NaN for those below."""
    out = np.full(len(above), np.nan)
    out[above] = values
    return out


def _copied(part: xr.Dataset, grid: tuple[Any, ...], rows: npt.NDArray[np.intp]) -> dict[str, Values]:
    """The columns of one set that is on the wanted grid already.

    Nothing is looked up: several nodes of a grid may be one direction (at a pole of its axes) and have values that
    differ, which a lookup by direction would exchange or average.
    """
    names = ["brdf", *uncertain(part)]
    columns = {n: part[n].transpose(*grid).values.astype(float).ravel()[rows] for n in names}
    return columns | {"origin": np.where(np.isnan(columns["brdf"]), MISSING, MEASURED).astype(float)}


def resampled(
    sources: Sources, k: int, wanted: Targets, impose: Sequence[str], filling: Filling | None
) -> tuple[dict[str, Values], str]:
    """The columns (n,) of the set k at n directions: brdf, origin, uncertainties; and how it interpolates, in words."""
    source = sources.of(k)
    values, exact = source.at(wanted)
    if impose:
        values = _mean_of([values, *sources.images(k, wanted, impose)])
    # A mean over images is measured nowhere, even where each of them is. Flags are floats here: below the horizon NaN.
    origin = np.where(np.isnan(values), MISSING, np.where(exact & (not impose), MEASURED, INTERPOLATED)).astype(float)
    gaps = np.flatnonzero(np.isnan(values))
    if filling is not None and filling.symmetries and len(gaps):
        if images := sources.images(k, wanted.part(gaps), filling.symmetries):
            values[gaps] = _mean_of(images)
        origin[gaps[np.isfinite(values[gaps])]] = BY_SYMMETRY
    part, measured = sources.sets[k][1], source.measured
    uncertainties = {} if impose or measured is None else _uncertainties(part, wanted, measured)
    return {"brdf": values, "origin": origin, **uncertainties}, source.how


def _uncertainties(part: xr.Dataset, wanted: Targets, measured: "Measured") -> dict[str, Values]:
    """Uncertainties (n,) by name: those of measured values, between them interpolated in place of the BRDF.

    A format's own interpolation is of its BRDF alone, so uncertainties never go through it.
    """
    uncertainties = {}
    for name in uncertain(part):
        values, exact = measured.at(wanted, name)
        remaining = np.flatnonzero(~exact)
        if len(remaining):
            column = part[name].transpose(*part["brdf"].dims)
            values[remaining] = interpolator(part.assign(brdf=column))[0](wanted.part(remaining))
        uncertainties[name] = values
    return uncertainties


def _mean_of(images: Sequence[Values]) -> Values:
    """The mean (n,) over those of m images (m, n) that have a value, NaN where none has."""
    finite = np.isfinite(images)
    total = np.where(finite, images, 0.0).sum(axis=0)
    with np.errstate(invalid="ignore"):
        return total / np.where(finite.any(axis=0), finite.sum(axis=0), np.nan)


def fill(columns: dict[str, Values], directions: xr.Dataset, key: Mapping[str, Any], function: Fill) -> None:
    """Put the function's values into the gaps of one set, in place.

    The function sees a flat scan of the gaps with the set's coordinates, by which a model chooses its parameters. Its
    brdf is a placeholder.
    """
    gaps = np.flatnonzero(np.isnan(columns["brdf"]))
    if not len(gaps):
        return
    flat = directions.isel(direction=gaps)
    flat = flat.assign_coords({n: ("direction", np.full(len(gaps), v)) for n, v in key.items()})
    columns["brdf"][gaps] = function(flat.assign(brdf=("direction", np.zeros(len(gaps)))))
    columns["origin"][gaps[np.isfinite(columns["brdf"][gaps])]] = FILLED


def assembled(
    scan: xr.Dataset,
    onto: xr.Dataset,
    directions: xr.Dataset,
    keys: list[dict[str, Any]],
    columns: Mapping[str, list[Values]],
) -> xr.Dataset:
    """The sets as one Dataset: each coordinate of `keys` a dimension before those of a grid, else along `direction`.

    `columns` holds, for each variable, one array of all directions for each key.
    """
    # What describes the old directions is not true of the new ones: their interpolation, storage and symmetry.
    attrs = {k: v for k, v in scan.attrs.items() if k not in (PARAMETERISATION, AXES, "stored", "symmetry")}
    attrs |= {AXES: onto.attrs[AXES]} if AXES in onto.attrs else {}
    units = {name: scan[name].attrs if name in scan else _ORIGIN for name in columns}
    # A coordinate with one value, such as a single wavelength, distinguishes no set and is in no key. It is kept, too.
    single = {n: scan[n].values.ravel()[0] for n in SETS if n in scan.coords and n not in keys[0]}
    grid_dims = _grid_dims(onto)
    if grid_dims == ("direction",):
        names = [n for n in DIRECTIONS if n in directions.coords]
        coords = {n: ("direction", np.tile(directions[n].values, len(keys)), {"units": "degree"}) for n in names}
        count = directions.sizes["direction"]
        labels = {n: np.repeat(np.array([key[n] for key in keys]), count) for n in keys[0]}
        labels |= {n: np.full(count * len(keys), v) for n, v in single.items()}
        data = {n: ("direction", np.concatenate(c), units[n]) for n, c in columns.items()}
        return xr.Dataset(
            data, coords=coords | {n: ("direction", v, _spectral(n)) for n, v in labels.items()}, attrs=attrs
        )
    axes = {n: np.array(list(dict.fromkeys(key[n] for key in keys))) for n in keys[0]}
    shape = tuple(onto.sizes[d] for d in grid_dims)
    # A flat scan need not hold every combination of its labels: those it lacks stay NaN.
    full = {n: np.full((*(len(v) for v in axes.values()), *shape), np.nan) for n in columns}
    for k, key in enumerate(keys):
        place = tuple(int(np.flatnonzero(values == key[n])[0]) for n, values in axes.items())
        for name, column in columns.items():
            full[name][place] = column[k].reshape(shape)
    grid = {n: onto[n].variable for n in onto.coords}
    variables: dict[str, Any] = {n: ((*axes, *grid_dims), v, units[n]) for n, v in full.items()}
    sets = {n: (n, v, _spectral(n)) for n, v in axes.items()} | {n: ((), v, _spectral(n)) for n, v in single.items()}
    return xr.Dataset(variables, coords=grid | sets, attrs=attrs)


# CF attributes of a variable whose numbers are flags.
_ORIGIN = {"flag_values": np.arange(len(ORIGINS)), "flag_meanings": " ".join(ORIGINS), "units": "1"}


def _spectral(name: str) -> dict[str, str]:
    """The attributes of a coordinate of SETS: of these only wavelength has a unit."""
    return {"units": "nm"} if name == SPECTRAL[0] else {}

"""A scan at other directions: as measured where it was measured, interpolated between, honest gaps elsewhere."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.dataset import DIRECTIONS, HORIZON, PARAMETERISATION, SETS, SPECTRAL
from gonio.resampling.interpolation import Interpolator, Targets, interpolator, targets_of
from gonio.resampling.lookup import Measured

Values = npt.NDArray[np.float64]
Fill = Callable[[xr.Dataset], Values]  # the BRDF at the directions of a flat scan, as a fitted model gives it

SYMMETRIES = {
    "reciprocity": "source and detector exchanged",
    "bilateral": "mirrored in the plane of incidence",
}
MOST_LOOKED_UP = 400_000  # values of a set; of a larger table a node's own value comes out of the interpolation
ORIGINS = ("missing", "measured", "interpolated", "by_symmetry", "filled")
MISSING, MEASURED, INTERPOLATED, BY_SYMMETRY, FILLED = range(len(ORIGINS))


@dataclass(frozen=True)
class Filling:
    """What may stand where a scan has no value: its images under symmetries first, then a function such as a model."""

    symmetries: tuple[str, ...] = ()
    function: Fill | None = None
    name: str = ""


def resample(
    scan: xr.Dataset, onto: xr.Dataset, *, impose: Sequence[str] = (), filling: Filling | None = None
) -> xr.Dataset:
    """The BRDF of `scan` at the directions of `onto`, a Dataset of coordinates on a grid or on `direction`.

    Values at directions that both have are taken as they are. Between them is linear interpolation in the scan's own
    coordinates (interpolation.py), or the format's own where the scan carries one; outside is NaN. Masked values are
    gaps. `impose` names symmetries of SYMMETRIES: the mean over the images of each direction. `filling` says what may
    stand in gaps; without it they stay. An uncertainty goes along as if those between neighbours were fully correlated.
    The result has the dimensions of `onto`, those of SETS with several values before them; history says what was done.
    Raises ValueError for a symmetry that is none.
    """
    for name in (*impose, *(filling.symmetries if filling else ())):
        if name not in SYMMETRIES:
            raise ValueError(f"no symmetry {name!r}: there are {', '.join(SYMMETRIES)}")
    directions = _directions(onto)
    targets = targets_of(directions)
    above = (targets.theta_i <= HORIZON) & (targets.theta_r <= HORIZON)
    rows = np.flatnonzero(above)
    columns: dict[str, list[Values]] = {}
    keys, how = [], ""
    for key, part in parts(_without_masked(scan)):
        if not impose and filling is None and is_on(part, onto):
            found = _as_it_is(part, _grid_dims(onto), rows)
        else:
            found, how = _set(part, targets.part(rows), impose, filling)
        if filling is not None and filling.function is not None:
            _fill(found, directions.isel(direction=rows), key, filling.function)
        keys.append(key)
        for name, column in found.items():
            columns.setdefault(name, []).append(_spread_out(column, above))
    origins = np.concatenate(columns["origin"])[np.tile(above, len(keys))]
    if filling is None:
        del columns["origin"]
    out = _assembled(scan, onto, directions, keys, {n: c for n, c in columns.items() if len(c) == len(keys)})
    return dataset.add_history(out, _words(origins, len(rows), how, impose, filling))


def _words(origins: Values, directions: int, how: str, impose: Sequence[str], filling: Filling | None) -> str:
    """How the values came about, in one line."""
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


def is_on(scan: xr.Dataset, onto: xr.Dataset) -> bool:
    """Whether the scan is on this very grid already."""
    if {d for d in scan["brdf"].dims if d not in SETS} != set(_grid_dims(onto)):
        return False
    names = [n for n in DIRECTIONS if n in onto.variables]
    return all(n in scan.coords and scan[n].dims == onto[n].dims and scan[n].equals(onto[n]) for n in names)


def parts(scan: xr.Dataset) -> Iterator[tuple[dict[str, Any], xr.Dataset]]:
    """Each set of a scan with what tells it from the others, grids and parameterisations kept."""
    along = [d for d in scan["brdf"].dims if d in SETS]
    if scan["brdf"].dims != ("direction",):
        for at in np.ndindex(*(scan.sizes[d] for d in along)):
            part = scan.isel(dict(zip(along, at, strict=True)))
            yield {str(d): part[d].values.item() for d in along}, part
        return
    names = dataset.sets(scan)
    codes = [np.unique(scan[n].values, return_inverse=True)[1].ravel() for n in names]
    if not names:
        yield {}, scan
        return
    _, first, group = np.unique(np.column_stack(codes), axis=0, return_index=True, return_inverse=True)
    for k, row in enumerate(first):
        key = {n: scan[n].values[row].item() for n in names}
        yield key, scan.isel(direction=np.flatnonzero(group.ravel() == k))


def _directions(onto: xr.Dataset) -> xr.Dataset:
    """The directions of a Dataset on one dimension, in the order of its own."""
    names = [n for n in DIRECTIONS if n in onto.variables]
    wide = _grid_dims(onto)
    shape = tuple(onto.sizes[d] for d in wide)
    template = xr.DataArray(np.zeros(shape), dims=wide)
    full = {n: onto[n].drop_vars(onto[n].coords).broadcast_like(template).transpose(*wide).values for n in names}
    return xr.Dataset(coords={n: ("direction", v.ravel().astype(float), {"units": "degree"}) for n, v in full.items()})


def _grid_dims(onto: xr.Dataset) -> tuple[Any, ...]:
    """The dimensions along which directions differ."""
    return tuple(d for d in onto.dims if any(d in onto[n].dims for n in DIRECTIONS if n in onto.variables))


def _without_masked(scan: xr.Dataset) -> xr.Dataset:
    if "mask" not in scan:
        return scan
    return scan.assign(brdf=scan["brdf"].where(scan["mask"] == 0).assign_attrs(scan["brdf"].attrs)).drop_vars("mask")


def _spread_out(values: Values, above: npt.NDArray[np.bool_]) -> Values:
    out = np.full(len(above), np.nan)
    out[above] = values
    return out


def _as_it_is(part: xr.Dataset, grid: tuple[Any, ...], rows: npt.NDArray[np.intp]) -> dict[str, Values]:
    """The columns of one set that is on the wanted grid already, where several nodes may be one direction."""
    names = [n for n in ("brdf", "uncertainty", "uncertainty_systematic") if n in part]
    found = {n: part[n].transpose(*grid).values.astype(float).ravel()[rows] for n in names}
    return found | {"origin": np.where(np.isnan(found["brdf"]), MISSING, MEASURED).astype(float)}


def _set(
    part: xr.Dataset, wanted: Targets, impose: Sequence[str], filling: Filling | None
) -> tuple[dict[str, Values], str]:
    """The columns of one set at the directions wanted: brdf, origin and uncertainties; and how values lie between."""
    source, how = _source(part)
    measured = Measured(part) if part["brdf"].size <= MOST_LOOKED_UP else None
    values, exact = _at(source, measured, wanted)
    if impose:
        values = _mean_of([values, *(_at(source, measured, image)[0] for image in _images(wanted, impose))])
    origin = np.where(np.isnan(values), MISSING, np.where(exact & (not impose), MEASURED, INTERPOLATED)).astype(float)
    gaps = np.flatnonzero(np.isnan(values))
    if filling is not None and filling.symmetries and len(gaps):
        images = [_at(source, measured, image)[0] for image in _images(wanted.part(gaps), filling.symmetries)]
        values[gaps] = _mean_of(images)
        origin[gaps[np.isfinite(values[gaps])]] = BY_SYMMETRY
    uncertainties = {} if impose or measured is None else _uncertainties(part, wanted, measured)
    return {"brdf": values, "origin": origin, **uncertainties}, how


def _at(source: Interpolator, measured: Measured | None, wanted: Targets) -> tuple[Values, npt.NDArray[np.bool_]]:
    """Values as measured where they were, else interpolated, and which are which."""
    if measured is None:
        return source(wanted), np.zeros(len(wanted), dtype=bool)
    values, exact = measured.at(wanted, "brdf")
    rest = np.flatnonzero(~exact)
    if len(rest):
        values[rest] = source(wanted.part(rest))
    return values, exact


def _uncertainties(part: xr.Dataset, wanted: Targets, measured: "Measured") -> dict[str, Values]:
    found = {}
    for name in ("uncertainty", "uncertainty_systematic"):
        if name in part and part[name].dims == part["brdf"].dims:
            values, exact = measured.at(wanted, name)
            rest = np.flatnonzero(~exact)
            if len(rest):
                values[rest] = interpolator(part.assign(brdf=part[name]))[0](wanted.part(rest))
            found[name] = values
    return found


def _source(part: xr.Dataset) -> tuple[Interpolator, str]:
    """The format's own interpolation where the scan carries one, else that between its directions."""
    name = part.attrs.get(PARAMETERISATION)
    if not name:
        return interpolator(part)
    from gonio.formats import formats

    evaluate = formats()[name].evaluate
    if evaluate is None:
        return interpolator(part)
    return lambda t: np.ravel(evaluate(part, t.theta_i, t.theta_r, t.phi, t.phi_i)), f"as {name} files are read"


def _images(wanted: Targets, symmetries: Sequence[str]) -> Iterator[Targets]:
    """The other directions at which a surface with these symmetries has the same BRDF."""
    swapped = Targets(wanted.theta_r, wanted.theta_i, -wanted.phi % 360.0, (wanted.phi_i + wanted.phi) % 360.0)
    if "reciprocity" in symmetries:
        yield swapped
    if "bilateral" in symmetries:
        yield _mirrored(wanted)
        if "reciprocity" in symmetries:
            yield _mirrored(swapped)


def _mirrored(wanted: Targets) -> Targets:
    return Targets(wanted.theta_i, wanted.theta_r, -wanted.phi % 360.0, -wanted.phi_i % 360.0)


def _mean_of(images: Sequence[Values]) -> Values:
    known = np.isfinite(images)
    total = np.where(known, images, 0.0).sum(axis=0)
    with np.errstate(invalid="ignore"):
        return total / np.where(known.any(axis=0), known.sum(axis=0), np.nan)


def _fill(found: dict[str, Values], directions: xr.Dataset, key: Mapping[str, Any], function: Fill) -> None:
    """Put the function's values into the gaps of one set."""
    gaps = np.flatnonzero(np.isnan(found["brdf"]))
    if not len(gaps):
        return
    there = directions.isel(direction=gaps)
    there = there.assign_coords({n: ("direction", np.full(len(gaps), v)) for n, v in key.items()})
    found["brdf"][gaps] = function(there.assign(brdf=("direction", np.zeros(len(gaps)))))
    found["origin"][gaps[np.isfinite(found["brdf"][gaps])]] = FILLED


def _assembled(
    scan: xr.Dataset,
    onto: xr.Dataset,
    directions: xr.Dataset,
    keys: list[dict[str, Any]],
    columns: Mapping[str, list[Values]],
) -> xr.Dataset:
    """The sets side by side: dimensions of their own before those of a grid, repeated along `direction` otherwise."""
    attrs = {k: v for k, v in scan.attrs.items() if k not in (PARAMETERISATION, "stored", "symmetry")}
    units = {name: scan[name].attrs if name in scan else _ORIGIN for name in columns}
    single = {n: scan[n].values.ravel()[0] for n in SETS if n in scan.coords and n not in keys[0]}
    wide = _grid_dims(onto)
    if wide == ("direction",):
        names = [n for n in DIRECTIONS if n in directions.coords]
        coords = {n: ("direction", np.tile(directions[n].values, len(keys)), {"units": "degree"}) for n in names}
        count = directions.sizes["direction"]
        told = {n: np.repeat(np.array([key[n] for key in keys]), count) for n in keys[0]}
        told |= {n: np.full(count * len(keys), v) for n, v in single.items()}
        data = {n: ("direction", np.concatenate(c), units[n]) for n, c in columns.items()}
        return xr.Dataset(
            data, coords=coords | {n: ("direction", v, _spectral(n)) for n, v in told.items()}, attrs=attrs
        )
    along = {n: np.array(list(dict.fromkeys(key[n] for key in keys))) for n in keys[0]}
    shape = tuple(onto.sizes[d] for d in wide)
    full = {n: np.full((*(len(v) for v in along.values()), *shape), np.nan) for n in columns}
    for k, key in enumerate(keys):
        at = tuple(int(np.flatnonzero(values == key[n])[0]) for n, values in along.items())
        for name, column in columns.items():
            full[name][at] = column[k].reshape(shape)
    grid = {n: onto[n].variable for n in onto.coords}
    variables: dict[str, Any] = {n: ((*along, *wide), v, units[n]) for n, v in full.items()}
    sets = {n: (n, v, _spectral(n)) for n, v in along.items()} | {n: ((), v, _spectral(n)) for n, v in single.items()}
    return xr.Dataset(variables, coords=grid | sets, attrs=attrs)


_ORIGIN = {"flag_values": np.arange(len(ORIGINS)), "flag_meanings": " ".join(ORIGINS), "units": "1"}


def _spectral(name: str) -> dict[str, str]:
    return {"units": "nm"} if name == SPECTRAL[0] else {}

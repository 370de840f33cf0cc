"""The Zarr store of the results of a stack: the Dataset of `fit_many` for all lanes, written block by block.

Every array over the lanes has one chunk for each block, and every chunk is a file. So no two tasks write to the same
file, and no locks are needed. What all lanes have in common (the parameters, which of them are held, the coordinates of
the lanes, the attributes) is written once, when the store is made.

The store can be opened at any time: the lanes of blocks that are not written yet read as fill values, and their status
is `not_fitted_yet`. Which blocks are written is in the manifest.
"""

import itertools
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.fitting.stack.manifest import FOLDER, BlockGrid, now
from gonio.fitting.status import MINIMA
from gonio.processes.portable import synchronise

OF_ONE_CALL = ("seconds",)  # attributes of one call of `fit_many`, which do not hold for the whole store
NOT_FITTED = "not_fitted_yet"  # the status of lanes whose block is not written
REACHED = tuple(status.name.lower() for status in MINIMA)  # statuses of lanes that have a result


def is_per_lane(variable: xr.DataArray, blocks: BlockGrid) -> bool:
    """Whether a variable has a value for each lane: its first dimensions are those of the lanes, in their order."""
    return variable.dims[: len(blocks.dims)] == blocks.dims


def create(path: Path, empty: xr.Dataset, coords: Mapping[Any, xr.DataArray], blocks: BlockGrid, run: Any) -> None:
    """Make a store in which no lane is fitted yet, and its manifest.

    empty: what `fit_many` gives for no lanes. It shows which variables there will be: those over the lanes become
        arrays of the full size without chunks, which read as fill values, and the others are stored as they are.
    coords: the coordinates of all lanes. run: the declaration of the run, for the manifest.
    """
    import zarr

    common = empty.drop_vars([n for n in empty.variables if set(empty[n].dims) & set(blocks.dims)])
    common.attrs = {k: _plain(v) for k, v in empty.attrs.items() if k not in OF_ONE_CALL}
    common = with_settled_texts(common.assign_coords(coords))
    # The coordinates bring the encodings (chunks, compressors) of the stack's own store, which need not suit this one.
    common.drop_encoding().to_zarr(path, mode="w", zarr_format=3, consolidated=False)
    group = zarr.open_group(path, mode="r+")
    for name in [str(n) for n in empty.data_vars if is_per_lane(empty[n], blocks)]:
        _create_array(group, name, empty[name], blocks)
    group.create_group(FOLDER, attributes={"begun": now(), "run": run})
    consolidate(path)


def with_settled_texts(data: xr.Dataset) -> xr.Dataset:
    """The same with all texts in the one type of texts that Zarr format 3 has settled."""
    for name in [str(n) for n, v in data.variables.items() if v.dtype.kind in "US" or _is_text(v)]:
        texts = data[name].values.astype(np.dtypes.StringDType())
        data = data.assign({name: (data[name].dims, texts, data[name].attrs)})
    return data


def _is_text(variable: xr.Variable) -> bool:
    """Whether an array of Python objects holds texts alone."""
    return variable.dtype.kind == "O" and all(isinstance(v, str) for v in variable.values.ravel())


def _create_array(group: Any, name: str, variable: xr.DataArray, blocks: BlockGrid) -> None:
    """An array over all lanes with the dtype, attributes and further dimensions of a variable, and no chunk yet.

    Chunks of the further dimensions (parameters) are whole. Each chunk has a checksum, so that a damaged one is found
    when it is read.
    """
    from zarr.codecs import Crc32cCodec, ZstdCodec

    tail = variable.shape[len(blocks.dims) :]
    attributes = {k: _plain(v) for k, v in variable.attrs.items()}
    fill: Any = np.nan if variable.dtype.kind == "f" else variable.dtype.type(0)
    if "flag_values" in attributes:
        # Flags have no NaN: lanes without a result get a flag of their own, below all that a fit can give.
        values = attributes["flag_values"]
        fill = min([0, *values]) - 1
        attributes["flag_values"] = [fill, *values]
        attributes["flag_meanings"] = f"{NOT_FITTED} {attributes['flag_meanings']}"
    group.create_array(
        name,
        shape=(*blocks.shape, *tail),
        chunks=(*blocks.chunk, *(max(1, n) for n in tail)),  # Zarr allows no chunk of size 0
        dtype=variable.dtype,
        fill_value=fill,
        compressors=[ZstdCodec(level=3), Crc32cCodec()],
        dimension_names=[str(d) for d in variable.dims],
        attributes=attributes,
    )


def _plain(value: Any) -> Any:
    """An attribute as JSON can hold it: lists and numbers of Python in place of NumPy's."""
    return value.tolist() if hasattr(value, "tolist") else value


def consolidate(path: Path) -> None:
    """Copy the metadata of all arrays into the group's own file, from which a store is opened by one read."""
    import warnings

    import zarr

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # consolidated metadata are not yet in the specification, and are harmless
        zarr.consolidate_metadata(path)


def write(path: Path, result: xr.Dataset, blocks: BlockGrid, block: int) -> None:
    """Write the results of one block into its chunks, and return when they are on the disk.

    result: what `fit_many` gave for the lanes of the block, with the lane dimensions first. Chunks that an earlier
    computation left, whole or not, are replaced. The caller marks the block as written afterwards.
    """
    import zarr

    region: Any = tuple(blocks.region(block).values())
    names = [str(n) for n in result.data_vars if is_per_lane(result[n], blocks)]
    group = zarr.open_group(path, mode="r+", use_consolidated=False)
    # By default Zarr writes no file for a chunk of nothing but fill values (such as at_bound, False everywhere), and
    # there would be nothing to synchronise.
    with zarr.config.set({"array.write_empty_chunks": True}):
        for name in names:
            array: Any = group[name]
            array[region] = result[name].values
            for file in _chunk_files(path / name, array, blocks.place(block)):
                synchronise(file)
                # A new file is also a new entry of its folder, and so on up to the folder of the array.
                for folder in list(file.parents)[: array.ndim + 1]:
                    synchronise(folder)


def remove_leftovers(path: Path, result: xr.Dataset, blocks: BlockGrid, block: int, before: float) -> None:
    """Remove the unfinished files of a block that a process left when it was killed while Zarr wrote its chunks.

    Zarr writes a chunk under a name of its own and renames it. Files younger than `before` [s since 1970] stay, because
    another worker may be writing them.
    """
    import zarr

    group = zarr.open_group(path, mode="r", use_consolidated=False)
    for name in [str(n) for n in result.data_vars if is_per_lane(result[n], blocks)]:
        for file in _chunk_files(path / name, group[name], blocks.place(block)):
            for left in file.parent.glob(f"{file.name}.*.partial"):
                if left.stat().st_mtime < before:
                    left.unlink(missing_ok=True)


def _chunk_files(folder: Path, array: Any, place: tuple[int, ...]) -> Iterator[Path]:
    """The files of a block's chunks, by Zarr format 3 `c/i/j/..`; one, as further dimensions are not cut."""
    counts = [range(-(-n // c)) for n, c in zip(array.shape, array.chunks, strict=True)][len(place) :]
    return (folder.joinpath("c", *map(str, (*place, *rest))) for rest in itertools.product(*counts))


def statuses(result: xr.Dataset) -> dict[str, int]:
    """How many lanes of a result have each status, by the name of the status; empty where it has no status."""
    if "status" not in result:
        return {}
    names = _status_names(result["status"].attrs)
    values, counts = np.unique(result["status"].values, return_counts=True)
    return {names[v]: n for v, n in zip(values.tolist(), counts.tolist(), strict=True)}


def undetermined(result: xr.Dataset) -> dict[str, int]:
    """In how many lanes of a result each value has an infinite uncertainty, by its name, where there are such."""
    if "uncertainty" not in result:
        return {}
    infinite = np.isinf(result["uncertainty"].transpose(..., "parameter").values)
    counts = infinite.reshape(-1, infinite.shape[-1]).sum(axis=0).tolist()
    return {str(name): n for name, n in zip(result["parameter"].values, counts, strict=True) if n}


def failed(path: Path, blocks: BlockGrid, some: Iterable[int], most: int) -> list[dict[str, Any]]:
    """The first lanes of some blocks, `most` at most, whose search reached no minimum: `at` (by dimension), `status`.

    The blocks must be written. A dimension without a coordinate gives its index in the stack.
    """
    import zarr

    found: list[dict[str, Any]] = []
    stored = xr.open_dataset(path, engine="zarr", chunks=None, consolidated=False, decode_times=False)
    group = zarr.open_group(path, mode="r", use_consolidated=False)
    for block in some:
        region = blocks.region(block)
        array: Any = group["status"]
        values = array[tuple(region.values())]
        names = _status_names(array.attrs)
        for place in np.argwhere(~np.isin(values, [v for v, name in names.items() if name in REACHED])):
            at = {dim: part.start + int(k) for (dim, part), k in zip(region.items(), place, strict=True)}
            named = {dim: _plain(stored[dim].values[k]) if dim in stored.coords else k for dim, k in at.items()}
            found.append({"at": named, "status": names[int(values[tuple(place)])]})
            if len(found) == most:
                return found
    return found


def _status_names(attrs: Mapping[str, Any]) -> dict[int, str]:
    """The names of the statuses by their numbers."""
    return dict(zip(np.asarray(attrs["flag_values"]).tolist(), str(attrs["flag_meanings"]).split(), strict=True))


def worst(result: xr.Dataset, stack: xr.Dataset, region: Mapping[str, slice]) -> dict[str, Any] | None:
    """The lane of a block that has the largest finite cost E: `at` (by dimension), `cost` and `status`.

    stack: the block's part of the stack, whose coordinates name the lane. A dimension without a coordinate gives its
    index in the whole stack. region: as `BlockGrid.region` gives it. None where no lane has a finite cost.
    """
    cost = result["cost"].values if "cost" in result else np.empty(0)
    if not np.isfinite(cost).any():
        return None
    # nanargmax ignores NaN, but would choose an infinite cost.
    place = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(cost), cost, np.nan))), cost.shape)
    at = {}
    for (dim, part), k in zip(region.items(), place, strict=True):
        at[dim] = _plain(stack[dim].values[k]) if dim in stack.coords else part.start + int(k)
    lane = result.isel({dim: [int(k)] for dim, k in zip(region, place, strict=True)})
    return {
        # The record is written as JSON, so anything but numbers and texts becomes text.
        "at": {dim: v if isinstance(v, int | float | str) else str(v) for dim, v in at.items()},
        "cost": float(cost[place]),
        "status": next(iter(statuses(lane)), ""),
    }

"""The Zarr store of a Solution of many lanes: one chunk of every array for each block, so that no two share a file."""

import itertools
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.fitting.stack.manifest import FOLDER, BlockGrid, now
from gonio.portable import synchronise

OF_ONE_CALL = ("seconds",)  # attributes of a Solution that are not those of all blocks
NOT_FITTED = "not_fitted_yet"  # the status of lanes whose block is not written


def is_per_lane(variable: xr.DataArray, blocks: BlockGrid) -> bool:
    return variable.dims[: len(blocks.dims)] == blocks.dims


def create(path: Path, empty: xr.Dataset, coords: Mapping[Any, xr.DataArray], blocks: BlockGrid, run: Any) -> None:
    """A store in which no lane is fitted yet, and its manifest.

    `empty` is the Solution of no lanes: its variables with lane dimensions become arrays without values, the others
    are stored. `coords` are the coordinates of all lanes.
    """
    import zarr

    common = empty.drop_vars([n for n in empty.variables if set(empty[n].dims) & set(blocks.dims)])
    common.attrs = {k: _plain(v) for k, v in empty.attrs.items() if k not in OF_ONE_CALL}
    common = common.assign_coords(coords)
    for name in [str(n) for n, v in common.variables.items() if v.dtype.kind in "US" or _is_text(v)]:
        texts = common[name].values.astype(np.dtypes.StringDType())  # the type of texts that Zarr's format 3 settled
        common = common.assign({name: (common[name].dims, texts, common[name].attrs)})
    common.drop_encoding().to_zarr(path, mode="w", zarr_format=3, consolidated=False)
    group = zarr.open_group(path, mode="r+")
    for name in [str(n) for n in empty.data_vars if is_per_lane(empty[n], blocks)]:
        _create_array(group, name, empty[name], blocks)
    group.create_group(FOLDER, attributes={"begun": now(), "run": run})
    _consolidate(path)


def _is_text(variable: xr.Variable) -> bool:
    return variable.dtype.kind == "O" and all(isinstance(v, str) for v in variable.values.ravel())


def _create_array(group: Any, name: str, variable: xr.DataArray, blocks: BlockGrid) -> None:
    from zarr.codecs import Crc32cCodec, ZstdCodec

    tail = variable.shape[len(blocks.dims) :]
    attributes = {k: _plain(v) for k, v in variable.attrs.items()}
    fill: Any = np.nan if variable.dtype.kind == "f" else variable.dtype.type(0)
    if "flag_values" in attributes:
        values = attributes["flag_values"]
        fill = min([0, *values]) - 1
        attributes["flag_values"] = [fill, *values]
        attributes["flag_meanings"] = f"{NOT_FITTED} {attributes['flag_meanings']}"
    group.create_array(
        name,
        shape=(*blocks.shape, *tail),
        chunks=(*blocks.chunk, *(max(1, n) for n in tail)),
        dtype=variable.dtype,
        fill_value=fill,
        compressors=[ZstdCodec(level=3), Crc32cCodec()],
        dimension_names=[str(d) for d in variable.dims],
        attributes=attributes,
    )


def _plain(value: Any) -> Any:
    return value.tolist() if hasattr(value, "tolist") else value


def _consolidate(path: Path) -> None:
    import warnings

    import zarr

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # consolidated metadata are not yet in the specification, and are harmless
        zarr.consolidate_metadata(path)


def write(path: Path, result: xr.Dataset, blocks: BlockGrid, block: int) -> None:
    """Put the Solution of one block into its chunks, and have these on the disk; what was half written is replaced."""
    import zarr

    region: Any = tuple(blocks.region(block).values())
    names = [str(n) for n in result.data_vars if is_per_lane(result[n], blocks)]
    group = zarr.open_group(path, mode="r+", use_consolidated=False)
    with zarr.config.set({"array.write_empty_chunks": True}):
        for name in names:
            array: Any = group[name]
            array[region] = result[name].values
            for file in _chunk_files(path / name, array, blocks.place(block)):
                synchronise(file)
                for folder in list(file.parents)[: array.ndim + 1]:
                    synchronise(folder)


def _chunk_files(folder: Path, array: Any, place: tuple[int, ...]) -> Iterator[Path]:
    counts = [range(-(-n // c)) for n, c in zip(array.shape, array.chunks, strict=True)][len(place) :]
    return (folder.joinpath("c", *map(str, (*place, *rest))) for rest in itertools.product(*counts))


def statuses(result: xr.Dataset) -> dict[str, int]:
    """How many lanes have which status, by its name."""
    if "status" not in result:
        return {}
    attrs = result["status"].attrs
    names = dict(zip(np.asarray(attrs["flag_values"]).tolist(), str(attrs["flag_meanings"]).split(), strict=True))
    values, counts = np.unique(result["status"].values, return_counts=True)
    return {names[v]: n for v, n in zip(values.tolist(), counts.tolist(), strict=True)}


def worst(result: xr.Dataset, stack: xr.Dataset, region: Mapping[str, slice]) -> dict[str, Any] | None:
    """The lane of a block that has the largest cost: `at` (its coordinates, or places), `cost` and `status`.

    `stack` is the block's part of the stack. None where no lane has a cost.
    """
    cost = result["cost"].values if "cost" in result else np.empty(0)
    if not np.isfinite(cost).any():
        return None
    place = np.unravel_index(int(np.nanargmax(np.where(np.isfinite(cost), cost, np.nan))), cost.shape)
    at = {}
    for (dim, part), k in zip(region.items(), place, strict=True):
        at[dim] = stack[dim].values[k].item() if dim in stack.coords else part.start + int(k)
    lane = result.isel({dim: [int(k)] for dim, k in zip(region, place, strict=True)})
    return {
        "at": {dim: v if isinstance(v, int | float | str) else str(v) for dim, v in at.items()},
        "cost": float(cost[place]),
        "status": next(iter(statuses(lane)), ""),
    }

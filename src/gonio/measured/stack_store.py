"""A stack of scans in a Zarr store, opened without reading it, and what tells one stack from another."""

import hashlib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.door.text import MOST_VALUES, clip, head
from gonio.door.zarr_chunks import METADATA, NAMES, STACK, check_chunks, plans
from gonio.files import FormatError
from gonio.measured.dataset import DIRECTIONS, SETS
from gonio.measured.sound import faults, missing
from gonio.measured.stack import foreign_dims

FORMAT_2 = (".zgroup", ".zattrs", ".zmetadata")
RESULTS = "manifest"  # the group that a store of fitted values has


def open_stack(path: str | Path) -> xr.Dataset:
    """The stack with its coordinates, and whatever else its scans share, in memory; the rest stays in the store.

    Metadata are checked, and the chunks of what is read. The other arrays are read later, block by block.
    Raises FormatError with the file in the store, and with the remedy where there is no Zarr store.
    """
    path = Path(path)
    if not path.exists():
        raise FormatError(path, "there is no such Zarr store")
    if not path.is_dir():
        head(path, 1)  # refuses pipes and archives in their own words
    if any((path / name).is_file() for name in FORMAT_2) and not (path / METADATA).is_file():
        raise FormatError(path, "is a store of Zarr format 2: save it in format 3", f"{FORMAT_2[0]}, byte 0")
    if not (path / METADATA).is_file():
        what = "is no Zarr store: make one by gonio stack FILES --out STACK.zarr, or take gonio fit for one scan"
        raise FormatError(path, what, "byte 0")
    if (path / RESULTS).is_dir():
        raise FormatError(path, "holds what gonio fit-stack wrote, and no stack of scans", f"{METADATA}, line 1")
    arrays = {plan.name: plan for plan in plans(path, STACK)}
    stack = _opened(path)
    if "brdf" not in stack:
        have = ", ".join(map(str, stack.data_vars)) or "none"
        what = f"holds no variable brdf, and a stack of scans needs one; it has {clip(have, 100)}"
        raise FormatError(path, what, f"{METADATA}, line 1")
    for name in [str(n) for n in stack.variables if n in stack.coords or _is_shared(stack, str(n))]:
        check_chunks(arrays[name])
        values = {name: _read(path, stack[name].variable)}
        stack = stack.assign_coords(values) if name in stack.coords else stack.assign(values)
    if lacking := missing(stack):
        raise FormatError(path, f"has no {lacking}: a stack needs the directions of its scans", f"{METADATA}, line 1")
    for name, what in faults(stack):
        raise FormatError(path, f"{name} {what}", f"{name}/{METADATA}, line 1")
    return stack


def is_store(path: Path) -> bool:
    """Whether a folder is a Zarr store that may hold a stack: of the format that is read, and not of fitted values."""
    return (path / METADATA).is_file() and not (path / RESULTS).is_dir()


def _is_shared(stack: xr.Dataset, name: str) -> bool:
    """Whether an array, such as a mask of directions, is the same for all scans, and small enough to be read."""
    variable = stack[name]
    return name != "brdf" and not set(variable.dims) & set(foreign_dims(stack)) and variable.size <= MOST_VALUES


def _opened(path: Path) -> xr.Dataset:
    """The arrays of a store whose metadata were checked, not yet read."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on types of texts that the format has not settled: they are only read
            stack = xr.open_dataset(path, engine="zarr", chunks=None, consolidated=False, decode_times=False)
            return stack.set_coords([n for n in (*DIRECTIONS, *SETS) if n in stack.variables])
    except Exception as error:  # whatever damaged metadata lead Zarr to
        raise _damaged(path, error) from error


def _read(path: Path, variable: xr.Variable) -> xr.Variable:
    """A coordinate in memory, with texts for the indexes as which gonio's own writer stores them."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            loaded = variable.load()
            texts = loaded.attrs.get(NAMES)
            if texts is None and loaded.dtype.kind in "OT":  # as Zarr gives texts of any length
                values = np.array(loaded.values.ravel().tolist(), dtype=str).reshape(loaded.shape)
                return xr.Variable(loaded.dims, values, loaded.attrs)
            if texts is None:
                return loaded
            attrs = {k: v for k, v in loaded.attrs.items() if k != NAMES}
            return xr.Variable(loaded.dims, np.array(texts, dtype=str)[loaded.values], attrs)
    except Exception as error:  # whatever damaged bytes lead Zarr to
        raise _damaged(path, error) from error


def _damaged(path: Path, error: Exception) -> FormatError:
    said = " ".join(f"{type(error).__name__}: {error}".split())
    return FormatError(path, f"is a Zarr store that cannot be opened ({clip(said, 160)})", f"{METADATA}, line 1")


def identity(path: str | Path, stack: xr.Dataset) -> dict[str, Any]:
    """What tells this stack from another: its place, its shape, and a checksum of its metadata and coordinates.

    The measured values themselves, which may be terabytes, are not summed.
    """
    total = hashlib.sha256()
    for folder in [Path(path), *sorted(p for p in Path(path).iterdir() if p.is_dir())]:
        if (folder / METADATA).is_file():
            total.update(f"{folder.name}/{METADATA}".encode() if folder != Path(path) else METADATA.encode())
            total.update((folder / METADATA).read_bytes())
    for name in sorted(map(str, stack.coords)):
        values = stack[name].values
        total.update(name.encode())
        total.update(values.tobytes() if values.dtype.kind in "biuf" else repr(values.tolist()).encode())
    return {
        "path": str(Path(path).resolve()),
        "shape": {str(d): int(n) for d, n in stack["brdf"].sizes.items()},
        "dtype": str(stack["brdf"].dtype),
        "checksum": total.hexdigest(),
    }

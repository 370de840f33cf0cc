"""A stack of scans in a Zarr store, opened without reading it, and what tells one stack from another."""

import hashlib
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.door.zarr_chunks import NAMES
from gonio.measured.dataset import DIRECTIONS, SETS

METADATA = ("zarr.json", ".zgroup", ".zattrs", ".zmetadata", ".zarray")


def open_stack(path: str | Path) -> xr.Dataset:
    """The stack with its coordinates read and its arrays left in the store until they are asked for.

    Raises ValueError with the remedy where there is no Zarr store, or one that cannot be opened.
    """
    path = Path(path)
    if not path.exists():
        raise ValueError(f"{path}: there is no such Zarr store")
    if not any((path / name).is_file() for name in METADATA[:2]):
        raise ValueError(f"{path} is no Zarr store: save the stack by xarray's to_zarr, or take gonio fit for one scan")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # on types of texts that the format has not settled: they are only read
            stack = xr.open_dataset(path, engine="zarr", chunks=None)
            stack = stack.set_coords([n for n in (*DIRECTIONS, *SETS) if n in stack.variables])
            for name in [str(n) for n in stack.coords]:
                stack = stack.assign_coords({name: _with_texts(stack[name].variable.load())})
    except Exception as error:  # whatever damaged bytes lead Zarr to
        said = " ".join(f"{type(error).__name__}: {error}".split())
        raise ValueError(f"{path} is a Zarr store that cannot be opened ({said[:160]})") from error
    if "brdf" not in stack:
        have = ", ".join(map(str, stack.data_vars)) or "none"
        raise ValueError(f"{path} holds no variable brdf, and a stack of scans needs one; it has {have}")
    return stack


def _with_texts(variable: xr.Variable) -> xr.Variable:
    """Texts for the indexes as which gonio's own writer stores them."""
    texts = variable.attrs.get(NAMES)
    if texts is None:
        return variable
    attrs = {k: v for k, v in variable.attrs.items() if k != NAMES}
    return xr.Variable(variable.dims, np.array(texts, dtype=str)[variable.values], attrs)


def identity(path: str | Path, stack: xr.Dataset) -> dict[str, Any]:
    """What tells this stack from another: its place, its shape, and a checksum of its metadata and coordinates.

    The measured values themselves, which may be terabytes, are not summed.
    """
    total = hashlib.sha256()
    for folder in [Path(path), *sorted(p for p in Path(path).iterdir() if p.is_dir())]:
        for name in METADATA:
            if (folder / name).is_file():
                total.update(f"{folder.name}/{name}".encode() if folder != Path(path) else name.encode())
                total.update((folder / name).read_bytes())
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

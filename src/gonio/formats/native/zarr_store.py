"""gonio's own Dataset as a Zarr store of format 3: a directory, from which big arrays are read only as they are used.

Names and units are those of docs/conventions.md. Texts (channels, scans) are stored as indexes into the list in the
attribute `names`, since Zarr format 3 has no settled type for texts. Chunks are compressed by zstd and have a CRC-32C
checksum.
"""

import warnings
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.text import clip
from gonio.door.zarr_chunks import METADATA, NAMES, check_chunks, plans
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.dataset import DIRECTIONS, SETS
from gonio.measured.sound import UNCERTAINTIES, faults, missing, pieces

RESULTS = "manifest"  # the group by which a store of fit results is recognised
MOST_BYTES_IN_MEMORY = 33_554_432  # a store of fewer bytes is read at once
VALUES_OF_CHUNK = 1_048_576
_OF_XARRAY = ("_FillValue", "coordinates")


def _recognises(head: bytes) -> bool:
    return head.startswith(b"/") and any(f"/{n}\n".encode() in head for n in (METADATA, ".zgroup", ".zattrs"))


def _read(path: Path) -> xr.Dataset:
    if not (path / METADATA).exists():
        raise FormatError(path, "is a store of Zarr format 2: save it in format 3", ".zgroup, byte 0")
    if (path / RESULTS).is_dir():
        message = "holds what gonio fit-stack found, and no scan: open it by xarray.open_zarr"
        raise FormatError(path, message, f"{METADATA}, line 1")
    arrays = plans(path)
    for plan in arrays:
        check_chunks(plan)
    scan = _opened(path, sum(plan.nbytes for plan in arrays) <= MOST_BYTES_IN_MEMORY)
    _check(path, scan)
    return scan


def _opened(path: Path, at_once: bool) -> xr.Dataset:
    # plans and check_chunks have checked sizes and checksums. Other damage may still raise any exception in Zarr.
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            stored = xr.open_dataset(path, engine="zarr", consolidated=False, decode_cf=False, cache=False, chunks=None)
            scan = stored.load() if at_once else stored
            for name in scan.variables:
                scan = _tidied(scan, str(name))
    except Exception as error:
        cause = f"{type(error).__name__}: {error}".splitlines()[0]
        message = f"is a damaged Zarr store ({clip(cause, 120)})"
        raise FormatError(path, message, f"{METADATA}, line 1") from error
    return scan.set_coords([n for n in (*DIRECTIONS, *SETS) if n in scan.variables])


def _tidied(scan: xr.Dataset, name: str) -> xr.Dataset:
    """The scan with one variable decoded: without xarray's own attributes, and with texts in place of their indexes."""
    variable = scan[name].variable
    attrs = {k: v for k, v in variable.attrs.items() if k not in (*_OF_XARRAY, NAMES)}
    texts = variable.attrs.get(NAMES)
    variable.attrs = attrs
    if texts is None:
        return scan
    index = variable.values
    if not isinstance(texts, list) or any(not isinstance(t, str) for t in texts) or index.dtype.kind not in "iu":
        raise ValueError(f"the names of {name} are no texts")
    if index.size and not 0 <= index.min() <= index.max() < len(texts):
        raise ValueError(f"{name} has no name for {index.max()}")
    return scan.assign({name: (variable.dims, np.array(texts, dtype=str)[index], attrs)})


def _check(path: Path, scan: xr.Dataset) -> None:
    """Raise FormatError for what a scan must not be. Big arrays are checked piece by piece."""
    if lacking := missing(scan):
        message = f"has no {lacking}: a scan needs brdf and the coordinates theta_i, theta_r, phi"
        raise FormatError(path, message, f"{METADATA}, line 1")
    for name, message in faults(scan):
        place = "c, byte 0" if message.startswith("holds") else f"{METADATA}, line 1"
        raise FormatError(path, f"{name} {message}", f"{name}/{place}")
    for name in (n for n in UNCERTAINTIES if n in scan.data_vars):
        _finite(path, scan, name)
    if not _finite(path, scan, "brdf"):
        raise FormatError(path, "every brdf value is zero or missing", f"brdf/{METADATA}, line 1")


def _finite(path: Path, scan: xr.Dataset, name: str) -> bool:
    """Whether any value of a variable differs from zero. Raises FormatError for an infinite one."""
    seen = False
    for piece in pieces(scan[name]):
        if np.isinf(piece).any():
            raise FormatError(path, f"{name} holds an infinite value", f"{name}/c, byte 0")
        seen = seen or bool(np.any(np.nan_to_num(piece)))
    return seen


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write a directory in place of the temporary file, with the dimensions that the scan has, dense or flat."""
    from zarr.codecs import Crc32cCodec, ZstdCodec

    stored = scan.drop_vars("line", errors="ignore").drop_encoding()
    for name in [str(n) for n in stored.variables]:
        stored = _without_texts(stored, name)
    packed = [ZstdCodec(level=3), Crc32cCodec()]
    encoding = {n: {"chunks": _chunks(v.shape), "compressors": packed} for n, v in stored.variables.items()}
    path.unlink(missing_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # consolidated metadata are not in the specification yet, and harmless
        stored.to_zarr(path, mode="w", zarr_format=3, consolidated=True, encoding=encoding, write_empty_chunks=True)


def _without_texts(scan: xr.Dataset, name: str) -> xr.Dataset:
    """The scan with one variable encoded: texts as indexes; for numbers, without xarray's fill value."""
    variable = scan[name]
    if variable.dtype.kind not in "USO":
        scan[name].encoding["_FillValue"] = None
        return scan
    names, index = np.unique(variable.values.astype(str), return_inverse=True)
    indexes = index.reshape(variable.shape).astype(np.int32)
    attrs = variable.attrs | {NAMES: names.tolist()}
    if name in scan.dims:
        scan = scan.drop_vars(name)
    return scan.assign({name: (variable.dims, indexes, attrs)})


def _chunks(shape: tuple[int, ...]) -> tuple[int, ...]:
    """The shape of chunks of about a million values at most: trailing axes stay whole, leading axes are cut."""
    room, chunks = VALUES_OF_CHUNK, []
    for n in reversed(shape):
        chunks.append(max(1, min(n, room)))
        room //= chunks[-1]
    return tuple(reversed(chunks))


FORMAT = Format(
    name="zarr",
    title="gonio Zarr",
    suffix=".zarr",
    recognises=_recognises,
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, transmission=True, relative=True, gaps=True, sets=SETS, variables=("*",)),
)

"""The metadata of a Zarr store, checked against its files before anything is allocated: shapes, chunks, codecs, sums.

Stores of format 3 are read whose arrays are plain numbers in a regular grid of chunks, uncompressed or compressed by
zstd, with or without a CRC-32C. In a scan every chunk must exist: a lost one would be read as fill values. A stack of
scans, which people store with xarray's defaults, may have arrays of texts, and lacks chunks that are all fill values.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gonio.door.json_text import Document, load
from gonio.door.text import MOST_VALUES, clip
from gonio.files import FormatError

METADATA = "zarr.json"
NAMES = "names"  # attribute of an array of indexes: the list of texts to which they point
LONGEST_METADATA = 4_194_304  # bytes
MOST_BYTES_OF_CHUNK = 67_108_864
LONGEST_TEXT = 65_536  # bytes of a text of fixed length
_KINDS = ("bool", "int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float32", "float64")
_FIXED_TEXTS, _TEXTS = "fixed_length_utf32", "string"
_CODECS, _TEXT_CODECS = ("bytes", "zstd", "crc32c"), ("vlen-utf8", "zstd", "crc32c")
_ZSTD = b"\x28\xb5\x2f\xfd"


@dataclass(frozen=True)
class Limits:
    """Limits for the arrays of a store: values, bytes of a chunk, whether texts and missing chunks are allowed."""

    values: int = MOST_VALUES
    chunk_bytes: int = MOST_BYTES_OF_CHUNK
    texts: bool = False
    gaps: bool = False


SCAN = Limits()
STACK = Limits(values=2**50, chunk_bytes=2**31, texts=True, gaps=True)  # may be terabytes: read block by block


@dataclass(frozen=True)
class Plan:
    """One array as its metadata declare it; itemsize is 0 for texts of variable length."""

    store: Path
    name: str
    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    itemsize: int
    codecs: tuple[str, ...]
    gaps: bool = False

    @property
    def nbytes(self) -> int:
        """Bytes of all values in memory."""
        return math.prod(self.shape) * self.itemsize

    @property
    def chunk_nbytes(self) -> int:
        """Bytes of the values of one chunk."""
        return math.prod(self.chunk) * self.itemsize

    def chunk_names(self) -> Any:
        """The names within the store of all chunks of the array, one at a time."""
        counts = tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))
        # itertools.product would hold each range in memory, even one of 2^62 beside a 0, which has no chunk.
        places = (np.unravel_index(k, counts) for k in range(math.prod(counts)))
        return ("/".join((self.name, "c", *map(str, at))) for at in places)


def plans(store: Path, limits: Limits = SCAN) -> list[Plan]:
    """The arrays of a store. Raises FormatError, with the file in the store and the line, for one beyond the limits."""
    root = _metadata(store, METADATA)
    _expect(store, METADATA, root, root.value.get("node_type") == "group", "the store's root is no group", "node_type")
    names = sorted(p.name for p in store.iterdir() if p.name != METADATA)
    if not names:
        raise FormatError(store, "the store holds no array", f"{METADATA}, line 1")
    return [_plan(store, name, limits) for name in names]


def _metadata(store: Path, name: str) -> Document:
    path = store / name
    if not path.is_file():
        raise FormatError(store, f"there is no file {clip(name)} in the store", f"{clip(name)}, byte 0")
    if path.stat().st_size > LONGEST_METADATA:
        raise FormatError(store, f"is longer than {LONGEST_METADATA} bytes", f"{clip(name)}, byte {LONGEST_METADATA}")
    try:
        document = load(path)
    except FormatError as error:
        raise FormatError(store, error.what, f"{name}, {error.where}") from error
    version = document.value.get("zarr_format")
    _expect(store, name, document, version == 3, "zarr_format is not 3: save the store in Zarr format 3", "zarr_format")
    return document


def _expect(store: Path, name: str, document: Document, holds: bool, what: str, *steps: str | int) -> None:
    if not holds:
        raise FormatError(store, what, f"{name}, {document.wrong(what, *steps).where}")


def _plan(store: Path, name: str, limits: Limits) -> Plan:
    file = f"{name}/{METADATA}"
    document = _metadata(store, file)

    def expect(holds: bool, message: str, *steps: str | int) -> None:
        _expect(store, file, document, holds, message, *steps)

    value = document.value
    expect(value.get("node_type") == "array", f"{clip(name)} is no array", "node_type")
    kind = value.get("data_type")
    itemsize = _itemsize(kind, limits.texts)
    expect(itemsize is not None, f"data_type is {clip(str(kind))!r}, not one of {', '.join(_KINDS)}", "data_type")
    assert itemsize is not None
    shape = _sizes(value.get("shape"))
    expect(shape is not None, "shape is no list of counts", "shape")
    grid = value.get("chunk_grid")
    configuration = grid.get("configuration") if isinstance(grid, dict) and grid.get("name") == "regular" else None
    chunk = _sizes(configuration.get("chunk_shape")) if isinstance(configuration, dict) else None
    expect(chunk is not None and min(chunk, default=1) > 0, "there is no regular chunk_grid", "chunk_grid")
    assert shape is not None
    assert chunk is not None
    expect(len(shape) == len(chunk), "chunk_shape has not as many counts as shape", "chunk_grid")
    expect(math.prod(shape) <= limits.values, f"{clip(name)} would hold more than {limits.values} values", "shape")
    room = math.prod(chunk) * (itemsize or 1)
    expect(room <= limits.chunk_bytes, f"a chunk would be {room} bytes: save with smaller chunks", "chunk_grid")
    encoding = value.get("chunk_key_encoding")
    standard = isinstance(encoding, dict) and encoding.get("name") == "default"
    slashed = standard and (encoding.get("configuration") or {"separator": "/"}) == {"separator": "/"}
    expect(slashed, "chunk_key_encoding is not the default one", "chunk_key_encoding")
    expect(not value.get("storage_transformers"), "there are storage_transformers", "storage_transformers")
    codecs = value.get("codecs")
    codec_names = [c.get("name") if isinstance(c, dict) else None for c in codecs] if isinstance(codecs, list) else []
    order = _CODECS if itemsize else _TEXT_CODECS
    known = tuple(n for n in order if n in codec_names)
    message = f"codecs are not {order[0]}, then zstd or none, then crc32c or none: save the store with these"
    expect(bool(codec_names) and tuple(codec_names) == known and known[0] == order[0], message, "codecs")
    return Plan(store, name, shape, chunk, itemsize, known, limits.gaps)


def _itemsize(kind: Any, texts: bool) -> int | None:
    """Bytes of a number, or of a text of fixed length; 0 for texts of variable length, None for unsupported types."""
    if isinstance(kind, str) and kind in _KINDS:
        return np.dtype(kind).itemsize
    if texts and kind == _TEXTS:
        return 0
    configuration = kind.get("configuration") if isinstance(kind, dict) and kind.get("name") == _FIXED_TEXTS else None
    length = configuration.get("length_bytes") if texts and isinstance(configuration, dict) else None
    return int(length) if isinstance(length, float) and 4 <= length <= LONGEST_TEXT and length % 4 == 0 else None


def _sizes(value: Any) -> tuple[int, ...] | None:
    """The value as whole numbers; None where it is not a list of them."""
    if not isinstance(value, list) or len(value) > 16 or set(map(type, value)) - {float}:
        return None
    if any(not 0 <= v <= 2**62 or v != int(v) for v in value):
        return None
    return tuple(map(int, value))


def check_chunks(plan: Plan) -> None:
    """Check that every chunk exists, has the size that its codecs need, and its checksum. Raises FormatError.

    Where a plan allows gaps, chunks that are all fill values may be missing. There may be too many of them to search
    for, so only the chunks that exist are checked.
    """
    for name in _stored_chunks(plan) if plan.gaps else plan.chunk_names():
        path = plan.store / name
        if not path.is_file():
            raise FormatError(plan.store, "a chunk is missing: copy the store whole", f"{name}, byte 0")
        most = plan.chunk_nbytes if plan.itemsize else MOST_BYTES_OF_CHUNK
        if path.stat().st_size > most + most // 8 + 1024:
            raise FormatError(plan.store, "a chunk's file is longer than its values need", f"{name}, byte 0")
        raw = path.read_bytes()
        if "crc32c" in plan.codecs:
            raw = _summed(plan, name, raw)
        size = _content(raw) if "zstd" in plan.codecs else len(raw)
        if plan.itemsize and size != plan.chunk_nbytes:
            message = (
                f"a chunk holds {size if size is not None else 'no stated number of'} bytes, not {plan.chunk_nbytes}"
            )
            raise FormatError(plan.store, message, f"{name}, byte 0")
        if not plan.itemsize:
            _check_texts(plan, name, raw, size)


def _stored_chunks(plan: Plan) -> list[str]:
    """The names of the chunks that exist and belong to the grid of the array."""
    folder = plan.store / plan.name / "c"
    if not plan.shape or folder.is_file():
        return [f"{plan.name}/c"] if folder.is_file() else []
    counts = [-(-n // c) for n, c in zip(plan.shape, plan.chunk, strict=True)]
    names = []
    for path in sorted(p for p in folder.rglob("*") if p.is_file()):
        place = path.relative_to(folder).parts
        of_grid = len(place) == len(counts) and all(
            p.isdecimal() and int(p) < n for p, n in zip(place, counts, strict=True)
        )
        if of_grid:
            names.append("/".join((plan.name, "c", *place)))
    return names


def _check_texts(plan: Plan, name: str, raw: bytes, size: int | None) -> None:
    """Check that a chunk of texts holds the right number, each within the chunk and in UTF-8."""
    from numcodecs.zstd import decompress

    if size is None or size > MOST_BYTES_OF_CHUNK:
        raise FormatError(plan.store, "a chunk of texts is too long, or of no stated length", f"{name}, byte 0")
    try:
        content = bytes(decompress(raw)) if "zstd" in plan.codecs else raw
        count, at = int.from_bytes(content[:4], "little"), 4
        for _ in range(count if count == math.prod(plan.chunk) else 0):
            length = int.from_bytes(content[at : at + 4], "little")
            content[at + 4 : at + 4 + length].decode("utf-8")
            at += 4 + length
    except (RuntimeError, ValueError) as error:
        raise FormatError(plan.store, "a chunk of texts is damaged", f"{name}, byte 0") from error
    if count != math.prod(plan.chunk) or at > len(content):
        raise FormatError(plan.store, "a chunk of texts is damaged: it holds fewer, or more", f"{name}, byte 0")


def _summed(plan: Plan, name: str, raw: bytes) -> bytes:
    import google_crc32c

    body, stated = raw[:-4], raw[-4:]
    if len(raw) < 4 or google_crc32c.value(body) != int.from_bytes(stated, "little"):
        raise FormatError(plan.store, "a chunk is damaged: its checksum differs", f"{name}, byte {len(body)}")
    return body


def _content(raw: bytes) -> int | None:
    """The length of content that the header of a zstd frame states (RFC 8878, 3.1.1.1); None where it states none."""
    if not raw.startswith(_ZSTD) or len(raw) < 6:
        return None
    flags = raw[4]
    single = bool(flags & 0x20)
    width = (1 if single else 0, 2, 4, 8)[flags >> 6]
    start = 5 + (0 if single else 1) + (0, 1, 2, 4)[flags & 3]
    if not width or len(raw) < start + width:
        return None
    return int.from_bytes(raw[start : start + width], "little") + (256 if width == 2 else 0)

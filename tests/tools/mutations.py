"""Damage and malice for files, by seed: what tests/tools/fuzzing.py feeds to the readers.

Every mutation is a function of a random generator, the bytes (a bytearray, changed in place or replaced) and the bytes
of another file of the format.
"""

import re
import struct
import zlib
from collections.abc import Callable, Sequence

import numpy as np

Mutation = Callable[[np.random.Generator, bytearray, bytes], bytearray]

WHOLE = (2**62, -1, 0, 2**31, 2**31 - 1, 2**63 - 1, -(2**62), 1, 255, 65_535)
REAL = (float("nan"), float("inf"), -1.0, 1e308, 0.0, 90.0000001, -0.0, 5e-324)
NUMBERS = (
    *(b"1e999", b"-1e999", b"nan", b"inf", b"-1", b"0", b"-0.0", b"1e-320", b"1e308", b"90.0000001"),
    *(b"4611686018427387904", b"2147483648", b"9" * 400, b"1,5", b"", b"0x10", b"1_000", b"1e", b"--1", b"1d3"),
    *(b"+", b"." * 50, "\uff11\uff12".encode()),
)
_NUMBER = re.compile(rb"[-+]?\d[\d.eE+-]*")
_WORD = re.compile(rb"[A-Za-z_]\w+")
_BRACES = ((b"{", b"}"), (b"[", b"]"), (b"(", b")"), (b"<a>", b"</a>"), (b'{"a":', b"}"), (b"{{", b""), (b"- ", b""))
DEEP = 1_000_000  # braces in one another
MOST = 2**20  # bytes to which repetition may blow a file up
ENTITIES = b'<!DOCTYPE a [<!ENTITY e0 "boom">%s]>' % b"".join(
    b'<!ENTITY e%d "%s">' % (k, b"&e%d;" % (k - 1) * 10) for k in range(1, 12)
)
OUTSIDE = b'<!DOCTYPE a [<!ENTITY e11 SYSTEM "file:///etc/hostname">]>'


def _place(rng: np.random.Generator, size: int) -> int:
    """A place in the file; half of all are near its head, which rules the rest."""
    share = rng.random()
    return int((share**5 if rng.random() < 0.5 else share) * size)


def _length(rng: np.random.Generator, most: float = 10.0) -> int:
    return int(2.0 ** (most * rng.random()))


def _flip(rng, data, other):
    if data:
        data[_place(rng, len(data))] ^= 1 << int(8 * rng.random())
    return data


def _byte(rng, data, other):
    if data:
        data[_place(rng, len(data))] = int(256 * rng.random())
    return data


def _cut(rng, data, other):
    at = _place(rng, len(data))
    del data[at : at + _length(rng)]
    return data


def _insert(rng, data, other):
    at = _place(rng, len(data) + 1)
    data[at:at] = rng.bytes(_length(rng, 6))
    return data


def _duplicate(rng, data, other):
    at = _place(rng, len(data))
    chunk = data[at : at + _length(rng)]
    data[at:at] = chunk
    return data


def _swap(rng, data, other):
    length = _length(rng)
    a, b = sorted((_place(rng, len(data)), _place(rng, len(data))))
    if a + length <= b:
        data[a : a + length], data[b : b + length] = data[b : b + length], data[a : a + length]
    return data


def _zero(rng, data, other):
    at = _place(rng, len(data))
    length = min(_length(rng), len(data) - at)
    data[at : at + length] = bytes((0, 255)[rng.random() < 0.2] for _ in range(length))
    return data


def _truncate(rng, data, other):
    del data[_place(rng, len(data)) :]
    return data


def _join(rng, data, other):
    """Put another file of the format behind this one, or its end behind a part of this one."""
    if rng.random() < 0.5:
        del data[_place(rng, len(data)) :]
        return data + other[_place(rng, len(other)) :]
    return data + other


def _packed(rng, data, pack, values, sizes):
    code = sizes[int(len(sizes) * rng.random())]
    width = struct.calcsize(code)
    at = _place(rng, max(len(data) - width, 1))
    at -= at % width if rng.random() < 0.7 else 0
    if at + width <= len(data):
        data[at : at + width] = pack(code, values[int(len(values) * rng.random())])
    return data


def _whole(rng, data, other):
    """Put a hostile count over two, four or eight bytes; one in four is big-endian, as NetCDF is."""

    def pack(code: str, value: int) -> bytes:
        order = "big" if rng.random() < 0.25 else "little"
        return (value % 2 ** (8 * struct.calcsize(code))).to_bytes(struct.calcsize(code), order)

    return _packed(rng, data, pack, WHOLE, "HIIQQ")


def _real(rng, data, other):
    def pack(code: str, value: float) -> bytes:
        number = min(value, 3e38) if code == "f" and value < 1e309 else value
        return struct.pack((">" if rng.random() < 0.25 else "<") + code, number)

    return _packed(rng, data, pack, REAL, "fd")


def _found(rng, data, pattern):
    return pattern.search(data, _place(rng, len(data))) or pattern.search(data)


def _number(rng, data, other):
    if found := _found(rng, data, _NUMBER):
        data[found.start() : found.end()] = NUMBERS[int(len(NUMBERS) * rng.random())]
    return data


def _numbers(rng, data, other):
    """Put one hostile number over all that are spelt alike: two counts that agree must not make a file whole."""
    if found := _found(rng, data, _NUMBER):
        value = NUMBERS[int(len(NUMBERS) * rng.random())]
        whole = re.compile(rb"(?<![\w.+-])" + re.escape(found.group()) + rb"(?![\w.])")
        return bytearray(whole.sub(value, data, count=1000))
    return data


def _word(rng, data, other):
    """Put one word of the file over another, or drop it."""
    a, b = _found(rng, data, _WORD), _found(rng, data, _WORD)
    if a and b:
        data[a.start() : a.end()] = b.group() if rng.random() < 0.7 else b""
    return data


def _line(rng, data):
    at = _place(rng, len(data))
    start = data.rfind(b"\n", 0, at) + 1
    end = data.find(b"\n", at) + 1
    return start, end or len(data)


def _line_cut(rng, data, other):
    start, end = _line(rng, data)
    del data[start:end]
    return data


def _line_repeat(rng, data, other):
    start, end = _line(rng, data)
    times = min(_length(rng, 13), MOST // max(end - start, 1))
    data[start:start] = data[start:end] * times
    return data


def _line_swap(rng, data, other):
    (a, b), (c, d) = sorted((_line(rng, data), _line(rng, data)))
    if b <= c:
        data[a:d] = data[c:d] + data[b:c] + data[a:b]
    return data


def _nest(rng, data, other):
    """Open a million braces in one another, at a brace where there is one, closed or not."""
    opening, closing = _BRACES[int(len(_BRACES) * rng.random())]
    at = _place(rng, len(data) + 1)
    if rng.random() < 0.6:
        at = max(data.find(opening[:1], at), data.find(opening[:1]), 0)
    data[at:at] = opening * DEEP + (closing * DEEP if rng.random() < 0.3 else b"")
    return data


def _entity(rng, data, other):
    """Declare entities that grow to gigabytes, or that name another file, and use them."""
    declared = data.find(b"?>") + 2 if data.lstrip().startswith(b"<?xml") else 0
    at = max(declared, _place(rng, len(data) + 1))
    if rng.random() < 0.7:
        at = max(data.find(b">", at) + 1, declared)
    data[at:at] = b"&e11;"
    data[declared:declared] = ENTITIES if rng.random() < 0.7 else OUTSIDE
    return data


def _mark(rng, data, other):
    data[0:0] = (b"\xef\xbb\xbf", b"\xff\xfe", b"\xef\xbb\xbf\xef\xbb\xbf")[int(3 * rng.random())]
    return data


def _line_ends(rng, data, other):
    lines = bytes(data).split(b"\n")
    ends = [(b"\n", b"\r\n", b"\r", b"\n\r")[k] for k in rng.integers(0, 4, len(lines) - 1).tolist()] + [b""]
    return bytearray(b"".join(x for pair in zip(lines, ends, strict=True) for x in pair))


def _commas(rng, data, other):
    return bytearray(re.sub(rb"(\d)\.(\d)", rb"\1,\2", data))


def _utf16(rng, data, other):
    return bytearray(data.decode("latin-1").encode(("utf-16", "utf-16-le", "utf-16-be")[int(3 * rng.random())]))


def _blank(rng, data, other):
    at = _place(rng, len(data) + 1)
    blanks = (
        b" ",
        b"\t",
        b"\n",
        b"\n\n\n",
        b"\x0c",
        b"\0",
        "\u00a0".encode(),
        "\u2028".encode(),
        b"\x1b[31m",
        b"#",
        b";",
        b",",
        b'"',
    )
    data[at:at] = blanks[int(len(blanks) * rng.random())] * (1 if rng.random() < 0.8 else _length(rng, 17))
    return data


def _case(rng, data, other):
    start, end = _line(rng, data)
    data[start:end] = data[start:end].swapcase()
    return data


def _repack(rng, data, other):
    """Swell a deflated stream to 64 MB of zeros, if there is one where a zip or a gzip file keeps it."""
    bomb = zlib.compressobj(9, zlib.DEFLATED, -15)
    swollen = b"".join(bomb.compress(bytes(2**20)) for _ in range(64)) + bomb.flush()
    at = data.find(b"PK\x03\x04")
    if at >= 0 and len(data) > at + 30:
        start = at + 30 + int.from_bytes(data[at + 26 : at + 28], "little")
        packed = int.from_bytes(data[at + 18 : at + 22], "little")
        data[start : start + packed] = swollen
        data[at + 18 : at + 22] = len(swollen).to_bytes(4, "little")
    return data


BYTES: tuple[Mutation, ...] = (_flip, _byte, _cut, _insert, _duplicate, _swap, _zero, _truncate, _join, _whole, _real)
OFTEN: tuple[Mutation, ...] = (_number, _number, _number, _numbers, _word, _line_cut, _line_repeat, _line_swap, _blank)
SELDOM: tuple[Mutation, ...] = (_mark, _line_ends, _commas, _utf16, _case, _entity)
MOST_MUTATIONS = 4


def mutated(rng: np.random.Generator, content: bytes, other: bytes) -> tuple[bytearray, list[str]]:
    """The damaged bytes, and the names of what was done to them."""
    data = bytearray(content)
    is_text = b"\0" not in content[:4096]
    done = []
    for _ in range(1 + int(MOST_MUTATIONS * rng.random() ** 2)):
        chance = rng.random()
        if is_text and chance < 0.6:
            kinds = OFTEN
        elif is_text and chance < 0.66:
            kinds = SELDOM
        elif chance > (0.996 if is_text else 0.999):
            kinds = (_nest,)
        elif content.startswith(b"PK") and chance < 0.02:
            kinds = (_repack,)
        else:
            kinds = BYTES
        kind = kinds[int(len(kinds) * rng.random())]
        data = kind(rng, data, other)
        done.append(kind.__name__.lstrip("_"))
    return data, done


def choice(rng: np.random.Generator, weights: Sequence[float]) -> int:
    """An index, in proportion to the weights."""
    left = rng.random() * sum(weights)
    for k, weight in enumerate(weights):
        left -= weight
        if left < 0:
            return k
    return len(weights) - 1

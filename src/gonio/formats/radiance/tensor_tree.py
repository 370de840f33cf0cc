"""Radiance's tensor trees of rank 3 and 4: trees of cells in the unit square to which the hemisphere is mapped.

A direction is projected on the surface, which gives a point of the unit disk, and the disk is mapped to the unit square
with areas in proportion (shirley1997). Rank 4 has the square of the incident direction, then that of the outgoing one.
Rank 3 is for isotropic surfaces: its first coordinate is 1/2 - sin(theta_i)/2, of which only the lower half is used,
then follows the outgoing square, with the incident light travelling to azimuth 0. A cell of level n is 2^-n wide in
every coordinate and holds one value. Incident azimuths are those to which the light travels, opposite to the source.
The layout is that of Radiance's reader, bsdf_t.c.
"""

import re
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from gonio.door.elements import Element
from gonio.door.text import clip

DEEPEST = 15  # levels of a tree; 2^-15 of the square is much less than the cone of any instrument
Array = npt.NDArray[np.float64]
Whole = npt.NDArray[np.int64]
_TOKEN = re.compile(r"[{}]|[^{}]+")
_NEAR_ONE = np.nextafter(1.0, 0.0)


def to_disk(a: Array, b: Array) -> tuple[Array, Array]:
    """Radius and azimuth [rad] in the unit disk of points of the unit square (shirley1997)."""
    x, y = 2 * np.asarray(a) - 1, 2 * np.asarray(b) - 1
    wide = np.abs(x) > np.abs(y)
    major, minor = np.where(wide, x, y), np.where(wide, y, x)
    turn = np.pi / 4 * np.divide(minor, major, out=np.zeros_like(major), where=major != 0)
    azimuth = np.where(wide, turn, np.pi / 2 - turn) + np.where(major < 0, np.pi, 0.0)
    return np.abs(major), azimuth


def to_square(radius: Array, azimuth: Array) -> tuple[Array, Array]:
    """The point of the unit square for a radius and an azimuth [rad] in the unit disk: the inverse of `to_disk`."""
    turned = (np.asarray(azimuth) + np.pi / 4) % (2 * np.pi)
    quarter = np.floor(turned / (np.pi / 2)).astype(int) % 4
    minor = radius * ((turned - quarter * np.pi / 2) / (np.pi / 4) - 1)
    x = np.choose(quarter, [radius, -minor, -radius, minor])
    y = np.choose(quarter, [minor, radius, -minor, -radius])
    return (x + 1) / 2, (y + 1) / 2


def leaves(data: Element, rank: int) -> tuple[Whole, Whole, Array]:
    """Levels (n,), cells (n, rank) and values (n,) of the tree in an element's text. Raises FormatError with the line.

    The lowest bit of a branch's number is the half of the first coordinate; in a grid of values the first coordinate
    runs slowest. Of a tree of rank 3 only the half that is used is returned.
    """
    levels, corners, finers, values = [], [], [], []
    for level, corner, finer, grid in _grids(data, rank):
        if level + finer > DEEPEST:
            raise data.wrong(f"the tree is finer than 2^-{DEEPEST}")
        levels.append(level)
        corners.append(corner)
        finers.append(finer)
        values += grid
    value = np.array(values)
    if not np.isfinite(value).all():
        numbers(data, data.text.replace("{", " ").replace("}", " "))  # raises with the place of the bad value
    counts = np.left_shift(1, np.array(finers) * rank)
    finer_of, level_of, cell = (np.repeat(np.array(v), counts, axis=0) for v in (finers, levels, corners))
    rest = np.arange(len(value)) - np.repeat(np.cumsum(counts) - counts, counts)
    inner = [rest >> finer_of * (rank - 1 - d) & (1 << finer_of) - 1 for d in range(rank)]
    cell = (cell << finer_of[:, None]) + np.stack(inner, axis=-1)
    every = level_of + finer_of
    if rank == 3:
        used = 2 * cell[:, 0] < (1 << every)
        every, cell, value = every[used], cell[used], value[used]
    return every, cell, value


def _grids(data: Element, rank: int) -> Iterator[tuple[int, tuple[int, ...], int, list[float]]]:
    """Level, corner, further levels and values of every innermost pair of braces, in the order of the file."""
    branches = 1 << rank
    seen: list[int] = []  # for each open node, the number of branches read
    corners: list[tuple[int, ...]] = []
    held = False  # whether the values of the innermost open node are read
    ended = False
    for token in _TOKEN.finditer(data.text):
        word, at = token.group(), token.start()
        if word == "{":
            if ended or held:
                raise data.wrong("'{' where '}' was expected" if held else "there is more after the tree's end", at)
            if len(seen) > DEEPEST:
                raise data.wrong(f"the tree's braces are nested more than {DEEPEST} deep", at)
            number = seen[-1] if seen else 0
            if number == branches:
                raise data.wrong(f"a node has more than {branches} branches", at)
            above = corners[-1] if corners else (0,) * rank
            corners.append(tuple(2 * c + (number >> d & 1) for d, c in enumerate(above)) if seen else above)
            if seen:
                seen[-1] += 1
            seen.append(0)
        elif word == "}":
            if not seen:
                raise data.wrong("'}' without '{'", at)
            if not held and seen[-1] != branches:
                raise data.wrong(f"a node has {seen[-1]} branches, not {branches}", at)
            seen.pop()
            corners.pop()
            held, ended = False, not seen
        elif word.replace(",", " ").strip():
            if not seen or seen[-1]:
                raise data.wrong(f"{clip(word.strip())!r} where {'{ or }' if seen else '{'} was expected", at)
            yield len(seen) - 1, corners[-1], *_values(data, word, at, rank)
            held = True
    if not ended:
        raise data.wrong("the tree ends before its last '}'" if seen else "there is no tree", len(data.text))


def _values(data: Element, words: str, at: int, rank: int) -> tuple[int, list[float]]:
    """The number of levels that a grid of values adds, and the values."""
    try:
        grid = list(map(float, words.replace(",", " ").split()))
    except ValueError:
        grid = numbers(data, words, at).tolist()
    finer, rest = divmod(len(grid).bit_length() - 1, rank)
    if rest or "_" in words or len(grid) != 1 << finer * rank:
        numbers(data, words, at)
        raise data.wrong(f"a grid holds {len(grid)} values, not a power of {1 << rank}", at)
    return finer, grid


def numbers(data: Element, text: str, at: int = 0) -> Array:
    """The numbers in `text`, which begins at character `at` of the element. Raises FormatError with the line."""
    words = text.replace(",", " ").split()
    try:
        values = np.array(list(map(float, words)))
    except ValueError:
        values = np.array([np.nan])
    if "_" in text or not np.isfinite(values).all():
        offset, bad = _first_bad(text)
        raise data.wrong(f"a value is {clip(bad)!r}, not a finite number", at + offset)
    return values


def _first_bad(text: str) -> tuple[int, str]:
    for word in re.finditer(r"[^\s,]+", text):
        try:
            if "_" not in word.group() and np.isfinite(float(word.group())):
                continue
        except ValueError:
            pass
        return word.start(), word.group()
    return 0, text.strip()


def centres(level: Whole, cell: Whole) -> tuple[Array, Array, Array, Array]:
    """Polar angles and azimuths [deg] of the cells' centres: incident (azimuth 0 for rank 3), then outgoing."""
    points = (cell + 0.5) / np.exp2(level)[:, None]
    if cell.shape[1] == 3:
        # A tree of a single cell includes the unused half: its centre is taken in the used half.
        radius_i = 1 - 2 * np.where(level == 0, 0.25, points[:, 0])
        azimuth_i = np.zeros(len(level))
    else:
        radius_i, azimuth_i = to_disk(points[:, 0], points[:, 1])
    radius_r, azimuth_r = to_disk(points[:, -2], points[:, -1])
    radians = np.arcsin(radius_i), azimuth_i, np.arcsin(radius_r), azimuth_r
    theta_i, phi_i, theta_r, phi_r = (np.degrees(v) for v in radians)
    return theta_i, phi_i % 360.0, theta_r, phi_r % 360.0


def cell_of(
    level: npt.ArrayLike, rank: int, theta_i: Array, azimuth_i: Array, theta_r: Array, azimuth_r: Array
) -> Whole:
    """The cells (n, rank) of a level that hold the directions [deg]; azimuths are as in `centres`."""
    radius_i, radius_r = np.sin(np.radians(theta_i)), np.sin(np.radians(theta_r))
    if rank == 3:
        turned = azimuth_r - azimuth_i
        used = np.minimum((1 - radius_i) / 2, 0.5 * _NEAR_ONE)
        points = [used, *to_square(radius_r, np.radians(turned))]
    else:
        points = [*to_square(radius_i, np.radians(azimuth_i)), *to_square(radius_r, np.radians(azimuth_r))]
    inside = np.clip(np.stack(np.broadcast_arrays(*points), axis=-1), 0.0, _NEAR_ONE)
    return np.floor(inside * np.exp2(np.asarray(level))[..., None]).astype(np.int64)


def look_up(level: Whole, cell: Whole, values: Array, directions: tuple[Array, Array, Array, Array]) -> Array:
    """The value of the leaf that holds each direction [deg], NaN where no leaf does."""
    rank = cell.shape[1]
    looked_up = np.full(np.broadcast_shapes(*(d.shape for d in directions)), np.nan)
    for n in np.unique(level):
        here = level == n
        order = np.argsort(_key(n, cell[here]))
        keys, leaf_values = _key(n, cell[here])[order], values[here][order]
        wanted = _key(n, cell_of(n, rank, *directions))
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        looked_up = np.where(keys[place] == wanted, leaf_values[place], looked_up)
    return looked_up


def _key(level: int, cell: Whole) -> Whole:
    """One integer for each cell of a level, of 4 x 15 bits at most."""
    shifts = np.arange(cell.shape[-1]) * int(level)
    return (cell << shifts).sum(axis=-1)

r"""Text files of the goniometer RT-300S (.jdv): blocks of one incidence angle each, in one of two layouts.

    DataType: BRDF(RT-300S)              DataType: BRDF(Raywiz)
    SampleID: a name                     SampleID: a name
    Date: 7/12/2011                      Date: 7/12/2011
    Incidence: 60                        1 1 2               incidences, steps of azimuth, steps of polar angle
    Polar: -30,30,30   first, last,      -90 -80 -30 30      first and last azimuth, first and last polar angle
    Azimuth: -90,-80,10        step      60                  incidence
    Raw data                             a row per polar angle, with a value per azimuth
    the polar angles, then a row per azimuth, which begins with the azimuth

Words are separated by tabs, lines end in \r. Values have no unit: they are relative. The layouts are known from the
only public files, the two samples of an exporter, which hold the same numbers in both layouts.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import MOST_VALUES, Words, clip, lines
from gonio.formats.format import Format
from gonio.formats.rt300s.sheet import direction
from gonio.measured.dataset import RELATIVE, make_scan

KINDS = {"brdf(rt-300s)": "RT-300S", "brdf(raywiz)": "Raywiz"}
MOST_NODES = 100_000  # on one axis
_SIGNATURE = re.compile(rb"\A(?:\xef\xbb\xbf)?\s*datatype:\s*b[rt]df\(", re.IGNORECASE)


@dataclass(frozen=True)
class JdvBlock:
    """One block of a .jdv file: the name of the sample, the angles [deg] and the values (azimuth, polar)."""

    name: str
    remarks: tuple[str, ...]
    incidence: float
    azimuth: npt.NDArray[np.float64]
    polar: npt.NDArray[np.float64]
    values: npt.NDArray[np.float64]


def _read(path: Path) -> xr.Dataset:
    words = Words(path, lines(path), comment="")
    blocks = [_block(words)]
    while words.peek():
        blocks.append(_block(words))
        if len(blocks) > 1000:
            raise words.wrong("more than 1000 blocks")
    names = _names(blocks)
    columns = [_columns(block) for block in blocks]
    theta_i, azimuth, polar, values = np.concatenate(columns, axis=1)
    theta_r, phi = direction(azimuth, polar)
    remarks = dict.fromkeys(r for b in blocks for r in b.remarks)
    zero = [n for n, b in zip(names, blocks, strict=True) if not b.values.any()]
    zero_values = "every value" if len(zero) == len(blocks) else f"every value of {', '.join(zero)}"
    return make_scan(
        theta_i,
        theta_r,
        values,
        phi,
        unit=RELATIVE,
        coordinates={"scan": np.repeat(names, [b.values.size for b in blocks])} if len(blocks) > 1 else {},
        provenance="\n".join(remarks),
        history=f"{zero_values} is zero" if zero else "",
    )


def _names(blocks: list[JdvBlock]) -> list[str]:
    """The names of the samples, each with a number from its second use on."""
    seen: dict[str, int] = {}
    names = []
    for block in blocks:
        seen[block.name] = seen.get(block.name, 0) + 1
        names.append(block.name if seen[block.name] == 1 else f"{block.name} ({seen[block.name]})")
    return names


def _columns(block: JdvBlock) -> npt.NDArray[np.float64]:
    azimuth, polar = np.meshgrid(block.azimuth, block.polar, indexing="ij")
    incidence = np.full(azimuth.shape, block.incidence)
    return np.array([incidence.ravel(), azimuth.ravel(), polar.ravel(), block.values.ravel()])


def _block(words: Words) -> JdvBlock:
    words.keyword("DataType:")
    kind = KINDS.get(" ".join(words.rest()).lower())
    if kind is None:
        raise words.wrong("the DataType is neither BRDF(RT-300S) nor BRDF(Raywiz)")
    name = _label(words, "SampleID:")
    date = _label(words, "Date:")
    remarks = (f"DataType: BRDF({kind})", f"Date: {clip(date)}")
    incidence, azimuth, polar, values = _goniometer(words) if kind == "RT-300S" else _raywiz(words)
    if not 0 <= incidence <= 90:
        raise words.wrong(f"the incidence angle is {incidence:g} deg, outside 0 to 90")
    return JdvBlock(clip(name), remarks, incidence, azimuth, polar, values)


def _label(words: Words, name: str) -> str:
    words.keyword(name)
    return " ".join(words.rest())


def _goniometer(
    words: Words,
) -> tuple[float, npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    words.keyword("Incidence:")
    incidence = words.number("the incidence angle")
    polar = _stepped(words, "Polar:", 90.0)
    azimuth = _stepped(words, "Azimuth:", 180.0)
    _bound(words, len(polar) * len(azimuth))
    words.keyword("Raw")
    words.keyword("data")
    _agree(words, words.numbers(len(polar), "the polar angles"), polar, "polar angle")
    values = np.empty((len(azimuth), len(polar)))
    for i, angle in enumerate(azimuth):
        row = words.numbers(len(polar) + 1, "a row")
        _agree(words, row[:1], np.array([angle]), "azimuth")
        values[i] = row[1:]
    return incidence, azimuth, polar, values


def _stepped(words: Words, name: str, limit: float) -> npt.NDArray[np.float64]:
    """The angles from the entry `name`, which has the first, the last and the step."""
    words.keyword(name)
    listed = [words.as_number(w, name) for w in " ".join(words.rest()).replace(",", " ").split()]
    if len(listed) != 3:
        raise words.wrong(f"{len(listed)} numbers where {name} has three: first, last, step")
    first, last, step = listed
    if max(abs(first), abs(last)) > limit:
        raise words.wrong(f"{name} goes from {first:g} to {last:g} deg, outside -{limit:g} to {limit:g}")
    steps = (last - first) / step if step else 0.0
    if not 0 <= steps < MOST_NODES or (step == 0 and last != first) or abs(steps - round(steps)) > 1e-6:
        raise words.wrong(f"{name} does not lead from {first:g} to {last:g} deg in steps of {step:g}")
    return _spread(words, first, last, round(steps), limit)


def _spread(words: Words, first: float, last: float, steps: int, limit: float) -> npt.NDArray[np.float64]:
    if max(abs(first), abs(last)) > limit:
        raise words.wrong(f"angles of {first:g} to {last:g} deg are outside -{limit:g} to {limit:g}")
    if steps >= MOST_NODES or (steps == 0) != (first == last):
        raise words.wrong(f"{steps} steps from {first:g} to {last:g} deg")
    return np.linspace(first, last, steps + 1)


def _raywiz(words: Words) -> tuple[float, npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    if words.count("the number of incidence angles") != 1:
        raise words.wrong("a block has more than one incidence angle, whose layout is not known")
    turns, tilts = words.count("steps of azimuth", least=0), words.count("steps of polar angle", least=0)
    bounds = words.numbers(4, "first and last azimuth, first and last polar angle")
    azimuth = _spread(words, bounds[0], bounds[1], turns, 180.0)
    polar = _spread(words, bounds[2], bounds[3], tilts, 90.0)
    _bound(words, len(polar) * len(azimuth))
    incidence = words.number("the incidence angle")
    values = np.array(words.numbers(len(polar) * len(azimuth), "values")).reshape(len(polar), len(azimuth))
    return incidence, azimuth, polar, values.T


def _bound(words: Words, count: int) -> None:
    most = min(words.path.stat().st_size // 2, MOST_VALUES)  # a value and its separator take two bytes
    if count > most:
        raise words.wrong(f"a block promises {count} values, and the file can hold {most}")


def _agree(words: Words, listed: list[float], expected: npt.NDArray[np.float64], quantity: str) -> None:
    if np.abs(np.array(listed) - expected).max() > 1e-6:
        raise words.wrong(f"a {quantity} is not that of the block's head")


FORMAT = Format(
    name="jdv",
    title="RT-300S text",
    suffix=".jdv",
    recognises=lambda head: _SIGNATURE.match(head) is not None,
    read=_read,
)

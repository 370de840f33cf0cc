"""Text of the command line into values; every refusal says how the text should look."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from gonio.door.json_text import load
from gonio.fitting.objective.from_scan import HALF_WIDTH, constants_at
from gonio.fitting.objective.options import Grouping, Held
from gonio.fitting.objective.smooth import Smooth, Smoothing
from gonio.polarisation import stokes as check_stokes

NEXT_PAIR = re.compile(r",(?=\s*\w[\w-]*(?:\[[^\]]*\])?\s*=)")  # the comma before a further name=


class Text(NamedTuple):
    """How values of a type are written on the command line: the type that Typer reads, and what becomes of it."""

    typed: Any
    read: Callable[..., Any]


def pairs(texts: Iterable[str], option: str) -> dict[str, str]:
    """`["a=1", "b=2"]` by name; one pair a text, so that values may hold commas."""
    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise ValueError(f"{option} {text!r} is not of the form name=value")
        out[name.strip()] = value.strip()
    return out


def several(texts: Iterable[str]) -> Iterator[str]:
    """Pairs whose values are numbers may share a text: `a=1,b=2`, `ks[30,R]=1`."""
    for text in texts:
        yield from NEXT_PAIR.split(text)


def number(text: str, what: str) -> float:
    """A finite number; ValueError with what it was meant to be."""
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f"{what} is {text!r}, not a number") from None
    if not math.isfinite(value):
        raise ValueError(f"{what} is {text}, not a finite number")
    return value


def numbers(texts: Iterable[str], option: str) -> dict[str, float]:
    """`["a=1"]` or `["a=1,b=2"]` as numbers by name."""
    return {name: number(value, f"{option} {name}") for name, value in pairs(several(texts), option).items()}


def held(texts: Iterable[str], option: str) -> dict[str, float | str]:
    """`sigma=0.142`, or `gamma=half-width` to have it read from the scan as the paper does."""
    return {
        name: value if value == HALF_WIDTH else number(value, f"{option} {name}")
        for name, value in pairs(several(texts), option).items()
    }


def groups(texts: Iterable[str], option: str) -> dict[str, tuple[str, ...]]:
    """`ks=theta_i` or `ks=theta_i,channel`."""
    return {name: tuple(c.strip() for c in value.split(",")) for name, value in pairs(texts, option).items()}


def smooth(texts: Iterable[str], option: str) -> dict[str, Smooth]:
    """`sigma=wavelength`, or `sigma=wavelength:1e-5` with a strength."""
    out = {}
    for name, value in pairs(texts, option).items():
        try:
            out[name] = Smooth.parsed(value)
        except ValueError:
            raise ValueError(f"{option} {name}={value} is not of the form name=coordinate:strength") from None
    return out


def bounds(texts: Iterable[str], option: str) -> dict[str, tuple[float, float]]:
    """`gamma=5:90`."""
    out = {}
    for name, value in pairs(several(texts), option).items():
        lower, colon, upper = value.partition(":")
        if not colon:
            raise ValueError(f"{option} {name}={value} is not of the form name=lower:upper")
        out[name] = (number(lower, f"{option} {name}"), number(upper, f"{option} {name}"))
    return out


def items(texts: Iterable[str], option: str) -> tuple[str, ...]:
    """Names, one a text."""
    return tuple(texts)


# How each type of an option is written; a number, a text or a truth is as Typer has it.
TEXTS: Mapping[Any, Text] = {
    Mapping[str, Held]: Text(list[str], held),
    Grouping: Text(list[str], groups),
    Smoothing: Text(list[str], smooth),
    Mapping[str, tuple[float, float]]: Text(list[str], bounds),
    Mapping[str, float]: Text(list[str], numbers),
    Mapping[str, str]: Text(list[str], pairs),
    tuple[str, ...]: Text(list[str], items),
}


def values(texts: Iterable[str], material: str, wavelength: float | None) -> dict[str, float]:
    """What `--set` and `--material` give a model; a text that names a JSON file gives the values of that file."""
    texts = list(texts)
    files = [text for text in texts if text.endswith(".json") and "=" not in text]
    given = numbers([text for text in texts if text not in files], "--set")
    return constants_at(material, wavelength) | dict(p for file in files for p in _of_file(Path(file))) | given


def _of_file(path: Path) -> Iterator[tuple[str, float]]:
    """The values by name in a JSON file: under `values`, as a page of gonio exports them, or the object itself."""
    document = load(path)
    steps = ("values",) if "values" in document.value else ()
    for name, value in document.object(*steps).items():
        if isinstance(value, bool) or not isinstance(value, float):
            raise document.wrong(f"the value of {name!r} is no number", *steps, name)
        yield name, value


def listed(text: str) -> tuple[str, ...]:
    """`a,b` as names."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def directions(text: str) -> list[tuple[float, float, float]]:
    """`30,30,180;40,20,180` as theta_i, theta_r, phi [deg]; phi may be left out in plane, theta_r then signed."""
    out = []
    for part in (p for p in text.split(";") if p.strip()):
        angles = [number(a, f"an angle of --at {part.strip()!r}") for a in part.split(",")]
        if len(angles) == 2:
            theta_i, theta_r = angles
            angles = [theta_i, abs(theta_r), 180.0 if theta_r >= 0 else 0.0]
        if len(angles) != 3:
            raise ValueError(f"--at {part.strip()!r} is not of the form theta_i,theta_r,phi")
        for name, angle in zip(("theta_i", "theta_r"), angles, strict=False):
            if not 0 <= angle <= 90:
                raise ValueError(f"{name} = {angle:g} in --at {part.strip()!r} is outside 0 to 90 deg")
        out.append((angles[0], angles[1], angles[2]))
    if not out:
        raise ValueError("--at names no direction: write theta_i,theta_r,phi;..")
    return out


def stokes(text: str) -> tuple[float, ...]:
    """`1,0,0,0` as the Stokes parameters of light that can exist."""
    parts = tuple(number(part, f"a Stokes parameter of {text!r}") for part in text.split(","))
    check_stokes(parts)
    return parts


def azimuths(text: str, count: int) -> list[float]:
    """`0,90` as azimuths [deg] of so many files, one for each; no text is none."""
    angles = [number(part, f"an angle of --phi-i {text!r}") for part in text.split(",") if part.strip()]
    if angles and len(angles) != count:
        raise ValueError(f"--phi-i names {len(angles)} angles for {count} files: give one for each, in their order")
    return angles


def incidence_angles(text: str) -> list[float]:
    """`30,60` as incidence angles [deg] below the horizon's 90."""
    angles = [number(part, f"an angle of --theta-i {text!r}") for part in text.split(",") if part.strip()]
    if not angles or not all(0 <= angle < 90 for angle in angles):
        raise ValueError(f"--theta-i {text!r} is not a list of angles from 0 to below 90 deg")
    return angles

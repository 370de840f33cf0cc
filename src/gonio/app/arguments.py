"""Text of the command line into values; every refusal says how the text should look."""

import dataclasses
import math
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.solver import Solver
from gonio.fitting.solution import label
from gonio.materials import constants as material_constants
from gonio.measured.half_width import half_widths, widest_angle
from gonio.polarisation import stokes as check_stokes

SOLVERS: Mapping[str, type[Projection] | type[Anneal]] = {s.name: s for s in (Projection, Anneal)}
HALF_WIDTH = "half-width"
CONSTANTS = ("index", "extinction")


def pairs(texts: Iterable[str], option: str) -> dict[str, str]:
    """`["a=1", "b=2"]` or `["a=1,b=2"]` is not ambiguous: one pair a text, so that values may hold commas."""
    out = {}
    for text in texts:
        name, equals, value = text.partition("=")
        if not equals or not name.strip() or not value.strip():
            raise ValueError(f"{option} {text!r} is not of the form name=value")
        out[name.strip()] = value.strip()
    return out


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
    return {name: number(value, f"{option} {name}") for name, value in pairs(texts, option).items()}


def values(texts: Iterable[str], material: str, wavelength: str) -> dict[str, float]:
    """What `--set` and `--material` give a model."""
    return constants(material, wavelength) | numbers(texts, "--set")


def groups(texts: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """`ks=theta_i` or `ks=theta_i,channel`."""
    return {name: tuple(c.strip() for c in value.split(",")) for name, value in pairs(texts, "--group").items()}


def smooth(texts: Iterable[str]) -> dict[str, Smooth]:
    """`sigma=wavelength`, or `sigma=wavelength:1e-5` with a strength."""
    out = {}
    for name, value in pairs(texts, "--smooth").items():
        try:
            out[name] = Smooth.parsed(value)
        except ValueError:
            raise ValueError(f"--smooth {name}={value} is not of the form name=coordinate:strength") from None
    return out


def bounds(texts: Iterable[str]) -> dict[str, tuple[float, float]]:
    """`gamma=5:90`."""
    out = {}
    for name, value in pairs(texts, "--bound").items():
        lower, colon, upper = value.partition(":")
        if not colon:
            raise ValueError(f"--bound {name}={value} is not of the form name=lower:upper")
        out[name] = (number(lower, f"--bound {name}"), number(upper, f"--bound {name}"))
    return out


def held(texts: Iterable[str], scan: xr.Dataset) -> dict[str, float]:
    """`sigma=0.142`, or `gamma=half-width` to read it from the scan as the paper does."""
    out = {}
    for name, value in pairs(texts, "--hold").items():
        out[name] = _read_half_width(scan) if value == HALF_WIDTH else number(value, f"--hold {name}")
    return out


def _read_half_width(scan: xr.Dataset) -> float:
    readings = half_widths(scan)
    best = widest_angle(readings)
    if best is None:
        reasons = "; ".join(sorted({str(reading.status) for reading in readings})) or "the scan has no in-plane curve"
        raise ValueError(f"no half width can be read from the scan ({reasons}): hold gamma at a number, or fit it")
    return best.gamma


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


def solver(name: str, seed: int, settings: Iterable[str]) -> Solver:
    """A solver by name; `settings` are its fields, and the seed goes to the one that draws random numbers."""
    if name not in SOLVERS:
        raise ValueError(f"no solver {name!r}: choose one of {', '.join(SOLVERS)}")
    kind = SOLVERS[name]
    defaults: dict[str, Any] = {
        f.name: f.default for f in dataclasses.fields(kind) if isinstance(f.default, int | float)
    }
    given: dict[str, Any] = {"seed": seed} if "seed" in defaults else {}
    for field, value in numbers(settings, "--setting").items():
        if field not in defaults:
            raise ValueError(f"the solver {name} has no setting {field!r}; it has {', '.join(defaults)}")
        given[field] = int(value) if isinstance(defaults[field], int) else value
    return kind(**given)


def stokes(text: str) -> tuple[float, ...]:
    """`1,0,0,0` as the Stokes parameters of light that can exist."""
    parts = tuple(number(part, f"a Stokes parameter of {text!r}") for part in text.split(","))
    check_stokes(parts)
    return parts


def incidence_angles(text: str) -> list[float]:
    """`30,60` as incidence angles [deg] below the horizon's 90."""
    angles = [number(part, f"an angle of --theta-i {text!r}") for part in text.split(",") if part.strip()]
    if not angles or not all(0 <= angle < 90 for angle in angles):
        raise ValueError(f"--theta-i {text!r} is not a list of angles from 0 to below 90 deg")
    return angles


def figure_target(out: str) -> tuple[Path, tuple[str, ...]]:
    """Where a figure goes and in which formats: those of the suffix, or both without one."""
    path = Path(out)
    if path.suffix in (".png", ".svg"):
        return path.with_suffix(""), (path.suffix,)
    return path, (".png", ".svg")


def constants(material: str, wavelength: str) -> dict[str, float]:
    """Index and extinction of a material at `--wavelength`, none without a material."""
    if not material:
        return {}
    if not wavelength:
        raise ValueError("--material needs --wavelength in nm here: nothing else says at which the constants are meant")
    return material_constants(material, number(wavelength, "--wavelength"))


def with_material(options: dict[str, Any], scan: xr.Dataset, material: str, wavelength: str) -> dict[str, Any]:
    """The options of a Problem with index and extinction held at the material's, at the scan's own wavelengths."""
    if taken := [name for name in CONSTANTS if any(name in options[what] for what in ("held", "grouped", "bounds"))]:
        raise ValueError(f"--material holds {taken[0]}: leave it out of --hold, --group and --bound")
    out = options | {"bounds": options["bounds"] | dict.fromkeys(CONSTANTS, (0.0, math.inf))}
    if "wavelength" not in scan.coords or wavelength:
        return out | {"held": options["held"] | constants(material, wavelength)}
    own = {label(w): material_constants(material, w) for w in np.unique(scan["wavelength"].values).tolist()}
    if len(own) == 1:
        return out | {"held": options["held"] | next(iter(own.values()))}
    held = {name: {w: values[name] for w, values in own.items()} for name in CONSTANTS}
    return out | {
        "held": options["held"] | held,
        "grouped": options["grouped"] | dict.fromkeys(CONSTANTS, ("wavelength",)),
    }

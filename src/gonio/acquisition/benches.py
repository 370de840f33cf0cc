"""A bench from its file: TOML that names the devices and their drivers, or the values of a simulated bench.

    [instrument]            # whatever is known, for the journal and the attributes of the readings
    aperture_radius = 4.75
    [table]                 # and [arm], [detector], [shutter]; where there are any, [monitor], [filters], [targets]
    driver = "esp300"
    address = "GPIB0::1::INSTR"
    zero = 12.5

or, without devices, `[simulated]` with `model` and `values`, or `mirror`.
"""

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

from gonio.acquisition.device import Axis, Bench, Detector, Filter, InPlane, Selector, Shutter
from gonio.acquisition.drivers import opened
from gonio.acquisition.plan import Conditions
from gonio.acquisition.simulated import Diffuse, Electronics, Laser, Mirror, Optics, SimulatedBench, SimulatedClock
from gonio.acquisition.simulated.devices import START, plain
from gonio.door.text import whole
from gonio.files import FormatError
from gonio.materials import constants
from gonio.model import Model
from gonio.outside import printable

LARGEST = 1_000_000  # bytes
DEVICES: Mapping[str, Any] = {
    "table": Axis,
    "arm": Axis,
    "detector": Detector,
    "shutter": Shutter,
    "monitor": Detector,
    "filters": Filter,
    "targets": Selector,
}
NEEDED = ("table", "arm", "detector", "shutter")
SIMULATED = (
    *("model", "values", "mirror", "standard", "seed", "real_time"),
    *("laser", "optics", "electronics", "stated", "faults"),
)
BREAK = 600.0  # s of simulated time between two sessions

Part = TypeVar("Part")


def read_bench(
    path: str | Path, conditions: Conditions, models: Callable[[str], Model], after: float | None = None
) -> Bench:
    """The bench of a file, its devices opened.

    conditions: of the plan, whose wavelength and polarisation a simulated mirror takes. models: finds a model by name.
    after: the last moment of the journal [s since 1970], after which a simulated clock goes on.
    Raises FormatError with the table of the file and what is wrong in it.
    """
    path = Path(path)
    try:
        stated = tomllib.loads(whole(path, LARGEST))
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(path, f"is no TOML: {error}") from error
    if loose := [name for name, table in stated.items() if not isinstance(table, dict)]:
        raise FormatError(path, f"{loose[0]} stands outside of a table, expected tables such as [detector]")
    if unknown := set(stated) - {"instrument", "simulated", *DEVICES}:
        names = ", ".join(["instrument", "simulated", *DEVICES])
        raise FormatError(path, f"has [{min(unknown)}], which no bench has: it has {names}")
    try:
        if "simulated" in stated:
            return _simulated(stated, conditions, models, after)
        return _real(stated, path.parent)
    except (ValueError, TypeError, KeyError, AttributeError) as error:
        said = str(error.args[0]) if isinstance(error, KeyError) and error.args else str(error)
        raise FormatError(path, said) from error


def _real(stated: Mapping[str, Any], folder: Path) -> Bench:
    if missing := [name for name in NEEDED if name not in stated]:
        raise ValueError(f"has no [{missing[0]}]: a bench has {', '.join(NEEDED)}, or [simulated]")
    devices, zeros = {}, {}
    for name, protocol in DEVICES.items():
        if name not in stated:
            continue
        about = dict(stated[name])
        if "driver" not in about:
            raise ValueError(f'[{name}] has no driver: give driver = "name", see docs/measuring.md')
        if name in ("table", "arm"):
            zeros[name] = float(about.pop("zero", 0.0))
        devices[name] = opened(about, folder)
        if lacks := sorted(_members(protocol) - set(dir(devices[name]))):
            raise ValueError(f"[{name}]: the driver {printable(str(about['driver']))!r} lacks {', '.join(lacks)}")
    stage = InPlane(devices.pop("table"), devices.pop("arm"), zeros["table"], zeros["arm"])
    return Bench(stage, instrument=stated.get("instrument", {}), **devices)


def _members(protocol: Any) -> set[str]:
    """What a Protocol asks for: methods and attributes."""
    annotated = {name for of in protocol.__mro__ for name in getattr(of, "__annotations__", {})}
    return {name for name in {*dir(protocol), *annotated} if not name.startswith("_")}


def _simulated(
    stated: Mapping[str, Any], conditions: Conditions, models: Callable[[str], Model], after: float | None
) -> SimulatedBench:
    about = stated["simulated"]
    if others := set(stated) - {"simulated", "instrument"}:
        raise ValueError(f"has [simulated] and [{min(others)}]: a bench is simulated as a whole, or not at all")
    if unknown := set(about) - set(SIMULATED):
        raise ValueError(f"[simulated] has {min(unknown)!r}: it has {', '.join(SIMULATED)}")
    if ("model" in about) == ("mirror" in about):
        raise ValueError('[simulated] needs model = "name" with its values, or mirror = "material"')
    optics = _part(Optics, about, "optics", wavelength=conditions.wavelength)
    return SimulatedBench(
        _mirror(about["mirror"], optics.wavelength, conditions) if "mirror" in about else models(about["model"]),
        {name: _value(value) for name, value in about.get("values", {}).items()},
        optics,
        [plain(fault) for fault in about.get("faults", [])],
        about.get("seed", 0),
        SimulatedClock(START if after is None else after + BREAK, about.get("real_time", False)),
        laser=_part(Laser, about, "laser"),
        electronics=_part(Electronics, about, "electronics"),
        standard=Diffuse(float(about.get("standard", 0.99))),
        stated={**about.get("stated", {}), **stated.get("instrument", {})},
    )


def _mirror(material: str, wavelength: float, conditions: Conditions) -> Mirror:
    known = constants(material, wavelength)
    return Mirror(known["index"], known["extinction"], conditions.polarisation)


def _value(value: Any) -> Any:
    """A number, or numbers by the incidence angle, which TOML has as texts."""
    return {float(angle): float(one) for angle, one in value.items()} if isinstance(value, dict) else float(value)


def _part(of: Callable[..., Part], about: Mapping[str, Any], name: str, **given: Any) -> Part:
    """A dataclass from the table of its name."""
    table = {key: value for key, value in given.items() if value is not None} | about.get(name, {})
    known = [field.name for field in fields(of)]  # type: ignore[arg-type]
    if unknown := set(table) - set(known):
        raise ValueError(f"[simulated.{name}] has {min(unknown)!r}: it has {', '.join(known)}")
    for key, value in table.items():
        default = next(field.default for field in fields(of) if field.name == key)  # type: ignore[arg-type]
        numbers = value if isinstance(default, tuple) and isinstance(value, list) and value else [value]
        if isinstance(value, list) != isinstance(default, tuple) or not all(_alike(one, default) for one in numbers):
            raise ValueError(f"[simulated.{name}] has {key} = {value!r}, expected such as {default!r}")
    return of(**{key: tuple(value) if isinstance(value, list) else value for key, value in table.items()})


def _alike(value: Any, default: Any) -> bool:
    """Whether both are truths, or both numbers."""
    if isinstance(value, bool) or isinstance(default, bool):
        return isinstance(value, bool) and isinstance(default, bool)
    return isinstance(value, int | float)

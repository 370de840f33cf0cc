"""Drivers of real devices, each imported only when a bench names it: by a name of DRIVERS, or as `module:Class`."""

import importlib
import importlib.util
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gonio.outside import NearestNames, printable

_PYMEASURE = "gonio.acquisition.drivers.pymeasure"
DRIVERS = NearestNames(
    "driver",
    {
        "pm100": f"{_PYMEASURE}:PM100",
        "esp300": f"{_PYMEASURE}:ESP300Axis",
        "sr830": f"{_PYMEASURE}:SR830",
        "command-shutter": f"{_PYMEASURE}:CommandShutter",
        "by-hand": "gonio.acquisition.drivers.by_hand:ByHand",
    },
)
REMEDY = "pip install 'gonio[instruments]'"


def driver(name: str, folder: Path) -> Any:
    """The class that a name of DRIVERS stands for, or `module:Class`, or `file.py:Class` with a file of that folder.

    Raises KeyError with the nearest names, ValueError for what is not there or needs a package that is not installed.
    """
    path = name if ":" in name else DRIVERS[name]
    where, _, of = path.rpartition(":")
    try:
        module = _of_file(folder / where) if where.endswith(".py") else importlib.import_module(where)
        return getattr(module, of)
    except ModuleNotFoundError as error:
        remedy = REMEDY if path.startswith(_PYMEASURE) else "install it, or mend the name"
        raise ValueError(f"the driver {printable(name)!r} needs {error.name}: {remedy}") from error
    except (AttributeError, FileNotFoundError) as error:
        raise ValueError(f"the driver {printable(name)!r} is not there: {printable(str(error))}") from error


def _of_file(path: Path) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise FileNotFoundError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def opened(about: Mapping[str, Any], folder: Path) -> Any:
    """A device from plain data: its `driver`, and what that takes besides. What the driver raises names it."""
    arguments = {key: value for key, value in about.items() if key != "driver"}
    name = str(about["driver"])
    of = driver(name, folder)
    try:
        return of(**arguments)
    except Exception as error:  # a driver raises what it likes
        raise ValueError(f"the driver {printable(name)!r} does not begin: {printable(str(error))}") from error

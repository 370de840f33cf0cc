"""Optical constants n + i k: metals at laser lines, as data beside this file, and files that a user gives."""

import functools
import tomllib
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from gonio.materials.material import Material
from gonio.model import NearestNames

__all__ = ["Material", "constants", "material", "materials"]


def material(name: str | Path) -> Material:
    """The built-in of that name, or what the file at that path holds; `./copper` is always a file.

    Raises KeyError with the nearest names where there is neither, FormatError for a file that cannot be read.
    """
    if isinstance(name, str) and name in _materials():
        return _materials()[name]
    if not Path(name).exists() and Path(name).name == str(name) and not Path(name).suffix:
        return _materials()[str(name)]
    from gonio.materials.reading import read_material

    return read_material(name)


def constants(name: str | Path, wavelength_nm: float) -> dict[str, float]:
    """The parameters `index` and `extinction` of a built-in or a file at one wavelength [nm].

    Raises KeyError and FormatError as `material` does, ValueError where the material says nothing at the wavelength.
    """
    n, k = material(name).at(float(wavelength_nm) / 1000)  # times 1e-3 would miss table entries by a rounding
    return {"index": n, "extinction": k}


@functools.cache
def _materials() -> NearestNames[Material]:
    entries = {}
    for path in sorted(files(__package__).iterdir(), key=lambda p: p.name):
        if path.name.endswith(".toml"):
            source = tomllib.loads(path.read_text(encoding="utf-8"))
            for entry in source["material"]:
                entries[entry["name"]] = _built_in(entry, path.name.removesuffix(".toml"), source["note"])
    return NearestNames("material", dict(sorted(entries.items())))


def _built_in(entry: Mapping[str, Any], cite: str, note: str) -> Material:
    wavelength_um, n, k = np.array(entry["lines"]).T
    return Material(
        name=entry["name"],
        title=entry["title"],
        cite=cite,
        where=entry["where"],
        wavelength_um=wavelength_um,
        n=n,
        k=k,
        note=note,
        lines=True,
        beyond=entry.get("beyond", ""),
    )


materials: Mapping[str, Material]


def __getattr__(name: str) -> Any:
    if name == "materials":
        return _materials()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

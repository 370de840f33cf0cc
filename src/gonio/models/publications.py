"""Constants that papers print, as data: one TOML file a citation key, beside this one."""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from gonio.model import NearestNames

ABOUT = """Surfaces that papers print the constants of, by name.

`gonio.published["Al"]` has the name of the `model`, its `values`, the `unit`, `wavelength_nm`, and `cite` and `where`,
which say where they stand; `at(theta_i)` interpolates values that are tabulated over the incidence angle [deg]. A name
that it does not have raises a KeyError with the nearest names.
"""


@dataclass(frozen=True)
class Published:
    """One surface as a paper describes it: its model, the values of shape and weights, and what they are worth.

    A weight that the paper tabulates over the incidence angle is a mapping from theta_i [deg] to its value.
    """

    name: str
    title: str
    cite: str
    where: str
    model: str
    unit: str
    wavelength_nm: float
    values: Mapping[str, float | Mapping[float, float]]
    note: str

    def at(self, theta_i: float) -> dict[str, float]:
        """Every value at one incidence angle [deg], tabulated ones interpolated linearly.

        Raises ValueError outside the tabulated incidence angles: the paper says nothing there.
        """
        return {name: self._at(name, value, theta_i) for name, value in self.values.items()}

    def _at(self, name: str, value: float | Mapping[float, float], theta_i: float) -> float:
        if not isinstance(value, Mapping):
            return value
        angles = sorted(value)
        if not angles[0] <= theta_i <= angles[-1]:
            raise ValueError(
                f"{self.cite} tabulates {name} of {self.name} from {angles[0]:g} to {angles[-1]:g} deg incidence; "
                f"{theta_i:g} deg is outside"
            )
        return float(np.interp(theta_i, angles, [value[a] for a in angles]))


def load(cite: str) -> dict[str, Any]:
    """The data file of one citation key, tables and all."""
    return tomllib.loads(files(__package__).joinpath(f"{cite}.toml").read_text(encoding="utf-8"))


@functools.cache
def _published() -> NearestNames[Published]:
    entries = {}
    for path in sorted(files(__package__).iterdir(), key=lambda p: p.name):
        if path.name.endswith(".toml"):
            paper = load(path.name.removesuffix(".toml"))
            for surface in paper.get("surface", []):
                entries[surface["name"]] = _surface(surface, path.name.removesuffix(".toml"), paper)
    return NearestNames("published surface", entries, ABOUT)


def _surface(entry: Mapping[str, Any], cite: str, paper: Mapping[str, Any]) -> Published:
    values = {
        name: {float(angle): float(v) for angle, v in value.items()} if isinstance(value, Mapping) else float(value)
        for name, value in entry["values"].items()
    }
    return Published(
        name=entry["name"],
        title=entry["title"],
        cite=cite,
        where=entry["where"],
        model=entry["model"],
        unit=paper["unit"],
        wavelength_nm=paper["wavelength_nm"],
        values=values,
        note=paper["note"],
    )


published: Mapping[str, Published]


def __getattr__(name: str) -> Any:
    if name == "published":
        return _published()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

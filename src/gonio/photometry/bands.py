"""The magnitude of the sun in each band, to which a body that it lights is compared (willmer2018)."""

import functools
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType

from gonio.options import one_of
from gonio.outside import printable

SYSTEMS = ("AB", "Vega")


@dataclass(frozen=True)
class Band:
    """A band: its name, its filter in words, and the apparent magnitude of the sun at 1 au in both systems."""

    name: str
    title: str
    ab: float
    vega: float

    def sun(self, system: str = "AB") -> float:
        """The apparent magnitude of the sun; ValueError for a system that is none of SYSTEMS."""
        if system not in SYSTEMS:
            raise ValueError(f"there is no system of magnitudes {printable(system)!r}: choose {one_of(SYSTEMS)}")
        return self.ab if system == "AB" else self.vega


@functools.cache
def bands() -> Mapping[str, Band]:
    """The bands by name."""
    declared = tomllib.loads(files(__package__).joinpath("bands.toml").read_text(encoding="utf-8"))["bands"]
    return MappingProxyType({name: Band(name, **entries) for name, entries in declared.items()})


def band_of(name: str | Band) -> Band:
    """The band of that name; ValueError with the names that there are. A Band of your own is taken as it is."""
    if isinstance(name, Band):
        return name
    if name not in bands():
        raise ValueError(f"there is no band {printable(name)!r}: choose {one_of(bands())}, or give a Band of your own")
    return bands()[name]

"""Bundled scans to learn with: simulated from a model whose values are known, seeded, and called simulated."""

import functools
import tomllib
from dataclasses import dataclass
from importlib.resources import files

import numpy as np
import xarray as xr

from gonio.measured.simulation import Value, simulate
from gonio.models import catalogue
from gonio.outside import NearestNames


@dataclass(frozen=True, kw_only=True)
class Sample:
    """What one bundled scan is simulated from: a sweep in the plane of incidence, angles in degrees."""

    title: str
    model: str
    values: dict[str, Value]
    noise: float
    offset_noise: float
    seed: int
    theta_i: list[float]
    theta_r: dict[str, float]
    wavelength: float
    blocked: float

    def scan(self) -> xr.Dataset:
        """The simulated scan, the same each time."""
        first, last, step = (self.theta_r[key] for key in ("from", "to", "step"))
        made = simulate(
            catalogue[self.model],
            self.values,
            self.theta_i,
            np.arange(first, last + step / 2, step),
            noise=self.noise,
            offset_noise=self.offset_noise,
            blocked=self.blocked,
            seed=self.seed,
            wavelength=self.wavelength,
        )
        made.attrs["provenance"] = f"material: none, simulated: {self.title}"
        return made


@functools.cache
def samples() -> NearestNames[Sample]:
    """The bundled scans by name."""
    declared = tomllib.loads(files(__package__).joinpath("samples.toml").read_text(encoding="utf-8"))
    common = declared.pop("every")
    return NearestNames("sample", {name: Sample(**common, **one) for name, one in declared.items()})


def sample(name: str) -> xr.Dataset:
    """A bundled scan of the plane of incidence, for a first try without a file of one's own.

    Nothing in it was measured. It is simulated from a model of the catalogue with known values and seeded noise, so it
    is the same on every call: `scan.attrs["simulated"]` names the model, and `gonio sample` lists the values.

    Parameters
    ----------
    name : str
        `"coating"`, a black coating, or `"metal"`, a blasted metal.

    Returns
    -------
    xarray.Dataset
        `brdf` [1/sr] and its standard `uncertainty` over `direction`: five incidence angles from 10 to 70 deg, 41
        detector angles each from -80 to 80 deg, at 633 nm. Where the detector would hide the source, the values are
        masked.

    Raises
    ------
    KeyError
        No sample has this name; the message lists the names.

    Examples
    --------
    >>> import gonio
    >>> scan = gonio.sample("coating")
    >>> scan.attrs["simulated"]
    'simulated from ggx'

    """
    return samples()[name].scan()

"""The mistakes of docs/findings.md planted in measured scans: how often each is found under its name.

Writes planted.json. A plant is a function of a scan and a strength; each of four scans has it at two strengths, and all
scans of the folder at the first. The noise of a plant, where it has any, is seeded.
"""

import datetime
import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from gonio import read
from gonio.findings import NAMES, check, corrections
from gonio.measured import dataset
from surfaces import DATA, SCANS

RECORD = Path(__file__).with_suffix(".json")
Values = np.ndarray


@dataclass(frozen=True)
class Plant:
    """One mistake: what it does to a scan, at which two strengths, what they are called, and four scans that show it.

    visible: what a scan must hold for the mistake to be seen.
    """

    make: Callable[[xr.Dataset, float], xr.Dataset]
    strengths: tuple[float, float]
    what: str
    scans: tuple[str, ...]
    visible: str


def of_values(scan: xr.Dataset, change: Callable[[xr.Dataset], Values]) -> xr.Dataset:
    """The flat scan with other values."""
    flat = dataset.flatten(scan)
    return flat.assign(brdf=("direction", change(flat), flat["brdf"].attrs))


def noisy(scan: xr.Dataset, relative: float) -> xr.Dataset:
    """The scan with Gaussian noise of a standard deviation relative to each value."""
    noise = np.random.default_rng(7).normal(size=scan["brdf"].size)
    return of_values(scan, lambda flat: flat["brdf"].values * (1 + relative * noise)) if relative else scan


def radians(scan: xr.Dataset, decimals: float) -> xr.Dataset:
    """Polar angles in radians with so many decimals, called degrees."""
    flat = dataset.flatten(scan)
    changed = {n: np.radians(flat[n].values).round(int(decimals)) for n in ("theta_i", "theta_r")}
    return flat.assign_coords({n: ("direction", v, flat[n].attrs) for n, v in changed.items()})


def with_cosine(scan: xr.Dataset, noise: float) -> xr.Dataset:
    """The values times cos(theta_r), and noise."""
    return noisy(of_values(scan, lambda f: f["brdf"].values * np.cos(np.radians(f["theta_r"].values))), noise)


def scaled(factor: float) -> Callable[[xr.Dataset, float], xr.Dataset]:
    """The values times a factor, and noise."""
    return lambda scan, noise: noisy(of_values(scan, lambda flat: factor * flat["brdf"].values), noise)


def cut(scan: xr.Dataset, share: float) -> xr.Dataset:
    """The largest values, this share of all, at the level where the detector saturates."""
    return of_values(scan, lambda f: np.minimum(f["brdf"].values, np.quantile(f["brdf"].values, 1 - share)))


def floored(scan: xr.Dataset, share: float) -> xr.Dataset:
    """The least values, this share of all, at the level of the floor."""
    return of_values(scan, lambda f: np.maximum(f["brdf"].values, np.quantile(f["brdf"].values, share)))


def mirrored(scan: xr.Dataset, turned: float) -> xr.Dataset:
    """Azimuth from the forward side: phi + 180 deg, or 180 deg - phi."""
    return corrections.flip(scan) if turned else corrections.mirror_azimuth(scan)


BRIGHT = "two-sided and R > 0.4, or matt; a dark or a one-sided scan hides it"
NOISE, NOISE_IN_WORDS = (0.0, 0.05), "as it is; with 5 % noise"
TABLES = {
    "AnoBlackNiTEonSteel.txt": "files/fred/AnoBlackNiTEonSteel.txt",
    "AnoBlackEC1onAlum_fullAz.txt": "files/fred/AnoBlackEC1onAlum_fullAz.txt",
    "AnoBlackEC1onAlum.bsdf": "files/zemax/AnoBlackEC1onAlum.bsdf",
    "satin_rosaline_rgb.bsdf": "files/rgl/satin_rosaline_rgb.bsdf",
}
PLANTS = {
    "sign-reversed": Plant(
        lambda scan, noise: noisy(corrections.flip(scan), noise), NOISE, NOISE_IN_WORDS,
        ("ualoft_anoblack_nite_steel", "rgl_paper_white", "jsss_mwir_steel_sandblasted", "starlink15_solar_array"),
        "every scan with incidence from 15 deg on",
    ),
    "azimuth-mirrored": Plant(
        mirrored, (0.0, 1.0), "180 deg - phi; phi + 180 deg",
        tuple(TABLES),
        "tables out of plane",
    ),
    "cosine-left-in": Plant(
        with_cosine, NOISE, NOISE_IN_WORDS,
        ("ualoft_anoblack_nite_steel", "rgl_paper_white", "jsss_mwir_copper", "merl_aluminium_lumos"),
        "two incidence angles or more",
    ),
    "radians": Plant(
        radians, (6.0, 4.0), "6 decimals; 4 decimals",
        ("ualoft_aeroglaze", "rgl_colodur_napoli_4f", "jsss_mwir_aluminium", "merl_aluminium_lumos"),
        "every scan",
    ),
    "percent": Plant(
        scaled(100.0), NOISE, NOISE_IN_WORDS,
        ("ualoft_anoblack_nite_steel", "rgl_colodur_napoli_4f", "starlink15_chassis", "merl_aluminium_lumos"),
        "two-sided and R > 0.0125, or one-sided and R > 0.2",
    ),
    "factor-pi": Plant(
        scaled(np.pi), NOISE, NOISE_IN_WORDS,
        ("rgl_paper_white", "rgl_satin_rosaline", "rgl_cg_sunflower", "starlink15_chassis"),
        BRIGHT,
    ),
    "reflectance-above-one": Plant(
        lambda scan, factor: scaled(factor)(scan, 0.0), (5.0, 400.0), "5 times; 400 times",
        ("rgl_paper_white", "rgl_colodur_napoli_4f", "rgl_satin_rosaline", "starlink15_chassis"),
        BRIGHT,
    ),
    "angle-zero-shifted": Plant(
        corrections.shift_theta_r, (1.0, -2.0), "+1 deg; -2 deg",
        ("starlink15_chassis", "rgl_satin_rosaline", "jsss_mwir_reference_paint_smooth", "merl_aluminium_lumos"),
        "two lobes or more of a half width up to 5 deg",
    ),
    "saturated": Plant(
        cut, (0.05, 0.02), "5 % of the values cut; 2 %",
        ("ualoft_aeroglaze", "rgl_satin_rosaline", "jsss_mwir_copper", "starlink15_solar_array"),
        "two values or more of one peak cut",
    ),
    "floor": Plant(
        floored, (0.1, 0.3), "10 % of the values; 30 %",
        ("ualoft_anoblack_nite_steel", "starlink15_chassis", "jsss_mwir_reference_paint_smooth", "rgl_paper_white"),
        "5 values or more",
    ),
}  # fmt: skip


def load(name: str) -> xr.Dataset:
    """A scan of the folder, or one of the tables."""
    return read(DATA / TABLES[name] if name in TABLES else SCANS / f"{name}.csv")


def names_in(scan: xr.Dataset) -> list[str]:
    """The mistakes that are found in a scan."""
    return [finding.name for finding in check(scan) if finding.name in NAMES]


def measured() -> dict[str, object]:
    """For every mistake how many of its eight plants were found, and in how many of all scans; false alarms besides."""
    every = {path.stem: read(path) for path in sorted(SCANS.glob("*.csv"))}
    tables = {name: load(name) for name in TABLES}
    found = {}
    for name, plant in PLANTS.items():
        some = tables if name == "azimuth-mirrored" else every
        cases = [
            name in names_in(plant.make(some[scan], strength)) for scan in plant.scans for strength in plant.strengths
        ]
        missed = [stem for stem, scan in some.items() if name not in names_in(plant.make(scan, plant.strengths[0]))]
        found[name] = {"found": sum(cases), "of": len(cases), "scans": len(some), "missed": missed}
    alarms = {name: names for name, scan in (every | tables).items() if (names := names_in(scan))}
    return {"planted": found, "scans": len(every), "alarms": alarms}


if __name__ == "__main__":
    record = {"date": datetime.datetime.now(datetime.UTC).date().isoformat(), **measured()}
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")

"""1173 observed magnitudes of Starlink v1.5 beside those of fits of its two surfaces, as docs/howto/magnitudes.md has.

    PYTHONPATH=src python tests/tools/starlink.py ggx gonio-best       prints a row for each model

The observations and the surfaces are those of Fankhauser, Tyson and Askari (MIT), read in ../shared/data.
"""

import csv
import sys
from pathlib import Path

import numpy as np

import gonio
from gonio.app.views.sky.magnitudes import agreement
from gonio.fitting import fit
from gonio.measured.masking import mask
from gonio.photometry import Earth, Facet, from_horizon, light_curve

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
OBSERVATIONS = DATA / "satellite" / "pomenis_observations.csv"
SITE = 32.4434, -110.7881  # deg north and east: Mount Lemmon
FLOOR = 1.01e-4  # 1/sr: values of 1e-4 in both files are the instrument's floor, which fits in logarithms would chase


def sun_from(utc, latitude, longitude):
    """Altitude and azimuth of the sun [deg] at times (datetime64) for a site [deg], without refraction.

    The low-precision formulas of the Astronomical Almanac, good to 0.01 deg from 1950 to 2050; against Astropy 8 at the
    times of the observations they err by 0.007 deg at most.
    """
    days = (utc - np.datetime64("2000-01-01T12:00:00")) / np.timedelta64(86400, "s")
    mean = np.radians(357.528 + 0.9856003 * days)
    longitude_of_sun = np.radians(280.460 + 0.9856474 * days + 1.915 * np.sin(mean) + 0.020 * np.sin(2 * mean))
    tilt = np.radians(23.439 - 4e-7 * days)
    ascension = np.arctan2(np.cos(tilt) * np.sin(longitude_of_sun), np.cos(longitude_of_sun))
    declination = np.arcsin(np.sin(tilt) * np.sin(longitude_of_sun))
    hour = np.radians(280.46061837 + 360.98564736629 * days + longitude) - ascension
    north = np.radians(latitude)
    up = np.sin(north) * np.sin(declination) + np.cos(north) * np.cos(declination) * np.cos(hour)
    east = -np.cos(declination) * np.sin(hour)
    forward = np.cos(north) * np.sin(declination) - np.sin(north) * np.cos(declination) * np.cos(hour)
    return np.degrees(np.arcsin(up)), np.degrees(np.arctan2(east, forward)) % 360


def observed():
    """The vectors of every observation, and the observed magnitudes [mag, AB]."""
    with OBSERVATIONS.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(line for line in file if line.strip() and not line.startswith("#")))
    utc = np.array([row["observation_time"] for row in rows], dtype="datetime64[s]")
    names = ("satellite_altitude", "satellite_azimuth", "satellite_height", "ab_magnitude")
    altitude, azimuth, height, magnitude = np.array([[float(row[name]) for name in names] for row in rows]).T
    return from_horizon(*sun_from(utc, *SITE), altitude, azimuth, height * 1e3), magnitude


def body(model, **options):
    """The chassis towards the nadir and the array towards the sun, each with a fit in logarithms."""
    fits = {}
    for name in ("chassis", "solar_array"):
        scan = mask(gonio.read(DATA / "scans" / f"starlink15_{name}.csv"), floor=FLOOR)
        fits[name] = fit(gonio.Problem(gonio.catalogue[model], scan, weighting="log", **options))
    return [
        Facet(3.64, [0, 0, -1], fits["chassis"], name="chassis"),
        Facet(22.68, [0, 1, 0], fits["solar_array"], name="array"),
    ]


def compared(facets, earthshine=0.0, every=1):
    """How the computed magnitudes, of every n-th time, differ from the observed ones, and the curve."""
    sight, magnitude = observed()
    sun, observer, position = (vector[::every] for vector in sight)
    earth = Earth(position, values={"rho": earthshine}) if earthshine else None
    curve = light_curve(facets, sun, observer, earth=earth)
    return agreement(curve["magnitude"].values, magnitude[::every]), curve


if __name__ == "__main__":
    print("model, earthshine, count, correlation, mean of computed less observed, standard deviation, median u [mag]")
    for name in sys.argv[1:]:
        facets = body(name)
        for albedo in (0.0, 0.3):
            found, curve = compared(facets, albedo)
            u = float(np.nanmedian(curve["uncertainty"].values))
            print(f"{name}, {albedo:g}, {found['count']}, {found['correlation']:.3f}, {found['bias']:+.2f}, "
                  f"{found['scatter']:.2f}, {u:.3f}", flush=True)  # fmt: skip

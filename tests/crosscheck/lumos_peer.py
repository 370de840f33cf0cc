"""Fluxes of satellites by Lumos-Sat, for tests/photometry/test_peers.py. Knows nothing of gonio.

    python tests/crosscheck/lumos_peer.py       writes tests/reference/peers/lumos.json

Lumos-Sat 1.0.9 asks for an old NumPy that it does not need: pip install --no-deps lumos-sat, with numpy and astropy.
Its magnitudes are another matter than its fluxes: it divides the whole solar constant by c/lambda at 532 nm, which
makes its sun 0.286 mag brighter than the sun in V.
"""

import importlib.metadata

import lumos.brdf.library as library
import lumos.calculator as calculator
import lumos.constants
import lumos.conversions
import lumos.functions
import numpy as np
from lumos.geometry import Surface
from peers import write

SURFACES = {
    "panel": [("LAMBERTIAN", {"albedo": 0.3}, 1.0, (0.0, 0.6, -0.8))],
    "glossy": [
        ("LAMBERTIAN", {"albedo": 0.2}, 3.64, (0.0, 0.0, -1.0)),
        ("PHONG", {"Kd": 0.1, "Ks": 0.4, "n": 20.0}, 22.68, (0.0, 1.0, 0.0)),
    ],
    "scattering": [("ABG", {"A": 0.002, "B": 0.003, "g": 1.8}, 5.0, (0.0, 0.8, -0.6))],
}
SEEN = 100
DENSITY = 1001  # of the mesh of the Earth


def main():
    rng = np.random.default_rng(21)
    altitude, azimuth = rng.uniform(20, 89, SEEN), rng.uniform(0, 360, SEEN)
    height, sun = rng.uniform(400e3, 1200e3, SEEN), np.stack([rng.uniform(-14, -6, SEEN), rng.uniform(0, 360, SEEN)])
    columns = {
        "altitude": altitude,
        "azimuth": azimuth,
        "height": height,
        "sun_altitude": sun[0],
        "sun_azimuth": sun[1],
    }
    for name, parts in SURFACES.items():
        surfaces = [Surface(area, np.array(normal), getattr(library, kind)(**v)) for kind, v, area, normal in parts]
        columns[name] = [
            calculator.get_intensity_observer_frame(
                surfaces, np.array([h]), np.array([alt]), np.array([az]), s, z, include_earthshine=False
            )[0]
            for h, alt, az, s, z in zip(height, altitude, azimuth, *sun, strict=True)
        ]
    facing = [Surface(1.0, np.array([0.0, 0.6, -0.8]), library.LAMBERTIAN(0.3))]
    # The satellite of the specification, 0.1 rad past the terminator over its observer, without and with the Earth.
    below = np.array([0.0, 0.0, lumos.constants.EARTH_RADIUS])
    columns["overhead"] = [
        calculator.get_intensity_satellite_frame(facing, 550e3, 0.1, below, include_earthshine=False)
    ]
    columns["earthshine"] = [
        calculator.get_intensity_satellite_frame(
            facing, 550e3, angle, below, False, True, DENSITY, library.LAMBERTIAN(0.3)
        )
        for angle in (0.0, 0.1, 0.2)
    ]
    about = {
        "peer": "Lumos-Sat",
        "version": importlib.metadata.version("lumos-sat"),
        "value": "flux [W/m^2] for a sun of 1360 W/m^2",
    }
    write("lumos.json", about, {n: np.asarray(c).tolist() for n, c in columns.items()}, SURFACES)


if __name__ == "__main__":
    main()

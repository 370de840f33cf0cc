"""A small goniometer for tests: readings of a surface whose BRDF is known, each cause drawn from its distribution."""

import numpy as np

from gonio import catalogue, simulate
from gonio.reduction import Known, make_readings
from gonio.reduction.steps.filling import solid_angle

THETA_I = (20.0, 40.0, 60.0)
THETA_R = np.arange(-72.0, 73.0, 8.0)
TRUTH = {"rho_s": 0.05, "rho_d": 0.2, "width": 0.25}
HELD = {"index": 1.5, "extinction": 0.0}
RADIUS, DISTANCE, TAU = Known(4.75, 0.005), Known(500.0, 0.5), Known(1e-3, 1e-5)
ZERO, SLOPE = 0.05, 2e-4  # standard uncertainties of the arm's zero [deg] and of the nonlinearity [1 per decade]
POWER = 1e-3  # of the beam [W]
DARK, DARK_SD, DARK_SAMPLES = 2e-10, 2e-11, 1
NOISE = 6e-4  # relative, of a reading


def truth(theta_r):
    """The BRDF at THETA_I and signed theta_r, in the order of a scan."""
    return simulate(catalogue["ggx"], TRUTH | HELD, THETA_I, theta_r, noise=0.0)["brdf"].values


def readings(rng):
    """The readings of one run, between a dark before and one after, with all that is uncertain drawn anew."""
    radius, distance, tau = (k.value + k.uncertainty * rng.standard_normal() for k in (RADIUS, DISTANCE, TAU))
    zero = ZERO * rng.standard_normal()
    # without directions where the arm is in the beam, whose angles a zero would move across the rim
    theta_i, theta_r = (grid.ravel() for grid in np.meshgrid(THETA_I, THETA_R, indexing="ij"))
    count = len(theta_i)
    time = np.arange(count + 3.0)
    flux = 1 + 0.002 * np.sin(time / 7.0)
    power = (
        POWER * flux[2:-1] * solid_angle(radius, distance) * np.cos(np.radians(theta_r + zero)) * truth(THETA_R + zero)
    )
    ideal = np.concatenate([[0.0], [POWER * flux[1] * tau], power, [0.0]])
    dark = DARK * (1 + 0.5 * time / time[-1])
    scatter = np.hypot(NOISE * ideal, 0.1 * DARK_SD)
    scatter[[0, -1]] = DARK_SD
    read = ideal + dark + scatter * rng.standard_normal(count + 3)
    return make_readings(
        {
            "kind": ["dark", "incident", *["sample"] * count, "dark"],
            "theta_i": [np.nan, np.nan, *theta_i, np.nan],
            "theta_r": [np.nan, np.nan, *theta_r, np.nan],
            "signal": read,
            "sd": scatter,
            "monitor": flux,
            "time": time,
        },
        "W",
        {"fill": "under"},
    )

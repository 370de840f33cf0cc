"""Fits of every kind that people read: one scan, several jointly, grouped by incidence, and a spectrum."""

import numpy as np
import pytest

from gonio import Problem, catalogue, fit, join, simulate

ANGLES = np.arange(-70.0, 71, 10)
LORENTZ = {"ks": 2.0, "kdd": 30.0, "kid": 0.1, "sigma": 0.15, "gamma": 20.0}
HOSTILE = '<script>alert("1")</script>&]]>\x1b[31m{x}$\\frac{$'


def surface(rho_d=0.1, **options):
    values = {"rho_s": 0.3, "rho_d": rho_d, "width": 0.2}
    return simulate(catalogue["ggx"], values, [20.0, 50.0], ANGLES, noise=0.01, seed=1, **options)


def spectrum(count=12):
    return join({f"{k}": surface(0.1 + 0.01 * k, wavelength=400.0 + k) for k in range(count)})


@pytest.fixture(scope="session")
def single():
    return fit(Problem(catalogue["ggx"], surface(), held={"index": 1.5, "extinction": 0.0}))


@pytest.fixture(scope="session")
def fits(single):
    """One solution of each kind by its name."""
    lorentz, ggx = catalogue["cauchy-lorentz"], catalogue["ggx"]
    held = {"index": 1.5, "extinction": 0.0}
    scan = simulate(lorentz, LORENTZ, [30.0, 50.0], ANGLES, noise=0.01)
    joint = join({HOSTILE: surface(), "b": surface(0.2)})
    colours = spectrum().drop_vars("scan")
    problems = {
        "joint": Problem(ggx, joint, held=held, weighting="log"),
        "grouped": Problem(lorentz, scan, grouped={"ks": "theta_i"}, weighting="relative"),
        "spectral": Problem(ggx, colours, held=held, grouped={"width": "wavelength"}),
    }
    return {"single": single} | {name: fit(problem) for name, problem in problems.items()}

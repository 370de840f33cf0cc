"""Reports of the kinds of fit that people have, as pages."""

import numpy as np
import pytest

import gonio
from gonio import Problem, catalogue, fit, join, simulate
from gonio.measured import dataset
from gonio.measured.causes import with_causes

HOSTILE = '<script>alert("1")</script>&]]>\x1b[31m\'{{ 7 * 7 }}--></style><b>\u202e'
VALUES = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2}
HELD = {"index": 1.5, "extinction": 0.0}
ANGLES = np.arange(-70.0, 71, 10)
DATE = "2026-01-31"


def painted(rho_d=0.1, **options):
    return simulate(catalogue["ggx"], VALUES | {"rho_d": rho_d}, [0.0, 45.0], ANGLES, noise=0.01, seed=1, **options)


def around(**coordinates):
    """Out of the plane, with standard uncertainties of 2 % and systematic ones of 1 %."""
    theta_i, theta_r, phi = (
        g.ravel() for g in np.meshgrid([20.0, 50.0], np.arange(5.0, 80, 15), np.arange(0, 360.0, 30))
    )
    at = dataset.make_scan(theta_i, theta_r, np.zeros(theta_i.size), phi)
    f = np.asarray(catalogue["ggx"](dataset.geometry(at), VALUES | HELD))
    more = {"uncertainty_systematic": (0.01 * f, "sr-1")}
    return dataset.make_scan(
        theta_i,
        theta_r,
        f,
        phi,
        uncertainty=0.02 * f,
        variables=more,
        coordinates=coordinates,
        history="read from a as b",
    )


def by_cause():
    """In plane: random errors of 1 %, a factor of 2 %, two darks, and the zero of the arm, odd about the normal."""
    scan = painted()
    f, theta_r = scan["brdf"].values, dataset.signed_theta_r(scan)
    shifts = {"standard": 0.02 * f, "dark[1]": -1e-4 + 0 * f, "dark[2]": 2e-4 + 0 * f}
    return with_causes(scan.assign(uncertainty=0.01 * scan["brdf"]), shifts | {"zero": 1e-3 * theta_r / 70 * f})


def of(kind):
    """A scan and the fit to it."""
    ggx, lambert = catalogue["ggx"], catalogue["lambert"]
    if kind == "coating":
        scan = painted()
        return scan, gonio.fit(scan, ["ggx", "lambert", "phong"])
    if kind == "causes":
        scan = by_cause()
        return scan, fit(Problem(ggx, scan, held=HELD))
    if kind == "spectral":
        scan = join({f"{k}": painted(0.1 + 0.01 * k, wavelength=400.0 + 10 * k) for k in range(8)}).drop_vars("scan")
        return scan, fit(Problem(ggx, scan, held=HELD, grouped={"width": "wavelength"}))
    if kind == "hemisphere":
        scan = around()
        return scan, fit(Problem(ggx, scan, held=HELD))
    if kind == "hostile":
        scan = join({HOSTILE: painted(), "b": painted(0.2)}).assign_attrs(provenance=f"name: {HOSTILE}")
        return scan, fit(Problem(ggx, scan, held=HELD))
    if kind == "grouped":
        scan = painted()
        return scan, fit(Problem(ggx, scan, held=HELD, grouped={"rho_d": "theta_i"}))
    scan = dataset.make_scan([30.0, 30.0], [30.0, 10.0], [1.2, 0.4], unit="a.u.")
    return scan, fit(Problem(lambert, scan))


KINDS = ("coating", "causes", "spectral", "hemisphere", "hostile", "grouped", "two values")
ABOUT = {
    "sample": {"name": HOSTILE, "dimensions": {"length": {"value": 50, "unit": "mm", "uncertainty": 0.1}}},
    "instrumentation": {"detection_system": {"solid_angle": {"value": 1.2e-4, "unit": "sr"}}},
    "environment": {"adhoc_section": {"cleanliness_class": "ISO 7"}},
}


@pytest.fixture(scope="session")
def pages(tmp_path_factory):
    """The page of every kind as a file, by kind."""
    folder, out = tmp_path_factory.mktemp("pages"), {}
    for kind in KINDS:
        scan, solution = of(kind)
        path = folder / f"{kind.replace(' ', '-')}.html"
        out[kind] = gonio.report(solution, path, scan=scan, about=ABOUT if kind == "hostile" else None, date=DATE)
    return out

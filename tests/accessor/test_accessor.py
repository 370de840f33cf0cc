"""`scan.gonio`: there on whatever gonio reads or makes, and the same as the functions of gonio."""

import subprocess
import sys
import warnings

import numpy as np
import pytest
import xarray as xr

import gonio
from gonio.accessor import Accessor

LAMBERT = gonio.catalogue["lambert"]


@pytest.fixture(scope="module")
def scan():
    return gonio.simulate(LAMBERT, {"rho": 0.4}, [10.0, 40.0], np.arange(-60, 61, 20.0), noise=0.01, seed=1)


@pytest.mark.parametrize(
    "made",
    [
        'gonio.sample("coating")',
        'gonio.read("scan.csv")',
        "gonio.scan([10.0], [10.0], brdf=[0.1], phi=[0.0])",
        'gonio.simulate(gonio.catalogue["lambert"], {"rho": 0.4}, [10.0], [0.0, 20.0])',
    ],
)
def test_it_is_there_however_a_scan_was_made(made, scan, tmp_path):
    """In a process of its own, in which nothing else has loaded it; without a warning that a name was taken."""
    gonio.write(scan, tmp_path / "scan.csv")
    code = f"import gonio\nscan = {made}\nprint(repr(scan.gonio))"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.stdout.startswith("<gonio: a scan of "), done.stderr


def test_importing_gonio_loads_no_xarray():
    code = "import sys, gonio\nprint([m for m in ('xarray', 'numpy', 'gonio.accessor') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_it_does_what_the_functions_do(scan, tmp_path):
    solution = scan.gonio.fit("lambert")
    assert solution.values == gonio.fit(scan, "lambert").values
    assert [str(one) for one in scan.gonio.check()] == [str(one) for one in gonio.check(scan)]
    ranked = scan.gonio.compare(["lambert", gonio.catalogue["minnaert"]])
    assert {row.model.name for row in ranked} == {"lambert", "minnaert"}
    assert scan.gonio.convert(tmp_path / "scan.nc").format.name == "netcdf"
    assert scan.gonio.plot(solution).axes
    assert scan.gonio.report(tmp_path / "page.md").is_file()
    assert scan.gonio.reflectance() == []  # of one plane alone


def test_a_reflectance_over_the_hemisphere():
    theta, phi = np.meshgrid(np.arange(0, 90, 5.0), np.arange(0, 360, 10.0))
    grid = gonio.scan(np.full(theta.size, 30.0), theta.ravel(), phi=phi.ravel(), brdf=np.full(theta.size, 0.5 / np.pi))
    (one,) = grid.gonio.reflectance()
    assert one.value == pytest.approx(0.5, rel=0.02)  # by the nodes of a quadrature on a grid of 5 deg


@pytest.mark.parametrize("name", [n for n in vars(Accessor) if not n.startswith("_")])
def test_a_dataset_that_is_no_scan_is_refused_with_the_remedy(name):
    words = {"compare": (["lambert"],), "report": ("a.md",), "convert": ("a.nc",)}.get(name, ())
    with pytest.raises(ValueError, match="this Dataset has no brdf, theta_i, theta_r, phi: a scan needs brdf and"):
        getattr(xr.Dataset({"a": 1}).gonio, name)(*words)
    assert repr(xr.Dataset().gonio) == "<gonio: this Dataset is no scan>"


def test_an_unknown_model_is_told_with_the_nearest(scan):
    with pytest.raises(KeyError, match="did you mean ggx"):
        scan.gonio.compare(["GGX"])


def test_a_name_that_another_package_took_is_told():
    """A warning of xarray, which gonio does not hide."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        xr.register_dataset_accessor("gonio")(Accessor)
    assert [one.category.__name__ for one in told] == ["AccessorRegistrationWarning"]

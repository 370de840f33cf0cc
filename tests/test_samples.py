"""The bundled scans: there by name, the same each time, called simulated, and fitted to what they were made from."""

import numpy as np
import pytest
import xarray as xr

import gonio
from gonio.samples import samples


@pytest.mark.parametrize("name", samples())
def test_each_is_a_sound_scan_that_says_that_it_is_simulated(name):
    scan = gonio.sample(name)
    assert scan.attrs["simulated"] == f"simulated from {samples()[name].model}"
    assert "simulated" in scan.attrs["provenance"]
    assert [finding.name for finding in gonio.check(scan)] == ["masked"]  # where the detector hides the source
    xr.testing.assert_identical(scan, gonio.sample(name))


@pytest.mark.parametrize("name", samples())
def test_the_values_that_the_angles_determine_are_found_again(name):
    made = samples()[name]
    scan = gonio.sample(name)
    held = {k: made.values[k] for k in ("index", "extinction")}  # in plane they trade off with rho_s
    solution = gonio.fit(gonio.Problem(gonio.catalogue[made.model], scan, held=held, weighting="log"))
    for value in ("rho_s", "rho_d", "width"):
        away = abs(solution.values[value] - made.values[value]) / solution.uncertainties[value]
        assert away < 4, f"{value} is {away:.1f} standard uncertainties away"  # of 6 values one beyond 4: 4e-4


@pytest.mark.parametrize("name", samples())
def test_a_written_sample_is_read_again(name, tmp_path):
    gonio.write(gonio.sample(name), tmp_path / "scan.csv")
    again = gonio.read(tmp_path / "scan.csv")
    np.testing.assert_allclose(again.brdf, gonio.sample(name).brdf)
    assert "simulated" in again.attrs["history"]
    assert "simulated" in again.attrs["provenance"]


def test_an_unknown_name_lists_those_that_there_are():
    with pytest.raises(KeyError, match="coating"):
        gonio.sample("coatings")

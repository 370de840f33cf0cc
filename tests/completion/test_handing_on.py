"""A corrected fit as a table of another program, or in the gaps of a scan: nearer to the data than its model."""

import numpy as np
import pytest

from bumped import HELD, VALUES, directions, exchanged, measured, some, surface
from gonio import Problem, catalogue, complete, convert, export, fit, join, read
from gonio.completion import Corrected, Correction
from gonio.measured import dataset
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling


@pytest.fixture(scope="module")
def corrected():
    scan = measured()
    solution = fit(Problem(catalogue["ggx"], scan, weighting="log", held=HELD))
    return Corrected.of(scan, solution)


def test_it_is_the_surface_that_complete_writes(corrected):
    places = some(200)
    found = corrected.brdf(places)
    np.testing.assert_allclose(found, complete(measured(), corrected.solution, places)["brdf"].values, rtol=1e-12)
    np.testing.assert_allclose(corrected.brdf(exchanged(places)), found, rtol=1e-9)


def test_directions_need_not_name_the_only_set_of_a_scan(corrected):
    scan = measured().assign_coords(wavelength=((), 650.0, {"units": "nm"}))
    of_one = Corrected.of(scan, fit(Problem(catalogue["ggx"], scan, weighting="log", held=HELD)))
    np.testing.assert_allclose(of_one.brdf(some(20)), corrected.brdf(some(20)), rtol=1e-6)


@pytest.mark.parametrize("to", ["zemax", "netcdf"])
def test_a_table_is_nearer_to_the_surface_than_its_model(corrected, tmp_path, to):
    places = directions(*np.meshgrid([20.0, 40.0, 60.0], [10.0, 30.0, 50.0]), 180.0)
    truth = surface(places)
    errors = []
    for name, of in (("plain", corrected.solution), ("corrected", corrected)):
        path = tmp_path / f"{name}{'.nc' if to == 'netcdf' else '.bsdf'}"
        done = export(of, path, to=to)
        assert done.prove().holds
        errors.append(difference(read(path), places.assign(brdf=("direction", truth, {"units": "sr-1"}))).log10_rmse)
    assert errors[1] < 0.5 * errors[0]
    assert "corrected by 93 values and the prior" in done.subject.facts["correction"]


def test_each_set_has_its_own_correction(tmp_path):
    """Red has the bump that the model lacks, green has not."""
    red = measured()
    plain = catalogue["ggx"](dataset.geometry(red), VALUES | HELD)
    green = red.assign(brdf=("direction", np.asarray(plain), red["brdf"].attrs))
    of_channels = {c: part.assign_coords(channel=("direction", [c] * 93)) for c, part in (("R", red), ("G", green))}
    scan = join(of_channels).drop_vars("scan")
    solution = fit(Problem(catalogue["ggx"], scan, weighting="log", held=HELD))
    of_sets = Corrected.of(scan, solution, Correction(prior=False))
    export(of_sets, tmp_path / "sets.nc", to="netcdf")
    table = read(tmp_path / "sets.nc")
    for channel in ("R", "G"):
        place = dataset.points(table.sel(channel=channel)).isel(direction=1234)
        exact = directions(*([float(place[name])] for name in dataset.ANGLES))
        exact = exact.assign_coords(channel=("direction", [channel]))
        assert float(place["brdf"]) == pytest.approx(float(of_sets.brdf(exact)[0]), rel=1e-6)


def test_no_formula_takes_a_correction(corrected, tmp_path):
    with pytest.raises(ValueError, match=r"is in no formula.*--to .*zemax"):
        export(corrected, tmp_path / "coating.h", to="c")
    assert not (tmp_path / "coating.h").exists()


def test_gaps_are_filled_by_it(corrected, tmp_path):
    gaps = measured()
    hidden = (gaps["theta_i"].values == 40.0) & (gaps["theta_r"].values < 30.0)
    known = gaps.isel(direction=np.flatnonzero(~hidden))
    of_known = Corrected.of(known, fit(Problem(catalogue["ggx"], known, weighting="log", held=HELD)))
    places = dataset.points(gaps).isel(direction=np.flatnonzero(hidden))
    truth = np.log10(surface(places))
    off = {
        name: float(np.sqrt(np.mean((np.log10(brdf(places)) - truth) ** 2)))
        for name, brdf in (("corrected", of_known.brdf), ("plain", of_known.solution.brdf))
    }
    assert off["corrected"] < off["plain"]
    done = convert(known, tmp_path / "filled.bsdf", "zemax", filling=Filling((), of_known.brdf, of_known.words))
    assert "corrected by" in done.scan.attrs["history"]

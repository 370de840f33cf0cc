"""Causes of systematic uncertainty go through resampling with their signs, or the history says that they do not."""

import numpy as np
import pytest

from gonio import catalogue, convert, join, read, simulate, write
from gonio.formats import formats
from gonio.measured import dataset
from gonio.measured.causes import causes, total, with_causes
from gonio.measured.coordinates import grid
from gonio.resampling.means import means_over
from gonio.resampling.resample import resample

ANGLES = np.arange(-70.0, 71, 10)
VALUES = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.3, "index": 1.5, "extinction": 0.0}


def scan_of(**more):
    """In plane: a factor, and a shift that is odd about the normal and linear in the angle."""
    scan = dataset.points(simulate(catalogue["ggx"], VALUES, [20.0, 40.0], ANGLES, **more))
    signed = dataset.signed_theta_r(scan)
    return with_causes(
        scan.assign(uncertainty=0.01 * scan["brdf"]), {"standard": 0.02 * scan["brdf"].values, "zero": 1e-4 * signed}
    )


def onto(*theta_r, theta_i=20.0):
    return dataset.make_scan([theta_i] * len(theta_r), theta_r, np.zeros(len(theta_r))).drop_vars("brdf")


def test_they_are_interpolated_with_their_signs():
    out = resample(scan_of(), onto(-65.0, -20.0, 14.0, 55.0))
    found = causes(out)
    assert list(found) == ["standard", "zero"]
    assert found["standard"] == pytest.approx(0.02 * out["brdf"].values, rel=1e-9)
    assert found["zero"] == pytest.approx([-65e-4, -20e-4, 14e-4, 55e-4], abs=1e-12)
    assert out["uncertainty_systematic"].values == pytest.approx(total([*found.values()]))
    assert out["systematic"].attrs["units"] == "sr-1"
    assert "without the uncertainties" not in out.attrs["history"]


def test_directions_that_were_measured_keep_theirs_to_the_last_bit():
    scan = scan_of()
    out = resample(scan, scan.drop_vars(list(scan.data_vars)))
    for name, shifts in causes(scan).items():
        assert causes(out)[name].tolist() == shifts.tolist()
    assert out["uncertainty_systematic"].values == pytest.approx(scan["uncertainty_systematic"].values)


def test_outside_of_the_data_there_are_none():
    out = resample(scan_of(), onto(75.0, 0.0))
    assert np.isnan(out["brdf"].values).tolist() == [True, False]
    assert np.isnan(out["systematic"].values).tolist() == [[True, False]] * 2


def surface():
    """On a grid, with a cause whose dimensions stand in another order than those of the BRDF."""
    nodes = grid(
        "spherical", theta_i=np.arange(0, 61, 20.0), theta_r=np.arange(0, 71, 10.0), phi=np.arange(0, 360, 30.0)
    )
    dims = tuple(nodes.sizes)
    angles = {n: nodes[n].broadcast_like(nodes["phi"] * nodes["theta_i"] * nodes["theta_r"]) for n in dataset.ANGLES}
    value = (1 + 0.01 * angles["theta_r"]).transpose(*dims) / np.pi
    scan = nodes.assign(brdf=value.assign_attrs(units="sr-1"))
    shifts = {"standard": 0.02 * value.values, "zero": 1e-4 * angles["theta_r"].transpose(*dims).values}
    done = with_causes(scan, shifts)
    return done.assign(systematic=done["systematic"].transpose("cause", *dims[::-1]))


def test_a_grid_onto_another_and_onto_directions():
    scan = surface()
    finer = grid(
        "spherical", theta_i=np.arange(0, 61, 10.0), theta_r=np.arange(0, 71, 5.0), phi=np.arange(0, 360, 15.0)
    )
    for target in (finer, onto(5.0, 25.0), scan.drop_vars(list(scan.data_vars))):
        out = resample(scan, target)
        assert list(out["systematic"].dims) == ["cause", *out["brdf"].dims]
        found = causes(out)
        assert found["standard"] == pytest.approx(0.02 * out["brdf"].values, rel=1e-9)
        theta_r = out["theta_r"].broadcast_like(out["brdf"]).transpose(*out["brdf"].dims).values
        assert found["zero"] == pytest.approx(1e-4 * theta_r, abs=1e-12)


def test_wavelengths_each_have_their_own():
    parts = {f"{k}": scan_of(wavelength=400.0 + 100 * k) for k in range(2)}
    parts["1"] = with_causes(parts["1"], {n: 3 * v for n, v in causes(parts["1"]).items()})
    out = resample(join(parts).drop_vars("scan"), onto(-15.0, 14.0))
    factor = np.where(out["wavelength"].values == 400, 1.0, 3.0)
    assert causes(out)["standard"] == pytest.approx(0.02 * factor * out["brdf"].values, rel=1e-9)
    assert causes(out)["zero"] == pytest.approx(1e-4 * factor * [-15.0, 14.0, -15.0, 14.0], abs=1e-12)


def test_masked_values_and_gaps_stay_gaps():
    scan = scan_of()
    scan["brdf"].values[3] = np.nan
    out = resample(scan, onto(-40.0, -35.0, 25.0))
    assert np.isfinite(out["systematic"].values[:, 2]).all()


@pytest.mark.parametrize("symmetry", ["reciprocity", "bilateral"])
def test_where_they_are_lost_the_history_says_so(symmetry):
    out = resample(scan_of(), onto(10.0), impose=[symmetry])
    assert "systematic" not in out
    assert out.attrs["history"].splitlines()[-1].count("without the uncertainties") == 1
    plain = scan_of().drop_vars(["uncertainty", "systematic", "uncertainty_systematic", "cause"])
    assert "without" not in resample(plain, onto(10.0), impose=[symmetry]).attrs["history"]


def test_means_over_patches_say_so():
    target = formats()["radiance"]
    out = means_over(surface(), target.layout(surface()), target, (), None)
    assert "without the uncertainties" in out.attrs["history"].splitlines()[-1]


def test_a_scan_that_is_converted_onto_a_grid_keeps_them_where_the_format_can(tmp_path):
    scan = scan_of()
    write(resample(scan, onto(-15.0, 14.0)), tmp_path / "out.csv")
    assert list(causes(read(tmp_path / "out.csv"))) == ["standard", "zero"]
    convert(scan, tmp_path / "again.nc")
    assert list(causes(read(tmp_path / "again.nc"))) == ["standard", "zero"]

"""A coated body in the place of a Lambertian on measured scans, and a diffuse standard (surface.md, E)."""

import json

import numpy as np
import pytest

from gonio import Problem, catalogue
from gonio.fitting import fit
from gonio.measured.dataset import make_scan
from places import ROOT, SHARED

STANDARD = SHARED / "raw" / "blacklab" / "z307_al_reference.txt"
# lg RMSE in sample of student-t with a Lambertian, and with a coated body whose index is free (E.2). "as printed": the
# scan was masked alike; the arms of jsss_* at 80 and 85 deg see the source, and are masked here. "not so": with a
# value of each weight for every channel, as here, the wall paint comes out at 0.0445 and 0.0485.
ERRORS = {
    "rgl_paper_white": (0.0235, 0.0185, ""),
    "ualoft_anoblack_ec1_al6061": (0.0460, 0.0396, ""),
    "jsss_mwir_stainless_steel_brushed": (0.2502, 0.2175, ""),
    "jsss_mwir_aluminium_sandblasted": (0.1548, 0.1379, ""),
    "jsss_mwir_steel_sandblasted": (0.1845, 0.1722, ""),
    "starlink15_solar_array": (0.2891, 0.2757, "as printed"),
    "jsss_mwir_reference_paint_rough": (0.2043, 0.1948, ""),
    "ualoft_anoblack_nite_steel": (0.0647, 0.0628, "as printed"),
    "rgl_colodur_napoli_4f": (0.0499, 0.0491, "not so"),
    "starlink15_chassis": (0.1963, 0.1930, ""),
    "ualoft_aeroglaze": (0.0265, 0.0266, "as printed"),
    "ualoft_singularity": (0.1432, 0.1448, ""),
}


@pytest.mark.parametrize("name", ERRORS)
def test_a_coated_body_errs_as_printed(name):
    """From the record, in which the index is held at 1.5: it errs less where the specification says so, else more."""
    record = json.loads((ROOT / "benchmarks" / "validated.json").read_text(encoding="utf-8"))["scans"]
    lambertian, coated, how = ERRORS[name]
    plain, found = (record[name]["models"][model]["fitted"] for model in ("student-t", "student-t-coated"))
    assert (found < plain) == ((coated < lambertian) != (how == "not so"))
    if how == "as printed":
        assert plain == pytest.approx(lambertian, abs=6e-5)
        assert found == pytest.approx(coated, rel=0.01)  # its index is held


@pytest.mark.skipif(not STANDARD.exists(), reason=f"no measured data at {STANDARD}")
def test_the_working_standard():
    """A white standard at 112 pairs of directions: the models that come nearest err by 1.3 to 1.8 %, none by 1 % (E.4).

    Its own pairs of exchanged directions differ by 1 %. Lambert errs by 11 %: it is a hemisphere's standard.
    """
    rows = STANDARD.read_text(encoding="latin-1").splitlines()[6:]
    values = np.unique(np.array([row.split() for row in rows if row.strip()], dtype=float), axis=0)
    assert len({tuple(row[:4]) for row in values}) >= 112
    scan = make_scan(values[:, 0], values[:, 2], values[:, 4] / np.pi, values[:, 3])
    errors = {}
    for name in ("lambert", "hapke", "student-t-coated"):
        solution = fit(Problem(catalogue[name], scan, weighting="relative"))
        errors[name] = float(np.sqrt(np.mean((np.asarray(solution.predict(scan)) / scan["brdf"].values - 1) ** 2)))
    assert errors["lambert"] > 0.1
    assert 0.01 < errors["hapke"] < 0.018
    assert 0.01 < errors["student-t-coated"] < 0.018

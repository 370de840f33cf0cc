"""What a million calls of each scatter DLL gave outside OpticStudio (`make crosscheck`), against gonio of today."""

import json
from pathlib import Path

import pytest

from crosscheck.zemax_dll import INCIDENCES, MODELS
from gonio import catalogue
from gonio.plausibility import hemispherical_reflectance

STORED = json.loads((Path(__file__).parent / "reference" / "peers" / "zemax-dll.json").read_text(encoding="utf-8"))
ERRORS = 4  # standard errors: of 36 means one in five hundred runs would be beyond, were the seeds not fixed
LEVEL = 1e-3 / 36  # of 36 tests of directions


def test_a_windows_compiler_took_every_model():
    """Those of the catalogue when it was run; a later one is for the next `make crosscheck`."""
    assert len(STORED["windows"]) >= 48
    assert max(STORED["windows"].values()) < 1e-9


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("theta_i", INCIDENCES)
def test_the_mean_energy_was_the_reflectance(name, theta_i):
    found = STORED["models"][name][f"{theta_i:g}"]
    now = hemispherical_reflectance(lambda g: catalogue[name](g, MODELS[name]), theta_i, 200)
    # an ideal diffuse surface has no standard error, and the quadrature rounds
    assert abs(found["mean energy"] - now) <= ERRORS * found["standard error"] + 1e-4 * now
    assert found["p"] > LEVEL

"""One coating at four wavelengths: what does not depend on the wavelength, and how rough light sees it (surface.md)."""

import json

import numpy as np
import pytest

from gonio import Problem, catalogue
from gonio.fitting import Projection, fit
from places import ROOT, SHARED
from surfaces import coating_at_four_wavelengths

PRINTED = {385.65: 0.240, 630.79: 0.267, 852.23: 0.257, 1059.04: 0.252}
QUICK = Projection(grid=3, searches=1, line=5, rounds=1)
pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason=f"no measured data at {SHARED}")


def test_a_width_does_not_depend_on_the_wavelength():
    """AnoBlack NiTE on Invar: widths of ggx from log fits are within 6 % of their mean (E.1)."""
    scan = coating_at_four_wavelengths()
    widths = {}
    for wavelength in PRINTED:
        one = scan.isel(direction=np.isclose(scan["wavelength"].values, wavelength))
        widths[wavelength] = fit(Problem(catalogue["ggx"], one, weighting="log"), QUICK).values["width"]
    assert widths == pytest.approx(PRINTED, rel=0.01)  # the masks of the specification are not known
    assert list(widths.values()) == pytest.approx([np.mean(list(widths.values()))] * 4, rel=0.06)


def test_light_sees_a_fortieth_of_what_an_interferometer_does():
    """Sq 3.49 um by interferometry, and a rms height below 0.1 um in the lobe, as recorded (B.7)."""
    record = json.loads((ROOT / "benchmarks" / "wavelengths.json").read_text(encoding="utf-8"))["fits"]
    sigma = record["one rms height"]["values"]["sigma"]
    assert 3.49 / sigma == pytest.approx(40, rel=0.1)

"""Headings taken apart: names, units, quantities, wavelengths and factors of uncertainties."""

import pytest

from gonio.tables.headings import constants, parsed
from gonio.tables.vocabulary import NAMES, QUANTITY_NAMES, UNCLEAR_NAMES, WEAK_NAMES


@pytest.mark.parametrize(
    ("text", "target", "unit"),
    [
        ("theta_i_deg", "theta_i", "deg"),
        ("Theta_i [deg]", "theta_i", "deg"),
        ("AOI in deg", "theta_i", "deg"),
        ("AOI / deg", "theta_i", "deg"),
        ("θ_i (°)", "theta_i", "deg"),
        ("elev_in_rad", "elevation_i", "rad"),
        ("elevation out [degrees]", "elevation_r", "deg"),
        ("Source Zenith Angle", "theta_i", ""),
        ("src_a", "phi_i", ""),
        ("view_z", "theta_r", ""),
        ("Measure_angle", "theta_r", ""),
        ("Einfallswinkel", "theta_i", ""),
        ("azimuth", "phi_r", ""),
        ("φ (rad)", "phi", "rad"),
        ("wavelength (µm)", "wavelength", "um"),
        ("lambda_nm", "wavelength", "nm"),
        ("BRDF, 1/sr", "brdf", "sr-1"),
        ("BRDF / sr⁻¹", "brdf", "sr-1"),
        ("fr_per_sr", "brdf", "sr-1"),
        ("BRDF sr^-1", "brdf", "sr-1"),
        ("BSDF [arb. units]", "brdf", "a.u."),
        ("Signal [V]", "signal", "V"),
        ("angle", "theta_r", ""),
        ("temperature [K]", "", ""),
        ("grad", "", ""),
    ],
)
def test_name_and_unit(text, target, unit):
    heading = parsed(text)
    assert (heading.target, heading.unit) == (target, unit)


@pytest.mark.parametrize(
    ("text", "quantity"),
    [
        ("BRDF", "brdf"),
        ("CCBRDF_sr-1", "ccbsdf"),
        ("cosine-corrected BSDF [1/sr]", "ccbsdf"),
        ("BRDF·cosθ", "ccbsdf"),
        ("R_factor_percent", "reflectance-factor"),
        ("log10(BRDF [1/sr])", "log10-brdf"),
        ("lg BSDF", "log10-brdf"),
        ("I_per_incident_W_sr-1", "radiant-intensity"),
        ("log BRDF", "?"),
        ("reflectance", "?"),
        ("radiance factor", "?"),
    ],
)
def test_quantity(text, quantity):
    assert parsed(text).quantity == quantity


@pytest.mark.parametrize(
    ("text", "coverage", "is_relative"),
    [
        ("u", 1, False),
        ("u(BRDF) [1/sr]", 1, False),
        ("U(k=1) [1/sr]", 1, False),
        ("U (k = 2)", 2, False),
        ("expanded uncertainty (k=2) [%]", 2, False),
        ("U", 0, False),
        ("expanded uncertainty", 0, False),
        ("Uncertainty", 1, False),
        ("standard uncertainty (relative)", 1, True),
        ("u_rel", 1, True),
    ],
)
def test_uncertainty(text, coverage, is_relative):
    heading = parsed(text)
    assert heading.target == "uncertainty"
    assert (heading.coverage, heading.is_relative) == (coverage, is_relative)


@pytest.mark.parametrize(("text", "nm"), [("450 nm", 450), ("BRF_632.8nm", 632.8), ("0,45 µm", 450), ("u 550nm", 550)])
def test_wavelength(text, nm):
    assert parsed(text).wavelength == pytest.approx(nm)
    assert parsed(text).target in ("brdf", "uncertainty")


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("AOI = 10 deg", [("theta_i", 10, "deg")]),
        ("# Incidence angle: 10,5°", [("theta_i", 10.5, "deg")]),
        ("AOI=10, wavelength = 650 nm", [("theta_i", 10, ""), ("wavelength", 650, "nm")]),
        ("650 nm", [("wavelength", 650, "nm")]),
        ("theta_i 0.5 rad", [("theta_i", 0.5, "rad")]),
        ("Serial 12345", []),
        ("AOI 10 30 50", []),
        ("AOI = 10 nm", []),
        ("detector angle 10", []),
    ],
)
def test_what_a_line_states(line, found):
    assert [(c.target, c.value, c.unit) for c in constants(line)] == found


def test_no_name_means_two_things():
    for one, other in (
        (NAMES, QUANTITY_NAMES),
        (NAMES, WEAK_NAMES),
        (QUANTITY_NAMES, UNCLEAR_NAMES),
        (NAMES, UNCLEAR_NAMES),
        (WEAK_NAMES, QUANTITY_NAMES),
    ):
        assert not set(one) & set(other)

"""Quantities and uncertainties against numbers worked out by hand, and what stays relative."""

import math

import numpy as np
import pytest

from gonio import read_table


def table(tmp_path, text, **flags):
    path = tmp_path / "table.csv"
    path.write_text(text)
    return read_table(path, **flags)


@pytest.mark.parametrize(
    ("heading", "cells", "brdf", "uncertainty"),
    [
        # At theta_r 60 deg, whose cosine is 1/2.
        ("BRDF,u", "0.2,0.01", 0.2, 0.01),
        ("BRDF,U (k=2)", "0.2,0.01", 0.2, 0.005),
        ("BRDF,u [%]", "0.2,5", 0.2, 0.01),
        ("BRDF,u_rel", "0.2,0.05", 0.2, 0.01),
        ("ccBRDF,u", "0.1,0.01", 0.2, 0.02),
        ("ccBRDF,u [%]", "0.1,5", 0.2, 0.01),
        ("reflectance factor,u", f"{0.2 * math.pi},{0.01 * math.pi}", 0.2, 0.01),
        ("reflectance factor,u [1/sr]", f"{0.2 * math.pi},0.01", 0.2, 0.01),
        ("BRF [%],u", f"{20 * math.pi},{math.pi}", 0.2, 0.01),
        ("log10(BRDF),u", f"{math.log10(0.2)},{0.05 / math.log(10)}", 0.2, 0.01),
        ("log10(BRDF),u [1/sr]", f"{math.log10(0.2)},0.01", 0.2, 0.01),
        ("log10(BRDF),u [%]", f"{math.log10(0.2)},5", 0.2, 0.01),
        ("I per incident W [1/sr],std", "0.1,0.005", 0.2, 0.01),
    ],
)
def test_values_and_uncertainties(tmp_path, heading, cells, brdf, uncertainty):
    scan = table(tmp_path, f"AOI,AOS,{heading}\n10,60,{cells}\n")
    assert scan["brdf"].item() == pytest.approx(brdf, rel=1e-12)
    assert scan["uncertainty"].item() == pytest.approx(uncertainty, rel=1e-12)
    assert scan["brdf"].attrs["units"] == scan["uncertainty"].attrs["units"] == "sr-1"


def test_percentage_points(tmp_path):
    scan = table(tmp_path, "AOI,AOS,BRF [%],u [%]\n10,60,50,1\n", columns={"u [%]": "uncertainty:percent:points"})
    assert scan["uncertainty"].item() == pytest.approx(0.01 / math.pi)


@pytest.mark.parametrize(
    ("heading", "flags", "factor"),
    [
        ("BRDF [a.u.]", {}, 1.0),
        ("Signal [V]", {}, 2.0),
        ("counts", {}, 2.0),
        ("radiant intensity [W/sr]", {}, 2.0),
        ("radiant intensity", {}, 2.0),
        ("x", {"columns": "x=signal"}, 2.0),
        ("x", {"columns": "x=brdf", "quantity": "radiant-intensity"}, 2.0),
        ("ccBRDF [arb. units]", {}, 2.0),
    ],
)
def test_what_is_relative_stays_so_and_says_so(tmp_path, heading, flags, factor):
    scan = table(tmp_path, f"AOI,AOS,{heading}\n10,60,0.5\n", **flags)
    assert scan["brdf"].attrs["units"] == "a.u."
    assert scan["brdf"].item() == pytest.approx(0.5 * factor)
    assert "stays so" in scan.attrs["history"]


def test_what_is_assumed_is_said(tmp_path):
    scan = table(tmp_path, "AOI,AOS,value\n10,60,0.5\n")
    assert "assumed, as nothing says it" in scan.attrs["history"]
    assert "assumed" not in table(tmp_path, "AOI,AOS,BRDF\n10,60,0.5\n").attrs["history"]


def test_the_text_above_states_quantity_unit_and_wavelength(tmp_path):
    scan = table(tmp_path, "BRF in %\nmeasured at 632.8 nm\nAOI,AOS,value\n10,60,50\n")
    assert scan["brdf"].item() == pytest.approx(0.5 / math.pi)
    assert scan["wavelength"].item() == 632.8


def test_no_brdf_follows_at_the_horizon(tmp_path):
    scan = table(tmp_path, "AOI,AOS,ccBRDF\n10,60,0.5\n10,90,0.1\n")
    np.testing.assert_allclose(scan["brdf"].values, [1.0, np.nan])
    assert "1 values at theta_r = 90 deg are gaps" in scan.attrs["history"]


def test_an_empty_value_is_a_gap_and_an_empty_row_nothing(tmp_path):
    scan = table(tmp_path, "AOI,AOS,BRDF,\n10,60,0.5,\n10,70,,\n,,,\n,,,\n")
    np.testing.assert_array_equal(scan["brdf"].values, [0.5, np.nan])


def test_transmission_is_not_taken_for_reflection(tmp_path):
    assert set(table(tmp_path, "AOI,AOS,BTDF\n10,60,0.5\n")["mode"].values.tolist()) == {"transmission"}


def test_channels_and_further_columns(tmp_path):
    scan = table(tmp_path, "AOI,AOS,R,G,B,T [K]\n10,60,.1,.2,.3,293\n")
    assert scan["channel"].values.tolist() == ["R", "G", "B"]
    assert scan["T [K]"].values.tolist() == [293] * 3
    assert "kept and not used: 'T [K]'" in scan.attrs["history"]

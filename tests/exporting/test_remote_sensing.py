"""Surfaces for Eradiate, Py6S and libRadtran."""

import math
import runpy

import numpy as np
import pytest
import yaml

from gonio import Geometry, catalogue, export, fit, simulate
from gonio.exporting.entry import write
from gonio.exporting.source import pairs
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.targets.py6s import AZIMUTHS, ZENITHS, loaded
from gonio.plausibility import bihemispherical_reflectance

RPV = {"r0": 0.2, "k": 0.8, "theta": -0.15, "rc": 0.3}
ROSS_LI = {"fiso": 0.3, "fvol": 0.1, "fgeo": 0.02}


def case(name, **values):
    return of_model(catalogue[name], values)


def spectral(name, **values):
    """A fit over wavelengths, whose order is not that of the numbers."""
    labels = ("1240", "550", "865")
    sets = {w: dict(case(name, **{n: v[k] for n, v in values.items()}).values) for k, w in enumerate(labels)}
    return Subject(catalogue[name], sets, "wavelength", origin="given by hand")


def written(subject, path, to):
    done = write(subject, path, to, "ground")
    assert done.prove().holds
    return done


@pytest.mark.parametrize("suffix", [".yml", ".py"])
@pytest.mark.parametrize(
    ("subject", "expected"),
    [
        (case("rpv", **RPV), {"type": "rpv", "rho_0": 0.2, "k": 0.8, "g": -0.15, "rho_c": 0.3}),
        (case("ross-li", **ROSS_LI), {"type": "rtls", "f_iso": 0.3, "f_vol": 0.1, "f_geo": 0.02}),
        (case("lambert", rho=0.5), {"type": "lambertian", "reflectance": 0.5}),
        (case("ross-li", fiso=1e-5), {"type": "rtls", "f_iso": 1e-5, "f_vol": 0.0, "f_geo": 0.0}),
    ],
)
def test_eradiate_gets_its_own_names(subject, expected, suffix, tmp_path):
    path = written(subject, tmp_path / f"ground{suffix}", "eradiate").files[0]
    found = runpy.run_path(str(path))["ground"] if suffix == ".py" else yaml.safe_load(path.read_text())
    assert found == expected
    assert list(found) == list(expected)


def test_eradiate_gets_wavelengths_in_order(tmp_path):
    subject = spectral("rpv", r0=(0.3, 0.1, 0.2), k=(0.7, 0.9, 0.8), rc=(0.3, 0.1, 0.2))
    found = yaml.safe_load(written(subject, tmp_path / "g.yml", "eradiate").files[0].read_text())
    assert found["rho_0"] == {"type": "interpolated", "wavelengths": [550.0, 865.0, 1240.0], "values": [0.1, 0.2, 0.3]}
    assert found["k"]["values"] == [0.9, 0.8, 0.7]
    assert found["g"]["values"] == [-0.1] * 3


@pytest.mark.parametrize(("name", "why"), [("hapke", "another formula"), ("ggx", "fit rpv or ross-li")])
@pytest.mark.parametrize(("to", "suffix"), [("eradiate", ".yml"), ("libradtran", ".dat")])
def test_other_models_are_refused_with_the_remedy(name, why, to, suffix, tmp_path):
    weight = catalogue[name].weights[0]
    with pytest.raises(ValueError, match="--model rpv") as refused:
        write(case(name, **{weight: 1.0}), tmp_path / f"g{suffix}", to)
    assert to == "libradtran" or why in str(refused.value)


def rows(path):
    return [[float(v) for v in line.split()] for line in path.read_text().splitlines() if not line.startswith("#")]


def rpv_of_libradtran(g, rho0, k, theta, scale):
    """The formula of libRadtran (cdisort, bidir_reflectivity_rpv), as a BRDF: its rho0 makes the hot spot too."""
    cos_g = g.x_i * g.x_r + g.y_i * g.y_r + g.z_i * g.z_r
    tan_i, tan_r = (np.hypot(x, y) / z for x, y, z in ((g.x_i, g.y_i, g.z_i), (g.x_r, g.y_r, g.z_r)))
    cos_phi = (g.x_i * g.x_r + g.y_i * g.y_r) / np.maximum(np.hypot(g.x_i, g.y_i) * np.hypot(g.x_r, g.y_r), 1e-300)
    distance = np.sqrt(np.maximum(tan_i**2 + tan_r**2 - 2 * tan_i * tan_r * cos_phi, 0))
    m = (g.z_i * g.z_r * (g.z_i + g.z_r)) ** (k - 1)
    f = (1 - theta**2) / (1 + 2 * theta * cos_g + theta**2) ** 1.5
    return scale * rho0 * m * f * (1 + (1 - rho0) / (1 + distance)) / math.pi


def upper(least=0.02):
    g = pairs()
    return Geometry(*(c[np.minimum(g.z_i, g.z_r) > least] for c in g))


def test_libradtran_has_the_hot_spot_from_rho0_and_a_scale(tmp_path):
    subject = case("rpv", **RPV)
    found = rows(written(subject, tmp_path / "g.dat", "libradtran").files[0])
    assert [row[0] for row in found] == [100.0, 100_000.0]
    expected = subject.brdf(upper())
    for row in found:
        # cos(phi) by a quotient moves the square of the distance by 1e-16 at the hot spot, where its root counts
        np.testing.assert_allclose(rpv_of_libradtran(upper(), *row[1:]), expected, rtol=1e-6)


def test_libradtran_has_a_row_for_each_wavelength(tmp_path):
    subject = spectral("ross-li", fiso=(0.3, 0.1, 0.2), fvol=(0.03, 0.01, 0.02), fgeo=(0.003, 0.001, 0.002))
    done = written(subject, tmp_path / "g.dat", "libradtran")
    assert rows(done.files[0]) == [[550, 0.1, 0.01, 0.001], [865, 0.2, 0.02, 0.002], [1240, 0.3, 0.03, 0.003]]
    assert "brdf_ambrals_file g.dat" in done.files[0].read_text()


def test_a_lambertian_of_a_half_is_the_isotropic_kernel_of_libradtran(tmp_path):
    done = written(case("lambert", rho=0.5), tmp_path / "g.dat", "libradtran")
    assert [row[1:] for row in rows(done.files[0])] == [[0.5, 0.0, 0.0]] * 2
    assert "brdf_ambrals_file" in done.files[0].read_text()


def test_libradtran_cannot_do_without_rho0(tmp_path):
    with pytest.raises(ValueError, match="--hold rc="):
        write(case("rpv", **RPV | {"rc": 0.0}), tmp_path / "g.dat", "libradtran")


def test_channels_have_no_wavelength(tmp_path):
    sets = {c: dict(case("rpv", **RPV).values) for c in "RGB"}
    for to, name in (("libradtran", "g.dat"), ("eradiate", "g.yml"), ("py6s", "g.py")):
        with pytest.raises(ValueError, match="--select channel=VALUE"):
            write(Subject(catalogue["rpv"], sets, "channel"), tmp_path / name, to)


def hapke_of_6s(g, om, af, s0, h):
    """The factor of 6S's hapkbrdf: one lobe, and a surge that is stated over om P(0)."""
    cos_g = np.clip(g.x_i * g.x_r + g.y_i * g.y_r + g.z_i * g.z_r, -1, 1)
    phase = [(1 - af**2) / (1 + af**2 + 2 * af * c) ** 1.5 for c in (cos_g, 1.0)]
    surge = s0 / (om * phase[1]) / (1 + np.tan(np.arccos(cos_g) / 2) / h)
    h_i, h_r = ((1 + 2 * z) / (1 + 2 * math.sqrt(1 - om) * z) for z in (g.z_i, g.z_r))
    return om / 4 / (g.z_i + g.z_r) * ((1 + surge) * phase[0] + h_i * h_r - 1)


def minnaert_of_6s(g, k, albedo):
    return 0.5 * albedo * (k + 1) * (g.z_i * g.z_r) ** (k - 1)


def rahman_of_6s(g, rho0, af, k):
    return math.pi * rpv_of_libradtran(g, rho0, k, af, 1.0)


@pytest.mark.parametrize(
    ("subject", "method", "factor"),
    [
        (case("minnaert", rho=0.4, k=0.7), "HomogeneousMinnaert", minnaert_of_6s),
        (case("rpv", **RPV | {"rc": 0.2}), "HomogeneousRahman", rahman_of_6s),
        (case("hapke", scale=1.0, w=0.7, c=1.0, b=0.3), "HomogeneousHapke", hapke_of_6s),
        (case("hapke", scale=1.0, w=0.7, c=-1.0, b=0.3), "HomogeneousHapke", hapke_of_6s),
        (case("lambert", rho=0.5), "HomogeneousLambertian", lambda g, rho: rho + 0 * g.z_i),
    ],
)
def test_6s_has_the_model_itself_as_a_reflectance_factor(subject, method, factor, tmp_path):
    path = written(subject, tmp_path / "g.py", "py6s").files[0]
    name, numbers = loaded(path)["ground"]
    assert name == method
    expected = math.pi * np.asarray(subject.brdf(upper()))
    np.testing.assert_allclose(factor(upper(), *numbers), expected, rtol=1e-6)


def test_6s_gets_the_weights_of_the_modis_kernels_in_their_order(tmp_path):
    path = written(case("ross-li", **ROSS_LI), tmp_path / "g.py", "py6s").files[0]
    assert loaded(path)["ground"] == ("HomogeneousMODISBRDF", (0.3, 0.1, 0.02))


@pytest.mark.parametrize(
    "subject",
    [case("rpv", **RPV), case("oren-nayar", scale=0.4), case("hapke", scale=0.9), case("modified-phong", rho_d=0.4)],
    ids=lambda s: s.model.name,
)
def test_tables_for_6s_are_factors_at_its_angles(subject, tmp_path):
    done = written(subject, tmp_path / "g.py", "py6s")
    method, (observed, albedo, of_sun, of_view) = loaded(done.files[0])["ground"](30.0, 10.0, 50.0, 100.0)
    assert method == "HomogeneousUserDefined"
    assert of_sun.shape == of_view.shape == (13, 10)  # a line for each azimuth, as 6S reads it

    def factor(theta_i, theta_r, phi):
        return math.pi * float(subject.brdf(Geometry.from_degrees(theta_i, theta_r, phi)))

    assert observed == pytest.approx(factor(30.0, 50.0, 90.0))
    assert of_sun[2, 7] == pytest.approx(factor(30.0, ZENITHS[7], AZIMUTHS[2]))
    assert of_view[7, 9] == pytest.approx(factor(50.0, 85.0, 210.0))
    assert albedo == pytest.approx(bihemispherical_reflectance(lambda g: np.asarray(subject.brdf(g))))
    assert done.numbers["table_error"] < 0.1


def test_a_narrow_lobe_is_refused_or_allowed_at_its_error(tmp_path):
    subject = case("ggx", rho_s=0.5, width=0.1)
    with pytest.raises(ValueError, match="--worst"):
        write(subject, tmp_path / "g.py", "py6s")
    done = write(subject, tmp_path / "g.py", "py6s", worst=1e9)
    assert done.numbers["table_error"] > 0.1


def test_6s_takes_no_surface_that_has_a_direction_or_reflects_more_than_arrives(tmp_path):
    with pytest.raises(ValueError, match="direction of its own"):
        write(case("ward", rho_s=0.3, alpha_x=0.5, alpha_y=0.4), tmp_path / "g.py", "py6s")
    with pytest.raises(ValueError, match="check the scale"):
        write(case("oren-nayar", scale=9.0), tmp_path / "g.py", "py6s")


def test_a_fit_over_wavelengths_goes_through(tmp_path):
    import xarray as xr

    scans = [
        simulate(catalogue["ross-li"], ROSS_LI | {"fiso": f}, [20.0, 50.0], np.arange(-60, 61, 10.0)).assign_coords(
            wavelength=w
        )
        for w, f in ((550.0, 0.1), (865.0, 0.4))
    ]
    solution = fit(xr.concat(scans, dim="wavelength"), "ross-li", weighting="uniform")
    done = export(solution, tmp_path / "g.dat", to="libradtran")
    assert [row[:2] for row in rows(done.files[0])] == [[550.0, pytest.approx(0.1)], [865.0, pytest.approx(0.4)]]
    assert done.prove().holds


def test_hostile_text_stays_a_comment(tmp_path):
    subject = case("rpv", **RPV | {"rc": 0.2})
    hostile = Subject(subject.model, subject.sets, origin='"""\nimport os\ntype: black\n100 9 9 9 9')
    for to, name in (("libradtran", "g.dat"), ("eradiate", "g.yml"), ("eradiate", "h.py"), ("py6s", "g.py")):
        done = write(hostile, tmp_path / name, to, "ground", force=True)
        assert done.prove().holds
        assert "import os" not in done.files[0].read_text().splitlines()

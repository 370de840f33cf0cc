"""The simulated bench against numbers that others computed, and against what gonio makes of its readings."""

import numpy as np
import pytest

from gonio import catalogue
from gonio.acquisition import Conditions, grid, readings
from gonio.acquisition.simulated import STEADY, Diffuse, Electronics, Laser, Mirror, Optics, SimulatedBench, kappa
from gonio.acquisition.simulated.light import Light, speckles
from gonio.geometry import Geometry
from simulated_benches import VALUES, bench, coating, measure

QUIET = Electronics(
    ranges=(1.0,), bandwidth=0.0, rin=0.0, dark=0.0, dark_slope=0.0, dark_noise=0.0, offset=0.0, bits=90
)


@pytest.mark.parametrize(
    ("beam", "view", "theta_i", "theta_r", "expected"),
    [
        (2, 3, 0, 0, 0.988891),
        (2, 3, 40, 40, 0.988891),
        (2, 3, 60, 0, 0.835082),
        (2, 3, 75, 0, 0.532040),
        (4, 3, 0, 0, 0.675348),
        (4, 3, 40, 40, 0.675348),
        (4, 3, 60, 0, 0.408974),
        (4, 3, 75, 0, 0.223270),
        (1, 5, 75, 0, 0.989967),
        (1, np.inf, 75, 0, 1.0),
    ],
)
def test_the_part_of_a_beam_in_the_field_of_view(beam, view, theta_i, theta_r, expected):
    assert kappa(theta_i, theta_r, beam, view) == pytest.approx(expected, abs=6e-7)


def test_a_wide_beam_is_seen_by_the_cosines():
    """The limit is 2 r_v^2 cos(theta_i) / (w^2 cos(theta_r)) for a beam much wider than the field of view."""
    expected = 2 / 1000**2 * np.cos(np.radians(60)) / np.cos(np.radians(20))
    assert kappa(60, 20, 1000.0, 1.0) == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("radius", "distance", "expected"),
    [(12.5, 300, 5.447062409e-3), (25, 100, 0.1876002044), (4.75, 500, 2.835095471e-4)],
)
def test_the_solid_angle_is_exact(radius, distance, expected):
    assert Optics(aperture_radius=radius, distance=distance).solid_angle == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(("spot", "contrast"), [(1, 0.0424), (3, 0.0141)])
def test_the_contrast_of_speckle(spot, contrast):
    count = speckles(spot, 9.5, 500, 632.8)
    assert count**-0.5 == pytest.approx(contrast, abs=6e-5)
    assert (2 * count) ** -0.5 == pytest.approx(contrast / 2**0.5, abs=6e-5)


def test_speckle_is_frozen():
    """The same place from the same direction is the same; others scatter by the contrast."""
    light = Light(Optics(speckle=True, beam_radius=0.5), {"sample": Diffuse(0.5)}, seed=3)
    plain = Light(Optics(beam_radius=0.5), {"sample": Diffuse(0.5)})
    angles = np.linspace(20, 140, 400)
    ratios = np.array([light.part("sample", 30, a) / plain.part("sample", 30, a) for a in angles if abs(a - 30) < 89])
    again = np.array([light.part("sample", 30, a) / plain.part("sample", 30, a) for a in angles if abs(a - 30) < 89])
    assert (ratios == again).all()
    assert ratios.mean() == pytest.approx(1, abs=3 * 0.0424 / len(ratios) ** 0.5)
    assert ratios.std() == pytest.approx(0.0424, rel=0.15)  # of 340 values the standard deviation is known to 4 %


def test_a_quiet_bench_shows_the_equation(tmp_path):
    """P = Phi Omega cos(theta_r) f, on both sides of the normal; the mirror direction is at +theta_i."""
    on = coating(laser=STEADY, electronics=QUIET, optics=Optics(background=0.0, arm_half_width=0, aperture_radius=0.01))
    measure(tmp_path / "run.jsonl", on, grid([30], range(-80, 81, 10), conditions=Conditions(dwell=0.1)))
    raw = readings(tmp_path / "run.jsonl")
    raw = raw.isel(reading=raw["kind"].values == "sample")
    angles = [raw[name].values for name in ("theta_i", "theta_r", "phi")]
    f = catalogue["ggx"](Geometry.from_degrees(*angles), VALUES)
    expected = 1e-3 * Optics(aperture_radius=0.01).solid_angle * np.cos(np.radians(angles[1])) * f
    np.testing.assert_allclose(raw["signal"].values, expected, rtol=1e-6)
    signed = np.where(angles[2] == 180, angles[1], -angles[1])
    assert signed[np.argmax(raw["signal"].values)] == pytest.approx(30, abs=0.01)


@pytest.mark.parametrize("cosine", ["theta_r", "theta_i"])
def test_under_and_over_filled_benches_need_their_own_cosine(tmp_path, cosine):
    """One f of both; with the other's equation they differ by cos(theta_i)/cos(theta_r)."""
    optics = {
        "theta_r": Optics(arm_half_width=0, background=0.0),
        "theta_i": Optics(arm_half_width=0, background=0.0, beam_radius=3000.0, view_radius=1.0),
    }[cosine]
    on = bench(laser=STEADY, electronics=QUIET, optics=optics)
    measure(tmp_path / "run.jsonl", on, grid([10, 60], [0, 20, 70], conditions=Conditions(dwell=0.1)))
    raw = readings(tmp_path / "run.jsonl")
    raw = raw.isel(reading=raw["kind"].values == "sample")
    f = raw["signal"].values / np.cos(np.radians(raw[cosine].values))
    np.testing.assert_allclose(f, f[0], rtol=2e-5)
    other = {"theta_i": "theta_r", "theta_r": "theta_i"}[cosine]
    wrong = raw["signal"].values / np.cos(np.radians(raw[other].values))
    assert wrong.max() / wrong.min() > 2


def test_the_arm_hides_the_beam_near_the_source():
    light = Light(Optics(beam_radius=1.0, arm_half_width=20), {"sample": Diffuse(0.5)})
    hidden = np.degrees(np.arcsin(20 / 500))
    assert light.part("sample", 30, 0.0) == 0
    assert light.part("sample", 30, hidden - 0.3) == 0
    full = light.part("sample", 30, hidden + 0.3) / np.cos(np.radians(hidden + 0.3 - 30))
    half = light.part("sample", 30, hidden) / np.cos(np.radians(hidden - 30))
    assert half / full == pytest.approx(0.5, rel=1e-6)


def test_a_mirror_reflects_by_fresnel():
    """Of n = 1.37, k = 7.62: the part of the power at the mirror angle is R_s, and nothing beside it."""
    light = Light(Optics(), {"sample": Mirror(1.37, 7.62, "s")})
    n = 1.37 + 7.62j
    cos_i = np.cos(np.radians(60))
    cos_t = np.sqrt(1 - (np.sin(np.radians(60)) / n) ** 2)
    r_s = abs((cos_i - n * cos_t) / (cos_i + n * cos_t)) ** 2
    assert light.part("sample", 60, 120) == pytest.approx(r_s, rel=1e-9)
    assert light.part("sample", 60, 110) < 1e-12


def test_stray_light_and_the_halo():
    """It is s = Omega (stray + halo exp(-angle/width)) about the direct beam, with the sample away."""
    light = Light(Optics(stray=1e-5, halo=0.1, halo_width=2.0), {"none": None})
    omega = Optics().solid_angle
    assert light.part("none", 0, 170) == pytest.approx(omega * (1e-5 + 0.1 * np.exp(-5)), rel=1e-6)
    assert light.part("none", 0, 180, 1e-3) == pytest.approx(1e-3, rel=1e-4)


def test_the_part_of_a_beam_in_the_aperture():
    """On the axis 1 - exp(-2 r^2/w^2); a beam whose middle is at the edge of a much larger aperture is half in it."""
    light = Light(Optics(beam_radius=4.0), {"none": None})
    assert light.part("none", 0, 180) == pytest.approx(1 - np.exp(-2 * 4.75**2 / 16), rel=1e-9)
    narrow = Light(Optics(beam_radius=0.02), {"none": None})
    edge = np.degrees(np.arctan(4.75 / 500))
    assert narrow.part("none", 0, 180 - edge) == pytest.approx(0.5, abs=0.002)
    assert narrow.part("none", 0, 180) == pytest.approx(1, rel=1e-12)


def test_the_monitor_follows_the_laser(tmp_path):
    """A warm-up of 2 % dies away in 20 minutes; the ratio to the monitor does not show it."""
    on = bench(laser=Laser(warm_up=0.02, noise=0.0), electronics=QUIET)
    measure(tmp_path / "run.jsonl", on, grid([30], [0] * 30, conditions=Conditions(dwell=60)))
    raw = readings(tmp_path / "run.jsonl")
    raw = raw.isel(reading=raw["kind"].values == "sample")
    signal, monitor = raw["signal"].values, raw["monitor"].values
    assert signal[0] / signal[-1] > 1.01
    np.testing.assert_allclose(signal / monitor, (signal / monitor)[0], rtol=2e-5)


def test_noise_is_that_of_the_formula():
    """2 e B i + 4 k T B / R_f + (RIN i)^2 + ADC step^2/12, in the unit of the signal."""
    electronics = Electronics(ranges=(1e-7,), rin=1e-4, dark_noise=0.0)
    on = bench(laser=STEADY, electronics=electronics)
    on.shutter.open()
    on.stage.arm.true = 60.0
    on.stage.table.true = 20.0
    read = [on.detector.read(1.0) for _ in range(300)]
    i = 0.4 * read[0].value
    resistor = 2.0 / (0.4 * 1e-7)
    shot, thermal = 2 * 1.602e-19 * 15 * i, 4 * 1.381e-23 * 298.15 * 15 / resistor
    expected = (shot + thermal + (1e-4 * i) ** 2) / 0.4**2 + (1e-7 / 2**16) ** 2 / 12
    assert np.mean([r.sd**2 for r in read]) == pytest.approx(expected, rel=0.05)  # 300 x 32 degrees of freedom: 1.4 %
    spread = np.std([r.value for r in read], ddof=1)
    assert spread == pytest.approx((expected / read[0].samples) ** 0.5, rel=0.15)  # of 300 values: 4 %


def test_one_seed_is_one_measurement(tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        measure(tmp_path / name, bench(seed=seed))
    a, b, c = ((tmp_path / name).read_bytes() for name in "abc")
    assert a == b
    assert a != c


def test_values_may_change_with_the_incidence_angle():
    on = SimulatedBench(catalogue["lambert"], {"rho": {20.0: 0.1, 40.0: 0.2}})
    parts = [on.light.part("sample", t, t) for t in (20.0, 40.0)]
    assert parts[1] / parts[0] == pytest.approx(2, rel=1e-6)


def test_values_that_the_model_has_not_are_refused_at_once():
    with pytest.raises(ValueError, match="lambert has no parameter 'rho_d'"):
        SimulatedBench(catalogue["lambert"], {"rho_d": 0.1})

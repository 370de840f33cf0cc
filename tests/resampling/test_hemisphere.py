"""The directional-hemispherical reflectance of tables: closed forms, formats, sums of both modes, and a stated TIS."""

import numpy as np
import pytest
import xarray as xr

from gonio import catalogue, convert, read, write
from gonio.app.views.file import describe
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.plausibility import hemispherical_reflectance, of_scan
from gonio.resampling.hemisphere import contradictions, excessive, reflectances
from gonio.resampling.resample import Filling


def table(value, theta_i=(0.0, 30.0, 60.0), last=90.0, step=15.0, **more):
    """A function of the directions on a spherical grid, as a flat scan."""
    t_i, t_r, phi = (
        v.ravel() for v in np.meshgrid(theta_i, np.arange(0, last + 1, 5.0), np.arange(0, 360, step), indexing="ij")
    )
    return make_scan(t_i, t_r, value(Geometry.from_degrees(t_i, t_r, phi)), phi, **more)


def lambert(rho):
    return lambda g: rho / np.pi + 0 * g.z_r


def test_a_constant_has_its_albedo():
    found = reflectances(table(lambert(0.5)))
    assert [one.theta_i for one in found] == [0, 30, 60]
    assert [one.value for one in found] == pytest.approx([0.5] * 3, rel=2e-3)  # a polygon of 24 corners is no circle
    assert excessive(found) is None
    energy = of_scan(table(lambert(0.5)))[2]
    assert energy.holds is True
    assert energy.figures == {f"DHR({one.theta_i:g})": one.value for one in found}


def test_more_than_all_the_light_is_violated_and_said(tmp_path):
    scan = table(lambert(1.5))
    energy = of_scan(scan)[2]
    assert energy.holds is False
    assert list(energy.figures.values()) == pytest.approx([1.5] * 3, rel=2e-3)
    write(scan, tmp_path / "bright.csv")
    (finding,) = [f for f in describe(tmp_path / "bright.csv")["checks"] if "light" in f["what"]]
    assert finding["severity"] == "warning"
    assert "150 % of the light" in finding["what"]


def test_a_part_of_the_hemisphere_is_a_lower_bound():
    """theta_r to 45 deg holds sin^2(45), a half of the light: of a Lambertian of albedo 1 0.5, of one of 2.5 1.25."""
    (one,) = reflectances(table(lambert(1.0), theta_i=(20.0,), last=45))
    assert one.value == pytest.approx(0.5, rel=0.02)
    assert one.covered == pytest.approx(0.5, rel=0.02)
    assert of_scan(table(lambert(1.0), last=45))[2].holds is None
    assert "cover 4" in of_scan(table(lambert(1.0), last=45))[2].why
    assert of_scan(table(lambert(2.5), last=45))[2].holds is False


@pytest.mark.parametrize("width", [0.3, 0.1])
def test_a_lobe_has_the_reflectance_of_its_model(width):
    """A table of 2.5 deg about a lobe of that slope or more: chords of its interpolation leave a percent or two."""
    values = {"rho_s": 0.6, "rho_d": 0.1, "width": width}
    model = catalogue["ggx"]
    t_r, phi = (v.ravel() for v in np.meshgrid(np.arange(0, 90.1, 2.5), np.arange(0, 360, 5.0), indexing="ij"))
    for theta_i in (0.0, 40.0):
        f = model(Geometry.from_degrees(np.full(len(phi), theta_i), t_r, phi), values)
        (one,) = reflectances(make_scan(np.full(len(phi), theta_i), t_r, f, phi))
        assert one.value == pytest.approx(hemispherical_reflectance(lambda g: model(g, values), theta_i), rel=0.03)


def test_what_has_no_reflectance():
    assert reflectances(table(lambert(0.5), unit="a.u.")) == []
    assert reflectances(make_scan([30.0] * 9, np.linspace(-80, 80, 9), np.ones(9))) == []  # one plane
    assert (
        "says nothing about the hemisphere"
        in of_scan(make_scan([30.0] * 9, np.linspace(-80, 80, 9), np.ones(9)))[2].why
    )


def test_reflection_and_transmission_of_one_side_share_the_light():
    count = table(lambert(0.6)).sizes["direction"]
    parts = [
        table(lambert(0.6), coordinates={"mode": [mode] * count, "side": ["front"] * count})
        for mode in ("reflection", "transmission")
    ]
    worst = excessive(reflectances(xr.concat(parts, dim="direction")))
    assert worst is not None
    assert worst.labels["mode"] == "both"
    assert worst.value == pytest.approx(1.2, rel=2e-3)


@pytest.mark.parametrize("kind", ["zemax", "lighttools", "speos-brdf", "rgl", "radiance", "integra", "ssdd"])
def test_a_file_that_would_shine_is_refused_unless_forced(kind, tmp_path):
    filling = Filling((), lambda p: np.full(p.sizes["direction"], 1.5 / np.pi), "a constant")
    scan = table(lambert(1.5))
    with pytest.raises(
        ValueError, match=r"would scatter 1\d\d.* % of the light that falls on it, .* --force writes it"
    ):
        convert(scan, tmp_path / "x", kind, filling=filling)
    assert not (tmp_path / "x").exists()
    done = convert(scan, tmp_path / "x", kind, filling=filling, force=True)
    worst = excessive(done.reflectances)
    assert worst is not None
    assert worst.value == pytest.approx(1.5, rel=5e-3)
    assert max(one.value for one in reflectances(read(tmp_path / "x"))) == pytest.approx(1.5, rel=5e-3)
    third = Filling((), lambda p: np.full(p.sizes["direction"], 0.5 / np.pi), "a constant")
    assert convert(table(lambert(0.5)), tmp_path / "third", kind, filling=third).path.exists()


def test_a_tis_that_is_not_that_of_the_table_is_said(tmp_path):
    scan = table(lambert(0.3))
    filling = Filling((), lambda p: np.full(p.sizes["direction"], 0.3 / np.pi), "a constant")
    convert(scan, tmp_path / "x.bsdf", "zemax", filling=filling)
    honest = read(tmp_path / "x.bsdf")
    assert contradictions(honest, reflectances(honest)) == []
    for factor in (33.0, 0.1):
        wrong = honest.assign(tis=honest["tis"] * factor)
        one = contradictions(wrong, reflectances(wrong))[0]
        assert one.stated == pytest.approx(0.3 * factor, rel=0.02)
        assert one.table.value == pytest.approx(0.3, rel=0.01)
    text = (tmp_path / "x.bsdf").read_text()
    lines = [f"TIS {33 * float(line.split()[1])}" if line.startswith("TIS") else line for line in text.splitlines()]
    (tmp_path / "wrong.bsdf").write_text("\n".join(lines) + "\n")
    (finding,) = [f for f in describe(tmp_path / "wrong.bsdf")["checks"] if "TIS" in f["what"]]
    assert "states a TIS of 9.9" in finding["what"]

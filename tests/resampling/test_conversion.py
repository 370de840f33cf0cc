"""Conversion: what a format cannot hold is left out with a word or refused, and the error is stated."""

import numpy as np
import pytest
import xarray as xr

from gonio import convert, read
from gonio.formats import formats
from gonio.measured import dataset
from gonio.measured.dataset import make_scan
from gonio.resampling.conversion import in_words
from gonio.resampling.difference import difference
from gonio.resampling.resample import Filling


def scan(**more):
    theta_i, theta_r, phi = (
        a.ravel() for a in np.meshgrid([10.0, 40], np.arange(0, 81, 10.0), np.arange(0, 360, 30.0))
    )
    return make_scan(theta_i, theta_r, (0.1 + np.cos(np.radians(theta_r)) ** 2) / 8, phi, **more)


def test_a_grid_target_says_what_it_cost(tmp_path):
    filling = Filling(("bilateral",), lambda p: np.full(p.sizes["direction"], 0.1 / 8), "a constant")
    done = convert(scan(), tmp_path / "x.bsdf", "zemax", filling=filling)
    history = done.scan.attrs["history"]
    assert "filled by a constant, not measured" in history
    assert "laid out as Zemax BSDF stores it: rms error" in history
    # cos^2 at steps of 10 deg bends by (pi/18)^2/4 = 0.8 % between nodes, and chords between azimuths of 30 deg run
    # 1 - cos 15 deg = 3.4 % nearer to the normal than their ends, where cos^2 falls by up to 1/rad: 2 % at theta_r 45.
    assert 0 < done.error.rms < 0.03
    again = difference(read(tmp_path / "x.bsdf"), scan())
    assert again.rms == pytest.approx(done.error.rms)
    assert in_words(again) == in_words(done.error)


def test_gaps_are_refused_with_the_remedy_and_nothing_is_written(tmp_path):
    in_plane = make_scan(np.repeat([10.0, 30], 9), np.tile(np.arange(-80, 81, 20.0), 2), np.ones(18))
    with pytest.raises(
        ValueError,
        match=r"Integra diffuse table stores a full grid, and .* lie outside the data: fill them with --fill",
    ):
        convert(in_plane, tmp_path / "x", "integra")
    assert not list(tmp_path.iterdir())


def test_what_is_left_out_is_said(tmp_path):
    full = scan(
        uncertainty=np.full(216, 0.01),
        coordinates={"wavelength": np.full(216, 650.0), "side": np.full(216, "front")},
        variables={"mask": (np.r_[1, np.zeros(215)].astype(np.int8), "1")},
    )
    done = convert(full, tmp_path / "x.txt", "fred")
    assert set(done.left_out) == {
        "wavelength 650.0",
        "side front",
        "the mask: 1 masked values became gaps",
        "uncertainty",
    }
    assert "left out for FRED" in done.scan.attrs["history"]
    assert "left out 1 directions without a value" in done.scan.attrs["history"]
    assert done.error.rms == 0
    assert done.error.count == 215


@pytest.mark.parametrize(
    ("more", "target", "message"),
    [
        ({"unit": "a.u."}, "fred", "relative .* cannot say so: calibrate them, or write .*tidy-csv"),
        (
            {"coordinates": {"wavelength": np.repeat([500.0, 600.0], 108)}},
            "fred",
            "one wavelength and the data have 2: choose with --select wavelength=500",
        ),
        (
            {"coordinates": {"mode": np.full(216, "transmission")}},
            "fred",
            "are of transmission, and FRED .* holds reflection alone",
        ),
        (
            {"phi_i": np.repeat([0.0, 45.0], 108)},
            "fred",
            "turned to 2 azimuths, .* isotropic one: choose with --select phi_i=0",
        ),
    ],
)
def test_what_would_lie_is_refused(tmp_path, more, target, message):
    with pytest.raises(ValueError, match=message):
        convert(scan(**more), tmp_path / "x", target)
    assert not (tmp_path / "x").exists()


def test_reflection_is_taken_where_transmission_cannot_be(tmp_path):
    both = scan(coordinates={"mode": np.repeat(["reflection", "transmission"], 108)})
    done = convert(both, tmp_path / "x", "fred")
    assert done.left_out == ("transmission", "mode reflection")
    assert done.error.count == 108


def test_imposed_symmetry_is_written_and_its_cost_stated(tmp_path):
    lopsided = scan()
    lopsided["brdf"] = lopsided["brdf"] * (1 + 0.1 * np.sin(np.radians(lopsided["phi"])))
    lopsided["brdf"].attrs["units"] = "sr-1"
    done = convert(lopsided, tmp_path / "x.csv", impose=("bilateral",))
    found = dataset.flatten(read(done.path))
    mirrored = found["brdf"].values.reshape(9, 2, 12)[..., 1:][..., ::-1]
    np.testing.assert_allclose(found["brdf"].values.reshape(9, 2, 12)[..., 1:], mirrored, rtol=1e-12)
    assert done.error.rms == pytest.approx(0.1 * np.sqrt(0.5), rel=0.02)  # the rms of the sine


def test_a_model_fills_only_gaps_and_is_flagged(tmp_path):
    holey = scan()
    holey["brdf"] = holey["brdf"].where((holey["theta_r"] < 45) | (holey["phi"] < 100)).assign_attrs(units="sr-1")
    done = convert(holey, tmp_path / "x.csv", filling=Filling((), lambda p: np.full(p.sizes["direction"], 5.0), "five"))
    found = read(done.path)
    assert set(np.unique(found["origin"])) == {1.0, 4.0}
    assert (found["brdf"].values[found["origin"].values == 4] == 5).all()
    assert done.error.rms == 0


FILLED = Filling(("bilateral",), lambda p: np.full(p.sizes["direction"], 0.1), "a constant")
RESTRICTED = [
    f for f in formats().values()
    if f.write and f.holds.channels and not f.holds.quantity and f.name != "merl"  # 33 MB: a case of its own
]  # fmt: skip


def coloured(names):
    """One scan in each channel, as many times the same as the place of its name."""
    one = scan()
    parts = [
        one.assign(brdf=one["brdf"] * (k + 1.0)).assign_coords(
            channel=("direction", np.full(one.sizes["direction"], name))
        )
        for k, name in enumerate(names)
    ]
    joined = xr.concat(parts, dim="direction")
    joined["brdf"].attrs["units"] = "sr-1"
    return joined


@pytest.mark.parametrize("kind", RESTRICTED, ids=lambda f: f.name)
def test_channels_go_by_name_in_any_order_and_one_alone_is_monochrome(kind, tmp_path):
    group = kind.holds.channels[0]
    turned = coloured(group[::-1])
    if kind.name.endswith("transmission"):
        turned = turned.assign_coords(mode=("direction", np.full(turned.sizes["direction"], "transmission")))
    done = convert(turned, tmp_path / "three", kind.name, filling=FILLED)
    again = read(done.path)
    assert again["channel"].values.tolist() == list(group)
    levels = [float(again["brdf"].sel(channel=name).max()) for name in group]
    np.testing.assert_allclose(np.array(levels) / levels[-1], [3, 2, 1], rtol=1e-3)
    one = turned.isel(direction=np.flatnonzero(turned["channel"] == group[0]))
    named = one.assign_coords(channel=("direction", np.full(one.sizes["direction"], "vis")))
    alone = convert(named, tmp_path / "one", kind.name, filling=FILLED)
    assert "channel vis" in alone.left_out
    two = turned.isel(direction=np.flatnonzero(turned["channel"] != group[0]))
    with pytest.raises(ValueError, match=f"holds the channels {group[0]}, .* choose one with --select channel="):
        convert(two, tmp_path / "two", kind.name, filling=FILLED)

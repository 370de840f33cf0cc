"""Six scans that gonio writes as Klems XML for Radiance and WINDOW, and their direct-hemispherical values by gonio.

    python tests/crosscheck/klems_files.py FOLDER     writes NAME.xml and gonio.json, for klems_peer.py

Three are measured and lie beside the project; without them the rest is written. Three are of a formula f that is
bilinear in the directions w_i and w_r (n the normal, u a direction in the plane of the surface),

    f = k (1 + a (w_i n)(w_r n) - b (w_i w_r - (w_i n)(w_r n)) + c (w_i u + w_r u)),

so that its means over patches, and the reflectance of a patch, are known in closed form. `c` makes the surface
anisotropic, without mirror symmetry: a turned or mirrored basis is seen in each patch.
"""

import json
import sys
from pathlib import Path
from unittest import mock

import numpy as np

from gonio import read, write
from gonio.app.cli import main as gonio
from gonio.formats.radiance import klems, window
from gonio.measured.dataset import make_scan

BASIS = klems.FULL
SHARED = Path(__file__).resolve().parents[3] / "shared" / "data"
LOW, HIGH = (np.repeat(np.radians(b), BASIS.counts) for b in (BASIS.bounds[:-1], BASIS.bounds[1:]))
COUNT = np.repeat(BASIS.counts, BASIS.counts)
AZIMUTH = np.concatenate([360 * np.arange(n) / n for n in BASIS.counts])  # to which the light of a patch travels [deg]
PROJECTED = np.pi * (np.sin(HIGH) ** 2 - np.sin(LOW) ** 2) / COUNT  # the integral of the cosine over each patch [sr]
MEAN_COSINE = 2 / 3 * (np.cos(LOW) ** 3 - np.cos(HIGH) ** 3) / (np.sin(HIGH) ** 2 - np.sin(LOW) ** 2)
MEAN_SINE = 2 / 3 * (np.sin(HIGH) ** 3 - np.sin(LOW) ** 3) / (np.sin(HIGH) ** 2 - np.sin(LOW) ** 2)
MEAN_SINE = MEAN_SINE * np.where(
    COUNT == 1, 0.0, np.sinc(1 / COUNT)
)  # the mean of the cosine over the patch's azimuths
ISOTROPIC = {"k": 0.12, "a": 0.3, "b": 0.25, "c": 0.0, "u": 0.0}
BLOCKS = {
    ("Visible", "reflection", "front"): {"k": 0.05, "a": 0.5, "b": 0.3, "c": 0.4, "u": 20.0},
    ("Visible", "reflection", "back"): {"k": 0.08, "a": -0.3, "b": 0.2, "c": 0.3, "u": 110.0},
    ("Visible", "transmission", "front"): {"k": 0.10, "a": 0.2, "b": -0.4, "c": 0.35, "u": 200.0},
    ("Visible", "transmission", "back"): {"k": 0.12, "a": 0.4, "b": -0.3, "c": 0.25, "u": 290.0},
    ("Solar", "reflection", "front"): {"k": 0.07, "a": 0.1, "b": 0.1, "c": 0.3, "u": 65.0},
    ("Solar", "reflection", "back"): {"k": 0.04, "a": 0.3, "b": 0.2, "c": 0.45, "u": 155.0},
    ("Solar", "transmission", "front"): {"k": 0.06, "a": -0.2, "b": -0.3, "c": 0.2, "u": 245.0},
    ("Solar", "transmission", "back"): {"k": 0.09, "a": 0.25, "b": -0.2, "c": 0.4, "u": 335.0},
}


def formula(cosines, products, along, k, a, b, c):
    """The value from the products of the cosines and of w_i w_r in the surface's plane, and the sum of both along u."""
    return k * (1 + a * cosines - b * products + c * along)


def grid(path, wavelengths, mode):
    """A scan in CSV on a grid of angles, of 1, 1/2 and 1/4 of the formula at its wavelengths [nm]."""
    angles = np.meshgrid(np.arange(0, 91, 10.0), np.arange(0, 91, 5.0), np.arange(0, 360, 15.0), indexing="ij")
    theta_i, theta_r, phi = (v.ravel() for v in angles)
    cos_i, cos_r, sin_i, sin_r = (f(np.radians(v)) for f in (np.cos, np.sin) for v in (theta_i, theta_r))
    shape = {n: ISOTROPIC[n] for n in "kabc"}
    values = formula(cos_i * cos_r, sin_i * sin_r * np.cos(np.radians(phi)), 0.0, **shape)
    many = len(wavelengths)
    scan = make_scan(
        np.tile(theta_i, many),
        np.tile(theta_r, many),
        np.concatenate([values / 2**n for n in range(many)]),
        np.tile(phi, many),
        coordinates={"wavelength": np.repeat(wavelengths, len(values)), "mode": np.full(many * len(values), mode)},
    )
    write(scan, path, force=True)


def patches(path):
    """The means of the formula over all pairs of patches, for each of BLOCKS, as gonio's own NetCDF."""
    layout = window.patches(BASIS, BASIS)
    phi_i, phi_r = (
        np.radians(layout["phi_i"].values),
        np.radians(layout["phi_i"].values[:, None] + layout["phi"].values),
    )
    phi_r = phi_r[0]  # a patch is one place, whatever patch the light comes from
    x_i, y_i, x_r, y_r = (MEAN_SINE * f(phi) for phi in (phi_i, phi_r) for f in (np.cos, np.sin))
    axes = [list(dict.fromkeys(names)) for names in zip(*BLOCKS, strict=True)]
    table = np.empty([*map(len, axes), BASIS.size, BASIS.size])
    for names, shape in BLOCKS.items():
        u = np.radians(shape["u"])
        along = np.add.outer(x_i * np.cos(u) + y_i * np.sin(u), x_r * np.cos(u) + y_r * np.sin(u))
        products = np.multiply.outer(x_i, x_r) + np.multiply.outer(y_i, y_r)
        cosines = np.multiply.outer(MEAN_COSINE, MEAN_COSINE)
        at = tuple(axis.index(n) for axis, n in zip(axes, names, strict=True))
        table[at] = formula(cosines, products, along, *(shape[n] for n in "kabc"))
    sets = dict(zip(("channel", "mode", "side"), axes, strict=True))
    dims = (*sets, "incident", "outgoing")
    write(layout.assign_coords(sets).assign(brdf=(dims, table, {"units": "sr-1"})), path, force=True)


def exact(k, a, c, u, **_):
    """The direct-hemispherical value of each incident patch: the integral of f cos over w_r, mean over the patch.

    The directions are those at which klems_peer.py asks Radiance, turned by half a turn about x into gonio's frame.
    """
    turn = np.radians(180 - AZIMUTH - u)
    return np.pi * k * (1 + 2 / 3 * a * MEAN_COSINE + c * MEAN_SINE * np.cos(turn))


# name: the scan and what `gonio convert` is told
MEASURED = {
    "one wavelength": (
        SHARED / "scans" / "ualoft_aeroglaze.csv",
        ("--fill", "torrance-sparrow", "--weighting", "uniform"),
    ),
    "one channel": (SHARED / "files" / "rgl" / "paper_white_rgb.bsdf", ("--select", "channel=G")),
    "in plane": (
        SHARED / "scans" / "rgl_colodur_napoli_4f.csv",
        ("--select", "channel=R", "--fill", "oren-nayar", "--weighting", "uniform"),
    ),
}
SIMULATED = {
    "three wavelengths": (lambda path: grid(path, [450.0, 550.0, 650.0], "reflection"), ("--select", "wavelength=550")),
    "transmission": (lambda path: grid(path, [633.0], "transmission"), ()),
    "four directions": (patches, ()),
}
SCANS = {**MEASURED, **SIMULATED}


def converted(name, folder):
    """The file of a scan by `gonio convert`; None where the measured scan is not there."""
    source, options = SCANS[name]
    if name in SIMULATED:
        make, source = source, folder / (f"{name}.nc" if name == "four directions" else f"{name}.csv")
        make(source)
    elif not source.exists():
        return None
    out = folder / f"{name}.xml"
    command = ["gonio", "convert", str(source), str(out), "--to", "radiance", "--force", *options]
    with mock.patch.object(sys, "argv", command):
        try:
            gonio()
        except SystemExit as stop:
            if stop.code:
                raise
    return out


def hemispherical(path):
    """The sum over outgoing patches of value times projected solid angle, for each block of a file and patch in it."""
    scan = read(path)
    if "side" not in scan.coords:  # both sides are the same
        scan = scan.assign(brdf=scan["brdf"].expand_dims(side=["front"]))
    found = {}
    for channel in scan["channel"].values.tolist():
        for mode in scan["mode"].values.tolist():
            for side in scan["side"].values.tolist():
                values = scan["brdf"].sel(channel=channel, mode=mode, side=side).transpose("incident", "outgoing")
                found[block(channel, mode, side)] = values.values @ PROJECTED
    return {name: value for name, value in found.items() if not np.isnan(value).all()}


def block(channel, mode, side):
    return f"{channel} {mode.title()} {side.title()}"


def source_values(name):
    """The same of the scan itself by block, where it is a formula."""
    if name == "four directions":
        return {block(*names): exact(**shape) for names, shape in BLOCKS.items()}
    if name == "transmission":
        return {block("Visible", name, "front"): exact(**ISOTROPIC)}
    return {block("Visible", "reflection", "front"): exact(**ISOTROPIC) / 2} if name == "three wavelengths" else {}


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for name in SCANS:
        path = converted(name, folder)
        if path is None:
            print(f"no measured scan {SCANS[name][0]}: {name!r} is left out")
            continue
        found[name] = {
            "options": list(SCANS[name][1]),
            "file": {key: value.tolist() for key, value in hemispherical(path).items()},
            "source": {key: value.tolist() for key, value in source_values(name).items()},
        }
    (folder / "gonio.json").write_text(json.dumps(found), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))

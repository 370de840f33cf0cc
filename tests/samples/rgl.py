"""Small RGL files of every variant. Synthetic: smooth functions of the nodes' indices, not measured."""

import math
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.tensor_file import write_fields
from gonio.formats.rgl.file import FORMAT
from gonio.measured.dataset import make_scan


def smooth(*shape, seed=0):
    """Positive numbers in single precision that change slowly along each axis."""
    at = np.meshgrid(*(np.linspace(0, 1, n) for n in shape), indexing="ij")
    phase = sum((k + 1 + seed) * v for k, v in enumerate(at))
    return (1.5 + np.sin(2.3 * phase + seed) + 0.4 * np.cos(5.1 * phase)).astype(np.float32)


def fields(turns, sets=3, wavelengths=None, size=5):
    """The fields of one file; `turns` are the azimuths phi_i [deg] of its slices, up to two when isotropic."""
    theta_i = np.radians([0.0, 31.0, 64.0, 88.0]).astype(np.float32)
    phi_i = np.radians(turns).astype(np.float32)
    slices = (len(phi_i), len(theta_i))
    turned = len(phi_i) > 2
    ndf, sigma = (smooth(7, 9, seed=k) if turned else np.repeat(smooth(1, 9, seed=k), 2, axis=0) for k in (1, 2))
    values = smooth(*slices, sets, size, size, seed=3)
    named = {"rgb": values} if wavelengths is None else {"wavelengths": np.float32(wavelengths), "spectra": values}
    return {
        "version": np.array([1, 0], dtype=np.uint32),
        "description": np.frombuffer(b"synthetic", dtype=np.uint8),
        "phi_i": phi_i,
        "theta_i": theta_i,
        "sigma": sigma,
        "ndf": ndf,
        "vndf": smooth(*slices, 6, 8, seed=4) * np.linspace(0, 1, 8, dtype=np.float32),
        "luminance": values.mean(axis=2),
        **named,
        "jacobian": np.ones(1, dtype=np.uint8),
        "valid": np.full(size * size, 255, dtype=np.uint8),
    }


def grey(named):
    """Three equal channels that gonio reads as one set of values."""
    order = {name: np.repeat(v[:, :, :1], 3, axis=2) if name == "rgb" else v for name, v in named.items()}
    return order | {"grey": np.ones(1, dtype=np.uint8)}


VARIANTS = {
    "isotropic_rgb": lambda: fields([0.0]),
    "isotropic_spectral": lambda: fields([0.0], 4, [450.0, 500.5, 610.0, 700.0]),
    "turned_rgb": lambda: fields([-180.0, -100.0, 0.0, 70.0, 180.0]),
    "half_turned_rgb": lambda: fields([-180.0, -110.0, -60.0, 0.0]),
    "quarter_turned_rgb": lambda: fields([-180.0, -140.0, -90.0]),
    "turned_spectral": lambda: fields([-180.0, -60.0, 60.0, 180.0], 2, [500.0, 600.0]),
    "without_jacobian": lambda: fields([0.0]) | {"jacobian": np.zeros(1, dtype=np.uint8)},
    "grey": lambda: grey(fields([0.0])),
}


def samples(folder: Path) -> list[Path]:
    """One file a variant."""
    paths = [folder / f"{name}.bsdf" for name in VARIANTS]
    for path, make in zip(paths, VARIANTS.values(), strict=True):
        write_fields(path, make())
    return paths


def lobe(theta_i, theta_r, phi, phi_i=0.0):
    """A smooth BRDF [1/sr] with a broad lobe about the mirror direction, which turns with the surface [deg]."""
    i, r, p = np.radians(theta_i), np.radians(theta_r), np.radians(phi)
    along = (np.sin(i) + np.sin(r) * np.cos(p)) / (np.cos(i) + np.cos(r))
    across = np.sin(r) * np.sin(p) / (np.cos(i) + np.cos(r))
    width = 8 + 3 * np.cos(2 * np.radians(phi_i))
    return 0.1 + np.exp(-width * (along**2 + across**2)) * (1 + 0.3 * np.sin(p) * np.sin(r))


def laid_out(turned=False, wavelengths=()):
    """`lobe` on the grid that gonio gives to a scan that was never in a RGL file; sets differ by a factor."""
    turns = [0.0, 60.0, 120.0, 200.0, 300.0] if turned else [0.0]
    theta_i, phi_i = (
        v.ravel()
        for v in np.meshgrid([0.0, 35.0, 65.0, 88.0] if turned else [0.0, 20.0, 40.0, 55.0, 70.0, 80.0, 88.0], turns)
    )
    ones = np.ones_like(theta_i)
    onto = FORMAT.layout(make_scan(theta_i, 0 * ones, ones, 0 * ones, phi_i=phi_i if turned else None))
    angles = [onto[n] for n in ("theta_i", "theta_r", "phi", *(["phi_i"] if turned else []))]
    values = xr.DataArray(lobe(*angles)).where(onto["theta_r"] <= 90).transpose(*onto["theta_r"].dims)
    name, sets = ("wavelength", list(wavelengths)) if wavelengths else ("channel", ["R", "G", "B"])
    factor = xr.DataArray(1.0 + 0.5 * np.arange(len(sets)), dims=name, coords={name: sets})
    scan = (factor * values).assign_attrs(units="sr-1").to_dataset(name="brdf").assign_coords(onto.coords)
    return scan.assign_attrs(provenance="synthetic: a lobe", history="")


LAID_OUT = {
    "laid_out_rgb": laid_out,
    "laid_out_spectral": lambda: laid_out(wavelengths=(450.0, 550.0)),
    "laid_out_turned_rgb": lambda: laid_out(turned=True),
}


def written(folder: Path) -> list[Path]:
    """The scans of LAID_OUT as gonio writes them."""
    paths = [folder / f"{name}.bsdf" for name in LAID_OUT]
    for path, make in zip(paths, LAID_OUT.values(), strict=True):
        FORMAT.write(make(), path)
    return paths


def directions(count, seed=1, steepest=85.0):
    """theta_i, theta_r, phi, phi_i [deg] of random pairs."""
    random = np.random.default_rng(seed)
    steep = math.cos(math.radians(steepest))
    theta_i, theta_r = np.degrees(np.arccos(random.uniform(steep, 1, (2, count))))
    return theta_i, theta_r, random.uniform(0, 360, count), random.uniform(0, 360, count)

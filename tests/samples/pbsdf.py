"""Small KAIST pBRDF files. Synthetic: matrices that tell each element, angle and wavelength apart, not measured."""

from pathlib import Path

import numpy as np

from gonio.door.tensor_file import write_fields

MATRIX = [[1, 0.1, 0.2, 0.05], [-0.15, 0.7, 0.3, -0.1], [0.12, -0.25, 0.6, 0.2], [0.02, 0.08, -0.3, 0.5]]


def fields(phi_d=(-180.0, -90.0, 0.0, 90.0, 180.0), theta_d=(0.0, 30.0, 60.0, 88.0), theta_h=(0.0, 20.0, 45.0, 85.0)):
    """Matrices whose elements change with every angle in single precision."""
    wavelengths = np.array([450, 500, 550, 600, 650], dtype=np.uint16)
    p, d, h = np.meshgrid(*(np.radians(v) for v in (phi_d, theta_d, theta_h)), indexing="ij")
    height = (2 + np.cos(p) + 0.3 * np.sin(p)) * (1.5 + d) * np.exp(-h)
    spectral = height[..., None] * (1 + 0.2 * np.arange(5))
    tilt = 1 + 0.3 * np.sin(np.arange(16).reshape(4, 4) + d[..., None, None, None]) * (np.arange(16) > 0).reshape(4, 4)
    axes = {
        n: np.radians([v]).astype(np.float32) for n, v in (("phi_d", phi_d), ("theta_d", theta_d), ("theta_h", theta_h))
    }
    return {**axes, "wvls": wavelengths, "M": (spectral[..., None, None] * np.array(MATRIX) * tilt).astype(np.float32)}


VARIANTS = {
    "around": fields,
    "half": lambda: fields(phi_d=tuple(np.linspace(0.0, 150.0, 6))),
}


def samples(folder: Path) -> list[Path]:
    """One file a variant."""
    paths = [folder / f"{name}.pbsdf" for name in VARIANTS]
    for path, make in zip(paths, VARIANTS.values(), strict=True):
        write_fields(path, make())
    return paths

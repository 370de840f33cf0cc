"""The measured surfaces beside the project, without what their own files warn of: for benchmarks, pages and tests."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import xarray as xr

from gonio import read
from gonio.measured.dataset import make_scan
from gonio.measured.masking import mask

DATA = Path(__file__).resolve().parent.parent.parent / "shared" / "data"
SCANS = DATA / "scans"
STARLINK_FLOOR = 1e-4  # 1/sr, the authors' own
LEAST = 1e-9  # 1/sr: the peers' fits of the two full sets leave smaller values out, as those closer than this to
GRAZING = 1e-3  # the horizon, in cos theta_r


def usable(path: Path, positive: bool) -> xr.Dataset:
    """A scan without what its own header warns of; `positive` also masks what a relative error cannot weigh."""
    scan = read(path)
    theta_i, theta_r = scan["theta_i"].values, scan["theta_r"].values
    bad = np.zeros(theta_i.shape, dtype=bool)
    if path.stem.startswith("jsss"):
        bad |= (theta_i >= 80) | ((theta_i == 15) & (theta_r <= 3))
    if path.stem.startswith("starlink15"):
        bad |= scan["brdf"].values <= STARLINK_FLOOR
    if positive:
        bad |= scan["brdf"].values <= 0
    return mask(scan, exclude=bad)


def anoblack_ec1() -> xr.Dataset:
    """AnoBlack EC1 on aluminium over all azimuths, as FRED tabulates it."""
    return _as_peers_take_it(read(DATA / "files" / "fred" / "AnoBlackEC1onAlum.txt"))


def merl_aluminium() -> xr.Dataset:
    """The in-plane slice of MERL's aluminium, a file of five columns."""
    return _as_peers_take_it(read(DATA / "files" / "columns" / "merl_aluminium_slice.csv"))


def _as_peers_take_it(scan: xr.Dataset) -> xr.Dataset:
    grazing = np.cos(np.radians(scan["theta_r"].values)) <= GRAZING
    return mask(scan, exclude=(scan["brdf"].values <= LEAST) | grazing)


def surfaces() -> Iterator[tuple[str, xr.Dataset]]:
    """The 19 scans by name, then the two full sets that peers fitted."""
    yield from ((path.stem, usable(path, positive=True)) for path in sorted(SCANS.glob("*.csv")))
    yield "AnoBlackEC1onAlum", anoblack_ec1()
    yield "merl_aluminium_slice", merl_aluminium()


def coating_at_four_wavelengths(least: float = 0.0) -> xr.Dataset:
    """AnoBlack NiTE on Invar at four wavelengths, from `least` [nm] on: the BRDF of the reduced file of blacklab."""
    path = DATA / "raw" / "blacklab" / "nite_invar_sample.txt"
    heads, *rows = (line.split() for line in path.read_text(encoding="latin-1").splitlines()[5:])
    values = np.array(rows, dtype=float)
    wavelengths = {k: float(head.removesuffix("nm")) for k, head in enumerate(heads) if head.endswith("nm")}
    parts = []
    for column, wavelength in wavelengths.items():
        one = make_scan(
            values[:, 0],
            values[:, 2],
            values[:, column] / np.pi,  # reflectance factors
            values[:, 3],
            coordinates={"wavelength": np.full(len(values), wavelength)},
        )
        if wavelength >= least:
            parts.append(mask(one, exclude=one["brdf"].values <= 0))
    return xr.concat(parts, "direction")

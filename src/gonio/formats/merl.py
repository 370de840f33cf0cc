"""MERL's binary tables of isotropic BRDFs in half-difference coordinates (matusik2003, rusinkiewicz1998).

Three int32 (theta_h, theta_d, phi_d), then planes of float64 for R, G and B, phi_d fastest, all little-endian. A BRDF
is a plane times 1/1500, 1.15/1500 or 1.66/1500; a negative number marks a cell without a value. The published reader
finds the cell of a direction by truncation: theta_h at 90 (i/90)^2 deg, theta_d each deg, phi_d each deg over half a
circle, the other half being the same by reciprocity. So a number is that of a cell, and the angles here are those of
its middle in the table's own index, theta_h = 90 ((i + 1/2)/90)^2: the published reader gives each number at its own
angles. (Some programs take the lower edge instead.) Non-reciprocal tables have 360 in the third dimension and cover the
whole circle; any other dimensions are read where the file has the size for them.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.binary import Bytes
from gonio.door.text import MOST_VALUES
from gonio.formats.colours import planes
from gonio.formats.format import Format, Holds
from gonio.measured import coordinates
from gonio.measured.dataset import ABSOLUTE, HORIZON, PARAMETERISATION

Values = npt.NDArray[np.float64]

NAME = "merl"
AXES = ("theta_h", "theta_d", "phi_d")
SHAPE = (90, 90, 180)
SCALES = {"R": 1.0 / 1500.0, "G": 1.15 / 1500.0, "B": 1.66 / 1500.0}
ALL_ROUND = 360  # of the third dimension: the table is not reciprocal and covers the whole circle
LONGEST = 4096  # entries of one dimension
HEADER = 12  # bytes
INVALID = -1.0
SLAB = 4  # rows of theta_h whose directions are computed at once: the intermediate arrays stay small
NUDGES = 2


def _recognises(head: bytes) -> bool:
    if len(head) < HEADER:
        return False
    shape = np.frombuffer(head[:HEADER], "<i4")
    return bool(((shape >= 1) & (shape <= LONGEST)).all())


def _read(path: Path) -> xr.Dataset:
    file = Bytes(path)
    shape = tuple(int(n) for n in file.array("<i4", (3,), "the three dimensions"))
    cells = shape[0] * shape[1] * shape[2]
    if min(shape) < 1 or cells > MOST_VALUES:
        raise file.wrong(f"the dimensions {_by(shape)} are no table's", 0)
    needed = HEADER + len(SCALES) * 8 * cells
    if file.size != needed:
        what = f"{_by(shape)} cells in three colours need {needed} bytes, and the file has {file.size}"
        raise file.wrong(what, min(file.size, needed))
    stored = file.array("<f8", (len(SCALES), *shape), "the table")
    grid = directions(shape)
    brdf, history = _scaled(file, stored, grid)
    dims = ("channel", *AXES)
    return xr.Dataset(
        {"brdf": (dims, brdf, {"units": ABSOLUTE})},
        coords={"channel": ("channel", np.array(list(SCALES))), **grid.coords},
        attrs={
            "Conventions": "CF-1.11",
            "history": history,
            "provenance": "",
            "symmetry": "isotropic",
            "stored": "BRDF over 1/1500, 1.15/1500 and 1.66/1500 for R, G and B",
            PARAMETERISATION: NAME,
        },
    )


def _by(shape: tuple[int, ...]) -> str:
    return " x ".join(str(n) for n in shape)


def _scaled(file: Bytes, stored: Values, grid: xr.Dataset) -> tuple[Values, str]:
    """The BRDF of a table's numbers, NaN where it has none, and what was done in words."""
    below = (grid["theta_r"].values > HORIZON) | (grid["theta_i"].values > HORIZON)
    brdf = np.empty(stored.shape)
    marked, dropped, something = 0, 0, False
    for k, scale in enumerate(SCALES.values()):
        plane = stored[k]
        if (infinite := np.isinf(plane)).any():
            at = HEADER + 8 * (k * plane.size + int(infinite.argmax()))
            raise file.wrong("the value is infinite", at)
        with np.errstate(invalid="ignore"):  # a signalling NaN of a damaged file
            np.multiply(plane, scale, out=brdf[k])
        invalid = ~(plane >= 0)  # NaN too
        marked += int(invalid.sum())
        dropped += int((below & ~invalid).sum())
        invalid |= below
        brdf[k][invalid] = np.nan
        something |= bool((brdf[k] > 0).any())
    if not something:
        raise file.wrong("every brdf value is zero or marked as invalid", HEADER)
    words = f"scaled R, G and B by 1/1500, 1.15/1500 and 1.66/1500; {marked} of {brdf.size} cells hold no value"
    if dropped:
        words += f"; left out {dropped} values of cells whose middle lies below the horizon"
    return brdf, words


def axes(shape: tuple[int, ...]) -> dict[str, Values]:
    """The middles of a table's cells [deg]; theta_h is quadratic in the index."""
    halves = [np.arange(n) + 0.5 for n in shape]
    round_about = 360.0 if shape[2] == ALL_ROUND else 180.0
    return {
        "theta_h": 90.0 * (halves[0] / shape[0]) ** 2,
        "theta_d": 90.0 * halves[1] / shape[1],
        "phi_d": round_about * halves[2] / shape[2],
    }


def directions(shape: tuple[int, ...]) -> xr.Dataset:
    """The directions of a table's cells, a Dataset of coordinates on theta_h, theta_d and phi_d."""
    middles = axes(shape)
    found = {name: np.empty(shape) for name in ("theta_i", "theta_r", "phi")}
    theta_h, theta_d, phi_d = np.ix_(*(np.radians(values) for values in middles.values()))
    for start in range(0, shape[0], SLAB):
        rows = slice(start, start + SLAB)
        for full, part in zip(found.values(), _angles(theta_h[rows], theta_d, phi_d), strict=True):
            full[rows] = part
    degrees = {"units": "degree"}
    own = {name: (name, values, degrees) for name, values in middles.items()}
    return xr.Dataset(coords=own | {name: (AXES, values, degrees) for name, values in found.items()})


def _angles(theta_h: Values, theta_d: Values, phi_d: Values) -> tuple[Values, Values, Values]:
    """theta_i, theta_r and phi [deg] of half-difference angles [rad].

    What coordinates.grid gives, four times as fast: with the half vector in the plane of x and z, w_r is w_i with the
    difference vector turned by 180 deg, and no arrays of vectors are needed.
    """
    along, across, up = np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)
    c, s = np.cos(theta_h), np.sin(theta_h)
    x_i, z_i = s * up + c * along, c * up - s * along
    x_r, z_r = s * up - c * along, c * up + s * along
    beside = across * across
    theta_i = np.degrees(np.arctan2(np.sqrt(x_i * x_i + beside), z_i))
    theta_r = np.degrees(np.arctan2(np.sqrt(x_r * x_r + beside), z_r))
    phi = np.degrees(np.arctan2(-across * (x_i + x_r), x_i * x_r - beside))
    phi[phi < 0] += 360.0
    return theta_i, theta_r, phi


def _layout(scan: xr.Dataset) -> xr.Dataset:
    """The scan's own cells where it has a table's, else those of the 100 published tables."""
    return directions(_shape(scan) or SHAPE)


def _shape(scan: xr.Dataset) -> tuple[int, ...] | None:
    """The dimensions of the table whose cells a scan is on, None where it is on no table's."""
    if not all(name in scan.dims for name in AXES):
        return None
    shape = tuple(scan.sizes[name] for name in AXES)
    same = all(np.allclose(scan[name].values, middle, rtol=0, atol=1e-9) for name, middle in axes(shape).items())
    return shape if same and max(shape) <= LONGEST else None


def _write(scan: xr.Dataset, path: Path) -> None:
    """Raises ValueError for other cells, for channels that are not R, G and B, and for negative values."""
    shape = _shape(scan)
    if shape is None:
        raise ValueError("a MERL table has cells of its own in theta_h, theta_d and phi_d: resample the scan onto them")
    found = planes(scan["brdf"], AXES, "a MERL table")
    if any((plane < 0).any() for plane in found):
        raise ValueError("a MERL table marks cells without a value by negative numbers: leave negative values out")
    with path.open("wb") as file:
        file.write(np.array(shape, "<i4").tobytes())
        for plane, scale in zip(found, SCALES.values(), strict=True):
            file.write(_unscaled(plane, scale).astype("<f8").tobytes())


def _unscaled(brdf: Values, scale: float) -> Values:
    """The numbers that give the BRDF back exactly when scaled, or to one rounding where none does."""
    found = brdf / scale
    for step in (np.inf, -np.inf):
        near = found
        for _ in range(NUDGES):
            near = np.nextafter(near, step)
            wrong = (found * scale != brdf) & (near * scale == brdf)
            found[wrong] = near[wrong]
    found[np.isnan(found)] = INVALID
    return found


def _evaluate(scan: xr.Dataset, theta_i: Values, theta_r: Values, phi: Values, phi_i: Values) -> Values:
    """The BRDF at any directions: linear between the middles of cells in the table's own index.

    The outermost half cells are constant. Where the cell of a direction holds no value there is none; neighbours
    without one are left out of the mean.
    """
    table = scan["brdf"].transpose(*AXES).values
    around = 360.0 if table.shape[2] == ALL_ROUND else 180.0
    theta_h, theta_d, phi_d, _ = coordinates.SYSTEMS["half-difference"].axes_of(theta_i, theta_r, phi, phi_i * 0.0)
    share = [np.sqrt(np.clip(theta_h / 90.0, 0.0, 1.0)), np.clip(theta_d / 90.0, 0.0, 1.0), (phi_d % around) / around]
    place = [s * n for s, n in zip(share, table.shape, strict=True)]
    own = tuple(np.minimum(p.astype(int), n - 1) for p, n in zip(place, table.shape, strict=True))
    lower = [np.floor(p - 0.5) for p in place]
    total, weights = np.zeros(np.shape(own[0])), np.zeros(np.shape(own[0]))
    for corner in np.ndindex(2, 2, 2):
        at = [(low + c).astype(int) for low, c in zip(lower, corner, strict=True)]
        weight = np.prod([1.0 - np.abs(p - 0.5 - a) for p, a in zip(place, at, strict=True)], axis=0)
        inside = [np.clip(a, 0, n - 1) for a, n in zip(at[:2], table.shape, strict=False)]
        value = table[inside[0], inside[1], at[2] % table.shape[2]]
        known = np.isfinite(value)
        total += np.where(known, weight * np.where(known, value, 0.0), 0.0)
        weights += np.where(known, weight, 0.0)
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(table[own]), total / weights, np.nan)


FORMAT = Format(
    name=NAME,
    title="MERL binary",
    suffix=".binary",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    evaluate=_evaluate,
    holds=Holds(gaps=True, negative=False, sets=("channel",)),
    rank=20,
)

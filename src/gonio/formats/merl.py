"""Binary tables of the MERL database: isotropic BRDFs in half-difference coordinates (matusik2003, rusinkiewicz1998).

Three int32 are the sizes of theta_h, theta_d and phi_d (90, 90, 180), then follow planes of float64 for R, G and B, in
which phi_d runs fastest; all are little-endian. The BRDF is the plane times 1/1500, 1.15/1500 or 1.66/1500. A negative
number marks a cell without a value. The layout is that of the database's published reader; public readers are in
libbsdf (MerlBinaryReader.cpp), dj_brdf.h, the merl.h of BBM and ALTA (merl.cpp).

The published reader finds the cell of a direction by truncation: theta_h begins at 90 (i/90)^2 deg, theta_d at every
degree, phi_d at every degree of half a circle; the other half is the same by reciprocity. A number belongs to a cell,
and gonio states the angles of the cell's middle in index space, theta_h = 90 ((i + 1/2)/90)^2, at which the published
reader returns that number. (Some programs use the lower edge instead.) Tables of non-reciprocal models have 360 in the
third dimension and cover the full circle; tables of any other size are read where the length of the file agrees.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.binary import Bytes
from gonio.door.text import MOST_VALUES
from gonio.formats.colours import COLOURS, planes
from gonio.formats.format import Format, Holds
from gonio.measured import coordinates
from gonio.measured.dataset import ABSOLUTE, HORIZON, PARAMETERISATION

Values = npt.NDArray[np.float64]

NAME = "merl"
AXES = ("theta_h", "theta_d", "phi_d")
SHAPE = (90, 90, 180)
SCALES = {"R": 1.0 / 1500.0, "G": 1.15 / 1500.0, "B": 1.66 / 1500.0}
ALL_ROUND = 360  # size of the third dimension of a table that is not reciprocal and covers the full circle
LONGEST = 4096  # cells along one dimension
HEADER = 12  # bytes
INVALID = -1.0
SLAB = 4  # rows of theta_h whose directions are computed at once: the intermediate arrays stay small
NUDGES = 2  # neighbouring floats that are tried for an exact round trip


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
        raise file.wrong(f"the dimensions {_by(shape)} are not those of a table", 0)
    needed = HEADER + len(SCALES) * 8 * cells
    if file.size != needed:
        message = f"{_by(shape)} cells in three colours need {needed} bytes, and the file has {file.size}"
        raise file.wrong(message, min(file.size, needed))
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
    """The BRDF of the stored numbers, NaN in cells without a value, and a line for the history."""
    below = (grid["theta_r"].values > HORIZON) | (grid["theta_i"].values > HORIZON)
    brdf = np.empty(stored.shape)
    marked, dropped, any_positive = 0, 0, False
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
        any_positive |= bool((brdf[k] > 0).any())
    if not any_positive:
        raise file.wrong("every brdf value is zero or marked as invalid", HEADER)
    words = f"scaled R, G and B by 1/1500, 1.15/1500 and 1.66/1500; {marked} of {brdf.size} cells hold no value"
    if dropped:
        words += f"; left out {dropped} values of cells whose middle lies below the horizon"
    return brdf, words


def axes(shape: tuple[int, ...]) -> dict[str, Values]:
    """The axes of a table, at the middles of its cells [deg]; theta_h is quadratic in the index."""
    halves = [np.arange(n) + 0.5 for n in shape]
    round_about = 360.0 if shape[2] == ALL_ROUND else 180.0
    return {
        "theta_h": 90.0 * (halves[0] / shape[0]) ** 2,
        "theta_d": 90.0 * halves[1] / shape[1],
        "phi_d": round_about * halves[2] / shape[2],
    }


def directions(shape: tuple[int, ...]) -> xr.Dataset:
    """The directions of the middles of a table's cells, as coordinates [deg] on theta_h, theta_d and phi_d."""
    middles = axes(shape)
    angles = {name: np.empty(shape) for name in ("theta_i", "theta_r", "phi")}
    theta_h, theta_d, phi_d = np.ix_(*(np.radians(values) for values in middles.values()))
    for start in range(0, shape[0], SLAB):
        rows = slice(start, start + SLAB)
        for full, part in zip(angles.values(), _angles(theta_h[rows], theta_d, phi_d), strict=True):
            full[rows] = part
    degrees = {"units": "degree"}
    axis_coords = {name: (name, values, degrees) for name, values in middles.items()}
    return xr.Dataset(coords=axis_coords | {name: (AXES, values, degrees) for name, values in angles.items()})


def _angles(theta_h: Values, theta_d: Values, phi_d: Values) -> tuple[Values, Values, Values]:
    """theta_i, theta_r and phi [deg] of half-difference angles [rad].

    The result is that of coordinates.grid, four times as fast: with the half vector in the x-z plane, w_r follows from
    w_i by changing the sign of the two components perpendicular to it, and no arrays of vectors are needed.
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
    """The scan's cells where they are those of a table, else the cells of the published tables (90, 90, 180)."""
    return directions(_shape(scan) or SHAPE)


def _shape(scan: xr.Dataset) -> tuple[int, ...] | None:
    """The size of the table whose cells a scan is on; None where its axes are not those of a table."""
    if not all(name in scan.dims for name in AXES):
        return None
    shape = tuple(scan.sizes[name] for name in AXES)
    same = all(np.allclose(scan[name].values, middle, rtol=0, atol=1e-9) for name, middle in axes(shape).items())
    return shape if same and max(shape) <= LONGEST else None


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write the scan. Raises ValueError for other cells, channels other than R, G and B, and negative values."""
    shape = _shape(scan)
    if shape is None:
        raise ValueError("a MERL table has cells of its own in theta_h, theta_d and phi_d: resample the scan onto them")
    colour_planes = planes(scan["brdf"], AXES, "a MERL table")
    if any((plane < 0).any() for plane in colour_planes):
        raise ValueError("a MERL table marks cells without a value by negative numbers: leave negative values out")
    with path.open("wb") as file:
        file.write(np.array(shape, "<i4").tobytes())
        for plane, scale in zip(colour_planes, SCALES.values(), strict=True):
            file.write(_unscaled(plane, scale).astype("<f8").tobytes())


def _unscaled(brdf: Values, scale: float) -> Values:
    """The numbers that give the BRDF exactly when scaled, where there are such floats, else to one rounding error."""
    numbers = brdf / scale
    for step in (np.inf, -np.inf):
        near = numbers
        for _ in range(NUDGES):
            near = np.nextafter(near, step)
            wrong = (numbers * scale != brdf) & (near * scale == brdf)
            numbers[wrong] = near[wrong]
    numbers[np.isnan(numbers)] = INVALID
    return numbers


def _evaluate(scan: xr.Dataset, theta_i: Values, theta_r: Values, phi: Values, phi_i: Values) -> Values:
    """The BRDF at any directions [deg]: trilinear between the middles of cells, in index space.

    In the outermost half cells the value is constant. A direction in a cell without a value gives NaN; neighbouring
    cells without a value are left out of the weighted mean.
    """
    table = scan["brdf"].transpose(*AXES).values
    around = 360.0 if table.shape[2] == ALL_ROUND else 180.0
    theta_h, theta_d, phi_d, _ = coordinates.SYSTEMS["half-difference"].axes_of(theta_i, theta_r, phi, phi_i * 0.0)
    share = [np.sqrt(np.clip(theta_h / 90.0, 0.0, 1.0)), np.clip(theta_d / 90.0, 0.0, 1.0), (phi_d % around) / around]
    place = [s * n for s, n in zip(share, table.shape, strict=True)]
    cell = tuple(np.minimum(p.astype(int), n - 1) for p, n in zip(place, table.shape, strict=True))
    lower = [np.floor(p - 0.5) for p in place]
    total, weights = np.zeros(np.shape(cell[0])), np.zeros(np.shape(cell[0]))
    for corner in np.ndindex(2, 2, 2):
        at = [(low + c).astype(int) for low, c in zip(lower, corner, strict=True)]
        weight = np.prod([1.0 - np.abs(p - 0.5 - a) for p, a in zip(place, at, strict=True)], axis=0)
        inside = [np.clip(a, 0, n - 1) for a, n in zip(at[:2], table.shape, strict=False)]
        value = table[inside[0], inside[1], at[2] % table.shape[2]]
        known = np.isfinite(value)
        total += np.where(known, weight * np.where(known, value, 0.0), 0.0)
        weights += np.where(known, weight, 0.0)
    with np.errstate(invalid="ignore"):
        return np.where(np.isfinite(table[cell]), total / weights, np.nan)


FORMAT = Format(
    name=NAME,
    title="MERL binary",
    suffix=".binary",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    evaluate=_evaluate,
    holds=Holds(gaps=True, negative=False, sets=("channel",), channels=(COLOURS,), monochrome=False),
    rank=20,
)

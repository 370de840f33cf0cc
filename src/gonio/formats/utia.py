"""Binary tables of the UTIA database: BRDFs of anisotropic surfaces (filip2014).

There is no header: planes of float64 (little-endian) for R, G and B, each over theta_i, phi_i, theta_v, phi_v, the last
fastest. Polar angles are 0 to 75 deg by 15, azimuths 0 to 352.5 deg by 7.5 from the surface's x axis; a file has
1 990 656 bytes. gonio's phi = phi_v - phi_i changes only the order of the values in a row. Public readers are
dj_brdf.h, ALTA (utia.cpp) and Fichet's utia.py.

The numbers are kept as stored, as relative data. The database calls them sRGB without a scale, and the public readers
disagree: one uses them unchanged, one inverts the sRGB curve, one divides by 140, inverts the curve and multiplies by
100.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.binary import Bytes
from gonio.formats.colours import COLOURS, planes
from gonio.formats.format import Format, Holds
from gonio.measured import coordinates
from gonio.measured.dataset import RELATIVE

Values = npt.NDArray[np.float64]

POLAR, AZIMUTHS = tuple(15.0 * k for k in range(6)), tuple(7.5 * k for k in range(48))
AXES = {"theta_i": POLAR, "phi_i": AZIMUTHS, "theta_r": POLAR, "phi": AZIMUTHS}
SHAPE = tuple(len(values) for values in AXES.values())
SIZE = 8 * len(COLOURS) * int(np.prod(SHAPE))
HEAD = 512  # numbers that are tested to recognise a file without a signature
SMALLEST, LARGEST = (
    1e-9,
    1e6,
)  # of a number in such a file; other bytes read as float64 are hardly ever all in this range


def _recognises(head: bytes) -> bool:
    """Whether the bytes make plausible values of a BRDF when read as float64, and do not when read as float32."""
    return len(head) >= 8 * HEAD and _plausible(head, "<f8") > 0.5 and _plausible(head, "<f4") < 0.9


def _plausible(head: bytes, dtype: str) -> float:
    """The share of numbers other than zero; 0 where any number is outside SMALLEST to LARGEST."""
    sizes = np.abs(np.frombuffer(head[: 8 * HEAD], dtype))
    with np.errstate(invalid="ignore"):
        good = ((sizes >= SMALLEST) & (sizes <= LARGEST)) | (sizes == 0)
        return float((sizes > 0).mean()) if good.all() else 0.0


def _read(path: Path) -> xr.Dataset:
    file = Bytes(path)
    if file.size != SIZE:
        message = f"holds {file.size} bytes of numbers without a header, and a UTIA file {SIZE}"
        raise file.wrong(message, min(file.size, SIZE))
    stored = file.array("<f8", (len(COLOURS), *SHAPE), "the table")
    if not (finite := np.isfinite(stored)).all():
        raise file.wrong("the value is not finite", 8 * int((~finite).argmax()))
    if not stored.any():
        raise file.wrong("every brdf value is zero", 0)
    return xr.Dataset(
        {"brdf": (("channel", *AXES), _turned(stored, back=False), {"units": RELATIVE})},
        coords={"channel": ("channel", np.array(COLOURS)), **coordinates.grid("spherical", **AXES).coords},
        attrs={
            "Conventions": "CF-1.11",
            "history": "kept the numbers as stored: the database calls them sRGB, and public readers disagree on "
            "their curve and scale",
            "provenance": "",
            "symmetry": "anisotropic",
            "stored": "sRGB values of unknown scale",
        },
    )


def _turned(values: Values, back: bool) -> Values:
    """Values (channel, theta_i, phi_i, theta, azimuth) with the last axis changed from phi_v to phi, or `back`."""
    steps = np.arange(len(AZIMUTHS))
    source = (steps[None, :] + (-steps if back else steps)[:, None]) % len(steps)
    return np.take_along_axis(values, np.broadcast_to(source[None, None, :, None, :], values.shape), axis=-1)


def _layout(_scan: xr.Dataset) -> xr.Dataset:
    """The one grid of the format."""
    return coordinates.grid("spherical", **AXES)


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write the scan. Raises ValueError for another grid, channels other than R, G and B, and gaps."""
    brdf = scan["brdf"]
    for name, nodes in AXES.items():
        if name not in brdf.dims or not np.array_equal(scan[name].values, nodes):
            raise ValueError(f"a UTIA file has {name} from 0 to {nodes[-1]:g} by {nodes[1]:g} deg: resample the scan")
    values = np.stack(planes(brdf, tuple(AXES), "a UTIA file"))
    if not np.isfinite(values).all():
        raise ValueError("a UTIA file has no gaps: fill them")
    path.write_bytes(_turned(values, back=True).astype("<f8").tobytes())


FORMAT = Format(
    name="utia",
    title="UTIA binary",
    suffix=".bin",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    holds=Holds(anisotropic=True, relative=True, sets=("channel",), channels=(COLOURS,), monochrome=False),
    rank=90,
)

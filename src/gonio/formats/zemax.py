"""The tabular BSDF of Zemax (rykowski2008): BRDF or BTDF about the specular direction, one table per incidence.

    Source  Measured
    Symmetry  PlaneSymmetrical | Asymmetrical | Asymmetrical4D
    SpectralContent  Monochrome | XYZ
    ScatterType  BRDF | BTDF
    SampleRotation, AngleOfIncidence, ScatterAzimuth, ScatterRadial: each a count, then so many angles [deg]
    Monochrome (or TristimulusX, Y and Z, one after another)
    DataBegin
    for each rotation, each angle of incidence: TIS v, then a row of the radial values for each azimuth
    DataEnd

Zemax documents the layout on its support page (rykowski2008); a public reader is libbsdf's ZemaxBsdfReader.cpp.
Azimuth 0 leads from the specular direction to the normal. At azimuth 90 phi is below 180, as in the two public readers.
AngleOfIncidence is the angle of the specular direction, and theta_i here. SampleRotation is phi_i. Values below the
horizon are NaN in the Dataset and 0 in the file.
"""

import math
import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import MOST_VALUES, Words, clip, lines
from gonio.formats.format import Format, Holds
from gonio.measured.coordinates import grid
from gonio.measured.dataset import HORIZON, RELATIVE, SETS, add_history, flatten, unit

AXES = {"SampleRotation": "phi_i", "AngleOfIncidence": "theta_i", "ScatterAzimuth": "phi_s", "ScatterRadial": "theta_s"}
RANGES = {"phi_i": (-360.0, 360.0), "theta_i": (0.0, 90.0), "phi_s": (0.0, 360.0), "theta_s": (0.0, 180.0)}
CHOICES = {
    "Symmetry": ("PlaneSymmetrical", "Asymmetrical", "Asymmetrical4D"),
    "SpectralContent": ("Monochrome", "XYZ"),
    "ScatterType": ("BRDF", "BTDF"),
}
CHANNELS = {"Monochrome": ("Monochrome",), "XYZ": ("TristimulusX", "TristimulusY", "TristimulusZ")}
STARTS = (*CHANNELS["Monochrome"], *CHANNELS["XYZ"])
DIMS = ("channel", "phi_i", "theta_i", "phi_s", "theta_s")  # the order of the file
RADIAL = (0, 0.5, 1, 2, 3, 4, 5, 7.5, 10, 12.5, 15, 20, 25, 30, 40, 50, 60, 70, 80, 90, 100, 120, 140, 160)
STEP = 10.0  # deg, between azimuths
MOST_ANGLES = 91  # of incidence, in the layout of a scan that is not on a grid
LONGEST = 1_000_000  # bytes of a line; a row of radial values may be long
_HISTORY = "history: "
_SIGNATURE = re.compile(rb"(?im)^[ \t]*(samplerotation|angleofincidence)[ \t]+[0-9]")


def _recognises(head: bytes) -> bool:
    return b"\0" not in head and _SIGNATURE.search(head.replace(b"\r", b"\n")) is not None


def _read(path: Path) -> xr.Dataset:
    words = Words(path, lines(path, longest=LONGEST))
    choices, axes = _header(words)
    channels = CHANNELS[choices["SpectralContent"]]
    shape = (len(channels), *(len(axes[a]) for a in DIMS[1:]))
    most = min(path.stat().st_size // 2, MOST_VALUES)  # a value and its separator take two bytes
    if math.prod(shape) > most:
        raise words.wrong(f"the header promises {math.prod(shape)} values, and the file can hold {most}")
    values, tis = np.empty(shape), np.empty(shape[:3])
    for c, name in enumerate(channels):
        words.keyword(name)
        _begin(words)
        for p, t in np.ndindex(shape[1:3]):
            words.keyword("TIS")
            tis[c, p, t] = words.number("TIS")
            for a in range(shape[3]):
                values[c, p, t, a] = _row(words, shape[4])
        _end(words, last=c == len(channels) - 1)
    return _dataset(choices, axes, values, tis, words.remarks)


def _header(words: Words) -> tuple[dict[str, str], dict[str, npt.NDArray[np.float64]]]:
    """The choices by keyword and the angles by axis [deg]; the file may give them in any order."""
    choices: dict[str, str] = {}
    axes: dict[str, npt.NDArray[np.float64]] = {}
    while words.peek().lower() not in [name.lower() for name in STARTS]:
        keyword = words.keyword("Source", *CHOICES, *AXES, *STARTS)
        if keyword in choices or AXES.get(keyword) in axes:
            raise words.wrong(f"{keyword} occurs twice: keep one")
        if keyword == "Source":
            choices[keyword] = " ".join(words.rest())
        elif keyword in CHOICES:
            choices[keyword] = words.keyword(*CHOICES[keyword])
        else:
            axes[AXES[keyword]] = _axis(words, keyword)
    if missing := [k for k in (*CHOICES, *AXES) if k not in choices and AXES.get(k) not in axes]:
        raise words.wrong(f"{words.peek()} where {' and '.join(missing)} should have come before")
    return choices, axes


def _axis(words: Words, keyword: str) -> npt.NDArray[np.float64]:
    angles = np.array(words.numbers(words.count(f"number of {keyword} angles", most=100_000), f"{keyword} angles"))
    low, high = RANGES[AXES[keyword]]
    if angles.min() < low or angles.max() > high:
        raise words.wrong(f"{keyword} is outside {low:g} to {high:g} deg")
    if (np.diff(angles) <= 0).any():
        raise words.wrong(f"{keyword} angles must ascend")
    return angles


def _row(words: Words, count: int) -> npt.NDArray[np.float64]:
    """The radial values of one azimuth, which are one line."""
    row = words.row()
    if len(row) != count:
        raise words.wrong(f"{len(row)} values where a row has {count}" if row else "the file ends within its values")
    try:
        values = np.array(list(map(float, row)))
    except ValueError:
        values = np.array([np.nan])
    if not np.isfinite(values).all() or any("_" in word for word in row):
        return np.array([words.as_number(word, "a value") for word in row])
    return values


def _begin(words: Words) -> None:
    """Read DataBegin, which comes before the first channel; before the other channels some files leave it out."""
    if words.peek().lower() != "tis":
        words.keyword("DataBegin")


def _end(words: Words, last: bool) -> None:
    if last or words.peek().lower() == "dataend":
        words.keyword("DataEnd")
    if last and words.peek():
        raise words.wrong(f"{clip(words.peek())!r} after the last DataEnd")


def _dataset(
    choices: dict[str, str],
    axes: dict[str, npt.NDArray[np.float64]],
    values: npt.NDArray[np.float64],
    tis: npt.NDArray[np.float64],
    remarks: list[str],
) -> xr.Dataset:
    turned = choices["Symmetry"] == "Asymmetrical4D" or axes["phi_i"].tolist() != [0.0]
    coloured = choices["SpectralContent"] == "XYZ"
    dims = [d for d in DIMS if (turned or d != "phi_i") and (coloured or d != "channel")]
    drop = tuple(i for i, d in enumerate(DIMS) if d not in dims)
    scan = grid("specular", **{d: axes[d] for d in dims if d != "channel"})
    if coloured:
        scan = scan.assign_coords(channel=("channel", ["X", "Y", "Z"]))
    if choices["ScatterType"] == "BTDF":
        scan = scan.assign_coords(mode="transmission")
    values, tis = values.squeeze(drop), tis.squeeze(tuple(i for i in drop if i < 3))
    below = np.broadcast_to(scan["theta_r"].values > HORIZON, values.shape)
    lost = int(np.count_nonzero(values[below]))
    values[below] = np.nan
    scan["brdf"] = (dims, values, {"units": "sr-1"})
    scan["tis"] = (dims[:-2], tis, {"units": "1"})
    source = [f"Source {choices['Source']}"] if choices.get("Source", "").lower() not in ("", "measured") else []
    scan.attrs = {
        "Conventions": "CF-1.11",
        "history": "\n".join(r.removeprefix(_HISTORY) for r in remarks if r.startswith(_HISTORY)),
        "provenance": "\n".join([*(r for r in remarks if not r.startswith(_HISTORY)), *source]).strip("\n"),
        "symmetry": "plane-symmetrical" if choices["Symmetry"] == "PlaneSymmetrical" else "anisotropic",
    }
    if lost:
        scan = add_history(scan, f"left out {lost} values below the horizon that are not zero in the file")
    if not np.nan_to_num(values).any():
        scan = add_history(scan, "every value is zero")
    return scan


def _layout(scan: xr.Dataset) -> xr.Dataset:
    """The scan's grid where it is about the specular direction, else its incidence angles with azimuths every 10 deg.

    Azimuths run from 0 to 180, or to 350 for anisotropic scans. Radial steps grow from 0.5 to 20 deg, up to the angle
    from the specular direction to the horizon at the largest incidence angle.
    """
    if {"theta_i", "phi_s", "theta_s"} <= set(scan["brdf"].dims):
        dims = [d for d in DIMS[1:] if d in scan["brdf"].dims]
        return grid("specular", **{d: scan[d].values for d in dims})
    flat = flatten(scan)
    theta_i = _thinned(flat["theta_i"].values, 5.0)
    phi_i = _thinned(flat["phi_i"].values % 360.0, STEP) if "phi_i" in flat.coords else np.zeros(1)
    turned = len(phi_i) > 1
    sided = turned or scan.attrs.get("symmetry") == "anisotropic"
    axes = {"phi_i": phi_i} if turned else {}
    radial = [r for r in RADIAL if r <= 90 + theta_i.max()]
    azimuths = np.arange(0, 360 if sided else 180 + STEP, STEP)
    return grid("specular", **axes, theta_i=theta_i, phi_s=azimuths, theta_s=radial)


def _thinned(angles: npt.NDArray[np.float64], step: float) -> npt.NDArray[np.float64]:
    """The distinct angles; where there are more than MOST_ANGLES, those of a regular grid over their range [deg]."""
    distinct = np.unique(angles)
    if len(distinct) <= MOST_ANGLES:
        return distinct
    return np.arange(np.ceil(distinct[0] / step), np.floor(distinct[-1] / step) + 1) * step


def _write(scan: xr.Dataset, path: Path) -> None:
    if unit(scan) == RELATIVE:
        raise ValueError("a Zemax BSDF is in 1/sr: calibrate the relative values first")
    mode = np.unique(scan["mode"].values) if "mode" in scan.coords else np.array(["reflection"])
    if len(mode) > 1:
        raise ValueError("a Zemax BSDF holds reflection or transmission: select one mode")
    brdf = _on_file_axes(scan)
    dims = tuple(str(d) for d in brdf.dims)
    axes = {d: brdf[d].values.astype(float) if d in dims else np.zeros(1) for d in DIMS[1:]}
    values = brdf.values.reshape(-1, *(len(axes[d]) for d in DIMS[1:]))
    if np.isinf(values).any():
        raise ValueError("the scan holds infinite values: mask or correct them")
    _refuse_gaps(brdf, scan)
    names = CHANNELS["XYZ" if "channel" in dims else "Monochrome"]
    tis = _stored_tis(scan, dims, values.shape[:3])
    if tis is None:
        tis = _integral(values, scan["theta_r"].transpose(*[d for d in dims if d != "channel"]).values, axes, scan)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.writelines(f"# {line}\n" for line in scan.attrs.get("provenance", "").splitlines())
        file.writelines(f"# {_HISTORY}{line}\n" for line in scan.attrs.get("history", "").splitlines())
        file.write(f"Source\tMeasured\nSymmetry\t{_symmetry(scan, axes, dims)}\n")
        file.write(f"SpectralContent\t{'XYZ' if len(names) > 1 else 'Monochrome'}\n")
        file.write(f"ScatterType\t{'BTDF' if mode[0] == 'transmission' else 'BRDF'}\n")
        for keyword, axis in AXES.items():
            file.write(f"{keyword}\t{len(axes[axis])}\n{_tabbed(axes[axis])}\n")
        for name, of_channel, its_tis in zip(names, np.nan_to_num(values), tis, strict=True):
            file.write(f"\n{name}\nDataBegin\n")
            for index in np.ndindex(of_channel.shape[:2]):
                file.write(f"TIS\t{_tabbed([its_tis[index]])}\n")
                file.writelines(f"{_tabbed(row)}\n" for row in of_channel[index])
            file.write("DataEnd\n")


def _tabbed(numbers: npt.ArrayLike) -> str:
    """Numbers with as many digits as they need, separated by tabs, as Zemax asks."""
    return "\t".join(repr(v).removesuffix(".0") for v in np.asarray(numbers, dtype=float).tolist())


def _on_file_axes(scan: xr.Dataset) -> xr.DataArray:
    """The BRDF with the file's dimensions in the file's order. Raises ValueError for other dimensions."""
    brdf = scan["brdf"]
    brdf = brdf.squeeze([d for d in SETS if d in brdf.dims and brdf.sizes[d] == 1])
    if extra := [str(d) for d in brdf.dims if d not in DIMS]:
        remedy = "convert the scan, which resamples it" if extra == ["direction"] else "select one of each"
        raise ValueError(f"a Zemax BSDF is a grid about the specular direction, not over {', '.join(extra)}: {remedy}")
    if lacking := [d for d in DIMS[2:] if d not in brdf.dims]:
        raise ValueError(f"a Zemax BSDF needs the axes theta_i, phi_s and theta_s; {', '.join(lacking)} is not there")
    if "channel" in brdf.dims:
        if sorted(brdf["channel"].values.tolist()) != ["X", "Y", "Z"]:
            raise ValueError("a Zemax BSDF has the channels X, Y and Z or none: select one channel, or convert to XYZ")
        brdf = brdf.sel(channel=["X", "Y", "Z"])
    brdf = brdf.transpose(*[d for d in DIMS if d in brdf.dims])
    for axis in (d for d in DIMS[1:] if d in brdf.dims):
        angles, (low, high) = brdf[axis].values, RANGES[axis]
        if (np.diff(angles) <= 0).any() or angles.min() < low or angles.max() > high:
            raise ValueError(f"{axis} must ascend, within {low:g} to {high:g} deg")
    return brdf


def _refuse_gaps(brdf: xr.DataArray, scan: xr.Dataset) -> None:
    above = scan["theta_r"].broadcast_like(brdf).transpose(*brdf.dims).values <= HORIZON
    if gaps := int((np.isnan(brdf.values) & above).sum()):
        raise ValueError(f"{gaps} values above the horizon are missing: a Zemax BSDF cannot say so; fill them first")


def _symmetry(scan: xr.Dataset, axes: dict[str, npt.NDArray[np.float64]], dims: tuple[str, ...]) -> str:
    halved = axes["phi_s"].max() <= 180.0
    if scan.attrs.get("symmetry", "plane-symmetrical" if halved else "") in ("plane-symmetrical", "isotropic"):
        return "PlaneSymmetrical"
    return "Asymmetrical4D" if "phi_i" in dims else "Asymmetrical"


def _stored_tis(scan: xr.Dataset, dims: tuple[str, ...], shape: tuple[int, ...]) -> npt.NDArray[np.float64] | None:
    """The TIS that was read with the values; None where the scan does not have it for each table."""
    if "tis" not in scan or set(scan["tis"].dims) != set(dims[:-2]) or not np.isfinite(scan["tis"].values).all():
        return None
    stored = scan["tis"].sel(channel=["X", "Y", "Z"]) if "channel" in dims else scan["tis"]
    return np.asarray(stored.transpose(*dims[:-2]).values, dtype=float).reshape(shape)


def _integral(
    values: npt.NDArray[np.float64],
    theta_r: npt.NDArray[np.float64],
    axes: dict[str, npt.NDArray[np.float64]],
    scan: xr.Dataset,
) -> npt.NDArray[np.float64]:
    """Total integrated scatter (TIS): the integral of f cos(theta_r) over the stored directions.

    It uses the trapezoidal rule in the angles about the specular direction. Azimuths within 0 to 180 of a
    plane-symmetrical table count for both sides; others close the circle.
    """
    cosine = np.clip(np.cos(np.radians(theta_r)), 0.0, None).reshape(1, *values.shape[1:])
    phi, theta = np.radians(axes["phi_s"]), np.radians(axes["theta_s"])
    along = _trapezoid(np.nan_to_num(values) * cosine * np.sin(theta), theta)
    if phi[-1] <= np.pi and _symmetry(scan, axes, ()) == "PlaneSymmetrical":
        return 2.0 * _trapezoid(along, phi)
    return _trapezoid(np.concatenate([along, along[..., :1]], axis=-1), np.append(phi, phi[0] + 2 * np.pi))


def _trapezoid(y: npt.NDArray[np.float64], x: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Integral over the last axis."""
    return np.asarray(((y[..., 1:] + y[..., :-1]) / 2 * np.diff(x)).sum(axis=-1))


FORMAT = Format(
    name="zemax",
    title="Zemax BSDF",
    suffix=".bsdf",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    holds=Holds(
        anisotropic=True, transmission=True, sets=("channel",), channels=(("X", "Y", "Z"),), variables=("tis",)
    ),
)

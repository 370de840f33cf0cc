"""Tables of any model in every format of measured data that gonio writes: a target for each, of the format's name.

The model is evaluated at the directions that the format stores, on a grid chosen from the width of its own lobe. The
file is read back and compared with the model, and one that is too far off is refused.
"""

import xarray as xr

from gonio.exporting.heading import heading
from gonio.exporting.subject import Subject
from gonio.exporting.tabulating import Error, error_of, lobe_of, table_of, told, written
from gonio.exporting.target import Made, Proof, Request, Target
from gonio.files import FormatError
from gonio.formats import formats
from gonio.formats.format import Format
from gonio.resampling.hemisphere import Reflectance, excessive, reflectances
from gonio.resampling.lobes import HORIZON_AT

FINER = (1.0, 2.0)  # times: the grid from the model's own width, and a finer one where that is not enough
OTHERS = {"fred": "fred-table", "radiance": "radiance-xml"}  # targets of these names write a program's own models
FOLDER = "zarr"


def name_of(target: Format) -> str:
    """What `--to` calls the table: as the format, unless that is a target with models of its own."""
    return OTHERS.get(target.name, target.name)


def _made(target: Format, subject: Subject, request: Request) -> Made:
    lobe = lobe_of(subject)
    lines = heading(subject, f"{subject.model.title} as {target.title}")
    for fineness in FINER:
        scan, left_out = table_of(subject, target, lobe, fineness)
        content, read_back = written(told(scan, lines, subject.model.name), target, request.out.name)
        error = error_of(subject, read_back)
        if error.rms <= request.worst:
            break
    if not error.rms <= request.worst:
        grid = " x ".join(f"{n} {str(d).replace('_', ' ')}" for d, n in scan["brdf"].sizes.items())
        raise ValueError(
            f"{request.out}: the {target.title} would differ from {subject.model.name} by {100 * error.rms:.3g} % rms, "
            f"where --worst allows {100 * request.worst:.3g} %: the lobe is {2 * lobe.width:.2g} deg wide, and the "
            f"finest grid here is {grid}; use --to mitsuba, or a format with a finer grid, such as --to rgl"
        )
    files: dict[str, str | bytes] = {request.out.name: content}
    remarks = [f"left out: {line}" for line in left_out]
    remarks += _remarks(scan, target, lobe.last, error)
    if lines[0] not in f"{read_back.attrs.get('provenance', '')}\n{read_back.attrs.get('history', '')}":
        files[f"{request.out.name}.txt"] = "\n".join(lines) + "\n"
        remarks.append(
            f"the {target.title} has no place for text: what it is stands in {request.out.name}.txt beside it"
        )
    if (excess := excessive(_reflectances(read_back))) is not None:
        remarks.append(
            f"the table scatters {100 * excess.value:.4g} % of the light that falls on it, at {excess.where}"
        )
    numbers = {"values": int(scan["brdf"].size), "half_width_deg": lobe.width, **error.numbers}
    return Made(files, tuple(remarks), numbers)


def _remarks(scan: xr.Dataset, target: Format, last: float, error: Error) -> list[str]:
    found = [target.remark(scan)] if target.remark is not None else []
    if target.means is not None:
        found.append(
            "values are means over pairs of patches, which keep the energy: at one direction the model differs"
        )
    elif "theta_i" in scan["brdf"].dims and scan["theta_i"].dims == ("theta_i",):
        end = float(scan["theta_i"].max())
        if last < 90.0 and end <= last:
            found.append(f"incidence ends at {end:g} deg: beyond, the model grows without bound")
        elif end < 89.0:
            found.append(f"incidence ends at {end:g} deg, as in every file of this format")
    if target.means is None:
        found.append(f"within {90 - HORIZON_AT:g} deg of the horizon, values are those at that distance from it")
    if error.lost:
        found.append(f"read back, {100 * error.lost:.2g} % of directions have no value: those close to the horizon")
    return [line for line in found if line]


def _reflectances(read_back: xr.Dataset) -> list[Reflectance]:
    return [] if read_back["brdf"].dims == ("direction",) else reflectances(read_back)


def _checked(target: Format, subject: Subject, request: Request) -> Proof:
    try:
        error = error_of(subject, target.read(request.out))
    except FormatError as wrong:
        raise ValueError(f"{request.out}: cannot be read back: {wrong}") from wrong
    return Proof("read back by gonio at random directions, rms over that of the model", error.rms, request.worst)


def _target(target: Format) -> Target:
    refused = ""
    if target.name == FOLDER:
        refused = "it is a folder, and an export is a file: use --to netcdf, and `gonio convert table.nc table.zarr`"
    elif target.holds.quantity or "reflection" not in target.holds.modes:
        refused = f"it holds {target.holds.quantity or target.holds.modes[0]}, and a model is a BRDF: use --to integra"
    return Target(
        name_of(target),
        target.title,
        (target.suffix,),
        "a table of values, on a grid as fine as the lobe is narrow",
        lambda subject, request: _made(target, subject, request),
        lambda subject, request: _checked(target, subject, request),
        refused,
        is_table=True,
    )


TARGETS = tuple(_target(target) for target in formats().values() if target.write is not None)

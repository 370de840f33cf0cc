"""Text files of the BRDF library ALTA: a header of lines that start with `#`, then one pair of directions per row.

    #DIM 3 1
    #PARAM_IN  ISOTROPIC_TV_TL_DPHI
    #PARAM_OUT INV_STERADIAN
    0.5 0.7853981633974483 3.141592653589793 0.02

The layout is that of ALTA's own reader (data_storage.cpp). A row has as many coordinates and values as DIM states;
PARAM_IN names the coordinates, parametrisations.py converts them. With `#VS 1` the half width of an interval about the
first value follows, with `#VS 2` its two ends; they are kept as brdf_lower and brdf_upper. Angles are rounded to 1e-10
deg, so that a file that is read, written and read again gives the same angles.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.rows import Rows
from gonio.door.text import lines
from gonio.files import FormatError
from gonio.formats.alta.header import CHANNELS, WITH_COSINE, AltaHeader, header_of, recognises
from gonio.formats.alta.parametrisations import Parametrisation, angles, impossible
from gonio.formats.format import Format, Holds
from gonio.measured.dataset import ABSOLUTE, HORIZON, add_history, flatten, make_scan, sets, unit

Values = npt.NDArray[np.float64]
Place = Callable[[int], str]  # from a row to its place in the file

BOUNDS = ("brdf_lower", "brdf_upper")
GRAZING = 1e-9  # cosine; below it the direction is at the horizon, and a quotient by it is meaningless
_HISTORY = "history: "


def _read(path: Path) -> xr.Dataset:
    header, rest = header_of(path, lines(path))
    interval = header.whole_number("VS", 0, 2, "0")
    size, count = header.parametrisation.size, max(len(header.channels), 1)
    names = [f"coordinate {k + 1}" for k in range(size)] + [f"value {k + 1}" for k in range(count)]
    rows = Rows(path, names + ["half width"] * (interval == 1) + ["lower end", "upper end"] * (interval == 2))
    for line, text in rest:
        if text.startswith("#"):
            header.take(line, text)
        elif words := text.split():
            rows.add(line, words)
    where, table = rows.table()
    return scan_of(header, table, lambda k: f"line {where[k]}", where)


def scan_of(header: AltaHeader, table: Values, place: Place, where: npt.NDArray[np.int64] | None) -> xr.Dataset:
    """The scan of the rows (n, coordinates + values + interval) of a file of text or binary numbers.

    `place` names a row in messages; `where` has the line of each row, None in a binary file. Raises FormatError for
    directions that cannot be, and where every value is zero.
    """
    size, count = header.dim
    parametrisation, channels, cosine = header.parametrisation, header.channels, header.text("PARAM_OUT") == WITH_COSINE
    angular, above = _directions(header, parametrisation, table[:, :size], place)
    table, brdf = table[above], table[above, size : size + count].T.copy()
    bounds = _bounds(header, table)
    history = [parametrisation.assumes] if parametrisation.assumes else []
    if lost := int((~above).sum()):
        history.append(f"left out {lost} rows whose directions lie below the horizon")
    if cosine:
        history.append(_without_cosine([brdf, *bounds.values()], angular[1]))
    if not np.any(np.nan_to_num(brdf)):
        raise FormatError(header.path, "every brdf value is zero or below the horizon", place(0))
    theta_i, theta_r, phi, phi_i = (np.tile(a, count) for a in angular)
    empty = np.full((count - 1) * len(table), np.nan)
    variables = {name: (np.concatenate([ends, empty]), ABSOLUTE) for name, ends in bounds.items()}
    scan = make_scan(
        theta_i,
        theta_r,
        brdf.ravel(),
        phi,
        phi_i=phi_i if parametrisation.turns else None,
        coordinates={"channel": np.repeat(channels, len(table))} if channels else {},
        variables=variables | ({} if where is None else {"line": (np.tile(where[above], count), "1")}),
        provenance="\n".join(r for r in header.remarks if not r.startswith(_HISTORY)),
        history="\n".join(r.removeprefix(_HISTORY) for r in header.remarks if r.startswith(_HISTORY)),
    )
    for line in history:
        scan = add_history(scan, line)
    return scan.assign_attrs(stored="BRDF x cos(theta_r)") if cosine else scan


def _directions(
    header: AltaHeader, parametrisation: Parametrisation, x: Values, place: Place
) -> tuple[list[Values], npt.NDArray[np.bool_]]:
    """theta_i, theta_r, phi and phi_i [deg] of the rows above the horizon, and the mask of these rows."""
    name = header.text("PARAM_IN")
    if (wrong := impossible(name, x)).any():
        row = int(wrong.argmax())
        numbers = " ".join(f"{v:g}" for v in x[row])
        raise FormatError(header.path, f"{numbers} is no {name}; ALTA's angles are in radians", place(row))
    degrees = angles(parametrisation, x)
    above = (degrees[0] <= HORIZON) & (degrees[1] <= HORIZON)
    if not above.all() and not (parametrisation.dips and above.any()):
        row = int((~above).argmax())
        message = (
            f"theta_i is {degrees[0][row]:g} and theta_r {degrees[1][row]:g} deg: a direction lies below the horizon"
        )
        raise FormatError(header.path, message, place(row))
    return [a[above] for a in degrees], above


def _bounds(header: AltaHeader, table: Values) -> dict[str, Values]:
    """The ends of the interval about the first value of each row; empty where the file has no intervals."""
    kind, value = header.whole_number("VS", 0, 2, "0"), table[:, header.dim[0]]
    if kind == 0:
        return {}
    ends = (value - table[:, -1], value + table[:, -1]) if kind == 1 else (table[:, -2].copy(), table[:, -1].copy())
    return dict(zip(BOUNDS, ends, strict=True))


def _without_cosine(values: list[Values], theta_r: Values) -> str:
    """Divide by cos(theta_r) in place; values at the horizon become gaps. Returns a line for the history."""
    cosine = np.cos(np.radians(theta_r))
    grazing = cosine < GRAZING
    for array in values:
        array /= np.where(grazing, np.nan, cosine)
    lost = f"; {int(grazing.sum())} directions at the horizon have no value" if grazing.any() else ""
    return f"divided by cos(theta_r){lost}"


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write the scan. Raises ValueError for what `stored` refuses."""
    header, comments, table = stored(scan)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"#{key} {value}\n" for key, value in header.items())
        file.writelines(f"# {line}".rstrip() + "\n" for line in comments)
        file.writelines("\t".join(map(repr, row)) + "\n" for row in table.tolist())


def stored(scan: xr.Dataset) -> tuple[dict[str, str], list[str], Values]:
    """The keys of the header, the comments, and the rows of a file.

    Raises ValueError for relative data, gaps, several sets, and channels without a common list of directions.
    """
    if unit(scan) != ABSOLUTE:
        raise ValueError("an ALTA file does not say that values are relative: calibrate the scan first")
    flat = flatten(scan)
    if others := [name for name in sets(flat) if name != "channel"]:
        raise ValueError(f"an ALTA file holds one set of directions: select one {' and one '.join(others)}")
    output, parts = _parts(flat)
    values = [part["brdf"].values.astype(float) for part in parts]
    if not np.isfinite(values).all():
        raise ValueError("an ALTA file has no gaps: leave missing values out")
    name, x = _coordinates(parts[0])
    ends = _ends(parts)
    header = {"DIM": f"{x.shape[1]} {len(values)}", "PARAM_IN": name, "PARAM_OUT": output}
    past = [_HISTORY + line for line in flat.attrs.get("history", "").splitlines()]
    comments = [*flat.attrs.get("provenance", "").splitlines(), *past]
    return header | ({"VS": "2"} if ends else {}), comments, np.column_stack([x, *values, *ends])


def _parts(flat: xr.Dataset) -> tuple[str, list[xr.Dataset]]:
    """The value of PARAM_OUT, and the scan of each channel, all at the same directions."""
    if sets(flat) != ("channel",):
        return "INV_STERADIAN", [flat]
    names = list(dict.fromkeys(flat["channel"].values.tolist()))
    numbered = [str(k + 1) for k in range(len(names))]
    known = {**CHANNELS, "INV_STERADIAN": tuple(numbered)}
    output = next((o for o, c in known.items() if sorted(c) == sorted(names)), "")
    if not output:
        raise ValueError(f"an ALTA file has the channels R G B or X Y Z, not {' '.join(map(str, names))}: select one")
    parts = [flat.isel(direction=np.flatnonzero(flat["channel"].values == name)) for name in known[output]]
    for part in parts[1:]:
        for angle in ("theta_i", "theta_r", "phi", "phi_i"):
            if angle in flat.coords and not np.array_equal(part[angle].values, parts[0][angle].values):
                raise ValueError("the channels of an ALTA file share their directions, in the same order: select one")
    return output, parts


def _coordinates(part: xr.Dataset) -> tuple[str, Values]:
    """A parametrisation without loss, by name, and the directions [rad] in it: four angles where the scan has phi_i."""
    degrees = {name: part[name].values.astype(float) for name in ("theta_i", "theta_r", "phi", "phi_i") if name in part}
    theta_l, theta_v, phi = (np.radians(degrees[name]) for name in ("theta_i", "theta_r", "phi"))
    if "phi_i" not in degrees:
        return "ISOTROPIC_TV_TL_DPHI", np.column_stack([theta_v, theta_l, -phi])
    phi_v = np.radians(degrees["phi_i"] + degrees["phi"])
    return "SPHERICAL_TL_PL_TV_PV", np.column_stack([theta_l, np.radians(degrees["phi_i"]), theta_v, phi_v])


def _ends(parts: list[xr.Dataset]) -> list[Values]:
    """The ends of the interval about the first value; empty where the scan has none."""
    if not all(name in parts[0] for name in BOUNDS):
        return []
    if any(np.isfinite(part[name].values).any() for part in parts[1:] for name in BOUNDS):
        raise ValueError("an ALTA file has intervals about its first value only: select one channel")
    ends = [parts[0][name].values.astype(float) for name in BOUNDS]
    if not np.isfinite(ends).all():
        raise ValueError("an ALTA file has an interval about every value or about none: leave brdf_lower and upper out")
    return ends


FORMAT = Format(
    name="alta",
    title="ALTA text",
    suffix=".alta",
    recognises=lambda head: recognises(head, binary=False),
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, sets=("channel",), variables=BOUNDS),
)

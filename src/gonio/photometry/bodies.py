"""Bodies of facets as TOML files, which name areas, normals, and fits or models.

    [[facet]]
    name = "chassis"
    area = 3.64                      # m^2
    normal = [0, 0, -1]
    fit = "chassis/solution.nc"      # as seen from the file; or model = "lambert" and values = {rho = 0.3}

`select` chooses a set of a fit or weighs several in the band, and `along` is a vector along the x axis of a surface
that has a direction.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gonio.door.text import whole
from gonio.files import FormatError
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.outside import nearest, printable
from gonio.photometry.facets import Facet

LARGEST = 100_000_000  # bytes: some 500 000 facets
KEYS = ("name", "area", "normal", "along", "fit", "model", "values", "select")


def read_facets(path: str | Path, models: Mapping[str, Model]) -> list[Facet]:
    """The facets of a file, by the models of that mapping, such as `gonio.catalogue`.

    Raises FormatError with the facet that is wrong, and as a fit that is named raises it.
    """
    path = Path(path)
    text = whole(path, LARGEST)
    try:
        stated = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise FormatError(path, f"is no TOML: {error}") from error
    rows = stated.pop("facet", None)
    if stated:
        raise FormatError(path, f"states {printable(next(iter(stated)))}, and only [[facet]] tables are read")
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise FormatError(path, "holds no [[facet]] table: each facet is one, with area, normal, and fit or model")
    fits: dict[Path, Solution] = {}
    return [_facet(path, number, row, models, fits) for number, row in enumerate(rows, start=1)]


def fits_named(path: str | Path) -> list[Path]:
    """The files of fits that a file of facets names, as seen from here; none where it cannot be read."""
    path = Path(path)
    try:
        rows = tomllib.loads(whole(path, LARGEST)).get("facet", [])
        return [path.parent / row["fit"] for row in rows if isinstance(row.get("fit"), str)]
    except (ValueError, AttributeError, TypeError, RecursionError):
        return []


def _facet(
    path: Path, number: int, row: dict[str, Any], models: Mapping[str, Model], fits: dict[Path, Solution]
) -> Facet:
    """One facet. Fits are read once each, so that facets of one fit err together."""
    place = f"facet {number}"
    if unknown := [key for key in row if key not in KEYS]:
        raise FormatError(
            path, f"has {printable(unknown[0])!r}, which no facet has ({nearest(unknown[0], KEYS)})", place
        )
    if lacking := [key for key in ("area", "normal") if key not in row]:
        raise FormatError(path, f"has no {lacking[0]}: add it", place)
    if ("fit" in row) == ("model" in row):
        raise FormatError(path, "needs either fit, the file of one, or model, a name", place)
    numbers = {"area": row["area"], **_listed(path, place, row)}
    if not _is_number(row["area"]):
        raise FormatError(path, f"area is {printable(str(row['area']))!r}, not a number of square metres", place)
    for key in ("values", "select"):
        if not isinstance(row.get(key, {}), dict):
            raise FormatError(path, f"{key} is no table: write {key} = {{name = value}}", place)
    values = row.get("values", {})
    if wrong := [name for name, value in values.items() if not _is_number(value)]:
        raise FormatError(
            path, f"values has {printable(wrong[0])} = {printable(str(values[wrong[0]]))!r}, no number", place
        )
    brdf = _fit(path, place, row["fit"], fits) if "fit" in row else _model(path, place, row["model"], models)
    try:
        name = str(row.get("name", ""))
        return Facet(**numbers, brdf=brdf, values=values, select=row.get("select", {}), name=name)
    except (ValueError, TypeError) as error:
        raise FormatError(path, str(error), place) from error


def _listed(path: Path, place: str, row: dict[str, Any]) -> dict[str, list[float]]:
    """The vectors of a facet."""
    found: dict[str, list[float]] = {}
    for key in ("normal", "along"):
        if key in row:
            vector = row[key]
            if not isinstance(vector, list) or len(vector) != 3 or not all(map(_is_number, vector)):
                raise FormatError(path, f"{key} is no vector: write {key} = [x, y, z]", place)
            found[key] = [float(v) for v in vector]
    return found


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _fit(path: Path, place: str, name: Any, fits: dict[Path, Solution]) -> Solution:
    if not isinstance(name, str):
        raise FormatError(path, "fit is no name of a file", place)
    file = path.parent / name
    if file not in fits:
        if not file.exists():
            raise FormatError(path, f"names the fit {printable(name)}, and there is no such file beside it", place)
        fits[file] = Solution.load(file)
    return fits[file]


def _model(path: Path, place: str, name: Any, models: Mapping[str, Model]) -> Model:
    if not isinstance(name, str) or name not in models:
        raise FormatError(path, f"there is no model {printable(str(name))!r} ({nearest(str(name), models)})", place)
    return models[name]

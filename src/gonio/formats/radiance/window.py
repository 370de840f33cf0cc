"""The XML of the programs Radiance and WINDOW (WindowElement): matrices over Klems patches, and tensor trees.

The layout is that of Radiance's readers, bsdf_m.c for matrices and bsdf_t.c for tensor trees. A matrix has a column for
each incident patch and a row for each outgoing one; with IncidentDataStructure Rows it is transposed. The format does
not interpolate: a patch or cell has one value, which `evaluate` returns for every direction in it.

Sides are named as in the file: `Reflection Front` is the front. Radiance's programs call that side the back, since
their z axis points away from it. Here z is the normal of the front, so that directions are Radiance's after half a turn
about x: the column of azimuth a has light from phi_i = 180 - a, the row of azimuth b goes to phi_r = -b. Both hold for
either side, as azimuths are about the front's normal.

An opaque scan that names no side is written for both (sides.py).

Radiance reads only the wavelength called Visible. PyWinCalc reads Visible and Solar, refuses a file with any other, and
needs both, in all four directions on Klems Full, for a glazing system. So one wavelength or channel is written as
Visible. Elements of the material, and spectra of source and detector, are lines of provenance such as `TIR: 0.1`, and
are written from such lines.
"""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.elements import Element, parse
from gonio.door.text import MOST_VALUES, clip
from gonio.formats.format import Evaluate, Format, Holds, Means
from gonio.formats.radiance import blocks as window_blocks
from gonio.formats.radiance import klems, patch_means, sides, tensor_tree
from gonio.formats.radiance.klems import Basis
from gonio.measured.dataset import ABSOLUTE, AXES, PARAMETERISATION, SETS, add_history, make_scan

LONGEST_NUMBER = 100  # characters, with the white space around the number
NAME = "radiance"
LEVEL = "level"  # variable of a tree: the level of each cell
_RANKS = {"tensortree3": 3, "tensortree4": 4}
_INCIDENT, _OUTGOING = "incident_basis", "outgoing_basis"
Array = npt.NDArray[np.float64]


def _read(path: Path) -> xr.Dataset:
    root, remarks = parse(path)
    if root.tag != "WindowElement":
        raise root.wrong(f"the root element is {clip(root.tag)}, not WindowElement")
    optical = root.child("Optical")
    layer = optical.child("Layer")
    definition = layer.child("DataDefinition")
    structure = definition.word("IncidentDataStructure")
    blocks, left_out = window_blocks.blocks(layer)
    if len(optical.all("Layer")) > 1:
        left_out = [*left_out, "left out the layers after the first"]
    if structure.lower() in ("columns", "rows"):
        scan = _matrices(definition, blocks, structure.lower() == "rows")
    elif structure.lower() in _RANKS:
        scan = _trees(blocks, _RANKS[structure.lower()])
    else:
        message = f"IncidentDataStructure is {clip(structure)!r}, not Columns, Rows, TensorTree3 or TensorTree4"
        raise definition.child("IncidentDataStructure").wrong(message)
    if not np.any(np.nan_to_num(scan["brdf"].values)):
        raise blocks[0].data.wrong("every brdf value is zero: the layer scatters nothing, or the data are wrong")
    if layer.find("Geometry") is not None and layer.child("Geometry").children:
        left_out = [*left_out, "left out Geometry, the shape of the layer"]
    scan.attrs["provenance"] = "\n".join([*remarks, *window_blocks.about(layer)])
    for line in left_out:
        scan = add_history(scan, line)
    return scan


def _in_order(values: Iterable[str | float]) -> list[str | float]:
    return list(dict.fromkeys(values))


def _matrices(definition: Element, blocks: list[window_blocks.WavelengthDataBlock], by_rows: bool) -> xr.Dataset:
    """The Dataset (mode, side, channel or wavelength, incident, outgoing) of the matrices."""
    bases, remarks = window_blocks.bases(definition)
    incident = window_blocks.basis(blocks[0].element, "ColumnAngleBasis", bases)
    outgoing = window_blocks.basis(blocks[0].element, "RowAngleBasis", bases)
    axes = [_in_order(v) for v in zip(*((b.mode, b.side, b.wavelength) for b in blocks), strict=True)]
    shape = (*map(len, axes), incident.size, outgoing.size)
    if math.prod(shape) > MOST_VALUES:
        raise blocks[0].element.wrong(f"the matrices together would hold more than {MOST_VALUES} values")
    values = np.full(shape, np.nan)
    for b in blocks:
        both = (
            window_blocks.basis(b.element, "ColumnAngleBasis", bases),
            window_blocks.basis(b.element, "RowAngleBasis", bases),
        )
        if both != (incident, outgoing):
            raise b.element.wrong("the angle bases differ from those of the first block")
        if len(b.data.text) > LONGEST_NUMBER * incident.size * outgoing.size + LONGEST_NUMBER:
            raise b.data.wrong(f"ScatteringData is longer than {outgoing.size} x {incident.size} values need")
        numbers = tensor_tree.numbers(b.data, b.data.text)
        if numbers.size != incident.size * outgoing.size:
            message = f"ScatteringData holds {numbers.size} values, not {outgoing.size} x {incident.size}"
            raise b.data.wrong(f"{message}; are there decimal commas?" if numbers.size else message)
        square = numbers.reshape((incident.size, -1) if by_rows else (outgoing.size, -1))
        at = tuple(axis.index(name) for axis, name in zip(axes, (b.mode, b.side, b.wavelength), strict=True))
        values[at] = square if by_rows else square.T
    scan = patches(incident, outgoing).assign_coords(_sets(*axes))
    dims = ("mode", "side", _spectral(axes[2]), "incident", "outgoing")
    scan = sides.kept_once(scan.assign(brdf=(dims, values, {"units": ABSOLUTE})), incident, outgoing)
    missing = math.prod(map(len, axes)) - len(blocks)
    for line in (*remarks, *([f"{missing} of the modes, sides and wavelengths have no data"] if missing else [])):
        scan = add_history(scan, line)
    return scan


def _spectral(names: list[str | float]) -> str:
    return "wavelength" if isinstance(names[0], float) else "channel"


def _sets(modes: list, sides: list, wavelengths: list) -> dict:
    spectral = _spectral(wavelengths)
    attrs = {"units": "nm"} if spectral == "wavelength" else {}
    return {"mode": ("mode", modes), "side": ("side", sides), spectral: (spectral, wavelengths, attrs)}


def patches(incident: Basis, outgoing: Basis) -> xr.Dataset:
    """The centres of the patches [deg]: coordinates theta_i, phi_i (incident), theta_r (outgoing) and phi (both)."""
    theta_i, column = incident.centres()
    theta_r, row = outgoing.centres()
    phi_i = (180.0 - column) % 360.0
    phi = (-row - phi_i[:, None]) % 360.0
    degree = {"units": "degree"}
    coords = {
        "theta_i": ("incident", theta_i, degree),
        "phi_i": ("incident", phi_i, degree),
        "theta_r": ("outgoing", theta_r, degree),
        "phi": (("incident", "outgoing"), phi, degree),
    }
    attrs = {"Conventions": "CF-1.11", "symmetry": "anisotropic", PARAMETERISATION: NAME, AXES: "incident outgoing"}
    return xr.Dataset(coords=coords, attrs=attrs | {_INCIDENT: str(incident), _OUTGOING: str(outgoing)})


def _trees(blocks: list[window_blocks.WavelengthDataBlock], rank: int) -> xr.Dataset:
    """The flat scan of the centres of the cells, with the level of each cell."""
    trees, total = [], 0
    for b in blocks:
        basis = b.element.word("AngleBasis")
        if basis.lower() != "lbnl/shirley-chiu":
            raise b.element.child("AngleBasis").wrong(f"AngleBasis is {clip(basis)!r}, not LBNL/Shirley-Chiu")
        trees.append(tensor_tree.leaves(b.data, rank))
        total += len(trees[-1][0])
        if total > MOST_VALUES:
            raise b.data.wrong(f"the trees together hold more than {MOST_VALUES} values")
    level, cell, values = (np.concatenate(v) for v in zip(*trees, strict=True))
    counts = [len(leaves[0]) for leaves in trees]
    names: dict[str, list] = {"mode": [b.mode for b in blocks], "side": [b.side for b in blocks]}
    names |= {_spectral([b.wavelength for b in blocks]): [b.wavelength for b in blocks]}
    theta_i, column, theta_r, row = tensor_tree.centres(level, cell)
    phi_i = (180.0 - column) % 360.0
    scan = make_scan(
        theta_i,
        theta_r,
        values,
        (-row - phi_i) % 360.0,
        phi_i=phi_i if rank == 4 else None,
        coordinates={name: np.repeat(v, counts) for name, v in names.items()},
        variables={LEVEL: (level.astype(np.int8), "1")},
    )
    scan.attrs |= {PARAMETERISATION: NAME, "symmetry": "anisotropic" if rank == 4 else "isotropic"}
    return scan


def evaluate(
    scan: xr.Dataset, theta_i: npt.ArrayLike, theta_r: npt.ArrayLike, phi: npt.ArrayLike, phi_i: npt.ArrayLike = 0.0
) -> Array:
    """The values (sets.., n) of the patches or cells that hold n directions [deg], NaN where none does.

    The sets of a matrix are its dimensions before `incident`; those of trees are the coordinates of SETS that the scan
    has, in that order, each sorted. Raises ValueError where the scan is neither.
    """
    arrays = (np.asarray(v, dtype=float) for v in (theta_i, theta_r, phi, phi_i))
    t_i, t_r, azimuth, turn = np.broadcast_arrays(*arrays)
    column, row = 180.0 - turn, -(turn + azimuth)
    if "incident" in scan.dims:
        incident, outgoing = _bases_of(scan)
        i, o = incident.index(t_i, column), outgoing.index(t_r, row)
        values = scan["brdf"].transpose(..., "incident", "outgoing").values[..., i, o]
        return np.where((i >= 0) & (o >= 0), values, np.nan)
    if LEVEL in scan:
        return _evaluate_trees(scan, (t_i, column, t_r, row))
    raise ValueError("the scan is no Klems matrix and no tensor tree")


def _evaluate_trees(scan: xr.Dataset, directions: tuple[Array, Array, Array, Array]) -> Array:
    names = [n for n in SETS if n in scan.coords]
    axes, places = zip(*(np.unique(scan[n].values, return_inverse=True) for n in names), strict=True)
    shape = tuple(len(axis) for axis in axes)
    of_set = np.ravel_multi_index(places, shape)
    level, values = scan[LEVEL].values.astype(np.int64), scan["brdf"].values
    phi_i = scan["phi_i"].values if "phi_i" in scan.coords else np.zeros(len(level))
    theta_i, theta_r, phi = (scan[n].values for n in ("theta_i", "theta_r", "phi"))
    rank = 4 if "phi_i" in scan.coords else 3
    cell = tensor_tree.cell_of(level, rank, theta_i, 180.0 - phi_i, theta_r, -(phi_i + phi))
    looked_up = np.full((math.prod(shape), *directions[0].shape), np.nan)
    for n in np.unique(of_set):
        in_set = of_set == n
        looked_up[n] = tensor_tree.look_up(level[in_set], cell[in_set], values[in_set], directions)
    return looked_up.reshape(*shape, *directions[0].shape)


def _bases_of(scan: xr.Dataset) -> tuple[Basis, Basis]:
    """The incident and outgoing basis with the scan's directions as patches. Raises ValueError where there is none."""
    if not {"incident", "outgoing"} <= set(scan.dims):
        raise ValueError("the scan has no dimensions incident and outgoing: convert it to Radiance XML")
    try:
        stated = [klems.from_text(scan.attrs[name]) for name in (_INCIDENT, _OUTGOING)]
    except (KeyError, ValueError):
        stated = []
    pairs = [(stated[0], stated[1])] if stated else [(b, b) for b in klems.BASES]
    for incident, outgoing in pairs:
        centres = patches(incident, outgoing)
        if all(
            centres[n].shape == scan[n].shape and np.allclose(centres[n], scan[n])
            for n in centres.coords
            if n in scan.coords
        ):
            return incident, outgoing
    raise ValueError("the scan's directions are those of no Klems basis: convert it to Radiance XML")


def _recognises(head: bytes) -> bool:
    return b"WindowElement" in head.replace(b"\0", b"") and b"<" in head


def _layout(scan: xr.Dataset) -> xr.Dataset:
    """The patches that the scan is on already, else those of Klems Full."""
    try:
        return patches(*_bases_of(scan))
    except ValueError:
        return patches(klems.FULL, klems.FULL)


def _means(onto: xr.Dataset, evaluate: Evaluate, turned: bool) -> Means:
    return patch_means.of_function(*_bases_of(onto), evaluate, turned)


def _exact_means(part: xr.Dataset, onto: xr.Dataset) -> Means | None:
    """The means of a tree over the patches; None for what is no tree."""
    if LEVEL not in part or part.attrs.get(PARAMETERISATION) != NAME:
        return None
    return Means(patch_means.of_tree(part, LEVEL, *_bases_of(onto)), 0, "exact sums over the cells of the tree")


def _reflectances(part: xr.Dataset) -> tuple[Array, Array, Array] | None:
    """theta_i and phi_i [deg] of incident patches, and the sums of value times projected solid angle of the outgoing.

    Of a tree these are means over the patches of Klems Full.
    """
    if LEVEL in part and part["brdf"].dims == ("direction",):
        incident = outgoing = klems.FULL
        means = patch_means.of_tree(part, LEVEL, incident, outgoing)
    else:
        try:
            incident, outgoing = _bases_of(part)
        except ValueError:
            return None
        means = part["brdf"].transpose("incident", "outgoing").values
    theta_i, column = incident.centres()
    finite = np.isfinite(means).all(axis=1)
    values = np.nan_to_num(means) @ outgoing.projected()
    return theta_i[finite], ((180.0 - column) % 360.0)[finite], values[finite]


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write matrices of the means over pairs of patches, whose centres are the directions that `layout` gives."""
    from gonio.formats.radiance import xml as window_xml

    bases = _bases_of(scan)
    with path.open("w", encoding="utf-8", newline="\n") as file:
        window_xml.write(file, scan.attrs, bases, _written_blocks(scan))


def _written_blocks(scan: xr.Dataset) -> list[tuple[str, str, list[tuple[str, Array]]]]:
    """Wavelength, unit, and named matrices (outgoing, incident) for each. Raises ValueError for a gap in a matrix."""
    spectral = next((n for n in ("wavelength", "channel") if n in scan.coords), None)
    names = [n for n in SETS if n in scan["brdf"].dims]
    if other := [n for n in names if n not in ("mode", "side", spectral)]:
        raise ValueError(f"Radiance XML does not tell several {' or '.join(other)} apart: select one")
    by_wavelength: dict[tuple[str, str], list[tuple[str, Array]]] = {}
    spectra: list[str | float] = np.atleast_1d(scan[spectral].values).tolist() if spectral else ["Visible"]
    for at in np.ndindex(*(scan.sizes[n] for n in names)):
        part = scan.isel(dict(zip(names, at, strict=True)))
        matrix = part["brdf"].transpose("outgoing", "incident").values
        if np.isnan(matrix).all():
            continue
        if not np.isfinite(matrix).all():
            raise ValueError("a patch has no value, and Radiance XML cannot store a gap: fill it first")
        mode, side = (
            str(part[n].values) if n in part.coords else d for n, d in (("mode", "reflection"), ("side", "front"))
        )
        if mode not in window_blocks.MODES or side not in window_blocks.SIDES:
            raise ValueError(
                f"mode {mode!r}, side {side!r}: Radiance XML knows reflection, transmission, front and back"
            )
        wavelength = part[spectral].values.item() if spectral else "Visible"
        matrices = by_wavelength.setdefault(_wavelength_text(wavelength, spectra), [])
        matrices.append((f"{mode.title()} {side.title()}", matrix))
        if sides.is_for_both(scan):
            matrices.append(("Reflection Back", sides.turned_over(matrix.T, *_bases_of(scan)).T))
    if not by_wavelength:
        raise ValueError("there is no value to write")
    return [(text, unit, matrices) for (text, unit), matrices in by_wavelength.items()]


def _wavelength_text(wavelength: str | float, spectra: list) -> tuple[str, str]:
    if not isinstance(wavelength, str):
        return f"{wavelength!r}", "Nanometer"
    if wavelength == "Y" and {"X", "Z"} <= set(spectra):
        return "Visible", "Integral"
    return next((text for text, name in window_blocks.CHANNELS.items() if name == wavelength), wavelength), "Integral"


FORMAT = Format(
    name=NAME,
    title="Radiance XML",
    suffix=".xml",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=_layout,
    means=_means,
    exact_means=_exact_means,
    reflectances=_reflectances,
    evaluate=evaluate,
    remark=sides.remark,
    holds=Holds(
        anisotropic=True,
        transmission=True,
        sets=("mode", "side", "channel", "wavelength"),
        alone="Visible",
        alone_among=("X", "Y", "Z"),
    ),
)

"""Which further readings would help a value that the data do not determine, and by how much.

Blocks of ten readings are tried all over the hemisphere's plane: one incidence angle, ten angles of the detector a
degree apart. With M the information of the scan by its own noise, and B that of a block, the standard uncertainty of
value k falls by the factor sqrt((M^-1)_kk / ((M + B)^-1)_kk), without a fit.
"""

import weakref
from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.design.candidates import nearest_to_beam, reachable
from gonio.design.known import Known
from gonio.design.question import undetermined
from gonio.fitting.certainty.identifiability import INFLATED
from gonio.fitting.solution import Solution
from gonio.measured.dataset import signed_theta_r

Values = npt.NDArray[np.float64]

BLOCK = 10  # readings, a degree apart
HELPS = 1.5  # times more certain: less is not worth a measurement
REACH = 85.0  # deg: beyond, goniometers see little
INCIDENCE = np.arange(10.0, 81.0, 10.0)  # deg, beside the angles of the scan
MOST_INCIDENCE = 20  # angles of a scan, beyond which a block at one more is little

_KNOWN: "weakref.WeakKeyDictionary[Solution, dict[str, str]]" = weakref.WeakKeyDictionary()


def remedy_of(solution: Solution) -> Callable[[str], str]:
    """What a further block of readings does for a value that trades off, in words that end a sentence, by its name.

    Empty where that cannot be said: for a fit that does not hold its scan, and one of several wavelengths or of smooth
    parameters. Nothing is computed before a value is asked for, and then kept as long as the solution.
    """

    def remedy(name: str) -> str:
        if solution not in _KNOWN:
            _KNOWN[solution] = _remedies(solution)
        return _KNOWN[solution].get(name, "")

    return remedy


def _remedies(solution: Solution) -> dict[str, str]:
    if not solution.has_scan or not len(solution.scan["brdf"]):
        return {}
    try:
        known = Known.of(solution)
        directions, noise = _around(solution), known.noise()
    except ValueError:  # no readings are designed for such a fit
        return {}
    measured, rows = known.rows(solution.scan, noise), known.rows(directions, noise)
    information = measured.T @ measured
    if undetermined(np.zeros((0, len(known.names))), information).any():
        return {}
    blocks = _blocks(directions)
    factors = _factors(information, rows[blocks])
    return {name: _words(directions, blocks, column) for name, column in zip(known.names, factors.T, strict=True)}


def _around(solution: Solution) -> xr.Dataset:
    """Directions in the plane of incidence, a degree apart, no nearer to the beam than the scan went.

    Incidence angles are those of the scan, and more where no parameter has a value for each of them.
    """
    scan = solution.scan
    grouped = {name for by in solution.dataset["by"].values.tolist() for name in by.split(",")}
    own = np.unique(np.round(scan["theta_i"].values, 6))[:MOST_INCIDENCE]
    angles = own if "theta_i" in grouped else np.unique(np.concatenate([own, INCIDENCE]))
    plane = scan.isel(direction=[0]).assign_coords(phi=("direction", [180.0]))
    return reachable(plane, angles.tolist(), (-REACH, REACH), blocked=nearest_to_beam(scan))


def _blocks(directions: xr.Dataset) -> npt.NDArray[np.intp]:
    """Places (blocks, BLOCK) of neighbours at one incidence angle, a degree apart."""
    theta_i, theta_r = directions["theta_i"].values, signed_theta_r(directions)
    first = np.arange(max(len(theta_i) - BLOCK + 1, 0))
    last = first + BLOCK - 1
    whole = (theta_i[first] == theta_i[last]) & (theta_r[last] - theta_r[first] < BLOCK)
    return np.asarray(first[whole][:, None] + np.arange(BLOCK), dtype=np.intp)


def _factors(information: Values, rows: Values) -> Values:
    """How many times surer each block (blocks, readings, values) makes each value: (blocks, values)."""
    length = np.sqrt(np.diag(information))
    scaled, rows = information / np.outer(length, length), rows / length
    before = np.diag(np.linalg.inv(scaled))
    after = np.linalg.inv(scaled + np.einsum("bra,brc->bac", rows, rows))
    return np.sqrt(before / np.einsum("baa->ba", after))


def _words(directions: xr.Dataset, blocks: npt.NDArray[np.intp], factors: Values) -> str:
    best = int(np.argmax(factors)) if len(factors) else 0
    if not len(factors) or factors[best] < HELPS:
        return f"no ten readings within {REACH:g} deg of the normal make it {HELPS:g} times more certain"
    some = directions.isel(direction=blocks[best])
    ends: Iterable[float] = signed_theta_r(some)[[0, -1]]
    low, high = ends
    times = f"{factors[best]:.0f}" if factors[best] > INFLATED else f"{factors[best]:.1f}"
    return (
        f"ten readings at theta_i {float(some['theta_i'][0]):g}, theta_r {low:g} to {high:g} deg would make it "
        f"{times} times more certain"
    )

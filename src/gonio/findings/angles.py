"""Angles in radians that are called degrees, and a zero of theta_r that is off."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.findings.clipped import RUN
from gonio.findings.curves import Curve
from gonio.findings.lobe import Width, lobe_of
from gonio.measured import dataset
from gonio.measured.check import Finding, Severity

Values = npt.NDArray[np.float64]

RIGHT_ANGLE, FULL_TURN = 1.5709, 6.2833  # rad, rounded up: what no polar angle, and no azimuth, is above in radians
FEW = 5  # angles from which nothing can be concluded
# deg: goniometers step by multiples of this. Angles that are such multiples as they stand are degrees; angles that are
# such multiples once taken for radians are radians, to the digits that a file of four decimals leaves.
ROUND, ROUNDED = 0.05, 0.004
ROUND_IN_DEGREES = 0.5  # deg: coarser, as finer multiples lie everywhere within the rounding of a file
# deg: half width h up to which the peak is at the mirror direction. A slope of ln f such as Fresnel's or that of a
# cosine, tan(theta) a radian, moves a Gaussian peak by h^2/(2 ln 2) tan(theta) pi/180, 0.3 deg at 45 deg for h = 5.
NARROW = 5.0
LEAST_SHIFT = 0.3  # deg: the alignment of good goniometers; real scans are off by as much
ALIKE = 0.25  # of the shift: how much it may differ between incidence angles. Off-specular peaks grow with tan(theta_i)
FARTHEST = 15.0  # deg: a peak farther off is another one
MOSTLY = 0.75  # of the incidence angles: how many must agree; the last may see the source or the horizon


def in_radians(columns: dict[str, Values]) -> list[str]:
    """Which of the columns theta_i, theta_r, phi [deg as they are called] hold radians.

    Both polar angles where none is above a quarter of a circle in radians, unless they are round in degrees; a column
    alone where its values are round in degrees once they are taken for radians, and are not as they stand.
    """
    polar = {name: columns[name] for name in ("theta_i", "theta_r")}
    small = 0 < max(values.max() for values in polar.values()) <= RIGHT_ANGLE
    if small:
        every = np.concatenate(list(polar.values()))
        many = len(every) > 2 * FEW and len(np.unique(polar["theta_r"])) > FEW
        small = many and not _round(every, ROUND, 1e-6)
    found = list(polar) if small else [name for name, v in polar.items() if _disguised(v, RIGHT_ANGLE)]
    turned = columns["phi"][columns["phi"] != 180.0]  # which a signed theta_r brings, in degrees
    return found + ["phi"] * _disguised(turned, FULL_TURN)


def _disguised(values: Values, most: float) -> bool:
    """Whether all values of a column are such as round angles in radians have."""
    if values.max(initial=0.0) > most:
        return False
    distinct = np.unique(values[values > 0])
    if len(distinct) < 2 or _round(distinct, ROUND, 1e-6):
        return False
    return _round(np.degrees(distinct), ROUND_IN_DEGREES, ROUNDED)


def _round(values: Values, step: float, within: float) -> bool:
    return bool((np.abs(values / step - np.round(values / step)) * step <= within).all())


def radians(flat: xr.Dataset) -> list[Finding]:
    """`radians` where angles are radians and called degrees."""
    columns = {name: flat[name].values.astype(float) for name in dataset.ANGLES}
    found = in_radians(columns)
    if not found:
        return []
    most = max(float(columns[name].max()) for name in found)
    if "theta_r" in found and "theta_i" in found:
        what = f"no polar angle is above {most:.5g} deg, a quarter of a circle being {np.pi / 2:.5g} rad"
    else:
        what = f"{' and '.join(found)}, up to {most:.5g} deg, would be round angles if taken for radians"
    names = " or ".join(f"{name}_rad" for name in found)
    remedy = f"if the angles are radians, give --radians, or name the columns so ({names})"
    return [Finding(Severity.WARNING, what, remedy, name="radians")]


def angle_zero_shifted(curves: list[Curve]) -> list[Finding]:
    """`angle-zero-shifted` where the lobe is off the mirror direction by the same angle at every incidence angle."""
    offsets: dict[float, list[float]] = {}
    steps = []
    for curve in curves:
        lobe = lobe_of(curve)
        k = int(np.argmax(curve.values))
        is_cut = (curve.values == curve.values[k]).sum() >= RUN
        if lobe.status is Width.BOTH and lobe.half_width <= NARROW and not is_cut:
            offsets.setdefault(curve.theta_i, []).append(lobe.theta_r - curve.theta_i)
            steps.append((curve.theta_r[k + 1] - curve.theta_r[k - 1]) / 2)
    if len(offsets) < 2:
        return []
    each = np.array([np.median(some) for some in offsets.values()])
    middle, least = float(np.median(each)), max(LEAST_SHIFT, float(np.median(steps)) / 2)
    agree = np.abs(each - middle) <= max(least / 2, ALIKE * abs(middle))
    if abs(middle) <= least or abs(middle) > FARTHEST or agree.mean() < MOSTLY:
        return []
    what = (
        f"the peak lies {abs(middle):.2f} deg {'beyond' if middle > 0 else 'short of'} the mirror direction at "
        f"{agree.sum()} of the {len(each)} incidence angles that have a narrow lobe"
    )
    remedy = (
        f"if the zero of theta_r is off, give --shift-theta-r {-middle:.2f}; a sample that was mounted tilted by half "
        "as much looks the same, and wants its theta_i mended too"
    )
    return [Finding(Severity.WARNING, what, remedy, name="angle-zero-shifted")]

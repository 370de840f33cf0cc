"""What the user states of a measurement, beside what its readings are compared with."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from gonio.reduction.steps.detector import Known
from gonio.reduction.steps.filling import Filling
from gonio.reduction.steps.signature import Signature


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """How readings are reduced, beside what they are compared with.

    fill: under, over or beam:W,R; without it the attribute `fill` of the readings. uncertainties: standard ones by
    cause. gains, filters: by the name of a range or filter. nonlinearity: the slope a by decade, and `level`, V0.
    drift: monitor, check or none. zero, tilt: of the arm and of the sample along and across the plane [deg], which
    the angles are corrected for. signature: of the instrument.
    """

    fill: Filling | None = None
    uncertainties: Mapping[str, float] = field(default_factory=dict)
    gains: Mapping[str, Known] = field(default_factory=dict)
    filters: Mapping[str, Known] = field(default_factory=dict)
    nonlinearity: float = 0.0
    level: float = 0.0
    drift: str = ""
    zero: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)
    signature: Signature | None = None

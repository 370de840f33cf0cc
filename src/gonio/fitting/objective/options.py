"""Everything that can be asked of a fit beside its model and its scan: each option once, with its default.

A new option is one more field here. It is then a field of every Problem, and a flag of every command that fits.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.objective.smooth import Smoothing
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.measured.instrument import IDEAL, Instrument
from gonio.options import Option, Panel, one_of

Values = npt.NDArray[np.float64]
Held = float | str | Mapping[str, float]
Grouping = Mapping[str, str | tuple[str, ...]]

MaterialName = Annotated[
    str,
    Option(
        "fix index and extinction at those of a material, such as gold, or of a file",
        flag="--material",
        metavar="NAME|FILE",
        panel=Panel.MODEL,
    ),
]
MaterialWavelength = Annotated[
    float | None,
    Option("wavelength for --material, where the scan names none", "--wavelength", "NM", panel=Panel.MODEL, above=0),
]


Weighting = Annotated[
    str,
    Option(
        f"how much each point counts: {one_of((AUTO, *WEIGHTINGS))}; {AUTO} chooses from the data, and says why",
        panel=Panel.WEIGHTS,
        names=(AUTO, *WEIGHTINGS),
    ),
]

Loss = Annotated[
    str,
    Option(
        f"how much a large error counts: {one_of(LOSSES)}; all but squared lessen outliers",
        panel=Panel.WEIGHTS,
        names=tuple(LOSSES),
    ),
]


@dataclass(frozen=True, kw_only=True, eq=False)
class ProblemOptions:
    """The options of a Problem.

    Parameters
    ----------
    held : mapping
        Parameters that keep a value given here, `{"kid": 24.0}`; for a grouped one, a mapping from each group's label
        to its value; `half-width` has it read from the scan (guo2023, section 2.1).
    grouped : mapping
        Parameters with one value for each value of one or more coordinates, `{"ks": "theta_i"}` (guo2023 Table 1).
    shared : tuple of str
        Weights with one value over all channels, wavelengths or scans. The others have one value a set, because colour
        scales what a surface reflects; shape parameters are shared over sets unless grouped, because they describe the
        surface.
    smooth : mapping
        Parameters with one value for each value of a coordinate that vary smoothly along it, with the strength of the
        penalty: `{"sigma": ("wavelength", 1e-5)}`, or "auto"; `objective.smooth` has the penalty.
    bounds : mapping
        Other bounds than the declared ones, by name; weights lie in 0..inf.
    dielectric, metal : bool
        What the surface is made of, for the models with `index` and `extinction`: a dielectric has an index of at
        least 1 and no extinction, a metal an extinction of at least 1. Without either they are free within the
        declared bounds, and a fit may end where no material lies.
    material : str
        Name or file of optical constants at which `index` and `extinction` are held, at the scan's wavelengths, or at
        `wavelength` where that is given.
    wavelength : float, optional
        The wavelength [nm] at which `material` is taken.
    weighting : str
        A name of WEIGHTINGS, or `auto`, which takes the one that the scan asks for (`automatic`).
    weighting_reason : str
        Why the scan asks for it, in words; empty where it was named.
    noise_floor : float
        For relative weighting, the BRDF below which the noise is constant, while it is proportional above: the
        constant standard deviation over the relative one. Values near zero then count for little, but none is dropped.
        Masking them instead cuts off those that noise made small, and biases the fit.
    loss : str
        A name of LOSSES, what a large error costs.
    instrument : Instrument
        The cones that source and detector take in, averaged into every term. The fitted values are those of the
        surface, not of what the instrument reads.
    g1, g2 : callable, optional
        Functions of theta_i and of theta_r [deg] that multiply the weights (eq 11).
    point_weights : array, optional
        Weights (points,) of the points in use, on top of all others; a fit under a robust loss sets them.

    """

    PANEL: ClassVar = Panel.MODEL
    held: Annotated[
        Mapping[str, Held],
        Option(
            "fix parameters at values instead of fitting them: sigma=0.14,kd=0; gamma=half-width fixes gamma at the "
            "half width of the scan's own lobe",
            "--hold",
            "NAME=VALUE",
            of_parameters=True,
        ),
    ] = field(default_factory=dict)
    grouped: Annotated[
        Grouping,
        Option(
            "fit one value of a parameter for each value of a coordinate: ks=theta_i, one for each incidence angle",
            "--group",
            "NAME=COORD",
            of_parameters=True,
        ),
    ] = field(default_factory=dict)
    shared: Annotated[
        tuple[str, ...],
        Option(
            "fit one value of this weight for all channels, wavelengths and scans, not one for each",
            "--share",
            "NAME",
            of_parameters=True,
        ),
    ] = ()
    smooth: Annotated[
        Smoothing,
        Option(
            "let a parameter vary smoothly along a coordinate: sigma=wavelength, or with a strength "
            "sigma=wavelength:1e-5",
            metavar="NAME=COORD",
            of_parameters=True,
        ),
    ] = field(default_factory=dict)
    bounds: Annotated[
        Mapping[str, tuple[float, float]],
        Option(
            "keep a parameter within these limits, not those of `gonio models`: gamma=5:90",
            "--bound",
            "NAME=LO:HI",
            of_parameters=True,
        ),
    ] = field(default_factory=dict)
    dielectric: Annotated[
        bool, Option("keep index at 1 or more and extinction at 0: paint, film, glass", panel=Panel.MODEL)
    ] = False
    metal: Annotated[bool, Option("keep extinction at 1 or more", panel=Panel.MODEL)] = False
    material: MaterialName = ""
    wavelength: MaterialWavelength = None
    weighting: Weighting = AUTO
    weighting_reason: str = ""
    noise_floor: Annotated[
        float,
        Option(
            "for relative weighting: BRDF below which the noise is constant",
            metavar="VALUE",
            panel=Panel.WEIGHTS,
            lowest=0,
        ),
    ] = 0.0
    loss: Loss = "squared"
    instrument: Instrument = IDEAL
    g1: Callable[[Values], Values] | None = None
    g2: Callable[[Values], Values] | None = None
    point_weights: Values | None = None

    def __post_init__(self) -> None:
        if self.weighting not in (AUTO, *WEIGHTINGS):
            raise ValueError(f"no weighting {self.weighting!r}: choose one of {', '.join((AUTO, *WEIGHTINGS))}")
        if self.loss not in LOSSES:
            raise ValueError(f"no loss {self.loss!r}: choose one of {', '.join(LOSSES)}")
        if not 0 <= self.noise_floor < math.inf:
            raise ValueError(f"noise_floor is {self.noise_floor:g}: give a BRDF of zero or more")
        if self.noise_floor and self.weighting != AUTO and not WEIGHTINGS[self.weighting].floored:
            raise ValueError(
                f"{self.weighting} weighting takes no noise floor: choose relative, or leave the floor out"
            )

    def given(self) -> dict[str, Any]:
        """Every option by name, as a Problem takes them; of a Problem too, without its model and data."""
        return {f.name: getattr(self, f.name) for f in fields(ProblemOptions)}

"""`gonio plan`: directions made into a plan of a measurement."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, ClassVar

from gonio.acquisition.layout import Layout, angles, grid, planned
from gonio.acquisition.plan import Conditions
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.views.measuring import planned as view
from gonio.files import refuse_existing
from gonio.options import Option, Panel

EXAMPLES = (
    Example(
        "gonio plan --theta-i 20:70:10 --theta-r -80:80:1 --check 0,45 --out new.toml",
        "Incidence angles from 20 to 70 deg, with a direction that shows drift",
    ),
    Example(
        "gonio plan --theta-i 30 --theta-r -60:60:5 --arm-half-width 20",
        "What an arm of 40 mm hides, and how long it takes; nothing is written",
    ),
    Example(
        "gonio plan --theta-i 10:80:10 --theta-r mirror --incident --out mirror.toml",
        "The mirror direction and the incident beam, as gonio verify needs them",
    ),
)
MIRROR = "mirror"
ANGLES = "DEG,..|FIRST:LAST:STEP"


@dataclass(frozen=True, kw_only=True)
class Besides:
    """Azimuths, and what is read beside the sample's directions; as text, and as the angles it names [deg]."""

    PANEL: ClassVar = Panel.MEASUREMENT
    phi: Annotated[
        str, Option("azimuths, where not in plane; theta_r is then from 0 on", metavar="DEG,..|FIRST:LAST:STEP")
    ] = ""
    check: Annotated[str, Option("read this direction again and again, to see drift", metavar="THETA_I,THETA_R")] = ""
    standard: Annotated[str, Option("read a standard at this direction, first and last", metavar="THETA_I,THETA_R")] = (
        ""
    )

    @property
    def azimuths(self) -> list[float]:
        """None where all is in plane."""
        return angles(self.phi, "--phi") if self.phi else []

    def added_to(self, layout: Layout) -> Layout:
        """The layout with the directions of check and standard."""
        return replace(
            layout, check=_direction(self.check, "--check"), standard=_direction(self.standard, "--standard")
        )


def _direction(text: str, flag: str) -> tuple[float, float] | None:
    """`0,45` as theta_i and signed theta_r [deg]; None for no text."""
    if not text:
        return None
    found = angles(text, flag)
    if len(found) != 2:
        raise ValueError(f"{flag} is {text!r}: give theta_i,theta_r, such as 0,45")
    return found[0], found[1]


def command(
    theta_i: Annotated[str, Option("incidence angles", metavar=ANGLES, panel=Panel.MEASUREMENT)],
    theta_r: Annotated[
        str,
        Option(
            "angles of the detector, signed: forward is positive; mirror for theta_r = theta_i",
            metavar=f"{ANGLES}|{MIRROR}",
            panel=Panel.MEASUREMENT,
        ),
    ],
    besides: Besides,
    layout: Layout,
    conditions: Conditions,
    output: OutputOptions,
    out: Annotated[Path | None, Option("write the plan to this file", metavar="PLAN.toml", panel=Panel.OUTPUT)] = None,
) -> None:
    """Plan a measurement: what, in which order, how long.

    The plan is a file of one line a reading, which can be edited. Incidence angles are outermost; the arm goes to and
    fro, so that slow drift does not line up with theta_r. Directions that the arm hides are left out and listed. Darks,
    the check direction, the incident beam and a standard are read first and last, and between where asked for.
    """
    if out is not None:
        refuse_existing(out, output.force)
    full, incidence = besides.added_to(layout), angles(theta_i, "--theta-i")
    if theta_r == MIRROR:
        plan = planned(((angle, angle, None) for angle in incidence), full, conditions)
    else:
        outward = angles(theta_r, "--theta-r")
        plan = grid(incidence, outward, besides.azimuths, layout=full, conditions=conditions)
    if out is not None:
        plan.write(out, output.force)
    output.show(view.record(plan, out), view.lines(plan, out))

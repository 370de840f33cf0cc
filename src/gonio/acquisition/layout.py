"""Directions made into a plan: what the arm hides is left out, the rest put in order with darks and checks between.

Incidence angles are outermost, since the table is slow and moves the sample. The arm goes to and fro (serpentine), so
that slow drift does not line up with theta_r.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from gonio.acquisition.plan import Conditions, Plan, Skipped, Step
from gonio.options import Option, Panel

Direction = tuple[float, float, float | None]  # theta_i, theta_r [deg], signed where phi is None


@dataclass(frozen=True, kw_only=True)
class Layout:
    """What cannot be measured, and what is measured beside the sample. Raises ValueError for what contradicts itself.

    blocked [deg]: directions nearer to the source than this are hidden by the arm; None takes what its geometry gives.
    check, standard: theta_i and signed theta_r [deg], None for none.
    """

    PANEL: ClassVar = Panel.MEASUREMENT
    blocked: Annotated[
        float | None,
        Option(
            "leave out directions nearer to the source than this, where the arm stands in the beam; without it what "
            "the arm's width gives",
            metavar="DEG",
            lowest=0,
            highest=90,
        ),
    ] = None
    arm_half_width: Annotated[float, Option("half the width of what the arm carries", metavar="MM", lowest=0)] = 0.0
    beam_radius: Annotated[float, Option("radius of the beam at the arm", metavar="MM", lowest=0)] = 0.0
    distance: Annotated[float, Option("from the spot to the detector's aperture", metavar="MM", above=0)] = 500.0
    repeats: Annotated[int, Option("how often each direction is measured", lowest=1)] = 1
    dark_every: Annotated[int, Option("readings from one dark to the next; 0: first and last", lowest=0)] = 40
    check_every: Annotated[int, Option("readings from one check to the next; 0: first and last", lowest=0)] = 0
    check: tuple[float, float] | None = None
    standard: tuple[float, float] | None = None
    incident: Annotated[bool, Option("measure the incident beam, first and last", flag="--incident")] = False
    background: Annotated[bool, Option("measure every direction with a light trap first", flag="--background")] = False

    def __post_init__(self) -> None:
        if min(self.repeats, 1 + self.dark_every, 1 + self.check_every) < 1 or not self.distance > 0:
            raise ValueError("repeats is 1 or more, dark_every and check_every 0 or more, distance above 0")
        if self.blocked is not None and self.blocked < self.hidden:
            raise ValueError(
                f"blocked is {self.blocked:g} deg, and the arm hides {self.hidden:.4g} deg: give that or more"
            )

    @property
    def hidden(self) -> float:
        """The angle [deg] from the source within which the arm touches the beam: asin((half width + radius) / D)."""
        across = self.arm_half_width + self.beam_radius if self.arm_half_width else 0.0
        if across >= self.distance:
            raise ValueError(f"the arm is {across:g} mm wide at {self.distance:g} mm: give a larger distance")
        return math.degrees(math.asin(across / self.distance))

    @property
    def limit(self) -> float:
        """The angle [deg] from the source from which on a direction is measured."""
        return self.hidden if self.blocked is None else self.blocked


def grid(
    theta_i: Iterable[float],
    theta_r: Iterable[float],
    phi: Iterable[float] = (),
    *,
    layout: Layout | None = None,
    conditions: Conditions | None = None,
) -> Plan:
    """A plan of every theta_i with every theta_r [deg], signed in plane; with `phi` theta_r is from 0 to 90."""
    outward = list(theta_r)
    azimuths: list[float | None] = [*phi] or [None]
    return planned(((i, r, p) for i in theta_i for p in azimuths for r in outward), layout, conditions)


def planned(
    directions: Iterable[Direction], layout: Layout | None = None, conditions: Conditions | None = None
) -> Plan:
    """A plan of these directions: what can be measured in order, what cannot with its reason.

    A direction that is given twice is measured twice. Raises ValueError where nothing is left, or for a direction at or
    beyond 90 deg, where the reduction would divide by zero.
    """
    layout, conditions = layout or Layout(), conditions or Conditions()
    if layout.check_every and not layout.check:
        raise ValueError("check_every needs a direction to check: give check, such as 0,45")
    wanted: list[Step] = []
    skipped: list[Skipped] = []
    for theta_i, theta_r, phi in directions:
        step = Step("sample", float(theta_i), float(theta_r), phi if phi is None else float(phi))
        reason = _hidden(step, layout)
        if reason:
            skipped.append(Skipped(float(theta_i), float(theta_r), step.phi, reason))
        else:
            wanted.append(step)
    if not wanted:
        raise ValueError(f"no direction can be measured: {skipped[0].reason if skipped else 'none is given'}")
    for name in ("check", "standard"):
        if (asked := getattr(layout, name)) and (reason := _hidden(Step(name, *asked), layout)):
            raise ValueError(f"the direction of {name} cannot be measured: {reason}")
    return Plan(conditions, tuple(_in_order(wanted, layout)), tuple(skipped))


def _hidden(step: Step, layout: Layout) -> str:
    """Why a direction cannot be measured; empty where it can."""
    theta_i, theta_r, phi = step.direction
    i, r, p = (math.radians(a) for a in (theta_i, theta_r, phi))
    # The angle between the directions to the source and to the detector; phi = 0 is on the side of the source.
    cosine = math.cos(i) * math.cos(r) + math.sin(i) * math.sin(r) * math.cos(p)
    away = math.degrees(math.acos(min(max(cosine, -1.0), 1.0)))
    if away < layout.limit - 1e-6:
        return f"within {layout.limit:.4g} deg of the source, where the arm stands in the beam"
    return ""


def _in_order(wanted: Sequence[Step], layout: Layout) -> Iterable[Step]:
    sweeps = list(_sweeps(wanted))
    around = [Step("dark")]
    around += [Step("incident")] * layout.incident
    around += [Step("standard", *layout.standard)] if layout.standard else []
    checks = [Step("check", *layout.check)] if layout.check else []
    yield from around
    if layout.background:
        yield from (Step("background", s.theta_i, s.theta_r, s.phi) for sweep in sweeps for s in sweep)
        yield Step("dark")
    yield from checks
    taken = 0
    total = len(wanted) * layout.repeats
    for sweep in sweeps:
        for turn in range(layout.repeats):
            for step in sweep if turn % 2 == 0 else sweep[::-1]:
                yield step
                taken += 1
                if taken < total and layout.check_every and taken % layout.check_every == 0:
                    yield from checks
                if taken < total and layout.dark_every and taken % layout.dark_every == 0:
                    yield Step("dark")
    yield from checks
    yield from reversed(around)


def _sweeps(wanted: Sequence[Step]) -> Iterable[list[Step]]:
    """The directions of each incidence angle in turn, in the order of the arm, to and fro."""
    angles = sorted({step.theta_i for step in wanted if step.theta_i is not None})
    forth = True
    for theta_i in angles:
        azimuths = sorted({step.phi for step in wanted if step.theta_i == theta_i}, key=lambda p: (p is not None, p))
        for phi in azimuths:
            sweep = [step for step in wanted if step.theta_i == theta_i and step.phi == phi]
            yield sorted(sweep, key=lambda step: step.theta_r or 0.0, reverse=not forth)
            forth = not forth


def angles(text: str, what: str) -> list[float]:
    """`20:70:10` or `20,30,50` [deg] as numbers; the end of a range is one of them where a whole step reaches it."""
    out: list[float] = []
    for part in text.split(","):
        try:
            ends = [float(word) for word in part.split(":")]
        except ValueError:
            ends = []
        if not all(map(math.isfinite, ends)) or len(ends) not in (1, 3) or (len(ends) == 3 and not ends[2] > 0):
            raise ValueError(f"{what} is {text!r}: give angles as 20,30,50 or first:last:step")
        if len(ends) == 1:
            out += ends
            continue
        first, last, step = ends
        if last < first or (last - first) / step > 1e6:
            raise ValueError(f"{what} is {text!r}: from {first:g} to {last:g} in steps of {step:g} is no range")
        out += [round(first + k * step, 9) for k in range(math.floor((last - first) / step + 1e-9) + 1)]
    return out

"""What a fit is asked besides its values: bootstrap, profiles and derived numbers, as plain data and as tables."""

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import xarray as xr

from gonio.app.output import LEVEL, figure, progress_bar, table, uncertain
from gonio.derived import Derived, derived
from gonio.fitting.certainty import bootstrap as resampling
from gonio.fitting.certainty import profile as likelihood
from gonio.fitting.certainty.bootstrap import bca, bootstrap, percentile, standard_deviations
from gonio.fitting.certainty.profile import Profile, between, profile
from gonio.fitting.covariance_kinds import COVARIANCES, DEFAULT
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Solution
from gonio.options import Option, Panel
from gonio.units import unit_label

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True, kw_only=True)
class CertaintyOptions:
    """What a fit is asked besides its values: none of it where nothing is said, but for the kind of covariance."""

    PANEL: ClassVar = Panel.UNCERTAINTY
    covariance: Annotated[
        str,
        Option(
            "where uncertainties come from: robust or scaled (the scatter of the points) or absolute (the "
            "uncertainties in the scan)",
            names=tuple(COVARIANCES),
        ),
    ] = DEFAULT
    bootstrap: Annotated[
        int,
        Option("refit this many resampled scans and take uncertainties from them; 500 is usual", "", "DRAWS", lowest=0),
    ] = 0
    resample: Annotated[
        str,
        Option(
            "what --bootstrap draws: residual (the wild bootstrap) or pairs (whole points)", names=("residual", "pairs")
        ),
    ] = "residual"
    profile: Annotated[
        str, Option("intervals of these parameters by profile likelihood: names with commas, or all", metavar="A,B|all")
    ] = ""
    derived: Annotated[
        bool, Option("also print reflectance, albedo, peak and half width, with their uncertainties")
    ] = False

    def refuse_unfit(self, problem: Problem) -> None:
        """ValueError where what is asked does not fit the problem, before the fit takes its time."""
        if self.names(problem):
            likelihood.refuse_unfit(problem)
        if self.bootstrap:
            resampling.refuse_unfit(problem, self.resample, self.bootstrap)

    def names(self, problem: Problem) -> list[str]:
        """The values to profile: `all`, names with commas, a grouped parameter for all of its groups.

        Raises ValueError for a name that is not free.
        """
        if self.profile == "all":
            return list(problem.names)
        names: list[str] = []
        for name in (part.strip() for part in self.profile.split(",") if part.strip()):
            groups = [n for entry in problem.free if entry.name == name for n in entry.names]
            if not groups and name not in problem.names:
                raise ValueError(f"--profile {name}: no free value is called so; there are {', '.join(problem.names)}")
            names += groups or [name]
        return list(dict.fromkeys(names))


@dataclass(frozen=True)
class Certainty:
    """The answers; None or empty where nothing was asked."""

    drawn: xr.Dataset | None = None
    profiles: tuple[Profile, ...] = ()
    derived: tuple[Derived, ...] = ()

    def record(self) -> dict[str, Any]:
        """The answers as plain data, those that were asked for."""
        out: dict[str, Any] = {}
        if self.drawn is not None:
            out["bootstrap"] = dict(self.drawn.attrs) | {"level": LEVEL, "parameters": _spreads(self.drawn)}
        if self.profiles:
            out["profiles"] = {p.name: _profile_record(p) for p in self.profiles}
        if self.derived:
            out["derived"] = [asdict(number) for number in self.derived]
        return out

    def tables(self) -> "Iterator[Table | str]":
        """One table an answer, and in words why a number is missing."""
        if self.drawn is not None:
            yield _bootstrap_table(self.drawn)
        if self.profiles:
            yield _profile_table(self.profiles)
        if self.derived:
            yield _derived_table(self.derived)
            for why in dict.fromkeys(number.why for number in self.derived if number.why):
                yield f"no {_listed([number for number in self.derived if number.why == why])}: {why}"


def ask(problem: Problem, solution: Solution, asked: CertaintyOptions, seed: int = 0) -> Certainty:
    """The answers about a fit, with a progress bar for each part; seed: of the bootstrap.

    Raises ValueError where what is asked does not fit the problem.
    """
    names = asked.names(problem)
    drawn, profiles, numbers = None, [], []
    if asked.bootstrap:
        with progress_bar(f"{asked.bootstrap} resampled fits") as progress:
            drawn = bootstrap(problem, solution, asked.resample, asked.bootstrap, seed, progress)
    if names:
        with progress_bar("profiles") as progress:
            for done, name in enumerate(names, start=1):
                profiles.append(profile(problem, solution, name, LEVEL))
                progress(done / len(names))
    if asked.derived:
        with progress_bar("derived numbers") as progress:
            numbers = derived(solution, problem.points, progress=progress)
    return Certainty(drawn, tuple(profiles), tuple(numbers))


def _spreads(drawn: xr.Dataset) -> dict[str, Any]:
    ends, corrected = percentile(drawn, LEVEL), bca(drawn, LEVEL)
    return {
        name: {"standard_deviation": spread, "percentile": list(ends[name]), "bca": list(corrected[name])}
        for name, spread in standard_deviations(drawn).items()
    }


def _profile_record(one: Profile) -> dict[str, Any]:
    return {
        "level": one.level,
        "lower": one.lower,
        "upper": one.upper,
        "open_below": one.open_below,
        "open_above": one.open_above,
        "words": one.words,
        "at": one.at.tolist(),
        "rise": one.rise.tolist(),
    }


def _bootstrap_table(drawn: xr.Dataset) -> "Table":
    percent = f"{100 * LEVEL:g} %"
    attrs = drawn.attrs
    title = f"bootstrap of {attrs['kind']}, {attrs['draws']} draws, seed {attrs['seed']}"
    out = table("parameter", "standard deviation", f"{percent} by percentiles", f"{percent} by BCa", title=title)
    for name, found in _spreads(drawn).items():
        ends = (between(*found[kind]) if math.isfinite(found[kind][0]) else "–" for kind in ("percentile", "bca"))
        out.add_row(name, figure(found["standard_deviation"]), *ends)
    return out


def _profile_table(profiles: tuple[Profile, ...]) -> "Table":
    out = table("parameter", "value", f"{100 * LEVEL:g} % by the profile", title="profile likelihood")
    out.columns[2].justify = "left"
    for one in profiles:
        out.add_row(one.name, f"{one.value:.5g}", one.words)
    return out


def _derived_table(numbers: tuple[Derived, ...]) -> "Table":
    known = [number for number in numbers if not number.why]
    parts = "standard uncertainty" if all(n.systematic != n.systematic for n in known) else "random ± systematic"
    out = table("derived", "of", f"value ± {parts}", "unit", left=2)
    out.columns[3].justify = "left"
    for number in known:
        where = ", ".join(f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in number.where.items())
        name = f"{number.name} (fit)" if number.name == "half width" else number.name  # gonio info has the measured one
        out.add_row(
            name, where, uncertain(number.value, number.uncertainty, number.systematic), unit_label(number.unit)
        )
    return out


def _listed(numbers: list[Derived]) -> str:
    """Names, each with its incidence angles."""
    out = []
    for name in dict.fromkeys(number.name for number in numbers):
        angles = dict.fromkeys(n.where["theta_i"] for n in numbers if n.name == name and "theta_i" in n.where)
        out.append(f"{name} at theta_i {', '.join(f'{a:g}' for a in angles)} deg" if angles else name)
    return ", ".join(out)

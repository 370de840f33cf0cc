"""The page with sliders at the end of a report: in a frame of its own, so that the report reads the same without it."""

from collections.abc import Sequence
from dataclasses import dataclass

from gonio.reporting.case import Case
from gonio.results.content import scan_name
from gonio.viewing.assembled import in_one_file, policy, scripts_of
from gonio.viewing.notebook import frame
from gonio.viewing.session import FIT, Opened, Session

HEIGHT = "60rem"


@dataclass(frozen=True)
class Interactive:
    """What a report says of the page, and the page.

    frame: its HTML. policy: the Content-Security-Policy that lets the page's own scripts run, and no other. size: of
    the page, in bytes.
    """

    frame: str
    policy: str
    size: int

    @property
    def words(self) -> str:
        """What it is, for who reads the report without scripts."""
        return (
            f"The same scan and fit with a slider for every parameter ({kilobytes(self.size)} of this file). It needs "
            "JavaScript, which this file brings, and no network; all else of this report is read without it."
        )


def kilobytes(size: int) -> str:
    """A number of bytes in words."""
    return f"{size / 1000:.0f} kB" if size < 1_000_000 else f"{size / 1e6:.1f} MB"


def interactive(case: Case) -> Interactive:
    """The page of a report's scan and fit."""
    solution = case.solution
    session = Session(
        [Opened(scan_name(solution), case.scan, {FIT: solution})], models={solution.model.name: solution.model},
        model=solution.model.name,
    )  # fmt: skip
    page = in_one_file(session, session.needed())
    scripts: Sequence[str] = scripts_of(page)
    return Interactive(frame(page, HEIGHT), policy(scripts), len(page.encode()))

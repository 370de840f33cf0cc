"""What a page shows: scans, fits of them, and the models to choose from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import xarray as xr

import gonio
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.models import catalogue
from gonio.viewing.columns import Columns, columns_of
from gonio.viewing.described import by_name

FIT = "fit"  # how a page calls the fit that it is handed without a name
FIRST = "gonio-best"  # the model that a page begins with, where nothing else is asked for


@dataclass
class Opened:
    """A scan on a page, and the fits of it by name."""

    name: str
    scan: xr.Dataset
    fits: dict[str, Solution] = field(default_factory=dict)

    @cached_property
    def columns(self) -> Columns:
        """Its rows."""
        return columns_of(self.name, self.scan)

    @cached_property
    def findings(self) -> list[dict[str, str]]:
        """What `gonio check` warns of."""
        from gonio.findings.registry import check
        from gonio.measured.check import Severity

        return [
            {"severity": str(f.severity), "text": str(f)} for f in check(self.scan) if f.severity is not Severity.NOTE
        ]

    @cached_property
    def fittable(self) -> bool:
        """Whether a page may fit it unasked: every value is shown one by one, and a model describes some of them.

        A fit of more values takes minutes, and models describe reflection alone.
        """
        header = self.columns.header
        is_whole = not header.get("interpolated") and header["shown"] == header["total"]
        return is_whole and any(cell["reflected"] for cell in header["cells"])

    def described(self) -> dict[str, Any]:
        """What the page has to know beside the columns."""
        fits = {}
        if self.fits:
            from gonio.viewing.fits import record

            fits = {name: record(solution, self.columns) for name, solution in self.fits.items()}
        return {
            "name": self.name,
            "history": str(self.scan.attrs.get("history", "")).splitlines(),
            "fits": fits,
            "fittable": self.fittable,
        }


@dataclass
class Session:
    """All that a page shows.

    model, values: what it begins with; without a fit the weights follow the data. pair: the scans that are compared.
    begin_with_model: whether that is so where there are fits as well. state: what another page wrote of itself, to
    begin with.
    """

    opened: list[Opened]
    models: Mapping[str, Model] = field(default_factory=lambda: catalogue)
    model: str = FIRST
    values: Mapping[str, float] = field(default_factory=dict)
    pair: Sequence[int] = ()
    begin_with_model: bool = False
    state: Mapping[str, Any] = field(default_factory=dict)

    @property
    def begins_with_fits(self) -> bool:
        """Whether scans without a fit are fitted unasked: nothing else was named to begin with."""
        return not self.values and not self.state

    def refuse_unshown(self) -> None:
        """ValueError for a scan or a fit that a page cannot show, before one is served or written."""
        for one in self.opened:
            _ = one.columns, one.described()

    def needed(self) -> list[str]:
        """The models of a page that cannot ask for others: those of the fits, and the one it begins with."""
        fitted = [solution.model.name for one in self.opened for solution in one.fits.values()]
        return list(dict.fromkeys([*fitted, self.model]))

    def described(self) -> dict[str, Any]:
        """The session as JSON."""
        return {
            "version": gonio.__version__,
            "sets": [one.described() for one in self.opened],
            "models": by_name(self.models),
            "model": self.model,
            "values": dict(self.values),
            "pair": list(self.pair),
            "begin_with_model": self.begin_with_model,
            "begins_with_fits": self.begins_with_fits,
            "state": dict(self.state),
        }

"""The options of commands that correct a model by what a scan says beyond it."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gonio.app import arguments
from gonio.completion import Correction
from gonio.options import Option, Panel


@dataclass(frozen=True, kw_only=True)
class CorrectionOptions:
    """How a correction is learned."""

    PANEL: ClassVar = Panel.MODEL
    no_prior: Annotated[bool, Option("correct without what models miss of public materials")] = False
    without: Annotated[
        str, Option("public materials that are left out of the correction, as for a scan of one", metavar="A,B")
    ] = ""

    @property
    def chosen(self) -> Correction:
        """The same for the functions that correct; ValueError for a material that is not known."""
        return Correction(prior=not self.no_prior, without=tuple(arguments.listed(self.without)))

    def refuse_unused(self, flag: str) -> None:
        """ValueError where they are given and nothing is corrected."""
        if self != CorrectionOptions():
            raise ValueError(f"--no-prior and --without belong to a correction: add {flag}, or leave them out")

"""The options of commands that take a model with values given by hand."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from gonio.app import arguments, names
from gonio.fitting.objective.options import MaterialName, MaterialWavelength
from gonio.options import Option, Panel

if TYPE_CHECKING:
    from gonio.app.views.evaluation import EvaluatedFit, EvaluatedModel


@dataclass(frozen=True, kw_only=True)
class ValueOptions:
    """Values of a model: weights and shape by name, optical constants of a material."""

    PANEL: ClassVar = Panel.MODEL
    set: Annotated[
        tuple[str, ...],
        Option(
            "value of a parameter: ks=0.4, or a file.json of values by name; without it a weight is 0, a shape "
            "parameter at its default",
            metavar="NAME=VALUE",
        ),
    ] = ()
    material: MaterialName = ""
    wavelength: MaterialWavelength = None

    def values(self) -> dict[str, float]:
        """The values by name; ValueError for text that is no number, or a material without a wavelength."""
        return arguments.values(self.set, self.material, self.wavelength)


@dataclass(frozen=True, kw_only=True)
class SurfaceOptions(ValueOptions):
    """The same, or the constants that a paper prints."""

    published: Annotated[
        str, Option("values that a paper prints for a surface, such as Al or Cu", metavar="NAME", names=names.surfaces)
    ] = ""
    select: Annotated[
        Mapping[str, str], Option("use one set of a fit: channel=R", metavar="COORD=VALUE", panel=Panel.DATA)
    ] = field(default_factory=dict)

    def of(self, model: str) -> "EvaluatedModel | EvaluatedFit":
        """The model of that name with these values, or the fit in the file of that name with its own."""
        from gonio import catalogue
        from gonio.app.views import contents, evaluation

        if (solution := contents.fit_named(model)) is None:
            if self.select:
                raise ValueError("--select chooses a set of a fit: give the file of one, or leave it out")
            return evaluation.surface(catalogue[model], self.values(), self.published)
        if self.set or self.material or self.published:
            raise ValueError("--set, --material and --published belong to a model: a fit has its own values")
        return evaluation.EvaluatedFit.of(Path(model), solution, self.select)

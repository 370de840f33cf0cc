"""The options of commands that take a model with values given by hand."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from gonio.app import arguments, names
from gonio.fitting.objective.options import MaterialName, MaterialWavelength
from gonio.options import Option, Panel

if TYPE_CHECKING:
    from gonio.app.views.evaluation import EvaluatedModel


@dataclass(frozen=True, kw_only=True)
class ValueOptions:
    """Values of a model: weights and shape by name, optical constants of a material."""

    PANEL: ClassVar = Panel.MODEL
    set: Annotated[
        tuple[str, ...],
        Option(
            "value of a parameter: ks=0.4; without it a weight is 0, a shape parameter at its default",
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

    def of(self, model: str) -> "EvaluatedModel":
        """The model of that name with these values."""
        from gonio import catalogue
        from gonio.app.views import evaluation

        return evaluation.surface(catalogue[model], self.values(), self.published)

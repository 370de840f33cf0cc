"""A model as degrees of polarisation see it: of its weights only their ratios, since a common factor cancels.

With one weight as the unit, 1 unless it is held at another value, the others are shape parameters of a single term, the
degree of polarisation, whose own weight is that unit and is never searched. So a solver meets an ordinary problem.
"""

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, declarations

# A share of light that depolarises, over the polarising term: most surfaces have 1e-3 to 10.
LEAST_SHARE, USUAL_SHARE, MOST_SHARE = 0.0, 0.1, 1e4


@dataclass(frozen=True, eq=False)
class RatioModel(Model):
    """The model `of`, with the name of every parameter and with one term alone; `scale` is the weight that is held."""

    of: Model = None  # type: ignore[assignment]  # fields with defaults come before it
    scale: str = ""

    def values(self, shape: Mapping[str, Any]) -> dict[str, Any]:
        """All values of the model `of` for shape parameters of this one; what is left out takes its default."""
        defaults = {name: parameter.default for name, parameter in self.shape.items()}
        return {self.scale: 1.0} | defaults | dict(shape)

    def __reduce__(self) -> Any:
        """Made anew in another process, of the model that is found there."""
        return ratio_model, (self.of,)


def ratio_model(model: Model) -> RatioModel:
    """A model with Mueller terms as degrees of polarisation see it; ValueError for a model that has none."""
    refuse_scalar(model)
    first = next(weight for weight in model.weights if replace(model, terms={weight: model.terms[weight]}).polarised)
    others = {
        weight: Parameter(USUAL_SHARE, LEAST_SHARE, MOST_SHARE, f"{weight} over {first}", "a.u.")
        for weight in model.weights
        if weight != first
    }
    of_terms = {name: one for term in model.terms.values() for name, one in declarations(term).items()}
    declared = others | of_terms

    def degree_of_polarisation(g: Geometry, **shape: Array) -> Array:
        matrix = model.mueller(g, {first: 1.0} | shape)
        xp = namespace(matrix)
        light = xp.where(matrix[..., 0, 0] > 0, matrix[..., 0, 0], 1.0)
        return xp.sqrt(matrix[..., 1, 0] ** 2 + matrix[..., 2, 0] ** 2) / light

    either = inspect.Parameter.POSITIONAL_OR_KEYWORD
    degree_of_polarisation.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [inspect.Parameter(name, either) for name in ("g", *declared)]
    )
    degree_of_polarisation.__annotations__ = {name: Annotated[Any, one] for name, one in declared.items()} | {
        "return": Dimensionless
    }
    return RatioModel(model.name, model.title, model.cite, {first: degree_of_polarisation}, of=model, scale=first)


def refuse_scalar(model: Model) -> None:
    """ValueError with the remedy for a model that knows no polarisation."""
    if not (model.polarised or isinstance(model, RatioModel)):
        raise ValueError(
            f"{model.name} knows no polarisation, and the values are degrees of polarisation: take a model with a "
            "Mueller matrix, such as priest-mueller or wellems"
        )


def whole(model: Model) -> Model:
    """The model that was asked for: of a RatioModel the one whose degrees of polarisation it gives."""
    return model.of if isinstance(model, RatioModel) else model

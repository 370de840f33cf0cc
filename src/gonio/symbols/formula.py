"""A model as a formula: it is called on Symbols, and what it computes is kept as a graph.

Nothing of the model is known here but how it is called, so a model that is added is traced like the others.
"""

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gonio.geometry import Geometry
from gonio.model import Model, Sampler, Term, declarations
from gonio.symbols.graph import Node, constant, rebuilt, walk, with_arguments
from gonio.symbols.symbol import Symbol, as_symbol

INCIDENCE = ("x_i", "y_i", "z_i")
REFLECTION = ("x_r", "y_r", "z_r")
NUMBERS = ("u_1", "u_2")  # uniform in 0..1, which a sampler turns into a direction
LEVELS = ("parameters", "incidence", "reflection")


@dataclass(frozen=True)
class Formula:
    """What a model computes, or a sampler: outputs by name, of inputs in three levels.

    Attributes
    ----------
    inputs : tuple
        The names of the parameters, of what is known with the incident light, and of what is known last.
    outputs : mapping
        Expressions by name, which depend on no axis.
    names : mapping
        Names that people know of expressions in between, such as `cos_beta`.

    """

    inputs: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
    outputs: Mapping[str, Node]
    names: Mapping[Node, str]

    @functools.cached_property
    def nodes(self) -> tuple[Node, ...]:
        """Every expression that the outputs need, arguments first."""
        return tuple(walk(*self.outputs.values()))

    @functools.cached_property
    def level(self) -> dict[Node, int]:
        """The level from which each expression can be computed: 0 parameters, 1 incidence, 2 all."""
        of_input = {name: level for level, names in enumerate(self.inputs) for name in names}
        found: dict[Node, int] = {}
        for node in self.nodes:
            own = of_input[str(node.value)] if node.op == "input" else 0
            found[node] = max((own, *(found[a] for a in node.args)))
        return found

    @property
    def operations(self) -> frozenset[str]:
        """The operations that it needs."""
        return frozenset(node.op for node in self.nodes)

    def with_values(self, values: Mapping[str, float]) -> "Formula":
        """The formula for given values of inputs, which are numbers in it from then on."""

        def change(node: Node, args: tuple[Node, ...]) -> Node:
            if node.op == "input" and node.value in values:
                return constant(float(values[str(node.value)]))
            return with_arguments(node, args)

        left = tuple(tuple(n for n in level if n not in values) for level in self.inputs)
        outputs = {name: rebuilt(node, change) for name, node in self.outputs.items()}
        present = set(walk(*outputs.values()))
        renamed = {rebuilt(node, change): name for node, name in self.names.items()}
        return Formula(left, outputs, {n: name for n, name in renamed.items() if n in present})  # type: ignore[arg-type]


def formula_of(model: Model, terms: bool = False) -> Formula:
    """The BRDF [1/sr, without the cosine] of a model as a formula of its parameters and of both directions.

    Parameters
    ----------
    model : Model
        Any model, of the catalogue or not.
    terms : bool
        Every term on its own, by its weight, instead of their weighted sum `f`.

    Raises
    ------
    TypeError
        The model branches on its values, or uses another array library.

    """
    geometry = _directions()
    values = {name: Symbol.named(name) for name in model.parameters}
    basis = model.basis(geometry, {name: values[name] for name in model.shape})
    found = {weight: _number(value) for weight, value in basis.items()}
    outputs = found if terms else {"f": _number(model(geometry, values))}
    known = {node: f"term_{weight}" for weight, node in found.items()}
    return _formula((model.parameters, INCIDENCE, REFLECTION), outputs, geometry, known)


def draw_of(sampler: Sampler, term: Term) -> Formula:
    """The direction that a sampler draws for a term, x_r, y_r and z_r, from two uniform numbers."""
    shape = {name: Symbol.named(name) for name in declarations(term)}
    light, numbers = (tuple(map(Symbol.named, names)) for names in (INCIDENCE, NUMBERS))
    drawn = sampler.draw(*light, *numbers, **shape)
    outputs = dict(zip(REFLECTION, map(_number, drawn), strict=True))
    return _formula((tuple(shape), INCIDENCE, NUMBERS), outputs, None)


def density_of(sampler: Sampler, term: Term) -> Formula:
    """The probability density [1/sr] of the directions that a sampler draws for a term."""
    geometry = _directions()
    shape = {name: Symbol.named(name) for name in declarations(term)}
    density = sampler.density(geometry, **shape)
    return _formula((tuple(shape), INCIDENCE, REFLECTION), {"density": _number(density)}, geometry)


def _directions() -> Geometry:
    return Geometry(*map(Symbol.named, (*INCIDENCE, *REFLECTION)))


def _number(value: Any) -> Node:
    """The expression of one number."""
    symbol = as_symbol(value)
    if symbol.ndim:
        raise TypeError(f"a formula gives one number for a pair of directions, not an array of shape {symbol.shape}")
    return symbol.node


def _formula(
    inputs: Any, outputs: Mapping[str, Node], geometry: Geometry | None, known: Mapping[Node, str] | None = None
) -> Formula:
    present = set(walk(*outputs.values()))
    names = {node: name for node, name in (known or {}).items() if node in present}
    if geometry is not None:
        for name in dir(Geometry):
            if isinstance(vars(Geometry).get(name), functools.cached_property) and not name.startswith("_"):
                node = getattr(geometry, name).node
                if node in present and node.op != "input":
                    names.setdefault(node, name)
    return Formula(inputs, dict(outputs), names)

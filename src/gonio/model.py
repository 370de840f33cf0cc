"""A model is a weighted sum of terms: f = sum_k weight_k * term_k(geometry; shape parameters).

Weights are the keys of `terms`, so no term can see its weight. Shape parameters are the arguments of the terms;
default, bounds, unit and meaning sit in their annotation. Start vectors, bounds, design matrices, command-line
options and tables are all read from this one declaration.
"""

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from typing import Annotated, Any, Generic, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from gonio.arrays import Array, align, is_traced_never
from gonio.geometry import Geometry

Term = Callable[..., Array]


@dataclass(frozen=True)
class Parameter:
    """The declaration of one shape parameter, written in the annotation of the argument that it is."""

    default: float
    lower: float
    upper: float
    help: str
    unit: str = "1"

    def __post_init__(self) -> None:
        if not self.lower <= self.default <= self.upper:
            raise ValueError(f"default {self.default} of {self.help!r} is outside {self.lower}..{self.upper}")


class TermUnit(NamedTuple):
    """The unit of a term, written in its return annotation; the weight's unit is the data's over this one."""

    unit: str


PerSteradian = Annotated[Array, TermUnit("sr-1")]
PerDegree = Annotated[Array, TermUnit("deg-1")]
Dimensionless = Annotated[Array, TermUnit("1")]


@dataclass(frozen=True, eq=False)
class Model:
    """A BRDF model [1/sr, without the cosine]: name, terms by weight, and what is known about its physics.

    `violates` names a law of physics that the model breaks and says why; `confidence` is "confirmed" where the
    formula was read in its source and "reconstructed" where only an abstract was.
    Raises ValueError when two terms declare the same shape parameter differently.
    """

    name: str
    title: str
    cite: str
    terms: Mapping[str, Term]
    violates: Mapping[str, str] = field(default_factory=dict)
    confidence: str = "confirmed"

    def __post_init__(self) -> None:
        declared: dict[str, Parameter] = {}
        for term in self.terms.values():
            for name, parameter in declarations(term).items():
                if declared.setdefault(name, parameter) != parameter:
                    raise ValueError(f"{self.name}: two terms declare {name!r} differently")
        if clash := declared.keys() & self.terms.keys():
            raise ValueError(f"{self.name}: {', '.join(sorted(clash))} cannot be both a weight and a shape parameter")

    @functools.cached_property
    def shape(self) -> dict[str, Parameter]:
        """The shape parameters in the order in which the terms name them."""
        return {name: p for term in self.terms.values() for name, p in declarations(term).items()}

    @property
    def weights(self) -> tuple[str, ...]:
        return tuple(self.terms)

    @property
    def parameters(self) -> tuple[str, ...]:
        return (*self.weights, *self.shape)

    def term_unit(self, weight: str) -> str:
        return _unit(self.terms[weight])

    def basis(self, geometry: Geometry, shape: Mapping[str, Array]) -> dict[str, Array]:
        """Value of every term, by weight, for shape parameters that broadcast against the directions.

        Terms are zero where a direction is below the horizon. Parameters left out take their defaults.
        Raises ValueError for a name that is no shape parameter of this model.
        """
        self._refuse_unknown(shape, self.shape)
        given = [shape.get(name, p.default) for name, p in self.shape.items()]
        xp, aligned = align(*geometry, *given)
        unchanged = all(a is b and is_traced_never(a) for a, b in zip(geometry, aligned[:6], strict=True))
        directions = geometry if unchanged else Geometry(*aligned[:6])
        values = dict(zip(self.shape, aligned[6:], strict=True))
        below = directions.below
        out = {}
        for weight, term in self.terms.items():
            value = term(directions, **{name: values[name] for name in declarations(term)})
            out[weight] = xp.where(below, 0.0, value)
        return out

    def __call__(self, geometry: Geometry, values: Mapping[str, Array]) -> Array:
        """BRDF for `values` of weights and shape parameters; a weight that is left out is zero."""
        self._refuse_unknown(values, self.parameters)
        basis = self.basis(geometry, {k: v for k, v in values.items() if k in self.shape})
        names = [w for w in self.weights if w in values]
        if not names:
            raise ValueError(f"{self.name}: give at least one weight: {', '.join(self.weights)}")
        _, aligned = align(*(basis[w] for w in names), *(values[w] for w in names))
        terms, weights = aligned[: len(names)], aligned[len(names) :]
        return sum((w * t for w, t in zip(weights[1:], terms[1:], strict=True)), start=weights[0] * terms[0])

    def _refuse_unknown(self, given: Iterable[str], known: Iterable[str]) -> None:
        known = tuple(known)
        for name in given:
            if name not in known:
                shape = ", ".join(self.shape) or "none"
                raise ValueError(
                    f"{self.name} has no parameter {name!r}; "
                    f"its weights are {', '.join(self.weights)} and its shape parameters {shape}"
                )


@functools.cache
def declarations(term: Term) -> dict[str, Parameter]:
    """The shape parameters that a term declares in its signature, in order."""
    hints = get_type_hints(term, include_extras=True)
    found = {}
    for name in list(inspect.signature(term).parameters)[1:]:
        notes = [a for a in get_args(hints.get(name)) if isinstance(a, Parameter)]
        if len(notes) != 1:
            raise ValueError(f"argument {name!r} of term {term.__name__} needs one Parameter in its annotation")
        found[name] = notes[0]
    return found


def _unit(term: Term) -> str:
    hint: Any = get_type_hints(term, include_extras=True).get("return")
    notes = [a for a in get_args(hint) if isinstance(a, TermUnit)] if get_origin(hint) is Annotated else []
    if len(notes) != 1:
        raise ValueError(f"term {term.__name__} needs its unit in the return annotation: PerSteradian, PerDegree, ..")
    return notes[0].unit


Entry = TypeVar("Entry")


class NearestNames(dict[str, Entry], Generic[Entry]):
    """A mapping by name whose KeyError offers the nearest names."""

    def __init__(self, kind: str, entries: Mapping[str, Entry]) -> None:
        super().__init__(entries)
        self.kind = kind

    def __missing__(self, name: str) -> Entry:
        near = get_close_matches(name, self, n=3, cutoff=0.4) or list(self)
        raise KeyError(f"no {self.kind} is called {name!r}; nearest: {', '.join(near)}")

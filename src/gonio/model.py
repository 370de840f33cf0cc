"""A model is a weighted sum of terms: f = sum_k weight_k * term_k(geometry; shape parameters).

Weights are the keys of `terms`, so no term can see its weight. Shape parameters are the arguments of the terms;
default, bounds, unit and meaning sit in their annotation. Start vectors, bounds, design matrices, command-line
options and tables are all read from this one declaration.
"""

import functools
import inspect
import math
import pkgutil
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, NamedTuple, Protocol, get_args, get_origin, get_type_hints

from gonio.arrays import Array, align, constants, is_traced_never
from gonio.geometry import Geometry
from gonio.literature.described import Described
from gonio.outside import NearestNames as NearestNames
from gonio.outside import shortened

Term = Callable[..., Array]


@dataclass(frozen=True)
class Parameter:
    """One shape parameter, in the annotation of its argument; fits keep one that is `held` until an option names it."""

    default: float
    lower: float
    upper: float
    help: str
    unit: str = "1"
    held: bool = False

    def __post_init__(self) -> None:
        if not self.lower <= self.default <= self.upper:
            raise ValueError(f"default {self.default} of {self.help!r} is outside {self.lower}..{self.upper}")


class TermUnit(NamedTuple):
    """The unit of a term, written in its return annotation; the weight's unit is the data's over this one.

    A term that is a `mueller` matrix returns (..., 4, 4).
    """

    unit: str
    mueller: bool = False


PerSteradian = Annotated[Array, TermUnit("sr-1")]
MuellerPerSteradian = Annotated[Array, TermUnit("sr-1", mueller=True)]
PerDegree = Annotated[Array, TermUnit("deg-1")]
Dimensionless = Annotated[Array, TermUnit("1")]


TERM_UNITS = ("sr-1", "deg-1", "1")


class Sampler(Protocol):
    """How to draw reflected directions in proportion to a term times cos(theta_r), or nearly so.

    `draw` turns two uniform numbers (u, v) into a direction for the incidence direction (x_i, y_i, z_i); one below the
    horizon stands for light that is lost. `density` is the probability density [1/sr] of what `draw` gives. Both take
    the term's own shape parameters by name.
    """

    def draw(
        self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array
    ) -> tuple[Array, Array, Array]:
        """Components (x_r, y_r, z_r) of the drawn direction."""

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        """Probability density of the reflected direction [1/sr]."""


def drawn_by(sampler: Sampler) -> Callable[[Term], Term]:
    """Declare beside a term how its reflected directions are drawn; a term without one is sampled numerically."""

    def mark(term: Term) -> Term:
        term.sampler = sampler  # type: ignore[attr-defined]
        return term

    return mark


def sampler_of(term: Term) -> Sampler | None:
    """The sampler that a term declares, None where it has to be sampled numerically."""
    return getattr(term, "sampler", None)


@dataclass(frozen=True, eq=False)
class Model(Described):
    """A BRDF model [1/sr, without the cosine]; `from_function` makes one of a plain function in one line.

    Parameters
    ----------
    name, title, cite : str
        What it is called, what it is, and its source: a key of gonio's references, or any text.
    terms : mapping
        Functions of a Geometry and of shape parameters, by the name of the weight of each. ValueError for one that does
        not declare its unit or an argument, and for two that declare one parameter differently.
    violates, confidence : mapping, str
        Laws of physics that the model breaks, and why; "confirmed" where the formula was read in its source and
        "reconstructed" where only an abstract was.
    combinations : mapping
        Numbers computed from several parameters that data determine better than the parameters themselves.
    only_named : str
        Why no search for the model of a surface tries this one unless it is named; empty where every search does.

    """

    name: str
    title: str = ""
    cite: str = ""
    terms: Mapping[str, Term] = field(default_factory=dict)
    violates: Mapping[str, str] = field(default_factory=dict)
    confidence: str = "confirmed"
    combinations: Mapping[str, Callable[[Mapping[str, float]], float]] = field(default_factory=dict)
    only_named: str = ""

    def __post_init__(self) -> None:
        if not self.terms:
            raise ValueError(
                f"{self.name} has no terms: give at least one by its weight, as terms={{'kd': lambertian}}"
            )
        if not self.title:
            object.__setattr__(self, "title", self.name)
        declared: dict[str, Parameter] = {}
        for term in self.terms.values():
            _unit(term)  # for what it refuses, here and not in a fit
            for name, parameter in declarations(term).items():
                if declared.setdefault(name, parameter) != parameter:
                    raise ValueError(f"{self.name}: two terms declare {name!r} differently")
        if clash := declared.keys() & self.terms.keys():
            raise ValueError(f"{self.name}: {', '.join(sorted(clash))} cannot be both a weight and a shape parameter")

    @classmethod
    def from_function(
        cls,
        function: Term,
        bounds: Mapping[str, tuple[float, float]] | None = None,
        *,
        units: Mapping[str, str] | None = None,
        unit: str = "sr-1",
        weight: str = "scale",
        name: str = "",
        title: str = "",
    ) -> "Model":
        """A model of one term from a plain function f(geometry, a, b, ..) of a Geometry and shape parameters.

        `Model.from_function(lambda g, width: np.exp(-g.tan_alpha_squared / width**2), {"width": (0.01, 1)})` is
        f = scale * exp(-tan(alpha)^2/width^2). bounds: lower and upper by argument that no annotation declares.
        A search starts at the default of the argument, else at the middle of its bounds, the geometric one where both
        are positive. units: of the arguments, "1" where none is given. unit: of the term, a name of TERM_UNITS.
        weight: the name of the factor that the fit finds. name: that of the function where none is given.
        The function gets arrays of NumPy in a fit; those of JAX in `fit_many`, where it has to take its functions from
        `gonio.arrays.namespace`. Raises ValueError for an argument without bounds and for a unit that no term has.
        """
        if unit not in TERM_UNITS:
            raise ValueError(f"no term has the unit {unit!r}: choose one of {', '.join(TERM_UNITS)}")
        called = name or getattr(function, "__name__", "model").replace("<lambda>", "model")
        term = _declared_term(function, called, bounds or {}, units or {})
        term.__annotations__["return"] = Annotated[Any, TermUnit(unit)]
        return cls(called, title, terms={weight: term})

    def __repr__(self) -> str:
        """Name, title and parameters, in at most 300 characters."""
        shape = [f"{n} {p.lower:g} to {p.upper:g}{f' {p.unit}' * (p.unit != '1')}" for n, p in self.shape.items()]
        head = f"<Model {self.name}: {self.title}; weights {', '.join(self.weights)}; "
        return shortened(head, shape or ["no shape parameters"], ">")

    def __reduce__(self) -> tuple[Callable[[str], Any], tuple[str]]:
        """A model goes to another process as the place of its declaration, and is the same object when it returns."""
        for module in list(sys.modules.values()):
            for attribute, value in list(getattr(module, "__dict__", {}).items()):
                if value is self and module.__name__ != "__main__":
                    return pkgutil.resolve_name, (f"{module.__name__}:{attribute}",)
        raise ValueError(f"{self.name} is declared in no module, so no other process can find it: use one worker")

    @functools.cached_property
    def shape(self) -> dict[str, Parameter]:
        """The shape parameters in the order in which the terms name them."""
        return {name: p for term in self.terms.values() for name, p in declarations(term).items()}

    @property
    def weights(self) -> tuple[str, ...]:
        """The names of the weights, one for each term."""
        return tuple(self.terms)

    @property
    def parameters(self) -> tuple[str, ...]:
        """The names of all parameters: weights, then shape parameters."""
        return (*self.weights, *self.shape)

    def term_unit(self, weight: str) -> str:
        """The unit of the term that has this weight."""
        return _unit(self.terms[weight]).unit

    @functools.cached_property
    def polarised(self) -> bool:
        """Whether a term is a Mueller matrix; the other terms of the model are then ideal depolarisers."""
        return any(_unit(term).mueller for term in self.terms.values())

    def basis(self, geometry: Geometry, shape: Mapping[str, Array]) -> dict[str, Array]:
        """Value of every term, by weight, for shape parameters that broadcast against the directions.

        A Mueller term gives element 00, its BRDF for unpolarised light. Terms are zero where a direction is below the
        horizon. Parameters left out take their defaults.
        Raises ValueError for a name that is no shape parameter of this model.
        """
        values = self._terms(geometry, shape)
        return {w: v[..., 0, 0] if _unit(self.terms[w]).mueller else v for w, v in values.items()}

    def mueller_basis(self, geometry: Geometry, shape: Mapping[str, Array]) -> dict[str, Array]:
        """Mueller matrix (..., 4, 4) of every term, by weight; a scalar term depolarises: it has element 00 alone.

        Rows and columns are Stokes parameters in the bases that `optics.mueller` defines.
        Raises ValueError for a model without polarisation, and as `basis` does.
        """
        if not self.polarised:
            raise ValueError(f"{self.name} has no Mueller terms: choose a model of polarised reflection")
        values = self._terms(geometry, shape)
        return {w: v if _unit(self.terms[w]).mueller else depolarising(v) for w, v in values.items()}

    def mueller(self, geometry: Geometry, values: Mapping[str, Array]) -> Array:
        """Mueller matrix BRDF (..., 4, 4) [1/sr] for `values` of weights and shape, as `__call__` takes them."""
        return self._weighted(self.mueller_basis, geometry, values, extra=2)

    def _terms(self, geometry: Geometry, shape: Mapping[str, Array]) -> dict[str, Array]:
        """Every term by weight, scalars and Mueller matrices alike, 0 where a direction is below the horizon."""
        self._refuse_unknown(shape, self.shape)
        shape_values = [shape.get(name, p.default) for name, p in self.shape.items()]
        xp, aligned = align(*geometry, *shape_values)
        unchanged = all(a is b and is_traced_never(a) for a, b in zip(geometry, aligned[:6], strict=True))
        directions = geometry if unchanged else Geometry(*aligned[:6])
        values = dict(zip(self.shape, aligned[6:], strict=True))
        below = directions.below
        out = {}
        for weight, term in self.terms.items():
            value = term(directions, **{name: values[name] for name in declarations(term)})
            out[weight] = xp.where(below[..., None, None] if _unit(term).mueller else below, 0.0, value)
        return out

    def __call__(self, geometry: Geometry, values: Mapping[str, Array]) -> Array:
        """BRDF for `values` of weights and shape parameters; a weight that is left out is zero."""
        return self._weighted(self.basis, geometry, values)

    def _weighted(
        self, basis_of: Callable[..., Any], geometry: Geometry, values: Mapping[str, Array], extra: int = 0
    ) -> Array:
        """Sum of weight times term, whose last `extra` dimensions are no directions."""
        self._refuse_unknown(values, self.parameters)
        basis = basis_of(geometry, {k: v for k, v in values.items() if k in self.shape})
        weighted = [w for w in self.weights if w in values]
        if not weighted:
            raise ValueError(f"{self.name}: give at least one weight: {', '.join(self.weights)}")
        _, aligned = align(*(basis[w] for w in weighted), *(values[w] for w in weighted))
        terms, weights = aligned[: len(weighted)], [w[(..., *[None] * extra)] for w in aligned[len(weighted) :]]
        return sum((w * t for w, t in zip(weights[1:], terms[1:], strict=True)), start=weights[0] * terms[0])

    def _refuse_unknown(self, names: Iterable[str], allowed: Iterable[str]) -> None:
        """ValueError for the first of the names that is not allowed."""
        allowed = tuple(allowed)
        for name in names:
            if name not in allowed:
                shape = ", ".join(self.shape) or "none"
                raise ValueError(
                    f"{self.name} has no parameter {name!r}; "
                    f"its weights are {', '.join(self.weights)} and its shape parameters {shape}"
                )


@functools.cache
def declarations(term: Term) -> dict[str, Parameter]:
    """The shape parameters that a term declares in its signature, in order."""
    hints = get_type_hints(term, include_extras=True)
    parameters = {}
    for name in list(inspect.signature(term).parameters)[1:]:
        notes = [a for a in get_args(hints.get(name)) if isinstance(a, Parameter)]
        if len(notes) != 1:
            raise ValueError(
                f"argument {name!r} of term {term.__name__} needs one Parameter in its annotation, or bounds: "
                f"Model.from_function({term.__name__}, {{{name!r}: (lower, upper)}})"
            )
        parameters[name] = notes[0]
    return parameters


def _declared_term(
    function: Term, name: str, bounds: Mapping[str, tuple[float, float]], units: Mapping[str, str]
) -> Term:
    """The function with a Parameter in the annotation of every argument, as the terms of the catalogue have it."""
    arguments = list(inspect.signature(function).parameters.values())
    if not arguments:
        raise ValueError(f"{name} takes no argument: its first is the Geometry, as in f(geometry, width)")
    arguments = arguments[1:]
    if unknown := (bounds.keys() | units.keys()) - {a.name for a in arguments}:
        have = ", ".join(a.name for a in arguments) or "none beside the Geometry"
        raise ValueError(f"{name} has no argument {min(unknown)!r}; it has {have}")
    if unbound := units.keys() - bounds.keys():
        raise ValueError(f"units name {min(unbound)!r}, and bounds do not: give its bounds too")
    annotated = get_type_hints(function, include_extras=True) if inspect.isroutine(function) else {}

    @functools.wraps(function)
    def term(geometry: Geometry, *given: Array, **shape: Array) -> Array:
        return function(geometry, *given, **shape)

    term.__name__ = name
    term.__annotations__ = {a.name: _annotation(a, annotated.get(a.name), name, bounds, units) for a in arguments}
    return term


def _annotation(
    argument: inspect.Parameter,
    hint: Any,
    name: str,
    bounds: Mapping[str, tuple[float, float]],
    units: Mapping[str, str],
) -> Any:
    """The declaration that an argument has, or one of its bounds."""
    if argument.name not in bounds:
        if any(isinstance(note, Parameter) for note in get_args(hint)):
            return hint
        raise ValueError(f"{name} needs bounds of {argument.name!r}: bounds={{{argument.name!r}: (lower, upper)}}")
    lower, upper = bounds[argument.name]
    if not -math.inf < lower <= upper < math.inf:
        raise ValueError(f"the bounds of {argument.name} are {lower:g} to {upper:g}: give two finite numbers in order")
    middle = math.sqrt(lower * upper) if lower > 0 else (lower + upper) / 2
    default = middle if argument.default is inspect.Parameter.empty else float(argument.default)
    return Annotated[float, Parameter(default, lower, upper, argument.name, units.get(argument.name, "1"))]


def depolarising(f: Array) -> Array:
    """Mueller matrix (..., 4, 4) of light that leaves unpolarised: `f` in element 00, zero elsewhere."""
    return f[..., None, None] * constants([[1.0] + [0.0] * 3] + [[0.0] * 4] * 3, f)


@functools.cache
def _unit(term: Term) -> TermUnit:
    hint: Any = get_type_hints(term, include_extras=True).get("return")
    notes = [a for a in get_args(hint) if isinstance(a, TermUnit)] if get_origin(hint) is Annotated else []
    if len(notes) != 1:
        raise ValueError(
            f"term {term.__name__} needs its unit in the return annotation: -> gonio.model.PerSteradian, PerDegree or "
            f"Dimensionless; or Model.from_function({term.__name__}, ..)"
        )
    return notes[0]

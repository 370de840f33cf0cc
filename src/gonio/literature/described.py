"""What a Model says of itself to people: its source, its equations, and both as HTML for notebooks."""

from collections.abc import Callable, Mapping
from typing import Any

from gonio.literature.equations import complete, equations, symbol
from gonio.literature.references import Reference, reference
from gonio.outside import html_table


class Described:
    """The part of a Model that reads its declaration for people; a Model has the attributes."""

    name: str
    title: str
    cite: str
    terms: Mapping[str, Callable[..., Any]]

    @property
    def source(self) -> Reference | None:
        """The publication that `cite` is the key of; None where `cite` is a text of its own, or empty."""
        return reference(self.cite)

    @property
    def equations(self) -> dict[str, tuple[str, ...]]:
        r"""The LaTeX of each term by its weight, with that of the factors it names; empty where its docstring has none.

        `\theta_i`, `\theta_r` and `\varphi` are the angles of `Geometry`, `\alpha` is the tilt of the facet and `\beta`
        the angle at which light meets it.
        """
        return {weight: complete(term) for weight, term in self.terms.items()}

    @property
    def sum_of_terms(self) -> str:
        """The LaTeX of the whole model, f = weight times term + ..; empty where a term states no equation."""
        names = [first.partition("=")[0] for term in self.terms.values() for first in equations(term)[:1]]
        if len(names) < len(self.terms):
            return ""
        names = [name.replace(r"\begin{aligned}", "").strip(" \n&") for name in names]
        return "f = " + " + ".join(rf"{symbol(w)}\,{name}" for w, name in zip(self.terms, names, strict=True))

    def _repr_html_(self: Any) -> str:
        """Title, source with its link, equations, what it violates, and its parameters, for notebooks."""
        import html

        source = self.source
        origin = html.escape(str(source).removesuffix(source.link) if source else self.cite)
        if source and source.link:
            origin += f'<a href="{html.escape(source.link)}">{html.escape(source.doi or source.link)}</a>'
        shown = [self.sum_of_terms, *(first for term in self.terms.values() for first in equations(term)[:1])]
        parts = [f"<b>{html.escape(self.name)}</b>: {html.escape(self.title)}", origin]
        parts += [f"$${html.escape(block)}$$" for block in shown if block]
        parts += [f"It violates {law}: {html.escape(why)}." for law, why in sorted(self.violates.items())]
        rows = [(n, f"weight of its term [{self.term_unit(n)}]", "0", "", "") for n in self.terms]
        rows += [(n, p.help, f"{p.lower:g}", f"{p.upper:g}", p.unit) for n, p in self.shape.items()]
        heads = ("parameter", "meaning", "lower", "upper", "unit")
        return "".join([*(f"<p>{part}</p>" for part in parts if part), html_table(heads, rows)])

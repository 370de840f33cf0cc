"""A model as functions of a shading language: what the light alone decides is computed in one of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from gonio.exporting.languages.language import Writer
from gonio.exporting.languages.shading import VECTOR, Arguments, Shading
from gonio.symbols.formula import INCIDENCE, REFLECTION, Formula
from gonio.symbols.program import Stage, staged

LIGHT, VIEW = ("w_i", VECTOR), ("w_r", VECTOR)
_PLACES = {n: f"w_i[{k}]" for k, n in enumerate(INCIDENCE)} | {n: f"w_r[{k}]" for k, n in enumerate(REFLECTION)}


@dataclass(frozen=True)
class Functions:
    """NAME(w_i, w_r) in a shading language, and what it calls.

    Attributes
    ----------
    language : Shading
        The language.
    formula : Formula
        The BRDF.
    name : str
        How the function is called.
    places : mapping
        Where the shader has each parameter, such as an element of an array, by its name.
    arguments : tuple
        What every function takes besides directions, where the places are arguments and not globals.
    prepares : bool
        Whether the shader computes what the parameters give on their own; otherwise it has that in NAME_pre.

    """

    language: Shading
    formula: Formula
    name: str
    places: Mapping[str, str]
    arguments: Arguments = ()
    prepares: bool = False

    @property
    def stem(self) -> str:
        """What other names begin with: no two underscores follow each other in GLSL."""
        return self.name.rstrip("_") or "model"

    def lines(self) -> list[str]:
        """Constant arrays, functions that the language lacks, and the functions of the model."""
        writer = Writer(self.language, self.stem)
        called = {"parameters": "pre" if self.prepares else f"{self.stem}_pre", "incidence": "inc"}
        program = staged(self.formula, called)
        pre, inc, last = program.stages
        n_pre, n_inc = (len(program.carried[level]) for level in ("parameters", "incidence"))
        carried: Arguments = (*self.arguments, *([("pre", n_pre)] if self.prepares and n_pre else []))
        ready: Arguments = (*carried, *([("inc", n_inc)] if n_inc else []))
        found: list[list[str]] = []
        main: list[str] = []
        if self.prepares and n_pre:
            found.append(self._array(writer, "prepare", self.arguments, pre))
            main += self.language.takes_array("pre", n_pre, f"{self.stem}_prepare", _names(self.arguments))
        if n_inc:
            found.append(self._array(writer, "incidence", (*carried, LIGHT), inc))
            main += self.language.takes_array("inc", n_inc, f"{self.stem}_incidence", (*_names(carried), "w_i"))
        inside, results = self._inside(writer, last)
        arguments = (*ready, LIGHT, VIEW)
        found.append(self.language.gives_number(f"{self.stem}_reflected", arguments, inside, results[0]))
        call = f"{self.stem}_reflected({', '.join(_names(arguments))})"
        found.append(self.language.gives_number(self.name, (*self.arguments, LIGHT, VIEW), main, call))
        shared = [] if self.language.tables_are_local else writer.tables()
        return [*shared, *writer.support(), *(line for function in found for line in ("", *function))]

    def _array(self, writer: Writer, what: str, arguments: Arguments, stage: Stage) -> list[str]:
        inside, results = self._inside(writer, stage)
        return self.language.gives_array(f"{self.stem}_{what}", arguments, inside, results)

    def _inside(self, writer: Writer, stage: Stage) -> tuple[list[str], list[str]]:
        """The statements of a function and its results: its inputs get their names first."""
        places = {**self.places, **_PLACES}
        names = [n for n in (*self.formula.inputs[0], *INCIDENCE, *REFLECTION) if n in stage.inputs]
        language = self.language
        known = {n: language.identifier(n) for n in names}
        lines = [language.let(known[n], places[n], False) for n in names if places[n] != known[n]]
        lines += writer.stage(stage)
        results = writer.results(stage)
        if language.tables_are_local:
            text = "\n".join((*lines, *results))
            lines = [*writer.tables(lambda name: f"{name}[" in text), *lines]
        return lines, results


def _names(arguments: Sequence[tuple[str, int]]) -> list[str]:
    return [name for name, _ in arguments]

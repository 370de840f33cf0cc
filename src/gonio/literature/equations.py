r"""The equations that terms and the functions they share state in their docstrings, as reStructuredText has them.

A docstring holds each equation as a `.. math::` block in LaTeX, formulas within a sentence as :math:`x`, and names the
functions that define its other factors as :func:`.name`: they are looked up in the module of the function, and belong
to the equation.
"""

import inspect
import re
import textwrap
from collections.abc import Callable
from typing import Any

_SECTION = re.compile(r"^\w[\w ]*\n-{3,}$", re.MULTILINE)
_BLOCK = re.compile(r"^\.\. math::\n\n((?: {4}.*\n|\n)+)", re.MULTILINE)
_FORMULA = re.compile(r":math:`([^`]+)`")
_FACTOR = re.compile(r":func:`\.(\w+)`")

# The letters of literature for parameters whose name is a word, or would be another quantity's letter: alpha is the
# tilt of a facet.
_LETTERS = {
    "width": "w",
    "index": "n",
    "extinction": "k",
    "wavelength": r"\lambda",
    "length": r"\ell",
    "alpha": "a",
    "depth": "d",
    "thickness": "d",
    "theta": r"\Theta",
    "eps": r"\varepsilon",
    "f0": "F_0",
    "f1": "F_1",
}
_GREEK = {"alpha", "gamma", "theta", "rho", "sigma", "tau", "Omega"}


def symbol(name: str) -> str:
    r"""The letter of a parameter in LaTeX: `sigma_m` \sigma_m, `kdd` k_{dd}, `b01` b_{01}, `tilt` \mathrm{tilt}."""
    if letter := _LETTERS.get(name):
        return letter
    head, _, tail = name.partition("_")
    if (
        head not in _GREEK
        and not tail
        and (short := re.fullmatch(r"([a-zA-Z])([0-9]+|(?<=[kr])[a-z]{1,2}|(?<=f)(?:iso|vol|geo))", name))
    ):
        head, tail = short.groups()
    base = "\\" + head if head in _GREEK else head if len(head) == 1 else rf"\mathrm{{{head}}}"
    if not tail:
        return base
    return f"{base}_{tail}" if len(tail) == 1 else f"{base}_{{{tail}}}"


def equations(function: Callable[..., Any]) -> tuple[str, ...]:
    """The LaTeX of every block in the docstring of a function."""
    return tuple(textwrap.dedent(block).strip() for block in _BLOCK.findall(_docstring(function)))


def factors(function: Callable[..., Any]) -> tuple[Callable[..., Any], ...]:
    """The functions that the equations of a function name, and those that these name, each once and in order.

    Raises KeyError for a name that the module of the function does not have.
    """
    found: dict[str, Callable[..., Any]] = {}

    def follow(one: Callable[..., Any]) -> None:
        for name in _FACTOR.findall(_docstring(one)):
            factor = inspect.unwrap(one).__globals__[name]
            if found.setdefault(name, factor) is factor:
                follow(factor)

    follow(function)
    return tuple(found.values())


def complete(function: Callable[..., Any]) -> tuple[str, ...]:
    """The LaTeX of a function and of all its factors: all that it takes to compute it."""
    return tuple(block for one in (function, *factors(function)) for block in equations(one))


def summary(function: Callable[..., Any]) -> str:
    """The first line of the docstring, empty where there is none."""
    return _docstring(function).partition("\n")[0]


def markdown(function: Callable[..., Any]) -> str:
    """What stands below the first line of the docstring, as Markdown with equations between dollars.

    Sections of arguments and examples, whose headings are underlined, are for programmers and left out.
    """
    text = _SECTION.split(_docstring(function).partition("\n")[2])[0]
    text = _BLOCK.sub(lambda block: f"$$\n{textwrap.dedent(block[1]).strip()}\n$$\n\n", text)
    text = _FORMULA.sub(lambda formula: f"${' '.join(formula[1].split())}$", text)
    return _FACTOR.sub(r"`\1`", text).strip()


def _docstring(function: Callable[..., Any]) -> str:
    """The docstring without its indentation, and with a line's end behind its last line."""
    return inspect.cleandoc(function.__doc__ or "") + "\n"

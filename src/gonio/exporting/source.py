"""What all targets share that write source code: names, values with what they mean, and the proof of the formula."""

import math
import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from gonio.exporting.languages import c, javascript, python
from gonio.exporting.subject import Subject
from gonio.exporting.target import Proof
from gonio.geometry import Geometry
from gonio.symbols.evaluate import evaluate
from gonio.symbols.formula import formula_of
from gonio.symbols.graph import Node
from gonio.symbols.program import Program, staged

RESERVED = c.KEYWORDS | javascript.KEYWORDS | python.RESERVED  # a name serves for every language
DOUBLE = 1e-12  # relative error of printed double precision: some hundred operations
PAIRS = 200


def identifier(text: str) -> str:
    """A name for a program: letters, digits and underscores, of which the first is no digit."""
    name = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "model"
    name = f"_{name}" if name[0].isdigit() else name
    return f"{name}_" if name in RESERVED else name


def programmed(subject: Subject) -> tuple[Program, dict[str, list[float]]]:
    """The model in three functions, and the numbers that the first of them gives for the values of the subject."""
    formula = formula_of(subject.model)
    program = staged(formula)
    pre = evaluate(program.carried["parameters"], dict(subject.values))
    return program, {"values": [subject.values[n] for n in formula.inputs[0]], "pre": [float(v) for v in pre]}


def prepared(nodes: Sequence[Node], values: dict[str, float]) -> list[float]:
    """Numbers that depend on the parameters alone."""
    return [float(v) for v in evaluate(nodes, values)]


def pairs() -> Geometry:
    """PAIRS pairs of directions: any, and those at which formulas fail if they do.

    The normal, the mirror direction, opposition, grazing directions and directions below the horizon.
    """
    random = np.random.default_rng(7)
    z = random.uniform(0.02, 1.0, (2, PAIRS))
    azimuth = random.uniform(0, 2 * math.pi, (2, PAIRS))
    light, view = (_vectors(z[k], azimuth[k]) for k in range(2))
    light[:, 0] = view[:, 0] = (0.0, 0.0, 1.0)
    view[:, 1:20] = light[:, 1:20] * np.array([[-1.0], [-1.0], [1.0]])
    view[:, 20:30] = light[:, 20:30]
    light[:, 30:40] = _vectors(np.full(10, 1e-4), azimuth[0, 30:40])
    view[:, 35:45] = _vectors(np.full(10, 3e-5), azimuth[1, 35:45])
    view[2, 45:50] *= -1
    light[2, 50:55] *= -1
    light[:, 55:57] = _vectors(np.zeros(2), azimuth[0, 55:57])
    view[:, 57:80] = _vectors(z[1, 57:80] * 0 + 0.5, np.full(23, 0.3))  # a narrow lobe about the mirror direction
    near = view[:, 57:80] * np.array([[-1.0], [-1.0], [1.0]]) + random.normal(0, 0.02, (3, 23))
    light[:, 57:80] = near / np.linalg.norm(near, axis=0)
    return Geometry(*light, *view)


def _vectors(z: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    sine = np.sqrt(1 - z**2)
    return np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z])


def proved(
    subject: Subject,
    how: str,
    run: Callable[[Geometry], np.ndarray],
    limit: float = DOUBLE,
    geometry: Geometry | None = None,
) -> Proof:
    """The largest error of a printed program over PAIRS pairs, or others, relative to the model's value there."""
    geometry = geometry or pairs()
    expected = np.asarray(subject.brdf(geometry), dtype=float)
    found = np.asarray(run(geometry), dtype=float)
    scale = np.maximum(np.abs(expected), 1e-290)
    same = (found == expected) | (np.isnan(found) & np.isnan(expected))
    error = np.where(same, 0.0, np.abs(found - expected) / scale)
    return Proof(how, float(np.max(error)), limit)


def refuse_suffix(out: Path, suffixes: Sequence[str], title: str) -> None:
    """ValueError for a file name that the program would not open."""
    if suffixes and out.suffix.lower() not in suffixes:
        raise ValueError(f"{out}: a file for {title} is called {out.stem}{suffixes[0]}: choose such a name")

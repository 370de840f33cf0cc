"""A formula as a program: assignments in an order that works, sums as loops, in up to three functions.

Every expression stands in the outermost loop that has all the axes that it depends on, so what does not change in a
loop is computed before it.
"""

from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from gonio.symbols.formula import LEVELS, Formula
from gonio.symbols.graph import Axis, Node

LONGEST = 70  # characters, about, of an expression before a part of it gets a name
_LEAVES = ("constant", "input", "table")


@dataclass(frozen=True)
class Let:
    """A name for an expression."""

    name: str
    node: Node


@dataclass(frozen=True)
class Loop:
    """A sum: its name, the axis that the loop runs along, and what it adds up in each round."""

    name: str
    node: Node
    axis: Axis
    statements: tuple["Let | Loop", ...]

    @property
    def body(self) -> Node:
        """What is added."""
        return self.node.args[0]


Statement = Let | Loop


@dataclass(frozen=True)
class Stage:
    """A function of a program: statements, then the results in order.

    `names` are how expressions are called in it, those of earlier functions included. `inputs` are the names of the
    inputs that it needs.
    """

    level: int
    statements: tuple[Statement, ...]
    results: tuple[Node, ...]
    names: Mapping[Node, str]
    inputs: tuple[str, ...]


@dataclass(frozen=True)
class Program:
    """Functions of the levels `parameters`, `incidence` and `reflection`, in this order, or the last alone.

    `carried` has what each of the first two hands on, in order; the last one gives the outputs of the formula.
    """

    formula: Formula
    stages: tuple[Stage, ...]
    carried: Mapping[str, tuple[Node, ...]] = field(default_factory=dict)

    @property
    def last(self) -> Stage:
        """The function that gives the outputs."""
        return self.stages[-1]

    def tables(self) -> tuple[Node, ...]:
        """The constant arrays, in the order in which they are used."""
        return tuple(node for node in self.formula.nodes if node.op == "table")


def staged(formula: Formula, carried: Mapping[str, str] | None = None) -> Program:
    """The program of three functions; `carried` names the arrays in which the first two hand on what they found."""
    called = carried or {LEVELS[0]: "pre", LEVELS[1]: "inc"}
    handed: dict[str, tuple[Node, ...]] = {}
    stages: list[Stage] = []
    known: dict[Node, str] = {}
    for level, name in enumerate(LEVELS[:2]):
        results = tuple(_handed_on(formula, level))
        stages.append(_stage(formula, level, results, known))
        handed[name] = results
        known |= {node: f"{called[name]}[{k}]" for k, node in enumerate(results)}
    stages.append(_stage(formula, 2, tuple(formula.outputs.values()), known))
    return Program(formula, tuple(stages), handed)


def whole(formula: Formula) -> Program:
    """The program of one function."""
    return Program(formula, (_stage(formula, 2, tuple(formula.outputs.values()), {}),))


def _handed_on(formula: Formula, level: int) -> Iterator[Node]:
    """What is computed at a level and needed later."""
    needed = {a for n in formula.nodes if formula.level[n] > level for a in n.args} | set(formula.outputs.values())
    for node in reversed(formula.nodes):  # truth values are found again, as an array of numbers holds none
        if node in needed and node.boolean and formula.level[node] == level:
            needed |= set(node.args)
    for node in formula.nodes:
        own = formula.level[node] == level and not node.axes and node.op not in _LEAVES
        if node in needed and own and not node.boolean:
            yield node


def _stage(formula: Formula, level: int, results: Sequence[Node], known: Mapping[Node, str]) -> Stage:
    return _Arranged(formula, results, known).stage(level)


class _Arranged:
    """The statements of one function."""

    def __init__(self, formula: Formula, results: Sequence[Node], known: Mapping[Node, str]) -> None:
        self.results = tuple(results)
        self.names = dict(known)
        self.needed = list(_unknown(results, known))
        self.uses = Counter(a for n in self.needed for a in n.args)
        self.readable = formula.names
        taken = {name for level in formula.inputs for name in level}
        self.taken = {*taken, *formula.outputs}
        self.own = self._own_names()

    def _own_names(self) -> set[Node]:
        """Which expressions get a name: used twice, long, known to people, or hoisted out of a loop."""
        own: set[Node] = set()
        lengths: dict[Node, int] = {}
        for node in self.needed:
            lengths[node] = 4 + sum(8 if a in own else lengths.get(a, 8) for a in node.args)
            if node.op in _LEAVES:
                continue
            if self.uses[node] > 1 or node.op == "sum" or node in self.readable or lengths[node] > LONGEST:
                own.add(node)
        for node in self.needed:  # what a loop does not change is computed before it
            if node.op != "sum":
                own |= {a for a in node.args if a.op not in _LEAVES and a in self.uses and a.axes != node.axes}
        return own - self.names.keys()

    def stage(self, level: int) -> Stage:
        inputs = tuple(str(n.value) for n in self.needed if n.op == "input")
        statements = tuple(self._statements(self.results, frozenset()))
        return Stage(level, statements, self.results, self.names, inputs)

    def _statements(self, targets: Collection[Node], scope: frozenset[Axis]) -> Iterator[Statement]:
        """What has to be said before the targets can be written, in a loop along the axes of `scope`."""
        for node in _unknown(targets, self.names):
            if node in self.names or node not in self.own or not node.axes <= scope:
                continue
            if node.op == "sum" and isinstance(node.value, Axis):
                axis = node.value
                inner = tuple(self._statements(node.args, scope | {axis}))
                for statement in inner:
                    self.names.pop(statement.node)  # known in the loop alone
                self.names[node] = self._name(node, "total")
                yield Loop(self.names[node], node, axis, inner)
            else:
                self.names[node] = self._name(node, "t")
                yield Let(self.names[node], node)

    def _name(self, node: Node, kind: str) -> str:
        name = self.readable.get(node, "")
        if not name or name in self.taken:
            number = sum(1 for t in self.taken if t.startswith(f"{kind}_")) + 1
            name = f"{kind}_{number}"
        self.taken.add(name)
        return name


def _unknown(roots: Collection[Node], known: Mapping[Node, str]) -> Iterator[Node]:
    """What the roots need that has no name yet, arguments first."""
    seen: set[Node] = set()
    waiting = [(root, False) for root in reversed(list(roots))]
    while waiting:
        node, ready = waiting.pop()
        if ready:
            yield node
        elif node not in seen and node not in known:
            seen.add(node)
            waiting.append((node, True))
            waiting += [(arg, False) for arg in reversed(node.args)]

"""Models as formulas: called on symbols, kept as a graph without repetitions, put in order as a program.

No array library and no parser is needed: a model that runs on any array runs on a `Symbol`.
"""

from gonio.symbols import namespace as namespace

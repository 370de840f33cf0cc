"""What public names say of themselves: every argument, what comes back, and examples that run."""

import doctest
import inspect
from importlib import import_module

import pytest

import gonio
from gonio.fitting import Solution
from gonio.fitting.readable import Readable

validation = pytest.importorskip("numpydoc.validate", reason="docstrings are read by numpydoc: pip install gonio[docs]")

PUBLIC = [f"gonio.{name}" for name in gonio.__all__] + [f"{home}.{name}" for name, home in gonio._BELOW.items()]
# GL08: no docstring; PR01, PR02: arguments that are not described, or do not exist; RT01: nothing of what comes back.
ASKED = {"GL08", "PR01", "PR02", "RT01"}
# The options of a Problem are described once, where they are declared.
INHERITED = {"gonio.Problem"}
CLASSES = (gonio.Geometry, gonio.Model, gonio.Problem, Solution, Readable)


@pytest.mark.parametrize("name", PUBLIC)
def test_it_says_what_it_takes_and_returns(name):
    asked = ASKED - {"PR01"} if name in INHERITED else ASKED
    assert [fault for fault in validation.validate(name)["errors"] if fault[0] in asked] == []


def test_the_test_finds_what_is_missing():
    assert {fault[0] for fault in validation.validate("gonio.formats.writer")["errors"]} >= {"PR01", "RT01"}


@pytest.mark.parametrize("kind", CLASSES, ids=lambda kind: kind.__name__)
def test_every_public_method_and_attribute_is_described(kind):
    described = {name: value for name, value in vars(kind).items() if not name.startswith("_") and _has_words(value)}
    assert {name for name, value in described.items() if not inspect.getdoc(value)} == set()


def _has_words(value: object) -> bool:
    return callable(value) or isinstance(value, (classmethod, property)) or hasattr(value, "attrname")


@pytest.mark.parametrize("name", PUBLIC)
def test_its_examples_run(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # some write a file
    home, _, last = name.rpartition(".")
    thing = getattr(import_module(home), last)
    runner = doctest.DocTestRunner()
    for example in doctest.DocTestFinder(recurse=False).find(thing, name, globs={}):
        runner.run(example)
    assert runner.summarize(verbose=False).failed == 0

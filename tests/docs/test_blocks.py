"""Every block of code of the README and of the pages of docs is run, in the order of its page."""

import io
from pathlib import Path

import numpy as np
import pytest

from gonio import catalogue, sample, simulate, write
from pages import NOT_RUN, Reader, blocks, compare
from places import ROOT
from stacks import one_after_another, only_here

GENERATED = ("command-line.md", "formats.md")  # of which other tests run or hold what they show
OWN_TESTS = ("figures.md", "tables.md")  # tests/printed/test_page.py, tests/tables/test_page.py
WHOLE = ("tutorial.md",)  # tries every model; the others a few, as all take ten seconds
# What is drawn becomes pictures on the pages about figures. The others put every figure and report together, of which
# Matplotlib would take half of their time to make the same pictures again.
PICTURED = ("README.md", "tutorial.md", "results.md")
PAGES = [
    path
    for path in [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("**/*.md"))]
    if path.name not in (*GENERATED, *OWN_TESTS) and "_build" not in path.parts and blocks(path)
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The current folder, with the files that a reader has: a scan, a folder of scans, a fit."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    scan = sample("coating")
    write(scan, tmp_path / "scan.csv")
    monkeypatch.setattr("gonio.fitting.stack.cluster.connected", only_here)  # fit-stack without other processes
    monkeypatch.setattr("gonio.fitting.stack.cluster.fit_blocks", one_after_another)
    (tmp_path / "wafers").mkdir()
    for k in (1, 2, 10):
        values = {"rho_s": 0.2, "rho_d": 0.01 * k, "width": 0.3}
        one = simulate(catalogue["ggx"], values, [10.0, 30.0, 50.0], np.arange(-70, 71, 10.0), noise=0.01, seed=k)
        write(one, tmp_path / "wafers" / f"wafer{k}.csv")
    return tmp_path


def without_picture(figure, target, **settings):
    """The file, or the stream, of a figure that was made up to its pixels."""
    text = "<svg></svg>"
    if isinstance(target, io.IOBase):
        target.write(text if isinstance(target, io.TextIOBase) else text.encode())
    else:
        Path(target).write_text(text)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
@pytest.mark.usefixtures("folder")
def test_a_page_runs_as_it_is_printed(page, monkeypatch):
    if page.name not in WHOLE:
        few = [catalogue[name] for name in ("lambert", "torrance-sparrow", "ggx")]
        monkeypatch.setattr("gonio.comparison.answer.everything", lambda: few)
    if page.name not in PICTURED:
        monkeypatch.setattr("matplotlib.figure.Figure.savefig", without_picture)
    Reader(page).follow()


def test_why_a_block_is_not_run_is_one_of_few_reasons():
    """So that no block is left out for convenience."""
    reasons = {block.note.removeprefix(NOT_RUN) for page in PAGES for block in blocks(page) if block.note}
    assert all(any(reason.startswith(known) for known in REASONS) for reason in reasons), reasons


REASONS = ("the files are yours", "needs ", "installs ", "is part of ")


@pytest.mark.parametrize(
    ("page", "printed"),
    [("a 1.00 b", "a 1.04 b"), ("a\n...\nd", "a b c d"), ("a ...", "a b"), ("... d", "c d"), ("ks[30] 2", "ks[30] 2")],
)
def test_what_a_page_shows_may_differ_in_last_digits_and_leave_out(page, printed):
    compare(page, printed, "here")


@pytest.mark.parametrize(
    ("page", "printed"),
    [("a 1.0 b", "a 1.2 b"), ("a", "a b"), ("a ... d", "a b c"), ("a c", "a b"), ("a b", "a"), ("x 1", "x 1%")],
)
def test_what_a_page_shows_is_not_what_was_printed(page, printed):
    with pytest.raises(AssertionError):
        compare(page, printed, "here")

"""Two runs on one store, in every order of their steps: one refuses in a line, and the store is never mixed."""

import itertools
import os
import subprocess
import sys
from contextlib import suppress

import pytest

from gonio.fitting.stack import lock
from gonio.fitting.stack.manifest import Manifest
from gonio.fitting.stack.run import fit_block, prepare
from stacks import asked, contents, means, write_stack

BLOCKS = 2
STEPS = 2 + BLOCKS + 1  # prepare, hold the store, each block, and leave


def doubled(problem, stack, **settings):
    """Another fit, whose values nobody can take for those of the first."""
    result = means(problem, stack, **settings)
    return result.assign(value=2 * result["value"])


@pytest.fixture(scope="module")
def stack(tmp_path_factory):
    path = tmp_path_factory.mktemp("stack") / "stack.zarr"
    write_stack(path, {"sample": 4})
    return path


@pytest.fixture(scope="module")
def ended():
    """The number of a process that is no more."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


class Fit:
    """A run as a process makes it, step by step; stops where it is refused, is killed at step `killed_at`,
    and its workers may outlive it.
    """

    def __init__(self, declared, force, killed_at=STEPS, outlived=False):
        self.declared, self.force, self.killed_at, self.outlived = declared, force, killed_at, outlived
        self.refusal, self.steps = "", self._steps()
        self.is_over = False

    def _steps(self):
        run = prepare(self.declared, self.force)
        yield
        holds = run.held()
        holds.__enter__()
        self.holds = holds  # or the lock would go with it
        yield
        for block in run.todo:
            fit_block(run.job, block)
            yield
        holds.__exit__(None, None, None)

    def go(self, step, ended):
        """The next step, if there is one; what a killed process leaves is a lock of a process that is no more."""
        if self.is_over:
            return
        if step == self.killed_at:
            self.is_over = not self.outlived
            mine = self.declared.out / "manifest" / lock.NAME
            if hasattr(self, "holds") and mine.exists():
                mine.write_text(mine.read_text().replace(f" {os.getpid()} ", f" {ended} "))
            if self.is_over:
                return
        try:
            next(self.steps)
        except StopIteration:
            self.is_over = True
        except (ValueError, OSError) as error:
            self.refusal, self.is_over = str(error), True
            if hasattr(self, "holds"):  # the process ends, and what it held is released
                with suppress(StopIteration, ValueError):
                    self.holds.gen.throw(error)


def orders():
    """Every order of the steps of two runs in which each keeps its own order."""
    for firsts in itertools.combinations(range(2 * STEPS), STEPS):
        yield "".join("A" if k in firsts else "B" for k in range(2 * STEPS))


def alone(stack, out, fit_many):
    run = prepare(asked(stack, out, block=2, fit_many=fit_many))
    run.begin()
    for block in run.todo:
        fit_block(run.job, block)
    return contents(out)


@pytest.fixture(scope="module")
def results(stack, tmp_path_factory):
    """What each run gives alone, and what the store holds of each."""
    folder = tmp_path_factory.mktemp("alone")
    return [alone(stack, folder / name, fit_many) for name, fit_many in (("a", means), ("b", doubled))]


def check(fits, out, results, order):
    """Whatever is there is of one run, every marked block is whole, and a run that was refused said so in a line."""
    for fit in fits:
        assert len(fit.refusal.splitlines()) <= 1, order
    manifest = Manifest(out)
    marks = list(manifest.records())
    assert {record.run for record in marks} <= {manifest.digest()}, order
    there = contents(out)
    mine = results[0] if manifest.digest() == fits[0].digest else results[1]
    for record in marks:
        chunks = {name for name in mine if name.split("/")[1:2] == ["c"] and name.split("/")[2] == str(record.block)}
        assert chunks
        assert {name: there.get(name) for name in chunks} == {name: mine[name] for name in chunks}, order
    assert {name for name in there if name not in mine} == set(), order
    return len(marks)


def tried(out, results, order, ended, fits):
    for fit in fits:
        fit.digest = prepare(fit.declared, True).job.digest
    done = [0, 0]
    for who in order:
        k = "AB".index(who)
        fits[k].go(done[k], ended)
        done[k] += 1
    return check(fits, out, results, order)


EVERY = 83  # of the 252 orders each variant tries other ones, three or four
NAMED = ("AAAAABBBBB", "AABBBBBAAA", "AAABBBBBAA")  # one after the other, B while A is at work, B after a block of A
VARIANTS = {
    "other options and force": (False, (False, True), STEPS),
    "force on both": (False, (True, True), STEPS),
    "other options": (False, (False, False), STEPS),
    "the same command": (True, (False, False), STEPS),
    "killed when it holds the store": (False, (False, True), 2),
    "killed after a block": (True, (False, False), 3),
    "outlived by its workers": (False, (False, True), 2),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_two_runs_are_never_mixed(stack, results, ended, tmp_path, name):
    (same, forces, killed_at), whole = VARIANTS[name], 0
    drawn = itertools.islice(orders(), list(VARIANTS).index(name), None, EVERY)
    for k, order in enumerate([*NAMED, *drawn]):
        out = tmp_path / f"{k}.zarr"
        declared = [asked(stack, out, block=2, fit_many=f) for f in (means, means if same else doubled)]
        fits = [Fit(declared[0], forces[0], killed_at, "outlived" in name), Fit(declared[1], forces[1])]
        whole += tried(out, [results[0], results[0]] if same else results, order, ended, fits) == BLOCKS
        if killed_at == STEPS:
            assert any(not fit.refusal for fit in fits), order
    assert whole, "no order has come to the end"


def test_a_run_that_was_resumed_after_another_began_anew_is_refused(stack, tmp_path):
    """Its workers were not yet there when it looked at the store."""
    out = tmp_path / "out.zarr"
    first = prepare(asked(stack, out, block=2))
    with first.held():
        fit_block(first.job, 0)
    again = prepare(asked(stack, out, block=2))
    other = prepare(asked(stack, out, block=2, fit_many=doubled), force=True)
    with other.held():
        pass
    with pytest.raises(ValueError, match="is now the store of another run"), again.held():
        pass
    assert not (out / "manifest" / lock.NAME).exists()

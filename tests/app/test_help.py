"""What every `--help` teaches, and the options that every command line is expected to have."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import gonio
from gonio.app.help_page import EXIT_CODES, sections
from gonio.app.program import COMMANDS, EXAMPLES, GROUPS, app
from gonio.options import Option, Panel
from places import ROOT, loaded

PROGRAM = typer.main.get_command(app)
ROOT_CONTEXT = PROGRAM.make_context("gonio", [], resilient_parsing=True)
BUILT = {name: PROGRAM.get_command(ROOT_CONTEXT, name) for name in COMMANDS}


def options(command):
    return [one for one in command.params if one.param_type_name == "option"]


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_has_its_group_and_a_value_that_people_can_read(name):
    for one in options(BUILT[name]):
        assert one.rich_help_panel in set(Panel), one.name
        assert one.help, one.name
        typed, meaning = one.get_help_record(BUILT[name].make_context(name, [], resilient_parsing=True))
        assert "<" not in typed, typed
        assert "[" not in typed, typed
        assert meaning[0].islower() or meaning.startswith(("Show", "Stokes", "BRDF")), meaning


@pytest.mark.parametrize("name", COMMANDS)
def test_every_number_has_bounds(name):
    """A count below zero, an angle beyond 180 deg or a number that is none is refused with what may be given."""
    for one in options(BUILT[name]):
        if one.metavar in ("N", "DRAWS", "NM", "DEG") and one.multiple is False and one.name not in ("at",):
            assert one.help.endswith(")"), f"{name} {one.opts}: {one.help}"


@pytest.mark.parametrize("name", COMMANDS)
@pytest.mark.parametrize("flag", ["--help", "-h"])
def test_a_help_has_groups_and_three_examples(run, name, flag):
    code, out, err = run(name, flag)
    assert (code, err) == (0, "")
    titles = [line.rstrip(":") for line in out.splitlines() if line.endswith(":") and not line.startswith(" ")]
    assert titles[-2:] == ["General", "Examples"]
    assert [t for t in titles if t in set(Panel)] == [t for t in Panel if t in titles]  # in one order everywhere
    assert len(BUILT[name].examples) >= 3
    for example in BUILT[name].examples:
        assert f"    {example.line}\n" in out  # on one line, to be copied
        assert example.line.startswith((f"gonio {name}", f"gonio {name.replace('-', ' ')}"))  # plan next
        assert len(example.what) <= 76, example.what
        assert len(example.line) <= 76, example.line
    assert out.startswith(f"Usage: gonio {name} [OPTIONS]")
    assert all(len(line) <= 80 for line in out.splitlines())


def test_the_groups_of_fit():
    """As F46 of the cases has it; --hold says what it does."""
    found = dict(sections(BUILT["fit"], BUILT["fit"].make_context("fit", [], resilient_parsing=True)))
    wanted = ["Arguments", "Data", "Model", "Weights", "Uncertainty", "Solver", "Ranking", "Figure", "Output"]
    wanted.append("General")
    assert list(found) == wanted
    assert max(map(len, found.values())) <= 15
    hold = next(meaning for typed, meaning in found["Model"] if typed.startswith("--hold"))
    assert "fix parameters at values" in hold


@pytest.mark.parametrize("arguments", [(), ("--help",), ("-h",)])
def test_gonio_alone_is_its_help(run, arguments):
    code, out, err = run(*arguments)
    assert (code, err) == (0, "")
    for word in (*GROUPS, *COMMANDS, "--version", "--install-completion", "--show-completion", "Exit codes"):
        assert word in out
    assert all(code.number in out and code.meaning.split(":")[0] in out for code in EXIT_CODES)
    assert all(f"    {example.line}\n" in out for example in EXAMPLES)


def test_the_version(run):
    assert run("--version") == (0, f"gonio {gonio.__version__}\n", "")


def test_python_m_gonio(tmp_path):
    environment = os.environ | {"PYTHONPATH": str(Path(gonio.__file__).parents[1])}
    for words, code, said in (("--version", 0, gonio.__version__), ("nothing", 2, "No such command 'nothing'")):
        line = [sys.executable, "-m", "gonio", words]
        done = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path, env=environment, check=False)
        assert done.returncode == code
        assert said in done.stdout + done.stderr


def test_the_exit_codes_are_those_that_are_documented(run, tmp_path):
    assert run("formats", "-q")[0] == 0
    assert run("info", tmp_path / "missing.csv")[0] == 1
    for wrong in (("nothing",), ("info",), ("info", "--nothing"), ("fit", "x.csv", "--seed", "x")):
        code, out, err = run(*wrong)
        assert (code, out) == (2, "")
        assert "Try 'gonio" in err


def test_help_loads_nothing_heavy():
    """What keeps `gonio --help` within a quarter of a second."""
    heavy = "{'numpy', 'scipy', 'xarray', 'pandas', 'matplotlib', 'jax', 'rich', 'logging'} & set(sys.modules)"
    code = "import sys; sys.argv = ['gonio', '--help']\nfrom gonio.app.cli import main\ntry: main()\n"
    code += f"except SystemExit: print(*{heavy}, file=sys.stderr)"
    environment = os.environ | {"PYTHONPATH": str(Path(gonio.__file__).parents[1])}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, env=environment)
    assert "Usage: gonio" in done.stdout
    assert done.stderr == "\n"


def test_a_number_out_of_its_bounds_is_refused():
    low, between, above = Option("", lowest=0), Option("", lowest=0, highest=180), Option("", above=0)
    assert (low.range, between.range, above.range) == ("0 or more", "0 to 180", "above 0")
    assert (low.within(0, "--a"), between.within(180, "--a"), above.within(1e-9, "--a")) == (0, 180, 1e-9)
    for option, value, remedy in (
        (low, -1, "give 0 or more"),
        (low, float("inf"), "give 0 or more"),
        (between, 180.1, "give a number from 0 to 180"),
        (above, 0, "give a number above 0"),
        (Option(""), float("nan"), "give a finite number"),
    ):
        with pytest.raises(ValueError, match=f"^--a is .*: {remedy}$"):
            option.within(value, "--a")


def test_the_pages_are_current():
    """docs/command-line.md and the man page say what the commands declare; `make pages` writes them."""
    sys.path.insert(0, str(ROOT / "docs" / "pages"))
    try:
        made = loaded(ROOT / "docs" / "pages" / "command_line.py")
    finally:
        sys.path.remove(str(ROOT / "docs" / "pages"))
    root = made.Root()
    assert (ROOT / "docs" / "command-line.md").read_text(encoding="utf-8") == made.page(root)
    assert (ROOT / "docs" / "gonio.1").read_text(encoding="utf-8") == made.manual(root)


@pytest.mark.parametrize("checker", [("mandoc", "-T", "lint", "-W", "warning"), ("groff", "-man", "-ww", "-z")])
def test_the_man_page_is_one(checker):
    try:
        done = subprocess.run([*checker, ROOT / "docs" / "gonio.1"], capture_output=True, text=True, check=False)
    except FileNotFoundError:
        pytest.skip(f"{checker[0]} is not installed")
    assert (done.returncode, done.stderr) == (0, "")

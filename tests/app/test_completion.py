"""What a shell completes: commands, options, and the names of models, formats, materials and files."""

import pytest

from gonio import catalogue
from gonio.formats import formats


@pytest.fixture
def completed(run, monkeypatch):
    """The words that bash is offered for what stands before the cursor."""

    def of(line):
        words = line.split(" ")
        monkeypatch.setenv("_GONIO_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", line)
        monkeypatch.setenv("COMP_CWORD", str(len(words) - 1))
        _, out, err = run()
        assert err == ""
        return out.split()

    return of


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("gonio fi", ["fit", "fit-stack"]),
        ("gonio --ver", ["--verbose", "--version"]),
        ("gonio fit scan.csv --model gg", ["ggx", "ggx-grain", "ggx-retro"]),
        ("gonio compare scan.csv --models ggx,war", ["ggx,ward", "ggx,ward-dur"]),
        ("gonio compare scan.csv --models fam", ["family"]),
        ("gonio fit scan.csv --weigh", ["--weighting"]),
        ("gonio fit scan.csv --weighting rel", ["relative"]),
        ("gonio fit scan.csv --solver a", ["anneal"]),
        ("gonio fit scan.csv --loss h", ["huber"]),
        ("gonio convert a.csv b.dat --to zem", ["zemax"]),
        ("gonio convert a.csv b.dat --fill sym", ["symmetry"]),
        ("gonio models cauchy-lorentz-", ["cauchy-lorentz-reciprocal"]),
        ("gonio eval lamb", ["lambert"]),
        ("gonio draw lamb", ["lambert"]),
        ("gonio check lamb", ["lambert"]),
        ("gonio eval ggx --published A", ["Al"]),
        ("gonio fetch merl/alumini", ["merl/aluminium"]),
        ("gonio materials go", ["gold", "gold-infrared"]),
        ("gonio plot scan.csv --figure resi", ["residuals"]),
    ],
)
def test_names_are_completed(completed, line, expected):
    assert completed(line) == expected


def test_all_models_and_formats_are_offered(completed):
    assert set(completed("gonio models ")) == set(catalogue)
    assert set(completed("gonio convert a.csv b.dat --to ")) == {f.name for f in formats().values() if f.write}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_of_a_shell_is_shown(run, monkeypatch, shell):
    # else it is the shell that runs the tests, which may be none
    monkeypatch.setenv("_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION", "1")
    code, out, err = run("--show-completion", shell)
    assert (code, err) == (0, "")
    assert "_GONIO_COMPLETE" in out

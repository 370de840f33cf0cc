"""An option of a fit is declared in one place: a field of ProblemOptions."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import gonio

DECLARATION = '    example_limit: Annotated[float, Option("an option that a test added", metavar="VALUE")] = 0.25\n'
BEFORE = "    point_weights: Values | None = None\n"
ASK = """
import contextlib, io, json, sys
from gonio import Problem, catalogue, simulate
from gonio.app.cli import main

told = {}
for command in ("fit", "compare", "plot", "fit-stack"):
    sys.argv = ["gonio", command, "--help"]
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        main()
    told[command] = out.getvalue()
scan = simulate(catalogue["lambert"], {"rho": 0.5}, [30.0], [0.0, 20.0, 40.0])
told["default"] = Problem(catalogue["lambert"], scan).example_limit
told["given"] = Problem(catalogue["lambert"], scan, example_limit=0.5).example_limit
print(json.dumps(told))
"""


def test_a_new_option_of_a_problem_is_one_field(tmp_path):
    """In a copy of the package with one line more the option is a flag of every command that fits, and of Problem."""
    package = tmp_path / "gonio"
    shutil.copytree(Path(gonio.__file__).parent, package, ignore=shutil.ignore_patterns("__pycache__"))
    options = package / "fitting" / "objective" / "options.py"
    text = options.read_text(encoding="utf-8")
    assert text.count(BEFORE) == 1
    options.write_text(text.replace(BEFORE, BEFORE + DECLARATION), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", ASK], capture_output=True, text=True, cwd=tmp_path, check=False,
        env={"PYTHONPATH": str(tmp_path), "COLUMNS": "120"},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    answers = json.loads(done.stdout)
    for command in ("fit", "compare", "plot", "fit-stack"):
        assert "--example-limit VALUE" in answers[command]
        assert "an option that a test added" in answers[command]
    assert (answers["default"], answers["given"]) == (0.25, 0.5)

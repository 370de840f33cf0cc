"""Scripts for FRED: which scatter model they add, with which numbers, and what the second one compares."""

import math
import re

import numpy as np
import pytest

import gonio
from gonio import catalogue
from gonio.exporting.entry import write
from gonio.exporting.subject import Subject, of_model
from gonio.exporting.targets.fred import compared, read


def exported(tmp_path, name, values):
    return gonio.export(catalogue[name], tmp_path / "coating.frs", to="fred", values=values)


def test_an_abg_is_the_structure_of_fred(tmp_path):
    done = exported(tmp_path, "abg", {"A": 0.01, "B": 0.02, "g": 1.5})
    text = done.files[0].read_text()
    for line in (
        "Dim t As T_ABGSCATTER", "InitAbgScatter t", "t.Acoef = 0.01", "t.Bcoef = 0.02", "t.G = 1.5",
        "t.ApplyRefl = True", "t.ApplyTrans = False", "t.HaltIncident = True", "n = AddAbgScatter(t)", "Update",
    ):  # fmt: skip
        assert f"    {line}\n" in text
    assert [f.name for f in done.files] == ["coating.frs", "coating_check.frs"]
    assert done.prove().holds


def test_a_harvey_shack_is_the_structure_of_fred(tmp_path):
    done = exported(tmp_path, "harvey-shack", {"b0": 0.1, "L": 0.01, "S": -1.5})
    found = read(done.files[0].read_text(), {"b0": "b0", "L": "L", "S": "S"})
    assert found == [{"b0": 0.1, "L": 0.01, "S": -1.5}]
    assert "AddHarveyShackScatter(t)" in done.files[0].read_text()


def test_a_lambertian_comes_back_as_half_over_pi(tmp_path):
    done = exported(tmp_path, "lambert", {"rho": 0.5})
    (found,) = read(done.files[0].read_text(), {"b0": "b0", "S": "S"})
    assert found == {"b0": pytest.approx(0.5 / math.pi), "S": 0.0}
    _, values = compared(done.files[1].read_text())
    assert values == pytest.approx(0.5 / math.pi)


def test_the_second_script_holds_twenty_directions_of_the_model(tmp_path):
    values = {"A": 0.01, "B": 0.02, "g": 1.5}
    g, found = compared(exported(tmp_path, "abg", values).files[1].read_text())
    assert len(found) == 20
    assert found == pytest.approx(np.asarray(catalogue["abg"](g, values)), rel=1e-9)  # of 12 printed digits
    text = (tmp_path / "coating_check.frs").read_text()
    assert text.index("ScatterPrepareForEval") < text.index("ScatterEval(id, -xi, -yi, -zi, -xi, -yi, zi, xr, yr, zr)")


def basic(text):
    """The subroutine of a scripted scatter model as a Python function: its statements are assignments alone."""
    body = re.search(r"Sub EvalScatter.*?\n(.*?)\nEnd Sub", text, re.S)[1]
    lines = []
    for line in map(str.strip, body.splitlines()):
        if line.startswith("Dim "):
            continue
        line = re.sub(r"^Const (\w+) As Double", r"\1", line)
        lines.append(line.replace("Log(", "math.log(").replace("Sqr(", "math.sqrt(").replace("Exp(", "math.exp("))

    def run(spec, scat, normal):
        t = type("T", (), {})()
        for name, vector in (("spec", spec), ("scat", scat), ("nrml", normal)):
            for axis, value in zip("XYZ", vector, strict=True):
                setattr(t, f"g_{axis}{name}", float(value))
        exec("\n".join(lines), {"math": math}, {"t": t})
        return t.g_BSDF

    return run


def test_a_binomial_is_a_script_that_computes_it(tmp_path):
    random = np.random.default_rng(2)
    values = {n: random.uniform(-0.5, 0.5) for n in catalogue["binomial"].shape} | {"scale": 0.03, "d": 40.0}
    done = exported(tmp_path, "binomial", values)
    run = basic(done.files[0].read_text())
    g, found = compared(done.files[1].read_text())
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]  # the surface may lie in any way
    for k in range(len(found)):
        w_i, w_r = (np.array([c[k] for c in part]) for part in (g[:3], g[3:]))
        specular = w_i * [-1, -1, 1]
        assert run(turn @ specular, turn @ w_r, turn @ [0, 0, 1]) == pytest.approx(found[k], rel=1e-9)
    assert done.prove().holds


def test_another_model_is_fitted_by_the_nearer_of_two(tmp_path):
    done = exported(tmp_path, "rayleigh-rice", {"A": 0.01})
    assert done.numbers["log10_rmse"] > 0
    assert "is not" in done.remarks[0]
    assert done.prove().holds


def test_every_set_is_a_scatter_model(tmp_path):
    sets = {c: {"A": a, "B": 0.01, "g": 2.0} for c, a in (("R", 0.01), ("G", 0.02))}
    done = write(Subject(catalogue["abg"], sets, by="channel"), tmp_path / "x.frs", "fred", "coating")
    text = done.files[0].read_text()
    assert text.count("AddAbgScatter(t)") == 2
    assert '"coating_R"' in text
    assert done.prove().holds


def test_text_from_outside_is_a_string_or_a_comment(tmp_path):
    subject = of_model(catalogue["abg"], {"A": 0.01}, origin='x" : Kill "*"\nKill "*"')
    text = write(subject, tmp_path / "x.frs", "fred").files[0].read_text()
    assert not any(line.strip().startswith("Kill") for line in text.splitlines())
    assert 't.Description = "x"" : Kill ""*""\\nKill ""*"""' in text

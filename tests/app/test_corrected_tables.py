"""`gonio export --correct` and `gonio convert --correct`: what they write, and what they refuse."""

import numpy as np
import pytest

from bumped import measured
from gonio import Problem, catalogue, fit, read, write


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("export", "ggx", "--set", "rho_s=0.5", "--correct", "--to", "zemax"), "a model is named: leave it out"),
        (("export", "scan.csv", "--model", "lambert", "--no-prior", "--to", "zemax"), "add --correct"),
        (("export", "scan.csv", "--model", "lambert", "--correct", "--to", "c"), "is in no formula"),
        (("convert", "scan.csv", "--correct", "--to", "zemax"), "as in --fill symmetry,ggx"),
        (("convert", "scan.csv", "--fill", "symmetry", "--correct", "--to", "zemax"), "as in --fill symmetry,ggx"),
        (("convert", "scan.csv", "--fill", "lambert", "--no-prior", "--to", "zemax"), "add --correct"),
    ],
)
def test_refusals(run, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    write(measured(), "scan.csv")
    command, source, *more = words
    out = ("out.x",) if command == "convert" else ("--out", "out.x")
    code, _, err = run(
        command, source, *(out if command == "convert" else ()), *more, *(out if command == "export" else ())
    )
    assert code == 1
    assert said in " ".join(err.split())
    assert not (tmp_path / "out.x").exists()


@pytest.mark.parametrize("command", ["export", "convert"])
def test_the_commands_correct(run, tmp_path, monkeypatch, command):
    monkeypatch.chdir(tmp_path)
    write(measured(), "scan.csv")
    fit(Problem(catalogue["lambert"], measured(), weighting="auto")).save(tmp_path / "fit.nc")
    written = {}
    for source in ("lambert", "fit.nc"):
        for more in ((), ("--correct",), ("--correct", "--no-prior")):
            of = ("scan.csv", "--model", "lambert") if source == "lambert" else (source,)
            words = {
                "export": ("export", *of, "--out", "out.nc", "--to", "netcdf"),
                "convert": ("convert", "scan.csv", "out.bsdf", "--to", "zemax", "--fill", source),
            }[command]
            code, _, err = run(*words, *more, "--force")
            assert code == 0, err
            out = read("out.nc" if command == "export" else "out.bsdf")
            written[(source, *more)] = out["brdf"].values
            texts = f"{out.attrs.get('history', '')} {out.attrs.get('provenance', '')}"
            assert ("corrected by 93 values" in " ".join(texts.split())) == bool(more)
    for source in ("lambert", "fit.nc"):
        assert not np.allclose(written[(source,)], written[(source, "--correct")], equal_nan=True)
    np.testing.assert_allclose(
        written[("lambert", "--correct")], written[("fit.nc", "--correct")], rtol=1e-6, equal_nan=True
    )

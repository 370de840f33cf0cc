"""What `gonio info`, `check` and the commands that fit say of mistakes, and the flags that mend them."""

import json
import math

import numpy as np
import pytest

from gonio import read
from gonio.measured.dataset import signed_theta_r

ANGLES = (10, 30, 50, 70)
THETA_R = range(-80, 81, 5)
FLAGS = (
    *("--radians", "--flip", "--mirror-azimuth", "--shift-theta-r"),
    *("--divide-cosine", "--divide", "--saturation", "--floor"),
)


def lobe(i, r):
    """A reciprocal lobe on a matt ground, in plane: a function of sin(theta_r) - sin(theta_i) alone."""
    away = math.sin(math.radians(r)) - math.sin(math.radians(i))
    return 0.01 + 0.1 * math.exp(-((away / 0.15) ** 2))


@pytest.fixture
def written(tmp_path):
    """A function that writes a scan of a BRDF and gives its path."""

    def write(brdf, angle=float, name="scan.csv"):
        rows = "".join(f"{angle(i):.6g},{angle(r):.6g},{brdf(i, r):.8g}\n" for i in ANGLES for r in THETA_R)
        path = tmp_path / name
        path.write_text(f"theta_i_deg,theta_r_deg,brdf_sr-1\n{rows}")
        return path

    return write


def findings(run, *arguments):
    code, out, _ = run(*arguments, "--json", "-")
    assert code == 0
    return {finding["name"]: finding for finding in json.loads(out)["findings"]}


@pytest.mark.parametrize("command", ["info", "check"])
@pytest.mark.parametrize(
    ("name", "wrong", "flags", "evidence"),
    [
        ("sign-reversed", {"brdf": lambda i, r: lobe(i, -r)}, ["--flip"], "at 3 of 3 incidence angles"),
        (
            "cosine-left-in",
            {"brdf": lambda i, r: lobe(i, r) * math.cos(math.radians(r))},
            ["--divide-cosine"],
            "dividing by cos(theta_r) makes reciprocity",
        ),
        ("radians", {"brdf": lobe, "angle": math.radians}, ["--radians"], "no polar angle is above"),
        ("percent", {"brdf": lambda i, r: 100 * (lobe(i, r) + 0.2)}, ["--divide", "100"], "when divided by 100"),
        ("factor-pi", {"brdf": lambda i, r: math.pi * (lobe(i, r) + 0.25)}, ["--divide", "pi"], "divided by pi"),
    ],
)
def test_a_mistake_is_found_and_mended(run, written, command, name, wrong, flags, evidence):
    path = written(**wrong)
    found = findings(run, command, path)
    assert found[name]["severity"] == ("note" if name == "factor-pi" else "warning")  # in plane, where R is estimated
    assert evidence in found[name]["evidence"]
    assert " ".join(flags) in found[name]["remedy"]
    assert set(findings(run, command, path, *flags)) <= {"no-uncertainty"}
    assert set(findings(run, command, written(lobe))) <= {"no-uncertainty"}


def test_a_flat_brdf_of_reflectance_100(run, written):
    path = written(lambda i, r: 31 + 4 * (r + 80) / 160)
    found = findings(run, "info", path)
    assert {"reflectance-above-one", "percent"} <= set(found)
    assert "--divide" in found["reflectance-above-one"]["remedy"]
    code, out, _ = run("info", path)
    assert code == 0
    assert "of the light that falls on the surface" in " ".join(out.split())


def test_keys_of_before_stay(run, written):
    record = json.loads(run("info", written(lambda i, r: lobe(i, -r)), "--json", "-")[1])
    assert [(c["severity"], c["remedy"]) for c in record["checks"]] == [
        (f["severity"], f["remedy"]) for f in record["findings"]
    ]
    assert all(f["name"] for f in record["findings"])
    verdicts = json.loads(run("check", written(lobe), "--json", "-")[1])["verdicts"]
    assert [v["law"] for v in verdicts] == ["positivity", "reciprocity", "energy"]
    assert isinstance(json.loads(run("check", "lambert", "--json", "-")[1]), list)


def test_a_fit_warns_and_takes_the_flag(run, written):
    path = written(lambda i, r: lobe(i, -r))
    _, _, err = run("fit", path, "--model", "lambert")
    assert "backscatter direction" in err
    assert "--flip" in err
    _, _, err = run("fit", path, "--model", "lambert", "--flip")
    assert err == ""


@pytest.mark.parametrize("command", ["info", "check", "fit", "compare", "plot", "convert"])
def test_every_command_that_reads_a_scan_has_the_flags(run, command):
    _, out, _ = run(command, "--help")
    assert [flag for flag in FLAGS if flag not in out] == []


def test_a_mended_scan_is_written_with_its_history(run, written, tmp_path):
    path = written(lambda i, r: 100 * lobe(i, -r))
    code, _, err = run("convert", path, tmp_path / "right.nc", "--flip", "--divide", "100")
    assert (code, err) == (0, "")
    right, wanted = read(tmp_path / "right.nc"), read(written(lobe, name="wanted.csv"))
    for scan in (right, wanted):
        scan["signed"] = ("direction", signed_theta_r(scan))
    order = [np.lexsort((scan["signed"].values, scan["theta_i"].values)) for scan in (right, wanted)]
    for name in ("theta_i", "signed", "brdf"):
        np.testing.assert_allclose(right[name].values[order[0]], wanted[name].values[order[1]], rtol=1e-6)
    assert right.attrs["history"].splitlines()[1:3] == [
        "exchanged the sides: phi + 180 deg",
        "divided the values by 100",
    ]


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (["--radians"], "no angle of the scan can be radians"),
        (["--divide", "0"], "cannot be divided by 0"),
        (["--divide", "two"], "--divide is 'two', not a number"),
        (["--saturation", "nan"], "the saturation is nan"),
        (["--shift-theta-r", "95"], "--shift-theta-r is 95: give a number from -90 to 90"),
    ],
)
def test_what_mends_nothing_is_refused_in_one_line(run, written, flags, words):
    code, out, err = run("info", written(lobe), *flags)
    assert (code, out, err.count("\n")) == (1, "", 1)
    assert words in err


def test_corrections_belong_to_scans(run, written, tmp_path):
    assert run("fit", written(lobe), "--model", "lambert", "--out", tmp_path / "fit")[0] == 0
    for command, target in (("info", tmp_path / "fit" / "solution.nc"), ("check", "lambert")):
        code, _, err = run(command, target, "--flip")
        assert code == 1
        assert "belong to a scan" in err


def test_info_prints_the_width_first_and_gamma_where_asked(run, written):
    path = written(lambda i, r: math.exp(-math.log(2) * ((r - i) / 14.1) ** 2))
    _, out, _ = run("info", path)
    assert out.count("14.1") == 4
    assert "half width of the lobe" in out
    assert "gamma" not in out
    assert "nothing wrong was found" in out
    _, out, _ = run("info", path, "--gamma")
    assert out.index("half width of the lobe") < out.index("gamma [deg]")
    record = json.loads(run("info", path, "--json", "-")[1])
    assert [round(one["half_width"], 3) for one in record["lobes"]] == [14.1] * 4
    assert len(record["half_widths"]) == 4

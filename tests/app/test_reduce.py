"""`gonio reduce` of raw readings: what it prints and writes, what it refuses, and that nothing gets lost on the way."""

import json
import math

import numpy as np
import pytest

from gonio import read
from gonio.raw import read_readings
from gonio.reduction import Filling, Known, Reduction, Relative, flags, reduce
from places import SHARED

FOLDER = SHARED / "raw" / "blacklab"
needs_files = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no measured files at {FOLDER}")
STANDARD = 1.02086
CERTIFICATE = f"{STANDARD}:factor@0,45"
OVER = Reduction(fill=Filling("over"))


@needs_files
def test_exactly_what_was_saturated_and_shaded_is_flagged(run, tmp_path):
    path, out = FOLDER / "nite_invar_a_l631h.inp.txt", tmp_path / "nite.csv"
    stated = ("--fill", "over", "--standard", CERTIFICATE, "--standard-signal", 4.816609 * STANDARD)
    code, text, err = run("reduce", path, *stated, "--out", out, "--json", "-")
    assert code == 0, err
    found = json.loads(text)["flags"]
    assert [(f["flag"], f["line"], f["theta_i"], f["theta_r"], f["phi"]) for f in found] == [
        ("saturated", 90, 70.0, 75.0, 180.0),
        ("saturated", 91, 70.0, 70.0, 180.0),
        ("shaded", 117, 70.0, 58.0, 0.0),
    ]
    again = read(out)
    assert np.flatnonzero(again["mask"].values).tolist() == [85, 86, 112]
    assert again["mask"].values[[85, 86, 112]].tolist() == [4, 4, 5]
    assert np.isfinite(again["brdf"].values).all()
    clean = reduce(
        read_readings(FOLDER / "z307_al_a_l631h.inp.txt"), Relative.parsed(CERTIFICATE, Known(9.17872)), OVER
    )
    assert flags(clean) == []


HEAD = "kind,theta_i_deg,theta_r_deg,signal_V,sd_V"
ROWS = [f"sample,20,{r},{0.002 + 0.02 * math.cos(math.radians(r)):.6f},2e-5" for r in range(-60, 61, 20)]
DARK, READ_STANDARD = "dark,,,0.002,1e-5", "standard,0,45,0.0702,2e-5"
LAMBERT = ("--fill", "under", "--standard", "0.99+-0.002:factor@0,45")


@pytest.fixture
def table(tmp_path):
    """Writes rows of readings as a table, and gives its path."""

    def write(*rows, name="readings.csv", head=HEAD):
        (tmp_path / name).write_text("\n".join([head, *rows]) + "\n")
        return tmp_path / name

    return write


def test_the_record_has_the_budget_and_the_file_every_cause(run, table, tmp_path):
    path, out = table(DARK, READ_STANDARD, *ROWS), tmp_path / "scan.csv"
    code, text, err = run("reduce", path, *LAMBERT, "--uncertainty", "zero=0.05", "--out", out, "--json", "-")
    assert code == 0, err
    record = json.loads(text)
    causes = ["random", "dark", "standard-reading", "standard", "zero"]
    assert [row["cause"] for row in record["budget"]] == causes
    assert [row["type"] for row in record["budget"]] == ["A", "A", "A", "B", "B"]
    by_cause = {row["cause"]: row for row in record["budget"]}
    assert by_cause["standard"]["relative"] == pytest.approx(0.002 / 0.99)
    assert by_cause["standard"]["shape"] == "one factor"
    assert record["flags"] == []
    assert (record["k"], record["fill"], record["directions"]) == (2.0, "under", len(ROWS))
    parts = np.array([row["by_direction"] for row in record["budget"]])
    assert record["combined"] == pytest.approx(np.sqrt((parts**2).sum(axis=0)).tolist())
    assert record["expanded"] == pytest.approx([2 * u for u in record["combined"]])
    assert np.diag(record["correlation"]) == pytest.approx(1.0)
    again = read(out)
    assert again["cause"].values.tolist() == causes[1:]
    relative = again["systematic"].values / again["brdf"].values
    assert relative == pytest.approx(parts[1:])
    # a Lambertian surface: one value, the signal at the normal over that of the standard at 45 deg
    assert again["brdf"].values == pytest.approx(0.02 / 0.0682 * 0.99 / math.pi * math.sqrt(0.5), rel=1e-4)


def test_people_see_the_budget_and_get_figure_and_page(run, table, tmp_path):
    path = table(DARK, READ_STANDARD, *ROWS)
    figure, page = tmp_path / "budget.pdf", tmp_path / "budget.html"
    code, out, err = run("reduce", path, *LAMBERT, "--out", tmp_path / "s.nc", "--figure", figure, "--report", page)
    assert code == 0, err
    text = " ".join(out.split())
    for words in ("uncertainty budget", "standard B normal one factor 0.202", "expanded, k=2", "cos(theta_r)"):
        assert words in text, words
    assert figure.read_bytes().startswith(b"%PDF")
    html = page.read_text()
    assert "<svg" in html
    assert '<td data-head="cause">standard</td><td data-head="type">B</td>' in html
    assert "subtracted the dark of 1 readings" in html
    code, _, err = run("reduce", path, *LAMBERT, "--out", tmp_path / "s2.nc", "--report", tmp_path / "budget.docx")
    assert code == 1
    assert "a report of a reduction is written as .html or .pdf" in err
    assert not (tmp_path / "s2.nc").exists()


def test_eq_10_as_printed_is_shown_beside_the_absolute_brdf(run, table, tmp_path):
    path = table(DARK, "incident,,,0.3,2e-5", *ROWS)
    stated = ("--fill", "under", "--absolute", "radius=4.75+-0.005,distance=500+-0.5,tau=1e-3+-1e-5")
    code, text, err = run("reduce", path, *stated, "--out", tmp_path / "s.csv", "--json", "-")
    assert code == 0, err
    record = json.loads(text)
    assert record["solid_angle"] == pytest.approx(2.835095471e-4, rel=1e-9)
    ratio = np.array(record["in_use"]["brdf"]) / record["eq10_as_printed"]["values"]
    assert ratio == pytest.approx(3527.2181, rel=1e-7)
    _, out, _ = run("reduce", path, *stated, "--out", tmp_path / "t.csv")
    assert "short of 1/Omega = 3527.2181" in " ".join(out.split())


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        (
            LAMBERT[2:],
            "readings.csv: the filling is not stated, and no reading tells it: say under where the detector sees",
        ),
        (LAMBERT[:2], "give --standard VALUE:factor@theta_i,theta_r, as 0.991+-0.002:factor@0,45, or --absolute"),
        ((*LAMBERT, "--absolute", "radius=1,distance=9"), "both are given: leave one out"),
        (
            (*LAMBERT, "--standard-signal", "1"),
            "line 3: the standard was read, and its signal is stated: leave one out",
        ),
        (
            ("--fill", "under", "--standard", "0.99:factor@8,0"),
            "line 3: the standard was read at theta_i 0, theta_r 45",
        ),
        (
            ("--fill", "under", "--standard", "0.99:8/d@8,0"),
            "a hemispherical reflectance, which says nothing about one",
        ),
        ((*LAMBERT, "--mirror"), "holds raw readings, and --mirror is for scans: leave it out"),
        ((*LAMBERT, "--uncertainty", "zerro=1"), "no cause 'zerro': nearest: zero"),
        ((*LAMBERT, "--nonlinearity", "1e-3"), "the level of the nonlinearity is 0"),
        ((*LAMBERT, "--gain", "hi=2"), "no reading has the range 'hi'; there are none"),
        ((*LAMBERT, "--specular", "0.5"), "--specular belongs to --signature"),
        ((*LAMBERT, "--tilt", "1,2,3"), "--tilt '1,2,3' is not of the form DEG,DEG"),
        ((*LAMBERT, "--unpolarised"), "unpolarised light needs readings in s and in p; there are none"),
    ],
)
def test_what_is_not_stated_is_refused_in_one_line(run, table, tmp_path, stated, message):
    path = table(DARK, READ_STANDARD, *ROWS)
    code, _, err = run("reduce", path, *stated, "--out", tmp_path / "scan.csv")
    assert code == 1
    assert err.count("\n") == 1
    assert message in err
    assert not (tmp_path / "scan.csv").exists()


def test_scans_take_no_options_of_readings_and_the_two_are_not_mixed(run, table, tmp_path):
    raw = table(*ROWS)
    scan = table("10,0,0.3", name="scan.csv", head="theta_i_deg,theta_r_deg,brdf_sr-1")
    for files, flags_of, message in (
        ([scan], ["--fill", "under"], "is a scan, and --fill is for raw readings"),
        ([raw, scan], list(LAMBERT), "holds raw readings and"),
    ):
        code, _, err = run("reduce", *files, *flags_of, "--out", tmp_path / "o.csv")
        assert code == 1
        assert message in err


def test_several_runs_are_kept_apart_or_averaged(run, table, tmp_path):
    paths = [table(DARK, READ_STANDARD, *ROWS, name=f"{name}.csv") for name in ("a", "b")]
    assert run("reduce", *paths, *LAMBERT, "--out", tmp_path / "all.csv")[0] == 0
    assert run("reduce", *paths, *LAMBERT, "--average", "--out", tmp_path / "mean.csv")[0] == 0
    every, mean = read(tmp_path / "all.csv"), read(tmp_path / "mean.csv")
    assert (every.sizes["direction"], mean.sizes["direction"]) == (2 * len(ROWS), len(ROWS))
    assert every["cause"].values.tolist() == [
        "dark of a", "standard-reading of a", "standard", "dark of b", "standard-reading of b",
    ]  # fmt: skip
    assert mean["uncertainty"].values == pytest.approx(every["uncertainty"].values[: len(ROWS)] / math.sqrt(2))
    common, own = ([every, mean][k]["systematic"].sel(cause=["standard", "dark of a"][k]).values for k in (0, 1))
    assert mean["systematic"].sel(cause="standard").values == pytest.approx(common[: len(ROWS)])
    assert own == pytest.approx(every["systematic"].sel(cause="dark of a").values[: len(ROWS)] / 2)


def test_a_table_goes_through_import_with_its_signal(run, tmp_path):
    lab = tmp_path / "lab.csv"
    lab.write_text("AOI [deg];AOS [deg];Signal [nA]\n" + "".join(f"30;{r};{2.5 - r / 100}\n" for r in (-20, 0, 40)))
    assert run("import", lab, "--out", tmp_path / "lab.gonio.csv")[0] == 0
    stated = ("--fill", "over", "--standard", "1:factor@0,0", "--standard-signal", "5")
    code, _, err = run("reduce", tmp_path / "lab.gonio.csv", *stated, "--out", tmp_path / "scan.csv")
    assert code == 0, err
    expected = np.array([2.7, 2.5, 2.1]) / 5 / math.pi / math.cos(math.radians(30))
    assert read(tmp_path / "scan.csv")["brdf"].values == pytest.approx(expected)


def test_a_fit_of_the_file_reports_each_cause(run, table, tmp_path):
    path = table(DARK, READ_STANDARD, *ROWS)
    run("reduce", path, *LAMBERT, "--out", tmp_path / "scan.csv")
    code, text, err = run("fit", tmp_path / "scan.csv", "--model", "lambert", "--json", "-")
    assert code == 0, err
    rho = _rho(json.loads(text))
    assert list(rho["systematic"]) == ["dark", "standard-reading", "standard"]
    assert rho["systematic"]["standard"] == pytest.approx(0.002 / 0.99 * rho["value"])
    assert rho["uncertainty_systematic"] == pytest.approx(math.sqrt(sum(s**2 for s in rho["systematic"].values())))


def _rho(record):
    """The values of rho wherever the record of a fit has them."""
    if isinstance(record, dict):
        if "rho" in record and isinstance(record["rho"], dict):
            return record["rho"]
        return next((found for value in record.values() if (found := _rho(value))), None)
    return next((found for value in record if (found := _rho(value))), None) if isinstance(record, list) else None

"""The budget of a scan by cause on its report, and what each cause does to the fitted values; both are printed."""

import json
import re
import shutil
import stat
import subprocess

import numpy as np
import pytest

import gonio
from gonio import Problem, catalogue, fit
from gonio.measured.causes import with_causes
from gonio.reduction.budget import budget, correlation
from gonio.reporting import pdf
from gonio.reporting.budget import budget_blocks, effect_blocks
from gonio.reporting.reduction import write_report
from gonio.results.reduction import HEADS, rows
from report.conftest import DATE, HELD, by_cause, of, painted


def record(path):
    return json.loads(path.read_text(encoding="utf-8").partition('id="report">')[2].partition("</script>")[0])


@pytest.fixture(scope="module")
def told(pages):
    return record(pages["causes"])["uncertainty"]


def test_the_table_is_that_of_a_reduction(told):
    expected = rows(budget(by_cause()))
    assert [[str(row[head]) for head in HEADS[:4]] for row in told["causes"]] == [[*row[:4]] for row in expected]
    assert [[row[head] for head in HEADS[4:]] for row in told["causes"]] == [[*map(float, row[4:])] for row in expected]
    assert [row["cause"] for row in told["causes"]] == [
        *("random", "standard", "dark (2)", "zero"),
        *("combined", "expanded, k=2"),
    ]


def test_every_cause_shifts_the_values_as_the_fit_says(told):
    _, solution = of("causes")
    parameters = solution.parameters()
    by_cause = {row["cause"]: row for row in told["effects"]}
    for name in ("rho_s", "rho_d", "width"):
        (head,) = (head for head in by_cause["value"] if head.split(" ")[0] == name)
        shifts = parameters[name]["systematic"]
        assert by_cause["standard"][head] == pytest.approx(shifts["standard"], rel=0.06)  # two digits are printed
        assert by_cause["zero"][head] == pytest.approx(shifts["zero"], rel=0.06)
        assert by_cause["dark (2)"][head] == pytest.approx(np.hypot(shifts["dark[1]"], shifts["dark[2]"]), rel=0.06)
        combined = np.sqrt(np.diag(solution.total_covariance))[solution.dataset["name"].values.tolist().index(name)]
        assert by_cause["combined"][head] == pytest.approx(combined, rel=0.06)
        assert by_cause["U, k = 2"][head] == pytest.approx(2 * combined, rel=0.06)
    assert by_cause["standard"]["width"] == 0 != by_cause["zero"]["width"]  # a factor moves no width
    assert parameters["rho_d"]["systematic"]["standard"] > 0  # a factor moves both weights to one side


def test_correlations_are_between_the_directions_that_are_named(told):
    scan = by_cause()
    listed = told["correlations"]
    assert len(listed) == 6
    names = [row["direction"] for row in listed]
    assert names[0] == "0, −70"
    assert names[-1] == "45, 70"
    between = correlation(scan)
    assert listed[0]["45, 70"] == pytest.approx(between[0, -1], abs=5e-4)
    for k, row in enumerate(listed):
        assert row[names[k]] == 1.0


def test_a_picture_for_each_incidence_angle_in_one_scale(pages):
    text = pages["causes"].read_text(encoding="utf-8")
    assert re.findall(r'aria-label="Budget at ([^"]+)"', text) == ["θᵢ = 0°", "θᵢ = 45°"]
    assert "No figure of the budget" not in text


def test_a_fit_alone_tells_its_shifts_and_where_the_budget_is(tmp_path, told):
    _, solution = of("causes")
    alone = record(gonio.report(solution, tmp_path / "alone.html", date=DATE))["uncertainty"]
    assert alone["effects"] == told["effects"]
    assert "causes" not in alone
    assert "in a report to which the scan is given (--scan)" in alone["no-causes"][0]
    assert "no-causes" not in told


@pytest.mark.parametrize("kind", ["coating", "hemisphere"])
def test_a_scan_that_names_no_cause_has_no_budget_by_cause(pages, kind):
    assert not {"causes", "effects", "correlations"} & record(pages[kind])["uncertainty"].keys()


def test_wavelengths_are_told_apart():
    """The table is of all values, figures and correlations are of the first wavelength, which is named."""
    scans = {f"{k}": painted(0.1 + 0.1 * k, wavelength=400.0 + 100 * k) for k in range(2)}
    joined = gonio.join({k: with_causes(s, {"standard": 0.02 * s["brdf"].values}) for k, s in scans.items()})
    found = {type(block).__name__: block for block in budget_blocks(joined.drop_vars("scan"))}
    assert [picture.caption for picture in found["Pictures"].pictures] == [
        "θᵢ = 0°, wavelength 400",
        "θᵢ = 45°, wavelength 400",
    ]
    lines = [*budget_blocks(joined.drop_vars("scan"))]
    assert all("wavelength 400" in b.caption for b in lines if getattr(b, "name", "") == "correlations")


def test_out_of_plane_there_is_no_figure_and_it_is_said():
    scan, _ = of("hemisphere")
    scan = with_causes(scan, {"standard": 0.02 * scan["brdf"].values})
    scan = scan.isel(direction=np.flatnonzero(~np.isin(scan["phi"].values, [0.0, 180.0])))
    blocks = {getattr(block, "name", type(block).__name__): block for block in budget_blocks(scan)}
    assert "no direction in the plane of incidence" in blocks["budget-figures"].lines[0]
    assert all("φ" in row[0].text for row in blocks["correlations"].rows)


def test_a_fit_of_many_values_counts_those_that_are_not_printed():
    scans = {f"{k}": painted(0.1, wavelength=400.0 + k) for k in range(25)}
    joined = gonio.join({k: with_causes(s, {"standard": 0.02 * s["brdf"].values}) for k, s in scans.items()})
    grouped = {"rho_s": "wavelength"}
    solution = fit(Problem(catalogue["ggx"], joined.drop_vars("scan"), held=HELD, grouped=grouped))
    blocks = [*effect_blocks(solution)]
    assert [len(block.heads) for block in blocks[:-1]] == [6, 6, 6, 6]
    assert blocks[-1].lines[-1].startswith("31 more values are not printed")


def test_a_value_at_its_bound_has_no_shift():
    scan = painted(rho_d=0.0)
    scan = scan.assign(brdf=scan["brdf"] * 0.5)
    scan = with_causes(scan, {"standard": 0.02 * scan["brdf"].values})
    solution = fit(Problem(catalogue["ggx"], scan, held=HELD | {"width": 0.3}))
    pinned = {str(n) for n in solution.dataset["name"].values[solution.dataset["at_bound"].values]}
    assert pinned == {"rho_d"}
    table = next(effect_blocks(solution))
    (at,) = (k for k, head in enumerate(table.heads) if head.startswith("rho_d"))
    assert [row[at].text for row in table.rows[1:]] == ["–"] * (len(table.rows) - 1)


@pytest.fixture
def no_browser(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    monkeypatch.setattr(pdf, "find_spec", lambda name: None)  # nor WeasyPrint
    pdf.browser.cache_clear()
    yield
    pdf.browser.cache_clear()


def test_without_a_browser_nothing_is_fitted_or_written(no_browser, tmp_path):
    with pytest.raises(
        ValueError, match=r"no chromium, chromium-browser or google-chrome on the PATH: pip install 'gonio"
    ):
        gonio.report(painted(), tmp_path / "page.pdf")  # before the fit, which would take seconds
    with pytest.raises(ValueError, match=r"write .html and print that"):
        write_report(by_cause(), tmp_path / "page.PDF")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("script", "words"), [("echo no sandbox >&2; exit 1", "no sandbox"), ("exit 0", "says nothing")]
)
def test_a_browser_that_prints_nothing_is_told(no_browser, monkeypatch, tmp_path, script, words):
    fake = tmp_path / "bin" / "google-chrome"
    fake.parent.mkdir()
    fake.write_text(f"#!/bin/sh\n{script}\n")
    fake.chmod(fake.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("PATH", str(fake.parent))
    with pytest.raises(ValueError, match=words) as told:
        write_report(by_cause(), tmp_path / "page.pdf")
    assert "\n" not in str(told.value)
    assert not (tmp_path / "page.pdf").exists()


@pytest.mark.skipif(not any(map(shutil.which, pdf.NAMES)), reason=f"none of {', '.join(pdf.NAMES)} is installed")
@pytest.mark.skipif(not shutil.which("pdftotext"), reason="pdftotext is not installed")
def test_a_page_is_printed_on_a4_with_all_of_its_text(tmp_path):
    scan, solution = of("causes")
    gonio.report(solution, tmp_path / "page.pdf", scan=scan, date=DATE)
    with pytest.raises(FileExistsError):
        write_report(scan, tmp_path / "page.pdf")
    write_report(scan, tmp_path / "budget.pdf")
    for name in ("page.pdf", "budget.pdf"):
        assert "A4" in _said("pdfinfo", tmp_path / name)
        words = _said("pdftotext", "-layout", tmp_path / name, "-")
        for expected in ("expanded, k=2", "odd about normal", "Correlation between the errors", "dark (2)"):
            assert expected in words
        assert "file://" not in words  # no header or footer of the browser
    assert "What each cause does to the fitted values" in _said("pdftotext", "-layout", tmp_path / "page.pdf", "-")


def _said(*command):
    return " ".join(subprocess.run(command, capture_output=True, check=True, text=True).stdout.split())

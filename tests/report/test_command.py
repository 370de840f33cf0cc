"""`gonio report` of files: scans, results, and what it refuses before it begins."""

import json
import shutil
import sys

import numpy as np
import pytest

from gonio import Problem, catalogue, fit, write
from gonio.app.cli import main
from gonio.reporting.pdf import NAMES
from report.conftest import painted


@pytest.fixture
def here(tmp_path, monkeypatch):
    """The current folder with a scan, the results of a fit to it and a description."""
    monkeypatch.chdir(tmp_path)
    scan = painted()
    write(scan, tmp_path / "scan.csv")
    (tmp_path / "results").mkdir()
    fit(Problem(catalogue["lambert"], scan)).save(tmp_path / "results" / "solution.nc")
    (tmp_path / "about.yml").write_text("sample: {name: panel 7}\n")
    return tmp_path


@pytest.fixture
def run(here, monkeypatch, capsys):
    def call(line):
        monkeypatch.setattr(sys, "argv", line.split())
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, capsys.readouterr().err

    return call


def record(path):
    return json.loads(path.read_text(encoding="utf-8").partition('id="report">')[2].partition("</script>")[0])


def test_a_scan_and_its_fit_give_the_same_values(run, here):
    assert run("gonio report scan.csv --model lambert --weighting uniform --validate none --out a.html")[0] == 0
    assert run("gonio report results --scan scan.csv --about about.yml --date 2026-01-31 --out b.html")[0] == 0
    one, two = record(here / "a.html"), record(here / "b.html")
    assert one["model"]["parameters"] == two["model"]["parameters"]
    assert one["identification"]["file"] == two["identification"]["file"]
    assert two["identification"]["file"].startswith("scan.csv, SHA-256 ")
    assert two["identification"]["date of the report"] == "2026-01-31"
    assert two["sample"] == {"name": "panel 7"}
    assert one["software"]["command"].startswith("gonio report scan.csv --model lambert")
    assert one["software"]["seed"] == 0


def test_a_fit_writes_its_report(run, here):
    assert run("gonio fit scan.csv --model lambert --out found")[0] == 0
    assert record(here / "found" / "report.html")["summary"]["model"] == "lambert"


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("results --out page.docx", "written as .html, .pdf, .md or .txt"),
        ("results --model ggx --out page.html", "results: holds a fit, and options of fitting belong to a scan"),
        ("results --group rho=theta_i --out page.html", "options of fitting belong to a scan"),
        ("results --floor 0.1 --out page.html", "holds a fit, and --select, masks and corrections belong to a scan"),
        ("scan.csv results --out page.html", "a report is of one fit, or of scans"),
        ("scan.csv --scan scan.csv --model lambert --out page.html", "--scan belongs to a report on a fit"),
        ("results --date 31.1.2026 --out page.html", "the date of a report is '31.1.2026'"),
        ("results --about scan.csv --out page.html", "scan.csv"),
        ("results --out scan.csv/page.html", "cannot be written"),
    ],
)
def test_what_is_refused_is_one_line(run, here, line, words):
    before = set(here.rglob("*"))
    code, err = run(f"gonio report {line}")
    assert code == 1
    assert words in err
    assert err.count("\n") == 1
    assert set(here.rglob("*")) == before


def test_another_scan_is_refused_for_a_fit_without_points(run, here):
    other = painted().isel(direction=np.arange(10))
    write(other, here / "other.csv")
    solution = type(fit(Problem(catalogue["lambert"], painted()))).load(here / "results" / "solution.nc")
    type(solution)(solution.dataset.drop_dims("direction"), solution.model).save(here / "bare.nc")
    code, err = run("gonio report bare.nc --scan other.csv --out page.html")
    assert code == 1
    assert "give the scan that was fitted" in err
    assert run("gonio report bare.nc --scan scan.csv --out page.html")[0] == 0


def test_another_scan_is_refused_for_a_fit_with_its_points(run, here):
    write(painted(0.2), here / "other.csv")
    code, err = run("gonio report results --scan other.csv --out page.html")
    assert code == 1
    assert "this scan has not the values that were fitted" in err


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("results", "a report is a file: give --out page.html, or --pdf page.pdf"),
        ("results --pdf page.html", "--pdf writes PDF: name a file that ends in .pdf"),
    ],
)
def test_what_is_printed_needs_a_name(run, here, line, words):
    code, err = run(f"gonio report {line}")
    assert code == 1
    assert words in err
    assert err.count("\n") == 1


@pytest.mark.skipif(not any(map(shutil.which, NAMES)), reason=f"none of {', '.join(NAMES)} is installed")
def test_a_fit_is_printed_beside_its_page(run, here):
    assert run("gonio report results --out page.html --pdf page.pdf")[0] == 0
    assert (here / "page.pdf").read_bytes().startswith(b"%PDF")
    assert record(here / "page.html")["summary"]["model"] == "lambert"
    code, err = run("gonio report results --pdf page.pdf")
    assert code == 1
    assert "page.pdf" in err
    assert "--force" in err

"""What the README claims in figures stands on the pages that it cites, which are made of measured results."""

import json
import re

import pytest

from gonio import catalogue
from gonio.findings.registry import NAMES
from gonio.formats import formats
from places import ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
CITED = re.findall(r"\[([^\]]*\d[^\]]*)\]\((docs/[\w/-]+\.md)\)", README)
FIGURE = re.compile(r"\d[\d,]*(?:\.\d+)?")


@pytest.mark.parametrize(("claim", "page"), CITED)
def test_a_figure_of_the_readme_is_on_the_page_that_it_cites(claim, page):
    there = FIGURE.findall((ROOT / page).read_text(encoding="utf-8"))
    assert set(FIGURE.findall(claim)) <= set(there), f"{page} does not say {claim!r}"


def test_the_readme_cites_pages_for_its_figures():
    assert {page for _, page in CITED} >= {"docs/formats.md", "docs/models/index.md", "docs/answers.md"}


def test_what_the_readme_counts():
    assert f"[{len(formats())} formats]" in README
    assert f"[{len(catalogue)} models]" in README
    assert "[ten kinds]" in README
    assert len(NAMES) == 10


def test_the_typical_error_is_that_of_the_record():
    record = json.loads((ROOT / "benchmarks" / "answers.json").read_text(encoding="utf-8"))
    left_out = [scan["left_out"] for scan in record["scans"].values()]
    mean = sum(left_out) / len(left_out)
    assert f"over {len(left_out)} measured scans" in " ".join(README.split())
    assert f"a mean lg RMSE of {mean:.4f}" in README
    assert f"a typical error of {100 * (10**mean - 1):.0f} %" in README


def test_the_first_screen_has_what_a_stranger_looks_for():
    first = README.splitlines()[:30]
    assert any(line.startswith("![") for line in first)
    assert "## Install" in first
    assert "gonio fit scan.csv" in first
    assert len(README.splitlines()) <= 100

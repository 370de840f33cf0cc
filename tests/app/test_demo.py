"""The demo: the paper's study on one page."""

import csv
import html.parser
import re
from unittest import mock

import pytest

from gonio.app.report import study
from gonio.app.report.demo import write_demo

pytestmark = pytest.mark.xdist_group("demo")  # one process, which makes it once


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    folder = tmp_path_factory.mktemp("demo")
    seen = []
    studied = mock.Mock(wraps=study.facts)
    with mock.patch.object(study, "facts", studied):
        page = write_demo(folder, seed=2023, force=False, progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == pytest.approx(1.0)
    return folder, page.read_text(encoding="utf-8"), studied.call_args.args[0]


def table(folder, name):
    with (folder / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_self_contained_and_complete(demo):
    _folder, page, _ = demo
    assert not re.search(r'(src|href)="(?!data:)', page)
    assert not re.search(r"\$\{?\w", page)
    assert page.count("<img") == 14
    assert page.count("<table") == 5
    for word in ("simulated", "seed 2023", "reciprocal", "arbitrary", "57.16", "30.61", "viewport"):
        assert word in page
    html.parser.HTMLParser().feed(page)


def test_table_1_is_recovered(demo):
    """All 24 printed ks lie within four standard uncertainties of the fitted ones (fails once in 600 seeds)."""
    folder, *_ = demo
    rows = table(folder, "table1")
    assert len(rows) == 8
    for printed, fitted in zip(rows[::2], rows[1::2], strict=True):
        for angle in ("20°", "30°", "40°", "50°", "60°", "70°"):
            value, spread = map(float, fitted[angle].split(" ± "))
            assert abs(value - float(printed[angle])) < 4 * spread


def test_printed_percentages_recompute(demo):
    folder, *_ = demo
    with (folder / "printed_drops.csv").open(newline="", encoding="utf-8") as file:
        cells = list(csv.reader(file))[1:]
    assert len(cells) == 14
    assert all(cell[2] == cell[3] and cell[4] == cell[5] for cell in cells)


def test_exact_weights_are_never_worse(demo):
    folder, *_ = demo
    for row in table(folder, "solvers"):
        assert float(row["excess of E"]) >= 0
        assert float(row["time ratio"].replace(",", "")) > 100


def test_the_model_that_made_the_scans_beats_torrance_sparrow(demo):
    folder, *_ = demo
    for row in table(folder, "simulated_errors"):
        assert float(row["vs T-S [%]"]) > 50


def test_nothing_is_overwritten(demo):
    folder, *_ = demo
    with pytest.raises(FileExistsError, match="--force"):
        write_demo(folder, seed=1, force=False, progress=lambda fraction: None)


def test_facts_as_in_the_specification(demo):
    """The numbers of formulas 9 that the page prints, from the constants alone: no seed, no fit moves them."""
    *_, studied = demo
    facts = study.facts(studied)
    assert (facts["sum_least"], facts["sum_most"]) == ("416", "2300")
    assert (facts["exchange_least"], facts["exchange_most"]) == ("0.53", "0.85")
    assert (facts["azimuth_0"], facts["azimuth_90"], facts["azimuth_180"]) == ("321", "321", "1659")
    assert (facts["pooled_t_s"], facts["pooled_t_c"]) == ("51.7", "23.7")
    assert float(facts["peak_30"]) == pytest.approx(22.5, abs=0.15)
    assert float(facts["peak_50"]) == pytest.approx(76.75, abs=0.15)

"""The frame of the benchmarks: what is kept, what is null and why, and the page made of it."""

import importlib.util
import json
from types import SimpleNamespace

import pytest

import figures
import quick
from figures import Figure, keep, paired
from places import ROOT


@pytest.fixture
def record(tmp_path, monkeypatch):
    path = tmp_path / "results.json"
    path.write_text(json.dumps({"figures": {"old": 2.0}, "reasons": {"new": "no time"}, "fits": [1]}))
    monkeypatch.setattr(figures, "RECORD", path)
    return path


def test_a_figure_has_a_value_or_a_reason():
    with pytest.raises(ValueError, match="a value, or a reason"):
        Figure("speed")
    with pytest.raises(ValueError, match="a value, or a reason"):
        Figure("speed", 1.0, reason="none")


def test_other_figures_stay(record):
    keep(Figure("new", 3.0, details={"rounds": 5}), Figure("none", reason="no GPU"))
    found = json.loads(record.read_text())
    assert found["figures"] == {"old": 2.0, "new": 3.0, "none": None}
    assert found["reasons"] == {"none": "no GPU"}
    assert found["fits"] == [1]
    assert found["details"]["new"]["rounds"] == 5
    assert found["details"]["new"]["measured"]["date"] == found["date"]
    assert found["machine"]


def test_ratios_are_of_runs_in_turn():
    """Theirs over ours, at least five rounds after one that is not counted, each first in turn."""
    order = []
    timed = paired(lambda: order.append("ours"), lambda: order.append("theirs"), rounds=1)
    assert order[:2] == ["ours", "theirs"]
    assert len(timed.ours) == len(timed.theirs) == 5
    assert order[2:6] == ["theirs", "ours", "ours", "theirs"]
    slow = figures.Timed((1.0, 2.0, 4.0), (2.0, 6.0, 8.0), (1.0, 1.0, 1.0), (5.0, 5.0, 9.0))
    assert (slow.ratio, slow.processor_ratio) == (2.0, 5.0)


def test_what_cannot_be_measured_is_null_with_the_reason(monkeypatch):
    given = {"evaluation_speed": SimpleNamespace(measure=lambda: Figure("evaluation_over_copy", 0.6))}

    def broken():
        raise ValueError("exact weights end higher")

    given["annealing_speed"] = SimpleNamespace(measure=broken)

    def load(name):
        if name not in given:
            raise ModuleNotFoundError(f"No module named {name!r}", name="lmfit" if name == "lmfit_peer" else name)
        return given[name]

    monkeypatch.setattr(quick.importlib, "import_module", load)
    found = {figure.name: figure for name in quick.MODULES for figure in quick.measured(name)}
    assert set(found) == {name for names in quick.MODULES.values() for name in names}
    assert found["evaluation_over_copy"].value == 0.6
    assert "did not measure it" in found["evaluation_over_mitsuba"].reason
    assert found["fits_over_scipy"].reason == "not measured: benchmarks/fits_speed.py is not there"
    assert found["lmfit_over_fit"].reason == "not measured: lmfit is not installed"
    assert found["anneal_over_exact"].reason == "not measured: ValueError: exact weights end higher"


def test_the_page_is_made_of_the_record():
    """docs/performance.md is what its script makes of results.json, and says what no GPU was there to measure."""
    specification = importlib.util.spec_from_file_location("performance", ROOT / "docs" / "pages" / "performance.py")
    script = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(script)
    page = (ROOT / "docs" / "performance.md").read_text(encoding="utf-8")
    assert page == script.page(json.loads((ROOT / "benchmarks" / "results.json").read_text(encoding="utf-8")))
    assert page.count("not measured: no GPU was at hand") == 2

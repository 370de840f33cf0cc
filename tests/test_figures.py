"""The frame of the benchmarks: what is kept, what is null and why, and the pages made of the records."""

import json
import sys
from types import SimpleNamespace

import pytest

import figures
import quick
from figures import Figure, keep, paired
from outcomes import EVERY_DOOR
from places import ROOT, loaded

PAGES = ROOT / "docs" / "pages"
OF_RECORDS = [path.stem for path in sorted(PAGES.glob("[a-z]*.py")) if "import BENCHMARKS, DOCS" in path.read_text()]


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


def test_the_coverage_that_the_readme_states_is_what_was_measured():
    cases = json.loads((ROOT / "benchmarks" / "intervals.json").read_text(encoding="utf-8"))["cases"].values()
    robust = [100 * rates["robust"] for case in cases for rates in case["rates"].values()]
    stated = f"{sum(robust) / len(robust):.1f} % on average"
    assert f"hold the truth in [{stated}](docs/intervals.md)" in " ".join(
        (ROOT / "README.md").read_text("utf-8").split()
    )


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


@pytest.fixture
def script(monkeypatch):
    """The script of a page by its name."""
    monkeypatch.syspath_prepend(PAGES)
    return lambda name: loaded(PAGES / f"{name}.py")


def test_scripts_of_records_are_found():
    assert {"annealing", "fuzzing", "intervals", "mutation", "performance"} <= set(OF_RECORDS)


@pytest.mark.parametrize("name", OF_RECORDS)
def test_a_page_is_made_of_its_record(script, name):
    """The committed page is what its script makes of the committed JSON file."""
    made = script(name)
    if not made.RECORD.exists():
        pytest.skip(f"no {made.RECORD.name} yet: {made.PAGE.name} is older than such files")
    assert made.PAGE.read_text(encoding="utf-8") == made.page(json.loads(made.RECORD.read_text(encoding="utf-8")))


def test_without_a_record_the_page_stays(script, tmp_path, capsys):
    script("mutation")
    pages = sys.modules["_pages"]
    target, record = tmp_path / "page.md", tmp_path / "record.json"
    target.write_text("old")
    pages.write(str, record, target, "make it")
    assert target.read_text() == "old"
    assert capsys.readouterr().err == f"page.md stays as it is: there is no {record}; make it makes it\n"
    record.write_text('{"a": 1}')
    pages.write(str, record, target, "make it")
    assert target.read_text() == "{'a': 1}"


def test_what_goes_through_every_door_has_a_table_of_its_own(script):
    made = script("fuzzing")
    row = {"inputs": 4, "reached": 3, "read": 1, "refused": 3, "failures": 0, "slowest_ms": 5, "peak_MB": 6}
    row |= {"date": "2026-01-02", "machine": "one"}
    formats, doors = made.page(dict.fromkeys(("merl", *EVERY_DOOR), row)).split("## Files through every door")
    line = "| {} | 4 | 75 | 1 | 3 | 0 | 5 | 6 | 2026-01-02 | one |"
    assert line.format("merl") in formats
    assert "merl" not in doors
    rows = [text for text in doors.splitlines() if text.endswith("| one |")]
    assert rows == [line.format(name) for name in EVERY_DOOR]
    assert "Not measured yet." in made.page({"merl": row})


def test_the_page_of_mutations(script):
    """Counts by kind and by model, and every change that no test saw, under its outcome."""
    counts = {"changes": 3, "killed": 1, "equivalent": 1, "slight": 0, "survived": 1}
    change = {"place": "models/a.py:7", "kind": "sign", "was": "a + b", "now": "a - b"}
    record = {
        **{"machine": "one", "date": "2026-01-02", "minutes": 2.0, "sample": 0, "only": "", "seed": 1, "tests": 9},
        **{"directions": 8, "same": 1e-9, "slight": 1e-6, "counted": ["test_a.py"], "not_counted": ["test_b"]},
        **{"all": counts, "kinds": {"sign": counts}, "models": {"lambert": counts}},
        "unseen": [change | {"outcome": "survived", "note": "much"}, change | {"outcome": "equivalent"}],
    }
    page = script("mutation").page(record)
    assert "| lambert | 3 | 1 | 1 | 0 | 1 |" in page
    assert "**1 of 3 changes survived.**" in page
    line = "- `models/a.py:7` sign: `a + b` → `a - b`"
    assert page.endswith(f"## Survived\n\n{line}; much\n\n## Slight\n\nNone.\n\n## Equivalent\n\n{line}\n")

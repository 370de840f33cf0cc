"""A report says what was found, hides nothing, and is harmless whatever a file is called."""

import json
import math
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import html5lib
import pytest

import gonio
from gonio.measured.masking import mask
from gonio.models import catalogue
from gonio.reporting.case import Case, Known
from gonio.reporting.checks import reflectance
from gonio.reporting.citation import reference
from gonio.reporting.page import page
from gonio.resampling.hemisphere import Reflectance
from gonio.results.content import content
from report.conftest import DATE, HOSTILE, KINDS, of, painted

pytestmark = pytest.mark.xdist_group("report")  # one process, which makes the pages once
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
SECTIONS = (
    *("identification", "sample", "instrument", "method", "environment", "conventions", "results", "uncertainty"),
    *("model", "plausibility", "software", "warnings", "citation", "not-stated"),
)


class Page(HTMLParser):
    """Elements with their attributes, the text that a reader sees, and the data in scripts."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.text, self.data, self.within = [], "", "", ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self.text += "\n"
        self.within = tag if tag in ("script", "style") else self.within

    def handle_endtag(self, tag):
        self.within = "" if tag == self.within else self.within
        self.text += "\n"

    def handle_data(self, data):
        if self.within == "script":
            self.data += data
        elif not self.within:
            self.text += data


def numbers(data):
    if isinstance(data, dict | list):
        for one in data.values() if isinstance(data, dict) else data:
            yield from numbers(one)
    elif isinstance(data, int | float) and not isinstance(data, bool):
        yield float(data)


@pytest.mark.parametrize("kind", KINDS)
def test_the_page_is_strict_html_with_every_section(pages, kind):
    text = pages[kind].read_text(encoding="utf-8")
    html5lib.HTMLParser(strict=True).parse(text)
    page = Page(text)
    assert [a["id"] for tag, a in page.elements if tag == "section" and a["id"] != "remarks"] == list(SECTIONS)
    ids = [a["id"] for _, a in page.elements if "id" in a]
    assert len(ids) == len(set(ids))
    used = {one or other for one, other in re.findall(r'href="#([\w-]+)"|url\(#([\w-]+)\)', text)}
    assert used <= set(ids)
    assert DATE in page.text


@pytest.mark.parametrize("kind", KINDS)
def test_every_number_of_the_data_stands_in_the_text(pages, kind):
    page = Page(pages[kind].read_text(encoding="utf-8"))
    record = json.loads(page.data)
    read = {float(found) for found in NUMBER.findall(page.text)}
    listed = list(numbers(record))
    assert len(listed) > 5
    assert set(listed) <= read


@pytest.mark.parametrize("kind", KINDS)
def test_a_page_holds_no_script_and_asks_for_nothing(pages, kind):
    page = Page(pages[kind].read_text(encoding="utf-8"))
    assert [a.get("type") for tag, a in page.elements if tag == "script"] == ["application/json"]
    for tag, attributes in page.elements:
        assert tag not in ("iframe", "object", "embed", "link", "base", "form", "b")
        assert not [name for name in attributes if name.startswith("on")]
        for name in ("href", "src", "xlink:href", "action"):
            assert attributes.get(name, "#").startswith(("#", "data:image/png;base64,"))


def test_hostile_names_are_shown_and_do_nothing(pages):
    text = pages["hostile"].read_text(encoding="utf-8")
    page = Page(text)
    assert not [c for c in text if not c.isprintable() and c != "\n"]
    shown = HOSTILE.replace("\x1b", "\\x1b").replace("\u202e", "\\u202e")
    assert page.text.count(shown) >= 3  # of the scan, the header and the sample
    assert json.loads(page.data)["sample"]["name"] == shown


def test_what_is_not_stated_is_listed_and_what_is_stated_is_not(pages):
    bare = json.loads(Page(pages["coating"].read_text(encoding="utf-8")).data)["not-stated"]
    told = json.loads(Page(pages["hostile"].read_text(encoding="utf-8")).data)
    assert "solid angle of the detector" in bare["Instrument"]
    assert "cleanliness class" in bare["Environment"]
    assert "solid angle of the detector" not in told["not-stated"]["Instrument"]
    assert told["instrument"]["solid angle of the detector"] == "0.00012 sr"
    assert told["sample"]["size"] == "length 50 mm (uncertainty 0.1 mm)"
    assert "cleanliness class" not in told["not-stated"]["Environment"]


def test_the_numbers_are_those_of_the_fit(pages):
    scan, solution = of("hemisphere")
    record = json.loads(Page(pages["hemisphere"].read_text(encoding="utf-8")).data)
    width = next(row for row in record["model"]["parameters"] if row["parameter"] == "width")
    assert width["value"] == pytest.approx(solution.values["width"], rel=1e-3)
    first = record["results"]["geometries"]
    assert all(
        row["U, k = 2"] == pytest.approx(2 * (0.02**2 + 0.01**2) ** 0.5 * row["f [sr⁻¹]"], rel=0.05) for row in first
    )
    budget = {row["component"]: row for row in record["uncertainty"]["budget"]}
    assert budget["random errors of a reading"]["typical, of f"] == pytest.approx(2.0)
    assert budget["calibration and other errors that readings share"]["typical, of f"] == pytest.approx(1.0)
    covered = record["results"]["measured-reflectance"]
    assert all(0 < row["hemisphere covered [%]"] < 100 for row in covered)
    assert scan["brdf"].size == record["method"]["values in use"]


def test_named_geometries_are_those_that_were_measured(pages):
    record = json.loads(Page(pages["coating"].read_text(encoding="utf-8")).data)
    rows = record["results"]["geometries"]
    # theta_r goes in steps of 10 from -70: 45 is no direction of it, and 40 is not near
    assert [(row["geometry"], row["θᵢ [deg]"], row["θᵣ [deg]"]) for row in rows] == [
        ("45:0", 45.0, 0.0),
        ("specular", 0.0, 0.0),
    ]


def test_reflectance_at_8_deg_is_marked_as_d_8():
    found = [Reflectance({}, theta_i, math.nan, 0.3, 0.9) for theta_i in (0.0, 8.0, 10.5, 10.6)]
    (table,) = reflectance(SimpleNamespace(table=found))
    assert [row[0].text.endswith("deg (as d/8)") for row in table.rows] == [False, True, True, False]
    assert "by reciprocity" in table.caption
    (table,) = reflectance(SimpleNamespace(table=found[:1]))
    assert "d/8" not in table.caption


def test_the_ranking_and_the_verdict_are_told(pages):
    record = json.loads(Page(pages["coating"].read_text(encoding="utf-8")).data)
    _, solution = of("coating")
    assert record["verdict"] == solution.answer["verdict"]["words"]
    assert [row["model"] for row in record["model"]["tried"]] == [one["model"] for one in solution.answer["tried"]]


def test_the_same_page_each_time(tmp_path, pages):
    scan, solution = of("grouped")
    again = gonio.report(solution, tmp_path / "a.html", scan=scan, date=DATE)
    assert again.read_bytes() == pages["grouped"].read_bytes()


def test_a_scan_is_fitted_first(tmp_path, monkeypatch):
    monkeypatch.setattr("gonio.comparison.answer.everything", lambda: [catalogue["lambert"], catalogue["ggx"]])
    page = gonio.report(painted(), tmp_path / "page.html").read_text(encoding="utf-8")
    assert "ggx describes this scan" in page


def test_a_fit_without_its_points_asks_for_the_scan(tmp_path):
    scan, solution = of("grouped")
    lost = type(solution)(solution.dataset.drop_dims("direction"), solution.model)
    with pytest.raises(ValueError, match=r"does not hold the points"):
        gonio.report(lost, tmp_path / "page.html")
    gonio.report(lost, tmp_path / "page.html", scan=scan)


def test_refusals(tmp_path):
    _, solution = of("two values")
    with pytest.raises(ValueError, match=r"written as .html, .pdf, .md or .txt"):
        gonio.report(solution, tmp_path / "page.docx")
    with pytest.raises(ValueError, match=r"date of a report is 'yesterday': give it as in 2026-01-31"):
        gonio.report(solution, tmp_path / "page.html", date="yesterday")
    with pytest.raises(ValueError, match=r"about: sample has no key 'nmae'; nearest: name"):
        gonio.report(solution, tmp_path / "page.html", about={"sample": {"nmae": "x"}})
    assert list(tmp_path.iterdir()) == []
    solution.report(tmp_path / "page.html")
    with pytest.raises(FileExistsError):
        gonio.report(solution, tmp_path / "page.html")


@pytest.mark.parametrize("name", sorted(catalogue))
def test_every_model_of_the_catalogue_is_cited_in_words(name):
    cite = catalogue[name].cite
    found = reference(cite)
    assert found.endswith(f"[{cite}]")
    assert re.search(r"\(\d{4}\)", found)
    assert "{" not in found


def test_a_notebook_shows_what_print_says():
    _, solution = of("hostile")
    fragment = solution._repr_html_()
    assert "<script>" not in fragment
    assert all(note.split()[0] in fragment for note in content(solution).notes)


def test_the_templates_are_in_the_package():
    from importlib.resources import files

    names = {entry.name for entry in (files("gonio.reporting") / "templates").iterdir()}
    assert {
        "page.html",
        "reduction.html",
        "head.html",
        "blocks.html",
        "fragment.html",
        "style.css",
        "conventions.svg",
    } <= names


def test_what_is_simulated_is_called_simulated(tmp_path):
    """A scan that was written as a table and read again as well: its history says so."""
    gonio.write(gonio.sample("coating"), tmp_path / "scan.csv")
    scan = gonio.read(tmp_path / "scan.csv")
    assert scan.attrs["simulated"] == "simulated from ggx"
    held = {"index": 1.5, "extinction": 0.0}
    text = gonio.report(gonio.fit(scan, "ggx", held=held), tmp_path / "page.html", scan=scan).read_text("utf-8")
    assert "Report on simulated values" in text
    assert "no: the values are simulated from ggx" in text
    assert "of a measurement of scattered light" not in text


def test_why_values_are_masked_is_said():
    scan = gonio.sample("coating")
    scan = mask(scan, blocked=5.0, floor=float(scan["brdf"].min()) * 1.05)
    held = {"index": 1.5, "extinction": 0.0}
    solution = gonio.fit(gonio.Problem(catalogue["ggx"], scan, held=held))
    text = page(Case(solution, scan, Known()))
    flags = {name: int((scan["mask"] == k).sum()) for k, name in ((1, "blocked"), (2, "below floor"))}
    assert min(flags.values()) > 0
    assert f"{flags['blocked']} blocked, {flags['below floor']} below floor" in text

"""The pages of the models: current, complete, and with links that lead somewhere."""

import re
import sys

import pytest

from gonio import catalogue
from places import ROOT, loaded

PAGES = ROOT / "docs" / "models"
EVERY_PAGE = sorted(PAGES.glob("*.md"))
every_model = pytest.mark.parametrize("model", catalogue.values(), ids=lambda model: model.name)


@pytest.fixture(scope="module")
def maker():
    sys.path.insert(0, str(ROOT / "docs" / "pages"))
    yield loaded(ROOT / "docs" / "pages" / "models.py")
    sys.path.remove(str(ROOT / "docs" / "pages"))


def test_every_model_has_a_page_and_every_page_a_model():
    assert {path.stem for path in EVERY_PAGE} == {*catalogue, "index"}


def without_python(page: str) -> str:
    """`make docs` formats the code of pages."""
    return re.sub(r"```python.*?```", "", page, flags=re.DOTALL)


@every_model
def test_the_page_is_current(maker, model, monkeypatch):
    """All of it but the code, and the physics, whose numbers a machine may round otherwise."""
    written = (PAGES / f"{model.name}.md").read_text(encoding="utf-8")
    rows = re.findall(
        r"^\| (\w+) \| ([^|]+) \| ([^|]+) \| ([^|]+) \|$", written.partition("## Physics")[2], re.MULTILINE
    )
    terms = [row for row in rows if row[0] in model.weights]
    assert [row[0] for row in terms] == list(model.weights)
    monkeypatch.setattr(maker.present, "physics_rows", lambda _: terms)
    assert without_python(maker.page(model)) == without_python(written)


def test_the_index_is_current_and_begins_with_the_advice(maker):
    written = (PAGES / "index.md").read_text(encoding="utf-8")
    assert maker.index() == written
    assert written.startswith("# Models\n\n## Which model for my kind of surface\n\n")
    advice = written.split("\n\n")[2]
    for kind in (
        "metal**",
        "Sandblasted metal**",
        "Paint**",
        "Black coating**",
        "Rough diffuse**",
        "Mirror-like scatter**",
    ):
        assert kind in advice


@pytest.mark.parametrize("path", EVERY_PAGE, ids=lambda path: path.stem)
def test_one_heading_at_the_top_and_no_dead_link(path):
    text = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert len(re.findall(r"^# ", text, re.MULTILINE)) == 1
    for target in re.findall(r"\]\(([^)]+)\)", text):
        assert target.startswith("https://doi.org/") or (path.parent / target).exists(), target


@every_model
def test_the_page_tells_title_and_doi_of_the_source(model):
    text = (PAGES / f"{model.name}.md").read_text(encoding="utf-8")
    assert f"*{model.source.title}*" in text
    assert not model.source.doi or f"(https://doi.org/{model.source.doi})" in text
    assert "formulas" not in text
    assert model.cite not in text or model.cite in ("harvey1976",)

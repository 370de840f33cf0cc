"""The publications that gonio cites: one declaration, and what is made and told of it."""

import re
import subprocess
import sys

import pytest

from gonio import Geometry, Model, catalogue
from gonio.literature.equations import symbol
from gonio.literature.references import entries, reference
from gonio.model import PerSteradian
from gonio.models.lambert import lambert
from places import ROOT, loaded

DOI = re.compile(r"10\.\d{4,5}/\S+")


@pytest.fixture(scope="module")
def pages():
    """The makers of pages, which know each other by their names."""
    sys.path.insert(0, str(ROOT / "docs" / "pages"))
    yield lambda name: loaded(ROOT / "docs" / "pages" / f"{name}.py")
    sys.path.remove(str(ROOT / "docs" / "pages"))


def test_references_bib_is_what_the_declaration_gives(pages):
    made = pages("references").bibtex()
    assert (ROOT / "references.bib").read_text(encoding="utf-8") == made
    assert set(re.findall(r"^@\w+\{(\w+),", made, re.MULTILINE)) == set(entries())
    assert made.count("{") == made.count("}")


def test_the_bibliography_of_latex_has_no_command_of_its_own(pages):
    text = pages("references").escaped("50 % of A_B & C, pages 1–9")
    assert text == r"50 \% of A\_B \& C, pages 1--9"


@pytest.mark.parametrize("key", entries())
def test_every_entry_is_complete(key):
    one = reference(key)
    assert one.title
    assert one.authors
    assert one.year or key in ("fredtabulated", "mscfb", "msxls")  # pages that bear no date
    assert not one.doi or DOI.fullmatch(one.doi)
    assert one.title in str(one)
    assert one.link in str(one)
    assert not re.search(r"[{}\\]|--", str(one)), "LaTeX has no place in the declaration"
    # what a publisher builds the address of
    entry = entries()[key]
    if one.doi.startswith("10.1364/") and entry["type"] == "article-journal":
        first = re.match(r"\d+", entry["page"])[0]
        assert one.doi.endswith(f".{entry['volume']}.{int(first):06d}")


def test_a_citation_in_words():
    one = reference("walter2007")
    assert one.byline == "B. Walter, S. R. Marschner, H. Li and K. E. Torrance (2007)"
    assert one.short == "Walter et al. 2007"
    assert str(one) == (
        "B. Walter, S. R. Marschner, H. Li and K. E. Torrance (2007): Microfacet Models for Refraction through Rough "
        "Surfaces. Eurographics Symposium on Rendering, 195–206. https://doi.org/10.2312/EGWR/EGSR07/195-206"
    )
    assert reference("nobody1900") is None
    assert reference("cook1982").short == "Cook and Torrance 1982"
    assert reference("chandrasekhar1960").link == ""
    assert "PhD thesis, University of Arizona" in str(reference("harvey1976"))


def test_a_model_of_ones_own_may_cite_any_text():
    own = Model("own", "Of a notebook", "A. <Author>, unpublished", lambert.terms)
    assert own.source is None
    assert "A. &lt;Author&gt;, unpublished" in own._repr_html_()

    def plain(g: Geometry) -> PerSteradian:
        return g.cos_i

    bare = Model("bare", terms={"k": plain})
    assert bare.equations == {"k": ()}
    assert bare.sum_of_terms == ""
    assert bare._repr_html_().startswith("<p><b>bare</b>: bare</p><table>")


def test_html_has_title_source_with_its_link_and_equations():
    html = catalogue["ggx"]._repr_html_()
    assert "Microfacet Models for Refraction through Rough Surfaces" in html
    assert '<a href="https://doi.org/10.2312/EGWR/EGSR07/195-206">10.2312/EGWR/EGSR07/195-206</a>' in html
    assert r"$$f = \rho_s\,f_s + \rho_d\,f_d$$" in html
    assert "&amp;=" in catalogue["phong"]._repr_html_()
    assert "<tr><td>width</td><td>width of the distribution of facet slopes</td><td>0.01</td><td>1</td>" in html
    assert "<p>It violates energy: the weight is the level" in catalogue["abg"]._repr_html_()


@pytest.mark.parametrize(
    ("name", "letter"),
    [
        ("sigma_m", r"\sigma_m"),
        ("rho", r"\rho"),
        ("rho_dd", r"\rho_{dd}"),
        ("kid", "k_{id}"),
        ("b01", "b_{01}"),
        ("r0", "r_0"),
        ("fiso", "f_{iso}"),
        ("B", "B"),
        ("tilt", r"\mathrm{tilt}"),
        ("index", "n"),
    ],
)
def test_letters_of_parameters(name, letter):
    assert symbol(name) == letter


@pytest.mark.parametrize("how", ["import gonio", "from gonio.app.cli import main; main()"])
def test_references_are_read_when_one_is_asked_for(how):
    """Neither `import gonio` nor `gonio --help` reads them."""
    code = (
        f"import sys\nsys.argv = ['gonio', '--help']\ntry:\n    {how}\nfinally:\n    assert 'yaml' not in sys.modules"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0

"""What a notebook shows of gonio's things: well-formed, small, without scripts, and harmless whatever a file says."""

import xml.etree.ElementTree as ET

import html5lib
import numpy as np
import pytest

import gonio
from gonio import Model, Problem, catalogue, fit
from gonio.formats import formats
from gonio.results.sparkline import sparkline
from results.conftest import HOSTILE, spectrum, surface

OWN = Model("own", "A <script>alert(1)</script> & more", "A. <Author>", catalogue["lambert"].terms)


def things():
    grouped = Problem(catalogue["ggx"], spectrum(30), grouped={"rho_s": "wavelength"}, held={"index": 1.5})
    return {
        "catalogue": catalogue,
        "formats": formats(),
        "model": catalogue["ggx"],
        "own": OWN,
        "problem": grouped,
        "hostile": Problem(OWN, gonio.join({HOSTILE: surface(), "b": surface()})),
    }


@pytest.mark.parametrize("name", ["catalogue", "formats", "model", "own", "problem", "hostile"])
def test_html_is_well_formed_small_and_has_no_script(name):
    html = things()[name]._repr_html_()
    assert len(html.encode()) < 20_000
    html5lib.HTMLParser(strict=True).parseFragment(html)
    elements = [one.tag for one in ET.fromstring(f"<div>{html}</div>").iter()]
    assert not {"script", "style", "link"} & set(elements)
    assert "\x1b" not in html
    assert len(repr(things()[name])) < 3000


def test_the_catalogue_is_a_table_of_names_and_titles():
    html = catalogue._repr_html_()
    assert f"<div>{len(catalogue)} models</div>" in html
    for name, model in catalogue.items():
        assert f"<tr><td>{name}</td><td>{model.title}</td></tr>".replace("'", "&#x27;") in html


def test_a_problem_says_what_is_free_held_and_grouped():
    html = things()["problem"]._repr_html_()
    assert "ggx (Microfacets" in html or "ggx (" in html
    assert "<td>rho_s</td><td>free</td><td>wavelength+scan (30)</td>" in html
    assert "<td>index</td><td>held at 1.5</td>" in html
    assert "uniform weighting, 62 free values" in html
    assert "\n" not in repr(things()["problem"])


def test_a_solution_has_a_picture_and_its_status_in_colour():
    scan = surface()
    solution = fit(Problem(catalogue["ggx"], scan, held={"index": 1.5, "extinction": 0.0}))
    html = solution._repr_html_()
    assert html.count("<svg ") == 1
    assert f'padding-left:6px">{solution.status}</div>' in html
    assert "var(--jp-success-color1" in html
    many = solution.dataset.drop_vars([n for n in solution.dataset if str(n).startswith("scan_")])
    assert type(solution)(many, solution.model)._repr_html_().count("<svg") == 0


def test_a_picture_has_every_curve_within_its_frame():
    scan = surface()
    solution = fit(Problem(catalogue["lambert"], scan))
    root = ET.fromstring(sparkline(scan, solution.brdf, size=(320, 110)))
    of = "{http://www.w3.org/2000/svg}"
    lines = [line.get("points").split() for line in root.iter(f"{of}polyline")]
    assert [len(line) for line in lines] == [15, 15]  # two incidence angles
    places = np.array([[float(v) for v in point.split(",")] for line in lines for point in line])
    assert places.min() >= 0
    assert (places <= [320, 110]).all()
    dots = [path.get("d") for path in root.iter(f"{of}path")][1:]
    assert [one.count("h0") for one in dots] == [15, 15]


def test_a_picture_of_what_cannot_be_drawn_is_none():
    off = gonio.scan([30.0, 30.0], [20.0, 40.0], phi=[90.0, 100.0], brdf=[0.1, 0.2])
    assert sparkline(off) == ""
    flat = gonio.scan([30.0], [0.0], phi=[0.0], brdf=[0.1])
    assert "<svg" in sparkline(flat, labelled=True)
    below = gonio.scan([30.0] * 3, [0.0, 10.0, 20.0], phi=[0.0] * 3, brdf=[-1e-4, 0.0, 1.0])
    assert "nan" not in sparkline(below, labelled=True)

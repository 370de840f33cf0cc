"""`gonio.view` in a notebook with anywidget and without, and where there is no notebook."""

import html
import json
import subprocess
import sys
import types
import warnings
import xml.etree.ElementTree as ET

import numpy as np
import pytest
import xarray as xr

from gonio import Problem, catalogue, fit, simulate
from gonio.viewing import notebook
from gonio.viewing.notebook import Page, view

LAMBERT = catalogue["lambert"]


@pytest.fixture(scope="module")
def scan():
    return simulate(LAMBERT, {"rho": 0.4}, [10.0, 40.0], np.arange(-60, 61, 20.0), noise=0.01, seed=1)


@pytest.fixture(scope="module")
def solution(scan):
    return fit(Problem(LAMBERT, scan, grouped={"rho": "theta_i"}))


@pytest.fixture
def in_notebook(monkeypatch):
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))


@pytest.fixture
def no_anywidget(monkeypatch):
    monkeypatch.setattr(notebook, "find_spec", lambda name: None)


@pytest.fixture
def browser_opened(monkeypatch):
    opened = []
    monkeypatch.setattr(notebook.webbrowser, "open", lambda address: opened.append(address) or True)
    return opened


def test_a_script_opens_the_browser_on_a_file_that_stays(scan, solution, browser_opened):
    page = view(scan, solution)
    (address,) = browser_opened
    path = notebook.Path(address.removeprefix("file://"))
    same = path.read_text(encoding="utf-8") == page.html
    assert same
    assert path.stat().st_mode & 0o077 == 0 or path.parent.stat().st_mode & 0o077 == 0


def test_ipython_in_a_terminal_opens_the_browser_too(scan, browser_opened, monkeypatch):
    shell = types.SimpleNamespace()
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    assert isinstance(view(scan, model="lambert"), Page)
    assert len(browser_opened) == 1


def test_without_a_browser_it_says_where_the_page_is(scan, monkeypatch):
    monkeypatch.setattr(notebook.webbrowser, "open", lambda address: False)
    with pytest.warns(UserWarning, match=r"no browser could be opened: the page is .*page\.html"):
        view(scan, model="lambert")


def test_a_notebook_without_anywidget_shows_the_page_in_a_sandbox_and_what_is_missing(
    scan, solution, in_notebook, no_anywidget, browser_opened
):
    page = view(scan, solution)
    shown = page._repr_html_()
    assert browser_opened == []
    assert "pip install &#x27;gonio[notebook]&#x27;" in shown
    assert 'sandbox="allow-scripts allow-downloads"' in shown
    same = html.unescape(shown.partition('srcdoc="')[2].partition('"')[0]) == page.html
    assert same  # compared before pytest would write out how they differ


def test_it_is_written_and_nothing_is_shown(scan, solution, browser_opened, tmp_path):
    page = view(solution, out=tmp_path / "page.html")
    same = (tmp_path / "page.html").read_text(encoding="utf-8") == page.html
    assert same
    assert browser_opened == []
    with pytest.raises(FileExistsError):
        view(solution, out=tmp_path / "page.html")
    assert page.write(tmp_path / "page.html", force=True).is_file()
    with pytest.raises(ValueError, match=r"page\.txt: the page is HTML: give a name that ends in \.html"):
        view(solution, out=tmp_path / "page.txt")


@pytest.mark.parametrize(
    ("call", "error", "words"),
    [
        (lambda s, f: view(xr.Dataset({"a": 1})), ValueError, "the Dataset has no brdf, theta_i, theta_r, phi"),
        (lambda s, f: view(f, f), ValueError, "two fits are given: give the scan, and the fit as the second"),
        (lambda s, f: view(s, model="GGX"), KeyError, "did you mean ggx"),
        (lambda s, f: view(s, model="lambert", values={"rhoo": 1}), KeyError, "no value 'rhoo'; nearest: rho"),
        (lambda s, f: view(s, model="ggx", values={"width": 9.0}), ValueError, "width is 9.0: give a number from 0.01"),
        (lambda s, f: view(s, model="ggx", values={"width": "a"}), ValueError, "width is 'a': give a number from 0.01"),
        (lambda s, f: view(s, f, values={"rho": 1.0}), ValueError, "a fit has its own values"),
        (lambda s, f: view(s.isel(direction=s["theta_i"] > 20), f), None, ""),
        (lambda s, f: view(s.assign_coords(theta_i=s["theta_i"] + 5), f), ValueError, "rho was fitted for theta_i"),
    ],
)  # fmt: skip
def test_what_cannot_be_shown_is_refused_in_a_line(scan, solution, browser_opened, call, error, words):
    if error is None:  # a part of the scan of a fit
        assert call(scan, solution).session.opened[0].columns.header["total"] == 7
        return
    with pytest.raises(error) as refused:
        call(scan, solution)
    assert words in str(refused.value.args[0])
    assert "\n" not in str(refused.value.args[0])


def test_a_fit_without_its_points_says_what_to_give(solution):
    bare = solution.dataset.drop_vars([n for n in solution.dataset if str(n).startswith("scan_")])
    with pytest.raises(ValueError, match="does not hold the points"):
        view(type(solution)(bare, solution.model))


def widget_of(*words, **options):
    pytest.importorskip("anywidget", reason="the widget needs anywidget: pip install gonio[notebook]")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from gonio.viewing.widget import View

    shown = View(
        notebook._session(*words, *[None] * (2 - len(words)), options.get("model", ""), options.get("values", {}))
    )
    shown.sent = []
    shown.send = lambda content, buffers=None: shown.sent.append(content)
    return shown


def test_a_widget_begins_with_the_values_of_the_fit(scan, solution):
    shown = widget_of(scan, solution)
    assert dict(shown.values) == solution.values
    assert set(shown.values) == {"rho[10]", "rho[40]"}
    assert shown.model is LAMBERT
    assert shown.solution is solution


def test_values_are_set_and_move_the_sliders(scan, solution):
    shown, seen = widget_of(scan, solution), []
    shown.observe(lambda change: seen.append(dict(change["new"])), "values")
    shown.values = {"rho[40]": 0.3}
    first = solution.values["rho[10]"]
    assert shown.sent == [{"kind": "values", "model": "lambert", "values": [[first, 0.3]]}]
    assert seen == [{"rho[10]": first, "rho[40]": 0.3}]
    shown.values = {"rho": 0.2}
    assert dict(shown.values) == {"rho[10]": 0.2, "rho[40]": 0.2}
    with pytest.raises(TypeError):
        shown.values["rho[10]"] = 0.1


@pytest.mark.parametrize(
    ("values", "error", "words"),
    [
        ({"rho[30]": 0.1}, KeyError, r"lambert has no value 'rho[30]'; nearest: rho[40], rho[10]"),
        ({"rho": -0.1}, ValueError, "rho is -0.1: give a number from 0 to inf"),
        ({"rho": float("nan")}, ValueError, "rho is nan"),
        ({"rho": True}, ValueError, "rho is True"),
        ([1.0], Exception, "values is a mapping: view.values = {"),
    ],
)
def test_values_that_no_slider_has_are_refused(scan, solution, values, error, words):
    shown = widget_of(scan, solution)
    with pytest.raises(error) as refused:
        shown.values = values
    assert words in str(refused.value.args[0])
    assert dict(shown.values) == solution.values


def told(shown, kind, **content):
    shown._told(shown, {"gonio": "gonio-page", "kind": kind, **content}, [])


def test_the_page_tells_its_values_and_asks_for_a_fit(scan):
    shown = widget_of(scan, model="ggx", values={"width": 0.3})
    assert shown.values["width"] == 0.3
    nested = [[0.5], [0.2], [0.25], [1.5], [0.0]]
    told(shown, "values", model="ggx", fit="", values=nested)
    assert dict(shown.values) == {"rho_s": 0.5, "rho_d": 0.2, "width": 0.25, "index": 1.5, "extinction": 0.0}
    assert shown.sent == []
    told(shown, "fit", model="ggx", fit="", values=nested, locked=[2, 3, 4])
    assert shown.solution.values["width"] == 0.25
    assert shown.solution.model.name == "ggx"
    assert dict(shown.values) == shown.solution.values
    (answer,) = shown.sent
    assert (answer["kind"], answer["name"]) == ("fit", "fit 1")
    json.dumps(answer, allow_nan=False)


@pytest.mark.parametrize("is_free", [True, False])
def test_what_is_held_by_default_is_free_where_the_page_frees_it(scan, is_free):
    shown = widget_of(scan, model="coated-body", values={"n_b": 1.5})
    names = shown._layout.model.parameters
    nested = shown._layout.nested(shown._all)
    told(shown, "fit", model="coated-body", fit="", values=nested, locked=[] if is_free else [names.index("n_b")])
    held = dict(zip(shown.solution.dataset["parameter"].values, shown.solution.dataset["held"].values, strict=True))
    assert held["n_b"] != is_free


def test_a_fit_that_was_made_is_fitted_again_with_its_groups(scan, solution):
    shown = widget_of(scan, solution)
    told(shown, "fit", model="lambert", fit="fit", values=[[0.1, 0.1]], locked=[])
    assert shown.solution.values == pytest.approx(solution.values)
    assert shown.solution is not solution


@pytest.mark.parametrize(
    "content",
    [
        None,
        [],
        {"kind": "values"},
        {"gonio": "gonio-kernel", "kind": "values", "values": [[1.0, 1.0]]},
        {"gonio": "gonio-page", "kind": ["fit"]},
        {"gonio": "gonio-page", "kind": "values", "fit": "fit", "model": "lambert", "values": [[1.0]]},
        {"gonio": "gonio-page", "kind": "values", "fit": "fit", "model": "lambert", "values": [["1", 1.0]]},
        {"gonio": "gonio-page", "kind": "values", "fit": "fit", "model": "lambert", "values": [[float("nan"), 1.0]]},
        {"gonio": "gonio-page", "kind": "values", "fit": "other", "model": "lambert", "values": [[1.0, 1.0]]},
        {"gonio": "gonio-page", "kind": "values", "fit": "", "model": "../x", "values": [[1.0]]},
        {"gonio": "gonio-page", "kind": "fit", "fit": "fit", "model": "lambert", "values": [[1.0, 1.0]], "locked": [9]},
        {"gonio": "gonio-page", "kind": "fit", "fit": "fit", "model": "lambert", "values": [[1.0, 1.0]], "locked": "a"},
    ],
)
def test_what_is_no_message_changes_no_fit(scan, solution, content):
    shown = widget_of(scan, solution)
    shown._told(shown, content, [])
    assert shown.solution is solution
    assert set(shown.values) == set(solution.values)
    assert {one["kind"] for one in shown.sent} <= {"error"}


def test_a_fit_that_is_refused_is_told_on_the_page(scan):
    shown = widget_of(scan, model="lambert")
    told(shown, "fit", model="lambert", fit="", values=[[0.5]], locked=[0])
    assert shown.sent == [{"kind": "error", "text": "every parameter is held: nothing is left to fit"}]
    assert shown.solution is None


def test_a_saved_notebook_has_a_picture(scan, solution):
    shown = widget_of(scan, solution)
    data, _ = shown._repr_mimebundle_()
    assert "application/vnd.jupyter.widget-view+json" in data
    picture = ET.fromstring(data["image/svg+xml"])
    assert picture.get("width") == "640"
    assert len(data["image/svg+xml"]) < 20_000
    assert repr(shown) == "<View: lambert; values, solution, model, write(path)>"


def test_importing_gonio_loads_neither_the_page_nor_the_widget():
    code = "import sys, gonio.measured.dataset\nprint([m for m in ('anywidget', 'gonio.viewing') if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"


# The notebook's side of the page, in a browser with a kernel that is played here.
HOST = """<!doctype html><meta charset="utf-8"><title>a</title><div id="cell"></div>
<script type="module">
import widget from "data:text/javascript;base64,{script}";
const listeners = [];
window.told = [];
window.kernel = (content) => listeners.forEach((call) => call(content));
const model = {{ get: () => {page}, send: (content) => told.push(content),
  on: (name, call) => listeners.push(call), off: (name, call) => listeners.splice(listeners.indexOf(call), 1) }};
window.away = widget.render({{ model, el: document.getElementById("cell") }});
</script>"""


@pytest.fixture(scope="module")
def hosted(scan, solution, tmp_path_factory):
    import base64

    shown = widget_of(scan, solution)
    page = json.dumps(shown._page).replace("<", "\\u003c")
    script = base64.b64encode(shown._esm.encode()).decode()
    path = tmp_path_factory.mktemp("host") / "host.html"
    path.write_text(HOST.format(script=script, page=page), encoding="utf-8")
    return path


@pytest.mark.xdist_group("viewer")
def test_messages_go_between_the_page_and_the_kernel(chromium, hosted, solution):
    from viewing.opened import READY, opened, until

    with opened(chromium, hosted) as page:
        until(page, "told.some((one) => one.kind === 'values')")
        assert page.evaluate("told[0].kind") == "ready"
        values = page.evaluate("told.find((one) => one.kind === 'values')")
        assert (values["model"], values["fit"]) == ("lambert", "fit")
        assert values["values"] == [[pytest.approx(v) for v in solution.values.values()]]
        inside = page.frames[1]
        inside.wait_for_selector(READY)
        page.evaluate("kernel({kind: 'values', model: 'lambert', values: [[0.25, 0.75]]})")
        until(inside, "gonio.store.get().values[0][1] === 0.75")
        until(page, "told.at(-1).values?.[0][1] === 0.75")
        for wrong in ("null", "{kind: 'nothing'}", "{kind: 'values', model: 'lambert', values: [[1]]}",
                      "{kind: 'values', model: 'lambert', values: [['1', 2]]}", "{kind: 'fit', set: 9}"):  # fmt: skip
            page.evaluate(f"kernel({wrong})")
        page.evaluate("window.postMessage({gonio: 'gonio-page', kind: 'fit'}, '*')")  # not from the frame
        inside.evaluate(
            "window.postMessage({gonio: 'gonio-kernel', kind: 'values', model: 'lambert', values: [[9, 9]]}, '*')"
        )
        inside.get_by_role("button", name="Fit", exact=True).click()
        until(page, "told.at(-1).kind === 'fit'")
        assert page.evaluate("told.filter((one) => one.kind === 'fit').length") == 1
        assert page.evaluate("told.at(-1).values") == [[0.25, 0.75]]
        inside.locator("body").press("f")  # nothing more: a fit is running
        assert page.evaluate("told.filter((one) => one.kind === 'fit').length") == 1
        page.evaluate("kernel({kind: 'error', text: '<b>no</b>'})")
        until(inside, "document.querySelector('#status .error').textContent === '<b>no</b>'")
        assert inside.get_by_role("button", name="Fit", exact=True).is_enabled()
        inside.locator("body").press("f")
        until(page, "told.filter((one) => one.kind === 'fit').length === 2")
        page.evaluate("away()")
        assert page.locator("iframe").count() == 0
        assert page.said == []


def test_a_frame_escapes_what_it_holds():
    assert 'srcdoc="&lt;p title=&quot;&amp;&quot;&gt;"' in notebook.frame('<p title="&">')
    assert html.unescape(notebook.frame("<b>").partition('srcdoc="')[2].partition('"')[0]) == "<b>"

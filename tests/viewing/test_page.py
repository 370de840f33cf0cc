"""The page in a browser: by keys alone, for a screen reader, and closed to everybody else."""

import json
from urllib.parse import urlsplit

import numpy as np
import pytest

from gonio import catalogue, join, simulate, write
from viewed import complaints, served
from viewing.opened import until

pytestmark = [pytest.mark.xdist_group("pages"), pytest.mark.no_cover]
HOSTILE = "<img src=x onerror=alert(1)><script>alert(2)</script>\x1b[31m\u202egnp.exe"
VALUES = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2}


def painted(**more):
    return simulate(catalogue["ggx"], VALUES, [0.0, 30.0, 60.0], np.arange(-80.0, 81, 4), noise=0.05, seed=1, **more)


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    """A page with a scan of error bars, a spectral one, and one whose names are hostile."""
    folder = tmp_path_factory.mktemp("view")
    spectral = join({str(k): painted(wavelength=500.0 + 50 * k) for k in range(3)}).drop_vars("scan")
    hostile = join({HOSTILE: painted(), "b": painted()}).assign_attrs(history=f"read from {HOSTILE}")
    files = {"bars.nc": painted(), "spectral.nc": spectral, "<script>alert(3)<\u2044script>\u202e.nc": hostile}
    for name, scan in files.items():
        write(scan, folder / name)
    with served(*(folder / name for name in files), "--model", "ggx", "--set", "width=0.05") as found:
        yield found


@pytest.fixture(scope="module")
def shared(chromium, address):
    """The page, with `asked`, the addresses that it asked for, and `wrong`, what should not have happened."""
    context = chromium.new_context(viewport={"width": 1280, "height": 800})
    tab = context.new_page()
    own = urlsplit(address).netloc
    tab.asked, tab.wrong = [], complaints(tab)
    tab.on("request", lambda request: tab.asked.append(request.url))
    tab.on("dialog", lambda dialog: (tab.wrong.append(dialog.message), dialog.dismiss()))
    # Scripts of the page itself may have any address of their own kind: blob, data.
    tab.route(
        lambda url: url.startswith("http") and urlsplit(url).netloc != own,
        lambda route: (tab.wrong.append(route.request.url), route.abort()),
    )
    tab.goto(address)
    tab.wait_for_selector("html[data-ready=true]")
    yield tab
    context.close()


# As it was opened, with Tab at the beginning of the page.
AGAIN = """async () => {
  document.querySelectorAll("dialog[open]").forEach((dialog) => dialog.close());
  document.querySelector(".table").open = false;
  const { store, actions } = gonio;
  store.set({ cursor: null, hidden: new Set(), scale: "log", quantity: "f" });
  await actions.chooseSet(0);
  await actions.chooseModel("model", store.get().first || store.get().models[0].name);
  store.flush();
  const before = Object.assign(document.createElement("span"), { tabIndex: -1 });
  document.body.prepend(before);
  before.focus();
  before.remove();
}"""


@pytest.fixture
def tab(shared):
    """The page, which asks nobody else, complains of nothing, and in which nothing alerts."""
    shared.evaluate(AGAIN)
    yield shared
    assert shared.wrong == []


def test_a_table_that_opens_waits_for_the_curves_it_belongs_to(tab):
    """Its event may come after a curve is hidden and before the plots are made anew: they still have all curves."""
    tab.evaluate(
        """() => {
          const table = document.querySelector(".table");
          gonio.store.set({ hidden: new Set([0]) });
          table.open = true;
          table.dispatchEvent(new Event("toggle"));
          gonio.store.flush();
        }"""
    )
    until(tab, "document.querySelectorAll('.table table').length > 0")


def test_every_slider_says_its_value_whatever_is_built_anew(tab):
    """What is told of the scans builds the sliders anew, and their values are then not told again by themselves."""
    values = "() => [...document.querySelectorAll('#panel .parameter input.number')].map((box) => box.value)"
    tab.evaluate("() => { const { store } = gonio; store.set({ sets: store.get().sets.slice() }); store.flush(); }")
    assert tab.evaluate(values)
    assert all(tab.evaluate(values))


def settle(tab):
    tab.evaluate("new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")


FOCUSED = """() => {
  const e = document.activeElement;
  const seen = e.matches(".one-of input") ? e.nextElementSibling : e;
  const { outlineStyle, outlineWidth } = getComputedStyle(seen);
  const box = seen.getBoundingClientRect();
  return { text: (e.ariaLabel || e.labels?.[0]?.textContent || e.textContent || "").trim().slice(0, 60), tag: e.tagName,
    section: e.closest("header, aside, main > section, footer, dialog")?.id ?? "",
    outlined: outlineStyle !== "none" && parseFloat(outlineWidth) >= 2, shown: box.width > 0 && box.height > 0 };
}"""


def walk(tab, most=200):
    """What has the focus after each press of Tab, until it is back where it began."""
    found = []
    for _ in range(most):
        tab.keyboard.press("Tab")
        one = tab.evaluate(FOCUSED)
        if one["tag"] == "BODY":
            return found
        found.append(one)
    raise AssertionError("Tab comes to no end")


def test_focus_is_seen_and_in_reading_order(tab):
    found = walk(tab)
    assert len(found) > 20
    assert [one for one in found if not one["outlined"] or not one["shown"]] == []
    order = tab.evaluate(
        "Array.from(document.querySelectorAll('header, aside, main > section, footer')).map((e) => e.id)"
    )
    places = [order.index(one["section"]) for one in found]
    assert places == sorted(places)


def reached(tab, text, section):
    """Press Tab until what has the focus is called so."""
    for _ in range(200):
        tab.keyboard.press("Tab")
        one = tab.evaluate(FOCUSED)
        if one["section"] == section and text in one["text"]:
            return
    raise AssertionError(f"no Tab leads to {text!r} in {section}")


def now(tab, expression):
    """What an expression of the page's state is, with all drawn that has changed."""
    return tab.evaluate(f"(() => {{ gonio.store.flush(); const state = gonio.store.get(); return {expression}; }})()")


def test_everything_by_keys(tab):
    """A model, a slider, best weights, a fit, a value of the plot, an incidence angle, an export, the list of keys."""
    reached(tab, "model", "panel")
    tab.keyboard.type("torrance-sparrow")
    tab.keyboard.press("Enter")
    until(tab, "gonio.store.get().model.declaration.name === 'torrance-sparrow'")
    slider(tab)
    values = fit(tab)
    read(tab)
    export(tab, values)
    tab.keyboard.press("?")
    assert "best weights" in tab.inner_text("dialog[open]")
    tab.keyboard.press("Enter")  # on the button that closes it
    assert now(tab, "document.querySelectorAll('dialog[open]').length") == 0


def slider(tab):
    reached(tab, "σ", "panel")
    before = tab.inner_text("#status .agreement")
    values = now(tab, "state.values")
    tab.keyboard.press("Shift+ArrowRight")
    moved = now(tab, "state.values")
    assert moved[2] > values[2]
    assert moved[0] != values[0], "weights follow"
    assert tab.inner_text("#status .agreement") != before
    tab.keyboard.press("Home")
    assert now(tab, "state.values[2][0] === state.model.declaration.parameters[2].lower")
    tab.keyboard.press("r")
    assert now(tab, "state.values") == values
    tab.keyboard.press("w")
    assert now(tab, "state.values")[0] == pytest.approx(values[0], rel=1e-9)
    tab.keyboard.press("Shift+ArrowRight")


def fit(tab):
    """The values that were fitted; the focus stays where it was, and the end of the fit is read out."""
    started = now(tab, "state.values")
    tab.keyboard.press("f")
    assert now(tab, "state.job.name") == "torrance-sparrow"
    until(tab, "!gonio.store.get().job && Boolean(gonio.store.get().fit)")
    fitted = now(tab, "state.values")
    assert fitted != started
    assert tab.inner_text("section.fit [role=status]").startswith("torrance-sparrow: converged, E ")
    assert tab.evaluate(FOCUSED)["text"].startswith("σ")
    return fitted


def read(tab):
    tab.keyboard.press("2")
    assert now(tab, "Array.from(state.hidden)") == [1]
    assert tab.evaluate("document.querySelectorAll('.chip')[1].ariaPressed") == "false"
    reached(tab, "arrow keys", "curves")
    tab.keyboard.press("ArrowRight")
    tab.keyboard.press("ArrowRight")
    now(tab, "0")
    assert tab.inner_text("#status .reading").startswith("θᵢ 0°, θᵣ −76°: ")
    tab.keyboard.press("ArrowUp")
    now(tab, "0")
    assert tab.inner_text("#status .reading").startswith("θᵢ 60°, θᵣ −76°: ")


def export(tab, values):
    """The parameters of the fit as a file, as gonio eval reads them."""
    reached(tab, "Export", "top")
    tab.keyboard.press("Enter")
    for _ in range(20):
        tab.keyboard.press("Tab")
        if tab.evaluate(FOCUSED)["text"] == "JSON":
            break
    with tab.expect_download() as handed:
        tab.keyboard.press("Enter")
    assert handed.value.suggested_filename == "bars-torrance-sparrow-values.json"
    exported = json.loads(handed.value.path().read_text(encoding="utf-8"))
    assert list(exported["values"].values()) == [own[0] for own in values]
    tab.keyboard.press("Escape")
    assert now(tab, "document.querySelectorAll('dialog[open]').length") == 0


def test_the_focus_stays_on_what_is_used(tab):
    """Also where using it builds that part of the page anew."""
    tab.evaluate("gonio.actions.chooseSet(1)")
    reached(tab, "wavelength", "panel")
    for _ in range(2):
        tab.keyboard.press("ArrowRight")
        settle(tab)
    assert now(tab, "state.block") == 2
    reached(tab, "compare", "panel")
    tab.keyboard.press("ArrowDown")
    settle(tab)
    assert now(tab, "state.second") == 0
    tab.keyboard.press("ArrowUp")
    settle(tab)
    assert now(tab, "state.second") == -1
    reached(tab, "30", "curves")
    for pressed in ("false", "true"):
        tab.keyboard.press("Space")
        settle(tab)
        assert tab.evaluate("document.activeElement.ariaPressed") == pressed


def test_a_model_is_typed_as_slowly_as_one_likes(tab):
    reached(tab, "model", "panel")
    for letter in "st":  # which no model but student-t begins with
        tab.keyboard.press(letter)
        settle(tab)
    until(tab, "gonio.store.get().model.declaration.name === 'student-t'")


def test_the_wavelength_is_dragged(tab):
    tab.evaluate("gonio.actions.chooseSet(1)")
    settle(tab)
    slider = tab.locator("section.data input[type=range]")
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    middle = box["y"] + box["height"] / 2
    tab.mouse.move(box["x"] + 4, middle)
    tab.mouse.down()
    for share in (0.5, 0.98):
        tab.mouse.move(box["x"] + share * box["width"], middle)
        settle(tab)
        assert now(tab, "state.block") == round(2 * share)
    tab.mouse.up()


STATES = {
    "as it opens": "",
    "table, a value read": "document.querySelector('.table').open = true;"
    "gonio.store.set({ cursor: { cell: 0, row: 3 }, hidden: new Set([1, 2]) })",
    "list of keys": "document.dispatchEvent(new KeyboardEvent('keydown', { key: '?' }))",
}


# In the dark nothing but colours is another. Of what is right axe tells one element a rule: it is twice as quick.
RULES = {"light": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"], "dark": ["color-contrast"]}


@pytest.mark.parametrize("scheme", RULES)
def test_axe_finds_nothing(scheme, tab):
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    tab.emulate_media(color_scheme=scheme)
    for state, script in STATES.items():
        tab.evaluate(script or "0")
        settle(tab)
        found = axe.run(tab, options={"runOnly": RULES[scheme], "resultTypes": ["violations"]})
        wrong = [(one["id"], [node["html"][:200] for node in one["nodes"]]) for one in found.response["violations"]]
        assert wrong == [], state
        assert "color-contrast" in {one["id"] for one in found.response["passes"]}, state
    tab.emulate_media(color_scheme="light")


def test_hostile_names_are_text(tab):
    """Nothing runs (`tab` looks for what alerts), nothing is made of markup, and controls are shown as such."""
    tab.evaluate("gonio.actions.chooseSet(2)")
    settle(tab)
    shown = tab.inner_text("body")
    assert "<script>alert(3)" in shown
    assert "<img src=x onerror=alert(1)><script>alert(2)</script>\ufffd[31m\ufffdgnp.exe" in shown
    everything = json.dumps(tab.evaluate("[document.body.textContent, document.title]"))
    assert "\u202e" not in json.loads(everything)[0]
    assert "\x1b" not in json.loads(everything)[0]
    assert tab.evaluate("document.querySelectorAll('img, body script').length") == 0


def test_it_asks_for_its_own_files_alone(tab, address):
    """No request leaves the origin (`tab` refuses and tells each), and others are refused what is here."""
    assert len(tab.asked) > 10
    own = urlsplit(address).netloc
    assert {urlsplit(url).netloc for url in tab.asked if url.startswith("http")} == {own}
    stranger = tab.context.browser.new_context()
    foreign = stranger.new_page()
    for path, status in {"/": 403, "/api/session": 403, "/page/app.js": 403, "/?token=x": 403}.items():
        assert foreign.goto(f"http://{own}{path}").status == status
    port = own.rsplit(":", 1)[1]
    for path in ("/page/../session.py", "/page/%2e%2e/session.py", "/page/..%2f..%2fsession.py", "/page/vendor"):
        assert tab.context.request.get(f"http://{own}{path}").status == 404
    assert tab.context.request.get(f"http://{own}/", headers={"Host": f"evil.example:{port}"}).status == 421
    stranger.close()

"""What the page does with its server: fits, a dragged curve, a second scan, exports, links; in a browser."""

import json
import math
import time
import tomllib

import numpy as np
import pytest

import gonio
from asking import served
from gonio.app.arguments import values as set_values
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.viewing.assembled import in_one_file
from gonio.viewing.pairs import pair
from gonio.viewing.session import Opened, Session
from viewing.opened import READY
from viewing.opened import opened as in_kept_tab

pytestmark = pytest.mark.xdist_group("viewer")
SCRIPT = "<script>document.title='owned'</script>\x07.csv"
DRAG = """async ([cell, theta, times]) => {
    const m = await import("gonio/drag.js"); const {store, actions} = window.gonio;
    const wanted = times * m.valueAt(store.get(), cell, theta); actions.drag(cell, theta, wanted);
    return [m.valueAt(store.get(), cell, theta), wanted]; }"""


def scan_of(noise=0.01, seed=1):
    values = {"kd": 0.1, "ks": 0.5, "n": 20.0}
    return gonio.simulate(
        gonio.catalogue["phong"], values, [20.0, 50.0], np.arange(-70, 71, 5.0), noise=noise, seed=seed
    )


@pytest.fixture(scope="module")
def session():
    opened = [Opened("a.csv", scan_of()), Opened(SCRIPT, scan_of(seed=2))]
    return Session(opened, model="phong", values={"n": 20.0}, pair=(0, 1))


@pytest.fixture(scope="module")
def client(session):
    with served(session) as asking:
        yield asking


@pytest.fixture(scope="module")
def context(chromium, client):
    made = chromium.new_context(viewport={"width": 1000, "height": 700})
    name, _, token = client.cookie.partition("=")
    made.add_cookies([{"name": name, "value": token, "url": f"http://127.0.0.1:{client.port}"}])
    yield made
    made.close()


@pytest.fixture(scope="module")
def page(context, client):
    return opened(context, f"http://127.0.0.1:{client.port}/")


def opened(context, address):
    page = context.new_page()
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.goto(address)
    page.wait_for_selector("html[data-ready=true]")
    return page


def until(page, condition, seconds=30.0):
    """Wait until an expression is true; the page's own policy forbids what Playwright waits by."""
    end = time.monotonic() + seconds
    while not page.evaluate(condition):
        assert time.monotonic() < end, condition
        page.wait_for_timeout(20)


@pytest.fixture(autouse=True)
def fresh(page):
    page.evaluate(
        """async () => { const {actions, store} = window.gonio;
        await actions.chooseModel("model", "phong");
        store.set({dragging: false, cursor: null, error: ""}); store.flush(); }"""
    )
    yield
    assert page.complaints == []


def test_the_key_f_fits_and_the_sliders_are_the_fit(page, session):
    page.locator("body").press("f")
    until(page, "!window.gonio.store.get().job && Boolean(window.gonio.store.get().fit)")
    said = page.evaluate("({values: window.gonio.store.get().values, name: window.gonio.store.get().fitName})")
    solution = session.opened[0].fits[said["name"]]
    assert [own[0] for own in said["values"]] == [solution.values[name] for name in ("ks", "kd", "n")]
    assert "E " in page.inner_text("section.fit [role=status]")
    assert page.locator(".tick:not([hidden])").count() == 3


def test_what_is_held_is_not_fitted(page):
    page.evaluate("window.gonio.actions.lock(2)")
    page.click("button:text-is('Fit')")
    until(page, "!window.gonio.store.get().job && Boolean(window.gonio.store.get().fit)")
    fit = page.evaluate("window.gonio.store.get().fit.parameters.map((p) => [p.held, p.values[0]])")
    assert fit[2] == [True, 20.0]
    assert not fit[0][0]


def test_every_weighting_can_be_chosen(page):
    assert page.locator("section.fit option").all_inner_texts() == ["auto", *WEIGHTINGS]


def test_every_parameter_held_is_a_message(page):
    page.evaluate("[0, 1, 2].forEach((k) => window.gonio.actions.lock(k))")
    page.click("button:text-is('Fit')")
    until(page, "Boolean(document.querySelector('section.fit .error').textContent)")
    assert "held" in page.inner_text("section.fit .error")
    until(page, "!window.gonio.store.get().job")


@pytest.mark.parametrize("times", [1.02, 1.5, 0.3])
def test_a_dragged_curve_is_where_the_pointer_is(page, times):
    """Gauss-Newton on ln f: after some rounds f is the wanted one to 1e-3, and what is held has not moved."""
    page.evaluate("window.gonio.actions.lock(1)")
    before = page.evaluate("window.gonio.store.get().values")
    f = page.evaluate(DRAG, [0, 25.0, times])
    after = page.evaluate("window.gonio.store.get().values")
    assert math.isclose(f[0], f[1], rel_tol=1e-3)
    assert after[1] == before[1]
    assert after != before
    assert page.evaluate("window.gonio.store.get().follow") is False


def test_the_step_changes_least_elsewhere(page):
    """Far in the tail of a lobe kd alone moves the curve: the lobe stays as it was."""
    change = page.evaluate(
        """async () => { const m = await import("gonio/drag.js"); const {store, actions} = window.gonio;
        const at = (t) => m.valueAt(store.get(), 0, t); const peak = at(20);
        actions.drag(0, -70, at(-70) * 1.1); return [at(20) / peak - 1]; }"""
    )
    assert abs(change[0]) < 0.03  # of the ten per cent in the tail, kd is a sixth of the peak


def test_a_held_model_cannot_be_dragged(page):
    page.evaluate("[0, 1, 2].forEach((k) => window.gonio.actions.lock(k))")
    before = page.evaluate("window.gonio.store.get().values")
    page.evaluate("window.gonio.actions.drag(0, 20, 1)")
    assert page.evaluate("window.gonio.store.get().values") == before
    assert "held" in page.inner_text("#curves .tools [role=status]")


def test_a_curve_that_cannot_go_there_says_so(page):
    page.evaluate("[1, 2].forEach((k) => window.gonio.actions.lock(k))")
    page.evaluate("window.gonio.actions.drag(0, 20, 1e-9)")  # less than kd alone gives
    assert 0 <= page.evaluate("window.gonio.store.get().values")[0][0] < 1e-2
    assert "no nearer" in page.inner_text("#curves .tools [role=status]")


def test_what_a_fit_holds_is_marked(page):
    """The half width of gonio-best's diffuse lobe: its box is ticked, and ticked off it moves with the others."""
    page.evaluate("window.gonio.actions.chooseModel('model', 'gonio-best')")
    until(page, "window.gonio.store.get().model.declaration.name === 'gonio-best'")
    names = "window.gonio.store.get().model.declaration.parameters.map((p) => p.name)"
    locked = f"[...window.gonio.store.get().locked].map((k) => {names}[k])"
    assert page.evaluate(locked) == ["gamma"]
    page.evaluate(f"window.gonio.actions.lock({names}.indexOf('gamma'))")
    assert page.evaluate(locked) == []


def test_a_parameter_stops_at_its_bound(page):
    page.evaluate("window.gonio.actions.chooseModel('model', 'ggx')")
    until(page, "window.gonio.store.get().model.declaration.name === 'ggx'")
    page.evaluate("[0, 1, 2, 4].forEach((k) => window.gonio.actions.lock(k))")  # the index is left, which is at most 10
    page.evaluate("window.gonio.actions.move(0, 1)")
    page.evaluate("window.gonio.actions.drag(0, 20, 1e6)")
    assert page.evaluate("window.gonio.store.get().values")[3] == [10]
    until(page, "document.querySelector('#curves .tools [role=status]').innerText.includes('bound: index')")


def test_the_pointer_and_the_keyboard_drag(page):
    page.check("#curves .drag input")
    until(page, "document.querySelectorAll('.u-over').length === 3")
    box = page.locator(".u-over").first.bounding_box()
    before = page.evaluate("window.gonio.store.get().values")
    x = box["x"] + box["width"] * (20 + 90) / 180  # the mirror direction of 20 deg, where the curve is near its top
    for y in np.arange(box["y"] + 4, box["y"] + box["height"], 12):
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x, y - 8)
        page.mouse.up()
        if page.evaluate("window.gonio.store.get().values") != before:
            break
    assert page.evaluate("window.gonio.store.get().values") != before
    page.uncheck("#curves .drag input")
    page.focus("#curves .plot")
    for _ in range(5):
        page.keyboard.press("ArrowRight")
    at = """async () => { const m = await import("gonio/drag.js"); const s = window.gonio.store.get();
        return m.valueAt(s, s.cursor.cell, s.sets[s.set].signed[s.cursor.row]); }"""
    f = page.evaluate(at)
    page.keyboard.press("+")
    assert math.isclose(page.evaluate(at), 1.02 * f, rel_tol=1e-3)


def test_a_second_scan_is_shown_with_both_uncertainties(page, session):
    until(page, "Boolean(window.gonio.store.get().pair)")
    shown = page.evaluate("[...window.gonio.store.get().pair.value]")
    assert shown == pair(*session.opened)["value"]
    assert page.locator("#curves .plot:not([hidden])").count() == 3
    ratio = page.evaluate(
        """async () => { const m = await import("gonio/compare.js"); const s = window.gonio.store.get();
        const set = s.sets[0]; return [m.compared(s, 3), set.value[3], set.uncertainty[3]]; }"""
    )
    (value, u), a, ua = ratio
    b, ub = pair(*session.opened)["value"][3], pair(*session.opened)["uncertainty"][3]
    assert math.isclose(value, b / a)
    assert u is None or math.isclose(u, b / a * math.hypot(ua / a, ub / b))
    page.click("text=difference")
    until(page, "window.gonio.store.get().pairAs === 'difference'")


def test_a_hostile_name_is_text(page):
    assert page.title() == "gonio"
    options = page.locator("section.second select option").all_inner_texts()
    assert any("<script>" in one and "\x07" not in one for one in options)


def test_the_values_leave_as_files_that_gonio_reads(page, tmp_path):
    texts = page.evaluate(
        """async () => { const m = await import("gonio/exported.js"); const s = window.gonio.store.get();
        return [m.asJson(s), m.asToml(s), m.asCsv(s), m.asCommand(s), s.values.map((own) => own[0])]; }"""
    )
    given = dict(zip(("ks", "kd", "n"), texts[4], strict=True))
    (tmp_path / "values.json").write_text(texts[0])
    assert set_values([str(tmp_path / "values.json")], "", None) == given
    assert set_values([texts[3].split("--set ")[1].split(" ")[0]], "", None) == given
    (surface,) = tomllib.loads(texts[1])["surface"]
    assert surface["values"] == given
    assert surface["model"] == "phong"
    (tmp_path / "numbers.csv").write_text(texts[2])
    found = gonio.read(tmp_path / "numbers.csv")
    assert np.array_equal(np.sort(found["brdf"].values.ravel()), np.sort(scan_of()["brdf"].values.ravel()))


def test_the_export_list_has_every_target(page):
    page.click("#top >> text=Export")
    until(page, "document.querySelectorAll('.exports select')[1].options.length > 10")
    with page.expect_download() as handed:
        page.click(".exports >> text=Download")
    assert handed.value.suggested_filename == "a-phong.py"
    with page.expect_download() as handed:
        page.click(".exports >> text=Plot as PNG")
    assert handed.value.suggested_filename == "a-phong.png"
    page.click(".exports > button")


def test_the_laws_follow_the_values(page):
    page.evaluate("window.gonio.actions.move(1, 2.5)")
    until(page, "document.querySelector('.laws').textContent.includes('energy conserved: no')")
    page.evaluate("window.gonio.actions.move(1, 0.1)")
    until(page, "document.querySelector('.laws').textContent.includes('energy conserved: yes')")
    assert "20 deg" in page.inner_text(".laws")


def pixels(page):
    page.evaluate("document.activeElement.blur()")
    page.wait_for_timeout(50)
    return page.evaluate("[...document.querySelectorAll('#curves canvas')].map((one) => one.toDataURL())")


def test_a_link_restores_the_same_pixels(page, context, client):
    page.evaluate(
        """() => { const {actions, store} = window.gonio; actions.move(2, 12.5); actions.move(1, 0.2); actions.lock(0);
        store.set({quantity: "fcos", scale: "linear", hidden: new Set([0]), cell: 1, pairAs: "ratio"}); }"""
    )
    text = page.evaluate(
        """async () => { const m = await import("gonio/link.js"); const {store} = window.gonio;
        return m.encoded(m.stateOf(store.get())); }"""
    )
    other = opened(context, f"http://127.0.0.1:{client.port}/#s={text}")
    until(other, "Boolean(window.gonio.store.get().pair)")
    assert pixels(other) == pixels(page)
    assert other.evaluate("[...window.gonio.store.get().locked]") == [0]
    assert other.inner_text("#status .error") == ""
    other.close()
    page.evaluate("window.gonio.store.set({quantity: 'f', scale: 'log', hidden: new Set()})")


@pytest.mark.parametrize(
    ("state", "word"),
    [
        ({"scale": "cubic"}, "scale must be"),
        ({"values": {"n": ["1"]}}, "values must be"),
        ({"values": {"n": [1, 2]}}, "n has 1 here"),
        ({"values": {"n": [-5]}}, "outside its bounds"),
        ({"model": "nobody"}, "no model nobody"),
        ({"model": "<b>\u202e"}, "no model <b>\ufffd"),
        ({"fit": "nothing"}, "no fit nothing"),
        ({"fit": "constructor"}, "no fit constructor"),
        ({"set": 9}, "scan 10"),
        ({"set": -1}, "set must be"),
        ({"v": 2}, "version 2"),
        ({"block": 7}, "no such wavelength"),
        ([1], "no object"),
        ({"unknown": 1, "v": 1}, ""),
    ],
)
def test_a_state_is_refused_with_a_word(page, state, word):
    said = page.evaluate(
        """async (said) => { const m = await import("gonio/link.js"); const {store, actions} = window.gonio;
        return m.restored(store, actions, said); }""",
        state,
    )
    assert word in said
    assert bool(said) == bool(word)


def test_a_damaged_link_is_a_word(page):
    page.evaluate("location.hash = '#s=%%%'")
    until(page, "document.querySelector('#status .error').textContent.includes('damaged')")
    page.evaluate("history.replaceState(null, '', location.pathname)")


def test_a_state_of_the_command_line_is_applied(context, session):
    given = Session(session.opened, model="phong", state={"v": 1.0, "scale": "linear", "values": {"n": [33.0]}})
    with served(given) as asking:
        name, _, token = asking.cookie.partition("=")
        context.add_cookies([{"name": name, "value": token, "url": f"http://127.0.0.1:{asking.port}"}])
        page = opened(context, f"http://127.0.0.1:{asking.port}/")
        assert page.evaluate("window.gonio.store.get().values[2]") == [33.0]
        assert page.evaluate("window.gonio.store.get().scale") == "linear"
        assert page.evaluate("document.querySelector('input[name=scale]:checked').value") == "linear"
        page.close()


def test_a_file_that_is_opened_is_one_scan_more(page, tmp_path):
    good = tmp_path / "new.csv"
    good.write_text("theta_i_deg,theta_r_deg,phi_deg,brdf_sr-1\n30,10,180,0.5\n30,20,180,0.6\n30,30,180,0.7\n")
    bad = tmp_path / "bad.csv"
    bad.write_bytes(b"\x00junk" * 9)
    page.set_input_files("section.files input", bad)
    until(page, "document.querySelector('section.files .error').textContent.includes('bad.csv')")
    before = page.evaluate("window.gonio.store.get().sets.length")
    page.set_input_files("section.files input", good)
    until(page, f"window.gonio.store.get().sets.length === {before + 1}")
    until(page, f"window.gonio.store.get().set === {before}")
    page.evaluate("window.gonio.actions.chooseSet(0)")


def test_a_file_is_dropped(page):
    page.evaluate(
        """() => { const data = new DataTransfer(); data.items.add(new File(["junk"], "dropped.csv"));
        for (const type of ["dragover", "drop"])
          document.dispatchEvent(new DragEvent(type, {dataTransfer: data, bubbles: true, cancelable: true})); }"""
    )
    until(page, "document.querySelector('section.files .error').textContent.includes('dropped.csv')")


def test_in_one_file_what_needs_a_server_says_so(chromium, session, tmp_path):
    path = tmp_path / "page.html"
    path.write_text(in_one_file(session, session.needed()), encoding="utf-8")
    with in_kept_tab(chromium, path) as page:
        page.wait_for_selector(READY)
        for text in ("Fit", "Compare all", "Open a scan …"):
            assert page.locator(f"button:text-is('{text}')").is_disabled()
        assert "gonio view" in page.inner_text("section.fit [role=status]")
        page.locator("body").press("f")
        until(page, "Boolean(window.gonio.store.get().pair)")  # it was computed when the page was written
        page.click("#top >> text=Export")
        with page.expect_download() as handed:
            page.click(".exports >> text=CSV")
        assert handed.value.suggested_filename == "a-phong.csv"
        assert page.locator(".exports >> text=Download").is_disabled()
        assert page.said == []
        assert json.loads(page.locator("#gonio-held").text_content())["pairs"]

"""Hemisphere, lobe and lit sphere in a browser: what they draw, what they say of it, and how quickly."""

import re
import statistics

import numpy as np
import pytest

from gonio import catalogue, simulate
from gonio.measured.dataset import make_scan
from gonio.viewing.assembled import in_one_file
from gonio.viewing.session import Opened, Session

pytestmark = pytest.mark.xdist_group("viewer")

ANGLES = np.arange(-80.0, 81, 2)
MOST = 50.0  # ms of a slider event
EVENTS = 20


def simulated(**more):
    values = {"rho_s": 0.3, "rho_d": 0.1, "width": 0.2}
    return simulate(catalogue["ggx"], values, [0.0, 45.0], ANGLES, noise=0.02, seed=1, **more)


def around():
    """Out of the plane too, of two incidences."""
    theta_i, theta_r, phi = (g.ravel() for g in np.meshgrid([20.0, 50.0], [5.0, 30.0, 60.0], np.arange(0, 360.0, 40)))
    return make_scan(theta_i, theta_r, 0.1 + 0.01 * theta_r / (1 + theta_i), phi)


def colours():
    """Three channels, the blue one dark."""
    scans = [simulated() for _ in range(3)]
    columns = {n: np.concatenate([s[n].values for s in scans]) for n in ("theta_i", "theta_r", "phi", "brdf")}
    columns["brdf"] *= np.repeat([1.0, 1.0, 1e-3], len(scans[0]["brdf"]))
    channel = np.repeat(["R", "G", "B"], len(scans[0]["brdf"]))
    return make_scan(*(columns[n] for n in ("theta_i", "theta_r", "brdf", "phi")), coordinates={"channel": channel})


class Page:
    """A page in one file, and what it wrote to the console."""

    def __init__(self, chromium, folder, session, models=("gonio-best", "ggx", "lambert"), **context):
        path = folder / "page.html"
        path.write_text(in_one_file(session, list(models)), encoding="utf-8")
        self.page = chromium.new_page(**context)
        self.said = []
        self.page.on("console", lambda m: self.said.append(m.text) if m.type == "error" else None)
        self.page.on("pageerror", lambda e: self.said.append(str(e)))
        self.path = path.as_uri()

    def open(self):
        self.page.goto(self.path)
        self.page.wait_for_selector("html[data-ready=true]", timeout=20_000)
        self.settle()
        return self

    def settle(self):
        """Wait until what is drawn coarser while something moves is drawn as it should be."""
        self.page.wait_for_timeout(400)

    def run(self, script):
        return self.page.evaluate(f"async () => {{ const {{ store, actions }} = window.gonio; {script} }}")

    def pixels(self, canvas):
        """The picture of a canvas as bytes (height, width, 4)."""
        width, height, content = self.page.evaluate(
            "(at) => { const c = document.querySelector(at);"
            " return [c.width, c.height, [...c.getContext('2d').getImageData(0, 0, c.width, c.height).data]]; }",
            canvas,
        )
        return np.array(content, dtype=np.uint8).reshape(height, width, 4)

    def label(self, canvas):
        return self.page.get_attribute(canvas, "aria-label")

    def text(self, at):
        return self.page.inner_text(at)


@pytest.fixture(scope="module")
def shown(chromium, tmp_path_factory):
    session = Session([Opened("plane", simulated()), Opened("around", around()), Opened("colours", colours())])
    return Page(chromium, tmp_path_factory.mktemp("views"), session, viewport={"width": 780, "height": 900}).open()


MAP, LOBE, BODY = "#map canvas.hemisphere", "#lobe canvas", "#sphere canvas"


def test_a_slider_moves_all_views(shown):
    """The pixels of every view are others after a slider has moved, and nothing is wrong on the console."""
    before = [shown.pixels(at) for at in (MAP, LOBE, BODY)]
    shown.run("actions.move(6, 0.3); store.flush();")
    after = [shown.pixels(at) for at in (MAP, LOBE, BODY)]
    for one, other in zip(before, after, strict=True):
        assert (one != other).any()
    assert shown.said == []


def test_every_canvas_says_in_numbers_what_is_seen(shown):
    shown.settle()
    for canvas in shown.page.query_selector_all("main canvas[role]"):
        assert re.search(r"\d", canvas.get_attribute("aria-label") or ""), canvas.evaluate("(c) => c.outerHTML")
    largest = max(simulated()["brdf"].values[:81])
    assert f"to {largest:.3g} at 81 directions" in shown.label(MAP)


def test_the_hemisphere_has_the_colours_of_the_model(shown):
    """In the middle of the model's half is the colour of f at the normal, as JavaScript computes it."""
    colour, scale = shown.run("""
        const { colourAt, rangeOf, scaleOf, SEQUENTIAL } = await import("gonio/palette.js");
        const { evaluator } = await import("gonio/compute.js");
        const { light } = await import("gonio/angles.js");
        store.set({ mapView: "model", cell: 1, scale: "log" });
        await new Promise((done) => setTimeout(done, 500));
        const state = store.get();
        const set = state.sets[0];
        const { start, end, theta_i } = set.cells[1];
        const scale = scaleOf(...rangeOf(set.value.slice(start, end), true), true, SEQUENTIAL);
        const f = evaluator(state, 1)(light(theta_i))([Math.sin(0.35), 0, Math.cos(0.35)]);
        return [colourAt(scale, f), scale.place(f)];
    """)
    assert 0 < scale < 1
    picture = shown.pixels(MAP)
    height, width, _ = picture.shape
    across = 400  # CSS pixels, and here those of the picture
    left, top = 32, 22  # of map.js: MARGIN
    x = left + across // 2 - round(0.35 / (np.pi / 2) * across / 2)  # phi 0 is on the left
    found = picture[top + across // 2 + 2, x, :3].astype(int)
    np.testing.assert_allclose(found, colour, atol=6)  # two pixels beside the place, 256 colours
    shown.run("store.set({ mapView: 'both', cell: 0 });")


def test_a_click_reads_the_nearest_direction(shown):
    shown.run("await actions.chooseSet(1); store.set({ mapView: 'data' });")
    shown.settle()
    box = shown.page.query_selector(MAP).bounding_box()
    # theta_r 60 deg, phi 40 deg: to the left and down
    r = 60 / 90 * 200
    x, y = 32 + 200 - r * np.cos(np.radians(40)), 22 + 200 + r * np.sin(np.radians(40))
    shown.page.mouse.click(box["x"] + x + 6, box["y"] + y - 6)
    row = shown.run(
        "store.flush(); const s = store.get(); const set = s.sets[s.set]; const { row } = s.cursor; return [set.theta_r[row], set.phi[row]];"
    )
    assert row == [60.0, 40.0]
    assert "θᵣ 60°, φ 40°" in shown.text("#status")
    shown.run("await actions.chooseSet(0); store.set({ mapView: 'both' });")


def test_three_channels_are_colours(shown):
    shown.run("await actions.chooseSet(2);")
    shown.settle()
    picture = shown.pixels(BODY).astype(int)
    middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
    assert middle[0] == middle[1] > 4 * middle[2]
    assert "red, green and blue" in shown.text("#sphere .note")
    shown.run("await actions.chooseSet(0);")


def test_the_light_is_moved_by_keys_and_by_pointer(shown):
    shown.settle()
    before = shown.pixels(BODY)
    shown.page.focus("#sphere label:has-text('across') input")
    shown.page.keyboard.press("Home")
    shown.run("store.flush();")
    assert (shown.pixels(BODY) != before).any()
    box = shown.page.query_selector(BODY).bounding_box()
    shown.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert shown.run("return store.get().lamp;") == [0, 0]


def test_a_slider_event_is_quick(shown):
    """Curve, map and sphere of gonio-best at 400 x 400 in software, while it is dragged: the median of 20 events."""
    shown.run("store.set({ mapView: 'model', quantity: 'f' }); await actions.chooseModel('model', 'gonio-best');")
    shown.settle()
    assert [shown.pixels(at).shape[:2] for at in (BODY,)] == [(400, 400)]
    medians = []
    for _ in range(5):  # other programs on the machine take their time from it
        times = shown.run(f"""
            const times = [];
            for (let k = 0; k < {EVENTS}; k++) {{
              actions.move(6, 0.05 + 0.002 * k);
              const begun = performance.now();
              store.flush();
              times.push(performance.now() - begun);
              await new Promise((done) => setTimeout(done, 5));
            }}
            return times;
        """)
        medians.append(statistics.median(times))
        if medians[-1] < MOST:
            break
    print(medians)
    assert min(medians) < MOST
    shown.run("store.set({ mapView: 'both' });")

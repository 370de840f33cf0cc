"""The first answer of a page: its model fitted to the scan, unless something else was named or done."""

import threading

import numpy as np
import pytest

import gonio
from asking import served
from gonio.measured.dataset import make_scan
from gonio.viewing.serving import jobs
from gonio.viewing.session import Opened, Session
from gonio.viewing.working import beginning, fitting
from gonio.viewing.working.beginning import fit_first
from viewing.opened import READY, opened, until

VALUES = {"kd": 0.1, "ks": 0.5, "n": 57.0}
FITTED = "!gonio.store.get().job && Boolean(gonio.store.get().fit)"


def scan_of(seed=1):
    return gonio.simulate(
        gonio.catalogue["phong"], VALUES, [20.0, 50.0], np.arange(-70, 71, 5.0), noise=0.01, seed=seed
    )


def through():
    """Light that went through, of which models say nothing."""
    theta = np.arange(0.0, 71.0, 10.0)
    return make_scan(
        np.full(theta.size, 20.0),
        theta,
        np.full(theta.size, 0.1),
        np.full(theta.size, 180.0),
        coordinates={"mode": np.full(theta.size, "transmission")},
    )


def session(scan=None, **named):
    return Session([Opened("a.csv", scan_of() if scan is None else scan)], model="phong", **named)


def test_each_scan_without_a_fit_is_fitted(monkeypatch):
    given = Session([Opened("a", scan_of()), Opened("b", scan_of(2))], model="phong")
    told = []
    assert fit_first(given, told=lambda fraction, name: told.append((fraction, name))) == []
    assert [list(one.fits) for one in given.opened] == [["phong"], ["phong"]]
    assert given.opened[0].fits["phong"].values["n"] == pytest.approx(57, rel=0.05)
    fractions = [fraction for fraction, _ in told]
    assert fractions == sorted(fractions)
    assert max(fractions) > 0.5
    assert {name for _, name in told} == {"phong"}
    monkeypatch.setattr(beginning, "fit", None)  # there is nothing left to fit
    assert fit_first(given) == []


@pytest.mark.parametrize("named", [{"values": {"n": 20.0}}, {"state": {"v": 1}}])
def test_what_is_named_is_not_replaced_by_a_fit(named):
    given = session(**named)
    assert fit_first(given) == []
    assert given.opened[0].fits == {}
    assert not given.described()["begins_with_fits"]


def test_what_models_do_not_describe_is_not_fitted(monkeypatch):
    given = session(through())
    assert not given.described()["sets"][0]["fittable"]
    assert fit_first(given) == []
    assert given.opened[0].fits == {}
    monkeypatch.setattr("gonio.viewing.columns.columns_of.__defaults__", (20,))
    assert not Opened("long", scan_of()).fittable


def test_a_fit_that_is_refused_is_told(monkeypatch, tmp_path):
    def refused(*_, **__):
        raise ValueError("no value is positive")

    monkeypatch.setattr(beginning, "fit", refused)
    given = session()
    assert fit_first(given) == [
        "a.csv: phong was not fitted, so that the page begins at its defaults: no value is positive"
    ]
    with pytest.warns(UserWarning, match="phong was not fitted"):
        gonio.view(scan_of(), model="phong", out=tmp_path / "page.html")


def test_python_fits_first(tmp_path):
    page = gonio.view(scan_of(), model="phong", out=tmp_path / "page.html")
    assert page.session.opened[0].fits["fit"].values["n"] == pytest.approx(57, rel=0.05)
    given = gonio.view(scan_of(), model="phong", values={"n": 9.0}, out=tmp_path / "given.html")
    assert given.session.opened[0].fits == {}


def at(client):
    return f"http://127.0.0.1:{client.port}/"


@pytest.fixture
def held(monkeypatch):
    """A fit that waits until it is let go; says whether it began."""
    begun, go = threading.Event(), threading.Event()
    real = fitting.fit_one

    def waiting(*arguments, **options):
        begun.set()
        assert go.wait(20)
        return real(*arguments, **options)

    monkeypatch.setattr(fitting, "fit_one", waiting)
    yield begun, go
    go.set()


@pytest.mark.xdist_group("viewer")
class TestPage:
    """In a browser."""

    def test_the_page_fits_by_itself(self, chromium):
        given = session()
        with served(given) as client, opened(chromium, f"{at(client)}?token=token-of-tests") as page:
            page.wait_for_selector(READY)
            until(page, FITTED)
            values = page.evaluate("gonio.store.get().values.map((own) => own[0])")
            solution = given.opened[0].fits["phong"]
            assert values == [solution.values[name] for name in ("ks", "kd", "n")]
            assert "E " in page.inner_text("section.fit [role=status]")
            assert page.inner_text("#panel .model option:checked") == "fit: phong"

    @pytest.mark.parametrize(
        ("done", "then"),
        [
            ("gonio.actions.move(2, 33)", "gonio.store.get().values[2][0] === 33"),
            ("gonio.actions.chooseModel('model', 'lambert')", "gonio.store.get().model.declaration.name === 'lambert'"),
            ("gonio.actions.lock(2)", "gonio.store.get().locked.has(2)"),
            (
                "location.hash = '#s=' + btoa(JSON.stringify({v: 1, values: {n: [33]}}))",
                "gonio.store.get().values[2][0] === 33",
            ),
        ],
    )
    def test_what_the_user_does_comes_first(self, chromium, held, done, then):
        begun, go = held
        with served(session()) as client, opened(chromium, f"{at(client)}?token=token-of-tests") as page:
            page.wait_for_selector(READY)
            until(page, "Boolean(gonio.store.get().job?.number)")
            assert begun.wait(20)
            assert page.is_visible("#top .job")
            page.evaluate(done)
            until(page, "!gonio.store.get().job")
            go.set()
            assert "gave way" in page.inner_text("section.fit [role=status]")
            assert page.evaluate("[gonio.store.get().fit, gonio.store.get().fitName]") == [None, ""]
            assert page.evaluate(then)

    def test_a_fit_that_another_page_makes_is_no_error(self, chromium, held):
        begun, _ = held
        with served(session()) as client:
            address = f"{at(client)}?token=token-of-tests"
            with opened(chromium, address) as page, opened(chromium, address, color_scheme="light") as other:
                page.wait_for_selector(READY)
                assert begun.wait(20)
                other.reload()
                status = "document.querySelector('section.fit [role=status]').textContent"
                until(other, f"{status}.startsWith('a fit of this scan is running')")
                assert other.inner_text("section.fit [role=alert]") == ""

    def test_what_is_shown_stays_when_the_fit_ends(self, chromium, held):
        _, go = held
        with served(session()) as client, opened(chromium, f"{at(client)}?token=token-of-tests") as page:
            page.wait_for_selector(READY)
            until(page, "Boolean(gonio.store.get().job?.number)")
            page.evaluate("gonio.store.set({ hidden: new Set([0]), cell: 1, cursor: { cell: 1, row: 30 } })")
            go.set()
            until(page, FITTED)
            state = "[[...gonio.store.get().hidden], gonio.store.get().cell, gonio.store.get().cursor.row]"
            assert page.evaluate(state) == [[0], 1, 30]

    @pytest.mark.parametrize("what", ["values", "state", "link", "through"])
    def test_nothing_is_fitted_where_something_else_is_named(self, chromium, monkeypatch, what):
        asked = []
        monkeypatch.setattr(jobs, "_one", lambda *_: asked.append(1))
        named = {"values": {"values": {"n": 20.0}}, "state": {"state": {"v": 1, "scale": "log"}}}.get(what, {})
        given = session(through() if what == "through" else None, **named)
        link = "#s=" + "eyJ2IjoxfQ" if what == "link" else ""
        with served(given) as client, opened(chromium, f"{at(client)}?token=token-of-tests{link}") as page:
            page.wait_for_selector(READY)
            page.wait_for_timeout(150)
            assert page.evaluate("gonio.store.get().job") is None
            assert asked == []

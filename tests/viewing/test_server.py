"""Who may ask the server of a page, and what it answers; over a real socket, without a browser."""

import base64
import json
import math
import socket
import time

import numpy as np
import pytest

import gonio
from asking import TOKEN, Client, served
from gonio.exporting.registry import targets
from gonio.viewing.session import Opened, Session

GGX = {"rho_s": [0.5], "width": [0.3], "index": [1.5], "extinction": [0.0]}


def scan_of(noise=0.01, seed=1):
    values = {"kd": 0.1, "ks": 0.5, "n": 20.0}
    return gonio.simulate(
        gonio.catalogue["phong"], values, [20.0, 50.0], np.arange(-70, 71, 5.0), noise=noise, seed=seed
    )


def started(model="lambert", **changed):
    """What a page sends of a model with its defaults."""
    one = gonio.catalogue[model]
    values = {name: [0.3 if name in one.weights else one.shape[name].default] for name in one.parameters}
    return {"set": 0, "model": model, "values": values} | changed


@pytest.fixture(scope="module")
def session():
    return Session([Opened("a.csv", scan_of()), Opened("b.csv", scan_of(seed=2))])


@pytest.fixture(scope="module")
def client(session):
    with served(session) as asking:
        yield asking


def test_localhost_is_the_same_server(client):
    other = Client(f"http://localhost:{client.port}/?token={TOKEN}")
    assert other.ask("GET", "/api/session").status == 200
    assert other.ask("POST", "/api/evaluate", started()).status == 200
    assert other.cookie.startswith(f"gonio-{client.port}=")


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1.evil.example", "", "localhost:1"])
def test_a_foreign_name_is_misdirected(client, host):
    with socket.create_connection((client.host, client.port)) as raw:
        raw.sendall(f"GET /api/session HTTP/1.0\r\nHost: {host}\r\nCookie: {client.cookie}\r\n\r\n".encode())
        assert raw.recv(100).split()[1] == b"421"


@pytest.mark.parametrize(
    ("method", "path", "body"),
    [
        ("GET", "/api/session", None),
        ("GET", "/api/set/0.bin", None),
        ("GET", "/api/model/ggx.js", None),
        ("GET", "/page/app.js", None),
        ("GET", "/", None),
        ("POST", "/api/fit", {}),
        ("POST", "/api/upload", b"x"),
        ("DELETE", "/api/job/1", None),
        ("GET", "/api/job/1", None),
        ("POST", "/api/export/figure", {}),
    ],
)
def test_nothing_without_the_token(client, method, path, body):
    assert client.ask(method, path, body, Cookie="").status == 403
    assert client.ask(method, path, body, Cookie=f"gonio-{client.port}=wrong").status == 403


def test_a_wrong_token_enters_nowhere(client):
    assert client.ask("GET", "/?token=wrong", Cookie="").status == 403


@pytest.mark.parametrize("origin", ["http://evil.example", "null", "", "https://127.0.0.1"])
def test_a_foreign_origin_changes_nothing(client, origin):
    assert client.ask("POST", "/api/evaluate", started(), Origin=origin).status == 403
    assert client.ask("DELETE", "/api/job/1", Origin=origin).status == 403


@pytest.mark.parametrize("kind", ["application/x-www-form-urlencoded", "multipart/form-data", "text/plain"])
def test_a_form_is_refused(client, kind):
    assert client.ask("POST", "/api/evaluate", started(), Content_Type=kind).status == 415


@pytest.mark.parametrize(
    "path",
    ["/page/../session.py", "/page/%2e%2e/session.py", "/api/model/..%2f..%2fggx.js", "/api/model/../secret.js",
     "/api/model//etc/passwd.js", "/api/set/7.bin", "/api/job/99", "/api/pair/0/9", "/etc/passwd"],
)  # fmt: skip
def test_no_path_leads_anywhere(client, path):
    assert client.ask("GET", path).status == 404


def test_the_answers_hold_no_door_open(client):
    headers = client.ask("GET", "/").headers
    assert "default-src 'none'" in headers["content-security-policy"]
    assert headers["x-content-type-options"] == "nosniff"
    assert not [name for name in headers if name.startswith("access-control")]


@pytest.mark.parametrize(
    ("body", "status", "word"),
    [
        (b"[1]", 400, "no object"),
        (b"{", 400, "no JSON"),
        (b'{"a": NaN}', 400, "finite"),
        (b"[" * 100_000, 400, "no JSON"),
        (b'{"a": "' + b"x" * 1_000_000 + b'"}', 413, "1 MB"),
    ],
)
def test_a_body_is_json_of_a_megabyte(client, body, status, word):
    answer = client.ask("POST", "/api/evaluate", body, Content_Type="application/json")
    assert answer.status == status
    assert word in answer.json["error"]


@pytest.mark.parametrize(
    ("changed", "word"),
    [
        ({"set": 2}, "set"),
        ({"set": -1}, "set"),
        ({"set": 0.5}, "set"),
        ({"set": True}, "set"),
        ({"model": "../ggx"}, "nearest"),
        ({"model": 5}, "no model"),
        ({"values": []}, "values"),
        ({"values": {"kd": [0.3]}}, "has no parameter"),
        ({"values": {"rho": [-1.0]}}, "bounds"),
        ({"values": {"rho": [1e999]}}, "finite"),
        ({"values": {"rho": ["1"]}}, "finite"),
        ({"values": {"rho": [0.1, 0.2]}}, "1 value"),
        ({"values": {}}, "1 value"),
        ({"fit": "none"}, "fits"),
        ({"block": 1}, "block"),
    ],
)
def test_values_are_checked(client, changed, word):
    body = json.dumps(started() | changed).replace("Infinity", "1e999").encode()
    answer = client.ask("POST", "/api/evaluate", body, Content_Type="application/json")
    assert answer.status in (400, 422)
    assert word in answer.json["error"]


def test_the_reflectance_of_a_lambertian_surface(client):
    found = client.ask("POST", "/api/evaluate", started(values={"rho": [0.3]})).json
    assert [angle for angle, _ in found["reflectances"]] == [20.0, 50.0]
    for _, value in found["reflectances"]:
        assert math.isclose(value, 0.3, rel_tol=1e-6)  # the quadrature of a constant
    assert found["reciprocal"]
    assert found["positive"]
    assert found["conserves_energy"]


def test_a_surface_that_reflects_too_much_is_said(client):
    found = client.ask("POST", "/api/evaluate", started(values={"rho": [1.5]})).json
    assert found["conserves_energy"] is False


def test_relative_data_say_nothing_about_energy():
    scan = scan_of()
    scan["brdf"].attrs["units"] = "a.u."
    with served(Session([Opened("a.csv", scan)])) as asking:
        found = asking.ask("POST", "/api/evaluate", started()).json
    assert found["relative"]
    assert found["reflectances"] == []
    assert found["conserves_energy"] is None


def test_a_fit_is_added_to_the_session(client, session):
    body = started("phong", locked=["n"], values={"kd": [0.1], "ks": [0.4], "n": [20.0]})
    number = client.ask("POST", "/api/fit", body).json["job"]
    *_, last = client.events(number)
    record = last["done"]["record"]
    name = last["done"]["name"]
    held = {p["name"]: p["held"] for p in record["parameters"]}
    assert held == {"kd": False, "ks": False, "n": True}
    assert record["cost"] < 1e-2  # of one per cent noise
    assert name in session.opened[0].fits
    assert client.ask("GET", "/api/session").json["sets"][0]["fits"][name] == record
    again = client.ask("POST", "/api/fit", body | {"fit": name, "values": values_of(record), "locked": []}).json["job"]
    *_, last = client.events(again)
    assert last["done"]["name"] == "phong 2"


def test_what_is_held_by_default_is_held_unless_the_page_frees_it(client):
    """The page begins with the half width of gonio-best's diffuse lobe locked."""
    model = gonio.catalogue["gonio-best"]
    values = {name: [0.1] for name in model.weights} | {name: [p.default] for name, p in model.shape.items()}
    for locked in (["gamma"], []):
        body = started("gonio-best", locked=locked, values=values)
        *_, last = client.events(client.ask("POST", "/api/fit", body).json["job"])
        held = {p["name"]: p["held"] for p in last["done"]["record"]["parameters"]}
        assert held["gamma"] == bool(locked)
        assert not held["width"]


def values_of(record):
    return {p["name"]: p["values"] for p in record["parameters"]}


def test_the_values_of_the_page_are_a_start():
    """A search from where the sliders are finds what its own starts may miss, and never worse."""
    from gonio.fitting.objective.problem import Problem
    from gonio.fitting.search.projection import Projection
    from gonio.viewing.working.fitting import FromHere

    scan = scan_of(noise=0.0)
    problem = Problem(gonio.catalogue["phong"], scan)
    poor = Projection(grid=1, searches=1, max_steps=10, rounds=0)
    start = {"kd": {"": 0.1}, "ks": {"": 0.5}, "n": {"": 20.0}}
    found = FromHere(start).search(problem)
    assert found.cost <= poor.search(problem).cost
    assert found.cost < 1e-20  # the values that the scan was simulated with
    assert FromHere({}).search(problem).cost < 1e-20


def test_one_fit_of_a_scan_at_a_time_and_cancel(session):
    with served(session, processes=True) as asking:
        slow = {"set": 0, "model": "best"}
        number = asking.ask("POST", "/api/fit", slow).json["job"]
        second = asking.ask("POST", "/api/fit", slow)
        assert second.status == 409
        assert "running" in second.json["error"]
        begun = time.monotonic()
        assert asking.ask("DELETE", f"/api/job/{number}").json == {"cancelled": True}
        assert asking.events(number)[-1] == {"cancelled": True}
        assert time.monotonic() - begun < 2
        assert asking.ask("POST", "/api/fit", slow).status == 202  # at once: the scan is free


def test_a_fit_that_cannot_be_is_a_message(client):
    answer = client.ask("POST", "/api/fit", started(locked=["rho"]))
    assert answer.status == 422
    assert "held" in answer.json["error"]
    assert client.ask("POST", "/api/fit", started(weighting="none")).status == 422
    assert client.ask("POST", "/api/fit", started(locked=["kd"])).status == 422


def test_two_scans_at_the_directions_of_the_first(client):
    found = client.ask("GET", "/api/pair/0/1").json
    assert found["missing"] == 0
    assert all(found["exact"])
    assert 0.0 < found["rms"] < 0.1  # one per cent of noise in each


def test_scans_of_different_units_are_a_message(session):
    relative = scan_of()
    relative["brdf"].attrs["units"] = "a.u."
    with served(Session([session.opened[0], Opened("r.csv", relative)])) as asking:
        answer = asking.ask("GET", "/api/pair/0/1")
    assert answer.status == 422
    assert "relative" in answer.json["error"]


def test_the_values_are_written_for_other_programs(client):
    listed = {target["name"] for target in client.ask("GET", "/api/targets").json}
    assert listed == set(targets())
    found = client.ask("POST", "/api/export/target", started(target="glsl")).json
    (name,) = found["files"]
    assert name == "a-lambert.glsl"
    assert b"lambert" in base64.b64decode(found["files"][name])
    assert client.ask("POST", "/api/export/target", started(target="../x")).status == 422


def test_relative_values_are_written_by_a_scale():
    scan = scan_of()
    scan["brdf"].attrs["units"] = "a.u."
    with served(Session([Opened("a.csv", scan)])) as asking:
        refused = asking.ask("POST", "/api/export/target", started(target="glsl"))
        assert refused.status == 422
        assert "scale" in refused.json["error"]
        assert asking.ask("POST", "/api/export/target", started(target="glsl", scale=0.5)).status == 200
        assert asking.ask("POST", "/api/export/target", started(target="glsl", scale=-1)).status == 422


def test_a_figure_is_written_beside_and_nothing_is_replaced(client, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    there = tmp_path / "results" / "figures" / "a-curves.svg"
    there.parent.mkdir(parents=True)
    there.write_text("mine")
    body = started("phong", format="svg", cells=[0, 1], scale="log")
    assert client.ask("POST", "/api/export/figure", body).json == {"written": "results/figures/a-curves-2.svg"}
    assert there.read_text() == "mine"
    assert "<svg" in there.with_name("a-curves-2.svg").read_text()
    assert client.ask("POST", "/api/export/figure", started(format="exe", cells=[0])).status == 422
    assert client.ask("POST", "/api/export/figure", started(format="svg", cells=[])).status == 422

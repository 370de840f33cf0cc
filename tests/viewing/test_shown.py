"""How the page words what it shows, by its modules under Node: exposure, and what `gonio check` warns of."""

import json

import numpy as np
import pytest

from asking import served
from gonio import catalogue, simulate
from gonio.viewing.assembled import in_one_file
from gonio.viewing.session import Opened, Session
from viewed import by_node

ANGLES = np.arange(-60.0, 61, 10)


def scan_of(rho=0.3):
    return simulate(catalogue["lambert"], {"rho": rho}, [0.0, 40.0], ANGLES, noise=0.01, seed=1)


@pytest.mark.parametrize(
    ("found", "stops", "clipped"),
    [
        ([0.9, 0.5, 0.1], 0, False),
        ([0.02, 0.01, 0.005], 5, False),  # black paint: 0.64 of white
        ([4.0, 2.0, 1.0], -3, False),
        ([1000.0, 1e-3, 1e-3], 4, True),  # a mirror on black: its highlight is clipped, so that the rest is seen
        ([1e-9], 12, False),
        ([], 0, False),
    ],
)
def test_exposure_is_whole_stops_below_white(found, stops, clipped, tmp_path):
    script = f"""
    const {{ stopsFor }} = await import("gonio/exposure.js");
    answer(stopsFor({json.dumps(found)}));
    """
    session = Session([Opened("a", scan_of())], model="lambert")
    assert by_node(session, script, tmp_path) == {"stops": stops, "isClipped": clipped}


def test_brightness_is_that_of_a_lit_sphere(tmp_path):
    """A white diffuser sends back 1 where the light falls straight, and nothing is brighter."""
    session = Session([Opened("a", scan_of())], model="lambert", values={"rho": 1.0})
    script = """
    const { actions, state } = await opened();
    const { brightness } = await import("gonio/exposure.js");
    await actions.chooseModel("model", "lambert");
    answer(brightness(state, 0, [0, 0, 1]));
    """
    found = by_node(session, script, tmp_path)
    assert max(found) == pytest.approx(1.0)
    assert len(found) > 50


def test_findings_are_asked_for_and_stand_in_a_file():
    """Of one incidence angle alone `gonio check` warns; the session itself does not wait for it."""
    one = simulate(catalogue["lambert"], {"rho": 0.3}, [30.0], ANGLES, noise=0.01, seed=1)
    session = Session([Opened("a", one)], model="lambert")
    assert "findings" not in session.described()["sets"][0]
    with served(session) as client:
        answer = client.ask("GET", "/api/set/0/findings").json
        assert client.ask("GET", "/api/set/1/findings").status == 404
    assert [finding["severity"] for finding in answer] == ["warning"]
    assert "one incidence angle only" in answer[0]["text"]
    page = in_one_file(session, ["lambert"])
    held = json.loads(page.split('id="gonio-held">', 1)[1].split("</script>", 1)[0])
    assert held["session"]["sets"][0]["findings"] == answer

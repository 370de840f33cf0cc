"""The widget as JupyterLab showed it (tests/crosscheck/jupyterlab_peer.py, part of `make crosscheck`)."""

import json
from pathlib import Path

import pytest

PEER = Path(__file__).parent / "reference" / "peers" / "jupyterlab.json"


def test_the_widget_in_jupyterlab_did_what_it_promises():
    kept = json.loads(PEER.read_text(encoding="utf-8"))
    found = kept["surfaces"]
    assert kept["columns"] == {"errors": []}
    assert found["sliders"] == 5  # parameters of ggx
    assert found["set from Python"] == 0.25
    assert found["moved on the page"] == 0.4
    assert found["changes that Python saw"] >= 2
    assert found["fitted by the kernel"] == found["values after the fit"]
    assert found["fitted by the kernel"] == pytest.approx(0.22, abs=0.01)  # of the sample, which was made with it
    assert found["frames left"] == 0
    assert found["style of the page on the notebook"] is False

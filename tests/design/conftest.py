import json

import pytest

from places import ROOT


@pytest.fixture(scope="session")
def record():
    """What `make designs` measured."""
    return json.loads((ROOT / "benchmarks" / "designs.json").read_text(encoding="utf-8"))

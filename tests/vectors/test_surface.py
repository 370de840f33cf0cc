"""The list of every printed vector of surface.md: each is held by a test that is there and has its digits."""

import math
import re
from pathlib import Path

import pytest
import yaml

from places import ROOT

LIST = yaml.safe_load(Path(__file__).with_name("surface.yaml").read_text(encoding="utf-8"))
DATA = (".py", ".toml", ".yaml", ".json")
NUMBER = re.compile(r"(?<![\w.])\d*\.?\d+(?:e-?\d+)?(?![\w.])")


def numbers_of(folder: Path) -> set[float]:
    """Every number that stands in the files of a folder of tests."""
    texts = (path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix in DATA)
    return {float(found.replace("_", "")) for text in texts for found in NUMBER.findall(text)}


@pytest.mark.parametrize("entry", LIST, ids=lambda entry: entry["section"])
def test_a_printed_vector_is_held_by_a_test(entry):
    file, test = entry["held_by"].split("::")
    path = ROOT / "tests" / file
    assert re.search(rf"^def {test}\(", path.read_text(encoding="utf-8"), re.MULTILINE)
    here = numbers_of(path.parent)
    assert [n for n in entry["numbers"] if not any(math.isclose(n, one, rel_tol=1e-12) for one in here)] == []

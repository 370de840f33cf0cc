"""What a laboratory says of a measurement: keys that do not exist are refused by line, with the nearest names."""

import json
from pathlib import Path

import pytest

from gonio.files import FormatError
from gonio.reporting import bird
from gonio.reporting.about import checked, further, over, read_about, stated
from gonio.reporting.bird import Item
from places import FILES

ASKED = (*bird.IDENTIFICATION, *bird.SAMPLE, *bird.INSTRUMENT, *bird.METHOD, *bird.ENVIRONMENT)


def written(folder: Path, text: str) -> Path:
    path = folder / "about.yml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("sample:\n  nmae: x\n", r"line 2: sample has no key 'nmae'; nearest: name"),
        ("Sample: {name: x}\n", r"line 1: there is no key 'Sample'; did you mean sample\?"),
        ("sample:\n  name: x\n  name: y\n", r"line 3: the key name occurs twice"),
        ("sample:\n  name: {a: b}\n", r"line 2: sample.name has no keys below it"),
        ("sample:\n  materials:\n  - nam: x\n", r"line 3: sample.materials has no key 'nam'"),
        ("- a\n- b\n", r"holds no keys"),
        ("# nothing\n", r"holds no keys"),
        ("a: &x [b]\nc: *x\n", r"YAML alias"),
        ("a: [", r"no valid YAML"),
        ("sample: {name: " + "[" * 60 + "]" * 60 + "}", r"nested more than 20 deep"),
        ("[a]: b\n", r"there is no key '\?'"),
    ],
)
def test_what_is_wrong_is_one_line(tmp_path, text, words):
    with pytest.raises(FormatError, match=words) as refused:
        read_about(written(tmp_path, text))
    assert "\n" not in str(refused.value)


def test_a_control_character_in_a_key_is_escaped(tmp_path):
    with pytest.raises(FormatError) as refused:
        read_about(written(tmp_path, '"a\\e[31m": b\n'))
    assert str(refused.value).isprintable()


def test_values_are_as_they_stand(tmp_path):
    about = read_about(written(tmp_path, "timestamp: 2025-01-02\nsample: {model: 0.10, name: no, comments: null}\n"))
    assert about == {"timestamp": "2025-01-02", "sample": {"model": "0.10", "name": "no", "comments": ""}}


def test_anything_goes_below_an_adhoc_section():
    about = checked({"sample": {"adhoc_section": {"storage": "dry", "rack": {"level": 7}}}})
    assert stated(about, Item("storage", ("sample.adhoc_section.storage",))) == "dry"
    assert list(further(about, ASKED)) == [("sample.adhoc_section.rack.level", "7")]


def test_the_example_of_the_format_has_no_strange_key():
    path = FILES / "bird" / "example.brdf"
    if not path.exists():
        pytest.skip(f"no file {path}")
    about = checked(json.loads(path.read_text(encoding="utf-8"))["metadata"])
    words = {item.label: stated(about, item) for item in ASKED}
    assert words["organisation"] == "Aalto University"
    assert words["bandwidth"] == "5 nm"
    said = {key for key, _ in further(about, ASKED)}
    assert "provenance.website" in said
    assert not any(key in said for item in ASKED for key in item.keys)


def test_the_keys_are_those_of_the_schema():
    folder = FILES / "bird" / "schema"
    if not folder.is_dir():
        pytest.skip(f"no schema at {folder}")
    parts = {
        "provenance": bird.KEYS["provenance"],
        "sample": bird.KEYS["sample"],
        "environment": bird.KEYS["environment"],
    }
    parts |= {"instrumentation": bird.KEYS["instrumentation"], "metadata": bird.KEYS, "license": bird.KEYS["license"]}
    for name, keys in parts.items():
        properties = json.loads((folder / f"{name}_json_schema_v1.0.json").read_text(encoding="utf-8"))["properties"]
        assert set(keys) == set(properties), name


def test_a_laboratory_comes_before_the_file():
    both = over({"sample": {"name": "a"}}, {"sample": {"name": "b", "model": "c"}, "id": "d"})
    assert both == {"sample": {"name": "a", "model": "c"}, "id": "d"}


def test_unknown_says_nothing():
    assert stated({"sample": {"name": "unknown"}}, Item("name", ("sample.name",))) == ""


def test_every_item_has_keys_that_exist():
    for item in ASKED:
        for path in item.keys:
            keys = bird.KEYS
            for step in path.split("."):
                assert step in keys, path
                if step == bird.ANYTHING:
                    break
                keys = keys[step]

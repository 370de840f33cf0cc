"""What a laboratory says of a measurement in a file: read, checked for keys that do not exist, and looked up."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import yaml

from gonio.door.text import clip, whole
from gonio.door.yaml_text import composed, line_of
from gonio.files import FormatError
from gonio.outside import nearest, printable
from gonio.reporting.bird import ANYTHING, KEYS, QUANTITY, RANGE, TEXT, Item

LARGEST = 1_000_000  # bytes
DEEPEST = 20
KIND = "description of a measurement"
About = Mapping[str, Any]  # texts, lists and mappings, by the names of bird.KEYS
UNKNOWN = ("", "unknown", "NA", "unknown@unknown.invalid")  # what says that nothing is known


def read_about(path: Path) -> About:
    """The content of a YAML or JSON file, every value as the text that stands there.

    Raises FormatError with the line for what is no YAML, a key that BiRD does not have, or one that occurs twice.
    """
    node = composed(path, whole(path, LARGEST), KIND)
    if not isinstance(node, yaml.MappingNode):
        raise FormatError(path, "holds no keys: write such as `sample: {name: SRT1}`", line_of(node) if node else "")
    return _mapping(path, node, KEYS, "")


def _mapping(path: Path, node: yaml.MappingNode, allowed: Mapping[str, Any], above: str) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key, value in node.value:
        name = str(key.value) if isinstance(key, yaml.ScalarNode) else "?"
        if wrong := _wrong(name, allowed, above):
            raise FormatError(path, wrong, line_of(key))
        if name in out:
            raise FormatError(path, f"the key {clip(name)} occurs twice: keep one", line_of(key))
        out[name] = _value(path, value, allowed.get(name, TEXT), f"{above}{name}.")
    return out


def _value(path: Path, node: yaml.Node, allowed: Mapping[str, Any], above: str) -> Any:
    if isinstance(node, yaml.MappingNode):
        return _mapping(path, node, allowed, above)
    if isinstance(node, yaml.SequenceNode):
        return [_value(path, one, allowed, above) for one in node.value]
    return "" if node.tag.endswith(":null") else str(node.value)


def _wrong(name: str, allowed: Mapping[str, Any], above: str) -> str:
    """What is wrong with a key in one line; empty where nothing is."""
    if name in allowed or ANYTHING in above.split("."):
        return ""
    section = f"{above.rstrip('.')} has" if above else "there is"
    if not allowed:
        return f"{section} no keys below it, and {clip(name)!r} stands there: give a text"
    return f"{section} no key {clip(name)!r}; {nearest(name, allowed)}; what BiRD has no key for goes under {ANYTHING}"


def checked(about: About) -> About:
    """A mapping from Python, every value as text; ValueError for a key that BiRD does not have."""
    return _checked(about, KEYS, "")


def _checked(value: Any, allowed: Mapping[str, Any], above: str) -> Any:
    if above.count(".") > DEEPEST:
        raise ValueError(f"about: is nested more than {DEEPEST} deep: this is no {KIND}")
    if isinstance(value, Mapping):
        for name in value:
            if wrong := _wrong(str(name), allowed, above):
                raise ValueError(f"about: {wrong}")
        return {str(n): _checked(one, allowed.get(str(n), TEXT), f"{above}{n}.") for n, one in value.items()}
    if isinstance(value, list | tuple):
        return [_checked(one, allowed, above) for one in value]
    return "" if value is None else str(value)


def over(first: About, second: About) -> About:
    """Two descriptions as one: what the first says comes before what the second says under the same key."""
    out = dict(second)
    for name, value in first.items():
        below = out.get(name)
        out[name] = over(value, below) if isinstance(value, Mapping) and isinstance(below, Mapping) else value
    return out


def stated(about: About, item: Item) -> str:
    """What is said of an item, in words; empty where nothing is."""
    found = [text for key in item.keys for value in _under(about, key.split(".")) for text in _words(value) if text]
    return "; ".join(dict.fromkeys(found))


def _under(value: Any, steps: Sequence[str]) -> Iterator[Any]:
    """All values under a path of keys; a list on the way has one for each of its parts."""
    if isinstance(value, list):
        for one in value:
            yield from _under(one, steps)
    elif not steps:
        yield value
    elif isinstance(value, Mapping) and steps[0] in value:
        yield from _under(value[steps[0]], steps[1:])


def _words(value: Any) -> Iterator[str]:
    """A value as sentences without keys where these say nothing: a quantity with its unit, else `name: value`."""
    if isinstance(value, list):
        for one in value:
            yield from _words(one)
    elif isinstance(value, Mapping):
        if "value" in value and set(value) <= set(QUANTITY):
            yield _quantity(value)
        elif "min_value" in value and set(value) <= set(RANGE):
            yield f"{value['min_value']} to {value.get('max_value', '?')} {value.get('unit', '')}".strip()
        else:
            yield ", ".join(_named(name, one) for name, one in value.items() if any(_words(one)))
    elif str(value) not in UNKNOWN:
        yield printable(str(value))


def _named(name: str, value: Any) -> str:
    words = "; ".join(text for text in _words(value) if text)
    return words if name == "name" else f"{name.replace('_', ' ')} {words}"


def _quantity(value: Mapping[str, Any]) -> str:
    unit = f" {value['unit']}" if value.get("unit") else ""
    stated_u = value.get("uncertainty")
    of_u = value.get("uncertainty_unit", value.get("unit", ""))
    return f"{value['value']}{unit}" + (f" (uncertainty {stated_u} {of_u}".rstrip() + ")" if stated_u else "")


def further(about: About, asked: Sequence[Item]) -> Iterator[tuple[str, str]]:
    """Whatever is said and no item asks for: its keys with dots, and its value in words."""
    keys = [key for item in asked for key in item.keys]
    waiting: list[tuple[str, Any]] = [("", about)]
    while waiting:
        name, value = waiting.pop()
        if name in keys or name == "schema":
            continue
        if isinstance(value, Mapping) and not ("value" in value or "min_value" in value):
            waiting += [(f"{name}.{k}".lstrip("."), one) for k, one in reversed(list(value.items()))]
        elif isinstance(value, list) and any(isinstance(one, Mapping) for one in value):
            waiting += [(name, one) for one in reversed(value)]
        elif text := "; ".join(text for text in _words(value) if text):
            yield name, text

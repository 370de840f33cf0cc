"""How the values of a peer are kept: JSON, one line a column, rewritten only where a number or a version changed."""

import datetime
import json
from pathlib import Path

FOLDER = Path(__file__).parents[1] / "reference" / "peers"


def write(name, about, columns, surfaces):
    """Write `name` with what it is `about`, its `columns` of numbers and the peer's parameters of its `surfaces`."""
    path = FOLDER / name
    kept = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    found = json.loads(json.dumps({"about": about, "surfaces": surfaces, "columns": columns}))
    dated = kept.get("about", {}).pop("date", None)
    if kept == found:
        print(f"{path}: as it was on {dated}")
        return
    about = about | {"date": datetime.date.today().isoformat()}
    rows = [_member(k, v) for k, v in columns.items()]
    rules = [_member(k, v, spaced=True) for k, v in surfaces.items()]
    text = (
        f'{{\n"about": {json.dumps(about, indent=1)},\n'
        + '"surfaces": {\n' + ",\n".join(rules) + "\n},\n"
        + '"columns": {\n' + ",\n".join(rows) + "\n}\n}\n"
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    print(f"{path}: {len(text) / 1000:.0f} kB written")


def _member(name, value, spaced=False):
    return f"{json.dumps(name)}: {json.dumps(value, separators=None if spaced else (',', ':'))}"

"""The modules of the page run by Node: the same state and actions, without a browser."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from gonio.exporting.targets import javascript
from gonio.viewing.assembled import in_one_file, parts
from gonio.viewing.described import module
from gonio.viewing.session import Session

# What a browser has and Node has not, as far as the modules ask for it before anything is drawn.
STANDING_IN = """
globalThis.document = { getElementById: (id) => (id === "gonio-held" ? { textContent: held } : null), hidden: true };
globalThis.matchMedia = () => ({ matches: false, addEventListener() {} });
globalThis.window = globalThis;
"""


def by_node(session: Session, script: str, folder: Path) -> Any:
    """What the script hands to `answer`, with the page's modules as "gonio/NAME.js" and all models of the session.

    The script has `opened()`: the store, the actions and the state of a page that shows the session.
    """
    if not (program := javascript.node()):
        pytest.skip("no Node is here")
    modules = {f"gonio/{name}": text for name, text in parts().items() if name.endswith(".js")}
    modules |= {f"model/{name}.js": module(model) for name, model in session.models.items()}
    for name, text in modules.items():
        path = folder / "node_modules" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        # What draws needs a browser when it is loaded; nothing here draws.
        path.write_text("export default {};" if "/vendor/" in name else text, encoding="utf-8")
    for package in ("gonio", "model"):
        (folder / "node_modules" / package / "package.json").write_text('{"type": "module"}')
    page = in_one_file(session, session.needed())
    held = page.split('id="gonio-held">', 1)[1].split("</script>", 1)[0]
    (folder / "all.mjs").write_text(
        f"const held = {json.dumps(held)};\n{STANDING_IN}\n"
        'const { opened } = await import("./opened.mjs");\n'
        "const word = (_, v) =>\n"
        "  ArrayBuffer.isView(v) ? [...v] : Object.is(v, +v) && !Number.isFinite(v) ? `${v}` : v;\n"
        "const answer = (found) => console.log(JSON.stringify(found, word));\n" + script
    )
    (folder / "opened.mjs").write_text(OPENED)
    done = subprocess.run([program, str(folder / "all.mjs")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


# As app.js begins, without views.
OPENED = """
import { actionsOf, fetched } from "gonio/actions.js";
import * as source from "gonio/source.js";
import { createStore } from "gonio/state.js";

export async function opened() {
  const session = await source.session();
  const first = { sets: session.sets, models: session.models, first: session.model, given: session.values };
  const none = { set: 0, block: 0, cell: 0, hidden: new Set(), locked: new Set(), model: null, values: [], groups: [] };
  const store = createStore({ ...first, ...none, beginWithModel: session.begin_with_model, fit: null, band: true });
  const state = store.get();
  for (let k = 0; k < state.sets.length; k++) await fetched(state, k);
  return { store, state, actions: actionsOf(store) };
}
"""


def complaints(tab: Any) -> list[str]:
    """What a tab writes to its console from now on, but for what software graphics say of their own speed."""
    wrong: list[str] = []
    tab.on("console", lambda message: None if "GL Driver Message" in message.text else wrong.append(message.text))
    tab.on("pageerror", lambda error: wrong.append(str(error)))
    return wrong


@contextmanager
def served(*arguments: str | Path) -> Iterator[str]:
    """The address that `gonio view` prints; the program ends with the block."""
    command = [sys.executable, "-m", "gonio", "view", *map(str, arguments), "--no-browser"]
    started = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env={**os.environ, "PYTHONUNBUFFERED": "1"})
    try:
        assert started.stdout is not None
        yield started.stdout.readline().strip()
    finally:
        started.terminate()
        started.wait(timeout=30)
        started.stdout.close()

"""The widget in JupyterLab: shown, moved from the page and from Python, fitted by the kernel, and taken away again.

    python tests/crosscheck/jupyterlab_peer.py PYTHON     writes tests/reference/peers/jupyterlab.json

PYTHON is an interpreter with gonio, anywidget and ipykernel, which runs the kernel; this one has JupyterLab, anywidget
and Playwright, and knows nothing of gonio. Needs Chromium on the PATH.
"""

import json
import os
import platform
import shutil
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path

import peers
from playwright.sync_api import sync_playwright

TOKEN = "of-this-test"
SHOW = """import gonio
scan = gonio.sample("coating")
w = gonio.view(scan, gonio.fit(scan, "ggx", held={"index": 1.5, "extinction": 0.0}))
seen = []
w.observe(lambda change: seen.append(dict(change["new"])), "values")
w"""
SET = 'w.values = {"width": 0.25}'
ASK = """import json
print("answer", json.dumps({"values": dict(w.values), "seen": len(seen), "model": w.model.name,
    "solution": w.solution.values}))"""


@contextmanager
def lab(python, folder):
    """The address of a server whose kernel is run by `python`."""
    spec = folder / "data" / "kernels" / "gonio"
    spec.mkdir(parents=True)
    command = [python, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    (spec / "kernel.json").write_text(json.dumps({"argv": command, "display_name": "gonio", "language": "python"}))
    (folder / "work").mkdir()
    bare = {"cell_type": "code", "metadata": {}, "outputs": [], "execution_count": None}
    cells = [{**bare, "id": f"c{k}", "source": source} for k, source in enumerate((SHOW, SET, ASK, ASK, ASK))]
    kernel = {"kernelspec": {"name": "gonio", "display_name": "gonio"}}
    notebook = {"cells": cells, "metadata": kernel, "nbformat": 4, "nbformat_minor": 5}
    (folder / "work" / "tour.ipynb").write_text(json.dumps(notebook))
    own = {"JUPYTER_DATA_DIR": folder / "data", "JUPYTER_CONFIG_DIR": folder / "config"}
    own |= {"JUPYTER_RUNTIME_DIR": folder / "run", "IPYTHONDIR": folder / "ipython"}
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    options = [
        f"--ServerApp.port={port}",
        f"--IdentityProvider.token={TOKEN}",
        f"--ServerApp.root_dir={folder / 'work'}",
    ]
    server = subprocess.Popen(
        [sys.executable, "-m", "jupyterlab", "--no-browser", "--allow-root", *options],
        env=os.environ | {name: str(path) for name, path in own.items()},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        address = f"http://localhost:{port}/lab/tree/tour.ipynb?token={TOKEN}"
        for _ in range(240):
            try:
                urllib.request.urlopen(f"http://localhost:{port}/api?token={TOKEN}", timeout=1)
                break
            except OSError:
                time.sleep(0.5)
        yield address
    finally:
        server.terminate()
        server.wait(30)


def run(page):
    """Run the cell that is selected, and go on to the next."""
    page.keyboard.press("Shift+Enter")


def answer(page, k):
    """What the k-th question printed."""
    told = page.locator(".jp-OutputArea-output pre", has_text="answer {")
    told.nth(k).wait_for(timeout=120_000)
    return json.loads(told.nth(k).inner_text().partition("answer ")[2])


def until(frame, expression):
    """Wait until an expression is true, asking from outside: the page's policy has no script evaluated in it."""
    for _ in range(480):
        if frame.evaluate(expression):
            return
        time.sleep(0.25)
    raise SystemExit(f"{expression}: it never was")


def walk(page):
    """Each step with what came of it."""
    page.locator(".jp-Cell").first.wait_for(timeout=120_000)
    page.get_by_text("gonio | Idle").wait_for(timeout=120_000)
    time.sleep(2)  # idle is said a little before the notebook takes what is run
    page.locator(".jp-Cell .cm-content").first.click()
    run(page)
    frame = page.frame_locator("iframe[title^=gonio]")
    frame.locator("html[data-ready=true]").wait_for(timeout=120_000)
    sliders = frame.locator(".parameter").count()
    run(page)
    frame.locator("#parameter-width").wait_for()
    inside = next(f for f in page.frames if f.url == "about:srcdoc")
    until(inside, "gonio.store.get().values[2][0] === 0.25")
    run(page)
    first = answer(page, 0)
    page.locator("iframe[title^=gonio]").scroll_into_view_if_needed()
    inside.evaluate("gonio.actions.move(2, 0.4)")
    until(inside, "gonio.store.get().result !== null")
    time.sleep(2)  # a message has no answer to wait for
    page.locator(".jp-Cell .cm-content").nth(3).click()
    run(page)
    second = answer(page, 1)
    page.locator("iframe[title^=gonio]").scroll_into_view_if_needed()
    frame.get_by_role("button", name="Fit", exact=True).click()
    until(inside, "gonio.store.get().fitName === 'fit 1'")
    page.locator(".jp-Cell .cm-content").nth(4).click()
    run(page)
    third = answer(page, 2)
    styled = page.evaluate("getComputedStyle(document.body).display")
    page.evaluate("document.querySelector('iframe[title^=gonio]').closest('.jp-OutputArea').remove()")
    return {
        "sliders": sliders,
        "set from Python": first["values"]["width"],
        "moved on the page": second["values"]["width"],
        "changes that Python saw": second["seen"],
        "fitted by the kernel": third["solution"]["width"],
        "values after the fit": third["values"]["width"],
        "frames left": page.locator("iframe[title^=gonio]").count(),
        "style of the page on the notebook": styled == "grid",  # which the page sets
    }


def main(python):
    with tempfile.TemporaryDirectory() as folder, lab(python, Path(folder)) as address, sync_playwright() as started:
        options = {"executable_path": shutil.which("chromium"), "args": ["--no-sandbox"]}
        page = started.chromium.launch(**options).new_page(viewport={"width": 1280, "height": 1000})
        wrong = []
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(address)
        found = walk(page)
    about = {
        "program": f"JupyterLab {version('jupyterlab')}, anywidget {version('anywidget')}",
        "python": platform.python_version(),
        "quantity": "what each step of tests/crosscheck/jupyterlab_peer.py found",
    }
    peers.write("jupyterlab.json", about, {"errors": wrong}, found)


if __name__ == "__main__":
    main(sys.argv[1])

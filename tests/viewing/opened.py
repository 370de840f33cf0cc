"""Pages in one file, opened in a browser that is told of every request and every word on the console."""

import time
from contextlib import contextmanager
from pathlib import Path

READY = "html[data-ready=true]"


@contextmanager
def opened(chromium, address, **options):
    """A page of its own, with `asked`, the addresses that it asked for, and `said`, what went wrong."""
    context = chromium.new_context(**options)
    page = context.new_page()
    page.asked, page.said = [], []
    page.on("request", lambda request: page.asked.append(request.url))
    page.on("console", lambda told: page.said.append(told.text) if _is_complaint(told) else None)
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.goto(address if "://" in str(address) else Path(address).as_uri())
    yield page
    context.close()


def _is_complaint(told):
    """Whether it is no word of the software graphics about their own speed."""
    return told.type in ("error", "warning") and "GL Driver Message" not in told.text


def from_elsewhere(page):
    """What a page asked of anything but itself: its own file, and the scripts that stand in it."""
    return [url for url in page.asked[1:] if not url.startswith(("data:", "blob:"))]


def until(frame, expression, seconds=20.0):
    """Wait until an expression is true, asking from outside: the page's policy has no script evaluated in it."""
    end = time.monotonic() + seconds
    while not frame.evaluate(expression):
        assert time.monotonic() < end, expression
        time.sleep(0.02)

"""Pages in one file, opened in a browser that is told of every request and every word on the console."""

import time
from contextlib import contextmanager
from pathlib import Path

from viewed import complaints

READY = "html[data-ready=true]"


@contextmanager
def opened(chromium, address, **options):
    """A page of its own, with `asked`, the addresses that it asked for, and `said`, what went wrong."""
    context = chromium.new_context(**options)
    page = context.new_page()
    page.asked, page.said = [], complaints(page)
    page.on("request", lambda request: page.asked.append(request.url))
    page.goto(address if "://" in str(address) else Path(address).as_uri())
    yield page
    context.close()


def from_elsewhere(page):
    """What a page asked of anything but itself: its own file, and the scripts that stand in it."""
    return [url for url in page.asked[1:] if not url.startswith(("data:", "blob:"))]


def until(frame, expression, seconds=20.0):
    """Wait until an expression is true, asking from outside: the page's policy has no script evaluated in it."""
    end = time.monotonic() + seconds
    while not frame.evaluate(expression):
        assert time.monotonic() < end, expression
        time.sleep(0.02)

"""Pages in one file, opened in a browser that is told of every request and every word on the console."""

import time
from contextlib import contextmanager
from pathlib import Path

from browser import shared
from viewed import complaints

READY = "html[data-ready=true]"


@contextmanager
def opened(chromium, address, before="", **options):
    """A page with `asked`, the addresses that it asked for, and `said`, what went wrong.

    It is opened in the tab of the test before; with a script that runs before those of the page, or with options as a
    browser context takes them, in a context of its own.
    """
    is_own = bool(before or options)
    page = chromium.new_context(**options).new_page() if is_own else shared.tab()
    if before:
        page.add_init_script(before)
    if not hasattr(page, "said"):
        page.asked, page.said = [], complaints(page)
        page.on("request", lambda request: page.asked.append(request.url))
    page.asked.clear()
    page.said.clear()
    page.goto(address if "://" in str(address) else Path(address).as_uri())
    yield page
    if is_own:
        page.context.close()
    else:
        page.goto("about:blank")


def from_elsewhere(page):
    """What a page asked of anything but itself: its own file, and the scripts that stand in it."""
    return [url for url in page.asked[1:] if not url.startswith(("data:", "blob:"))]


def until(frame, expression, seconds=20.0):
    """Wait until an expression is true, asking from outside: the page's policy has no script evaluated in it."""
    end = time.monotonic() + seconds
    while not frame.evaluate(expression):
        assert time.monotonic() < end, expression
        time.sleep(0.02)

"""A browser for tests that look at pages as a reader sees them; such a test is skipped where there is none."""

import shutil
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome")
DESK = {"width": 1280, "height": 720}
# Without what a browser fetches for itself: whatever is then asked for, a page asked for.
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


class Shared:
    """One browser for tests that follow each other: starting one takes longer than most tests."""

    def __init__(self) -> None:
        self._held = ExitStack()
        self._opened: Any = None
        self._tab: Any = None

    def browser(self) -> Any:
        """Chromium, without a window; started when it is first asked for."""
        if self._opened is None:
            self._opened = self._held.enter_context(browser())
        return self._opened

    def tab(self) -> Any:
        """The same tab each time: a page that is opened in it finds a process and graphics that run already."""
        if self._tab is None:
            self._tab = self.browser().new_context().new_page()
        self._tab.set_viewport_size(DESK)
        self._tab.emulate_media(media="null")
        return self._tab

    def close(self) -> None:
        """Ends it. While it is open, nothing else of its process can have an event loop."""
        self._opened = self._tab = None
        self._held.close()


shared = Shared()


@contextmanager
def browser() -> Iterator[Any]:
    """Chromium, without a window."""
    path = next(filter(None, map(shutil.which, NAMES)), None)
    if path is None:
        pytest.skip(f"no browser is called {', '.join(NAMES)}")
    playwright = pytest.importorskip("playwright.sync_api")
    with playwright.sync_playwright() as started:
        opened = started.chromium.launch(executable_path=path, args=list(QUIET))
        yield opened
        opened.close()

"""A page of HTML as PDF: printed by the Chromium that is installed, or by WeasyPrint where none is."""

import functools
import shutil
import subprocess
from importlib.util import find_spec
from pathlib import Path

from gonio.files import replacing, temporary_folder
from gonio.outside import printable
from gonio.processes.portable import is_superuser

SUFFIX = ".pdf"
NAMES = ("chromium", "chromium-browser", "google-chrome")
SECONDS = 180.0  # a page of many figures takes some five
# Nothing but the page itself is asked for: no name is resolved, and the browser does not fetch for itself.
OPTIONS = (
    "--headless",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--disable-sync",
    "--no-first-run",
    "--no-pdf-header-footer",
    "--host-resolver-rules=MAP * ~NOTFOUND",
)


@functools.cache
def browser() -> str:
    """The path of the browser that prints; empty where none of NAMES is installed."""
    return next(filter(None, map(shutil.which, NAMES)), "")


def refuse_no_printer() -> None:
    """ValueError, with the remedy, where neither a browser nor WeasyPrint is installed."""
    if not browser() and find_spec("weasyprint") is None:
        raise ValueError(
            f"a PDF is printed by Chromium or by WeasyPrint, and there is no {', '.join(NAMES[:-1])} or {NAMES[-1]} on "
            "the PATH: pip install 'gonio[pdf]', install a browser, or write .html and print that from any browser"
        )


def write_pdf(html: str, path: Path, force: bool) -> Path:
    """A page that needs nothing else, printed to a file.

    Raises ValueError where nothing is installed that prints, or it prints nothing, and FileExistsError without `force`.
    """
    refuse_no_printer()
    with temporary_folder() as folder, replacing(path, force) as temporary:
        page, printed = folder / "page.html", folder / "page.pdf"
        if browser():
            page.write_text(html, encoding="utf-8")
            _print(page, printed, folder / "profile")
        else:
            _set(html, printed)
        shutil.copyfile(printed, temporary)
    return path


def _set(html: str, printed: Path) -> None:
    """By WeasyPrint, which runs no scripts; it is given no way to fetch anything."""
    try:
        import weasyprint
    except OSError as error:  # it is there, and a library of the system that it needs is not
        why = printable(str(error).splitlines()[0])
        raise ValueError(
            f"WeasyPrint cannot be loaded ({why}): install Pango, or write .html and print that from any browser"
        ) from error
    # Pictures stand in the page; whatever else it asks for, nothing is fetched.
    fetcher = weasyprint.urls.URLFetcher(allowed_protocols=("data",))
    weasyprint.HTML(string=html, url_fetcher=fetcher).write_pdf(printed)


def _print(page: Path, printed: Path, profile: Path) -> None:
    # Chromium does not run as root in its sandbox; the page holds no script, and whatever it quotes is escaped.
    options = [*OPTIONS, *["--no-sandbox"] * is_superuser(), f"--user-data-dir={profile}", f"--print-to-pdf={printed}"]
    why = ""
    try:
        done = subprocess.run([browser(), *options, page.as_uri()], capture_output=True, timeout=SECONDS, check=False)
        why = done.stderr.decode("utf-8", "replace").strip().rpartition("\n")[2]
    except subprocess.TimeoutExpired:
        why = f"it did not end within {SECONDS:g} s"
    except OSError as error:
        why = str(error.strerror)
    if not (printed.is_file() and printed.stat().st_size):
        why = printable(why) or "it says nothing of why"
        raise ValueError(f"{browser()} printed no PDF ({why}): write .html, and print that from any browser")

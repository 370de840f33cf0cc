"""A page of HTML as PDF: printed by the Chromium that is installed, which knows how a page is broken."""

import functools
import shutil
import subprocess
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
    """The path of the browser that prints; ValueError, with the remedy, where none of NAMES is installed."""
    for name in NAMES:
        if found := shutil.which(name):
            return found
    raise ValueError(
        f"a PDF is printed by Chromium, and no {', '.join(NAMES[:-1])} or {NAMES[-1]} is on the PATH: install one, or "
        "write .html and print that from any browser"
    )


def write_pdf(html: str, path: Path, force: bool) -> Path:
    """A page that needs nothing else, printed to a file.

    Raises ValueError where no browser is installed or it prints nothing, and FileExistsError without `force`.
    """
    with temporary_folder() as folder, replacing(path, force) as temporary:
        page, printed = folder / "page.html", folder / "page.pdf"
        page.write_text(html, encoding="utf-8")
        _print(page, printed, folder / "profile")
        shutil.copyfile(printed, temporary)
    return path


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

"""Matplotlib style files: read whole or refused, where Matplotlib itself passes over what it does not understand."""

import logging
from pathlib import Path
from typing import Any

from gonio.files import FormatError

LARGEST = 100_000  # bytes: a style file has a line for each of some 300 settings
# How files are written and text is made, which decides whether a figure is correct, and what concerns windows.
NOT_OF_A_STYLE = (
    "backend",
    "backend_fallback",
    "docstring.hardcopy",
    "figure.hooks",
    "figure.max_open_warning",
    "figure.raise_window",
    "interactive",
    "pdf.fonttype",
    "pdf.use14corefonts",
    "savefig.directory",
    "savefig.format",
    "svg.fonttype",
    "svg.hashsalt",
    "text.usetex",
    "timezone",
    "toolbar",
)


def read_style(name: str) -> dict[str, Any]:
    """The settings of a style file by name.

    Raises FileNotFoundError where there is none, and FormatError with the line for a setting that Matplotlib does not
    know or that is none of a style, and for a value that it does not take.
    """
    from matplotlib import rc_params_from_file

    path = Path(name)
    if not path.is_file():
        raise FileNotFoundError(
            f"{path}: there is no such style file: name a Matplotlib style file, such as a.mplstyle"
        )
    text = _text(path)
    complaints: list[str] = []
    handler = _Listener(complaints)
    logger = logging.getLogger("matplotlib")
    passed_on = logger.propagate
    logger.addHandler(handler)
    logger.propagate = False
    try:
        read = rc_params_from_file(path, fail_on_error=False, use_default_template=False)
    finally:
        logger.removeHandler(handler)
        logger.propagate = passed_on
    settings: dict[str, Any] = {str(name): value for name, value in read.items()}
    given = [(k, line.partition(":")[0].strip()) for k, line in enumerate(text.splitlines(), 1)]
    for k, key in given:
        if not key or key.startswith("#"):
            continue
        if key in NOT_OF_A_STYLE:
            raise FormatError(path, f"{key} does not belong to the style of a figure: leave it out", f"line {k}")
        if key not in settings:
            raise FormatError(path, f"Matplotlib does not understand {key!r} or its value: mend it", f"line {k}")
    if complaints:
        raise FormatError(path, complaints[0].splitlines()[0])
    return settings


def _text(path: Path) -> str:
    if path.stat().st_size > LARGEST:
        raise FormatError(path, f"is larger than {LARGEST} bytes: this is no Matplotlib style file")
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise FormatError(path, "is no text in UTF-8: give a Matplotlib style file", f"byte {error.start}") from None


class _Listener(logging.Handler):
    def __init__(self, heard: list[str]) -> None:
        super().__init__(logging.WARNING)
        self.heard = heard

    def emit(self, record: logging.LogRecord) -> None:
        self.heard.append(record.getMessage().strip())

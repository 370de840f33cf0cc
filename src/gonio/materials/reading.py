"""Reading optical constants from a file: what it is, is told from its content, never from its name."""

from pathlib import Path

from gonio.files import FormatError
from gonio.materials import columns, database
from gonio.materials.material import Material

LARGEST_FILE = 10_000_000  # bytes


def read_material(path: str | Path) -> Material:
    """A Material from a refractiveindex.info YAML or from two or three columns of text.

    Raises FormatError with file, line and what was expected.
    """
    path = Path(path)
    text = _text(path)
    return database.read(path, text) if database.recognises(text) else columns.read(path, text)


def _text(path: Path) -> str:
    if not path.exists():
        raise FormatError(path, "there is no such file")
    if not path.is_file():
        raise FormatError(path, "is a directory: name a file in it" if path.is_dir() else "is not a regular file")
    with path.open("rb") as file:
        raw = file.read(LARGEST_FILE + 1)
    if len(raw) > LARGEST_FILE:
        raise FormatError(path, f"is larger than {LARGEST_FILE // 1_000_000} MB: this is no table of one material")
    if b"\0" in raw:
        raise FormatError(path, "holds zero bytes: this is no text file; save it as UTF-8 text", f"byte {raw.index(0)}")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        raise FormatError(
            path, "is not UTF-8 text: save the file as UTF-8", f"line {line}, byte {error.start}"
        ) from error
    if not text.strip():
        raise FormatError(path, "is empty")
    return text

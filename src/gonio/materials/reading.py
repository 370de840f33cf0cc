"""Reading optical constants from a file: what it is, is told from its content, never from its name."""

from pathlib import Path

from gonio.door.text import whole
from gonio.materials import columns, database
from gonio.materials.material import Material

LARGEST_FILE = 10_000_000  # bytes


def read_material(path: str | Path) -> Material:
    """A Material from a refractiveindex.info YAML or from two or three columns of text.

    Raises FormatError with file, line and what was expected.
    """
    path = Path(path)
    text = whole(path, LARGEST_FILE)
    return database.read(path, text) if database.recognises(text) else columns.read(path, text)

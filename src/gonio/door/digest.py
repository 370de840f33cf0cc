"""The SHA-256 of a file, by which a report names exactly the bytes that were read."""

import hashlib
from pathlib import Path


def sha256(path: Path) -> str:
    """In hexadecimal; empty for a folder, such as a Zarr store, which has none of its own."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

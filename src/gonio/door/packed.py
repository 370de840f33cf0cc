"""Compressed files and archives, known by their first bytes: gonio opens none, and says how to unpack them."""

import shlex
from pathlib import Path

from gonio.files import FormatError

LENGTH = 512  # bytes by which every kind is known
_TAR_AT = 257  # where the header of a tar archive holds its signature
ZIP = b"PK\x03\x04"  # how a ZIP archive with files in it begins
_MEMBER_AT = 30  # where the name of its first file is

# Signature, what it is, and the usual program that unpacks it; the name of the file follows.
KINDS = (
    (b"\x1f\x8b", "compressed by gzip", "gunzip -k"),
    (b"BZh", "compressed by bzip2", "bunzip2 -k"),
    (b"\xfd7zXZ\0", "compressed by xz", "unxz -k"),
    (b"\x28\xb5\x2f\xfd", "compressed by Zstandard", "unzstd"),
    (b"\x04\x22\x4d\x18", "compressed by LZ4", "unlz4"),
    (b"LZIP\x01", "compressed by lzip", "lzip -dk"),
    (b"\x1f\x9d", "compressed by compress", "uncompress -k"),
    (ZIP, "a ZIP archive", "unzip"),
    (b"PK\x05\x06", "an empty ZIP archive", ""),
    (b"PK\x07\x08", "a ZIP archive in parts", "7z x"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive", "7z x"),
    (b"Rar!\x1a\x07", "a RAR archive", "unrar x"),
)
OFFICE = (b"[Content_Types].xml", b"_rels/", b"docProps/", b"xl/", b"word/")  # first in a file of Office 2007 or later
OPEN_DOCUMENT = b"mimetypeapplication/vnd.oasis.opendocument"


def refuse_packed(path: Path, head: bytes) -> None:
    """FormatError, with the command that unpacks it, for a file that begins with the bytes of a packed one.

    head: its first LENGTH bytes. Workbooks and documents are ZIP archives too, and no reason to unpack anything.
    """
    if is_document(head):
        return
    for signature, what, program in KINDS:
        if head.startswith(signature):
            raise FormatError(path, f"is {what}: {_remedy(program, path)}", "byte 0")
    if head[_TAR_AT : _TAR_AT + 5] == b"ustar" and b"\0" in head[:_TAR_AT]:
        raise FormatError(path, f"is a tar archive: {_remedy('tar -xf', path)}", "byte 0")


def is_document(head: bytes) -> bool:
    """Whether a file is a workbook or another document that is stored as a ZIP archive."""
    return head.startswith(ZIP) and head[_MEMBER_AT:].startswith((*OFFICE, OPEN_DOCUMENT))


def _remedy(program: str, path: Path) -> str:
    return f"unpack it first ({program} {shlex.quote(str(path))})" if program else "there is nothing to read in it"

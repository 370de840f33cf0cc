"""Members of a ZIP archive whose names and sizes are checked before anything is unpacked."""

import zipfile
from pathlib import Path

from gonio.door.text import clip
from gonio.files import FormatError

METHODS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
MOST_MEMBERS = 1000


class Archive:
    """The members of a ZIP archive by name. Every method raises FormatError with the byte where a member begins."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            with zipfile.ZipFile(path) as archive:
                listed = archive.infolist()
        except Exception as error:  # a damaged directory may raise any exception in the reader
            raise self._damaged(error, 0) from error
        if len(listed) > MOST_MEMBERS:
            raise FormatError(path, f"holds {len(listed)} files, more than {MOST_MEMBERS}", "byte 0")
        self._members = {one.filename: one for one in listed}

    def _damaged(self, error: Exception, at: int) -> FormatError:
        said = clip(f"{type(error).__name__}: {error}".splitlines()[0], 120)
        return FormatError(self.path, f"is a damaged ZIP archive ({said})", f"byte {at}")

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def at(self, name: str) -> int:
        """The byte at which a member begins; 0 for one that is not there."""
        return self._members[name].header_offset if name in self._members else 0

    def size(self, name: str) -> int:
        """How many bytes a member says that it has. Raises FormatError where there is none of that name."""
        if name not in self._members:
            raise FormatError(self.path, f"the archive holds no {clip(name)}", "byte 0")
        return self._members[name].file_size

    def read(self, name: str, most: int) -> bytes:
        """The bytes of a member of at most `most` bytes, whose checksum is right."""
        size = self.size(name)
        member = self._members[name]
        place = f"byte {member.header_offset}"
        if size > most:
            raise FormatError(self.path, f"{clip(name)} has {size} bytes, and at most {most} belong there", place)
        if member.compress_type not in METHODS or member.flag_bits & 1:
            how = "is locked by a password" if member.flag_bits & 1 else "is packed by an unusual method"
            raise FormatError(self.path, f"{clip(name)} {how}: pack it again, deflated and without one", place)
        try:
            with zipfile.ZipFile(self.path) as archive, archive.open(member) as file:
                content = file.read(size + 1)
        except Exception as error:  # damaged bytes may raise any exception in the reader
            raise self._damaged(error, member.header_offset) from error
        if len(content) != size:
            what = f"{clip(name)} has {len(content)} bytes, and the archive says {size}"
            raise FormatError(self.path, what, place)
        return content

"""A download that goes on where it was cut off, and keeps nothing that is not what was asked for."""

import hashlib
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gonio.archive.collection import PublicFile

ATTEMPTS = 4
PATIENCE = (10.0, 60.0)  # s to connect, and between two pieces of the answer
CHUNK = 2**15  # bytes; one that breaks off is lost
PARTIAL, RANGE_REFUSED, BUSY = 206, 416, (408, 429)  # HTTP


class InterruptedDownloadError(OSError):
    """The archive did not answer, or the line broke; what had arrived is kept for the next time."""


@dataclass(frozen=True)
class Download:
    """A downloader for pooch: called with address and target, it leaves the verified file there.

    What has arrived lies in `partial` until the file is whole; `pause` [s] grows with each attempt.
    """

    file: PublicFile
    partial: Path
    progress: Callable[[float], None] = lambda fraction: None
    pause: float = 1.0

    def __call__(self, url: str, output_file: Any, pooch: Any) -> None:
        """Fetch `url` to `output_file`.

        Raises ValueError where the archive has something else, and InterruptedDownloadError where it does not answer;
        a partial file stays only after the latter.
        """
        resumed = self._arrive(url)
        found = sha256(self.partial)
        if found != self.file.sha256 and resumed:  # what was there before may have been of another version
            self.partial.unlink()
            self._arrive(url)
            found = sha256(self.partial)
        if found != self.file.sha256:
            self.partial.unlink()
            raise ValueError(
                f"{url} is not the file that gonio knows: SHA-256 {found} where {self.file.sha256} was expected; "
                "nothing was kept. Try another mirror with --base-url"
            )
        shutil.move(self.partial, output_file)

    def _arrive(self, url: str) -> bool:
        """Bring the whole file into `partial`; whether a part of it was there before."""
        import requests

        resumed = self._have() > 0
        for attempt in range(1, ATTEMPTS + 1):
            try:
                self._stream(url)
                if self._have() >= self.file.size:
                    return resumed
                why = f"it ends after {self._have()} of {self.file.size} bytes"
            except requests.RequestException as error:
                why = _in_words(error)
            if attempt < ATTEMPTS:
                time.sleep(self.pause * attempt)
        raise InterruptedDownloadError(
            f"{url} did not arrive: {why}; what is there is kept, and the same command goes on from it"
        )

    def _have(self) -> int:
        return self.partial.stat().st_size if self.partial.exists() else 0

    def _stream(self, url: str) -> None:
        import requests

        have = self._have()
        if have == self.file.size:
            return
        if have > self.file.size:
            self.partial.unlink()
            have = 0
        # Without compression on the way, so that bytes count the same on both sides.
        headers = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={have}-"} if have else {})
        with requests.get(url, headers=headers, stream=True, timeout=PATIENCE) as answer:
            status = answer.status_code
            if status == RANGE_REFUSED:
                self.partial.unlink()
                return
            if 400 <= status < 500 and status not in BUSY:
                raise ValueError(f"{url}: the archive answers {status} {answer.reason}: name a mirror with --base-url")
            answer.raise_for_status()
            goes_on = status == PARTIAL and answer.headers.get("Content-Range", "").startswith(f"bytes {have}-")
            with self.partial.open("ab" if goes_on else "wb") as out:
                for chunk in answer.iter_content(CHUNK):
                    out.write(chunk)
                    self.progress(min(out.tell() / self.file.size, 1.0))
                    if out.tell() > self.file.size:  # it cannot be the file: its hash says so next
                        return


def _in_words(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]


def sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

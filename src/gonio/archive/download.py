"""A download that resumes where it was cut off, and keeps no file whose SHA-256 is wrong."""

import hashlib
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gonio.archive.collection import PublicFile
from gonio.files import naming

ATTEMPTS = 4
PATIENCE = (10.0, 60.0)  # s to connect, and between two pieces of the answer
CHUNK = 2**15  # bytes written at once
SLOWEST, AFTER = 1000.0, 60.0  # bytes/s on average that an answer must reach after so many seconds
PARTIAL, RANGE_REFUSED, BUSY = 206, 416, (408, 429)  # HTTP


class InterruptedDownloadError(OSError):
    """The archive did not answer, or the connection broke; the part that had arrived is kept for the next attempt."""


@dataclass(frozen=True)
class Download:
    """A downloader for pooch: called with address and target, it writes the verified file there.

    The part that has arrived is in `partial` until the file is complete; `pause` [s] grows with each attempt.
    targets: the temporary files of pooch, which it removes unless a signal ends the program.
    """

    file: PublicFile
    partial: Path
    progress: Callable[[float], None] = lambda fraction: None
    pause: float = 1.0
    targets: list[Path] = field(default_factory=list)

    def forget_targets(self) -> None:
        """Remove the temporary files of pooch that are there."""
        for path in self.targets:
            path.unlink(missing_ok=True)

    def __call__(self, url: str, output_file: Any, pooch: Any) -> None:
        """Fetch `url` to `output_file`.

        Raises ValueError where the archive has another file, and InterruptedDownloadError where it does not answer; a
        partial file is kept only after the latter.
        """
        self.targets.append(Path(output_file))
        resumed = self._complete(url)
        digest = sha256(self.partial)
        if digest != self.file.sha256 and resumed:  # the earlier part may have been of another version
            self.partial.unlink()
            self._complete(url)
            digest = sha256(self.partial)
        if digest != self.file.sha256:
            self.partial.unlink()
            raise ValueError(
                f"{url} is not the file that gonio knows: SHA-256 {digest} where {self.file.sha256} was expected; "
                "nothing was kept. Try another mirror with --base-url"
            )
        shutil.move(self.partial, output_file)

    def _complete(self, url: str) -> bool:
        """Download the rest of the file into `partial`; whether a part of it existed before."""
        import requests
        from urllib3.exceptions import HTTPError

        resumed = self._size() > 0
        for attempt in range(1, ATTEMPTS + 1):
            try:
                self._stream(url)
                if self._size() >= self.file.size:
                    return resumed
                why = f"it ends after {self._size()} of {self.file.size} bytes"
            except (requests.RequestException, HTTPError) as error:
                why = _in_words(error)
            if attempt < ATTEMPTS:
                time.sleep(self.pause * attempt)
        raise InterruptedDownloadError(
            f"{url} did not arrive: {why}; the part that arrived is kept, and the same command goes on from it"
        )

    def _size(self) -> int:
        """Bytes that have arrived."""
        return self.partial.stat().st_size if self.partial.exists() else 0

    def _stream(self, url: str) -> None:
        """One request for the bytes that `partial` lacks, appended to it; for all of them if the archive sends all."""
        import requests

        size = self._size()
        if size == self.file.size:
            return
        if size > self.file.size:
            self.partial.unlink()
            size = 0
        # Without compression in transit, so that bytes count the same on both sides.
        headers = {"Accept-Encoding": "identity"} | ({"Range": f"bytes={size}-"} if size else {})
        with requests.get(url, headers=headers, stream=True, timeout=PATIENCE) as answer:
            status = answer.status_code
            if status == RANGE_REFUSED:
                self.partial.unlink()
                return
            if 400 <= status < 500 and status not in BUSY:
                raise ValueError(f"{url}: the archive answers {status} {answer.reason}: name a mirror with --base-url")
            answer.raise_for_status()
            appends = status == PARTIAL and answer.headers.get("Content-Range", "").startswith(f"bytes {size}-")
            with self.partial.open("ab" if appends else "wb") as out:
                begin, started = out.tell(), time.monotonic()
                # What has arrived, not a full chunk: an archive that sends a byte a second would never fill one.
                while chunk := answer.raw.read1(CHUNK):
                    with naming(self.partial):
                        out.write(chunk)
                    self.progress(min(out.tell() / self.file.size, 1.0))
                    if out.tell() > self.file.size:  # it cannot be the file: the check of its hash fails next
                        return
                    seconds, arrived = time.monotonic() - started, out.tell() - begin
                    if seconds > AFTER and arrived < SLOWEST * seconds:
                        raise requests.Timeout(f"{arrived} bytes arrived in {seconds:.0f} s")


def _in_words(error: Exception) -> str:
    """An exception on one line of at most 200 characters."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:200]


def sha256(path: Path) -> str:
    """The SHA-256 of a file's content, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()

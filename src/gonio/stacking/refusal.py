"""Files that make no stack with the others, told all at once: each by its name, with the place and the remedy."""

from collections.abc import Sequence
from pathlib import Path

from gonio.files import FormatError
from gonio.outside import shortened

MOST_SAID = 5  # files of which is said what is wrong; the others are named or counted
LEAVE_OUT = "or leave these files out"


class MisfitError(ValueError):
    """A file that does not fit to the first one of a stack: what differs, where, and the remedy."""

    def __init__(self, path: Path, what: str, remedy: str) -> None:
        super().__init__(f"{path}: {what}: {remedy}")
        self.path, self.what, self.remedy = path, what, remedy


def refusal(errors: Sequence[ValueError], skipped: Sequence[FormatError], first: Path | None, count: int) -> ValueError:
    """One error for all files that are refused, of `count` files.

    errors: at least one, each with its file in the text. skipped: files of a folder that are no scans, and would have
    been left out. first: the file to which the others have to fit.
    """
    if len(errors) == 1 and not skipped:
        return errors[0]
    texts = [f"{e.path}: {e.what}" if isinstance(e, MisfitError) else str(e) for e in errors]
    parts = [f"{len(errors)} of {count} files make no stack with the others: {'; '.join(texts[:MOST_SAID])}"]
    if rest := errors[MOST_SAID:]:
        parts.append(shortened("and ", [e.path.name if isinstance(e, MisfitError) else str(e) for e in rest], ""))
    if skipped:
        parts.append("no scans: " + "; ".join(str(e) for e in skipped[:MOST_SAID]))
        if len(skipped) > MOST_SAID:
            parts.append(shortened("no scans either: ", [e.path.name for e in skipped[MOST_SAID:]], ""))
    if first is not None and 2 * len(errors) > count:
        parts.append(f"most files differ from the first, {first}: perhaps it is the one to leave out")
    parts += dict.fromkeys(e.remedy for e in errors if isinstance(e, MisfitError))
    return ValueError("; ".join([*parts, LEAVE_OUT]))

"""What a person changes: a filter, or what lies in the sample's place."""

import sys
from collections.abc import Mapping, Sequence

from gonio.acquisition.device import DeviceError
from gonio.outside import printable


class ByHand:
    """A selector whose hand is somebody at the terminal, who is asked, with the shutter closed for targets.

    names: what can be asked for. transmittance: of each, if they are filters: its value and standard uncertainty.
    """

    def __init__(self, names: Sequence[str], transmittance: Mapping[str, Sequence[float]] | None = None) -> None:
        self.names = list(names)
        self._known = {name: (float(pair[0]), float(pair[1])) for name, pair in (transmittance or {}).items()}

    def select(self, name: str) -> None:
        """Ask, and wait for Enter; DeviceError where nobody can answer."""
        what = f"put {printable(name)!r} in its place" if name else "take the filter away"
        print(f"gonio: {what}, then press Enter", file=sys.stderr, flush=True)
        if not sys.stdin.readline():
            raise DeviceError("nobody answers: standard input is closed")

    def transmittance(self, name: str) -> tuple[float, float]:
        """As it was stated."""
        return self._known[name]

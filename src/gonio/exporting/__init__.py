"""Models and scans handed on to other programs: each target is declared in one file of `targets`.

`gonio.export` writes a file, `targets()` lists what can be written. A target gets a `Subject`, which is a model with
its values and all that is known of them, and says what it wrote and at what error.
"""

from gonio.exporting.registry import targets

__all__ = ["targets"]

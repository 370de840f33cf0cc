"""Writes docs/targets.md from the declarations of the targets."""

from _pages import DOCS, table

from gonio.exporting import targets
from gonio.exporting.target import Target

HEAD = """# Programs that models are written for

`make pages` writes this page from the declarations in `src/gonio/exporting/targets`; do not edit it.
[How to hand a model on](howto/exporting.md) says how to use them.

"""

REFUSED = """

## Not written, and what to do instead

"""


def suffixes(target: Target) -> str:
    return ", ".join(f"`{suffix}`" for suffix in target.suffixes) or "any"


def main() -> None:
    """Write the page."""
    every = targets().values()
    written = [(f"`{t.name}`", t.title, suffixes(t), t.writes) for t in every if not t.refused]
    refused = [f"- **{t.title}** (`{t.name}`): {t.refused}." for t in every if t.refused]
    text = HEAD + table(("`--to`", "program", "suffix", "what is written"), written, 4) + "\n"
    (DOCS / "targets.md").write_text(text + (REFUSED + "\n".join(refused) + "\n" if refused else ""), encoding="utf-8")


if __name__ == "__main__":
    main()

"""How the gallery finds gonio's figures, which Matplotlib's list of open windows does not hold."""

from typing import Any
from weakref import WeakSet

from matplotlib.figure import Figure
from sphinx.application import Sphinx
from sphinx_gallery.scrapers import figure_rst

DPI = 200
SAVED: WeakSet[Figure] = WeakSet()


def scraper(_block: Any, block_vars: dict[str, Any], gallery_conf: dict[str, Any]) -> str:
    """The new figures among the variables of a script, in the order in which they were made."""
    paths, titles = [], []
    for name, value in list(block_vars["example_globals"].items()):
        if isinstance(value, Figure) and value not in SAVED:
            SAVED.add(value)
            paths.append(next(block_vars["image_path_iterator"]))
            titles.append(name.strip("_").replace("_", " "))
            value.savefig(paths[-1], dpi=DPI)
    return figure_rst(paths, gallery_conf["src_dir"], ", ".join(filter(None, titles)))


def setup(_app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    return {"parallel_read_safe": True, "parallel_write_safe": True}

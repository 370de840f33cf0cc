"""How Sphinx builds the site: `make docs`. It needs no network, and neither do the pages that it makes."""

import os
import sys
from pathlib import Path

import gonio

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "gonio"
author = "The gonio authors"
copyright = "The gonio authors"
version = release = gonio.__version__

extensions = [
    "myst_parser",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "figures",
    "inherited",
    "links",
    "repository",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "_extensions", "_templates", "pages", "gallery"]
templates_path = ["_templates"]
highlight_language = "none"  # a fence that names no language is a command or a file
default_role = "code"  # a word between single backticks, in docstrings and on pages alike
nitpicky = True

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
html_math_renderer = "mathml"

autosummary_generate = True
autodoc_typehints = "none"  # a docstring says shapes and units, which a type does not
autodoc_preserve_defaults = True
maximum_signature_line_length = 72
autodoc_member_order = "groupwise"
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

# The names of other projects in our pages become links only where the network is asked for.
intersphinx_mapping = (
    {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "xarray": ("https://docs.xarray.dev/en/stable", None),
    }
    if os.environ.get("GONIO_DOCS_ONLINE") == "1"
    else {}
)

sphinx_gallery_conf = {
    "examples_dirs": "gallery",
    "gallery_dirs": "examples",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("figures.scraper",),
    "backreferences_dir": None,
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_signature": False,
    "show_memory": False,
    "write_computation_times": False,
    "min_reported_time": 60,
    "within_subsection_order": "FileNameSortKey",
}

html_theme = "pydata_sphinx_theme"
html_title = "gonio"
html_static_path = ["_static"]
html_css_files = ["gonio.css"]
html_copy_source = False
html_show_sourcelink = False
html_context = {"default_mode": "auto"}  # light or dark, as the reader's system has it
html_theme_options = {
    "header_links_before_dropdown": 6,
    "icon_links": [],
    "navbar_end": ["theme-switcher"],
    "primary_sidebar_end": [],
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "show_prev_next": True,
}
linkcheck_timeout = 30

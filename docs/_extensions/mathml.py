"""Formulas as MathML, which browsers draw themselves: no script and no font from elsewhere.

The converter is the one of Docutils. A formula that it cannot convert is a warning, and so stops `make docs`.
"""

import re
from typing import Any

from docutils import nodes
from docutils.utils.math import MathError
from docutils.utils.math.latex2mathml import tex2mathml
from docutils.utils.math.unichar2tex import uni2tex_table
from sphinx.application import Sphinx
from sphinx.util import logging

LOGGER = logging.getLogger(__name__)
ALIGNED = re.compile(r"(\\(?:begin|end)){align\*?}")  # Docutils knows it by the name that it has within a formula


def converted(node: nodes.Node, block: bool) -> str:
    """The formula of a node in MathML, or its source with a warning."""
    source = ALIGNED.sub(r"\1{aligned}", node.astext())
    try:
        return tex2mathml(source.translate(uni2tex_table), as_block=block)
    except MathError as error:
        LOGGER.warning("no MathML for %r: %s", source, error, location=node, type="mathml")
        return source


def inline(translator: Any, node: nodes.math) -> None:
    """A formula in a sentence."""
    translator.body.append(converted(node, block=False))
    raise nodes.SkipNode


def block(translator: Any, node: nodes.math_block) -> None:
    """A formula of its own, with its number where it has one; a wide one scrolls in its own frame."""
    translator.body.append(translator.starttag(node, "div", CLASS="math-block", tabindex="0"))
    if node.get("number"):
        translator.body.append(f'<span class="eqno">({node["number"]})</span>')
    translator.body.append(converted(node, block=True) + "</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

"""Formulas as MathML, which browsers draw by themselves: pages need neither network nor scripts."""

import re

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator

_TAG = re.compile(r"\s*\\tag\{(.+?)\}")
_BLOCK = (
    '<div style="display: flex; align-items: center; overflow-x: auto; padding-block: 0.4rem">'
    '<div style="flex: 1">{formula}</div><div>{number}</div></div>'
)


def inline(translator: HTML5Translator, node: nodes.math) -> None:
    """Write a formula within a sentence."""
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def block(translator: HTML5Translator, node: nodes.math_block) -> None:
    r"""Write a formula that stands alone, its number from ``\tag`` at the right."""
    text = node.astext()
    tag = _TAG.search(text)
    formula = convert(_TAG.sub("", text), display="block")
    number = f"({tag[1]})" if tag else ""
    translator.body.append(_BLOCK.format(formula=formula, number=number))
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the writer of formulas."""
    app.add_html_math_renderer("mathml", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}

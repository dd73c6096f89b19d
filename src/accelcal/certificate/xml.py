"""Elements of a certificate, by the names of their schemas."""

from __future__ import annotations

from collections.abc import Iterable
from xml.etree.ElementTree import Element, indent, register_namespace, tostring

from accelcal.report.lines import visible_lines

DCC = "https://ptb.de/dcc"
SI = "https://ptb.de/si"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"

Child = Element | None


def dcc(tag: str, *children: Child | str, **attributes: str) -> Element:
    """Make an element of the DCC; children that are None are left out."""
    return _element(f"{{{DCC}}}{tag}", children, attributes)


def si(tag: str, *children: Child | str, **attributes: str) -> Element:
    """Make an element of the D-SI; children that are None are left out."""
    return _element(f"{{{SI}}}{tag}", children, attributes)


def named(text: str) -> Element:
    """Make the name of an element of the DCC, in English."""
    return rich("name", text)


def rich(tag: str, text: str) -> Element:
    """Make an element of the DCC that holds a text in English.

    It is one ``content``: several are one text in several languages, of which a reader takes one.
    """
    return dcc(tag, dcc("content", text, lang="en"))


def number(value: float) -> str:
    """Write a number so that it reads back the same."""
    return repr(float(value))


def written(root: Element, version: str) -> str:
    """Write a certificate as XML in UTF-8, which names the version of its schema."""
    for prefix, space in (("dcc", DCC), ("si", SI), ("xsi", _XSI)):
        register_namespace(prefix, space)
    root.set(f"{{{_XSI}}}schemaLocation", f"{DCC} {DCC}/v{version}/dcc.xsd")
    indent(root)
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{tostring(root, encoding="unicode")}\n'


def _element(tag: str, children: Iterable[Child | str], attributes: dict[str, str]) -> Element:
    element = Element(tag, attributes)
    for child in children:
        if isinstance(child, str):
            element.text = visible_lines(child.split("\n"))
        elif child is not None:
            element.append(child)
    return element

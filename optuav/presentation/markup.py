"""HTML and SVG that a notebook shows: trees of elements, whose texts are escaped when written.

The output has no script, loads nothing, and takes its colours from the page around it.
"""

import re
from collections.abc import Iterable, Sequence
from typing import TypeAlias
from xml.etree.ElementTree import Element, tostring

from optuav.errors import printable
from optuav.looks import colour
from optuav.presentation.numbers import figure

Cell: TypeAlias = str | float | bool | Element | None

MOST_ROWS = 60  # Most rows shown of a long table
FIGURE = re.compile(r"[-+−]?(\d[\d.]*(·10\S+|e[-+−]?\d+)?|∞)( %)?|–")
KEPT = "\n\N{NO-BREAK SPACE}"
STYLE = (
    f"\n.optuav {{--flies: {colour('flies')}; --dry: {colour('dry')}}}"
    + """
.optuav {max-width: 64rem; font-size: .9em; line-height: 1.45; overflow-wrap: anywhere}
.optuav p {margin: .3em 0}
.optuav p.yes, .optuav p.no {border-left: .3em solid var(--flies); padding-left: .6em;
font-weight: bold}
.optuav p.no {border-color: var(--dry)}
.optuav div.wide {overflow-x: auto}
.optuav table {border-collapse: collapse; margin: .3em 0; font-variant-numeric: tabular-nums}
.optuav table th, .optuav table td {text-align: left !important;
vertical-align: baseline !important; color: inherit;
border: 0; border-bottom: 1px solid rgba(128, 128, 128, .3); padding: .15em .8em .15em 0;
white-space: normal; max-width: min(28rem, 70vw); background: none; overflow-wrap: break-word}
.optuav table td:has(> math) {max-width: none; white-space: nowrap}
.optuav table:not(.pairs) {width: max-content}
.optuav table .number {text-align: right !important; white-space: nowrap}
.optuav table tr.no td:first-child {box-shadow: inset .2em 0 var(--dry); padding-left: .5em}
.optuav summary {cursor: pointer}
.optuav svg {width: 100%; max-width: 44rem; height: auto; display: block; margin: .4em 0;
overflow: visible}
"""
)
IGNORED = "optuav tex2jax_ignore mathjax_ignore"  # MathJax reads no name as mathematics.


def element(tag: str, *content: str | Element, **attributes: str) -> Element:
    """An element with texts and elements in it; ``class_`` stands for the attribute class."""
    made = Element(tag, {name.strip("_").replace("_", "-"): v for name, v in attributes.items()})
    for child in content:
        if isinstance(child, Element):
            made.append(child)
        elif len(made):
            made[-1].tail = (made[-1].tail or "") + child
        else:
            made.text = (made.text or "") + child
    return made


def paragraph(text: str, *, good: bool | None = None) -> Element:
    """A paragraph; a verdict if it is known to be good or bad."""
    return element("p", text) if good is None else element("p", text, class_=yes_or_no(good))


def yes_or_no(value: object) -> str:
    """A truth value in a word."""
    return "yes" if value else "no"


def table(
    heads: Sequence[str],
    rows: Sequence[Sequence[Cell]],
    *,
    bad: Iterable[int] = (),
) -> Element:
    """A table of the first rows, figures on the right; bad rows are marked.

    Rows beyond `MOST_ROWS` are counted.
    """
    body, marked = [[_shown(cell) for cell in row] for row in rows[:MOST_ROWS]], {*bad}
    right = [all(_is_figure(row[k]) for row in body) for k in range(len(heads))]
    classes = ["number" if is_right else "words" for is_right in right]
    lines = []
    if any(heads):
        titles = zip(heads, classes, strict=True)
        lines.append(element("tr", *(element("th", head, class_=kind) for head, kind in titles)))
    for number, row in enumerate(body):
        cells = (element("td", c, class_=kind) for c, kind in zip(row, classes, strict=True))
        lines.append(element("tr", *cells, **({"class_": "no"} if number in marked else {})))
    wide = element("div", element("table", *lines), class_="wide")
    if hidden := len(rows) - len(body):
        wide.append(paragraph(f"and {hidden} more"))
    return wide


def pairs(rows: Iterable[tuple[str, Cell]]) -> Element:
    """A table of names and their values."""
    made = table(("", ""), [*rows])
    made[0].set("class", "pairs")
    return made


def fold(title: str, *content: Element, is_open: bool = False) -> Element:
    """Content below a title that shows and hides it."""
    made = element("details", element("summary", title), *content)
    if is_open:
        made.set("open", "")
    return made


def page(*content: Element) -> str:
    """Elements as the HTML of one object."""
    whole = element("div", element("style", STYLE), *content, class_=IGNORED)
    for node in whole.iter():
        node.text = printable(node.text or "", KEPT) or None
        node.tail = printable(node.tail or "", KEPT) or None
        for name, value in node.items():
            node.set(name, printable(value))
    return tostring(whole, encoding="unicode", method="html")


def _shown(cell: Cell) -> str | Element:
    """A cell as it is shown."""
    if cell is None:
        return "–"
    if isinstance(cell, bool):
        return yes_or_no(cell)
    return cell if isinstance(cell, str | Element) else figure(cell)


def _is_figure(cell: str | Element) -> bool:
    """Return whether a cell is a number, or the dash for none."""
    return isinstance(cell, str) and FIGURE.fullmatch(cell) is not None

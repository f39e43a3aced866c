"""Documents as trees of elements, written as one HTML page or as Markdown.

Text goes into the tree as it is and is escaped when the tree is written, so that a name that looks
like HTML or Markdown is shown as a name.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from urllib.parse import quote, unquote
from xml.etree.ElementTree import Element, tostring

MARKS = re.compile(r"[\\`*_\[\]<$|&~]|^\s*(?:[>#+=-]|\d+[.)])")
"""What Markdown would read as its own."""
STYLE = """
body { font: 16px/1.5 "DejaVu Sans", "Segoe UI", Arial, sans-serif; color: #222; margin: 2em auto;
  max-width: 58em; padding: 0 1em; overflow-wrap: break-word; }
h1 { font-size: 1.6em; } h2 { border-bottom: 1px solid #ccc; margin-top: 2.2em; font-size: 1.3em; }
nav ul { columns: 20em; padding-left: 1.2em; }
figure { margin: 1.6em 0; } figcaption { color: #444; font-size: .9em; margin-top: .4em; }
.wide { overflow-x: auto; } .wide img { width: 100%; min-width: 40em; height: auto; }
table { border-collapse: collapse; font-size: .88em; }
th, td { border-bottom: 1px solid #ddd; padding: .3em .7em; text-align: left; vertical-align: top; }
th { background: #f3f3f3; } td { font-variant-numeric: tabular-nums; }
summary { cursor: pointer; padding: .5em 0; color: #0645ad; }
@media (max-width: 45em) {
  body { margin: 1em auto; } th, td { padding: .25em .3em; } .plain { font-size: .74em; }
  figure:has(img) figcaption::before { content: "↔ Scroll the picture sideways. "; color: #777; }
  .cards tr:first-child { display: none; }
  .cards tr { display: block; border-bottom: 2px solid #bbb; padding: .5em 0; }
  .cards td { display: block; border: 0; padding: .1em 0; }
  .cards td:empty { display: none; }
  .cards td::before { content: attr(data-head) ": "; color: #666; }
}
"""


def element(tag: str, *content: str | Element, **attributes: str) -> Element:
    """An element with texts and elements in it; ``class_`` stands for the attribute class."""
    made = Element(tag, {name.strip("_").replace("_", "-"): v for name, v in attributes.items()})
    for each in content:
        if isinstance(each, Element):
            made.append(each)
        elif len(made):
            made[-1].tail = (made[-1].tail or "") + each
        else:
            made.text = (made.text or "") + each
    return made


def prose(text: str) -> Element:
    """A paragraph of our own words, in which code stands between backquotes."""
    parts = enumerate(text.split("`"))
    return element("p", *(element("code", part) if n % 2 else part for n, part in parts))


def listing(items: Iterable[str | Element]) -> Element:
    """Short texts, one a line."""
    return element("ul", *(element("li", item) for item in items))


def table(rows: Sequence[Sequence[str]], *, cards: bool = False) -> Element:
    """A table whose first row has the headings; as cards it is one block a row on a phone."""
    head, *body = rows
    lines = [element("tr", *(element("th", cell) for cell in head))]
    for row in body:
        cells = zip(head, row, strict=True)
        lines.append(element("tr", *(element("td", cell, data_head=name) for name, cell in cells)))
    return element(
        "div", element("table", *lines, class_="cards" if cards else "plain"), class_="wide"
    )


def figure(name: str, caption: str, rows: Sequence[Sequence[str]] = ()) -> Element:
    """A picture, or a table, with its caption and links to its files beside the page."""
    files = {} if rows else {"PNG": f"figures/{name}.png", "SVG": f"figures/{name}.svg"}
    links = [
        element("a", kind, href=quote(file))
        for kind, file in {**files, "CSV": f"data/{name}.csv"}.items()
    ]
    picture = element("img", alt=caption, src=quote(f"figures/{name}.png"))
    shown = table(rows) if rows else element("div", picture, class_="wide")
    words = [part for link in links for part in (" ", link)]
    return element("figure", shown, element("figcaption", f"{caption}.", *words))


def page(title: str, body: Element, pictures: Mapping[str, bytes]) -> str:
    """The document as one HTML page, with the PNG of its pictures by file inside."""
    body = deepcopy(body)
    for image in body.iter("img"):
        encoded = base64.b64encode(pictures[unquote(image.get("src", ""))]).decode("ascii")
        image.set("src", f"data:image/png;base64,{encoded}")
    for each in body.iter():
        if each.tag in ("p", "ul", "li", "tr", "figure", "section", "nav", "h1", "h2", "details"):
            each.tail = "\n"
    viewport = "width=device-width, initial-scale=1"
    head = element(
        "head",
        element("meta", charset="utf-8"),
        element("meta", name="viewport", content=viewport),
        element("title", title),
        element("style", STYLE),
    )
    whole = element("html", head, body, lang="en")
    return f"<!DOCTYPE html>\n{tostring(whole, encoding='unicode', method='html')}\n"


def markdown(body: Element) -> str:
    """The document as Markdown, with its pictures and data in files beside it."""
    return "\n\n".join(_blocks(body)) + "\n"


def _blocks(parent: Element) -> Iterator[str]:
    for each in parent:
        if each.tag in ("h1", "h2"):
            yield f"{'#' * int(each.tag[1])} {_inline(each)}"
        elif each.tag in ("p", "figcaption"):
            yield _inline(each)
        elif each.tag == "ul":
            yield "\n".join(f"- {_inline(item)}" for item in each)
        elif each.tag == "img":
            yield f"![{_plain(each.get('alt', ''))}]({each.get('src')})"
        elif each.tag == "table":
            head, *body = ([_inline(cell) for cell in row] for row in each)
            rows = [head, ["---"] * len(head), *body]
            yield "\n".join(f"| {' | '.join(row)} |" for row in rows)
        elif each.tag not in ("nav", "summary"):
            yield from _blocks(each)


def _inline(parent: Element) -> str:
    parts = [_plain(parent.text or "")]
    for each in parent:
        inner = _plain("".join(each.itertext()))
        link = f"[{inner}]({each.get('href')})"
        code = f"`{''.join(each.itertext())}`"
        parts += [code if each.tag == "code" else link, _plain(each.tail or "")]
    return "".join(parts)


def _plain(text: str) -> str:
    """Text on one line without marks of Markdown."""
    line = " ".join(text.splitlines())
    return MARKS.sub(lambda found: f"{found[0][:-1]}\\{found[0][-1]}", line)

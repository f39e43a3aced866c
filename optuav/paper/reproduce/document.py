"""A report as a list of blocks, written as Markdown and as one HTML page without other files."""

from __future__ import annotations

import base64
import html
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias
from urllib.parse import quote


@dataclass(frozen=True)
class Heading:
    """A heading; level 1 is the title."""

    text: str
    level: int = 2


@dataclass(frozen=True)
class Paragraph:
    """A paragraph of plain text."""

    text: str


@dataclass(frozen=True)
class Listing:
    """Short texts, one a line."""

    items: tuple[str, ...]


@dataclass(frozen=True)
class Table:
    """A table of plain texts."""

    head: tuple[str, ...]
    rows: Sequence[Sequence[str]]


@dataclass(frozen=True)
class Picture:
    """A picture by the name of its files, with the name of its data."""

    name: str
    caption: str


Block: TypeAlias = Heading | Paragraph | Listing | Table | Picture

CODE = re.compile("`([^`]*)`")
MARKS = re.compile(r"[_*<$]")
STYLE = """
body { font: 15px/1.5 "DejaVu Sans", "Segoe UI", Arial, sans-serif; color: #222; margin: 2em auto;
  max-width: 62em; padding: 0 1.2em; }
h1 { font-size: 1.7em; } h2 { border-bottom: 1px solid #ccc; margin-top: 2.2em; font-size: 1.3em; }
h3 { font-size: 1.05em; margin-top: 1.6em; }
figure { margin: 1.2em 0; } figcaption { color: #555; font-size: .9em; }
img { max-width: min(100%, 52em); height: auto; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: .82em; }
th, td { border-bottom: 1px solid #ddd; padding: .25em .6em; text-align: left;
  vertical-align: top; }
th { background: #f3f3f3; }
"""


def _files(name: str) -> tuple[tuple[str, str], ...]:
    """Kinds of a picture's files, and where they lie beside the report."""
    return (
        ("PNG", f"figures/{name}.png"),
        ("SVG", f"figures/{name}.svg"),
        ("CSV", f"data/{name}.csv"),
    )


def markdown(blocks: Iterable[Block]) -> str:
    """The report as Markdown; pictures and data lie beside it."""
    return "\n\n".join(_markdown(block) for block in blocks) + "\n"


def _markdown(block: Block) -> str:
    if isinstance(block, Heading):
        return f"{'#' * block.level} {_plain(block.text)}"
    if isinstance(block, Paragraph):
        return _plain(block.text)
    if isinstance(block, Listing):
        return "\n".join(f"- {_plain(item)}" for item in block.items)
    if isinstance(block, Table):
        rows = [block.head, ["---"] * len(block.head), *block.rows]
        return "\n".join(f"| {' | '.join(map(_cell, row))} |" for row in rows)
    links = " ".join(f"[{kind}]({place})" for kind, place in _files(block.name))
    caption = _plain(block.caption)
    return f"![{caption}](figures/{block.name}.png)\n\n{caption}. {links}"


def _plain(text: str) -> str:
    """Text without marks that Markdown would read as its own, but for code."""
    return "`".join(
        part if number % 2 else MARKS.sub(r"\\\g<0>", part)
        for number, part in enumerate(text.split("`"))
    )


def _cell(text: str) -> str:
    return text if set(text) == {"-"} else _plain(text).replace("|", r"\|").replace("\n", " ")


def page(title: str, blocks: Iterable[Block], pictures: Mapping[str, bytes]) -> str:
    """The report as one HTML page with its pictures inside.

    Parameters
    ----------
    title
        Of the page.
    blocks
        The report.
    pictures
        PNG by name.
    """
    body = "\n".join(_html(block, pictures) for block in blocks)
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{html.escape(title)}</title>\n<style>{STYLE}</style>\n</head>\n"
        f"<body>\n{body}\n</body>\n</html>\n"
    )


def _html(block: Block, pictures: Mapping[str, bytes]) -> str:
    if isinstance(block, Heading):
        return f"<h{block.level}>{html.escape(block.text)}</h{block.level}>"
    if isinstance(block, Paragraph):
        return f"<p>{_marked(block.text)}</p>"
    if isinstance(block, Listing):
        items = "".join(f"<li>{_marked(item)}</li>" for item in block.items)
        return f"<ul>{items}</ul>"
    if isinstance(block, Table):
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in block.head)
        rows = "\n".join(
            f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>"
            for row in block.rows
        )
        return f'<div class="wide"><table>\n<tr>{head}</tr>\n{rows}\n</table></div>'
    encoded = base64.b64encode(pictures[block.name]).decode("ascii")
    caption = html.escape(block.caption)
    return (
        f'<figure><img alt="{caption}" src="data:image/png;base64,{encoded}">'
        f"<figcaption>{caption}. {_links(block.name)}</figcaption></figure>"
    )


def _links(name: str) -> str:
    """To the files of a picture, which lie beside the page."""
    return " ".join(
        f'<a href="{html.escape(quote(place))}">{kind}</a>' for kind, place in _files(name)
    )


def _marked(text: str) -> str:
    """Text with what stands between backquotes as code."""
    return CODE.sub(r"<code>\1</code>", html.escape(text))

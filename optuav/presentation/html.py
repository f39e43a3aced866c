"""Blocks as HTML that a notebook shows."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from optuav.presentation.blocks import (
    Block,
    Blocks,
    Cell,
    Facts,
    Fold,
    Heading,
    Note,
    Picture,
    Table,
)
from optuav.presentation.markup import fold, page, pairs, paragraph, table


def as_html(blocks: Blocks) -> str:
    """Blocks as the HTML of one object."""
    return page(*(element for block in blocks for element in _elements(block)))


def _elements(block: Block) -> Iterator[Element]:
    match block:
        case Heading():
            yield paragraph(block.text, good=block.good)
        case Facts():
            if block.rows:
                yield pairs((label, ", ".join(words)) for label, *words in block.rows)
        case Note():
            yield from map(paragraph, block.lines)
        case Picture():
            yield block.draw()
        case Fold():
            inside = (element for part in block.blocks for element in _elements(part))
            if block.title:
                yield fold(block.title, *inside, is_open=block.is_open)
            else:
                yield from inside
        case Table():
            rows = [[*map(_long, row)] for row in block.rows]
            heads = block.heads or [""] * len(rows[0] if rows else ())
            lines = [table(heads, rows, bad=block.bad), *map(paragraph, block.below)]
            if block.label:
                title = ": ".join(filter(None, [block.label, block.above.removesuffix(":")]))
                yield fold(title, *lines, is_open=True)
            else:
                yield from map(paragraph, filter(None, [block.above]))
                yield from lines


def _long(cell: Cell) -> str:
    """The words of a cell, of two the long ones."""
    return cell if isinstance(cell, str) else cell[0]

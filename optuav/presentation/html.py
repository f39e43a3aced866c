"""Blocks as HTML that a notebook shows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element

from optuav.markup import pairs, paragraph, shown, table
from optuav.presentation.blocks import Block, Facts, Heading, Note, Table


def as_html(blocks: Iterable[Block]) -> str:
    """Blocks as the HTML of one object."""
    return shown(*(element for block in blocks for element in _elements(block)))


def _elements(block: Block) -> Iterator[Element]:
    match block:
        case Heading():
            yield paragraph(block.text)
        case Facts():
            yield pairs(block.rows)
        case Note():
            yield from map(paragraph, block.lines)
        case Table():
            yield from map(paragraph, filter(None, [block.above]))
            yield table(block.heads, block.rows)
            yield from map(paragraph, block.below)

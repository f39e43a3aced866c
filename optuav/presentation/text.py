"""Blocks as text: aligned lines of at most 80 columns, or as many as COLUMNS states."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate

from optuav.errors import line_width, printable, spelled
from optuav.presentation.blocks import Block, Facts, Heading, Note, Table

FILLER = "\0"


def as_lines(blocks: Iterable[Block]) -> Iterator[str]:
    """Blocks as lines, with a blank one between them; none between a heading and its facts."""
    above: Block | None = None
    for block in blocks:
        if above is not None and not (isinstance(above, Heading) and isinstance(block, Facts)):
            yield ""
        yield from _lines(block)
        above = block


def _lines(block: Block) -> Iterator[str]:
    match block:
        case Heading():
            yield block.text
        case Facts():
            yield from (f"{label:{block.label_width}}{words}" for label, words in block.rows)
        case Note():
            yield from block.lines
        case Table():
            yield from filter(None, [block.above])
            rows = [block.heads, *block.rows]
            yield from tabulated(rows, block.words, block.last, block.gap, block.longest)
            yield from block.below


def tabulated(
    rows: Sequence[Sequence[str]], words: int = 1, last: int = 0, gap: int = 2, longest: int = 24
) -> list[str]:
    """Rows of cells as aligned lines: columns of words, of figures, and the last again of words.

    Long cells are cut. A table too wide for a line has parts, each with the first words.
    """
    sides = "<" * words + ">" * (len(rows[0]) - words - last) + "<" * last
    columns, widths, room = list[list[str]](), list[int](), line_width() + gap
    cut = spelled("…")
    for column, side in zip(zip(*rows, strict=True), sides, strict=True):
        cells = [
            cell if len(cell) <= longest else cell[: longest - len(cut)].rstrip(FILLER) + cut
            for cell in map(as_wide, map(spelled, column))
        ]
        widths.append(max(map(len, cells)) + gap)
        columns.append([f"{cell:{side}{widths[-1] - gap}}" for cell in cells])
    first = max(1, sum(end <= room / 2 for end in accumulate(widths[:words])))
    parts = [[*range(first)]]
    for number in range(first, len(widths)):
        if sum(widths[part] for part in (*parts[-1], number)) > room and len(parts[-1]) > first:
            parts.append([*range(first)])
        parts[-1].append(number)
    return [
        (" " * gap).join(row).rstrip().replace(FILLER, "")
        for part in parts
        for row in zip(*(columns[name] for name in part), strict=True)
    ]


def as_wide(text: str) -> str:
    """Printable text as long as it is wide: a filler before each letter that takes two columns."""
    wide = unicodedata.east_asian_width
    return "".join(FILLER * (wide(each) in "WF") + each for each in printable(text))

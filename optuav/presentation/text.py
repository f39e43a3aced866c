"""Blocks as text: aligned lines as wide as the terminal, 80 columns elsewhere, or COLUMNS."""

from __future__ import annotations

import math
import os
import re
import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from itertools import accumulate

from optuav.errors import encodable, printable
from optuav.presentation.blocks import (
    Block,
    Blocks,
    Cell,
    Facts,
    Fold,
    Heading,
    Note,
    Table,
)

FILLER = "\0"
NO_BREAK = "\N{NO-BREAK SPACE}"
NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(?:s|m|N|A|W|J|%|m/s|A s)\b|%)")
GAP = 2  # Blanks between columns
LABEL = 13  # Columns of the labels of facts
LEAST_COLUMNS = 60  # Fewest columns of a legible table
WIDEST_COLUMNS = 120  # Most columns of a terminal that lines fill
LEAST_CELL = 15  # Columns for the words of a row at least
LEAST_ROOM, ROOM = 24, 36  # Columns for a last cell, and for one that is long, beside the others


def line_width(most: int = 80) -> int:
    """The width of COLUMNS; else of the terminal, 60 to 120; without a terminal `most`."""
    from shutil import get_terminal_size

    columns = get_terminal_size((0, 0)).columns or most
    widest = max(most, WIDEST_COLUMNS)
    return max(LEAST_COLUMNS, columns if os.environ.get("COLUMNS") else min(widest, columns))


def as_text(blocks: Blocks, most: int = 80) -> str:
    """Blocks as lines that fit the terminal, with signs that the standard output can show.

    Blank lines stand between blocks, but none between a heading and its facts.
    """
    lines, width, above = list[str](), line_width(most), None
    for block in _in_text(blocks):
        if above is not None and not (isinstance(above, Heading) and isinstance(block, Facts)):
            lines.append("")
        lines += _lines(block, width)
        above = block
    return "\n".join(lines)


def _in_text(blocks: Blocks) -> Iterator[Heading | Facts | Table | Note]:
    """The blocks that text shows: none without content, no pictures."""
    for block in blocks:
        match block:
            case Fold():
                yield from _in_text(block.blocks) if block.in_text else ()
            case Heading():
                yield block
            case Table() if block.heads or block.rows:
                yield block
            case Facts(rows=content) | Note(lines=content) if content:
                yield block


def _lines(block: Block, width: int) -> Iterator[str]:
    match block:
        case Heading():
            yield from filled(block.text, width, below=2, whole=True)
        case Facts():
            margin = max(LABEL, *(len(label) + GAP for label, *_ in block.rows))
            figures = [len(row[1]) for row in block.rows if len(row) > 2]
            for label, *figure, words in block.rows:
                start = f"{label:<{margin}}" + "".join(f"{x:>{max(figures)}}   " for x in figure)
                yield from filled(words, width, start, margin, whole=block.whole)
        case Note():
            for line in block.lines:
                yield from filled(line, width, below=2, whole=True)
        case Table():
            margin = LABEL * bool(block.label)
            lines = filled(block.above, width, " " * margin, margin or 2) if block.above else []
            rows = [block.heads, *block.rows] if block.heads else block.rows
            sides = "<" * block.words + ">" * (len(rows[0]) - block.words - block.last)
            sides += "<" * block.last
            if block.heads:
                lines += (" " * margin + line for line in _cut(rows, sides, block, width - margin))
            else:
                lines += lined_up(rows, width, " " * margin, sides=sides)
            for line in block.below:
                lines += filled(line, width, " " * margin, margin or 2)
            yield f"{block.label:<{margin}}{lines[0][margin:]}"
            yield from lines[1:]


def filled(
    text: str, width: int, start: str = "", below: int | None = None, *, whole: bool = False
) -> list[str]:
    """A paragraph behind a start, its other lines below; a number keeps its unit on its line.

    A word too long for a line is broken, unless it is to stay whole.
    """
    below = len(start) if below is None else below
    lead = len(text) - len(text.lstrip(" "))
    wide = NUMBER_AND_UNIT.sub(NO_BREAK, _wide(text))
    room = width - (FILLER in wide)  # A break may part a letter from its filler
    wrapper = textwrap.TextWrapper(room, start, " " * (below + lead), break_on_hyphens=False)
    wrapper.break_long_words = not whole
    return [_narrow(line).rstrip() for line in wrapper.wrap(wide) or [start]]


def lined_up(
    rows: Sequence[Sequence[Cell]],
    width: int,
    indent: str = "",
    *,
    sides: str = "",
    longest: float = math.inf,
    whole: bool = False,
) -> list[str]:
    """Rows as lined-up columns; the last one continues on lines of its own where it is long.

    First cells that are longer than `longest` stand on the line before the rest of their row.
    """
    cells = [[_fitting(cell) for cell in row] for row in rows]
    heads = ["" if len(row[0]) > longest else row[0] for row in cells]
    table = [[head, *row[1:]] for head, row in zip(heads, cells, strict=True)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)][:-1]
    least = len(indent) + sum(widths) + GAP * len(widths)
    if math.isfinite(longest) and least > width - LEAST_ROOM:
        widths[2:] = [0 for _ in widths[2:]]  # Lined up no further
    lines = []
    for (first, *_), row in zip(cells, table, strict=True):
        if first != row[0]:
            lines.append(_narrow(f"{indent}{first}"))
        padded = zip(row, widths, sides or "<" * len(row), strict=False)
        start = indent + "".join(f"{cell:{side}{size}}" + " " * GAP for cell, size, side in padded)
        last, below = row[-1].replace(FILLER, ""), len(indent) + 2 * GAP
        if width - len(start) < LEAST_ROOM:  # The first cells are a paragraph with the last
            start, last = indent, f"{start[len(indent) :]}{last}"
        elif width - len(start) > ROOM:
            below = len(start) + GAP
        lines += filled(last, width, start, below, whole=whole)
    return lines


def _cut(rows: Sequence[Sequence[Cell]], sides: str, block: Table, width: int) -> list[str]:
    """Rows of cells as aligned lines, in which long cells are cut.

    A table too wide for a line has parts, each with the first words.
    """
    columns, widths, room = list[list[str]](), list[int](), width + block.gap
    others = [[len(_fitting(row[k])) for row in rows] for k in range(len(sides))]
    taken = sum(max(column) + block.gap for k, column in enumerate(others) if k != block.words - 1)
    left = {block.words - 1: max(LEAST_CELL, width - taken)} if block.longest is None else {}
    for k, side in enumerate(sides):
        cells = [_fitting(row[k], left.get(k, block.longest)) for row in rows]
        widths.append(max(map(len, cells)) + block.gap)
        columns.append([f"{cell:{side}{widths[-1] - block.gap}}" for cell in cells])
    first = max(1, sum(end <= room / 2 for end in accumulate(widths[: block.words])))
    parts = [[*range(first)]]
    for number in range(first, len(widths)):
        if sum(widths[part] for part in (*parts[-1], number)) > room and len(parts[-1]) > first:
            parts.append([*range(first)])
        parts[-1].append(number)
    return [
        _narrow((" " * block.gap).join(row)).rstrip()
        for part in parts
        for row in zip(*(columns[name] for name in part), strict=True)
    ]


def _fitting(cell: Cell, longest: int | None = None) -> str:
    """A cell as wide text; beyond the longest its short form, or cut."""
    forms = [_wide(form) for form in ((cell,) if isinstance(cell, str) else cell)]
    if longest is None:
        return forms[0]
    fitting = next((form for form in forms if len(form) <= longest), forms[-1])
    cut = encodable("…")
    if len(fitting) > longest:
        return fitting[: longest - len(cut)].rstrip(FILLER) + cut
    return fitting


def _wide(text: str) -> str:
    """Printable text as long as it is wide: a filler before each letter that takes two columns."""
    shown = NO_BREAK.join(printable(encodable(piece)) for piece in text.split(NO_BREAK))
    wide = unicodedata.east_asian_width
    return shown if shown.isascii() else "".join(FILLER * (wide(x) in "WF") + x for x in shown)


def _narrow(text: str) -> str:
    """Wide text as it is written, which a blank may part."""
    return text.replace(NO_BREAK, " ").replace(FILLER, "")

"""The blocks that everything shown consists of: headings, facts, tables and notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias


@dataclass(frozen=True)
class Heading:
    """A line that says what follows; facts stand right below it."""

    text: str


@dataclass(frozen=True)
class Facts:
    """Labels with their words, one line each."""

    rows: Sequence[tuple[str, str]]
    label_width: int = 12  # Columns of the labels in text


@dataclass(frozen=True)
class Table:
    """Rows of cells below their heads: columns of words, of figures, and the last again of words.

    Text cuts cells that are too long.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    words: int = 1  # First columns of words
    last: int = 0  # Last columns of words
    gap: int = 2  # Blanks between columns in text
    longest: int = 24  # Most characters of a cell in text
    above: str = ""  # A line directly above
    below: Sequence[str] = ()  # Lines directly below


@dataclass(frozen=True)
class Note:
    """Sentences, each on a line of its own."""

    lines: Sequence[str]


Block: TypeAlias = Heading | Facts | Table | Note

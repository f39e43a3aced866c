"""The blocks that everything shown consists of: headings, facts, tables, notes and pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from xml.etree.ElementTree import Element

Cell: TypeAlias = str | tuple[str, str]
"""The words of a cell; or long ones, and short ones where text has no room for them."""


@dataclass(frozen=True)
class Heading:
    """A line that says what follows, facts right below it; a verdict if it is good or bad."""

    text: str
    good: bool | None = None


@dataclass(frozen=True)
class Facts:
    """Labels with their words, one line each; a figure between them stands in a column."""

    rows: Sequence[tuple[str, str] | tuple[str, str, str]]
    whole: bool = False  # Whether a word too long for a line, as a path, stays whole


@dataclass(frozen=True)
class Table:
    """Rows of cells below their heads: columns of words, of figures, and the last again of words.

    Text cuts cells that are too long. Without heads the last column goes on below itself.
    """

    heads: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    words: int = 1  # First columns of words
    last: int = 0  # Last columns of words
    gap: int = 2  # Blanks between columns in text
    longest: int | None = 24  # Most characters of a cell in text; None for what a line leaves
    label: str = ""  # In the margin of text, and above what HTML folds
    above: str = ""  # A line directly above
    below: Sequence[str] = ()  # Lines directly below
    bad: Sequence[int] = ()  # Rows that HTML marks


@dataclass(frozen=True)
class Note:
    """Sentences, each on a line of its own."""

    lines: Sequence[str]


@dataclass(frozen=True)
class Picture:
    """A picture, which text leaves out."""

    draw: Callable[[], Element]


@dataclass(frozen=True)
class Fold:
    """Blocks below a title that HTML folds, if there is one; text has them without it, or not."""

    title: str
    blocks: Sequence[Block]
    is_open: bool = False
    in_text: bool = True


Block: TypeAlias = Heading | Facts | Table | Note | Picture | Fold
Blocks: TypeAlias = Iterable[Block]

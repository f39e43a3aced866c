"""Blocks: their layout as text, and the same words as HTML."""

from optuav.presentation.blocks import Facts, Heading, Note, Table
from optuav.presentation.html import as_html
from optuav.presentation.text import as_lines

BLOCKS = (
    Heading("A day"),
    Facts([("Hover", "9 s"), ("Rest", "7 s")], label_width=8),
    Table(["place", "for [s]"], [["b1", "7.00"], ["hover", "19.00"]], above="Stops", below=["all"]),
    Note(["First.", "a < b & c"]),
)
TEXT = """\
A day
Hover   9 s
Rest    7 s

Stops
place  for [s]
b1        7.00
hover    19.00
all

First.
a < b & c"""


def test_text_has_blank_lines_between_blocks_but_below_a_heading_of_facts() -> None:
    assert "\n".join(as_lines(BLOCKS)) == TEXT


def test_a_heading_stands_apart_from_a_table() -> None:
    heading, _, table, _ = BLOCKS
    assert [*as_lines([heading, table])][:3] == ["A day", "", "Stops"]


def test_html_has_the_same_words_escaped() -> None:
    """Facts are a table of pairs, figures stand on the right."""
    page = as_html(BLOCKS)
    assert "<p>A day</p>" in page
    assert '<table class="pairs"><tr><td class="words">Hover</td>' in page
    assert '<td class="number">19.00</td>' in page
    assert page.index("<p>Stops</p>") < page.index("<p>all</p>") < page.index("<p>First.</p>")
    assert "a &lt; b &amp; c" in page

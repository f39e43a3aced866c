"""Blocks: their layout as text, and the same words as HTML."""

from xml.etree.ElementTree import Element

import pytest

from optuav.presentation.blocks import Facts, Fold, Heading, Note, Picture, Table
from optuav.presentation.html import as_html
from optuav.presentation.text import as_text, filled

BLOCKS = (
    Heading("A day", good=True),
    Facts([("Hover", "9.00 s", "at b1"), ("Rest", "17.00 s", "at b2"), ("Route", "b1 → b2")]),
    Table(["place", "for [s]"], [["b1", "7.00"], ["hover", "19.00"]], above="Stops", below=["all"]),
    Table((), [["2 ×", "charge"], ["sum", "all"]], words=2, label="Proof", above="added up:"),
    Picture(lambda: Element("svg")),
    Fold("More", [Note(["First.", "a < b & c"])]),
    Fold("Hidden", [Note(["Only where there is room."])], in_text=False),
    Facts([]),
)
TEXT = """\
A day
Hover         9.00 s   at b1
Rest         17.00 s   at b2
Route        b1 → b2

Stops
place  for [s]
b1        7.00
hover    19.00
all

Proof        added up:
             2 ×  charge
             sum  all

First.
a < b & c"""


def test_text_has_blank_lines_between_blocks_but_below_a_heading_of_facts() -> None:
    """Figures of facts end in one column, a label stands in the margin of its table."""
    assert as_text(BLOCKS) == TEXT


def test_a_heading_stands_apart_from_a_table() -> None:
    heading, _, table, *_ = BLOCKS
    assert as_text([heading, table]).splitlines()[:3] == ["A day", "", "Stops"]


def test_html_has_the_same_words_escaped() -> None:
    """Facts are a table of pairs, figures stand on the right, a labelled table is folded open."""
    page = as_html(BLOCKS)
    assert '<p class="yes">A day</p>' in page
    assert '<table class="pairs"><tr><td class="words">Hover</td>' in page
    assert "9.00 s, at b1" in page
    assert '<td class="number">19.00</td>' in page
    assert page.index("<p>Stops</p>") < page.index("<p>all</p>") < page.index("<p>First.</p>")
    assert '<details open=""><summary>Proof: added up</summary>' in page
    assert "<details><summary>More</summary><p>First.</p>" in page
    assert "Only where there is room." in page
    assert "a &lt; b &amp; c" in page
    assert "<svg" in page


@pytest.mark.parametrize("columns", ["60", "80", "200"])
def test_no_line_is_wider_than_the_terminal(columns: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Words wrap beside their label, a wide table has parts; names keep to their side of a cell."""
    monkeypatch.setenv("COLUMNS", columns)
    words = "a battery of 36000 A s hovers 597.27 s " * 8
    row = ["a place with a long name", *(f"{number:.3f}" for number in range(12))]
    heads = ["place", *(f"figure {number}" for number in range(12))]
    blocks = (
        Heading(words),
        Facts([("Why", words), ("Because", "1 s", words)]),
        Note([words]),
        Table(heads, [row], longest=12),
        Table((), [("once", words), ("twice", words)], words=2, label="Proof", above=words),
    )
    lines = as_text(blocks).splitlines()
    assert max(map(len, lines)) <= int(columns)
    assert max(map(len, lines)) > int(columns) - 20
    assert (
        sum(line.startswith("a place") for line in lines) == {"60": 3, "80": 2, "200": 1}[columns]
    )


def test_a_number_keeps_its_unit_on_its_line() -> None:
    """ "… 36000 A s" moves to the next line as one."""
    first, second = filled("the battery holds 36000 A s", 22)
    assert (first, second) == ("the battery holds", "36000 A s")


def test_a_cell_without_room_has_its_short_form(monkeypatch: pytest.MonkeyPatch) -> None:
    """A flight is told by both places, or by its end."""
    name = "a" * 20
    table = Table(("where", "s"), [((f"{name} → {name}", f"→ {name}"), "1")], longest=None)
    monkeypatch.setenv("COLUMNS", "80")
    assert f"{name} → {name}" in as_text([table])
    short = Table(("where", "s"), [((f"{name} → {name}", f"→ {name}"), "1")], longest=30)
    assert as_text([short]).splitlines()[1] == f"→ {name}  1"

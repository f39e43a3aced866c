"""A model as a page for a notebook, in MathML, which browsers set without a script."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from xml.etree.ElementTree import Element, fromstring

from optuav.errors import printable
from optuav.modelling.declaration import Declaration
from optuav.modelling.display import parameters, sections
from optuav.modelling.expression import Variable
from optuav.modelling.writer import LIST, MARKED, Text, Written, parts_of
from optuav.presentation.markup import Cell, fold, paragraph, table

THIN = '<mspace width="0.17em"/>'
MARKUP_OR_SIGN = re.compile(r"<(mi|mn|mo|mtext)>[^<]*</\1>|<[^>]*>|\s+|\d[\d.]*|.")
"""A piece of what `MathML` writes: a finished token, a tag, a number or a sign."""


def html(model: Declaration) -> list[Element]:
    """The model as rows of mathematics, and its parameters as a folded table."""
    writer, rows = MathML(marks=True), list[Sequence[Cell]]()
    for head, lines in sections(model, writer):
        for number, (maths, name) in enumerate(lines):
            rows.append(("" if number else head, as_element(maths), name))
    parts = [paragraph(model.title), table(("", "", ""), rows)]
    shown_parameters = [
        (as_element(writer.symbol(symbol)), value, "" if unit == "1" else unit, name, key)
        for symbol, name, value, unit, key in parameters(model, Text())
    ]
    if shown_parameters:
        heads = ("symbol", "value", "unit", "name", "key of the mission")
        parts.append(
            fold(f"where ({len(shown_parameters)} parameters)", table(heads, shown_parameters))
        )
    return parts


class MathML(Text):
    """MathML with bare numbers and signs, until `as_element` makes elements of them."""

    several = "{}<mtext> values, </mtext>{}<mtext> to </mtext>{}".replace(" ", Text.after)
    aside = ',<mspace width="1em"/>'
    bracketed, size = "<mrow>({})</mrow>", "<mrow>|{}|</mrow>"
    root, root_takes = "<msqrt>{}</msqrt>", LIST

    def symbol(self, symbol: str) -> str:
        """A symbol with its subscripts; sums of symbols are sums, and words stay words."""
        if (parts := parts_of(symbol)) is None:
            if re.search(r"[|+−]", symbol):
                return re.sub(r"[^\s|+−]+", lambda each: self.symbol(each[0]), symbol)
            return self.words(symbol)
        below = f"<mrow>{'<mo>,</mo>'.join(map(_name, parts.below))}</mrow>"
        base, above = _name(parts.base), f"<mo>{'′' * len(parts.primes)}</mo>"
        if parts.primes:
            both = f"<msubsup>{base}{below}{above}</msubsup>"
            return both if parts.below else f"<msup>{base}{above}</msup>"
        return f"<msub>{base}{below}</msub>" if parts.below else base

    def unit(self, unit: str) -> str:
        """A unit after a thin space; nothing for ``"1"``."""
        return "" if unit == "1" else THIN + self.words(unit)

    def words(self, words: str) -> str:
        """Words as text."""
        return f"<mtext>{_safe(words).replace(' ', self.after)}</mtext>"

    def interval(self, variable: Variable) -> str:
        """The values that a variable may take, in brackets of their own height."""
        return f"<mrow>{super().interval(variable)}</mrow>"

    def _times(self, left: str, right: str) -> str:
        return f"{left}·{right}" if right[0].isdigit() else f"{left}{THIN}{right}"

    def _over(self, above: Written, below: Written) -> str:
        return f"<mfrac><mrow>{above.text}</mrow><mrow>{below.text}</mrow></mfrac>"

    def _power(self, base: str, exponent: Written) -> str:
        return f"<msup><mrow>{base}</mrow><mrow>{exponent.text}</mrow></msup>"

    def _function(self, name: str, arguments: str) -> str:
        return f"<mi>{_safe(name)}</mi><mrow>({arguments})</mrow>"


def as_element(written: str) -> Element:
    """Return the output of `MathML` as an element in display style."""
    whole = "".join(map(_token, MARKUP_OR_SIGN.finditer(written)))
    return fromstring(f'<math displaystyle="true"><mrow>{whole}</mrow></math>')


def _token(piece: re.Match[str]) -> str:
    """A piece as it is, or as the element that it is the content of."""
    text = piece[0]
    if text.startswith("<") or text.isspace():
        return text.strip()
    if text == "|":
        return '<mo stretchy="false" lspace="0" rspace="0">|</mo>'
    kind = "mn" if text[0].isdigit() else "mi" if text.isalpha() or text == "∞" else "mo"
    return f"<{kind}>{text}</{kind}>"


def _name(letters: str) -> str:
    """A letter in italics, more letters upright, and numbers; marked ones may become a letter."""
    is_number = letters.isdigit() and letters[0] not in MARKED
    return f"<mn>{letters}</mn>" if is_number else f"<mi>{_safe(letters)}</mi>"


def _safe(text: str) -> str:
    """Text from anywhere, as XML takes it."""
    return escape(printable(text))

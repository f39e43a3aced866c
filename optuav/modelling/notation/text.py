"""Mathematics in a line of Unicode."""

from __future__ import annotations

import re
from collections.abc import Mapping

from optuav.modelling.expression import Sense
from optuav.modelling.notation.rules import ATOM, POWER, PRODUCT, Notation, Written

SUPERSCRIPTS = str.maketrans("−0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Text(Notation):
    """A line of Unicode; it may be broken at a space, not at a no-break space."""

    minus = "−"
    infinity = "∞"
    after = "\N{NO-BREAK SPACE}"
    several = "{} values, {} to {}".replace(" ", after)
    span = "{} … {}"
    aside = ", "
    member = "∈"
    binary = "{0, 1}"
    senses: Mapping[Sense, str] = {"<=": "≤", ">=": "≥", "==": "="}

    def symbol(self, symbol: str) -> str:
        """A symbol as it stands."""
        return symbol

    def unit(self, unit: str) -> str:
        """A unit as it stands."""
        return "" if unit == "1" else f" {unit}"

    def words(self, words: str) -> str:
        """Words as they stand."""
        return words

    def bracket(self, inner: str) -> str:
        """(a)."""
        return f"({inner})"

    def times(self, left: str, right: str) -> str:
        """a·b."""
        return f"{left}·{right}"

    def over(self, above: Written, below: Written) -> Written:
        """a/b, with room around the slash where there are brackets."""
        left, right = self.at_least(PRODUCT, above), self.at_least(POWER, below)
        roomy = left.endswith(")") or right.startswith("(")
        slash = f" /{self.after}" if roomy else "/"
        return Written(f"{left}{slash}{right}", PRODUCT)

    def power(self, base: str, exponent: Written) -> str:
        """a² or a^b."""
        if re.fullmatch(r"−?\d+", exponent.text):
            return f"{base}{exponent.text.translate(SUPERSCRIPTS)}"
        return f"{base}^{self.at_least(ATOM, exponent)}"

    def root(self, inner: Written) -> Written:
        """√a or √(a + b)."""
        return Written(f"√{self.at_least(ATOM, inner)}", POWER)

    def size(self, inner: str) -> str:
        """|a|."""
        return f"|{inner}|"

    def function(self, name: str, arguments: str) -> str:
        """f(a, b)."""
        return f"{name}({arguments})"

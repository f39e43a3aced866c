"""Mathematics in LaTeX."""

from __future__ import annotations

import re
from collections.abc import Mapping

from optuav.modelling.expression import Sense
from optuav.modelling.notation.rules import ATOM, PRODUCT, Notation, Written


class Latex(Notation):
    """LaTeX for its mathematics mode, in the words that matplotlib's mathtext knows as well."""

    minus = "-"
    infinity = r"\infty"
    several = r"{} \text{{ values, }} {} \text{{ to }} {}"
    span = r"{}, \ldots, {}"
    aside = r",\quad "
    member = r"\in"
    binary = r"\{0, 1\}"
    senses: Mapping[Sense, str] = {"<=": r"\leq", ">=": r"\geq", "==": "="}

    def symbol(self, symbol: str) -> str:
        """A symbol with its subscripts; words stay words."""
        parts = re.fullmatch(r"([^\W\d_]+)(\d*)('*)(?:_([^\W_]+(?:,[^\W_]+)*))?('*)", symbol)
        if parts is None:
            return self.words(symbol)
        base, index, primes, subscript, more_primes = parts.groups(default="")
        below = ",".join(_name(part) for part in (index, *subscript.split(",")) if part)
        below = below if len(below) == 1 else f"{{{below}}}"
        return f"{_name(base)}{primes}{more_primes}" + (f"_{below}" if below != "{}" else "")

    def unit(self, unit: str) -> str:
        """A unit in upright letters."""
        upright = _escaped(unit).replace(" ", r"\,").replace("²", "^2").replace("³", "^3")
        return "" if unit == "1" else rf"\,\mathrm{{{upright}}}"

    def words(self, words: str) -> str:
        """Words as text; Greek letters among them stay letters."""
        parts = re.split(f"([{''.join(GREEK)}])", words)
        return "".join(
            GREEK[part] if part in GREEK else rf"\text{{{_escaped(part)}}}"
            for part in parts
            if part
        )

    def bracket(self, inner: str) -> str:
        """(a), as tall as what it holds."""
        return rf"\left({inner}\right)"

    def times(self, left: str, right: str) -> str:
        """The factors side by side, with a dot before a number."""
        return rf"{left} \cdot {right}" if right[0].isdigit() else rf"{left}\,{right}"

    def over(self, above: Written, below: Written) -> Written:
        """A fraction."""
        return Written(rf"\frac{{{above.text}}}{{{below.text}}}", PRODUCT)

    def power(self, base: str, exponent: Written) -> str:
        """A power; a prime must not meet a superscript."""
        base = f"{{{base}}}" if "'" in base else base
        return f"{base}^{{{exponent.text}}}"

    def root(self, inner: Written) -> Written:
        """A square root."""
        return Written(rf"\sqrt{{{inner.text}}}", ATOM)

    def size(self, inner: str) -> str:
        """|a|, as tall as what it holds."""
        return rf"\left|{inner}\right|"

    def function(self, name: str, arguments: str) -> str:
        """f(a, b) with an upright f."""
        upright = rf"\{name}" if name in OPERATORS else rf"\operatorname{{{_escaped(name)}}}"
        return f"{upright}{self.bracket(arguments)}"


OPERATORS = frozenset({"exp", "ln", "max", "min", "sin", "cos", "tan", "tanh"})
"""Functions that LaTeX has a name for."""

GREEK: Mapping[str, str] = {
    letter: rf"\{name}"
    for letter, name in re.findall(
        r"(\w) (\w+)",
        "α alpha β beta γ gamma δ delta ε epsilon ζ zeta η eta θ theta ι iota κ kappa λ lambda "
        "μ mu ν nu ξ xi π pi ρ rho σ sigma τ tau υ upsilon φ phi χ chi ψ psi ω omega ϱ varrho "
        "Γ Gamma Δ Delta Θ Theta Λ Lambda Ξ Xi Π Pi Σ Sigma Φ Phi Ψ Psi Ω Omega",
    )
}


def _escaped(text: str) -> str:
    return re.sub(r"([_%&#${}])", r"\\\1", text)


def _name(letters: str) -> str:
    """A letter in italics, more letters upright."""
    if letters in ("min", "max"):
        return rf"\{letters}"
    if len(letters) == 1 or letters.isdigit():
        return GREEK.get(letters, letters)
    if any(letter in GREEK for letter in letters):
        return r"\,".join(map(_name, letters))
    return rf"\mathrm{{{letters}}}"

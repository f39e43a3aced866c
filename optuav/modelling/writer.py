"""Expressions in the notation of mathematics: a line of Unicode, or LaTeX."""

import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from typing import NamedTuple

import numpy as np

from optuav.modelling.expression import (
    INDEX,
    Indexed,
    Leaf,
    Let,
    Operand,
    Relation,
    Sense,
    Variable,
)
from optuav.modelling.traversal import fold, outermost

LIST, SUM, SIGN, PRODUCT, POWER, ATOM = range(6)  # How tightly a written expression holds together

NAMES: Mapping[np.ufunc, str] = {
    np.log: "ln",
    np.arctan2: "atan2",
    np.maximum: "max",
    np.minimum: "min",
    np.sign: "sgn",
}
"""Functions whose name in mathematics is not NumPy's."""

DIGITS = 7
LEAST_WITHOUT_POWER, MOST_WITHOUT_POWER = (
    1e-4,
    10.0**DIGITS,
)  # Numbers between these are written without a power of ten
GUARD = 1e-100  # max(x, g) with a positive g below this is written as x
SUPERSCRIPTS = str.maketrans("−0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MARKED = "𝟎𝟏𝟐𝟑𝟒𝟓𝟔𝟕𝟖𝟗"  # Digits of the numbers of symbols while a page is put together
MARKS = str.maketrans("0123456789", MARKED)


class Written(NamedTuple):
    """An expression in writing, how tightly it holds together, and its negative if that is simpler.

    With the negative, −(exp(x) − 1) is written 1 − exp(x), and a·(−b) as −a·b. A sum has its
    opposite beside it: where a + b is too long for a bracket, c − (a + b) is written c − a − b.
    """

    text: str
    level: int
    negative: "Written | None" = None
    opposite: str = ""


ONE = Written("1", ATOM)


class Text:
    """Mathematics in a line of Unicode; it may be broken at a space, not at a no-break space.

    With `marks`, the numbers of `Indexed` symbols are written in digits of their own, `MARKED`.
    """

    minus, infinity, member, binary = "−", "∞", "∈", "{0, 1}"
    after = "\N{NO-BREAK SPACE}"
    """Text between an operator and the term that follows it."""
    several = "{} values, {} to {}".replace(" ", after)
    span = "{} … {}"
    """Whole numbers from a first to a last one."""
    aside = ", "
    """Between a relation and where it holds."""
    bracketed, size, root = "({})", "|{}|", "√{}"
    root_takes = ATOM
    """Precedence that the operand of a root needs."""
    senses: Mapping[Sense, str] = {"<=": "≤", ">=": "≥", "==": "="}
    longest_bracket: float = np.inf
    """Largest width of a sum subtracted in brackets, where no line is broken."""

    def __init__(self, *, marks: bool = False) -> None:
        self.marks = marks

    def symbol(self, symbol: str) -> str:
        """A symbol such as ``"P_0,hv"``."""
        return symbol

    def unit(self, unit: str) -> str:
        """A unit after a number or an interval; nothing for ``"1"``."""
        return "" if unit == "1" else f" {unit}"

    def words(self, words: str) -> str:
        """Words among mathematics."""
        return words

    def _times(self, left: str, right: str) -> str:
        return f"{left}·{right}"

    def _over(self, above: Written, below: Written) -> str:
        """A fraction, with room around the slash where there are brackets."""
        left, right = self._at_least(PRODUCT, above), self._at_least(POWER, below)
        roomy = left.endswith(")") or right.startswith("(")
        return f"{left} /{self.after}{right}" if roomy else f"{left}/{right}"

    def _power(self, base: str, exponent: Written) -> str:
        if re.fullmatch(r"−?\d+", exponent.text):
            return f"{base}{exponent.text.translate(SUPERSCRIPTS)}"
        return f"{base}^{self._at_least(ATOM, exponent)}"

    def _function(self, name: str, arguments: str) -> str:
        return f"{name}({arguments})"

    def write(self, expression: Operand | Relation) -> str:
        """An expression, a number, an array of numbers or a relation."""
        if isinstance(expression, Relation):
            left, right = map(self.write, expression.sides)
            return f"{left} {self.senses[expression.sense]}{self.after}{right}"
        names = {id(node): self.named(node) for node in outermost(expression)}
        return self._operand(fold(expression, self.named, self._call, done=names)).text

    def named(self, node: Leaf | Let) -> Written:
        """The symbol of a leaf or a named quantity."""
        symbol = node.symbol
        if self.marks and isinstance(symbol, Indexed):
            symbol = symbol.pattern[: -len(INDEX)] + str(symbol.number).translate(MARKS)
        return Written(self.symbol(symbol), ATOM)

    def number(self, value: Operand) -> Written:
        """A number; an array of different numbers as its size and range."""
        entries = np.unique(np.asarray(value, float))
        if len(entries) > 1:
            ends = np.fmin.reduce(entries), np.fmax.reduce(entries)
            written = (self.number(end).text for end in ends)
            return Written(self.several.format(np.size(value), *written), LIST)
        number = float(entries[0]) + 0.0  # no −0
        if number < 0.0:
            return self._negative(self.number(-number))
        if not np.isfinite(number):
            return Written(self.infinity if number > 0.0 else "NaN", ATOM)
        if number == 0.0 or LEAST_WITHOUT_POWER <= number < MOST_WITHOUT_POWER:
            digits = np.format_float_positional(number, DIGITS, fractional=False, trim="-")
            return Written(digits, ATOM)
        mantissa, exponent = np.format_float_scientific(number, DIGITS - 1, trim="-").split("e")
        ten = self._power("10", self.number(int(exponent)))
        one = mantissa == "1"
        return Written(ten if one else self._times(mantissa, ten), POWER if one else PRODUCT)

    def interval(self, variable: Variable) -> str:
        """The values that a variable may take, in its unit."""
        if variable.binary:
            return self.binary
        lower, upper = self.write(variable.lower), self.write(variable.upper)
        left = "(" if lower == f"{self.minus}{self.infinity}" else "["
        right = ")" if upper == self.infinity else "]"
        return f"{left}{lower}, {upper}{right}{self.unit(variable.unit)}"

    def running(self, numbers: Sequence[int]) -> str:
        """After a relation, the numbers that its index runs through: ", j = 1 … 5, 7"."""
        parts = list[str]()
        for _, run in groupby(enumerate(sorted(numbers)), lambda each: each[1] - each[0]):
            first, *more = (number for _, number in run)
            short = len(more) < 2
            parts += map(str, (first, *more)) if short else [self.span.format(first, more[-1])]
        return self.aside + f"{INDEX} = {', '.join(parts)}".replace(" ", self.after)

    def _operand(self, value: Operand) -> Written:
        return value if isinstance(value, Written) else self.number(value)

    def _at_least(self, level: int, written: Written) -> str:
        """An expression as an operand that must hold together as tightly as a level."""
        return written.text if written.level >= level else self.bracketed.format(written.text)

    def _call(self, ufunc: np.ufunc, arguments: tuple[Operand, ...]) -> Written:
        first, *rest = map(self._operand, arguments)
        # A guard that only keeps a divisor from being 0 is not part of the mathematics.
        guards = ufunc is np.maximum and not isinstance(least := arguments[1], Written)
        if ufunc is np.positive or (guards and 0.0 < np.min(least) <= np.max(least) < GUARD):
            return first
        if ufunc is np.add:
            return self._sum(first, rest[0])
        if ufunc is np.subtract:
            if rest[0].negative is not None:
                return self._sum(first, rest[0].negative)
            if rest[0].opposite and _width(rest[0].text) > self.longest_bracket:
                return self._sum(first, Written(rest[0].opposite, SUM))
            return self._join(first, self.minus, self._at_least(PRODUCT, rest[0]))
        if ufunc is np.negative:
            return self._negative(first)
        if ufunc in (np.multiply, np.divide):
            return self._product(first, rest[0], ufunc)
        if ufunc in (np.power, np.float_power):
            return Written(self._power(self._at_least(ATOM, first), rest[0]), POWER)
        if ufunc is np.sqrt:
            return Written(self.root.format(self._at_least(self.root_takes, first)), POWER)
        if ufunc is np.absolute:
            return Written(self.size.format(first.text), ATOM)
        if ufunc is np.expm1:
            power = self._call(np.exp, arguments)
            opposite = self._join(ONE, self.minus, power.text)
            return self._join(power, self.minus, ONE.text)._replace(negative=opposite)
        if ufunc is np.log1p:
            return self._call(np.log, (self._sum(ONE, first),))
        name = NAMES.get(ufunc, ufunc.__name__)
        separate = (self._at_least(SUM, term) for term in (first, *rest))
        return Written(self._function(name, ", ".join(separate)), ATOM)

    def _sum(self, left: Written, right: Written) -> Written:
        if left.text == "0":
            return right
        term = self._at_least(SUM, right)
        if term.startswith(self.minus):
            return self._join(left, self.minus, term.removeprefix(self.minus))
        return self._join(left, "+", term)

    def _join(self, left: Written, operator: str, right: str) -> Written:
        if right == "0":
            return left
        term = self._at_least(SUM, left)
        signed = term.removeprefix(self.minus) if left.level == SIGN else f"{self.minus}{term}"
        other = "+" if operator == self.minus else self.minus
        return Written(
            f"{term} {operator}{self.after}{right}",
            SUM,
            opposite=f"{left.opposite or signed} {other}{self.after}{right}",
        )

    def _negative(self, written: Written) -> Written:
        if written.negative is not None:
            return written.negative._replace(negative=written)
        return Written(f"{self.minus}{self._at_least(PRODUCT, written)}", SIGN, written)

    def _product(self, left: Written, right: Written, ufunc: np.ufunc) -> Written:
        """A product or a quotient; a sign in front of a factor stands in front of the whole."""
        if left.level == SIGN and left.negative is not None:
            return self._negative(self._product(left.negative, right, ufunc))
        if right == ONE:
            return left
        if ufunc is np.divide:
            return Written(self._over(left, right), PRODUCT)
        if right.level == SIGN and right.negative is not None:
            return self._negative(self._product(left, right.negative, ufunc))
        factors = self._at_least(PRODUCT, left), self._at_least(PRODUCT, right)
        return Written(self._times(*factors), PRODUCT)


class SymbolParts(NamedTuple):
    """A symbol such as ``"P_0,hv'"``, taken apart."""

    base: str
    below: list[str]
    primes: str


def parts_of(symbol: str) -> SymbolParts | None:
    """The parts of a symbol; None of a sum, or of words."""
    match = re.fullmatch(r"([^\W\d_]+)(\d*)('*)(?:_([^\W_]+(?:,[^\W_]+)*))?('*)", symbol)
    if match is None:
        return None
    base, index, primes, subscript, more_primes = match.groups(default="")
    below = [part for part in (index, *subscript.split(",")) if part]
    return SymbolParts(base, below, primes + more_primes)


OPERATORS = frozenset({"exp", "ln", "max", "min", "sin", "cos", "tan", "tanh"})
"""Functions that LaTeX has a name for."""
GREEK: Mapping[str, str] = {
    letter: rf"\{name}"
    for letter, name in re.findall(
        r"(\w) (\w+)",
        "α alpha β beta γ gamma δ delta ε varepsilon ζ zeta η eta θ theta ι iota κ kappa λ lambda "
        "μ mu ν nu ξ xi π pi ρ rho σ sigma τ tau υ upsilon φ phi χ chi ψ psi ω omega ϱ varrho "
        "Γ Gamma Δ Delta Θ Theta Λ Lambda Ξ Xi Π Pi Σ Sigma Φ Phi Ψ Psi Ω Omega",
    )
}
IN_WORDS: Mapping[str, str] = {
    **GREEK,
    **{mark: rf"\{mark}" for mark in "_%#${}"},
    **{"−": "-", "…": r"\ldots", "→": r"\to", "·": r"\cdot", "×": r"\times", "∞": r"\infty"},
    **{"≤": r"\leq", "≥": r"\geq", "^": r"\wedge", "~": r"\sim", "\\": r"\backslash"},
    "&": r"\text{\&}",
}
"""Marks among words that are mathematics in LaTeX: MathJax knows none of them in ``\\text``."""
IN_UPRIGHT: Mapping[str, str] = {"\\": r"\backslash{}", "^": r"\wedge{}", "~": r"\sim{}"}
"""Signs in LaTeX that a backslash before them does not escape."""
IN_UNITS: Mapping[str, str] = {
    **{" ": r"\,", "²": "^2", "³": "^3", "⁻¹": "^{-1}", "⁻²": "^{-2}"},
    **{"°": r"^\circ ", "µ": r"\mu ", "μ": r"\mu ", "Ω": r"\Omega "},
}
"""Signs of units in LaTeX."""
LINE = 46  # About how many characters of mathematics fit on a line of an article
KEY = r"[A-Za-z0-9.]*_[A-Za-z0-9._]*[A-Za-z0-9]"  # A name such as those in code and in files


class Latex(Text):
    """LaTeX for its mathematics mode, in commands that MathJax and matplotlib's mathtext know.

    Lines are of some `width` characters.
    """

    minus, infinity, member, binary, after = "-", r"\infty", r"\in", r"\{0, 1\}", " "
    several = r"{} \text{{ values, }} {} \text{{ to }} {}"
    span, aside = r"{}, \ldots, {}", r",\quad "
    bracketed, size, root = r"\left({}\right)", r"\left|{}\right|", r"\sqrt{{{}}}"
    root_takes = LIST
    senses: Mapping[Sense, str] = {"<=": r"\leq", ">=": r"\geq", "==": "="}

    def __init__(self, *, marks: bool = False, width: int = LINE) -> None:
        super().__init__(marks=marks)
        self.longest_bracket = self.width = width

    def symbol(self, symbol: str) -> str:
        """A symbol with its subscripts; sums of symbols are sums, and words stay words."""
        if (parts := parts_of(symbol)) is None:
            if re.search(r"[|+−]", symbol):
                terms = re.sub(r"[^\s|+−]+", lambda each: self.symbol(each[0]), symbol)
                return terms.replace("−", self.minus)
            return self.words(symbol)
        below = ",".join(map(_name, parts.below))
        below = below if len(below) == 1 else f"{{{below}}}"
        return f"{_name(parts.base)}{parts.primes}" + (f"_{below}" if parts.below else "")

    def unit(self, unit: str) -> str:
        """A unit in upright letters; nothing for ``"1"``."""
        upright = re.sub("|".join(IN_UNITS), lambda sign: IN_UNITS[sign[0]], _upright(unit))
        return "" if unit == "1" else rf"\,\mathrm{{{upright}}}"

    def words(self, words: str) -> str:
        """Words as text, keys as in code, the marks of `IN_WORDS` as mathematics."""
        parts = re.split(f"({KEY}|[{re.escape(''.join(IN_WORDS))}])", words)
        return "".join(
            rf"\mathtt{{{_upright(part)}}}"
            if re.fullmatch(KEY, part)
            else IN_WORDS.get(part, rf"\text{{{part}}}")
            for part in parts
            if part
        )

    def lines(self, maths: str) -> list[str]:
        """A piece of mathematics on lines of some `width`, broken outside of brackets."""
        lines = [""]
        for term in _terms(maths):
            fits = not lines[-1] or _width(lines[-1] + term) <= self.width
            lines[-1:] = [lines[-1] + term] if fits else [lines[-1].rstrip(), r"\qquad " + term]
        return lines

    def _times(self, left: str, right: str) -> str:
        """The factors side by side, with a dot before a number."""
        return rf"{left} \cdot {right}" if right[0].isdigit() else rf"{left}\,{right}"

    def _over(self, above: Written, below: Written) -> str:
        return rf"\frac{{{above.text}}}{{{below.text}}}"

    def _power(self, base: str, exponent: Written) -> str:
        """A power; a prime must not meet a superscript."""
        base = f"{{{base}}}" if "'" in base else base
        return f"{base}^{{{exponent.text}}}"

    def _function(self, name: str, arguments: str) -> str:
        upright = rf"\{name}" if name in OPERATORS else rf"\operatorname{{{_upright(name)}}}"
        return upright + self.bracketed.format(arguments)


def _upright(text: str) -> str:
    """Text as it is, among mathematics."""
    return re.sub(r"[_%&#${}\\^~]", lambda mark: IN_UPRIGHT.get(mark[0], rf"\{mark[0]}"), text)


def _name(letters: str) -> str:
    """A letter in italics, more letters upright."""
    if letters in ("min", "max"):
        return rf"\{letters}"
    if len(letters) == 1 or letters.isdigit():
        return GREEK.get(letters, letters)
    if any(letter in GREEK for letter in letters):
        return r"\,".join(map(_name, letters))
    return rf"\mathrm{{{letters}}}"


def _terms(maths: str) -> Iterator[str]:
    """Pieces between which a line may be broken: before signs and relations outside of brackets."""
    start = 0
    for sign in re.finditer(r"(?<= )(?:[+-]|\\leq|\\geq) |(?<=,)\\quad ", maths):
        before = maths[: sign.start()].replace(r"\{", "").replace(r"\}", "")
        pairs = (r"\left", r"\right"), ("{", "}")
        if all(before.count(left) == before.count(right) for left, right in pairs):
            yield maths[start : sign.start()]
            start = sign.start()
    yield maths[start:]


def _width(maths: str) -> int:
    """About how many characters of a line it takes."""
    seen = re.sub(r"\\(?:left|right|text|mathrm|frac|[,;])|[{}^]|(?<!\\)_", "", maths)
    return len(re.sub(r"\\(?:[A-Za-z]+|.)", "m", seen))

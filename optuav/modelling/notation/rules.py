"""What holds in every notation: precedence, signs, numbers; marks and forms are a subclass's."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from optuav.modelling.expression import Operand, Relation, Sense, Variable
from optuav.modelling.traversal import fold

LIST, SUM, SIGN, PRODUCT, POWER, ATOM = range(6)
"""How tightly a written expression holds together."""

NAMES: Mapping[np.ufunc, str] = {
    np.log: "ln",
    np.arctan2: "atan2",
    np.maximum: "max",
    np.minimum: "min",
    np.sign: "sgn",
}
"""Functions that mathematics calls otherwise than NumPy does."""

DIGITS = 7
LEAST, MOST = 1e-4, 10.0**DIGITS
"""Numbers between these are written without a power of ten."""


GUARD = 1e-100
"""max(x, g) with a positive g below this is written as x."""


class Written(NamedTuple):
    """An expression in writing, how tightly it holds together, and its negative if that is simpler.

    So −(exp(x) − 1) is written 1 − exp(x), and a·(−b) as −a·b.
    """

    text: str
    level: int
    negative: Written | None = None


ONE = Written("1", ATOM)


class Notation(ABC):
    """The rules of precedence, over marks and forms that a subclass chooses."""

    minus: str
    infinity: str
    several: str
    span: str
    """Whole numbers from a first to a last one."""
    aside: str
    """Between a relation and where it holds."""
    member: str
    binary: str
    senses: Mapping[Sense, str]
    after = " "
    """What stands between an operator and the term that follows it."""

    @abstractmethod
    def symbol(self, symbol: str) -> str:
        """A symbol such as ``"P_0,hv"``."""

    @abstractmethod
    def unit(self, unit: str) -> str:
        """A unit after a number or an interval; nothing for ``"1"``."""

    @abstractmethod
    def words(self, words: str) -> str:
        """Words among mathematics."""

    @abstractmethod
    def bracket(self, inner: str) -> str:
        """Something in parentheses."""

    @abstractmethod
    def times(self, left: str, right: str) -> str:
        """The product of two factors."""

    @abstractmethod
    def over(self, above: Written, below: Written) -> Written:
        """A fraction."""

    @abstractmethod
    def power(self, base: str, exponent: Written) -> str:
        """A power."""

    @abstractmethod
    def root(self, inner: Written) -> Written:
        """A square root."""

    @abstractmethod
    def size(self, inner: str) -> str:
        """An absolute value."""

    @abstractmethod
    def function(self, name: str, arguments: str) -> str:
        """A function of its arguments."""

    def write(
        self, expression: Operand | Relation, called: Callable[[str], str] = lambda symbol: symbol
    ) -> str:
        """An expression, a number, an array of numbers or a relation.

        Parameters
        ----------
        expression
            What is to be written.
        called
            What the symbols of named quantities become.
        """
        if isinstance(expression, Relation):
            left, right = (self.write(each, called) for each in expression.sides)
            return f"{left} {self.senses[expression.sense]}{self.after}{right}"
        written = fold(
            expression,
            leaf=lambda node: Written(self.symbol(node.symbol), ATOM),
            call=self._call,
            let=lambda node, _: Written(self.symbol(called(node.symbol)), ATOM),
        )
        return written.text if isinstance(written, Written) else self.number(written).text

    def _call(self, ufunc: np.ufunc, arguments: tuple[Any, ...]) -> Written:
        first, *rest = map(self._operand, arguments)
        if ufunc is np.maximum and _is_guard(arguments[1]):
            return first
        return self._apply(ufunc, [first, *rest])

    def number(self, value: Any) -> Written:
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
        if number == 0.0 or LEAST <= number < MOST:
            digits = np.format_float_positional(number, DIGITS, fractional=False, trim="-")
            return Written(digits, ATOM)
        mantissa, exponent = np.format_float_scientific(number, DIGITS - 1, trim="-").split("e")
        ten = Written(self.power("10", self.number(int(exponent))), POWER)
        return ten if mantissa == "1" else Written(self.times(mantissa, ten.text), PRODUCT)

    def quantity(self, value: Any, unit: str) -> str:
        """A number with its unit."""
        return f"{self.number(value).text}{self.unit(unit)}"

    def interval(self, variable: Variable) -> str:
        """The values that a variable may take."""
        if variable.binary:
            return self.binary
        lower, upper = self.write(variable.lower), self.write(variable.upper)
        left = "(" if lower == f"{self.minus}{self.infinity}" else "["
        right = ")" if upper == self.infinity else "]"
        return f"{left}{lower}, {upper}{right}"

    def running(self, index: str, numbers: Sequence[int]) -> str:
        """After a relation, the numbers that an index runs through: ", j = 1 … 5, 7"."""
        parts: list[str] = []
        stretch: list[int] = []
        for number in sorted(numbers):
            if stretch and number > stretch[-1] + 1:
                parts.append(self._stretch(stretch))
                stretch = []
            stretch.append(number)
        through = f"{index} = {', '.join([*parts, self._stretch(stretch)])}"
        return self.aside + through.replace(" ", self.after)

    def _stretch(self, numbers: Sequence[int]) -> str:
        if len(numbers) < 3:
            return ", ".join(map(str, numbers))
        return self.span.format(numbers[0], numbers[-1])

    def _operand(self, value: Any) -> Written:
        return value if isinstance(value, Written) else self.number(value)

    def at_least(self, level: int, written: Written) -> str:
        """An expression as an operand that must hold together as tightly as a level."""
        return written.text if written.level >= level else self.bracket(written.text)

    def _apply(self, ufunc: np.ufunc, arguments: list[Written]) -> Written:
        first, *rest = arguments
        if ufunc is np.add:
            return self._sum(first, rest[0])
        if ufunc is np.subtract:
            if rest[0].negative is not None:
                return self._sum(first, rest[0].negative)
            return self._join(first, self.minus, self.at_least(PRODUCT, rest[0]))
        if ufunc is np.negative:
            return self._negative(first)
        if ufunc is np.positive:
            return first
        if ufunc is np.multiply:
            return self._product(first, rest[0])
        if ufunc is np.divide:
            return self._fraction(first, rest[0])
        if ufunc in (np.power, np.float_power):
            return Written(self.power(self.at_least(ATOM, first), rest[0]), POWER)
        if ufunc is np.sqrt:
            return self.root(first)
        if ufunc is np.absolute:
            return Written(self.size(first.text), ATOM)
        if ufunc is np.expm1:
            power = self._apply(np.exp, arguments)
            opposite = self._join(ONE, self.minus, power.text)
            return self._join(power, self.minus, ONE.text)._replace(negative=opposite)
        if ufunc is np.log1p:
            return self._apply(np.log, [self._sum(ONE, first)])
        name = NAMES.get(ufunc, ufunc.__name__)
        separate = (self.at_least(SUM, each) for each in arguments)
        return Written(self.function(name, ", ".join(separate)), ATOM)

    def _sum(self, left: Written, right: Written) -> Written:
        if left.text == "0":
            return right
        term = self.at_least(SUM, right)
        if term.startswith(self.minus):
            return self._join(left, self.minus, term.removeprefix(self.minus))
        return self._join(left, "+", term)

    def _join(self, left: Written, operator: str, right: str) -> Written:
        if right == "0":
            return left
        return Written(f"{self.at_least(SUM, left)} {operator}{self.after}{right}", SUM)

    def _negative(self, written: Written) -> Written:
        if written.negative is not None:
            return written.negative._replace(negative=written)
        return Written(f"{self.minus}{self.at_least(PRODUCT, written)}", SIGN, written)

    def _product(self, left: Written, right: Written) -> Written:
        for factor, other in ((left, right), (right, left)):
            if factor.level == SIGN and factor.negative is not None:
                positive = factor.negative
                turned = (positive, other) if factor is left else (other, positive)
                return self._negative(self._product(*turned))
        return Written(
            self.times(self.at_least(PRODUCT, left), self.at_least(PRODUCT, right)), PRODUCT
        )

    def _fraction(self, above: Written, below: Written) -> Written:
        if above.level == SIGN and above.negative is not None:
            return self._negative(self._fraction(above.negative, below))
        return self.over(above, below)


def _is_guard(operand: Any) -> bool:
    """Whether a number does nothing but keep a divisor from being 0: no part of the mathematics."""
    return not isinstance(operand, Written) and bool(
        np.all((np.asarray(operand) > 0.0) & (np.asarray(operand) < GUARD))
    )

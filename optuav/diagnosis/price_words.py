"""Shadow prices in words: what one more unit of each parameter brings."""

from __future__ import annotations

import math
from collections.abc import Iterator

from optuav.diagnosis.explanation import Explanation
from optuav.diagnosis.layout import columns, paragraph, with_unit
from optuav.diagnosis.prices import Price

UNIT_NAMES = {
    "s": "second",
    "m": "metre",
    "A": "ampere",
    "A s": "A s",
    "W": "watt",
    "V": "volt",
    "J": "joule",
}


def price_blocks(explained: Explanation) -> Iterator[list[str]]:
    """Blocks of lines: the prices, what has no effect, and where nothing more is feasible."""
    worth = [each for each in explained.prices if each.matters and not _edge(each)]
    if worth:
        rows = [
            (_name(each), f"{each.symbol} = {with_unit(each.value, each.unit)}", _rates(each))
            for each in worth
        ]
        head = f"{explained.objective} per unit of a parameter, the others held:"
        yield [*paragraph("Prices", head), *columns(rows)]
        yield [
            line
            for k, each in enumerate(worth)
            for line in paragraph("" if k else "One more", _words(explained, each))
        ]
    free = [_name(each) for each in explained.prices if not each.matters]
    if free:
        yield paragraph("No effect", ", ".join(free))
    edges = [words for each in explained.prices if _edge(each) for words in _edges(each)]
    if edges:
        yield paragraph("At the edge", f"nothing is feasible with {', '.join(edges)}")


def _name(price: Price) -> str:
    return price.key or price.name


def _edge(price: Price) -> bool:
    """Whether a side is infeasible, and the other one without effect."""
    finite = [each for each in (price.less, price.more) if math.isfinite(each)]
    return len(finite) < 2 and not any(finite)


def _edges(price: Price) -> Iterator[str]:
    if math.isinf(price.more):
        yield f"more {_name(price)}"
    if math.isinf(price.less):
        yield f"less {_name(price)}"


def _rates(price: Price) -> str:
    if not price.has_kink:
        return _signed(price.more)
    return f"{_signed(price.less)} below, {_signed(price.more)} above"


def _signed(value: float) -> str:
    if math.isinf(value):
        return "no plan"
    return f"{value:+.6g}".replace("-", "−") if value else "0"


def _words(explained: Explanation, price: Price) -> str:
    """For example: one more second of limits.deadline_s brings 0.102 s of hover."""
    if price.unit == "1":
        unit = "one more" if price.step == 1.0 else f"{price.step:g} more"
        start = f"{unit} of {_name(price)}"
    else:
        unit = UNIT_NAMES.get(price.unit, price.unit)
        more = f"one more {unit}" if price.step == 1.0 else f"{price.step:g} {price.unit} more"
        start = f"{more} of {_name(price)}"
    words = f"{start} {_change(explained, price.gain, price.solved_again)}"
    if price.has_kink:
        words += f", as much less {_change(explained, price.loss, price.solved_again)}"
    return words


def _change(explained: Explanation, change: float, exact: bool) -> str:
    if math.isinf(change):
        return "leaves no plan"
    if change == 0.0:
        return "changes nothing"
    better = (change > 0.0) == (explained.sense == "maximise")
    gain = "brings" if explained.sense == "maximise" else "saves"
    verb = gain if better else "costs"
    return f"{verb} {'' if exact else 'about '}{abs(change):.3g} {explained.objective}"

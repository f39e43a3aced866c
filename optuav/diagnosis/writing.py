"""Explanations in words: aligned, at most 80 columns."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction

from optuav.diagnosis.certificate import Certificate, Combination
from optuav.diagnosis.clash import Clash
from optuav.diagnosis.conflict import Conflict
from optuav.diagnosis.explanation import Explanation, Side
from optuav.diagnosis.prices import Price
from optuav.diagnosis.repair import WRITTEN, Repair
from optuav.diagnosis.short import shortened, written
from optuav.mission.words import shown
from optuav.status import Status

WIDTH = 80
LABEL = 13
MOST_REPAIRS = 12

EXACT = (
    "certificates are exact as they stand: their rows are rounded so that they say a little less "
    "than the mission, times being 0 or more. --json holds all digits, as fractions"
)

UNIT_NAMES = {
    "s": "second",
    "m": "metre",
    "A": "ampere",
    "A s": "A s",
    "W": "watt",
    "V": "volt",
    "J": "joule",
}


def text(explained: Explanation) -> str:
    """The explanation as a block of text."""
    head, *_ = explained.plan.summary().split("\n\n")
    blocks = [head.splitlines()]
    blocks += _optimum(explained) if explained else _no_plan(explained)
    blocks.append([line for note in explained.notes for line in _paragraph("Note", note)])
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _paragraph(label: str, words: str) -> list[str]:
    return textwrap.wrap(
        words,
        WIDTH,
        initial_indent=f"{label:<{LABEL}}",
        subsequent_indent=" " * LABEL,
        break_on_hyphens=False,
    )


def _columns(rows: Iterable[tuple[str, ...]]) -> list[str]:
    """Rows as lined-up columns under the label; the last one wraps."""
    table = [*rows]
    if not table:
        return []
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = []
    for row in table:
        cells = [f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)]
        start = " " * LABEL + "  ".join(cells[:-1]) + ("  " if len(cells) > 1 else "")
        lines += textwrap.wrap(
            cells[-1].rstrip(),
            WIDTH,
            initial_indent=start,
            subsequent_indent=" " * (len(start) + 2),
            break_on_hyphens=False,
        ) or [start.rstrip()]
    return lines


def _labelled(label: str, lines: list[str]) -> list[str]:
    """Lines with a label in the margin of the first."""
    return [f"{label:<{LABEL}}{line[LABEL:]}" if not k else line for k, line in enumerate(lines)]


def _number(value: float | Fraction) -> str:
    digits = f"{float(value):.6g}"
    return digits.replace("-", "−")


def _with_unit(value: float, unit: str) -> str:
    return _number(value) if unit == "1" else f"{_number(value)} {unit}"


def _inequality(
    coefficients: Mapping[str, Fraction], limit: Fraction, number: Callable[[Fraction], str]
) -> str:
    terms: list[str] = []
    for symbol, factor in coefficients.items():
        size = symbol if abs(factor) == 1 else f"{number(abs(factor))}·{symbol}"
        sign = "−" if factor < 0 else "+"
        terms.append(f"{sign} {size}" if terms else f"{sign}{size}".removeprefix("+"))
    return f"{' '.join(terms) or '0'} ≤ {number(limit)}"


def combination_text(used: Combination) -> list[str]:
    """Rows with their multipliers, and what they add up to; a contradiction in full."""
    if isinstance(used, Certificate):
        used, number, false = shortened(used), written, ", which is false"
    else:
        number, false = _number, ""
    rows = [
        (f"{number(row.multiplier)} ×", row.label, _inequality(row.coefficients, row.limit, number))
        for row in used.rows
    ]
    rows.append(("sum", "", _inequality(used.coefficients, used.limit, number) + false))
    return _columns(rows)


def _no_plan(explained: Explanation) -> Iterator[list[str]]:
    if explained.plan.status is not Status.INFEASIBLE:
        return
    for conflict in explained.conflicts:
        yield from conflict_text(conflict, explained.plan.slot_s)
    if any(conflict.certificates for conflict in explained.conflicts):
        yield _paragraph("Exact", EXACT)
    if explained.conflicts or explained.repairs or explained.plan.proof == "physics":
        yield _repairs(explained.repairs)


def conflict_text(conflict: Conflict, slot_s: float | None) -> Iterator[list[str]]:
    """A conflict with its proofs, one block of lines each."""
    places = " → ".join(conflict.route)
    where = (
        f"on {places}" if conflict.routes == 1 else f"on {conflict.routes} routes, such as {places}"
    )
    if conflict.clash is not None:
        yield from _clash(conflict.clash, where)
    elif not conflict.certificates:
        why = "the constraints are not linear" if slot_s is None else "only whole slots do not fit"
        yield _paragraph("Conflict", f"{where}: no certificate, {why}")
    for each in conflict.certificates:
        labels = _listed(each.labels)
        verb = "cannot hold together" if len(each.labels) > 1 else "cannot hold"
        keys = f" ({', '.join(each.keys)})" if each.keys else ""
        yield [
            *_paragraph("Conflict", f"{where}: {labels} {verb}{keys}"),
            *_labelled("  proof", combination_text(each)),
        ]


def _clash(clash: Clash, where: str) -> Iterator[list[str]]:
    together = len(clash.labels) > 1
    keys = f" ({', '.join(clash.keys)})" if clash.keys else ""
    verb = "cannot hold together" if together else "cannot hold"
    head = f"{where}: {_listed(clash.labels)} {verb}{keys}"
    lines = _paragraph("Conflict", head)
    if clash.broken:
        even = "without" if together else "even without"
        lines += _paragraph("  there", f"{'; '.join(clash.broken)}, {even} any stay")
    far = "" if math.isinf(clash.far_s) else f" whose sum is at most {clash.far_s:g} s"
    proof = f"bracketed: no times{far} satisfy them"
    if together:
        proof += " all, though they do if any one of them is left out"
    yield [*lines, *_paragraph("  proof", proof)]


def _listed(names: Sequence[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def _repairs(repairs: tuple[Repair, ...]) -> list[str]:
    if not repairs:
        return _paragraph("Repairs", "no change of a single number makes it feasible")
    shown_ones = repairs[:MOST_REPAIRS]
    rows = [(str(each), f"now {_now(each)}") for each in shown_ones]
    lines = _columns(rows)
    for k in range(1, len(lines)):
        lines[k] = f"{'  or':<{LABEL}}{lines[k][LABEL:]}"
    more = len(repairs) - len(shown_ones)
    tail = [f"{'':<{LABEL}}and {more} more, each larger"] if more else []
    return [*_labelled("Feasible if", lines), *tail]


def _now(repair: Repair) -> str:
    return shown(repair.now) if repair.comparison == "==" else f"{repair.now:{WRITTEN}}"


def _optimum(explained: Explanation) -> Iterator[list[str]]:
    plan = explained.plan
    stays = "".join(
        f", {stop.kind} {stop.duration_s:.2f} s at {stop.at}" for stop in plan.stops
    ).removeprefix(", ")
    yield _paragraph("Optimum", stays)
    binding = [each for each in explained.constraints if each.binds]
    spare = [each for each in explained.constraints if not each.binds]
    moments = [each for each in binding if _of_wells(each)]
    lines = _columns(_sides(each for each in binding if not _of_wells(each)))
    yield _labelled("Binding", lines + _columns((each.label,) for each in moments))
    lines = _columns(_spare(each for each in spare if not _of_wells(each)))
    yield _labelled("To spare", lines + _columns(_well_moments(spare)))
    if explained.bound is not None:
        head = "no point that satisfies these constraints is better:"
        yield [*_paragraph("Proof", head), *combination_text(explained.bound)]
    yield from _prices(explained)


def _sides(sides: Iterable[Side]) -> Iterator[tuple[str, ...]]:
    for each in sides:
        values = f"{_number(each.left)} {each.sense} {_with_unit(each.right, each.unit)}"
        yield each.label, each.statement or values


def _spare(sides: Iterable[Side]) -> Iterator[tuple[str, ...]]:
    for each in sides:
        yield each.label, _with_unit(each.slack, each.unit), each.statement


def _of_wells(side: Side) -> bool:
    return " not dry " in side.label or " not past full " in side.label


def _well_moments(sides: Iterable[Side]) -> Iterator[tuple[str, ...]]:
    """Shares of the battery to spare in the available well; of its moments in flight the least."""
    wells = [each for each in sides if _of_wells(each)]
    flown = [each for each in wells if " flight " in each.label]
    least = min(flown, key=lambda each: each.slack, default=None)
    for each in wells:
        if each not in flown:
            yield f"{_number(each.slack)} of B", each.label
    if least is not None:
        more = f", the least of {len(flown)} such moments" if len(flown) > 1 else ""
        yield f"{_number(least.slack)} of B", f"{least.label}{more}"


def _prices(explained: Explanation) -> Iterator[list[str]]:
    worth = [each for each in explained.prices if each.matters and not _edge(each)]
    if worth:
        rows = [
            (_name(each), f"{each.symbol} = {_with_unit(each.value, each.unit)}", _rates(each))
            for each in worth
        ]
        head = f"{explained.objective} per unit, the other parameters held:"
        yield [*_paragraph("Prices", head), *_columns(rows)]
        yield [
            line
            for k, each in enumerate(worth)
            for line in _paragraph("" if k else "One more", _words(explained, each))
        ]
    free = [_name(each) for each in explained.prices if not each.matters]
    if free:
        yield _paragraph("No effect", ", ".join(free))
    edges = [words for each in explained.prices if _edge(each) for words in _edges(each)]
    if edges:
        yield _paragraph("At the edge", f"nothing is feasible with {', '.join(edges)}")


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
    unit = "" if price.unit == "1" else f" per {price.unit}"
    if not price.has_kink:
        return f"{_signed(price.more)}{unit}"
    return f"{_signed(price.less)} below, {_signed(price.more)} above{unit}"


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

"""Explanations in words."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

from formulations.wells import LABELS
from optuav.diagnosis.clash import Clash
from optuav.diagnosis.conflict import Conflict
from optuav.diagnosis.explanation import Explanation, Side
from optuav.diagnosis.layout import LABEL, columns, labelled, number_text, paragraph, with_unit
from optuav.diagnosis.price_words import price_blocks
from optuav.diagnosis.proof_words import combination_text
from optuav.diagnosis.repair import WRITTEN, Repair
from optuav.mission.messages import shown
from optuav.status import Status

MOST_REPAIRS = 12

EXACT = (
    "certificates are exact as they stand: their rows are rounded so that they say a little less "
    "than the mission, times being 0 or more. --json holds all digits, as fractions"
)

NO_REPAIR = (
    "no single number, moved up or down to a thousandfold, was seen to make it feasible; places "
    "were not moved"
)
NOT_TRIED = "each is one change alone; places were not moved"
IN_SLOTS = (
    "a time that whole slots have to fill exactly may do so at single values between those tried"
)


def text(explained: Explanation) -> str:
    """The explanation as a block of text."""
    head, *_ = explained.plan.summary().split("\n\n")
    blocks = [head.splitlines()]
    blocks += _optimum(explained) if explained else _no_plan(explained)
    blocks.append([line for note in explained.notes for line in paragraph("Note", note)])
    return "\n\n".join("\n".join(block) for block in blocks if block)


def _no_plan(explained: Explanation) -> Iterator[list[str]]:
    if explained.plan.status is not Status.INFEASIBLE:
        return
    for conflict in explained.conflicts:
        yield from conflict_text(conflict, explained.plan.slot_s)
    if any(conflict.certificates for conflict in explained.conflicts):
        yield paragraph("Exact", EXACT)
    if explained.conflicts or explained.repairs or explained.plan.proof == "physics":
        yield _repairs(explained.repairs, explained.plan.slot_s)


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
        yield paragraph("Conflict", f"{where}: no certificate, {why}")
    for each in conflict.certificates:
        labels = _listed(each.labels)
        verb = "cannot hold together" if len(each.labels) > 1 else "cannot hold"
        keys = f" ({', '.join(each.keys)})" if each.keys else ""
        yield [
            *paragraph("Conflict", f"{where}: {labels} {verb}{keys}"),
            *labelled("  proof", combination_text(each)),
        ]


def _clash(clash: Clash, where: str) -> Iterator[list[str]]:
    together = len(clash.labels) > 1
    keys = f" ({', '.join(clash.keys)})" if clash.keys else ""
    verb = "cannot hold together" if together else "cannot hold"
    head = f"{where}: {_listed(clash.labels)} {verb}{keys}"
    lines = paragraph("Conflict", head)
    if clash.broken:
        even = "without" if together else "even without"
        lines += paragraph("  there", f"{'; '.join(clash.broken)}, {even} any stay")
    far = "" if math.isinf(clash.far_s) else f" whose sum is at most {clash.far_s:g} s"
    proof = f"bracketed: no times{far} satisfy them"
    if together:
        proof += " all, though they do if any one of them is left out"
    yield [*lines, *paragraph("  proof", proof)]


def _listed(names: Sequence[str]) -> str:
    *most, last = names
    return f"{', '.join(most)} and {last}" if most else last


def _repairs(repairs: tuple[Repair, ...], slot_s: float | None) -> list[str]:
    if not repairs:
        return paragraph("Repairs", NO_REPAIR if slot_s is None else f"{NO_REPAIR}; {IN_SLOTS}")
    shown_ones = repairs[:MOST_REPAIRS]
    rows = [(str(each), f"now {_now(each)}") for each in shown_ones]
    lines = columns(rows)
    for k in range(1, len(lines)):
        lines[k] = f"{'  or':<{LABEL}}{lines[k][LABEL:]}"
    more = len(repairs) - len(shown_ones)
    tail = [f"{'':<{LABEL}}and {more} more, each larger"] if more else []
    return [*labelled("Feasible if", lines), *tail, f"{'':<{LABEL}}{NOT_TRIED}"]


def _now(repair: Repair) -> str:
    return shown(repair.now) if repair.comparison == "==" else f"{repair.now:{WRITTEN}}"


def _optimum(explained: Explanation) -> Iterator[list[str]]:
    plan = explained.plan
    stays = "".join(
        f", {stop.kind} {stop.duration_s:.2f} s at {stop.at}" for stop in plan.stops
    ).removeprefix(", ")
    yield paragraph("Optimum", stays)
    binding = [each for each in explained.constraints if each.binds]
    spare = [each for each in explained.constraints if not each.binds]
    moments = [each for each in binding if _of_wells(each)]
    lines = columns(_sides(each for each in binding if not _of_wells(each)), formulas=True)
    yield labelled("Binding", lines + columns((each.label,) for each in moments))
    lines = columns(_spare(each for each in spare if not _of_wells(each)), formulas=True)
    yield labelled("To spare", lines + columns(_well_moments(spare)))
    if explained.bound is not None:
        head = "no point that satisfies these constraints is better:"
        yield [*paragraph("Proof", head), *combination_text(explained.bound)]
    yield from price_blocks(explained)


def _sides(sides: Iterable[Side]) -> Iterator[tuple[str, ...]]:
    for each in sides:
        values = f"{number_text(each.left)} {each.sense} {with_unit(each.right, each.unit)}"
        yield each.label, each.statement or values


def _spare(sides: Iterable[Side]) -> Iterator[tuple[str, ...]]:
    for each in sides:
        yield each.label, with_unit(each.slack, each.unit), each.statement


def _of_wells(side: Side) -> bool:
    return side.kind in LABELS


def _well_moments(sides: Iterable[Side]) -> Iterator[tuple[str, ...]]:
    """Shares of the battery to spare in the available well; of its moments in flight the least."""
    wells = [each for each in sides if _of_wells(each)]
    flown = [each for each in wells if each.in_flight]
    least = min(flown, key=lambda each: each.slack, default=None)
    for each in wells:
        if each not in flown:
            yield f"{number_text(each.slack)} of B", each.label
    if least is not None:
        more = f", the least of {len(flown)} such moments" if len(flown) > 1 else ""
        yield f"{number_text(least.slack)} of B", f"{least.label}{more}"

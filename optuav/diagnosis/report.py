"""An explanation: its findings as blocks."""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass

from formulations.soc import LABELS
from optuav.diagnosis.findings import ConstraintAtOptimum, Findings
from optuav.diagnosis.in_words import (
    MAY_CHANGE,
    binding,
    gain_figure,
    key_of,
    price_words,
    symbol_and_value,
    without_effect,
)
from optuav.diagnosis.infeasibility import Certificate, Conflict
from optuav.plan.summary import question_blocks
from optuav.presentation.blocks import Block, Facts, Fold, Table
from optuav.presentation.numbers import figure, percent, seconds, with_unit
from optuav.presentation.presented import Presented
from optuav.solving.constraint_words import constraint_words

MOST_REPAIRS = 12
MOST_CONFLICTS = 3  # Over several devices there are as many as there are kinds of routes
EXACT = "rounded here; --json gives exact fractions"
NO_REPAIR = (
    "no change of a single number, up to a factor of 1000, was found that makes it feasible; "
    "places were not moved"
)
NONE_BETTER = "on this route no point that satisfies all of these is better:"
ONE_OF = "one of these holds:"
NOT_TRIED = "each is a single change; places were not moved"
BETWEEN_SLOTS = (
    "where whole slots have to add up to a time exactly, values between those tried may do"
)


@dataclass(frozen=True)
class Explanation(Presented, Findings):
    """Explanation of an answer by `optuav.explain`; print it. True where there is a plan.

    Parameters
    ----------
    plan
        The plan explained.
    objective
        Unit of the objective, and its name if it is a known time: ``"s of hover"``, ``"TB"``, or
        ``"of the objective"`` if its terms have no unit in common; empty without a plan.
    sense
        ``"maximise"`` or ``"minimise"``.
    conflicts, repairs
        Without a plan: which constraints conflict, with proofs, none where the reasons are
        physical; and single changes that make it feasible, those a planner can make first.
    constraints, bound
        With a plan: those of its programme, and why nothing is better, None if that is not linear.
    prices, key_prices
        With a plan: the worth of the parameters of its programme, and of one percent of the keys of
        flight model, beam and drag.
    notes
        Remarks for the reader.
    more_stops_open
        Whether more than one rest or one hover in one piece might give a longer hover.
    gain_s
        Gain in hover from more stops over one rest and one hover [s]; None if they were not
        searched for, or without a plan to compare.
    doubt_costs_s
        Of a robust plan: by uncertain number, the hover gained on its route if that number were
        certain [s], the largest first.

    Examples
    --------
    >>> import optuav
    >>> explained = optuav.explain("paper", "P3", perspective="battery")
    >>> [side.label for side in explained.constraints if side.binds]
    ['P3.a state of charge']
    >>> explained.bound.holds()
    True
    """

    def blocks(self) -> Iterator[Block]:
        """Yield the question, limits, proof and prices, or repairs and conflicts, and notes."""
        yield from question_blocks(self.plan)
        yield from _optimum(self) if self else _no_plan(self)
        if self.doubt_costs_s:
            (costliest, gain_s), *_ = self.doubt_costs_s.items()
            words = f"{costliest} costs most: {seconds(gain_s)} of hover on the robust route"
            rows = [(number, seconds(cost_s)) for number, cost_s in self.doubt_costs_s.items()]
            yield Table((), rows, label="Doubt", above=words)
        yield Facts([("Note", note) for note in self.notes])

    def __repr__(self) -> str:
        count = len(self.constraints) if self else len(self.conflicts)
        counted = f"{count} {'constraints' if self else 'conflicts'}"
        return repr(self.plan).replace("Plan for", "Explanation for")[:-1] + f", {counted}>"


def _no_plan(explained: Explanation) -> Iterator[Block]:
    """Repairs, and conflicts with their proofs."""
    plan, repairs = explained.plan, explained.repairs
    if repairs:
        rows = [repair.row for repair in repairs[:MOST_REPAIRS]]
        more = len(repairs) - len(rows)
        below = [f"and {more} more", NOT_TRIED] if more else [NOT_TRIED]
        yield Table((), rows, words=2, label="Feasible if", above=ONE_OF, below=below)
    elif explained.conflicts or plan.proof == "physics":
        words = NO_REPAIR if plan.slot_s is None else f"{NO_REPAIR}; {BETWEEN_SLOTS}"
        yield Facts([("Repairs", words)])
    for conflict in explained.conflicts[:MOST_CONFLICTS]:
        yield from conflict_blocks(conflict, plan.slot_s)
    if others := explained.conflicts[MOST_CONFLICTS:]:
        routes = sum(conflict.routes for conflict in others)
        yield Facts([("Others", f"{routes} routes have conflicts of their own, listed by --json")])
    if any(conflict.certificates for conflict in explained.conflicts):
        yield Facts([("Exact", EXACT)])


def conflict_blocks(conflict: Conflict, slot_s: float | None) -> Iterator[Block]:
    """A conflict with its proofs."""
    such_as = f"{conflict.routes} routes, such as " if conflict.routes > 1 else ""
    where = f"on {such_as}{' → '.join(conflict.route)}"
    for proof in conflict.proofs:
        together = " together" if len(proof.labels) > 1 else ""
        keys = f" ({', '.join(proof.keys)})" if proof.keys else ""
        named = ", ".join(map(constraint_words, proof.labels))
        words = f"{where}: {named} cannot hold{together}{keys}"
        if isinstance(proof, Certificate):
            yield Table((), _rows(proof), words=3, label="Conflict", above=f"{words}; the proof:")
            continue
        lines = [("Conflict", words)]
        if proof.broken:
            even = "without" if together else "even without"
            lines.append(("  there", f"{'; '.join(proof.broken)}, {even} any stay"))
        far = "" if math.isinf(proof.far_s) else f" whose sum is at most {figure(proof.far_s)} s"
        words = f"bracketed: no times{far} satisfy them"
        words += " all, but some do if any one of them is left out" if together else ""
        yield Facts([*lines, ("  proof", words)])
    if not conflict.proofs:
        why = "the constraints are not linear" if slot_s is None else "only whole slots do not fit"
        yield Facts([("Conflict", f"{where}: no certificate, {why}")])


def _rows(proof: Certificate) -> list[tuple[str, str, str]]:
    """The rows of a proof, their labels in words."""
    return [(factor, constraint_words(label), _whole(row)) for factor, label, row in proof.table]


def _whole(comparison: str) -> str:
    """A comparison or a sum that is broken before a sign, not behind it."""
    return re.sub(r" ([≤≥=+−]) ", " \\1\N{NO-BREAK SPACE}", comparison)


def _limit(side: ConstraintAtOptimum) -> str:
    """A constraint in words; of a time that is at least 0, the time."""
    if side.kind == "bounds":
        return constraint_words(side.label).removeprefix("range of the ").removesuffix(" ≥ 0")
    return constraint_words(side.words or side.label)


def _optimum(explained: Explanation) -> Iterator[Block]:
    """Stays, binding limits, slack, proof and prices."""
    plan, sides = explained.plan, explained.constraints
    stays = [f"{stop.kind} {seconds(stop.duration_s)} at {stop.at}" for stop in plan.stops]
    lines = [("Optimum", ", ".join(stays))]
    if words := binding(explained):
        lines.append(("What binds", words))
    yield Facts(lines)
    wells = [side for side in sides if side.kind in LABELS]
    others = [side for side in sides if side.kind not in LABELS]
    names = [_limit(well) for well in wells if well.binds]
    names = names if sides else [*map(constraint_words, plan.binding)]
    rows = [(_limit(other), _whole(other.both_sides)) for other in others if other.binds]
    yield Table((), [*rows, *((name, "") for name in names)], words=2, label="Binding")
    yield Table((), [*_spare(wells, others)], words=2, label="To spare")
    if sides:
        yield Fold(*_all_constraints(explained), in_text=False)
    if explained.bound is not None:
        yield Table((), _rows(explained.bound), words=3, label="Proof", above=NONE_BETTER)
    yield from _prices(explained)
    yield from _key_prices(explained)


def _spare(
    wells: list[ConstraintAtOptimum], others: list[ConstraintAtOptimum]
) -> Iterator[tuple[str, str]]:
    """Slack of what does not bind; of the wells in flight, the least stands for all."""
    yield from ((e.spare, f"{_limit(e)}: {_whole(e.both_sides)}") for e in others if not e.binds)
    free = [well for well in wells if not well.binds]
    for well in free:
        if not well.in_flight:
            yield f"{percent(well.slack)} of capacity", _limit(well)
    if flown := [well for well in free if well.in_flight]:
        least = min(flown, key=lambda well: well.slack)
        more = f", the least of {len(flown)} such moments" if len(flown) > 1 else ""
        yield f"{percent(least.slack)} of capacity", f"{_limit(least)}{more}"


def _all_constraints(explained: Explanation) -> tuple[str, list[Table]]:
    """Title and table of all constraints as they are stated, those that bind first."""
    sides = sorted(explained.constraints, key=lambda side: not side.binds)
    rows = [(e.words, e.label, e.statement, e.both_sides, e.spare) for e in sides]
    heads = ("limit", "constraint", "as stated", "in numbers", "to spare")
    well = "; y1_k is the charge in the available well after step k"
    shows_well = any(e.step is not None and e.statement for e in sides)
    return f"Constraints ({len(rows)}){well * shows_well}", [Table(heads, rows)]


def _key_prices(explained: Explanation) -> Iterator[Block]:
    """The worth of a percent of the keys that have one, and the names of the others."""
    worth = [row for row in explained.key_prices if row.size]
    rows = [
        (
            row.key,
            with_unit(row.value, row.unit),
            *(gain_figure(x, 3) for x in (row.less, row.more)),
        )
        for row in worth
    ]
    if rows:
        heads = ("key", "value", "1 % less", "1 % more")
        words = f"{explained.objective} by a percent of a key, solved again over all routes:"
        yield Table(heads, rows, words=2, longest=34, label="One percent", above=words)
    if without := ", ".join(row.key for row in explained.key_prices if not row.size):
        yield Facts([("No effect", without)])


def _prices(explained: Explanation) -> Iterator[Block]:
    """The prices, parameters without effect, and values beyond which nothing is feasible."""
    worth = [price for price in explained.prices if price.matters and not price.at_edge]
    if worth:
        rows = list[tuple[str, str, str]]()
        for price in worth:
            rates = gain_figure(price.more)
            if price.has_kink:
                rates = f"{gain_figure(price.less)} below, {rates} above"
            rows.append((key_of(price), symbol_and_value(price), rates))
        rated = "" if all(price.solved_again for price in worth) else ", for small changes"
        head = f"{explained.objective} per unit of a parameter, the others held{rated}:"
        yield Table((), rows, words=3, label="Prices", above=head)
        again = [price_words(explained, price) for price in worth if price.solved_again]
        yield Facts([("" if k else "One more", words) for k, words in enumerate(again)])
    free = without_effect(explained)
    if free and explained.more_stops_open:
        yield Facts([("One stop", f"{free}: {MAY_CHANGE}")])
    elif free:
        yield Facts([("No effect", free)])
    edges = [
        f"{word} {key_of(price)}"
        for price in explained.prices
        for word, rate in (("more", price.more), ("less", price.less))
        if price.at_edge and math.isinf(rate)
    ]
    if edges:
        yield Facts([("At the edge", f"nothing is feasible with {', '.join(edges)}")])

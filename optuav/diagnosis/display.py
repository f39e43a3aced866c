"""An explanation as tables for a notebook."""

from __future__ import annotations

from collections.abc import Iterator
from xml.etree.ElementTree import Element

from optuav.diagnosis.findings import Findings, with_unit
from optuav.diagnosis.infeasibility import Certificate, Conflict
from optuav.diagnosis.sentences import binding, binding_moments
from optuav.diagnosis.wording import UNDECIDED, name, sentence, signed, valued
from optuav.markup import folded, pairs, paragraph, shown, table


def html(explained: Findings) -> str:
    """The explanation as HTML: binding constraints and their worth, or conflicts."""
    parts = _optimum(explained) if explained else _no_plan(explained)
    notes = [pairs(("Note", note) for note in explained.notes)] if explained.notes else []
    return shown(*parts, *notes)


def _optimum(explained: Findings) -> Iterator[Element]:
    """Verdict, constraints, proof and prices of a plan."""
    plan, sides = explained.plan, explained.constraints
    stays = ", ".join(f"{stop.kind} {stop.duration_s:.2f} s at {stop.at}" for stop in plan.stops)
    said = binding(explained) or f"{', '.join(plan.binding) or 'nothing'} binds"
    yield paragraph(f"{stays}: {said[0].lower()}{said[1:].removesuffix('.')}", good=True)
    yield from map(paragraph, filter(None, [binding_moments(explained)]))
    ordered = sorted(sides, key=lambda side: not side.binds)
    rows = [(e.words, e.label, e.statement, e.figures, e.spare) for e in ordered]
    titles = ("limit", "constraint", "as stated", "in numbers", "to spare")
    well = "; y1_k is the charge in the available well after step k"
    shows_well = any(e.step is not None and e.statement for e in sides)
    head = f"Constraints ({len(rows)}){well * shows_well}"
    yield folded(head, table(titles, rows))
    if explained.bound is not None:
        yield folded("Proof that nothing is better", _sum(explained.bound))
    if prices := sorted(explained.prices, key=lambda price: not price.matters):
        worth = [(name(e), valued(e), signed(e.less), signed(e.more)) for e in prices]
        priced = (e for e in explained.prices if e.matters and e.solved_again and not e.at_edge)
        again = [paragraph(sentence(explained, price)) for price in priced]
        again += [paragraph(f"Where it is 0, {UNDECIDED}")] if explained.more_stops_open else []
        head = f"Prices: {explained.objective} per unit of a parameter, the others held"
        heads = ("parameter", "value", "less", "more")
        yield folded(head, table(heads, worth), *again, is_open=True)
    if keys := explained.key_prices:
        percents = [
            (e.key, with_unit(e.value, e.unit), signed(e.less), signed(e.more)) for e in keys
        ]
        head = f"Keys of flight and beam: {explained.objective} by a percent, solved again"
        yield folded(head, table(("key", "value", "1 % less", "1 % more"), percents))


def _no_plan(explained: Findings) -> Iterator[Element]:
    """Verdict, conflicts with their proofs, and repairs."""
    plan = explained.plan
    yield paragraph(f"{plan.status.value}: {'; '.join(plan.reasons) or plan.proof}", good=False)
    for conflict in explained.conflicts:
        yield from _conflict(conflict)
    if any(conflict.certificates for conflict in explained.conflicts):
        yield paragraph("rounded here; to_dict gives exact fractions")
    if explained.repairs:
        rows = table(("feasible if", ""), [repair.row for repair in explained.repairs])
        yield folded(f"Repairs ({len(explained.repairs)})", rows, is_open=True)


def _conflict(conflict: Conflict) -> Iterator[Element]:
    """Return the constraints that cannot hold together on a route."""
    where = f"On {' → '.join(conflict.route)}"
    where += f" and {conflict.routes - 1} other routes" if conflict.routes > 1 else ""
    if not conflict.proofs:
        yield paragraph(f"{where}: no certificate")
    for proof in conflict.proofs:
        together = " together" if len(proof.labels) > 1 else ""
        words = f"{where}, {', '.join(proof.labels)} cannot hold{together}"
        shown_sum = [_sum(proof)] if isinstance(proof, Certificate) else []
        yield folded(words, *shown_sum, pairs([("keys", ", ".join(proof.keys) or "none")]))


def _sum(certificate: Certificate) -> Element:
    """Rows that are added up, and their sum."""
    return table(("times", "constraint", "row"), certificate.table)

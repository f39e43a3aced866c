"""An explanation: its findings as text with labels in the margin."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from formulations.soc import LABELS
from optuav.diagnosis.findings import ConstraintAtOptimum, Findings, with_unit
from optuav.diagnosis.infeasibility import Certificate, Conflict, number_text
from optuav.diagnosis.sentences import binding
from optuav.diagnosis.wording import UNDECIDED, in_words, name, sentence, signed, valued
from optuav.errors import line_width, printed, spelled
from optuav.plan.summary import LABEL, wrapped

MOST_REPAIRS = 12
EXACT = "rounded here; --json gives exact fractions"
NO_REPAIR = (
    "no change of a single number, up to a factor of 1000, was found that makes it feasible; "
    "places were not moved"
)
NOT_TRIED = "each is a single change; places were not moved"
IN_SLOTS = "where whole slots have to add up to a time exactly, values between those tried may do"


@dataclass(frozen=True)
class Explanation(Findings):
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

    @printed
    def __str__(self) -> str:
        head, *_ = self.plan.summary().split("\n\n")
        blocks = [head.splitlines(), *(_optimum(self) if self else _no_plan(self))]
        if self.doubt_costs_s:
            (costliest, gain_s), *_ = self.doubt_costs_s.items()
            words = f"{costliest} costs most: {gain_s:.3f} s of hover on the robust route"
            rows = ((each, f"{cost_s:.3f} s") for each, cost_s in self.doubt_costs_s.items())
            blocks.append([*wrapped("Doubt", words), *_columns(rows)])
        blocks.append([line for note in self.notes for line in wrapped("Note", note)])
        return "\n\n".join("\n".join(block) for block in blocks if block)

    def __repr__(self) -> str:
        count = len(self.constraints) if self else len(self.conflicts)
        counted = f"{count} {'constraints' if self else 'conflicts'}"
        return repr(self.plan).replace("Plan for", "Explanation for")[:-1] + f", {counted}>"

    def _repr_html_(self) -> str:
        from optuav.diagnosis.display import html

        return html(self)


def _columns(rows: Iterable[tuple[str, ...]]) -> list[str]:
    """Rows as aligned columns under the label; the last column wraps.

    A cell too long for its column but not for a line stays whole, as near to it as it fits.
    """
    table, width = [[*map(spelled, row)] for row in rows], line_width()
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    lines = list[str]()
    for row in table:
        start = " " * LABEL + "".join(f"{cell}  " for cell in map(str.ljust, row, widths[:-1]))
        head, last = start.rstrip(), row[-1]
        if not LABEL <= width - len(last) < len(start):
            lines += wrapped("", last, start, len(start) + 2)
        elif len(head) + 2 + len(last) <= width:
            lines.append(f"{head}{last:>{width - len(head)}}")
        else:
            lines += [head, f"{last:>{width}}"]
    return lines


def _labelled(label: str, lines: list[str]) -> list[str]:
    """Lines with a label in the margin of the first."""
    return [f"{label:<{LABEL}}{line[LABEL:]}" if not k else line for k, line in enumerate(lines)]


def _no_plan(explained: Findings) -> Iterator[list[str]]:
    """Conflicts and repairs, one block of lines each."""
    plan, repairs = explained.plan, explained.repairs
    for conflict in explained.conflicts:
        yield from conflict_text(conflict, plan.slot_s)
    if any(conflict.certificates for conflict in explained.conflicts):
        yield wrapped("Exact", EXACT)
    if repairs:
        rows = _columns(repair.row for repair in repairs[:MOST_REPAIRS])
        lines = [f"{'  or' * (line[LABEL] != ' '):<{LABEL}}{line[LABEL:]}" for line in rows]
        lines = _labelled("Feasible if", lines)
        if (more := len(repairs) - MOST_REPAIRS) > 0:
            lines += wrapped("", f"and {more} more")
        yield [*lines, *wrapped("", NOT_TRIED)]
    elif explained.conflicts or plan.proof == "physics":
        yield wrapped("Repairs", NO_REPAIR if plan.slot_s is None else f"{NO_REPAIR}; {IN_SLOTS}")


def conflict_text(conflict: Conflict, slot_s: float | None) -> Iterator[list[str]]:
    """A conflict with its proofs, one block of lines each."""
    such_as = f"{conflict.routes} routes, such as " if conflict.routes > 1 else ""
    where = f"on {such_as}{' → '.join(conflict.route)}"
    for proof in conflict.proofs:
        together = " together" if len(proof.labels) > 1 else ""
        keys = f" ({', '.join(proof.keys)})" if proof.keys else ""
        named = ", ".join(map(in_words, proof.labels))
        lines = wrapped("Conflict", f"{where}: {named} cannot hold{together}{keys}")
        if isinstance(proof, Certificate):
            yield [*lines, *_labelled("  proof", _columns(_in_words(proof)))]
            continue
        if proof.broken:
            even = "without" if together else "even without"
            lines += wrapped("  there", f"{'; '.join(proof.broken)}, {even} any stay")
        far = "" if math.isinf(proof.far_s) else f" whose sum is at most {proof.far_s:g} s"
        words = f"bracketed: no times{far} satisfy them"
        words += " all, but some do if any one of them is left out" if together else ""
        yield [*lines, *wrapped("  proof", words)]
    if not conflict.proofs:
        why = "the constraints are not linear" if slot_s is None else "only whole slots do not fit"
        yield wrapped("Conflict", f"{where}: no certificate, {why}")


def _in_words(proof: Certificate) -> Iterator[tuple[str, str, str]]:
    """The rows of a proof, their labels in words."""
    return ((factor, in_words(label), row) for factor, label, row in proof.table)


def _limit(side: ConstraintAtOptimum) -> str:
    """A constraint in words; of a time that is at least 0, the time."""
    if side.kind == "bounds":
        return in_words(side.label).removeprefix("range of the ").removesuffix(" ≥ 0")
    return in_words(side.words or side.label)


def _optimum(explained: Findings) -> Iterator[list[str]]:
    """Return binding limits, slack, proof and prices, one block of lines each."""
    plan, sides = explained.plan, explained.constraints
    stays = [f"{stop.kind} {stop.duration_s:.2f} s at {stop.at}" for stop in plan.stops]
    head = wrapped("Optimum", ", ".join(stays))
    if said := binding(explained):
        head += wrapped("What binds", said)
    yield head
    wells = [side for side in sides if side.kind in LABELS]
    others = [side for side in sides if side.kind not in LABELS]
    figures = ((_limit(other), other.figures) for other in others if other.binds)
    names = [_limit(well) for well in wells if well.binds]
    names = names if sides else [*map(in_words, plan.binding)]
    yield _labelled("Binding", _columns(figures) + _columns((name,) for name in names))
    rows = [(e.spare, f"{_limit(e)}: {e.figures}") for e in others if not e.binds]
    free = [(well, f"{number_text(well.slack)} of capacity") for well in wells if not well.binds]
    rows += [(share, _limit(well)) for well, share in free if not well.in_flight]
    if flown := [each for each in free if each[0].in_flight]:  # the least stands for all
        least, share = min(flown, key=lambda each: each[0].slack)
        more = f", the least of {len(flown)} such moments" if len(flown) > 1 else ""
        rows.append((share, f"{_limit(least)}{more}"))
    yield _labelled("To spare", _columns(rows))
    if explained.bound is not None:
        head = wrapped("Proof", "on this route no point that satisfies all of these is better:")
        yield [*head, *_columns(_in_words(explained.bound))]
    yield from _prices(explained)
    yield _key_prices(explained)


def _key_prices(explained: Findings) -> list[str]:
    """The worth of a percent of the keys that have one, and the names of the others."""
    worth = [
        (row.key, with_unit(row.value, row.unit), signed(float(f"{row.more:.3g}")))
        for row in explained.key_prices
        if row.size
    ]
    head = f"{explained.objective} by 1 % more of a key, solved again over all routes:"
    lines = [*wrapped("One percent", head), *_columns(worth)] if worth else []
    without = ", ".join(row.key for row in explained.key_prices if not row.size)
    return lines + (wrapped("No effect", without) if without else [])


def _prices(explained: Findings) -> Iterator[list[str]]:
    """The prices, parameters without effect, and values beyond which nothing is feasible."""
    worth = [price for price in explained.prices if price.matters and not price.at_edge]
    if worth:
        rows, sentences = [], []
        for price in worth:
            rates = signed(price.more)
            if price.has_kink:
                rates = f"{signed(price.less)} below, {rates} above"
            rows.append((name(price), valued(price), rates))
            if price.solved_again:
                sentences += wrapped("", sentence(explained, price))
        rated = "" if all(price.solved_again for price in worth) else ", for small changes"
        head = f"{explained.objective} per unit of a parameter, the others held{rated}:"
        yield [*wrapped("Prices", head), *_columns(rows)]
        yield _labelled("One more", sentences)
    free = ", ".join(name(price) for price in explained.prices if not price.matters)
    if free and explained.more_stops_open:
        yield wrapped("Undecided", f"{free}: {UNDECIDED}")
    elif free:
        yield wrapped("No effect", free)
    edges = [
        f"{word} {name(price)}"
        for price in explained.prices
        for word, rate in (("more", price.more), ("less", price.less))
        if price.at_edge and math.isinf(rate)
    ]
    if edges:
        yield wrapped("At the edge", f"nothing is feasible with {', '.join(edges)}")

"""An explanation, as data and as text."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from formulations.soc import LABELS
from optuav.diagnosis.certificate import Bound
from optuav.diagnosis.infeasibility import Clash, Conflict
from optuav.diagnosis.prices import Price
from optuav.diagnosis.repair import Repair
from optuav.diagnosis.words import (
    LABEL,
    columns,
    labelled,
    listed,
    number_text,
    paragraph,
    with_unit,
)
from optuav.plan import Plan
from optuav.status import Status

MOST_REPAIRS = 12
UNIT_NAMES = {"s": "second", "m": "metre", "A": "ampere", "W": "watt", "V": "volt", "J": "joule"}
EXACT = (
    "certificates are exact: their rows are rounded so that each follows from the mission's, as "
    "times are 0 or more. --json holds all digits, as fractions"
)
NO_REPAIR = (
    "no single number, moved up or down to a thousandfold, was seen to make it feasible; places "
    "were not moved"
)
NOT_TRIED = "each is one change alone; places were not moved"
IN_SLOTS = (
    "a time that whole slots have to fill exactly may do so at single values between those tried"
)
UNDECIDED = (
    "with one rest and one hover in one piece the hover time stays the same; with more stops, "
    "which are not excluded, it may not"
)


@dataclass(frozen=True)
class Side:
    """A constraint at the optimum."""

    label: str
    unit: str
    statement: str  # The constraint as mathematics; empty for one too long to read
    left: float
    sense: str
    right: float
    slack: float
    binds: bool  # Whether it holds with equality
    kind: str = ""  # What it limits, and at the end of which step, as in a `Constraint`
    step: int | None = None
    in_flight: bool = False  # Whether that step is a stage of flight

    @property
    def of_wells(self) -> bool:
        """Whether it limits the available well."""
        return self.kind in LABELS

    def to_dict(self) -> dict[str, object]:
        """As plain data; None for an infinite number."""
        return {
            name: None if isinstance(value, float) and not math.isfinite(value) else value
            for name, value in vars(self).items()
        }


@dataclass(frozen=True)
class Explanation:
    """What `optuav.explain` returns; print it. True where there is a plan.

    Parameters
    ----------
    plan
        What is explained.
    objective
        What was sought, as ``"s of hover"``; empty if there is no plan.
    sense
        ``"maximise"`` or ``"minimise"``.
    conflicts
        Without a plan: which constraints conflict, with proofs; empty where the reasons of the
        plan are physical.
    repairs
        Without a plan: single changes that make it feasible, the smallest first.
    constraints
        With a plan: the constraints of its programme.
    bound
        With a plan: why nothing is better; None where the programme is not linear.
    prices
        With a plan: what the parameters of its programme are worth.
    notes
        What a reader should know.
    more_stops_open
        Whether more than one rest or one hover in one piece might give a longer hover.
    gain_s
        Hover time that more stops bring over one rest and one hover [s]; None where they were not
        searched for, or there is no plan to compare.

    Examples
    --------
    >>> import optuav
    >>> explained = optuav.explain("paper", "P3", perspective="battery")
    >>> [side.label for side in explained.constraints if side.binds]
    ['P3.a state of charge']
    >>> explained.bound.holds()
    True
    """

    plan: Plan
    objective: str = ""
    sense: str = "maximise"
    conflicts: tuple[Conflict, ...] = ()
    repairs: tuple[Repair, ...] = ()
    constraints: tuple[Side, ...] = ()
    bound: Bound | None = None
    prices: tuple[Price, ...] = ()
    notes: tuple[str, ...] = ()
    more_stops_open: bool = False
    gain_s: float | None = None

    def __bool__(self) -> bool:
        return bool(self.plan)

    def __str__(self) -> str:
        head, *_ = self.plan.summary().split("\n\n")
        blocks = [head.splitlines(), *(_optimum(self) if self else _no_plan(self))]
        blocks.append([line for note in self.notes for line in paragraph("Note", note)])
        return "\n\n".join("\n".join(block) for block in blocks if block)

    def to_dict(self) -> dict[str, object]:
        """As plain data: strings, numbers, lists, dicts and None."""
        plan = self.plan
        stated = ("problem", "trajectory", "building", "order", "perspective", "slot_s")
        answer: dict[str, object] = {
            "mission": plan.mission.name,
            **{name: getattr(plan, name) for name in stated},
            "status": plan.status.value,
            "proof": plan.proof,
        }
        if plan:
            answer |= {
                "hover_time_s": plan.hover_time_s,
                "rest_time_s": plan.rest_time_s,
                "route": list(plan.route),
                "objective": self.objective,
                "constraints": [each.to_dict() for each in self.constraints],
                "bound": self.bound.to_dict() if self.bound else None,
                "prices": [each.to_dict() for each in self.prices],
            }
        else:
            answer |= {
                "reasons": list(plan.reasons),
                "conflicts": [each.to_dict() for each in self.conflicts],
                "repairs": [each.to_dict() for each in self.repairs],
            }
        stops = {"more_stops_open": self.more_stops_open, "gain_s": self.gain_s}
        return {**answer, **stops, "notes": list(self.notes)}


# Without a plan


def _no_plan(explained: Explanation) -> Iterator[list[str]]:
    if explained.plan.status is not Status.INFEASIBLE:
        return
    slot_s = explained.plan.slot_s
    for conflict in explained.conflicts:
        yield from conflict_text(conflict, slot_s)
    if any(conflict.certificates for conflict in explained.conflicts):
        yield paragraph("Exact", EXACT)
    if explained.conflicts or explained.repairs or explained.plan.proof == "physics":
        yield _repairs(explained.repairs, slot_s)


def conflict_text(conflict: Conflict, slot_s: float | None) -> Iterator[list[str]]:
    """A conflict with its proofs, one block of lines each."""
    places = " → ".join(conflict.route)
    where = f"on {conflict.routes} routes, such as {places}"
    if conflict.routes == 1:
        where = f"on {places}"
    if conflict.clash is not None:
        yield _clash(conflict.clash, where)
    elif not conflict.certificates:
        why = "the constraints are not linear" if slot_s is None else "only whole slots do not fit"
        yield paragraph("Conflict", f"{where}: no certificate, {why}")
    for each in conflict.certificates:
        head = paragraph("Conflict", f"{where}: {_in_conflict(each.labels, each.keys)}")
        yield [*head, *labelled("  proof", each.lines())]


def _in_conflict(labels: tuple[str, ...], keys: tuple[str, ...]) -> str:
    together = " together" if len(labels) > 1 else ""
    return f"{listed(labels)} cannot hold{together}" + (f" ({', '.join(keys)})" if keys else "")


def _clash(clash: Clash, where: str) -> list[str]:
    together = len(clash.labels) > 1
    lines = paragraph("Conflict", f"{where}: {_in_conflict(clash.labels, clash.keys)}")
    if clash.broken:
        even = "without" if together else "even without"
        lines += paragraph("  there", f"{'; '.join(clash.broken)}, {even} any stay")
    far = "" if math.isinf(clash.far_s) else f" whose sum is at most {clash.far_s:g} s"
    proof = f"bracketed: no times{far} satisfy them"
    if together:
        proof += " all, though they do if any one of them is left out"
    return [*lines, *paragraph("  proof", proof)]


def _repairs(repairs: tuple[Repair, ...], slot_s: float | None) -> list[str]:
    if not repairs:
        return paragraph("Repairs", NO_REPAIR if slot_s is None else f"{NO_REPAIR}; {IN_SLOTS}")
    first, *others = columns((str(each), f"now {each.now_text}") for each in repairs[:MOST_REPAIRS])
    lines = labelled("Feasible if", [first])
    lines += [line for each in others for line in labelled("  or", [each])]
    if (more := len(repairs) - MOST_REPAIRS) > 0:
        lines.append(f"{'':<{LABEL}}and {more} more, each larger")
    return [*lines, f"{'':<{LABEL}}{NOT_TRIED}"]


# With a plan


def _optimum(explained: Explanation) -> Iterator[list[str]]:
    stays = [f"{stop.kind} {stop.duration_s:.2f} s at {stop.at}" for stop in explained.plan.stops]
    yield paragraph("Optimum", ", ".join(stays))
    if not explained.constraints:
        yield labelled("Binding", columns((each,) for each in explained.plan.binding))
    binding = [each for each in explained.constraints if each.binds]
    spare = [each for each in explained.constraints if not each.binds]
    lines = columns((_stated(each) for each in binding if not each.of_wells), formulas=True)
    yield labelled("Binding", lines + columns((each.label,) for each in binding if each.of_wells))
    rows = (
        (each.label, with_unit(each.slack, each.unit), each.statement)
        for each in spare
        if not each.of_wells
    )
    yield labelled("To spare", columns(rows, formulas=True) + columns(_well_moments(spare)))
    if explained.bound is not None:
        head = "no point that satisfies these constraints is better:"
        yield [*paragraph("Proof", head), *explained.bound.lines()]
    yield from _prices(explained)


def _stated(side: Side) -> tuple[str, str]:
    values = f"{number_text(side.left)} {side.sense} {with_unit(side.right, side.unit)}"
    return side.label, side.statement or values


def _well_moments(sides: Iterable[Side]) -> Iterator[tuple[str, str]]:
    """Shares of the battery to spare in the available well; of its moments in flight the least."""
    wells = [each for each in sides if each.of_wells]
    flown = [each for each in wells if each.in_flight]
    for each in wells:
        if not each.in_flight:
            yield f"{number_text(each.slack)} of B", each.label
    if flown:
        least = min(flown, key=lambda each: each.slack)
        more = f", the least of {len(flown)} such moments" if len(flown) > 1 else ""
        yield f"{number_text(least.slack)} of B", f"{least.label}{more}"


def _prices(explained: Explanation) -> Iterator[list[str]]:
    """The prices, what has no effect, and beyond which value nothing is feasible."""
    worth = [each for each in explained.prices if each.matters and not each.at_edge]
    if worth:
        head = f"{explained.objective} per unit of a parameter, the others held:"
        rows = [
            (_name(each), f"{each.symbol} = {with_unit(each.value, each.unit)}", _rates(each))
            for each in worth
        ]
        yield [*paragraph("Prices", head), *columns(rows)]
        sentences = [paragraph("", _sentence(explained, each)) for each in worth]
        yield labelled("One more", [line for lines in sentences for line in lines])
    free = [_name(each) for each in explained.prices if not each.matters]
    if free and explained.more_stops_open:
        yield paragraph("Undecided", f"{listed(free)}: {UNDECIDED}")
    elif free:
        yield paragraph("No effect", ", ".join(free))
    edges = [
        f"{word} {_name(each)}"
        for each in explained.prices
        if each.at_edge
        for word, rate in (("more", each.more), ("less", each.less))
        if math.isinf(rate)
    ]
    if edges:
        yield paragraph("At the edge", f"nothing is feasible with {', '.join(edges)}")


def _name(price: Price) -> str:
    return price.key or price.name


def _rates(price: Price) -> str:
    if not price.has_kink:
        return _signed(price.more)
    return f"{_signed(price.less)} below, {_signed(price.more)} above"


def _signed(value: float) -> str:
    if math.isinf(value):
        return "no plan"
    return f"{value:+.6g}".replace("-", "−") if value else "0"


def _sentence(explained: Explanation, price: Price) -> str:
    """For example: one more second of limits.deadline_s brings 0.102 s of hover."""
    unit = "" if price.unit == "1" else UNIT_NAMES.get(price.unit, price.unit)
    more = f"one more {unit}".rstrip()
    if price.step != 1.0:
        more = f"{price.step:g} {price.unit} more" if unit else f"{price.step:g} more"
    sentence = f"{more} of {_name(price)} {_change(explained, price.gain, price.solved_again)}"
    if price.has_kink:
        sentence += f", as much less {_change(explained, price.loss, price.solved_again)}"
    return sentence


def _change(explained: Explanation, change: float, exact: bool) -> str:
    if math.isinf(change):
        return "leaves no plan"
    if change == 0.0:
        return "changes nothing"
    better = (change > 0.0) == (explained.sense == "maximise")
    gain = "brings" if explained.sense == "maximise" else "saves"
    verb = gain if better else "costs"
    return f"{verb} {'' if exact else 'about '}{abs(change):.3g} {explained.objective}"

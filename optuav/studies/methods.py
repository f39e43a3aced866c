"""Every problem of a mission by every engine, in slots and in continuous times, side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.engines import closed_form
from optuav.engines.ranges import TOLERANCE as SLOT_TOLERANCE
from optuav.errors import SolverError
from optuav.mission import Mission
from optuav.modelling import Model, evaluate
from optuav.modelling.check import TOLERANCE
from optuav.modelling.forms import excess
from optuav.options import ORDERS, Perspective
from optuav.plan import Plan
from optuav.solving import Program, formulate, solve
from optuav.solving.route_choice import route_choice
from optuav.status import Status
from optuav.studies.results import LONGEST_NAME, NONE, Results, Row, fixed, plain_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACCURACY_S = {"closed-form": 1e-6, "cvxpy": 1e-5, "casadi": 1e-4, "grid": 1e-6}
"""By how much an engine may miss an answer [s], up to `LONG_S` and in proportion beyond."""
LONG_S = 1000.0
REFERENCE = "closed form"
UNITS = {
    **dict.fromkeys(("problem", "building", "order", "method", "engine"), ""),
    **{"slot_s": "s", "status": "", "hover_time_s": "s", "rest_time_s": "s"},
    **{"gap_s": "s", "largest_gap_s": "s", "agrees": "", "words": "", "proof": ""},
}
SLOTS_ABREAST = 5
MOST_LINES = 12
MOST_REASONS = 3

Progress = Callable[[int, int, str], None]
"""Called before every answer: how many are done, how many there are, and what comes now."""


def compare_methods(
    mission: Mission,
    perspective: Perspective,
    slots_s: Sequence[float],
    engines: Sequence[str],
    time_limit_s: float | None,
    progress: Progress | None,
    *,
    times: bool,
) -> Results:
    """Return the answers to P3, P4 for every building and order, and P1, one row a method.

    Parameters are those of `optuav.compare`, already checked.
    """
    methods = [*_methods(slots_s, perspective, engines)]
    for library in ("cvxpy", "casadi"):
        if any(method["engine"] == library for method in methods):
            import_module(library)  # or the first time taken would include the import
    on_roofs = [P4(each.name, order=order) for each in mission.buildings for order in ORDERS]
    problems: list[Formulation] = [P3(), *on_roofs, P1()]
    rows: list[Row] = []
    reasons: dict[str, tuple[str, ...]] = {}
    for number, problem in enumerate(problems):
        subject = {"problem": problem.name, "building": problem.building, "order": problem.order}
        reference = _Reference.of(mission, problem, perspective, time_limit_s)
        by_slot: dict[float, Row] = {}
        for column, method in enumerate(methods if reference.program.parts else ()):
            if progress is not None:
                done, total = number * len(methods) + column, len(problems) * len(methods)
                progress(done, total, _name(subject))
            row = {**subject, **method, **_answer(reference, method)}
            if method["slot_s"] is not None:
                row |= _mismatch(row, by_slot.setdefault(method["slot_s"], row))
            rows.append({name: row[name] for name in row if times or name != "time_s"})
        solved = reference.hover_time_s is not None
        reasons[_name(subject)] = () if solved else reference.program.solve().reasons
    facts = {
        "perspective": perspective,
        "agrees": all(row["agrees"] is not False for row in rows),
        "disagreements": _remarks(rows, agrees=False),
        "failures": _remarks(rows, agrees=None),
        "reasons": reasons,
    }
    units = {**UNITS, "time_s": "s"} if times else UNITS
    return Results("optuav comparison", mission, facts, units, tuple(rows), _tables, _figures)


def _methods(
    slots_s: Sequence[float], perspective: Perspective, engines: Sequence[str]
) -> Iterator[Row]:
    """Yield the methods: name, engine, and the length of slots [s] if times are in slots."""
    found: list[tuple[str, str, float | None]] = [(REFERENCE, "closed-form", None)]
    wells = " wells" if perspective == "battery" else ""
    found += [("LP", "cvxpy", None), (f"CasADi{wells}", "casadi", None)]
    for slot_s in map(float, slots_s):
        found += [(f"grid {slot_s:g} s", "grid", slot_s), (f"MILP {slot_s:g} s", "cvxpy", slot_s)]
    for name, engine, length_s in found:
        if engine in (*engines, "closed-form"):
            yield {"method": name, "engine": engine, "slot_s": length_s}


def _remarks(rows: Sequence[Row], *, agrees: bool | None) -> tuple[str, ...]:
    chosen = (row for row in rows if row["agrees"] is agrees)
    return tuple(f"{_name(row)}, {row['method']}: {row['words']}" for row in chosen)


def _name(row: Row) -> str:
    """Return the short name of a problem, for example "P4 b1 rest-first"."""
    return " ".join(row[part] for part in ("problem", "building", "order") if row[part])


@dataclass(frozen=True)
class _Reference:
    """A declared problem and its optimum in continuous times, by closed form."""

    program: Program
    through_wells: Program
    """What CasADi solves."""
    hover_time_s: float | None = None
    model: Model | None = None
    parameters: Row = field(default_factory=dict)
    """Figures of the best itinerary."""
    rounding_s: float = 0.0
    """Seconds of hover by which the tolerance of the constraints may move an answer."""

    @classmethod
    def of(
        cls,
        mission: Mission,
        problem: Formulation,
        perspective: Perspective,
        time_limit_s: float | None,
    ) -> _Reference:
        wells = "wells" if perspective == "battery" else perspective
        program, through_wells = (
            formulate(mission, problem, perspective=each, time_limit_s=time_limit_s)
            for each in (perspective, wells)
        )
        solutions = [closed_form.solve(part.model, len(part.routes)) for part in program.parts]
        chosen = program.best(solutions) if solutions else None
        if chosen is None:
            return cls(program, through_wells)
        number, entry = chosen
        model, solution = program.parts[number].model, solutions[number]
        parameters = model.row(entry)
        worth_s = solution.multipliers_at(entry)
        rounding_s = TOLERANCE * sum(
            worth_s[each.label] * max(1.0, abs(float(evaluate(each.relation.right, parameters))))
            for each in model.constraints
        )
        hover_s = solution.point(entry)["hover_time_s"]
        return cls(program, through_wells, hover_s, model, parameters, rounding_s)

    def plan(self, engine: str, slot_s: float | None) -> Plan:
        """Return the checked plan of a method; CVXPY solves (P1) over all routes at once."""
        question = self.program.question
        if engine == "cvxpy" and isinstance(question.problem, P1):
            return route_choice(
                self.program.network.mission,
                perspective=question.perspective,
                slot_s=slot_s,
                time_limit_s=question.time_limit_s,
            ).plan
        program = self.through_wells if engine == "casadi" else self.program
        question = replace(program.question, engine=engine, slot_s=slot_s)
        return replace(program, question=question).solve()

    def judge(
        self, hover_s: float | None, slot_s: float | None, allowance_s: float
    ) -> dict[str, object]:
        """Return whether an answer is what theory asks, why, and its largest gap [s]."""
        best_s = self.hover_time_s
        if best_s is None or self.model is None:
            words = (
                "no plan, as by closed form" if hover_s is None else "a plan where there is none"
            )
            return {"agrees": hover_s is None, "words": words}
        if slot_s is None:
            if hover_s is None:
                return {"agrees": False, "words": f"no plan, but one with Δ = {best_s:.6g} s"}
            words = f"{abs(best_s - hover_s):.3g} s from the closed form"
            return {"agrees": abs(best_s - hover_s) <= allowance_s, "words": words}
        slots, why = bound(self.model, self.parameters, slot_s)
        largest_s = None if slots is None else slots * slot_s
        gap_s = best_s - (hover_s or 0.0)  # where no slots fit, all of the hover is lost
        within = largest_s is None or gap_s <= largest_s + allowance_s
        limit = "no bound" if largest_s is None else f"bound {largest_s:g} s"
        return {
            "agrees": within and gap_s >= -allowance_s,
            "words": f"{gap_s:.6g} s below continuous times, {limit}: {why}",
            "why": why,
            "largest_gap_s": largest_s,
        }


def _answer(reference: _Reference, method: Row) -> dict[str, Any]:
    """Return what a method answers, its verdict, and the time that it took [s]."""
    row: dict[str, Any] = {"status": Status.ERROR.value, "proof": "none", "words": ""}
    row |= dict.fromkeys(("hover_time_s", "rest_time_s", "gap_s", "largest_gap_s", "agrees", "why"))
    begin, plan = time.perf_counter(), None
    try:
        plan = reference.plan(method["engine"], method["slot_s"])
    except SolverError as error:
        row["words"] = str(error)
    row["time_s"] = time.perf_counter() - begin
    hover_s = plan.hover_time_s if plan else None
    accuracy_s = ACCURACY_S[method["engine"]] * max(1.0, (hover_s or 0.0) / LONG_S)
    row["allowance_s"] = accuracy_s + reference.rounding_s
    if plan is not None:
        row |= {"status": plan.status.value, "proof": plan.proof}
        if plan.status is not Status.ERROR:
            row |= reference.judge(hover_s, method["slot_s"], row["allowance_s"])
    if plan:
        row |= {"hover_time_s": hover_s, "rest_time_s": plan.rest_time_s}
        if reference.hover_time_s is not None:
            row["gap_s"] = reference.hover_time_s - plan.hover_time_s
    return row


def _mismatch(row: Row, other: Row) -> dict[str, Any]:
    """Return what to change in a row if another method finds another answer in the same slots."""
    if not row["agrees"] or not other["agrees"]:
        return {}
    hover_s, found_s = row["hover_time_s"], other["hover_time_s"]
    if hover_s is None or found_s is None:
        same = hover_s is found_s
    else:
        same = abs(hover_s - found_s) <= row["allowance_s"]
    found = "no plan" if found_s is None else f"Δ = {found_s:.6f} s"
    return {} if same else {"agrees": False, "words": f"{other['method']} finds {found}"}


# What whole slots may cost

HOVER, REST = "hover_time_s", "rest_time_s"


class SlotBound(NamedTuple):
    """What the theory says about a length of slot, and why."""

    slots: int | None
    """Δ in continuous times less Δ in slots is from 0 to so many slots; None for no such bound."""
    words: str


def bound(model: Model, parameters: Row, slot_s: float) -> SlotBound:
    """Return the bound for a linear model that maximises the hover time.

    Let (Δ, T') be the optimum in continuous times, and H the horizon that the deadline leaves. If
    neither a shorter hover nor a longer rest can break any other constraint, ⌊Δ⌋ slots of hover and
    the remaining slots of rest are feasible as well: at most one slot is lost, or less than two if
    H is not a whole number of slots. Without a rest less than one slot is lost.

    Parameters
    ----------
    model
        A model with the unknown ``hover_time_s`` and, if there is a rest, ``rest_time_s``.
    parameters
        Values of its parameters for one itinerary.
    slot_s
        Length of a slot [s], > 0.
    """
    rests = any(variable.name == REST for variable in model.variables)
    slots, words = 1, "whole slots" if rests else "no rest"
    for constraint in model.constraints:
        relation = constraint.relation
        form = excess(relation, parameters)[0].times(relation.signs[0])
        by_hover, by_rest = (float(form.coefficients.get(name, 0.0)) for name in (HOVER, REST))
        if relation.sense == "==":
            return SlotBound(None, f"{constraint.label} is an equality")
        if by_hover >= 0.0 >= by_rest:
            continue
        if by_hover != by_rest or by_hover < 0.0:
            what = "a shorter hover" if by_hover < 0.0 else "a longer rest"
            return SlotBound(None, f"{what} can break {constraint.label}")
        horizon_slots = -float(form.constant) / by_hover / slot_s
        if abs(horizon_slots - round(horizon_slots)) > SLOT_TOLERANCE * max(1.0, horizon_slots):
            slots, words = 2, "the horizon is not a whole number of slots"
    return SlotBound(slots, words)


# The printed text


def _tables(found: Results) -> Iterator[RenderableType]:
    """Yield gaps by problem, what each method is worth, how it knows, and the verdict."""
    title = f"{found.mission.name}: longest hover Δ, {found.facts['perspective']}, by every method"
    yield Text(title, style="bold")
    yield ""
    feasible = any(row["hover_time_s"] is not None for row in found.rows)
    if feasible:
        for piece in (*_gap_tables(found), _worth(found), _proofs(found)):
            yield piece
            if isinstance(piece, Table):
                yield ""
    yield from _without_plan(found, feasible)
    for why in dict.fromkeys(row["why"] for row in found.rows if _unbounded(row)):
        yield Text(f"The theory has no bound where {why}.")
    remarks = {"DISAGREE": found.facts["disagreements"], "FAILED": found.facts["failures"]}
    for heading, lines in remarks.items():
        more = [f"and {len(lines) - MOST_LINES} more"] if len(lines) > MOST_LINES else []
        for line in (*lines[:MOST_LINES], *more):
            yield Text(f"{heading}  {line}", style="bold red")
    if found.rows and not any(remarks.values()):
        on_what = "" if feasible else " that nothing is feasible"
        yield Text(f"All {len(found.rows)} answers agree{on_what}.", style="bold green")


def _unbounded(row: Row) -> bool:
    return bool(row["slot_s"] and row["gap_s"] is not None and row["largest_gap_s"] is None)


def _gap_tables(found: Results) -> Iterator[RenderableType]:
    """Yield the gaps, five lengths of slots abreast, and their bound in slots."""
    slots_s = {row["method"]: row["slot_s"] for row in found.rows if row["slot_s"] is not None}
    first_of: dict[float, str] = {}
    for name, slot_s in slots_s.items():
        first_of.setdefault(slot_s, name)
    cells = {(_name(row), row["method"]): row for row in found.rows}
    for first in range(0, max(1, len(first_of)), SLOTS_ABREAST):
        names = list(first_of.values())[first : first + SLOTS_ABREAST]
        table = plain_table("Δ [s]", words=["problem"], gap=1)
        table.columns[0].max_width = LONGEST_NAME
        for name in names:
            table.add_column(Text(f"{slots_s[name]:g} s"), justify="right", min_width=5)
        if names:
            yield Text("Δ in continuous times, and what is lost of it [s] in slots of")
            table.add_column("bound", justify="right", no_wrap=True)
        table.add_column("agree", justify="right")
        for problem in found.facts["reasons"]:
            best = cells.get((problem, REFERENCE))
            shown = [cells.get((problem, name)) for name in names]
            table.add_row(
                Text(problem),
                fixed(best["hover_time_s"], 3) if best else NONE,
                *map(_gap, shown),
                *([_slots_lost(filter(None, shown))] if names else []),
                _agreement({row["agrees"] for row in found.rows if _name(row) == problem}),
            )
        yield table


def _gap(cell: Row | None) -> Text:
    if cell is None:
        return Text("–")
    if cell["agrees"] is None:
        return Text("failed", style="bold red")
    gap_s = cell["gap_s"]
    text = NONE if gap_s is None else f"{round(gap_s, 2) + 0.0:.2f}"
    return Text(text) if cell["agrees"] else Text(f"{text}!", style="bold red")


def _slots_lost(cells: Iterable[Row]) -> str:
    """Return how many slots the theory lets be lost, which may depend on their length."""
    largest = [(row["largest_gap_s"], row["slot_s"]) for row in cells if row["gap_s"] is not None]
    if not largest:
        return "–"
    known = sorted({round(gap_s / slot_s) for gap_s, slot_s in largest if gap_s is not None})
    words = [*map(str, known), *([NONE] if None in dict(largest) else [])]
    unit = " slot" if known == [1] else " slots"
    return "/".join(words) + (unit if len(words) == 1 and known else "")


def _agreement(verdicts: set[bool | None]) -> Text:
    if False in verdicts:
        return Text("NO", style="bold red")
    return Text("–" if not verdicts else "?" if None in verdicts else "yes")


def _worth(found: Results) -> Table:
    """Return the largest gap of each method beside its bound, and how often it agrees."""
    times = ["time [s]"] if "time_s" in found.units else []
    headings = ("largest gap [s]", "its bound [s]", "agree", *times)
    table = plain_table(*headings, words=["method"])
    for method in dict.fromkeys(row["method"] for row in found.rows):
        cells = [row for row in found.rows if row["method"] == method]
        worst = max(cells, key=lambda row: -1.0 if row["gap_s"] is None else abs(row["gap_s"]))
        gap_s, bound_s = worst["gap_s"], NONE
        if gap_s is not None:
            gap_s, bound_s = gap_s if worst["slot_s"] else abs(gap_s), _allowed(worst)
        table.add_row(
            method,
            "reference" if method == REFERENCE else NONE if gap_s is None else _short(gap_s),
            bound_s,
            f"{sum(cell['agrees'] is True for cell in cells)} of {len(cells)}",
            *(f"{sum(cell['time_s'] for cell in cells):.2f}" for _ in times),
        )
    return table


def _proofs(found: Results) -> Table:
    """Return how the methods know; one line for those that differ in their slots only."""
    proofs: dict[str, dict[str, None]] = {}
    for row in found.rows:
        if row["hover_time_s"] is not None:
            kind = row["method"].removesuffix(f" {row['slot_s'] or 0.0:g} s")
            proofs.setdefault(kind, {})[row["proof"].partition(";")[0]] = None
    table = plain_table(words=["method"])
    table.add_column("how it knows")
    for kind, words in proofs.items():
        table.add_row(kind, Text("; ".join(words).removeprefix(f"{kind}: ")))
    return table


def _allowed(cell: Row) -> str:
    if cell["slot_s"] is None:
        return _short(cell["allowance_s"])
    return "no bound" if cell["largest_gap_s"] is None else f"{cell['largest_gap_s']:g}"


def _short(seconds: float) -> str:
    return f"{seconds:.2f}" if abs(seconds) >= 0.01 else f"{seconds:.0e}" if seconds else "0"


def _without_plan(found: Results, feasible: bool) -> Iterator[Text]:
    """Yield which problems have no plan, and why; if none has one, why (P1) has none."""
    names: dict[tuple[str, ...], list[str]] = {}
    for name, reasons in found.facts["reasons"].items():
        if reasons and (feasible or name == "P1"):
            names.setdefault(reasons, []).append(name)
    have = {True: "has", False: "have"}
    for reasons, problems in [*names.items()][:MOST_REASONS]:
        who = f"{', '.join(problems)} {have[len(problems) == 1]} no plan"
        yield Text(f"{who if feasible else 'No problem has a plan'}: {'; '.join(reasons)}.")
    if left := sum(map(len, [*names.values()][MOST_REASONS:])):
        yield Text(f"{left} more {have[left == 1]} no plan either; --json lists the reasons.")


# The pictures


def _figures(found: Results) -> Iterator[tuple[str, Figure | None]]:
    """Yield what slots cost, and the plane of times of the (P4) that hovers longest."""
    from optuav import plots
    from optuav.plots.style import printed

    slotted = [row for row in found.rows if row["slot_s"] and row["gap_s"] is not None]
    lost: dict[tuple[str, str], float] = {}
    for row in sorted(slotted, key=lambda row: row["slot_s"]):
        key = f"{row['slot_s']:g} s", row["problem"]
        lost[key] = max(lost.get(key, 0.0), 100.0 * row["gap_s"] / row["slot_s"])
    if lost:
        bounds = [row["largest_gap_s"] / row["slot_s"] for row in slotted if row["largest_gap_s"]]
        axes = plots.bars(
            [plots.Bar(*key, percent) for key, percent in lost.items()],
            title=f"{printed(found.mission.name)}: what whole slots cost at most, by their length",
            y_label="hover time Δ lost [% of a slot]",
            level=plots.Level(100.0 * max(bounds), "bound of the theory") if bounds else None,
        )
        yield "gaps.png", axes.get_figure(root=True)
    solved = [row for row in found.rows if row["hover_time_s"] is not None]
    rests = [row for row in solved if (row["problem"], row["method"]) == ("P4", REFERENCE)]
    if not rests:
        return
    best = max(rests, key=lambda row: row["hover_time_s"])
    problem, perspective = P4(best["building"], order=best["order"]), found.facts["perspective"]
    slots_s = [row["slot_s"] for row in solved if row["slot_s"] and _name(row) == _name(best)]
    longest_s = max(slots_s, default=found.mission.limits.slot_s)
    (part,) = formulate(found.mission, problem, perspective=perspective).parts
    plans = [
        solve(found.mission, problem, slot_s=each, perspective=perspective)
        for each in (None, longest_s)
    ]
    axes = plots.plane(part.model, part.model.row(0), plans, slot_s=longest_s)
    yield "plane.png", axes.get_figure(root=True)

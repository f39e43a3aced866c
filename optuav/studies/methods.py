"""Every problem of a mission by every engine, in slots and in continuous times, side by side."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any, NamedTuple

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from optuav.engines import closed_form
from optuav.errors import SolverError
from optuav.mission import Mission
from optuav.modelling import Model, evaluate
from optuav.modelling.check import TOLERANCE
from optuav.network.routes import ORDERS
from optuav.plan import Plan
from optuav.solving import Program, formulate, solve
from optuav.solving.route_choice import route_choice
from optuav.status import Status
from optuav.studies.bound import bound
from optuav.studies.results import LONGEST_NAME, NONE, Results, Row, fixed, plain_table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACCURACY_S = {"closed-form": 1e-6, "cvxpy": 1e-5, "casadi": 1e-4, "grid": 1e-6}
"""By how much an engine may miss an answer [s], up to `LONG_S` and in proportion beyond."""
LONG_S = 1000.0
LIBRARIES = {"cvxpy", "casadi"}
REFERENCE = "closed form"
UNITS = {
    **dict.fromkeys(("problem", "building", "order", "method", "engine"), ""),
    **{"slot_s": "s", "status": "", "hover_time_s": "s", "rest_time_s": "s"},
    **{"gap_s": "s", "largest_gap_s": "s", "agrees": "", "words": "", "proof": ""},
}
WIDE = 120
"""Columns of a screen that has room for each gap beside its bound."""
SLOTS_ABREAST = 5
MOST_LINES = 12
MOST_REASONS = 3

Progress = Callable[[int, int, str], None]
"""Called before every answer: how many are done, how many there are, and what comes now."""


class Method(NamedTuple):
    """A way to solve a problem: its name, its engine, and the slots [s] if times are in slots."""

    name: str
    engine: str
    slot_s: float | None = None


def compare_methods(
    mission: Mission,
    perspective: str,
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
    methods = tuple(_methods(slots_s, perspective, engines))
    for library in LIBRARIES & {method.engine for method in methods}:
        import_module(library)  # or the first time taken would include the import
    on_roofs = [("P4", each.name, order) for each in mission.buildings for order in ORDERS]
    problems: list[tuple[str, str | None, str | None]] = [("P3", None, None), *on_roofs]
    problems.append(("P1", None, None))
    rows: list[Row] = []
    reasons: dict[str, tuple[str, ...]] = {}
    for number, (problem, building, order) in enumerate(problems):
        subject = {"problem": problem, "building": building, "order": order}
        reference = _Reference.of(mission, perspective, time_limit_s, **subject)
        by_slot: dict[float, dict[str, Any]] = {}
        for column, method in enumerate(methods if reference.program.parts else ()):
            if progress is not None:
                done = number * len(methods) + column
                progress(done, len(problems) * len(methods), _name(subject))
            row, taken_s = _answer(reference, method)
            if method.slot_s is not None:
                row |= _mismatch(row, by_slot.setdefault(method.slot_s, row))
            rows.append({**subject, **row, **({"time_s": taken_s} if times else {})})
        solved = reference.hover_time_s is not None
        reasons[_name(subject)] = () if solved else reference.program.solve().reasons
    remarks = {
        verdict: tuple(
            f"{_name(row)}, {row['method']}: {row['words']}"
            for row in rows
            if row["agrees"] is verdict
        )
        for verdict in (False, None)
    }
    facts = {
        "perspective": perspective,
        "agrees": not remarks[False],
        "disagreements": remarks[False],
        "failures": remarks[None],
        "reasons": reasons,
    }
    units = {**UNITS, "time_s": "s"} if times else UNITS
    return Results("optuav comparison", mission, facts, units, tuple(rows), _tables, _figures)


def _methods(
    slots_s: Sequence[float], perspective: str, engines: Sequence[str]
) -> Iterator[Method]:
    yield Method(REFERENCE, "closed-form")
    if "cvxpy" in engines:
        yield Method("LP", "cvxpy")
    if "casadi" in engines:
        yield Method("CasADi wells" if perspective == "battery" else "CasADi", "casadi")
    for slot_s in map(float, slots_s):
        if "grid" in engines:
            yield Method(f"grid {slot_s:g} s", "grid", slot_s)
        if "cvxpy" in engines:
            yield Method(f"MILP {slot_s:g} s", "cvxpy", slot_s)


@dataclass(frozen=True)
class _Reference:
    """A declared problem and its optimum in continuous times, by closed form.

    Parameters
    ----------
    program, through_wells
        The problem; CasADi solves `through_wells`.
    hover_time_s
        Best Δ [s]; None if there is none.
    model, parameters
        Declaration and figures of the best itinerary.
    rounding_s
        Seconds of hover by which the tolerance of the constraints may move an answer.
    """

    program: Program
    through_wells: Program
    hover_time_s: float | None = None
    model: Model | None = None
    parameters: Mapping[str, Any] | None = None
    rounding_s: float = 0.0

    @classmethod
    def of(
        cls, mission: Mission, perspective: str, time_limit_s: float | None, **subject: Any
    ) -> _Reference:
        wells = "wells" if perspective == "battery" else perspective
        program, through_wells = (
            formulate(mission, perspective=each, time_limit_s=time_limit_s, **subject)
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

    def plan(self, method: Method) -> Plan:
        """Return the checked plan of a method; CVXPY solves (P1) over all routes at once."""
        question = self.program.question
        if method.engine == "cvxpy" and question.problem == "P1":
            return route_choice(
                self.program.worked_out.mission,
                perspective=question.perspective,
                slot_s=method.slot_s,
                time_limit_s=question.time_limit_s,
            ).plan
        program = self.through_wells if method.engine == "casadi" else self.program
        question = replace(program.question, engine=method.engine, slot_s=method.slot_s)
        return replace(program, question=question).solve()

    def judge(
        self, hover_s: float | None, slot_s: float | None, allowance_s: float
    ) -> tuple[bool, float | None, str]:
        """Return whether an answer is what theory asks, its largest gap [s], and why."""
        best_s = self.hover_time_s
        if best_s is None or self.model is None or self.parameters is None:
            words = (
                "no plan, as by closed form" if hover_s is None else "a plan where there is none"
            )
            return hover_s is None, None, words
        if slot_s is None:
            if hover_s is None:
                return False, None, f"no plan, but one with Δ = {best_s:.6g} s"
            gap_s = abs(best_s - hover_s)
            return gap_s <= allowance_s, None, f"{gap_s:.3g} s from the closed form"
        slots, why = bound(self.model, self.parameters, slot_s)
        largest_s = None if slots is None else slots * slot_s
        gap_s = best_s - (hover_s or 0.0)  # where no slots fit, all of the hover is lost
        agrees = gap_s >= -allowance_s
        agrees &= largest_s is None or gap_s <= largest_s + allowance_s
        limit = "no bound" if largest_s is None else f"bound {largest_s:g} s"
        return agrees, largest_s, f"{gap_s:.6g} s below continuous times, {limit}: {why}"


def _answer(reference: _Reference, method: Method) -> tuple[dict[str, Any], float]:
    """Return what a method answers, with its verdict, and the time that it took [s]."""
    begin = time.perf_counter()
    plan: Plan | None = None
    words = ""
    try:
        plan = reference.plan(method)
    except SolverError as error:
        words = str(error)
    taken_s = time.perf_counter() - begin
    hover_s = plan.hover_time_s if plan else None
    accuracy_s = ACCURACY_S[method.engine] * max(1.0, (hover_s or 0.0) / LONG_S)
    allowance_s = accuracy_s + reference.rounding_s
    agrees, largest_s = None, None
    if plan is not None and plan.status is not Status.ERROR:
        agrees, largest_s, words = reference.judge(hover_s, method.slot_s, allowance_s)
    best_s = reference.hover_time_s
    row = {
        "method": method.name,
        "engine": method.engine,
        "slot_s": method.slot_s,
        "status": Status.ERROR.value if plan is None else plan.status.value,
        "hover_time_s": hover_s,
        "rest_time_s": plan.rest_time_s if plan else None,
        "gap_s": None if hover_s is None or best_s is None else best_s - hover_s,
        "largest_gap_s": largest_s,
        "allowance_s": allowance_s,
        "agrees": agrees,
        "words": words,
        "proof": "none" if plan is None else plan.proof,
    }
    return row, taken_s


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


def _name(row: Row) -> str:
    """Return the short name of a problem, for example "P4 b1 rest-first"."""
    return " ".join(row[part] for part in ("problem", "building", "order") if row[part])


# The printed text


def _tables(found: Results, width: int) -> Iterator[RenderableType]:
    """Yield gaps by problem, what each method is worth, how it knows, and the verdict."""
    title = f"{found.mission.name}: longest hover Δ, {found.facts['perspective']}, by every method"
    yield Text(title, style="bold")
    yield ""
    if any(row["hover_time_s"] is not None for row in found.rows):
        for table in (*_gap_tables(found, wide=width >= WIDE), _worth(found), _proofs(found)):
            yield table
            if isinstance(table, Table):
                yield ""
    yield from _verdict(found)


def _gap_tables(found: Results, *, wide: bool) -> Iterator[RenderableType]:
    """Yield the gaps, five lengths of slots abreast."""
    first_by_slot: dict[float, str] = {}
    for row in found.rows:
        if row["slot_s"] is not None:
            first_by_slot.setdefault(row["slot_s"], row["method"])
    methods = list(first_by_slot.values())
    for first in range(0, max(1, len(methods)), SLOTS_ABREAST):
        if methods:
            lost = "≤ its bound [s]" if wide else "[s]"
            yield Text(f"Δ in continuous times, and what is lost of it {lost} in slots of")
        yield _gaps(found, methods[first : first + SLOTS_ABREAST], wide=wide)


def _gaps(found: Results, slotted: Sequence[str], *, wide: bool) -> Table:
    """Return the gaps of each problem: each beside its bound, or with the bounds at the end."""
    slots_s = {row["method"]: row["slot_s"] for row in found.rows}
    others = [name for name, s in slots_s.items() if s is None and name != REFERENCE and wide]
    bounds_last = bool(slotted) and not wide
    table = plain_table("Δ [s]", *others, words=["problem"], gap=2 if wide else 1)
    table.columns[0].max_width = LONGEST_NAME
    for name in slotted:
        table.add_column(Text(f"{slots_s[name]:g} s"), justify="right", min_width=5)
    for name in (*(["bound"] if bounds_last else []), "agree"):
        table.add_column(name, justify="right", no_wrap=bounds_last and name == "bound")
    for problem in found.facts["reasons"]:
        own = {row["method"]: row for row in found.rows if _name(row) == problem}
        cells = [own.get(name) for name in slotted]
        table.add_row(
            Text(problem),
            fixed(own[REFERENCE]["hover_time_s"], 3) if own else NONE,
            *(_gap(own.get(name)) for name in others),
            *(_gap(cell, with_bound=wide) for cell in cells),
            *([_slots_lost([cell for cell in cells if cell])] if bounds_last else []),
            _agreement(own.values()),
        )
    return table


def _slots_lost(cells: Iterable[Row]) -> str:
    """Return how many slots the theory lets be lost, which may depend on their length."""
    largest = [
        (cell["largest_gap_s"], cell["slot_s"]) for cell in cells if cell["gap_s"] is not None
    ]
    if not largest:
        return "–"
    known = sorted({round(gap_s / slot_s) for gap_s, slot_s in largest if gap_s is not None})
    words = [*map(str, known), *([NONE] if None in dict(largest) else [])]
    unit = " slot" if known == [1] else " slots"
    return "/".join(words) + (unit if len(words) == 1 and known else "")


def _gap(cell: Row | None, *, with_bound: bool = False) -> Text:
    if cell is None:
        return Text("–")
    if cell["agrees"] is None:
        return Text("failed", style="bold red")
    gap_s = cell["gap_s"]
    if gap_s is None:
        text = NONE
    elif cell["slot_s"] is None:
        text = _short(abs(gap_s))
    else:
        text = f"{round(gap_s, 2) + 0.0:.2f}"
    if with_bound and gap_s is not None:
        text += f" ≤ {_allowed(cell)}"
    return Text(text) if cell["agrees"] else Text(f"{text}!", style="bold red")


def _agreement(cells: Iterable[Row]) -> Text:
    verdicts = {cell["agrees"] for cell in cells}
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
        if method == REFERENCE:
            gap = "reference"
        elif worst["gap_s"] is None:
            gap = NONE
        else:
            gap = _short(worst["gap_s"] if worst["slot_s"] else abs(worst["gap_s"]))
        table.add_row(
            method,
            gap,
            NONE if worst["gap_s"] is None else _allowed(worst),
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


def _verdict(found: Results) -> Iterator[Text]:
    feasible = any(row["hover_time_s"] is not None for row in found.rows)
    yield from _without_plan(found, feasible)
    unbounded = {
        row["words"].partition(": ")[2]: None
        for row in found.rows
        if row["slot_s"] and row["gap_s"] is not None and row["largest_gap_s"] is None
    }
    for why in unbounded:
        yield Text(f"The theory has no bound where {why}.")
    remarks = {"DISAGREE": found.facts["disagreements"], "FAILED": found.facts["failures"]}
    for heading, lines in remarks.items():
        more = len(lines) - MOST_LINES
        for line in (*lines[:MOST_LINES], *([f"and {more} more"] if more > 0 else [])):
            yield Text(f"{heading}  {line}", style="bold red")
    if found.rows and not any(remarks.values()):
        on_what = "" if feasible else " that nothing is feasible"
        yield Text(f"All {len(found.rows)} answers agree{on_what}.", style="bold green")


def _without_plan(found: Results, feasible: bool) -> Iterator[Text]:
    """Yield which problems have no plan, and why; if none has one, why (P1) has none."""
    names: dict[tuple[str, ...], list[str]] = {}
    for name, reasons in found.facts["reasons"].items():
        if reasons and (feasible or name == "P1"):
            names.setdefault(reasons, []).append(name)
    for number, (reasons, problems) in enumerate(names.items()):
        if number == MOST_REASONS:
            left = sum(map(len, [*names.values()][MOST_REASONS:]))
            verb = "has" if left == 1 else "have"
            yield Text(f"{left} more {verb} no plan either; --json tells why.")
            return
        verb = "has" if len(problems) == 1 else "have"
        who = f"{', '.join(problems)} {verb} no plan" if feasible else "No problem has a plan"
        yield Text(f"{who}: {'; '.join(reasons)}.")


# The pictures


def _figures(found: Results) -> Iterator[tuple[str, Figure | None]]:
    """Yield what slots cost, and the plane of times of the (P4) that hovers longest."""
    from optuav import plots

    gaps = {
        (_name(row), row["slot_s"]): plots.Gap(
            f"{row['problem']} {row['order']}" if row["order"] else row["problem"],
            row["slot_s"],
            row["gap_s"],
            row["largest_gap_s"],
        )
        for row in reversed(found.rows)
        if row["slot_s"] is not None and row["gap_s"] is not None
    }
    if gaps:
        drawn = sorted(gaps.values(), key=lambda gap: gap.slot_s)
        axes = plots.slot_gaps(drawn, found.mission.name)
        yield "gaps.png", axes.get_figure(root=True)
    rests = [
        row
        for row in found.rows
        if (row["problem"], row["method"]) == ("P4", REFERENCE) and row["hover_time_s"] is not None
    ]
    if rests:
        best = max(rests, key=lambda row: row["hover_time_s"])
        yield "plane.png", _plane(found, best)


def _plane(found: Results, best: Row) -> Figure | None:
    """Return the plane of a (P4) with its optimum, and that in the longest slots that fit."""
    subject = {"building": best["building"], "order": best["order"]}
    subject["perspective"] = found.facts["perspective"]
    answered = [r for r in found.rows if _name(r) == _name(best) and r["hover_time_s"] is not None]
    slots_s = [row["slot_s"] for row in answered if row["slot_s"] is not None]
    slot_s = max(slots_s, default=found.mission.limits.slot_s)
    (part,) = formulate(found.mission, "P4", **subject).parts
    plans = [solve(found.mission, "P4", slot_s=each, **subject) for each in (None, slot_s)]
    from optuav import plots

    axes = plots.plane(part.model, part.model.row(0), plans, slot_s=slot_s)
    return axes.get_figure(root=True)

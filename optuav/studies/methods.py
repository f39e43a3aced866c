"""Every problem of a mission by every engine, in slots and in continuous times."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any

from formulations.perspectives import AVAILABLE, PAPER
from optuav.engines import closed_form
from optuav.engines.capabilities import ENGINES
from optuav.errors import Fault, InputError, SolverError
from optuav.mission import Mission, load
from optuav.mission.quantities import SLOT
from optuav.mission.words import shown
from optuav.modelling import Model, evaluate
from optuav.modelling.check import TOLERANCE
from optuav.network.routes import ORDERS
from optuav.plan import Plan
from optuav.solving import Program, formulate
from optuav.solving.question import LIMIT
from optuav.solving.route_choice import route_choice
from optuav.status import Status
from optuav.studies.bound import bound
from optuav.studies.comparison import Cell, Comparison, Method, Row

SLOTS_S = (0.5, 1.0, 5.0, 10.0, 60.0)
CLOSED_FORM = Method("closed form", "closed-form", None)
ACCURACY_S = {"closed-form": 1e-6, "cvxpy": 1e-5, "casadi": 1e-4, "grid": 1e-6}
"""What the answer of an engine may miss [s], for times up to `LONG_S` and in proportion beyond."""
LONG_S = 1000.0
LIBRARIES = {"cvxpy": "cvxpy", "casadi": "casadi"}

Progress = Callable[[int, int, str], None]
"""Called before every cell: how many are done, how many there are, and what comes now."""


def compare(
    mission: Mission | str | Path,
    *,
    slots: Sequence[float] = SLOTS_S,
    perspective: str = "battery",
    engines: Sequence[str] = ENGINES,
    time_limit_s: float | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Solve P3, P4 for every building and order, and P1, by every method, and compare the answers.

    The methods are closed form, the linear programme by CVXPY, CasADi (through both wells of the
    battery, if the perspective is ``"battery"``), and for every length of slot the exhaustive grid
    of Algorithm 1 and the integer programme by CVXPY, whose linear relaxation is the former. (P1)
    is one integer programme that chooses the route as well. An answer in continuous times has to be
    that of the closed form, one in slots within the bound of the theory, and the integer
    programme's that of the grid.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    slots
        Lengths of the time slots [s], 0.001 <= x <= 1e7.
    perspective
        ``"battery"``, ``"energy"`` or ``"adjusted"``: those that are linear in the times.
    engines
        Which engines to compare; the closed form, from which gaps are counted, is always there.
    time_limit_s
        Longest that an engine may take for one programme [s], > 0; None for no limit.
    progress
        What to call before every cell with the number of cells that are done, the number of all
        cells, and the name of the row.

    Raises
    ------
    InputError
        If an argument is out of range.
    """
    _refuse(slots, perspective, engines, time_limit_s)
    asked = mission if isinstance(mission, Mission) else load(mission)
    methods = tuple(_methods(slots, perspective, engines))
    for method in methods:
        if method.engine in LIBRARIES:
            import_module(LIBRARIES[method.engine])
    problems = [
        ("P3", None, None),
        *(("P4", each.name, order) for each in asked.buildings for order in ORDERS),
        ("P1", None, None),
    ]
    rows = []
    for number, (problem, building, order) in enumerate(problems):
        begun = Row(problem, building, order, (), ())

        def tell(column: int, name: str = begun.name, before: int = number) -> None:
            if progress is not None:
                done, total = before * len(methods) + column, len(problems) * len(methods)
                progress(done, total, name)

        declared = _Declared.of(asked, problem, building, order, perspective, time_limit_s)
        cells = tuple(_cells(declared, methods, tell))
        reasons = declared.program.solve().reasons if declared.hover_time_s is None else ()
        rows.append(replace(begun, cells=cells, reasons=reasons))
    return Comparison(asked, perspective, methods, tuple(rows))


def _refuse(
    slots: Sequence[float],
    perspective: str,
    engines: Sequence[str],
    time_limit_s: float | None,
) -> None:
    faults = [Fault("slots", shown(s), SLOT.words) for s in slots if not SLOT.accepts(s)]
    if not faults and len(set(slots)) < len(slots):
        faults.append(Fault("slots", shown(tuple(slots)), "each length once"))
    if time_limit_s is not None and not LIMIT.accepts(time_limit_s):
        faults.append(Fault("time_limit_s", shown(time_limit_s), f"{LIMIT.words}, or nothing"))
    if perspective not in PAPER:
        plans = "; available where plans are compared (compare_by, --by)"
        words = f"one of {', '.join(PAPER)}{plans if perspective == AVAILABLE else ''}"
        faults.append(Fault("perspective", repr(perspective), words))
    unknown = (each for each in engines if each not in ENGINES)
    faults += [Fault("engines", repr(each), f"some of {', '.join(ENGINES)}") for each in unknown]
    if faults:
        raise InputError(faults)


def _methods(slots: Sequence[float], perspective: str, engines: Sequence[str]) -> Iterator[Method]:
    yield CLOSED_FORM
    if "cvxpy" in engines:
        yield Method("LP", "cvxpy", None)
    if "casadi" in engines:
        yield Method("CasADi wells" if perspective == "battery" else "CasADi", "casadi", None)
    for slot_s in map(float, slots):
        if "grid" in engines:
            yield Method(f"grid {slot_s:g} s", "grid", slot_s)
        if "cvxpy" in engines:
            yield Method(f"MILP {slot_s:g} s", "cvxpy", slot_s)


@dataclass(frozen=True)
class _Declared:
    """A problem declared for the engines, and its optimum in continuous times.

    Parameters
    ----------
    program, through_wells
        The problem; `through_wells` is for CasADi.
    hover_time_s
        Best Δ by closed form [s]; None if there is none.
    model, parameters
        Declaration and numbers of the itinerary that is best.
    rounding_s
        Seconds of hover that the constraints are worth by which an engine may miss them.
    """

    program: Program
    through_wells: Program
    hover_time_s: float | None
    model: Model | None
    parameters: Mapping[str, Any]
    rounding_s: float

    @classmethod
    def of(
        cls,
        mission: Mission,
        problem: str,
        building: str | None,
        order: str | None,
        perspective: str,
        time_limit_s: float | None,
    ) -> _Declared:
        """Declare a problem of a mission."""
        program, through_wells = (
            formulate(
                mission,
                problem,
                building=building,
                order=order,
                perspective=each,
                time_limit_s=time_limit_s,
            )
            for each in (perspective, "wells" if perspective == "battery" else perspective)
        )
        solutions = [closed_form.solve(part.model, len(part.routes)) for part in program.parts]
        chosen = program.best(solutions) if solutions else None
        if chosen is None:
            return cls(program, through_wells, None, None, {}, 0.0)
        number, entry = chosen
        model, solution = program.parts[number].model, solutions[number]
        parameters = model.row(entry)
        worth_s = solution.multipliers_at(entry)
        rounding_s = sum(
            worth_s[each.label] * max(1.0, abs(float(evaluate(each.relation.right, parameters))))
            for each in model.constraints
        )
        hover_time_s = solution.point(entry)["hover_time_s"]
        return cls(program, through_wells, hover_time_s, model, parameters, TOLERANCE * rounding_s)


def _cells(
    declared: _Declared, methods: Sequence[Method], tell: Callable[[int], None]
) -> Iterator[Cell]:
    """The cells of a row; none where the route cannot be flown."""
    by_grid: dict[float, Cell] = {}
    for column, method in enumerate(methods if declared.program.parts else ()):
        tell(column)
        cell = _judged(_solved(declared, method), declared)
        if method.slot_s is not None:
            cell = _compared(cell, by_grid.setdefault(method.slot_s, cell))
        yield cell


def _solved(declared: _Declared, method: Method) -> Cell:
    begin = time.perf_counter()
    status, hover_s, rest_s = Status.ERROR, None, None
    proof, words = "none", ""
    try:
        plan = _plan(declared, method)
    except SolverError as error:
        words = str(error)
    else:
        status, proof = plan.status, plan.proof
        if plan:
            hover_s, rest_s = plan.hover_time_s, plan.rest_time_s
    taken_s = time.perf_counter() - begin
    accuracy_s = ACCURACY_S[method.engine] * max(1.0, (hover_s or 0.0) / LONG_S)
    allowance_s = accuracy_s + declared.rounding_s
    gap_s = (
        None
        if hover_s is None or declared.hover_time_s is None
        else declared.hover_time_s - hover_s
    )
    return Cell(
        method, status, hover_s, rest_s, gap_s, None, allowance_s, None, words, proof, taken_s
    )


def _plan(declared: _Declared, method: Method) -> Plan:
    """The checked plan of a method; CVXPY solves (P1) as one programme over all routes."""
    asked = declared.program.question
    if method.engine == "cvxpy" and asked.problem == "P1":
        return route_choice(
            declared.program.worked_out.mission,
            perspective=asked.perspective,
            slot_s=method.slot_s,
            time_limit_s=asked.time_limit_s,
        ).plan
    program = declared.through_wells if method.engine == "casadi" else declared.program
    asked = replace(program.question, engine=method.engine, slot_s=method.slot_s)
    return replace(program, question=asked).solve()


def _judged(cell: Cell, declared: _Declared) -> Cell:
    """The cell, with what the theory says of it."""
    if cell.status is Status.ERROR:
        return cell
    best_s, slot_s = declared.hover_time_s, cell.method.slot_s
    if best_s is None or declared.model is None:
        there_is_none = cell.hover_time_s is None
        words = "no plan, as by closed form" if there_is_none else "a plan where there is none"
        return replace(cell, agrees=there_is_none, words=words)
    if slot_s is None:
        if cell.gap_s is None:
            return replace(cell, agrees=False, words=f"no plan, but one with Δ = {best_s:.6g} s")
        words = f"{abs(cell.gap_s):.3g} s from the closed form"
        return replace(cell, agrees=abs(cell.gap_s) <= cell.allowance_s, words=words)
    allowed, words = bound(declared.model, declared.parameters, slot_s)
    largest_s = None if allowed is None else allowed * slot_s
    # Where no slots fit, all of the hover time is lost.
    gap_s = best_s if cell.gap_s is None else cell.gap_s
    agrees = gap_s >= -cell.allowance_s
    agrees &= largest_s is None or gap_s <= largest_s + cell.allowance_s
    limit = "no bound" if largest_s is None else f"bound {largest_s:g} s"
    return replace(
        cell,
        largest_gap_s=largest_s,
        agrees=agrees,
        words=f"{gap_s:.6g} s below continuous times, {limit}: {words}",
    )


def _compared(cell: Cell, other: Cell) -> Cell:
    """The cell, with whether another method finds the same in the same slots."""
    if not cell.agrees or not other.agrees:
        return cell
    if cell.hover_time_s is None or other.hover_time_s is None:
        same = cell.hover_time_s is other.hover_time_s
    else:
        same = abs(cell.hover_time_s - other.hover_time_s) <= cell.allowance_s
    if same:
        return cell
    found = "no plan" if other.hover_time_s is None else f"Δ = {other.hover_time_s:.6f} s"
    return replace(cell, agrees=False, words=f"{other.method.name} finds {found}")

"""Every problem of a mission by every engine, in slots and in continuous times, side by side."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from math import inf
from typing import NamedTuple, NotRequired, TypedDict

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.arrays import Values
from optuav.engines.linear_form import SLOTS_ROUNDING
from optuav.errors import SolverError
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.modelling.classify import traits
from optuav.modelling.forms import excess
from optuav.options import ORDERS, ORDERS_OF_SEVERAL, Perspective
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Heading, Note, Table
from optuav.presentation.numbers import NONE, figure, fixed, seconds
from optuav.solving import formulate, solve
from optuav.solving.route_choice import route_choice
from optuav.studies.processes import run_tasks
from optuav.studies.results import ComparedAnswer, Comparison, Pictures

ACCURACY_S = {**dict.fromkeys(("closed-form", "bracket", "cvxpy", "grid"), 1e-5), "casadi": 1e-4}
"""Tolerance of an engine's answer [s], up to `LONG_S` and in proportion beyond."""
LONG_S = 1000.0
SLOTS_S, SLOTS_OF_SEVERAL_S = (0.5, 1.0, 5.0, 10.0, 60.0), (10.0, 60.0)
"""Lengths of slots that are compared by default [s], and with several devices."""
HOVER, REST = "hover_time_s", "rest_time_s"
METHOD_UNITS = {
    **dict.fromkeys(("problem", "building", "order", "method", "engine"), ""),
    **{"slot_s": "s", "status": "", "hover_time_s": "s", "rest_time_s": "s"},
    **{"gap_s": "s", "largest_gap_s": "s", "relaxation_s": "s"},
    **{"agrees": "", "words": "", "proof": ""},
}
Progress = Callable[[int, int, str], None]
"""Called before every answer: how many are done, how many there are, and what comes now."""
Bound = tuple[int | None, str]
"""Number of slots that Δ in slots may lose to continuous times, None for no bound; and why."""
Bounds = dict[float, Bound]  # By length of slots [s]


class ComparedMethod(NamedTuple):
    """A method: an engine, in slots or in continuous times."""

    name: str
    engine: str
    slot_s: float | None
    perspective: Perspective


class TimeTaken(TypedDict):
    """The time that an answer took [s], if it was asked for."""

    time_s: NotRequired[float]


class MethodAnswer(ComparedAnswer, TimeTaken):
    """A row of a comparison of methods: a problem, a method and its answer.

    Hover, rest and gap are None without a plan, `agrees` if the engine failed, the largest gap that
    theory allows if there is none, and the bound of the relaxation unless a MILP chose the route.
    """

    problem: str
    building: str | None
    order: str | None
    method: str
    engine: str
    slot_s: float | None
    perspective: Perspective
    relaxation_s: float | None
    proof: str
    words: str
    rest_time_s: float | None
    gap_s: float | None
    allowance_s: float
    largest_gap_s: float | None
    agrees: bool | None
    why: str | None


@dataclass(frozen=True, kw_only=True, repr=False)
class MethodComparison(Comparison):
    """Every problem of a mission by every engine, one row per problem and method.

    Parameters
    ----------
    perspective
        How to count charge.
    agrees, disagreements, failures
        Whether all answers agree, those that do not, and the engines that failed, in words.
    reasons
        By problem, why it has no plan; empty where it has one.

    Examples
    --------
    >>> import optuav
    >>> found = optuav.compare("paper", perspective="battery", slots_s=60, engines=["grid"])
    >>> found.agrees, found.failures
    (True, ())
    """

    kind = "optuav comparison"
    rows: tuple[MethodAnswer, ...]
    perspective: Perspective
    agrees: bool
    disagreements: tuple[str, ...]
    failures: tuple[str, ...]
    reasons: Mapping[str, tuple[str, ...]]

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each column by its name."""
        return METHOD_UNITS | ({"time_s": "s"} if self._timed else {})

    @property
    def _timed(self) -> bool:
        return "time_s" in self.rows[0]

    def blocks(self) -> Iterator[Block]:
        """Yield the verdict, gaps by problem, what each method is worth, and how it knows."""
        name, question = self.mission.name, f"{self.perspective}, by every method"
        yield Heading(f"{name}: longest hover Δ, {question}")
        feasible = any(row["hover_time_s"] is not None for row in self.rows)
        yield Note([*self._verdict(feasible)])
        if feasible:
            yield self._gaps()
            yield from self._worth()
        yield Note([*self._remarks(feasible)])

    def _verdict(self, feasible: bool) -> Iterator[str]:
        """Yield who disagrees or failed, or that all agree."""
        for heading, lines in (("DISAGREE", self.disagreements), ("FAILED", self.failures)):
            yield from (f"{heading}  {line}" for line in lines)
        if not self.disagreements and not self.failures:
            plans = sum(row["hover_time_s"] is not None for row in self.rows)
            few = f", {plans} of them with a plan" if plans < len(self.rows) else ""
            on_what = few if feasible else " that nothing is feasible"
            yield f"All {len(self.rows)} answers agree{on_what}."

    def _remarks(self, feasible: bool) -> Iterator[str]:
        """Yield why problems have no plan, and what theory does not bound."""
        for name, reasons in self.reasons.items():
            if reasons and (feasible or name == "P1"):
                who = f"{name} has no plan" if feasible else "No problem has a plan"
                yield f"{who}: {'; '.join(reasons)}."
        unbounded = (row for row in self.rows if row["why"] and row["largest_gap_s"] is None)
        for why in dict.fromkeys(row["why"] for row in unbounded):
            yield f"The theory has no bound where {why}."
        lengths_s = {row["slot_s"] for row in self.rows if row["slot_s"]}
        if self.mission.devices and lengths_s == {*SLOTS_OF_SEVERAL_S}:
            lengths = " and ".join(figure(slot_s) for slot_s in SLOTS_OF_SEVERAL_S)
            yield f"With several devices, slots of {lengths} s are compared by default."

    def _gaps(self) -> Table:
        """Return what slots lose of the hover by problem."""
        slots_s = [*dict.fromkeys(row["slot_s"] for row in self.rows if row["slot_s"])]
        # The first of several methods in the same slots
        cells = {(_name(row), row["slot_s"]): row for row in reversed(self.rows)}
        rows = list[list[str]]()
        for problem in self.reasons:
            verdicts = {row["agrees"] for row in self.rows if _name(row) == problem}
            gaps = (_gap(cells[problem, slot_s]) for slot_s in slots_s)
            best_s = cells[problem, None]["hover_time_s"]
            agree = "NO" if False in verdicts else "?" if None in verdicts else "yes"
            rows.append([problem, fixed(best_s, 3), *gaps, agree])
        heads = ["problem", "Δ [s]", *(f"{figure(slot_s)} s" for slot_s in slots_s), "agree"]
        above = "Δ in continuous times; below each length of slot, how much of it is lost [s]"
        return Table(heads, rows, gap=1, above=above)

    def _worth(self) -> Iterator[Block]:
        """Yield the largest gap of each method by its bound, how often it agrees, and its proof."""
        times = ["time [s]"] if self._timed else []
        rows, proofs = list[list[str]](), dict[str, dict[str, None]]()
        for method in dict.fromkeys(row["method"] for row in self.rows):
            cells = [row for row in self.rows if row["method"] == method]
            solved = [row for row in cells if row["gap_s"] is not None]
            gap, limit = NONE, NONE
            if solved:
                worst = max(solved, key=lambda row: abs(row["gap_s"] or 0.0))
                limit_s = worst["largest_gap_s"] if worst["slot_s"] else worst["allowance_s"]
                limit = "no bound" if limit_s is None else figure(limit_s)
                gap_s = worst["gap_s"] or 0.0
                short = figure(abs(gap_s), 1)
                gap = fixed(gap_s) if abs(gap_s) >= 0.01 else short
            agree = f"{sum(cell['agrees'] is True for cell in cells)} of {len(cells)}"
            took = (fixed(sum(cell["time_s"] for cell in cells)) for _ in times)
            reference = method == self.rows[0]["method"]
            rows.append([method, "reference" if reference else gap, limit, agree, *took])
            for row in solved:  # One line for methods that differ only in their slots
                kind = method.removesuffix(f" {figure(row['slot_s'] or 0.0)} s")
                proofs.setdefault(kind, {})[row["proof"].partition(";")[0]] = None
        yield Table(["method", "largest gap [s]", "its bound [s]", "agree", *times], rows)
        notes = [
            f"{kind}: {'; '.join(words).removeprefix(f'{kind}: ')}"
            for kind, words in proofs.items()
        ]
        relaxed = [row["relaxation_s"] for row in self.rows if row["relaxation_s"] is not None]
        if limits := " or ".join(dict.fromkeys(seconds(bound_s, 3) for bound_s in relaxed)):
            notes.insert(
                0, f"P1 over all routes as one MILP: its LP relaxation bounds Δ by {limits}"
            )
        yield Note(notes)

    def pictures(self) -> Pictures:
        """Yield what slots cost, by their length."""
        from optuav import plots
        from optuav.plots.style import drawable

        lost, bounds = dict[tuple[float, str], float](), list[float]()
        for row in self.rows:
            slot_s, gap_s = row["slot_s"], row["gap_s"]
            if slot_s and gap_s is not None:
                key = slot_s, row["problem"]
                lost[key] = max(lost.get(key, 0.0), 100.0 * gap_s / slot_s)
                if largest_s := row["largest_gap_s"]:
                    bounds.append(largest_s / slot_s)
        if lost:
            # A stable order: of slots of one length, the problems as in the rows
            bars = [
                plots.Bar(f"{figure(slot_s)} s", problem, lost[slot_s, problem])
                for slot_s, problem in sorted(lost, key=lambda key: key[0])
            ]
            level = plots.Mark(100.0 * max(bounds), "bound of the theory") if bounds else None
            title = f"{drawable(self.mission.name)}: what whole slots cost at most, by their length"
            y_label = "hover time Δ lost [% of a slot]"
            yield "gaps.png", plots.bars(bars, title=title, y_label=y_label, level=level)


def _gap(cell: MethodAnswer) -> str:
    """Return the gap of an answer in slots, marked where it disagrees."""
    if cell["agrees"] is None:
        return "failed"
    gap_s = cell["gap_s"]
    text = fixed(gap_s)
    return text if cell["agrees"] else f"{text}!"


def default_slots_s(mission: Mission) -> tuple[float, ...]:
    """Return the lengths of slots to compare by default [s]; short ones are slow on many routes."""
    return SLOTS_OF_SEVERAL_S if mission.devices else SLOTS_S


def compare_methods(
    mission: Mission,
    perspective: Perspective,
    slots_s: Sequence[float],
    engines: Sequence[str],
    time_limit_s: float | None,
    progress: Progress | None,
    workers: int,
    *,
    times: bool,
) -> MethodComparison:
    """Return the answers to P3, P4 for every building and order, and P1, one row per method.

    The parameters come from `optuav.compare`, already checked.
    """
    methods = [*_methods(slots_s, perspective, engines)]
    orders = ORDERS_OF_SEVERAL if mission.devices else ORDERS
    on_roofs = [P4(name, order=order) for name in mission.buildings.names for order in orders]
    # From the last row to the first: (P1) takes longest, so that it begins first.
    problems: list[Formulation] = [P1(), *reversed(on_roofs), P3()]
    rows, tell = list[MethodAnswer](), progress or (lambda *_: None)
    reasons: dict[str, tuple[str, ...]] = {}
    tasks = [(mission, problem, perspective, methods, time_limit_s, times) for problem in problems]
    answers = run_tasks(_answers, tasks, workers)
    for number, problem in enumerate(problems):
        name = " ".join(filter(None, (problem.name, problem.building, problem.order)))
        tell(number, len(problems), name)
        some, reasons[name] = next(answers)
        rows = some + rows
    remarks: dict[bool | None, list[str]] = {True: [], False: [], None: []}
    for row in rows:
        remarks[row["agrees"]].append(f"{_name(row)}, {row['method']}: {row['words']}")
    return MethodComparison(
        mission=mission,
        rows=tuple(rows),
        perspective=perspective,
        agrees=not remarks[False],
        disagreements=tuple(remarks[False]),
        failures=tuple(remarks[None]),
        reasons=dict(reversed(reasons.items())),
    )


def _answers(
    mission: Mission,
    problem: Formulation,
    perspective: Perspective,
    methods: Sequence[ComparedMethod],
    time_limit_s: float | None,
    times: bool,
) -> tuple[list[MethodAnswer], tuple[str, ...]]:
    """Return a problem's rows, one per method, and the reasons if the reference has no plan."""
    for library in ("cvxpy", "casadi"):
        if any(method.engine == library for method in methods):
            import_module(library)  # or the first time taken would include the import
    best_s, bounds = _optimum(mission, problem, methods)
    rows, reasons = list[MethodAnswer](), tuple[str, ...]()
    by_slot = dict[float, MethodAnswer]()
    for method in methods:
        begin = time.perf_counter()
        plan, words, relaxation_s = _solved(mission, problem, method, time_limit_s)
        taken_s = time.perf_counter() - begin if times else None
        row = _answer(problem, method, plan, words, taken_s, relaxation_s)
        _judge(row, plan, methods[0].name, best_s, bounds)
        if method.slot_s is not None:
            _note_mismatch(row, by_slot.setdefault(method.slot_s, row))
        if method is methods[0]:
            reasons = plan.reasons if plan is not None else (words,)
        rows.append(row)
    return rows, reasons


def _methods(
    slots_s: Sequence[float], perspective: Perspective, engines: Sequence[str]
) -> Iterator[ComparedMethod]:
    """Yield the methods, the reference first, with the length of slots [s] or None."""
    wells = perspective == "battery"  # CasADi goes through both
    methods: list[tuple[str, str, float | None]]
    methods = [("closed form", "closed-form", None), ("bracket", "bracket", None)]
    methods += [("LP", "cvxpy", None), ("CasADi wells" if wells else "CasADi", "casadi", None)]
    for slot_s in map(float, slots_s):
        methods += [
            (f"grid {figure(slot_s)} s", "grid", slot_s),
            (f"MILP {figure(slot_s)} s", "cvxpy", slot_s),
        ]
    for name, engine, length_s in methods:
        if engine in engines:
            counted_by: Perspective = "wells" if wells and engine == "casadi" else perspective
            yield ComparedMethod(name, engine, length_s, counted_by)


def _name(row: MethodAnswer) -> str:
    """Return the short name of a problem, for example "P4 b1 rest-first"."""
    return " ".join(filter(None, (row["problem"], row["building"], row["order"])))


def _optimum(
    mission: Mission, problem: Formulation, methods: Sequence[ComparedMethod]
) -> tuple[float | None, Bounds]:
    """Return the longest hover in continuous times [s], and what each length of slots may cost."""
    reference = methods[0]
    program = formulate(
        mission, problem, perspective=reference.perspective, engine=reference.engine
    )
    solutions = program.answers()
    chosen = program.best(solutions) if solutions else None
    if chosen is None:
        return None, {}
    (number, entry), model = chosen, program.parts[chosen[0]].model
    slots_s = {method.slot_s for method in methods if method.slot_s is not None}
    bounds = {slot_s: bound(model, model.row(entry), slot_s) for slot_s in slots_s}
    return solutions[number].point(entry)["hover_time_s"], bounds


def _solved(
    mission: Mission, problem: Formulation, method: ComparedMethod, time_limit_s: float | None
) -> tuple[Plan | None, str, float | None]:
    """Return the plan of a method, or None and why its engine failed.

    CVXPY solves (P1) over all routes at once, which has a bound by its LP relaxation [s].
    """
    try:
        if method.engine == "cvxpy" and isinstance(problem, P1):
            choice = route_choice(
                mission,
                perspective=method.perspective,
                slot_s=method.slot_s,
                time_limit_s=time_limit_s,
            )
            return choice.plan, "", choice.relaxation_s
        plan = solve(
            mission,
            problem,
            perspective=method.perspective,
            slot_s=method.slot_s,
            engine=method.engine,
            time_limit_s=time_limit_s,
        )
        return plan, "", None
    except SolverError as error:
        return None, str(error), None


def _answer(
    problem: Formulation,
    method: ComparedMethod,
    plan: Plan | None,
    words: str,
    taken_s: float | None,
    relaxation_s: float | None,
) -> MethodAnswer:
    """Return a method's answer to a problem, not yet judged."""
    hover_s = plan.hover_time_s if plan else None
    taken: TimeTaken = {} if taken_s is None else {"time_s": taken_s}
    return {
        "problem": problem.name,
        "building": problem.building,
        "order": problem.order,
        "method": method.name,
        "engine": method.engine,
        "slot_s": method.slot_s,
        "perspective": method.perspective,
        **taken,
        "relaxation_s": relaxation_s,
        "status": "error" if plan is None else plan.status.value,
        "proof": "none" if plan is None else plan.proof,
        "words": words,
        "hover_time_s": hover_s,
        "rest_time_s": plan.rest_time_s if plan else None,
        "gap_s": None,
        "allowance_s": ACCURACY_S[method.engine] * max(1.0, (hover_s or 0.0) / LONG_S),
        "largest_gap_s": None,
        "agrees": None,
        "why": None,
    }


def _judge(
    row: MethodAnswer, plan: Plan | None, reference: str, best_s: float | None, bounds: Bounds
) -> None:
    """Add to an answer its gap, whether it agrees with theory, and why."""
    hover_s, slot_s, allowance_s = row["hover_time_s"], row["slot_s"], row["allowance_s"]
    if plan is None:
        return
    if best_s is None:
        row["agrees"] = hover_s is None
        agrees = f"no plan, as by the {reference}"
        row["words"] = agrees if row["agrees"] else "a plan where none exists"
        return
    if hover_s is not None:
        row["gap_s"] = best_s - hover_s
    if slot_s is None:
        if hover_s is None:
            row["agrees"], row["words"] = False, f"no plan, but one with Δ = {figure(best_s)} s"
            return
        row["agrees"] = abs(best_s - hover_s) <= allowance_s
        row["words"] = f"{figure(abs(best_s - hover_s), 3)} s from the {reference}"
        return
    slots, row["why"] = bounds[slot_s]
    row["largest_gap_s"] = largest_s = None if slots is None else slots * slot_s
    gap_s = best_s - (hover_s or 0.0)  # where no slots fit, all of the hover is lost
    within = largest_s is None or gap_s <= largest_s + allowance_s
    limit = "no bound" if largest_s is None else f"bound {figure(largest_s)} s"
    row["agrees"] = within and gap_s >= -allowance_s
    row["words"] = f"{figure(gap_s)} s below continuous times, {limit}: {row['why']}"


def _note_mismatch(row: MethodAnswer, other: MethodAnswer) -> None:
    """Note in a row if another method finds another answer in the same slots."""
    hover_s, other_s = row["hover_time_s"], other["hover_time_s"]
    if not row["agrees"] or not other["agrees"] or hover_s is other_s:
        return
    apart_s = inf if hover_s is None or other_s is None else abs(hover_s - other_s)
    if apart_s <= row["allowance_s"]:
        return
    answer = "no plan" if other_s is None else f"Δ = {seconds(other_s, 6)}"
    row["agrees"], row["words"] = False, f"{other['method']} finds {answer}"


def bound(model: Model, parameters: Values, slot_s: float) -> Bound:
    """Return how many slots a model that maximises the hover time may lose, and why.

    Let (Δ, T') be the optimum in continuous times, and H the horizon that the deadline leaves. If
    neither a shorter hover nor a longer rest can break any other constraint, ⌊Δ⌋ slots of hover and
    the remaining slots of rest are feasible as well: at most one slot is lost, or less than two if
    H is not a whole number of slots. Without a rest less than one slot is lost.
    """
    if not traits(model).linear:
        return None, "the model is not linear in the times"
    rests = any(variable.name == REST for variable in model.variables)
    slots, words = 1, "whole slots" if rests else "no rest"
    for constraint in model.constraints:
        relation = constraint.relation
        form = excess(relation, parameters)[0].times(relation.signs[0])
        by_hover, by_rest = (float(form.coefficients.get(name, 0.0)) for name in (HOVER, REST))
        if relation.sense == "==":
            return None, f"{constraint.label} is an equality"
        if by_hover >= 0.0 >= by_rest:
            continue
        if by_hover != by_rest or by_hover < 0.0:
            what = "a shorter hover" if by_hover < 0.0 else "a longer rest"
            return None, f"{what} can break {constraint.label}"
        horizon_slots = -float(form.constant) / by_hover / slot_s
        if abs(horizon_slots - round(horizon_slots)) > SLOTS_ROUNDING * max(1.0, horizon_slots):
            slots, words = 2, "the horizon is not a whole number of slots"
    return slots, words

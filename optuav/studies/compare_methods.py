"""Every problem of a mission by every engine, in slots and in continuous times, side by side."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.engines.linear_form import WHOLE as SLOT_TOLERANCE
from optuav.errors import SolverError
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.modelling.classify import traits
from optuav.modelling.forms import excess
from optuav.options import ORDERS, ORDERS_OF_SEVERAL, Perspective
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Heading, Note, Table
from optuav.presentation.numbers import NONE, fixed
from optuav.solving import formulate, solve
from optuav.solving.route_choice import route_choice
from optuav.studies.processes import run_tasks
from optuav.studies.results import Comparison, Pictures, Row

ACCURACY_S = {**dict.fromkeys(("closed-form", "bracket", "cvxpy", "grid"), 1e-5), "casadi": 1e-4}
"""Tolerance of an engine's answer [s], up to `LONG_S` and in proportion beyond."""
LONG_S = 1000.0
HOVER, REST = "hover_time_s", "rest_time_s"
UNITS = {
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


@dataclass(frozen=True, kw_only=True, repr=False)
class MethodComparison(Comparison):
    """Every problem of a mission by every engine, one row per problem and method.

    Parameters
    ----------
    perspective
        How charge is counted.
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
    perspective: Perspective
    agrees: bool
    disagreements: tuple[str, ...]
    failures: tuple[str, ...]
    reasons: Mapping[str, tuple[str, ...]]

    @property
    def units(self) -> Mapping[str, str]:
        """Unit of each column by its name."""
        return UNITS | ({"time_s": "s"} if self._timed else {})

    @property
    def _timed(self) -> bool:
        return "time_s" in self.rows[0]

    def blocks(self) -> Iterator[Block]:
        """Yield gaps by problem, what each method is worth, how it knows, and the verdict."""
        name, known = self.mission.name, f"{self.perspective}, by every method"
        yield Heading(f"{name}: longest hover Δ, {known}")
        feasible = any(row["hover_time_s"] is not None for row in self.rows)
        if feasible:
            yield self._gaps()
            yield from self._worth()
        yield Note([*self._verdict(feasible)])

    def _verdict(self, feasible: bool) -> Iterator[str]:
        """Yield why problems have no plan, what theory does not bound, and who disagrees."""
        for name, reasons in self.reasons.items():
            if reasons and (feasible or name == "P1"):
                who = f"{name} has no plan" if feasible else "No problem has a plan"
                yield f"{who}: {'; '.join(reasons)}."
        unbounded = (row for row in self.rows if row["why"] and row["largest_gap_s"] is None)
        for why in dict.fromkeys(row["why"] for row in unbounded):
            yield f"The theory has no bound where {why}."
        for heading, lines in (("DISAGREE", self.disagreements), ("FAILED", self.failures)):
            yield from (f"{heading}  {line}" for line in lines)
        if not self.disagreements and not self.failures:
            plans = sum(row["hover_time_s"] is not None for row in self.rows)
            few = f", {plans} of them with a plan" if plans < len(self.rows) else ""
            on_what = few if feasible else " that nothing is feasible"
            yield f"All {len(self.rows)} answers agree{on_what}."

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
        heads = ["problem", "Δ [s]", *(f"{slot_s:g} s" for slot_s in slots_s), "agree"]
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
                worst = max(solved, key=lambda row: abs(row["gap_s"]))
                limit_s = worst["largest_gap_s"] if worst["slot_s"] else worst["allowance_s"]
                limit, gap_s = "no bound" if limit_s is None else f"{limit_s:g}", worst["gap_s"]
                short = f"{abs(gap_s):.0e}" if gap_s else "0"
                gap = f"{gap_s:.2f}" if abs(gap_s) >= 0.01 else short
            agree = f"{sum(cell['agrees'] is True for cell in cells)} of {len(cells)}"
            took = (f"{sum(cell['time_s'] for cell in cells):.2f}" for _ in times)
            reference = method == self.rows[0]["method"]
            rows.append([method, "reference" if reference else gap, limit, agree, *took])
            for row in solved:  # One line for methods that differ only in their slots
                kind = method.removesuffix(f" {row['slot_s'] or 0.0:g} s")
                proofs.setdefault(kind, {})[row["proof"].partition(";")[0]] = None
        yield Table(["method", "largest gap [s]", "its bound [s]", "agree", *times], rows)
        known = [
            f"{kind}: {'; '.join(words).removeprefix(f'{kind}: ')}"
            for kind, words in proofs.items()
        ]
        relaxed = [row["relaxation_s"] for row in self.rows if row["relaxation_s"] is not None]
        if limits := " or ".join(dict.fromkeys(f"{bound_s:.3f} s" for bound_s in relaxed)):
            known.insert(
                0, f"P1 over all routes as one MILP: its LP relaxation bounds Δ by {limits}"
            )
        yield Note(known)

    def pictures(self) -> Pictures:
        """Yield what slots cost, by their length."""
        from optuav import plots
        from optuav.plots.style import drawable

        slotted = [row for row in self.rows if row["slot_s"] and row["gap_s"] is not None]
        lost: dict[tuple[str, str], float] = {}
        for row in sorted(slotted, key=lambda row: row["slot_s"]):
            key = f"{row['slot_s']:g} s", row["problem"]
            lost[key] = max(lost.get(key, 0.0), 100.0 * row["gap_s"] / row["slot_s"])
        if lost:
            bars = [plots.Bar(*key, percent) for key, percent in lost.items()]
            bounds = [
                row["largest_gap_s"] / row["slot_s"] for row in slotted if row["largest_gap_s"]
            ]
            level = plots.Mark(100.0 * max(bounds), "bound of the theory") if bounds else None
            title = f"{drawable(self.mission.name)}: what whole slots cost at most, by their length"
            y_label = "hover time Δ lost [% of a slot]"
            yield "gaps.png", plots.bars(bars, title=title, y_label=y_label, level=level)


def _gap(cell: Row) -> str:
    """Return the gap of an answer in slots, marked where it disagrees."""
    if cell["agrees"] is None:
        return "failed"
    gap_s = cell["gap_s"]
    text = NONE if gap_s is None else f"{round(gap_s, 2) + 0.0:.2f}"
    return text if cell["agrees"] else f"{text}!"


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
    rows, tell = list[Row](), progress or (lambda *_: None)
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
    methods: Sequence[Row],
    time_limit_s: float | None,
    times: bool,
) -> tuple[list[Row], tuple[str, ...]]:
    """Return a problem's rows, one per method, and the reasons if the reference has no plan."""
    for library in ("cvxpy", "casadi"):
        if any(method["engine"] == library for method in methods):
            import_module(library)  # or the first time taken would include the import
    subject = {"problem": problem.name, "building": problem.building, "order": problem.order}
    best_s, bounds = _optimum(mission, problem, methods)
    rows, by_slot, reasons = list[Row](), dict[float, Row](), tuple[str, ...]()
    for method in methods:
        begin = time.perf_counter()
        plan, words, relaxation_s = _solved(mission, problem, method, time_limit_s)
        taken = {"time_s": time.perf_counter() - begin} if times else {}
        row = {**subject, **method, **taken, "relaxation_s": relaxation_s}
        row |= _answer(plan, words, method, methods[0]["method"], best_s, bounds)
        if method["slot_s"] is not None:
            row |= _mismatch(row, by_slot.setdefault(method["slot_s"], row))
        if method is methods[0]:
            reasons = plan.reasons if plan is not None else (words,)
        rows.append(row)
    return rows, reasons


def _methods(
    slots_s: Sequence[float], perspective: Perspective, engines: Sequence[str]
) -> Iterator[Row]:
    """Yield the methods, the reference first: name, engine, and length of slots [s] or None."""
    wells = perspective == "battery"  # CasADi goes through both
    methods: list[tuple[str, str, float | None]]
    methods = [("closed form", "closed-form", None), ("bracket", "bracket", None)]
    methods += [("LP", "cvxpy", None), ("CasADi wells" if wells else "CasADi", "casadi", None)]
    for slot_s in map(float, slots_s):
        methods += [(f"grid {slot_s:g} s", "grid", slot_s), (f"MILP {slot_s:g} s", "cvxpy", slot_s)]
    for name, engine, length_s in methods:
        if engine in engines:
            counted = "wells" if wells and engine == "casadi" else perspective
            yield {"method": name, "engine": engine, "slot_s": length_s, "perspective": counted}


def _name(row: Row) -> str:
    """Return the short name of a problem, for example "P4 b1 rest-first"."""
    return " ".join(row[part] for part in ("problem", "building", "order") if row[part])


def _optimum(
    mission: Mission, problem: Formulation, methods: Sequence[Row]
) -> tuple[float | None, Bounds]:
    """Return the longest hover in continuous times [s], and what each length of slots may cost."""
    program = formulate(mission, problem, **{n: methods[0][n] for n in ("perspective", "engine")})
    solutions = program.answers()
    chosen = program.best(solutions) if solutions else None
    if chosen is None:
        return None, {}
    (number, entry), model = chosen, program.parts[chosen[0]].model
    slots_s = {method["slot_s"] for method in methods if method["slot_s"] is not None}
    bounds = {slot_s: bound(model, model.row(entry), slot_s) for slot_s in slots_s}
    return solutions[number].point(entry)["hover_time_s"], bounds


def _solved(
    mission: Mission, problem: Formulation, method: Row, time_limit_s: float | None
) -> tuple[Plan | None, str, float | None]:
    """Return the plan of a method, or None and why its engine failed.

    CVXPY solves (P1) over all routes at once, which has a bound by its LP relaxation [s].
    """
    options = {name: method[name] for name in ("perspective", "slot_s")}
    options["time_limit_s"] = time_limit_s
    try:
        if method["engine"] == "cvxpy" and isinstance(problem, P1):
            choice = route_choice(mission, **options)
            return choice.plan, "", choice.relaxation_s
        return solve(mission, problem, engine=method["engine"], **options), "", None
    except SolverError as error:
        return None, str(error), None


def _answer(
    plan: Plan | None, words: str, method: Row, reference: str, best_s: float | None, bounds: Bounds
) -> dict[str, Any]:
    """Return a method's answer, whether it agrees with theory, and why."""
    hover_s = plan.hover_time_s if plan else None
    allowance_s = ACCURACY_S[method["engine"]] * max(1.0, (hover_s or 0.0) / LONG_S)
    row: dict[str, Any] = {
        "status": "error" if plan is None else plan.status.value,
        "proof": "none" if plan is None else plan.proof,
        "words": words,
        "hover_time_s": hover_s,
        "rest_time_s": plan.rest_time_s if plan else None,
        "gap_s": None if best_s is None or hover_s is None else best_s - hover_s,
        "allowance_s": allowance_s,
        **dict.fromkeys(("largest_gap_s", "agrees", "why")),
    }
    if plan is None:
        return row
    if best_s is None:
        agrees = hover_s is None
        words = f"no plan, as by the {reference}" if agrees else "a plan where none exists"
        return row | {"agrees": agrees, "words": words}
    if method["slot_s"] is None:
        if hover_s is None:
            return row | {"agrees": False, "words": f"no plan, but one with Δ = {best_s:.6g} s"}
        words = f"{abs(best_s - hover_s):.3g} s from the {reference}"
        return row | {"agrees": abs(best_s - hover_s) <= allowance_s, "words": words}
    slots, why = bounds[method["slot_s"]]
    largest_s = None if slots is None else slots * method["slot_s"]
    gap_s = best_s - (hover_s or 0.0)  # where no slots fit, all of the hover is lost
    within = largest_s is None or gap_s <= largest_s + allowance_s
    limit = "no bound" if largest_s is None else f"bound {largest_s:g} s"
    return row | {
        "agrees": within and gap_s >= -allowance_s,
        "words": f"{gap_s:.6g} s below continuous times, {limit}: {why}",
        "why": why,
        "largest_gap_s": largest_s,
    }


def _mismatch(row: Row, other: Row) -> dict[str, Any]:
    """Return what to change in a row if another method finds another answer in the same slots."""
    hover_s, found_s = row["hover_time_s"], other["hover_time_s"]
    if not row["agrees"] or not other["agrees"] or hover_s is found_s:
        return {}
    if None not in (hover_s, found_s) and abs(hover_s - found_s) <= row["allowance_s"]:
        return {}
    answer = "no plan" if found_s is None else f"Δ = {found_s:.6f} s"
    return {"agrees": False, "words": f"{other['method']} finds {answer}"}


def bound(model: Model, parameters: Row, slot_s: float) -> Bound:
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
        if abs(horizon_slots - round(horizon_slots)) > SLOT_TOLERANCE * max(1.0, horizon_slots):
            slots, words = 2, "the horizon is not a whole number of slots"
    return slots, words

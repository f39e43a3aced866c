"""Prove: multipliers of an optimum or of a conflict, verified in exact rational arithmetic."""

import math
import numbers
from collections.abc import Callable, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import partial

from optuav.diagnosis.infeasibility import Certificate, Row, bound, inequalities
from optuav.engines import closed_form
from optuav.engines.linear_form import linear_form
from optuav.errors import Fault, refuse
from optuav.exercises.exercise import Draws, Exercise, Grade, Task, plain
from optuav.mission.messages import shown
from optuav.modelling import Model

ROUNDED = 0.01  # What rounded multipliers may miss of a coefficient
MOST_PARTS = 10**6  # Largest denominator of the fraction that a float is read as
OPTIMUM, CONFLICT = "optimum", "conflict"


def prove(
    number: str,
    text: str,
    *,
    what: str = OPTIMUM,
    with_point: bool = False,
    mission: str = "paper",
    draws: Draws | None = None,
) -> Callable[[Callable[[Task], Model]], Exercise]:
    """An exercise on a linear model to be maximised, with numbers whose fractions are short.

    Its answer is the multiplier of each constraint by label; with a point the values of the
    unknowns by name as well.
    """

    def declared(function: Callable[[Task], Model]) -> Exercise:
        grade = partial(_grade, what, with_point)
        return Exercise(number, "prove", text, grade, mission, draws or {}, model=function)

    return declared


def _grade(what: str, with_point: bool, task: Task, answer: object) -> Grade:
    """The grade of multipliers: the first condition of a proof that fails."""
    model = task.model
    assert model is not None
    rows = inequalities(model, model.row(0))
    unknowns = {each.name: each.symbol for each in model.variables} if with_point else {}
    found = _fractions(answer, [row.label for row in rows], list(unknowns))
    weighted = tuple(replace(row, multiplier=found.get(row.label, Fraction(0))) for row in rows)
    if negative := [row.label for row in weighted if row.multiplier < 0]:
        words = f"sign: the multiplier of {negative[0]!r} is negative"
        return Grade.wrong(task, words, "times a negative number, ≤ turns into ≥")
    goal = {} if what == CONFLICT else _objective(model)
    proof = Certificate(weighted, goal)
    for symbol in (each.symbol for each in model.variables):
        reached, wanted = (each.get(symbol, Fraction(0)) for each in (proof.coefficients, goal))
        if reached != wanted:
            words = f"stationarity: the rows add up to {_text(reached)} · {symbol}"
            needed = "the objective has" if goal else "a contradiction needs"
            hint = f"{needed} {_text(wanted)} · {symbol}"
            if abs(reached - wanted) < ROUNDED:
                hint += "; whole numbers and Fractions are exact, rounded numbers are not"
            return Grade.wrong(task, words, hint)
    if what == CONFLICT:
        if proof.limit >= 0:
            hint = "0 ≤ a number is false only if the number is negative"
            return Grade.wrong(task, "the sum is true, and so proves no conflict", hint)
        return Grade.correct(task, "the sum is false, evaluated exactly")
    point = {symbol: found.get(name, Fraction(0)) for name, symbol in unknowns.items()}
    if point and (fault := _slackness(task, weighted, point)) is not None:
        return fault
    best = closed_form.solve(model, 1)
    optimum = bound(model, model.row(0), best.binding_labels(0))
    assert optimum is not None
    if proof.limit != optimum.limit:
        hint = "a constraint with slack at the optimum has the multiplier 0"
        return Grade.wrong(task, "gap: the bound is valid, but above the optimum", hint)
    return Grade.correct(task, "every condition holds exactly")


def _slackness(task: Task, rows: tuple[Row, ...], point: Mapping[str, Fraction]) -> Grade | None:
    """What is wrong with a point beside multipliers."""
    slack = {r.label: r.limit - sum(a * point[s] for s, a in r.coefficients.items()) for r in rows}
    if broken := [label for label, each in slack.items() if each < 0]:
        words = f"feasibility: the point violates {broken[0]!r}"
        return Grade.wrong(task, words, "a point needs every constraint, with exact numbers")
    if loose := [row.label for row in rows if row.multiplier * slack[row.label]]:
        words = f"complementary slackness: {loose[0]!r} has slack and a multiplier"
        return Grade.wrong(task, words, "of slack and multiplier one is 0, with exact numbers")
    return None


def _objective(model: Model) -> Mapping[str, Fraction]:
    """The coefficients of the objective, which is maximised."""
    goal = linear_form(model, model.row(0)).directions[0, :, 0].tolist()
    symbols = (each.symbol for each in model.variables)
    return {symbol: Fraction(x) for symbol, x in zip(symbols, goal, strict=True) if x}


def _fractions(answer: object, labels: list[str], unknowns: list[str]) -> dict[str, Fraction]:
    """The numbers of an answer as fractions; `InputError` with all that are none."""
    names = [*labels, *unknowns]
    faults, found = list[Fault](), dict[str, Fraction]()
    if not isinstance(answer, Mapping):
        refuse([Fault("answer", shown(answer), f"numbers by name: {', '.join(names)}")])
    assert isinstance(answer, Mapping)
    for name, stated in answer.items():
        value = plain(stated)
        if name not in names:
            key = name if isinstance(name, str) else shown(name)
            faults.append(Fault(key, shown(value), f"the names are {', '.join(names)}"))
        elif isinstance(value, bool) or not isinstance(value, numbers.Real):
            faults.append(Fault(name, shown(value), "a number, as Fraction(1, 98)"))
        elif isinstance(value, numbers.Rational):
            found[name] = Fraction(int(value.numerator), int(value.denominator))
        elif not math.isfinite(value):
            faults.append(Fault(name, shown(value), "a finite number"))
        else:
            found[name] = Fraction(float(value)).limit_denominator(MOST_PARTS)
    if missing := [name for name in unknowns if name not in answer]:
        faults += [Fault(name, "", "is missing") for name in missing]
    refuse(faults)
    return found


def _text(value: Fraction) -> str:
    text = str(value) if value.denominator < 10**4 else f"{float(value):.6g}"
    return text.replace("-", "−")

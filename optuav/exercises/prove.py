"""Prove: multipliers of an optimum or of a conflict, verified in exact rational arithmetic."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from optuav.diagnosis.infeasibility import Certificate, Row, bound, inequalities
from optuav.engines import closed_form
from optuav.engines.linear_form import linear_form
from optuav.errors import Fault, InputError
from optuav.exercises.answers import Form, fractions
from optuav.exercises.exercise import Draws, Task
from optuav.exercises.linear import linear
from optuav.exercises.witness import Condition, Conditions, Witness
from optuav.mission.messages import shown
from optuav.modelling import Model

MISSED = 0.01  # What rounded multipliers may miss of a coefficient
EXACT = "whole numbers and Fractions are exact, rounded numbers are not"


MULTIPLIERS = "{'charge': Fraction(1, 98), ...}"


def prove(
    number: str,
    text: str,
    draws: Draws,
    programme: Sequence[str],
    *,
    conflict: bool = False,
    with_point: bool = False,
) -> Witness:
    """Declare an exercise on a linear programme that is to be maximised.

    Its answer is the multiplier of each constraint by label; with a point the values of the
    unknowns by name as well.
    """

    def read(task: Task, answer: object) -> dict[str, Fraction]:
        model = linear(task, programme)
        names = [variable.name for variable in model.variables] if with_point else []
        return fractions(answer, [*labels(model), *names], names)

    def test(task: Task, numbers: Mapping[str, Fraction]) -> Conditions:
        model = linear(task, programme)
        if conflict:
            return contradiction(model, numbers)
        return optimality(model, numbers, numbers if with_point else None)

    return Witness(number, text, draws, form=Form(MULTIPLIERS, read), programme=programme)(test)


def two_proofs(*programme: str) -> Form:
    """Form of two dicts of multipliers by label."""

    def read(task: Task, answer: object) -> list[dict[str, Fraction]]:
        names = labels(linear(task, programme))
        if not isinstance(answer, list | tuple) or len(answer) != 2:
            words = f"two dicts of numbers by name: {', '.join(names)}"
            raise InputError([Fault("answer", shown(answer), words)])
        return [fractions(numbers_by_name, names) for numbers_by_name in answer]

    return Form(f"[{MULTIPLIERS}, {MULTIPLIERS}]", read)


def labels(model: Model) -> list[str]:
    """Return the labels of all inequalities of a model, its bounds included."""
    return [row.label for row in inequalities(model, model.row(0))]


def added(
    model: Model, multipliers: Mapping[str, Fraction], goal: Mapping[str, Fraction]
) -> tuple[Certificate, Condition]:
    """Add the constraints up, and check signs and coefficients of the sum."""
    rows = tuple(
        replace(row, multiplier=multipliers.get(row.label, Fraction(0)))
        for row in inequalities(model, model.row(0))
    )
    proof = Certificate(rows, dict(goal))
    for row in rows:
        if row.multiplier < 0:
            words = f"sign: the multiplier of {row.label!r} is negative"
            return proof, Condition(False, words, "times a negative number, ≤ turns into ≥")
    for symbol in (variable.symbol for variable in model.variables):
        reached, wanted = (each.get(symbol, Fraction(0)) for each in (proof.coefficients, goal))
        if reached != wanted:
            words = f"stationarity: the rows add up to {text_of(reached)} · {symbol}"
            needed = "the objective has" if goal else "a contradiction needs"
            hint = f"{needed} {text_of(wanted)} · {symbol}"
            hint += f"; {EXACT}" if abs(reached - wanted) < MISSED else ""
            return proof, Condition(False, words, hint)
    return proof, Condition(True, f"the bound is {text_of(proof.limit)}")


def contradiction(model: Model, multipliers: Mapping[str, Fraction]) -> Conditions:
    """Yield whether multipliers add the constraints up to a false sentence."""
    proof, test = added(model, multipliers, {})
    yield test
    hint = "0 ≤ a number is false only if the number is negative"
    yield Condition(proof.limit < 0, "the sum is true, and so proves no conflict", hint)
    yield Condition(True, "the sum is false, evaluated exactly")


def optimality(
    model: Model, multipliers: Mapping[str, Fraction], point: Mapping[str, Fraction] | None = None
) -> Conditions:
    """Yield whether multipliers prove the optimum, alone or with the values of a point."""
    proof, test = added(model, multipliers, objective(model))
    yield test
    if point is not None:
        yield from _slackness(model, proof.rows, point)
    best = closed_form.solve(model, 1)
    optimum = bound(model, model.row(0), best.binding_labels(0))
    assert optimum is not None
    hint = "a constraint with slack at the optimum has the multiplier 0"
    yield Condition(
        proof.limit == optimum.limit, "gap: the bound is valid, but above the optimum", hint
    )
    yield Condition(True, "every condition holds exactly")


def feasibility(
    model: Model, point: Mapping[str, Fraction]
) -> tuple[dict[str, Fraction], Condition]:
    """Return the slack of each constraint at a point, and whether none is negative."""
    at = {variable.symbol: point[variable.name] for variable in model.variables}
    slack = {
        row.label: row.limit - sum(a * at[symbol] for symbol, a in row.coefficients.items())
        for row in inequalities(model, model.row(0))
    }
    broken = [label for label, left in slack.items() if left < 0]
    words = f"feasibility: the point violates {broken[0]!r}" if broken else "the point is feasible"
    return slack, Condition(not broken, words, "a point needs every constraint, with exact numbers")


def _slackness(model: Model, rows: tuple[Row, ...], point: Mapping[str, Fraction]) -> Conditions:
    """Yield a point beside multipliers."""
    slack, test = feasibility(model, point)
    yield test
    for row in rows:
        words = f"complementary slackness: {row.label!r} has slack and a multiplier"
        hint = "of slack and multiplier one is 0, with exact numbers"
        yield Condition(not row.multiplier * slack[row.label], words, hint)


def objective(model: Model) -> dict[str, Fraction]:
    """Return the coefficients of the objective, which is maximised."""
    goal = linear_form(model, model.row(0)).directions[0, :, 0].tolist()
    symbols = (variable.symbol for variable in model.variables)
    return {symbol: Fraction(x) for symbol, x in zip(symbols, goal, strict=True) if x}


def text_of(value: Fraction) -> str:
    """Return a fraction as words show it, short where it has many digits."""
    if max(abs(value.numerator), value.denominator) < 10**9:
        return str(value).replace("-", "−")
    return f"{float(value):.6g}".replace("-", "−") if abs(value) < 10**300 else "a huge number"

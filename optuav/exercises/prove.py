"""Multipliers and points that prove something, verified in exact rational arithmetic."""

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias

from optuav.diagnosis.infeasibility import Certificate, bound, inequalities
from optuav.engines import closed_form
from optuav.engines.linear_form import linear_form
from optuav.exercises.task import Condition, Conditions
from optuav.modelling import Model
from optuav.presentation.numbers import figure

Exact: TypeAlias = Mapping[str, Fraction]

MISSED = 0.01  # Largest error of a coefficient by rounded multipliers
EXACT = "whole numbers and Fractions are exact, rounded numbers are not"


def added(
    model: Model, multipliers: Exact, goal: Exact | None = None
) -> tuple[Certificate, Condition]:
    """Add the constraints up, and check the signs, and the sum by a goal: the objective."""
    goal = objective(model) if goal is None else goal
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
        reached, wanted = (sums.get(symbol, Fraction(0)) for sums in (proof.coefficients, goal))
        if reached != wanted:
            words = f"stationarity: the rows add up to {exact_figure(reached)} · {symbol}"
            needed = "the objective has" if goal else "a contradiction needs"
            hint = f"{needed} {exact_figure(wanted)} · {symbol}"
            hint += f"; {EXACT}" if abs(reached - wanted) < MISSED else ""
            return proof, Condition(False, words, hint)
    return proof, Condition(True, f"the bound is {exact_figure(proof.limit)}")


def contradiction(model: Model, multipliers: Exact) -> Conditions:
    """Yield whether multipliers add the constraints up to a false sentence."""
    proof, condition = added(model, multipliers, {})
    yield condition
    hint = "0 ≤ a number is false only if the number is negative"
    yield Condition(proof.limit < 0, "the sum is true, and so proves no conflict", hint)


def optimality(model: Model, multipliers: Exact) -> Conditions:
    """Yield whether multipliers prove the optimum."""
    proof, condition = added(model, multipliers)
    yield condition
    best = closed_form.solve(model, 1)
    optimum = bound(model, model.row(0), best.binding_labels(0))
    assert optimum is not None
    hint = "a constraint with slack at the optimum has the multiplier 0"
    words = "gap: the bound is valid, but above the optimum"
    yield Condition(proof.limit == optimum.limit, words, hint)


def feasibility(model: Model, point: Exact, multipliers: Exact | None = None) -> Conditions:
    """Yield whether a point satisfies each constraint, without slack beside a multiplier."""
    at = {variable.symbol: point[variable.name] for variable in model.variables}
    for row in inequalities(model, model.row(0)):
        slack = row.limit - sum(a * at[symbol] for symbol, a in row.coefficients.items())
        words = f"feasibility: the point violates {row.label!r}"
        yield Condition(slack >= 0, words, "a point needs every constraint, with exact numbers")
        words = f"complementary slackness: {row.label!r} has slack and a multiplier"
        hint = "of slack and multiplier one is 0, with exact numbers"
        yield Condition(not slack * (multipliers or {}).get(row.label, 0), words, hint)


def objective(model: Model) -> Exact:
    """Return the coefficients of the objective, which is maximised."""
    goal = linear_form(model, model.row(0)).directions[0, :, 0].tolist()
    symbols = (variable.symbol for variable in model.variables)
    return {symbol: Fraction(x) for symbol, x in zip(symbols, goal, strict=True) if x}


def exact_figure(value: Fraction) -> str:
    """Return a fraction as words show it, short where it has many digits."""
    if max(abs(value.numerator), value.denominator) < 10**9:
        return str(value).replace("-", "−")
    return figure(value, 12) if abs(value) < 10**300 else "a huge number"

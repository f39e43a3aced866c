"""The closed form over all itineraries against one linear programme at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linprog

from benchmarks.timing import Row, interleaved_s, median_s
from formulations.p4 import P4
from formulations.parameters import QUANTITIES, Quantities
from optuav.engines import closed_form
from optuav.mission import load
from optuav.modelling import Model
from optuav.solving import formulate


def run() -> list[Row]:
    """All P4 of the shipped mission, then copies of them up to 10⁵ buildings."""
    program = formulate(load("paper"), perspective="battery")
    part = next(each for each in program.parts if len(each.model.variables) == 2)
    model, count = part.model, len(part.routes)
    ours_s, linprog_s = interleaved_s(
        lambda: closed_form.solve(model, count), lambda: _linprog(model, count), 15
    )
    hot_s = median_s(hot_highs(model, count), 15)
    rows = [
        Row(
            f"closed form / linprog, a programme ({count} of them)",
            ours_s / count,
            linprog_s / count,
            at_least=25.0,
        ),
        Row("closed form / hot re-solve by highspy, a programme", ours_s / count, hot_s / count),
    ]
    reference_s = None
    for buildings in (10, 100, 1_000, 10_000, 100_000):
        many = _copies(model, 2 * buildings)
        seconds = median_s(lambda: closed_form.solve(many, 2 * buildings), 5)  # noqa: B023
        each_s = seconds / (2 * buildings)
        reference_s = reference_s or each_s
        rows.append(Row(f"a programme of {buildings} buildings / of 10", each_s, reference_s))
    return rows


def _data(model: Model, index: int) -> tuple[list[list[float]], list[float]]:
    """Rows and right sides of P4 for one itinerary, (Δ, T') ≥ 0."""
    given = model.row(index)
    battery_As = given["packs"] * given["capacity_As"]
    allowed_As = (1.0 - given["min_soc"]) * battery_As - given["flight_charge_As"]
    rows = [[given["hover_current_A"], -given["rest_current_A"]], [1.0, 1.0]]
    return rows, [allowed_As, given["deadline_s"] - given["flight_time_s"]]


def _linprog(model: Model, count: int) -> list[float]:
    found = []
    for index in range(count):
        rows, limits = _data(model, index)
        solved = linprog([-1.0, 0.0], A_ub=rows, b_ub=limits)
        assert solved.fun is not None
        found.append(-solved.fun)
    return found


def hot_highs(model: Model, count: int) -> Any:
    """A call that re-solves one loaded HiGHS model with the data of every itinerary."""
    import highspy

    highs = highspy.Highs()  # type: ignore[no-untyped-call]
    highs.silent()
    rows, limits = _data(model, 0)
    inf = highspy.kHighsInf
    highs.addVars(2, np.zeros(2), np.full(2, inf))
    highs.changeColsCost(2, np.array([0, 1], np.int32), np.array([-1.0, 0.0]))
    for row, limit in zip(rows, limits, strict=True):
        highs.addRow(-inf, limit, 2, np.array([0, 1], np.int32), np.array(row))

    def resolve() -> None:
        for index in range(count):
            data, bounds = _data(model, index)
            for row, (coefficients, limit) in enumerate(zip(data, bounds, strict=True)):
                highs.changeRowBounds(row, -inf, limit)
                for column, coefficient in enumerate(coefficients):
                    highs.changeCoeff(row, column, coefficient)
            highs.run()

    return resolve


def _copies(model: Model, count: int) -> Model:
    """P4 over as many itineraries as wanted, the given ones in turn."""
    values = {name: parameter.value for name, parameter in model.parameters.items()}
    tiled = {
        name: np.resize(value, count) if getattr(value, "ndim", 0) else value
        for name, value in values.items()
    }
    figures: dict[str, Any] = {each.name: tiled.get(each.name, 1.0) for each in QUANTITIES}
    return P4("b1").model(Quantities(**figures), "battery")

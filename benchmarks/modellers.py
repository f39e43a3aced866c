"""All itineraries at once by the closed form, against modelling libraries one by one.

Pyomo and linopy are in ``benchmarks/requirements.txt`` only; without them their rows are left out.
``make bench-modellers`` runs all rows in an environment of their own.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import numpy as np

from benchmarks.timing import Row, interleaved_s
from optuav.engines import closed_form
from optuav.mission import Mission, load
from optuav.solving import formulate, solve
from optuav.solving.route_models import RouteModel

Answer = tuple[float, float, float, float]
"""Δ, T' [s] and the multipliers of charge [s/(A s)] and deadline [s/s]."""
SAME = 1e-6


def run() -> list[Row]:
    """P1 over every itinerary of the shipped mission, and the whole way from mission to plan."""
    mission = load("paper")
    parts = formulate(mission, perspective="battery").parts
    programmes = [part.model.row(k) for part in parts for k in range(len(part.routes))]
    count = len(programmes)
    rows = []
    for name, modeller, repeats in (
        ("CVXPY", _cvxpy, 9),
        ("Pyomo", _pyomo, 9),
        ("linopy", _linopy, 3),
    ):
        if find_spec(name.lower()) is None:
            print(f"{name} is not installed and left out: see benchmarks/requirements.txt")
            continue
        one = modeller()
        with _silence():
            _compare(parts, [one(given) for given in programmes])
            ours_s, other_s = interleaved_s(
                lambda: [closed_form.solve(part.model, len(part.routes)) for part in parts],
                lambda: [one(given) for given in programmes],  # noqa: B023
                repeats,
            )
        what = f"closed form / {name}, a programme ({count} of them)"
        rows.append(Row(what, ours_s / count, other_s / count, at_least=25.0))
    return [*rows, _whole(mission, programmes[-1])]


@contextmanager
def _silence() -> Iterator[None]:
    """Keep what a library writes past Python, HiGHS's name at every solve, off the screen."""
    sys.stdout.flush()
    screen = os.dup(1)
    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(screen, 1)
        os.close(screen)


def _compare(parts: tuple[RouteModel, ...], answers: list[Answer]) -> None:
    """Same times and multipliers to `SAME`."""
    ours = []
    for part in parts:
        count = len(part.routes)
        solution = closed_form.solve(part.model, count)
        prices = [solution.shadow_prices(index) for index in range(count)]
        rest_s = solution.values.get("rest_time_s", np.zeros(count))
        charge = np.array([each["flight_charge_As"].more for each in prices])
        deadline = np.array([each["deadline_s"].more for each in prices])
        ours.append(np.stack([solution.values["hover_time_s"], rest_s, -charge, deadline]))
    difference = np.abs(np.concatenate(ours, axis=1).T - np.array(answers)).max()
    assert difference <= SAME, f"the answers differ by {difference}"


def _whole(mission: Mission, given: Mapping[str, Any]) -> Row:
    """From a mission to a checked plan, against three problems for CVXPY."""
    one = _cvxpy()
    ours_s, other_s = interleaved_s(
        lambda: solve(mission, perspective="battery"), lambda: [one(given) for _ in range(3)], 31
    )
    return Row("optuav.solve(mission) / three new problems for CVXPY", ours_s, other_s, None, 1.0)


def _limits(given: Mapping[str, Any]) -> tuple[float, float]:
    """Charge [A s] and time [s] that the flight leaves."""
    charge_As = (1.0 - given["min_soc"]) * given["packs"] * given["capacity_As"]
    return charge_As - given["flight_charge_As"], given["deadline_s"] - given["flight_time_s"]


Modeller = Callable[[Mapping[str, Any]], Answer]


def _cvxpy() -> Modeller:
    import cvxpy

    def one(given: Mapping[str, Any]) -> Answer:
        charge_As, left_s = _limits(given)
        hover: Any = cvxpy.Variable(nonneg=True)
        rest: Any = cvxpy.Variable(nonneg=True)
        charge = given["hover_current_A"] * hover - _rest_A(given) * rest <= charge_As
        deadline = hover + rest <= left_s
        problem = cvxpy.Problem(cvxpy.Maximize(hover), [charge, deadline])
        problem.solve(solver="HIGHS")  # type: ignore[no-untyped-call]
        assert problem.status == "optimal"
        return (
            float(hover.value),
            float(rest.value),
            float(charge.dual_value),
            float(deadline.dual_value),
        )

    return one


def _pyomo() -> Modeller:
    import pyomo.environ as pyomo
    from pyomo.contrib.appsi.solvers import Highs

    solver = Highs()

    def one(given: Mapping[str, Any]) -> Answer:
        charge_As, left_s = _limits(given)
        model = pyomo.ConcreteModel()
        model.hover = pyomo.Var(bounds=(0.0, None))
        model.rest = pyomo.Var(bounds=(0.0, None))
        model.charge = pyomo.Constraint(
            expr=given["hover_current_A"] * model.hover - _rest_A(given) * model.rest <= charge_As
        )
        model.deadline = pyomo.Constraint(expr=model.hover + model.rest <= left_s)
        model.longest = pyomo.Objective(expr=model.hover, sense=pyomo.maximize)
        result = solver.solve(model)
        assert result.termination_condition.name == "optimal"
        duals = solver.get_duals()
        return (
            model.hover.value,
            model.rest.value,
            duals[model.charge],
            duals[model.deadline],
        )

    return one


def _linopy() -> Modeller:
    import linopy

    def one(given: Mapping[str, Any]) -> Answer:
        charge_As, left_s = _limits(given)
        model = linopy.Model()
        hover = model.add_variables(lower=0.0, name="hover")
        rest = model.add_variables(lower=0.0, name="rest")
        left = given["hover_current_A"] * hover - _rest_A(given) * rest
        charge = model.add_constraints(left <= charge_As, name="charge")
        deadline = model.add_constraints(hover + rest <= left_s, name="deadline")
        model.add_objective(hover, sense="max")
        status, _ = model.solve("highs", io_api="direct", output_flag=False)
        assert status == "ok"
        return (
            float(hover.solution),
            float(rest.solution),
            float(charge.dual),
            float(deadline.dual),
        )

    return one


def _rest_A(given: Mapping[str, Any]) -> float:
    return float(given.get("rest_current_A", 0.0))

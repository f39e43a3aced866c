"""Solving a compiled program again, against the bare library doing the same work."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

import optuav
from benchmarks.timing import Row, interleaved_s
from optuav.mission import load
from optuav.solving import formulate

Solve = Callable[[float, float], tuple[float, float]]
"""Δ and T' [s] for a deadline [s] and η0 [-]."""
SAME_S = 1e-4


def run() -> list[Row]:
    """One P4 of the shipped mission, another deadline and another η0 at every call."""
    program = formulate(load("paper"), optuav.P4("b1", order="rest-first"), perspective="battery")
    given = program.parts[0].model.row(0)
    rows = []
    for engine, bare, repeats, limit in (
        ("cvxpy", bare_cvxpy(given), 300, 1.4),
        ("casadi", bare_casadi(given, (0.5,)), 100, 3.0),
    ):
        compiled = program.compile(engine)

        def ours(deadline_s: float, min_soc: float, compiled: Any = compiled) -> Any:
            solution = compiled.solve(deadline_s=deadline_s, min_soc=min_soc)
            assert solution.status.has_answer
            assert solution.multipliers_at(0)
            return solution.values["hover_time_s"][0], solution.values["rest_time_s"][0]

        assert np.allclose(ours(900.0, 0.1), bare(900.0, 0.1), rtol=0.0, atol=SAME_S)
        ours_s, bare_s = interleaved_s(varied(ours), varied(bare), repeats)
        what = f"a compiled P4, solved again by {engine} / bare {engine}"
        rows.append(Row(what, ours_s, bare_s, at_most=limit))
    return rows


def varied(solve: Solve) -> Callable[[], object]:
    """A call with new values every time."""
    numbers = itertools.count()

    def call() -> object:
        step = next(numbers) % 50
        return solve(900.0 + step, 0.1 + 0.001 * step)

    return call


def limits(given: Mapping[str, Any], deadline_s: float, min_soc: float) -> tuple[float, float]:
    """Charge [A s] and time [s] that the flight leaves."""
    battery_As = given["packs"] * given["capacity_As"]
    charge_As = (1.0 - min_soc) * battery_As - given["flight_charge_As"]
    return charge_As, deadline_s - given["flight_time_s"]


def bare_cvxpy(given: Mapping[str, Any]) -> Solve:
    """A parametrised problem as CVXPY's documentation teaches it; here the optimum is not tied."""
    import cvxpy

    hover: Any = cvxpy.Variable(nonneg=True)
    rest: Any = cvxpy.Variable(nonneg=True)
    names = ("hover_A", "rest_A", "charge_As", "left_s")
    parameter = {name: cvxpy.Parameter(name=name) for name in names}
    rows = [
        parameter["hover_A"] * hover - parameter["rest_A"] * rest <= parameter["charge_As"],
        hover + rest <= parameter["left_s"],
    ]
    problem = cvxpy.Problem(cvxpy.Maximize(hover), rows)

    parameter["hover_A"].value = given["hover_current_A"]
    parameter["rest_A"].value = given["rest_current_A"]

    def solve(deadline_s: float, min_soc: float) -> tuple[float, float]:
        charge_As, left_s = limits(given, deadline_s, min_soc)
        parameter["charge_As"].value, parameter["left_s"].value = charge_As, left_s
        problem.solve(solver="HIGHS")  # type: ignore[no-untyped-call]
        assert problem.status == "optimal"
        assert all(float(row.dual_value) > 0.0 for row in rows)
        return float(hover.value), float(rest.value)

    return solve


def bare_casadi(given: Mapping[str, Any], shares: tuple[float, ...]) -> Solve:
    """A programme for IPOPT with the options of the engine, from starts at shares of the times."""
    import casadi

    from optuav.engines.casadi_engine import ACCURACY, OPTIONS

    options = {**OPTIONS, "ipopt.tol": ACCURACY}
    x, p = casadi.SX.sym("x", 2), casadi.SX.sym("p", 5)
    hover, rest = x[0] * p[4], x[1] * p[4]
    rows = casadi.vertcat(p[0] * hover - p[1] * rest - p[2], hover + rest - p[3])
    programme = casadi.nlpsol("bare", "ipopt", {"x": x, "p": p, "f": -hover, "g": rows}, options)

    def solve(deadline_s: float, min_soc: float) -> tuple[float, float]:
        charge_As, left_s = limits(given, deadline_s, min_soc)
        battery_As = given["packs"] * given["capacity_As"]
        per_s = given["hover_current_A"] / battery_As, given["rest_current_A"] / battery_As
        numbers = np.array([*per_s, charge_As / battery_As, left_s, left_s])
        found = []
        for start in itertools.product(shares, repeat=2):
            answer = programme(x0=start, p=numbers, lbx=0.0, ubg=0.0)
            assert programme.stats()["return_status"] == "Solve_Succeeded"
            assert np.asarray(answer["lam_g"]).any()
            found.append((float(answer["f"]), np.asarray(answer["x"]).ravel() * left_s))
        hover_s, rest_s = min(found, key=lambda each: each[0])[1]
        return float(hover_s), float(rest_s)

    return solve

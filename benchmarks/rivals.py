"""Every engine against its rivals at their best settings, where it wins and where it loses.

Ratios below 1 are lost. A hot rival keeps its problem and its last basis, a cold one builds all
anew; they return two times, ours a checked answer with its proof.
"""

from __future__ import annotations

from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.optimize import linprog

import optuav
from benchmarks.bracket import batches
from benchmarks.closed_form import hot_highs
from benchmarks.compiled import SAME_S, Solve, bare_casadi, bare_cvxpy, limits, varied
from benchmarks.timing import Row, interleaved_s, median_s
from optuav.engines import casadi_engine, closed_form
from optuav.engines.casadi_engine import Casadi
from optuav.mission import Mission, load
from optuav.solving import formulate


def run() -> list[Row]:
    """One P4 solved again with other data, many at once, and itineraries under `available`."""
    mission = load("paper")
    program = formulate(mission, optuav.P4("b1", order="rest-first"), perspective="battery")
    given = program.parts[0].model.row(0)
    rivals = {
        "hot HiGHS": _highs(given, hot=True),
        "cold HiGHS": _highs(given, hot=False),
        "linprog": _linprog(given),
        "CVXPY": bare_cvxpy(given),
        "IPOPT, one start": bare_casadi(given, (0.5,)),
        "IPOPT, nine starts": bare_casadi(given, (0.02, 0.5, 0.98)),
    }
    rows = []
    for engine, asked in (
        ("closed-form", ("hot HiGHS", "cold HiGHS", "linprog")),
        ("bracket", ("hot HiGHS", "cold HiGHS")),
        ("cvxpy", ("CVXPY", "hot HiGHS")),
        ("casadi", ("IPOPT, one start", "IPOPT, nine starts")),
    ):
        ours = _ours(program.compile(engine))
        for name in asked:
            assert np.allclose(ours(900.0, 0.1), rivals[name](900.0, 0.1), rtol=0.0, atol=SAME_S)
            seconds = interleaved_s(varied(ours), varied(rivals[name]), 60)
            rows.append(Row(f"one P4 solved again: {engine} / {name}", *seconds))
    many = formulate(mission, perspective="battery").parts[-1]
    model, count = many.model, len(many.routes)
    ours_s, hot_s = interleaved_s(
        lambda: closed_form.solve(model, count), hot_highs(model, count), 15
    )
    rows.append(Row(f"{count} P4 at once: closed form / hot HiGHS", ours_s, hot_s))
    few = list(batches(mission))
    count = sum(map(len, few))
    ours_s = median_s(lambda: [each.solve() for each in few], 31) / count
    for shares, words in (((0.5,), "one start"), ((0.02, 0.5, 0.98), "up to nine")):
        what = f"an itinerary under available: bracket / IPOPT, {words}"
        rows.append(Row(what, ours_s, _ipopt_s(mission, shares)))
    return rows


def _ipopt_s(mission: Mission, shares: tuple[float, ...]) -> float:
    """Time of IPOPT, an itinerary [s]; its best answer is what is proved."""
    parts = formulate(mission, perspective="available").parts
    proved_s = max(np.nanmax(each.solve().beyond_s) for each in batches(mission))
    with patch.object(casadi_engine, "SHARES", shares):
        ready = [Casadi().compile(part.model, len(part.routes)) for part in parts]
        found = [solve({}).objective for solve in ready]
        assert abs(max(np.nanmax(each) for each in found) - proved_s) <= SAME_S
        seconds = median_s(lambda: [solve({}) for solve in ready], 3)
    return seconds / sum(len(part.routes) for part in parts)


def _ours(compiled: Any) -> Solve:
    def solve(deadline_s: float, min_soc: float) -> tuple[float, float]:
        solution = compiled.solve(deadline_s=deadline_s, min_soc=min_soc)
        return solution.values["hover_time_s"][0], solution.values["rest_time_s"][0]

    return solve


def _highs(given: Any, *, hot: bool) -> Solve:
    """HiGHS without a modelling layer: from the last basis, or built anew at every call."""
    import highspy

    none, columns = highspy.kHighsInf, np.array([0, 1], np.int32)

    def built() -> Any:
        highs = highspy.Highs()  # type: ignore[no-untyped-call]
        highs.silent()
        highs.setOptionValue("presolve", "off")
        highs.addVars(2, np.zeros(2), np.full(2, none))
        highs.changeColsCost(2, columns, np.array([-1.0, 0.0]))
        charge = np.array([given["hover_current_A"], -given["rest_current_A"]])
        for row in (charge, np.ones(2)):
            highs.addRow(-none, none, 2, columns, row)
        return highs

    kept = built()

    def solve(deadline_s: float, min_soc: float) -> tuple[float, float]:
        highs = kept if hot else built()
        for row, limit in enumerate(limits(given, deadline_s, min_soc)):
            highs.changeRowBounds(row, -none, limit)
        highs.run()
        hover_s, rest_s = highs.getSolution().col_value
        return hover_s, rest_s

    return solve


def _linprog(given: Any) -> Solve:
    def solve(deadline_s: float, min_soc: float) -> tuple[float, float]:
        rows = [[given["hover_current_A"], -given["rest_current_A"]], [1.0, 1.0]]
        solved = linprog([-1.0, 0.0], rows, limits(given, deadline_s, min_soc))
        assert solved.x is not None
        return solved.x[0], solved.x[1]

    return solve

"""The vectorised grid against Algorithm 1 as printed."""

from __future__ import annotations

import time
from functools import partial, reduce

import numpy as np

import optuav
from benchmarks.timing import Row, median_s
from formulations.algorithms import algorithm1, best_pair
from optuav.engines import grid
from optuav.mission import load
from optuav.network.timeline import route_phases
from optuav.physics import kibam
from optuav.solving import formulate


def run() -> list[Row]:
    """P4 on b1, rest first, at a deadline of 1200 s and slots of 1 s."""
    mission = load("paper").replace({"limits.deadline_s": 1200})
    program = formulate(
        mission, optuav.P4("b1", order="rest-first"), engine="grid", perspective="battery"
    )
    (part,) = program.parts
    route, given = int(part.routes[0]), part.model.row(0)
    pool = mission.pool
    time_left_s = given["deadline_s"] - given["flight_time_s"]

    def through_phases(hover_s: float, rest_s: float) -> float:
        stages = [
            stage
            for phase in route_phases(program.network, route, hover_s, rest_s)
            for stage in phase.net
        ]
        wells = reduce(partial(kibam.step, pool), stages, pool.full)
        return float(wells.total_As / pool.capacity_As)

    flight_As, hover_A = float(given["flight_charge_As"]), float(given["hover_current_A"])
    rest_A, battery_As = float(given["rest_current_A"]), float(pool.capacity_As)

    def inlined(hover_s: float, rest_s: float) -> float:
        return 1.0 - (flight_As + hover_A * hover_s - rest_A * rest_s) / battery_As

    def vectorised() -> tuple[float, float]:
        solution = grid.solve(part.model, 1, slot_s=1.0)
        return solution.values["hover_time_s"][0], solution.values["rest_time_s"][0]

    grid_s = median_s(vectorised, 15)
    begin = time.perf_counter()
    tables = algorithm1(inlined, time_left_s, given["min_soc"])
    inlined_s = time.perf_counter() - begin
    assert best_pair(tables) == vectorised()
    cells = int(np.floor(time_left_s)) * (int(np.floor(time_left_s)) - 1) // 2
    # The same under `available`, whose limits are exponential in both times.
    (curved,) = formulate(
        mission, optuav.P4("b1", order="rest-first"), engine="grid", perspective="available"
    ).parts
    curved_s = median_s(lambda: grid.solve(curved.model, 1, slot_s=0.25), 5)
    fine = 16 * cells
    sample_s = median_s(lambda: through_phases(700.0, 300.0), 500)
    return [
        Row("NumPy grid / printed loops, charge inlined", grid_s, inlined_s, at_least=20.0),
        Row(
            f"NumPy grid / printed loops through the phases (one cell × {cells} cells)",
            grid_s,
            sample_s * cells,
            at_least=50.0,
        ),
        Row("NumPy grid under available, a cell / 30 ns", curved_s / fine, 30e-9, at_most=1.0),
    ]

"""The endless cycle as a declared problem, and its answers by every method that takes it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from formulations.cycle import Cycle
from optuav.errors import printable
from optuav.plan.summary import tabulated
from optuav.service.checks import need_laser
from optuav.solving import formulate, solve
from optuav.solving.program import Program
from optuav.studies.results import Results, fixed, labelled_rows

if TYPE_CHECKING:
    from optuav.service.cycle import Coverage

UNITS = {"method": "", "hover_s": "s", "rest_s": "s", "share": "-", "gap_s": "s", "status": ""}
METHODS = {"available": "bisection", "battery": "closed form"}


def program_of(coverage: Coverage) -> Program:
    """The cycle on its building as a program over the mission of its plan."""
    need_laser(coverage)
    # A cycle never drives the available well past full, so that a taper changes nothing.
    mission = coverage.plan.mission.replace({"battery.charging": "constant"})
    return formulate(mission, Cycle(coverage.building), perspective=coverage.perspective)


def compared(coverage: Coverage) -> Results:
    """The cycle by `coverage` and by every engine that takes its declaration."""
    program = program_of(coverage)
    mission, problem = program.network.mission, program.question.problem
    answers = [(METHODS[coverage.perspective], coverage.hover_s, coverage.rest_s, coverage.status)]
    for engine in ("cvxpy", "casadi"):
        if engine in program.engines:
            plan = solve(mission, problem, perspective=coverage.perspective, engine=engine)
            answers.append((engine, plan.hover_time_s, plan.rest_time_s, plan.status.value))
    rows = (
        (method, h, r, h / (h + r + coverage.flight_s), h - coverage.hover_s, status)
        for method, h, r, status in answers
    )
    facts = {"building": coverage.building, "perspective": coverage.perspective}
    table = coverage.mission, facts, UNITS, labelled_rows(UNITS, rows)
    # No picture: the table has two rows or three.
    return Results("optuav comparison of cycles", *table, _show, lambda _: ())


def _show(results: Results) -> Iterator[str]:
    """One line per method."""
    facts = results.facts
    name = printable(results.mission.name)
    yield f"{name}: endless cycle on {printable(facts['building'])}, {facts['perspective']}\n"
    table = [["method", "hover [s]", "rest [s]", "share [%]", "apart [s]", "status"]]
    for row in results.rows:
        times = (fixed(row[n], 4) for n in ("hover_s", "rest_s"))
        share = fixed(100.0 * row["share"], 6)
        table.append([row["method"], *times, share, fixed(abs(row["gap_s"]), 4), row["status"]])
    yield from tabulated(table)

"""The endless cycle as a declared problem, and its answers by every method that takes it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypedDict

from formulations.cycle import Cycle
from optuav.errors import printable
from optuav.options import Perspective
from optuav.presentation.blocks import Block, Heading, Table
from optuav.presentation.numbers import fixed
from optuav.service.endless import EndlessCycle, need_laser
from optuav.solving import formulate, solve
from optuav.solving.program import Program
from optuav.studies.results import Pictures, Result

CYCLE_ANSWER_UNITS = {
    "method": "",
    "hover_s": "s",
    "rest_s": "s",
    "share": "-",
    "gap_s": "s",
    "status": "",
}
METHODS = {"available": "bisection", "battery": "closed form"}


class CycleAnswer(TypedDict):
    """A row of a comparison of cycles."""

    method: str
    hover_s: float
    rest_s: float
    share: float
    gap_s: float
    status: str


@dataclass(frozen=True, kw_only=True, repr=False)
class CycleComparison(Result):
    """The endless cycle by every method that takes its declaration, one row per method.

    Parameters
    ----------
    building, perspective
        Where the drone rests, and how charge is counted.
    """

    kind = "optuav comparison of cycles"
    units = CYCLE_ANSWER_UNITS
    rows: tuple[CycleAnswer, ...]
    building: str
    perspective: Perspective

    def blocks(self) -> Iterator[Block]:
        """Yield one line per method."""
        where = f"endless cycle on {printable(self.building)}, {self.perspective}"
        yield Heading(f"{printable(self.mission.name)}: {where}")
        rows = [
            [
                row["method"],
                *(fixed(time_s, 4) for time_s in (row["hover_s"], row["rest_s"])),
                fixed(100.0 * row["share"], 6),
                fixed(abs(row["gap_s"]), 4),
                row["status"],
            ]
            for row in self.rows
        ]
        yield Table(["method", "hover [s]", "rest [s]", "share [%]", "apart [s]", "status"], rows)

    def pictures(self) -> Pictures:
        """Yield nothing: the table has two rows or three."""
        yield from ()


def program_of(cycle: EndlessCycle) -> Program:
    """The cycle on its building as a program over the mission of its plan."""
    visit = need_laser(cycle)
    # A cycle never drives the available well past full, so that a taper changes nothing.
    mission = cycle.plan.mission.replace({"battery.charging": "constant"})
    return formulate(mission, Cycle(visit.building), perspective=cycle.perspective)


def compared(cycle: EndlessCycle) -> CycleComparison:
    """The cycle by `coverage` and by every engine that takes its declaration."""
    program = program_of(cycle)
    mission, problem = program.network.mission, program.question.problem
    answers = [(METHODS[cycle.perspective], cycle.hover_s, cycle.rest_s, cycle.status)]
    for engine in ("cvxpy", "casadi"):
        if engine in program.engines:
            plan = solve(mission, problem, perspective=cycle.perspective, engine=engine)
            answers.append((engine, plan.hover_time_s, plan.rest_time_s, plan.status.value))
    rows = (
        CycleAnswer(
            method=method,
            hover_s=h,
            rest_s=r,
            share=h / (h + r + cycle.flight_s),
            gap_s=h - cycle.hover_s,
            status=status,
        )
        for method, h, r, status in answers
    )
    return CycleComparison(
        mission=cycle.mission,
        rows=tuple(rows),
        building=cycle.finite_cycle().building,
        perspective=cycle.perspective,
    )

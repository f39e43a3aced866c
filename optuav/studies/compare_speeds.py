"""The longest hover by how fast the legs are flown: named speeds, free ones, CasADi and a grid."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from formulations.p1 import P1
from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.options import Perspective
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Heading, Note, Table
from optuav.presentation.numbers import fixed
from optuav.solving import formulate, solve
from optuav.solving.free_speed import FreeSpeedProgram
from optuav.solving.speed_search import RULES, RouteSpeeds
from optuav.studies.results import ComparedAnswer, Comparison, Pictures, longest_of

SPEED_UNITS = {
    "method": "",
    "hover_time_s": "s",
    "brings_s": "s",
    "speeds_m_s": "m/s",
    "status": "",
}
GRID = 20_000  # Most points of the grid of speeds
SPEEDS_DRAWN = 120  # Speeds of the picture
SLOWEST = 0.2  # Least speed of grid and picture, as a share of the largest


class SpeedAnswer(ComparedAnswer):
    """A row of a comparison of speeds."""

    method: str
    brings_s: float | None  # Gain against the first row
    speeds_m_s: tuple[float, ...]  # Of the legs; empty without a plan


@dataclass(frozen=True, kw_only=True, repr=False)
class SpeedComparison(Comparison):
    """The longest hover by how fast the legs are flown, one row per method.

    Parameters
    ----------
    by, perspective
        ``("speed",)``, and how charge is counted.
    """

    kind = "optuav comparison of speeds"
    units = SPEED_UNITS
    rows: tuple[SpeedAnswer, ...]
    by: tuple[str, ...]
    perspective: Perspective
    plan: Plan = field(repr=False)  # With free speeds
    route: RouteSpeeds | None = field(repr=False)  # Of that plan

    def blocks(self) -> Iterator[Block]:
        """Yield one line a method."""
        yield Heading(
            f"{self.mission.name}: longest hover by speed of the legs, {self.perspective}"
        )
        yield Note([longest_of([(row["method"].replace(", ", " by "), row) for row in self.rows])])
        rows = list[list[str]]()
        for row in self.rows:
            speeds = ", ".join(fixed(speed_m_s) for speed_m_s in row["speeds_m_s"]) or "–"
            gain = fixed(row["brings_s"], 3, otherwise="–", sign="+")
            rows.append([row["method"], fixed(row["hover_time_s"], 3), gain, speeds, row["status"]])
        yield Table(["speed", "Δ [s]", "gain [s]", "legs [m/s]", "answer"], rows, last=2)

    def pictures(self) -> Pictures:
        """Yield the hover over one speed of all legs, named speeds, and the best of each leg."""
        if self.route is None:
            return
        from optuav.plots import Line, Mark, curves
        from optuav.plots.style import titled

        most_m_s = self.route.largest_m_s
        speeds: Floats = np.linspace(SLOWEST, 1.0, SPEEDS_DRAWN) * most_m_s.max()
        points = np.minimum(speeds[:, None] / np.maximum(most_m_s, 1e-9), 1.0)
        hovers_s = self.route.hover_times_s(points, 0.0, self.perspective)
        flown = np.isfinite(hovers_s)
        at_best = [speed for leg in self.plan.speeds_m_s for speed in leg]
        curve: Any = self.mission.flight_model.power_over_speed(0.0)
        named = {"best endurance": curve.best_endurance[0], "best range": curve.best_range[0]}
        ax = curves(
            [
                Line("all legs at one speed", speeds[flown], hovers_s[flown]),
                Line("each leg at its best", at_best, [self.plan.hover_time_s] * len(at_best), "o"),
            ],
            title=titled(self.mission.name, "hover by the speed of the legs"),
            x_label="ground speed $V$ [m/s]",
            y_label="hover time Δ [s]",
            marks=[
                Mark(float(x), f"{words}: {fixed(float(x), 1)} m/s") for words, x in named.items()
            ],
        )
        yield "speeds.png", ax


def compare_speeds(mission: Mission, perspective: Perspective) -> SpeedComparison:
    """Return P1 at named speeds and at free ones, with the answers of CasADi and a grid.

    The grid covers all speeds of the legs on the route of the plan with free speeds.
    """
    free = formulate(mission, P1(speed="free"), perspective=perspective)
    assert isinstance(free, FreeSpeedProgram)
    plans = {
        rule: solve(
            mission.replace({"flight.cruise_speed_m_s": None, "flight.speed": rule}),
            perspective=perspective,
        )
        for rule in RULES
    }
    plan = plans["free"] = free.solve()
    answers = list[tuple[str, float | None, tuple[float, ...], str]]()
    for method, answer in plans.items():
        flown = tuple(speed for leg in answer.speeds_m_s for speed in leg) if answer else ()
        answers.append(
            (method, answer.hover_time_s if answer else None, flown, answer.status.value)
        )
    route: RouteSpeeds | None = None
    if plan:
        solutions = free.answers()
        if (best := free.best(solutions)) is not None:
            solution, entry = solutions[best[0]], best[1]
            point = solution.point(entry)
            speeds = tuple(x for name, x in point.items() if name.startswith("speed_"))
            status = solution.statuses[entry].value
            answers.append(("free, CasADi", point["hover_time_s"], speeds, status))
        route = free.route_of(plan)
        most_m_s = route.largest_m_s
        side = int(GRID ** (1.0 / len(most_m_s)))
        axes = np.meshgrid(*[np.linspace(SLOWEST, 1.0, side)] * len(most_m_s))
        points = np.array([axis.ravel() for axis in axes]).T
        hovers_s = route.hover_times_s(points, 0.0, perspective)
        top = int(hovers_s.argmax())
        speeds = tuple((points[top] * most_m_s).tolist())
        answers.append(("free, grid", float(hovers_s[top]), speeds, f"{side} per leg"))
    first_s = answers[0][1]
    gains_s = [None if s is None or first_s is None else s - first_s for _, s, _, _ in answers]
    gains_s[0] = None  # The others are compared with it
    rows = (
        SpeedAnswer(
            method=method, hover_time_s=s, brings_s=gain_s, speeds_m_s=speeds, status=status
        )
        for (method, s, speeds, status), gain_s in zip(answers, gains_s, strict=True)
    )
    return SpeedComparison(
        mission=mission,
        rows=tuple(rows),
        by=("speed",),
        perspective=perspective,
        plan=plan,
        route=route,
    )

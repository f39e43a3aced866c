"""The search for the best hover point: samples, IPOPT cell by cell, and a close search.

A turn of a leg costs time that has a cusp where the turn vanishes, the charging jumps where a
building hides the laser, and no leg may cross a building. So the hover times of all itineraries are
tried all over the region, and on the surfaces on which a turn vanishes, with the real geometry.
From the best of these points IPOPT solves `P1Free` in the cell around them. At the end, points ever
closer around the best are tried.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from optuav.network.network import Network
from optuav.solving.hover_cells import Cells
from optuav.solving.hover_region import Region
from optuav.solving.hover_starts import PROMISING_S, starts
from optuav.solving.hover_times import Found, HoverTimes
from optuav.solving.open_routes import OpenRoutes
from optuav.solving.question import Question
from optuav.solving.vanishing_turns import moved_onto, surfaces

MOST_JUDGED = 6
"""Most points found that are straightened, searched closely, and judged."""
AROUND, FIRST_M, LAST_M, SHRINK = 100, 5.0, 1e-6, 0.5
"""Close search: points a round, how far they reach first and last [m], and after a failure."""
CLOSE_S = 1e-3
"""Points that are worse than the best by more than this are not judged [s]."""


def best_points(
    groups: tuple[OpenRoutes, ...], asked: Question, worked_out: Network, where: Region
) -> list[Found]:
    """The best points found, the best first, those that are next to as good among them.

    They are sought as if the battery were charged at constant current.

    Parameters
    ----------
    groups
        Routes with their hover point open.
    asked, worked_out
        The question, and the mission.
    where
        Where the UAV may hover.

    Raises
    ------
    SolverError
        If the time limit passes.
    """
    groups = tuple(replace(each, free=replace(each.free, tapers=False)) for each in groups)
    times = HoverTimes(asked, worked_out, where)
    cells = Cells(times)
    climbed: list[Found] = []
    for start in starts(groups, times):
        if not climbed or start.hover_s > max(each.hover_s for each in climbed) - PROMISING_S:
            climbed.append(cells.climbed(start))
    ends = _ordered(climbed)
    straightened = [better for end in ends[:MOST_JUDGED] for better in _straightened(end, cells)]
    judged = _ordered([*ends, *straightened])[:MOST_JUDGED]
    found = _ordered(_closely(each, times) for each in judged)
    return [each for each in found if each.hover_s >= found[0].hover_s - CLOSE_S]


def _straightened(end: Found, cells: Cells) -> Iterator[Found]:
    """What one more vanishing turn makes better, as long as there is one."""
    times = cells.times
    entry = np.array([end.entry])
    better = [
        Found(end.routes, end.entry, (*end.straight, turn), on_m[0], hover_s)
        for turn, on_m in surfaces(
            end.routes, end.entry, times.where, end.point_m[None], end.straight
        )
        if (hover_s := float(times.at(end.routes, entry, on_m)[0, 0])) > end.hover_s
    ]
    for start in better:
        found = cells.climbed(start)
        yield found
        yield from _straightened(found, cells)


def _closely(found: Found, times: HoverTimes) -> Found:
    """The best of points ever closer around a point, half of them where its turns vanish."""
    where = times.where
    random, reach_m, entry = np.random.default_rng(0), FIRST_M, np.array([found.entry])
    while reach_m > LAST_M:
        steps_m = reach_m * random.normal(size=(AROUND, 3))
        for axis in range(3):
            steps_m[axis::4, axis] = 0.0
        points_m = where.inside(found.point_m + steps_m)
        if found.straight:
            on_m = moved_onto(found.routes, found.entry, where, points_m[::2], found.straight)
            points_m = np.vstack([points_m, on_m])
        hover_s = times.at(found.routes, entry, points_m)[0]
        top = int(hover_s.argmax())
        if hover_s[top] > found.hover_s:
            found = found._replace(point_m=points_m[top], hover_s=float(hover_s[top]))
        else:
            reach_m *= SHRINK
    return found


def _ordered(found: Iterable[Found]) -> list[Found]:
    return sorted(found, key=lambda each: -each.hover_s)

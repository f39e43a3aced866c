"""Hover times by mission and place of the laser, and lasers moved in the plane to better places."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.solving.best_plans import best_plans
from optuav.solving.question import checked_question

AT_ONCE = 800
"""Missions times places of the laser computed together, about: as many as fit the cache."""
LAST_M = 1.0  # Shortest step [m]
WORTHWHILE = 1e-5  # Relative; for less no laser is moved
ANGLES = np.arange(8) * np.pi / 4.0
AROUND = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(8)])  # Steps to all sides


def hover_table(missions: Sequence[Mission], sites_m: Floats, perspective: Perspective) -> Floats:
    """Longest hovers (mission, site) [s] with the laser at each site (site, 3) [m].

    NaN without a plan.
    """
    found_s = np.empty((len(missions), len(sites_m)))
    for numbers, hover_s, _ in _with_laser_at(missions, sites_m, perspective):
        found_s[numbers] = hover_s
    return found_s


def refined(
    missions: Sequence[Mission],
    position_m: Floats,
    reach_m: Floats,
    perspective: Perspective,
    value: Callable[[Floats], float],
) -> tuple[Floats, Floats]:
    """Better places of the lasers (laser, 3) [m], and the hover times there (mission, laser) [s].

    Each stays within its reach (laser,) [m] and at its height. The `value` of hover times
    (mission, laser) [s] is maximised; each mission takes its longest.

    Where sight of the laser begins or ends the hover time jumps, so that no bound on its slope
    holds across. Within such borders it is tried point by point, each computed exactly as at a
    candidate, and the result is the best of these points, without a bound.
    """
    start_m, position_m = position_m, position_m.copy()
    tables = [_tried(missions, point_m[None], perspective) for point_m in start_m]
    hover_s = np.concatenate([each for each, _ in tables], axis=1)
    best, step_m = value(hover_s), 0.5 * reach_m.max(initial=0.0)
    while step_m >= LAST_M:
        before = best
        for laser, (_, lit) in enumerate(tables):
            points_m = position_m[laser] + step_m * AROUND
            far_m = np.linalg.norm(points_m - start_m[laser], axis=1)
            points_m = points_m[far_m <= reach_m[laser]]
            if not len(points_m):
                continue
            found_s, seen = _tried(missions, points_m, perspective)
            for point in np.flatnonzero((seen == lit).all(axis=1)).tolist():
                changed_s = hover_s.copy()
                changed_s[:, laser] = found_s[:, point]
                if (reached := value(changed_s)) > best + WORTHWHILE * abs(best):
                    best, hover_s, position_m[laser] = reached, changed_s, points_m[point]
        if best <= before + WORTHWHILE * abs(before):
            step_m *= 0.5
    return position_m, hover_s


def _tried(
    missions: Sequence[Mission], points_m: Floats, perspective: Perspective
) -> tuple[Floats, Booleans]:
    """Hover times at points (mission, point) [s], and lit places there (point, place of all)."""
    hover_s, seen = np.empty((len(missions), len(points_m))), list[Booleans]()
    for numbers, some_s, lit in _with_laser_at(missions, points_m, perspective):
        hover_s[numbers] = some_s
        seen += [*lit]
    return hover_s, np.concatenate(seen, axis=1)


def _with_laser_at(
    missions: Sequence[Mission], sites_m: Floats, perspective: Perspective
) -> Iterator[tuple[list[int], Floats, Booleans]]:
    """Some missions by number, their hovers (mission, site) [s], lit places (…, site, place).

    Missions that differ only in the place of their device are computed together.
    """
    alike = dict[Mission, list[int]]()
    for number, mission in enumerate(missions):
        link = mission.link.model_copy(update={"device_m": (0.0, 0.0, 0.0)})
        alike.setdefault(mission.model_copy(update={"link": link}), []).append(number)
    at_once = max(1, AT_ONCE // len(sites_m))
    for group in alike.values():
        for first in range(0, len(group), at_once):
            numbers = group[first : first + at_once]
            network, shape = build_network(missions[numbers[0]]), (len(numbers), len(sites_m))
            columns = _columns("laser.position_m", np.tile(sites_m, (shape[0], 1)))
            if len(numbers) > 1:  # else legs have one row
                devices_m = np.array([missions[number].link.device_m for number in numbers])
                columns |= _columns("link.device_m", devices_m.repeat(shape[1], axis=0))
            variants = Variants(network, columns)
            question = checked_question(network.mission, "P1", perspective)
            hover_s = best_plans(variants, question).hover_time_s
            power_W = variants.received.power_W
            lit = np.broadcast_to(power_W > 0.0, (variants.count, power_W.shape[1]))
            yield numbers, hover_s.reshape(shape), lit.reshape(*shape, -1)


def _columns(key: str, points_m: Floats) -> dict[str, Floats]:
    """A place of variants by component."""
    return {f"{key}[{axis}]": at_m for axis, at_m in enumerate(points_m.T)}

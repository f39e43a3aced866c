"""Hover times by mission and place of the laser, and lasers moved in the plane to better places."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import TypeAlias

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.places import Places, build_places
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.presentation.numbers import figure
from optuav.solving.best_plans import best_plans, takes_arrays
from optuav.solving.device_routes import with_routes
from optuav.solving.promising_buildings import (
    FIRST_ROUTES,
    MANY_BUILDINGS,
    best_plans_or_all,
    few_near,
    takes_few,
)
from optuav.solving.question import Question, checked_question
from optuav.solving.solve import solve
from optuav.status import SAME_S

Progress: TypeAlias = Callable[[int, int | None, str], None]

TRIALS_AT_ONCE = 800
"""Missions times places of the laser computed together, about: as many as fit the cache."""
ROUTES_AT_ONCE = 1 << 19  # Routes over several devices times places of the laser
SOME = 64  # Places of the laser computed together past many buildings
NEAREST = 10  # Buildings that are tried first then, besides those that were the best so far
LAST_M = 1.0  # Shortest step [m]
WORTHWHILE = 1e-5  # Relative; for less no laser is moved
ANGLES = np.arange(8) * np.pi / 4.0
AROUND = np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(8)])  # Steps to all sides


class HoverTimes:
    """Hover times of missions with the laser elsewhere."""

    def __init__(
        self, missions: Sequence[Mission], perspective: Perspective, tell: Progress | None = None
    ) -> None:
        self.missions, self.computed = missions, 0
        self._tell = tell or (lambda *_: None)
        self._questions = [checked_question(mission, "P1", perspective) for mission in missions]
        # Towns, with the buildings to try first, and missions that differ only in their device.
        self._towns, alike = dict[int, tuple[Places, list[int]]](), dict[Mission, list[int]]()
        for number, mission in enumerate(missions):
            question, large = self._questions[number], len(mission.buildings) >= MANY_BUILDINGS
            if large and not mission.devices and takes_few(mission, question):
                self._towns[number] = build_places(mission), []
            else:
                link = mission.link.model_copy(update={"device_m": (0.0, 0.0, 0.0)})
                alike.setdefault(mission.model_copy(update={"link": link}), []).append(number)
        self._alike = [*alike.values()]

    def at(self, sites_m: Floats, words: str = "", total: int | None = None) -> Floats:
        """The longest hovers (mission, site) [s] with the laser at each site (site, 3) [m].

        NaN without a plan. The words say what they are for, and the total how many there will be.
        """
        hover_s = np.empty((len(self.missions), count := len(sites_m)))
        for number in self._towns:
            for some in (slice(begin, begin + SOME) for begin in range(0, count, SOME)):
                self._tell(self.computed, total, words)
                hover_s[number, some] = found_s = self._in_town(number, sites_m[some])
                self.computed += found_s.size
        at_once = max(1, TRIALS_AT_ONCE // count)
        for group in self._alike:
            for numbers in (group[k : k + at_once] for k in range(0, len(group), at_once)):
                self._tell(self.computed, total, words)
                hover_s[numbers] = found_s = self._together(numbers, sites_m)
                self.computed += found_s.size
        return hover_s

    def lit(self, site_m: Floats) -> list[Booleans]:
        """Return which places a laser at a site [m] lights, by mission (place,)."""
        key = {"laser.position_m": site_m.tolist()}
        places = (build_places(mission.replace(key)) for mission in self.missions)
        return [table.received_power_W > 0.0 for table in places]

    def _in_town(self, number: int, sites_m: Floats) -> Floats:
        """The hovers of a mission with many buildings (site,) [s]."""
        mission, (places, best) = self.missions[number], self._towns[number]
        few = few_near(mission, places, NEAREST if best else FIRST_ROUTES, *best)
        variants = Variants(few, _columns("laser.position_m", sites_m))
        plans = best_plans_or_all(variants, places, self._questions[number])
        best[:] = np.unique((plans.route[plans.route > 0] - 1) // 2).tolist()
        return plans.hover_time_s

    def _together(self, numbers: list[int], sites_m: Floats) -> Floats:
        """The hovers of missions that differ only in their device (mission, site) [s].

        Missions with several devices differ in nothing.
        """
        first, shape = numbers[0], (len(numbers), len(sites_m))
        if self.missions[first].devices:
            hovers_s = [*self._over_devices(self.missions[first], self._questions[first], sites_m)]
            return np.broadcast_to(np.concatenate(hovers_s), shape)
        columns = _columns("laser.position_m", np.tile(sites_m, (shape[0], 1)))
        if len(numbers) > 1:  # else legs have one row
            devices_m = np.array([self.missions[number].device_m for number in numbers])
            columns |= _columns("link.device_m", devices_m.repeat(shape[1], axis=0))
        variants = Variants(build_network(self.missions[first]), columns)
        return best_plans(variants, self._questions[first]).hover_time_s.reshape(shape)

    def _over_devices(
        self, mission: Mission, question: Question, sites_m: Floats
    ) -> Iterator[Floats]:
        """Yield the hovers of a mission with several devices, for some sites at a time [s]."""
        if not takes_arrays(mission, question):  # Too many routes for a table
            for site_m in sites_m.tolist():
                plan = solve(mission.replace({"laser.position_m": site_m}), **vars(question))
                yield np.array([plan.hover_time_s if plan else np.nan])
            return
        network = with_routes(build_network(mission), question)
        at_once = max(1, ROUTES_AT_ONCE // len(network.routes))
        for begin in range(0, len(sites_m), at_once):
            columns = _columns("laser.position_m", sites_m[begin : begin + at_once])
            yield best_plans(Variants(network, columns), question).hover_time_s


def refined(
    times: HoverTimes,
    position_m: Floats,
    hover_s: Floats,
    reach_m: Floats,
    value: Callable[[Floats], float],
) -> tuple[Floats, Floats]:
    """Better places of the lasers (laser, 3) [m], and the hover times there (mission, laser) [s].

    Each stays within its reach (laser,) [m] and at its height. The `value` of hover times
    (mission, laser) [s], of which those at the start are given, is maximised; each mission takes
    its longest.

    Where sight of the laser begins or ends the hover time jumps, so that no bound on its slope
    holds across. Within such borders it is tried point by point, each computed exactly as at a
    candidate, and the result is the best of these points, without a bound. A laser around which a
    step to any side changes no hover stays where it is.
    """
    start_m, position_m = position_m, position_m.copy()
    lit_at_start = cache(lambda laser: times.lit(start_m[laser]))
    best, step_m, left = value(hover_s), 0.5 * reach_m.max(initial=0.0), [*range(len(start_m))]
    while step_m >= LAST_M and left:
        before = best
        for laser in [*left]:
            points_m = position_m[laser] + step_m * AROUND
            far_m = np.linalg.norm(points_m - start_m[laser], axis=1)
            points_m = points_m[far_m <= reach_m[laser]]
            if not len(points_m):
                continue
            found_s = times.at(points_m, f"laser {laser + 1}, steps of {figure(step_m, 3)} m")
            gain_s = np.nan_to_num(found_s) - np.nan_to_num(hover_s[:, [laser]])
            if len(points_m) == len(AROUND) and (np.abs(gain_s) <= SAME_S).all():
                left.remove(laser)
                continue
            for point_m, column_s in zip(points_m, found_s.T, strict=True):
                changed_s = hover_s.copy()
                changed_s[:, laser] = column_s
                reached = value(changed_s)
                # Sight takes longer to find than hover times, so it comes last.
                if reached > best + WORTHWHILE * abs(best) and all(
                    map(np.array_equal, times.lit(point_m), lit_at_start(laser))
                ):
                    best, hover_s, position_m[laser] = reached, changed_s, point_m
        if best <= before + WORTHWHILE * abs(before):
            step_m *= 0.5
    return position_m, hover_s


def _columns(key: str, points_m: Floats) -> dict[str, Floats]:
    """A place of variants by component."""
    return {f"{key}[{axis}]": at_m for axis, at_m in enumerate(points_m.T)}

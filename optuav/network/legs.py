"""Legs: flights between two places, as arrays."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.flight.model import CruisingModel
from optuav.mission import Mission
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import Places, own_roofs
from optuav.network.prisms import Prisms
from optuav.network.ways import build_ways, loads_along
from optuav.physics.flight import Loads
from optuav.physics.kibam import Stage
from optuav.physics.quantity import Quantity

NO_LEG = -1
LEGS_AT_ONCE = 1 << 14  # Legs that are computed together: as many as fit the cache


@dataclass(frozen=True)
class Legs:
    """Legs by number; all arrays have one entry per leg."""

    # Numbers of places.
    start: Integers
    end: Integers
    stages: tuple[str, ...]  # Names of the stages of the flight model
    # Length [m] and largest speed [m/s].
    distance_m: Floats
    peak_speed_m_s: Floats
    # (stage, leg): duration [s], current [A] and power [W] drawn in every stage.
    durations_s: Floats
    currents_A: Floats
    powers_W: Floats
    # Number of a building in the way, −1 if the way is clear or may cross buildings.
    crosses: Integers
    waypoints_m: Floats  # (waypoint, axis, leg) of bent ways [m]; NaN beyond a leg's own
    flyable: Booleans  # Whether a route may use it
    edited: Booleans  # Whether its figures were stated by the user rather than computed
    # (segment, leg): horizontal speeds over ground [m/s] where they were chosen leg by leg; NaN
    # beyond a leg's own segments
    speeds_m_s: Floats | None = None

    @property
    def arrays(self) -> dict[str, Any]:
        """Its arrays by name."""
        return {k: value for k, value in vars(self).items() if isinstance(value, np.ndarray)}

    def take(self, numbers: Integers) -> "Legs":
        """Some of the legs, by number."""
        return replace(self, **{k: array[..., numbers] for k, array in self.arrays.items()})

    def put(self, which: Integers, others: "Legs") -> "Legs":
        """The table with others in place of some of its legs, by number."""
        joined = dict[str, Any]()
        for name, array in self.arrays.items():
            pair = [array.copy(), others.arrays[name]]
            if array.ndim > 1:  # Legs of fewer segments
                most, absent = max(map(len, pair)), np.nan if name == "waypoints_m" else 0.0
                more = [np.full((most - len(table), *table.shape[1:]), absent) for table in pair]
                pair = [np.concatenate(tables) for tables in zip(pair, more, strict=True)]
            joined[name], new = pair
            joined[name][..., which] = new
        return replace(self, stages=max(self.stages, others.stages, key=len), **joined)

    def stages_of(self, leg: int) -> tuple[Stage, ...]:
        """Stages of a leg, with the current into the battery [A], as numbers."""
        pairs = np.stack([self.currents_A[:, leg], self.durations_s[:, leg]], axis=1).tolist()
        return tuple(Stage(-current_A, duration_s) for current_A, duration_s in pairs)

    @property
    def duration_s(self) -> Floats:
        """Flight time [s]."""
        return np.asarray(self.durations_s.sum(axis=0))

    @property
    def charge_As(self) -> Floats:
        """Charge drawn [A s]."""
        return np.asarray((self.durations_s * self.currents_A).sum(axis=0))

    @property
    def energy_J(self) -> Floats:
        """Energy drawn [J]."""
        return np.asarray((self.durations_s * self.powers_W).sum(axis=0))


def build_legs(
    mission: Mission, places: Places, obstacles: Prisms, start: Integers, end: Integers
) -> Legs:
    """A table of the legs between places, from `start` to `end` (leg,), different in every leg."""
    count, at_m, flight = len(start), places.position_m, mission.flight_model
    crosses = np.full(len(start), CLEAR, dtype=np.intp)
    waypoints_m, rule = np.empty((count, 0, 3)), mission.flight.obstacle_rule
    if rule != "ignore" and len(obstacles.building):
        lines, line = shared_lines(start, end)
        (roofs,) = own_roofs(town := (mission.buildings,), at_m[None], places.roofs)
        if rule == "refuse":
            crosses = _blockers(places, obstacles, lines, roofs).take(line)
        else:
            ways = build_ways(mission, town, at_m[None], lines, roofs[lines])
            crosses = ways.blocker[0, line]
            waypoints_m = ways.of_legs(line, start > end)[0]
    loads = list[Loads]()
    for part in (slice(k, k + LEGS_AT_ONCE) for k in range(0, max(count, 1), LEGS_AT_ONCE)):
        start_m, end_m = (at_m.take(ends[part], axis=0) for ends in (start, end))
        loads.append(loads_along(flight.leg, start_m, end_m, waypoints_m[part]))
    distance_m, peak_m_s = _table([(load.distance_m, load.peak_speed_m_s) for load in loads], count)
    durations_s = _table([load.durations_s for load in loads], count)
    currents_A = _table([load.currents_A for load in loads], count)
    powers_W = _table([load.powers_W for load in loads], count)
    flyable = np.isfinite(durations_s).all(axis=0) & (crosses == CLEAR)
    edited, stages = np.zeros(count, bool), loads[0].stages
    drawn = durations_s, currents_A, powers_W
    bent_m = np.moveaxis(waypoints_m, 0, -1)
    return Legs(start, end, stages, distance_m, peak_m_s, *drawn, crosses, bent_m, flyable, edited)


def segment_ways(places: Places, legs: Legs) -> Floats:
    """The ways of the segments of legs (axis, segment, leg) [m]; NaN beyond a leg's own."""
    start_m, end_m = (places.position_m[end].T[None] for end in (legs.start, legs.end))
    absent = np.isnan(legs.waypoints_m)
    stops_m = np.concatenate([start_m, np.where(absent, end_m, legs.waypoints_m), end_m])
    ways_m = np.diff(stops_m, axis=0)
    ways_m[1:][absent] = np.nan
    return np.moveaxis(ways_m, 1, 0)


def legs_at(mission: Mission, places: Places, legs: Legs, speeds_m_s: Floats) -> Legs:
    """The legs at other horizontal speeds over ground (segment, leg) [m/s]."""
    flight = mission.flight_model
    assert isinstance(flight, CruisingModel)
    # As in `loads_along`, which asks for one segment after the other, missing ones are the first
    own_m_s = iter(np.where(np.isnan(speeds_m_s), speeds_m_s[:1], speeds_m_s))
    start_m, end_m = (places.position_m[end] for end in (legs.start, legs.end))
    ends_m = start_m, end_m, np.moveaxis(legs.waypoints_m, -1, 0)
    loads = loads_along(lambda way_m: flight.leg_at(way_m, next(own_m_s)), *ends_m)
    durations_s, count = np.stack(loads.durations_s), len(legs.start)
    return replace(
        legs,
        peak_speed_m_s=np.asarray(loads.peak_speed_m_s),
        durations_s=durations_s,
        currents_A=_table([loads.currents_A], count),
        powers_W=_table([loads.powers_W], count),
        flyable=np.isfinite(durations_s).all(axis=0) & (legs.crosses == CLEAR),
        speeds_m_s=speeds_m_s,
    )


def _blockers(places: Places, obstacles: Prisms, lines: Integers, roofs: Integers) -> Integers:
    """A building in the way of each line (line, 2); none where an end is not known.

    That on whose roof (place,) an end stands does not count.
    """
    ways = lines[known := places.exists.take(lines).all(axis=1)]
    low_m, high_m = (places.position_m.take(ends, axis=0) for ends in ways.T)
    blockers = np.full(len(lines), CLEAR, dtype=np.intp)
    blockers[known] = crossed(obstacles, low_m, high_m, roofs[ways])
    return blockers


def _table(parts: Sequence[Sequence[Quantity]], count: int) -> Floats:
    """Figures (figure, leg) of all parts; without memory where one value suits all legs."""
    if not any(np.ndim(part) for part in parts[0]):
        return np.broadcast_to(np.array(parts[0], dtype=float)[:, None], (len(parts[0]), count))
    return np.concatenate([np.stack(np.broadcast_arrays(*part)) for part in parts], axis=1)


def shared_lines(start: Integers, end: Integers) -> tuple[Integers, Integers]:
    """The lines between places (line, 2) that legs fly along, and the number of each leg's line.

    One line serves both directions, so that rounding cannot tell them apart.
    """
    most = max(start.max(initial=0), end.max(initial=0)) + 1
    key = np.minimum(start, end) * most + np.maximum(start, end)
    order = np.argsort(key, kind="stable")  # Fast, as the keys are sorted in long runs
    key = key.take(order)
    first = np.append(True, key[1:] != key[:-1])[: len(key)]
    line = np.empty_like(order)
    line[order] = np.cumsum(first) - 1
    return np.stack(np.divmod(key[first], most), axis=1), line

"""Legs: flights between two places, as arrays."""

from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.places import FIRST_BUILDING, Places
from optuav.network.prisms import Prisms
from optuav.physics.quantity import norm

NO_LEG = -1
AT_ONCE = 1 << 14  # Legs that are computed together: as many as fit the cache


@dataclass(frozen=True)
class Legs:
    """Legs by number; all arrays have one entry a leg."""

    # Numbers of places.
    start: Integers
    end: Integers
    # Length [m] and largest speed [m/s].
    distance_m: Floats
    peak_speed_m_s: Floats
    # (stage, leg): duration [s], current [A] and power [W] drawn in every stage.
    durations_s: Floats
    currents_A: Floats
    powers_W: Floats
    # Number of a building in the way, −1 if the way is clear or may cross buildings.
    crosses: Integers
    flyable: Booleans  # Whether a route may use it
    edited: Booleans  # Whether its figures were stated by the user rather than computed

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
    count, at_m = len(start), places.position_m
    rows = list[Floats]()
    for part in (slice(k, k + AT_ONCE) for k in range(0, max(count, 1), AT_ONCE)):
        way_m = tuple((at_m.take(end[part], axis=0) - at_m.take(start[part], axis=0)).T)
        loads, peak_m_s = vehicle.leg_loads(mission, way_m)
        rows.append(np.stack(np.broadcast_arrays(norm(way_m), peak_m_s, *loads.durations_s)))
    distance_m, top_m_s, *stages_s = figures = np.concatenate(rows, axis=1)
    durations_s = figures[-len(stages_s) :]
    # Currents and powers are the same on all legs.
    currents_A, powers_W = (
        np.broadcast_to(np.array(each, dtype=float)[:, None], durations_s.shape)
        for each in (loads.currents_A, loads.powers_W)
    )
    crosses = np.full(len(start), CLEAR, dtype=np.intp)
    if not mission.flight.through_buildings and len(obstacles.building):
        # A building in the way is the same there and back, and none where an end is not known.
        lines, line = shared_lines(start, end)
        known = np.isfinite(places.position_m).all(axis=1).take(lines).all(axis=1)
        ways = lines[known]
        low_m, high_m = (at_m.take(each, axis=0) for each in ways.T)
        blockers = np.full(len(lines), CLEAR, dtype=np.intp)
        blockers[known] = crossed(obstacles, low_m, high_m, ways - FIRST_BUILDING)
        crosses = blockers.take(line)
    flyable = np.isfinite(durations_s).all(axis=0) & (crosses == CLEAR)
    drawn = durations_s, currents_A, powers_W
    edited = np.zeros(count, bool)
    return Legs(start, end, distance_m, top_m_s, *drawn, crosses, flyable, edited)


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

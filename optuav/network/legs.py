"""Legs: flights between two places, as arrays."""

from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, Prisms, crossed
from optuav.network.places import FIRST_BUILDING, Places
from optuav.physics.quantity import norm

NO_LEG = -1


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
    x, y, z = (places.position_m[end] - places.position_m[start]).T
    loads, peak_m_s = vehicle.leg_loads(mission, (x, y, z))
    durations_s, currents_A, powers_W = (
        np.stack([np.broadcast_to(each, start.shape) for each in by_stage]) for by_stage in loads
    )
    crosses = np.full(len(start), CLEAR, dtype=np.intp)
    if not mission.flight.through_buildings:
        # A building in the way is the same there and back, and none where an end is not known.
        lines, line = shared_lines(start, end)
        known = np.isfinite(places.position_m)[lines].all(axis=(1, 2))
        low_m, high_m = np.moveaxis(places.position_m[lines[known]], 1, 0)
        blockers = np.full(len(lines), CLEAR, dtype=np.intp)
        blockers[known] = crossed(obstacles, low_m, high_m, lines[known] - FIRST_BUILDING)
        crosses = blockers[line]
    way = norm((x, y, z)), np.asarray(peak_m_s, dtype=float)
    drawn = durations_s, currents_A, powers_W
    flyable = np.isfinite(durations_s).all(axis=0) & (crosses == CLEAR)
    return Legs(start, end, *way, *drawn, crosses, flyable, np.zeros(len(start), bool))


def shared_lines(start: Integers, end: Integers) -> tuple[Integers, Integers]:
    """The lines between places (line, 2) that legs fly along, and the number of each leg's line.

    One line serves both directions, so that rounding cannot tell them apart.
    """
    low, high = np.minimum(start, end), np.maximum(start, end)
    count = 1 + int(high.max(initial=0))
    numbers, line = np.unique(low * count + high, return_inverse=True)
    return np.stack(np.divmod(numbers, count), axis=1), line

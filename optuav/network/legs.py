"""The legs that routes may use, as one table of arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import CLEAR, Prisms, crossed
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN, Places
from optuav.physics.flight import Loads
from optuav.physics.quantity import Quantity, norm


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


def one_stop_legs(buildings: int) -> tuple[Integers, Integers]:
    """Starts and ends of all legs with at most one building on the way.

    Legs 0 and 1 are origin → hover and hover → destination; legs 2 + 4 b to 5 + 4 b belong to
    building b: origin → b, b → hover, hover → b, b → destination.
    """
    roof = np.arange(FIRST_BUILDING, FIRST_BUILDING + buildings)
    start = np.stack([np.full(buildings, ORIGIN), roof, np.full(buildings, HOVER), roof], axis=1)
    end = np.stack([roof, np.full(buildings, HOVER), roof, np.full(buildings, DESTINATION)], axis=1)
    return (
        np.concatenate([[ORIGIN, HOVER], start.ravel()]),
        np.concatenate([[HOVER, DESTINATION], end.ravel()]),
    )


def all_pairs(places: int) -> tuple[Integers, Integers]:
    """Starts and ends of the legs between any two places, both ways, ordered by start and end."""
    start, end = np.divmod(np.arange(places * places), places)
    apart = start != end
    return start[apart], end[apart]


def build_legs(
    mission: Mission, places: Places, obstacles: Prisms, start: Integers, end: Integers
) -> Legs:
    """A table of the legs between places, from `start` to `end` (leg,), different in every leg."""
    loads, peak_m_s = leg_loads(mission, places.position_m, start, end)
    crosses = np.full(len(start), CLEAR, dtype=np.intp)
    if not mission.flight.through_buildings:
        crosses = _blockers(places, obstacles, start, end)

    def by_stage(figures: tuple[Quantity, ...]) -> Floats:
        table = np.empty((len(figures), len(start)))
        for row, figure in zip(table, figures, strict=True):
            row[:] = figure
        return table

    return Legs(
        start,
        end,
        norm(tuple((places.position_m[end] - places.position_m[start]).T)),
        np.asarray(peak_m_s, dtype=float),
        by_stage(loads.durations_s),
        by_stage(loads.currents_A),
        by_stage(loads.powers_W),
        crosses,
        np.isfinite(np.asarray(loads.duration_s)) & (crosses == CLEAR),
        np.zeros(len(start), bool),
    )


def leg_loads(
    mission: Mission, position_m: Floats, start: Integers, end: Integers
) -> tuple[Loads, Quantity]:
    """What legs draw, and their peak speed [m/s], between places (…, place, 3) [m]."""
    x, y, z = np.moveaxis(position_m[..., end, :] - position_m[..., start, :], -1, 0)
    return vehicle.leg_loads(mission, (x, y, z))


def shared_lines(start: Integers, end: Integers) -> tuple[Integers, Integers]:
    """The lines between places (line, 2) that legs fly along, and the number of each leg's line.

    One line serves both directions, so that rounding cannot tell them apart.
    """
    low, high = np.minimum(start, end), np.maximum(start, end)
    count = 1 + int(high.max(initial=0))
    numbers, line = np.unique(low * count + high, return_inverse=True)
    return np.stack(np.divmod(numbers, count), axis=1), line


def _blockers(places: Places, obstacles: Prisms, start: Integers, end: Integers) -> Integers:
    """A building in the way of each leg, the same there and back; −1 where an end is not known."""
    lines, line = shared_lines(start, end)
    found = np.full(len(lines), CLEAR, dtype=np.intp)
    known = places.exists[lines].all(axis=1)
    low_m, high_m = np.moveaxis(places.position_m[lines[known]], 1, 0)
    found[known] = crossed(obstacles, low_m, high_m, lines[known] - FIRST_BUILDING)
    return found[line]

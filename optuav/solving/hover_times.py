"""How long the UAV can hover at any points, by any itinerary, with the buildings in the way."""

from __future__ import annotations

import math
import time
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.errors import SolverError
from optuav.network.network import Network
from optuav.network.obstacles import CLEAR, crossed, prisms
from optuav.network.places import FIRST_BUILDING
from optuav.solving.hover_region import Region
from optuav.solving.open_routes import OpenRoutes
from optuav.solving.question import Question

LASER = -1
"""In place of the number of a place."""


class Found(NamedTuple):
    """A hover point of an itinerary, and what it gives.

    Parameters
    ----------
    routes, entry
        The itinerary.
    straight
        Turns that vanish there, by number.
    point_m
        Where the UAV hovers (3,) [m].
    hover_s
        Δ [s].
    """

    routes: OpenRoutes
    entry: int
    straight: tuple[int, ...]
    point_m: Floats
    hover_s: float


class HoverTimes:
    """Hover times with the real geometry, until the time limit passes.

    Parameters
    ----------
    asked, worked_out
        The question, and the mission.
    where
        Where the UAV may hover.
    """

    def __init__(self, asked: Question, worked_out: Network, where: Region) -> None:
        self.where = where
        self.perspective, self.time_limit_s = asked.perspective, asked.time_limit_s
        self.mission = worked_out.mission
        self.places_m = worked_out.places.position_m
        self.obstacles = prisms(self.mission)
        self.latest = time.monotonic() + (asked.time_limit_s or math.inf)

    def at(self, routes: OpenRoutes, entry: Integers, points_m: Floats) -> Floats:
        """Δ [s] of itineraries (r,) at points (k, 3) [m], shape (r, k); −∞ where none is.

        Raises
        ------
        SolverError
            If the time limit has passed.
        """
        self.check_limit()
        which, point = (each.ravel() for each in np.indices((len(entry), len(points_m))))
        lit = self.lit(points_m)
        times = routes.times_s(self.perspective, entry[which], points_m[point], lit[point])
        found = np.nan_to_num(times["hover_time_s"], nan=-np.inf).reshape(len(entry), -1)
        around = routes.around[entry]
        for place in [] if self.mission.flight.through_buildings else np.unique(around).tolist():
            blocked = self.hidden(place, points_m) != CLEAR
            found[(around == place).any(axis=1)[:, None] & blocked] = -np.inf
        return found

    def lit(self, points_m: Floats) -> Booleans:
        """Whether points (k, 3) [m] are in sight of the laser."""
        if self.mission.laser is None:
            return np.zeros(len(points_m), bool)
        clear: Booleans = self.hidden(LASER, points_m) == CLEAR
        return clear

    def hidden(self, place: int, points_m: Floats) -> Integers:
        """A building between a place, or the laser, and each point (k, 3) [m]; −1 for none."""
        if place == LASER and self.mission.laser is None:
            return np.full(len(points_m), CLEAR)
        from_m = np.broadcast_to(self.position_m(place), points_m.shape)
        exempt = np.full((len(points_m), 1), place - FIRST_BUILDING)
        return crossed(self.obstacles, from_m, points_m, exempt)

    def position_m(self, place: int) -> Floats:
        """Where a place, or the laser, is (3,) [m]."""
        if place == LASER:
            assert self.mission.laser is not None
            return np.array(self.mission.laser.position_m)
        where: Floats = self.places_m[place]
        return where

    def check_limit(self) -> None:
        """Give up where the time limit has passed."""
        if time.monotonic() > self.latest:
            raise SolverError("casadi did not finish within the time limit")

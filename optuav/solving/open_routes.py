"""Routes with their hover point left open: their hover times at any points."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from formulations.p1 import P1
from formulations.p1_free import AXES, Cell, P1Free
from formulations.perspectives import AVAILABLE
from formulations.quantities import QUANTITIES
from optuav.arrays import Booleans, Floats, Integers
from optuav.modelling import Model, Parameter
from optuav.network import vehicle
from optuav.network.network import Network, nearest_building
from optuav.network.places import HOVER
from optuav.network.routes import NO_LEG
from optuav.physics.kibam import Stage
from optuav.solving.delivered import delivered
from optuav.solving.given import quantities
from optuav.solving.question import Question

PLACES = ("before_m", "after_m")


@dataclass(frozen=True)
class OpenRoutes:
    """Routes, all direct or all by way of a building, with the hover point open.

    Parameters
    ----------
    index
        Numbers of the itineraries.
    around
        (itinerary, 2): numbers of the places before and after the hover point.
    free
        What depends on the hover point and what does not; arrays with one entry an itinerary.
    """

    index: Integers
    around: Integers
    free: P1Free

    def model(self, perspective: str, cell: Cell | None = None) -> Model:
        """(P1) over w, Δ and T', the figures of the itineraries as parameters."""
        places = {
            place: tuple(
                Parameter(f"{place[:-2]}_{axis}_m", f"{axis}_{place[0]}", "m", values)
                for axis, values in zip(AXES, getattr(self.free, place), strict=True)
            )
            for place in PLACES
        }
        names = ("device_m", "laser_m", "leg", "turns", "charging")
        kept = {name: getattr(self.free, name) for name in names}
        sight = Parameter("laser_sight", "s_w", "1", 1.0)
        return P1Free.model(self.free, perspective, **places, **kept, laser_sight=sight, cell=cell)

    def taken(self, entry: Integers | int) -> P1Free:
        """The figures of one itinerary, or of several."""
        steps = (
            step if isinstance(step, str) else Stage(*(_taken(each, entry) for each in step))
            for step in self.free.steps
        )
        arrays = {
            each.name: value[entry]
            for each in QUANTITIES
            if np.ndim(value := getattr(self.free, each.name))
        }
        for place in PLACES:
            arrays[place] = tuple(values[entry] for values in getattr(self.free, place))
        return replace(self.free, **arrays, steps=tuple(steps))

    def times_s(
        self, perspective: str, entry: Integers, points_m: Floats, lit: Booleans
    ) -> Mapping[str, Floats]:
        """Δ and T' [s] by name of itineraries (k,) at points (k, 3) [m]; NaN where none are.

        What is in the way of legs is left aside; `lit` tells where the laser charges.
        """
        free = replace(self.taken(entry), laser_sight=np.where(lit, 1.0, 0.0))
        there = free.at(tuple(points_m.T))
        if perspective == AVAILABLE:
            return delivered(there, len(points_m))
        from optuav.engines import closed_form

        return closed_form.solve(P1.model(there, perspective), len(points_m)).values


def _taken(figure: Any, entry: Integers | int) -> Any:
    """A figure of one itinerary or several: its own, or the one of all."""
    return figure[entry] if np.ndim(figure) else figure


def open_routes(asked: Question, worked_out: Network) -> tuple[OpenRoutes, ...]:
    """The itineraries that a question allows and some hover point may make flyable."""
    routes, table = worked_out.routes, worked_out.legs
    flown = routes.legs != NO_LEG
    to_hover = flown & (table.end[routes.legs] == HOVER)
    from_hover = flown & (table.start[routes.legs] == HOVER)
    apart = flown & ~to_hover & ~from_hover
    around = np.stack(
        [table.start[routes.legs[to_hover]], table.end[routes.legs[from_hover]]], axis=1
    )
    by_way = routes.building >= 0
    usable = np.where(apart, table.flyable[routes.legs], True).all(axis=1)
    if asked.trajectory == "direct":
        usable &= ~by_way
    elif asked.trajectory == "traj1":
        usable &= by_way & (routes.building == nearest_building(worked_out))
    if asked.order is not None:
        usable &= ~by_way | (routes.rest_first == (asked.order == "rest-first"))
    groups = [np.flatnonzero(usable & ~by_way), np.flatnonzero(usable & by_way)]
    if asked.perspective == AVAILABLE:
        # The steps tell in which order an itinerary stays.
        first = routes.rest_first[groups[1]]
        groups[1:] = [groups[1][first], groups[1][~first]]
    return tuple(
        OpenRoutes(which, around[which], _opened(worked_out, which, apart[which], around[which]))
        for which in groups
        if len(which)
    )


def _opened(worked_out: Network, which: Integers, apart: Booleans, around: Integers) -> P1Free:
    """What itineraries draw but for their legs to and from the hover point (itinerary, leg)."""
    mission, table = worked_out.mission, worked_out.legs
    legs = worked_out.routes.legs[which]
    rests = bool(worked_out.routes.building[which[0]] >= 0)
    given = vars(quantities(worked_out, which, rests=rests, hover_open=True))
    for figure in ("time_s", "charge_As", "energy_J"):
        drawn = getattr(table, "duration_s" if figure == "time_s" else figure)[legs]
        given[f"flight_{figure}"] = np.where(apart, drawn, 0.0).sum(axis=1)
    place_m = worked_out.places.position_m
    before_m, after_m = (tuple(place_m[places].T) for places in around.T)
    drawn_A = float(vehicle.hover_load(mission).current_A)
    return P1Free(
        **{**given, "hover_current_A": drawn_A, "hover_received_W": 0.0},
        before_m=before_m,
        after_m=after_m,
        device_m=mission.link.device_m,
        laser_m=None if mission.laser is None else mission.laser.position_m,
        leg=lambda way_m: vehicle.leg_loads(mission, way_m)[0],
        turns=lambda way_m: vehicle.turns_rad(mission, way_m),
        charging=lambda distance_m: vehicle.charging(mission, distance_m),
    )

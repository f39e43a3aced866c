"""Routes: which legs in which order, with what they cost and what charges on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Literal

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.network.legs import Legs
from optuav.network.places import Places

Order = Literal["rest-first", "hover-first"]
ORDERS: tuple[Order, Order] = ("rest-first", "hover-first")

NO_LEG = -1


@dataclass(frozen=True)
class Routes:
    """Routes with at most one building; all arrays have one entry an itinerary.

    They are ordered as ties are broken: the direct route, then the buildings in the mission's
    order, each rest first and then hover first.

    Parameters
    ----------
    legs
        (itinerary, 3): numbers of the legs flown, −1 for none.
    building
        Number of the building by way of which it goes, −1 for the direct route.
    rest_first
        Whether the building comes before the hover point.
    flyable
        Whether all its legs are.
    flight_time_s, flight_charge_As, flight_energy_J
        Totals over its legs [s], [A s], [J].
    """

    legs: Integers
    building: Integers
    rest_first: Booleans
    flyable: Booleans
    flight_time_s: Floats
    flight_charge_As: Floats
    flight_energy_J: Floats

    def __len__(self) -> int:
        return len(self.building)

    def take(self, which: Sequence[int] | Integers) -> Routes:
        """The itineraries with the given numbers, in that order."""
        chosen = np.asarray(which, dtype=np.intp)
        return Routes(**{each.name: getattr(self, each.name)[chosen] for each in fields(self)})

    def order(self, index: int) -> Order | None:
        """Order of rest and hover of an itinerary; None for the direct route."""
        if self.building[index] < 0:
            return None
        return "rest-first" if self.rest_first[index] else "hover-first"


def itineraries(table: Legs, where: Places) -> Routes:
    """All itineraries with at most one building over a table of legs.

    Parameters
    ----------
    table
        Legs in the order of `one_stop_legs`.
    where
        The places.
    """
    count = len(where.buildings)
    to_roof, roof_to_hover, hover_to_roof, from_roof = (
        2 + 4 * np.arange(count) + k for k in range(4)
    )
    first, last = np.zeros(count, np.intp), np.ones(count, np.intp)
    rest_first = np.stack([to_roof, roof_to_hover, last], axis=1)
    hover_first = np.stack([first, hover_to_roof, from_roof], axis=1)
    numbers = np.concatenate(
        [[[0, 1, NO_LEG]], np.stack([rest_first, hover_first], axis=1).reshape(-1, 3)]
    ).astype(np.intp)
    building = np.concatenate([[-1], np.repeat(np.arange(count), 2)]).astype(np.intp)
    flown = numbers != NO_LEG

    def total(per_leg: Floats) -> Floats:
        sums: Floats = np.where(flown, per_leg[numbers], 0.0).sum(axis=1)
        return sums

    return Routes(
        legs=numbers,
        building=building,
        rest_first=np.concatenate([[False], np.tile([True, False], count)]),
        flyable=np.asarray(np.where(flown, table.flyable[numbers], True).all(axis=1)),
        flight_time_s=total(table.duration_s),
        flight_charge_As=total(table.charge_As),
        flight_energy_J=total(table.energy_J),
    )

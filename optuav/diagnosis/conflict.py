"""Which constraints conflict on which routes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.diagnosis.certificate import Certificate, certificates
from optuav.mission.itineraries import NO_LEG
from optuav.mission.network import Network
from optuav.modelling.traits import traits
from optuav.solving import Program

MOST_ROUTES = 100
"""Routes of a declaration whose conflicts are looked into: those with the shortest flights."""


@dataclass(frozen=True)
class Conflict:
    """Why some routes have no feasible times.

    Parameters
    ----------
    route
        Names of the places of the route for which it is told: of those that it concerns the one
        with the shortest flight.
    routes
        Number of routes that it concerns.
    certificates
        The conflicts on that route, each with its proof; all of them have to be resolved. None
        where the constraints are not linear, or only whole slots do not fit them.
    """

    route: tuple[str, ...]
    routes: int
    certificates: tuple[Certificate, ...]

    @property
    def labels(self) -> tuple[tuple[str, ...], ...]:
        """Labels of the constraints that conflict, one tuple a conflict."""
        return tuple(each.labels for each in self.certificates)

    def to_dict(self) -> dict[str, Any]:
        """As plain data."""
        return {
            "route": list(self.route),
            "routes": self.routes,
            "conflicts": [
                {"labels": list(each.labels), "keys": list(each.keys), **each.to_dict()}
                for each in self.certificates
            ],
        }


def conflicts(program: Program) -> tuple[Conflict, ...]:
    """The conflicts of an infeasible program by kind."""
    found: dict[tuple[tuple[str, ...], ...], Conflict] = {}
    for route, proofs in _by_route(program):
        labels = tuple(each.labels for each in proofs)
        first = found.get(labels)
        if first is None:
            places = route_names(program.worked_out, route)
            found[labels] = Conflict(places, 1, proofs)
        else:
            found[labels] = Conflict(first.route, first.routes + 1, first.certificates)
    return tuple(found.values())


def conflicting(program: Program) -> frozenset[str] | None:
    """Labels of which the certificates of all routes are made; None if some route has none."""
    if any(len(part.routes) > MOST_ROUTES for part in program.parts):
        return None
    labels: set[str] = set()
    for _, proofs in _by_route(program):
        if not proofs:
            return None
        labels.update(label for each in proofs for label in each.labels)
    return frozenset(labels)


def _by_route(program: Program) -> Iterator[tuple[int, tuple[Certificate, ...]]]:
    """Routes by flight time within each declaration, with their certificates if it is linear."""
    flight_s, slot_s = program.worked_out.itineraries.flight_time_s, program.question.slot_s
    for part in program.parts:
        linear = traits(part.model).linear
        for entry in np.argsort(flight_s[part.routes], kind="stable")[:MOST_ROUTES].tolist():
            route = int(part.routes[entry])
            if linear:
                yield route, tuple(certificates(part.model, part.model.row(entry), slot_s))
            else:
                yield route, ()


def route_names(worked_out: Network, route: int) -> tuple[str, ...]:
    """Names of the places of an itinerary in the order in which they are reached."""
    legs, names = worked_out.itineraries.legs[route], worked_out.places.names
    flown = [int(leg) for leg in legs if leg != NO_LEG]
    table = worked_out.legs
    return (names[table.start[flown[0]]], *(names[table.end[leg]] for leg in flown))

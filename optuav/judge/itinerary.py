"""Where somebody wants to rest and to hover, and for how long: a plan without its figures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from optuav.mission import Mission
from optuav.plan import Plan, Stage
from optuav.plan.phases import Kind


@dataclass(frozen=True)
class Stop:
    """A stay at one place.

    Parameters
    ----------
    at
        Name of a place: ``"hover"``, a building's, ``"origin"`` or ``"destination"``.
    kind
        ``"rest"`` or ``"hover"``.
    duration_s
        For how long [s], ≥ 0.
    """

    at: str
    kind: Literal["rest", "hover"]
    duration_s: float


@dataclass(frozen=True)
class Itinerary:
    """Stops in order, from origin to destination; the legs between them follow.

    Parameters
    ----------
    mission
        In which it is to be flown.
    stops
        Any number, in order; a building may be visited again.
    """

    mission: Mission
    stops: tuple[Stop, ...]


@dataclass(frozen=True)
class Move:
    """What is taken from a plan: where to go and how long to stay; nothing that can be computed.

    Parameters
    ----------
    kind
        ``"flight"``, ``"hover"`` or ``"rest"``.
    start_place, end_place
        Names of places.
    duration_s
        Of a stay [s]; not read of a leg, where it is computed.
    stated
        Stages of a phase whose figures the user stated; empty otherwise.
    distance_m, peak_speed_m_s
        Of a leg [m], [m/s]; read only where the user stated its figures.
    """

    kind: Kind
    start_place: str
    end_place: str
    duration_s: float = 0.0
    stated: tuple[Stage, ...] = ()
    distance_m: float = 0.0
    peak_speed_m_s: float = 0.0


def moves(subject: Plan | Itinerary) -> list[Move]:
    """The moves of a plan or an itinerary, in order."""
    return list(_planned(subject) if isinstance(subject, Plan) else _between(subject))


def _planned(plan: Plan) -> Iterator[Move]:
    for phase in plan.phases:
        yield Move(
            phase.kind,
            phase.start_place,
            phase.end_place,
            phase.duration_s,
            phase.stages if phase.edited else (),
            phase.distance_m,
            phase.peak_speed_m_s,
        )


def _between(itinerary: Itinerary) -> Iterator[Move]:
    here = "origin"
    for stop in itinerary.stops:
        if stop.at != here:
            yield Move("flight", here, stop.at)
        yield Move(stop.kind, stop.at, stop.at, stop.duration_s)
        here = stop.at
    if here != "destination":
        yield Move("flight", here, "destination")

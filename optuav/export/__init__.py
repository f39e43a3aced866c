"""The course of a plan on Earth: where the UAV flies, hovers and rests, and for how long."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal, NamedTuple

from optuav.presentation.numbers import seconds

NOT_FLOWN = "Computed by optuav. No autopilot has flown this plan: check it before you use it."


class Position(NamedTuple):
    """A point on Earth, its height counted from the mission's z = 0."""

    longitude_deg: float
    latitude_deg: float
    z_m: float
    ellipsoid_m: float | None = None  # Height above the ellipsoid of WGS 84, where a geoid is known


class Step(NamedTuple):
    """A flight along a way, or a stay at its only point."""

    kind: Literal["flight", "hover", "rest"]
    place: str  # Where it ends
    way: tuple[Position, ...]
    duration_s: float
    peak_speed_m_s: float  # 0 in a stay
    level_speeds_m_s: tuple[float, ...] = ()  # Horizontal, of each piece of the way, for autopilots
    tapers_s: float | None = (
        None  # From the begin of a stay until less than the offered current flows
    )


class Flight(NamedTuple):
    """Legs and hovers between a take-off and the next landing."""

    start_place: str
    rested_s: float  # Before the take-off
    steps: tuple[Step, ...]

    @property
    def start(self) -> Position:
        """The place of the take-off, which an autopilot takes as home."""
        return self.steps[0].way[0]

    @property
    def end(self) -> Position:
        """The place of the landing."""
        return self.steps[-1].way[-1]

    @property
    def words(self) -> str:
        """Its ends, and the rest before it."""
        rest = f", after a rest of {seconds(self.rested_s)}" * (self.rested_s > 0.0)
        return f"from {self.start_place} to {self.steps[-1].place}{rest}"


class PlanOnEarth(NamedTuple):
    """A plan on Earth."""

    name: str
    notes: tuple[str, ...]  # `NOT_FLOWN`, and why the plan cannot be flown
    altitude_m: float  # Altitude of z = 0 above mean sea level
    steps: tuple[Step, ...]
    start_place: str

    @property
    def start(self) -> Position:
        """The first place."""
        return self.steps[0].way[0]

    @property
    def flights(self) -> Iterator[Flight]:
        """Yield its flights: a rest ends one, and begins the next."""
        place, rested_s, steps = self.start_place, 0.0, list[Step]()
        for step in self.steps:
            if step.kind != "rest":
                steps.append(step)
                continue
            if steps:
                yield Flight(place, rested_s, tuple(steps))
            place, rested_s, steps = step.place, step.duration_s, []
        if steps:
            yield Flight(place, rested_s, tuple(steps))

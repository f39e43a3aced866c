"""The course of a plan on Earth: where the UAV flies, hovers and rests, and for how long."""

from __future__ import annotations

from typing import Literal, NamedTuple

NOT_FLOWN = "Computed by optuav. No autopilot has flown this plan: check it before you use it."


class Position(NamedTuple):
    """A point on Earth, its height counted from the mission's z = 0."""

    longitude_deg: float
    latitude_deg: float
    z_m: float


class Step(NamedTuple):
    """A flight along a way, or a stay at its only point."""

    kind: Literal["flight", "hover", "rest"]
    place: str  # Where it ends
    way: tuple[Position, ...]
    duration_s: float
    peak_speed_m_s: float  # 0 in a stay


class PlanOnEarth(NamedTuple):
    """A plan on Earth."""

    name: str
    notes: tuple[str, ...]  # `NOT_FLOWN`, and why the plan cannot be flown
    altitude_m: float  # Altitude of z = 0 above mean sea level
    steps: tuple[Step, ...]

    @property
    def start(self) -> Position:
        """The origin."""
        return self.steps[0].way[0]

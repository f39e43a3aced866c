"""What a plan is made of: phases with their stages, and the stops among them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictStr

LARGEST = 1e100
"""Largest number in a plan, so that products stay finite."""

Kind = Literal["flight", "hover", "rest"]
Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Amount = Annotated[float, Field(strict=True, ge=0.0, le=LARGEST)]
Packs = Annotated[tuple[Number, ...], Field(min_length=1)]


class Record(BaseModel):
    """Frozen data of a plan, as it stands in its file."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Stage(Record):
    """A stretch of constant current.

    Parameters
    ----------
    duration_s
        [s], ≥ 0.
    current_A, power_W
        Net, into the battery [A], [W]: negative while they drain it. Where charging tapers, what is
        offered: a full battery takes less.
    """

    duration_s: Amount
    current_A: Number
    power_W: Number


class Phase(Record):
    """A leg, a hover or a rest.

    Parameters
    ----------
    kind
        ``"flight"``, ``"hover"`` or ``"rest"``.
    start_place, end_place
        Names of places; the same while hovering and resting.
    start_s
        When it begins, counted from take-off [s].
    stages
        Its stretches of constant current, in order; at least one.
    distance_m, peak_speed_m_s
        Of a leg [m], [m/s]; 0 otherwise.
    edited
        Whether its figures were stated by the user in a graph.
    available_As, bound_As
        Charge in the wells at its end [A s], one entry a pack; pooled packs count as one.
    """

    kind: Kind
    start_place: StrictStr
    end_place: StrictStr
    start_s: Amount
    stages: Annotated[tuple[Stage, ...], Field(min_length=1)]
    distance_m: Amount
    peak_speed_m_s: Amount
    edited: StrictBool
    available_As: Packs
    bound_As: Packs

    @property
    def duration_s(self) -> float:
        """How long it takes [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def end_s(self) -> float:
        """When it ends, counted from take-off [s]."""
        return self.start_s + self.duration_s

    @property
    def current_A(self) -> float:
        """Mean net current into the battery [A]."""
        return self._mean([stage.current_A for stage in self.stages])

    @property
    def power_W(self) -> float:
        """Mean net power into the battery [W]."""
        return self._mean([stage.power_W for stage in self.stages])

    def _mean(self, values: list[float]) -> float:
        weights = [stage.duration_s for stage in self.stages]
        if not sum(weights):
            return values[0]
        return sum(v * w for v, w in zip(values, weights, strict=True)) / sum(weights)


class Stop(Record):
    """A stay at one place.

    Parameters
    ----------
    kind
        ``"hover"`` or ``"rest"``.
    at
        Name of the place.
    start_s, duration_s
        When, counted from take-off, and for how long [s].
    """

    kind: Literal["hover", "rest"]
    at: str
    start_s: Amount
    duration_s: Amount

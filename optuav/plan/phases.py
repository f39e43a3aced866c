"""Phases of a plan with their stages, its stops, and what the phases do to the battery."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import partial, reduce
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, StrictBool, StrictStr

from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.timeline import carry
from optuav.physics import kibam
from optuav.physics.charging import STEPS

LARGEST = 1e100
"""Largest number in a plan, so that products stay finite."""

ROUNDING = 1e-9
"""Share of the capacity by which rounding may carry a well past its limit [-]."""

Kind = Literal["flight", "hover", "rest"]
Number = Annotated[float, Field(strict=True, ge=-LARGEST, le=LARGEST)]
Amount = Annotated[float, Field(strict=True, ge=0.0, le=LARGEST)]
Packs = Annotated[tuple[Number, ...], Field(min_length=1)]


class Record(BaseModel):
    """Frozen data of a plan, with the same keys as in its file."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Stage(Record):
    """A stage of constant current.

    Parameters
    ----------
    duration_s
        Duration [s], ≥ 0.
    current_A, power_W
        Net, into the battery [A], [W]; negative while the battery drains. Where charging tapers,
        what is offered: a full battery takes less.
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
        Start, counted from take-off [s].
    stages
        Its stages, in order; at least one.
    distance_m, peak_speed_m_s
        Of a leg [m], [m/s]; 0 otherwise.
    edited
        Whether the user stated its figures in a graph.
    available_As, bound_As
        Charge in the wells at its end [A s], one entry per pack; pooled packs count as one.
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
        """Duration [s]."""
        return sum(stage.duration_s for stage in self.stages)

    @property
    def end_s(self) -> float:
        """End, counted from take-off [s]."""
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
        Start, counted from take-off, and duration [s].
    """

    kind: Literal["hover", "rest"]
    at: str
    start_s: Amount
    duration_s: Amount


def runs_dry_s(mission: Mission, phases: Sequence[Phase]) -> float | None:
    """When the available well is empty, or no pack is left to fly on [s]; None if never."""
    if mission.battery.takes_turns:
        return carry(mission, net_stages(phases)).ended_s
    return _first_crossing_s(mission, phases, full=False)


def overfull_s(mission: Mission, phases: Sequence[Phase]) -> float | None:
    """When charging first drives the available well past full [s]; None if it never does."""
    if mission.battery.takes_turns or mission.battery.charging == "taper":
        return None
    return _first_crossing_s(mission, phases, full=True)


def net_stages(phases: Sequence[Phase]) -> Iterator[tuple[Kind, list[kibam.Stage]]]:
    """Kind of every phase, and its stages as the battery model takes them."""
    for phase in phases:
        yield phase.kind, [kibam.Stage(each.current_A, each.duration_s) for each in phase.stages]


def wells_at_ends(
    mission: Mission, phases: Iterable[tuple[Kind, Sequence[kibam.Stage]]]
) -> list[kibam.Wells]:
    """Wells [A s] at the end of every phase, stated as a kind and stages, from full packs.

    Pooled packs are one battery, which may be driven past full unless charging tapers; where packs
    take turns there is one entry per pack.
    """
    if mission.battery.takes_turns:
        return carry(mission, phases).wells
    pool = vehicle.pool(mission)
    wells, ends = pool.full, []
    for _, stages in phases:
        wells = reduce(partial(STEPS[mission.battery.charging], pool), stages, wells)
        ends.append(wells)
    return ends


def _first_crossing_s(mission: Mission, phases: Sequence[Phase], *, full: bool) -> float | None:
    """When y1 first rises above ωB, or else falls below 0 [s]; a stage's end is the extreme."""
    pool = vehicle.pool(mission)
    end_of = STEPS[mission.battery.charging]
    wells, start_s = pool.full, 0.0
    for stage in (stage for phase in phases for stage in phase.stages):
        end = end_of(pool, wells, kibam.Stage(stage.current_A, stage.duration_s))
        level = end.available_As / pool.capacity_As
        if level > pool.available_fraction + ROUNDING if full else level < -ROUNDING:
            crossing_s = kibam.time_to_full if full else kibam.time_to_empty
            return start_s + min(float(crossing_s(pool, wells, stage.current_A)), stage.duration_s)
        wells, start_s = end, start_s + stage.duration_s
    return None

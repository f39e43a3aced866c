"""What the phases of a plan do to the wells of the battery."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial, reduce

from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.timeline import carry
from optuav.physics import kibam
from optuav.physics.charging import STEPS
from optuav.physics.quantity import Quantity
from optuav.plan.phases import Kind, Phase

ROUNDING = 1e-9
"""Share of the capacity by which rounding may carry a well past its limit [-]."""


def runs_dry_s(mission: Mission, phases: Sequence[Phase]) -> float | None:
    """When the available well is empty, or no pack is left to fly on [s]; None if never."""
    if mission.battery.takes_turns:
        return carry(mission, net_stages(phases)).ended_s
    return _first_passing(
        mission, phases, kibam.time_to_empty, lambda level, full: level < -ROUNDING
    )


def overfull_s(mission: Mission, phases: Sequence[Phase]) -> float | None:
    """When charging first drives the available well past full [s]; None if it never does."""
    if mission.battery.takes_turns or mission.battery.charging == "taper":
        return None
    return _first_passing(
        mission, phases, kibam.time_to_full, lambda level, full: level > full + ROUNDING
    )


def net_stages(phases: Sequence[Phase]) -> Iterator[tuple[Kind, list[kibam.Stage]]]:
    """Kind and stages of every phase, as the packs see them."""
    for phase in phases:
        yield (
            phase.kind,
            [kibam.Stage(stage.current_A, stage.duration_s) for stage in phase.stages],
        )


def wells_at_ends(
    mission: Mission, phases: Iterable[tuple[Kind, Sequence[kibam.Stage]]]
) -> list[kibam.Wells]:
    """Wells [A s] at the end of every phase, a kind and stages, from full packs.

    Pooled packs are one battery that takes what it is given, past full too unless charging tapers;
    where packs take turns there is an entry a pack.
    """
    if mission.battery.takes_turns:
        return carry(mission, phases).wells
    pool = vehicle.pool(mission)
    wells, ends = pool.full, []
    for _, stages in phases:
        wells = reduce(partial(STEPS[mission.battery.charging], pool), stages, wells)
        ends.append(wells)
    return ends


def _first_passing(
    mission: Mission,
    phases: Sequence[Phase],
    moment: Callable[[kibam.Battery, kibam.Wells, float], Quantity],
    beyond: Callable[[float, float], bool],
) -> float | None:
    """First moment [s] at which y1/B passes a limit; within a stage an end is the extreme."""
    pool = vehicle.pool(mission)
    charged = STEPS[mission.battery.charging]
    wells, start_s = pool.full, 0.0
    for stage in (stage for phase in phases for stage in phase.stages):
        end = charged(pool, wells, kibam.Stage(stage.current_A, stage.duration_s))
        if beyond(end.available_As / pool.capacity_As, pool.available_fraction):
            return start_s + min(float(moment(pool, wells, stage.current_A)), stage.duration_s)
        wells, start_s = end, start_s + stage.duration_s
    return None

"""The phases of a mission carried by its packs, under their schedule.

A job is a phase. In flight one pack carries the whole load. While hovering it carries the load of
the hover alone, and the laser charges another one; a single pack is charged as it hovers. At rest
the laser charges the emptiest pack. What they are and when one takes over: `optuav.physics.packs`.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from optuav.mission import vehicle
from optuav.mission.phases import Kind
from optuav.mission.schema import Mission
from optuav.physics import kibam
from optuav.physics.packs import Load, Packs, Stretch


class Flown(NamedTuple):
    """What phases do to the packs.

    Parameters
    ----------
    stretches
        For every phase, the stretches in which no pack changes its part.
    wells
        (pack,): charge in the wells at the end of every phase [A s].
    ended_s
        When no pack is left to carry the load [s]; None if that never comes. The packs stay as they
        are from then on.
    """

    stretches: list[list[Stretch]]
    wells: list[kibam.Wells]
    ended_s: float | None


def packs(mission: Mission) -> Packs:
    """The mission's packs, full."""
    given = mission.battery
    pack = kibam.Battery(given.capacity_As, given.available_fraction, given.flow_rate_per_s)
    return Packs(pack, given.packs, given.schedule, given.period_s)


def loads(mission: Mission, kind: Kind, stages: Iterable[kibam.Stage]) -> list[Load]:
    """What is drawn and what is charged in the stages of a phase, from their net currents [A]."""
    drawn_A = 0.0
    if kind != "flight":
        load = vehicle.hover_load(mission) if kind == "hover" else vehicle.rest_load(mission)
        drawn_A = float(load.current_A)
    return [
        Load(drawn_A, net_A + drawn_A, duration_s)
        if kind != "flight"
        else Load(-net_A, 0.0, duration_s)
        for net_A, duration_s in stages
    ]


def fly(mission: Mission, phases: Iterable[tuple[Kind, Iterable[kibam.Stage]]]) -> Flown:
    """Carry phases, each a kind and its stages of net current, from full packs."""
    carried, stretches, wells = packs(mission), [], []
    for kind, stages in phases:
        stretches.append(carried.job(loads(mission, kind, stages)))
        wells.append(kibam.Wells(*(np.array(well[0]) for well in carried.wells)))
    ended_s = float(carried.clock_s[0]) if carried.exhausted[0] else None
    return Flown(stretches, wells, ended_s)

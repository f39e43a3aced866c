"""The table of a simulation: every quantity at moments of every stage."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from optuav.errors import NoPlanError
from optuav.judge.ledger import PERSPECTIVES, ledger, states_of_charge
from optuav.judge.motion import motion
from optuav.judge.phases import Phase, Stage
from optuav.judge.wells import Follower
from optuav.mission import Mission, vehicle
from optuav.physics.battery import Wells
from optuav.plan.trace import Trace

POINTS = 65
"""Moments of a stage, its ends among them."""


def trace(
    mission: Mission,
    phases: Sequence[Phase],
    levels: Sequence[tuple[Wells, ...]],
    follower: Follower,
) -> Trace:
    """Work out the table.

    Parameters
    ----------
    mission
        In which the phases are flown.
    phases
        In order.
    levels
        Wells of every pack [A s] at the start of every stage, and at the end of the last.
    follower
        How the wells are followed in between.

    Raises
    ------
    NoPlanError
        If nothing is flown.
    """
    if not any(phase.duration_s for phase in phases):
        raise NoPlanError("there is no table: nothing is flown")
    pool, book = vehicle.pool(mission), ledger(mission, phases)
    pieces: list[dict[str, Any]] = []
    for number, (place, phase, stage, begun_s) in enumerate(_stages(phases)):
        if stage.duration_s == 0.0:
            continue
        passed_s = np.linspace(0.0, stage.duration_s, POINTS)
        # At its very end the next stage of a leg begins.
        last_s = np.nextafter(begun_s + stage.duration_s, 0.0)
        wells = [follower.at(pool, pack, stage.current_A, passed_s) for pack in levels[number]]
        available_As = np.stack([pack.available_As for pack in wells], axis=1)
        bound_As = np.stack([pack.bound_As for pack in wells], axis=1)
        share = (available_As + bound_As).sum(axis=1) / pool.capacity_As
        drawn = stage.drawn
        constant = {
            "kind": phase.kind,
            "stage": stage.name,
            "phase": place,
            "start_place": phase.start.name,
            "end_place": phase.end.name,
            "current_A": stage.current_A,
            "power_W": stage.power_W,
            "received_power_W": float(stage.received.power_W),
            "voltage_V": drawn.power_W / drawn.current_A
            if drawn.current_A
            else mission.battery.nominal_voltage_V,
        }
        pieces.append(
            {
                "time_s": stage.start_s + passed_s,
                **motion(mission, phase, np.linspace(begun_s, last_s, POINTS))._asdict(),
                **{name: np.full(POINTS, value) for name, value in constant.items()},
                "available_As": available_As,
                "bound_As": bound_As,
                **states_of_charge(book, book.at(number, passed_s), share),
            }
        )
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    soc = {name: columns.pop(name) for name in PERSPECTIVES}
    return Trace(**columns, soc=soc)


def _stages(phases: Sequence[Phase]) -> Iterator[tuple[int, Phase, Stage, float]]:
    """Every stage with its phase, the number of that, and when in it the stage begins [s]."""
    for place, phase in enumerate(phases):
        begun_s = 0.0
        for stage in phase.stages:
            yield place, phase, stage, begun_s
            begun_s += stage.duration_s

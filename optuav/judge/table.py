"""The table of a simulation: every quantity at moments of every stage."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.errors import NoPlanError
from optuav.judge.course import Course, Stretch
from optuav.judge.energies import PERSPECTIVES, Energies, energies, states_of_charge
from optuav.judge.motion import motion
from optuav.judge.phases import Phase, Stage
from optuav.judge.wells import Follower
from optuav.mission import Mission
from optuav.physics.charging import holding_current
from optuav.physics.kibam import Battery
from optuav.plan.trace import Trace

POINTS = 65
"""Moments of a stretch, its ends among them."""


def trace(mission: Mission, phases: Sequence[Phase], course: Course, follower: Follower) -> Trace:
    """Work out the table.

    Parameters
    ----------
    mission
        In which the phases are flown.
    phases
        In order.
    course
        What they do to the packs.
    follower
        How the wells are followed within a stretch.

    Raises
    ------
    NoPlanError
        If nothing is flown.
    """
    if not any(phase.duration_s for phase in phases):
        raise NoPlanError("there is no table: nothing is flown")
    told = energies(mission, phases)
    stages = [stage for phase in phases for stage in phase.stages]
    pieces = [
        _piece(mission, phases[each.phase], stages[each.stage], each, course.pack, told, follower)
        for each in course.stretches
        if each.duration_s > 0.0
    ]
    columns = {name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]}
    soc = {name: columns.pop(name) for name in PERSPECTIVES}
    return Trace(**columns, soc=soc)


def _piece(
    mission: Mission,
    phase: Phase,
    stage: Stage,
    stretch: Stretch,
    pack: Battery,
    told: Energies,
    follower: Follower,
) -> dict[str, Any]:
    """The rows of a stretch."""
    passed_s = np.linspace(0.0, stretch.duration_s, POINTS)
    current_A: Any = sum(stretch.currents_A)
    if stretch.held:
        wells = [follower.held(pack, before, passed_s) for before in stretch.before]
        current_A = sum(holding_current(pack, each) for each in wells)
    else:
        wells = [
            follower.at(pack, before, current, passed_s)
            for before, current in zip(stretch.before, stretch.currents_A, strict=True)
        ]
    available_As = np.stack([each.available_As for each in wells], axis=1)
    bound_As = np.stack([each.bound_As for each in wells], axis=1)
    share = (available_As + bound_As).sum(axis=1) / (len(wells) * pack.capacity_As)
    energies_J = told.at(stretch.stage, stretch.start_s - stage.start_s + passed_s)
    drawn_A, drawn_W = stage.drawn
    constant = {
        "kind": phase.kind,
        "stage": stage.name,
        "phase": stretch.phase,
        "start_place": phase.start.name,
        "end_place": phase.end.name,
        "power_W": stage.power_W,
        "received_power_W": float(stage.received.power_W),
        "voltage_V": drawn_W / drawn_A if drawn_A else mission.battery.nominal_voltage_V,
    }
    return {
        "time_s": stretch.start_s + passed_s,
        **motion(mission, phase, _since_phase(phase, stage, stretch))._asdict(),
        **{name: np.full(POINTS, value) for name, value in constant.items()},
        "current_A": np.zeros(POINTS) + current_A,
        "available_As": available_As,
        "bound_As": bound_As,
        **states_of_charge(told.batteries_J, energies_J, share),
    }


def _since_phase(phase: Phase, stage: Stage, stretch: Stretch) -> Floats:
    """Moments of a stretch since its phase began [s]: at the end of a stage the next one begins."""
    begun_s = 0.0
    for each in phase.stages:
        if each is stage:
            break
        begun_s += each.duration_s
    last_s = np.nextafter(begun_s + stage.duration_s, 0.0)
    start_s = begun_s + (stretch.start_s - stage.start_s)
    return np.clip(start_s + np.linspace(0.0, stretch.duration_s, POINTS), begun_s, last_s)

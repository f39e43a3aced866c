"""Energy drawn and received over the stages of a plan, and the state of charge they make."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from optuav.arrays import Floats
from optuav.judge.phases import Phase
from optuav.mission import Mission
from optuav.network import vehicle

PERSPECTIVES = ("battery", "energy", "adjusted")
"""The perspectives from which the state of charge is told."""


@dataclass(frozen=True)
class Energies:
    """What was drawn in flight, drawn in hover, and gained otherwise, stage by stage.

    Parameters
    ----------
    gains_W
        (stage, 3) power drawn in flight, drawn in hover, and received in hover or gained net at
        rest [W].
    starts_J
        (stage + 1, 3) their integrals at the start of every stage, and at the end of the last [J].
    batteries_J
        What the battery holds at the voltages of flight, of hover, and nominally: E_1, E_2 and
        E_0 [J].
    """

    gains_W: Floats
    starts_J: Floats
    batteries_J: tuple[float, float, float]

    def at(self, stage: int, passed_s: Floats) -> Floats:
        """Energies [J] (moment, 3) at moments after a stage began [s]."""
        energies_J: Floats = self.starts_J[stage] + passed_s[:, None] * self.gains_W[stage]
        return energies_J


def energies(mission: Mission, phases: Sequence[Phase]) -> Energies:
    """Energies over the phases of a plan."""
    stages = [(phase.kind, stage) for phase in phases for stage in phase.stages]
    gains_W = np.array(
        [_gains_W(kind, stage.drawn[1], stage.received[1]) for kind, stage in stages]
    )
    durations_s = np.array([stage.duration_s for _, stage in stages])
    starts_J = np.concatenate([np.zeros((1, 3)), np.cumsum(durations_s[:, None] * gains_W, axis=0)])
    flown_As = sum(
        stage.duration_s * stage.drawn.current_A for kind, stage in stages if kind == "flight"
    )
    hover = vehicle.hover_load(mission)
    given = mission.battery
    B = float(vehicle.pool(mission).capacity_As)
    E_0 = B * given.nominal_voltage_V
    E_1 = given.flight_energy_J or (B * starts_J[-1, 0] / flown_As if flown_As else E_0)
    E_2 = given.hover_energy_J or (B * hover.power_W / hover.current_A if hover.current_A else E_0)
    return Energies(gains_W, starts_J, (float(E_1), float(E_2), E_0))


def _gains_W(kind: str, drawn_W: float, received_W: float) -> tuple[float, float, float]:
    if kind == "flight":
        return drawn_W, 0.0, received_W
    return (0.0, drawn_W, received_W) if kind == "hover" else (0.0, 0.0, received_W - drawn_W)


def states_of_charge(
    batteries_J: tuple[float, float, float], energies_J: Floats, share: Floats
) -> dict[str, Floats]:
    """State of charge by perspective [-].

    Parameters
    ----------
    batteries_J
        E_1, E_2 and E_0 [J].
    energies_J
        (moment, 3) as `Energies.at` has them [J].
    share
        (y1 + y2)/B over all packs [-].
    """
    flight_J, hover_J, gained_J = np.moveaxis(energies_J, -1, 0)
    E_1, E_2, E_0 = batteries_J
    return {
        "battery": share,
        "energy": 1.0 - (flight_J + hover_J - gained_J) / E_0,
        "adjusted": 1.0 - flight_J / E_1 - hover_J / E_2 + gained_J / E_0,
    }

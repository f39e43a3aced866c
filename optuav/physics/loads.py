"""What a flight leg takes and draws, stage by stage, whatever the flight model.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2020, eqs (6)-(7).
"""

from __future__ import annotations

from dataclasses import dataclass

from optuav.physics.quantity import Quantity


@dataclass(frozen=True)
class Loads:
    """What a leg draws in each of its stages.

    Parameters
    ----------
    durations_s
        Duration of every stage [s], one entry a stage, each a scalar or an array over legs; NaN
        where the leg cannot be flown.
    currents_A, powers_W
        Current drawn [A] and power drawn [W], > 0, one entry a stage; a scalar is the same for all
        legs.
    """

    durations_s: tuple[Quantity, ...]
    currents_A: tuple[Quantity, ...]
    powers_W: tuple[Quantity, ...]

    @property
    def duration_s(self) -> Quantity:
        """Flight time of the leg [s]."""
        return sum(self.durations_s)

    @property
    def charge_As(self) -> Quantity:
        """Charge drawn on the leg [A s]."""
        return sum(t * i for t, i in zip(self.durations_s, self.currents_A, strict=True))

    @property
    def energy_J(self) -> Quantity:
        """Energy drawn on the leg [J], [1]_ eq (6)."""
        return sum(t * p for t, p in zip(self.durations_s, self.powers_W, strict=True))

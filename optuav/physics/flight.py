"""Terms that all flight models share: loads of a leg, state on it, flows of charge.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, eqs (6)-(7).
"""

from typing import NamedTuple

import numpy as np

from optuav.physics.quantity import Quantity, Vector, norm
from optuav.presentation.numbers import fixed

FASTEST_WITHOUT_DRAG_M_S = 40.0
"""Peak speed above which the missing drag matters [m/s]; small drones hardly reach it."""


def speed_warning(peak_speed_m_s: float, *, has_drag: bool = False) -> str | None:
    """A sentence on a peak speed [m/s] above 40 m/s without drag; None for others."""
    if has_drag or not peak_speed_m_s > FASTEST_WITHOUT_DRAG_M_S:
        return None
    return f"a peak of {fixed(peak_speed_m_s, 1)} m/s is not realistic: this model has no drag"


class Flow(NamedTuple):
    """Current [A] and power [W]."""

    current_A: Quantity
    power_W: Quantity


class SpeedPower(NamedTuple):
    """Level flight over its air speed, and the speeds that stand out, up to the model's cap."""

    power_W: Quantity  # At the rotors [W]
    drawn: Flow  # From the battery
    hover_power_W: Quantity  # At the rotors, in the wind of the mission [W]
    max_speed_m_s: Quantity  # The cap [m/s]
    # Air speed [m/s] and power at the rotors [W], in air at rest
    best_endurance: tuple[Quantity, Quantity]
    best_range: tuple[Quantity, Quantity]


class Loads(NamedTuple):
    """Draw of legs in their stages; every quantity is a scalar or an array over legs."""

    way_m: Vector  # From start to end [m], components (x, y, z)
    stages: tuple[str, ...]  # Names of the stages in order, the same on all legs
    # Duration of every stage [s], one entry a stage; NaN where the leg cannot be flown.
    durations_s: tuple[Quantity, ...]
    # Current drawn [A] and power drawn [W], > 0, one entry a stage.
    currents_A: tuple[Quantity, ...]
    powers_W: tuple[Quantity, ...]
    peak_speed_m_s: Quantity
    peak_s: Quantity  # Moment of the peak speed since the leg began [s]
    bent_m: Quantity | None = None  # Length of a bent path [m]; None for straight ones

    @property
    def distance_m(self) -> Quantity:
        """Length of the path [m]."""
        return norm(self.way_m) if self.bent_m is None else self.bent_m

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

    @property
    def least_current_A(self) -> Quantity:
        """Smallest current of a stage [A]."""
        return np.minimum.reduce(np.broadcast_arrays(*self.currents_A))


class Attitude(NamedTuple):
    """Attitude of the UAV; its yaw stays 0."""

    # ψ_p = atan2(f_x, f_z) [rad], positive with the nose down, thrust towards +x.
    pitch_rad: Quantity
    roll_rad: Quantity  # ψ_r = asin(f_y) [rad], positive with thrust towards +y


LEVEL = Attitude(0.0, 0.0)


class LegState(NamedTuple):
    """Position and motion on a leg at some moments.

    Without a state, on a leg that cannot be flown or before the leg begins, the stage is 0
    and everything else NaN.
    """

    stage: Quantity  # From 1; one more than there are stages once the leg has ended
    position_m: Vector  # From the start of the leg [m], components
    # Along the path [m/s]: the rate of change of the position, so 0 while the six-stage model
    # freezes the position in a turn and keeps the speed for the next stage.
    speed_m_s: Quantity
    attitude: Attitude  # Pitch and roll [rad]; NaN where the model has none

"""Charging near full: at constant current throughout, or with a second part that tapers.

The available well takes the full current only while y1 < ωB. From then on a tapering charger holds
y1 = ωB and gives what seeps into the bound well, I = ωk'((1−ω)B − y2), so that y2 approaches (1−ω)B
at the rate ωk' = k_F/(1−ω). The current falls from there on and never exceeds that of the first
part: y1 reaches ωB from below, so that no more seeps away than comes in.

*Wells that hold more keep holding more.* Wells y that hold at least as much as wells v, each for
each, do so ever after: y charged like this at the current I, v at any currents up to I that keep
v1 ≤ ωB. While y1 < ωB, the difference y − v obeys w' = A w + (I − u, 0) with no negative entry of A
off the diagonal, so that it stays non-negative. While y1 = ωB ≥ v1, (y2 − v2)' ≥ −ωk' (y2 − v2).
So it is best at every moment to charge at full current first and to hold y1 at ωB then, and nothing
is lost by it later: legs and hovers keep the order as well.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Literal, TypeAlias

import numpy as np

from optuav.physics.kibam import Battery, Stage, Wells, step, time_to_full
from optuav.physics.quantity import Quantity

Charging: TypeAlias = Literal["constant", "taper"]  # Names of the ways to charge

Step: TypeAlias = Callable[[Battery, Wells, Stage], Wells]


def holding_current(battery: Battery, wells: Wells) -> Quantity:
    """Current that keeps y1 where it is [A]: what seeps into the bound well."""
    share = battery.available_fraction
    return battery.flow_rate_per_s * (wells.available_As / share - wells.bound_As / (1.0 - share))


def held(battery: Battery, wells: Wells, duration_s: Quantity) -> Wells:
    """Wells [A s] after a duration [s], ≥ 0, in which y1 is held where it is."""
    share = battery.available_fraction
    gained = -np.expm1(-battery.flow_rate_per_s / (1.0 - share) * duration_s)
    level = (1.0 - share) / share * wells.available_As
    return Wells(wells.available_As, wells.bound_As + (level - wells.bound_As) * gained)


def tapered(battery: Battery, wells: Wells, stage: Stage) -> Wells:
    """Wells [A s] after a stage whose current tapers once y1 = ωB; floats and arrays.

    At the start y1 ≤ ωB and y2 ≤ (1−ω)B. The current of the stage is what the charger offers, less
    what is drawn.
    """
    steady_s = np.minimum(stage.duration_s, time_to_full(battery, wells, stage.current_A))
    steady = step(battery, wells, Stage(stage.current_A, steady_s))
    return held(battery, steady, stage.duration_s - steady_s)


STEPS: Mapping[Charging, Step] = {"constant": step, "taper": tapered}
"""What a stage does to the wells, by name; at constant current y1 may exceed ωB."""

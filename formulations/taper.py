"""Wells after a stay in which charging tapers: constant current until y1 = ωB, then y1 is held.

At constant current throughout, neither well would hold less (`optuav.physics.charging`), and both
would hold the same if y1 stayed below ωB. That, and what they hold when full, bounds what a stay
leaves in a form that engines take.
"""

from __future__ import annotations

from typing import Any

from optuav.modelling import Expression
from optuav.modelling.expression import Bounded, Call
from optuav.physics import charging
from optuav.physics.kibam import Battery, Stage, Wells, step


def tapered(whole: Battery, level: Wells, phase: Stage, stay: str) -> Wells:
    """Wells after a stay, in numbers or symbols."""
    if not isinstance(phase.duration_s, Expression):
        return charging.tapered(whole, level, phase)
    constant, full = step(whole, level, phase), whole.full
    battery = whole.capacity_As, whole.available_fraction, whole.flow_rate_per_s
    operands = constant.available_As, full.available_As, *level, *phase, *battery
    words = f"the {stay} that tapers"
    return Wells(
        *(
            Call(Bounded(words, value), (well, most, *operands))
            for value, well, most in zip((_available, _bound), constant, full, strict=True)
        )
    )


def _wells(y1: Any, y2: Any, current: Any, time: Any, *battery: Any) -> Wells:
    return charging.tapered(Battery(*battery), Wells(y1, y2), Stage(current, time))


def _available(*operands: Any) -> Any:
    return _wells(*operands).available_As


def _bound(*operands: Any) -> Any:
    return _wells(*operands).bound_As

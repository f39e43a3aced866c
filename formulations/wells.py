"""State of charge through both wells, step by step: [1] eqs (11)-(16) in Δ and T'.

The same problems as with charge balance, and the same optimum, since y1 + y2 changes by I t
whatever the wells do; but smooth in Δ and T', for engines that take such models.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from formulations.named_wells import named
from formulations.pool import pool
from formulations.quantities import Quantities
from formulations.taper import tapered
from optuav.physics import kibam


def levels(given: Quantities, hover: Any, rest: Any) -> Sequence[tuple[Any, kibam.Wells]]:
    """Every step of the itinerary with the wells after it, from a full battery.

    The same times give the same trees, so that several constraints share them.
    """
    known = given.known_levels
    if not any(h is hover and r is rest for h, r, _ in known):
        known.append((hover, rest, list(_levels(given, hover, rest))))
    return next(steps for h, r, steps in known if h is hover and r is rest)


def _levels(given: Quantities, hover: Any, rest: Any) -> Iterator[tuple[Any, kibam.Wells]]:
    whole = pool(given)
    stays = {
        "hover": kibam.Stage(-given.hover_current_A, hover),
        "rest": kibam.Stage(given.rest_current_A, rest),
    }
    level: Any = whole.full
    for number, step in enumerate(given.steps, start=1):
        phase = stays[step] if isinstance(step, str) else step
        if isinstance(step, str) and given.tapers:
            level = tapered(whole, level, phase, step)
            words = f"after the {step}, whose current tapers once y1 = ωB"
        else:
            change = (
                phase if isinstance(phase, kibam.Transition) else kibam.transition(whole, phase)
            )
            level = kibam.along(whole, level, change)
            words = "by eqs (15)-(16), a stage of flight" if isinstance(step, kibam.Stage) else ""
        level = named(level, number, words)
        yield step, level


def wells(given: Quantities, hover: Any, rest: Any) -> Any:
    """(y1 + y2)/B after the steps of the itinerary, from a full battery, as far as it tapers."""
    *_, (_, last) = levels(given, hover, rest)
    return kibam.state_of_charge(pool(given), last)

"""One key at a time: how far the longest hover moves, and at which rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from formulations.perspectives import AVAILABLE
from formulations.quantities import QUANTITIES
from optuav.engines import closed_form
from optuav.engines.solution import Solution
from optuav.mission.sight import Points
from optuav.solving import formulate
from optuav.studies.uncertain.ensemble import Base, Ensemble
from optuav.studies.uncertain.longest import longest
from optuav.studies.uncertain.spread import Spread

PLACE = frozenset(
    {
        "hover_distance_m",
        "coverage_radius_m",
        "hover_altitude_m",
        "min_altitude_m",
        "max_altitude_m",
        "end_gap_m",
    }
)
"""Quantities of constraints in which no time occurs."""
STEP = 1e-5
"""Relative step of the derivatives of parameters by keys."""


@dataclass(frozen=True)
class Effect:
    """What one key does to the longest hover, everything else held.

    Parameters
    ----------
    key, unit
        Its name and unit.
    now, low, high
        Its value, and the range that is looked at.
    hover_low_s, hover_high_s
        Longest hover at the ends of the range [s]; None without a plan.
    elasticity
        Percent of hover time by one percent of the key, as a mean over the range; None where an
        end has no plan, or the value is 0.
    exact_elasticity
        The same at the value itself: shadow prices times derivatives of the parameters; None where
        the prices differ between the two sides, or there are none.
    along
        Keys that change by the same factor.
    """

    key: str
    unit: str
    now: float
    low: float
    high: float
    hover_low_s: float | None
    hover_high_s: float | None
    elasticity: float | None
    exact_elasticity: float | None
    along: tuple[str, ...] = ()

    def swing_s(self, hover_time_s: float) -> float:
        """How far the hover time moves at most [s]; without a plan it is lost."""
        ends = (self.hover_low_s or 0.0, self.hover_high_s or 0.0)
        return max(abs(end - hover_time_s) for end in ends)


def effects(
    base: Base, spreads: Sequence[Spread], perspective: str, hover_time_s: float
) -> tuple[Effect, ...]:
    """Effects of keys, the largest first.

    Parameters
    ----------
    base
        The mission.
    spreads
        Ranges of the keys.
    perspective
        How the state of charge is written.
    hover_time_s
        The longest hover of the mission as it stands [s].
    """
    ends = np.array([[each.low, each.high] for each in spreads]).reshape(-1)
    hover_s = longest(_apart(base, spreads, ends, 2), perspective).hover_time_s.reshape(-1, 2)
    exact = _exact(base, spreads, perspective)
    found = [
        _effect(spread, low_s, high_s, hover_time_s, rate)
        for spread, (low_s, high_s), rate in zip(spreads, hover_s.tolist(), exact, strict=True)
    ]
    return tuple(sorted(found, key=lambda each: -each.swing_s(hover_time_s)))


def _effect(
    spread: Spread, low_s: float, high_s: float, hover_time_s: float, rate: float | None
) -> Effect:
    key = spread.key
    known = np.isfinite(low_s + high_s) and key.now != 0.0 and hover_time_s > 0.0
    slope = (high_s - low_s) / (spread.high - spread.low)
    share = key.now / hover_time_s if hover_time_s > 0.0 else 0.0
    return Effect(
        key.name,
        key.unit,
        key.now,
        spread.low,
        spread.high,
        low_s if np.isfinite(low_s) else None,
        high_s if np.isfinite(high_s) else None,
        float(slope * share) if known else None,
        None if rate is None or key.now == 0.0 or hover_time_s <= 0.0 else float(rate * share),
        tuple(other.name for other in spread.along),
    )


def _apart(base: Base, spreads: Sequence[Spread], values: Points, each: int) -> Ensemble:
    """Variants in which one key alone differs, `each` of them a key."""
    columns: dict[str, Points] = {}
    for number, spread in enumerate(spreads):
        own = slice(each * number, each * (number + 1))
        for name, column in spread.columns(values[own]):
            now = next(k.now for k in (spread.key, *spread.along) if k.name == name)
            columns.setdefault(name, np.full(len(values), now))[own] = column
    return Ensemble(base, columns)


def _exact(base: Base, spreads: Sequence[Spread], perspective: str) -> list[float | None]:
    """Rates dΔ/dkey [s per unit] by the chain rule over the parameters of the winning programme."""
    nothing: list[float | None] = [None] * len(spreads)
    if perspective == AVAILABLE or not spreads:
        return nothing
    program = formulate(base.mission, "P1", perspective=perspective)
    solutions = [closed_form.solve(part.model, len(part.routes)) for part in program.parts]
    chosen = program.best(solutions) if solutions else None
    if chosen is None:
        return nothing
    number, entry = chosen
    part = program.parts[number]
    price = _prices(solutions[number], entry)
    steps = np.array([STEP * (abs(each.key.now) or each.high - each.low) for each in spreads])
    now = np.array([each.key.now for each in spreads])
    values = np.stack([now - steps, now + steps], axis=1).reshape(-1)
    variants = np.arange(len(values))
    route = np.full(len(values), part.routes[entry])
    rests = len(part.model.variables) > 1
    given = _apart(base, spreads, values, 2).quantities(variants, route, rests=rests)
    rates: list[float | None] = []
    for k, step in enumerate(steps.tolist()):
        rate: float | None = 0.0
        for name, (less, more) in price.items():
            column = np.broadcast_to(getattr(given, name), len(values))[2 * k : 2 * k + 2]
            slope = float(column[1] - column[0]) / (2.0 * step)
            if slope == 0.0 or rate is None:
                continue
            alike = np.isclose(less, more, rtol=1e-6, atol=1e-9)
            rate = rate + slope * more if alike and np.isfinite(slope) else None
        rates.append(rate)
    return rates


def _prices(solution: Solution, entry: int) -> Mapping[str, tuple[float, float]]:
    """Shadow prices of the winner's own programme, on either side.

    Where the hover point lies is no choice: it is always on the rim of what is covered.
    """
    found = solution.shadow_prices(entry)
    return {
        name: (found[name].less, found[name].more)
        for name in (each.name for each in QUANTITIES)
        if name in found and name not in PLACE
    }

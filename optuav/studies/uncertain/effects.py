"""One key at a time: how far the longest hover moves, and at which rate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from formulations.p1 import P1
from formulations.perspectives import AVAILABLE
from formulations.quantities import steps_for
from optuav.arrays import Floats
from optuav.engines import bracket, closed_form
from optuav.engines.sensitivity import ShadowPrice
from optuav.modelling import Model
from optuav.studies.uncertain.ensemble import Base, Ensemble
from optuav.studies.uncertain.longest import best_itineraries, longest
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
"""Quantities of constraints in which no time occurs: where the hover point lies is no choice, it is
always on the rim of what is covered."""
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
    exact_less, exact_more
        The same at the value itself, below it and above: shadow prices times derivatives of the
        parameters. They differ at a kink, as where itineraries tie and another one is the best on
        either side; None where there is no such rate.
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
    exact_less: float | None
    exact_more: float | None
    along: tuple[str, ...] = ()

    @property
    def has_kink(self) -> bool:
        """Whether the hover time has another exact rate below the value than above."""
        if self.exact_less is None or self.exact_more is None:
            return self.exact_less is not self.exact_more
        return ShadowPrice(self.exact_less, self.exact_more).has_kink

    @property
    def exact_elasticity(self) -> float | None:
        """The exact rate where it is the same on both sides; None at a kink or without one."""
        return None if self.has_kink else self.exact_more

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
        _effect(spread, low_s, high_s, hover_time_s, rates)
        for spread, (low_s, high_s), rates in zip(spreads, hover_s.tolist(), exact, strict=True)
    ]
    return tuple(sorted(found, key=lambda each: -each.swing_s(hover_time_s)))


def _effect(
    spread: Spread, low_s: float, high_s: float, hover_time_s: float, rates: ShadowPrice
) -> Effect:
    key = spread.key
    known = np.isfinite(low_s + high_s) and key.now != 0.0 and hover_time_s > 0.0
    slope = (high_s - low_s) / (spread.high - spread.low)
    share = key.now / hover_time_s if hover_time_s > 0.0 else 0.0
    exact = [rate * share if np.isfinite(rate) and share else None for rate in rates]
    return Effect(
        key.name,
        key.unit,
        key.now,
        spread.low,
        spread.high,
        low_s if np.isfinite(low_s) else None,
        high_s if np.isfinite(high_s) else None,
        float(slope * share) if known else None,
        exact[0],
        exact[1],
        tuple(other.name for other in spread.along),
    )


def _apart(base: Base, spreads: Sequence[Spread], values: Floats, each: int) -> Ensemble:
    """Variants in which one key alone differs, `each` of them a key."""
    columns: dict[str, Floats] = {}
    for number, spread in enumerate(spreads):
        own = slice(each * number, each * (number + 1))
        for name, column in spread.columns(values[own]):
            now = next(k.now for k in (spread.key, *spread.along) if k.name == name)
            columns.setdefault(name, np.full(len(values), now))[own] = column
    return Ensemble(base, columns)


def _exact(base: Base, spreads: Sequence[Spread], perspective: str) -> list[ShadowPrice]:
    """Rates dΔ/dkey [s per unit] on both sides; NaN where there are none.

    Each of the itineraries that tie has its own. Below the value the one with the lowest rate is
    the best, above it the one with the highest.
    """
    if not spreads:
        return []
    as_it_stands = _apart(base, spreads[:1], np.array([spreads[0].key.now]), 1)
    tied = best_itineraries(as_it_stands, perspective)
    if not len(tied):
        return [ShadowPrice(np.nan, np.nan)] * len(spreads)
    sides = np.array([_rates(base, spreads, perspective, each) for each in tied.tolist()])
    less, more = sides[:, 0].min(axis=0), sides[:, 1].max(axis=0)
    return [ShadowPrice(*each) for each in zip(less.tolist(), more.tolist(), strict=True)]


def _rates(base: Base, spreads: Sequence[Spread], perspective: str, itinerary: int) -> Floats:
    """dΔ/dkey of one itinerary below and above (2, key), by the chain rule over its parameters.

    Of every key there are three variants: a step below its value, as it stands, a step above. One
    parameter that the key moves may have another price on either side; where two have, their prices
    do not tell what both together are worth, which makes NaN.
    """
    now = np.array([each.key.now for each in spreads])
    steps = np.array([STEP * (abs(each.key.now) or each.high - each.low) for each in spreads])
    values = (now[:, None] + steps[:, None] * [-1.0, 0.0, 1.0]).reshape(-1)
    model = _model(_apart(base, spreads, values, 3), itinerary, perspective)
    engine = bracket if perspective == AVAILABLE else closed_form
    prices = engine.solve(model, 1, model.row(1)).shadow_prices()
    rates, kinks = np.zeros((2, len(spreads))), np.zeros(len(spreads))
    for name in prices.keys() - PLACE:
        figure = np.broadcast_to(model.parameters[name].value, len(values))
        below, _, above = figure.reshape(-1, 3).T
        slopes = (above - below) / (2.0 * steps)
        less, more = prices[name]
        sides = np.where(slopes > 0.0, [[less], [more]], [[more], [less]])
        with np.errstate(invalid="ignore"):
            rates += np.where(slopes == 0.0, 0.0, slopes * sides)
        kinks += prices[name].has_kink & (slopes != 0.0)
    return np.where(kinks > 1, np.nan, rates)


def _model(ensemble: Ensemble, itinerary: int, perspective: str) -> Model:
    """(P1) of one itinerary in all variants, in which the stages of flight are parameters too."""
    variants = np.arange(ensemble.count)
    given = ensemble.quantities(
        variants,
        np.full_like(variants, itinerary),
        rests=bool(ensemble.base.worked_out.routes.building[itinerary] >= 0),
        steps=perspective == AVAILABLE,
    )
    return P1.model(replace(given, steps=steps_for(given.steps, varies=True)), perspective)

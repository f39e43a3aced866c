"""Conditions on figures, and on itineraries that are flown."""

import math
from collections.abc import Iterable

from optuav.exercises.task import Condition, Conditions
from optuav.judge import Itinerary, audit
from optuav.presentation.numbers import figure, percent, seconds, significant

ROUNDED = 0.01  # Relative distance from the truth that rounding may explain
NEAR_MISTAKE = 0.1  # Relative distance from a usual mistake that counts as this mistake
FACTORS = {100.0: "a factor of 100", 1000.0: "a factor of 1000"}
FACTORS_OF_UNITS = {
    "s": {60.0: "minutes for seconds", 3600.0: "hours for seconds"},
    "A s": {3600.0: "ampere-hours for ampere-seconds"},
}


def titled(title: str, conditions: Iterable[Condition]) -> Conditions:
    """Yield conditions whose words begin with a title."""
    for condition in conditions:
        yield condition._replace(words=f"{title}: {condition.words}")


def is_close(value: float, other: float, within: float) -> bool:
    """Whether two figures agree within an amount, with room for the last digits."""
    return math.isfinite(other) and abs(value - other) <= within * (1.0 + 1e-9)


def equals(
    value: float, truth: float, within: float, unit: str, hint: str, *mistakes: tuple[float, str]
) -> Conditions:
    """Yield whether a figure is the true one, within an amount; usual mistakes have own hints."""
    right = is_close(value, truth, within)
    for mistake, words in mistakes:
        made = is_close(value, mistake, min(within, NEAR_MISTAKE * abs(mistake)))
        yield Condition(right or not made, "a common mistake", words)
    words, reason = _missed(value, truth, within, unit)
    yield Condition(right, words, reason or hint)


def _missed(value: float, truth: float, within: float, unit: str) -> tuple[str, str]:
    """Return how a figure misses the truth, and a hint where rounding or a unit explains it."""
    near = ROUNDED * abs(truth)
    if is_close(value, truth, near) or value in {round(truth), significant(truth, 2)} - {0}:
        hint = f"keep all digits until the end, and answer within {figure(within, 3)} {unit}"
        return f"close, but not within {figure(within, 3)} {unit}: it looks rounded", hint
    for factor, words in (FACTORS | FACTORS_OF_UNITS.get(unit, {})).items():
        if is_close(value * factor, truth, near) or is_close(value / factor, truth, near):
            return f"off by {words}", f"the unit is {unit}"
    if is_close(-value, truth, within):
        return "the sign is wrong", ""
    return f"{figure(value)} {unit} is too {'large' if value > truth else 'small'}", ""


def within(name: str, value: float, wanted: float, by: float, unit: str, hint: str) -> Condition:
    """Return whether a quantity of a witness has the wanted value, within an amount."""
    holds = abs(value - wanted) <= by
    side = "" if holds or math.isnan(value) else ", too much" if value > wanted else ", too little"
    words = f"{name} is {figure(value)} {unit}{side}"
    hint = f"{figure(wanted)} ± {figure(by, 3)} {unit} is required; {hint}"
    return Condition(holds, words, hint, None, True)


def flown(itinerary: Itinerary, rests: int = 1) -> Conditions:
    """Yield whether an itinerary can be flown, and rests so often at most."""
    audited = audit(itinerary)
    if not audited:
        events = audited.replay.violations if audited.replay else audited.events
        words = f"it cannot be flown: at {seconds(events[0].time_s, 1)} {events[0].words}"
        yield Condition(False, words, "optuav.audit(itinerary) lists all violations")
    count = sum(stop.kind == "rest" for stop in itinerary.stops)
    words = f"it can be flown, but has {count} rest{'s' * (count != 1)}"
    yield Condition(count <= rests, words, f"the most rests allowed: {rests}")


def longest(itinerary: Itinerary, best_s: float, least: float, rests: int = 1) -> Conditions:
    """Yield whether an itinerary can be flown, and hovers for a share of the longest time."""
    yield from flown(itinerary, rests)
    hover_s = sum(stop.duration_s for stop in itinerary.stops if stop.kind == "hover")
    share = hover_s / best_s
    reached = math.floor(1000.0 * share + 1e-6) / 1000.0  # 98.96 % is less than 99 %, and reads so
    words = f"it can be flown, and hovers for {percent(reached, 1)} of the longest time"
    hint = f"at least {percent(least)} are required"
    yield Condition(share >= least, words, hint, min(share, 1.0), True)

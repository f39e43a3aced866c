"""Numbers and prices of an explanation in words."""

from __future__ import annotations

import math
import re

from optuav.diagnosis.findings import Findings
from optuav.diagnosis.parameter_prices import Price
from optuav.presentation.numbers import figure, with_unit

UNIT_NAMES = {"s": "second", "m": "metre", "A": "ampere", "W": "watt", "V": "volt", "J": "joule"}
NOUNS = {
    "battery.capacity_As": "capacity of a pack",
    "battery.available_fraction": "available share",
    "battery.flow_rate_per_s": "flow between the wells",
    "limits.min_soc": "charge to be left",
    "limits.deadline_s": "deadline",
    "flight_charge_As": "charge for the flights",
    "flight_time_s": "flight time",
    "hover_current_A": "current in hover",
    "rest_current_A": "current at rest",
}
"""Parameters in words, by the mission's key or their own name."""
LABELLED = (
    (r"^P\d+(-\w+)?\.\w (?=hover time$)", "range of the "),
    (r"^P\d+(-\w+)?\.\w ", ""),
    (r"^state of charge$", "charge left"),
    (r"^not (?=past full)", "available well not "),
    (r"^not dry", "available well not empty"),
    (r"^bounds of Δ$", "hover time ≥ 0"),
    (r"^bounds of T'$", "rest time ≥ 0"),
)
"""Words in place of parts of the paper's labels."""
UNDECIDED = (
    "with one rest and one hover in one piece the hover time stays the same; with more stops it "
    "may change"
)


def key_of(price: Price) -> str:
    """The mission's key of a parameter, or its own name."""
    return price.key or price.name


def symbol_and_value(price: Price) -> str:
    """The symbol of a parameter and its present value."""
    return f"{price.symbol} = {with_unit(price.value, price.unit)}"


def constraint_words(label: str) -> str:
    """The label of a constraint without the paper's number and symbols."""
    for pattern, words in LABELLED:
        label = re.sub(pattern, words, label)
    return label


def gain_figure(value: float, digits: int = 6) -> str:
    """A change with its sign; words without a plan or without such a value."""
    if not math.isfinite(value):
        return "no plan" if math.isinf(value) else "end of the range"
    return "+" * (value > 0.0) + figure(value, digits)


def price_words(explained: Findings, price: Price) -> str:
    """For example: one more second of the deadline gives 0.102 s of hover."""

    def change(value: float) -> str:
        if not math.isfinite(value):
            return "leaves no plan" if math.isinf(value) else "is beyond the range"
        if value == 0.0:
            return "changes nothing"
        gain = "gives" if explained.sense == "maximise" else "saves"
        verb = gain if (value > 0.0) == (explained.sense == "maximise") else "costs"
        return f"{verb} {figure(abs(value), 3)} {explained.objective}"

    unit = "" if price.unit == "1" else price.unit
    more = f"one more {UNIT_NAMES.get(unit, unit)}".rstrip()
    if price.step != 1.0:
        more = f"{price.step:g} {unit}".rstrip() + " more"
    noun = NOUNS.get(key_of(price))
    if landing := re.fullmatch(r"landing_(\d)_(As|J)", key_of(price)):
        flights = [phase for phase in explained.plan.phases if phase.kind == "flight"]
        place = flights[int(landing[1]) - 1].end_place
        noun = f"draw up to the {'hover point' if place == 'hover' else f'landing at {place}'}"
    more = f"{more} of {f'the {noun}' if noun else key_of(price)}"
    more = "one more pack" if price.key == "battery.packs" else more
    less = f", as much less {change(price.loss)}" if price.has_kink else ""
    return f"{more} {change(price.gain)}{less}"

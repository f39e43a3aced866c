"""An explanation in words: verdict, route, limits, what one more of a number is worth."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import NamedTuple

from formulations.soc import LABELS, StepEnd
from optuav.diagnosis.findings import ConstraintAtOptimum, Findings
from optuav.diagnosis.parameter_prices import Price
from optuav.mission import Mission
from optuav.modelling import Constraint
from optuav.modelling.check import evaluated
from optuav.network.network import Network
from optuav.network.places import laser_reach, on_landing
from optuav.plan import Plan
from optuav.plan.plane import ROLES, kind_of
from optuav.presentation.numbers import amperes, figure, percent, seconds, with_unit
from optuav.solving import Program
from optuav.solving.program import route_model_of

LIMIT_NOUNS = {"state of charge": "charge", "deadline": "the deadline"}
LIMIT_NOUNS |= dict.fromkeys(LABELS, "the available well")
"""Nouns for binding limits, by the kind of the constraint."""
LIMITS_BY_KEY = {
    "limits.deadline_s": "the deadline",
    "limits.min_altitude_m": "the lowest altitude",
    "limits.max_altitude_m": "the highest altitude",
}
STATED = re.compile(rf"({'|'.join(map(re.escape, LIMITS_BY_KEY))}) = ")
IN_BRACKETS = re.compile(r" \([a-z_]+\.[\w., ]+\)$")
WHY_NOT_EVEN_FLOWN = {
    "deadline": "the deadline is shorter than the flight",
    "state of charge": "the battery is too small even for the flight",
    **dict.fromkeys(LABELS, "the available well does not last even for the flight"),
}
"""Reasons why even the flight cannot be made, by the kind of the broken constraint."""
SYMBOLS = {"charge": "η ≥ η₀", "deadline": "Δ + T′ ≤ T_max − T_fl"}
SYMBOLS |= {"dry": "y₁ ≥ 0", "overfull": "y₁ ≤ ωB"}
"""Limits in symbols, by role."""
SEEN_S = 0.005  # Gain that two decimals show [s]
STEPS_IN_WORDS = {
    "battery.packs": "one more pack",
    "limits.deadline_s": "one more second of deadline",
}
SAME_SHARE = 1e-6  # Largest relative difference of equal times or charges
UNIT_NAMES = {"s": "second", "m": "metre", "A": "ampere", "W": "watt", "V": "volt", "J": "joule"}
PARAMETER_NOUNS = {
    "battery.packs": "number of packs",
    "body.mass_kg": "mass of the drone",
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
MAY_CHANGE = (
    "with one rest and one hover in one piece the hover time stays the same; with more stops it "
    "may change"
)


class Conclusion(NamedTuple):
    """A plan in one sentence: hover time, whether the plan flies, why not."""

    promise: str  # Such as "719.54 s of hover promised"; empty without a plan
    event: str  # Such as "falls at 1095 s"
    reason: str
    good: bool

    def __str__(self) -> str:
        mark = "✓" if self.good else "✕"
        return "; ".join(filter(None, [self.promise, f"{mark} {self.event}"])) + (
            f": {self.reason}" if self.reason else ""
        )


def verdict(plan: Plan, broken: Iterable[str] = ()) -> Conclusion:
    """Return the verdict; broken are the kinds of constraints that even the flight breaks."""
    if not plan:
        causes = [WHY_NOT_EVEN_FLOWN[kind] for kind in broken if kind in WHY_NOT_EVEN_FLOWN]
        reason = (
            causes[0] if causes else IN_BRACKETS.sub("", plan.reasons[0] if plan.reasons else "")
        )
        return Conclusion(
            "", "no plan", STATED.sub(lambda m: f"{LIMITS_BY_KEY[m[1]]} of ", reason), False
        )
    hover = f"{seconds(plan.hover_time_s)} of hover"
    if not plan.hover_time_s:  # as on the shortest trip
        hover = f"{seconds(plan.mission_time_s)} of travel"
    if plan.flyable is not False:
        return Conclusion(hover, "flies" if plan.flyable else "not simulated", "", True)
    event, reason = "cannot be flown", next(iter(plan.faults), "")
    if (dry_s := plan.runs_dry_s) is not None:
        turns = plan.mission.battery.takes_turns
        event = f"falls at {seconds(dry_s, 0)}"
        reason = "no pack is left to fly on" if turns else "the available well is empty"
    elif (full_s := plan.overfull_s) is not None:
        event = f"overfills at {seconds(full_s, 0)}"
        reason = "the available well is full and accepts less than the plan assumes"
    return Conclusion(f"{hover} promised", event, reason, False)


def route(plan: Plan) -> str:
    """The stops in order, such as "Rest 392.1 s at b1, then hover."."""
    stays = list[str]()
    for kind, stops in groupby(plan.stops if plan else (), lambda stop: stop.kind):
        if kind == "hover" and plan.mission.devices:
            *others, last = (str(stop.at) for stop in stops)
            stays.append(f"hover over {', '.join(others)}{' and ' * bool(others)}{last}")
            continue
        for stop in stops:
            lasts = seconds(stop.duration_s, 1)
            rest = f"pass by {stop.at}" if lasts == "0.0 s" else f"rest {lasts} at {stop.at}"
            stays.append(rest if kind == "rest" else "hover")
    words = ", then ".join(stays) if len(stays) > 1 else "".join(stays) + " without a rest"
    return sentence(words) if stays else ""


def header(program: Program, explained: Findings) -> dict[str, object]:
    """Return all that stands above the pictures of a plan, as plain data."""
    plan = explained.plan
    said = verdict(plan, () if plan else _broken(program, plan))
    stops = plan.stops if plan else ()
    times = {"hover_s": "hover_time_s", "rest_s": "rest_time_s", "time_s": "mission_time_s"}
    return {
        **said._asdict(),
        "text": str(said),
        **{key: getattr(plan, name) if plan else None for key, name in times.items()},
        "stops": [(stop.kind, stop.at) for stop in stops],
        "binds": binding(explained),
        "route": route(plan),
        "worth": gains_in_words(explained),
    }


def _broken(program: Program, plan: Plan) -> list[str]:
    """The kinds of constraints that even the flight breaks; none if nothing can be flown."""
    if not program.parts:
        return []
    part, entry = route_model_of(program, plan)
    model = part.model
    still = dict.fromkeys((variable.name for variable in model.variables), 0.0)
    rows = evaluated(model, {**model.row(entry), **still})
    return [row.constraint.kind for row in rows if not row.satisfied]


def limit(kind: str, moment: object, way: Sequence[str], label: str = "") -> str:
    """A limit in words, with its moment for a well; its label if it has no words."""
    if kind == "state of charge":
        return f"charge left {when(moment, way)}" if isinstance(moment, StepEnd) else "charge left"
    if kind not in LABELS or not isinstance(moment, StepEnd):
        return {"deadline": "deadline"}.get(kind, label)
    return f"available well {'empty' if kind == 'dry' else 'past full'} {when(moment, way)}"


def when(moment: StepEnd, way: Sequence[str]) -> str:
    """The end of a step in words, with the places of the route."""
    if moment.stay:
        over = f" over {way[moment.flight]}" if moment.hover and way else ""
        return f"after the {moment.stay}{over}"
    if not way:
        verb = "on landing at" if moment.lands else "in flight to"
        return f"{verb} the end of flight {moment.flight}"
    place = way[moment.flight]
    if moment.lands:
        return on_landing(place, hovers=moment.ahead == "hover" or place == "hover")
    names = {"hover": "the hover point", "destination": "the destination"}
    return f"in flight to {names.get(place, place)}"


class Curve(NamedTuple):
    """A limit in a plane: its role, its words in two lengths, and its symbols."""

    role: str
    words: str
    short: str
    symbol: str


def curve(constraint: Constraint, way: Sequence[str], mission: Mission) -> Curve:
    """Return what stands beside a limit in the plane; no words for the bounds of times."""
    kind, moment, limits = kind_of(constraint), constraint.moment, mission.limits
    role = ROLES.get(kind, "bounds")
    words = {
        "charge": f"charge left: {percent(limits.min_soc)}",
        "deadline": f"deadline: {figure(limits.deadline_s)} s",
    }.get(role, constraint.label if kind != "bounds" else "")
    short = words.partition(":")[0]
    if isinstance(moment, StepEnd) and role == "charge":
        words = short = f"{words} {when(moment, way)}"
    if isinstance(moment, StepEnd) and kind in LABELS:
        words = f"{'empty' if kind == 'dry' else 'too full'} {when(moment, way)}"
        short = words.replace("on landing ", "").replace("at the destination", "at the end")
    return Curve(role, words, short, SYMBOLS.get(role, ""))


def sentence(words: str) -> str:
    """Return words as a sentence, none for none; a symbol of a user's problem keeps its case."""
    if not words:
        return ""
    first, *_ = words.split(" ")
    return f"{first if len(first) == 1 else first[0].upper() + first[1:]}{words[len(first) :]}."


def binding(explained: Findings) -> str:
    """Say which limits bind and which do not; empty where that is not known."""
    kinds = {side.kind for side in explained.constraints if side.kind in LIMIT_NOUNS}
    binding_sides = [side for side in explained.constraints if side.binds]
    tight = {side.kind for side in binding_sides}
    if not kinds:
        return ""
    named = ((kind, side) for kind in LIMIT_NOUNS for side in binding_sides if side.kind == kind)
    binds = [*dict.fromkeys(_landed(side) or LIMIT_NOUNS[kind] for kind, side in named)]
    of_problem = [side for side in binding_sides if side.kind not in (*LIMIT_NOUNS, "bounds")]
    binds += dict.fromkeys(side.label for side in of_problem)  # Constraints of a user's problem
    loose = [LIMIT_NOUNS[kind] for kind in ("deadline", "state of charge") if kind in kinds - tight]
    if len(binds) > 1:
        words = " and ".join(bind.removeprefix("the ") for bind in binds) + " bind"
    elif binds:
        words = f"{binds[0]} binds" + f", {loose[0]} does not" * bool(loose)
    elif len(loose) == 2:
        words = f"neither {' nor '.join(reversed(loose))} binds"
    else:
        words = f"{loose[0]} does not bind" if loose else ""
    return sentence(words)


def _landed(side: ConstraintAtOptimum) -> str:
    """The charge left at a landing that a limit holds there, in words; empty for another limit."""
    left, _, where = side.words.partition("charge left ")
    return f"{percent(side.right)} left {where}" if where and not left else ""


def gains_in_words(explained: Findings) -> str:
    """Say what one more pack and one more second are worth, as steps that were solved again."""
    gain_of = {e.key: e.gain for e in explained.prices if e.matters and e.solved_again}
    gains = [
        (what, seconds(gain, 2 if gain < 1.0 else 0))
        for key, what in STEPS_IN_WORDS.items()
        if SEEN_S <= (gain := gain_of.get(key, 0.0)) < math.inf
    ]
    if not gains or explained.objective != "s of hover":
        return ""
    (first, most), *others = gains
    also = "".join(f", {what} {gain}" for what, gain in others)
    return sentence(f"{first} adds {most} of hover{also}")


MAY_BE_IDLE = ("limits.deadline_s", "limits.min_soc", "laser.power_W", "battery.charge_current_A")
"""Keys that `idle` tells of."""


class KeyWithoutEffect(NamedTuple):
    """Values of a mission key over which the answer stays the same, and why."""

    low: float
    high: float | None  # None without an end
    words: str


def idle(explained: Findings, network: Network) -> Iterator[tuple[str, KeyWithoutEffect]]:
    """Return the keys that change nothing, each with a reason that holds without solving again."""
    plan, mission = explained.plan, network.mission
    deadline, min_soc, power, current = MAY_BE_IDLE
    if plan and not plan.has_several_stops:
        limits, end_s = mission.limits, plan.mission_time_s
        if limits.deadline_s - end_s > SAME_SHARE * limits.deadline_s:
            yield (
                deadline,
                KeyWithoutEffect(end_s, limits.deadline_s, "the plan ends then"),
            )
        left = (plan.soc or {}).get(plan.perspective, (plan.soc or {}).get("battery", 0.0))
        if limits.keep_soc == "always":
            rows = (side.left for side in explained.constraints if side.kind == "state of charge")
            left = min(left, *rows)
        if left - limits.min_soc > SAME_SHARE:
            yield min_soc, KeyWithoutEffect(limits.min_soc, left, "that much is left")
    if mission.laser is None:
        return
    current_A = mission.battery.charge_current_A
    most_A, capped_W = laser_reach(mission, network.places)
    if most_A == capped_W == 0.0:
        unreached = KeyWithoutEffect(0.0, None, "the laser reaches no place to stay")
        yield from ((power, unreached), (current, unreached))
    elif mission.laser.power_W >= capped_W:
        words = f"the charging current is capped at {figure(current_A)} A"
        yield (
            power,
            KeyWithoutEffect(capped_W, None, words if capped_W else "the mission sets the current"),
        )
    elif most_A < current_A:
        words = f"the laser delivers at most {amperes(most_A)}"
        yield current, KeyWithoutEffect(most_A, None, words)


def key_of(price: Price) -> str:
    """The mission's key of a parameter, or its own name, with the device that it belongs to."""
    if price.device:
        return f"{price.name.partition('[')[0]} over {price.device}"
    return price.key or price.name


def _noun(explained: Findings, price: Price) -> str:
    """A parameter in words, with its place; empty without any."""
    if price.device:
        noun = PARAMETER_NOUNS.get(price.name.partition("[")[0], "")
        return f"{noun} over {price.device}" if noun else ""
    if landing := re.fullmatch(r"landing_(\d+)_(As|J)", price.name):
        flights = [phase for phase in explained.plan.phases if phase.kind == "flight"]
        place = flights[int(landing[1]) - 1].end_place
        over = explained.plan.mission.devices and place in explained.plan.hovers
        at = f"hover point of {place}" if over else f"landing at {place}"
        return f"draw up to the {'hover point' if place == 'hover' else at}"
    return PARAMETER_NOUNS.get(key_of(price), "")


def without_effect(explained: Findings) -> str:
    """Name the parameters that change nothing, by key or in words; empty without any."""
    free = (price for price in explained.prices if not price.matters)
    landed = re.compile(r"landing_\d+_(As|J)")
    return ", ".join(
        f"the {_noun(explained, price)}" if landed.fullmatch(price.name) else key_of(price)
        for price in free
    )


def symbol_and_value(price: Price) -> str:
    """The symbol of a parameter and its present value."""
    return f"{price.symbol} = {with_unit(price.value, price.unit)}"


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
        more = f"{with_unit(price.step, unit)} more"
    noun = _noun(explained, price)
    more = f"{more} of {f'the {noun}' if noun else key_of(price)}"
    more = "one more pack" if price.key == "battery.packs" else more
    less = f", as much less {change(price.loss)}" if price.has_kink else ""
    return f"{more} {change(price.gain)}{less}"

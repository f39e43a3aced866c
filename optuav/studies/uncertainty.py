"""Uncertain keys: how they are spread, samples of them, and what follows for the hover time."""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from zlib import crc32

import numpy as np
from scipy import special

from formulations.p1 import P1
from formulations.soc import AVAILABLE
from optuav.arrays import Booleans, Floats
from optuav.diagnosis.repair import Key, keys
from optuav.errors import Fault, InputError, refuse
from optuav.mission import Mission
from optuav.mission.files import label, read_toml
from optuav.mission.messages import nearest, path_of, shown
from optuav.mission.schema import Number
from optuav.modelling.check import evaluated
from optuav.network import vehicle
from optuav.network.network import Network, build_network
from optuav.network.places import ENDS
from optuav.network.routes import SAME_S
from optuav.network.variants import Variants
from optuav.options import Perspective
from optuav.plan import Plan
from optuav.solving.assemble import quantities
from optuav.solving.best_plans import best_plans
from optuav.solving.question import checked_question

KNOWN = "body.gravity_m_s2"  # It varies only where its spread is stated
SHARE = 0.1  # Reach of a key to either side if nothing is stated, relative to its value
FARTHEST_M = 1e6
DEVIATIONS = 2.0  # Half the range that a picture shows of a normal distribution
AT_ONCE = 8192  # Samples computed together: as many as fit the cache. No result depends on it.
QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
FORMS = (
    "a table such as { percent = 5 }, { low = 1, high = 2 }, { low = 1, likely = 1.5, high = 2 } "
    'or { deviation = 0.1 }, each with or without along = ["table.key"]'
)
FINITE = Number("-", gt=-math.inf, lt=math.inf)
KINDS = ({"percent"}, {"low", "high"}, {"low", "likely", "high"}, {"deviation"})
LEGS, ALTITUDE = "legs and thrust", "altitude"
CONDITIONS = {
    "outage": "link",
    "state of charge": "charge left",
    "dry": "never dry",
    "past full": "never past full",
    "deadline": "deadline",
}
"""What a fixed plan has to keep beside legs and altitude, by the kind of constraint of (P1)."""


@dataclass(frozen=True)
class Spread:
    """The distribution of a key: triangular, normal, or else uniform from `low` to `high`."""

    key: Key
    low: float
    high: float
    likely: float | None = None  # Most likely value of a triangular distribution
    # Of a normal distribution about the mission's value, cut off at the range of the key.
    deviation: float | None = None
    along: tuple[Key, ...] = ()  # Keys that change by the same factor

    def at(self, share: Floats) -> Floats:
        """Return the quantiles of the distribution for shares between 0 and 1."""
        low, high, likely = self.low, self.high, self.likely
        if self.deviation is not None:
            now, scale = self.key.now, self.deviation
            ends = special.ndtr((np.array([self.key.low, self.key.high]) - now) / scale)
            within = special.ndtri(ends[0] + share * (ends[1] - ends[0]))
            return np.asarray(np.clip(now + scale * within, self.key.low, self.key.high))
        if likely is None:
            return low + share * (high - low)
        up = low + np.sqrt(share * (high - low) * (likely - low))
        down = high - np.sqrt((1.0 - share) * (high - low) * (high - likely))
        return np.where(share * (high - low) < likely - low, up, down)

    def columns(self, values: Floats) -> Iterator[tuple[str, Floats]]:
        """Yield the values by key, and those of the keys that change along with it."""
        yield self.key.name, values
        for other in self.along:
            yield other.name, np.clip(other.now * (values / self.key.now), other.low, other.high)


def drawn(spreads: Sequence[Spread], seed: int, first: int, count: int) -> dict[str, Floats]:
    """Return samples by key from number `first` on, each key from a random stream of its own."""
    found: dict[str, Floats] = {}
    for spread in spreads:
        stream = np.random.PCG64([seed, crc32(spread.key.name.encode())])
        stream.advance(first)  # each number takes one step
        found |= spread.columns(spread.at(np.random.Generator(stream).random(count)))
    return found


def unstated(mission: Mission) -> Iterator[Spread]:
    """Yield every key within 10 %, but what is known and what has no range, as whole numbers."""
    for key in spreadable(mission).values():
        ends = sorted(float(f"{key.now * share:.12g}") for share in (1.0 - SHARE, 1.0 + SHARE))
        low, high = (min(max(end, key.low), key.high) for end in ends)
        if not key.whole and low < high and key.name != KNOWN:
            yield Spread(key, low, high)


def spreadable(mission: Mission) -> dict[str, Key]:
    """Return the keys that may vary by name: numbers, and components of places and the wind."""
    found = {key.name: key for key in keys(mission)}
    for table, name in (
        *(("route", end) for end in ("origin_m", "destination_m", "hover_m")),
        *(("laser", "position_m"), ("link", "device_m"), ("wind", "force_N")),
    ):
        vector = getattr(getattr(mission, table), name, None)
        for axis, now in enumerate(vector or ()):
            part = f"{table}.{name}[{axis}]"
            found[part] = Key(part, now, -FARTHEST_M, FARTHEST_M, False, name.rpartition("_")[2])
    return found


def spreads(mission: Mission, stated: Mapping[str, object] | str | Path) -> tuple[Spread, ...]:
    """Return the spreads that a TOML file or a mapping states, or refuse it with all faults.

    A mapping has the form ``{"battery": {"capacity_As": {"percent": 5}}}``, or ``{
    "battery.capacity_As": {"percent": 5}}``; other forms as in `optuav.sensitivity`.
    """
    source = ""
    if not isinstance(stated, Mapping):
        path = path_of(stated)
        source, stated = label(path), read_toml(path)
    known = spreadable(mission)
    found, faults = [], []
    for table, content in stated.items():
        # A dotted key has its form beside it, a table those of its keys.
        forms = content.items() if isinstance(content, dict) and "." not in table else None
        for name, form in ((None, content),) if forms is None else forms:
            try:
                found.append(_spread(known, table if name is None else f"{table}.{name}", form))
            except InputError as error:
                faults += [replace(fault, source=source) for fault in error.faults]
    names = Counter(each.name for spread in found for each in (spread.key, *spread.along))
    words = "varies once, by itself or along another"
    faults += [Fault(name, "", words, source) for name in sorted(names) if names[name] > 1]
    refuse(faults)
    return tuple(found)


def _spread(known: Mapping[str, Key], name: str, form: object) -> Spread:
    """Return the spread of one key, or refuse what is stated."""
    key = _key(known, name)
    stated = form if isinstance(form, dict) else {}
    parts = ", ".join(f"{part} = {shown(value)}" for part, value in stated.items())
    written = f"{{ {parts} }}" if stated else shown(form)
    numbers = {part: value for part, value in stated.items() if part != "along"}
    if numbers.keys() not in KINDS or not all(map(FINITE.accepts, numbers.values())):
        raise InputError([Fault(name, written, FORMS)])
    if key.whole:
        raise InputError([Fault(name, written, "a whole number cannot be spread")])
    along = stated.get("along", [])
    if not isinstance(along, list) or not all(isinstance(each, str) for each in along):
        raise InputError([Fault(f"{name}.along", shown(along), "a list of keys")])
    if along and key.now == 0.0:
        raise InputError([Fault(f"{name}.along", shown(along), "nothing goes along with 0")])
    likely, deviation = numbers.get("likely"), numbers.get("deviation")
    reach = abs(key.now) * numbers.get("percent", 0.0) / 100.0 + DEVIATIONS * (deviation or 0.0)
    low, high = numbers.get("low", key.now - reach), numbers.get("high", key.now + reach)
    if deviation is not None:
        low, high = max(low, key.low), min(high, key.high)
    if not (key.low <= low < high <= key.high and low <= numbers.get("likely", low) <= high):
        within = f"within {key.low:g} to {key.high:g} [{key.unit}]"
        raise InputError([Fault(name, written, f"low < high, likely between, {within}")])
    return Spread(key, low, high, likely, deviation, tuple(_key(known, each) for each in along))


def _key(known: Mapping[str, Key], name: str) -> Key:
    """Return a key that may vary, or refuse its name."""
    if name in known:
        return known[name]
    alike = [each for each in known if each.startswith(f"{name.partition('.')[0]}.")]
    words = "a number that the mission states, or a component such as wind.force_N[0]; "
    words += f"buildings stay where they are{nearest(name, alike)}"
    raise InputError([Fault(name, "", words)])


@dataclass(frozen=True)
class FixedPlan:
    """A plan whose route, hover point and times [s] stay as they were planned."""

    # The mission with its hover point where the plan has it, and the plan's itinerary alone.
    network: Network
    itinerary: int  # Number of that itinerary among all of the mission
    hover_time_s: float
    rest_time_s: float

    @classmethod
    def of(cls, plan: Plan, mission: Mission) -> "FixedPlan":
        """Return the plan on a mission, or refuse one for other places or another route."""
        scene, other = (
            (each.route.origin_m, each.route.destination_m, each.link.device_m, each.buildings)
            + ((each.laser.position_m,) if each.laser else ())
            for each in (plan.mission, mission)
        )
        if scene == other:
            point_m = [float(each) for each in vehicle.hover_point_m(plan.mission)]
            network = build_network(mission.replace({"route.hover_m": point_m}))
            for number in range(len(network.routes)):
                if network.route_names(number) == plan.route:
                    return cls(network.only(number), number, plan.hover_time_s, plan.rest_time_s)
        words = "a plan over the places of this mission: the same origin, destination, device, "
        words += "laser and buildings, with one hover and at most one rest"
        raise InputError([Fault("plan", " → ".join(plan.route), words)])

    def kept(self, variants: Variants, perspective: Perspective = AVAILABLE) -> dict[str, Booleans]:
        """Return in which variants of the mission the plan keeps each condition.

        Under ``"available"`` it can be flown where it keeps all of them.
        """
        own = Variants(self.network, variants.columns, variants.coverage_radius_m)
        every = np.arange(own.count)
        rests = bool(self.network.routes.building[0] >= 0)
        given = quantities(own, np.zeros_like(every), every, rests=rests)
        point = {"hover_time_s": self.hover_time_s}
        if rests:
            point["rest_time_s"] = self.rest_time_s
        found = {name: np.ones(own.count, bool) for name in (LEGS, *CONDITIONS.values(), ALTITUDE)}
        found[LEGS] &= own.able[:, 0]
        for check in evaluated(P1().model(given, perspective), point):
            # What has no kind bounds the altitude; or the ends, which all routes join.
            found[CONDITIONS.get(check.constraint.kind, ALTITUDE)] &= check.satisfied
        return found


@dataclass(frozen=True)
class Chances:
    """What follows from everything that is uncertain, over all samples."""

    samples: int
    seed: int
    uncertain: tuple[str, ...]  # Keys that vary
    stated: bool  # Whether their spread was stated; else all are within 10 % of their values
    mean_s: float  # Mean hover time [s], with 0 for a sample without a plan, as in the quantiles
    # Hover times [s] that so large a share of the samples does not reach.
    quantiles_s: Mapping[float, float]
    no_plan: float  # Share of samples without a plan
    # Share of samples by the route of the best plan; the most frequent first.
    routes: Mapping[str, float]
    # Share of samples in which the fixed plan keeps each condition, and in which it keeps all of
    # them; None without a plan.
    kept: Mapping[str, float] | None
    flyable: float | None
    # Longest hover of each sample, at least the fixed plan's if that is feasible; 0 without.
    hover_times_s: Floats = field(repr=False, compare=False)


def chances(
    network: Network,
    uncertain: Sequence[Spread],
    perspective: Perspective,
    plan: FixedPlan | None,
    samples: int,
    seed: int,
    *,
    stated: bool,
    at_once: int = AT_ONCE,
) -> Chances:
    """Return what the samples say, computed `at_once` at a time."""
    routes, names = network.routes, network.places.names
    question = checked_question(network.mission, perspective=perspective)
    hover_s, wins = np.empty(samples), np.zeros(len(routes), dtype=np.intp)
    kept, flyable = Counter[str](), 0
    for first in range(0, samples, at_once):
        some = slice(first, min(first + at_once, samples))
        variants = Variants(network, drawn(uncertain, seed, first, some.stop - first))
        plans = best_plans(variants, question)
        best_s, best = plans.hover_time_s, plans.route
        if plan is not None:
            conditions = plan.kept(variants)
            kept.update({name: int(where.sum()) for name, where in conditions.items()})
            flyable += int(np.logical_and.reduce([*conditions.values()]).sum())
            if perspective != AVAILABLE:
                conditions = plan.kept(variants, perspective)
            # The best plan's hover point moves with the reach of the radio, the fixed plan's stays:
            # where the best has no clear way or a longer one, the fixed plan may hover longer.
            better = np.logical_and.reduce([*conditions.values()])
            better &= ~(best_s >= plan.hover_time_s - SAME_S)
            best_s = np.where(better, plan.hover_time_s, best_s)
            best = np.where(better, plan.itinerary, best)
        hover_s[some] = np.nan_to_num(best_s, nan=0.0)
        wins += np.bincount(best[~np.isnan(best_s)], minlength=len(routes))
    by_route = Counter[str]()
    for building, count in zip(routes.building.tolist(), wins.tolist(), strict=True):
        by_route["direct" if building < 0 else f"by way of {names[len(ENDS) + building]}"] += count
    quantiles_s = np.quantile(hover_s, QUANTILES).tolist()
    return Chances(
        samples=samples,
        seed=seed,
        uncertain=tuple(k.name for each in uncertain for k in (each.key, *each.along)),
        stated=stated,
        mean_s=float(np.mean(hover_s)),
        quantiles_s=dict(zip(QUANTILES, quantiles_s, strict=True)),
        no_plan=(samples - int(wins.sum())) / samples,
        routes={name: count / samples for name, count in by_route.most_common() if count},
        kept={name: count / samples for name, count in kept.items()} or None,
        flyable=None if plan is None else flyable / samples,
        hover_times_s=hover_s,
    )

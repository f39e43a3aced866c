"""Plans that hold for every value of uncertain numbers within a box, and what that costs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from formulations.formulation import Formulation
from formulations.soc import AVAILABLE
from optuav.errors import Fault, InputError, NoPlanError, collected, printable, refuse
from optuav.fields import Range
from optuav.mission import Mission
from optuav.mission.load import load_one_device
from optuav.mission.messages import misfits, shown, unlisted
from optuav.network import vehicle
from optuav.network.network import Network
from optuav.network.variants import Variants, as_variants
from optuav.options import Perspective, ProblemName
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Heading, Table
from optuav.presentation.numbers import figure, fixed, percent, seconds
from optuav.service.calm_air import calm_facts, hover_words, in_calm_air, with_words
from optuav.service.flyable import flyable_network
from optuav.service.robust_search import KEPT, RobustTimes, Search
from optuav.service.uncertainty_box import Box, box_of, corners_of, samples_of, stated_ranges
from optuav.solving import solve
from optuav.solving.assemble import route_quantities
from optuav.solving.question import Question, checked_question
from optuav.solving.route_models import permitted_routes
from optuav.solving.route_plan import replayed, route_plan
from optuav.studies.results import Pictures, Result
from optuav.studies.samples import SEED, completed

MOST_SAMPLES = 1_000_000
SAMPLES = Range("-", ge=1, le=MOST_SAMPLES, whole=True)
CHANCE = Range("-", gt=0.0, lt=1.0)
PERSPECTIVES_TAKEN = (AVAILABLE, "battery")
PROBLEMS_TAKEN = ("P1", "P3", "P4")
UNCERTAIN_NUMBER_UNITS = {"number": "", "low": "", "high": "", "gain_s": "s"}


class UncertainNumber(TypedDict):
    """A row of a robust plan: a number and the hover gained if it were certain."""

    number: str
    low: float
    high: float
    gain_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class RobustPlan(Result):
    """A plan that holds within a box, one row per uncertain number.

    Parameters
    ----------
    hover_s, rest_s, route
        Times of the plan [s], and its places.
    nominal_hover_s, price_s
        Longest hover if every number is as the mission states it, and the hover that doubt costs
        [s].
    corners, samples, flyable
        Number of corners that the plan is declared for; number of samples of the box that were
        flown, and the share of them in which the plan keeps every limit.
    reach_share
        The plan is declared for a box with this share of the reach to either side of the mission's
        own numbers (of the middle of a range that does not hold its number); 1 without a chance.
    chance
        The share of the box in which it was asked to hold, None for the whole box.
    risk_bound, confidence
        Upper bound on the share of the box in which the plan fails, and its confidence.
    outside
        Numbers of the mission that do not lie in the box, in words.
    calm_hover_s, in_calm_air
        If hovering counts on a wind that the box does not vary, the longest hover of a robust plan
        in calm air [s], None without a plan there, and the same in words; else None.

    Examples
    --------
    >>> import optuav
    >>> robust = optuav.robust("paper", {"drain": {"percent": 5}}, samples=500)
    >>> robust.corners, robust.doubt_costs_s.keys()
    (1, dict_keys(['drain']))
    """

    kind = "optuav robust"
    units = UNCERTAIN_NUMBER_UNITS
    rows: tuple[UncertainNumber, ...]
    hover_s: float
    rest_s: float
    route: tuple[str, ...]
    nominal_hover_s: float
    price_s: float
    corners: int
    samples: int
    flyable: float
    chance: float | None
    reach_share: float
    confidence: float
    outside: tuple[str, ...]
    calm_hover_s: float | None
    in_calm_air: str | None
    risk_bound: float
    plan: Plan = field(repr=False)  # Flown with the numbers of the mission

    @property
    def doubt_costs_s(self) -> dict[str, float]:
        """Hover gained on the route if a number were certain [s], by number; the largest first."""
        return {row["number"]: row["gain_s"] for row in self.rows}

    def blocks(self) -> Iterator[Block]:
        """Yield the plan, where it holds, and the gain of every number."""
        yield Heading(f"Robust plan: {printable(self.mission.name)}")
        nominal = f"{seconds(self.nominal_hover_s)} with certain numbers"
        part = "" if self.chance is None else f" of a box {percent(self.reach_share)} as wide"
        held = f"{percent(self.flyable)} of {self.samples} samples of the box"
        facts = [
            ("Route", " → ".join(map(printable, self.route))),
            ("Hover", f"{seconds(self.hover_s)}, rest {seconds(self.rest_s)}"),
            ("Price", f"{seconds(self.price_s)} of hover: {nominal}"),
            ("Holds", f"at {2 * self.corners} corners{part}, and in {held}"),
        ]
        if self.chance is None and self.flyable < 1.0:
            facts.append(("Beware", "not in the whole box: set smaller ranges, or a chance"))
        facts += [("Beware", words) for words in self.outside]
        if not self.plan.flyable:
            words = "the plan cannot be flown with the mission's own numbers"
            facts.append(("Beware", words))
        facts += [*calm_facts(self.in_calm_air)]
        if self.in_calm_air is not None:
            keys = " and ".join(_blowing(self.mission))
            words = f"for a plan that holds in both, set a range of {keys} that contains 0"
            facts.append(("", words))
        sure = f"with a confidence of {percent(self.confidence)}"
        yield Facts([*facts, ("Risk", f"at most {percent(self.risk_bound)} of the box, {sure}")])
        rows = [
            [row["number"], figure(row["low"]), figure(row["high"]), fixed(row["gain_s"])]
            for row in self.rows
        ]
        heads = ["if this were certain", "low", "high", "hover gained [s]"]
        yield Table(heads, rows, longest=34)

    def pictures(self) -> Pictures:
        """Yield both wells of the plan with the numbers of the mission."""
        from optuav import plots

        yield "robust.png", plots.wells(self.plan)[0]


def robust(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, object] | str | Path,
    problem: Formulation | ProblemName = "P1",
    *,
    perspective: Perspective = AVAILABLE,
    chance: float | None = None,
    confidence: float = 0.99,
    samples: int = 20_000,
    seed: int = 0,
) -> RobustPlan:
    """Find the plan with the longest hover that can be flown with any numbers in a box.

    y1(t) − ωB is the integral of the current over a positive kernel. For fixed times, the charge is
    therefore lowest with the most drain and the least charging, and highest with the least drain
    and the most charging. `robust` declares the limits for these two cases at every corner of the
    keys, and also for the least wind and for five values each of ω and k_F, in which the wells are
    not monotone; route, hover point and times are the same for all. The worst value of other keys,
    such as positions, may lie between: `robust` also declares the limits at points within the box
    at which the plan fails, until it finds none. For factors this is a proof; for keys it rests on
    samples, and fresh samples check the answer.

    Parameters
    ----------
    mission
        A mission, or its name or path; its packs are pooled and charge at constant current.
    uncertainty
        Ranges of keys as `sensitivity` takes them, as a dict or a TOML file; and of two factors,
        ``drain`` on every current that is drawn and ``charge`` on the charging current after its
        cap, each as ``{ percent = 5 }`` or ``{ low = 0.9, high = 1.2 }``. The box of a
        ``deviation`` is two deviations to either side; samples stay inside it.
    problem
        ``"P1"``, ``"P3"``, or an instance of `P1`, `P3` or `P4` with one rest and hover.
    perspective
        How to count charge, as for `optuav.solve`: ``"available"`` or ``"battery"``.
    chance
        The share of the box in which the plan must hold, between 0 and 1; by default the whole box.
        `robust` then solves for the smallest part of the box, around the mission's own numbers (or
        the middle of a range that does not contain its number), for which so few samples fail that
        the chance holds with the confidence (an order statistic, because the plan for a larger part
        holds in more of the box).
    confidence
        Confidence of the chance and of the bound on the risk, between 0 and 1.
    samples, seed
        Number of samples of the box that check the plan, 1 to 1e6, and their seed, 0 to 2**63. With
        a chance, as many other samples find the part of the box.

    Returns
    -------
    RobustPlan
        Its times, its price, the share of samples that it survives, ``plan``, and one row per
        number: the hover gained on the same route [s] if that number were certain. If the box does
        not contain the mission's own numbers, ``plan.flyable`` may be false.

    Raises
    ------
    InputError, NoPlanError
        If an argument is out of range, the box has more than 128 corners, or the samples are too
        few for the chance (459 for 99 % at a confidence of 99 %); or if optuav finds no plan that
        holds in the whole box, or with the chance.

    Examples
    --------
    >>> import optuav
    >>> box = {"drain": {"percent": 5}, "charge": {"percent": 10}}
    >>> robust = optuav.robust("paper", box)
    >>> f"{robust.hover_s:.3f} s, {robust.price_s:.1f} s less than with certain numbers"
    '555.810 s, 41.5 s less than with certain numbers'
    """
    loaded: Mission | None = None
    faults, ranges = [*_option_faults(perspective, chance, confidence, samples, seed)], None
    with collected(faults):
        ranges = stated_ranges(uncertainty)
    with collected(faults):
        loaded = load_one_device(mission, "a robust plan")
        faults += _battery_faults(loaded)
        if ranges is not None:
            box = box_of(loaded, ranges)
    with collected(faults):
        counted = perspective if perspective in PERSPECTIVES_TAKEN else AVAILABLE
        question = _question(loaded, problem, counted)
    refuse(faults)
    loaded, count = completed(loaded, box.spreads), int(samples)
    nominal = solve(loaded, question.problem, perspective=perspective)
    if not nominal:
        raise NoPlanError(f"no plan even with certain numbers: {'; '.join(nominal.reasons)}")
    hover_m = vehicle.hover_point_m(loaded)
    network = flyable_network(loaded.replace({"route.hover_m": [*map(float, hover_m)]}))
    search = Search(question, network)
    routes = np.flatnonzero(permitted_routes(as_variants(network), question.problem)[0])
    share, times = 1.0, None
    if chance is None:
        times, _ = search.holding(routes, box)
    else:
        trials = samples_of(loaded, box, count, count, int(seed))
        most = _most_failures(count, chance, confidence)
        share, times = search.by_chance(routes, box, trials, most)
    if times is None:
        raise _no_plan(network, box, chance)
    about = "" if chance is None else "; its range shrinks about its middle"
    outside = tuple(f"{words}{about}" for words in box.outside)
    kept = search.holds_at(times, samples_of(loaded, box, 0, count, int(seed)))
    box = box.shrunk(share) if share < 1.0 else box
    calm_hover_s, in_words = None, None
    if not any(spread.key.name.startswith("wind.") for spread in box.spreads):
        options: dict[str, Any] = {"perspective": perspective, "chance": chance}
        options |= {"confidence": confidence, "samples": samples, "seed": seed}
        calm = in_calm_air(loaded, lambda calm: robust(calm, uncertainty, problem, **options))
        hover_s = calm.hover_s if isinstance(calm, RobustPlan) else calm
        calm_hover_s, in_words = with_words(hover_s, hover_words)
    stays_s = times.hover_s, times.rest_s
    plan = route_plan(question, network, times.route, stays_s, **times.how)
    plan = replayed(plan, must_fly=not box.outside)
    return RobustPlan(
        mission=loaded,
        rows=tuple(sorted(_gains(search, times, box), key=lambda row: -row["gain_s"])),
        hover_s=times.hover_s,
        rest_s=times.rest_s,
        route=tuple(plan.route),
        nominal_hover_s=nominal.hover_time_s,
        price_s=nominal.hover_time_s - times.hover_s,
        corners=corners_of(loaded, box).count,
        samples=count,
        flyable=float(kept.mean()),
        chance=chance,
        reach_share=share,
        confidence=confidence,
        outside=outside,
        calm_hover_s=calm_hover_s,
        in_calm_air=in_words,
        risk_bound=_risk_bound(count, int(np.count_nonzero(~kept)), confidence),
        plan=plan,
    )


def _blowing(mission: Mission) -> Iterator[str]:
    """Yield the keys of the wind's components that are not 0."""
    assert mission.wind is not None
    for name, vector in mission.wind.model_dump(exclude_none=True).items():
        yield from (f"wind.{name}[{axis}]" for axis, size in enumerate(vector) if size)


def _option_faults(
    perspective: str, chance: float | None, confidence: float, samples: int, seed: int
) -> Iterator[Fault]:
    """Yield options out of range, and samples that are too few for a chance."""
    faults = [*misfits(("samples", samples, SAMPLES), ("seed", seed, SEED))]
    faults += misfits(("confidence", confidence, CHANCE))
    faults += misfits(("chance", chance, CHANCE)) if chance is not None else ()
    yield from faults
    if not faults and chance is not None and _most_failures(samples, chance, confidence) < 0:
        least, sure = math.log1p(-confidence) / math.log(chance), f"a confidence of {confidence}"
        words = f"at least {math.ceil(least)} for a chance of {chance} at {sure}"
        fault = Fault("samples", shown(samples), words)
        if not SAMPLES.accepts(math.ceil(least)):
            most = math.exp(math.log1p(-confidence) / MOST_SAMPLES)
            words = f"at most {fixed(math.floor(1e7 * most) / 1e7, 7)} at {sure}, for which"
            words += f" {MOST_SAMPLES} samples are enough"
            fault = Fault("chance", shown(chance), words)
        yield fault
    yield from unlisted(("perspective", perspective, PERSPECTIVES_TAKEN))


def _battery_faults(mission: Mission) -> Iterator[Fault]:
    """Yield a schedule and a charging that a robust plan cannot have."""
    for name, only in (("schedule", "pooled"), ("charging", "constant")):
        if (now := getattr(mission.battery, name)) != only:
            yield Fault(f"battery.{name}", shown(now), f"must be {only!r} here")


def _question(
    mission: Mission | None, problem: Formulation | ProblemName, perspective: Perspective
) -> Question:
    """Return the question with certain numbers, or refuse a problem that has no robust form."""
    question = checked_question(mission, problem, perspective)
    several = question.several or question.speed_free or question.p1.hover_point != "w_U"
    if question.problem.name not in PROBLEMS_TAKEN or several:
        names = ", ".join(PROBLEMS_TAKEN)
        words = f"must be {names} with one rest, one hover, w_U and speeds from the mission"
        raise InputError([Fault("problem", question.problem.name, words)])
    return question


def _no_plan(network: Network, box: Box, chance: float | None) -> NoPlanError:
    """Return the refusal where no plan holds, with its repair."""
    where = "in the whole box" if chance is None else f"with a chance of {chance}"
    repair = "state smaller ranges"
    table = route_quantities(Variants(network, corners_of(network.mission, box).columns))
    if np.any(table.hover_distance_m > table.coverage_radius_m * (1.0 + KEPT)):
        repair = "the link does not reach the hover point at some corners: set route.hover_m "
        repair += "nearer to link.device_m"
    words = (f"optuav found no plan that holds {where}: {repair}", *box.outside)
    return NoPlanError("; ".join(words))


def _gains(search: Search, times: RobustTimes, box: Box) -> Iterator[UncertainNumber]:
    """Yield every uncertain number with the hover gained on the route if it were certain."""
    for name, (low, high) in box.numbers.items():
        certain, _ = search.holding(np.array([times.route]), box.with_nominal(name))
        gain_s = 0.0 if certain is None else certain.hover_s - times.hover_s
        yield UncertainNumber(number=name, low=low, high=high, gain_s=gain_s)


def _most_failures(samples: int, chance: float, confidence: float) -> int:
    """The largest k with P(Bin(n, 1 − chance) ≤ k) ≤ 1 − confidence."""
    from scipy import special

    below = special.bdtr(np.arange(samples), samples, 1.0 - chance)
    return int(np.count_nonzero(below <= 1.0 - confidence)) - 1


def _risk_bound(samples: int, failures: int, confidence: float) -> float:
    """Upper end of the one-sided interval of Clopper and Pearson for the share that fails."""
    from scipy import special

    if failures == samples:
        return 1.0
    return float(special.betaincinv(failures + 1, samples - failures, confidence))

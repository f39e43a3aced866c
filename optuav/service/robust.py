"""Plans that hold for every value of uncertain numbers within a box, and what that costs."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from formulations.formulation import Formulation, Given
from formulations.parameters import Quantities
from formulations.soc import AVAILABLE, PERSPECTIVES, levels, well_limits
from optuav.arrays import Booleans, Floats
from optuav.errors import Fault, InputError, NoPlanError, collected, printable, refuse
from optuav.mission import Mission, load
from optuav.mission.flight_model import flight_of
from optuav.mission.messages import misfits, shown, unknown
from optuav.mission.schema import Number
from optuav.modelling import Model
from optuav.network import vehicle
from optuav.network.feasibility import impossibilities
from optuav.network.network import Network, build_network
from optuav.network.variants import Columns, Variants, stacked
from optuav.options import Perspective, ProblemName
from optuav.physics.kibam import Stage
from optuav.plan import Plan
from optuav.plan.summary import tabulated
from optuav.service.box import FACTORS, LEVELS, Box, box_of, corners_of, count_of, samples_of
from optuav.solving import solve
from optuav.solving.assemble import entries, quantities
from optuav.solving.balance import TIMES
from optuav.solving.outcome import best, replayed, route_plan
from optuav.solving.parts import allowed
from optuav.solving.question import Question, answer, checked_question
from optuav.status import SAME_S
from optuav.studies.results import Pictures, Results, ResultsWithFacts
from optuav.studies.samples import SEED, completed

SAMPLES = Number("-", ge=1, le=1e6, whole=True)
CHANCE = Number("-", gt=0.0, lt=1.0)
HALVINGS = 10  # Halvings of the share of the box that a chance needs
KEPT = 1e-9  # Share of the capacity, or of the deadline, that rounding may take
PROBLEMS_TAKEN = ("P1", "P3", "P4")
UNITS = {"number": "", "low": "", "high": "", "gain_s": "s"}


class Found(NamedTuple):
    """A robust plan: its route, its times [s], and how they are known."""

    route: int
    hover_s: float
    rest_s: float
    said: dict[str, Any]


@dataclass(frozen=True)
class RobustPlan(ResultsWithFacts):
    """A plan that holds within a box, one row per uncertain number.

    Parameters
    ----------
    hover_s, rest_s, route
        Of the plan [s], and its places.
    nominal_hover_s, price_s
        Longest hover if every number is as the mission states it, and what certainty costs [s].
    corners, samples, flyable
        How many corners the plan is declared for; how many samples of the box were flown, and the
        share of them in which it keeps every limit.
    reach_share
        The plan is declared for a box about the same middle with this share of the reach to either
        side; 1 without a chance.
    risk_bound, confidence
        A share of the box that the plan fails in no more than, at this confidence.
    """

    plan: Plan = field(kw_only=True, repr=False)  # Flown with the numbers of the mission

    @property
    def doubt_costs_s(self) -> dict[str, float]:
        """Hover gained on the route if a number were certain [s], by number; the largest first."""
        return {row["number"]: row["gain_s"] for row in self.rows}


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
    """Find the plan with the longest hover that can be flown wherever the numbers lie in a box.

    y1(t) − ωB is the integral of the current over a positive kernel. For fixed times a plan is
    therefore worst for dry wells and for charge with the most drawn and the least charged, and
    worst for overfull ones with the least drawn and the most charged. Limits are declared for these
    two at every corner of the keys, and for five values each of ω and k_F, in which the wells are
    not monotone; the route, the hover point and the times are the same for all. Samples of the
    whole box then check what corners alone do not prove.

    Parameters
    ----------
    mission
        A mission, or its name or path; its packs are pooled and charge at constant current.
    uncertainty
        Ranges of keys as `sensitivity` takes them, as a dict or a TOML file; and of two factors,
        ``drain`` on every current that is drawn and ``charge`` on the charging current after its
        cap, each as ``{ percent = 5 }`` or ``{ low = 0.9, high = 1.2 }``. A ``deviation`` has as
        its box the range that samples are drawn from.
    problem
        ``"P1"``, ``"P3"``, or an instance of `P1`, `P3` or `P4` with one rest and hover.
    perspective
        ``"available"``, or ``"battery"``, which counts charge alone.
    chance
        The share of the box in which the plan must hold, between 0 and 1; by default the whole
        box. The plan is then declared for the smallest part of the box, about its middle, with
        which so few samples fail that the chance is met with the confidence (an order statistic,
        as the plans of larger parts hold in more of the box).
    confidence
        Of the chance, and of the bound on the risk; between 0 and 1.
    samples, seed
        How many samples of the box check the plan, 1 to 1e6, and their seed, 0 to 2**63. As many
        others find the part of the box for a chance.

    Returns
    -------
    RobustPlan
        Its times, its price, the share of samples that it survives, ``plan``, and one row per
        number: the hover gained on the same route [s] if that number were certain. Where the box
        does not hold the numbers of the mission itself, ``plan.flyable`` may be false.

    Raises
    ------
    InputError
        If an argument is out of range, the box has more than 128 corners, or the samples are too
        few for the chance (459 for 99 % at a confidence of 99 %).
    NoPlanError
        If no plan holds in the whole box, or with the chance.

    Examples
    --------
    >>> import optuav
    >>> box = {"drain": {"percent": 5}, "charge": {"percent": 10}}
    >>> found = optuav.robust("paper", box)
    >>> f"{found.hover_s:.3f} s, {found.price_s:.1f} s less than without doubt"
    '555.810 s, 41.5 s less than without doubt'
    """
    faults = [*misfits(("samples", samples, SAMPLES), ("seed", seed, SEED))]
    faults += misfits(("confidence", confidence, CHANCE))
    if chance is not None:
        faults += misfits(("chance", chance, CHANCE))
        if not faults and _most_failures(int(samples), chance, confidence) < 0:
            least = math.ceil(math.log1p(-confidence) / math.log(chance))
            words = f"at least {least} for a chance of {chance:g} at a confidence of {confidence:g}"
            faults.append(Fault("samples", shown(samples), words))
    if perspective not in (AVAILABLE, "battery"):
        faults.append(unknown("perspective", perspective, (AVAILABLE, "battery")))
    with collected(faults):
        whole = load(mission)
        for name, only in (("schedule", "pooled"), ("charging", "constant")):
            if (now := getattr(whole.battery, name)) != only:
                faults.append(Fault(f"battery.{name}", shown(now), f"must be {only!r} here"))
        box = box_of(whole, uncertainty)
    refuse(faults)
    whole = completed(whole, box.spreads)
    question = checked_question(whole, problem, perspective)
    several = question.several or question.speed_free or question.p1.hover_point != "w_U"
    if question.problem.name not in PROBLEMS_TAKEN or several:
        words = f"one of {', '.join(PROBLEMS_TAKEN)}, with one rest, one hover and a hover point"
        raise InputError([Fault("problem", question.problem.name, words)])
    hover_m = [float(coordinate) for coordinate in vehicle.hover_point_m(whole)]
    nominal = solve(whole, question.problem, perspective=perspective)
    if not all(map(math.isfinite, hover_m)) or not nominal:
        raise NoPlanError(f"no plan even without doubt: {'; '.join(nominal.reasons)}")
    network = build_network(whole.replace({"route.hover_m": hover_m}))
    if reasons := impossibilities(network, one_stop=False):
        raise NoPlanError("; ".join(reasons))
    checked = samples_of(network.mission, box, 0, int(samples), int(seed))
    share, found = 1.0, None
    if chance is None:
        found = _best(question, network, box)
    else:
        trials = samples_of(network.mission, box, int(samples), int(samples), int(seed))
        most = _most_failures(int(samples), chance, confidence)
        share, found = _by_chance(question, network, box, trials, most)
    if found is None:
        where = "in the whole box" if chance is None else f"with a chance of {chance:g}"
        raise NoPlanError(f"no plan was found that holds {where}: state smaller ranges")
    box = box.shrunk(share) if share < 1.0 else box
    route, hover_s, rest_s, said = found
    plan = route_plan(question, network, route, (hover_s, rest_s), **said)
    plan = replayed(plan, must_fly=box.holds_now)
    kept = _kept(question, network, found, *checked)
    corners = corners_of(network.mission, box.spreads)
    facts = {
        **{"hover_s": hover_s, "rest_s": rest_s, "route": tuple(plan.route)},
        "nominal_hover_s": nominal.hover_time_s,
        "price_s": nominal.hover_time_s - hover_s,
        **{"corners": count_of(corners), "samples": int(samples), "flyable": float(kept.mean())},
        **{"chance": chance, "reach_share": share, "confidence": confidence},
        "risk_bound": _risk_bound(int(samples), int(np.count_nonzero(~kept)), confidence),
    }
    rows = list[dict[str, Any]]()
    for name, ends in box.numbers.items():
        less = box.without(name)
        again = _on_route(question, network, route, less, corners_of(network.mission, less.spreads))
        gain_s = 0.0 if again is None else again.hover_s - hover_s
        rows.append(dict(zip(UNITS, (name, *ends, gain_s), strict=True)))
    rows.sort(key=lambda row: -row["gain_s"])
    return RobustPlan("optuav robust", whole, facts, UNITS, tuple(rows), _show, _draw, plan=plan)


def _scaled(
    network: Network, route: int, columns: Columns, drain: Any, charge: Any
) -> tuple[Quantities, Booleans]:
    """Figures of a route by variant, currents multiplied; and where its legs and link hold."""
    variants, count = Variants(network, columns), count_of(columns)
    every, rests = np.arange(count), bool(network.routes.building[route] >= 0)
    table = quantities(variants, np.full(count, route), every, rests=rests)
    hover_A = np.broadcast_to(variants.hover_load.current_A, (count, 1))[:, 0]
    rest_A = np.broadcast_to(flight_of(variants.mission).rest().current_A, (count, 1))[:, 0]
    able = np.broadcast_to(variants.able[:, route], (count,))
    reached = np.asarray(table.hover_distance_m <= table.coverage_radius_m * (1.0 + KEPT))
    steps = tuple(
        step if isinstance(step, str) else Stage(drain * step.current_A, step.duration_s)
        for step in table.steps
    )
    received_A = hover_A - table.hover_current_A
    scaled = replace(
        table,
        steps=steps,
        flight_charge_As=drain * table.flight_charge_As,
        hover_current_A=drain * hover_A - charge * received_A,
        rest_current_A=charge * (table.rest_current_A + rest_A) - drain * rest_A,
    )
    return scaled, able & reached


@dataclass(frozen=True, kw_only=True, eq=False)
class _Robust(Formulation):
    """Longest hover within limits that hold at all corners."""

    emptiest: tuple[Quantities, ...]
    fullest: tuple[Quantities, ...]

    def declare(self, model: Model, given: Given) -> None:
        """State charge, dry and deadline at the emptiest corners, past full at the fullest."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        for number, own in enumerate(self.emptiest, start=1):
            left = PERSPECTIVES[given.perspective](own, hover, rest) >= own.min_soc
            model.subject_to(f"charge, corner {number}", left, kind="state of charge")
            in_time = hover + rest <= own.time_left
            model.subject_to(f"deadline, corner {number}", in_time, unit="s", kind="deadline")
        if given.perspective != AVAILABLE:
            return
        for kind, every in (("dry", self.emptiest), ("past full", self.fullest)):
            for number, own in enumerate(every, start=1):
                for limit in well_limits(own, hover, rest):
                    if limit.kind == kind:
                        label = f"{kind}, corner {number}, step {limit.step + 1}"
                        model.subject_to(label, limit.relation, kind=kind)


def _on_route(
    question: Question, network: Network, route: int, box: Box, corners: Columns
) -> Found | None:
    """The longest robust hover on a route; None for none."""
    (drain_low, drain_high), (charge_low, charge_high) = (box.factors[name] for name in FACTORS)
    emptiest, able = _scaled(network, route, corners, drain_high, charge_low)
    fullest, _ = _scaled(network, route, corners, drain_low, charge_high)
    if not able.all():
        return None
    every = range(count_of(corners))
    problem = _Robust(
        emptiest=tuple(entries(emptiest, each) for each in every),
        fullest=tuple(entries(fullest, each) for each in every),
    )
    rests = bool(network.routes.building[route] >= 0)
    given = quantities(network, np.array([route]), rests=rests)
    solution = answer(problem.model(given, question.perspective), 1, question)
    if not solution.statuses[0].has_answer:
        return None
    solution.verify(0)
    point = solution.point(0)
    hover_s, rest_s = (max(0.0, point.get(name, 0.0)) for name in TIMES)
    said = {"engine": solution.engine, "status": solution.statuses[0]}
    return Found(route, hover_s, rest_s, {**said, "proof": f"corners of the box: {solution.proof}"})


def _best(question: Question, network: Network, box: Box) -> Found | None:
    """The longest robust hover over all routes; None for none."""
    routes = np.flatnonzero(allowed(stacked(network), question.problem)[0]).tolist()
    answers = _answers(question, network, routes, box)
    hovers_s = [math.nan if each is None else each.hover_s for each in answers]
    rests_s = np.array([0.0 if each is None else each.rest_s for each in answers])
    totals_s = np.array(hovers_s) + rests_s + network.routes.flight_time_s[routes]
    winner = best(hovers_s, totals_s, network.routes.building[routes] >= 0)
    return None if winner is None else answers[winner]


def _answers(
    question: Question, network: Network, routes: Sequence[int], box: Box
) -> list[Found | None]:
    """Robust hovers by route; None for none, and for routes that cannot be the best."""
    plain = box
    for name in LEVELS:
        plain = plain.without(name)
    corners, fewer = (
        corners_of(network.mission, corner_box.spreads) for corner_box in (box, plain)
    )
    bounds = [_on_route(question, network, route, plain, fewer) for route in routes]
    if plain.numbers == box.numbers:
        return bounds
    # Fewer corners bound the hover, and their rates let a quicker engine answer.
    answers: list[Found | None] = [None] * len(routes)
    longest_s = -math.inf
    for number in sorted(range(len(routes)), key=lambda k: -_hover_s(bounds[k])):
        if _hover_s(bounds[number]) < longest_s - SAME_S:
            break
        answers[number] = _on_route(question, network, routes[number], box, corners)
        longest_s = max(longest_s, _hover_s(answers[number]))
    return answers


def _hover_s(found: Found | None) -> float:
    return -math.inf if found is None else found.hover_s


def _by_chance(
    question: Question,
    network: Network,
    box: Box,
    drawn: tuple[Columns, Floats, Floats],
    most_failures: int,
) -> tuple[float, Found | None]:
    """The smallest share of the reach with a plan that few enough samples fail, and the plan."""
    chosen: tuple[float, Found | None] = (1.0, None)
    low, high, share = 0.0, 1.0, 1.0
    for _ in range(HALVINGS + 1):
        found = _best(question, network, box.shrunk(share))
        few = found is not None and (
            np.count_nonzero(~_kept(question, network, found, *drawn)) <= most_failures
        )
        if few:
            chosen = share, found
        if few or found is None:
            high = share
        else:
            low = share
        if low == high:  # Samples of a deviation reach past its box
            break
        share = 0.5 * (low + high)
    return chosen


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


def _kept(
    question: Question,
    network: Network,
    found: Found,
    columns: Columns,
    drain: Floats,
    charge: Floats,
) -> Booleans:
    """In which samples the plan keeps every limit."""
    times_s = found.hover_s, found.rest_s
    own, kept = _scaled(network, found.route, columns, drain, charge)
    left = PERSPECTIVES[question.perspective](own, *times_s)
    kept = kept & np.asarray(left >= own.min_soc - KEPT)
    kept &= np.asarray(sum(times_s) <= own.time_left + KEPT * own.deadline_s)
    if question.perspective == AVAILABLE:
        for step, wells in zip(own.steps, levels(own, *times_s), strict=True):
            share = wells.available_As / own.battery_As
            kept &= np.asarray(share >= -KEPT)
            if isinstance(step, str):
                kept &= np.asarray(share <= own.available_fraction + KEPT)
    return np.asarray(kept, dtype=bool)


def _show(found: Results) -> Iterator[str]:
    facts = found.facts
    yield f"Robust plan: {printable(found.mission.name)}"
    yield f"Route       {' → '.join(map(printable, facts['route']))}"
    yield f"Hover       {facts['hover_s']:.3f} s, rest {facts['rest_s']:.3f} s"
    nominal = f"{facts['nominal_hover_s']:.3f} s without doubt"
    yield f"Price       {facts['price_s']:.3f} s of hover: {nominal}"
    part = "" if facts["chance"] is None else f" at {facts['reach_share']:.1%} of its reach"
    held = f"{facts['flyable']:.2%} of {facts['samples']} samples of the box"
    yield f"Holds       at {2 * facts['corners']} corners{part}, and in {held}"
    sure = f"with a confidence of {facts['confidence']:g}"
    yield f"Risk        at most {facts['risk_bound']:.2%} of the box, {sure}\n"
    lines = [["if this were certain", "low", "high", "hover gained [s]"]]
    for row in found.rows:
        lines.append([row["number"], f"{row['low']:g}", f"{row['high']:g}", f"{row['gain_s']:.3f}"])
    yield from tabulated(lines, longest=34)


def _draw(found: Results) -> Pictures:
    """Both wells of the plan with the numbers of the mission."""
    from optuav import plots

    assert isinstance(found, RobustPlan)
    yield "robust.png", plots.wells(found.plan)[0]

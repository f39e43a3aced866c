"""Both shipped towns with wells from one end of their ranges to the other, in all perspectives.

ω from 1e-6 to 0.999999 and k_F from 0 to 1000 per second, ends included, with and without a laser:
no crash and no wrong answer. The truth is the tests' own wells, stepped over a grid of Δ and T' on
every itinerary, coarse everywhere and fine around what the engine claims; in the linear
perspectives it is exact arithmetic. Forty missions in the suite, ten thousand with ``--soak``.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest

import optuav
from formulations.formulation import Formulation
from formulations.soc import AVAILABLE, PERSPECTIVES
from optuav import P1, P3, P4, Mission, Plan
from optuav.options import Perspective
from optuav.solving import Program, formulate
from optuav.status import Status
from tests.engines.test_missions_agree import exact_best
from tests.solving.delivered import longer, rests, slack
from tests.solving.test_flyable_missions import CASADI_S, INSIDE, MARGIN_S, OUTSIDE, by, flown_wrong

PROVED_S = 1e-6
"""How far the end of a bracket is from the answer that it proves."""
EXACT_S = {"closed-form": 1e-6, "bracket": 1e-6, "cvxpy": 1e-5, "casadi": 1e-4}
"""How far an engine may be from exact arithmetic in a linear perspective."""
TOWNS = ("paper", "paper-table2")
OTHERS_EVERY = 25
"""One question in so many is handed to all engines that take it."""


def town(name: str, values: dict[str, object], *, laser: bool = True) -> Mission:
    """A shipped mission with other values, and without its laser if that is asked for."""
    document = optuav.load(name).to_dict()
    if not laser:
        document.pop("laser", None)
        for key in ("charge_current_A", "charge_power_W"):
            document["flight"].pop(key, None)
    return Mission.from_dict(document).replace(values)


EXTREMES = [
    ("paper", False, {"battery.available_fraction": 1e-6}),
    (
        "paper-table2",
        True,
        {
            "battery.available_fraction": 0.166,
            "battery.flow_rate_per_s": 1000.0,
            "flight.flight_current_A": 2.18,
            "flight.hover_current_A": 38.67,
        },
    ),
    (
        "paper-table2",
        True,
        {
            "battery.available_fraction": 1e-6,
            "battery.flow_rate_per_s": 10.0,
            "flight.rest_current_A": 20.0,
            "flight.charge_current_A": 50.0,
        },
    ),
]


@pytest.mark.parametrize(("name", "laser", "values"), EXTREMES)
def test_rounding_leaves_the_kind_of_a_problem(
    name: str, laser: bool, values: dict[str, object]
) -> None:
    """Terms of the wells that cancel but for rounding are none, at any rate of flow."""
    judge(town(name, values, laser=laser), P1(), AVAILABLE, Counter())


def judge(
    mission: Mission, problem: Formulation, perspective: Perspective, tally: Counter[str]
) -> None:
    """Hold the answer to one question against the truth, and count it."""
    program = formulate(mission, problem, perspective=perspective)
    plan = program.solve()
    tally["missions"] += 1
    tally[f"{perspective}: {plan.status.value}"] += 1
    every = tally["missions"] % OTHERS_EVERY == 0
    if not program.parts:
        return
    if perspective == AVAILABLE:
        judge_wells(program, plan, tally)
        if every:
            judge_others(program, plan, tally)
        return
    same: Perspective = "battery" if perspective == "wells" else perspective
    truth = exact_best(formulate(mission, problem, perspective=same))
    hover_s = float(truth.hover_s) if truth else -math.inf
    assert close(plan, hover_s, EXACT_S[plan.engine or "bracket"]), (plan, hover_s)
    for engine in EXACT_S.keys() & {*program.engines} if every else ():
        found = by(program, engine).solve()
        tally[f"{perspective} by {engine}"] += 1
        assert close(found, hover_s, EXACT_S[engine]), (engine, found, hover_s)


def close(plan: Plan, hover_s: float, within_s: float) -> bool:
    """Whether the hover of a plan is so far from the best [s], or there is none that is longer."""
    if not plan:
        return plan.status is Status.INFEASIBLE and hover_s <= within_s
    return abs(plan.hover_time_s - hover_s) <= within_s


def judge_wells(program: Program, plan: Plan, tally: Counter[str]) -> None:
    """Whether a plan can be flown by the tests' own wells, and no other hovers longer."""
    network = program.network
    horizon_s = network.mission.limits.deadline_s
    beyond_s = plan.hover_time_s + PROVED_S if plan else -math.inf
    assert plan.status in (Status.OPTIMAL, Status.INFEASIBLE), plan
    if plan:
        assert not list(flown_wrong(plan))
    hovers_s = longer(beyond_s, horizon_s, MARGIN_S)[::3]
    for part, found in zip(program.parts, program.answers(), strict=True):
        rested = found.values.get("rest_time_s")
        for entry, route in enumerate(part.routes.tolist()):
            rest_s = np.zeros(1)
            if rested is not None:
                near = [rested[entry]] if np.isfinite(rested[entry]) else []
                rest_s = rests(near, horizon_s)[::3]
            if found.statuses[entry].has_answer:
                at = found.objective[entry], rested[entry] if rested is not None else 0.0
                assert slack(network, route, *at, looks=3) >= -INSIDE
            kept = slack(network, route, hovers_s[:, None], rest_s[None]) > OUTSIDE
            assert not kept.any(), (route, plan, np.argwhere(kept))
            tally["itineraries"] += 1


def judge_others(program: Program, plan: Plan, tally: Counter[str]) -> None:
    """No other engine finds more than what is proved; how often CasADi stops short is counted."""
    best_s = plan.hover_time_s if plan else -math.inf
    deadline_s = program.network.mission.limits.deadline_s
    # A check admits a billionth of the capacity, which where ω is tiny is worth some of the hover.
    battery = program.network.mission.battery
    hover_A = max((-each.current_A for each in plan.phases if each.kind == "hover"), default=1.0)
    spare_As = INSIDE * battery.packs * battery.capacity_As
    more_s = CASADI_S + spare_As / (battery.available_fraction * max(hover_A, 1e-3))
    for engine, slot_s in (("casadi", None), ("grid", deadline_s / 97.0)):
        found = by(program, engine, slot_s).solve()
        tally[f"by {engine}"] += 1
        if found:
            assert found.flyable
            assert found.hover_time_s <= best_s + more_s
        if plan and slot_s is None:
            reached_s = found.hover_time_s if found else -math.inf
            tally[f"{engine} short"] += reached_s < best_s - 1e-2


def drawn(rng: np.random.Generator) -> tuple[Mission, Formulation, Perspective]:
    """A shipped town with other wells, a problem and a perspective."""
    name = TOWNS[rng.integers(2)]
    ends = rng.random(2)
    shares = [1e-6, 0.999999, 10.0 ** rng.uniform(-6.0, 0.0), 1.0 - 10.0 ** rng.uniform(-6.0, -0.3)]
    share = shares[np.searchsorted([0.05, 0.1, 0.6], ends[0])]
    rates = [0.0, 1000.0, 1e-6 * 10.0 ** rng.uniform(-6.0, 0.0), 10.0 ** rng.uniform(-6.0, 3.0)]
    rate_per_s = rates[np.searchsorted([0.05, 0.1, 0.15], ends[1])]
    values: dict[str, object] = {
        "battery.available_fraction": float(np.clip(share, 1e-6, 0.999999)),
        "battery.flow_rate_per_s": float(rate_per_s),
        "limits.deadline_s": float(rng.choice([100.0, 800.0, 1200.0, 3000.0])),
        "limits.min_soc": float(rng.choice([0.0, 0.05, 0.5])),
    }
    if name == "paper-table2" and rng.random() < 0.5:
        values["flight.flight_current_A"] = rng.uniform(1.0, 100.0)
        values["flight.hover_current_A"] = rng.uniform(1.0, 100.0)
    problems: list[Formulation] = [P1(), P1(), P3(), P4(f"b{rng.integers(1, 11)}")]
    problem = problems[rng.integers(4)]
    perspective: Any = AVAILABLE if rng.random() < 0.6 else rng.choice(list(PERSPECTIVES))
    return town(name, values, laser=bool(rng.random() < 0.75)), problem, str(perspective)


def campaign(count: int, seed: int, tally: Counter[str]) -> None:
    """So many missions, each from a seed of its own, which a failure names."""
    for number in range(count):
        rng = np.random.default_rng([seed, number])
        mission, problem, perspective = drawn(rng)
        try:
            judge(mission, problem, perspective, tally)
        except BaseException as error:
            error.add_note(f"mission {number} of seed {seed}")
            raise


def test_extreme_wells_are_answered_right() -> None:
    """Twenty-four of the missions of the campaign below."""
    campaign(24, 0, Counter())


@pytest.mark.soak
def test_ten_thousand_extreme_wells(record_property: Any) -> None:
    """The campaign; how many had which answer is counted."""
    tally = Counter[str]()
    campaign(10_000, 1, tally)
    record_property("count", ", ".join(f"{name}: {n}" for name, n in sorted(tally.items())))

"""Shadow prices against finite differences, on both sides, at kinks and away from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

import optuav
from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from optuav.engines import closed_form, grid
from optuav.engines.casadi_engine import Casadi
from optuav.engines.prices import ShadowPrice
from optuav.modelling import Model, Parameter
from optuav.solving import formulate
from optuav.status import Status
from tests.engines.optimality import solved
from tests.engines.random_missions import random_quantities
from tests.formulations.given import LINEAR, quantities

KINKS = (
    "none",
    "no time",
    "charge for all of the time",
    "no rest",
    "no charge",
    "η0 = 0",
    "all rest",
)
TOLERANCE = {"closed-form": 3e-4, "cvxpy": 3e-4, "casadi": 1e-3}


def at_kink(given: Quantities, kink: str) -> Quantities:
    """The quantities moved to where the best value bends, or where it ends."""
    left_s = given.deadline_s - given.flight_time_s

    def with_charge(spent_As: float) -> Quantities:
        capacity_As = (given.flight_charge_As + spent_As) / (1.0 - given.min_soc) / given.packs
        return replace(given, capacity_As=capacity_As) if capacity_As > 0.0 else given

    return {
        "none": lambda: given,
        "no time": lambda: replace(given, deadline_s=given.flight_time_s),
        "charge for all of the time": lambda: with_charge(given.hover_current_A * left_s),
        "no rest": lambda: replace(given, rest_current_A=0.0, rest_received_W=0.0),
        "no charge": lambda: with_charge(0.0),
        "η0 = 0": lambda: replace(given, min_soc=0.0),
        "all rest": lambda: with_charge(-given.rest_current_A * left_s),
    }[kink]()


def differences(model: Model, name: str, step: float) -> list[float]:
    """(v(p) − v(p ∓ step))/±step, below and above; infinite where nothing is feasible."""
    value = float(model.parameters[name].value)
    found = closed_form.solve(model, 3, {name: value + step * np.array([-1.0, 0.0, 1.0])})
    assert set(found.statuses) <= {Status.INFEASIBLE, Status.OPTIMAL}
    worst = -math.inf if model.sense == "maximise" else math.inf
    below, here, above = (
        worst if status is Status.INFEASIBLE else float(best)
        for status, best in zip(found.statuses, found.objective, strict=True)
    )
    return [(here - below) / step, (above - here) / step]


def agrees(price: ShadowPrice, model: Model, name: str, tolerance: float) -> bool:
    """Whether both sides are as differences over one of some steps have it.

    Over a small step rounding counts, over a large one another constraint may take over.
    """
    size = abs(float(model.parameters[name].value)) or 1.0
    return any(
        tuple(size * side for side in price)
        == pytest.approx(
            [size * side for side in differences(model, name, step * size)],
            rel=tolerance,
            abs=tolerance,
        )
        for step in (1e-5, 1e-4, 1e-6)
    )


def disagreements(model: Model, engine: str) -> tuple[int, list[str]]:
    """How many prices an engine gives, and which of them differences contradict."""
    found = solved(engine, model)
    if not found.status.has_answer:
        return 0, []
    prices = found.shadow_prices()
    assert prices.keys() == model.parameters.keys()
    wrong = [
        f"{engine} {model.title} {name} = {model.parameters[name].value}: {price}\n{model}"
        for name, price in prices.items()
        if not agrees(price, model, name, TOLERANCE[engine])
    ]
    return len(prices), wrong


def feasible(model: Model) -> bool:
    return closed_form.solve(model, 1).status is Status.OPTIMAL


FORMULATIONS: tuple[Formulation, ...] = (P3(), P4("b1"), P1(), P2(tight=True))


def compare(
    rng: np.random.Generator, engine: str, kink: str, perspectives: Sequence[str] = LINEAR
) -> tuple[int, list[str]]:
    """Prices of one random mission."""
    count, wrong = 0, []
    drawn = at_kink(random_quantities(rng), kink)
    for formulation in FORMULATIONS:
        for perspective in perspectives:
            model = formulation.model(drawn, perspective)
            if feasible(model):
                more, bad = disagreements(model, engine)
                count, wrong = count + more, wrong + bad
    return count, wrong


@pytest.mark.parametrize(
    ("engine", "kink"),
    [
        *(("closed-form", kink) for kink in KINKS),
        *(("cvxpy", kink) for kink in KINKS[::2]),
        *(("casadi", kink) for kink in KINKS[1::2]),
    ],
)
def test_prices_are_differences(engine: str, kink: str) -> None:
    """Of every parameter of random P3, P4 and P2-tight, to either side."""
    rng, count = np.random.default_rng(KINKS.index(kink) + 1), 0
    while not count:
        perspective = LINEAR[int(rng.integers(len(LINEAR)))]
        count, wrong = compare(rng, engine, kink, [perspective])
    assert not wrong, wrong[0]


@pytest.mark.soak
@pytest.mark.parametrize(
    ("engine", "prices"), [("closed-form", 60_000), ("cvxpy", 20_000), ("casadi", 10_000)]
)
def test_soak_prices(engine: str, prices: int) -> None:
    """Tens of thousands of prices."""
    rng, count, wrong = np.random.default_rng(), 0, list[str]()
    while count < prices:
        more, bad = compare(rng, engine, KINKS[rng.integers(len(KINKS))])
        count, wrong = count + more, wrong + bad
    print(f"\n{engine}: {count} shadow prices, disagreements: {len(wrong)}")
    assert not wrong, "\n".join(wrong[:10])


def test_comparison_can_fail() -> None:
    """A wrong side is told, and a finite price where that side is infeasible."""
    model = P3().model(quantities(deadline_s=50.0), "battery")
    right = ShadowPrice(math.inf, 1.0)
    assert agrees(right, model, "deadline_s", 1e-6)
    for wrong in (
        ShadowPrice(1.0, 1.0),
        ShadowPrice(math.inf, 1.1),
        ShadowPrice(math.inf, math.inf),
    ):
        assert not agrees(wrong, model, "deadline_s", 1e-6)


def test_tied_and_degenerate_entries_are_told_apart() -> None:
    """Of three programmes one is regular, one has a kink, one has no answer."""
    given = quantities(
        capacity_As=np.array([500.0, 8000.0 / 9.0, 500.0]),
        deadline_s=np.array([200.0, 200.0, 40.0]),
    )
    solution = closed_form.solve(P4("b1").model(given, "battery"), 3)
    # By hand: 1/3 where charge and deadline meet; 1 less and 1/3 more where T' = 0 besides.
    assert solution.shadow_prices(0)["deadline_s"] == pytest.approx((1 / 3, 1 / 3))
    assert solution.shadow_prices(1)["deadline_s"] == pytest.approx((1.0, 1 / 3))
    assert solution.shadow_prices(2) == {}


@pytest.mark.parametrize("perspective", LINEAR)
def test_engines_give_the_same_prices(perspective: str) -> None:
    """Of P4 on a building of the paper."""
    program = formulate("paper", optuav.P4("b9", order="hover-first"), perspective=perspective)
    (part,) = program.parts
    reference = closed_form.solve(part.model, 1).shadow_prices()
    assert reference["deadline_s"].more > 0.0
    for engine in ("cvxpy", "casadi"):
        prices = solved(engine, part.model).shadow_prices()
        for name, price in reference.items():
            assert tuple(prices[name]) == pytest.approx(tuple(price), rel=1e-5, abs=1e-9), name


def test_wells_have_the_prices_of_charge_balance() -> None:
    """What is charge in one is y1 + y2 in the other; k_F and ω move nothing."""
    (linear,) = formulate(
        "paper", optuav.P4("b9", order="hover-first"), perspective="battery"
    ).parts
    (wells,) = formulate("paper", optuav.P4("b9", order="hover-first"), perspective="wells").parts
    reference = closed_form.solve(linear.model, 1).shadow_prices()
    prices = Casadi().solve(wells.model, 1).shadow_prices()
    for name in ("deadline_s", "min_soc", "capacity_As", "hover_current_A", "rest_current_A"):
        assert tuple(prices[name]) == pytest.approx(tuple(reference[name]), rel=1e-5), name
    for name in ("flow_rate_per_s", "available_fraction"):
        assert prices[name].more == pytest.approx(0.0, abs=1e-3)


AT_THE_EDGE = {
    "hover_distance_m": 500.0,
    "coverage_radius_m": 500.0,
    "hover_altitude_m": 50.0,
    "min_altitude_m": 50.0,
    "max_altitude_m": 120.0,
    "end_gap_m": 0.0,
}


def test_p1_at_the_edge_of_the_coverage() -> None:
    """Less reach makes the mission infeasible, more of it brings nothing to a fixed point."""
    prices = closed_form.solve(P1().model(quantities(**AT_THE_EDGE), "battery"), 1).shadow_prices()
    assert tuple(prices["coverage_radius_m"]) == (math.inf, 0.0)
    assert tuple(prices["hover_distance_m"]) == (0.0, -math.inf)
    assert tuple(prices["min_altitude_m"]) == (0.0, -math.inf)
    assert tuple(prices["max_altitude_m"]) == (0.0, 0.0)


def test_objective_may_hold_parameters_itself() -> None:
    """P2 counts the flight: a second more of it costs one, and the time that is left besides."""
    prices = closed_form.solve(P2().model(quantities(**AT_THE_EDGE), "battery"), 1).shadow_prices()
    assert tuple(prices["flight_time_s"]) == (1.0, 1.0)


@pytest.mark.parametrize(
    ("less", "more", "kink"),
    [(1.0, 1.0, False), (1.0, 1.0 + 1e-9, False), (1.0, 1.1, True), (math.inf, 1.0, True),
     (0.0, 0.0, False), (0.0, 1e-12, True), (1e-13, 2e-13, True), (math.inf, math.inf, False)],
)  # fmt: skip
def test_what_counts_as_a_kink(less: float, more: float, kink: bool) -> None:
    """Whatever the unit of the objective: a price that is rounding is exactly 0."""
    assert ShadowPrice(less, more).has_kink is kink


def test_no_prices_without_an_answer_or_multipliers() -> None:
    """An infeasible programme, an error, and an answer in whole slots have none."""
    infeasible = closed_form.solve(P3().model(quantities(deadline_s=0.0), "battery"), 1)
    assert infeasible.shadow_prices() == {}
    assert (
        closed_form.solve(P3().model(quantities(deadline_s=math.nan), "battery"), 1).shadow_prices()
        == {}
    )
    in_slots = grid.solve(P4("b1").model(quantities(), "battery"), 1, slot_s=1.0)
    assert in_slots.shadow_prices() == {}


def test_bounds_with_parameters_have_their_price() -> None:
    """Lower and upper bound of an unknown share a label; the one that is met counts."""
    model = Model("bounds")
    low, high = Parameter("low", "low", "s", 2.0), Parameter("high", "high", "s", 5.0)
    x = model.variable("x", "x", unit="s", lower=low, upper=high)
    y = model.variable("y", "y", unit="s", lower=low, upper=high)
    model.maximise(x - 3.0 * y)
    for engine in ("closed-form", "cvxpy", "casadi"):
        prices = solved(engine, model).shadow_prices()
        assert tuple(prices["high"]) == pytest.approx((1.0, 1.0), rel=1e-6)
        assert tuple(prices["low"]) == pytest.approx((-3.0, -3.0), rel=1e-6)

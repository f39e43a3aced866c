"""Shadow prices under `available` against differences of what bracket proves, on both sides."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from optuav.engines import bracket, grid
from optuav.engines.prices import ShadowPrice
from optuav.engines.solution import Status
from optuav.modelling import Model
from optuav.physics.kibam import Stage
from optuav.solving import formulate
from tests.engines.optimality import solved
from tests.engines.random_missions import random_quantities
from tests.engines.test_missions_agree import differences_of_best, shared_parameters, sides_agree
from tests.engines.test_prices import KINKS, at_kink
from tests.formulations.given import quantities

WITHIN = {"rel": 1e-3, "abs": 3e-3}
"""How far a price may be from a difference [s], for all of its parameter."""
STEPS = (1e-4, 1e-5, 1e-3)
"""Shares of a parameter: over a small one the width of the bracket counts, over a large one the
curvature."""
SHORT_STEPS = (3e-7, 1e-7)
TOO_SHORT_S = 1e-4
"""By how much a local optimum may be short of the proved one to be compared with it."""


def model_of(formulation: Formulation, given: Quantities) -> Model:
    """The model of an itinerary, which rests where the formulation does."""
    if isinstance(formulation, P3):
        steps = tuple(step for step in given.steps if step != "rest")
        given = replace(given, rests=False, steps=steps)
    return formulation.model(given, "available")


def differences(
    model: Model, names: Iterable[str], steps: Sequence[float]
) -> dict[tuple[str, float], list[float]]:
    """(v(p ± h) − v(p))/h for all of a parameter, below and above, by name and step.

    All of them are solved for at once; infinite where nothing is feasible.
    """
    values = model.row(0)
    moves = [(name, step) for name in names for step in steps]
    changed = {name: np.full(2 * len(moves), value) for name, value in values.items()}
    for place, (name, step) in enumerate(moves):
        size = abs(values[name]) or 1.0
        changed[name][2 * place : 2 * place + 2] += step * size * np.array([-1.0, 1.0])
    found = bracket.solve(model, 2 * len(moves), changed)
    here_s = bracket.solve(model, 1).objective[0]
    none = np.array([each is Status.INFEASIBLE for each in found.statuses])
    gains_s = np.where(none, -np.inf, found.objective - here_s).reshape(-1, 2) * (-1.0, 1.0)
    return {move: (gain_s / move[1]).tolist() for move, gain_s in zip(moves, gains_s, strict=True)}


def contradicted(model: Model, prices: Mapping[str, ShadowPrice]) -> Iterator[str]:
    """Prices of which a side is not as differences over one of some steps have it.

    Where the best value bends within these, as where a rest brings microseconds, they have to be as
    differences over two much shorter ones, to what is known of a time.
    """
    found = differences(model, prices, STEPS)
    for name, price in prices.items():
        size = abs(model.row(0)[name]) or 1.0
        stated = [size * side for side in price]
        sides = [found[name, step] for step in STEPS]
        if not any(stated == pytest.approx(each, **WITHIN) for each in sides):
            for (_, step), each in differences(model, [name], SHORT_STEPS).items():
                if stated != pytest.approx(each, rel=1e-3, abs=bracket.WIDTH_S / step):
                    yield f"{model.title} {name} of {size}: {stated} s, by differences {sides}"
                    break


def compare(rng: np.random.Generator, engine: str, kink: str) -> tuple[int, list[str]]:
    """How many prices an engine gives for a random itinerary, and which differences contradict."""
    count, wrong = 0, []
    given = at_kink(random_quantities(rng), kink)
    for formulation in (P3(), P4("b1"), P1()):
        model = model_of(formulation, given)
        proved = bracket.solve(model, 1)
        if not proved.status.has_answer:
            continue
        found = solved(engine, model)
        if not found.objective[0] > proved.objective[0] - TOO_SHORT_S:
            continue
        prices = found.shadow_prices()
        assert prices.keys() == model.parameters.keys()
        count += len(prices)
        wrong += [f"{engine} {each}\n{given}" for each in contradicted(model, prices)]
    return count, wrong


@pytest.mark.parametrize("kink", ["none", "no rest", "charge for all of the time"])
@pytest.mark.parametrize("engine", ["bracket", "casadi"])
def test_prices_are_differences(engine: str, kink: str) -> None:
    """Of every parameter of a random P3, P4 and P1, stages of flight among them."""
    rng, count = np.random.default_rng(KINKS.index(kink)), 0
    while not count:
        count, wrong = compare(rng, engine, kink)
    assert not wrong, wrong[0]


@pytest.mark.soak
@pytest.mark.parametrize(("engine", "prices"), [("bracket", 4000), ("casadi", 2000)])
def test_soak_prices(engine: str, prices: int, record_property: Any) -> None:
    """Thousands of prices."""
    rng, count, wrong = np.random.default_rng(), 0, list[str]()
    while count < prices:
        more, bad = compare(rng, engine, str(rng.choice(KINKS)))
        count, wrong = count + more, wrong + bad
    record_property("count", f"{engine}: {count} shadow prices, disagreements: {len(wrong)}")
    assert not wrong, "\n".join(wrong[:10])


def test_a_rest_without_charge_may_be_of_any_length() -> None:
    """More current would help the longest of them: (T_max − T_fl − Δ)/I seconds an ampere.

    By hand, with wells that level out at once: 3000 A s down to 20 %, 500 of them for flying, at
    10 A leave 190 s of hover; of the other 900 s 710 s to rest.
    """
    leg = Stage(-5.0, 100.0 / 3.0)
    given = quantities(
        deadline_s=1000.0,
        min_soc=0.2,
        packs=1.0,
        capacity_As=3000.0,
        flight_time_s=100.0,
        flight_charge_As=500.0,
        hover_current_A=10.0,
        rest_current_A=0.0,
        available_fraction=0.9,
        flow_rate_per_s=1.0,
        steps=(leg, "hover", leg, "rest", leg),
    )
    for engine in ("bracket", "casadi"):
        found = solved(engine, P4("b1").model(given, "available"))
        assert found.point(0) == pytest.approx(
            {"hover_time_s": 190.0, "rest_time_s": 0.0}, abs=1e-4
        )
        price = found.shadow_prices()["rest_current_A"]
        assert tuple(price) == pytest.approx((0.0, 71.0), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize(
    "asked",
    [P3(), P4("b9", order="hover-first"), P1()],
    ids=["direct", "b9", "all"],
)
def test_prices_of_the_paper(asked: Formulation) -> None:
    """Of the mission's plans, by both engines the same; what a grid finds has none."""
    program = formulate("paper", asked)
    compiled, prices = program.compile("bracket"), program.shadow_prices()
    here_s = compiled.solve().objective[0]
    for name, value in shared_parameters(program).items():
        stated = [value * side for side in prices[name]]
        found = differences_of_best(compiled, here_s, name, value, 1e-4)
        assert sides_agree(stated, found, WITHIN), name
    assert prices["capacity_As"].more > 0.0
    if not isinstance(asked, P1):
        (part,) = program.parts
        for name, price in solved("casadi", part.model).shadow_prices().items():
            assert tuple(price) == pytest.approx(tuple(prices[name]), rel=1e-5, abs=1e-7), name
        assert grid.solve(part.model, 1, slot_s=30.0).shadow_prices() == {}


@pytest.mark.parametrize("seed", [3403, 1176, 1730])
def test_a_flat_optimum_has_prices(seed: int) -> None:
    """Where a rest that hardly matters is known to fewer digits than the wells' limit.

    In the second third the best rest lasts until the deadline, and the answer ends just before it;
    or less current than −3e-7 A ends what the rest brings, in which there is no kink at 0 A.
    """
    rng = np.random.default_rng(seed)
    count, wrong = compare(rng, "bracket", str(rng.choice(KINKS)))
    assert count
    assert not wrong

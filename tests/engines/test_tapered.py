"""Charging that tapers: answers and bounds against the tests' own wells on dense grids."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from optuav.engines import bracket, grid
from optuav.engines.solution import Solution
from optuav.mission import load
from optuav.modelling import Model, check
from optuav.solving import formulate
from optuav.solving.question import problem_of
from optuav.status import Status
from tests.engines.random_missions import random_quantities
from tests.kibam import Floats, Kibam

ROUNDING = 1e-10
"""Share of the capacity that is more than rounding of the oracle."""


def margin(given: Quantities, hover_s: Any, rest_s: Any) -> Floats:
    """By how much the wells keep their limits at Δ and T', as a share of the capacity."""
    wells = Kibam(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    for step in given.steps:
        if step == "hover":
            wells.taper(-given.hover_current_A, hover_s)
        elif step == "rest":
            wells.taper(given.rest_current_A, rest_s)
        else:
            wells.spend(step.current_A, step.duration_s)
    return np.minimum(wells.least, wells.soc - given.min_soc)


def strong(given: Quantities, seed: int) -> Quantities:
    """The same over a longer time, at times with a laser that carries the hover, and tapering."""
    rng = np.random.default_rng(seed)
    hover_A = given.hover_current_A * rng.choice([1.0, 0.1, -0.5])
    rest_A = given.rest_current_A * rng.choice([1.0, 4.0])
    deadline_s = given.deadline_s * rng.choice([1.0, 3.0])
    min_soc = rng.choice([given.min_soc, 0.9])
    return replace(
        given,
        hover_current_A=hover_A,
        rest_current_A=rest_A,
        deadline_s=deadline_s,
        min_soc=min_soc,
        hover_distance_m=300.0,
        hover_altitude_m=60.0,
        tapers=True,
    )


def declared(given: Quantities) -> Model:
    """(P4), or (P3) where the route passes no building."""
    return (P4("b1") if "rest" in given.steps else P3()).model(given, "available")


def asked(seed: int) -> Quantities:
    """Quantities of every third itinerary without a rest."""
    given = strong(random_quantities(np.random.default_rng(seed)), seed)
    if seed % 3:
        return given
    return replace(given, steps=tuple(each for each in given.steps if each != "rest"), rests=False)


def times(given: Quantities, found: Solution, count: int = 150) -> tuple[Floats, Floats]:
    """Δ beyond what none should exceed, and T' for each, within the deadline [s]."""
    left_s, beyond_s = given.time_left, float(found.beyond[0])
    start_s = min(beyond_s + 1e-6 * left_s, left_s) if beyond_s >= 0.0 else 0.0
    near_s = start_s + (left_s - start_s) * np.geomspace(1e-7, 1.0, count)
    hover_s = np.concatenate([[start_s], near_s])[:, None]
    shares = np.concatenate([np.linspace(0.0, 1.0, count), 1.0 - np.geomspace(1e-9, 1.0, count)])
    rest_s = shares * (left_s - hover_s) if given.rests else np.zeros((1, 1))
    return hover_s, rest_s


def examined(seed: int) -> Status:
    """What bracket claims about one programme is tried out, and what the others find."""
    given = asked(seed)
    model = declared(given)
    if given.time_left < 0.0:
        assert bracket.solve(model, 1).status is Status.INFEASIBLE
        return Status.INFEASIBLE
    found = bracket.solve(model, 1)
    beyond = margin(given, *times(given, found))
    if found.status is Status.INFEASIBLE or float(found.beyond[0]) < given.time_left * (1 - 1e-6):
        assert beyond.max() < ROUNDING, f"seed {seed}: a longer hover is possible"
    if found.status.has_answer:
        point = found.point(0)
        hover_s, rest_s = point["hover_time_s"], point.get("rest_time_s", 0.0)
        assert margin(given, hover_s, rest_s) >= -ROUNDING, f"seed {seed}: not feasible"
        assert all(row.satisfied for row in check(model, {**model.row(0), **point}))
    return found.status


@pytest.mark.parametrize("seed", [*range(1, 7), 104, 115, 197])
def test_bracket_against_a_dense_grid(seed: int) -> None:
    """A feasible time, and nothing beyond what none should exceed, whatever charges."""
    assert examined(seed) in (Status.OPTIMAL, Status.FEASIBLE, Status.INFEASIBLE)


@pytest.mark.soak
def test_bracket_against_dense_grids(record_property: Any) -> None:
    """The same over a thousand programmes, most of them extreme; a few are left undecided."""
    tally = Counter(examined(seed).value for seed in range(100, 1100))
    record_property("count", ", ".join(f"{name}: {count}" for name, count in tally.items()))
    assert tally["optimal"] > 300
    assert tally["error"] < 20


BASE = {"battery.charging": "taper"}
STRONG = {"laser.power_W": 12_000.0, "battery.charge_current_A": 120.0}
MISSIONS = {
    "rest first, held full": (BASE, "P4", "rest-first"),
    "rest first, much to be left": (
        {**BASE, "limits.min_soc": 0.9, "limits.deadline_s": 3000.0},
        "P4",
        "rest-first",
    ),
    "hover first": (BASE, "P4", "hover-first"),
    "hovering charges": ({**BASE, **STRONG, "limits.min_soc": 0.9}, "P3", None),
}


def programme(changes: dict[str, Any], problem: str, order: str | None) -> Model:
    """One itinerary of `paper` with changes, by way of b9 or direct."""
    building = "b9" if problem == "P4" else None
    mission = load("paper").replace(changes)
    (part,) = formulate(mission, problem_of(problem, building=building, order=order)).parts
    return part.model


@pytest.mark.parametrize("asked", MISSIONS.values(), ids=list(MISSIONS))
def test_whole_slots_agree(asked: tuple[dict[str, Any], str, str | None]) -> None:
    """The grid, which evaluates the taper in every cell, comes within a slot of the answer."""
    model, slot_s = programme(*asked), 10.0
    found, searched = bracket.solve(model, 1), grid.solve(model, 1, slot_s=slot_s)
    assert found.status is (Status.FEASIBLE if asked[2] == "rest-first" else Status.OPTIMAL)
    assert found.beyond[0] - found.objective[0] < 0.5
    short_s = float(found.beyond[0] - searched.objective[0])
    assert -1e-9 <= short_s <= 2.0 * slot_s


def test_a_bound_is_no_worse_than_at_constant_current() -> None:
    """The plan that stops charging once y1 is full can be flown as well; no limit of it binds.

    On paper the taper is worth thousandths of a second of hover, by a rest that is longer.
    """
    changes, *asked = MISSIONS["rest first, held full"]
    tapered = bracket.solve(programme(changes, *asked), 1)
    constant = bracket.solve(programme({}, *asked), 1)
    assert 1e-3 < tapered.objective[0] - constant.objective[0] < 1e-2
    assert tapered.values["rest_time_s"][0] > constant.values["rest_time_s"][0] + 100.0
    assert tapered.binding_labels(0) == ("P4.a not dry after stage 5 of flight 3",)
    assert not tapered.multipliers_at(0)


def test_the_bound_holds_over_all_programmes_at_once() -> None:
    """Many itineraries in one call get what each gets alone."""
    few = {f"buildings.b{k}": None for k in range(2, 9)}
    program = formulate(load("paper").replace({**BASE, **few, "limits.deadline_s": 2400.0}))
    for part in program.parts:
        together = bracket.solve(part.model, len(part.routes))
        for index in range(len(part.routes)):
            row = part.model.row(index)
            alone = bracket.solve(part.model, 1, {k: np.array([v]) for k, v in row.items()})
            assert alone.objective[0] == pytest.approx(together.objective[index], abs=1e-7)
            assert alone.beyond[0] == pytest.approx(together.beyond[index], abs=1e-7)
            assert alone.status is together.statuses[index]

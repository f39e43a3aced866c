"""An unknown that stands for a number of the mission is in the plan's mission, and can be flown."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.modelling import Model
from optuav.status import Status

PAPER = optuav.load("paper")


@dataclass(frozen=True)
class Least(optuav.Formulation):
    """Least number of the mission that a hover of 300 s needs."""

    unknown: str = "capacity_As"
    field: str = "capacity_As"
    unit: str = "A s"
    least: float = 1e3
    most: float = 1e5

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        size = model.variable(self.unknown, "u", unit=self.unit, lower=self.least, upper=self.most)
        model.minimise(size)
        sized = replace(given, **{self.field: size})
        model.subject_to("hover", hover == 300.0, unit="s")
        model.subject_to("charge", sized.soc_end(hover, rest) >= given.min_soc)
        sized.keep_wells(model, "battery", hover, rest)
        sized.keep_deadline(model, "deadline", hover, rest)


@pytest.mark.parametrize("unknown", ["capacity_As", "battery_capacity_As"])
def test_the_smallest_battery_flies_its_own_plan(unknown: str, tmp_path: Path) -> None:
    """The wells bind, so that any smaller pack falls by the judge, and so would the mission's."""
    plan = optuav.solve(PAPER, Least(unknown, least=2e4), engine="casadi")
    assert plan.mission.battery.capacity_As == plan.objective
    assert 2e4 < plan.objective < 36_000.0
    assert plan.flyable
    assert plan.soc["battery"] == pytest.approx(
        (sum(plan.phases[-1].available_As) + sum(plan.phases[-1].bound_As)) / (2 * plan.objective)
    )
    plan.save(tmp_path / "plan.json")
    assert optuav.load_plan(tmp_path / "plan.json") == plan
    assert optuav.audit(tmp_path / "plan.json")
    stops = [optuav.Stop(stop.at, stop.kind, stop.duration_s) for stop in plan.stops]
    for share, flies in ((1.0, True), (0.99, False)):
        mission = PAPER.replace({"battery.capacity_As": share * plan.objective})
        assert optuav.replay(optuav.Itinerary(mission, tuple(stops))).flyable == flies


def test_the_shortest_deadline_is_that_of_the_plan() -> None:
    """The direct flight and 300 s of hover: 75.79 s and 300 s (SPEC)."""
    problem = Least("deadline_s", "deadline_s", "s", 1.0, 1e4)
    plan = optuav.solve(PAPER, problem, perspective="battery")
    assert plan.mission.limits.deadline_s == pytest.approx(375.79, abs=0.01)
    assert plan.mission_time_s == pytest.approx(plan.mission.limits.deadline_s, abs=1e-6)
    assert plan.flyable


@dataclass(frozen=True)
class Power(optuav.Formulation):
    """Longest hover beside a laser whose power is an unknown, at a fixed value."""

    power_W: float = 700.0

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        power = model.variable("laser_power_W", "P", unit="W", upper=1e4)
        model.maximise(hover)
        model.subject_to("power", power == self.power_W, unit="W")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_deadline(model, "deadline", hover, rest)


def test_what_follows_from_the_number_follows_in_the_plan() -> None:
    """The light on the roof is that of 700 W, by the judge: wells, energies and all."""
    plan = optuav.solve(PAPER, Power(building="b1"), perspective="battery")
    stops = tuple(optuav.Stop(stop.at, stop.kind, stop.duration_s) for stop in plan.stops)
    weaker = PAPER.replace({"laser.power_W": 700.0})
    judged = optuav.replay(optuav.Itinerary(weaker, stops))
    assert plan.mission.laser.power_W == pytest.approx(700.0)
    assert plan.soc == pytest.approx(judged.soc, rel=1e-6)
    assert not optuav.replay(plan).by_kind["Contradicted"]
    assert plan.rest_time_s > 0.0


@dataclass(frozen=True)
class Packs(optuav.Formulation):
    """Longest hover with a number of packs."""

    count: float = 3.0

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        packs = model.variable("packs", "n", unit="1", upper=9.0)
        model.maximise(hover)
        model.subject_to("packs", packs == self.count)
        spare_As = given.capacity_As * (1.0 - given.min_soc) * packs
        drawn_As = given.flight_charge_As + given.hover_current_A * hover
        model.subject_to("charge", drawn_As - given.rest_current_A * rest <= spare_As, unit="A s")
        given.keep_deadline(model, "deadline", hover, rest)


def test_a_number_that_no_mission_has_is_told() -> None:
    """2.5 packs: the plan is that of the mission as it is, and says so."""
    three, some = (optuav.solve(PAPER, Packs(count), perspective="battery") for count in (3.0, 2.5))
    assert three.mission.battery.packs == 3
    assert not any("found" in note for note in three.notes)
    assert some.mission == PAPER
    assert any("not those found: battery.packs = 2.5" in note for note in some.notes)


def test_other_unknowns_leave_the_mission_as_it_is() -> None:
    plan = optuav.solve(PAPER, Least("size_As", least=2e4), perspective="battery")
    assert plan.mission == PAPER
    assert plan.status in (Status.OPTIMAL, Status.LOCALLY_OPTIMAL)

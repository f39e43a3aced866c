"""The quick test of feasibility says what solving says."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from formulations.formulation import Formulation, Given
from optuav.diagnosis.explain import question_of
from optuav.diagnosis.repair import feasible
from optuav.mission import Mission
from optuav.modelling import Model
from tests.diagnosis.missions import CHANGES, OPTIONS, PAPER, SMALL

questions = st.sampled_from([*OPTIONS, {"problem": "P1", "slot_s": 5.0}])
changes = st.fixed_dictionaries({}, optional=CHANGES)


def is_feasible(mission: Mission, **options: Any) -> bool:
    (found,) = feasible([question_of(mission, **options).case(mission)])
    return found


@given(changes, questions)
def test_it_agrees_with_the_engines(change: dict[str, Any], options: dict[str, Any]) -> None:
    """Closed form and grid, from impossible to easy missions."""
    mission, given_options = SMALL.replace(change), {"perspective": "battery", **options}
    found = is_feasible(mission, **given_options)
    assert found == bool(optuav.solve(mission, **given_options))


LASTING: tuple[dict[str, Any], ...] = (
    {},
    {"problem": "P3"},
    {"problem": optuav.P4("b1", order="hover-first")},
    {"problem": "P2"},
)


@settings(max_examples=4)
@given(st.lists(changes, min_size=2, max_size=3), st.sampled_from(LASTING))
def test_missions_judged_together_are_judged_as_alone(
    some: list[dict[str, Any]], options: dict[str, Any]
) -> None:
    """Through the wells by bracket: stacked into one declaration, each keeps its own figures."""
    missions = [SMALL.replace(change) for change in some]
    together = feasible([question_of(each, **options).case(each) for each in missions])
    assert together == [bool(optuav.solve(mission, **options)) for mission in missions]


@pytest.mark.parametrize(("packs", "expected"), [(2, True), (0.1, False)])
def test_programmes_that_are_not_linear_are_decided(packs: float, expected: bool) -> None:
    """Through the wells: two legs alone take 7843 A·s."""
    mission = SMALL.replace({"battery.capacity_As": 36000 * packs})
    assert is_feasible(mission, problem="P3", perspective="wells") is expected


class Below(Formulation):
    """Longest hover beside an unknown that has to be negative."""

    def declare(self, model: Model, given: Given) -> None:
        """Maximise Δ."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        model.subject_to("low", model.variable("y", "y", unit="1", lower=-10.0) <= -5.0)
        given.keep_deadline(model, "deadline", hover, rest)


def test_an_unknown_below_0_is_not_taken_for_a_time() -> None:
    """Bracketed from 0 on, nothing would satisfy y <= -5."""
    mission = SMALL.replace({"buildings": []})
    assert optuav.solve(mission, Below(), perspective="battery")
    assert is_feasible(mission, problem=Below(), perspective="battery")


def test_more_slots_than_can_be_searched() -> None:
    """With 10⁷ slots a feasible cell is found without looking at all of them."""
    mission = PAPER.replace({"limits.deadline_s": 1e7})
    options = {"problem": optuav.P4("b1"), "slot_s": 1.0, "perspective": "battery"}
    assert is_feasible(mission, **options)


@pytest.mark.parametrize(("beyond_s", "expected"), [(0.0, True), (0.5, False), (1e-3, False)])
def test_an_exact_duration_is_met_by_whole_slots_or_at_once_refused(
    beyond_s: float, expected: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """(P2) with the deadline tight: no cell is looked at where no sum of slots can be right."""
    ample = SMALL.replace({"battery.packs": 4})
    flight_s = optuav.solve(ample, "P3").flight_time_s
    mission = ample.replace({"limits.deadline_s": flight_s + 700.0 + beyond_s})
    options = {"slot_s": 1.0, "perspective": "battery"}
    problem = optuav.P2(tight=True, trajectory="direct")
    if not expected:
        monkeypatch.setattr("optuav.diagnosis.repair.grid.cells", None)
    assert is_feasible(mission, problem=problem, **options) is expected

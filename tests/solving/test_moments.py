"""Moments of a mission are told to a reader by its places, never by the number of a step."""

from __future__ import annotations

import pytest

import optuav
from formulations.soc import well_limits
from optuav.physics.kibam import Stage
from tests.asking import formulate, solve
from tests.formulations.given import quantities


def test_moments_count_flights_and_their_stages() -> None:
    flown = Stage(-100.0, 3.0)
    wells = {"available_fraction": 0.5, "flow_rate_per_s": 1e-3}
    given = quantities(**wells, steps=[flown, "rest", flown, flown, "hover"])
    limits = [each for each in well_limits(given, 1.0, 1.0) if each.kind == "dry"]
    assert [str(each.moment) for each in limits] == [
        "after stage 1 of flight 1",
        "after the rest",
        "after stage 1 of flight 2",
        "after stage 2 of flight 2",
        "after the hover",
    ]


@pytest.mark.parametrize(
    ("options", "binding"),
    [
        ({"problem": "P3"}, ("P3.a not dry at the end of the flight hover → destination",)),
        (
            {"problem": "P4", "building": "b9", "order": "hover-first"},
            (
                "P4.a not dry at the end of the flight hover → b9",
                "P4.a not dry at the end of the flight b9 → destination",
            ),
        ),
    ],
)
def test_what_binds_is_told_by_the_places_of_the_route(
    options: dict[str, str], binding: tuple[str, ...]
) -> None:
    """In `paper` the wells bind at landings: SPEC 4's 577.524 s and 597.270 s."""
    assert solve("paper", **options).binding == binding


def test_a_building_that_is_passed_by_parts_a_flight_in_two() -> None:
    """In slots, to pass b1 by is a choice of its own, and its two legs make one flight."""
    plan = solve("paper", optuav.P1(trajectory="traj1"), slot_s=10.0)
    assert not any(" of flight " in each for each in plan.binding)
    program = formulate("paper", optuav.P1(trajectory="traj1"), slot_s=10.0)
    labels = [each.label for part in program.parts for each in part.model.constraints]
    assert "P1.b not dry after stage 10 of flight 1" in labels


def test_what_does_not_hold_is_told_by_the_places_of_the_route() -> None:
    """4000 A·s a pack: 3200 of 4000 are available at once, 3921.6 are drawn to the hover point."""
    mission = optuav.load("paper").replace({"battery.packs": 1, "battery.capacity_As": 4000})
    plan = solve(mission, "P3")
    assert not plan
    assert any("of the flight origin → hover" in reason for reason in plan.reasons)


def test_that_there_is_no_plan_is_proved_in_these_words() -> None:
    plan = solve(optuav.load("paper").replace({"limits.min_soc": 0.99}))
    assert plan.proof == "bracketed: proof that no times satisfy all constraints"

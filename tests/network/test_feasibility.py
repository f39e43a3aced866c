"""Why nothing can be flown: each impossibility alone, several together, always in words."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.feasibility import blocked_legs, impossibilities
from optuav.network.network import build_network
from optuav.network.routes import NO_LEG
from tests.examples import few
from tests.mission.strategies import missions

PAPER = optuav.load("paper")
WALL = {"name": "wall", "position_m": [1000, 2300, 300], "footprint_m": [3000, 100]}

HEAVY = {"body.mass_kg": 2.0}
STORM = {"wind.force_N": [11.6, 0, 0]}
WEAK = {"rotor.max_speed_rad_s": 900}
FAR = {"link.device_m": [1000, 3000, 600]}
DEAF = {"link.snr_threshold_dB": 60}
OUTSIDE = {"route.hover_m": [1000, 2000, 50]}
LOW = {"route.hover_m": [1000, 2900, 49]}
HIGH = {"route.hover_m": [1000, 2900, 151]}
WALLED = {"buildings": [WALL]}

ALONE: list[tuple[dict[str, Any], list[str]]] = [
    (HEAVY, ["17.2158 N at full speed", "19.6 N", "body.mass_kg", "rotor.max_speed_rad_s"]),
    (STORM, ["weight and wind take 17.2", "wind.force_N"]),
    (WEAK, ["cannot fly", "rotor.max_speed_rad_s"]),
    (FAR, ["out of reach", "501.484 m", "550 m", "limits.min_altitude_m = 50 m", "link.device_m"]),
    (DEAF, ["out of reach", "link.transmit_power_W"]),
    (OUTSIDE, ["P1.a outage", "route.hover_m is 1001.25 m", "limits.outage_probability = 0.01"]),
    (LOW, ["P1.e altitude", "route.hover_m is at 49 m", "limits.min_altitude_m"]),
    (HIGH, ["P1.e altitude", "route.hover_m is at 151 m", "limits.max_altitude_m"]),
    (WALLED, ["origin → hover crosses building wall", "flight.through_buildings = true"]),
]


def reasons(mission: Mission) -> tuple[str, ...]:
    return impossibilities(build_network(mission))


def test_the_shipped_missions_are_possible() -> None:
    """Nothing to say about either."""
    assert reasons(PAPER) == reasons(optuav.load("paper-table2")) == ()


@pytest.mark.parametrize(("changes", "words"), ALONE)
def test_each_impossibility_alone(changes: dict[str, Any], words: list[str]) -> None:
    """One plan without answer, its reasons with the figures and the keys to change."""
    mission = PAPER.replace({"limits.max_altitude_m": 150, "limits.min_altitude_m": 50} | changes)
    found = reasons(mission)
    assert found
    for word in words:
        assert word in " ".join(found)
    plan = optuav.solve(mission, perspective="battery")
    assert not plan
    assert plan.status == "infeasible"
    assert plan.reasons == found
    for word in words:
        assert word in " ".join(plan.summary().split())


def test_impossibilities_together_are_all_told() -> None:
    """Too heavy, out of reach and outside the altitudes at once."""
    found = reasons(PAPER.replace(HEAVY | {"route.hover_m": [1000, 2000, 500]}))
    assert [text.partition(":")[0] for text in found] == [
        "the UAV cannot fly",
        "P1.a outage",
        "P1.e altitude",
    ]


def test_a_way_round_by_a_building_is_a_way() -> None:
    """The direct legs are blocked, a building is reached and left: possible."""
    screen = {"name": "screen", "position_m": [500, 1250.5, 200], "footprint_m": [20, 20]}
    stated = [*PAPER.to_dict()["buildings"], screen]
    mission = PAPER.replace({"buildings": stated})
    assert not build_network(mission).routes.flyable[0]
    assert reasons(mission) == ()
    assert optuav.solve(mission, perspective="battery").route[1] == "b1"


@pytest.mark.parametrize(
    ("hover_m", "covered"), [([1000, 2501.0153, 50], True), ([1000, 2501.01, 50], False)]
)
def test_the_rim_of_the_coverage_is_covered(hover_m: list[float], covered: bool) -> None:
    """d_max = 501.4836 m; half a centimetre further is not."""
    mission = PAPER.replace({"route.hover_m": hover_m})
    assert (reasons(mission) == ()) == covered


def test_the_hover_point_of_the_link_may_be_stated() -> None:
    """w_U itself, to the last digit."""
    hover_m = build_network(PAPER).places.position_m[1].tolist()
    assert reasons(PAPER.replace({"route.hover_m": hover_m})) == ()


@pytest.mark.campaign
@few(15, most=1000)
@given(missions())
def test_a_plan_or_reasons(mission: Mission) -> None:
    """Never neither; nothing impossible is ever planned."""
    found = reasons(mission)
    plan = optuav.solve(mission, perspective="battery")
    assert bool(plan) != bool(plan.reasons)
    assert not (found and plan)
    assert all(text and "nan" not in text for text in plan.reasons)


@pytest.mark.campaign
@few(15, most=1000)
@given(missions())
def test_blocked_tells_of_every_leg_that_cannot_be_flown(mission: Mission) -> None:
    """As many words as legs of the itinerary without passage."""
    worked_out = build_network(mission)
    for index, legs in enumerate(worked_out.routes.legs.tolist()):
        stuck = [leg for leg in legs if leg != NO_LEG and not worked_out.legs.flyable[leg]]
        assert len(blocked_legs(worked_out, index)) == len(stuck)

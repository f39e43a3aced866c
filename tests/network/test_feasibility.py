"""What makes a mission impossible or unwise, and the key that caps its charging current."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.feasibility import advice, blocked_legs, impossibilities
from optuav.network.graph import edited_network
from optuav.network.legs import NO_LEG
from optuav.network.network import build_network
from optuav.network.places import HOVER, ChargingCap, charging_cap
from optuav.network.vehicle import coverage_radius_m
from tests.examples import few
from tests.mission.strategies import missions
from tests.several_devices import three

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
    (WALLED, ["origin → hover crosses building wall", 'flight.obstacles = "over"']),
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
@few(5, most=1000)
@given(missions())
def test_a_plan_or_reasons(mission: Mission) -> None:
    """Never neither; nothing impossible is ever planned, and all of it is among the advice."""
    found = reasons(mission)
    plan = optuav.solve(mission, perspective="battery")
    assert bool(plan) != bool(plan.reasons)
    assert not (found and plan)
    assert all(text and "nan" not in text for text in plan.reasons)
    # As many words as legs of the itinerary without passage.
    network = build_network(mission)
    for index, legs in enumerate(network.routes.legs.tolist()):
        stuck = [leg for leg in legs if leg != NO_LEG and not network.legs.flyable[leg]]
        assert len(blocked_legs(network, index)) == len(stuck)
    # `validate` warns of what will make the plan infeasible.
    found = [*advice(mission)]
    assert set(impossibilities(build_network(mission))) <= set(found)
    assert all(text and "nan" not in text for text in found)


FAST = "on the leg origin → hover, a peak of 154.9 m/s is not realistic"


def warnings(changes: dict[str, Any]) -> list[str]:
    """Warnings about the paper's mission with changes, except on its speeds and its wells."""
    told = advice(PAPER.replace(changes))
    return [each for each in told if "realistic" not in each and "wells have a lag" not in each]


def test_the_shipped_missions() -> None:
    """The paper's fly faster than any drone; in one a building really stands in the beam.

    The paper's wells are unlike any lithium cell's.
    """
    fast, wells = advice(PAPER)
    assert fast.startswith(FAST)
    assert wells.startswith("the wells have a lag (1−ω)²/k_F of 889 s")
    assert len([*advice(optuav.load("paper-table2"))]) == 2
    (warning,) = advice(optuav.load("matrice350"))
    assert warning == "the laser does not see b12: no charging there"


def test_the_fastest_leg_is_named_unless_it_is_below_40_m_s_or_stated_in_a_graph() -> None:
    """The flight models have no drag; a user who states a speed in a graph knows why."""
    slow = optuav.load("matrice350")
    (fast, _) = advice(slow.replace({"flight.max_speed_m_s": 41}))
    assert "a peak of 41.0 m/s" in fast
    assert len([*advice(slow.replace({"flight.max_speed_m_s": 40}))]) == 1


@pytest.mark.parametrize("rule", ["refuse", "over", "around"])
@pytest.mark.parametrize(
    ("end", "at_m"), [("origin", (0, 0, 50)), ("hover", (1000, 2502, 50)), ("hover", None)]
)
def test_an_end_inside_a_building_is_the_reason(
    rule: str, end: str, at_m: tuple[float, float, float] | None
) -> None:
    """Not the leg, which no way over or around the building would free."""
    x, y, _ = at_m or build_network(PAPER).places.position_m[HOVER].tolist()
    hall = {"name": "H", "position_m": [x, y, 90], "footprint_m": [80, 80]}
    changes = {"buildings": [hall], "flight.obstacles": rule}
    mission = PAPER.replace({**changes, **({} if at_m is None else {f"route.{end}_m": at_m})})
    words = " ".join(blocked_legs(build_network(mission), 0))
    assert f"{end} lies inside building H" in words
    assert "crosses" not in words
    assert '"over"' not in words
    assert reasons(mission.replace({"flight.obstacles": "ignore"})) == ()


@pytest.mark.parametrize("beyond_m", [1e-4, 1e-6])
def test_figures_that_differ_look_different(beyond_m: float) -> None:
    """A hover point a hair out of reach has a distance with more digits than its link covers."""
    reach_m = coverage_radius_m(PAPER)
    device_m = PAPER.link.device_m
    hover_m = (device_m[0], device_m[1] - np.sqrt(reach_m**2 - 50.0**2) - beyond_m, 50.0)
    (reason,) = reasons(PAPER.replace({"route.hover_m": hover_m, "link.device_m": device_m}))
    away, reach = re.findall(r"(\S+) m from the device, its link covers (\S+) m", reason)[0]
    assert float(away) > float(reach)


def test_packs_that_are_used_as_one_are_charged_as_one() -> None:
    """20 A are exactly 1 C of two packs of 36 000 A s."""
    assert warnings({"battery.charge_current_A": 20}) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"buildings.b1.position_m": (0, 0, 80), "buildings.b1.footprint_m": (50, 50)},
            "origin lies inside building b1",
        ),
        ({"battery.charge_current_A": 20.1}, "battery.charge_current_A = 20.1 A is above 1 C"),
        ({"battery.packs": 1, "battery.capacity_As": 35000}, "9.72222 A"),
        ({"body.mass_kg": 2}, "the UAV cannot fly"),
        ({"link.device_m": [1000, 3000, 600]}, "out of reach"),
        ({"route.hover_m": [1000, 2000, 50]}, "P1.a outage"),
        ({"laser.position_m": [50, 300, 1]}, "the laser does not see hover, b2"),
    ],
)
def test_advice_names_the_key_and_the_figure(changes: dict[str, Any], words: str) -> None:
    """One thing wrong, one warning."""
    (warning,) = warnings(changes)
    assert words in warning


def test_advice_tells_everything_at_once() -> None:
    """Physics, battery and sight do not hide each other."""
    found = warnings(
        {"body.mass_kg": 2, "battery.charge_current_A": 21, "laser.position_m": [50, 300, 1]}
    )
    assert [text.split()[0] for text in found] == [
        "the",
        "battery.charge_current_A",
        "the",
    ]


def test_without_a_laser_nothing_is_said_of_the_dark() -> None:
    """A mission that does not charge."""
    assert warnings({"laser": None}) == []


def test_a_radio_that_draws_more_than_a_tenth_of_the_hover_is_doubted() -> None:
    """`relay-today` hovers on 24.54 A without its radio: 5 W at 1 V are 5 A, at 2.1 V 2.38 A.

    Loads of regimes include the radio, so that its voltage counts for nothing there.
    """
    relay = optuav.load("relay-today")
    before = [*advice(relay)]
    assert not any("radio" in words for words in before)
    added = [
        words
        for words in advice(relay.replace({"link.transmit_voltage_V": 1.0}))
        if words not in before
    ]
    (doubt,) = added
    assert "the radio draws 5 A" in doubt
    assert "more than a tenth of the 24.54 A of hovering" in doubt
    assert "link.transmit_voltage_V = 1 V" in doubt
    assert "battery.nominal_voltage_V = 44.76 V" in doubt
    assert [*advice(relay.replace({"link.transmit_voltage_V": 2.1}))] == before
    regimes = optuav.load("matrice350")
    assert regimes.link.transmit_voltage_V == 1.0
    assert not any("radio" in words for words in advice(regimes))


def test_many_dark_roofs_are_not_all_named() -> None:
    """Ten and an ellipsis."""
    wall = {"name": "wall", "position_m": [1000, 50, 500], "footprint_m": [9000, 10]}
    roofs = [{"name": f"n{k}", "position_m": [1000, 300 + k, 20]} for k in range(50)]
    (warning,) = warnings({"buildings": [*roofs, wall], "flight.through_buildings": True})
    assert warning == (
        f"the laser does not see hover, {', '.join(f'n{k}' for k in range(9))}, …: no charging "
        "there"
    )


def test_the_key_that_caps_the_charging_current_is_named() -> None:
    """Stronger by any factor, the laser then charges no faster; below the cap it does."""

    def cap(changes: dict[str, Any]) -> ChargingCap | None:
        mission = PAPER.replace(changes)
        return charging_cap(mission, build_network(mission).places)

    strong = cap({"laser.power_W": 1e9})
    assert strong is not None
    caps = (
        "battery.charge_current_A = 10 A caps the charging current wherever the laser is in sight"
    )
    assert strong.words.startswith(caps)
    assert cap({"battery.charge_current_A": 0.0}) is None
    assert cap({"laser.power_W": 100.0}) is None
    assert cap({"laser": None}) is None
    hazy = cap({"laser.visibility_km": 3.0})
    assert hazy is not None
    assert "wherever" not in hazy.words
    mission = PAPER.replace({"laser.visibility_km": 3.0})
    more = mission.replace({"laser.power_W": 2000.0})
    before, after = (build_network(each).places for each in (mission, more))
    same = after.charge_current_A == before.charge_current_A
    found = {before.names[place] for place in np.flatnonzero(same)} - {"origin", "destination"}
    assert found == set(hazy.places)


def test_where_no_uav_stays_no_key_caps_its_charging() -> None:
    """A laser at the origin is strongest there, and charges at the hover point and on roofs."""
    mission = PAPER.replace({"laser.position_m": (0.0, 0.0, 40.0), "laser.visibility_km": 3.0})
    network = build_network(mission)
    assert network.places.charge_current_A[0] == 10.0
    cap = charging_cap(mission, network.places)
    assert cap is None or not {"origin", "destination"} & {*cap.places}


def test_regimes_that_state_a_charging_current_cap_it_themselves() -> None:
    """The laser's power model has no part in it."""
    mission = optuav.load("paper-table2")
    found = charging_cap(mission, build_network(mission).places)
    assert found is not None
    assert found.words.startswith("flight.charge_current_A = ")


def test_power_stated_in_a_graph_is_not_called_capped() -> None:
    """Neither key decides there."""
    view = optuav.graph(PAPER)
    for _, data in view.nodes(data=True):
        data["received_power_W"] = 1.0
    assert charging_cap(PAPER, edited_network(PAPER, view).places) is None


LITHIUM = {"battery.available_fraction": 0.1, "battery.flow_rate_per_s": 0.0027}


def test_more_current_than_wells_were_fitted_to_is_doubted() -> None:
    """Energy cells, fitted to 2 C: 24.65 A of 11.76 Ah are 2.1 C; a typed flow rate is the same."""
    dark = {"laser.power_W": 0.0, **LITHIUM}
    mission = optuav.load("matrice350").replace(dark)
    words = "beyond the 2 C to which wells `liion` were fitted: nothing is promised there"
    (told,) = (each for each in advice(mission) if words in each)
    assert told.startswith("the hover draws 24.65 A, 2.1 C, ")
    assert told in optuav.solve(mission, "P3").notes
    own = mission.replace({"battery.flow_rate_per_s": 0.0028})
    slow = mission.replace({"flight.hover_current_A": 20.0, "flight.flight_current_A": 20.0})
    for changed in (own, slow, optuav.load("matrice350"), PAPER):
        assert not any("were fitted" in each for each in advice(changed))


def test_wells_that_bind_hardly_any_charge_have_no_large_lag() -> None:
    """ω of 0.999 leaves a thousandth of the charge, however slowly it flows; ω of 0.8 a fifth."""
    slow = {"battery.flow_rate_per_s": 1.3875e-11}
    for share, doubted in ((0.999, False), (0.8, True)):
        mission = optuav.load("matrice350").replace({"battery.available_fraction": share, **slow})
        assert any("wells have a lag" in each for each in advice(mission)) == doubted


def test_a_device_without_legs_is_named_before_a_leg_of_one_order() -> None:
    """A graph without its node; a leg of the mission's own order was the first reason."""
    mission = three()
    graph = optuav.graph(mission)
    graph.remove_node("north")
    assert optuav.solve(mission, graph=graph).reasons == (
        "no leg to the hover point of device north is left in the graph",
        "no leg from the hover point of device north is left in the graph",
    )

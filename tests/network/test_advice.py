"""What the author of a mission should know: well-formed, but impossible or unwise."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.feasibility import advice, impossibilities
from optuav.network.graph import edited_network
from optuav.network.network import build_network
from optuav.network.places import ChargingCap, charging_cap
from tests.examples import few
from tests.mission.strategies import missions

PAPER = optuav.load("paper")


FAST = "on the leg origin → hover, a peak of 154.9 m/s is not realistic"


def warnings(changes: dict[str, Any]) -> list[str]:
    """Warnings about the paper's mission with changes, except on its speeds."""
    return [each for each in advice(PAPER.replace(changes)) if "realistic" not in each]


def test_the_shipped_missions() -> None:
    """The paper's fly faster than any drone; in one a building really stands in the beam."""
    (fast,) = advice(PAPER)
    assert fast.startswith(FAST)
    assert len(advice(optuav.load("paper-table2"))) == 1
    (warning,) = advice(optuav.load("matrice350"))
    assert warning == "the laser does not see b12: no charging there"


def test_the_fastest_leg_is_named_unless_it_is_below_40_m_s_or_stated_in_a_graph() -> None:
    """The flight models have no drag; a user who states a speed in a graph knows why."""
    slow = optuav.load("matrice350")
    (fast, _) = advice(slow.replace({"flight.max_speed_m_s": 41}))
    assert "a peak of 41.0 m/s" in fast
    assert len(advice(slow.replace({"flight.max_speed_m_s": 40}))) == 1


def test_packs_that_are_used_as_one_are_charged_as_one() -> None:
    """20 A are exactly 1 C of two packs of 36 000 A s."""
    assert warnings({"battery.charge_current_A": 20}) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"limits.deadline_s": 75}, "limits.deadline_s = 75 s is shorter than the flight alone"),
        ({"limits.deadline_s": 75}, "75.79 s"),
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


def test_many_dark_roofs_are_not_all_named() -> None:
    """Ten and an ellipsis."""
    wall = {"name": "wall", "position_m": [1000, 50, 500], "footprint_m": [9000, 10]}
    roofs = [{"name": f"n{k}", "position_m": [1000, 300 + k, 20]} for k in range(50)]
    (warning,) = warnings({"buildings": [*roofs, wall], "flight.through_buildings": True})
    assert warning == (
        f"the laser does not see hover, {', '.join(f'n{k}' for k in range(9))}, …: no charging "
        "there"
    )


@pytest.mark.campaign
@few(15, most=1000)
@given(missions())
def test_advice_holds_every_impossibility(mission: Mission) -> None:
    """`validate` warns of what will make the plan infeasible."""
    found = advice(mission)
    assert set(impossibilities(build_network(mission))) <= set(found)
    assert all(text and "nan" not in text for text in found)


def test_the_key_that_caps_the_charging_current_is_named() -> None:
    """Stronger by any factor, the laser then charges no faster; below the cap it does."""

    def cap(changes: dict[str, Any]) -> ChargingCap | None:
        mission = PAPER.replace(changes)
        return charging_cap(mission, build_network(mission).places)

    strong = cap({"laser.power_W": 1e9})
    assert strong is not None
    assert (strong.key, strong.current_A) == ("battery.charge_current_A", 10.0)
    assert strong.everywhere
    assert str(strong).startswith("battery.charge_current_A = 10 A caps the charging current")
    assert cap({"laser.power_W": 100.0}) is None
    assert cap({"laser": None}) is None
    hazy = cap({"laser.visibility_km": 3.0})
    assert hazy is not None
    assert not hazy.everywhere
    mission = PAPER.replace({"laser.visibility_km": 3.0})
    more = mission.replace({"laser.power_W": 2000.0})
    before, after = (build_network(each).places for each in (mission, more))
    same = after.charge_current_A == before.charge_current_A
    assert {before.names[place] for place in np.flatnonzero(same)} == set(hazy.places)


def test_regimes_that_state_a_charging_current_cap_it_themselves() -> None:
    """The laser's power model has no part in it."""
    mission = optuav.load("paper-table2")
    found = charging_cap(mission, build_network(mission).places)
    assert found is not None
    assert found.key == "flight.charge_current_A"


def test_power_stated_in_a_graph_is_not_called_capped() -> None:
    """Neither key decides there."""
    view = optuav.graph(PAPER)
    for _, data in view.nodes(data=True):
        data["received_power_W"] = 1.0
    assert charging_cap(PAPER, edited_network(PAPER, view).places) is None

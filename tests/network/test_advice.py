"""What the author of a mission should know: well-formed, but impossible or unwise."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.feasibility import advice, impossibilities
from optuav.network.network import build_network
from tests.mission.strategies import missions

PAPER = optuav.load("paper")


def test_the_shipped_missions_need_none() -> None:
    """But one, where a building really stands in the beam."""
    assert advice(PAPER) == advice(optuav.load("paper-table2")) == ()
    (warning,) = advice(optuav.load("matrice350"))
    assert warning == "the laser does not see b12: no charging there"


def test_packs_that_are_used_as_one_are_charged_as_one() -> None:
    """20 A are exactly 1 C of two packs of 36 000 A s."""
    assert advice(PAPER.replace({"battery.charge_current_A": 20})) == ()


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
    (warning,) = advice(PAPER.replace(changes))
    assert words in warning


def test_advice_tells_everything_at_once() -> None:
    """Physics, battery and sight do not hide each other."""
    mission = PAPER.replace(
        {"body.mass_kg": 2, "battery.charge_current_A": 21, "laser.position_m": [50, 300, 1]}
    )
    assert [text.split()[0] for text in advice(mission)] == [
        "the",
        "battery.charge_current_A",
        "the",
    ]


def test_without_a_laser_nothing_is_said_of_the_dark() -> None:
    """A mission that does not charge."""
    assert advice(PAPER.replace({"laser": None})) == ()


def test_many_dark_roofs_are_not_all_named() -> None:
    """Ten and an ellipsis."""
    wall = {"name": "wall", "position_m": [1000, 50, 500], "footprint_m": [9000, 10]}
    roofs = [{"name": f"n{k}", "position_m": [1000, 300 + k, 20]} for k in range(50)]
    (warning,) = advice(
        PAPER.replace({"buildings": [*roofs, wall], "flight.through_buildings": True})
    )
    assert warning == (
        f"the laser does not see hover, {', '.join(f'n{k}' for k in range(9))}, …: no charging "
        "there"
    )


@given(missions())
def test_advice_holds_every_impossibility(mission: Mission) -> None:
    """`validate` warns of what will make the plan infeasible."""
    found = advice(mission)
    assert set(impossibilities(build_network(mission))) <= set(found)
    assert all(text and "nan" not in text for text in found)

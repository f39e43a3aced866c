"""Figures that follow from a mission, against the specification and by hand."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given

import optuav
from optuav.mission import Mission
from optuav.network.feasibility import Figure, building_figures, derived
from tests.examples import few
from tests.mission.strategies import missions
from tests.solving.by_hand import hovering

PAPER = optuav.load("paper")


def figures(mission: Mission) -> dict[str, Figure]:
    return {figure.name: figure for figure in derived(mission)}


@pytest.mark.parametrize(
    ("name", "value", "unit", "digits"),
    [
        ("battery capacity B", 72000, "A s", 0.5),
        ("nominal battery energy E_0", 799200, "J", 0.5),
        ("full thrust", 4 * 3.8305e-6 * 1060**2, "N", 1e-9),
        ("weight", 12.74, "N", 1e-9),
        ("rotor speed in hover", 911.8575, "rad/s", 5e-5),
        ("largest level wind", 11.5791, "N", 5e-5),
        ("hover power, radio included", 1310.994 + 5, "W", 5e-4),
        ("hover current, radio included", 4 * 23.2276 + 5, "A", 2e-4),
        ("coverage radius d_max", 501.4836, "m", 5e-5),
        ("direct flight", 2 * 37.8961, "s", 1e-4),
        ("net current in hover", 10 - 4 * 23.2276 - 5, "A", 2e-4),
        ("power received at hover", 111, "W", 1e-9),
    ],
)
def test_figures_of_the_shipped_mission(name: str, value: float, unit: str, digits: float) -> None:
    """SPEC 4, or a line of arithmetic."""
    figure = figures(PAPER)[name]
    assert figure.value == pytest.approx(value, abs=digits)
    assert figure.unit == unit


def test_hover_point_of_the_shipped_mission() -> None:
    """w_U of SPEC 4, as a person reads it."""
    figure = figures(PAPER)["hover point"]
    assert figure.value == pytest.approx((1000, 2501.0152, 50), abs=5e-5)
    assert figure.text == "(1000.00, 2501.02, 50.00)"


def test_regimes_have_no_rotor_figures() -> None:
    """A flight log gives loads, not thrust."""
    found = figures(optuav.load("paper-table2"))
    assert "full thrust" not in found
    assert found["hover power, radio included"].value == 1032.82
    assert found["direct flight"].value == pytest.approx(59.35, abs=5e-3)


def test_what_does_not_exist_is_none() -> None:
    """Too heavy to hover; out of reach; no laser, no row about it."""
    heavy = figures(PAPER.replace({"body.mass_kg": 2}))
    assert heavy["rotor speed in hover"].value is None
    assert heavy["hover power, radio included"].text == "none"
    assert heavy["direct flight"].value is None
    far = figures(PAPER.replace({"link.device_m": [1000, 3000, 900]}))
    assert far["hover point"].value is None
    assert not [name for name in figures(PAPER.replace({"laser": None})) if "net current" in name]


def test_a_hover_point_in_the_dark_is_marked() -> None:
    """A wall in front of the laser."""
    wall = {"name": "wall", "position_m": [1000, 100, 500], "footprint_m": [900, 10]}
    found = figures(PAPER.replace({"buildings": [wall]}))
    assert found["power received at hover (no sight)"].value == 0.0


@pytest.mark.campaign
@few(5, most=1000)
@given(missions())
def test_figures_are_finite_or_none(mission: Mission) -> None:
    """Nothing NaN reaches the screen; loads by hand, and buildings as in the graph."""
    found = figures(mission)
    for figure in found.values():
        values = figure.value if isinstance(figure.value, tuple) else (figure.value,)
        assert all(value is None or math.isfinite(value) for value in values)
        assert "nan" not in figure.text
    load = hovering(mission)
    for name, expected in (("power", load.power_W), ("current", load.current_A)):
        value = found[f"hover {name}, radio included"].value
        assert value is None or value == pytest.approx(expected, rel=1e-9)
    # Flight time by way of each building, in both orders, in the order of the mission.
    rows = building_figures(mission)
    assert [row.name for row in rows] == [building.name for building in mission.buildings]
    view = optuav.graph(mission)
    for row in rows:
        ways = {
            "rest_first_s": ("origin", row.name, "hover", "destination"),
            "hover_first_s": ("origin", "hover", row.name, "destination"),
        }
        for name, places in ways.items():
            edges = list(itertools.pairwise(places))
            flight_s = getattr(row, name)
            assert (flight_s is not None) == all(view.has_edge(*edge) for edge in edges)
            if flight_s is not None:
                expected = sum(view.edges[edge]["duration_s"] for edge in edges)
                assert flight_s == pytest.approx(expected, rel=1e-12)
        assert row.laser_sight == view.nodes[row.name]["laser_sight"]
        assert row.received_power_W == view.nodes[row.name]["received_power_W"]


def test_building_figures_of_the_shipped_mission() -> None:
    """b1 rest first is the shortest way; where it cannot be flown there is no time."""
    wall = {"name": "wall", "position_m": [25, 150, 90], "footprint_m": [10, 10]}
    rows = building_figures(PAPER.replace({"buildings": [*PAPER.to_dict()["buildings"], wall]}))
    assert [row.name for row in rows] == [*(f"b{k}" for k in range(1, 11)), "wall"]
    first, second = rows[:2]
    assert first.rest_first_s is None, "the wall is in the way"
    assert second.hover_first_s == pytest.approx(88.3163, abs=5e-5)
    assert second.rest_first_s == pytest.approx(first.hover_first_s)
    assert [row.received_power_W for row in rows[1:10]] == pytest.approx([111.0] * 9)
    assert first.position_m == (50, 300, 60)
    assert first.footprint_m == (40, 40)

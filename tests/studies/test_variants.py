"""Many variants of a mission at once are what each of them is alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import optuav
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.obstacles import CLEAR, clear_lines, crossed, prisms
from optuav.network.variants import KEY, Base, Columns, Variants
from optuav.solving.given import quantities
from optuav.studies.variants import longest, variant_quantities

COUNT = 60


def columns(mission: Mission, seed: int = 0) -> dict[str, Any]:
    """Sizes, loads, link, light and places within a good tenth of their values."""
    draw = np.random.default_rng(seed)
    keys = ["battery.capacity_As", "battery.charge_current_A", "battery.nominal_voltage_V"]
    keys += ["battery.available_fraction", "battery.flow_rate_per_s"]
    keys += ["link.transmit_power_W", "link.rice_factor", "limits.deadline_s", "laser.power_W"]
    if mission.flight.model == "rotors":
        keys += ["body.mass_kg", "rotor.lift_coefficient_N_s2_rad2", "laser.attenuation_per_km"]
    else:
        keys += ["flight.hover_current_A", "flight.acceleration_m_s2", "flight.flight_power_W"]
    found = {}
    for key in keys:
        table, name = key.split(".")
        found[key] = getattr(getattr(mission, table), name) * draw.uniform(0.88, 1.12, COUNT)
    found["battery.available_fraction"] = draw.uniform(0.7, 0.95, COUNT)
    found["link.device_m[0]"] = mission.link.device_m[0] + draw.uniform(-300, 300, COUNT)
    found["laser.position_m[1]"] = draw.uniform(-400, 400, COUNT)
    found["route.destination_m[1]"] = mission.route.destination_m[1] + draw.uniform(0, 80, COUNT)
    return found


def alone(mission: Mission, varied: Columns, number: int) -> Mission:
    """One of the variants, made by the mission itself."""
    values: dict[str, Any] = {}
    for key, column in varied.items():
        found = KEY.fullmatch(key)
        assert found is not None
        table, name, place = found.groups()
        if place is None:
            values[key] = float(column[number])
        else:
            whole = f"{table}.{name}"
            vector = list(values.get(whole, getattr(getattr(mission, table), name)))
            vector[int(place)] = float(column[number])
            values[whole] = vector
    return mission.replace(values)


@pytest.mark.parametrize("name", ["paper", "paper-table2", "matrice350"])
def test_quantities_are_those_of_each_variant_alone(name: str) -> None:
    """Every quantity and every step on the way, and which itineraries can be flown."""
    mission = optuav.load(name)
    varied = columns(mission)
    ensemble = Variants(Base.of(mission), varied)
    flyable = np.broadcast_to(ensemble.flyable, (COUNT, ensemble.flyable.shape[1]))
    for number in range(0, COUNT, 7):
        one = build_network(alone(mission, varied, number))
        assert (one.routes.flyable == flyable[number]).all()
        for routes in (np.array([0]), np.arange(1, len(one.routes), 2)):
            rests = bool(routes[0])
            expected = quantities(one, routes, rests=rests)
            variants = np.full(len(routes), number)
            given = variant_quantities(ensemble, variants, routes, rests=rests, steps=True)
            apart = {"steps", "rests", "flight_battery_J", "hover_battery_J"}
            held = {"battery_in_flight_J", "battery_in_hover_J"}
            for field in (expected.__dataclass_fields__.keys() - apart) | held:
                left, right = getattr(given, field), getattr(expected, field)
                np.testing.assert_allclose(left, right, 1e-9, 1e-9, err_msg=field)
            for step, wanted in zip(given.steps, expected.steps, strict=True):
                if isinstance(wanted, str):
                    assert step == wanted
                else:
                    np.testing.assert_allclose(step.duration_s, wanted.duration_s, 1e-9)
                    np.testing.assert_allclose(step.current_A, wanted.current_A, 1e-9)


@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted", "available"])
@pytest.mark.parametrize("name", ["paper", "matrice350"])
def test_the_longest_hover_is_that_of_each_variant_alone(name: str, perspective: str) -> None:
    """Solved by `optuav.solve`, which looks at every itinerary; some variants have no plan."""
    mission = optuav.load(name)
    varied = columns(mission, seed=4)
    found = longest(Variants(Base.of(mission), varied), perspective)
    for number in range(0, COUNT, 12):
        plan = optuav.solve(alone(mission, varied, number), perspective=perspective)
        if plan:
            assert found.hover_time_s[number] == pytest.approx(plan.hover_time_s, abs=2e-5)
        else:
            assert np.isnan(found.hover_time_s[number])
            assert found.itinerary[number] == -1


def test_lines_that_move_are_clear_where_each_of_them_is() -> None:
    """Against the test of single lines, with thousands of lines through the town."""
    mission = optuav.load("matrice350")
    obstacles = prisms(mission)
    draw = np.random.default_rng(2)
    start_m = draw.uniform([300, 100, 5], [500, 700, 40], (2000, 1, 3))
    end_m = np.broadcast_to([900.0, 300.0, 10.0], start_m.shape).copy()
    end_m[::3, 0, 2] = 60.0
    end_m[5] = np.nan
    exempt = np.array([[11]])
    between = np.array([[0, 1]])
    free = clear_lines(obstacles, np.concatenate([start_m, end_m], axis=1), between, exempt)
    every = np.tile(exempt, (2000, 1))
    known = np.delete(np.arange(2000), 5)
    alone = crossed(obstacles, start_m[known, 0], end_m[known, 0], every[known]) == CLEAR
    assert (free[known, 0] == alone).all()
    assert not free[5, 0]
    assert 0.1 < free.mean() < 0.9


def test_a_line_that_stays_is_judged_once_for_all() -> None:
    """From the laser to b12, which b4 hides, and to b4."""
    mission = optuav.load("matrice350")
    lamp, hidden, seen = (
        np.array(place)
        for place in (
            mission.laser.position_m if mission.laser else (),
            mission.buildings[11].position_m,
            mission.buildings[3].position_m,
        )
    )
    place_m = np.broadcast_to(np.stack([lamp, hidden, seen]), (50, 3, 3))
    lines = np.array([[0, 1], [0, 2]])
    free = clear_lines(prisms(mission), place_m, lines, np.array([[11], [3]]))
    assert (free == [False, True]).all()


@pytest.mark.parametrize("seed", range(4))
def test_bundles_about_corners_and_roofs_are_judged_as_single_lines(seed: int) -> None:
    """Through a square, an L and a sliver, beside and over them, from outside and from within."""
    corner = ((0.0, 0.0), (60.0, 0.0), (60.0, 20.0), (20.0, 20.0), (20.0, 60.0), (0.0, 60.0))
    town = [
        {"name": "square", "position_m": (100.0, 0.0, 30.0), "footprint_m": (40.0, 40.0)},
        {"name": "L", "position_m": (10.0, 10.0, 20.0), "footprint_m": corner},
        {"name": "sliver", "position_m": (-60.0, 0.0, 50.0), "footprint_m": (3.0, 90.0)},
    ]
    obstacles = prisms(optuav.load("matrice350").replace({"buildings": town}))
    draw = np.random.default_rng(seed)
    count, judged = 1500, []
    for _ in range(25):
        middle_m = draw.uniform([-120, -80, 0], [180, 120, 60], (2, 3))
        reach_m = draw.choice([0.0, 1.0, 10.0, 40.0], (2, 3))
        place_m = middle_m + reach_m * draw.uniform(-1.0, 1.0, (count, 2, 3))
        place_m[:, :, 2] = np.maximum(place_m[:, :, 2], 0.0)
        free = clear_lines(obstacles, place_m, np.array([[0, 1]]), np.array([[-1]]))[:, 0]
        exempt = np.full((count, 1), -1)
        alone = crossed(obstacles, place_m[:, 0], place_m[:, 1], exempt) == CLEAR
        assert (free == alone).all()
        judged.append(free.mean())
    assert min(judged) == 0.0
    assert max(judged) == 1.0
    assert any(0.0 < share < 1.0 for share in judged)

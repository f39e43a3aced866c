"""Many variants of a mission at once are what each of them is alone."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

import optuav
from formulations.soc import adjusted
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.variants import Columns, Variants
from optuav.solving.assemble import quantities
from optuav.solving.best_plans import hover_times_s

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
        table, name, place = re.fullmatch(r"(\w+)\.(\w+)(?:\[(\d)\])?", key).groups()
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
    ensemble = Variants(build_network(mission), varied)
    flyable = np.broadcast_to(ensemble.able, (COUNT, ensemble.able.shape[1]))
    for number in range(0, COUNT, 7):
        one = build_network(alone(mission, varied, number))
        assert (one.routes.flyable == flyable[number]).all()
        for routes in (np.array([0]), np.arange(1, len(one.routes), 2)):
            rests = bool(routes[0])
            expected = quantities(one, routes, rests=rests)
            variants = np.full(len(routes), number)
            given = quantities(ensemble, routes, variants, rests=rests)
            apart = {
                "numbers",
                "steps",
                "rests",
                "known_levels",
                "landings",
                "flight_battery_J",
                "hover_battery_J",
            }
            for field in expected.__dataclass_fields__.keys() - apart:
                left, right = getattr(given, field), getattr(expected, field)
                if left is None and right is None:
                    continue  # The mission states no such quantity
                np.testing.assert_allclose(left, right, 1e-9, 1e-9, err_msg=field)
            for mine, own in zip(given.landings, expected.landings, strict=True):
                for left, right in zip(mine[:2], own[:2], strict=True):
                    np.testing.assert_allclose(left, right, 1e-9, 1e-9, err_msg="landing")
            left, right = (adjusted(each, 100.0, 50.0) for each in (given, expected))
            np.testing.assert_allclose(left, right, 1e-9, 1e-9, err_msg="state of charge")
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
    found = hover_times_s(Variants(build_network(mission), varied), perspective)
    for number in range(0, COUNT, 12):
        plan = optuav.solve(alone(mission, varied, number), perspective=perspective)
        if plan:
            assert np.max(found[number]) == pytest.approx(plan.hover_time_s, abs=1e-9)
        else:
            assert np.isneginf(found[number]).all()

"""Tables over many variants of a mission are those of each variant's own network."""

from __future__ import annotations

import numpy as np
import pytest

import optuav
from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.variants import Variants, as_variants

COUNT = 25


def drawn(mission: Mission) -> dict[str, Floats]:
    """Keys that move places, change loads and dim the light, some by component."""
    draw = np.random.default_rng(1)
    load = "body.mass_kg" if mission.flight.model == "rotors" else "flight.acceleration_m_s2"
    table, name = load.split(".")
    assert mission.laser is not None
    return {
        load: getattr(getattr(mission, table), name) * draw.uniform(0.9, 1.1, COUNT),
        "laser.power_W": mission.laser.power_W * draw.uniform(0.2, 2.0, COUNT),
        "laser.position_m[1]": draw.uniform(-400.0, 400.0, COUNT),
        "link.device_m[0]": mission.link.device_m[0] + draw.uniform(-300.0, 300.0, COUNT),
    }


def alone(mission: Mission, columns: dict[str, Floats], number: int) -> Mission:
    """One of the variants, made by `Mission.replace`."""
    values: dict[str, object] = {}
    for key, column in columns.items():
        name, _, axis = key.partition("[")
        if not axis:
            values[name] = float(column[number])
            continue
        table, field = name.split(".")
        vector = list(getattr(getattr(mission, table), field))
        vector[int(axis[0])] = float(column[number])
        values[name] = vector
    return mission.replace(values)


@pytest.mark.parametrize("name", ["paper", "paper-table2", "matrice350"])
def test_each_variant_has_the_places_and_routes_of_its_own_network(name: str) -> None:
    """Positions, light, flight figures, and which routes can be flown."""
    mission = optuav.load(name)
    columns = drawn(mission)
    variants = Variants(build_network(mission), columns)
    for number in range(COUNT):
        own = build_network(alone(mission, columns, number))
        row = [number if len(each) > 1 else 0 for each in (variants.position_m, variants.able)]
        assert variants.position_m[row[0]] == pytest.approx(own.places.position_m, nan_ok=True)
        received = [np.broadcast_to(each, (COUNT, each.shape[1])) for each in variants.received]
        assert received[0][number] == pytest.approx(own.places.charge_current_A)
        assert received[1][number] == pytest.approx(own.places.received_power_W)
        assert list(variants.able[row[1]]) == list(own.routes.flyable)
        figures = ("flight_time_s", "flight_charge_As", "flight_energy_J")
        for figure, table in zip(figures, variants.flight, strict=True):
            found = table[number if len(table) > 1 else 0]
            assert found == pytest.approx(getattr(own.routes, figure), rel=1e-9, nan_ok=True)


def test_one_route_alone_has_the_same_figures() -> None:
    """The other routes and their legs are left out, which saves their work."""
    mission = optuav.load("paper")
    network, columns = build_network(mission), drawn(mission)
    whole, single = Variants(network, columns), Variants(network.only([5]), columns)
    assert len(single.network.legs.start) == 3
    assert single.flight[0][:, 0] == pytest.approx(whole.flight[0][:, 5])


def test_stated_energies_are_dropped_where_the_battery_varies_in_size() -> None:
    """As `Mission.replace` does; other columns keep them."""
    stated = {"battery.flight_energy_J": 8e5, "battery.hover_energy_J": 7e5}
    network = build_network(optuav.load("paper").replace(stated))
    size = Variants(network, {"battery.capacity_As": np.array([3e4, 4e4])}).mission
    assert size.battery.flight_energy_J is size.battery.hover_energy_J is None
    current = Variants(network, {"battery.charge_current_A": np.array([5.0, 6.0])}).mission
    assert current.battery.flight_energy_J == 8e5


@pytest.mark.parametrize("name", ["paper", "paper-table2", "matrice350"])
def test_networks_below_one_another_are_the_variants_of_their_missions(name: str) -> None:
    """Every table of `stacked` is that of `Variants`, which computes it from columns."""
    mission = optuav.load(name)
    columns = drawn(mission)
    whole = Variants(build_network(mission), columns)
    missions = [alone(mission, columns, number) for number in range(COUNT)]
    below = as_variants(*(build_network(each) for each in missions))
    assert below.count == whole.count
    for table in ("position_m", "able", "hover_load", "received", "flight"):
        tables = getattr(below, table), getattr(whole, table)
        for ours, computed in zip(*tables, strict=True) if len(tables[0]) < COUNT else [tables]:
            here, there = np.broadcast_arrays(ours, computed)
            assert here == pytest.approx(there, nan_ok=True), table
    for ours, computed in zip(below.stages, whole.stages, strict=True):
        for part, expected in zip(ours, computed, strict=True):
            assert part == pytest.approx(np.broadcast_to(expected, part.shape)), "stages"


def test_an_energy_that_a_new_size_displaces_is_computed() -> None:
    """E_1 of `paper-table2` is stated; with another capacity it follows from the mean voltage."""
    mission = optuav.load("paper-table2")
    larger = mission.replace({"battery.capacity_As": 40_000})
    assert larger.battery.flight_energy_J is None
    column = as_variants(
        build_network(mission), build_network(larger)
    ).mission.battery.flight_energy_J
    known_J, displaced_J = np.ravel(column)  # type: ignore[arg-type]
    assert known_J == mission.battery.flight_energy_J
    assert np.isnan(displaced_J)

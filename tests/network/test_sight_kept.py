"""The sight of a laser is kept for a city that is solved again, and never for another."""

from __future__ import annotations

import numpy as np
import pytest

import optuav
from optuav.network import places
from optuav.network.places import build_places

CITY = optuav.layouts("paper", 1, "manhattan", area_m=(800.0, 500.0, 1400.0, 2600.0), seed=2)[0]
CHANGES: list[dict[str, object]] = [
    {},
    {"limits.deadline_s": 700.0},
    {"laser.position_m": (1000.0, 400.0, 30.0)},
    {"laser.position_m": (1000.0, 400.0, 90.0)},
    {"link.device_m": (900.0, 2300.0, 0.0)},
    {"route.hover_m": (1100.0, 2400.0, 70.0)},
    {"laser.power_W": 300.0},
    {"buildings.r1": None},
    {"buildings.r3": {"position_m": (1203.0, 1404.0, 99.0), "footprint_m": (30.0, 10.0)}},
    {"laser": None},
]


def test_changed_missions_have_places_of_their_own() -> None:
    """Whatever is changed, and in whatever order: as if no other city had been solved before."""
    missions = [CITY.replace(each) for each in CHANGES]
    alone = []
    for mission in missions:
        places._kept_sight.cache_clear()
        alone.append(build_places(mission))
    for number in [*range(len(missions)), *np.random.default_rng(0).integers(0, 10, 40).tolist()]:
        for name, values in vars(build_places(missions[number])).items():
            np.testing.assert_array_equal(values, vars(alone[number])[name], err_msg=name)


def test_a_city_that_is_solved_again_is_not_looked_at_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Neither with another deadline or battery, nor as variants of them."""
    known = build_places(CITY)
    monkeypatch.setattr(places, "clear_lines", None)
    again = build_places(CITY.replace({"limits.deadline_s": 800.0, "battery.capacity_As": 30_000}))
    np.testing.assert_array_equal(again.laser_sight, known.laser_sight)

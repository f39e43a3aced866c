"""Longest hovers with the wells of lithium cells: figures of the specification."""

from __future__ import annotations

import pytest

import optuav
from optuav.mission.template import wells_of
from optuav.options import BatteryName

HOVERS_S: dict[str, dict[BatteryName, float]] = {
    "paper": {"paper": 597.270, "lipo": 619.649, "liion": 425.904},
    "paper-table2": {"paper": 827.297, "lipo": 884.240, "liion": 677.271},
    "paper-drag": {"paper": 460.606, "lipo": 471.178, "liion": 292.229},
    "matrice350": {"lipo": 1916.903, "liion": 1782.501},
    "relay-today": {"lipo": 2385.803, "liion": 2201.441},
}


@pytest.mark.parametrize("name", HOVERS_S)
def test_hovers_by_kind_of_cells(name: str) -> None:
    """With a reserve at the end, in `available`, one rest and one hover."""
    for battery, hover_s in HOVERS_S[name].items():
        changes = {**wells_of(battery), "limits.keep_soc": "end"}
        plan = optuav.solve(optuav.load(name).replace(changes))
        assert plan.hover_time_s == pytest.approx(hover_s, abs=6e-4), battery
        assert plan.status == "optimal"


@pytest.mark.parametrize(
    ("name", "hover_s", "roof", "gained_s"),
    [("relay-today", 1993.892, "b11", 24.430), ("matrice350", 1753.655, "b4", None)],
)
def test_shipped_missions_keep_their_reserve_on_the_roof(
    name: str, hover_s: float, roof: str, gained_s: float | None
) -> None:
    """They have LiPo wells and land with 20 %: one rest gains seconds of a first hover."""
    mission = optuav.load(name)
    assert mission.limits.keep_soc == "always"
    assert mission.battery.available_fraction == 0.2
    plan = optuav.solve(mission)
    assert plan.hover_time_s == pytest.approx(hover_s, abs=6e-4)
    assert roof in plan.route
    assert plan.flyable
    pool_As = mission.battery.packs * mission.battery.capacity_As
    landings = [phase for phase in plan.phases if phase.kind == "flight"]
    for phase in landings:
        assert (phase.available_As[0] + phase.bound_As[0]) / pool_As >= 0.2 - 1e-9
    if gained_s is not None:
        direct_s = optuav.solve(mission, "P3").hover_time_s
        assert plan.hover_time_s - direct_s == pytest.approx(gained_s, abs=2e-3)

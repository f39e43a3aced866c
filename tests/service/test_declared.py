"""The declared cycle: engines agree with `coverage`, its plan repeats, refusals."""

from typing import Any

import pytest

import optuav
from optuav.errors import InputError

SHIPPED = ["paper", "paper-table2", "paper-drag", "matrice350", "relay-today"]


@pytest.mark.parametrize("mission", SHIPPED)
@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_engines_agree_with_the_closed_form_and_the_bisection(
    mission: str, perspective: Any
) -> None:
    """CVXPY and CasADi know nothing of periodic tilts or bisection, and find the same cycle."""
    coverage = optuav.coverage(mission, perspective=perspective)
    rows = coverage.compare().rows
    engines = ["cvxpy", "casadi"] if perspective == "battery" else ["casadi"]
    assert [row["method"] for row in rows][1:] == engines
    for row in rows[1:]:
        assert row["hover_s"] == pytest.approx(coverage.hover_s, abs=1e-4)
        assert row["share"] == pytest.approx(coverage.share, rel=1e-6)


@pytest.mark.parametrize("mission", SHIPPED)
def test_the_solved_cycle_ends_with_the_wells_of_its_start(mission: str) -> None:
    """The judge flies the plan from the start wells that CasADi found, and back to them."""
    plan = optuav.coverage(mission).program().solve()
    replay, start, battery = optuav.replay(plan), plan.mission.start, plan.mission.battery
    assert replay.flyable, replay.violations
    assert start is not None
    ends = replay.trace.available_As[-1, 0], replay.trace.bound_As[-1, 0]
    size_As = battery.packs * battery.capacity_As
    assert ends == pytest.approx((start.available_As, start.bound_As), abs=1e-6 * size_As)


def test_what_the_declaration_cannot_hold_is_refused() -> None:
    """Other charging than by the mission's laser, a dark hover, and a route that does not close."""
    for options, name in (
        ({"swap_s": 90.0}, "swap_s"),
        ({"pad_power_W": 300.0}, "pad_power_W"),
        ({"lit_hover": False}, "lit_hover"),
    ):
        chosen: Any = options
        with pytest.raises(InputError, match=name):
            optuav.coverage("paper", **chosen).program()
    mission = optuav.coverage("paper").plan.mission
    for where, building in (("paper", "b9"), (mission, "b1")):
        with pytest.raises(InputError, match=rf"route\.destination_m.*the roof of {building}"):
            optuav.solve(where, optuav.Cycle(building))
    for perspective in ("energy", "wells"):
        with pytest.raises(InputError, match="perspective"):
            optuav.solve(mission, optuav.Cycle("b9"), perspective=perspective)
    with pytest.raises(InputError, match="building"):
        optuav.solve(optuav.coverage("paper").plan.mission, optuav.Cycle("b99"))

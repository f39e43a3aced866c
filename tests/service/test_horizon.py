"""One drone's day: the known figures, the judge's verdict, refusals."""

from typing import Any

import pytest

import optuav
from optuav.errors import InputError, NoPlanError

SHIPPED = ["paper", "paper-table2", "paper-drag", "matrice350", "relay-today"]


def test_eight_hours_of_paper() -> None:
    """The figures that independent code found."""
    day = optuav.coverage("paper").horizon(8)
    assert day.building == "b9"
    assert day.hover_s == pytest.approx(3277.31, abs=5e-3)
    assert day.bound_s == pytest.approx(3305.80, abs=5e-3)
    (ax, *_) = day.plot()["horizon.png"].axes
    assert "8 h" in ax.get_title(loc="left")


@pytest.mark.parametrize(("hours", "hovers"), [(0.2, 1), (1, 2)])
def test_where_the_wells_level_at_once_the_bound_is_the_plan(hours: float, hovers: int) -> None:
    """Then time and charge alone decide, over one hover or two."""
    mission = optuav.load("paper").replace({"battery.flow_rate_per_s": 0.01})
    day = optuav.coverage(mission).horizon(hours)
    assert [row["kind"] for row in day.rows].count("hover") == hovers
    assert day.hover_s == pytest.approx(day.bound_s, abs=1e-6)
    assert day.share == pytest.approx(day.hover_s / (3600.0 * hours), rel=1e-9)


@pytest.mark.parametrize("mission", SHIPPED)
@pytest.mark.parametrize("hours", [1, 5, 24])
def test_the_judge_flies_the_day(mission: str, hours: float) -> None:
    """Flyable, in time, above η0 at every landing, and no longer than the bound."""
    day = optuav.coverage(mission).horizon(hours)
    replay = optuav.replay(day.itinerary)
    assert replay.flyable, replay.violations
    assert replay.times_s["hover_time_s"] == pytest.approx(day.hover_s)
    assert replay.mission_time_s <= 3600 * hours + 1e-6
    assert day.hover_s <= day.bound_s + 1e-6
    battery, trace = day.mission.battery, replay.trace
    charge_As = trace.available_As[:, 0] + trace.bound_As[:, 0]
    least_As = day.mission.limits.min_soc * battery.packs * battery.capacity_As
    assert charge_As.min() >= least_As - 1e-6 * battery.capacity_As


def test_what_is_no_day_is_refused() -> None:
    """Hours out of range, other charging, the perspective battery, and a day too short."""
    coverage = optuav.coverage("paper")
    hours: Any
    for hours in (0, -1, float("nan"), "8", 2001):
        with pytest.raises(InputError, match="hours"):
            coverage.horizon(hours)
    with pytest.raises(InputError, match="swap_s: must be left out: the mission's laser"):
        optuav.coverage("paper", swap_s=90).horizon(8)
    with pytest.raises(InputError, match="lit_hover: must be left out: the mission's laser"):
        optuav.coverage("paper", lit_hover=False).horizon(8)
    with pytest.raises(InputError, match="available"):
        optuav.coverage("paper", perspective="battery").horizon(8)
    with pytest.raises(NoPlanError, match="no time"):
        coverage.horizon(0.01)

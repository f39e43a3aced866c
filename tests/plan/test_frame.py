"""The plan as a pandas table."""

from __future__ import annotations

import pytest

from tests.plan.made import INFEASIBLE, feasible, plans

pytest.importorskip("pandas")
COLUMNS = [
    *("kind", "start_place", "end_place", "start_s", "duration_s", "current_A", "power_W"),
    *("distance_m", "peak_speed_m_s", "edited", "available_As", "bound_As"),
]


@pytest.mark.parametrize("kind", feasible())
def test_one_row_a_phase(kind: str) -> None:
    """Each column has the attribute of its name; wells are summed over the packs."""
    plan = plans()[kind]
    frame = plan.to_frame()
    assert list(frame.columns) == COLUMNS
    assert len(frame) == len(plan.phases)
    for name in COLUMNS[:-2]:
        assert frame[name].tolist() == [getattr(phase, name) for phase in plan.phases]
    assert frame["available_As"].tolist() == [sum(phase.available_As) for phase in plan.phases]
    assert frame["bound_As"].tolist() == [sum(phase.bound_As) for phase in plan.phases]
    assert frame["duration_s"].sum() == pytest.approx(plan.mission_time_s)
    assert frame["edited"].dtype == bool


@pytest.mark.parametrize("kind", INFEASIBLE)
def test_no_plan_no_rows(kind: str) -> None:
    """But the columns are there."""
    frame = plans()[kind].to_frame()
    assert list(frame.columns) == COLUMNS
    assert len(frame) == 0

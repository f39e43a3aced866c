"""Replay of missions whose packs carry the load one at a time."""

from __future__ import annotations

import numpy as np
import pytest

import optuav
from optuav import InputError, Mission, plots
from optuav.judge import Itinerary, Replay, Stop

SCHEDULES = ("sequential", "round-robin", "alternating", "most-available")


def mission(schedule: str, **keys: object) -> Mission:
    """`paper` with a schedule and other keys, dots written as two underscores."""
    changed = {name.replace("__", "."): value for name, value in keys.items()}
    period = {"battery.period_s": 60.0} if schedule == "alternating" else {}
    return optuav.load("paper").replace({"battery.schedule": schedule, **period, **changed})


def hovering(given: Mission, hover_s: float) -> Replay:
    return optuav.replay(Itinerary(given, (Stop("hover", "hover", hover_s),)))


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_without_flow_all_that_is_available_is_flown(schedule: str) -> None:
    """k_F = 0 and no laser: the packs hold out until ωB is drawn, whoever carries when.

    By hand: 3921.555 A s on the first leg of 37.8961 s, then 4 · 23.2276 A and the radio's 5 W.
    """
    given = mission(schedule, laser=None, battery__flow_rate_per_s=0.0)
    hover_A = 4 * 23.2276 + 5.0 / given.link.transmit_voltage_V
    expected_s = 37.8961 + (0.8 * 72_000 - 3921.555) / hover_A
    replayed = hovering(given, 600.0)
    assert replayed.first_s("empty") == pytest.approx(expected_s, abs=0.01)
    assert [event.kind for event in replayed.events].count("pack empty") == 2
    (empty,) = replayed.violations
    assert empty.value is not None
    assert -empty.value == pytest.approx((637.896 - expected_s) * hover_A + 3921.555, rel=1e-4)


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_table_has_a_column_a_pack(schedule: str) -> None:
    """Both packs begin full, their charges change by what flows into them, and only that."""
    replayed = hovering(mission(schedule), 400.0)
    assert replayed.flyable
    table = replayed.trace
    assert table.available_As.shape == table.bound_As.shape == (len(table), 2)
    assert table.available_As[0] == pytest.approx([28_800.0, 28_800.0])
    total_As = (table.available_As + table.bound_As).sum(axis=1)
    drawn_As = -(table.current_A[:-1] * np.diff(table.time_s)).sum()
    assert total_As[-1] == pytest.approx(72_000.0 - drawn_As, abs=0.072)
    assert replayed.soc["battery"] == pytest.approx(total_As[-1] / 72_000)
    assert abs(np.diff(total_As)).max() < 120.0 * 16.0
    assert table.available_As.max() < 28_800.0 * (1 + 1e-9)
    assert {"available_As", "available_1_As", "bound_2_As"} <= set(replayed.to_frame().columns)


def test_pooled_is_what_a_single_pack_does() -> None:
    """One pack of the whole capacity under a schedule, and two used as one."""
    alone = {"battery__packs": 1, "battery__capacity_As": 72_000.0}
    single = hovering(mission("sequential", **alone), 650.0)
    both = hovering(optuav.load("paper"), 650.0)
    assert single.first_s("empty") == pytest.approx(both.first_s("empty"), abs=1e-6)


def test_only_pooled_packs_are_integrated() -> None:
    with pytest.raises(InputError, match="pooled"):
        optuav.replay(Itinerary(mission("sequential"), ()), method="solve_ivp")


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_audit_and_picture(schedule: str) -> None:
    """Where the packs give out, the table ends."""
    pytest.importorskip("matplotlib")
    replayed = hovering(mission(schedule), 650.0)
    assert "no pack is left to fly on" in str(optuav.audit(replayed.subject))
    assert replayed.trace.time_s[-1] == pytest.approx(replayed.first_s("empty"))
    axes = plots.profile(replayed)
    assert axes.speed.get_xlim()[1] == replayed.trace.time_s[-1]

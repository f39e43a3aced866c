"""Schedules side by side: rows, differences, and what is refused."""

from __future__ import annotations

import csv
import io

import pytest

import optuav
from optuav.errors import InputError
from optuav.studies import Schedules, compare_schedules


@pytest.fixture(scope="module")
def found() -> Schedules:
    """`paper` in slots of 40 s."""
    return compare_schedules("paper", slot_s=40.0, periods_s=(30.0, 90.0))


def test_one_row_a_schedule_and_a_period(found: Schedules) -> None:
    assert [(row["schedule"], row["period_s"]) for row in found.records()] == [
        ("pooled", None),
        ("sequential", None),
        ("round-robin", None),
        ("alternating", 30.0),
        ("alternating", 90.0),
        ("most-available", None),
    ]


def test_what_a_schedule_brings_is_counted_from_pooled_packs(found: Schedules) -> None:
    pooled = optuav.solve("paper", perspective="available", slot_s=40.0)
    assert found.plans[0].hover_time_s == pooled.hover_time_s
    for row in found.records():
        assert row["brings_s"] == row["hover_time_s"] - pooled.hover_time_s
    assert found.records()[1]["brings_s"] < 0.0


def test_table_and_files_tell_the_same(found: Schedules) -> None:
    rows = list(csv.DictReader(io.StringIO(found.to_csv())))
    assert [float(row["hover_time_s"]) for row in rows] == [p.hover_time_s for p in found.plans]
    text = str(found)
    assert all(f"{plan.hover_time_s:.2f}" in text for plan in found.plans)
    assert max(map(len, text.splitlines())) <= 80
    assert found.to_dict()["mission"] == found.mission.to_dict()


def test_a_mission_s_own_period_is_among_them() -> None:
    own = optuav.load("paper").replace(
        {"battery.schedule": "alternating", "battery.period_s": 45, "buildings": []}
    )
    periods = [row["period_s"] for row in compare_schedules(own, slot_s=40.0).records()]
    assert periods == [None, None, None, 45.0, 60.0, None]


def test_periods_are_judged() -> None:
    with pytest.raises(InputError, match="periods_s"):
        compare_schedules("paper", periods_s=(0.0, -5.0))

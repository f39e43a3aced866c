"""The quick test of feasibility says what solving says."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.diagnosis.feasible import confirmed, feasible
from tests.diagnosis.missions import CHANGES, OPTIONS, PAPER, SMALL

questions = st.sampled_from([*OPTIONS, {"problem": "P1", "slot_s": 5.0}])
changes = st.fixed_dictionaries({}, optional=CHANGES)


@given(changes, questions)
def test_it_agrees_with_the_engines(change: dict[str, Any], options: dict[str, Any]) -> None:
    """Closed form and grid, from impossible to easy missions."""
    program = optuav.formulate(SMALL.replace(change), **{"perspective": "battery", **options})
    assert feasible(program) == bool(program.solve())


@pytest.mark.parametrize(("packs", "expected"), [(2, True), (0.1, False)])
def test_programmes_that_are_not_linear_are_tried_at_points(packs: float, expected: bool) -> None:
    """Through the wells: two legs alone take 7843 A·s."""
    mission = SMALL.replace({"battery.capacity_As": 36000 * packs})
    program = optuav.formulate(mission, "P3", perspective="wells")
    assert feasible(program) is expected


def test_more_slots_than_can_be_searched() -> None:
    """With 10⁷ slots a feasible cell is confirmed without looking at the others."""
    program = optuav.formulate(
        PAPER.replace({"limits.deadline_s": 1e7}),
        "P4",
        building="b1",
        slot_s=1.0,
        perspective="battery",
    )
    assert confirmed(program)

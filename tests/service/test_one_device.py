"""Services that hover over one device refuse several in one sentence, and in words of their own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import optuav
from tests.several_devices import three

SERVICES: dict[str, Callable[[optuav.Mission], Any]] = {
    "an endless cycle serves": optuav.coverage,
    "the time to return is for": optuav.return_by,
    "a fleet serves": optuav.size_fleet,
    "a robust plan serves": lambda mission: optuav.robust(mission, {"drain": {"percent": 5}}),
}


@pytest.mark.parametrize("words", [*SERVICES])
def test_several_devices_are_refused_in_one_sentence(words: str) -> None:
    with pytest.raises(optuav.InputError) as refused:
        SERVICES[words](three())
    sentence = f"devices: must be one: {words} one device, and the mission has 3"
    assert str(refused.value) == sentence


def test_a_fleet_of_several_devices_hides_no_other_fault() -> None:
    with pytest.raises(optuav.InputError) as refused:
        optuav.coverage(three(), swap_s=-1.0)
    assert {fault.key for fault in refused.value.faults} == {"devices", "swap_s"}


def test_a_cycle_and_packs_in_turn_are_refused() -> None:
    with pytest.raises(optuav.InputError, match="a cycle hovers over a single device"):
        optuav.solve(three(), optuav.Cycle("b9"))
    turns = three().replace({"battery.schedule": "sequential"})
    with pytest.raises(optuav.InputError, match="must be pooled with several devices"):
        optuav.solve(turns)

"""Large missions: the routes that bounds leave out change nothing in the plan."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.mission import Mission
from optuav.solving import promising
from optuav.solving.question import checked_question

KINDS: list[dict[str, Any]] = [{"perspective": each} for each in ("available", "battery", "energy")]
KINDS += [{"problem": optuav.P3()}, {"problem": optuav.P4("b2")}, {"perspective": "wells"}]
KINDS += [{"problem": optuav.P1(trajectory="direct")}, {"problem": optuav.P1(trajectory="traj1")}]
KINDS += [{"problem": optuav.P1(order="hover-first")}]


def town(seed: int) -> Mission:
    """Some 40 buildings, with walls or without; the deadline may be too short for any."""
    draw = np.random.default_rng(seed)
    count, turns = int(draw.integers(3, 40)), seed == 6
    count = 2 if turns else count
    table = {"name": [f"b{k}" for k in range(count)], "z_m": draw.uniform(20, 90, count)}
    table |= {"x_m": draw.uniform(0, 2000, count), "y_m": draw.uniform(0, 2500, count)}
    if walls := seed % 3:
        table |= dict.fromkeys(("width_m", "depth_m"), np.full(count, 40.0 * walls))
    return (
        optuav.load("paper")
        .replace(
            {
                "limits.deadline_s": float(draw.uniform(60, 2400)),
                "limits.min_soc": float(draw.choice([0.05, 0.3, 0.7])),
                "laser.power_W": float(draw.choice([0, 500, 3000])),
                "battery.charging": "taper" if seed % 5 == 4 else "constant",
                "battery.schedule": "sequential" if turns else "pooled",
                "flight.through_buildings": seed % 2 == 0,
                "link.transmit_power_W": 1e-6 if seed == 3 else 5.0,  # Out of reach
                "body.mass_kg": 100.0 if seed == 5 else 1.3,  # Too heavy
            }
        )
        .with_buildings(table)
    )


@pytest.mark.parametrize("seed", range(14))
def test_the_plan_is_that_of_all_routes(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the last digit and note, whatever the question, with bounds in small pieces."""
    mission = town(seed)
    kinds = KINDS[:2] if mission.battery.charging == "taper" else KINDS
    kinds = KINDS[:1] if mission.battery.takes_turns else kinds
    plans = [optuav.solve(mission, **kind).to_dict() for kind in kinds]
    monkeypatch.setattr(import_module("optuav.solving.solve"), "MANY", 0)
    monkeypatch.setattr(promising, "FIRST", 2)
    monkeypatch.setattr(promising, "AT_ONCE", 7)
    assert [optuav.solve(mission, **kind).to_dict() for kind in kinds] == plans


def test_most_routes_are_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """And routes that bounds do not exclude are added to the first ones until none is open."""
    mission = optuav.load("paper").replace({"limits.deadline_s": 2000})
    question = checked_question(mission)
    monkeypatch.setattr(promising, "FIRST", 1)
    program = promising.narrowed(mission, question)
    assert program is not None
    assert len(program.network.routes) < 21
    assert program.solve().phases == optuav.solve(mission).phases
    shared = np.zeros(20)
    monkeypatch.setattr(promising, "_bounds_s", lambda *_: (shared + np.inf, shared, shared))
    everything = promising.narrowed(mission, question)
    assert everything is not None
    assert len(everything.network.routes) == 21

"""Whatever varies, a batch is what `solve` finds of each scenario alone, on any chunking."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.arrays import Floats
from optuav.mission import Mission
from optuav.studies import scenarios as machine
from tests.examples import few
from tests.studies.test_batch import PROBLEMS, alone, assert_same, missions

MISSIONS = missions()
PERSPECTIVES = ["battery", "energy", "adjusted", "wells", "available"]
SHARES = {
    "limits.deadline_s": (0.0, 3.0),
    "limits.min_soc": (0.0, 4.5),
    "battery.capacity_As": (0.1, 2.0),
    "battery.charge_current_A": (0.0, 4.0),
    "battery.available_fraction": (0.2, 1.2),
    "battery.flow_rate_per_s": (0.0, 40.0),
    "link.device_m[1]": (0.5, 1.2),
    "link.transmit_power_W": (0.01, 3.0),
    "laser.power_W": (0.0, 3.0),
    "laser.visibility_km": (0.05, 3.0),
    "body.mass_kg": (0.5, 1.6),
    "rotor.max_speed_rad_s": (0.9, 1.2),
    "flight.hover_current_A": (0.1, 2.0),
    "flight.acceleration_m_s2": (0.1, 3.0),
}
"""Keys, and between which shares of what the mission states they are drawn."""


def stated(mission: Mission, key: str) -> float | None:
    """What a mission states of a key."""
    table, _, name = key.partition(".")
    name, _, axis = name.partition("[")
    found = getattr(getattr(mission, table), name, None)
    return found[int(axis[0])] if found is not None and axis else found


@st.composite
def scenarios(draw: st.DrawFn, most: int) -> tuple[Mission, dict[str, Floats]]:
    """A mission, and rows of values of some of its keys."""
    mission = draw(st.sampled_from(MISSIONS))
    here = {key: now for key in SHARES if (now := stated(mission, key)) is not None}
    if mission.laser is not None and mission.laser.visibility_km is None:
        here.pop("laser.visibility_km", None)
    keys = draw(st.lists(st.sampled_from([*here]), min_size=1, max_size=4, unique=True))
    count = draw(st.integers(1, most))
    values = {}
    for key in keys:
        shares = st.floats(*SHARES[key], allow_subnormal=False)
        values[key] = here[key] * np.array(draw(st.lists(shares, min_size=count, max_size=count)))
    if (key := "battery.available_fraction") in values:
        values[key] = np.clip(values[key], 0.01, 0.99)
    return mission, {key: np.maximum(column, 1e-9) for key, column in values.items()}


@given(scenarios(3), st.sampled_from(PERSPECTIVES))
@few(8)
def test_what_varies_is_solved_as_alone(drawn: Any, perspective: str) -> None:
    """The longest hover of any rows of any keys, in every perspective."""
    mission, values = drawn
    found = optuav.batch_arrays(mission, values, perspective=perspective, paired=True)
    for number in range(len(next(iter(values.values())))):
        one = alone(mission, values, number)
        assert_same(found, number, optuav.solve(one, perspective=perspective))


@pytest.mark.soak
@given(scenarios(2), st.sampled_from(PROBLEMS))
@few(3, 100)
def test_every_problem_is_solved_as_alone(drawn: Any, asked: tuple[Any, str]) -> None:
    """The other problems, orders and trajectories, some of them mission by mission."""
    (mission, values), (problem, perspective) = drawn, asked
    options: dict[str, Any] = {"perspective": perspective}
    found = optuav.batch_arrays(mission, values, problem, paired=True, **options)
    for number in range(len(next(iter(values.values())))):
        plan = optuav.solve(alone(mission, values, number), problem, **options)
        assert_same(found, number, plan)


@given(scenarios(12), st.sampled_from(PERSPECTIVES), st.integers(1, 12))
@few(8)
def test_no_bit_depends_on_what_is_computed_together(
    drawn: Any, perspective: Any, at_once: int
) -> None:
    """Any number of scenarios at once."""
    (mission, values), found = drawn, []
    with pytest.MonkeyPatch.context() as patch:
        for scenarios_at_once in (at_once, 12):
            routes = 1 + 2 * len(mission.buildings)
            patch.setattr(machine, "ITINERARIES_AT_ONCE", scenarios_at_once * routes)
            found.append(optuav.batch_arrays(mission, values, perspective=perspective, paired=True))
    some, whole = found
    for name, column in whole.items():
        assert some[name].tobytes() == column.tobytes(), name

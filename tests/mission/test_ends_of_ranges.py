"""At the ends of the allowed values nothing but an answer comes: no warning of NumPy, no error."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

import optuav
from optuav.mission import Mission
from optuav.mission.keys import numeric_keys
from optuav.mission.messages import number

DIVERGING = {
    "laser.beam": "divergence",
    "laser.aperture_m": 0.1,
    "laser.divergence_rad": 3.4e-5,
    "receiver.area_m2": 0.009,
}
MISSIONS = {
    "paper": optuav.load("paper"),
    "matrice350": optuav.load("matrice350"),
    "relay-today": optuav.load("relay-today"),
    "divergence": optuav.load("paper").replace(DIVERGING),
}


def at_the_ends(mission: Mission) -> Iterator[tuple[str, Mission]]:
    """The mission with each of its numbers at the least and the largest allowed value."""
    for key in numeric_keys():
        allowed = number(key)
        for end in (allowed.ge, allowed.le) if allowed else ():
            if end is not None:
                value = int(end) if allowed and allowed.whole else float(end)
                try:
                    yield f"{key} = {value}", mission.replace({key: value})
                except optuav.InputError:  # contradicts another key
                    continue


@pytest.mark.parametrize(
    ("name", "key", "value"),
    [
        *((name, "laser.visibility_km", 0.001) for name in MISSIONS),
        *((name, "battery.available_fraction", 1e-6) for name in MISSIONS),
        ("matrice350", "flight.flight_current_A", 1e6),
        ("relay-today", "receiver.optics_efficiency", 5e-324),
        ("relay-today", "receiver.cell_efficiency", 5e-324),
    ],
)
@pytest.mark.parametrize("perspective", ["available", "battery", "wells"])
def test_values_that_warned(name: str, key: str, value: float, perspective: str) -> None:
    """Warnings are errors here; where no light arrives, charge promises no more by a rest."""
    mission = MISSIONS[name].replace({key: value})
    plan = optuav.solve(mission, perspective=perspective)  # type: ignore[arg-type]
    batch = optuav.batch_arrays(mission, {"limits.deadline_s": [mission.limits.deadline_s]})
    assert batch["status"].shape == (1,)
    if perspective == "battery" and not key.startswith(("battery", "flight")):
        without = optuav.solve(mission, "P3", perspective="battery")
        assert plan.hover_time_s == pytest.approx(without.hover_time_s, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("name", MISSIONS)
def test_every_key_at_its_ends(name: str) -> None:
    """A plan, or reasons for none."""
    for stated, mission in at_the_ends(MISSIONS[name]):
        plan = optuav.solve(mission)
        assert plan or plan.reasons, stated

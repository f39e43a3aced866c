"""The bound on what whole slots cost: where it is claimed it holds, where not it says why."""

from __future__ import annotations

import itertools
import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from formulations.p1 import P1
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.modelling import Model
from optuav.studies.compare_methods import bound
from tests.formulations.given import quantities


def p4(**changes: Any) -> tuple[Model, dict[str, Any]]:
    """A P4 with 10 A of hover, 5 A of rest, 800 A s to spend and 150 s of time."""
    model = P4("b1").model(quantities(**changes), "battery")
    return model, model.row(0)


def test_one_slot_where_the_horizon_is_whole() -> None:
    assert bound(*p4(), 1.0)[0] == 1
    assert bound(*p4(), 30.0)[0] == 1
    assert bound(*p4(deadline_s=200.3, flight_time_s=50.2), 0.1)[0] == 1


def test_two_slots_where_it_is_not() -> None:
    found = bound(*p4(), 40.0)
    assert found[0] == 2
    assert found[1] == "the horizon is not a whole number of slots"


def test_one_slot_without_a_rest() -> None:
    model = P3().model(quantities(), "battery")
    assert bound(model, model.row(0), 40.0) == (1, "no rest")


def test_constraints_without_unknowns_do_not_matter() -> None:
    given = quantities(
        hover_distance_m=500.0,
        coverage_radius_m=501.0,
        end_gap_m=0.0,
        hover_altitude_m=50.0,
        min_altitude_m=50.0,
        max_altitude_m=100.0,
    )
    model = P1().model(given, "battery")
    assert bound(model, model.row(0), 1.0)[0] == 1


def test_none_where_resting_discharges() -> None:
    """A longer rest may cost more charge than the shorter hover saves."""
    found = bound(*p4(rest_current_A=-1.0), 1.0)
    assert found == (None, "a longer rest can break P4.a state of charge")


def test_none_where_hovering_charges() -> None:
    found = bound(*p4(hover_current_A=-1.0), 1.0)
    assert found == (None, "a shorter hover can break P4.a state of charge")


def test_none_for_an_equality() -> None:
    model, parameters = p4()
    hover, rest = model.variables
    model.subject_to("both the same", hover == rest)
    assert bound(model, parameters, 1.0) == (None, "both the same is an equality")


def best_in_slots(slot_s: float, horizon_s: float, room: float, drain: float, gain: float) -> float:
    """Longest hover over all pairs of at least one slot each [s]; 0 if there is none."""
    most = math.floor(horizon_s / slot_s + 1e-9)
    pairs = itertools.product(range(1, most), range(1, most))
    return slot_s * max(
        (
            hover
            for hover, rest in pairs
            if hover + rest <= most
            and drain * hover * slot_s - gain * rest * slot_s <= room * (1 + 1e-12)
        ),
        default=0,
    )


@given(
    horizon_s=st.floats(1.0, 40.0) | st.integers(1, 40).map(float),
    slot_s=st.sampled_from([1.0, 1.5, 2.0, 7.0]),
    room=st.floats(0.0, 300.0),
    drain=st.floats(0.1, 20.0),
    gain=st.floats(0.0, 20.0),
)
def test_the_bound_holds(
    horizon_s: float, slot_s: float, room: float, drain: float, gain: float
) -> None:
    """Against every pair of slots, counted without optuav, and the vertex formula for Δ."""
    best_s = min(horizon_s, (room + gain * horizon_s) / (drain + gain))
    model, parameters = p4(
        deadline_s=horizon_s,
        flight_time_s=0.0,
        flight_charge_As=0.0,
        min_soc=1.0 - room / 1000.0,
        hover_current_A=drain,
        rest_current_A=gain,
    )
    slots = bound(model, parameters, slot_s)[0]
    whole = abs(horizon_s / slot_s - round(horizon_s / slot_s)) < 1e-9
    assert slots == (1 if whole else 2)
    lost_s = best_s - best_in_slots(slot_s, horizon_s, room, drain, gain)
    assume(abs(lost_s / slot_s - slots) > 1e-6)  # at the very bound rounding decides
    assert -1e-9 <= lost_s <= slots * slot_s


def test_the_bound_is_reached() -> None:
    """With nothing to gain from resting the obligatory slot of rest costs one slot of hover."""
    model, parameters = p4(deadline_s=60.0, rest_current_A=0.0)
    assert bound(model, parameters, 1.0)[0] == 1
    assert best_in_slots(1.0, 10.0, 800.0, 10.0, 0.0) == pytest.approx(9.0)

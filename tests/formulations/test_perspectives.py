"""The three ways to write the state of charge, by hand and against each other."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from formulations.soc import PERSPECTIVES, adjusted, battery
from optuav.solving.question import problem_of
from tests.formulations.given import quantities


@pytest.mark.parametrize(
    ("perspective", "hover_s", "rest_s", "expected"),
    [
        # 100 A s in flight, 10 A of hover, 5 A of rest, of 1000 A s
        ("battery", 0.0, 0.0, 0.9),
        ("battery", 60.0, 0.0, 0.3),
        ("battery", 60.0, 40.0, 0.5),
        # 1500 J in flight, 105 W of hover less 15 W received, 50 W of rest, of 10 kJ
        ("energy", 0.0, 0.0, 0.85),
        ("energy", 60.0, 0.0, 0.31),
        ("energy", 60.0, 40.0, 0.51),
        # 1500 J of 15 kJ, 105 W of 10.5 kJ, 15 W and 50 W of 10 kJ
        ("adjusted", 0.0, 0.0, 0.9),
        ("adjusted", 60.0, 0.0, 0.39),
        ("adjusted", 60.0, 40.0, 0.59),
    ],
)
def test_by_hand(perspective: str, hover_s: float, rest_s: float, expected: float) -> None:
    found = PERSPECTIVES[perspective](quantities(), hover_s, rest_s)
    assert found == pytest.approx(expected, abs=1e-12)


VOLTAGES = st.floats(5.0, 50.0)
TIMES = st.floats(0.0, 1e3)


@given(VOLTAGES, VOLTAGES, VOLTAGES, TIMES, TIMES, st.floats(0.0, 9.0))
def test_adjusted_is_battery_where_energies_are_charges_at_a_voltage(
    nominal_V: float, flight_V: float, hover_V: float, hover_s: float, rest_s: float, laser_A: float
) -> None:
    """E_1 and E_2 hold B at the voltages of flight and hover, the laser feeds at the nominal.

    Whether they are stated so or follow from the voltages.
    """
    given = quantities(
        nominal_voltage_V=nominal_V,
        flight_energy_J=100.0 * flight_V,
        flight_battery_J=1000.0 * flight_V,
        hover_power_W=(10.0 + laser_A) * hover_V,
        hover_battery_J=1000.0 * hover_V,
        hover_received_W=laser_A * nominal_V,
        rest_received_W=5.0 * nominal_V,
    )
    derived = replace(
        given,
        flight_voltage_V=flight_V,
        hover_voltage_V=hover_V,
        flight_battery_J=None,
        hover_battery_J=None,
    )
    for each in (given, derived):
        assert adjusted(each, hover_s, rest_s) == pytest.approx(
            battery(each, hover_s, rest_s), abs=1e-9
        )


@pytest.mark.parametrize(("problem", "stays"), [("P3", 1), ("P4", 2)])
def test_both_wells_print_on_a_page(problem: str, stays: int) -> None:
    """The rate has a name, stays are written out, stages of flight are told once a quantity."""
    asked = {"building": "b1", "order": "rest-first"} if problem == "P4" else {}
    (part,) = optuav.formulate("paper", problem_of(problem, **asked), perspective="wells").parts
    page = str(part.model)
    assert len(page.splitlines()) <= 40
    assert page.count("k' = k_F / (ω·(1 − ω))") == 1
    assert page.count("k_F /") == 1
    assert "max(" not in page
    assert (
        page.count("a stage of flight") == 4
    )  # Both wells at the end, charge and tilt before stays
    for unknown in ("Δ", "T'")[:stays]:
        assert f"exp(−k'·{unknown})" in page

"""Discrete and continuous optimum of random P4 and P3: the bounds and the order between them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from formulations.formulation import Formulation
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from optuav.engines import closed_form, grid
from optuav.engines.solution import Solution
from optuav.modelling import Model
from optuav.status import Status
from tests.examples import few
from tests.formulations.given import LINEAR

ROUNDING_S = 1e-6


@st.composite
def missions(draw: st.DrawFn, *, whole: bool) -> tuple[Quantities, float]:
    """Quantities and a slot [s]; from hopeless to plenty of charge, up to 150 slots of time."""
    slot_s = draw(st.sampled_from([0.5, 1.0, 7.0]))
    slots = draw(st.integers(0, 150)) + (0.0 if whole else draw(st.floats(0.0, 0.999)))
    horizon_s = slot_s * slots
    hover_A = draw(st.floats(0.5, 100.0))
    hover_W, voltage = 12.0 * hover_A, draw(st.floats(9.0, 16.0))
    given = Quantities(
        deadline_s=horizon_s + 64.0,
        flight_time_s=64.0,
        min_soc=draw(st.floats(0.0, 0.5)),
        packs=2.0,
        capacity_As=0.5 * hover_A * horizon_s * draw(st.floats(0.1, 3.0)) + 1.0,
        nominal_voltage_V=voltage,
        flight_charge_As=draw(st.floats(0.0, 0.3)) * hover_A * horizon_s,
        flight_energy_J=draw(st.floats(0.0, 0.3)) * hover_W * horizon_s,
        hover_current_A=hover_A,
        hover_power_W=hover_W,
        hover_received_W=draw(st.floats(0.0, 0.9)) * hover_W,
        rest_current_A=draw(st.floats(0.0, 2.0)) * hover_A,
        rest_received_W=draw(st.floats(0.0, 2.0)) * hover_W,
        flight_battery_J=1e3 + 15.0 * hover_A * horizon_s,
        hover_battery_J=1e3 + 14.0 * hover_A * horizon_s,
    )
    return given, slot_s


FORMULATIONS: tuple[Formulation, ...] = (P3(), P4("b1"))
PERSPECTIVE = st.sampled_from(LINEAR)


def hover_s(solution: Solution) -> float | None:
    """Δ [s], None where the programme is infeasible; any other status is a failure."""
    if solution.statuses[0] is Status.INFEASIBLE:
        return None
    assert solution.statuses[0] is Status.OPTIMAL
    return solution.point(0)["hover_time_s"]


def both(model: Model, slot_s: float) -> tuple[float | None, float | None]:
    """Δ [s] on the continuum and on the grid, each a point that passes the check."""
    solutions = closed_form.solve(model, 1), grid.solve(model, 1, slot_s=slot_s)
    for solution in solutions:
        if solution.statuses[0].has_answer:
            solution.verify()
    return hover_s(solutions[0]), hover_s(solutions[1])


@pytest.mark.parametrize("whole", [True, False])
@given(st.data(), PERSPECTIVE)
def test_grid_of_p4_is_within_its_bound(whole: bool, data: st.DataObject, perspective: str) -> None:
    """0 ≤ Δ_continuous − Δ_grid ≤ a slot where the horizon is whole slots, < 2 slots otherwise.

    The grid takes Δ ≥ 1 and T' ≥ 1: it has no plan only if the continuum has hardly one.
    """
    given, slot_s = data.draw(missions(whole=whole))
    continuous_s, grid_s = both(P4("b1").model(given, perspective), slot_s)
    bound_s = (1.0 if whole else 2.0) * slot_s + ROUNDING_S
    if continuous_s is None:
        assert grid_s is None
    elif grid_s is None:
        assert continuous_s <= bound_s
    else:
        assert -ROUNDING_S <= continuous_s - grid_s <= bound_s


@few(12)
@pytest.mark.campaign
@given(missions(whole=False), PERSPECTIVE)
def test_grid_of_p3_loses_less_than_a_slot(
    mission: tuple[Quantities, float], perspective: str
) -> None:
    """min(T_max − T_fl, ⌊charge limit⌋) against min(T_max − T_fl, charge limit)."""
    given, slot_s = mission
    continuous_s, grid_s = both(P3().model(given, perspective), slot_s)
    if continuous_s is None or grid_s is None:
        assert continuous_s is grid_s
    else:
        assert -ROUNDING_S <= continuous_s - grid_s <= slot_s + ROUNDING_S


def easier(given: Quantities, way: str, by: float) -> Quantities:
    """The mission with more time, more charge, a lower limit or a stronger laser."""
    changes: dict[str, dict[str, Any]] = {
        "deadline": {"deadline_s": given.deadline_s + 30.0 * by},
        "capacity": {
            "capacity_As": given.capacity_As * (1.0 + by),
            "flight_battery_J": given.flight_battery_J * (1.0 + by),
            "hover_battery_J": given.hover_battery_J * (1.0 + by),
        },
        "limit": {"min_soc": given.min_soc * (1.0 - by)},
        "charge": {
            "rest_current_A": given.rest_current_A * (1.0 + by),
            "rest_received_W": given.rest_received_W * (1.0 + by),
        },
    }
    return replace(given, **changes[way])


@pytest.mark.parametrize("way", ["deadline", "capacity", "limit", "charge"])
@few(8, most=1000)
@pytest.mark.campaign
@given(st.data(), PERSPECTIVE, st.floats(0.0, 1.0))
def test_easier_missions_are_never_worse(
    way: str, data: st.DataObject, perspective: str, by: float
) -> None:
    """Δ grows with T_max, B, −η0 and the charging current, on the continuum and on the grid."""
    given, slot_s = data.draw(missions(whole=False))
    formulation = data.draw(st.sampled_from(FORMULATIONS))
    before = both(formulation.model(given, perspective), slot_s)
    after = both(formulation.model(easier(given, way, by), perspective), slot_s)
    for worse_s, better_s in zip(before, after, strict=True):
        if worse_s is not None:
            assert better_s is not None
            assert better_s >= worse_s - ROUNDING_S


@given(missions(whole=False), PERSPECTIVE, st.sampled_from([0.125, 4.0, 1024.0]))
def test_charges_and_powers_scaled_together_change_nothing(
    mission: tuple[Quantities, float], perspective: str, factor: float
) -> None:
    """A fleet of twice the size draws twice the current from twice the battery."""
    given, slot_s = mission
    scaled = replace(
        given,
        **{
            name: factor * getattr(given, name)
            for name in (
                "capacity_As",
                "flight_charge_As",
                "flight_energy_J",
                "hover_current_A",
                "hover_power_W",
                "hover_received_W",
                "rest_current_A",
                "rest_received_W",
                "flight_battery_J",
                "hover_battery_J",
            )
        },
    )
    before = both(P4("b1").model(given, perspective), slot_s)
    assert both(P4("b1").model(scaled, perspective), slot_s) == before

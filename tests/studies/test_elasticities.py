"""Elasticities: exact ones from shadow prices against hand calculations and solving again."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav.studies.uncertain.effects import Effect
from optuav.studies.uncertain.study import Sensitivity


def effect(found: Sensitivity, key: str) -> Effect:
    return next(each for each in found.effects if each.key == key)


@pytest.fixture(scope="module")
def direct() -> Sensitivity:
    """`paper-table2` with time to spare and no laser: hovers until the charge is used."""
    mission = optuav.load("paper-table2").replace(
        {
            "laser": None,
            "flight.charge_current_A": None,
            "flight.charge_power_W": None,
            "limits.deadline_s": 5000,
        }
    )
    return optuav.sensitivity(mission, {}, perspective="battery")


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("paper", "battery.capacity_As"),
        ("paper", "battery.flow_rate_per_s"),
        ("paper", "rotor.max_speed_rad_s"),
        ("paper-table2", "battery.available_fraction"),
        ("paper-table2", "flight.hover_current_A"),
        ("paper-table2", "flight.acceleration_m_s2"),
        ("matrice350", "flight.max_speed_m_s"),
        ("matrice350", "laser.visibility_km"),
    ],
)
def test_exact_elasticities_of_a_battery_that_must_not_run_dry(name: str, key: str) -> None:
    """Rates by shadow prices of both wells are those of solving again, 0.1 % to either side."""
    mission = optuav.load(name)
    now = effect(optuav.sensitivity(mission, {}, samples=1), key)
    less, more = (
        optuav.solve(mission.replace({key: now.now * (1 + step)})) for step in (-1e-3, 1e-3)
    )
    assert less.route == more.route
    measured = (more.hover_time_s - less.hover_time_s) / (more.hover_time_s + less.hover_time_s)
    assert now.exact_elasticity == pytest.approx(1e3 * measured, rel=1e-3)


def test_elasticities_of_a_direct_flight_by_hand(direct: Sensitivity) -> None:
    """Δ = ((1 − η0) B − I_fl T_fl)/I_hv, with B = 72 000 As and the recovered loads."""
    usable_As, flight_As, hover_A = 0.95 * 72000, 93.658 * 59.35, 72.073
    hover_s = (usable_As - flight_As) / hover_A
    assert direct.hover_time_s == pytest.approx(hover_s, rel=1e-4)
    size = effect(direct, "battery.capacity_As")
    assert size.exact_elasticity == pytest.approx(usable_As / (hover_A * hover_s), rel=1e-4)
    assert size.elasticity == pytest.approx(size.exact_elasticity, rel=1e-9)
    assert size.hover_low_s == pytest.approx((0.9 * usable_As - flight_As) / hover_A, rel=1e-4)
    load = effect(direct, "flight.hover_current_A")
    assert load.exact_elasticity == pytest.approx(-1.0, abs=1e-6)
    assert load.elasticity == pytest.approx(-1.0 / 0.99, rel=1e-6)  # mean of 1/1.1 and 1/0.9
    assert effect(direct, "limits.deadline_s").exact_elasticity == 0.0


def test_measured_and_exact_agree_where_nothing_bends(direct: Sensitivity) -> None:
    """Within a tenth of the value, to a fifth of the elasticity at worst; most far closer."""
    for each in direct.effects:
        measured, exact = each.elasticity, each.exact_elasticity
        if measured is not None and exact is not None and abs(exact) > 0.01:
            assert measured == pytest.approx(exact, rel=0.2), each.key


def test_a_kink_has_no_elasticity() -> None:
    """Where charge and deadline end the hover together, more time brings nothing, less costs."""
    mission = optuav.load("paper-table2").replace(
        {
            "laser": None,
            "flight.charge_current_A": None,
            "flight.charge_power_W": None,
            "limits.deadline_s": 5000,
        }
    )
    plan = optuav.solve(mission, perspective="battery")
    both = mission.replace({"limits.deadline_s": plan.mission_time_s})
    found = effect(optuav.sensitivity(both, {}, perspective="battery"), "limits.deadline_s")
    assert found.exact_elasticity is None
    share = plan.mission_time_s / plan.hover_time_s
    assert found.exact_less == pytest.approx(share, rel=1e-6)  # a second less costs a second
    assert found.exact_more == 0.0
    assert found.hover_high_s == pytest.approx(plan.hover_time_s)
    assert found.hover_low_s == pytest.approx(plan.hover_time_s - 0.1 * plan.mission_time_s)


@pytest.mark.parametrize("perspective", ["available", "battery"])
@pytest.mark.parametrize("axis", ["link.device_m[0]", "route.destination_m[0]"])
def test_tied_itineraries_have_the_rates_of_solving_again_on_either_side(
    perspective: str, axis: str
) -> None:
    """`paper` is symmetric: moved to one side, one of two roofs is the best, to the other side the
    other one. Above, the hover time is that of the route that gains more, or loses less."""
    mission, (key, _) = optuav.load("paper"), axis.split("[")
    table, name = key.split(".")
    now, *rest = getattr(getattr(mission, table), name)
    here, less, more = (
        optuav.solve(mission.replace({key: [now + step, *rest]}), perspective=perspective)
        for step in (0.0, -1e-4 * now, 1e-4 * now)
    )
    assert less.route != more.route
    below, above = (
        (end.hover_time_s / here.hover_time_s - 1.0) / step
        for end, step in ((less, -1e-4), (more, 1e-4))
    )
    assert below < above - 5e-4
    found = optuav.sensitivity(mission, {}, perspective=perspective, samples=1)
    each = effect(found, axis)
    assert each.exact_less == pytest.approx(below, rel=5e-3)
    assert each.exact_more == pytest.approx(above, rel=5e-3)
    assert each.exact_elasticity is None
    assert {"exact_less": each.exact_less, "exact_more": each.exact_more}.items() <= next(
        row for row in found.to_dict()["effects"] if row["key"] == axis
    ).items()


def test_a_kink_is_told_below_the_table() -> None:
    """With its rates below and above the value, on a row that would have no room for two."""
    told = " ".join(str(optuav.sensitivity("paper", {}, samples=1)).split())
    assert "-0.001 kink" in told
    assert "Exact at a kink: link.device_m[0] -0.012 below, +0.003 above;" in told


@settings(max_examples=5, deadline=None)
@given(
    aside_m=st.floats(20.0, 60.0) | st.floats(-60.0, -20.0),
    mass_kg=st.floats(1.2, 1.32),
    perspective=st.sampled_from(["available", "battery"]),
)
def test_without_a_tie_both_sides_are_the_same(
    aside_m: float, mass_kg: float, perspective: str
) -> None:
    """Off the axis of `paper` one itinerary is the best: its rates are those of solving again."""
    device_m = [1000.0 + aside_m, 3000.0, 0.0]
    mission = optuav.load("paper").replace({"link.device_m": device_m, "body.mass_kg": mass_kg})
    found = optuav.sensitivity(mission, {}, perspective=perspective, samples=1)
    assert not [each.key for each in found.effects if each.has_kink]
    each = effect(found, "link.device_m[0]")
    hover_s = [
        optuav.solve(
            mission.replace({"link.device_m": [device_m[0] + step, *device_m[1:]]}),
            perspective=perspective,
        ).hover_time_s
        for step in (-0.5, 0.5)
    ]
    rate = (hover_s[1] - hover_s[0]) * device_m[0] / found.hover_time_s
    assert each.exact_elasticity == pytest.approx(rate, rel=1e-3, abs=1e-6)

"""`relay-today` can be flown: speeds, powers, light and weights are those that have been shown."""

from __future__ import annotations

from math import exp, pi

import pytest

import optuav

MISSION = optuav.load("relay-today")


def test_hover_draws_what_matrice350_does() -> None:
    """1103.5 W with the radio: mass to the power of 3/2 over the published 8 m/s and hover."""
    (hover,) = (phase for phase in optuav.solve(MISSION, "P3").phases if phase.kind == "hover")
    lit_W = optuav.link_budget(MISSION, "hover").dc_W
    assert lit_W - hover.power_W == pytest.approx(1103.5, abs=0.5)


def test_light_becomes_charge_as_in_demonstrations() -> None:
    """2 kW of light: 98.17 % through the aperture, 10 km of visibility, 20 % of what arrives."""
    budget = optuav.link_budget(MISSION, "hover")
    assert budget.light_W == 2000.0
    arriving_W = 2000.0 * (1.0 - exp(-4.0)) * budget.air
    assert 0.19 < budget.dc_W / arriving_W < 0.205
    assert budget.dc_W / budget.light_W < 0.2


def test_the_plan_flies_within_the_airframe() -> None:
    """No faster than 23 m/s, from the van and back to it, and the judge flies it too."""
    plan = optuav.solve(MISSION)
    assert plan.flyable
    assert plan.peak_speed_m_s <= 23.0
    assert optuav.audit(plan).flyable
    assert any("not a safety assessment" in note for note in plan.notes)


def test_hovering_for_ever_takes_more_light_than_was_shown() -> None:
    """1103.5 W at 20 %: 28 kW/m² on average over the receiver, near 300 in the middle."""
    budget = optuav.link_budget(MISSION, "hover")
    light_W = 1103.5 / 0.2
    assert light_W / (pi * 0.25**2) == pytest.approx(28.1e3, rel=0.01)
    peak = budget.peak_irradiance_W_m2 * light_W / budget.on_receiver_W
    assert 290e3 < peak < 320e3

"""Random quantities of P3 and P4, from hopeless to plenty, and their exact answers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from formulations.parameters import Quantities
from optuav.physics.kibam import Stage


def random_quantities(rng: np.random.Generator) -> Quantities:
    """Quantities of one itinerary with a rest, its flight in legs of constant current."""
    horizon_s = rng.uniform(5.0, 2000.0)
    hover_A = rng.uniform(0.5, 100.0)
    hover_W = 12.0 * hover_A
    flight_s = rng.uniform(1.0, 300.0)
    shares = rng.dirichlet(np.ones(3))
    legs_s = flight_s * rng.dirichlet(np.ones(3))
    flight_As = rng.uniform(0.0, 0.5) * hover_A * horizon_s
    legs = [Stage(-flight_As * c / t, t) for c, t in zip(shares, legs_s, strict=True)]
    packs = float(rng.integers(1, 4))
    capacity_As = hover_A * horizon_s * rng.uniform(0.1, 3.0) / packs + 1.0
    stays = ["hover", "rest"] if rng.random() < 0.5 else ["rest", "hover"]
    return Quantities(
        deadline_s=horizon_s + flight_s,
        min_soc=rng.uniform(0.0, 0.5),
        packs=packs,
        capacity_As=capacity_As,
        nominal_voltage_V=rng.uniform(9.0, 16.0),
        flight_time_s=flight_s,
        flight_charge_As=flight_As,
        flight_energy_J=flight_As * rng.uniform(10.0, 16.0),
        hover_current_A=hover_A,
        hover_power_W=hover_W,
        hover_received_W=rng.uniform(0.0, 0.9) * hover_W,
        rest_current_A=rng.choice([0.0, rng.uniform(0.0, 2.0)], p=[0.1, 0.9]) * hover_A,
        rest_received_W=rng.choice([0.0, rng.uniform(0.0, 2.0)], p=[0.1, 0.9]) * hover_W,
        flight_voltage_V=15.0,
        hover_voltage_V=14.0,
        available_fraction=rng.uniform(0.1, 0.9),
        flow_rate_per_s=10.0 ** rng.uniform(-6.0, -3.0),
        hover_distance_m=400.0,
        coverage_radius_m=rng.choice([400.0, 500.0]),
        hover_altitude_m=50.0,
        min_altitude_m=rng.choice([30.0, 50.0]),
        max_altitude_m=120.0,
        end_gap_m=0.0,
        steps=(legs[0], stays[0], legs[1], stays[1], legs[2]),
    )


class Exact(NamedTuple):
    """Best times in fractions, or None where there are none."""

    hover_s: Fraction
    rest_s: Fraction


def exact(given: Mapping[str, Any], perspective: str, *, rests: bool) -> Exact | None:
    """P3 or P4 in exact arithmetic, from the numbers of one itinerary.

    With charge q to spend, a a second of hovering, r back a second of resting and τ time, Δ needs
    r T' ≥ a Δ − q and leaves T' ≤ τ − Δ: Δ = min(τ, (q + r τ)/(a + r)), or τ if Δ brings more than
    it takes. A rest that discharges is no help: r = 0.
    """
    g = {name: Fraction(float(value)) for name, value in given.items() if _number(value)}
    B, share = g["packs"] * g["capacity_As"], 1 - g["min_soc"]
    E0 = B * g.get("nominal_voltage_V", Fraction(0))
    if perspective == "battery":
        q, a = share * B - g["flight_charge_As"], g["hover_current_A"]
        r = g.get("rest_current_A", Fraction(0))
    elif perspective == "energy":
        q, a = share * E0 - g["flight_energy_J"], g["hover_power_W"] - g["hover_received_W"]
        r = g.get("rest_received_W", Fraction(0))
    else:
        E1, E2 = (
            g[f"{stay}_battery_J"] if f"{stay}_battery_J" in g else B * g[f"{stay}_voltage_V"]
            for stay in ("flight", "hover")
        )
        q = share - g["flight_energy_J"] / E1
        a = g["hover_power_W"] / E2 - g["hover_received_W"] / E0
        r = g.get("rest_received_W", Fraction(0)) / E0
    τ = g["deadline_s"] - g["flight_time_s"]
    r = max(r, Fraction(0)) if rests else Fraction(0)
    if a + r <= 0:
        return Exact(τ, Fraction(0)) if τ >= 0 and a * τ <= q else None
    hover = min(τ, (q + r * τ) / (a + r))
    if hover < 0:
        return None
    need = a * hover - q
    return Exact(hover, need / r if need > 0 else Fraction(0))


def _number(value: object) -> bool:
    return isinstance(value, float | np.ndarray) and np.ndim(value) == 0 and math.isfinite(value)

"""Plans of a rotary wing at stated speeds, by formulas of the tests' own, and random missions.

Power as it is printed, legs as d/V + V/a at the draw of their cruise, wells by `tests.kibam`. What
hovering and resting draw is taken from the network, as no speed changes it.
"""

from __future__ import annotations

import itertools
import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from hypothesis import strategies as st

import optuav
from optuav import Mission
from optuav.network.network import build_network
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.network.timeline import stay_net
from tests.flight.test_flights import WINGED
from tests.kibam import Kibam

Array = npt.NDArray[np.float64]


class Legs(NamedTuple):
    """Duration [s] and current drawn [A] of the legs of a route, one array a leg."""

    times_s: list[Array]
    currents_A: list[Array]


def route(mission: Mission, building: str | None, rest_first: bool) -> list[int]:
    """The numbers of the places of a route."""
    if building is None:
        return [ORIGIN, HOVER, DESTINATION]
    roof = FIRST_BUILDING + mission.buildings.names.index(building)
    return [ORIGIN, roof, HOVER, DESTINATION] if rest_first else [ORIGIN, HOVER, roof, DESTINATION]


def fastest_m_s(mission: Mission, way_m: Array) -> float:
    """The largest horizontal speed on a straight leg, by halving what it reaches."""
    keys, (x, y, z) = vars(mission.flight), way_m
    d, a = math.hypot(x, y), keys["acceleration_m_s2"]
    u, (wx, wy, _) = (x / d, y / d), mission.wind.velocity_m_s
    along, across = wx * u[0] + wy * u[1], wx * u[1] - wy * u[0]
    cap = along + math.sqrt(keys["max_speed_m_s"] ** 2 - across**2)
    upright_s = z / keys["climb_speed_m_s"] if z > 0 else -z / keys["descent_speed_m_s"]
    low, high = 0.0, min(cap, math.sqrt(a * d))
    if d / high + high / a >= upright_s:
        return high
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if d / middle + middle / a > upright_s else (low, middle)
    return high


def legs(mission: Mission, places: list[int], speeds_m_s: Array) -> Legs:
    """Straight legs at speeds (leg, point), which they must be able to reach."""
    keys, at_m = vars(mission.flight), build_network(mission).places.position_m
    a, v_0 = keys["acceleration_m_s2"], keys["induced_speed_m_s"]
    assert mission.body is not None
    weight_N = mission.body.mass_kg * mission.body.gravity_m_s2
    found = Legs([], [])
    for (start, end), V in zip(itertools.pairwise(places), speeds_m_s, strict=True):
        x, y, z = at_m[end] - at_m[start]
        d = math.hypot(x, y)
        wx, wy, _ = mission.wind.velocity_m_s
        air = np.hypot(V * x / d - wx, V * y / d - wy)
        lift = np.sqrt(np.sqrt(1 + air**4 / (4 * v_0**4)) - air**2 / (2 * v_0**2))
        power_W = (
            keys["blade_power_W"] * (1 + 3 * air**2 / keys["tip_speed_m_s"] ** 2)
            + keys["induced_power_W"] * lift
            + keys["parasite_W_s3_m3"] * air**3
        )
        time_s = d / V + V / a
        energy_J = power_W * time_s + weight_N * max(z, 0.0)
        volt = keys["efficiency"] * mission.battery.nominal_voltage_V
        found.times_s.append(time_s)
        found.currents_A.append(energy_J / time_s / volt)
    return found


def balanced_s(
    mission: Mission, building: str | None, rest_first: bool, speeds_m_s: Array
) -> Array:
    """The longest hover by charge and deadline at speeds (leg, point); −∞ where none."""
    places, network = route(mission, building, rest_first), build_network(mission)
    flown = legs(mission, places, speeds_m_s)
    hover_A = -float(stay_net(network, HOVER).current_A)
    gain_A = 0.0
    if building is not None:
        gain_A = max(0.0, float(stay_net(network, places[1 if rest_first else 2]).current_A))
    stored = mission.battery.packs * mission.battery.capacity_As * (1.0 - mission.limits.min_soc)
    drawn = sum(t * i for t, i in zip(flown.times_s, flown.currents_A, strict=True))
    left_s = mission.limits.deadline_s - sum(flown.times_s)
    # Least rest at Δ = x is max(0, (I x − q)/r); Δ + T' ≤ left.
    spare = stored - drawn
    if hover_A + gain_A > 0.0:
        most = np.minimum(left_s, (spare + gain_A * left_s) / (hover_A + gain_A))
        if gain_A == 0.0:
            most = np.minimum(left_s, spare / hover_A)
    else:
        most = np.where(spare >= hover_A * left_s, left_s, -np.inf)
    return np.where(most >= 0.0, most, -np.inf)


def delivered_s(
    mission: Mission, building: str | None, rest_first: bool, speeds_m_s: Array
) -> Array:
    """The longest hover that wells deliver at speeds (leg, point), by halving; −∞ where none.

    With a rest, the best of many lengths of it, so that it may fall short of the optimum.
    """
    places, network = route(mission, building, rest_first), build_network(mission)
    flown, battery = legs(mission, places, speeds_m_s), mission.battery
    nets = [float(stay_net(network, place).current_A) for place in places[1:-1]]
    left_s = mission.limits.deadline_s - sum(flown.times_s)
    best = np.full(speeds_m_s.shape[1], -np.inf)
    for share in (0.0,) if building is None else np.linspace(0.0, 1.0, 9):

        def lasts(hover_s: Array, share: float = share) -> npt.NDArray[np.bool_]:
            whole = battery.packs * battery.capacity_As
            wells = Kibam(whole, battery.available_fraction, battery.flow_rate_per_s)
            rest_s = share * np.maximum(left_s - hover_s, 0.0)
            full = np.ones(len(hover_s), bool)
            for leg, (time_s, current_A) in enumerate(zip(*flown, strict=True)):
                wells.spend(-current_A, time_s)
                if leg < len(nets):
                    wells.spend(nets[leg], hover_s if places[leg + 1] == HOVER else rest_s)
                    full &= wells.y1 <= wells.share * whole * (1 + 1e-12)
            enough = (wells.least >= 0.0) & (wells.soc >= mission.limits.min_soc)
            return full & enough & (hover_s <= left_s)

        low, high = np.zeros(len(best)), np.maximum(left_s, 0.0)
        able = lasts(low)
        for _ in range(40):
            middle = 0.5 * (low + high)
            fine = lasts(middle)
            low, high = np.where(fine, middle, low), np.where(fine, high, middle)
        best = np.maximum(best, np.where(able, low, -np.inf))
    return best


def grid(mission: Mission, places: list[int], count: int, low: float = 0.25) -> Array:
    """Speeds (leg, point) all over those of a route."""
    at_m = build_network(mission).places.position_m
    most = [fastest_m_s(mission, at_m[b] - at_m[a]) for a, b in itertools.pairwise(places)]
    axes = np.meshgrid(*(np.linspace(low * m, m, count) for m in most))
    return np.array([axis.ravel() for axis in axes])


@st.composite
def winged(draw: st.DrawFn, windy: bool = True, calm_hover: bool = True) -> Mission:
    """Missions of a rotary wing, from hopeless to plenty, with at most two buildings."""
    factor = st.floats(0.6, 1.6)
    keys: dict[str, Any] = {
        f"flight.{name}": vars(WINGED.flight)[name] * draw(factor)
        for name in (
            "blade_power_W",
            "induced_power_W",
            "induced_speed_m_s",
            "parasite_W_s3_m3",
            "acceleration_m_s2",
            "max_speed_m_s",
        )
    }
    keys["flight.through_buildings"] = True
    keys["flight.efficiency"] = draw(st.floats(0.5, 1.0))
    keys["flight.rest_current_A"] = draw(st.sampled_from([0.0, 0.1]))
    keys["limits.deadline_s"] = draw(st.floats(300.0, 3000.0))
    keys["limits.min_soc"] = draw(st.floats(0.0, 0.3))
    keys["battery.capacity_As"] = draw(st.floats(2000.0, 20_000.0))
    keys["battery.flow_rate_per_s"] = draw(st.floats(1e-6, 1e-4))
    keys["battery.available_fraction"] = draw(st.floats(0.3, 0.9))
    keys["route.origin_m"] = [draw(st.floats(-1500, 1500)), draw(st.floats(-1500, 500)), 10.0]
    keys["laser.power_W"] = draw(st.floats(100.0, 2000.0))
    if windy:
        keys["wind.velocity_m_s"] = [draw(st.floats(-5, 5)), draw(st.floats(-5, 5)), 0.0]
    buildings = WINGED.buildings[: draw(st.integers(0, 2))]
    return optuav.load(WINGED).replace({**keys, "buildings": buildings})

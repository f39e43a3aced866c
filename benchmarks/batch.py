"""Batches of scenarios against a closed form written by hand for these very columns."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import optuav
from benchmarks.timing import Row, interleaved_s
from optuav.arrays import Floats
from optuav.network.network import build_network
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.network.timeline import stay_net

COUNT, REPEATS = 100_000, 5
AT_ONCE = {"battery": 1500, "available": 400}  # What is fastest by hand
STEPS = 5  # Newton's
LIMITS = {"battery": 2.0, "energy": 2.0, "adjusted": 2.0, "available": 3.0}
SAME_S = 1e-6


def run() -> list[Row]:
    """A hundred thousand deadlines and sizes of the shipped mission: 21 itineraries each."""
    mission, draw = optuav.load("paper"), np.random.default_rng(0)
    columns = {
        "limits.deadline_s": draw.uniform(600.0, 3000.0, COUNT),
        "battery.capacity_As": draw.uniform(30e3, 45e3, COUNT),
    }
    by_hand = {"battery": by_charge(mission), "available": by_wells(mission)}

    def ours(perspective: Any) -> Floats:
        found = optuav.batch_arrays(mission, columns, perspective=perspective, paired=True)
        hover_s: Floats = found["hover_time_s"]
        return hover_s

    def other(kind: str) -> Floats:
        parts, size = [], AT_ONCE[kind]
        for first in range(0, COUNT, size):
            some = (column[first : first + size] for column in columns.values())
            parts.append(by_hand[kind](*some))
        return np.concatenate(parts)

    rows = []
    for name, limit in LIMITS.items():
        kind = name if name in by_hand else "battery"
        if name in by_hand:
            apart_s = np.abs(ours(name) - other(name)).max()
            assert apart_s < SAME_S, f"by hand, {name} differs by {apart_s:g} s"
        pair = interleaved_s(lambda p=name: ours(p), lambda k=kind: other(k), REPEATS)
        title = f"a scenario, {name} / NumPy by hand, {kind}"
        rows.append(Row(title, *(each / COUNT for each in pair), None, limit))
    return rows


def by_charge(mission: Any) -> Callable[[Floats, Floats], Floats]:
    """The longest hover by charge alone, with its rest and the tie rule."""
    network = build_network(mission)
    routes, share = network.routes, 1.0 - mission.limits.min_soc
    flight_s, flight_As = routes.flight_time_s, routes.flight_charge_As
    hover_A = -stay_net(network, HOVER).current_A
    rests_A = stay_net(network, FIRST_BUILDING + routes.building).current_A
    rest_A = np.where(routes.building >= 0, rests_A, 0.0)

    def solve(deadline_s: Floats, capacity_As: Floats) -> Floats:
        left = deadline_s[:, None] - flight_s
        spare = share * mission.battery.packs * capacity_As[:, None] - flight_As
        hover = np.minimum(left, (spare + rest_A * left) / (hover_A + rest_A))
        hover = np.where(hover >= 0.0, hover, -np.inf)
        tied = hover >= hover.max(axis=1)[:, None] - SAME_S
        with np.errstate(divide="ignore", invalid="ignore"):
            rest = np.where(rest_A > 0.0, np.maximum((hover_A * hover - spare) / rest_A, 0.0), 0.0)
        whole = np.where(tied, flight_s + hover + rest, np.inf)
        best = np.argmax(whole <= whole.min(axis=1)[:, None] + SAME_S, axis=1)
        every = np.arange(len(best))
        rest[every, best]  # the answer too
        found: Floats = hover[every, best]
        return found

    return solve


def by_wells(mission: Any) -> Callable[[Floats, Floats], Floats]:
    """The longest hover with wells, where a rest fills them as far as time allows.

    Right for these columns: after a hover no rest lasts until the wells are past full.
    """
    network, battery = build_network(mission), mission.battery
    routes, legs = network.routes, network.legs
    share, rate = battery.available_fraction, battery.flow_rate_per_s
    k = rate / (share * (1.0 - share))
    hover_A = -stay_net(network, HOVER).current_A
    rest_A = stay_net(network, FIRST_BUILDING + np.arange(len(mission.buildings))).current_A
    # Of each leg: what it adds to the tilt z = y1 - ω y, and by how much that decays.
    tilt = np.zeros(len(legs.start))
    for current_A, duration_s in zip(legs.currents_A, legs.durations_s, strict=True):
        e = np.exp(-k * duration_s)
        tilt = tilt * e - (1.0 - share) * current_A * (1.0 - e) / k
    charge, decay = legs.charge_As, np.exp(-k * legs.duration_s)
    hold, gain = (1.0 - share) * hover_A / k, (1.0 - share) * rest_A / k

    def of(numbers: Any) -> tuple[tuple[Any, Any, Any], ...]:
        return tuple((charge[each], tilt[each], decay[each]) for each in routes.legs[numbers].T)

    direct, first, last = of(slice(0, 1)), of(slice(1, None, 2)), of(slice(2, None, 2))
    # Resting first: until the wells are full, by Newton's method from the start.
    full_s = np.zeros(len(rest_A))
    for _ in range(50):
        (c1, z1, _), e = first[0], np.exp(-k * full_s)
        y1 = share * (rest_A * full_s - c1) + z1 * e + gain * (1.0 - e)
        full_s = np.maximum(full_s - y1 / (share * rest_A + (gain - z1) * k * e), 0.0)

    def flown(full_As: Floats, hover: Floats, most: Floats) -> Floats:
        """Direct: until the well is empty at the end."""
        (c1, z1, _), (c2, z2, d2), _ = direct
        for _ in range(STEPS):
            e = np.exp(-k * hover)
            y1 = share * (full_As - c1 - c2 - hover_A * hover)
            y1 = y1 + (z1 * e - hold * (1.0 - e)) * d2 + z2
            hover = np.minimum(hover + y1 / (share * hover_A + k * (z1 + hold) * e * d2), most)
        return hover

    def rested(full_As: Floats, left: Floats, hover: Floats, most: Floats) -> Floats:
        """Resting first, until the wells are full or no time is left."""
        (c1, z1, _), (c2, z2, d2), (c3, z3, d3) = first
        for _ in range(STEPS):
            e, rest = np.exp(-k * hover), np.minimum(full_s, left - hover)
            r = np.exp(-k * rest)
            tilted = (z1 * r + gain * (1.0 - r)) * d2 + z2
            y1 = share * (full_As - c1 - c2 - c3 + rest_A * rest - hover_A * hover)
            y1 = y1 + (tilted * e - hold * (1.0 - e)) * d3 + z3
            slope = share * hover_A + k * (tilted + hold) * e * d3
            more = share * rest_A + (gain - z1) * k * r * d2 * e * d3
            slope = slope + np.where(rest < full_s, more, 0.0)
            hover = np.minimum(hover + y1 / slope, most)
        return hover

    def resting(full_As: Floats, left: Floats, hover: Floats, most: Floats) -> Floats:
        """Hovering first: until the well is empty on the building, or at the end."""
        (c1, z1, _), (c2, z2, d2), (c3, z3, d3) = last
        for _ in range(STEPS):
            e, rest = np.exp(-k * hover), left - hover
            r = np.exp(-k * rest)
            tilted = (z1 * e - hold * (1.0 - e)) * d2 + z2
            bend = k * (z1 + hold) * e * d2
            y1 = share * (full_As - c1 - c2 - hover_A * hover)
            end = y1 - share * (c3 - rest_A * rest) + (tilted * r + gain * (1.0 - r)) * d3 + z3
            y1 = y1 + tilted
            slope = share * hover_A + bend
            end_slope = share * (hover_A + rest_A) + (bend + (gain - tilted) * k) * r * d3
            hover = np.minimum(hover + np.minimum(y1 / slope, end / end_slope), most)
        return hover

    def solve(deadline_s: Floats, capacity_As: Floats) -> Floats:
        full_As = battery.packs * capacity_As[:, None]
        left = deadline_s[:, None] - routes.flight_time_s
        spare = (1.0 - mission.limits.min_soc) * full_As - routes.flight_charge_As
        gained = np.concatenate([[0.0], np.repeat(rest_A, 2)])
        most = np.minimum(left, (spare + gained * left) / (hover_A + gained))
        start = np.maximum(most, 0.0)
        found = np.full(len(left), -np.inf)
        for which, way in ((slice(1, None, 2), rested), (slice(2, None, 2), resting)):
            times = way(full_As, left[:, which], start[:, which], most[:, which])
            found = np.maximum(found, times.max(axis=1))
        return np.maximum(found, flown(full_As, start[:, :1], most[:, :1])[:, 0])

    return solve

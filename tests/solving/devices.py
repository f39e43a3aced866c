"""Missions over several devices by formulas of the tests' own: legs, light, wells, and all routes.

Written apart from the package: legs at constant acceleration, the laser's power by its fit, the
hover points stated, the wells of `tests.kibam`, every order of devices and place of the rest by
`itertools`, and HiGHS for every route where the charge is affine in the times.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, table I.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import linprog

import optuav
from tests.kibam import Kibam

Floats = npt.NDArray[np.float64]
Point = tuple[float, float, float]
HALVINGS, REFINED = 60, 6


@dataclass
class Town:
    """A mission over several devices in plain numbers."""

    devices: dict[str, Point]  # Their hover points
    roofs: dict[str, Point]
    shares: dict[str, float]
    deadline_s: float = 1800.0
    min_soc: float = 0.1
    always: bool = False
    capacity_As: float = 72_000.0
    voltage_V: float = 11.1
    fraction: float = 0.8
    rate_per_s: float = 4.5e-5
    charge_A: float = 30.0
    laser_W: float = 3000.0
    acceleration_m_s2: float = 8.0
    flight: tuple[float, float] = (95.0, 1400.0)
    hover: tuple[float, float] = (70.0, 1000.0)
    rest: tuple[float, float] = (1.0, 12.0)
    ends: tuple[Point, Point] = ((0.0, 0.0, 50.0), (2000.0, 0.0, 50.0))
    laser_m: Point = (1000.0, 0.0, 60.0)
    route_legs: dict[tuple[str, str], float] = field(default_factory=dict)

    def mission(self) -> optuav.Mission:
        """The same as a mission of the package."""
        flight_A, flight_W = self.flight
        devices = [
            {"name": name, "position_m": [x, y, 0.0], "hover_m": [x, y, z], "share": share}
            for (name, (x, y, z)), share in zip(
                self.devices.items(), self.shares.values(), strict=True
            )
        ]
        return optuav.load("paper").replace(
            {
                **dict.fromkeys(("rotor", "body"), None),
                "flight": {
                    "model": "regimes",
                    "acceleration_m_s2": self.acceleration_m_s2,
                    "flight_current_A": flight_A,
                    "flight_power_W": flight_W,
                    "hover_current_A": self.hover[0],
                    "hover_power_W": self.hover[1],
                    "rest_current_A": self.rest[0],
                    "rest_power_W": self.rest[1],
                },
                "route.origin_m": list(self.ends[0]),
                "route.destination_m": list(self.ends[1]),
                "limits.deadline_s": self.deadline_s,
                "limits.min_soc": self.min_soc,
                "limits.keep_soc": "always" if self.always else "end",
                "limits.max_altitude_m": 200.0,
                "battery.packs": 1,
                "battery.capacity_As": self.capacity_As,
                "battery.nominal_voltage_V": self.voltage_V,
                "battery.available_fraction": self.fraction,
                "battery.flow_rate_per_s": self.rate_per_s,
                "battery.charge_current_A": self.charge_A,
                "laser.power_W": self.laser_W,
                "laser.position_m": list(self.laser_m),
                "devices": devices,
                "buildings": [
                    {"name": name, "position_m": list(at)} for name, at in self.roofs.items()
                ],
            }
        )

    def at(self, place: str) -> Point:
        """Where a place is [m]."""
        ends = dict(zip(("origin", "destination"), self.ends, strict=True))
        return {**ends, **self.devices, **self.roofs}[place]

    def leg_s(self, start: str, end: str) -> float:
        """Flight time from rest to rest [s]."""
        return 2.0 * math.sqrt(math.dist(self.at(start), self.at(end)) / self.acceleration_m_s2)

    def received_W(self, place: str) -> float:
        """Power of the laser there [W], up to what the battery takes."""
        a1, b1, a2, b2 = 0.34, -1.1, 0.5434, -0.2761  # [1], as in the mission `paper`
        nu = math.exp(-0.1019 * math.dist(self.at(place), self.laser_m) / 1000.0)
        power = a1 * a2 * nu * self.laser_W + a2 * b1 * nu + b2
        return min(max(power, 0.0), self.charge_A * self.voltage_V)

    def net(self, place: str) -> tuple[float, float]:
        """Current [A] and power [W] into the battery of a stay there."""
        drawn_A, drawn_W = self.hover if place in self.devices else self.rest
        power_W = self.received_W(place)
        return power_W / self.voltage_V - drawn_A, power_W - drawn_W

    def routes(self) -> Iterator[tuple[str, ...]]:
        """Every route: devices in any order, and one roof at most, anywhere between."""
        for order in itertools.permutations(self.devices):
            yield order
            for roof, place in itertools.product(self.roofs, range(len(order) + 1)):
                yield (*order[:place], roof, *order[place:])

    def phases(self, route: Sequence[str]) -> list[tuple[str, float, float, float]]:
        """Kind of every phase, current and power into the battery, and its time or share [s]."""
        (flight_A, flight_W), phases = self.flight, []
        for start, end in itertools.pairwise(("origin", *route, "destination")):
            phases.append(("flight", -flight_A, -flight_W, self.leg_s(start, end)))
            if end in self.devices:
                phases.append(("hover", *self.net(end), self.shares[end]))
            elif end in self.roofs:
                phases.append(("rest", *self.net(end), 1.0))
        return phases

    def linear(self, route: Sequence[str], energy: bool = False) -> tuple[float, float]:
        """The longest Δ, −∞ for none, and the shortest T' for it [s], by HiGHS."""
        whole = self.capacity_As * (self.voltage_V if energy else 1.0)
        budget, by_hover, by_rest, flown_s = (1.0 - self.min_soc) * whole, 0.0, 0.0, 0.0
        rows = []  # by_hover Δ + by_rest T' ≥ −budget, at landings and at the end
        for kind, current, power, amount in self.phases(route):
            net = power if energy else current
            if kind == "flight":
                budget, flown_s = budget + net * amount, flown_s + amount
                rows.append((by_hover, by_rest, budget))
            elif kind == "hover":
                by_hover += net * amount
            else:
                by_rest += net
        rests = any(place in self.roofs for place in route)
        rows = rows if self.always else rows[-1:]
        above = [[-h, -r] for h, r, _ in rows] + [[1.0, 1.0]]
        most = [b for *_, b in rows] + [self.deadline_s - flown_s]
        bounds = [(0, None), (0, None if rests else 0)]
        best = linprog([-1.0, 0.0], above, most, bounds=bounds)
        if best.status:
            return -math.inf, 0.0
        hover_s = float(best.x[0])
        least = linprog([0.0, 1.0], above, most, bounds=[(hover_s - 1e-9, None), bounds[1]])
        return hover_s, float(least.x[1]) if least.status == 0 else float(best.x[1])

    def slack(self, route: Sequence[str], hover_s: Any, rest_s: Any) -> Floats:
        """Least share of the capacity by which some times keep all limits of the wells."""
        wells = Kibam(self.capacity_As, self.fraction, self.rate_per_s)
        low, time_s = np.inf, 0.0
        phases = self.phases(route)
        for number, (kind, current, _, amount) in enumerate(phases):
            times = {"hover": hover_s, "rest": rest_s}
            lasts = amount * np.asarray(times.get(kind, 1.0), dtype=float)
            wells.spend(current, lasts)
            time_s = time_s + lasts
            y1 = wells.y1 / self.capacity_As
            low = np.minimum(low, np.minimum(y1, self.fraction - y1 if current > 0 else np.inf))
            if kind == "flight" and (self.always or number == len(phases) - 1):
                total = (wells.y1 + wells.y2) / self.capacity_As
                low = np.minimum(low, total - self.min_soc)
        return np.minimum(low, (self.deadline_s - time_s) / self.deadline_s)

    def available(self, route: Sequence[str], points: int = 200) -> float:
        """A hover through the wells that is all but the longest [s]; −∞ if none was found.

        By halving Δ on a grid of T', which is made finer around the best.
        """
        rests = any(place in self.roofs for place in route)
        low, high = 0.0, self.deadline_s if rests else 0.0
        best = -math.inf
        for _ in range(REFINED):
            rest_s = np.linspace(low, high, points if rests else 1)
            some, most = np.zeros_like(rest_s), np.full_like(rest_s, self.deadline_s)
            known = self.slack(route, some, rest_s) >= 0.0
            for _ in range(HALVINGS):
                middle = 0.5 * (some + most)
                holds = self.slack(route, middle, rest_s) >= 0.0
                some, most = np.where(holds, middle, some), np.where(holds, most, middle)
            found = np.where(known | (some > 0.0), some, -np.inf)
            at = int(found.argmax())
            best = max(best, float(found[at]))
            step = (high - low) / max(points - 1, 1)
            low, high = max(rest_s[at] - 2 * step, 0.0), rest_s[at] + 2 * step
        return best


def random_town(seed: int, count: int = 3, roofs: int = 4, **changes: Any) -> Town:
    """A town of some devices and roofs at random."""
    rng = np.random.default_rng(seed)

    def places(names: Sequence[str], low_m: float, high_m: float) -> dict[str, Point]:
        x, y, z = rng.uniform((0, 300, low_m), (2000, 2500, high_m), (len(names), 3)).T
        points = np.stack([x, y, z], axis=1).round(1).tolist()
        return {name: tuple(point) for name, point in zip(names, points, strict=True)}

    weights = rng.uniform(0.5, 2.0, count)
    names = [f"d{k}" for k in range(count)]
    shares = (weights / weights.sum()).tolist()
    figures = {
        "deadline_s": float(rng.uniform(900, 2400)),
        "charge_A": float(rng.uniform(10, 50)),
        "laser_W": float(rng.uniform(1000, 6000)),
        "hover": (float(rng.uniform(55, 85)), float(rng.uniform(700, 1200))),
    }
    return Town(
        places(names, 60.0, 90.0),
        places([f"b{k}" for k in range(roofs)], 20.0, 100.0),
        dict(zip(names, shares, strict=True)),
        **{**figures, **changes},
    )

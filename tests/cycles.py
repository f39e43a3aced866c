"""Batteries, legs and an independent simulation of cycles for the tests of `optuav.service`."""

import math

import numpy as np

from optuav.physics.kibam import Battery, Stage
from optuav.service.visit import Visit


def random_visit(rng: np.random.Generator, perspective: str = "available") -> Visit:
    """A drone between a building and the hover point."""
    battery = Battery(10 ** rng.uniform(3, 5), rng.uniform(0.2, 0.9), 10 ** rng.uniform(-6, -3))
    hover_A = battery.capacity_As / rng.uniform(200, 4000)
    legs = [
        tuple(
            Stage(-hover_A * rng.uniform(0.8, 1.6), rng.uniform(1, 25))
            for _ in range(rng.integers(1, 4))
        )
        for _ in range(2)
    ]
    return Visit(
        "b", battery, *legs, hover_A, hover_A * rng.uniform(0.03, 1.5),
        rng.uniform(0, 0.3) * battery.capacity_As, perspective,
    )  # fmt: skip


def flown(
    visit: Visit, stages: list[Stage], wells: tuple[float, float]
) -> list[tuple[float, float]]:
    """Both wells after every stage, by the published eqs (15)-(16) in the wells themselves."""
    c, k = visit.battery.available_fraction, visit.battery.rate_per_s
    found = [wells]
    for current_A, t in stages:
        (y1, y2), e = found[-1], math.exp(-k * t)
        y0, d = y1 + y2, -current_A
        one = y1 * e + (y0 * k * c - d) * (1 - e) / k - d * c * (k * t - 1 + e) / k
        two = y2 * e + y0 * (1 - c) * (1 - e) - d * (1 - c) * (k * t - 1 + e) / k
        found.append((one, two))
    return found[1:]

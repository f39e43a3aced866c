"""Motion along a straight line from rest to rest, under drag that grows with the squared speed.

A body of mass m is accelerated by a constant net force, m v' = A − c v², and braked by another one,
m v' = −A_b − c v², with c = ½ρC_dA. The forms are those without cancellation or overflow, and with
c = 0 each factor from drag is 1 to the last digit.
"""

from typing import NamedTuple

import numpy as np

from optuav.physics.quantity import TINY, Quantity

LARGEST_EXPONENT = 700.0
"""An exponent whose exponential still is a number."""
SMALLEST = 1e-100
"""A positive number whose square is one too."""


def coefficient(drag_area_m2: Quantity, density_kg_m3: Quantity) -> Quantity:
    """Drag over squared speed, c = ½ρC_dA [kg/m]; C_dA [m²] ≥ 0 and the air's ρ [kg/m³] > 0."""
    return 0.5 * density_kg_m3 * drag_area_m2


class Run(NamedTuple):
    """A way from rest to rest; every field may be an array."""

    # Durations of accelerating, of a cruise at the cap (0 without one) and of braking [s].
    accelerate_s: Quantity
    cruise_s: Quantity
    brake_s: Quantity
    peak_speed_m_s: Quantity
    capped: Quantity  # 1 where the cap holds the speed down, else 0


def run(
    distance_m: Quantity,
    accelerations_m_s2: tuple[Quantity, Quantity],
    free_s: tuple[Quantity, Quantity],
    drag_per_m: Quantity,
    max_speed_m_s: Quantity,
) -> Run:
    """The quickest way of a length d [m] ≥ 0 under drag and a cap of the speed [m/s] > 0.

    A/m and A_b/m [m/s²] are the accelerations without drag, and the times are for
    accelerating and braking [s] without drag or cap; the drag is c/m [1/m] ≥ 0. With x = 2cd/m the
    peak speed is v² = A A_b (1 − e⁻ˣ)/(c (A e⁻ˣ + A_b)); the time to reach a speed v is
    m/√(Ac) artanh(v √(c/A)), that to brake from it m/√(A_b c) arctan(v √(c/A_b)).
    """
    (a2, a4), (t2, t4) = accelerations_m_s2, free_s
    x = np.maximum(2.0 * drag_per_m * distance_m, TINY)
    rise, both, late = -np.expm1(-x), a2 + a4, a2 * np.exp(-x) + a4
    slowed = np.sqrt(both * (rise / x) / late)
    free = a2 * t2 * slowed
    r = np.minimum(max_speed_m_s / np.maximum(free, TINY), 1.0)
    rest = (1.0 - r) * (1.0 + r)
    capped = np.sign(rest)
    # At the uncapped peak: c v²/A, c v²/A_b, and 1/(1 − c v²/A) − 1 as far as it is a number.
    s2, b2 = a4 * rise / late, a2 * rise / late
    w = a4 / both * np.expm1(np.minimum(x, LARGEST_EXPONENT))
    beyond = np.maximum(x - LARGEST_EXPONENT, 0.0)
    # At the speed reached: −ln(1 − c v²/A), and the share 1 − (x₂ + x₄)/d of the way that is left
    # for a cruise, both as sums without a negative term.
    lag = np.log1p(w * r**2 / (1.0 + w * rest)) + (1.0 - capped) * beyond
    left = np.log1p(w * rest) + capped * beyond + np.log1p(b2 * rest / (1.0 + b2 * r**2))
    s, b = (np.maximum(np.sqrt(square) * r, SMALLEST) for square in (s2, b2))
    peak = np.minimum(free, max_speed_m_s)
    return Run(
        accelerate_s=t2 * slowed * r * ((np.log1p(s) + 0.5 * lag) / s),
        cruise_s=distance_m * (left / x) / np.maximum(peak, TINY),
        brake_s=t4 * slowed * r * (np.arctan(b) / b),
        peak_speed_m_s=peak,
        capped=capped,
    )


def accelerated(
    acceleration_m_s2: Quantity, drag_per_m: Quantity, time_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Way [m] and speed [m/s] of a body that has accelerated from rest for a time [s] ≥ 0."""
    y = np.maximum(np.sqrt(acceleration_m_s2 * drag_per_m) * time_s, SMALLEST)
    small = np.log1p(2.0 * np.sinh(0.5 * np.minimum(y, 1.0)) ** 2)
    ln_cosh = np.where(y < 1.0, small, y + np.log1p(np.exp(-2.0 * y)) - np.log(2.0))
    way = 0.5 * acceleration_m_s2 * time_s**2 * (2.0 * ln_cosh / y**2)
    return way, acceleration_m_s2 * time_s * (np.tanh(y) / y)


def braked(
    braking_m_s2: Quantity, drag_per_m: Quantity, time_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Way left [m] and speed [m/s] of a body a time [s] ≥ 0 before braking stops it."""
    tangent = np.tan(z := np.maximum(np.sqrt(braking_m_s2 * drag_per_m) * time_s, SMALLEST))
    way = 0.5 * braking_m_s2 * time_s**2 * (np.log1p(tangent**2) / z**2)
    return way, braking_m_s2 * time_s * (tangent / z)

"""The radio link to the ground device: where the UAV can hover.

Over a Rician channel the outage probability is P_out = 1 − Q1(sqrt(2K), sqrt(2 γ_th (1+K) N0 d^β /
P_u)), Q1 the Marcum function. The squared second argument has a noncentral χ² distribution with
two degrees of freedom and noncentrality 2K, which is how it is computed.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2020, eq (17).
.. [2] M. K. Simon, M.-S. Alouini, "Digital communication over fading channels", 2004, eq 4.33.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from scipy import special

from optuav.physics.quantity import TINY, Quantity

Point = tuple[float, float, float]

DEGREES_OF_FREEDOM = 2.0

HALVINGS = 60
"""Of an angle of at most π, until its ends are neighbouring floats."""


@dataclass(frozen=True)
class Channel:
    """Rician air-to-ground channel of the device.

    Parameters
    ----------
    noise_power_W
        N0 [W], > 0.
    transmit_power_W
        P_u [W], > 0.
    rice_factor
        K, a ratio and not dB [-], ≥ 0.
    snr_threshold_dB
        γ_th [dB].
    path_loss_exponent
        β [-], > 0.
    """

    noise_power_W: float
    transmit_power_W: float
    rice_factor: float
    snr_threshold_dB: float
    path_loss_exponent: float

    @property
    def snr_threshold(self) -> float:
        """γ_th as a ratio [-]."""
        return float(10.0 ** (self.snr_threshold_dB / 10.0))


def outage_probability(channel: Channel, distance_m: Quantity) -> Quantity:
    """P_out [-] at a distance d from the device [m], ≥ 0; floats and arrays. [1]_ eq (17)."""
    path_loss = np.asarray(distance_m, dtype=float) ** channel.path_loss_exponent
    return special.chndtr(
        _squared_argument_at_1_m(channel) * path_loss, DEGREES_OF_FREEDOM, 2.0 * channel.rice_factor
    )[()]


def coverage_radius(channel: Channel, outage_limit: Quantity) -> Quantity:
    """Largest distance d_max [m] at which P_out ≤ ε; ε in (0, 1) [-]; floats and arrays."""
    largest = special.chndtrix(outage_limit, DEGREES_OF_FREEDOM, 2.0 * channel.rice_factor)
    return (largest / _squared_argument_at_1_m(channel)) ** (1.0 / channel.path_loss_exponent)


def _squared_argument_at_1_m(channel: Channel) -> float:
    """2 γ_th (1+K) N0/P_u, the second argument of Q1, squared, at d = 1 m."""
    return (
        2.0
        * channel.snr_threshold
        * (1.0 + channel.rice_factor)
        * channel.noise_power_W
        / channel.transmit_power_W
    )


def hover_point(
    origin_m: Point,
    destination_m: Point,
    device_m: Point,
    radius_m: float,
    altitude_m: float,
    preferred_m: Point,
) -> Point:
    """Where the direct route touches the coverage of the device: w_U of [1]_.

    Of all points in the coverage ball at the given altitude, the one that makes the way origin →
    point → destination shortest. Where a whole stretch of the straight line is covered, the point
    of that stretch nearest to the preferred one.

    Parameters
    ----------
    origin_m, destination_m
        Ends of the mission (x, y, z) [m].
    device_m
        Ground device, centre of the ball [m].
    radius_m
        Coverage radius d_max [m].
    altitude_m
        z of the hover point, the paper's z_min [m].
    preferred_m
        Breaks the tie on a covered straight line, the paper's laser [m].

    Returns
    -------
    (x, y, z) [m]; NaN where the ball does not reach up or down to the altitude.
    """
    squared_disc_radius = radius_m**2 - (altitude_m - device_m[2]) ** 2
    if not squared_disc_radius >= 0.0:
        return (math.nan, math.nan, math.nan)
    disc_radius_m = math.sqrt(squared_disc_radius)
    start, end, centre, preferred = (
        complex(x, y) for x, y, _ in (origin_m, destination_m, device_m, preferred_m)
    )
    start_height_m = abs(origin_m[2] - altitude_m)
    end_height_m = abs(destination_m[2] - altitude_m)
    if start_height_m + end_height_m > 0.0:
        # Mirrored at the altitude, the shortest way is a straight line through one point of it.
        share = start_height_m / (start_height_m + end_height_m)
        shortest = (start + share * (end - start),) * 2
    else:
        shortest = (start, end)
    stretch = _covered_stretch(*shortest, centre, disc_radius_m)
    if stretch is not None:
        point = _nearest_on_segment(*stretch, preferred)
    else:
        point = _nearest_on_rim(
            ((start, start_height_m), (end, end_height_m)), shortest[0], centre, disc_radius_m
        )
    return (point.real, point.imag, altitude_m)


# Below, a point of the map is a complex number x + iy.


def _dot(left: complex, right: complex) -> float:
    return left.real * right.real + left.imag * right.imag


def _covered_stretch(
    low: complex, high: complex, centre: complex, radius_m: float
) -> tuple[complex, complex] | None:
    """Part of the segment low-high inside a disc, by its ends; None where there is none."""
    along, offset = high - low, low - centre
    a, b, c = _dot(along, along), _dot(along, offset), _dot(offset, offset) - radius_m**2
    if a == 0.0:
        return (low, high) if c <= 0.0 else None
    # b² − a c without its cancelling, which a line that touches the disc would feel.
    squared_half = a * radius_m**2 - _dot(1j * along, offset) ** 2
    if squared_half < 0.0:
        return None
    entry = max(0.0, (-b - math.sqrt(squared_half)) / a)
    leave = min(1.0, (-b + math.sqrt(squared_half)) / a)
    return (low + entry * along, low + leave * along) if entry <= leave else None


def _nearest_on_segment(low: complex, high: complex, point: complex) -> complex:
    """Point of a segment nearest to another point."""
    along = high - low
    squared_length = _dot(along, along)
    if squared_length == 0.0:
        return low
    return low + min(1.0, max(0.0, _dot(point - low, along) / squared_length)) * along


def _nearest_on_rim(
    ends: tuple[tuple[complex, float], tuple[complex, float]],
    shortest: complex,
    centre: complex,
    radius_m: float,
) -> complex:
    """Point of a circle with the least sum of distances to two ends, each with its height.

    The sum is convex, and `shortest`, where it is least, lies outside the circle. The best point
    of the circle is in sight of that one, or some point inside would be better still. Along the
    arc in sight the sum falls before the best point and rises after it: elsewhere on the arc, the
    half-plane in which its gradient lets the sum only rise holds all of the arc on that side.
    """
    away = shortest - centre
    half_arc = math.acos(min(1.0, radius_m / abs(away)))
    low, high = cmath.phase(away) - half_arc, cmath.phase(away) + half_arc
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        outward = cmath.rect(1.0, middle)
        slope = 0.0
        for foot, height_m in ends:
            way = centre + radius_m * outward - foot
            slope += _dot(way, 1j * outward) / max(math.hypot(abs(way), height_m), TINY)
        low, high = (middle, high) if slope < 0.0 else (low, middle)
    return centre + cmath.rect(radius_m, 0.5 * (low + high))

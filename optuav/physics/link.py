"""The radio link to the ground device: outage probability, coverage radius and hover point.

Over a Rician channel the outage probability is P_out = 1 − Q1(sqrt(2K), sqrt(2 γ_th (1+K) N0 d^β /
P_u)), Q1 the Marcum function: the probability that an amplitude with the Rice density is below a
level. Its series is summed here, because importing `scipy.special` takes longer than solving most
missions.

References
----------
.. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, eq (17).
.. [2] M. K. Simon, M.-S. Alouini, "Digital communication over fading channels", 2004, eqs 4.33 and
   4.35.
.. [3] W. Gautschi, "Computational aspects of three-term recurrence relations", SIAM Review, 1967.
"""

from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans
from optuav.physics.quantity import TINY, Quantity, Vector, memoised, one_where_not_negative

REACH = 7.0  # So far above the direct part an amplitude is reached but for exp(−49), rounding
ROUNDING_RAD = 1e-15  # Step of an angle that is rounding [rad]
MOST_STEPS = 100  # Pure bisection needs some fifty for an angle of at most π


class Channel(NamedTuple):
    """Rician air-to-ground channel of the device."""

    noise_power_W: Quantity  # N0 [W], > 0
    transmit_power_W: Quantity  # P_u [W], > 0
    rice_factor: Quantity  # K, a ratio and not dB [-], ≥ 0
    snr_threshold_dB: Quantity  # γ_th [dB]
    path_loss_exponent: Quantity  # β [-], > 0

    @property
    def squared_argument_at_1_m(self) -> Quantity:
        """2 γ_th (1+K) N0/P_u, the second argument of Q1, squared, at d = 1 m; γ_th as a ratio."""
        threshold = 10.0 ** (self.snr_threshold_dB / 10.0)
        return (
            2.0 * threshold * (1.0 + self.rice_factor) * self.noise_power_W / self.transmit_power_W
        )


def outage_probability(channel: Channel, distance_m: Quantity) -> Quantity:
    """P_out [-] at a distance d from the device [m], ≥ 0; floats and arrays. [1]_ eq (17)."""
    path_loss = np.asarray(distance_m, dtype=float) ** channel.path_loss_exponent
    level = np.sqrt(0.5 * channel.squared_argument_at_1_m * path_loss)
    direct = np.sqrt(channel.rice_factor)
    probability, _ = _below(np.minimum(level, direct + REACH)[()], direct)
    return np.minimum(probability, 1.0)


@memoised
@np.errstate(divide="ignore", invalid="ignore")
def coverage_radius(channel: Channel, outage_limit: Quantity) -> Quantity:
    """Largest distance d_max [m] with P_out ≤ ε; ε in (0, 1] [-]; floats and arrays.

    It is infinite for ε = 1, as no probability is above 1.
    Newton's method on log F of the amplitude, which is concave, rises from a lower bound:
    F(r) ≤ 1 − exp(−r²), and Birgé's bound on the lower tail of a noncentral χ² distribution.
    """
    direct, everywhere = np.sqrt(channel.rice_factor), np.asarray(outage_limit) >= 1.0
    outage_limit = np.where(everywhere, 0.5, outage_limit)
    start = 1.0 + direct**2 - np.sqrt((2.0 + 4.0 * direct**2) * -np.log(outage_limit))
    level = np.sqrt(np.maximum(-np.log1p(-outage_limit), start))
    for _ in range(MOST_STEPS):
        below, series = _below(level, direct)
        nearer = level - np.log(below / outage_limit) * series / (2.0 * level)
        if not np.any(nearer > level):
            break
        # Only rounding turns a step back.
        level = np.fmax(nearer, level)
    path_loss = 2.0 * np.where(everywhere, np.inf, level) ** 2 / channel.squared_argument_at_1_m
    return path_loss[()] ** (1.0 / channel.path_loss_exponent)


def _below(level: Quantity, direct: Quantity) -> tuple[Quantity, Quantity]:
    """Probability F that an amplitude with direct part a is below r, and 2 r by the slope of log F.

    F = exp(−r² − a²) Σ (r/a)ⁿ I_n(2 r a) over n ≥ 1; the second number is that sum over I0 [2]_.
    All terms are positive. The ratios I_n/I_(n−1) come from their continued fraction, and I0 from
    exp(z) = I0(z) + 2 Σ I_n(z) [3]_. A term is the probability that Poisson numbers of means r² and
    a² differ by n, which tells how many of them count.
    """
    more, less, product = level * level, direct * direct, level * direct
    spread = np.maximum(more - less, 0.0) + 9.0 * np.sqrt(more + less)
    terms = 25.0 + np.floor(spread)
    ratio = above = both = 0.0 * spread
    for n in range(int(np.max(terms)), 0, -1):
        # Of I_n to I_(n−1), over r a; each sum has its own terms, whatever the others need.
        ratio = (n <= terms) / (n + product * product * ratio)
        above = more * ratio * (1.0 + above)
        both = product * ratio * (1.0 + both)
    return np.exp(-((level - direct) ** 2)) * above / (1.0 + 2.0 * both), above


@memoised
def hover_point(
    origin_m: Vector,
    destination_m: Vector,
    device_m: Vector,
    radius_m: Quantity,
    altitude_m: Quantity,
    preferred_m: Vector,
) -> Vector:
    """Return the point where the direct route touches the device's coverage: w_U of [1]_.

    Of all points in the ball of radius d_max [m] about the device that lie at the altitude, the
    paper's z_min [m], the one that makes the way origin → point → destination shortest. Where a
    whole stretch of the straight line is covered, the point of that stretch nearest to the
    preferred one, the paper's laser. Points are (x, y, z) [m], the one returned NaN where the ball
    does not reach up or down to the altitude. Every argument may be an array.
    """
    height_m = altitude_m - device_m[2]
    disc_radius_m = np.sqrt(one_where_not_negative(squared := radius_m**2 - height_m**2) * squared)
    start, end, centre, preferred = (
        np.asarray(x) + 1j * np.asarray(y)
        for x, y, _ in (origin_m, destination_m, device_m, preferred_m)
    )
    start_height_m = np.abs(origin_m[2] - altitude_m)
    end_height_m = np.abs(destination_m[2] - altitude_m)
    heights_m = start_height_m + end_height_m
    # Mirrored at the altitude, the shortest way is a straight line through one point of it.
    share = start_height_m / np.where(heights_m > 0.0, heights_m, 1.0)
    single = start + share * (end - start)
    low = np.where(heights_m > 0.0, single, start)
    high = np.where(heights_m > 0.0, single, end)
    # The part of that line inside the disc, and its point nearest to the preferred one.
    along, offset = high - low, low - centre
    a, b, c = _dot(along, along), _dot(along, offset), _dot(offset, offset) - disc_radius_m**2
    # b² − a c without its cancelling, which a line that touches the disc would feel.
    squared_half = a * disc_radius_m**2 - _dot(1j * along, offset) ** 2
    half, divisor = np.sqrt(np.maximum(squared_half, 0.0)), np.where(a > 0.0, a, 1.0)
    entry = np.maximum(0.0, (-b - half) / divisor)
    leave = np.minimum(1.0, (-b + half) / divisor)
    covered = np.where(a > 0.0, (squared_half >= 0.0) & (entry <= leave), c <= 0.0)
    point, stretch = low + entry * along, (leave - entry) * along
    if np.any(covered):  # else the preferred one, which may be an array, makes no difference
        length = np.where(stretch != 0.0, _dot(stretch, stretch), 1.0)
        share = _dot(preferred - point, stretch) / length
        point = point + np.clip(share, 0.0, 1.0) * stretch
    if not np.all(covered):
        ends = ((start, start_height_m), (end, end_height_m))
        point = np.where(covered, point, _nearest_on_rim(ends, low, centre, disc_radius_m))
    return (point.real[()], point.imag[()], (altitude_m + 0.0 * point.real)[()])


# Below, a point of the map is a complex number x + iy, or an array of them.


def _dot(left: Quantity, right: Quantity) -> Quantity:
    return left.real * right.real + left.imag * right.imag


def _nearest_on_rim(
    ends: tuple[tuple[Quantity, Quantity], tuple[Quantity, Quantity]],
    shortest: Quantity,
    centre: Quantity,
    radius_m: Quantity,
) -> Quantity:
    """Point of a circle with the least sum of distances to two ends, each with its height.

    The sum is convex, and `shortest`, where it is least, lies outside the circle. The best point is
    in sight of that one, or some point inside would be better still. Along the arc in sight the sum
    falls before the best point and rises after it: elsewhere, the half-plane where its gradient
    lets the sum only rise holds all of the arc on that side. Newton's steps find it within the rest
    of the arc.
    """
    away = shortest - centre
    half_arc = np.arccos(np.minimum(1.0, radius_m / np.maximum(np.abs(away), TINY)))
    low, high = np.angle(away) - half_arc, np.angle(away) + half_arc
    angle = 0.5 * (low + high)
    moves: Booleans = np.ones_like(angle, dtype=bool)
    for _ in range(MOST_STEPS):
        outward = np.exp(1j * angle)
        slope, bend = 0.0, 0.0
        for foot, height_m in ends:
            way = centre + radius_m * outward - foot
            distance_m = np.maximum(np.hypot(np.abs(way), height_m), TINY)
            along = _dot(way, 1j * outward) / distance_m
            slope = slope + along
            bend = bend + (radius_m * (1.0 - along**2) - _dot(way, outward)) / distance_m
        falls = slope < 0.0
        low, high = np.where(falls, angle, low), np.where(falls, high, angle)
        newton = angle - slope / np.where(bend > 0.0, bend, np.nan)
        newton = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
        # A settled angle stays, so that no result depends on the other elements of the array.
        before, angle = angle, np.where(moves, newton, angle)
        moves = np.abs(angle - before) > ROUNDING_RAD
        if not np.any(moves):
            break
    return centre + radius_m * np.exp(1j * angle)

"""Power of a rotary-wing UAV over air speed, the speeds that follow, and legs at constant power.

P(V) = P_0 (1 + 3V²/U²) + P_i/√(√(1 + z²) + z) + pV³ with z = V²/(2v_0²): blades, lift and fuselage
[1]_, whose eq (12) has √(1 + z²) − z under a root, which cancels at speed. V is the horizontal air
speed, so P(0) is drawn in hover without wind. A climb at v_z draws m g v_z more; a descent gives
nothing back.

References
----------
.. [1] Y. Zeng, J. Xu, R. Zhang, "Energy minimization for wireless communication with rotary-wing
   UAV", IEEE Transactions on Wireless Communications, 2019, eqs (12), (61)-(65).
"""

import math
from typing import NamedTuple

import numpy as np

from optuav.physics import roots
from optuav.physics.quantity import TINY, Quantity, Vector, is_number, memoised

PROFILE_DRAG = 0.012
"""Drag coefficient of a blade's section, δ of [1]_."""
INDUCED_CORRECTION = 0.1
"""Share of induced power above the ideal, k of [1]_."""


class PowerCoefficients(NamedTuple):
    """Coefficients of the power against airspeed."""

    blade_power_W: Quantity  # P_0 in hover [W], ≥ 0
    induced_power_W: Quantity  # P_i in hover [W], > 0
    induced_speed_m_s: Quantity  # v_0 in hover [m/s], > 0
    tip_speed_m_s: Quantity  # U_tip of the blades [m/s], > 0
    parasite_W_s3_m3: Quantity  # p = ½ d_0 ρ s A of the fuselage [W s³/m³], ≥ 0


def coefficients(
    disc_area_m2: Quantity,
    solidity: Quantity,
    tip_speed_m_s: Quantity,
    weight_N: Quantity,
    drag_ratio: Quantity,
    density_kg_m3: Quantity = 1.225,
) -> PowerCoefficients:
    """The coefficients by [1]_, eqs (61)-(65), from a datasheet; all arguments > 0.

    The disc area A [m²] covers all rotors, n π R²; solidity s [-] is the share of it that
    blades fill, and the drag ratio of the fuselage d_0 [-] is its drag area over s A.
    """
    blades = density_kg_m3 * solidity * disc_area_m2
    induced_speed = np.sqrt(weight_N / (2.0 * density_kg_m3 * disc_area_m2))
    return PowerCoefficients(
        blade_power_W=PROFILE_DRAG / 8.0 * blades * tip_speed_m_s**3,
        induced_power_W=(1.0 + INDUCED_CORRECTION) * weight_N * induced_speed,
        induced_speed_m_s=induced_speed,
        tip_speed_m_s=tip_speed_m_s,
        parasite_W_s3_m3=0.5 * drag_ratio * blades,
    )


def power(wing: PowerCoefficients, air_speed_m_s: Quantity) -> Quantity:
    """P(V) [W] in level flight at a horizontal air speed [m/s] ≥ 0, [1]_ eq (12)."""
    V, z = air_speed_m_s, air_speed_m_s**2 / (2.0 * wing.induced_speed_m_s**2)
    blades = wing.blade_power_W * (1.0 + 3.0 * V**2 / wing.tip_speed_m_s**2)
    lift = wing.induced_power_W / np.sqrt(np.sqrt(1.0 + z**2) + z)
    return blades + lift + wing.parasite_W_s3_m3 * V**3


def rise(wing: PowerCoefficients, air_speed_m_s: Quantity) -> Quantity:
    """dP/d(V²) [W s²/m²], which grows with V: P is convex in V², though not in V."""
    V, v_0 = air_speed_m_s, wing.induced_speed_m_s
    z = V**2 / (2.0 * v_0**2)
    root = np.sqrt(1.0 + z**2)
    lift = wing.induced_power_W / (4.0 * v_0**2 * root * np.sqrt(root + z))
    blades = 3.0 * wing.blade_power_W / wing.tip_speed_m_s**2
    return blades - lift + 1.5 * wing.parasite_W_s3_m3 * V


@memoised
def best_endurance(wing: PowerCoefficients, max_speed_m_s: Quantity = math.inf) -> Quantity:
    """Air speed of least power [m/s], up to a cap [m/s]; no symbols.

    0 where the power grows from hover on. Either P_0 or p must be > 0.
    """
    best = roots.last_nonnegative(lambda V: -rise(wing, V), wing.induced_speed_m_s)
    return np.minimum(best, max_speed_m_s)


@memoised
def best_range(
    wing: PowerCoefficients,
    max_speed_m_s: Quantity = math.inf,
    wind_m_s: Vector = (0.0, 0.0, 0.0),
    direction: Vector = (1.0, 0.0, 0.0),
) -> Quantity:
    """Ground speed [m/s] with the least energy per metre over ground; no symbols.

    The direction is as in `ground_speed`, and the cap one of the air speed [m/s]. NaN where the
    cap leaves no way against the wind. Either P_0 or p must be > 0.
    """
    along, across = _components(wind_m_s, direction)
    # The air speed has a part f along the path, and g = f + along is the ground speed. Slower than
    # the wind, the same power carries further with f turned round, so f ≥ 0. As P first is concave
    # in f and then convex, g dP/df − P has one root.
    least = np.maximum(-along, 0.0)

    def falling(more: Quantity) -> Quantity:
        f = least + more
        V = np.sqrt(f**2 + across**2)
        return power(wing, V) - (f + along) * 2.0 * f * rise(wing, V)

    best = least + along + roots.last_nonnegative(falling, wing.induced_speed_m_s)
    return np.minimum(best, ground_speed(max_speed_m_s, wind_m_s, direction))


def ground_speed(air_speed_m_s: Quantity, wind_m_s: Vector, direction: Vector) -> Quantity:
    """Speed over ground [m/s] along a direction at an air speed [m/s] in a level wind [m/s].

    The direction is horizontal, of length 1 or 0: without one, as on a climb on the spot, it is the
    air speed. NaN where the wind leaves no way forward.
    """
    along, across = _components(wind_m_s, direction)
    with np.errstate(invalid="ignore"):
        forward = along + np.sqrt(air_speed_m_s**2 - across**2)
        way_on = np.sqrt(np.sign(forward))
        return np.divide(way_on, way_on) * forward


def capped(
    ground_speed_m_s: Quantity, max_speed_m_s: Quantity, wind_m_s: Vector, direction: Vector
) -> Quantity:
    """Speed over ground [m/s] along a direction, as far as a cap of the air speed [m/s] allows.

    The direction is as in `ground_speed`; NaN where the cap leaves no way forward.
    """
    return np.minimum(ground_speed_m_s, ground_speed(max_speed_m_s, wind_m_s, direction))


def air_speed(ground_speed_m_s: Quantity, wind_m_s: Vector, direction: Vector) -> Quantity:
    """Horizontal air speed [m/s] at a speed over ground [m/s] along a direction of length 1 or 0.

    Wind makes hovering cheaper: at 0 over ground, it is the speed of the wind [m/s].
    """
    x, y = (ground_speed_m_s * u - w for u, w in zip(direction[:2], wind_m_s[:2], strict=True))
    return np.sqrt(x * x + y * y)


def _components(wind_m_s: Vector, direction: Vector) -> tuple[Quantity, Quantity]:
    """Wind along and across a level direction [m/s]."""
    (x, y, _), (u, v, _) = wind_m_s, direction
    return x * u + y * v, x * v - y * u


def level_direction(way_m: Vector) -> Vector:
    """Horizontal direction of a way [m], of length 1; of length 0 for a climb on the spot."""
    x, y, _ = way_m
    length = np.maximum(level_length(way_m), TINY)
    return x / length, y / length, 0.0


def level_length(way_m: Vector) -> Quantity:
    """Horizontal length of a way [m]."""
    x, y, _ = way_m
    return np.sqrt(x * x + y * y)


def priced_speed(
    wing: PowerCoefficients,
    length_m: Quantity,
    acceleration_m_s2: Quantity,
    price_W: Quantity,
    most_m_s: Quantity,
    easiest_m_s: Quantity,
    wind_m_s: Vector = (0.0, 0.0, 0.0),
    direction: Vector = (1.0, 0.0, 0.0),
) -> Quantity:
    """Ground speed V [m/s] of the least (d/V + V/a)(P + price), up to the most [m/s]; no symbols.

    For the horizontal length d [m] of a leg from rest to rest, its acceleration a [m/s²] > 0, a
    price of time [W], and the `best_endurance` up to the cap [m/s], an air speed; the direction is
    as in `ground_speed`. NaN where the most is. A price of ∞ is worth the most, and −∞ the speed
    of least power.

    P is convex in V² and grows above the air speed of least power, so there P is convex in the
    ground speed too. The slope of the product times V², P'V(d + V²/a) + (P + price)(V²/a − d), then
    grows with V: it has one root, whatever the price. Slower, both factors are larger. So the root
    is the least of all speeds.
    """
    along, across = _components(wind_m_s, direction)
    # The ground speed of the least power
    least = np.maximum(along + np.sqrt(np.maximum(easiest_m_s**2 - across**2, 0.0)), 0.0)

    def falling(more: Quantity) -> Quantity:
        V = least + more
        d, ramp, P, slope = length_m, V * V / acceleration_m_s2, *_slope(wing, V - along, across)
        return (P + price_W) * (d - ramp) - slope * V * (d + ramp)

    if is_number(price_W, math.inf):
        return most_m_s
    easiest = is_number(price_W, -math.inf)
    best = least if easiest else least + roots.last_nonnegative(falling, wing.induced_speed_m_s)
    return np.minimum(best, most_m_s)


def price(
    wing: PowerCoefficients,
    length_m: Quantity,
    acceleration_m_s2: Quantity,
    ground_speed_m_s: Quantity,
    wind_m_s: Vector = (0.0, 0.0, 0.0),
    direction: Vector = (1.0, 0.0, 0.0),
) -> Quantity:
    """Price of time [W] that makes a ground speed [m/s] > 0 the `priced_speed`; ∞ at √(a d)."""
    along, across = _components(wind_m_s, direction)
    d, V, ramp = length_m, ground_speed_m_s, ground_speed_m_s**2 / acceleration_m_s2
    P, slope = _slope(wing, V - along, across)
    with np.errstate(divide="ignore"):
        return np.divide(slope * V * (d + ramp), np.maximum(d - ramp, 0.0)) - P


def _slope(
    wing: PowerCoefficients, forward_m_s: Quantity, across_m_s: Quantity
) -> tuple[Quantity, Quantity]:
    """Power [W] at an air speed, by its parts along and across, and its slope in the first."""
    V = np.sqrt(forward_m_s**2 + across_m_s**2)
    return power(wing, V), 2.0 * forward_m_s * rise(wing, V)


class CruiseLeg(NamedTuple):
    """A leg at constant power; every field may be an array over legs."""

    duration_s: Quantity
    rise_s: Quantity  # Time to reach the largest speed, and to lose it again [s]
    peak_speed_m_s: Quantity  # Largest speed along the path [m/s]
    air_speed_m_s: Quantity  # Horizontal air speed at the peak [m/s]
    power_W: Quantity  # At the rotors, climb included [W]


def leg(
    wing: PowerCoefficients,
    way_m: Vector,
    ground_speed_m_s: Quantity,
    acceleration_m_s2: Quantity,
    vertical_speeds_m_s: tuple[Quantity, Quantity],
    weight_N: Quantity,
    wind_m_s: Vector = (0.0, 0.0, 0.0),
) -> CruiseLeg:
    """A straight leg from rest to rest: accelerate, cruise, brake, all at the draw of the cruise.

    With the horizontal length d and the horizontal ground speed V [m/s] > 0 it takes d/V + V/a, and
    V is at most √(a d), without any cruise; a [m/s²] > 0. A leg that has to climb or
    descend takes |Δz| over that mean speed at least (climb and descent [m/s] > 0): V is then as low
    as the time allows, and a climb draws m g Δz over that time more. The way is end minus start
    [m]; a leg of no length takes no time. NaN where the ground speed is.
    """
    a, (climb, descent) = acceleration_m_s2, vertical_speeds_m_s
    d, z = level_length(way_m), way_m[2]
    V = np.minimum(ground_speed_m_s, np.sqrt(a * d))
    cruise_s, ramp_s = d / np.maximum(V, TINY), V / a
    level_s = cruise_s + ramp_s
    up, down = np.maximum(z, 0.0), np.maximum(-z, 0.0)
    T = np.maximum(level_s, up / climb + down / descent)
    # The smaller root V of d/V + V/a = T, written without cancellation.
    root = np.sqrt((T - level_s) * (T + level_s) + (cruise_s - ramp_s) ** 2)
    V = 2.0 * d / np.maximum(T + root, TINY)
    speed = air_speed(V, wind_m_s, level_direction(way_m))
    drawn_W = power(wing, speed) + weight_N * up / np.maximum(T, TINY)
    # Along the path the speed rises as long: to V times length over d, or L/(T − V/a).
    peak = np.sqrt(d * d + z * z) / np.maximum(T - V / a, TINY)
    return CruiseLeg(T, V / a, peak, speed, drawn_W)


def reached(leg: CruiseLeg, ground_speed_m_s: Quantity, acceleration_m_s2: Quantity) -> Quantity:
    """Horizontal speed [m/s] that a leg reaches, at most the ground speed asked for."""
    return np.minimum(acceleration_m_s2 * leg.rise_s, ground_speed_m_s)

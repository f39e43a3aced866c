"""Distributed laser charging: from the power of the source to the current into the battery.

P_0 = a1 a2 ν P_s + a2 b1 ν + b2 with ν = exp(−α d): the emitter turns the source power P_s into
light (slope a1, offset b1), the air lets ν of it through, the receiver turns light into power
(slope a2, offset b2).

References
----------
.. [1] Q. Zhang et al., "Distributed laser charging: a wireless power transfer approach",
   IEEE Internet of Things Journal, 2018.
.. [2] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
   IEEE Internet of Things Journal, 2021, eqs (10) and (14).
.. [3] I. Kim, B. McArthur, E. Korevaar, "Comparison of laser beam propagation at 785 nm and
   1550 nm in fog and haze for optical wireless communications", Proc. SPIE 4214, 2001.
"""

from typing import NamedTuple

import numpy as np

from optuav.physics.quantity import Quantity


class Conversion(NamedTuple):
    """Straight-line fits of emitter and receiver, which depend on the wavelength."""

    # a1 [-], > 0, and b1 [W]: light = a1 P_s + b1.
    emitter_slope: Quantity
    emitter_offset_W: Quantity
    # a2 [-], > 0, and b2 [W]: received power = a2 (light at the receiver) + b2.
    receiver_slope: Quantity
    receiver_offset_W: Quantity


def size_exponent(visibility_km: Quantity) -> Quantity:
    """Exponent ρ of the wavelength in the attenuation [-], Kim's model [3]_.

    1.6 above 50 km, 1.3 from 6 to 50 km (clear), 0.16 V + 0.34 from 1 to 6 km (haze), V − 0.5 from
    0.5 to 1 km (mist), 0 below (fog); V is the visibility [km], > 0.
    """
    V = visibility_km
    up_to_50_km = np.maximum(np.minimum(np.minimum(V - 0.5, 0.16 * V + 0.34), 1.3), 0.0)
    return up_to_50_km + 0.3 * np.heaviside(V - 50.0, 0.0)


def attenuation(wavelength_nm: Quantity, visibility_km: Quantity) -> Quantity:
    """Attenuation coefficient α = (3.92/V) (λ/550 nm)^(−ρ) [1/km], [1]_ and [3]_.

    λ [nm] > 0; the visibility V [km] > 0 is 10 in clear air, 3 in haze, 0.4 in fog.
    """
    return 3.92 / visibility_km * (wavelength_nm / 550.0) ** (-size_exponent(visibility_km))


def transmission(attenuation_per_km: Quantity, distance_m: Quantity) -> Quantity:
    """Share of the light that arrives, ν = exp(−α d) [-]; α in [1/km], d in [m], ≥ 0."""
    return np.exp(-attenuation_per_km * distance_m / 1000.0)


@np.errstate(divide="ignore", invalid="ignore", over="ignore")
def source_limit(conversion: Conversion, power_limit_W: Quantity, share: Quantity) -> Quantity:
    """Source power [W] that makes the received power reach a limit [W] ≥ 0, [2]_ eq (14).

    The paper's limit is I_ch e_nom: more would exceed the charging current of the battery. The
    share ν [-] in [0, 1] comes from `transmission`; no power is enough where no light arrives.
    """
    a2, b2 = conversion.receiver_slope, conversion.receiver_offset_W
    light_W = (power_limit_W - b2) / (a2 * share)
    return (light_W - conversion.emitter_offset_W) / conversion.emitter_slope


def received_power(
    conversion: Conversion,
    source_power_W: Quantity,
    attenuation_per_km: Quantity,
    distance_m: Quantity,
    power_limit_W: Quantity,
) -> Quantity:
    """P_0 [W] at a distance, with the source turned down where the battery could not take it.

    By the straight lines, [2]_ eq (10), and never below 0. The source gives P_s [W] ≥ 0 at full,
    and at most `source_limit`; as P_0 grows with P_s, it then gives the limit I_ch e_nom [W]
    itself. α [1/km] ≥ 0, and the distance to the UAV is d [m] ≥ 0.
    """
    share = transmission(attenuation_per_km, distance_m)
    light_W = conversion.emitter_slope * source_power_W + conversion.emitter_offset_W
    received_W = conversion.receiver_slope * share * light_W + conversion.receiver_offset_W
    return np.minimum(np.maximum(received_W, 0.0), power_limit_W)


def efficiency(received_power_W: Quantity, source_power_W: Quantity) -> Quantity:
    """Harvesting efficiency ζ = P_0/P_s [-] of [2]_, section V; P_s > 0 [W]."""
    return received_power_W / source_power_W

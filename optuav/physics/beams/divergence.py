"""A beam that widens by a constant divergence, as the literature on laser-charged UAVs has it.

P_r = χ A P e^(−αd)/(D + dΔθ)². A uniform disc of the diameter D + dΔθ would give 4/π of that.

References
----------
.. [1] M.-A. Lahmeri, M. A. Kishk, M.-S. Alouini, "Stochastic geometry-based analysis of airborne
   base stations with laser-powered UAVs", IEEE Communications Letters, 2019.
"""

from typing import NamedTuple

import numpy as np

from optuav.physics.laser import transmission
from optuav.physics.quantity import Quantity


class Divergence(NamedTuple):
    """Emitter and receiver; χA must not exceed D²."""

    aperture_m: Quantity  # D [m], > 0
    divergence_rad: Quantity  # Full angle Δθ [rad], ≥ 0
    area_m2: Quantity  # A of the receiver [m²], > 0
    optics_efficiency: Quantity  # χ of everything from light to DC power [-], in (0, 1]


def share(beam: Divergence, distance_m: Quantity) -> Quantity:
    """Share of the light that arrives which becomes DC power, χA/(D + dΔθ)² [-]; d [m] ≥ 0."""
    diameter = beam.aperture_m + distance_m * beam.divergence_rad
    return beam.optics_efficiency * beam.area_m2 / diameter**2


def received_power(
    beam: Divergence,
    light_W: Quantity,
    attenuation_per_km: Quantity,
    distance_m: Quantity,
    most_W: Quantity = np.inf,
) -> Quantity:
    """P_r [W] by [1]_ of a source of light [W] ≥ 0 at a distance [m], up to a largest power [W]."""
    air = transmission(attenuation_per_km, distance_m)
    return np.minimum(light_W * air * share(beam, distance_m), most_W)


def disc_irradiance(beam: Divergence, distance_m: Quantity) -> Quantity:
    """Irradiance of a uniform disc of the beam's diameter, per watt of light [1/m²]."""
    diameter = beam.aperture_m + distance_m * beam.divergence_rad
    return 4.0 / (np.pi * diameter**2)


@np.errstate(divide="ignore", invalid="ignore")
def reach(
    beam: Divergence, light_W: Quantity, attenuation_per_km: Quantity, needed_W: Quantity
) -> Quantity:
    """Largest distance [m] that receives a power [W]; numbers and arrays.

    With u = D + dΔθ and β = α/(2Δθ) it is βu e^(βu) = β √(χAP/P_r) e^(βD), so βu is a value of
    Lambert's W. Its logarithm is solved for: e^(βD) overflows where air takes more than the
    divergence. 0 where the power is never reached, infinite where it always is.
    """
    from scipy.special import wrightomega

    D, Δθ, α = beam.aperture_m, beam.divergence_rad, attenuation_per_km / 1000.0
    gain = beam.optics_efficiency * beam.area_m2 * np.divide(light_W, needed_W)
    ln_u = 0.5 * np.log(gain)  # Where nothing is lost in air
    β = np.divide(α, 2.0 * Δθ)
    u = wrightomega(np.log(β) + ln_u + β * D) / β
    both = (u - D) / Δθ
    # A step by Newton, where (u − D) has cancelled.
    both = both + (ln_u - 0.5 * α * both - np.log(D + both * Δθ)) / (0.5 * α + Δθ / (D + both * Δθ))
    air, spread = np.divide(2.0 * (ln_u - np.log(D)), α), np.divide(np.exp(ln_u) - D, Δθ)
    no_air, no_spread = np.equal(α, 0.0), np.equal(Δθ, 0.0)
    cases = (
        np.less_equal(needed_W, 0.0),
        np.less(gain, D**2),
        no_air & no_spread,
        no_spread,
        no_air,
    )
    return np.select(cases, (np.inf, 0.0, np.inf, air, spread), both)[()]

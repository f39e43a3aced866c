"""A Gaussian beam that spreads by diffraction, jitter and turbulence, and its receiver.

The intensity at a distance d falls off as exp(−2r²/w²) with w = w_0 √(1 + (M²λd/(πw_0²))²).
Pointing errors of σ per axis and turbulence displace and blur that profile; of their mean only the
second moment counts. A limit of irradiance, power or current acts on the light of each moment, so
it is the mean of the limited light that charges.

References
----------
.. [1] A. E. Siegman, "Lasers", 1986, chapter 17; ISO 11146-1 for M².
.. [2] L. C. Andrews, R. L. Phillips, "Laser beam propagation through random media", 2005,
   chapter 6: mean irradiance by the extended Huygens-Fresnel principle, exact in the second moment
   at any strength. Its closed form w² (1 + 1.33 σ_R² Λ^(5/6)) holds for weak turbulence only.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from optuav.physics.beams.turbulence import blur, mixture
from optuav.physics.laser import transmission
from optuav.physics.quantity import TINY, Quantity, is_number


class Emitter(NamedTuple):
    """Laser and its telescope; arguments may be arrays over places or missions."""

    wavelength_nm: Quantity  # λ [nm], > 0
    aperture_m: Quantity  # Diameter D [m], > 0
    waist_m: Quantity  # w_0, radius at 1/e² of the intensity [m], > 0
    m2: Quantity = 1.0  # Beam quality M² [-], ≥ 1
    jitter_rad: Quantity = 0.0  # Standard deviation σ of the pointing per axis [rad], ≥ 0
    turbulence_cn2: Quantity = 0.0  # C_n² [m^(−2/3)], ≥ 0
    source_efficiency: Quantity = 1.0  # Light over electric power [-], in (0, 1]


class Receiver(NamedTuple):
    """A round receiver and its limits; efficiencies are in (0, 1]."""

    radius_m: Quantity  # a [m], > 0
    optics_efficiency: Quantity = 1.0
    cell_efficiency: Quantity = 1.0
    dc_efficiency: Quantity = 1.0
    max_irradiance_W_m2: Quantity = math.inf  # Mean over the receiver, before its optics, > 0
    max_power_W: Quantity = math.inf  # Largest DC power [W], > 0

    @property
    def efficiency(self) -> Quantity:
        """DC power over light on the receiver [-]."""
        return self.optics_efficiency * self.cell_efficiency * self.dc_efficiency


def default_waist(aperture_m: Quantity) -> Quantity:
    """w_0 = D/(2√2) [m], whose aperture passes 98.17 %."""
    return aperture_m / math.sqrt(8.0)


def aperture_share(emitter: Emitter) -> Quantity:
    """Share of the light that its aperture passes, 1 − exp(−D²/(2w_0²)) [-]."""
    return -np.expm1(-(emitter.aperture_m**2) / (2.0 * emitter.waist_m**2))


def width(emitter: Emitter, distance_m: Quantity) -> Quantity:
    """Radius w at 1/e² of the intensity [m] at a distance d [m] ≥ 0, only by diffraction [1]_."""
    length = np.pi * emitter.waist_m**2 / (emitter.m2 * 1e-9 * emitter.wavelength_nm)
    return emitter.waist_m * np.sqrt(1.0 + (distance_m / length) ** 2)


def share(emitter: Emitter, radius_m: Quantity, distance_m: Quantity) -> Quantity:
    """Mean share of the light on a disc of a radius a [m] around the aim [-].

    1 − exp(−2a²/(w² + 4σ²d²)) without turbulence, else to 1e-10
    a ∫ J₁(aκ) exp(−κ²(w² + 4σ²d²)/8 − c κ^(5/3)) dκ, with c as in `turbulence`.
    """
    return _mean(emitter, distance_m, lambda w2: -np.expm1(-2.0 * radius_m**2 / w2))


def axis_irradiance(emitter: Emitter, distance_m: Quantity) -> Quantity:
    """Mean irradiance at the aim, its largest, per watt of light that gets there [1/m²]."""
    return _mean(emitter, distance_m, lambda w2: 2.0 / (np.pi * w2))


def _mean(emitter: Emitter, distance_m: Quantity, of: Callable[[Quantity], Quantity]) -> Quantity:
    """Mean of a function of the squared width [m²] over jitter and turbulence."""
    wander = emitter.jitter_rad * distance_m
    squared = width(emitter, distance_m) ** 2 + 4.0 * wander**2
    if is_number(emitter.turbulence_cn2, 0.0):
        return of(squared)
    blurred = _blur(emitter, distance_m)
    return sum(weight * of(squared + blurred * S) for weight, S in zip(*mixture(), strict=True))


def _blur(emitter: Emitter, distance_m: Quantity) -> Quantity:
    """Return the growth of the squared width w² by turbulence, per unit of S [m²]."""
    return 8.0 * blur(emitter.turbulence_cn2, emitter.wavelength_nm, distance_m)


def limited_share(
    emitter: Emitter, radius_m: Quantity, distance_m: Quantity, most: Quantity
) -> Quantity:
    """Mean over the jitter of the smaller of the share on a disc and a largest share [-] > 0.

    With turbulence it is an upper bound, as its blur flickers. No symbols, unless σ is 0 or the
    largest share infinite.
    """
    mean = np.minimum(share(emitter, radius_m, distance_m), most)
    if is_number(emitter.jitter_rad, 0.0) or is_number(most, math.inf):
        return mean
    from optuav.physics.beams import jitter

    spread = width(emitter, distance_m) ** 2, _blur(emitter, distance_m)
    figures = radius_m, *spread, emitter.jitter_rad * distance_m, most
    return jitter.limited_share(mean, *figures)


class Chain(NamedTuple):
    """Light and power on the way from the source to the battery, before any limit."""

    light_W: Quantity  # Out of the source
    after_aperture_W: Quantity
    air: Quantity  # Share that the air lets through [-]
    share: Quantity  # Mean share of what arrives that meets the receiver [-]
    on_receiver_W: Quantity  # Light on the receiver
    dc_W: Quantity


def chain(
    emitter: Emitter,
    receiver: Receiver,
    power_W: Quantity,
    attenuation_per_km: Quantity,
    distance_m: Quantity,
) -> Chain:
    """The stations of the light of a source of an electric power [W], air of α [1/km], both ≥ 0."""
    light = power_W * emitter.source_efficiency
    passed, air = light * aperture_share(emitter), transmission(attenuation_per_km, distance_m)
    part = share(emitter, receiver.radius_m, distance_m)
    on_receiver = passed * air * part
    return Chain(light, passed, air, part, on_receiver, on_receiver * receiver.efficiency)


def largest_shares(
    receiver: Receiver, arriving_W: Quantity, most_W: Quantity
) -> tuple[Quantity, Quantity, Quantity]:
    """Shares of the arriving light [W] where each limit acts, above 1 where it never does.

    In turn the irradiance, the DC power of the receiver and the DC power that can be used [W].
    """
    light = np.maximum(arriving_W, TINY)
    dc = np.maximum(light * receiver.efficiency, TINY)
    irradiance_W = receiver.max_irradiance_W_m2 * np.pi * receiver.radius_m**2
    return irradiance_W / light, receiver.max_power_W / dc, most_W / dc


def received_power(
    emitter: Emitter,
    receiver: Receiver,
    power_W: Quantity,
    attenuation_per_km: Quantity,
    distance_m: Quantity,
    most_W: Quantity = math.inf,
) -> Quantity:
    """Mean DC power [W] at a distance [m], with the light of each moment within all limits.

    Arguments as for `chain`; the battery takes at most `most_W` [W].
    """
    air = transmission(attenuation_per_km, distance_m)
    arriving_W = power_W * emitter.source_efficiency * aperture_share(emitter) * air
    irradiance, power, used = largest_shares(receiver, arriving_W, most_W)
    most = np.minimum(np.minimum(irradiance, power), used)
    part = limited_share(emitter, receiver.radius_m, distance_m, most)
    return arriving_W * part * receiver.efficiency

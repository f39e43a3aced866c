"""Exposure limits of the eye, and how far a beam exceeds them. This is not a safety assessment.

References
----------
.. [1] IEC 60825-1:2014, annex A; ICNIRP, "Guidelines on limits of exposure to laser radiation of
   wavelengths between 180 nm and 1,000 μm", Health Physics 105(3), 2013.
"""

from collections.abc import Callable

import numpy as np

from optuav.physics import roots
from optuav.physics.laser import transmission
from optuav.physics.quantity import Quantity

SHORTEST_NM, LONGEST_NM = 700.0, 1e6
"""Wavelengths between which `exposure_limit` is known [nm]."""


def exposure_limit(wavelength_nm: Quantity) -> Quantity:
    """Largest irradiance [W/m²] for 10 s or longer, a point source and one beam [1]_.

    10·10^(0.002(λ−700))·C7 from 700 to 1050 nm, 50·C7 to 1400 nm, 1000 from there to 1 mm, with C7
    = 1 up to 1150 nm, 10^(0.018(λ−1150)) to 1200 nm and 8 + 10^(0.04(λ−1250)) to 1400 nm; from
    1250 nm on the retina stands more than the cornea. NaN elsewhere. Numbers and arrays.
    """
    λ = wavelength_nm
    steep = 8.0 + 10.0 ** (0.04 * (np.minimum(λ, 1400.0) - 1250.0))
    c7 = np.where(
        np.less(λ, 1200.0), 10.0 ** (0.018 * (np.clip(λ, 1150.0, 1200.0) - 1150.0)), steep
    )
    near = 10.0 * 10.0 ** (0.002 * (np.clip(λ, 700.0, 1050.0) - 700.0)) * c7
    bands = (
        np.less(λ, SHORTEST_NM),
        np.less(λ, 1050.0),
        np.less(λ, 1400.0),
        np.less_equal(λ, LONGEST_NM),
    )
    return np.select(bands, (np.nan, near, 50.0 * c7, 1000.0), np.nan)[()]


def hazard_distance(
    irradiance: Callable[[Quantity], Quantity],
    light_W: Quantity,
    attenuation_per_km: Quantity,
    limit_W_m2: Quantity,
) -> Quantity:
    """Distance [m] within which light exceeds a limit of the irradiance, in the middle of the beam.

    The irradiance per watt of light [1/m²] is a function of the distance [m] that does not grow
    with it. The light [W] ≥ 0 is that before the aperture; the air has α [1/km] ≥ 0. 0 where the
    limit is kept everywhere, infinite where nowhere. Numbers and arrays.
    """

    def excess(distance_m: Quantity) -> Quantity:
        air = transmission(attenuation_per_km, distance_m)
        return light_W * air * irradiance(distance_m) - limit_W_m2

    return roots.last_nonnegative(excess, 1.0)

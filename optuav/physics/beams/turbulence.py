"""Blur of a beam by Kolmogorov turbulence, as a mixture of Gaussian blurs.

A long exposure multiplies the transfer function of a beam by exp(−c κ^(5/3)). That is the
characteristic function of an isotropic 5/3-stable law, which is a mixture of normal laws:
exp(−t^(5/3)) = E exp(−S t²), where S is positive and 5/6-stable [1]_. So a closed form for a
Gaussian beam becomes a mean over S for a blurred one, with neither Bessel function nor oscillation.

References
----------
.. [1] W. Feller, "An introduction to probability theory and its applications", vol. 2, 1971,
   sections VI.2 and XVII.6; the density by V. M. Zolotarev, "One-dimensional stable
   distributions", 1986, section 2.2.
"""

import math
from functools import lru_cache

import numpy as np

from optuav.arrays import Floats
from optuav.physics.quantity import Quantity

SPHERICAL = 1.09275
"""Factor of C_n² k² d r^(5/3) in the structure function of a spherical wave, 3/8 of 2.914."""

STEP, FIRST, LAST = 0.4, -17, 70
"""Trapezoidal rule in a variable that makes the density of ln S analytic: errors stay below
1e-10 of each mean."""


def blur(cn2: Quantity, wavelength_nm: Quantity, distance_m: Quantity) -> Quantity:
    """c^(6/5) [m²] of exp(−c κ^(5/3)), with c = ½·1.09275 C_n² k² d (d/k)^(5/3).

    C_n² [m^(−2/3)] ≥ 0 is the same all along a way d [m] ≥ 0; the wavelength is > 0 [nm].
    """
    k = 2e9 * np.pi / wavelength_nm
    return (0.5 * SPHERICAL * cn2 * k**2 * distance_m) ** 1.2 * (distance_m / k) ** 2


@lru_cache(maxsize=1)
def mixture() -> tuple[Floats, Floats]:
    """Weights and values of S: exp(−t^(5/3)) = Σ weight exp(−S t²) to 1e-10, for all t ≥ 0."""
    x = STEP * np.arange(FIRST, LAST + 1)
    # ln S = 0.2 x + 0.8 ln(1 + e^x): fine where the density rises like exp(−S^(−5)), coarse after.
    S = np.exp(0.2 * x + 0.8 * np.logaddexp(0.0, x))
    density = np.where(S < 1.0, _rising(np.minimum(S, 1.0)), _falling(np.maximum(S, 1.0)))
    return STEP * density * S * (0.2 + 0.8 / (1.0 + np.exp(-x))), S


def _rising(S: Floats) -> Floats:
    """Density of S in (0, 1], Zolotarev's integral by the midpoint rule."""
    u = (np.arange(400) + 0.5) * np.pi / 400
    A = np.sin(5.0 * u / 6.0) ** 5 * np.sin(u / 6.0) / np.sin(u) ** 6
    steep = S[:, np.newaxis] ** -5.0
    return np.asarray(5.0 / S * (steep * A * np.exp(-steep * A)).mean(axis=1))


def _falling(S: Floats) -> Floats:
    """Density of S ≥ 1, by its convergent series."""
    total = np.zeros_like(S)
    for n in range(1, 80):
        order = 5.0 * n / 6.0
        size = math.exp(math.lgamma(order + 1.0) - math.lgamma(n + 1.0)) / math.pi
        total -= (-1.0) ** n * math.sin(order * math.pi) * size * S ** (-order - 1.0)
    return total

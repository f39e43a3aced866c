"""Mean of limited light under jitter: numbers and arrays.

The centre of a Gaussian beam is displaced by r, whose law is that of Rayleigh, and a disc of a
radius a then gets the share s(r), with −s′(r) = (4a/w²) exp(−2(a² + r²)/w²) I₁(4ar/w²).
"""

import numpy as np
from scipy.special import i1e

from optuav.arrays import Floats
from optuav.physics import roots
from optuav.physics.beams.turbulence import mixture
from optuav.physics.quantity import Quantity

NODES, WEIGHTS = np.polynomial.legendre.leggauss(32)
REACH = 7.5
"""Standard deviations beyond which a normal density is left out: less than 1e-12 of it."""
HALVINGS = 22
"""For the displacement at which a limit begins to act: an error there counts in its square."""
AT_ONCE = 256  # Places that are computed together: as many as fit the cache


def limited_share(
    mean: Quantity,
    radius_m: Quantity,
    squared_width_m2: Quantity,
    blur_m2: Quantity,
    wander_m: Quantity,
    most: Quantity,
) -> Quantity:
    """E min(s(r), most), for a disc of a radius a [m] and displacements of σd [m] per axis.

    The squared widths [m²] are those of a mixture, w² + blur·S. `mean` is the answer where nothing
    is displaced or the limit is no limit.
    """
    figures = np.broadcast_arrays(mean, radius_m, squared_width_m2, blur_m2, wander_m, most)
    result, *rows = (np.array(each, dtype=float).ravel() for each in figures)
    (limited,) = np.nonzero((rows[3] > 0.0) & (rows[4] < 1.0))
    for first in range(0, len(limited), AT_ONCE):
        part = limited[first : first + AT_ONCE]
        result[part] = _limited(*(each[part] for each in rows))
    return result.reshape(figures[0].shape)[()]


def _limited(a: Floats, w2: Floats, blur: Floats, away: Floats, most: Floats) -> Floats:
    """E min(s(r), most): the limit acts up to the displacement at which s(r) falls to it.

    Beyond, by parts, the mean of s is that of its slope.
    """
    weights, S = mixture() if blur.any() else (np.ones(1), np.zeros(1))
    a, w2 = a[:, np.newaxis], w2[:, np.newaxis] + blur[:, np.newaxis] * S

    def beyond(r: Floats, precision: Quantity = 0.0) -> Floats:
        return np.asarray(_beyond(a, w2, r[:, np.newaxis], precision) @ weights)

    r = roots.last(lambda r: beyond(r) - most, a[:, 0], HALVINGS)
    rest = np.exp(-0.5 * (r / away) ** 2)
    held = np.where(r > 0.0, most * (1.0 - rest), 0.0)
    return np.asarray(held + beyond(r) * rest - beyond(r, away[:, np.newaxis] ** -2.0))


def _beyond(a: Floats, w2: Floats, r: Floats, precision: Quantity) -> Floats:
    """∫ −s′(ρ) exp(−ρ² precision/2) dρ from r on; s(r) where the precision is 0."""
    variance = 1.0 / (precision + 4.0 / w2)
    centre, reach = 4.0 * a / w2 * variance, REACH * np.sqrt(variance)
    low, high = np.maximum(np.maximum(centre - reach, r), 0.0), np.maximum(centre, r) + reach
    half, total = 0.5 * (high - low), np.zeros_like(w2)
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        ρ = low + half * (1.0 + node)
        normal = np.exp(-2.0 * (a - ρ) ** 2 / w2 - 0.5 * precision * ρ**2)
        total += weight * normal * i1e(4.0 * a * ρ / w2)
    return np.asarray(total * half * 4.0 * a / w2)

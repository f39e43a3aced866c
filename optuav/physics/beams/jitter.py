"""Mean of limited light under jitter: numbers and arrays.

The centre of a Gaussian beam is displaced by r, with Rayleigh's law, and a disc of a
radius a then gets the share s(r), with −s′(r) = (4a/w²) exp(−2(a² + r²)/w²) I₁(4ar/w²).
"""

import numpy as np
from scipy.special import i1e

from optuav.arrays import Floats
from optuav.physics.beams.turbulence import mixture
from optuav.physics.quantity import TINY, Quantity

NODES, WEIGHTS = np.polynomial.legendre.leggauss(32)
REACH = 7.5
"""Standard deviations beyond which a normal density is left out: less than 1e-12 of it."""
FARTHEST = 8.5  # Displacement in standard deviations per axis; 2e-16 of the law lie beyond
NEWTON_STEPS, SMALL_STEP = 24, 1e-6
"""Steps for the displacement where a limit begins to act, and a step small enough as a share
of the standard deviation: an error there counts in its square."""
PLACES_AT_ONCE = 256  # Places that are computed together: as many as fit the cache


def limited_share(
    mean: Quantity,
    radius_m: Quantity,
    squared_width_m2: Quantity,
    blur_m2: Quantity,
    wander_m: Quantity,
    most: Quantity,
) -> Quantity:
    """E min(s(r), most), for a disc of a radius a [m] and displacements of σd [m] per axis.

    The squared widths [m²] form a mixture, w² + blur·S. `mean` is the answer where nothing
    is displaced or the limit never acts.
    """
    figures = np.broadcast_arrays(mean, radius_m, squared_width_m2, blur_m2, wander_m, most)
    result, *rows = (np.array(figure, dtype=float).ravel() for figure in figures)
    weights, S = mixture() if rows[2].any() else (np.ones(1), np.zeros(1))
    (limited,) = np.nonzero((rows[3] > 0.0) & (rows[4] < 1.0))
    for first in range(0, len(limited), PLACES_AT_ONCE):
        part = limited[first : first + PLACES_AT_ONCE]
        a, w2, blur, away, most = (row[part, np.newaxis] for row in rows)
        w2 = w2 + blur * S
        # Where it acts at no displacement or at all of them, the mean is the answer.
        least, largest = _beyond(a, w2, FARTHEST * away, 0.0), -np.expm1(-2.0 * a**2 / w2)
        acts = (least @ weights < most[:, 0]) & (most[:, 0] < largest @ weights)
        if acts.any():
            figures_limited = (argument[acts] for argument in (a, w2, away, most))
            result[part[acts]] = _limited(weights, *figures_limited)
    return result.reshape(figures[0].shape)[()]


def _limited(weights: Floats, a: Floats, w2: Floats, away: Floats, most: Floats) -> Floats:
    """E min(s(r), most): the limit acts up to the displacement where s(r) falls to it.

    Beyond, by parts, the mean of s is the mean of its slope. Figures are (place, 1 or part of the
    mixture).
    """

    def beyond(r: Floats, precision: Quantity = 0.0) -> Floats:
        return (_beyond(a, w2, r, precision) @ weights)[:, np.newaxis]

    # Newton's steps from the rim of the disc, halving where they leave the known interval.
    low, high, r = np.zeros_like(a), FARTHEST * away, np.minimum(a, FARTHEST * away)
    for _ in range(NEWTON_STEPS):
        excess = beyond(r) - most
        low, high = np.where(excess >= 0.0, r, low), np.where(excess < 0.0, r, high)
        slope = _slope(a, w2, r) @ weights
        step = excess / np.maximum(slope[:, np.newaxis], TINY)
        inside = (low <= r + step) & (r + step <= high)
        before, r = r, np.where(inside, r + step, 0.5 * (low + high))
        if (np.abs(r - before) <= SMALL_STEP * away).all():
            break
    rest = np.exp(-0.5 * (r / away) ** 2)
    return np.asarray(most * (1.0 - rest) + beyond(r) * rest - beyond(r, away**-2.0))[:, 0]


def _slope(a: Floats, w2: Floats, r: Floats) -> Floats:
    """−s′(r) by part of the mixture."""
    return np.asarray(4.0 * a / w2 * np.exp(-2.0 * (a - r) ** 2 / w2) * i1e(4.0 * a * r / w2))


def _beyond(a: Floats, w2: Floats, r: Floats, precision: Quantity) -> Floats:
    """∫ −s′(ρ) exp(−ρ² precision/2) dρ from r on; s(r) where the precision is 0."""
    variance = 1.0 / (precision + 4.0 / w2)
    centre, reach = 4.0 * a / w2 * variance, REACH * np.sqrt(variance)
    low, high = np.maximum(np.maximum(centre - reach, r), 0.0), np.maximum(centre, r) + reach
    half, total = 0.5 * (high - low), np.zeros_like(w2)
    for node, weight in zip(NODES, WEIGHTS, strict=True):
        ρ = low + half * (1.0 + node)
        total += weight * _slope(a, w2, ρ) * np.exp(-0.5 * precision * ρ**2)
    return np.asarray(total * half)

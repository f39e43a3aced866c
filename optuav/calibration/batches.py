"""The mean of a record over time, and how far it is to be trusted where neighbours are alike.

Means of whole batches are nearly independent, so their scatter tells that of the mean [1]_. In a
short record they are alike as well. How much is reckoned from the correlation φ of neighbouring
samples as if each went back on the one before, x' = φ x + noise: the mean of n such samples has a
variance proportional to g(n) = ((1 + φ)/(1 − φ) n − 2 φ (1 − φⁿ)/(1 − φ)²)/n² [2]_, and that of m
batches makes it out to be (g(n/m) − g(n))/(m − 1).

References
----------
.. [1] A. M. Law, "Simulation Modeling and Analysis", 5th ed., McGraw-Hill, 2015, section 9.5.3.
.. [2] G. E. P. Box, G. M. Jenkins, G. C. Reinsel, G. M. Ljung, "Time Series Analysis", 5th ed.,
   Wiley, 2015, section 2.1.6.
.. [3] F. H. C. Marriott, J. A. Pope, "Bias in the estimation of autocorrelations", Biometrika,
   1954.
"""

from __future__ import annotations

import math

import numpy as np

from optuav.arrays import Floats
from optuav.calibration.estimation import CONFIDENCE, Interval

BATCHES = 10
"""Of a record, for the interval of its mean; it has at least as many samples."""
MOST_ALIKE = 0.99
"""Largest correlation of neighbours that is believed."""


def mean_over_time(values: Floats, steps_s: Floats) -> tuple[float, Interval]:
    """Mean of samples, and where it lies.

    Parameters
    ----------
    values, steps_s
        (sample,): the samples in order, and how long each stands for [s].
    """
    from scipy.special import stdtrit

    parts = zip(np.array_split(values, BATCHES), np.array_split(steps_s, BATCHES), strict=True)
    means = [float(np.average(part, weights=step)) for part, step in parts]
    mean = float(np.average(values, weights=steps_s))
    variance = float(np.var(means, ddof=1)) / BATCHES * _understated(values)
    reach = float(stdtrit(BATCHES - 1, 0.5 + 0.5 * CONFIDENCE)) * math.sqrt(variance)
    return mean, Interval(mean - reach, mean + reach)


def _understated(values: Floats) -> float:
    """The variance of the mean over what independent batches make it out to be."""
    alike, count = _alike(values), len(values)
    whole, batch = (_variance(alike, number) for number in (count, count / BATCHES))
    return whole * (BATCHES - 1) / (batch - whole)


def _variance(alike: float, count: float) -> float:
    """Of the mean of samples with neighbours alike, but for a factor."""
    ends = 2.0 * alike * (1.0 - math.pow(alike, count)) / (1.0 - alike) ** 2
    return ((1.0 + alike) / (1.0 - alike) * count - ends) / count**2


def _alike(values: Floats) -> float:
    """Correlation of neighbours about the straight line through a record.

    So a voltage that sags does not pass for one that wanders. Without the bias of short records,
    about (2 + 4 φ)/n where it is (1 + 3 φ)/n about a mean [3]_.
    """
    count = len(values)
    place = np.arange(count) - 0.5 * (count - 1)
    left = values - np.mean(values)
    left = left - (place @ left) / (place @ place) * place
    squares = float(left @ left)
    found = float(left[1:] @ left[:-1]) / squares if squares > 0.0 else 0.0
    return float(np.clip((found + 2.0 / count) / (1.0 - 4.0 / count), 0.0, MOST_ALIKE))

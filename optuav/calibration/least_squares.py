"""Least squares over transformed parameters, and how far the result is to be trusted.

Positive parameters are fitted by their logarithm, shares by their logit, so that no bound is needed
and intervals stay inside the range. With r(x) the residuals, independent and of one variance, and J
their Jacobian of rank p at the optimum, the covariance of x is s² (JᵀJ)⁻¹, s² = r·r/(n − p) [1]_.

References
----------
.. [1] G. A. F. Seber, C. J. Wild, "Nonlinear Regression", Wiley, 1989, section 5.1.
.. [2] G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares
   problems whose variables separate", SIAM J. Numer. Anal., 1973.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Sequence
from itertools import compress
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats

CONFIDENCE = 0.95  # share of intervals that hold the truth
LOGIT = 13.8  # largest size of the logit of a share: 1e-6 from 0 and 1
LOGARITHM = (-35.0, 20.7)  # range of the logarithm of a positive value: 1e-15 to 1e9
CLOSE = 1e-12  # tolerances of a fit
MOST_POLISH = 30  # steps of the last fit, which needs a few where the data determine all
BLIND = 1e-6  # singular value of the Jacobian, over the largest, that determines nothing
NOTHING = 1e-100  # what replaces 0 in a denominator, far from 1 and from overflow
TIE = 1e-6  # relative difference of two sums of squares that is rounding
SAME = 1e-4  # difference of two optima, in logarithms or logits, that is rounding
WIDE = math.log(10.0)  # half width, of a logarithm or logit, of a value that is not determined
ROUNDING = 1e-3  # component of a blind direction that may come from rounding

Residuals = Callable[[Floats], Floats]


class ConfidenceInterval(NamedTuple):
    """The range in which a value lies at a confidence of 95 %."""

    low: float
    high: float


class Estimate(NamedTuple):
    """The result of a fit: values by parameter, residuals by observation, and how sure they are."""

    values: Floats
    residuals: Floats
    spread: float | None  # s; None if there are no more observations than parameters
    intervals: tuple[ConfidenceInterval, ...] | None  # by the Jacobian; None without a spread
    undetermined: tuple[str, ...]  # parameters that the data do not determine or tell apart


def estimate(
    names: Sequence[str],
    residuals: Residuals,
    starts: Iterable[Sequence[float]],
    *,
    shares: Collection[str] = (),
    spread: float | None = None,
    eliminated: int = 0,
    miss: Callable[[Floats], float] | None = None,
) -> Estimate:
    """Fit parameters to observations from several starts.

    Parameters
    ----------
    names
        Of the p parameters, which are positive.
    residuals
        Maps values (p,) to the n residuals, all of one standard deviation; finite everywhere.
    starts
        Values to start from, at least one set.
    shares
        Names of the parameters that are below 1 as well.
    spread
        Standard deviation of a residual where it is known; the residuals may show a larger one.
    eliminated
        Further parameters, over which the residuals of every set of values are least already [2]_.
    miss
        Relative miss of values by another measure, which decides between equally good optima.
    """
    from scipy.special import ndtri, stdtrit

    problem = _Problem(np.array([name in shares for name in names]), residuals)
    found = [problem.fit(problem.inner(start)) for start in starts]
    least = min(each.sum_of_squares for each in found)
    rounding = TIE * (least + (spread or 0.0) ** 2)
    ties = [each for each in found if each.sum_of_squares <= least + rounding]
    if miss and any(np.max(np.abs(each.x - ties[0].x)) > SAME for each in ties):
        misses = [miss(problem.outer(each.x)) for each in ties]
        pairs = zip(ties, misses, strict=True)
        ties = [each for each, missed in pairs if missed <= min(misses) + SAME]
    best = problem.fit(min(ties, key=lambda each: each.way).x, polish=True)
    errors, largest_error, rank = _errors(best.jacobian)
    freedom = len(best.residuals) - rank - eliminated
    left = math.sqrt(best.sum_of_squares / freedom) if freedom > 0 else None
    sigma = left if spread is None else max(spread, left or 0.0)
    wide, intervals = errors >= largest_error, None
    if sigma is not None:
        level = 0.5 + 0.5 * CONFIDENCE
        quantile = float(stdtrit(freedom, level) if spread is None else ndtri(level))
        reach = sigma * quantile * errors
        intervals = problem.intervals(best.x - reach, best.x + reach)
        wide |= reach > WIDE
        # Of optima that are equally good, rounding would choose one.
        apart = [np.abs(each.x - best.x) > np.maximum(reach, SAME) for each in ties]
        wide |= np.any(apart, axis=0)
    undetermined = tuple(compress(names, wide))
    return Estimate(problem.outer(best.x), best.residuals, sigma, intervals, undetermined)


class _Optimum(NamedTuple):
    """An optimum in transformed parameters, and how far from its start."""

    x: Floats
    residuals: Floats
    jacobian: Floats
    way: float

    @property
    def sum_of_squares(self) -> float:
        return float(self.residuals @ self.residuals)


class _Problem:
    """Residuals as a function of logarithms and logits."""

    def __init__(self, shares: Booleans, residuals: Residuals) -> None:
        self.shares, self.residuals = shares, residuals
        # Beyond these a mission may state no value.
        self.low = np.where(self.shares, -LOGIT, LOGARITHM[0])
        self.high = np.where(self.shares, LOGIT, LOGARITHM[1])

    def inner(self, values: Sequence[float]) -> Floats:
        """Logarithms and logits of values."""
        found = np.array(values)
        x: Floats = np.log(found / np.where(self.shares, 1.0 - found, 1.0))
        return x

    def outer(self, x: Floats) -> Floats:
        """Values from their logarithms and logits."""
        grown = np.exp(np.clip(x, self.low, self.high))
        return np.where(self.shares, grown / (1.0 + grown), grown)

    def fit(self, start: Floats, *, polish: bool = False) -> _Optimum:
        """The optimum near a start."""
        from scipy.optimize import least_squares

        def residuals(x: Floats) -> Floats:
            return self.residuals(self.outer(x))

        answer = least_squares(
            residuals,
            start,
            # Steps of "trf" keep out of directions in which the data are blind.
            method="trf",
            # One-sided differences leave the optimum uncertain in its seventh digit.
            jac="3-point" if polish else "2-point",
            xtol=CLOSE,
            ftol=CLOSE,
            gtol=CLOSE,
            max_nfev=MOST_POLISH if polish else None,
        )
        way = float(np.linalg.norm(answer.x - start))
        return _Optimum(answer.x, answer.fun, np.asarray(answer.jac), way)

    def intervals(self, low: Floats, high: Floats) -> tuple[ConfidenceInterval, ...]:
        """Intervals of the values from the ends of those of their logarithms and logits."""
        ends = self.outer(low).tolist(), self.outer(high).tolist()
        return tuple(map(ConfidenceInterval, *ends))


def _errors(jacobian: Floats) -> tuple[Floats, float, int]:
    """Standard errors of the parameters for s = 1, which of them are too large, and the rank of J.

    Errors in directions in which the data are blind are larger than anything.
    """
    rows, columns = jacobian.shape
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=rows < columns)
    sizes = np.pad(sizes, (0, columns - len(sizes)))
    largest = max(float(sizes[0]), NOTHING)
    blind = sizes <= BLIND * largest
    along = 1.0 / np.where(blind, BLIND**2 * largest, sizes)
    # A rounding error in a blind direction would reach parameters that are determined.
    directions[blind] = np.where(np.abs(directions[blind]) < ROUNDING, 0.0, directions[blind])
    errors = np.linalg.norm(directions * along[:, None], axis=0)
    return errors, 1.0 / (BLIND * largest), int(np.sum(~blind))

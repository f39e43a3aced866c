"""Least squares over transformed parameters, and how far the result is to be trusted.

Positive parameters are fitted by their logarithm, shares by their logit, so that no bound is needed
and intervals stay inside the range. With r(x) the residuals, independent and of one variance, and J
their Jacobian of rank p at the optimum, the covariance of x is s² (JᵀJ)⁻¹, s² = r·r/(n − p) [1]_.
The bootstrap refits to residuals drawn from those of the fit, scaled up by sqrt(n/(n − p)), and
uses the quantiles of (x* − x)/s*, "bootstrap-t" [2]_.

References
----------
.. [1] G. A. F. Seber, C. J. Wild, "Nonlinear Regression", Wiley, 1989, section 5.1.
.. [2] A. C. Davison, D. V. Hinkley, "Bootstrap Methods and their Application", Cambridge, 1997,
   sections 5.2.1 and 6.3.
.. [3] G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares
   problems whose variables separate", SIAM J. Numer. Anal., 1973.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from itertools import compress
from typing import Literal, NamedTuple

import numpy as np

from optuav.arrays import Floats

CONFIDENCE = 0.95
"""Share of intervals that hold the truth."""
REPLICATES = 400
"""Refits of the bootstrap."""
SEED = 20200813
"""Of the bootstrap, so that the same data give the same intervals."""
LEAST_FREEDOM = 3
"""Fewest observations more than parameters for a bootstrap."""
LOGIT = 13.8
"""Largest size of the logit of a share: 1e-6 from 0 and 1."""
LOGARITHM = (-35.0, 20.7)
"""Range of the logarithm of a positive value: 1e-15 to 1e9."""
CLOSE = {"trf": 1e-12, "lm": 1e-6}
"""Tolerance of the fit itself, and of the refits of the bootstrap."""
BLIND = 1e-6
"""Singular value of the Jacobian, over the largest, below which the data determine nothing."""
NOTHING = 1e-100
"""What replaces 0 in a denominator, far from 1 and from overflow."""
TIE = 1e-6
"""Relative difference of two sums of squares below which the nearer optimum is preferred."""
WIDE = math.log(10.0)
"""Half width of an interval, of a logarithm or logit, beyond which a value is not determined."""
ROUNDING = 1e-3
"""Component of a blind direction that may come from rounding."""

Residuals = Callable[[Floats], Floats]


class Unknown(NamedTuple):
    """A parameter to be fitted: its name, and whether it is a share in (0, 1) or just positive."""

    name: str
    kind: Literal["positive", "share"] = "positive"


class ConfidenceInterval(NamedTuple):
    """The range in which a value lies at a confidence of 95 %."""

    low: float
    high: float


@dataclass(frozen=True)
class Estimate:
    """The result of a fit.

    Parameters
    ----------
    values
        (parameter,): the values.
    residuals
        (observation,): the residuals at the optimum.
    spread
        s, standard deviation of a residual; None if there are no more observations than parameters.
    intervals
        By the Jacobian, one a parameter; None where the spread is unknown.
    bootstrap
        By refitting; None where there are too few observations or they determine too little.
    undetermined
        Parameters that the data do not determine, or cannot tell apart.
    """

    values: Floats
    residuals: Floats
    spread: float | None
    intervals: tuple[ConfidenceInterval, ...] | None
    bootstrap: tuple[ConfidenceInterval, ...] | None
    undetermined: tuple[str, ...]


def estimate(
    unknowns: Sequence[Unknown],
    residuals: Residuals,
    starts: Iterable[Sequence[float]],
    *,
    spread: float | None = None,
    bootstrap: bool = True,
    eliminated: int = 0,
) -> Estimate:
    """Fit parameters to observations from several starts.

    Parameters
    ----------
    unknowns
        The p parameters.
    residuals
        Maps values (p,) to the n residuals, all of one standard deviation; finite everywhere.
    starts
        Values to start from, at least one set.
    spread
        Standard deviation of a residual where it is known; the residuals may show a larger one.
    bootstrap
        Whether to refit for intervals as well.
    eliminated
        Further parameters, over which the residuals of every set of values are least already [3]_.
    """
    from scipy.special import ndtri, stdtrit

    problem = _Problem(unknowns, residuals)
    found = [problem.fit(problem.inner(start)) for start in starts]
    least = min(each.sum_of_squares for each in found)
    ties = [each for each in found if each.sum_of_squares <= (1.0 + TIE) * least]
    best = min(ties, key=lambda each: each.way)
    errors = _errors(best.jacobian)
    freedom = len(best.residuals) - errors.rank - eliminated
    left = math.sqrt(best.sum_of_squares / freedom) if freedom > 0 else None
    sigma = left if spread is None else max(spread, left or 0.0)
    wide = errors.parameters >= errors.least / BLIND
    intervals = None
    if sigma is not None:
        level = 0.5 + 0.5 * CONFIDENCE
        quantile = float(stdtrit(freedom, level) if spread is None else ndtri(level))
        reach = sigma * quantile * errors.parameters
        intervals = problem.intervals(best.x - reach, best.x + reach)
        wide |= reach > WIDE
    undetermined = tuple(compress((each.name for each in unknowns), wide))
    refit = bootstrap and freedom >= LEAST_FREEDOM and not undetermined
    return Estimate(
        problem.outer(best.x),
        best.residuals,
        sigma,
        intervals,
        _bootstrap(problem, best, freedom) if refit else None,
        undetermined,
    )


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

    def __init__(self, unknowns: Sequence[Unknown], residuals: Residuals) -> None:
        self.residuals = residuals
        self.shares = np.array([unknown.kind == "share" for unknown in unknowns])
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

    def fit(
        self, start: Floats, method: Literal["trf", "lm"] = "trf", shift: Floats | float = 0.0
    ) -> _Optimum:
        """The optimum, `shift` added to the residuals.

        Steps of "trf" keep out of directions in which the data are blind; "lm" is fast.
        """
        from scipy.optimize import least_squares

        def residuals(x: Floats) -> Floats:
            return self.residuals(self.outer(x)) + shift

        close = CLOSE[method]
        answer = least_squares(
            residuals,
            start,
            # Central differences: forward ones move the optimum in its seventh digit.
            jac="3-point" if method == "trf" else "2-point",
            method=method,
            xtol=close,
            ftol=close,
            gtol=close,
        )
        way = float(np.linalg.norm(answer.x - start))
        return _Optimum(answer.x, answer.fun, np.asarray(answer.jac), way)

    def intervals(self, low: Floats, high: Floats) -> tuple[ConfidenceInterval, ...]:
        """Intervals of the values from the ends of those of their logarithms and logits."""
        ends = self.outer(low).tolist(), self.outer(high).tolist()
        return tuple(map(ConfidenceInterval, *ends))


class _Errors(NamedTuple):
    """Standard errors of the parameters for s = 1 and along the best determined direction."""

    parameters: Floats
    least: float
    rank: int


def _errors(jacobian: Floats) -> _Errors:
    """Errors by the singular values; where the data are blind, larger than anything."""
    rows, columns = jacobian.shape
    _, sizes, directions = np.linalg.svd(jacobian, full_matrices=rows < columns)
    sizes = np.pad(sizes, (0, columns - len(sizes)))
    largest = max(float(sizes[0]), NOTHING)
    blind = sizes <= BLIND * largest
    along = 1.0 / np.where(blind, BLIND**2 * largest, sizes)
    # A rounding error in a blind direction would reach parameters that are determined.
    directions[blind] = np.where(np.abs(directions[blind]) < ROUNDING, 0.0, directions[blind])
    parameters = np.linalg.norm(directions * along[:, None], axis=0)
    return _Errors(parameters, 1.0 / largest, int(np.sum(~blind)))


def _bootstrap(problem: _Problem, best: _Optimum, freedom: int) -> tuple[ConfidenceInterval, ...]:
    """Intervals by the bootstrap-t."""
    random = np.random.default_rng(SEED)
    count = len(best.residuals)

    def errors(fit: _Optimum) -> Floats:
        own = math.sqrt(fit.sum_of_squares / freedom)
        return np.maximum(own * _errors(fit.jacobian).parameters, np.finfo(float).tiny)

    pool = (best.residuals - best.residuals.mean()) * math.sqrt(count / freedom)
    scaled = []
    for drawn in random.choice(pool, (REPLICATES, count)):
        again = problem.fit(best.x, "lm", drawn - best.residuals)
        scaled.append((again.x - best.x) / errors(again))
    outside = 0.5 - 0.5 * CONFIDENCE
    low, high = np.quantile(scaled, [outside, 1.0 - outside], axis=0)
    return problem.intervals(best.x - high * errors(best), best.x - low * errors(best))

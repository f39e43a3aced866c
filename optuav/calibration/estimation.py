"""Least squares over transformed parameters, and how far the answer is to be trusted.

Parameters that are positive are fitted by their logarithm, shares by their logit, so that no bound
is needed and intervals stay inside the range. With r(x) the residuals, independent and of one
variance, and J their Jacobian of rank p at the optimum, the covariance of x is s² (JᵀJ)⁻¹,
s² = r·r/(n − p) [1]_. The bootstrap fits again and again to residuals drawn from those that were
left over, scaled up by sqrt(n/(n − p)), and uses the quantiles of (x* − x)/s*, "bootstrap-t" [2]_.

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
from functools import partial
from itertools import compress
from typing import Literal, NamedTuple

import numpy as np

from optuav.arrays import Floats

CONFIDENCE = 0.95
"""Share of intervals that cover the truth."""
REPLICATES = 400
"""Refits of the bootstrap."""
SEED = 20200813
"""Of the bootstrap, so that the same data give the same intervals."""
LEAST_FREEDOM = 3
"""Fewest observations more than parameters for which a bootstrap is worth its name."""
LOGIT = 13.8
"""Largest size of the logit of a share: 1e-6 from 0 and 1."""
LOGARITHM = (-35.0, 20.7)
"""Range of the logarithm of a positive value: 1e-15 to 1e9."""
CLOSE = {"trf": 1e-12, "lm": 1e-6}
"""Tolerance of the fit itself, and of the refits of the bootstrap."""
BLIND = 1e-6
"""Singular value of the Jacobian, over the largest, below which the data say nothing."""
NOTHING = 1e-100
"""What stands for 0 below a fraction, so far from 1 and yet from overflow."""
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


class Interval(NamedTuple):
    """Where a value lies at the confidence of `CONFIDENCE`."""

    low: float
    high: float


@dataclass(frozen=True)
class Estimate:
    """What a fit found.

    Parameters
    ----------
    values
        (parameter,): the values.
    residuals
        (observation,): what was left over.
    spread
        s, standard deviation of a residual; None where no observation is left over to tell.
    intervals
        By the Jacobian, one a parameter; None where the spread is not known.
    bootstrap
        By refitting; None where there are too few observations or they determine too little.
    undetermined
        Parameters that the data do not determine, or cannot tell apart.
    """

    values: Floats
    residuals: Floats
    spread: float | None
    intervals: tuple[Interval, ...] | None
    bootstrap: tuple[Interval, ...] | None
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
        Standard deviation of a residual where it is known; it is taken for larger if what is left
        over says so.
    bootstrap
        Whether to refit for intervals as well.
    eliminated
        Further parameters, over which the residuals of every set of values are least already [3]_.
    """
    outer = _outer(unknowns)
    found = [_fit(lambda x: residuals(outer(x)), _inner(unknowns, start)) for start in starts]
    least = min(each.sum_of_squares for each in found)
    ties = [each for each in found if each.sum_of_squares <= (1.0 + TIE) * least]
    best = min(ties, key=lambda each: each.way)
    errors = _errors(best.jacobian)
    freedom = len(best.residuals) - errors.rank - eliminated
    left = math.sqrt(best.sum_of_squares / freedom) if freedom > 0 else None
    sigma = left if spread is None else max(spread, left or 0.0)
    reach = None if sigma is None else sigma * _quantile(freedom, spread)
    undetermined = _undetermined(unknowns, errors, reach)
    intervals, drawn = None, None
    if reach is not None:
        intervals = _intervals(outer, best.x, -reach * errors.parameters, reach * errors.parameters)
    if bootstrap and freedom >= LEAST_FREEDOM and not undetermined:
        drawn = _refits(outer, residuals, best, freedom)
    return Estimate(outer(best.x), best.residuals, sigma, intervals, drawn, undetermined)


class _Found(NamedTuple):
    """An optimum in transformed parameters, and how far from its start."""

    x: Floats
    residuals: Floats
    jacobian: Floats
    way: float

    @property
    def sum_of_squares(self) -> float:
        return float(self.residuals @ self.residuals)


def _fit(residuals: Residuals, start: Floats, method: Literal["trf", "lm"] = "trf") -> _Found:
    """Steps of "trf" keep out of directions in which the data are blind; "lm" is fast."""
    from scipy.optimize import least_squares

    close = CLOSE[method]
    answer = least_squares(residuals, start, method=method, xtol=close, ftol=close, gtol=close)
    way = float(np.linalg.norm(answer.x - start))
    return _Found(answer.x, answer.fun, np.asarray(answer.jac), way)


def _inner(unknowns: Sequence[Unknown], values: Sequence[float]) -> Floats:
    """Logarithms and logits."""
    return np.array(
        [
            math.log(value / (1.0 - value)) if unknown.kind == "share" else math.log(value)
            for unknown, value in zip(unknowns, values, strict=True)
        ]
    )


def _outer(unknowns: Sequence[Unknown]) -> Callable[[Floats], Floats]:
    """The way back, within what a mission may be."""
    shares = np.array([unknown.kind == "share" for unknown in unknowns])
    low, high = np.where(shares, [[-LOGIT], [LOGIT]], np.reshape(LOGARITHM, (2, 1)))

    def outer(x: Floats) -> Floats:
        grown = np.exp(np.clip(x, low, high))
        return np.where(shares, grown / (1.0 + grown), grown)

    return outer


class _Errors(NamedTuple):
    """Standard errors of the parameters for s = 1 and along the direction that is seen best."""

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
    # A rounding error in a direction that is blind would reach parameters that are not.
    directions[blind] = np.where(np.abs(directions[blind]) < ROUNDING, 0.0, directions[blind])
    parameters = np.linalg.norm(directions * along[:, None], axis=0)
    return _Errors(parameters, 1.0 / largest, int(np.sum(~blind)))


def _undetermined(
    unknowns: Sequence[Unknown], errors: _Errors, reach: float | None
) -> tuple[str, ...]:
    """Parameters of which the data say too little."""
    wide = errors.parameters >= errors.least / BLIND
    if reach is not None:
        wide |= reach * errors.parameters > WIDE
    return tuple(compress((each.name for each in unknowns), wide))


def _quantile(freedom: int, spread: float | None) -> float:
    """Of Student's t, or of the normal distribution where the spread is known."""
    from scipy.special import ndtri, stdtrit

    level = 0.5 + 0.5 * CONFIDENCE
    return float(ndtri(level) if spread is not None else stdtrit(freedom, level))


def _intervals(
    outer: Callable[[Floats], Floats], x: Floats, below: Floats, above: Floats
) -> tuple[Interval, ...]:
    lows, highs = outer(x + below), outer(x + above)
    return tuple(map(Interval, lows.tolist(), highs.tolist()))


def _refits(
    outer: Callable[[Floats], Floats], residuals: Residuals, best: _Found, freedom: int
) -> tuple[Interval, ...]:
    """Intervals by the bootstrap-t."""
    random = np.random.default_rng(SEED)
    count = len(best.residuals)

    def errors(fit: _Found) -> Floats:
        own = math.sqrt(fit.sum_of_squares / freedom)
        return np.maximum(own * _errors(fit.jacobian).parameters, np.finfo(float).tiny)

    def shifted(shift: Floats, x: Floats) -> Floats:
        return residuals(outer(x)) + shift

    pool = (best.residuals - best.residuals.mean()) * math.sqrt(count / freedom)
    scaled = []
    for drawn in random.choice(pool, (REPLICATES, count)):
        again = _fit(partial(shifted, drawn - best.residuals), best.x, "lm")
        scaled.append((again.x - best.x) / errors(again))
    outside = 0.5 - 0.5 * CONFIDENCE
    low, high = np.quantile(scaled, [outside, 1.0 - outside], axis=0)
    return _intervals(outer, best.x, -high * errors(best), -low * errors(best))

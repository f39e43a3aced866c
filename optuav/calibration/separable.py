"""Least squares where most parameters enter linearly, with intervals by profile likelihood.

For given values of the others, the linear parameters follow without a search, none below its least
value [1]_. An interval holds all values of a parameter with which some values of the others leave a
sum of squares up to S + t² s². There S is the least of all, s² = S/(n − p) with n observations and
p parameters, and t is by Student [2]_. Unlike an interval by curvature it is right where the data
see a parameter from one side only: it then ends with the range of the parameter.

References
----------
.. [1] G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares
   problems whose variables separate", SIAM J. Numer. Anal., 1973.
.. [2] D. M. Bates, D. G. Watts, "Nonlinear Regression Analysis and Its Applications", Wiley, 1988,
   chapter 6.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import fit
from optuav.calibration.fit import ConfidenceInterval, Estimate, quantile

Columns: TypeAlias = Callable[[Floats], tuple[Floats, Floats]]
"""From the other parameters to the columns (observation, linear parameter) and the observations."""

BETTER = 1e-6  # relative gain of the sum of squares that makes another optimum
ROUNDED_DEVIATION = 1e-9  # least standard deviation, over the root mean square of the observations
FIRST_STEP = 0.05  # of a search for an end, in logarithms
SQUARES_TOLERANCE, END_TOLERANCE = (
    1e-9,
    1e-8,
)  # relative tolerances of a sum of squares, and of an end
WIDE = math.exp(fit.WIDE)  # factor of an end to a value that is not determined
MOST_OPTIMA = 5  # optima, each better than the last, after which the search ends


class Optimum(NamedTuple):
    """The least sum of squares, the residuals, and values of all parameters, linear ones last."""

    squares: float
    residuals: Floats
    values: Floats


class Problem(NamedTuple):
    """A sum of squares, and the ranges of its parameters: `others` that are above 0, linear ones.

    The linear parameters have no largest value.
    """

    columns: Columns
    others: Sequence[tuple[float, float]]
    linear: Sequence[float]  # least values

    def solved(self, others: Floats, place: int = -1, value: float = 0.0) -> Optimum:
        """The optimum over the linear parameters, or all of them but one that has a value."""
        from scipy.optimize import nnls

        columns, observed = self.columns(others)
        linear, free = np.array(self.linear), np.arange(len(self.linear))
        if place >= len(others):
            linear[place - len(others)] = value
            free = free[free != place - len(others)]
        sizes = np.maximum(np.linalg.norm(columns[:, free], axis=0), fit.NOTHING)
        linear[free] += nnls(columns[:, free] / sizes, observed - columns @ linear)[0] / sizes
        residuals = columns @ linear - observed
        return Optimum(float(residuals @ residuals), residuals, np.append(others, linear))

    def least(self, start: Floats, place: int = -1, value: float = 0.0) -> Optimum:
        """The optimum over all parameters, or all but one, from a start of the others."""
        from scipy.optimize import least_squares

        others, free = start.copy(), np.arange(len(start)) != place
        others[~free] = value

        def residuals(x: Floats) -> Floats:
            others[free] = np.exp(x)
            return self.solved(others, place, value).residuals

        how: dict[str, Any] = {"method": "dogbox", "max_nfev": fit.MOST_STEPS}
        # One-sided differences leave the place uncertain in its seventh digit, not the sum.
        how["jac"], close = (
            ("3-point", fit.FIT_TOLERANCE) if place < 0 else ("2-point", SQUARES_TOLERANCE)
        )
        how |= dict.fromkeys(("xtol", "ftol", "gtol"), close)
        bounds = np.log(np.array(self.others)[free].T)
        inside = np.clip(np.log(start[free]), *bounds)  # rounding may leave them
        others[free] = np.exp(least_squares(residuals, inside, bounds=bounds, **how).x)
        return self.solved(others, place, value)

    def best(self, starts: Iterable[Sequence[float]]) -> Optimum:
        """The optimum over all parameters, from the best of several starts of the others."""
        first = min((self.solved(np.array(start, float)) for start in starts), key=_squares)
        return self.least(first.values[: len(self.others)])


def estimate(keys: Sequence[str], problem: Problem, best: Optimum, freedom: int) -> Estimate:
    """The optimum, or a better one that the search for intervals meets, and its intervals.

    Residuals are of one standard deviation. It is known with a freedom of n − p, or a smaller one
    where parts of the residuals were scaled by themselves.
    """
    count, deviations = len(problem.others), quantile(fit.CONFIDENCE, freedom)
    for _ in range(MOST_OPTIMA):
        observed = problem.columns(best.values[:count])[1]
        least = ROUNDED_DEVIATION * float(np.linalg.norm(observed))
        spread = math.sqrt(max(best.squares, least**2) / (len(observed) - len(keys)))
        reach, seen = deviations * spread, [best]
        ends = [
            [_end(problem, best, place, reach, seen, up=up) for up in (False, True)]
            for place in range(len(keys))
        ]
        if (better := min(seen, key=_squares)).squares >= best.squares - BETTER * reach**2:
            break
        best = problem.least(better.values[:count])
    low, high = np.array(ends).T
    wide = (low * WIDE < best.values) | (high > best.values * WIDE)
    intervals = tuple(itertools.starmap(ConfidenceInterval, ends))
    undetermined = tuple(itertools.compress(keys, wide))
    return Estimate(tuple(keys), best.values, best.residuals, spread, intervals, undetermined)


def _squares(optimum: Optimum) -> float:
    return optimum.squares


def _end(
    problem: Problem, best: Optimum, place: int, reach: float, seen: list[Optimum], *, up: bool
) -> float:
    """The end of the interval of a parameter, where the sum of squares is larger by the reach².

    All optima on the way are added to those seen.
    """
    from scipy.optimize import brentq

    count, linear = len(problem.others), place - len(problem.others)
    # Steps are in the logarithm of a parameter that is not linear.
    into, back = (math.log, math.exp) if linear < 0 else (float, float)
    low, high = problem.others[place] if linear < 0 else (problem.linear[linear], math.inf)
    bound, near, step = into(high if up else low), best, FIRST_STEP
    if linear >= 0:  # as far as the end lies at least, if nothing else makes up for the parameter
        columns, _ = problem.columns(best.values[:count])
        step = reach / float(np.linalg.norm(columns[:, linear]))

    @cache  # or one place would have two values, by where the search came from
    def beyond(x: float) -> float:
        nonlocal near
        optimum = problem.least(near.values[:count], place, back(x))
        seen.append(optimum)
        more = math.sqrt(max(optimum.squares - best.squares, 0.0)) - reach
        near = optimum if more < 0.0 else near
        return more

    here = inner = into(float(best.values[place]))
    while beyond(outer := min(here + step, bound) if up else max(here - step, bound)) < 0.0:
        if outer == bound:
            return high if up else low
        inner, step = outer, 2.0 * step
    return back(
        brentq(
            beyond,
            inner,
            outer,
            xtol=END_TOLERANCE * max(abs(inner), abs(outer)),
            rtol=END_TOLERANCE,
        )
    )

"""A programme as a local solver sees it: unknowns of size 1, their bounds, and where to start."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from optuav.arrays import Floats
from optuav.engines.ranges import implied_upper_bounds
from optuav.modelling.model import Model

SHARES = (0.02, 0.5, 0.98)
"""Where the starts lie between the bounds of an unknown."""
MOST_STARTS = 27
TYPICAL = 1000.0
"""Reach of an unknown for which nothing states a bound."""
LEAST = 1e-3
"""Least reach by which an unknown is scaled, where the constraints leave it next to none."""
AT_BOUND = 1e-9
"""Relative distance from a bound that is as good as none."""
STEEP = 100.0
"""Largest slope of an objective as the solver sees it; its tolerances are absolute."""


@dataclass(frozen=True)
class ScaledProgramme:
    """One programme: a model with numbers for its parameters.

    Parameters
    ----------
    names
        Of the unknowns.
    parameters, numbers
        Values of the parameters by name, and in the order in which the solver takes them.
    lower, upper, scale
        Bounds of the unknowns, and their sizes; the solver sees an unknown over its size.
    starts
        Points to start from, scaled.
    """

    names: Sequence[str]
    parameters: Mapping[str, Any]
    numbers: Floats
    lower: Floats
    upper: Floats
    scale: Floats
    starts: Sequence[Floats]

    def arguments(
        self, senses: Sequence[str], start: Floats, more: Sequence[float]
    ) -> dict[str, Floats]:
        """Of a call from a start, with rows of the given senses.

        `more` holds the steepness, and a limit for every earlier goal: a further row ≤ 0.
        """
        kept = len(more) - 1
        low = [-math.inf if sense == "<=" else 0.0 for sense in senses]
        high = [math.inf if sense == ">=" else 0.0 for sense in senses]
        return {
            "x0": start,
            "p": np.concatenate([self.numbers, self.scale, more]),
            "lbx": self.lower / self.scale,
            "ubx": self.upper / self.scale,
            "lbg": np.append(low, np.full(kept, -math.inf)),
            "ubg": np.append(high, np.zeros(kept)),
        }

    def scaled(self, points: Iterable[Mapping[str, float]]) -> list[Floats]:
        """Points as the solver sees them."""
        return [np.array([point[name] for name in self.names]) / self.scale for point in points]

    def point(self, answer: Any) -> dict[str, float]:
        """Where an answer lies, by name; on a bound that an interior point stopped short of."""
        found = np.clip(np.asarray(answer["x"]).ravel() * self.scale, self.lower, self.upper)
        for bound in (self.lower, self.upper):
            reach = AT_BOUND * np.maximum(1.0, np.abs(bound))
            found = np.where(np.isfinite(bound) & (np.abs(found - bound) <= reach), bound, found)
        return dict(zip(self.names, found.tolist(), strict=True))

    def steepness(self, slope: Any) -> float:
        """What to divide the objective by, from its slope halfway between the bounds."""
        halfway = self.starts[len(self.starts) // 2]
        gradient = np.asarray(slope(halfway, np.concatenate([self.numbers, self.scale])))
        largest = float(np.abs(gradient).max(initial=0.0))
        return largest / STEEP if math.isfinite(largest) and largest > 0.0 else 1.0


def scaled_programme(
    model: Model,
    parameters: Mapping[str, Any],
    numbers: Floats,
    lower: Mapping[str, float],
    upper: Mapping[str, float],
) -> ScaledProgramme:
    """A programme with sizes and starts that its bounds and constraints suggest."""
    names = [variable.name for variable in model.variables]
    implied = implied_upper_bounds(model, parameters, lower)
    spans = [_span(lower[name], min(implied[name], upper[name]), upper[name]) for name in names]
    first, scale = np.array(spans).reshape(-1, 2).T
    shares = itertools.islice(itertools.product(SHARES, repeat=len(names)), MOST_STARTS)
    return ScaledProgramme(
        names,
        parameters,
        numbers,
        np.array([lower[name] for name in names]),
        np.array([upper[name] for name in names]),
        scale,
        [(first + np.array(share) * scale) / scale for share in shares],
    )


def _span(lower: float, likely: float, upper: float) -> tuple[float, float]:
    """Where the starts of an unknown begin and how far they reach, from its bounds.

    `likely` is the upper bound that the constraints put on it as well.
    """
    if math.isinf(lower):
        return (-0.5 * TYPICAL if math.isinf(upper) else upper - TYPICAL), TYPICAL
    if not likely > lower or math.isinf(likely):
        return lower, TYPICAL
    return lower, max(likely - lower, LEAST)

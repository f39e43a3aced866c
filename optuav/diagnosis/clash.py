"""Constraints that are not linear and cannot hold together: no certificate, but none to spare.

References
----------
.. [1] J. W. Chinneck, "Feasibility and infeasibility in optimization", Springer, 2008: the
   deletion filter.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from optuav.arrays import Booleans
from optuav.diagnosis.proving import constrained, linear_part, subset
from optuav.engines import bracket
from optuav.errors import InputError
from optuav.modelling import Expression, Model, Relation
from optuav.modelling.check import Check, evaluated
from optuav.modelling.expression import Variable
from optuav.modelling.model import Constraint

FAR_S = 1e4
"""How far times are followed where no constraint bounds them [s]."""
BROKEN = {"dry": "empty", "past full": "past full"}
"""What the available well is where a limit of it does not hold, by the limit's kind."""


@dataclass(frozen=True)
class Clash:
    """Constraints that no times satisfy together, though they do if any one of them is left out.

    Parameters
    ----------
    labels
        Of the constraints.
    keys
        The mission's keys in them.
    broken
        What does not hold without any stay, Δ = T' = 0, in words.
    far_s
        Sum of the times up to which it is proved [s]; infinity where the constraints bound them.
    """

    labels: tuple[str, ...]
    keys: tuple[str, ...]
    broken: tuple[str, ...]
    far_s: float

    def to_dict(self) -> dict[str, Any]:
        """As plain data; None for infinity."""
        return {
            "labels": list(self.labels),
            "keys": list(self.keys),
            "broken": list(self.broken),
            "far_s": self.far_s if math.isfinite(self.far_s) else None,
        }


def clash(model: Model, parameters: Mapping[str, Any]) -> tuple[Constraint, ...]:
    """Constraints of a programme that cannot hold together, none of which can be spared.

    Of several such sets the one that is met first on the way.

    Parameters
    ----------
    model
        The declaration.
    parameters
        Values of all its parameters, numbers, with which nothing is feasible.

    Raises
    ------
    NotExponentialError
        If a constraint is no form that phases of constant current give.
    """
    linear = linear_part(model).constraints
    kept = [*(each for each in model.constraints if each not in linear), *linear]
    size = len(kept)
    while size > 1:
        size = (size + 1) // 2
        for start in range(0, len(kept), size)[::-1]:
            fewer = kept[:start] + kept[start + size :]
            if impossible(model, fewer, 1, parameters)[0]:
                kept = fewer
    return tuple(each for each in model.constraints if each in kept)


def impossible(
    model: Model,
    constraints: Sequence[Constraint],
    programmes: int,
    values: Mapping[str, Any] | None = None,
) -> Booleans:
    """Where it is proved that no times which sum up to `FAR_S` satisfy some of the constraints."""
    far = Relation(_sum(model), "<=", FAR_S)
    part = subset(model, [*constraints, Constraint("", far, "s", "")])
    return bracket.no_point(part, programmes, values)


def reach_s(model: Model, constraints: Sequence[Constraint], row: Mapping[str, Any]) -> float:
    """Sum of the times up to which `impossible` is a proof [s]: infinity if it cannot be larger.

    It is where the constraints without `FAR_S` can be followed to their ends, and contradict each
    other there too.
    """
    part = subset(model, constraints)
    try:
        ended = bracket.no_point(part, 1, row)
    except InputError:
        return FAR_S
    return math.inf if ended.all() else FAR_S


def _sum(model: Model) -> Expression:
    times: Sequence[Variable] = model.variables
    return sum(times[1:], start=times[0] + 0.0)


def told(
    model: Model,
    constraints: Sequence[Constraint],
    labels: tuple[str, ...],
    moments: Sequence[str],
    row: Mapping[str, Any],
) -> Clash:
    """A clash in words, with labels and moments by the places of the route."""
    part = subset(model, constraints)
    nothing = {each.name: 0.0 for each in model.variables}
    sides = evaluated(part, {**row, **nothing})[: len(constraints)]
    keys = (each.key for one in constraints for each in constrained(one) if each.key)
    return Clash(
        labels,
        tuple(dict.fromkeys(keys)),
        tuple(
            _broken(label, moment, side)
            for label, moment, side in zip(labels, moments, sides, strict=True)
            if not side.satisfied
        ),
        reach_s(model, constraints, row),
    )


def _broken(label: str, moment: str, side: Check) -> str:
    """What a constraint that does not hold says of the battery, or else its two sides."""
    if moment and side.constraint.kind in BROKEN:
        return f"the available well would be {BROKEN[side.constraint.kind]} {moment}"
    return f"{label}: {side.left:.6g} {side.sense} {side.right:.6g} would be false"

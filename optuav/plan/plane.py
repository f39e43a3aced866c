"""The (Δ, T') plane of a problem: feasible times under its constraints, sampled, and its grid.

A problem without a rest has only Δ: its plane is the same for all rest times.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from formulations.soc import StepEnd
from optuav.arrays import Booleans, Floats
from optuav.engines import grid
from optuav.modelling import Constraint, Model
from optuav.modelling.check import Checks, evaluated
from optuav.plan.display import rounded_up
from optuav.tables import Limits

Points: TypeAlias = Sequence[tuple[float, float]]

REACHED = {"dry": "dry", "past full": "full"}
"""State of the available well where a limit of it binds, by the kind of the constraint."""
ROLES = {"state of charge": "charge", "dry": "dry", "past full": "overfull"}
ROLES |= {role: role for role in ("deadline", "bounds")}
"""Roles in `optuav.looks` of limits by the kind of the constraint."""
DRAWN = ROLES.keys() - {"bounds"}  # Kinds of limits that are lines in a plane
MOST_POINTS = 40  # Most points of the grid that are shown along an axis
SAMPLES, LARGEST_WHOLE = (
    61,
    100_000,
)  # Samples along an axis on a page, and largest whole number there
EXCESS_SHOWN = 4.0  # Multiple of the excess beside the line of a limit that a page tells apart
BINDING_SLACK = 1e-6  # Largest slack of a binding constraint, as a share of its limit
POINTS = 25  # Points of its grid along an axis
BELOW = 0.0375  # Share of its axes that lies below 0
ABOVE = 1.02  # Least end of an axis per time of a marked plan, which so stands inside
BEYOND = 1.5  # How far the grid is shown, as a multiple of how far it is feasible


def kind_of(constraint: Constraint) -> str:
    """Name a constraint's limited quantity; a time that the deadline bounds above is at least 0."""
    lower = constraint.kind == "deadline" and constraint.relation.sense == ">="
    return "bounds" if lower else constraint.kind


class Cut(NamedTuple):
    """A constraint without which more would be feasible."""

    constraint: Constraint
    excess: Floats  # By how much it holds (Δ, T'); it forbids where that is negative
    others_hold: Booleans  # Where all other constraints hold (Δ, T')

    @property
    def whole(self) -> list[int]:
        """The excess as whole numbers up to `LARGEST_WHOLE`, row by row; NaN counts as violated.

        What is far from the line of the limit is clipped, so that its digits tell the line.
        """
        bounded = np.nan_to_num(self.excess, nan=-np.inf, posinf=np.inf, neginf=-np.inf)
        finite, near = np.isfinite(bounded), np.zeros(bounded.shape, dtype=bool)
        for holds, beside in ((bounded >= 0.0, near), ((bounded >= 0.0).T, near.T)):
            crossed = holds[1:] != holds[:-1]
            beside[1:] |= crossed
            beside[:-1] |= crossed
        most = EXCESS_SHOWN * np.abs(bounded[finite & near]).max(initial=0.0)
        most = most or np.abs(bounded[finite]).max(initial=0.0) or 1.0
        rounded = np.rint(np.clip(bounded / most, -1.0, 1.0) * LARGEST_WHOLE).astype(int)
        return list[int](rounded.ravel().tolist())

    @property
    def forbids(self) -> bool:
        """True if it has a forbidden side: an equality holds only on its line."""
        return self.constraint.relation.sense != "=="


class Sampled(NamedTuple):
    """A plane as a page draws it: ends of the axes and grid [s], Δ before T', and what cuts."""

    ends_s: list[tuple[float, float]]
    round_s: list[float]  # Where the axes end if nothing is stated
    cuts: list[Cut]
    grid_s: list[Floats]
    one_of: int  # How many points of the grid each point stands for
    feasible: Booleans


def constraint_name(constraint: Constraint, route: Sequence[str]) -> str:
    """The label of a constraint; for one of the available well, what happens on the route."""
    moment = constraint.moment
    if constraint.kind not in REACHED or not isinstance(moment, StepEnd):
        return constraint.label
    well = f"available well {REACHED[constraint.kind]}"
    if moment.stay and moment.hover and route:
        return f"{well} after the hover over {route[moment.flight]}"
    if moment.stay:
        return f"{well} {moment}"
    flight = f"flight to {route[moment.flight]}" if route else f"flight {moment.flight}"
    return f"{well}, {'end' if moment.lands else f'stage {moment.stage}'} of {flight}"


def thinned(counted: Sequence[Floats], most: int = MOST_POINTS) -> tuple[list[Floats], int]:
    """Every n-th value of both axes of the grid, and one of how many points is left."""
    steps = [max(1, math.ceil(len(values_s) / most)) for values_s in counted]
    return [values_s[::n] for values_s, n in zip(counted, steps, strict=True)], math.prod(steps)


class Plane(NamedTuple):
    """A problem at the values of its parameters; rest times x and hover times y [s] are axes.

    Marked points are (T', Δ).
    """

    model: Model
    parameters: Mapping[str, object]

    def sampled(self, given: Limits, marked: Points, highest_s: Sequence[float] = ()) -> Sampled:
        """Return the plane up to stated times, Δ and T' [s], or up to round ones without them.

        Where nothing is feasible, the axes end at the deadline.
        """
        counted = self.worth_seeing(given.slot_s, marked, SAMPLES)
        along = (
            [*values_s[-1:], *(ABOVE * p[1 - k] for p in marked)]
            for k, values_s in enumerate(counted)
        )
        round_s = [rounded_up(float(max(ends, default=0.0)) or given.deadline_s) for ends in along]
        ends_s = [(-BELOW * highest, float(highest)) for highest in highest_s or round_s]
        y, x = (np.linspace(*end_s, SAMPLES) for end_s in ends_s)
        grid_s, one_of = thinned(counted, POINTS)
        curves = [*self.cuts(x, y, marked)]
        return Sampled(ends_s, round_s, curves, grid_s, one_of, self.feasible(*grid_s))

    def worth_seeing(self, slot_s: float, marked: Points, samples: int) -> list[Floats]:
        """The grid [s], Δ and T', as far as it is feasible or marked, and somewhat farther.

        The whole grid if that is not much more.
        """
        counted = [*grid.axes(self.model, self.parameters, slot_s), np.zeros(1)][:2]
        y, x = (np.linspace(0.0, values_s.max(initial=0.0), samples) for values_s in counted)
        excesses = [e >= 0.0 for row, e in self._excesses(x, y) if row.relation.sense != "=="]
        feasible = np.all([np.ones((samples, samples), dtype=bool), *excesses], axis=0)
        reached = (y[feasible.any(axis=1)], 1), (x[feasible.any(axis=0)], 0)
        seen = []
        for values_s, (inside, number) in zip(counted, reached, strict=True):
            farthest = BEYOND * max([*inside, *(point[number] for point in marked)], default=np.inf)
            cut = values_s[values_s <= farthest]
            seen.append(cut if len(cut) > 1 and farthest < 0.7 * values_s.max() else values_s)
        return seen

    def feasible(self, y: Floats, x: Floats) -> Booleans:
        """Test which points of the grid satisfy all constraints (Δ, T')."""
        held = [
            np.broadcast_to(row.satisfied, (len(y), len(x))) for row in self._rows(y[:, None], x)
        ]
        return np.asarray(np.all(held, axis=0))

    def cuts(self, x: Floats, y: Floats, marked: Points = ()) -> Iterator[Cut]:
        """The constraints without which more would be feasible, one of those that do the same.

        One that binds at a marked point is among them unless another one of its kind is.
        """
        touching = {label for point in marked for label in self._binding(*point)}
        kept = [(row, e, e >= 0.0) for row, e in self._excesses(x, y)]
        bounding = [cut for cut in kept if cut[0].relation.sense != "=="]

        def all_hold(but: Booleans | None = None) -> Booleans:
            others = [held for *_, held in bounding if held is not but]
            return np.asarray(np.all([np.ones((len(y), len(x)), dtype=bool), *others], axis=0))

        inside = all_hold()
        for cut in list(bounding):
            # What holds nowhere is named, though another constraint forbids everything as well.
            kind = kind_of(cut[0])
            only_one = sum(kind_of(cut[0]) == kind for cut in bounding) == 1
            if only_one and kind in DRAWN and cut[0].label in touching:
                continue
            if cut[2].any() and (all_hold(but=cut[2]) == inside).all():
                bounding.remove(cut)
                kept.remove(cut)
        for constraint, excess, own in kept:
            yield Cut(constraint, excess, all_hold(but=own))

    def _binding(self, rest_s: float, hover_s: float) -> Iterator[str]:
        """The labels of the constraints that hold with equality at a point."""
        for row in self._rows(hover_s, rest_s):
            if abs(float(row.slack)) <= BINDING_SLACK * max(1.0, abs(float(row.right))):
                yield row.constraint.label

    @np.errstate(over="ignore", invalid="ignore")
    def _rows(self, hover_s: float | Floats, rest_s: float | Floats) -> Checks:
        """The constraints at times, also so far away that exponentials are too large to write."""
        names = [variable.name for variable in self.model.variables]
        times_s = dict(zip(names, (hover_s, rest_s), strict=False))
        return evaluated(self.model, {**self.parameters, **times_s})

    def _excesses(self, x: Floats, y: Floats) -> Iterator[tuple[Constraint, Floats]]:
        """Constraints and by how much they hold (y, x); they forbid where that is negative.

        A shortfall within the tolerance of a check counts as held.
        """
        for row in self._rows(y[:, None], x):
            held = np.where(row.satisfied, np.maximum(row.slack, 0.0), row.slack)
            excess = row.left - row.right if row.sense == "==" else held
            yield row.constraint, np.broadcast_to(np.asarray(excess, dtype=float), (len(y), len(x)))

"""Why a program is infeasible: irreducible sets of constraints in conflict, route by route.

References
----------
.. [1] J. W. Chinneck, "Feasibility and infeasibility in optimization", Springer, 2008: the
   deletion filter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Values
from optuav.diagnosis.certificate import (
    Certificate,
    certificates,
    linear_part,
    parameters_in,
    subset,
)
from optuav.engines import bracket
from optuav.errors import InputError
from optuav.modelling import Model, Relation
from optuav.modelling.check import evaluated
from optuav.modelling.classify import traits
from optuav.modelling.forms import NotExponentialError
from optuav.modelling.model import Constraint
from optuav.solving import Program
from optuav.solving.outcome import Part, moments, words

MOST_ROUTES = 100
"""Routes of a declaration whose conflicts are examined: those with the shortest flights."""
FAR_S = 1e4
"""How far times are followed where no constraint bounds them [s]."""
BROKEN = {"dry": "empty", "past full": "past full"}
"""What the available well is where a limit of it does not hold, by the limit's kind."""


@dataclass(frozen=True)
class Clash:
    """Constraints that no times satisfy together, though they do if any one of them is left out."""

    labels: tuple[str, ...]
    keys: tuple[str, ...]  # The mission's keys in them
    broken: tuple[str, ...]  # Sentences on those that do not hold without any stay, Δ = T' = 0
    far_s: float  # Sum of the times up to which it is proved [s]; infinity where they are bounded

    def to_dict(self) -> dict[str, object]:
        """As plain data; None for infinity."""
        return {
            "labels": list(self.labels),
            "keys": list(self.keys),
            "broken": list(self.broken),
            "far_s": self.far_s if math.isfinite(self.far_s) else None,
        }


@dataclass(frozen=True)
class Conflict:
    """Why some routes have no feasible times.

    All certificates have to be resolved. Without any the linear constraints agree; then there is a
    clash, or only whole slots do not fit, or no engine can tell.
    """

    route: tuple[str, ...]  # Places of the route with the shortest flight of those concerned
    routes: int  # Number of routes concerned
    certificates: tuple[Certificate, ...]  # Conflicts of linear constraints on that route
    clash: Clash | None = None

    @property
    def labels(self) -> tuple[tuple[str, ...], ...]:
        """Labels of the constraints in conflict, one tuple a conflict."""
        found = tuple(each.labels for each in self.certificates)
        return (*found, self.clash.labels) if self.clash else found

    def to_dict(self) -> dict[str, object]:
        """As plain data."""
        return {
            "route": list(self.route),
            "routes": self.routes,
            "conflicts": [
                {"labels": list(each.labels), "keys": list(each.keys), **each.to_dict()}
                for each in self.certificates
            ],
            "clash": self.clash.to_dict() if self.clash else None,
        }


def conflicts(program: Program) -> tuple[Conflict, ...]:
    """The conflicts of an infeasible program, those that routes share once."""
    return tuple(each for part in program.parts for each in _of_part(program, part))


def _of_part(program: Program, part: Part) -> Iterator[Conflict]:
    """Conflicts on the routes of a declaration, those with the shortest flights first."""
    flight_s = program.network.routes.flight_time_s[part.routes]
    entries = np.argsort(flight_s, kind="stable")[:MOST_ROUTES].tolist()
    proofs = {each: _certificates(part, each, program.question.slot_s) for each in entries}
    kinds: dict[tuple[tuple[str, ...], ...], list[int]] = {}
    for entry in entries:
        kinds.setdefault(tuple(each.labels for each in proofs[entry]), []).append(entry)
    unproved = kinds.pop((), [])
    for alike in kinds.values():
        named = tuple(_in_places(program, part, alike[0], each) for each in proofs[alike[0]])
        yield Conflict(_names(program, part, alike[0]), len(alike), named)
    if unproved and traits(part.model).linear:
        yield Conflict(_names(program, part, unproved[0]), len(unproved), ())
    elif unproved:
        yield from _clashes(program, part, unproved)


def _certificates(part: Part, entry: int, slot_s: float | None) -> list[Certificate]:
    """Certificates of a route; of constraints without unknowns, the first that does not hold."""
    found: list[Certificate] = []
    fixed_before = False
    for each in certificates(part.model, part.model.row(entry), slot_s):
        fixed = not any(row.coefficients for row in each.rows)
        if not (fixed and fixed_before):
            found.append(each)
        fixed_before |= not all(row.coefficients for row in each.rows)
    return found


def _in_places(program: Program, part: Part, entry: int, proof: Certificate) -> Certificate:
    """A certificate with its constraints named by the places of the route."""
    labels = words(program.network, part, entry, [row.label for row in proof.rows])
    rows = zip(proof.rows, labels, strict=True)
    return replace(proof, rows=tuple(replace(row, label=label) for row, label in rows))


def _names(program: Program, part: Part, entry: int) -> tuple[str, ...]:
    return program.network.route_names(int(part.routes[entry]))


def _clashes(program: Program, part: Part, entries: Sequence[int]) -> Iterator[Conflict]:
    """Conflicts of constraints that are not linear: of one route, and of all that share it."""
    model, left = part.model, [*entries]
    while left:
        first, names = left[0], _names(program, part, left[0])
        try:
            meeting = irreducible(model, model.row(first))
            shared = impossible(model, meeting, len(part.routes))
        except (NotExponentialError, InputError):
            yield Conflict(names, len(left), ())
            return
        alike = [entry for entry in left if entry == first or shared[entry]]
        left = [entry for entry in left if entry not in alike]
        yield Conflict(names, len(alike), (), _clash(program, part, first, meeting))


def irreducible(model: Model, parameters: Values) -> tuple[Constraint, ...]:
    """Constraints that cannot hold together, none of which can be spared; one of such sets.

    Nothing may be feasible with the parameters, all of them numbers. Raises `NotExponentialError`
    if a constraint has a form that phases of constant current do not give.
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
    values: Values | None = None,
) -> Booleans:
    """Where it is proved that no times with a sum up to `FAR_S` satisfy some constraints."""
    first, *others = model.variables
    far = Constraint("", Relation(sum(others, start=first + 0.0), "<=", FAR_S), "s", "")
    return bracket.no_point(subset(model, [*constraints, far]), programmes, values)


def _reach_s(model: Model, constraints: Sequence[Constraint], parameters: Values) -> float:
    """Sum of the times up to which `impossible` is a proof [s]; infinity if they are bounded."""
    try:
        ended = bracket.no_point(subset(model, constraints), 1, parameters)
    except InputError:
        return FAR_S
    return math.inf if ended.all() else FAR_S


def _clash(program: Program, part: Part, entry: int, meeting: Sequence[Constraint]) -> Clash:
    """A clash with labels and moments by the places of the route."""
    network, model, row = program.network, part.model, part.model.row(entry)
    labels = tuple(words(network, part, entry, [each.label for each in meeting]))
    known = moments(network, part, entry)
    no_stay = {each.name: 0.0 for each in model.variables}
    sides = evaluated(subset(model, meeting), {**row, **no_stay})
    broken = []
    # The bounds of the unknowns, which follow, are not among the constraints in conflict.
    for label, side in zip(labels, sides, strict=False):
        if not side.satisfied:
            moment = known.get(side.label)
            kind = BROKEN.get(side.constraint.kind) if moment else None
            broken.append(
                f"the available well would be {kind} {moment}"
                if kind
                else f"{label}: {side.left:.6g} {side.sense} {side.right:.6g} would be false"
            )
    keys = dict.fromkeys(each.key for one in meeting for each in parameters_in(one) if each.key)
    return Clash(labels, tuple(keys), tuple(broken), _reach_s(model, meeting, row))

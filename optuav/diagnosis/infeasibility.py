"""Why a program is infeasible: irreducible sets of constraints in conflict, route by route.

References
----------
.. [1] J. W. Chinneck, "Feasibility and infeasibility in optimization", Springer, 2008: the
   deletion filter.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from optuav.arrays import Booleans, Values
from optuav.diagnosis.certificate import (
    Certificate,
    certificates,
    linear_part,
    parameters_in,
    plain,
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
FAR_S = 1e4  # How far times are followed where no constraint bounds them [s]
BROKEN = {"dry": "empty", "past full": "past full"}
"""What the available well is where a limit of it does not hold, by the limit's kind."""


@dataclass(frozen=True)
class Clash:
    """Constraints that no times satisfy together, though they do if any one of them is left out."""

    labels: tuple[str, ...]
    keys: tuple[str, ...]  # The mission's keys in them
    broken: tuple[str, ...]  # Sentences on those that do not hold without any stay, Δ = T' = 0
    far_s: float  # Sum of the times up to which it is proved [s]; infinity where they are bounded


@dataclass(frozen=True)
class Conflict:
    """Why some routes have no feasible times.

    All certificates have to be resolved. Without any the linear constraints agree; then there is a
    clash, or only whole slots do not fit, or no engine can tell.
    """

    route: tuple[str, ...]  # Places of the route with the shortest flight of those concerned
    routes: int  # Number of routes concerned
    certificates: tuple[Certificate, ...] = ()  # Conflicts of linear constraints on that route
    clash: Clash | None = None

    @property
    def proofs(self) -> tuple[Certificate | Clash, ...]:
        """Certificates and clash."""
        return (*self.certificates, self.clash) if self.clash else self.certificates

    def to_dict(self) -> dict[str, object]:
        """As plain data."""
        proofs = {"conflicts": plain(self.certificates), "clash": plain(self.clash)}
        return {"route": list(self.route), "routes": self.routes, **proofs}


def conflicts(program: Program) -> tuple[Conflict, ...]:
    """The conflicts of an infeasible program, those that routes share once."""
    return tuple(each for part in program.parts for each in _of_part(program, part))


def _of_part(program: Program, part: Part) -> Iterator[Conflict]:
    """Conflicts on the routes of a declaration, those with the shortest flights first."""
    network = program.network
    flight_s = network.routes.flight_time_s[part.routes]
    alike: dict[tuple[tuple[str, ...], ...], list[int]] = {}
    proofs: dict[int, list[Certificate]] = {}
    for entry in np.argsort(flight_s, kind="stable")[:MOST_ROUTES].tolist():
        parameters = part.model.row(entry)
        proofs[entry] = [*certificates(part.model, parameters, program.question.slot_s)]
        alike.setdefault(tuple(each.labels for each in proofs[entry]), []).append(entry)
    unproved = alike.pop((), [])
    for first, *others in alike.values():
        named = []
        for proof in proofs[first]:
            labels = words(network, part, first, [row.label for row in proof.rows])
            rows = map(lambda row, label: replace(row, label=label), proof.rows, labels)
            named.append(replace(proof, rows=tuple(rows)))
        yield Conflict(_names(program, part, first), 1 + len(others), tuple(named))
    if unproved and traits(part.model).linear:
        yield Conflict(_names(program, part, unproved[0]), len(unproved))
    elif unproved:
        yield from _clashes(program, part, unproved)


def _names(program: Program, part: Part, entry: int) -> tuple[str, ...]:
    return program.network.route_names(int(part.routes[entry]))


def _clashes(program: Program, part: Part, entries: Sequence[int]) -> Iterator[Conflict]:
    """Conflicts of constraints that are not linear: of one route, and of all that share it."""
    model, left = part.model, [*entries]
    while left:
        first, names = left[0], _names(program, part, left[0])
        try:
            meeting = _irreducible(model, model.row(first))
            shared = _impossible(model, meeting, len(part.routes))
        except (NotExponentialError, InputError):
            yield Conflict(names, len(left))
            return
        others = [entry for entry in left[1:] if not shared[entry]]
        clash = _clash(program, part, first, meeting)
        yield Conflict(names, len(left) - len(others), clash=clash)
        left = others


def _irreducible(model: Model, parameters: Values) -> tuple[Constraint, ...]:
    """Constraints that cannot hold together, none of which can be spared; one of such sets.

    Nothing may be feasible with the parameters, all of them numbers. Raises `NotExponentialError`
    if a constraint has a form that phases of constant current do not give.
    """
    linear = linear_part(model).constraints
    kept = [*(each for each in model.constraints if each not in linear), *linear]
    for each in kept[::-1]:
        fewer = [other for other in kept if other is not each]
        if fewer and _impossible(model, fewer, 1, parameters)[0]:
            kept = fewer
    return tuple(each for each in model.constraints if each in kept)


def _impossible(
    model: Model, constraints: Sequence[Constraint], programmes: int, values: Values | None = None
) -> Booleans:
    """Where it is proved that no times with a sum up to `FAR_S` satisfy some constraints."""
    first, *others = model.variables
    far = Constraint("", Relation(sum(others, start=first + 0.0), "<=", FAR_S), "s", "")
    return bracket.some_point(subset(model, [*constraints, far]), programmes, values)[1]


def _clash(program: Program, part: Part, entry: int, meeting: Sequence[Constraint]) -> Clash:
    """A clash with labels and moments by the places of the route."""
    network, model, row = program.network, part.model, part.model.row(entry)
    labels = tuple(words(network, part, entry, [each.label for each in meeting]))
    known = moments(network, part, entry)
    sides = evaluated(meeting, {**row, **{each.name: 0.0 for each in model.variables}})
    broken = []
    for label, side in zip(labels, sides, strict=True):
        moment, kind = known.get(side.label), BROKEN.get(side.constraint.kind)
        if side.satisfied:
            continue
        if moment and kind:
            broken.append(f"the available well would be {kind} {moment}")
        else:
            compared = f"{side.left:.6g} {side.sense} {side.right:.6g}"
            broken.append(f"{label}: {compared} would be false")
    keys = dict.fromkeys(each.key for one in meeting for each in parameters_in(one) if each.key)
    far_s = FAR_S
    with suppress(InputError):  # the times are not bounded
        if bracket.some_point(subset(model, meeting), 1, row)[1].all():
            far_s = math.inf
    return Clash(labels, tuple(keys), tuple(broken), far_s)

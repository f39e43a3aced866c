"""Which constraints conflict on which routes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from optuav.diagnosis.certificate import Certificate
from optuav.diagnosis.clash import Clash, clash, impossible, told
from optuav.diagnosis.proving import certificates
from optuav.errors import InputError
from optuav.modelling.classify import traits
from optuav.modelling.kibam_form import NotExponentialError
from optuav.solving import Program
from optuav.solving.plans import Part, moment_words, words

MOST_ROUTES = 100
"""Routes of a declaration whose conflicts are looked into: those with the shortest flights."""


@dataclass(frozen=True)
class Conflict:
    """Why some routes have no feasible times.

    Parameters
    ----------
    route
        Names of the places of the route for which it is told: of those that it concerns the one
        with the shortest flight.
    routes
        Number of routes that it concerns.
    certificates
        The conflicts of linear constraints on that route, each with its proof; all of them have to
        be resolved. None where the linear constraints agree.
    clash
        Where they agree: constraints that no times satisfy together; None where only whole slots do
        not fit, or no engine can tell.
    """

    route: tuple[str, ...]
    routes: int
    certificates: tuple[Certificate, ...]
    clash: Clash | None = None

    @property
    def labels(self) -> tuple[tuple[str, ...], ...]:
        """Labels of the constraints that conflict, one tuple a conflict."""
        found = tuple(each.labels for each in self.certificates)
        return (*found, self.clash.labels) if self.clash else found

    def to_dict(self) -> dict[str, Any]:
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
    """The conflicts of an infeasible program by kind."""
    return tuple(each for part in program.parts for each in _of_part(program, part))


def _of_part(program: Program, part: Part) -> Iterator[Conflict]:
    """Conflicts on the routes of a declaration, those with the shortest flights first."""
    flight_s = program.network.routes.flight_time_s[part.routes]
    entries = np.argsort(flight_s, kind="stable")[:MOST_ROUTES].tolist()
    model, slot_s = part.model, program.question.slot_s
    proofs = {entry: _certificates(part, entry, slot_s) for entry in entries}
    kinds: dict[Any, list[int]] = {}
    for entry in entries:
        kinds.setdefault(tuple(each.labels for each in proofs[entry]), []).append(entry)
    unproved = kinds.pop((), [])
    for alike in kinds.values():
        named = [_in_places(program, part, alike[0], each) for each in proofs[alike[0]]]
        yield Conflict(_names(program, part, alike[0]), len(alike), tuple(named))
    if unproved:
        yield from (
            _clashes(program, part, unproved)
            if not traits(model).linear
            else [Conflict(_names(program, part, unproved[0]), len(unproved), ())]
        )


def _certificates(part: Part, entry: int, slot_s: float | None) -> list[Certificate]:
    """Certificates of a route; of figures that no unknown moves, the first that does not hold."""
    found: list[Certificate] = []
    for each in certificates(part.model, part.model.row(entry), slot_s):
        fixed = not any(row.coefficients for row in each.rows)
        if not (fixed and any(not row.coefficients for other in found for row in other.rows)):
            found.append(each)
    return found


def _clashes(program: Program, part: Part, entries: Sequence[int]) -> Iterator[Conflict]:
    """Conflicts of constraints that are not linear: one route at a time, and all that share it."""
    model, left = part.model, [*entries]
    while left:
        first, row = left[0], model.row(left[0])
        names = _names(program, part, first)
        try:
            meeting = clash(model, row)
            shared = impossible(model, meeting, len(part.routes))
        except (NotExponentialError, InputError):
            yield Conflict(names, len(left), ())
            return
        alike = [entry for entry in left if entry == first or shared[entry]]
        left = [entry for entry in left if entry not in alike]
        labels = words(program.network, part, first, [each.label for each in meeting])
        moments = moment_words(program.network, part, first, meeting)
        found = told(model, meeting, tuple(labels), moments, row)
        yield Conflict(names, len(alike), (), found)


def _in_places(program: Program, part: Part, entry: int, proof: Certificate) -> Certificate:
    """A certificate with its labels as a reader takes them."""
    labels = words(program.network, part, entry, [row.label for row in proof.rows])
    rows = zip(proof.rows, labels, strict=True)
    return replace(proof, rows=tuple(replace(row, label=label) for row, label in rows))


def _names(program: Program, part: Part, entry: int) -> tuple[str, ...]:
    return program.network.route_names(int(part.routes[entry]))

"""A point checked against the declared models of a program, route by route."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from optuav.errors import Fault, InputError
from optuav.modelling import Checks, check
from optuav.network.network import Network
from optuav.solving.heading import routes_of
from optuav.solving.planning import Part


def checks(worked_out: Network, parts: Sequence[Part], point: Mapping[str, Any]) -> Checks:
    """Every constraint of the models that have just the unknowns of a point; see `Program.check`.

    Parameters
    ----------
    worked_out
        The mission's places, legs and itineraries.
    parts
        The declared models.
    point
        Values by name, of the unknowns and of parameters.

    Raises
    ------
    InputError
        As of `Program.check`.
    """
    if not isinstance(point, Mapping):
        words = "as {'hover_time_s': 10.0}; a plan's times are its hover_time_s and rest_time_s"
        raise InputError([Fault("point", repr(point), f"values of the unknowns by name, {words}")])
    unknowns = [{each.name for each in part.model.variables} for part in parts]
    stated = {name for name in point if any(name in names for names in unknowns)}
    asked = [part for part, names in zip(parts, unknowns, strict=True) if names == stated]
    if not asked:
        known = " or ".join(dict.fromkeys(", ".join(sorted(names)) for names in unknowns))
        raise InputError(f"a point of this program states {known or 'nothing'}")
    parameters = dict.fromkeys(name for part in asked for name in part.model.parameters)
    given = stated.union(*(part.model.given for part in asked))
    if strange := [name for name in point if name not in given]:
        words = f"is no parameter of the program; there are {', '.join(parameters)}"
        raise InputError([Fault(name, repr(point[name]), words) for name in strange])
    return Checks(row for part in asked for row in _checks_of(worked_out, part, stated, point))


def _checks_of(
    worked_out: Network, part: Part, stated: set[str], point: Mapping[str, Any]
) -> Checks:
    """Every constraint of one model, its points called after its routes if it has several."""
    known = stated | part.model.given.keys()
    told = {name: value for name, value in point.items() if name in known}
    count = len(part.routes)
    if count == 1:
        return check(part.model, {**part.model.row(0), **told})
    points, names = routes_of(worked_out, part), _names(worked_out, part)
    return Checks(
        replace(row, points=points, names=names) if np.shape(row.satisfied) == (count,) else row
        for row in check(part.model, told)
    )


def _names(worked_out: Network, part: Part) -> tuple[str, ...]:
    """What tells the routes of a model apart: the places on the way, with hover if need be."""
    ways = [worked_out.route_names(int(route))[1:-1] for route in part.routes]
    short = [[name for name in way if name != "hover"] for way in ways]
    for named in (short, ways):
        names = tuple(" → ".join(way) or "direct" for way in named)
        if len(set(names)) == len(names):
            break
    return names

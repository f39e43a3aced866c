"""Several stops in the linear perspectives, where one rest and one hover are enough.

There the state of charge at the end is linear in the total times of flying, hovering and resting.
Take any plan, its best building among those it rests on, and one visit to the hover point and to
that building; leave all other stops out, hover and rest for the total times there. The battery ends
with no less charge: resting charges at least as well. And if every leg between origin, hover point,
building and destination takes no more time, charge and energy than any way around, the flight costs
no more. So no plan is better than the best with one rest and one hover.

Edited graphs and buildings in the way may break that condition. Then all sequences are compared,
each by its own linear programme with the rest on its best building: the same argument without the
shortening of the flight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from optuav.arrays import Integers
from optuav.errors import SolverError
from optuav.network.network import Network
from optuav.network.places import FIRST_BUILDING
from optuav.network.timeline import rest_net
from optuav.plan import Plan
from optuav.search.boxes import patterns, sequences
from optuav.solving.assemble import quantities
from optuav.solving.everywhere import terrain, ways
from optuav.solving.more_stops import ways_around
from optuav.solving.plans import Part
from optuav.solving.program import Program

MOST_SEQUENCES = 1 << 20
"""Sequences that are compared at most."""


def linear_stops(program: Program, everywhere: Network, rests: int, hovers: int) -> Plan:
    """The best plan with at most so many rests and hovers in a linear perspective.

    Parameters
    ----------
    program
        (P1) with one rest and one hover.
    everywhere
        The same mission with the legs between any two places.
    rests, hovers
        Most rests and hovers.

    Raises
    ------
    SolverError
        If one stop may not be enough, and there are too many sequences to compare.
    """
    if rests and not ways_around(everywhere).any():
        plan = program.solve()
        note = "one rest and one hover are enough: no way around is shorter than a leg"
        return plan.model_copy(update={"notes": (*plan.notes, note)})
    return _compared(program, everywhere, rests, hovers).solve()


def _compared(program: Program, everywhere: Network, rests: int, hovers: int) -> Program:
    """The programmes of all sequences, each with a rest on its best building."""
    known = terrain(everywhere)
    net = rest_net(everywhere, np.arange(len(known.duration_s) - FIRST_BUILDING))
    gain = net.current_A if program.question.perspective == "battery" else net.power_W
    worth = np.concatenate([np.full(FIRST_BUILDING, -np.inf), gain])
    columns: list[Integers] = []
    count = 0
    for pattern in patterns(rests, hovers):
        for boxes in sequences(known, pattern):
            rows = np.full((rests + hovers + 2, len(boxes)), -1, dtype=np.intp)
            rows[: len(boxes.places)] = boxes.places
            columns.append(rows)
            count += len(boxes)
            if count > MOST_SEQUENCES:
                raise SolverError(
                    f"more than {MOST_SEQUENCES} sequences of stops: ask for fewer stops or hovers"
                )
    places = np.concatenate(columns, axis=1)
    best = np.take_along_axis(places, worth[places].argmax(axis=0)[None], axis=0)[0]
    building = np.where(best >= FIRST_BUILDING, best - FIRST_BUILDING, -1)
    network = replace(everywhere, routes=ways(everywhere, places, building))
    return replace(program, network=network, parts=tuple(_parts(program, network)))


def _parts(program: Program, network: Network) -> Iterator[Part]:
    asked, building = program.question, network.routes.building
    for rests in (False, True):
        which = np.flatnonzero((building >= 0) == rests)
        if len(which):
            given = quantities(network, which, rests=rests)
            yield Part(asked.problem.model(given, asked.perspective), which)

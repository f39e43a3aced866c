"""Routes of several missions as one set of quantities, so that one declaration serves all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import PAPER
from optuav.arrays import Integers
from optuav.network.feasibility import impossibilities
from optuav.network.network import Network
from optuav.physics.kibam import Stage
from optuav.solving.assemble import quantities
from optuav.solving.declare import groups
from optuav.solving.question import Question

AT_ONCE = 1 << 13
"""Routes worked on together: few enough to stay in the cache, and in bounded memory."""


class Case(NamedTuple):
    """A question about a mission that is worked out."""

    asked: Question
    network: Network


class Stack(NamedTuple):
    """Routes of several cases.

    Parameters
    ----------
    asked
        The question about all of them.
    given
        Quantities, arrays with one entry an itinerary.
    cases
        Number of the case that each itinerary belongs to.
    """

    asked: Question
    given: Quantities
    cases: Integers


def stacks(cases: Sequence[Case]) -> Iterator[Stack]:
    """All itineraries that can be flown, those together that a single declaration can serve."""
    alike: dict[Any, list[tuple[Quantities, Integers]]] = {}
    for number, (asked, network) in enumerate(cases):
        if impossibilities(network):
            continue
        for which, rests in groups(asked, network):
            given = quantities(network, which, rests=rests)
            if asked.perspective in PAPER:
                given = replace(given, steps=())
            own = alike.setdefault((asked, *_kind(given)), [])
            own.append((given, np.full(len(which), number)))
    for (asked, *_), members in alike.items():
        for some in _portions(members):
            numbers = [each for _, each in some]
            given = _stacked([each for each, _ in some], [*map(len, numbers)])
            yield Stack(asked, given, np.concatenate(numbers))


def _kind(given: Quantities) -> tuple[Any, ...]:
    """What quantities must have in common to share a declaration."""
    missing = tuple(each.name for each in QUANTITIES if getattr(given, each.name) is None)
    return given.rests, missing, tuple(s if isinstance(s, str) else "" for s in given.steps)


def _portions(
    members: Sequence[tuple[Quantities, Integers]],
) -> Iterator[list[tuple[Quantities, Integers]]]:
    portion: list[tuple[Quantities, Integers]] = []
    for member in members:
        if portion and sum(len(each) for _, each in (*portion, member)) > AT_ONCE:
            yield portion
            portion = []
        portion.append(member)
    yield portion


def _stacked(every: Sequence[Quantities], counts: Sequence[int]) -> Quantities:
    """Quantities of the same kind one after the other."""

    def joined(values: Sequence[Any]) -> Any:
        return np.concatenate(
            [np.broadcast_to(v, n) for v, n in zip(values, counts, strict=True)], dtype=float
        )

    first = every[0]
    figures = {
        each.name: joined([getattr(given, each.name) for given in every])
        for each in QUANTITIES
        if getattr(first, each.name) is not None
    }
    steps = [
        step
        if isinstance(step, str)
        else Stage(*map(joined, zip(*(given.steps[k] for given in every), strict=True)))
        for k, step in enumerate(first.steps)
    ]
    return replace(first, **figures, steps=tuple(steps))

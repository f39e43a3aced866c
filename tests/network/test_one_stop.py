"""Whether one stop is enough: detours that are shorter than the leg they replace."""

from __future__ import annotations

import itertools
import math

import networkx
import numpy as np
import pytest

import optuav
from optuav.network.network import build_network
from optuav.network.one_stop import FIGURES, find_shortcuts

BUILDINGS = ("b1", "b2", "b3")
PLACES = ("origin", "hover", "destination", *BUILDINGS)


def random_legs(seed: int) -> networkx.DiGraph:
    """Some of the legs between six places, with figures that obey no inequality."""
    random = np.random.default_rng(seed)
    legs = networkx.DiGraph()
    legs.add_nodes_from(PLACES)
    for start, end in itertools.permutations(PLACES, 2):
        if random.random() < 0.7:
            legs.add_edge(start, end, **{each: random.uniform(1.0, 2.5) for each in FIGURES})
    return legs


def shorter(legs: networkx.DiGraph, way: tuple[str, str, str]) -> set[tuple[tuple[str, ...], str]]:
    """The figures in which two legs take less than the direct one, or the first without one."""
    first, stop, last = way
    if not (legs.has_edge(first, stop) and legs.has_edge(stop, last)):
        return set()
    if not legs.has_edge(first, last):
        return {(way, FIGURES[0])}
    return {
        (way, each)
        for each in FIGURES
        if legs[first][last][each] > legs[first][stop][each] + legs[stop][last][each]
    }


@pytest.mark.parametrize("seed", range(20))
def test_shortcuts_are_those_of_plain_loops(seed: int) -> None:
    """Detours by way of a building, and moving either piece of a hover around a rest."""
    legs = random_legs(seed)
    expected: set[tuple[tuple[str, ...], str]] = set()
    for first, stop, last in itertools.product(PLACES, BUILDINGS, PLACES):
        if first == "destination" or last in ("origin", first):
            continue
        if (first, last) != ("origin", "destination"):
            expected |= shorter(legs, (first, stop, last))
    for stop in BUILDINGS:
        before = shorter(legs, ("origin", "hover", stop))
        behind = shorter(legs, (stop, "hover", "destination"))
        if legs.has_edge("hover", stop) and legs.has_edge(stop, "hover") and before and behind:
            expected |= before | behind
    found = find_shortcuts(legs)
    assert {(each.places, each.figure) for each in found} == expected
    for each in found:
        start, stop, end = each.places
        direct = legs[start][end][each.figure] if legs.has_edge(start, end) else math.inf
        assert each.direct == direct
        assert each.by_way == legs[start][stop][each.figure] + legs[stop][end][each.figure]


def test_flight_models_obey_the_triangle_inequality() -> None:
    """Of the shipped mission, worked out and as its graph; a graph without legs has no detours."""
    mission = optuav.load("paper")
    assert find_shortcuts(build_network(mission)) == ()
    legs = optuav.graph(mission)
    assert find_shortcuts(legs) == ()
    legs.remove_edges_from(list(legs.edges))
    assert find_shortcuts(legs) == ()


def test_an_edited_leg_is_told_in_words() -> None:
    """A direct leg that takes longer than by way of a building."""
    legs = optuav.graph(optuav.load("paper"))
    legs.edges["origin", "hover"]["duration_s"] = 500.0
    first = str(find_shortcuts(legs)[0])
    assert first.startswith("origin → b")
    assert first.endswith("→ hover takes 500 s")

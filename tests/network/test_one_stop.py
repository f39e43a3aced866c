"""Whether one stop is enough: detours that are shorter than the leg they replace."""

from __future__ import annotations

import math

import networkx
import numpy as np
import pytest

import optuav
from optuav.network.graph import edited_network
from optuav.network.network import build_network
from optuav.network.one_stop import FIGURES, find_shortcuts

PAPER = optuav.load("paper")
BUILDINGS = ("b1", "b2", "b3")
FEW = PAPER.replace({"buildings": PAPER.to_dict()["buildings"][:3]})


def random_legs(seed: int) -> networkx.DiGraph:
    """Some of the legs of a mission, with figures that obey no inequality."""
    random = np.random.default_rng(seed)
    legs = optuav.graph(FEW)
    for start, end in [*legs.edges]:
        if random.random() < 0.2:
            legs.remove_edge(start, end)
        else:
            legs.edges[start, end].update({each: random.uniform(1.0, 2.5) for each in FIGURES})
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
    for stop in BUILDINGS:
        expected |= shorter(legs, ("origin", stop, "hover"))
        expected |= shorter(legs, ("hover", stop, "destination"))
        before = shorter(legs, ("origin", "hover", stop))
        behind = shorter(legs, (stop, "hover", "destination"))
        if legs.has_edge("hover", stop) and legs.has_edge(stop, "hover") and before and behind:
            expected |= before | behind
    found = find_shortcuts(edited_network(FEW, legs))
    assert {(each.places, each.figure) for each in found} == expected
    for each in found:
        start, stop, end = each.places
        direct = legs[start][end][each.figure] if legs.has_edge(start, end) else math.inf
        assert each.direct == direct
        assert each.by_way == legs[start][stop][each.figure] + legs[stop][end][each.figure]


def test_flight_models_obey_the_triangle_inequality() -> None:
    """Of the shipped mission; a graph without legs has no detours."""
    assert find_shortcuts(build_network(PAPER)) == ()
    legs = optuav.graph(PAPER)
    legs.remove_edges_from(list(legs.edges))
    assert find_shortcuts(edited_network(PAPER, legs)) == ()


def test_an_edited_leg_is_told_in_words() -> None:
    """A direct leg that takes longer than by way of a building."""
    legs = optuav.graph(PAPER)
    legs.edges["origin", "hover"]["duration_s"] = 500.0
    first = str(find_shortcuts(edited_network(PAPER, legs))[0])
    assert first.startswith("origin → b")
    assert first.endswith("→ hover takes 500 s")

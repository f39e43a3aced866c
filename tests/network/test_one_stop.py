"""Whether one stop is enough: detours that are shorter than the leg they replace."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import networkx
import numpy as np
import pytest

import optuav
from optuav import Mission
from optuav.network.graph import edited_network
from optuav.network.one_stop import (
    FIGURES,
    Shortcut,
    all_legs,
    find_shortcuts,
    one_stop_words,
)

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
    for start, end in itertools.permutations(BUILDINGS, 2):
        figures = {each: random.uniform(0.1, 2.5) for each in FIGURES}
        legs.add_edge(start, end, distance_m=1.0, peak_speed_m_s=1.0, **figures)
    return legs


def shortcuts(mission: Mission, legs: networkx.DiGraph) -> tuple[Shortcut, ...]:
    network = edited_network(mission, legs)
    return find_shortcuts(replace(network, legs=all_legs(network, legs)))


def shorter(
    legs: networkx.DiGraph, first: str, stop: str, last: str
) -> dict[tuple[str, str, str], float]:
    """By end and figure, what two legs take if it is less than the direct one, or all without."""
    if not (legs.has_edge(first, stop) and legs.has_edge(stop, last)):
        return {}
    sums = {each: legs[first][stop][each] + legs[stop][last][each] for each in FIGURES}
    if not legs.has_edge(first, last):
        return {(first, last, FIGURES[0]): sums[FIGURES[0]]}
    return {
        (first, last, each): sums[each] for each in FIGURES if legs[first][last][each] > sums[each]
    }


@pytest.mark.parametrize("seed", range(20))
def test_shortcuts_are_those_of_plain_loops(seed: int) -> None:
    """Ways by a building, from roof to roof too, and moving either piece of a hover."""
    legs = random_legs(seed)
    flown = [("origin", "hover"), ("hover", "destination")]
    flown += [(end, stop) for end in ("origin", "hover") for stop in BUILDINGS]
    flown += [(stop, end) for end in ("hover", "destination") for stop in BUILDINGS]
    detours = [
        shorter(legs, first, stop, last)
        for first, last in flown
        for stop in BUILDINGS
        if stop not in (first, last)
    ]
    for stop in BUILDINGS:
        before = shorter(legs, "origin", "hover", stop)
        behind = shorter(legs, stop, "hover", "destination")
        detours += [before, behind] if before and behind else []
    expected: dict[tuple[str, str, str], float] = {}
    for way, amount in (pair for each in detours for pair in each.items()):
        expected[way] = min(amount, expected.get(way, math.inf))
    found = shortcuts(FEW, legs)
    by_way = {(each.places[0], each.places[2], each.figure): each.by_way for each in found}
    assert by_way == pytest.approx(expected)
    assert len(found) == len(expected)
    for each in found:
        start, stop, end = each.places
        direct = legs[start][end][each.figure] if legs.has_edge(start, end) else math.inf
        assert each.direct == pytest.approx(direct)
        legs_s = legs[start][stop][each.figure] + legs[stop][end][each.figure]
        assert each.by_way == pytest.approx(legs_s)


def test_flight_models_obey_the_triangle_inequality() -> None:
    """Of the shipped mission; a graph without legs has no detours."""
    legs = optuav.graph(PAPER)
    assert shortcuts(PAPER, legs) == ()
    legs.remove_edges_from(list(legs.edges))
    assert shortcuts(PAPER, legs) == ()


def test_a_way_from_roof_to_roof_is_a_shortcut() -> None:
    """One stop was called enough wherever no graph named such a leg."""
    legs = optuav.graph(PAPER)
    legs.remove_edges_from([("origin", "b9"), ("hover", "b9")])
    words = one_stop_words(edited_network(PAPER, legs), legs)
    assert words.startswith("a route with more than one stop may be better and was not tried: or")
    assert "→ b9 can be flown, origin → b9 cannot" in words


def test_an_edited_leg_is_told_in_words() -> None:
    """A direct leg that takes longer than by way of a building."""
    legs = optuav.graph(PAPER)
    legs.edges["origin", "hover"]["duration_s"] = 500.0
    first = str(shortcuts(PAPER, legs)[0])
    assert first.startswith("origin → b")
    assert first.endswith("→ hover takes 500 s")

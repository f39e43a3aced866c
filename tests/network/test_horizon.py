"""The survey of many lines from one place changes no verdict, and leaves few lines to follow."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from optuav.arrays import Floats, Integers
from optuav.mission.building_columns import of_polygons
from optuav.network import horizon
from optuav.network import obstacles as sight
from optuav.network.obstacles import CLEAR, crossed
from optuav.network.prisms import Prisms, prisms
from tests.network.test_obstacles import L_SHAPE, is_crossed, star

Rings = list[Floats]


def prisms_around(rings: Rings, roof_m: Floats) -> Prisms:
    """Every footprint is a building, by number."""
    corners_m, sizes = np.concatenate(rings), np.array([*map(len, rings)])
    firsts_m = corners_m[np.cumsum(sizes) - sizes]
    names = [f"n{k}" for k in range(len(rings))]
    return prisms(of_polygons(names, np.column_stack([firsts_m, roof_m]), corners_m, sizes))


def all_pairs(
    obstacles: Prisms, start_m: Floats, end_m: Floats, exempt: Integers
) -> tuple[Integers, Integers]:
    """Every line with each footprint that blocks it, all being tried: no map, no survey."""
    line, footprint = np.divmod(
        np.arange(len(start_m) * len(obstacles.sizes)), len(obstacles.sizes)
    )
    swap = start_m[:, 2] > end_m[:, 2]
    low_m, high_m = np.where(swap, (end_m.T, start_m.T), (start_m.T, end_m.T))
    return sight._met(obstacles, (low_m, high_m - low_m, exempt.T), line, footprint)


def surveyed(
    obstacles: Prisms, place_m: Floats, ends_m: Floats, exempt: Integers
) -> tuple[Integers, list[tuple[int, int]], int]:
    """What blocks each line from a place; candidates for all lines; and how many were followed."""
    start_m = np.broadcast_to(place_m, ends_m.shape)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sight, "MANY", 1)
        patch.setattr(horizon, "FOOTPRINTS_AT_ONCE", 4)
        for most in ("MOST_CORNERS", "MOST_PAIRS"):
            patch.setattr(horizon, most, 500)
        followed = list[int]()
        follow = sight._followed
        patch.setattr(
            sight, "_followed", lambda *each: (followed.append(len(each[1][0].T)), follow(*each))[1]
        )
        found = crossed(obstacles, start_m, ends_m, exempt)
        seen = horizon.view(obstacles, place_m)
        ways = horizon.lines_from(place_m, ends_m, seen.bearings)
        pairs = [*horizon.candidates(seen, ways, np.arange(len(ends_m)))]
    likely = [pair for each in pairs for pair in zip(*map(np.ndarray.tolist, each), strict=True)]
    return found, likely, sum(followed)


def check(obstacles: Prisms, place_m: Floats, ends_m: Floats, exempt: Integers) -> int:
    """The survey against all pairs; how many lines were followed over the map."""
    found, likely, followed = surveyed(obstacles, place_m, ends_m, exempt)
    line, footprint = all_pairs(obstacles, np.broadcast_to(place_m, ends_m.shape), ends_m, exempt)
    blocked = np.isin(np.arange(len(ends_m)), line)
    assert np.array_equal(found != CLEAR, blocked)
    # What is named is in the way, and no other.
    met = set(zip(line.tolist(), footprint.tolist(), strict=True))
    number = np.searchsorted(obstacles.building, found[blocked])
    assert met >= set(zip(np.flatnonzero(blocked).tolist(), number.tolist(), strict=True))
    # Nothing in the way is overlooked.
    assert len(likely) == len(set(likely))
    around = np.flatnonzero(horizon.view(obstacles, place_m).near_m == 0.0).tolist()
    assert {pair for pair in met if pair[1] not in around} <= set(likely)
    return followed


def town(
    draw: np.random.Generator, count: int, apart_m: float
) -> tuple[Rings, Floats, Floats, float]:
    """Boxes, slanting squares, L-shapes and stars; their roofs, points on them, and their reach."""
    reach_m = apart_m * np.sqrt(count)
    at_m = draw.uniform(-reach_m / 2, reach_m / 2, (count, 2))
    size_m = draw.uniform(4.0, 40.0, count)
    box = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    rings = list[Floats]()
    for k, kind in enumerate(draw.integers(0, 4, count)):
        turn = draw.uniform(0.0, np.pi)
        spin = np.array([(np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))])
        shape = (
            box,
            box @ spin,
            (np.array(L_SHAPE) / 20 - 0.25) @ spin,
            np.array(star(draw, (0, 0), False)) / 60,
        )[kind]
        rings.append(at_m[k] + size_m[k] * shape)
    return rings, draw.uniform(3.0, 60.0, count), at_m, float(reach_m)


@pytest.mark.parametrize("apart_m", [15.0, 60.0, 300.0])
@pytest.mark.parametrize("seed", range(8))
def test_no_verdict_differs_from_exact_prisms(seed: int, apart_m: float) -> None:
    """24 towns from dense to sparse, 4 places each, 400 lines each: 38 400 lines in all.

    Half of the lines end on roofs, which do not block them; places lie on the ground, in and over
    the roofs, on a roof, and outside of the town.
    """
    draw = np.random.default_rng([seed, int(apart_m)])
    rings, roof_m, at_m, reach_m = town(draw, 150, apart_m)
    obstacles = prisms_around(rings, roof_m)
    own = draw.integers(0, 150, 200)
    anywhere_m = draw.uniform((-reach_m, -reach_m, 0), (reach_m, reach_m, 90), (200, 3))
    ends_m = np.concatenate([np.column_stack([at_m[own], roof_m[own]]), anywhere_m])
    exempt = np.concatenate([own, draw.integers(-3, 150, 200)])
    for place_m in (
        (*draw.uniform(-reach_m / 2, reach_m / 2, 2), 1.5),
        (*draw.uniform(-reach_m / 2, reach_m / 2, 2), 80.0),
        (*at_m[7], roof_m[7]),
        (reach_m, -reach_m, 30.0),
    ):
        alone = np.where(draw.random(400) < 0.5, exempt, 7)
        both = np.column_stack([exempt, alone])
        check(obstacles, np.array(place_m), ends_m, both)


@pytest.mark.parametrize("seed", range(2))
def test_no_verdict_differs_from_a_search_along_each_line(seed: int) -> None:
    """A search that shares no code with it: see `tests.network.test_obstacles`."""
    draw = np.random.default_rng(seed)
    rings, roof_m, _, reach_m = town(draw, 60, 50.0)
    place_m = np.array([3.0, -reach_m / 3, 40.0])
    ends_m = draw.uniform((-reach_m, -reach_m, 0), (reach_m, reach_m, 70), (400, 3))
    exempt = np.full((400, 1), CLEAR)
    found, *_ = surveyed(prisms_around(rings, roof_m), place_m, ends_m, exempt)
    outlines = [[(x, y) for x, y in ring.tolist()] for ring in rings]
    expected = [
        any(
            is_crossed(ring, roof, place_m.tolist(), end_m)
            for ring, roof in zip(outlines, roof_m.tolist(), strict=True)
        )
        for end_m in ends_m.tolist()
    ]
    assert 0.1 < np.mean(expected) < 0.9
    assert np.array_equal(found != CLEAR, expected)


whole = st.integers(-6, 6)
height = st.integers(0, 4)
places = st.tuples(whole, whole, height)


@pytest.mark.campaign
@given(
    st.lists(st.tuples(whole, whole, st.integers(1, 3), st.integers(1, 3), height), min_size=1),
    places,
    st.lists(st.tuples(places, st.integers(-1, 5), st.integers(-1, 5)), min_size=1, max_size=40),
)
@example([(-4, -6, 3, 2, 0), (0, 0, 1, 1, 3)], (0, 0, 3), [((0, 0, 3), 1, 1), ((5, 5, 3), 1, 1)])
@example([(1, 0, 1, 1, 2)] * 3, (0, 0, 2), [((3, 0, 2), 0, 0), ((3, 1, 1), 2, -1)])
def test_walls_and_lines_that_meet_in_whole_numbers(
    boxes: list[tuple[int, int, int, int, int]],
    place: tuple[int, int, int],
    lines: list[tuple[tuple[int, int, int], int, int]],
) -> None:
    """Along walls, through corners, level with roofs, straight up, from within, and to nowhere."""
    rings = [
        np.array([(x, y), (x + w, y), (x + w, y + d), (x, y + d)], dtype=float)
        for x, y, w, d, _ in boxes
    ]
    obstacles = prisms_around(rings, np.array([float(box[4]) for box in boxes]))
    ends_m, exempt = np.array([each[0] for each in lines], float), np.array([x[1:] for x in lines])
    check(obstacles, np.array(place, dtype=float), ends_m, exempt)


def square_town(count: int, apart_m: float, side_m: float) -> tuple[Prisms, Floats]:
    """Squares at random, as prisms and by points on their roofs."""
    draw = np.random.default_rng(1)
    reach_m = apart_m * np.sqrt(count)
    roofs_m = draw.uniform((0, 0, 30), (reach_m, reach_m, 100), (count, 3))
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) * side_m / 2
    return prisms_around([*(roofs_m[:, None, :2] + corners)], roofs_m[:, 2]), roofs_m


@pytest.mark.parametrize(("apart_m", "height_m", "most"), [(200, 50, 0.2), (30, 50, 0.01)])
def test_few_footprints_are_tried(
    apart_m: float, height_m: float, most: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Most blocked lines of 20 000 are guessed; those that are clear have few candidates.

    The verdicts are as if all lines had been followed over the map.
    """
    obstacles, roofs_m = square_town(20_000, apart_m, 10.0)
    place_m = np.array([roofs_m[:, 0].mean(), 0.0, height_m])
    start_m, own = np.broadcast_to(place_m, roofs_m.shape), np.arange(20_000)[:, None]
    found = crossed(obstacles, start_m, roofs_m, own)
    seen = horizon.view(obstacles, place_m)
    ways = horizon.lines_from(place_m, roofs_m, seen.bearings)
    _, likely = horizon.survey(seen, ways, obstacles, own)
    (clear,) = np.nonzero(found == CLEAR)
    tried = sum(len(line) for line, _ in horizon.candidates(seen, ways, clear))
    assert tried < most * len(roofs_m)
    blocked = found != CLEAR
    assert (likely[blocked] == found[blocked]).mean() > 0.95
    monkeypatch.setattr(sight, "MANY", math.inf)
    followed = crossed(obstacles, start_m, roofs_m, own)
    assert np.array_equal(found != CLEAR, followed != CLEAR)


def test_rows_from_several_places_and_single_lines_together(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each line has the verdict that it has alone, in whatever company it comes."""
    obstacles, roofs_m = square_town(6_000, 60.0, 10.0)
    places_m = np.array([(0.0, 0.0, 40.0), (2000.0, 1000.0, 120.0)])
    start_m = np.concatenate([np.repeat(places_m, 6_000, axis=0), roofs_m[:50]])
    end_m = np.concatenate([roofs_m, roofs_m, roofs_m[50:100]])
    own = np.concatenate([np.arange(6_000), np.arange(6_000), np.arange(50, 100)])
    exempt = np.column_stack([own, np.append(np.full(12_000, CLEAR), np.arange(50))])
    found = crossed(obstacles, start_m, end_m, exempt)
    monkeypatch.setattr(sight, "MANY", math.inf)
    followed = crossed(obstacles, start_m, end_m, exempt)
    assert np.array_equal(found != CLEAR, followed != CLEAR)
    assert 0.0 < (found == CLEAR).mean() < 1.0


def test_a_place_in_a_heap_of_footprints_is_no_special_case() -> None:
    """Forty towers around it; beyond so many every line is followed."""
    ring = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    rings = [ring * (k + 1) for k in range(40)]
    obstacles = prisms_around(rings, np.linspace(1.0, 40.0, 40))
    ends_m = np.random.default_rng(1).uniform((-60, -60, 0), (60, 60, 200), (500, 3))
    assert check(obstacles, np.array([0.0, 0.0, 39.5]), ends_m, np.full((500, 1), 39)) == 500

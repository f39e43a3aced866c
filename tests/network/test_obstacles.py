"""Straight lines and buildings, against an independent search along each line."""

from __future__ import annotations

import itertools
import math
import sys
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

import optuav
from optuav.mission import Mission
from optuav.network import obstacles as sight
from optuav.network.network import build_network
from optuav.network.obstacles import CLEAR, clear_lines, crossed
from optuav.network.places import HOVER
from optuav.network.prisms import prisms
from optuav.tables import Building

Point = tuple[float, float, float]
Ring = Sequence[tuple[float, float]]
L_SHAPE = ((0, 0), (20, 0), (20, 10), (10, 10), (10, 20), (0, 20))


def town(*buildings: tuple[Ring | tuple[float, float] | None, Point]) -> Mission:
    """The mission `paper` with these buildings: footprint and position; named 0, 1 and so on."""
    stated = [
        {"name": str(number), "position_m": place}
        | ({} if footprint is None else {"footprint_m": [*footprint]})
        for number, (footprint, place) in enumerate(buildings)
    ]
    return optuav.load("paper").replace({"buildings": stated})


def outline(building: Building) -> Ring:
    """Corners of a footprint, none of what has no footprint."""
    stated, (x, y, _) = building.footprint_m or (), building.position_m
    if not stated or isinstance(stated[0], tuple):
        return stated
    width, depth = stated
    west, east, south, north = x - width / 2, x + width / 2, y - depth / 2, y + depth / 2
    return ((west, south), (east, south), (east, north), (west, north))


def blocker(mission: Mission, start_m: Point, end_m: Point, exempt: int = CLEAR) -> int:
    """The building that the line from start to end crosses, the same both ways."""
    ends_m = np.array([[start_m, end_m], [end_m, start_m]], dtype=float)
    there, back = crossed(prisms(mission.buildings), ends_m[0], ends_m[1], np.full((2, 1), exempt))
    assert there == back
    return int(there)


def is_inside(ring: Ring, x: float, y: float) -> bool:
    """Even-odd rule: whether a ray to the east meets the ring an odd number of times."""
    odd = False
    for (x1, y1), (x2, y2) in zip(ring, (*ring[1:], ring[0]), strict=True):
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            odd = not odd
    return odd


def is_crossed(ring: Ring, roof_m: float, start_m: Sequence[float], end_m: Sequence[float]) -> bool:
    """Cut the line where it meets a wall or the roof, and look at the middle of every piece."""
    (x0, y0, z0), (x1, y1, z1) = start_m, end_m
    u, v, w = x1 - x0, y1 - y0, z1 - z0
    cuts = [0.0, 1.0]
    if w:
        cuts.append((roof_m - z0) / w)
    for (ax, ay), (bx, by) in zip(ring, (*ring[1:], ring[0]), strict=True):
        determinant = u * (by - ay) - v * (bx - ax)
        if determinant:
            cuts.append(((ax - x0) * (by - ay) - (ay - y0) * (bx - ax)) / determinant)
    inner = sorted(cut for cut in cuts if 0.0 <= cut <= 1.0)
    middles = [(low + high) / 2 for low, high in itertools.pairwise(inner) if high - low > 1e-9]
    return any(z0 + s * w < roof_m and is_inside(ring, x0 + s * u, y0 + s * v) for s in middles)


def star(rng: np.random.Generator, centre: Sequence[float], convex: bool) -> Ring:
    """A random polygon in which every corner sees the centre; on a circle if it is convex."""
    corners = int(rng.integers(3, 9))
    angles = (np.arange(corners) + rng.uniform(0.0, 0.4, corners)) * 2.0 * math.pi / corners
    radii = np.full(corners, 20.0) if convex else rng.uniform(3.0, 40.0, corners)
    offsets = zip((radii * np.cos(angles)).tolist(), (radii * np.sin(angles)).tolist(), strict=True)
    return [(centre[0] + x, centre[1] + y) for x, y in offsets]


@pytest.mark.parametrize("convex", [True, False])
@pytest.mark.parametrize(("count", "lines"), [(3, 200), (12, 200), (70, 250)])
def test_random_lines_among_random_buildings(count: int, lines: int, convex: bool) -> None:
    """A line is blocked if and only if the search finds a building, and by one that it finds.

    With 70 buildings the lines are tried in several pieces.
    """
    rng = np.random.default_rng(count)
    tops_m = rng.uniform((-100.0, -100.0, 5.0), (100.0, 100.0, 60.0), (count, 3)).tolist()
    rings = [star(rng, top_m, convex) for top_m in tops_m]
    mission = town(*zip(rings, map(tuple, tops_m), strict=True))
    start_m, end_m = rng.uniform((-120.0, -120.0, 0.0), (120.0, 120.0, 80.0), (2, lines, 3))
    start_m[: lines // 10, :2] = end_m[: lines // 10, :2]
    exempt = rng.integers(-1, count, (lines, 2))
    found = crossed(prisms(mission.buildings), start_m, end_m, exempt)
    expected = [
        {
            number
            for number, (ring, top_m) in enumerate(zip(rings, tops_m, strict=True))
            if number not in without and is_crossed(ring, top_m[2], low, high)
        }
        for low, high, without in zip(start_m.tolist(), end_m.tolist(), exempt, strict=True)
    ]
    assert any(expected)
    assert not all(expected)
    for number, crossings in zip(found, expected, strict=True):
        assert number in crossings if crossings else number == CLEAR


@given(st.data())
def test_a_line_through_a_point_deep_inside_is_blocked(data: st.DataObject) -> None:
    """Whatever the sizes: inside by a millimetre below the roof is crossing, outside is not."""
    size = st.floats(0.01, 1e4)
    width_m, depth_m, roof_m = data.draw(size), data.draw(size), data.draw(size)
    mission = town(((width_m, depth_m), (0.0, 0.0, roof_m)))
    share = st.floats(-0.4, 0.4)
    inside = np.array(
        [width_m * data.draw(share), depth_m * data.draw(share), roof_m * (0.5 + data.draw(share))]
    )
    direction = np.array([data.draw(st.floats(-1.0, 1.0)) for _ in range(3)])
    assume(np.hypot(*direction[:2]) > 1e-3)
    start, end = inside - 1e5 * direction, inside + 1e5 * direction
    assert blocker(mission, tuple(start), tuple(end)) == 0
    outwards = np.array([*direction[:2] / np.abs(direction[:2]).max(), 0.0])
    outside = inside + outwards * max(width_m, depth_m)
    assert blocker(mission, tuple(outside), tuple(outside + 1e5 * outwards)) == CLEAR


@pytest.mark.parametrize(
    ("footprint", "start_m", "end_m"),
    [
        pytest.param((20, 20), (-50, 10, 5), (50, 10, 5), id="along a wall"),
        pytest.param((20, 20), (10, 10, 0), (10, 10, 90), id="up an edge of the walls"),
        pytest.param((20, 20), (10, 0, 0), (10, 0, 90), id="up a wall"),
        pytest.param((20, 20), (0, 20, 5), (20, 0, 5), id="past a corner"),
        pytest.param((20, 20), (10, 10, 5), (50, 50, 5), id="from a corner"),
        pytest.param((20, 20), (-50, 0, 5), (-10, 0, 5), id="up to a wall"),
        pytest.param((20, 20), (-50, 0, 30), (50, 0, 30), id="level with the roof"),
        pytest.param((20, 20), (-50, 0, 70), (10, 0, 30), id="down to the edge of the roof"),
        pytest.param((20, 20), (-50, 0, 70), (50, 0, 10 / 3), id="over that edge"),
        pytest.param((20, 20), (0, 0, 30), (0, 0, 90), id="up from the roof"),
        pytest.param(
            ((-1, -3), (4, 2), (-9, 5)), (-6, -8, 5), (9, 7, 5), id="along a slanting wall"
        ),
        pytest.param(
            ((-0.1, -0.3), (0.4, 0.7), (-0.9, 0.5)),
            (-0.1 - 7 * 0.5, -0.3 - 7, 5),
            (-0.1 + 3.1 * 0.5, -0.3 + 3.1, 5),
            id="along a wall between places that floats do not meet",
        ),
    ],
)
def test_to_graze_is_not_to_cross(footprint: Ring, start_m: Point, end_m: Point) -> None:
    """A roof at 30 m around the origin, touched from outside."""
    assert blocker(town((footprint, (0, 0, 30))), start_m, end_m) == CLEAR


@pytest.mark.parametrize(
    ("start_m", "end_m"),
    [
        pytest.param((-50, 9.99, 5), (50, 9.99, 5), id="behind a wall"),
        pytest.param((9.99, 9.99, 0), (9.99, 9.99, 90), id="upright"),
        pytest.param((0, 0, 29.99), (0, 0, 90), id="out of the roof"),
        pytest.param((-50, 0, 29.99), (50, 0, 29.99), id="under the roof"),
        pytest.param((0, 19.98, 5), (19.98, 0, 5), id="round the wrong side of a corner"),
        pytest.param((-1, 2, 5), (1, -2, 5), id="indoors"),
        pytest.param((0, 0, 5), (0, 0, 5), id="a place indoors"),
        pytest.param((-50, 0, 70), (50, 0, 3.3), id="over the edge of the roof and in before it"),
    ],
)
def test_a_centimetre_inside_is_crossing(start_m: Point, end_m: Point) -> None:
    """The counterparts of grazing, 20 m by 20 m, roof at 30 m."""
    assert blocker(town(((20, 20), (0, 0, 30))), start_m, end_m) == 0


def test_a_line_over_one_wing_that_grazes_the_other_is_clear() -> None:
    """Above the roof where it is inside, below the roof only where it runs along a wall."""
    mission = town((L_SHAPE, (5, 5, 30)))
    assert blocker(mission, (10, -10, 60), (10, 30, 0)) == CLEAR
    assert blocker(mission, (9.99, -10, 60), (9.99, 30, 0)) == 0
    assert blocker(mission, (10, -10, 20), (10, 30, 0)) == 0
    assert blocker(mission, (15, 15, 0), (12, 30, 0)) == CLEAR, "in the notch"


def test_a_building_without_a_footprint_blocks_nothing() -> None:
    """It has a roof to rest on and no walls."""
    assert blocker(town((None, (0, 0, 30))), (-50, 0, 5), (50, 0, 5)) == CLEAR
    assert blocker(town(), (-50, 0, 5), (50, 0, 5)) == CLEAR
    numbered = town((None, (0, 0, 30)), ((20, 20), (100, 0, 30)))
    assert blocker(numbered, (-50, 0, 5), (150, 0, 5)) == 1


def test_nested_buildings_block_each_by_its_own_roof() -> None:
    """A tower of 90 m within a block of 30 m: exempting one leaves the other in the way."""
    mission = town(((60, 60), (0, 0, 30)), ((20, 20), (0, 0, 90)))
    assert blocker(mission, (-200, 0, 60), (200, 0, 60)) == 1
    assert blocker(mission, (-200, 20, 20), (200, 20, 20)) == 0
    assert blocker(mission, (-200, 0, 60), (200, 0, 60), exempt=1) == CLEAR
    assert blocker(mission, (-200, 0, 20), (200, 0, 20), exempt=1) == 0
    assert blocker(mission, (-200, 0, 20), (200, 0, 20), exempt=0) == 1


def test_a_clockwise_and_a_closed_outline_are_the_same_building() -> None:
    """The order of the corners and a repeated first corner mean nothing."""
    for ring in (L_SHAPE, L_SHAPE[::-1], (*L_SHAPE, L_SHAPE[0])):
        mission = town((ring, (5, 5, 30)))
        assert blocker(mission, (-50, 15, 5), (50, 15, 5)) == 0
        assert blocker(mission, (12, -50, 5), (12, 50, 5)) == 0
        assert blocker(mission, (15, 15, 5), (30, 15, 5)) == CLEAR


def test_a_size_is_centred_on_the_position() -> None:
    """Width along x, depth along y; polygons stay as stated, and what has neither has none."""
    solids = (None, (0, 0, 9)), (L_SHAPE, (5, 5, 30)), ((40, 10), (100, 200, 30))
    corners_m, count = town(*solids).buildings.outlines()
    assert count.tolist() == [0, 6, 4]
    box = ((80, 195), (120, 195), (120, 205), (80, 205))
    assert corners_m.tolist() == [[*corner] for corner in (*L_SHAPE, *box)]


def crowd(count: int, seed: int) -> Mission:
    """Buildings that overlap in a town of 2 km by 2 km."""
    rng = np.random.default_rng(seed)
    places_m = np.column_stack(
        [*rng.uniform((0, 0), (2000, 2400), (count, 2)).T, rng.uniform(10, 90, count)]
    )
    return town(*(((60.0, 40.0), tuple(place)) for place in places_m.tolist()))


def test_trying_lines_a_few_at_a_time_changes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The bound on memory cuts the work, not the answer."""
    mission = crowd(60, 1)
    at_once = build_network(mission)
    build_network.cache_clear()
    monkeypatch.setattr(sight, "MOST_PAIRS", 600)
    bit_by_bit = build_network(mission)
    assert np.array_equal(at_once.legs.crosses, bit_by_bit.legs.crosses)
    assert np.array_equal(at_once.places.laser_sight, bit_by_bit.places.laser_sight)


def test_legs_and_sight_of_a_crowded_town() -> None:
    """Every leg and every beam of 60 buildings as the search along it finds."""
    mission = crowd(60, 2)
    network = build_network(mission)
    where, table = network.places, network.legs
    solids = [(outline(each), each.position_m[2]) for each in mission.buildings]

    def in_the_way(start_m: Sequence[float], end_m: Sequence[float], without: set[int]) -> set[int]:
        return {
            number
            for number, (ring, roof_m) in enumerate(solids)
            if number not in without and is_crossed(ring, roof_m, start_m, end_m)
        }

    for leg, (start, end) in enumerate(zip(table.start, table.end, strict=True)):
        ends_m = tuple(where.position_m[start]), tuple(where.position_m[end])
        found = in_the_way(*ends_m, {int(start) - 3, int(end) - 3})
        assert table.crosses[leg] in (found or {CLEAR})
        assert table.flyable[leg] == (not found)
    assert mission.laser is not None
    for place, position_m in enumerate(where.position_m):
        beam = mission.laser.position_m, tuple(position_m)
        assert where.laser_sight[place] == (not in_the_way(*beam, {place - 3}))
    assert 0 < where.laser_sight.sum() < len(where.names)
    assert 0 < table.flyable.sum() < len(table.flyable)


def test_its_own_roof_never_blocks_a_place() -> None:
    """Rising steeply from the middle of a broad roof, the way crosses the own building only."""
    mission = town(((900, 900), (1000, 1000, 60)))
    network = build_network(mission)
    assert network.places.laser_sight[3]
    to_roof, roof_to_hover = network.legs.flyable[2:4]
    assert to_roof
    assert roof_to_hover
    assert not network.legs.flyable[0], "origin to hover passes through it"


def test_a_laser_within_a_footprint_is_in_the_dark() -> None:
    """It sees the roof that it stands under, which is exempt, and no other place."""
    mission = town(((100, 100), (1000, 0, 60)), ((40, 40), (50, 300, 60)))
    assert list(build_network(mission).places.laser_sight) == [False, False, False, True, False]
    on_the_roof = mission.replace({"laser.position_m": [1000, 0, 60]})
    assert build_network(on_the_roof).places.laser_sight[4]


@pytest.mark.parametrize(
    ("roof_m", "sees", "flies"), [(40.0, True, True), (50.0, True, True), (60.0, False, False)]
)
def test_hovering_over_on_or_in_a_building(roof_m: float, sees: bool, flies: bool) -> None:
    """The hover point lies at 50 m: over a lower roof, on one as high, within a higher building.

    Origin and destination are far and high, so that only the last metres can be blocked.
    """
    mission = town(((40, 40), (1000, 2501.015, roof_m))).replace(
        {
            "route.origin_m": [0, 2501, 100],
            "route.destination_m": [2000, 2501, 100],
            "route.hover_m": [1000, 2501, 50],
            "laser.position_m": [1000, 0, 100],
        }
    )
    network = build_network(mission)
    assert network.places.laser_sight[HOVER] == sees
    assert list(network.legs.flyable[:2]) == [flies, flies]
    assert network.legs.flyable[2:].all(), "the building itself is at an end of these"


def test_legs_through_buildings_are_allowed_on_request() -> None:
    """flight.through_buildings frees the legs; the laser stays in the dark."""
    mission = town(((200, 200), (500, 1250, 90)), ((2000, 10), (1000, 100, 90)))
    blocked = build_network(mission)
    through = build_network(mission.replace({"flight.through_buildings": True}))
    assert not blocked.legs.flyable[:2].any()
    assert through.legs.flyable.all()
    assert (through.legs.crosses == CLEAR).all()
    assert np.array_equal(blocked.places.laser_sight, through.places.laser_sight)
    assert not through.places.laser_sight[HOVER]


def test_what_is_out_of_reach_blocks_nothing() -> None:
    """A hover point that does not exist has no sight and legs that cross nothing."""
    mission = crowd(10, 3).replace({"limits.min_altitude_m": 600, "limits.max_altitude_m": 700})
    network = build_network(mission)
    where, table = network.places, network.legs
    assert not where.laser_sight[HOVER]
    assert not table.flyable[(table.start == HOVER) | (table.end == HOVER)].any()
    assert table.flyable[(table.start != HOVER) & (table.end != HOVER)].any()


def test_rectangles_need_no_geometry_library(monkeypatch: pytest.MonkeyPatch) -> None:
    """Walls along the axes are compared as numbers, and others too; what grazes is shapely's."""
    boxes = [(40, 10), ((-20, -5), (-20, 5), (20, 5), (20, -5))]
    triangle = ((-20, -5), (20, -5), (-20, 5), (-20, -5))
    boxed, other = ([town((each, (-15, 0, 30))) for each in some] for some in (boxes, [triangle]))
    monkeypatch.setitem(sys.modules, "shapely", None)
    for mission in boxed:
        assert blocker(mission, (-50, 0, 5), (50, 0, 5)) == 0
    assert blocker(other[0], (-50, 0, 5), (50, 0, 5)) == 0
    with pytest.raises(ImportError):
        blocker(other[0], (-60, 15, 5), (60, -15, 5))


def test_missions_share_the_prisms_of_equal_buildings() -> None:
    """In a large town they take longer to make than to compare."""
    mission = town(((40, 10), (100, 200, 30)), (None, (0, 0, 50)), (L_SHAPE, (5, 5, 20)))
    later = mission.replace({"limits.deadline_s": 900})
    assert prisms(mission.buildings) is prisms(later.buildings)


@pytest.mark.parametrize(
    ("key", "value"),
    [("0.footprint_m", [40, 11]), ("0.position_m", [101, 200, 30]), ("2.position_m", [5, 5, 21])],
)
def test_prisms_follow_footprints_and_roofs(key: str, value: object) -> None:
    """No other town's are taken for them."""
    mission = town(((40, 10), (100, 200, 30)), (None, (0, 0, 50)), (L_SHAPE, (5, 5, 20)))
    before, after = (
        prisms(mission.buildings),
        prisms(mission.replace({f"buildings.{key}": value}).buildings),
    )
    bounds_m = [shapely.bounds(each.polygons) for each in (before, after)]
    assert not np.array_equal(*bounds_m) or not np.array_equal(before.roof_m, after.roof_m)


@pytest.mark.parametrize("apart_m", [1.0, 1e-3, 1e-5, 2e-6, 0.0])
def test_ways_are_inside_as_geometry_says(apart_m: float) -> None:
    """Ways along walls, past corners and between random points, next to them and far away.

    Against shapely on the same footprints, the walls moved inwards.
    """
    draw = np.random.default_rng(7)
    rings: list[Ring] = [L_SHAPE, ((0, 0), (6, 0), (3, 9)), ((2, 0), (4, 2), (2, 4), (0, 2))]
    rings += [star(draw, (0, 0), False) for _ in range(5)]
    rings += [ring[::-1] for ring in rings]
    obstacles = prisms.__wrapped__(town(*((ring, (*ring[0], 9.0)) for ring in rings)).buildings)
    walls = [shapely.buffer(shapely.Polygon(r), -1e-6, join_style="mitre") for r in rings]
    number, ends = list[int](), list[object]()
    for k, ring in enumerate(rings):
        corners_m = np.array(ring, dtype=float)
        low_m, high_m = corners_m.min(axis=0) - 2, corners_m.max(axis=0) + 2
        for _ in range(160):
            one, two = corners_m[draw.integers(len(ring), size=2)]
            other = draw.uniform(low_m, high_m)
            way = [(one, two), (one, other), (other, draw.uniform(low_m, high_m))][draw.integers(3)]
            reach = draw.uniform(-1, 2, 2)[:, None] * (way[1] - way[0])
            ends.append(way[0] + reach + draw.choice([-apart_m, apart_m], 2))
            number.append(k)
    ends_m = np.stack(ends)
    found = sight._inside(obstacles, np.array(number), np.moveaxis(ends_m, 0, 2))
    expected = [
        walls[k].intersects(shapely.LineString(e)) for k, e in zip(number, ends_m, strict=True)
    ]
    assert np.array_equal(found, expected)
    assert 0.05 < found.mean() < 0.95


def test_polygons_are_made_when_they_are_asked_for() -> None:
    """And are the same, whatever was asked for before."""
    rng = np.random.default_rng(4)
    tops_m = rng.uniform(0, 500, (9, 3)).tolist()
    solids = [(star(rng, top_m, False), tuple(top_m)) for top_m in tops_m]
    buildings = town(*solids).buildings
    whole, apart = (prisms.__wrapped__(buildings) for _ in range(2))
    assert shapely.is_missing(apart.made).all()
    some = np.array([7, 2, 7])
    assert shapely.equals_exact(apart.inner(some), whole.polygons[some], 0.0).all()
    assert (~shapely.is_missing(apart.made)).nonzero()[0].tolist() == [2, 7]
    assert shapely.equals_exact(apart.polygons, whole.polygons, 0.0).all()


def test_prisms_know_the_numbers_of_their_buildings() -> None:
    """Also where the same ones stand elsewhere in the list."""
    solids = [((40, 10), (100, 200, 30)), (L_SHAPE, (5, 5, 20))]
    assert prisms(town(*solids).buildings).building.tolist() == [0, 1]
    assert prisms(town((None, (0, 0, 50)), *solids).buildings).building.tolist() == [1, 2]


# Many lines between places that move


def test_lines_that_move_are_clear_where_each_of_them_is() -> None:
    """Against the test of single lines, with thousands of lines through the town."""
    mission = optuav.load("matrice350")
    obstacles = prisms(mission.buildings)
    draw = np.random.default_rng(2)
    start_m = draw.uniform([300, 100, 5], [500, 700, 40], (2000, 1, 3))
    end_m = np.broadcast_to([900.0, 300.0, 10.0], start_m.shape).copy()
    end_m[::3, 0, 2] = 60.0
    end_m[5] = np.nan
    exempt = np.array([[11]])
    between = np.array([[0, 1]])
    free = clear_lines(obstacles, np.concatenate([start_m, end_m], axis=1), between, exempt)
    every = np.tile(exempt, (2000, 1))
    known = np.delete(np.arange(2000), 5)
    alone = crossed(obstacles, start_m[known, 0], end_m[known, 0], every[known]) == CLEAR
    assert (free[known, 0] == alone).all()
    assert not free[5, 0]
    assert 0.1 < free.mean() < 0.9


def test_a_line_that_stays_is_judged_once_for_all() -> None:
    """From the laser to b12, which b4 hides, and to b4."""
    mission = optuav.load("matrice350")
    lamp, hidden, seen = (
        np.array(place)
        for place in (
            mission.laser.position_m if mission.laser else (),
            mission.buildings[11].position_m,
            mission.buildings[3].position_m,
        )
    )
    place_m = np.broadcast_to(np.stack([lamp, hidden, seen]), (50, 3, 3))
    lines = np.array([[0, 1], [0, 2]])
    free = clear_lines(prisms(mission.buildings), place_m, lines, np.array([[11], [3]]))
    assert (free == [False, True]).all()


@pytest.mark.parametrize("seed", range(2))
def test_lines_of_variants_are_judged_as_single_lines(seed: int) -> None:
    """Through a square, an L and a sliver, beside and over them, from outside and from within."""
    corner = ((0.0, 0.0), (60.0, 0.0), (60.0, 20.0), (20.0, 20.0), (20.0, 60.0), (0.0, 60.0))
    town = [
        {"name": "square", "position_m": (100.0, 0.0, 30.0), "footprint_m": (40.0, 40.0)},
        {"name": "L", "position_m": (10.0, 10.0, 20.0), "footprint_m": corner},
        {"name": "sliver", "position_m": (-60.0, 0.0, 50.0), "footprint_m": (3.0, 90.0)},
    ]
    obstacles = prisms(optuav.load("matrice350").replace({"buildings": town}).buildings)
    draw = np.random.default_rng(seed)
    count, judged = 1500, []
    for _ in range(25):
        middle_m = draw.uniform([-120, -80, 0], [180, 120, 60], (2, 3))
        reach_m = draw.choice([0.0, 1.0, 10.0, 40.0], (2, 3))
        place_m = middle_m + reach_m * draw.uniform(-1.0, 1.0, (count, 2, 3))
        place_m[:, :, 2] = np.maximum(place_m[:, :, 2], 0.0)
        free = clear_lines(obstacles, place_m, np.array([[0, 1]]), np.array([[-1]]))[:, 0]
        exempt = np.full((count, 1), -1)
        alone = crossed(obstacles, place_m[:, 0], place_m[:, 1], exempt) == CLEAR
        assert (free == alone).all()
        judged.append(free.mean())
    assert min(judged) == 0.0
    assert max(judged) == 1.0
    assert any(0.0 < share < 1.0 for share in judged)


def test_a_line_that_the_first_variant_lacks_is_judged_in_the_next() -> None:
    """One and the same blocked line in all variants but the first, where an end is not known."""
    mission = optuav.load("matrice350")
    wall = [{"name": "wall", "position_m": (50.0, 0.0, 30.0), "footprint_m": (4.0, 40.0)}]
    obstacles = prisms(mission.replace({"buildings": wall}).buildings)
    place_m = np.tile([[[0.0, 0.0, 10.0], [100.0, 0.0, 10.0]]], (3, 1, 1))
    place_m[0, 1] = np.nan
    free = clear_lines(obstacles, place_m, np.array([[0, 1]]), np.array([[-1]]))
    assert not free.any()


@given(st.data())
def test_lines_in_many_variants_are_judged_as_one_by_one(data: st.DataObject) -> None:
    """In random towns of fewer and of more buildings than variants; ends recur or are not known."""
    draw = np.random.default_rng(data.draw(st.integers(0, 2**32 - 1)))
    buildings, variants = data.draw(st.integers(1, 60)), data.draw(st.integers(1, 30))
    tops_m = draw.uniform([0, 0, 10], [200, 200, 60], (buildings, 3)).tolist()
    sides_m = draw.uniform(2, 30, (buildings, 2)).tolist()
    obstacles = prisms(town(*zip(map(tuple, sides_m), map(tuple, tops_m), strict=True)).buildings)
    place_m = draw.uniform([0, 0, 0], [200, 200, 80], (5, 3))
    position_m = np.tile(place_m, (variants, 1, 1))
    spread_m = data.draw(st.sampled_from([1.0, 100.0]))
    for moved in range(data.draw(st.integers(0, 3))):
        few_m = place_m[moved] + draw.uniform(-spread_m, spread_m, (3, 3)) * [1.0, 1.0, 0.1]
        few_m[2] = data.draw(st.sampled_from([few_m[2].tolist(), [math.nan] * 3]))
        position_m[:, moved] = few_m[draw.integers(0, 3, variants)]
    lines = np.array([*itertools.combinations(range(5), 2)])
    exempt = draw.integers(CLEAR, buildings, (len(lines), 2))
    free = clear_lines(obstacles, position_m, lines, exempt)
    alike = clear_lines(obstacles, position_m, lines, np.tile(exempt, (variants, 1, 1)))
    assert np.array_equal(free, alike)
    for places_m, row in zip(position_m, free, strict=True):
        known = np.isfinite(places_m[lines]).all(axis=(1, 2))
        start_m, end_m = np.moveaxis(places_m[lines[known]], 1, 0)
        assert not row[~known].any()
        assert np.array_equal(
            row[known], crossed(obstacles, start_m, end_m, exempt[known]) == CLEAR
        )


def test_the_same_line_is_tried_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lamp at three places and a hover point at two: of 12 variants by 3 lines 3 + 2 + 6."""
    walls = [((4.0, 40.0), (50.0 + 10.0 * k, 0.0, 30.0)) for k in range(20)]
    obstacles, tried = prisms(town(*walls).buildings), list[int]()
    place_m = np.tile([[0.0, 0.0, 10.0], [90.0, 60.0, 50.0], [300.0, 0.0, 20.0]], (12, 1, 1))
    place_m[:, 0, 1] += np.arange(12) % 3
    place_m[:, 1, 0] += np.arange(12) // 3 % 2

    def counted(*each: object) -> object:
        tried.append(len(each[1]))  # type: ignore[arg-type]
        return crossed(*each)  # type: ignore[arg-type]

    monkeypatch.setattr(sight, "crossed", counted)
    lines = np.array([[0, 2], [1, 2], [0, 1]])
    free = clear_lines(obstacles, place_m, lines, np.full((3, 1), CLEAR))
    assert tried == [11]
    assert np.array_equal(free[:6], free[6:])

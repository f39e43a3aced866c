"""Bent ways: against a grid of apexes, another visibility graph, and distances by shapely."""

from __future__ import annotations

import itertools
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx
import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.network import ways
from optuav.network.network import build_network
from tests.examples import few

PAPER = optuav.load("paper")
OVER, AROUND = {"flight.obstacles": "over"}, {"flight.obstacles": "around"}
START_M, END_M = (0.0, 0.0, 30.0), (400.0, 100.0, 60.0)


def town(*boxes: tuple[float, float, float, float, float]) -> list[dict[str, Any]]:
    """Buildings by x, y, height, width and depth [m]."""
    return [
        {"name": f"h{k}", "position_m": [x, y, z], "footprint_m": [width, depth]}
        for k, (x, y, z, width, depth) in enumerate(boxes)
    ]


def mission(buildings: list[dict[str, Any]], **flight: Any) -> Mission:
    """From START_M to hover at END_M."""
    place = {"route.origin_m": START_M, "route.hover_m": END_M, "link.device_m": (400, 100, 0)}
    keys = {f"flight.{key}": value for key, value in flight.items()}
    height = {"limits.min_altitude_m": 1, "limits.max_altitude_m": 500}
    return PAPER.replace({"buildings": buildings, **place, **height, **keys})


def way_m(of: Mission) -> np.ndarray[Any, Any] | None:
    """Points of the way from the origin to the hover point [m]; None where there is none."""
    legs, at_m = build_network(of).legs, build_network(of).places.position_m
    by_m = legs.waypoints_m[..., 0]
    points_m = np.array([at_m[0], *by_m[~np.isnan(by_m[:, 0])], at_m[1]])
    return points_m if legs.flyable[0] else None


def length_m(points_m: Any) -> float:
    return sum(math.dist(*ends) for ends in itertools.pairwise(points_m))


def is_clear(points_m: Any, buildings: list[dict[str, Any]], clearance_m: float) -> bool:
    """Whether points all along a way are away from prisms, above or beside (Euclidean)."""
    at_m = np.concatenate([np.linspace(*ends, 400) for ends in itertools.pairwise(points_m)])
    for house in buildings:
        (x, y, roof_m), (width, depth) = house["position_m"], house["footprint_m"]
        box = shapely.box(x - width / 2, y - depth / 2, x + width / 2, y + depth / 2)
        ends = shapely.points(np.array(points_m)[[0, -1], :2])
        # An end beside a wall sees the outline.
        at_end = shapely.intersects(box.buffer(clearance_m, join_style="mitre"), ends).any()
        beside_m = shapely.distance(box, shapely.points(at_m[:, :2]))
        wide = beside_m <= 0.0 if at_end else beside_m < clearance_m - 1e-5
        low_m = at_m[:, 2] - roof_m
        if (wide & (low_m < clearance_m - 1e-5)).any():
            return False
    return True


def grid_m(buildings: list[dict[str, Any]], clearance_m: float, ceiling_m: float) -> float:
    """Length of the shortest way by one apex of a fine grid above the straight way [m]."""
    start, end, best_m = np.array(START_M), np.array(END_M), np.inf
    hurdles = list[tuple[float, float]]()
    line = shapely.LineString([start[:2], end[:2]])
    for house in buildings:
        (x, y, roof_m), (width, depth) = house["position_m"], house["footprint_m"]
        half = width / 2 + clearance_m, depth / 2 + clearance_m
        wall = shapely.box(x - half[0], y - half[1], x + half[0], y + half[1])
        common = shapely.intersection(line, wall)
        for point in shapely.get_coordinates(common):
            hurdles.append((math.dist(point, start[:2]), roof_m + clearance_m))
    level_m = math.dist(start[:2], end[:2])
    for s in np.linspace(0.0, level_m, 4001)[1:-1]:
        z = -np.inf
        for at_m, top_m in hurdles:
            share = at_m / s if at_m <= s else (level_m - at_m) / (level_m - s)
            low = start[2] if at_m <= s else end[2]
            z = max(z, low + (top_m - low) / share)
        if z <= ceiling_m:
            best_m = min(best_m, math.hypot(s, z - start[2]) + math.hypot(level_m - s, z - end[2]))
    return best_m


BOXES = st.tuples(
    *(
        st.floats(60, 340),
        st.floats(-20, 120),
        st.floats(5, 150),
        st.floats(5, 60),
        st.floats(5, 60),
    )
)


# At 300 m a roof of 53 m; the best apex stands well before it, where the way meets the ceiling.
BELOW_THE_END = [(291.0, 72.8, 53.0, 5.0, 5.0)], 0.0, 45.0


@few(25)
@given(st.lists(BOXES, min_size=1, max_size=4), st.floats(0, 12), st.floats(20, 250))
@example(*BELOW_THE_END)
@example([(100.0, 20.0, 40.0, 5.0, 5.0), (200.0, 50.0, 45.0, 5.0, 5.0)], 5.0, 45.0)
def test_the_apex_is_that_of_a_fine_grid(boxes: Any, clearance_m: float, ceiling_m: float) -> None:
    """No apex of a grid gives a shorter way, and a way is found where the grid has one.

    The ceiling may be below the ends of the way.
    """
    buildings = town(*boxes)
    walls = (
        shapely.box(x - w / 2, y - d / 2, x + w / 2, y + d / 2).buffer(clearance_m + 1.0)
        for x, y, _, w, d in boxes
    )
    ends = shapely.MultiPoint([START_M[:2], END_M[:2]])
    assume(not any(wall.intersects(ends) for wall in walls))
    limits = {"clearance_m": clearance_m, "max_altitude_m": ceiling_m}
    own = way_m(mission(buildings, obstacles="over", **limits))
    shortest_m = grid_m(buildings, clearance_m, ceiling_m)
    if own is None:
        assert shortest_m == np.inf
    elif len(own) > 2:
        assert length_m(own) <= shortest_m + 1e-9
        assert length_m(own) >= shortest_m - 0.2 or shortest_m == np.inf
        assert own[1:-1, 2].max() <= ceiling_m
        assert is_clear(own, buildings, clearance_m)


def test_a_ceiling_below_an_end_leaves_the_apexes_before_it() -> None:
    """Corners are higher than the ceiling, yet one apex fits: the ceiling itself is tried."""
    (box,), clearance_m, ceiling_m = BELOW_THE_END
    limits = {"clearance_m": clearance_m, "max_altitude_m": ceiling_m}
    own = way_m(mission(town(box), obstacles="over", **limits))
    assert own is not None
    assert own[1][2] == ceiling_m


def around_m(buildings: list[dict[str, Any]], clearance_m: float) -> float:
    """Length over ground of the shortest way around all boxes, by a whole visibility graph [m]."""
    low_m = min(START_M[2], END_M[2])
    walls = []
    for house in buildings:
        (x, y, roof_m), (width, depth) = house["position_m"], house["footprint_m"]
        half = width / 2 + clearance_m, depth / 2 + clearance_m
        if roof_m + clearance_m > low_m:
            walls.append(shapely.box(x - half[0], y - half[1], x + half[0], y + half[1]))
    corners = [corner for wall in walls for corner in wall.exterior.coords[:-1]]
    inner = [wall.buffer(-1e-5, join_style="mitre") for wall in walls]
    graph = networkx.Graph()
    for a, b in itertools.combinations([START_M[:2], END_M[:2], *corners], 2):
        if not any(wall.intersects(shapely.LineString([a, b])) for wall in inner):
            graph.add_edge(a, b, weight=math.dist(a, b))
    ends = START_M[:2], END_M[:2]
    if not graph.has_node(ends[0]) or not graph.has_node(ends[1]):
        return math.inf
    try:
        return float(networkx.shortest_path_length(graph, *ends, weight="weight"))
    except networkx.NetworkXNoPath:
        return math.inf


@few(25)
@given(st.lists(BOXES, min_size=1, max_size=5), st.floats(0, 12))
def test_the_way_around_is_that_of_a_whole_visibility_graph(boxes: Any, apart_m: float) -> None:
    """With no room above: as short as in the graph of all corners, and clear of all prisms."""
    buildings = town(*boxes)
    walls = (
        shapely.box(x - w / 2, y - d / 2, x + w / 2, y + d / 2).buffer(apart_m + 1.0, join_style=2)
        for x, y, _, w, d in boxes
    )
    ends = shapely.MultiPoint([START_M[:2], END_M[:2]])
    assume(not any(wall.intersects(ends) for wall in walls))
    own = way_m(mission(buildings, obstacles="around", clearance_m=apart_m, max_altitude_m=60.0))
    shortest_m = around_m(buildings, apart_m)
    if own is None:
        assert shortest_m == math.inf
    elif len(own) > 2 and (np.ptp(own @ [100.0, -400.0, 0.0]) > 1e-3):
        assert length_m(own[:, :2]) == pytest.approx(shortest_m, rel=1e-6)
        assert is_clear(own, buildings, apart_m)


WALL = {"name": "wall", "position_m": [500, 1250, 200], "footprint_m": [800, 60]}
BACK = {"name": "back", "position_m": [1500, 1400, 120], "footprint_m": [300, 200]}


def blocked(name: str) -> Mission:
    """A shipped mission with walls in the way from the origin and to the destination."""
    own = optuav.load(name)
    start_m, end_m = own.route.origin_m, build_network(own).places.position_m[1]
    x, y = (0.5 * (a + b) for a, b in zip(start_m[:2], end_m[:2], strict=True))
    wall = {"name": "wall", "position_m": [x, y, 200], "footprint_m": [90, 60]}
    return own.replace({"buildings": [wall]})


WALLED = PAPER.replace({"buildings": [*PAPER.to_dict()["buildings"], WALL, BACK]})


def test_there_and_back_take_the_same_way() -> None:
    """Also around, where a wind makes the charges of both directions differ."""
    for rule in (OVER, AROUND):
        legs = build_network(WALLED.replace({**rule, "wind.force_N": [3, 1, 0]})).legs
        bent_m = {
            (int(start), int(end)): way[~np.isnan(way[:, 0])]
            for start, end, way in zip(
                legs.start, legs.end, np.moveaxis(legs.waypoints_m, -1, 0), strict=True
            )
        }
        pairs = [(at, at[::-1]) for at in bent_m if at[::-1] in bent_m and len(bent_m[at])]
        assert pairs
        for there, back in pairs:
            assert np.array_equal(bent_m[there], bent_m[back][::-1])


@pytest.mark.parametrize("name", ["paper", "paper-drag", "matrice350"])
def test_a_bent_leg_is_flown_segment_by_segment(name: str) -> None:
    """Its figures are those of legs from rest to rest, and the replay is at their ends in time."""
    mission = blocked(name).replace(OVER)
    plan = optuav.solve(mission, "P3")
    leg, at_m = plan.phases[0], build_network(mission).places.position_m
    points_m = np.array([at_m[0], *leg.waypoints_m, at_m[1]])
    parts = [mission.flight_model.leg(tuple(way)) for way in np.diff(points_m, axis=0).tolist()]
    assert len(parts) == 2
    assert leg.duration_s == pytest.approx(sum(float(x.duration_s) for x in parts), rel=1e-12)
    assert -leg.charge_As == pytest.approx(sum(float(x.charge_As) for x in parts), rel=1e-12)
    assert -leg.energy_J == pytest.approx(sum(float(x.energy_J) for x in parts), rel=1e-12)
    assert leg.distance_m == pytest.approx(length_m(points_m), rel=1e-12)
    assert leg.peak_speed_m_s == max(float(x.peak_speed_m_s) for x in parts)
    trace = optuav.replay(plan).trace
    own = trace.phase == 0
    time_s, position_m = trace.time_s[own], trace.position_m[own]
    at_apex = np.abs(time_s - float(parts[0].duration_s)).argmin()
    for number, point_m in ((0, points_m[0]), (at_apex, points_m[1]), (-1, points_m[2])):
        assert position_m[number] == pytest.approx(point_m, abs=1e-6)
        assert trace.speed_m_s[own][number] == pytest.approx(0.0, abs=1e-6)
    way = shapely.LineString(points_m[:, :2])
    assert max(shapely.distance(way, shapely.points(position_m[:, :2]))) < 1e-6
    # The speed is the rate at which the position changes.
    steps_m = np.linalg.norm(np.diff(position_m, axis=0), axis=1)
    speeds_m_s = 0.5 * (trace.speed_m_s[own][1:] + trace.speed_m_s[own][:-1])
    assert steps_m == pytest.approx(speeds_m_s * np.diff(time_s), abs=0.05 * steps_m.max())


@pytest.mark.parametrize("rule", ["over", "around"])
def test_a_batch_is_a_loop_of_solves(rule: str) -> None:
    """Over hover points, clearances, heights and masses, each variant with ways of its own."""
    mission = WALLED.replace({"flight.obstacles": rule, "flight.max_altitude_m": 260})
    mission = mission.replace({"flight.clearance_m": 5, "route.hover_m": [1000, 2600, 60]})
    columns = {
        "flight.clearance_m": [0.0, 5.0, 20.0, 70.0],
        "flight.max_altitude_m": [260.0, 200.0, 400.0, 260.0],
        "body.mass_kg": [1.0, 1.1, 0.9, 1.2],
        "route.hover_m[0]": [1000.0, 1010.0, 900.0, 1000.0],
    }
    asked: dict[str, Any] = {"problem": "P1", "perspective": "battery"}
    together = optuav.batch_arrays(mission, columns, paired=True, **asked)
    plans = []
    for k in range(4):
        values = {key: own[k] for key, own in columns.items() if "[" not in key}
        values["route.hover_m"] = [columns["route.hover_m[0]"][k], 2600, 60]
        plans.append(optuav.solve(mission.replace(values), **asked))
    hover_s = [plan.hover_time_s if plan else math.nan for plan in plans]
    assert together["hover_time_s"] == pytest.approx(hover_s, abs=1e-6, nan_ok=True)
    assert any(phase.waypoints_m for plan in plans for phase in plan.phases)


@pytest.mark.parametrize("perspective", ["available", "wells", "battery"])
def test_routes_of_bent_and_straight_legs_compete(perspective: Any) -> None:
    """Of all routes the best is flyable, its moments have words, and no straight route is lost."""
    over = PAPER.replace({**OVER, "buildings": [*PAPER.buildings, WALL]})
    plan, straight = (
        optuav.solve(each, perspective=perspective)
        for each in (over, over.replace({"flight.obstacles": "refuse"}))
    )
    assert plan.binding
    assert not [e for e in optuav.replay(plan).violations if e.kind in ("building", "mismatch")]
    assert not straight or plan.hover_time_s >= straight.hover_time_s - 1e-6


def test_layouts_are_solved_as_each_of_them_alone() -> None:
    """Past towns of their own, the ways of a batch are those of single missions."""
    towns = [each.replace(OVER) for each in optuav.layouts("paper", 6, size_m=200.0, seed=4)]
    together = optuav.batch_arrays(towns, problem="P3", perspective="battery")
    alone = [optuav.solve(each, "P3", perspective="battery") for each in towns]
    assert together["hover_time_s"] == pytest.approx([x.hover_time_s for x in alone], abs=1e-6)
    assert any(phase.waypoints_m for plan in alone for phase in plan.phases)


def test_the_audit_catches_what_a_bent_way_may_break() -> None:
    """A waypoint moved into the clearance, one above the cap, and a way that is left out."""
    mission = WALLED.replace({**OVER, "flight.max_altitude_m": 230})
    plan = optuav.solve(mission, "P3")
    itinerary = optuav.Itinerary(mission, plan.stops)
    assert optuav.replay(plan).flyable
    assert optuav.replay(itinerary).mission_time_s == pytest.approx(plan.mission_time_s, rel=1e-9)
    leg, *others = plan.phases
    ((x, y, z),) = leg.waypoints_m
    for waypoints_m, kinds in (
        (((x, y, z - 2.0),), {"clearance"}),
        (((x, y, 231.0),), {"altitude"}),
        (((x, y, 199.0),), {"clearance"}),
        (((120.0, 1250.0, 100.0),), {"clearance"}),
        ((), {"building"}),
    ):
        moved = plan.model_copy(
            update={"phases": (replace(leg, waypoints_m=waypoints_m), *others), "flyable": None}
        )
        kinds_found = {event.kind for event in optuav.audit(moved).violations}
        assert kinds <= kinds_found <= kinds | {"mismatch", "empty", "state of charge"}
    (event,) = (
        each
        for each in optuav.audit(moved_to(plan, (x, y, z - 2.0))).violations
        if each.kind == "clearance"
    )
    assert event.limit == 5.0
    assert 3.0 < event.value < 5.0


def moved_to(plan: optuav.Plan, point_m: tuple[float, float, float]) -> optuav.Plan:
    leg, *others = plan.phases
    phases = (replace(leg, waypoints_m=(point_m,)), *others)
    return plan.model_copy(update={"phases": phases, "flyable": None})


def test_waypoints_stand_in_the_file(tmp_path: Path) -> None:
    """The round trip is exact; without bent ways a file does not speak of them."""
    plan = optuav.solve(WALLED.replace(OVER), "P3")
    assert optuav.load_plan(plan.save(tmp_path / "plan.json")) == plan
    assert "waypoints_m" in plan.to_dict()["phases"][0]
    assert "waypoints_m" not in plan.to_dict()["phases"][1]
    data = plan.to_dict()
    data["phases"][1]["waypoints_m"] = [[0, 0, 0]]
    (tmp_path / "hover.json").write_text(json.dumps(data))
    with pytest.raises(InputError, match="a hover has no waypoints_m"):
        optuav.load_plan(tmp_path / "hover.json")


def test_an_export_goes_by_the_waypoints(tmp_path: Path) -> None:
    """The first leg of a map in GeoJSON has its apex, at its height over z = 0."""
    place = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4, "earth.altitude_m": 30.0}
    plan = optuav.solve(WALLED.replace({**OVER, **place}), "P3")
    (file,) = plan.export(tmp_path / "plan.geojson")
    features = json.loads(file.read_text("utf-8"))["features"]
    line, altitudes_m = next(
        (x["geometry"], x["properties"]["altitudes_m"])
        for x in features
        if x["geometry"]["type"] == "LineString"
    )
    ((x, y, z),) = plan.phases[0].waypoints_m
    assert len(line["coordinates"]) == 3
    longitude, latitude, *_ = line["coordinates"][1]
    assert altitudes_m[1] == pytest.approx(z + 30.0, abs=1e-5)
    assert latitude == pytest.approx(52.5 + y / 111_270.0, abs=1e-4)
    assert longitude == pytest.approx(
        13.4 + x / (111_320.0 * math.cos(math.radians(52.5))), abs=1e-4
    )


@pytest.mark.parametrize(
    ("flight", "words"),
    [
        ({"obstacles": "under"}, 'one of "refuse", "ignore", "over", "around"'),
        ({"obstacles": "over", "through_buildings": True}, "either obstacles or through_buildings"),
        ({"clearance_m": 5}, 'clearance_m.*goes with obstacles = "over" or "around" only'),
        ({"obstacles": "ignore", "max_altitude_m": 90}, 'goes with obstacles = "over"'),
        ({"obstacles": "over", "clearance_m": -1}, "a number, 0 <= x <= 1000"),
        ({"obstacles": "around", "max_altitude_m": "high"}, "a number, 0 <= x <= 1e6"),
    ],
)
def test_broken_input_gets_one_error(flight: dict[str, Any], words: str) -> None:
    document = PAPER.to_dict()
    del document["flight"]["through_buildings"]
    document["flight"] |= flight
    with pytest.raises(InputError, match=words) as caught:
        Mission.from_dict(document)
    assert len(caught.value.faults) == 1


def test_the_old_key_and_the_new_one_displace_each_other() -> None:
    """`through_buildings` stays accepted: true means "ignore", false "refuse"."""
    over = PAPER.replace({**OVER, "flight.clearance_m": 8})
    assert over.flight.through_buildings is None
    for switch, rule in ((True, "ignore"), (False, "refuse")):
        old = over.replace({"flight.through_buildings": switch})
        assert (old.flight.obstacle_rule, old.flight.obstacles) == (rule, None)
        assert old.flight.clearance_m is None
    assert over.replace(AROUND).flight.clearance_m == 8
    assert over.replace({"flight.obstacles": "ignore"}).flight.clearance_m is None


def test_no_way_at_all_names_the_building_that_closes_it() -> None:
    """Under a low cap the wall closes the leg, with the keys that decide."""
    low = WALLED.replace({**OVER, "flight.max_altitude_m": 150})
    (reason,) = optuav.solve(low, "P3").reasons
    assert reason.startswith(
        "the leg origin → hover is blocked by building wall (no way over it keeps"
    )
    assert "flight.max_altitude_m = 150 m" in reason
    upright = mission(town((400, 100, 50, 20, 20)), obstacles="over")
    upright = upright.replace({"route.origin_m": [400, 100, 10]})
    (reason,) = optuav.solve(upright, "P3").reasons
    assert "origin lies inside building h0" in reason


def test_without_a_stated_ceiling_no_apex_stands_in_space() -> None:
    """From the foot of one wall to the foot of another: no way over them, but one around."""
    feet = town((-5, 0, 90, 10, 40), (405, 100, 90, 10, 40), (200, 50, 90, 10, 10))
    inward = {"route.origin_m": [-10, 0, 30], "route.hover_m": [410, 100, 60]}
    over = mission(feet, obstacles="over").replace({**inward, "link.device_m": [410, 100, 0]})
    (reason,) = optuav.solve(over.replace({"route.destination_m": [410, 100, 60]}), "P3").reasons
    assert "flight.max_altitude_m = 10000 m" in reason
    assert way_m(over.replace(AROUND)) is not None


# Ends on roofs and walls: solver and judge must agree

WHERE = st.tuples(st.integers(0, 3), st.sampled_from(["roof", "wall", "corner", "open"]))
HEIGHTS = st.sampled_from([0.0, 1.0, 10.0, "half", "roof", "grazing", "above", "high"])
BLOCKS = st.tuples(
    *(st.integers(0, 40), st.integers(0, 40), st.integers(1, 14)),
    *(st.integers(1, 8), st.integers(1, 8)),
)


@st.composite
def end_m(draw: st.DrawFn, blocks: Any) -> list[float]:
    """A place on, above or beside a building, or anywhere."""
    number, where = draw(WHERE)
    x, y, roof_m, width, depth = (10.0 * side for side in blocks[number % len(blocks)])
    named = {"half": roof_m / 2, "roof": roof_m, "grazing": roof_m + 1e-7, "above": roof_m + 3}
    z = named.get(height := draw(HEIGHTS), 120.0 if height == "high" else height)
    share = draw(st.floats(-0.5, 0.5))
    if where == "open":
        return [10.0 * draw(st.integers(0, 40)), 10.0 * draw(st.integers(0, 40)), z]
    side = draw(st.sampled_from([-0.5, 0.5]))
    across = {"roof": share, "wall": side, "corner": side}[where]
    return [x + across * width, y + (side if where == "corner" else share) * depth, z]


@st.composite
def crowded(draw: st.DrawFn) -> dict[str, Any]:
    """Values by key: a few buildings, and ends on their roofs and walls."""
    blocks = draw(st.lists(BLOCKS, min_size=1, max_size=4))
    ends = {f"route.{name}_m": draw(end_m(blocks)) for name in ("origin", "hover", "destination")}
    x, y, _ = ends["route.hover_m"]
    return {
        "buildings": town(*([10.0 * side for side in block] for block in blocks)),
        **ends,
        "link.device_m": [x, y, 0],
        "flight.obstacles": draw(st.sampled_from(["over", "around"])),
        "flight.clearance_m": draw(st.sampled_from([0.0, 1e-7, 5.0, 12.0])),
        "flight.max_altitude_m": draw(st.sampled_from([None, 60.0, 160.0])),
    }


PLENTY = {
    "limits.min_altitude_m": 0,
    "limits.max_altitude_m": 1000,
    "limits.deadline_s": 1e6,
    "battery.capacity_As": 1e8,
}
LOW_M, ROOF_M = [200, 0, 1], [0, 0, 60]
ON_A_ROOF = {  # From the roof of h0 a way over h1 leads down past the edge of h0
    "buildings": town((0, 0, 60, 40, 40), (185, 0, 20, 10, 40)),
    "route.origin_m": ROOF_M,
    "route.hover_m": LOW_M,
    "route.destination_m": LOW_M,
    "link.device_m": LOW_M,
    **OVER,
}
ALONG_A_WALL = {  # The way over h1 grazes a wall of h0
    "buildings": town((100, 0, 100, 20, 40), (160, 20, 100, 60, 10)),
    "route.origin_m": [0, 20, 10],
    "route.hover_m": [300, 20, 60],
    "route.destination_m": [300, 20, 60],
    "link.device_m": [300, 20, 0],
    "flight.clearance_m": 0.0,
    **OVER,
}


@few(30)
@given(crowded())
@example(ON_A_ROOF)
@example({**ON_A_ROOF, "route.origin_m": LOW_M, "route.hover_m": ROOF_M, "link.device_m": ROOF_M})
@example({**ON_A_ROOF, "route.origin_m": LOW_M, "route.destination_m": ROOF_M})
@example({**ON_A_ROOF, "flight.clearance_m": 1e-7, "route.origin_m": [0, 0, 60.0000001]})
@example(ALONG_A_WALL)
@example({**ALONG_A_WALL, "flight.clearance_m": 1e-7})
def test_the_judge_flies_every_way_that_the_solver_finds(values: dict[str, Any]) -> None:
    """Also from, above and beside roofs and walls, and along a wall."""
    crowd = PAPER.replace({**PLENTY, **values})
    plan = optuav.solve(crowd, "P3", perspective="battery")
    if plan:
        for subject in (plan, optuav.Itinerary(crowd, plan.stops)):
            kinds = {event.kind for event in optuav.replay(subject).violations}
            assert kinds <= {"empty", "full"}


def test_a_roof_below_the_origin_is_no_error() -> None:
    """Under `available` a plan that its own replay refuses would be a fault of the solver."""
    plan = optuav.solve(PAPER.replace({**ON_A_ROOF, "limits.min_altitude_m": 0}), "P3")
    assert plan.flyable
    assert plan.phases[0].waypoints_m


def test_the_judge_lets_no_way_through_other_roofs() -> None:
    """Only the roof below an end may be near: two metres lower, the way is too near to h1."""
    plan = optuav.solve(PAPER.replace({**PLENTY, **ON_A_ROOF}), "P3", perspective="battery")
    ((x, y, z),) = plan.phases[0].waypoints_m
    events = optuav.replay(moved_to(plan, (x, y, z - 2.0))).violations
    words = [event.words for event in events if event.kind == "clearance"]
    assert words == ["the leg origin → hover comes too near to building h1"]


def test_one_may_rest_where_the_origin_stands_on_a_roof() -> None:
    """The judge knows the roof below an end, also to rest there."""
    crowd = PAPER.replace({**PLENTY, **ON_A_ROOF})
    stops = (optuav.Stop("origin", "rest", 10.0), optuav.Stop("hover", "hover", 10.0))
    kinds = {event.kind for event in optuav.replay(optuav.Itinerary(crowd, stops)).violations}
    assert "no roof" not in kinds


def test_an_end_beside_a_wall_sees_the_outline() -> None:
    """Within the clearance of a building one may start, and climb along its wall."""
    own = way_m(mission(town((12, 0, 90, 20, 40)), obstacles="over"))
    assert own is not None
    assert own[1][2] >= 95.0 - 1e-9
    assert 2.0 <= own[1][0] < 2.1


@pytest.mark.parametrize("yard_m", [START_M, END_M], ids=["origin", "hover point"])
def test_no_way_around_leads_out_of_a_closed_yard(yard_m: tuple[float, float, float]) -> None:
    """Four walls that touch at the corners close in an end; over them there is a way."""
    x, y, _ = yard_m
    yard = [(x + a, y + b, 90, c, d) for a, b, c, d in ((30, 0, 10, 70), (-30, 0, 10, 70))]
    yard += [(x + a, y + b, 90, c, d) for a, b, c, d in ((0, 30, 70, 10), (0, -30, 70, 10))]
    walls = town(*yard)
    limits: dict[str, Any] = {"clearance_m": 5, "max_altitude_m": 300}
    assert way_m(mission(walls, obstacles="over", **limits)) is not None
    assert way_m(mission(walls, obstacles="around", clearance_m=5, max_altitude_m=60)) is None


def test_a_way_around_may_meet_no_more_than_so_many_footprints(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ways, "MOST_MET", 1)
    walls = town((150, 40, 90, 20, 200), (250, 40, 90, 20, 300))
    with pytest.raises(InputError, match=r'obstacles = \'?"around".*more than 1 footprints'):
        optuav.solve(mission(walls, obstacles="around"), "P3")


def test_a_free_hover_point_flies_over_buildings() -> None:
    """The search sees bent ways, and its plan keeps clear of the wall."""
    over, plans = blocked("paper").replace(OVER), dict[str, optuav.Plan]()
    for point in ("free", "w_U"):
        problem = optuav.P1(trajectory="direct", hover_point=point)
        plans[point] = optuav.solve(over, problem, perspective="battery")
    assert plans["free"].hover_time_s > plans["w_U"].hover_time_s
    events = optuav.replay(plans["free"]).violations
    assert not [each for each in events if each.kind in ("building", "clearance")]


@pytest.mark.soak
def test_the_figures_of_random_layouts() -> None:
    """Of 200 random layouts, (P3) is blocked in many; one apex frees all of them."""
    costs_s, gains_s = list[float](), list[float]()
    for each in optuav.layouts("paper", 200, seed=0):
        solved = {
            rule: optuav.solve(
                each.replace({"flight.obstacles": rule}), "P3", perspective="battery"
            )
            for rule in ("refuse", "ignore", "over", "around")
        }
        if not solved["refuse"]:
            hover_s = {rule: plan.hover_time_s for rule, plan in solved.items() if plan}
            costs_s.append(hover_s["ignore"] - hover_s["over"])
            gains_s.append(hover_s["around"] - hover_s["over"])
    print(len(costs_s), np.mean(costs_s), np.mean(gains_s))
    assert min(gains_s) >= -1e-6
    assert min(costs_s) >= -1e-6


@pytest.mark.parametrize("rule", ["over", "around"])
def test_no_way_leads_into_a_building(rule: str) -> None:
    """The destination lies below a roof, so deep that an apex right above it seemed to do."""
    corners = [[106.90438497889096, -714.2283050373503], [185.56236201486166, -714.2283050373503]]
    corners += [[197.36105857025728, -659.1677211121707], [146.2333734968763, -635.5703280013795]]
    roof_m = [146.2333734968763, -674.8993165193649, 56.57776579389627]
    hall = {"name": "hall", "position_m": roof_m, "footprint_m": corners}
    town = {"buildings": [hall], "flight.obstacles": rule, "link.device_m": [824, 1725, 0]}
    town |= {"route.origin_m": [831.0369499364965, 421.8308200908916, 55.92941231223945]}
    town |= {"route.hover_m": [824.0670593366578, 1725.8204758089637, 81.9873401287198]}
    town |= {"route.destination_m": [162.58620288979682, -676.5239043139004, 52.51163318745794]}
    plan = optuav.solve(optuav.load("paper").replace(town), "P3", perspective="battery")
    assert not plan
    assert "destination lies inside building hall" in " ".join(plan.reasons)

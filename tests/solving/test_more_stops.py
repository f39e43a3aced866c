"""Whether more stops may help: held against all walks through the places, and known missions."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings

import optuav
from optuav import InputError, Mission
from optuav.engines import closed_form
from optuav.network import vehicle
from optuav.network.feasibility import impossibilities
from optuav.network.network import build_network
from optuav.options import Perspective
from optuav.solving import more_stops
from optuav.solving.assemble import quantities
from optuav.solving.balance import by_balance
from optuav.solving.more_stops import more_stops_may_help
from optuav.solving.question import MOST_BUILDINGS, checked_question
from tests.asking import solve
from tests.diagnosis.missions import only
from tests.examples import few
from tests.mission.strategies import Document
from tests.solving.dense import hidden, leg
from tests.solving.test_flyable_missions import wild_documents

PAPER = optuav.load("paper")


def may_help(
    mission: Mission, perspective: Perspective = "available", graph: Any = None, **options: Any
) -> bool:
    """Whether `optuav.solve` says so, and `optuav.explain`, in their notes."""
    told = solve(mission, perspective=perspective, graph=graph, **options).notes
    explained = optuav.explain(mission, perspective=perspective, graph=graph, **options)
    found = [any("more stops" in each for each in notes) for notes in (told, explained.notes)]
    assert found == [explained.more_stops_open] * 2
    return explained.more_stops_open


@pytest.mark.parametrize("deadline_s", [800.0, 1200.0, 3000.0])
def test_where_the_wells_bind_more_stops_may_help(deadline_s: float) -> None:
    """SPEC 6: at 3000 s two hovers give 810.04 s, one gives 597.27 s."""
    assert may_help(PAPER.replace({"limits.deadline_s": deadline_s}))


@pytest.mark.parametrize(
    ("options", "without"),
    [
        ({"slot_s": 10.0}, ", without slots"),
        ({"problem": optuav.P1(order="hover-first")}, ", without a stated order"),
        (
            {"problem": optuav.P1(order="rest-first"), "slot_s": 10.0},
            ", without slots or a stated order",
        ),
    ],
)
def test_slots_and_an_order_do_not_exclude_more_stops(options: Any, without: str) -> None:
    """`explain` said "no effect" of the deadline there, and nothing of more stops."""
    mission = PAPER.replace({"limits.deadline_s": 3000.0})
    assert may_help(mission, **options)
    assert solve(mission, **options).notes[-1].endswith(f"hovers=2){without}")
    assert "no effect" not in str(optuav.explain(mission, **options)).lower()


def test_more_stops_among_too_many_buildings_are_not_offered(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The search takes at most 1000 buildings; here a tenth of them."""
    assert MOST_BUILDINGS == 1000
    monkeypatch.setattr(more_stops, "MOST_BUILDINGS", 100)
    far = [{"name": f"f{k}", "position_m": [5e3 + 50.0 * k, 5e3, 50.0]} for k in range(100)]
    mission = PAPER.replace({"buildings": [*PAPER.to_dict()["buildings"], *far]})
    assert may_help(mission)
    note = "more stops might gain hover time; optuav searches for them among at most 100 buildings"
    assert solve(mission).notes[-1] == note


def test_where_the_deadline_alone_binds_the_direct_flight_more_stops_do_not_help() -> None:
    """All the time that the shortest flight leaves is spent hovering."""
    mission = PAPER.replace({"limits.deadline_s": 500.0})
    assert not may_help(mission)
    one, more = solve(mission), solve(mission, optuav.P1(stops=2, hovers=2))
    assert more.hover_time_s == pytest.approx(one.hover_time_s, abs=1e-6)


@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted", "wells"])
def test_more_stops_do_not_help_in_the_linear_perspectives(perspective: Perspective) -> None:
    """SPEC 3: the legs of `paper` obey the triangle inequality."""
    assert not may_help(PAPER, perspective)


def blocked_by_a_wall() -> Mission:
    """The direct way to b9 is blocked, a way over b1 is not."""
    wall = {"name": "wall", "position_m": [400, 900, 300], "footprint_m": [30, 300]}
    return PAPER.replace({"buildings": [*PAPER.to_dict()["buildings"], wall]})


def test_a_building_in_the_way_of_a_leg_may_make_a_further_stop_help() -> None:
    blocked = blocked_by_a_wall()
    network = build_network(blocked)
    assert not network.legs.flyable.all()
    assert may_help(blocked, "battery")
    assert not may_help(blocked.replace({"flight.through_buildings": True}), "battery")


def test_an_edited_graph_may_make_a_further_stop_help() -> None:
    """A removed edge, an edited figure, and a short way between buildings that the graph states."""
    removed, edited, added = (optuav.graph(PAPER) for _ in range(3))
    removed.remove_edge("origin", "b9")
    edited.edges["origin", "hover"]["duration_s"] = 900.0
    added.add_edge("b1", "b9", **{**added.edges["b1", "hover"], "duration_s": 0.1})
    for legs in (removed, edited, added):
        assert may_help(PAPER, "battery", legs)
    assert not may_help(PAPER, "battery", optuav.graph(PAPER))


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_without_a_building_there_is_nowhere_to_stop(perspective: Perspective) -> None:
    """The note stood where charge or deadline left the battery more to give."""
    assert not may_help(PAPER.replace({"buildings": []}), perspective)


def test_packs_that_take_turns_take_more_stops_in_the_linear_perspectives_alone() -> None:
    """There they do not count; under ``available`` several stops are refused."""
    turns = blocked_by_a_wall().replace({"battery.schedule": "sequential"})
    assert may_help(turns, "battery")
    assert solve(turns, optuav.P1(stops=2), perspective="battery")
    assert not may_help(turns, slot_s=100.0)
    with pytest.raises(InputError, match="pooled with several stops"):
        solve(turns, optuav.P1(stops=2))


def test_without_a_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    """Too heavy for any plan, and out of time: no number of stops mends either."""
    only(monkeypatch)  # or explain would search every key for repairs
    for changes in ({"body.mass_kg": 9.0}, {"limits.deadline_s": 60.0}):
        mission = PAPER.replace(changes)
        for perspective in ("battery", "available"):
            assert not solve(mission, perspective=perspective)
            assert not may_help(mission, perspective)


def longest_walk_s(mission: Mission, rests: int = 2, hovers: int = 2) -> float:
    """Longest hover by the balance of charge over all walks through the places; −inf for none."""
    places = build_network(mission).places
    names, position_m, legs = places.names, places.position_m, {}
    for start, end in itertools.permutations(range(len(names)), 2):
        ends = names[start], names[end]
        others = [each.model_dump() for each in mission.buildings if each.name not in ends]
        in_the_way = hidden(
            mission.replace({"buildings": others}), position_m[start], position_m[end][None]
        )
        if not in_the_way[0]:
            legs[start, end] = leg(mission, position_m[start], position_m[end])
    received_A = places.received_power_W / mission.battery.nominal_voltage_V
    hover_A = float(vehicle.hover_load(mission).current_A - received_A[1])
    pool_As, longest_s = mission.battery.packs * mission.battery.capacity_As, -np.inf
    for count in range(1, rests + hovers + 1):
        for middle in itertools.product([1, *range(3, len(names))], repeat=count):
            if not 1 <= middle.count(1) <= hovers or count - middle.count(1) > rests:
                continue
            walk = list(itertools.pairwise([0, *middle, 2]))
            if any(way not in legs for way in walk):
                continue
            left_s = mission.limits.deadline_s - sum(float(legs[w].duration_s) for w in walk)
            drawn_As = sum(float(legs[w].charge_As) for w in walk)
            left_As = (1.0 - mission.limits.min_soc) * pool_As - drawn_As
            gained_A = max((float(received_A[k]) for k in middle if k > 2), default=0.0)
            hover_s = min(left_s, (left_As + gained_A * left_s) / (gained_A + hover_A))
            if hover_s >= 0.0:
                longest_s = max(longest_s, hover_s)
    return longest_s


def test_walks_find_the_known_optimum() -> None:
    """SPEC 4: 719.54 s by b1."""
    mission = PAPER.replace({"buildings": PAPER.to_dict()["buildings"][:1]})
    assert longest_walk_s(mission) == pytest.approx(719.5399, abs=1e-3)


def town(seed: int) -> Mission:
    """The UAV of `paper` among buildings that may stand in each other's way, with little time."""
    random = np.random.default_rng(seed)
    buildings = [
        {
            "name": f"b{number}",
            "position_m": [*random.uniform([0.0, 0.0], [2000.0, 2500.0]), random.uniform(20, 150)],
            "footprint_m": random.uniform(20.0, 300.0, 2).tolist(),
        }
        for number in range(random.integers(1, 5))
    ]
    return PAPER.replace(
        {
            "buildings": buildings,
            "limits.deadline_s": random.uniform(200.0, 1500.0),
            "wind.force_N": random.choice([0.0, 4.0]) * random.uniform(-1.0, 1.0, 3),
        }
    )


@pytest.mark.parametrize("perspective", ["battery", "available"])
@pytest.mark.parametrize(
    "seed", [*range(5), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(5, 400))]
)
def test_where_more_stops_do_not_help_no_walk_hovers_longer(
    seed: int, perspective: Perspective
) -> None:
    """By the balance of charge, which bounds what the wells deliver."""
    mission = town(seed)
    plan = solve(mission, perspective=perspective)
    question = checked_question(mission, perspective=perspective)
    if not more_stops_may_help(question, build_network(mission), plan):
        hover_s = plan.hover_time_s if plan else -np.inf
        assert longest_walk_s(mission) <= hover_s + 1e-6


@pytest.mark.campaign
@settings(
    few(4, most=1000),
    suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow],
)
@given(wild_documents())
def test_the_balance_is_the_optimum_of_the_perspective_battery(document: Document) -> None:
    """Δ and the least T' of every route, by closed form; also where hovering charges."""
    network = build_network(Mission.from_dict(document))
    hovers_s, rests_s = by_balance(network)
    assume(network.routes.flyable.all() and not impossibilities(network))
    for by_way in (False, True):
        which = np.flatnonzero((network.routes.building >= 0) == by_way)
        if not len(which):
            continue
        given = quantities(network, which, rests=by_way)
        found = closed_form.solve(optuav.P1().model(given, "battery"), len(which))
        expected_s, found_s = found.objective, hovers_s[which]
        known = np.isfinite(expected_s)
        assert found_s[known] == pytest.approx(expected_s[known], rel=1e-9, abs=1e-6)
        assert np.all(found_s[~known] <= 1e-6)  # rounding decides of a hover of 0 s
        if by_way:
            least_s = found.values["rest_time_s"]
            assert rests_s[which][known] == pytest.approx(least_s[known], rel=1e-6, abs=1e-5)

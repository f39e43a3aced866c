"""The hover point as an unknown: never worse than w_U, and as good as the best of many points."""

from __future__ import annotations

import itertools
import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import optuav
from optuav import InputError, Mission
from optuav.network import vehicle
from optuav.network.variants import Variants
from optuav.service.fleet import lasting
from optuav.solving import free_hover
from optuav.solving.best_plans import hover_times_s
from tests.asking import formulate, solve
from tests.mission.strategies import missions
from tests.solving.dense import best_s, delivered_s

PAPER = optuav.load("paper")
FEW = PAPER.replace({"buildings": PAPER.buildings[7:9]})
TABLE2 = optuav.load("paper-table2").replace({"buildings": PAPER.buildings[:9:4]})
SCREEN = {"name": "s", "position_m": [1000, 2400, 120], "footprint_m": [120, 120]}
VARIANTS: dict[str, dict[str, Any]] = {
    "paper": {},
    "short": {"limits.deadline_s": 800.0},
    "windy": {"limits.deadline_s": 800.0, "wind.force_N": [0.0, -3.0, 0.0]},
    "screened": {"limits.deadline_s": 800.0, "buildings": [SCREEN]},
}


def never_worse(mission: Mission, **options: Any) -> optuav.Plan:
    """The plan with the hover point free, held against w_U and against the rules of hovering."""
    at_w_U = solve(
        mission.replace({"route.hover_m": None}), **{"perspective": "battery", **options}
    )
    plan = solve(mission, **{"hover_point": "free", "perspective": "battery", **options})
    if at_w_U:
        assert plan.hover_time_s >= at_w_U.hover_time_s - 1e-9
    if plan:
        assert plan.status == "locally_optimal"
        assert plan.proof.startswith("local")
        x, y, z = optuav.graph(plan.mission).nodes["hover"]["position_m"]
        distance_m = np.linalg.norm(np.subtract((x, y, z), mission.link.device_m))
        assert distance_m <= vehicle.coverage_radius_m(mission) * (1 + 1e-9)
        assert mission.limits.min_altitude_m <= z <= mission.limits.max_altitude_m
        again = solve(plan.mission, **{"perspective": "battery", **options})
        assert again.hover_time_s == pytest.approx(plan.hover_time_s, abs=1e-9)
        assert again.route == plan.route
    return plan


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "screened",
        *(pytest.param(name, marks=pytest.mark.soak) for name in ("paper", "short", "windy")),
    ],
)
def test_as_good_as_a_dense_sampling(name: str) -> None:
    """Within 0.01 s of points all over the ball, searched closely, by formulas of their own."""
    mission = PAPER.replace(VARIANTS[name])
    plan = never_worse(mission)
    assert plan.hover_time_s > best_s(mission, fineness=41, close=1) - 0.01


@pytest.mark.slow
@pytest.mark.parametrize(
    "changes",
    [pytest.param(changes, marks=pytest.mark.soak) for changes in VARIANTS.values()],
)
def test_as_good_as_a_dense_sampling_of_what_wells_deliver(changes: dict[str, Any]) -> None:
    """The same under `available`, by wells of the tests' own."""
    mission = PAPER.replace(changes)
    plan = never_worse(mission, perspective="available")
    assert plan.flyable
    assert plan.hover_time_s > best_s(mission, 7, close=1, hover_s=delivered_s) - 0.01


def test_where_w_U_is_best_the_plan_hovers_there() -> None:
    """At 800 s nothing is gained: the plan is the one of w_U, and says so."""
    mission = FEW.replace({"limits.deadline_s": 800.0})
    plan = solve(mission, optuav.P1(trajectory="direct", hover_point="free"), perspective="battery")
    at_w_U = solve(mission, trajectory="direct", perspective="battery")
    assert plan.mission.route.hover_m is None
    assert plan.phases == at_w_U.phases
    assert plan.notes[0] == "hover point free: none was found that is better than w_U"


def test_a_stated_hover_point_is_set_free() -> None:
    mission = FEW.replace({"route.hover_m": [1000, 2700, 80], "limits.deadline_s": 800.0})
    plan = never_worse(mission, trajectory="direct")
    assert "more than route.hover_m" in plan.notes[0]


@pytest.mark.parametrize(
    ("lost_s", "words"), [(0.25, "0.2500 s more than"), (1e-6, "no longer hover than")]
)
def test_a_gain_that_no_digit_shows_is_none(lost_s: float, words: str) -> None:
    """Of two points with equal hovers, that of the shorter mission is taken: 0.0000 s more."""
    at_w_U = solve(FEW, trajectory="direct", perspective="battery")
    out, hover, back = at_w_U.phases
    shorter = out, lasting(hover, hover.duration_s - lost_s), back
    own = at_w_U.model_copy(update={"phases": shorter})
    assert free_hover._gain(at_w_U, own) == f"hover point free: w_U gives {words} w_U"


@pytest.mark.parametrize(
    ("changes", "perspective"),
    [({"laser": None}, "battery"), ({"flight.through_buildings": True}, "energy")],
)
def test_variants(changes: dict[str, Any], perspective: str) -> None:
    """Without a laser, and by the other perspectives."""
    mission = FEW.replace({"buildings": FEW.buildings[:1], **changes})
    never_worse(mission, trajectory="direct", perspective=perspective)


def test_loads_by_regime() -> None:
    mission = optuav.load("paper-table2")
    few = mission.replace({"buildings": mission.buildings[:1]})
    never_worse(few, trajectory="traj1", perspective="adjusted")


PERSPECTIVES = ("battery", "available")


@pytest.mark.parametrize("perspective", PERSPECTIVES)
@settings(max_examples=2)
@given(mission=missions(most_buildings=2))
def test_random_missions(mission: Mission, perspective: str) -> None:
    """Never worse than w_U, whatever the mission."""
    never_worse(mission, perspective=perspective)


@pytest.mark.soak
@pytest.mark.parametrize("perspective", PERSPECTIVES)
@settings(max_examples=100)
@given(mission=missions(most_buildings=4))
def test_soak_random_missions(mission: Mission, perspective: str) -> None:
    """As before, a hundred times."""
    never_worse(mission, perspective=perspective)


def test_out_of_reach_is_told() -> None:
    plan = solve(
        PAPER.replace({"limits.min_altitude_m": 600.0, "limits.max_altitude_m": 700.0}),
        optuav.P1(hover_point="free"),
        perspective="battery",
    )
    assert not plan
    assert "out of reach" in plan.reasons[0]


def test_too_short_a_deadline_is_told() -> None:
    plan = solve(
        FEW.replace({"limits.deadline_s": 60.0}),
        optuav.P1(hover_point="free"),
        perspective="battery",
    )
    assert not plan
    assert "longer than limits.deadline_s" in " ".join(plan.reasons)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (
            {"problem": "P4", "building": "b1"},
            "problem P4 takes no hover_point, P1 does",
        ),
        ({"trajectory": "traj2"}, "trajectory = 'traj2'"),
        ({"perspective": "wells"}, "perspective = 'wells'"),
        ({"slot_s": 1.0}, "slot_s = 1.0"),
        ({"engine": "grid"}, "engine = 'grid'"),
        ({"graph": optuav.graph(PAPER)}, "graph"),
        ({"hover_point": "anywhere"}, "one of w_U, free"),
    ],
)
def test_contradictions_are_refused_by_name(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        formulate(PAPER, **{"perspective": "battery", **{"hover_point": "free", **options}})


def test_the_program_is_printed_and_checked() -> None:
    """The declaration holds for any point; what needs one hover point is refused."""
    program = formulate(PAPER, optuav.P1(hover_point="free"), perspective="battery")
    assert "hover point free" in str(program)
    point = {"hover_x_m": 1000.0, "hover_y_m": 2501.0, "hover_z_m": 50.0, "hover_time_s": 600.0}
    outage = {row.label: row for row in program.check(point)}["P1.a outage"]
    assert outage.left == pytest.approx(np.hypot(499.0, 50.0))
    assert not outage.satisfied if outage.left > outage.right else outage.satisfied
    for ask in (program.shadow_prices, program.compile):
        with pytest.raises(InputError, match=r"route\.hover_m"):
            ask()


def town(seed: int) -> Mission:
    """The UAV of `paper` in a town of its own, many buildings near the device, wind or none."""
    random = np.random.default_rng(seed)
    x, y = random.uniform(0.0, 2000.0), random.uniform(500.0, 3000.0)
    around = ([x - 700.0, y - 900.0], [x + 700.0, y])
    buildings = [
        {
            "name": f"b{number}",
            "position_m": [*random.uniform(*around), random.uniform(20.0, 150.0)],
            "footprint_m": random.uniform(20.0, 200.0, 2).tolist(),
        }
        for number in range(random.integers(0, 5))
    ]
    return PAPER.replace(
        {
            "link.device_m": [x, y, random.uniform(0.0, 20.0)],
            "laser.position_m": [*random.uniform(0.0, 2000.0, 2), random.uniform(5.0, 80.0)],
            "limits.deadline_s": random.uniform(700.0, 1500.0),
            "buildings": buildings,
            "wind.force_N": random.choice([0.0, 3.0]) * random.uniform(-1.0, 1.0, 3),
        }
    )


@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(2, 60))]
)
def test_towns(seed: int) -> None:
    """Where lines of sight are cut and legs are short, as good as a dense sampling too."""
    mission = town(seed)
    plan = never_worse(mission)
    assert (plan.hover_time_s if plan else -np.inf) >= best_s(mission, 81, close=1) - 0.01


def test_out_of_time_the_best_point_so_far_is_flown(monkeypatch: pytest.MonkeyPatch) -> None:
    """Never worse than w_U, longer with more time, and not called an optimum."""
    clock, hovers_s = itertools.count(), list[float]()
    monkeypatch.setattr(free_hover.time, "monotonic", lambda: float(next(clock)))
    whole = solve(PAPER, hover_point="free", perspective="battery", time_limit_s=1e9)
    looks = next(clock)
    for share in (0.0, 0.5):
        clock = itertools.count()
        limit_s = share * looks + 0.5
        plan = solve(PAPER, hover_point="free", perspective="battery", time_limit_s=limit_s)
        assert next(clock) <= limit_s + 3.0
        assert plan.status == "feasible"
        assert "within the time limit" in plan.proof
        assert any("did not end within the time limit" in note for note in plan.notes)
        hovers_s.append(plan.hover_time_s)
    at_w_U = solve(PAPER, perspective="battery")
    assert hovers_s[0] == pytest.approx(at_w_U.hover_time_s, abs=1e-9)
    assert hovers_s[0] < hovers_s[1] <= whole.hover_time_s + 1e-9


def test_out_of_time_without_a_plan_is_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """w_U has no plan and no point was tried: neither a plan nor proof that none exists."""
    clock = itertools.count()
    monkeypatch.setattr(free_hover.time, "monotonic", lambda: float(next(clock)))
    mission = PAPER.replace(VARIANTS["screened"])
    with pytest.raises(optuav.SolverError, match=r"within the time limit, without a plan"):
        solve(mission, hover_point="free", perspective="battery", time_limit_s=0.5)


def search_of(mission: Mission, perspective: str) -> tuple[Any, Any]:
    """A search for a hover point, and the routes that it may take."""
    search = free_hover.PointSearch(perspective, mission)
    return search, np.flatnonzero(search.network.routes.flyable)


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_no_answer_depends_on_the_portion(
    perspective: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Points in one portion, in some and in many: the same starts, to the last bit."""
    search, routes = search_of(FEW, perspective)
    found = []
    for at_once in (1 << 30, 1 << 13, 997):
        monkeypatch.setattr(free_hover, "POINTS_AT_ONCE", at_once)
        starts = search._starts(routes)
        found.append([(each.value, each.branch, *each.at) for each in starts])
    assert found[0]
    assert found[0] == found[1] == found[2]


def near_roofs(count: int) -> Mission:
    """The UAV of `paper` and roofs around its device, some higher than the UAV may hover low."""
    low, high = (700.0, 2400.0, 10.0), (1300.0, 3000.0, 70.0)
    roofs_m = np.random.default_rng(1).uniform(low, high, (count, 3))
    table = dict(zip(("x_m", "y_m", "z_m"), roofs_m.T, strict=True))
    sizes_m = {"width_m": [20.0] * count, "depth_m": [20.0] * count}
    return PAPER.with_buildings({"name": [f"x{k}" for k in range(count)], **table, **sizes_m})


def windy_roofs() -> Mission:
    """A few of them in wind, where no leg is as quick as its way back."""
    return near_roofs(6).replace({"wind.force_N": [2.0, -1.0, 0.5]})


def hover_of(search: Any, points_m: Any, perspective: str) -> Any:
    """Δ at points by routes [s], past all buildings."""
    columns = {f"route.hover_m[{axis}]": points_m[:, axis] for axis in range(3)}
    return hover_times_s(Variants(search.network, columns), perspective)


@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted", "available"])
@pytest.mark.parametrize("mission", [near_roofs(6), windy_roofs(), TABLE2], ids=str)
def test_no_hover_is_longer_than_the_bound_of_its_ring(mission: Mission, perspective: str) -> None:
    """At points all over the region, and close to every roof."""
    search, routes = search_of(mission, perspective)
    random = np.random.default_rng(2)
    network = replace(search.network, routes=search.network.routes.take(routes))
    points_m = search.region.inside(
        np.concatenate(
            [
                search.region.spread()[::40],
                *(
                    roof_m + random.normal(size=(20, 3)) * random.choice([0.1, 3.0, 30.0], (20, 1))
                    for roof_m in mission.buildings.roof_m
                ),
            ]
        )
    )
    rings_m, most_s = search._bounds_s(network, points_m)
    hover_s = hover_of(search, points_m, perspective)[:, routes]
    building = network.routes.building
    away_m = np.linalg.norm(points_m[:, None] - mission.buildings.roof_m[building], axis=2)
    ring = np.searchsorted(rings_m, away_m, side="right") - 1
    assert np.isfinite(hover_s).any()
    assert (hover_s <= most_s[np.arange(len(routes)), ring] + 1e-9).all()


@pytest.mark.parametrize("perspective", PERSPECTIVES)
def test_bounds_leave_out_no_start(perspective: str) -> None:
    """The best start is the best of all points on all routes, each tried past all buildings."""
    search, routes = search_of(near_roofs(6), perspective)
    starts = search._starts(routes)
    network, seen = search.network, list[Any]()
    for place_m in network.places.position_m[3:]:
        seen.append(search.region.near(place_m))
    points_m = np.concatenate([search.region.spread(), *seen])
    hover_s = hover_of(search, points_m, perspective)
    best_s = max(each.value for each in starts)
    assert best_s >= hover_s.max() - 1e-9
    for start in starts:
        own_s = hover_of(search, start.at[None], perspective)[0, start.branch]
        assert own_s == pytest.approx(start.value, abs=1e-9)


@pytest.mark.parametrize("perspective", PERSPECTIVES)
def test_memory_does_not_grow_with_the_buildings(perspective: str) -> None:
    """All points by all routes at once take gigabytes for 1000 buildings."""
    search, routes = search_of(near_roofs(150), perspective)
    tracemalloc.start()
    search._starts(routes)
    _, peak_B = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak_B < 4e7


RELAY = optuav.load("relay-today")
UNPRINTED = {
    "wind": ({"laser.jitter_rad": 0.0, "wind.velocity_m_s": [6.0, -3.0, 0.0]}, "wind"),
    "jitter": ({"laser.jitter_rad": 1e-5}, "jitter"),
}


@pytest.mark.parametrize("name", UNPRINTED)
def test_a_programme_that_cannot_be_printed_is_searched(name: str) -> None:
    """Of a rotary wing in wind and of jitter: no point that is tried at random is better."""
    changes, words = UNPRINTED[name]
    mission = RELAY.replace({**changes, "buildings": RELAY.buildings[10:]})
    free = optuav.P1(hover_point="free")
    plan = optuav.solve(mission, free)
    assert plan.flyable
    assert plan.hover_time_s > optuav.solve(mission).hover_time_s + 1.0
    region, random = free_hover.HoverRegion(mission), np.random.default_rng(7)
    points_m = region.inside(region.centre_m + random.uniform(-400.0, 400.0, (16, 3)))
    moved = (mission.replace({"route.hover_m": at_m}) for at_m in points_m.tolist())
    others = [each.hover_time_s for each in map(optuav.solve, moved) if each]
    assert len(others) > 8
    assert max(others) <= plan.hover_time_s + 1e-6
    with pytest.raises(InputError, match=f"cannot be declared: .*{words}"):
        optuav.formulate(mission, free)


def test_a_search_without_a_programme_is_explained() -> None:
    """By the programme at the point that it found."""
    mission = RELAY.replace({**UNPRINTED["wind"][0], "buildings": []})
    explained = optuav.explain(mission, optuav.P1(hover_point="free"))
    assert explained.plan.flyable
    assert any(side.binds for side in explained.constraints)

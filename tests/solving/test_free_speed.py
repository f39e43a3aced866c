"""The speeds of legs as unknowns: against grids, named speeds, CasADi and the judge."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav import InputError, Mission
from optuav.engines.registry import engine
from optuav.status import Status
from tests.diagnosis.missions import only
from tests.examples import few
from tests.flight.test_flights import WINGED
from tests.solving.by_speed import balanced_s, delivered_s, grid, route, winged
from tests.wells import SLOW

RULES = ("best-range", "best-endurance", "max")
ANY, DIRECT = optuav.P1(speed="free"), optuav.P3(speed="free")
ROUTES = [(None, False), ("b1", True), ("b1", False), ("b2", True), ("b2", False)]


def ways(mission: Mission) -> list[tuple[str | None, bool]]:
    """The routes of (P1) with at most one building."""
    known = (None, *mission.buildings.names)
    return [each for each in ROUTES if each[0] in known]


def refined(mission: Mission, way: tuple[str | None, bool], hover_s: Any, count: int) -> float:
    """The longest hover on a route over all speeds, by grids ever closer around the best."""
    points = grid(mission, route(mission, *way), count)
    low, high = points.min(axis=1), points.max(axis=1)
    top, best = points.max(axis=1), high
    found = -math.inf
    for _ in range(7):
        values = hover_s(mission, *way, points)
        if values.max() > found:
            found, best = float(values.max()), points[:, values.argmax()]
        step = (high - low) / (count - 1)
        low, high = np.maximum(best - 1.5 * step, 0.05 * top), np.minimum(best + 1.5 * step, top)
        axes = np.meshgrid(*map(np.linspace, low, high, [count] * len(low)))
        points = np.array([axis.ravel() for axis in axes])
    return found


def free(mission: Mission, problem: Any = ANY, **options: Any) -> optuav.Plan:
    """The plan with free speeds, which the judge flies to the same place, speed and charge."""
    plan = optuav.solve(mission, problem, **options)
    if not plan:
        return plan
    audited = optuav.audit(plan)
    allowed = {"empty", "full"}  # Other perspectives do not see the available well, nor charge
    allowed |= {"state of charge"} if plan.perspective in ("energy", "adjusted") else set()
    assert {event.kind for event in audited.replay.violations} <= allowed
    for phase, flown in zip(plan.phases, audited.replay.phases, strict=True):
        assert flown.speeds_m_s == phase.speeds_m_s
        assert flown.duration_s == pytest.approx(phase.duration_s, rel=1e-12)
    return plan


@pytest.mark.campaign
@few(4, 200)
@given(winged())
def test_no_speed_of_a_grid_is_better(mission: Mission) -> None:
    """(P1) under `battery` is proved optimal, and no speeds of any route hover longer."""
    plan = free(mission, perspective="battery")
    truth = -math.inf
    for way in ways(mission):
        points = grid(mission, route(mission, *way), 15 if way[0] is None else 6)
        truth = max(truth, float(balanced_s(mission, *way, points).max()))
    if plan:
        assert plan.status == "optimal"
        assert plan.proof.startswith("priced")
        building = next((name for name in plan.route if name in mission.buildings.names), None)
        way = building, building is not None and plan.route[1] == building
        own = balanced_s(mission, *way, np.array(plan.speeds_m_s))
        assert plan.hover_time_s == pytest.approx(float(own[0]), abs=1e-6)
        assert plan.hover_time_s >= truth - 1e-6
    else:
        assert truth == -math.inf


@few(3)
@given(winged())
def test_as_good_as_all_speeds_and_better_than_named_ones(mission: Mission) -> None:
    """The same as grids ever closer around the best, and never worse than a rule."""
    plan = free(mission, perspective="battery")
    truth = max(refined(mission, w, balanced_s, 15 if w[0] is None else 7) for w in ways(mission))
    hover_s = plan.hover_time_s if plan else -math.inf
    assert hover_s >= truth - 1e-6
    # A grid may miss the few speeds of a mission that is hardly possible.
    assert hover_s <= (truth + 0.02 if math.isfinite(truth) else 1.0)
    for rule in RULES:
        named = optuav.solve(mission.replace({"flight.speed": rule}), perspective="battery")
        assert not named or hover_s >= named.hover_time_s - 1e-6


@few(3)
@given(winged(), st.sampled_from(["energy", "adjusted"]))
def test_the_argument_holds_in_power(mission: Mission, perspective: Any) -> None:
    """Charge at the nominal voltage is energy; against a stated energy it counts more."""
    plan = free(mission, DIRECT, perspective=perspective)
    for rule in RULES:
        named = optuav.solve(mission.replace({"flight.speed": rule}), "P3", perspective=perspective)
        assert not named or plan.hover_time_s >= named.hover_time_s - 1e-6
    own = mission.battery.packs * mission.battery.capacity_As * mission.battery.nominal_voltage_V
    stated = mission.replace({"battery.flight_energy_J": 0.9 * own})
    less = free(stated, DIRECT, perspective="adjusted")
    if less and plan:
        assert less.status == "optimal"
        assert less.hover_time_s <= plan.hover_time_s + 1e-9


@pytest.mark.campaign
@few(3, 100)
@given(winged())
def test_under_available_the_search_is_between_grid_and_bound(mission: Mission) -> None:
    """No named speed and no speed of a grid hovers longer, by wells of the tests' own."""
    plan = free(mission)
    named = [optuav.solve(mission.replace({"flight.speed": rule})) for rule in RULES]
    longest = max((each.hover_time_s for each in named if each), default=-math.inf)
    truth = delivered_s(mission, None, False, grid(mission, [0, 1, 2], 12)).max()
    for way in ways(mission)[1:]:
        points = grid(mission, route(mission, *way), 4)
        truth = max(truth, delivered_s(mission, *way, points).max())
    if not plan:
        assert longest == truth == -math.inf
        return
    assert plan.flyable
    assert plan.hover_time_s >= max(longest, truth) - 1e-6
    if plan.status == "optimal":
        assert plan.bound is None
    else:
        assert plan.status == "locally_optimal"
        assert plan.bound is not None
        assert plan.bound >= plan.hover_time_s
        by_charge = free(mission, perspective="battery")  # Which knows fewer limits
        assert plan.bound <= by_charge.hover_time_s + 1e-5


TEMPTED = WINGED.replace(  # Named speeds hover longest by way of b1, the best speeds without it
    {
        "flight.blade_power_W": 70.2,
        "flight.induced_power_W": 67.6,
        "flight.induced_speed_m_s": 5.63,
        "flight.parasite_W_s3_m3": 0.01258,
        "flight.efficiency": 0.708,
        "flight.acceleration_m_s2": 2.9,
        "flight.max_speed_m_s": 29.4,
        "flight.through_buildings": True,
        "battery.capacity_As": 17350.0,
        "battery.available_fraction": 0.761,
        "battery.flow_rate_per_s": 3.4e-6,
        "route.origin_m": [-1449, -1119, 10],
        "limits.deadline_s": 1799.0,
        "limits.min_soc": 0.1788,
        "laser.power_W": 1894.0,
        "wind.velocity_m_s": [-2.49, 0.11, 0.0],
        "buildings": WINGED.buildings[:1],
    }
)


@pytest.mark.parametrize(
    "mission", [TEMPTED, TEMPTED.replace({"battery.charging": "taper"})], ids=["constant", "taper"]
)
def test_all_routes_are_no_worse_than_any_of_them_alone(mission: Mission) -> None:
    """(P1) searches each route that its bound leaves open as (P3) and (P4) do."""
    problems = ANY, DIRECT, optuav.P4("b1", speed="free")
    plan, direct, rested = (optuav.solve(mission, problem) for problem in problems)
    assert plan.hover_time_s >= max(direct.hover_time_s, rested.hover_time_s) - 1e-6
    assert plan.bound == pytest.approx(max(direct.bound or 0.0, rested.bound or 0.0), abs=1e-3)


@few(2)
@given(winged())
def test_under_available_the_direct_route_is_as_good_as_all_speeds(mission: Mission) -> None:
    """Within 0.01 s of grids ever closer around the best, and the bound is above them."""
    plan = free(mission, DIRECT)
    truth = refined(mission, (None, False), delivered_s, 15)
    assert (plan.hover_time_s if plan else -math.inf) == pytest.approx(truth, abs=0.01)
    assert not plan or plan.bound is None or plan.bound >= truth - 1e-6


@pytest.mark.parametrize(
    ("perspective", "deadline_s", "capacity_As", "problem"),
    [
        ("battery", 700.0, 9000.0, optuav.P3(speed="free")),
        ("available", 3000.0, 9000.0, optuav.P3(speed="free")),
        pytest.param(
            *("available", 900.0, 5000.0, optuav.P4("b1", speed="free")), marks=pytest.mark.soak
        ),
        ("battery", 900.0, 5000.0, optuav.P4("b1", order="hover-first", speed="free")),
    ],
)
def test_casadi_solves_the_declared_program(
    perspective: Any, deadline_s: float, capacity_As: float, problem: Any
) -> None:
    """One program with a speed a leg, which CasADi takes as it is."""
    mission = WINGED.replace({"limits.deadline_s": deadline_s, "flight.through_buildings": True})
    mission = mission.replace({"battery.capacity_As": capacity_As})
    plan = free(mission, problem, perspective=perspective)
    program = optuav.formulate(mission, problem, perspective=perspective)
    assert program.engines == ("casadi",)
    found = [engine("casadi").solve(part.model, len(part.routes)) for part in program.parts]
    best = max(float(np.nanmax(each.objective)) for each in found)
    assert plan.hover_time_s == pytest.approx(best, abs=1e-4)


def test_the_program_is_printed_as_mathematics() -> None:
    text = str(optuav.formulate(WINGED, DIRECT, perspective="battery"))
    assert "V_j ∈ [V^min_j, V^max_j] m/s" in text
    assert "d_j/V_j + V_j/2" in text
    assert "√(√(1 + " in text
    assert r"\sqrt" in optuav.formulate(WINGED, DIRECT).to_latex()


def test_prices_of_a_second() -> None:
    """μ is 0 where charge alone binds, the rest current with a rest, and else between."""
    from optuav.network.network import build_network
    from optuav.solving.speed_search import LegSpeeds, RoutePricing

    mission = WINGED.replace({"battery.capacity_As": 5000.0, "flight.through_buildings": True})
    ample_s = free(mission.replace({"limits.deadline_s": 1e4}), DIRECT, perspective="battery")
    for share, low, high in ((2.0, 0.0, 0.0), (0.97, 1e-3, 1e3), (0.6, math.inf, math.inf)):
        limited = mission.replace({"limits.deadline_s": share * ample_s.mission_time_s})
        speeds = LegSpeeds(build_network(limited))
        found = RoutePricing.of(speeds, np.array([0]), "battery").prices()
        assert low <= found.price_A[0] <= high
    network = build_network(mission.replace({"limits.deadline_s": 1e4}))
    found = RoutePricing.of(LegSpeeds(network), np.array([1]), "battery").prices()
    assert found.price_A[0] == pytest.approx(network.places.charge_current_A[3], rel=1e-12)
    assert found.price_A[0] > 0.5


@few(3)
@given(winged(), st.integers(0, 2**32 - 1), st.booleans())
def test_routes_come_in_the_order_of_their_bounds(
    mission: Mission, seed: int, capped: bool
) -> None:
    """Best first, with the prices of all routes at once; no quick bound is below an exact one."""
    from optuav.network.network import build_network
    from optuav.solving.speed_search import LegSpeeds, RoutePricing, best_first

    chance, names = np.random.default_rng(seed), [f"x{k}" for k in range(60)]
    roofs_m = dict(zip(("x_m", "y_m", "z_m"), chance.uniform(5.0, 1500.0, (3, 60)), strict=True))
    town = mission.with_buildings({"name": names, **roofs_m})
    speeds, routes = LegSpeeds(build_network(town)), np.arange(121)
    pricing = RoutePricing.of(speeds, routes, "battery")
    exact = pricing.prices()
    most_s = exact.bound_s - chance.integers(0, 2, 121) if capped else np.full(121, np.inf)
    bounds_s = np.minimum(exact.bound_s, most_s)
    for price_A in (0.0, 3.0, *exact.price_A[np.isfinite(exact.price_A)][:1].tolist()):
        assert (pricing.quick_bounds_s(price_A) >= exact.bound_s - 1e-6).all()
    ranked = [*best_first(pricing, most_s)]
    assert [number for number, _ in ranked] == [*np.argsort(-bounds_s, kind="stable")]
    for number, prices in ranked:
        assert [*np.concatenate(prices)[:4]] == [column[number] for column in exact[:4]]
        assert prices.bound_s[0] == bounds_s[number]


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_in_a_town_few_routes_are_priced(perspective: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quick bounds leave a few dozen of 1201 routes; each priced one costs 200 roots a leg."""
    from optuav.solving.speed_search import RoutePricing

    chance, names = np.random.default_rng(1), [f"x{k}" for k in range(600)]
    roofs_m = chance.uniform((-2000, -2000, 5), (2000, 2000, 60), (600, 3))
    table = dict(zip(("x_m", "y_m", "z_m"), roofs_m.T, strict=True))
    town = optuav.load("relay-today").replace(SLOW).with_buildings({"name": names, **table})
    priced, prices = list[int](), RoutePricing.prices

    def counted(pricing: RoutePricing) -> Any:
        priced.append(len(pricing.budget_As))
        return prices(pricing)

    monkeypatch.setattr(RoutePricing, "prices", counted)
    plan = optuav.solve(town, ANY, perspective=perspective)
    assert plan.status == "optimal"
    assert sum(priced) <= 64


# Files, the judge, and what is refused

TIGHT = WINGED.replace(
    {"battery.capacity_As": 5000.0, "flight.through_buildings": True, "limits.deadline_s": 900.0}
)


def test_a_file_holds_the_speeds_and_a_changed_one_is_found(tmp_path: Path) -> None:
    """Slower, faster than stated, faster than possible, and left out."""
    plan = free(TIGHT, optuav.P4("b1", speed="free"), perspective="battery")
    path = plan.save(tmp_path / "plan.json")
    assert optuav.load_plan(path) == plan
    assert all(len(speeds) == 1 for speeds in plan.speeds_m_s)
    document = json.loads(path.read_text("utf-8"))
    (speed,) = document["phases"][0]["speeds_m_s"]
    for other, kind in ((speed * 0.99, "mismatch"), (speed * 1.01, "mismatch"), (24.0, "speed")):
        document["phases"][0]["speeds_m_s"] = [other]
        found = optuav.audit(document)
        assert not found
        assert kind in {event.kind for event in found.violations}
    del document["phases"][0]["speeds_m_s"]
    assert "mismatch" in {event.kind for event in optuav.audit(document).violations}
    for wrong in ([speed, speed], ["fast"], [-1.0]):
        document["phases"][0]["speeds_m_s"] = wrong
        with pytest.raises(InputError, match="speeds_m_s"):
            optuav.audit(document)


def test_a_file_without_free_speeds_is_as_it_was() -> None:
    plan = optuav.solve(TIGHT, "P3", perspective="battery")
    assert not any(plan.speeds_m_s)
    assert all("speeds_m_s" not in phase for phase in plan.to_dict()["phases"])
    with pytest.raises(InputError, match="speeds_m_s"):
        optuav.audit(_with_speeds(optuav.solve("paper", "P3")))


def _with_speeds(plan: optuav.Plan) -> dict[str, Any]:
    document = plan.to_dict()
    document["phases"][0]["speeds_m_s"] = [10.0]
    return document


def test_position_over_time_is_that_of_the_stated_speeds() -> None:
    """The trace ends every leg at its place, and peaks at the speed of a level leg."""
    plan = free(TIGHT.replace({"route.origin_m": [0, 0, 50]}), DIRECT, perspective="battery")
    trace = optuav.replay(plan).trace
    landed = np.searchsorted(trace.time_s, plan.phases[0].duration_s)
    hover_m = optuav.graph(plan.mission).nodes["hover"]["position_m"]
    assert trace.position_m[landed] == pytest.approx(np.array(hover_m), abs=1e-6)
    (speed,) = plan.phases[0].speeds_m_s
    assert trace.speed_m_s[:landed].max() == pytest.approx(speed, rel=1e-9)


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_each_segment_of_a_bent_leg_has_its_speed(perspective: Any) -> None:
    """A bent leg stops at its apex: its segments fly as two legs of their lengths would."""
    wall = {"name": "wall", "position_m": [500, 1250, 110], "footprint_m": [800, 60]}
    mission = WINGED.replace(
        {
            "buildings": [wall],
            "flight.obstacles": "over",
            "wind.velocity_m_s": [3.0, -2.0, 0.0],
            "battery.capacity_As": 6000.0,
            "limits.deadline_s": 700.0,
        }
    )
    plan = free(mission, DIRECT, perspective=perspective)
    bent = plan.phases[0]
    assert len(bent.waypoints_m) == 1
    assert len(bent.speeds_m_s) == 2
    for rule in RULES:
        named = optuav.solve(mission.replace({"flight.speed": rule}), "P3", perspective=perspective)
        assert plan.hover_time_s >= named.hover_time_s - 1e-6


@pytest.mark.parametrize(
    ("mission", "problem", "options", "words"),
    [
        ("paper", optuav.P1(speed="free"), {}, "rotary-wing"),
        ("paper-table2", optuav.P4("b1", speed="free"), {}, "rotary-wing"),
        (TIGHT, optuav.P1(speed="fast"), {}, "speed"),  # type: ignore[arg-type]
        (TIGHT, optuav.P1(speed="free", stops=2), {}, "stops"),
        (TIGHT, optuav.P1(speed="free", hovers=2), {}, "hovers"),
        (TIGHT, optuav.P1(speed="free", hover_point="free"), {}, "hover_point"),
        (TIGHT, optuav.P1(speed="free", trajectory="traj2"), {}, "trajectory"),
        (TIGHT, DIRECT, {"slot_s": 1.0}, "slot_s"),
        (TIGHT, DIRECT, {"engine": "casadi"}, "engine"),
        (TIGHT, DIRECT, {"perspective": "wells"}, "perspective"),
        (TIGHT.replace({"battery.schedule": "sequential"}), DIRECT, {}, "battery.schedule"),
        (TIGHT, DIRECT, {"graph": optuav.graph(TIGHT)}, "graph"),
    ],
)
def test_what_has_no_free_speed_is_refused(
    mission: Any, problem: Any, options: dict[str, Any], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        optuav.solve(mission, problem, **options)


def test_where_nothing_can_be_flown_the_reasons_say_so() -> None:
    """Too late at any speed, too little charge at any speed, and against too strong a wind."""
    late = optuav.solve(TIGHT.replace({"limits.deadline_s": 60.0}), DIRECT, perspective="battery")
    assert "the flight takes" in late.reasons[1]
    poor = TIGHT.replace({"battery.capacity_As": 500.0})
    empty = optuav.solve(poor, DIRECT, perspective="energy")
    assert "charge left: " in empty.reasons[1]
    assert late.status is empty.status is Status.INFEASIBLE
    windy = optuav.solve(TIGHT.replace({"wind.velocity_m_s": [0.0, 30.0, 0.0]}), DIRECT)
    assert "the wind blows" in windy.reasons[0]


def test_explain_tells_what_a_second_of_flight_costs(monkeypatch: pytest.MonkeyPatch) -> None:
    """The rest current where both bind with a rest; the price of flight time is that of charge."""
    only(monkeypatch, "battery")
    explained = optuav.explain(TIGHT, optuav.P4("b1", speed="free"), perspective="battery")
    assert explained.notes[0] == "a second less of flight is worth 10 A s of charge on every leg"
    by_name = {price.name: price for price in explained.prices}
    rate = by_name["flight_time_s"].more / by_name["flight_charge_As"].more
    assert rate == pytest.approx(10.0, rel=1e-9)
    assert optuav.explain(explained.plan).notes[:2] == explained.notes[:2]
    capped = optuav.explain(TIGHT.replace({"limits.deadline_s": 300.0}), DIRECT)
    assert "all legs fly at their fastest" in capped.notes[0]
    none = optuav.explain(TIGHT.replace({"battery.capacity_As": 500.0}), DIRECT)
    assert "no plan was found either" in none.notes[0]
    assert none.repairs


def test_compare_sets_the_search_beside_casadi_and_a_grid() -> None:
    few = TIGHT.replace({"buildings": TIGHT.buildings[:1]})
    found = optuav.compare(few, by="speed", perspective="battery")
    hover_s = {row["method"]: row["hover_time_s"] for row in found.rows}
    assert hover_s["free"] == pytest.approx(hover_s["free, CasADi"], abs=1e-4)
    assert hover_s["free, grid"] <= hover_s["free"] + 1e-6
    assert hover_s["free"] == pytest.approx(hover_s["free, grid"], abs=0.1)
    assert max(hover_s[rule] for rule in RULES) <= hover_s["free"] + 1e-6
    assert [*found.plot()] == ["speeds.png"]


def test_a_batch_solves_them_one_by_one() -> None:
    """Three deadlines, as three plans."""
    deadlines = [500.0, 900.0, 1300.0]
    ranges = {"limits.deadline_s": deadlines}
    found = optuav.batch_arrays(TIGHT, ranges, DIRECT, perspective="battery")
    for deadline_s, hover_s in zip(deadlines, found["hover_time_s"], strict=True):
        plan = free(TIGHT.replace({"limits.deadline_s": deadline_s}), DIRECT, perspective="battery")
        assert hover_s == pytest.approx(plan.hover_time_s, abs=1e-9)


def test_a_first_rest_fills_the_battery_at_most() -> None:
    """In `relay-today` the bound is that of the route flown, as no rest leaves more than full."""
    plan = optuav.solve(optuav.load("relay-today").replace(SLOW), ANY)
    assert plan.bound is not None
    assert 0.0 <= plan.bound - plan.hover_time_s < 0.01


def test_a_time_limit_leaves_the_best_plan_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    """After the named speeds, no time is left: a feasible plan with a bound."""
    from optuav.solving import speed_search

    clock = iter(range(10_000))
    monkeypatch.setattr(speed_search.time, "monotonic", lambda: float(next(clock)))
    plan = optuav.solve(TIGHT, DIRECT, time_limit_s=2.5)
    assert plan.status is Status.FEASIBLE
    assert plan.bound is not None
    assert "time limit" in plan.notes[0]


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_a_leg_straight_up_has_no_speed(perspective: Any) -> None:
    """The program has none for it either, and CasADi agrees."""
    keys = {"route.origin_m": [1000, 2600, 10], "route.hover_m": [1000, 2600, 60]}
    mission = TIGHT.replace(keys)
    plan = free(mission, DIRECT, perspective=perspective)
    assert plan.speeds_m_s[0] == (0.0,)
    (found,) = optuav.formulate(mission, DIRECT, perspective=perspective).answers()
    assert plan.hover_time_s == pytest.approx(float(found.objective[0]), abs=1e-4)
    assert "second less of flight" in optuav.explain(plan).notes[0]


@pytest.mark.slow
def test_where_charging_tapers_named_speeds_are_no_better() -> None:
    """The search leaves tapering out; the plan does not."""
    mission = TIGHT.replace({"battery.charging": "taper", "buildings": TIGHT.buildings[:1]})
    problem = optuav.P4("b1", order="hover-first", speed="free")
    plan = optuav.solve(mission, problem)
    assert plan.flyable
    for rule in RULES:
        named = optuav.solve(
            mission.replace({"flight.speed": rule}), optuav.P4("b1", order="hover-first")
        )
        assert plan.hover_time_s >= named.hover_time_s - 1e-6

"""(P1) along the edges of the graph, against formulas and solvers of the tests' own."""

from __future__ import annotations

import itertools
import math
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import highspy
import numpy as np
import pytest
from scipy.optimize import LinearConstraint, milp

import optuav
from formulations.milp import FORMS
from optuav.engines.linear_form import linear_form
from optuav.errors import InputError
from optuav.status import Status
from tests.solving.devices import Town, random_town
from tests.solving.labels import longest_hover
from tests.solving.test_devices import SHARED, STRONG, TABLE2, THREE

NUMBERS = [
    (THREE, "battery", 736.282546),
    (THREE, "energy", 558.131999),
    (SHARED, "battery", 736.282546),
    (STRONG, "battery", 1248.703167),
    (STRONG, "energy", 981.311418),
    (TABLE2, "battery", 989.768610),
    (TABLE2, "energy", 735.897671),
]


def along_edges(mission: optuav.Mission, perspective: str = "battery", **options: Any) -> Any:
    return optuav.route_choice(mission, perspective=perspective, form="edges", **options)


@pytest.mark.parametrize(("mission", "perspective", "hover_s"), NUMBERS)
def test_check_numbers(mission: optuav.Mission, perspective: str, hover_s: float) -> None:
    """The longest hover by a prototype of its own, and a bound that is no smaller."""
    choice = along_edges(mission, perspective)
    assert choice.plan.status is Status.OPTIMAL
    assert choice.plan.hover_time_s == pytest.approx(hover_s, abs=1.5e-6)
    assert hover_s - 1e-6 <= choice.relaxation_s <= 1.06 * hover_s


@pytest.mark.parametrize("seed", range(6))
def test_against_a_programme_per_route(seed: int) -> None:
    """Every order of devices and place of the rest, with the reserve at the end or at landings."""
    town = random_town(40 + seed, count=2 + seed % 2, roofs=3, always=seed > 2)
    energy = seed % 2 == 1
    choice = along_edges(town.mission(), "energy" if energy else "battery")
    known = {route: town.linear(route, energy)[0] for route in town.routes()}
    best_s = max(known.values())
    assert bool(choice.plan) == math.isfinite(best_s)
    if choice.plan:
        assert choice.plan.hover_time_s == pytest.approx(best_s, abs=1e-6)
        assert known[choice.plan.route[1:-1]] == pytest.approx(best_s, abs=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_a_reserve_at_landings_from_a_charge_at_the_start(seed: int) -> None:
    """As the closed form finds it on all routes; hovering draws, or charges over some devices."""
    hover = (25.0, 280.0) if seed % 2 else (70.0, 1000.0)
    town = random_town(90 + seed, 2, 2, always=True, hover=hover, deadline_s=700.0)
    mission = town.mission().replace({"start.soc": 0.25, "battery.capacity_As": 30_000.0})
    best, choice = optuav.solve(mission, perspective="battery"), along_edges(mission)
    assert choice.plan.status is best.status
    if best:
        assert choice.plan.hover_time_s == pytest.approx(best.hover_time_s, abs=1e-6)


def eight(count: int = 8) -> tuple[Town, Any]:
    """A town of eight devices, and its graph with legs that draw less or more."""
    town = random_town(7, count=count, roofs=3, deadline_s=2200.0, capacity_As=60_000.0)
    graph, rng = optuav.graph(town.mission()), np.random.default_rng(1)
    for *_, figures in graph.edges(data=True):
        figures["charge_As"] *= rng.uniform(0.5, 1.5)
        figures["energy_J"] *= rng.uniform(0.5, 1.5)
    return town, graph


def by_labels(town: Town, graph: Any) -> float:
    """The longest hover on a graph by labels over sets of devices."""
    charging_A = {roof: town.net(roof)[0] for roof in town.roofs}
    hover_A = -sum(share * town.net(name)[0] for name, share in town.shares.items())
    spare_As = (1.0 - town.min_soc) * town.capacity_As
    devices = [*town.devices]
    return longest_hover(graph, devices, charging_A, hover_A, spare_As, town.deadline_s)


def test_eight_devices_in_any_order_against_labels() -> None:
    """`solve` proves the best of 8! orders on an edited graph."""
    town, graph = eight()
    plan = optuav.solve(town.mission(), perspective="battery", graph=graph)
    assert plan.status is Status.OPTIMAL
    assert "branch and bound" in plan.proof
    assert sorted(plan.hovers) == sorted(town.devices)
    assert plan.hover_time_s == pytest.approx(by_labels(town, graph), abs=1e-6)


def test_devices_in_a_row_are_proved() -> None:
    """Circles over neighbours are the shortest: the rows of subtours cut them off.

    Without these rows the relaxation is 30.6 s above the optimum, and the proof takes nine times as
    long.
    """
    town = random_town(7, count=10, roofs=3, deadline_s=2600.0, capacity_As=60_000.0)
    row = {
        name: (300.0 + 140.0 * k, 2300.0 + 150.0 * (k % 3), 50.0)
        for k, name in enumerate(town.devices)
    }
    town = replace(town, devices=row)
    choice, best_s = along_edges(town.mission()), by_labels(town, optuav.graph(town.mission()))
    assert choice.plan.status is Status.OPTIMAL
    assert choice.plan.hover_time_s == pytest.approx(best_s, abs=1e-6)
    assert choice.gap_s < 10.0


@pytest.mark.parametrize("seed", range(4))
def test_rows_of_subtours_hold_on_every_route(seed: int) -> None:
    """They cut off no route: its legs out of the places of each row are at least one."""
    town = random_town(20 + seed, count=4, roofs=2, always=seed % 2 == 1)
    choice = along_edges(town.mission())
    form = linear_form(choice.model, choice.model.row(0))
    rows = [k for k, label in enumerate(form.labels) if label.startswith("P1 out of subtour")]
    number = {name: form.names.index(f"edge[{k}]") for k, name in enumerate(choice.shares, 1)}
    assert rows
    for route in town.routes():
        legs = itertools.pairwise(("origin", *route, "destination"))
        flown = [number[f"{start} → {end}"] for start, end in legs]
        assert (form.normals[rows][:, flown, 0].sum(axis=1) <= form.limits[rows, 0]).all()


def test_a_hover_that_charges_carries_the_next_one() -> None:
    """Charge above that at the start flows on to the hover that draws."""
    places: dict[str, tuple[float, float, float]] = {
        "near": (1000.0, 100.0, 50.0),
        "far": (1000.0, 2500.0, 50.0),
    }
    town = Town(
        places,
        {"b0": (100.0, 2900.0, 50.0)},
        {"near": 0.3, "far": 0.7},
        deadline_s=5000.0,
        always=True,
        capacity_As=3000.0,
        laser_W=1700.0,
        flight=(10.0, 100.0),
        hover=(25.0, 280.0),
        rest=(30.0, 350.0),
    )
    best_s, best = max((town.linear(route)[0], route) for route in town.routes())
    choice = along_edges(town.mission())
    assert best == ("near", "far")
    assert choice.plan.route[1:-1] == best
    assert choice.plan.hover_time_s == pytest.approx(best_s, abs=1e-6)


def test_a_reserve_at_landings_bounds_the_relaxation() -> None:
    """Charge that flows along edges cannot stay with edges that are flown in part.

    With a charge for each place, and rows that unflown edges switch off, the relaxation had
    744.75 s for an optimum of 677.19 s, and no proof in minutes.
    """
    places_m = np.random.default_rng(4).uniform((1000, 2400), (1150, 2550), (8, 2))
    devices = [{"name": f"d{k}", "position_m": [x, y, 0]} for k, (x, y) in enumerate(places_m)]
    always = {"limits.deadline_s": 1800.0, "limits.keep_soc": "always"}
    choice = along_edges(optuav.load("paper").replace({"devices": devices} | always))
    assert choice.plan.status is Status.OPTIMAL
    assert choice.gap_s == pytest.approx(0.0, abs=1.0)


def test_labels_find_the_best_of_all_routes() -> None:
    """The oracle of the test above against routes one by one, on legs that are not edited."""
    for seed in range(4):
        town = random_town(60 + seed, count=3, roofs=2)
        best_s = max(town.linear(route)[0] for route in town.routes())
        found_s = by_labels(town, optuav.graph(town.mission()))
        assert found_s == pytest.approx(best_s, abs=1e-6)


def test_five_devices_are_chosen_along_edges_by_default() -> None:
    """Also where the mission's own order cannot be flown."""
    town, graph = eight(5)
    graph.remove_edge("d0", "d1")
    graph.remove_edge("origin", "d0")
    choice = optuav.route_choice(town.mission(), perspective="battery", graph=graph)
    assert choice.form == "edges"
    assert choice.plan.hover_time_s == pytest.approx(by_labels(town, graph), abs=1e-6)


@pytest.mark.parametrize(
    "options",
    [
        {"trajectory": "direct"},
        {"order": "rest-first"},
        {"order": "between"},
        {"order": "hover-first"},
        {"device_order": ("east", "west", "north")},
    ],
)
def test_options_leave_out_edges(options: dict[str, Any]) -> None:
    """As the closed form finds it on the routes that are left."""
    best = optuav.solve(THREE, optuav.P1(**options), perspective="battery")
    choice = along_edges(THREE, **options)
    assert choice.plan.hover_time_s == pytest.approx(best.hover_time_s, abs=1e-6)
    assert choice.plan.route == best.route


def test_all_forms_agree_and_only_the_hull_is_tight() -> None:
    mission = random_town(3, count=2, roofs=2, always=True).mission()
    best_s = optuav.solve(mission, perspective="battery").hover_time_s
    for form in (*FORMS, "edges"):
        choice = optuav.route_choice(mission, perspective="battery", form=form)
        assert choice.plan.hover_time_s == pytest.approx(best_s, abs=1e-6), form
        assert choice.relaxation_s >= best_s - 1e-6, form
        if form == "hull":
            assert choice.gap_s == pytest.approx(0.0, abs=1e-5)


def test_one_device_along_edges_is_the_hull() -> None:
    hull, edges = optuav.route_choice("paper", perspective="battery"), along_edges("paper")
    assert hull.form == "hull"
    assert edges.plan.route == hull.plan.route
    assert edges.plan.hover_time_s == hull.plan.hover_time_s


def by_scipy(town: Town, relaxed: bool) -> float:
    """The same programme by SciPy, from the formulas of the specification and numbers of a town."""
    devices, roofs = [*town.devices], [*town.roofs]
    inner = [*devices, *roofs]
    ways = [("origin", name) for name in inner] + [(name, "destination") for name in inner]
    ways += [(i, j) for i, j in itertools.permutations(inner, 2) if {i, j} & {*devices}]
    width, most = len(ways) + len(inner) + len(roofs) + 1, len(devices) + 1
    column = {name: len(ways) + k for k, name in enumerate(inner)}
    rest = {name: width - 1 - len(roofs) + k for k, name in enumerate(roofs)}
    legs_s = np.array([town.leg_s(*way) for way in ways])
    rows, least, upper = [], [], []

    def row(entries: dict[int, float], low: float, high: float) -> None:
        rows.append(np.zeros(width))
        for k, value in entries.items():
            rows[-1][k] += value
        least.append(low)
        upper.append(high)

    into = {b: {k: 1.0 for k, (_, j) in enumerate(ways) if j == b} for b in (*inner, "destination")}
    out_of = {a: {k: 1.0 for k, (i, _) in enumerate(ways) if i == a} for a in ("origin", *inner)}
    for entries in (out_of["origin"], into["destination"]):
        row(entries, 1.0, 1.0)
    for name in devices:
        row(into[name], 1.0, 1.0)
        row(out_of[name], 1.0, 1.0)
    for name in roofs:
        row(into[name] | dict.fromkeys(out_of[name], -1.0), 0.0, 0.0)
    row({k: 1.0 for name in roofs for k in into[name]}, 0.0, 1.0)
    for k, (i, j) in enumerate(ways):
        if i in inner and j in inner:
            entries = {column[j]: 1.0, column[i]: -1.0, k: -(most + 1.0)}
            row(entries, 1.0 - (most + 1.0), np.inf)
    # An edge leads out of every group of places that holds a hover point.
    for size in range(1, len(inner) + 1):
        for group in itertools.combinations(inner, size):
            if {*group} & {*devices}:
                leaving = [k for k, (i, j) in enumerate(ways) if i in group and j not in group]
                row(dict.fromkeys(leaving, 1.0), 1.0, np.inf)

    def shortest(place: str, side: int) -> float:
        return min(time_s for way, time_s in zip(ways, legs_s, strict=True) if way[side] == place)

    for name in roofs:
        reached_s = sum(shortest(place, 1) for place in (*devices, "destination", name))
        left_s = sum(shortest(place, 0) for place in ("origin", *devices, name))
        most_s = town.deadline_s - max(reached_s, left_s)
        row({rest[name]: 1.0} | dict.fromkeys(into[name], -most_s), -np.inf, 0.0)
    times = {k: float(time_s) for k, time_s in enumerate(legs_s)}
    row(times | dict.fromkeys([*rest.values(), width - 1], 1.0), -np.inf, town.deadline_s)
    drawn = {k: town.flight[0] * time_s for k, time_s in times.items()}
    drawn |= {rest[name]: -town.net(name)[0] for name in roofs}
    drawn[width - 1] = -sum(share * town.net(name)[0] for name, share in town.shares.items())
    row(drawn, -np.inf, (1.0 - town.min_soc) * town.capacity_As)
    whole = np.zeros(width)
    whole[: len(ways)] = 0.0 if relaxed else 1.0
    low, high = np.zeros(width), np.full(width, np.inf)
    high[: len(ways)] = 1.0
    low[[*column.values()]], high[[*column.values()]] = 1.0, most
    goal = np.zeros(width)
    goal[-1] = -1.0
    found = milp(
        goal,
        constraints=LinearConstraint(np.array(rows), least, upper),
        integrality=whole,
        bounds=(low, high),
        options={"mip_rel_gap": 0.0},
    )
    return float(-found.fun)


def test_optimum_and_bound_are_those_of_the_same_programme_by_scipy() -> None:
    town = random_town(5, count=4, roofs=3)
    choice = along_edges(town.mission())
    assert choice.plan.hover_time_s == pytest.approx(by_scipy(town, relaxed=False), abs=1e-5)
    assert choice.relaxation_s == pytest.approx(by_scipy(town, relaxed=True), abs=1e-5)


@pytest.mark.parametrize(("devices", "roofs"), [(3, 10), (6, 10)])
def test_size_of_the_programme(devices: int, roofs: int) -> None:
    """U(U + 1) + 2N(U + 1) edges, an order for each place, T' for each roof, and Δ.

    Besides the rows of subtours, which depend on where the places are.
    """
    choice = along_edges(random_town(0, devices, roofs, deadline_s=3000.0).mission())
    edges = devices * (devices + 1) + 2 * roofs * (devices + 1)
    ordered = devices * (devices - 1) + 2 * devices * roofs
    others = ("P1.a", "P1.c", "P1.e", "P1 out of subtour")
    rows = [row for row in choice.model.constraints if not row.label.startswith(others)]
    assert len(choice.model.variables) == edges + devices + 2 * roofs + 1
    assert len(rows) == 2 + 2 * devices + roofs + 1 + ordered + roofs + 2
    assert len(choice.shares) == edges


def test_the_page_does_not_grow_with_the_town() -> None:
    """Rows of a kind are one line of mathematics, with the numbers that it runs through."""
    towns = (random_town(1, 3, roofs, always=True, deadline_s=2600.0) for roofs in (3, 6))
    pages = [str(along_edges(town.mission()).model).splitlines() for town in towns]
    assert len(pages[0]) == len(pages[1])
    page = "\n".join(pages[1])
    assert "x_j ∈ {0, 1}, j = 1 … 60" in page
    assert "u_end,j ≥ u_begin,j + 1 − 5·(1 − x_j)" in page
    assert "T'_j ≤ (T_max − L_j)·x_in,j" in page
    assert "η_out,j ≤ η_in,j − (Q_out,j + I_j·Δ)" in page
    assert "current over …" in page


@pytest.mark.parametrize("ending", ["lp", "mps"])
def test_files_hold_the_programme(ending: str) -> None:
    """HiGHS reads the file and finds the same hover; remarks name the edges."""
    choice = along_edges(random_town(2, 2, 2).mission())
    text = choice.to_file(ending)
    assert "edge[1] is origin" in text
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"choice.{ending}"
        path.write_text(text, "utf-8")
        file = highspy.Highs()
        file.setOptionValue("output_flag", False)
        file.setOptionValue("mip_rel_gap", 0.0)
        file.readModel(str(path))
        file.run()
    objective_s = abs(file.getInfo().objective_function_value)
    assert objective_s == pytest.approx(choice.plan.hover_time_s, abs=1e-5)


def test_no_plan_says_what_is_short() -> None:
    """On the shortest flight: the deadline, or the charge; or that there is no way."""
    late = along_edges(THREE.replace({"limits.deadline_s": 70}))
    assert late.plan.status is Status.INFEASIBLE
    assert "longer than limits.deadline_s = 70 s" in str(late)
    short = along_edges(THREE.replace({"battery.capacity_As": 2000, "limits.deadline_s": 150}))
    assert "charge left: −198.46 % ≥ 5 %" in str(short)
    graph = optuav.graph(THREE)
    graph.remove_edges_from([*graph.in_edges("west")])
    lost = along_edges(THREE, graph=graph)
    assert "no way that can be flown leads over all hover points" in str(lost)
    assert (lost.model, lost.relaxation_s) == (None, None)


def test_what_is_not_stated_along_edges_is_refused() -> None:
    with pytest.raises(InputError) as refusal:
        along_edges("paper", slot_s=10.0, trajectory="traj1")
    assert [fault.key for fault in refusal.value.faults] == ["slot_s", "trajectory"]
    always = THREE.replace({"limits.keep_soc": "always"})
    with pytest.raises(InputError, match="the share of a leg depends on the others"):
        along_edges(always, "adjusted")


def test_many_devices_in_any_order_are_refused_elsewhere() -> None:
    """Through the wells, in slots, and by other engines and problems; and with more than twelve.

    The refusal has their number and names what takes them: not a field of the function alone.
    """
    mission = random_town(7, count=8, roofs=1).mission()
    more = random_town(7, count=13, roofs=1).mission()
    asked: list[Any] = [
        lambda: optuav.solve(mission),
        lambda: optuav.solve(mission, optuav.P3(), perspective="battery"),
        lambda: optuav.solve(mission, perspective="battery", slot_s=10.0),
        lambda: optuav.solve(mission, perspective="battery", engine="closed-form"),
        lambda: optuav.formulate(mission, perspective="battery"),
        lambda: optuav.route_choice(mission, perspective="battery", slot_s=10.0),
        lambda: optuav.sensitivity(mission),
        lambda: optuav.maps.device(mission, 500.0, device=mission.devices[0].name),
        lambda: optuav.compare(mission, by="perspective"),
        lambda: optuav.solve(more, perspective="battery"),
        lambda: along_edges(more),
    ]
    for call in asked:
        with pytest.raises(InputError, match=r"devices = (8|13): must be at most 7 in any") as told:
            call()
        assert "device_order" in str(told.value)
    with pytest.raises(InputError, match="form = 'hull': must be 'edges' over more than 7 devices"):
        optuav.route_choice(mission, perspective="battery", form="hull")


def test_methods_are_compared_over_few_routes() -> None:
    """Seven devices and one roof have 7!·(1 + 8) routes; no problem can be stated there."""
    for count, perspective in ((7, "available"), (8, "battery")):
        mission = random_town(7, count=count, roofs=1).mission()
        with pytest.raises(InputError) as told:
            optuav.compare(mission, perspective=perspective)
        assert f"devices = {count}: must be fewer" in str(told.value)
        assert "device_order" not in str(told.value)


def test_the_relaxed_bound_is_printed_once() -> None:
    """A note repeated the line above it."""
    text = str(optuav.route_choice(THREE, perspective="battery", form="edges"))
    assert text.count("743.592") == 1

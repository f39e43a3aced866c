"""`solve` with several rests and hovers: plans, proofs, refusals, and the linear perspectives."""

from __future__ import annotations

import itertools
from typing import Any

import networkx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav import InputError, Mission, Plan, SolverError
from optuav.network.feasibility import derived
from optuav.search import branch
from optuav.status import Status
from tests.asking import solve

PAPER = optuav.load("paper")
LOOSE = {
    "buildings": PAPER.to_dict()["buildings"][4:6],
    "battery.charge_current_A": 10.38,
    "laser.power_W": 4.981e4,
    "battery.available_fraction": 0.3151,
    "battery.flow_rate_per_s": 1.39e-4,
    "battery.charging": "taper",
    "limits.deadline_s": 1964.0,
    "limits.min_soc": 0.3887,
}
"""Changes of `paper` for which bounds are weak."""
PAPER_NAMES = [building.name for building in PAPER.buildings]
LINEAR = ("battery", "energy", "adjusted")


def available(mission: Mission, **options: Any) -> Plan:
    return solve(mission, perspective="available", **options)


def test_two_rests_and_two_hovers_make_an_ordinary_plan() -> None:
    """SPEC 3: route, stops, totals and wells; the judge finds it flyable."""
    plan = available(PAPER, stops=2)
    assert plan.route == ("origin", "b9", "hover", "b10", "destination")
    assert [stop.kind for stop in plan.stops] == ["rest", "hover", "rest"]
    assert plan.hover_time_s == pytest.approx(605.456, abs=5e-4)
    assert plan.rest_time_s == pytest.approx(231.8 + 254.2, abs=0.1)
    assert plan.mission_time_s <= 1200.0
    assert plan.status is Status.OPTIMAL
    assert plan.runs_dry_s is None
    assert plan.overfull_s is None
    assert plan.flyable is True
    assert optuav.audit(plan).flyable


def test_hovering_in_two_pieces_counts_both() -> None:
    """SPEC 3: 598.976 s in pieces of 597.27 and 1.71 s."""
    plan = available(PAPER, hovers=2)
    hovers_s = [stop.duration_s for stop in plan.stops if stop.kind == "hover"]
    assert hovers_s == pytest.approx([597.27, 1.71], abs=5e-3)
    assert plan.hover_time_s == pytest.approx(598.976, abs=5e-4)
    assert "597.27 s at hover, 1.71 s at hover" in plan.summary()


def test_without_rests_and_with_one_that_is_enough() -> None:
    """SPEC 4: 577.524 s direct; hovering in pieces brings nothing there. Where the search comes
    down to one rest and one hover, the plan is the one of a single stop, ties included."""
    for hovers in (1, 2):
        plan = available(PAPER, stops=0, hovers=hovers)
        assert plan.route == ("origin", "hover", "destination")
        assert plan.hover_time_s == pytest.approx(577.524, abs=5e-4)
    rich = PAPER.replace({"battery.flow_rate_per_s": 0.01})
    assert available(rich, stops=2).phases == available(rich).phases


def test_states_of_charge_count_every_stay() -> None:
    """The battery's from the wells at the end, the energy's from the phases one by one."""
    plan = available(PAPER, stops=2, hovers=2)
    assert plan.soc is not None
    last, capacity_As = plan.phases[-1], 72_000.0
    left_As = last.available_As[0] + last.bound_As[0]
    assert plan.soc["battery"] == pytest.approx(left_As / capacity_As, rel=1e-9)
    gained_J = sum(s.power_W * s.duration_s for phase in plan.phases for s in phase.stages)
    nominal_J = capacity_As * PAPER.battery.nominal_voltage_V
    assert plan.soc["energy"] == pytest.approx(1.0 + gained_J / nominal_J, rel=1e-9)


def test_more_stops_never_hover_less() -> None:
    """Each more rest or hover adds plans and takes none away."""
    mission = PAPER.replace({"limits.deadline_s": 1600.0, "buildings": PAPER.buildings[8:]})
    hover_s = {
        most: available(mission, stops=most[0], hovers=most[1]).hover_time_s
        for most in itertools.product(range(3), (1, 2))
        if most != (1, 1)
    }
    for (rests, hovers), time_s in hover_s.items():
        for more in ((rests + 1, hovers), (rests, hovers + 1)):
            assert hover_s.get(more, np.inf) >= time_s - 1e-6


def test_an_edited_graph_forbids_places_and_legs() -> None:
    """Without b1 to b8 the plan keeps to b9 and b10; without legs from hover to them, before it."""
    legs = optuav.graph(PAPER)
    legs.remove_nodes_from([f"b{k}" for k in range(1, 9)])
    plan = available(PAPER, stops=2, graph=legs)
    assert set(plan.route) == {"origin", "b9", "hover", "b10", "destination"}
    legs.remove_edge("hover", "b9")
    legs.remove_edge("hover", "b10")
    shorter = available(PAPER, stops=2, graph=legs)
    assert shorter.route[-2:] == ("hover", "destination")
    assert shorter.hover_time_s < plan.hover_time_s


@pytest.mark.parametrize("perspective", ["available", "battery"])
def test_where_every_single_stop_is_blocked_two_may_do(perspective: str) -> None:
    """Legs origin → b9 → b10 → hover alone: no way with one stop, one with two."""
    legs = optuav.graph(PAPER)
    legs.remove_edges_from([("origin", name) for name in legs["origin"] if name != "b9"])
    legs.remove_edges_from([(name, "hover") for name in PAPER_NAMES if name != "b10"])
    one, two = (
        solve(PAPER, optuav.P1(stops=stops), perspective=perspective, graph=legs)
        for stops in (1, 2)
    )
    assert not one
    assert two.route == ("origin", "b9", "b10", "hover", "destination")


def test_without_a_plan_the_reasons_say_so() -> None:
    plan = available(PAPER.replace({"limits.deadline_s": 60.0}), stops=2)
    assert plan.status is Status.INFEASIBLE
    assert "no plan with at most 2 rests and 1 hover" in plan.reasons[0]
    assert "the flight takes 75.79 s" in plan.reasons[1]


def test_a_search_that_ends_early_tells_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plan that is feasible, and a bound that holds: the optimum is 605.456 s."""
    clock = itertools.count()
    monkeypatch.setattr(branch.time, "monotonic", lambda: float(next(clock)))
    plan = available(PAPER, stops=2, time_limit_s=9.0)
    assert plan.status is Status.FEASIBLE
    assert 0.0 < plan.hover_time_s <= 605.4559 <= plan.bound
    assert "ended after 9 s; not proved to be best" in plan.notes[0]


def test_an_interruption_returns_the_best_so_far() -> None:
    """Ctrl-C in the midst of the search: a plan, and a gap that covers the optimum."""
    calls = itertools.count()

    def told(best_s: float, examined: int, left: int) -> None:
        if next(calls) == 24:
            raise KeyboardInterrupt

    plan = available(PAPER, stops=2, hovers=2, progress=told)
    assert plan.status is Status.FEASIBLE
    assert "the search was interrupted; not proved to be best" in plan.notes[0]
    gap_s = float(plan.notes[0].split("a gap of ")[1].split(" s")[0])
    assert plan.hover_time_s <= 605.4559 <= plan.hover_time_s + gap_s + 0.01


def test_the_budget_of_boxes_leaves_a_gap_that_covers_the_optimum(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is open is bounded again: nothing is lost between the best plan and the bound."""
    monkeypatch.setattr(branch, "MOST_BOXES", 20)
    plan = available(PAPER.replace({"limits.deadline_s": 2400.0}), stops=1, hovers=2)
    bound_s = float(plan.proof.rsplit("longer than ", 1)[1].split(" s")[0])
    assert plan.status is Status.FEASIBLE
    assert plan.hover_time_s <= 742.8337 <= bound_s + 1e-5
    assert bound_s < 2300.0


def test_a_taper_that_refuses_much_is_proved() -> None:
    """A taper that refuses much, and wells that level slowly: proved, and flyable."""
    plan = available(PAPER.replace(LOOSE), stops=2)
    assert plan.status is Status.OPTIMAL
    assert plan.flyable


def test_a_search_that_ends_at_once_is_as_good_as_one_stop() -> None:
    """597.2698 s, not proved to be best where 605.456 s are possible; nothing depends on luck."""
    plan = available(PAPER, stops=2, time_limit_s=1e-9)
    assert plan.status is Status.FEASIBLE
    assert plan.flyable
    assert plan.hover_time_s == pytest.approx(597.2698, abs=1e-4)
    assert any("not proved to be best" in note for note in plan.notes)


def test_no_plan_in_time_is_an_error() -> None:
    """Neither a plan nor a proof that none exists: not an answer."""
    legs = {"limits.min_soc": 0.9, "laser.power_W": 100.0}
    with pytest.raises(SolverError, match=r"without a plan or proof.*\. Allow more time"):
        available(PAPER.replace(legs), stops=3, time_limit_s=1e-9)


def test_an_interruption_without_a_plan_advises_no_more_time() -> None:
    """Nothing was short of time; and no plan can hover longer than the written bound."""
    changes = {"limits.min_soc": 0.9, "laser.power_W": 100.0, "limits.deadline_s": 1200.004}
    mission = PAPER.replace(changes)

    def told(best_s: float, examined: int, left: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(SolverError) as refused:
        available(mission, stops=3, progress=told)
    words = str(refused.value)
    assert words.startswith("the search was interrupted without a plan or proof that none exists")
    assert "time_limit_s" not in words
    assert "fewer" not in words
    bound_s = float(words.rsplit("longer than ", 1)[1].removesuffix(" s"))
    left_s = 1200.004 - solve(PAPER, "P3").flight_time_s
    assert 0.0 <= bound_s <= left_s + 1e-5


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"stops": -1}, "stops = -1: must be a whole number, 0 <= x <= 10"),
        ({"stops": 2.0}, "stops = 2.0: must be a whole number"),
        ({"hovers": 0}, "hovers = 0: must be a whole number, 1 <= x <= 10"),
        ({"stops": 2, "problem": "P3"}, "stops = 2: problem P3 takes no stops, P1 does"),
        ({"stops": 2, "slot_s": 1.0}, "slot_s = 1.0: must be left out with several stops"),
        ({"stops": 2, "trajectory": "traj1"}, "'traj1': must be optimal with several stops"),
        ({"stops": 2, "perspective": "wells"}, "battery, energy, adjusted, available with several"),
    ],
)
def test_what_does_not_go_together_is_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words.replace("(", r"\(")):
        solve(PAPER, **({"perspective": "available"} | options))


@pytest.mark.parametrize("perspective", LINEAR)
def test_in_the_linear_perspectives_one_stop_is_enough(perspective: str) -> None:
    """SPEC 3, on the shipped mission: the same plan, and why."""
    one = solve(PAPER, perspective=perspective)
    more = solve(PAPER, optuav.P1(stops=3, hovers=2), perspective=perspective)
    assert more.phases == one.phases
    assert more.notes[-1].startswith("one rest and one hover are enough")


def linear_optimum(mission: Mission, legs: networkx.DiGraph[str], rests: int, hovers: int) -> float:
    """Longest hover by charge balance over all walks through the graph, by hand; −1 for none."""
    pool_As = mission.battery.packs * mission.battery.capacity_As
    hover_A = next(each.value for each in derived(mission) if "net current" in each.name)
    assert isinstance(hover_A, float)
    nominal_V = mission.battery.nominal_voltage_V
    longest_s = -1.0
    names = [each.name for each in mission.buildings]
    for count in range(1, rests + hovers + 1):
        for middle in itertools.product([*names, "hover"], repeat=count):
            if not 1 <= middle.count("hover") <= hovers or count - middle.count("hover") > rests:
                continue
            walk = list(itertools.pairwise(["origin", *middle, "destination"]))
            if not all(legs.has_edge(*way) for way in walk):
                continue
            left_s = mission.limits.deadline_s - sum(legs.edges[way]["duration_s"] for way in walk)
            left_As = (1.0 - mission.limits.min_soc) * pool_As - sum(
                legs.edges[way]["charge_As"] for way in walk
            )
            if left_s < 0.0:
                continue
            charge_A = max(
                (legs.nodes[n]["received_power_W"] / nominal_V for n in middle if n != "hover"),
                default=0.0,
            )
            # Δ net + ... ≤ left + charge T', T' = left_s − Δ: the longest rest is the best.
            hover_s = min(left_s, (left_As + charge_A * left_s) / (-hover_A + charge_A))
            if hover_s >= 0.0:
                longest_s = max(longest_s, hover_s)
    return longest_s


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.floats(0.05, 1.5), min_size=20, max_size=20),
    st.sampled_from([(2, 1), (1, 2), (2, 2)]),
)
def test_broken_triangles_are_compared_sequence_by_sequence(
    factors: list[float], most: tuple[int, int]
) -> None:
    """Legs scaled at random: the optimum over all walks, worked out by hand."""
    mission = PAPER.replace({"buildings": PAPER.buildings[:3], "limits.deadline_s": 900.0})
    legs = optuav.graph(mission)
    for factor, (_, _, data) in zip(factors, legs.edges(data=True), strict=False):
        for figure in ("duration_s", "charge_As", "energy_J"):
            data[figure] *= factor
    legs.add_edge("b1", "b2", **{**legs.edges["b1", "hover"], "duration_s": 3.0})
    legs.add_edge("b2", "b1", **{**legs.edges["b1", "hover"], "charge_As": 10.0})
    for pair in itertools.permutations(["b1", "b2", "b3"], 2):
        if not legs.has_edge(*pair):
            legs.add_edge(*pair, **{**legs.edges["b1", "hover"], "duration_s": 600.0})
    legs.add_edge("origin", "destination", **legs.edges["origin", "hover"])
    plan = solve(
        mission, optuav.P1(stops=most[0], hovers=most[1]), perspective="battery", graph=legs
    )
    expected_s = linear_optimum(mission, legs, *most)
    assert (plan.hover_time_s if plan else -1.0) == pytest.approx(expected_s, abs=1e-6)
    if plan:
        assert all(legs.has_edge(*way) for way in itertools.pairwise(plan.route))
        assert plan.soc is not None
        assert plan.soc["battery"] >= mission.limits.min_soc - 1e-9


def test_an_edge_between_buildings_replaces_the_leg(monkeypatch: pytest.MonkeyPatch) -> None:
    """A way from b1 to b9 that takes next to nothing is a way around that pays, and is told."""
    mission = PAPER.replace({"buildings": [PAPER.buildings[k] for k in (0, 8, 9)]})
    legs = optuav.graph(mission)
    free = {"duration_s": 0.1, "charge_As": 0.0, "energy_J": 0.0}
    legs.add_edge("b1", "b9", **{**legs.edges["b1", "hover"], **free})
    monkeypatch.setattr(branch, "MOST_BOXES", 2_000)
    plan = available(mission, stops=3, graph=legs)
    assert plan.route[:4] == ("origin", "b1", "b9", "hover")
    assert plan.hover_time_s > 610.0
    assert any("figures from the graph" in note for note in plan.notes)

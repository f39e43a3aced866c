"""The check numbers of the specification, end to end: from a shipped mission to a plan."""

from __future__ import annotations

from pathlib import Path

import pytest

import optuav

DIRECT = ("origin", "hover", "destination")
TABLE_2 = [
    (800, "battery", 740.65, 24.30, -0.27, 24.3),
    (800, "energy", 697.0, 28.31, 5.01, 28.3),
    (800, "adjusted", 740.65, 24.30, -0.27, 24.3),
    (1200, "battery", 950.0, 5.09, -25.58, 5.1),
    (1200, "energy", 697.0, 28.31, 5.01, 28.3),
    (1200, "adjusted", 950.0, 5.09, -25.58, 5.1),
]
"""Deadline, perspective, Δ, η1, η2 and η3 [%] of the paper's Table II, its own slips mended."""


@pytest.mark.parametrize(("deadline_s", "perspective", "hover_s", "η1", "η2", "η3"), TABLE_2)
def test_table_2_by_the_grid(
    deadline_s: float, perspective: str, hover_s: float, η1: float, η2: float, η3: float
) -> None:
    """Whole slots on the recovered loads give the Δ column exactly, and its states of charge."""
    mission = optuav.load("paper-table2").replace({"limits.deadline_s": deadline_s})
    plan = optuav.solve(mission, "P3", perspective=perspective, engine="grid")
    assert plan.hover_time_s == pytest.approx(hover_s, abs=0.005)
    assert plan.mission_time_s - plan.hover_time_s == pytest.approx(59.35, abs=0.005)
    assert plan.soc is not None
    assert 100 * plan.soc["battery"] == pytest.approx(η1, abs=0.0051)
    assert 100 * plan.soc["energy"] == pytest.approx(η2, abs=0.0051)
    assert 100 * plan.soc["adjusted"] == pytest.approx(η3, abs=0.051)


@pytest.mark.parametrize("deadline_s", [800, 1200])
@pytest.mark.parametrize(("perspective", "hover_s"), [("battery", 688.848), ("energy", 524.628)])
def test_p3_of_the_printed_parameters(deadline_s: float, perspective: str, hover_s: float) -> None:
    """Both perspectives are bound by charge at either deadline."""
    mission = optuav.load("paper").replace({"limits.deadline_s": deadline_s})
    plan = optuav.solve(mission, "P3", perspective=perspective)
    assert plan.hover_time_s == pytest.approx(hover_s, abs=0.0005)
    assert plan.binding == ("P3.a state of charge",)


def test_p1_of_the_printed_parameters_and_its_tie() -> None:
    """b1 rest first, tied with b2 hover first, is the optimum; the mission's order decides."""
    plan = optuav.solve("paper", perspective="battery")
    assert plan.hover_time_s == pytest.approx(719.5399, abs=5e-5)
    assert plan.rest_time_s == pytest.approx(392.1438, abs=6e-5)
    assert plan.route == ("origin", "b1", "hover", "destination")
    twin = optuav.solve("paper", optuav.P4("b2", order="hover-first"), perspective="battery")
    assert twin.hover_time_s == pytest.approx(plan.hover_time_s, abs=1e-9)


def test_the_optimum_cannot_be_flown() -> None:
    """The available well runs dry in the air; rest first overcharges it."""
    direct = optuav.solve("paper", "P3", perspective="battery")
    assert direct.runs_dry_s == pytest.approx(660.26, abs=0.005)
    best = optuav.solve("paper", perspective="battery")
    assert best.runs_dry_s == pytest.approx(1095.5, abs=0.05)
    assert best.overfull_s is not None
    (available,) = best.phases[-1].available_As
    assert available / 72000 == pytest.approx(-0.13, abs=0.005)
    (rested,) = best.phases[1].available_As
    assert rested / 57600 == pytest.approx(1.04, abs=0.005)
    assert len(best.warnings) == 2


def test_a_short_deadline_makes_the_direct_flight_best() -> None:
    """At 800 s no rest pays, for either set of loads."""
    for name in ("paper", "paper-table2"):
        mission = optuav.load(name).replace({"limits.deadline_s": 800})
        assert optuav.solve(mission, perspective="battery").route == DIRECT


def test_p2_with_the_deadline_tight_loses_hover_time() -> None:
    """678.69 s against P1's 688.85 s at 800 s; as printed P2 is content with no hover at all."""
    mission = optuav.load("paper").replace({"limits.deadline_s": 800})
    assert optuav.solve(mission, perspective="battery").hover_time_s == pytest.approx(
        688.85, abs=0.005
    )
    assert optuav.solve(mission, "P2-tight", perspective="battery").hover_time_s == pytest.approx(
        678.69, abs=0.005
    )
    assert optuav.solve(mission, "P2", perspective="battery").hover_time_s == 0.0


def test_trajectories_of_the_recovered_loads() -> None:
    """traj2 is best at 1200 s by b1; traj1, by b9, gives the 951 s that the paper reports."""
    best = optuav.solve("paper-table2", optuav.P1(trajectory="traj2"), perspective="battery")
    assert best.hover_time_s == pytest.approx(955.28, abs=0.005)
    assert best.route[1] == "b1"
    nearest = optuav.solve("paper-table2", optuav.P1(trajectory="traj1"), perspective="battery")
    assert nearest.hover_time_s == pytest.approx(951.03, abs=0.005)
    assert "b9" in nearest.route


@pytest.mark.parametrize(("min_soc", "fall_percent"), [(0.10, 5.23), (0.15, 10.46)])
def test_hover_time_falls_with_the_charge_to_be_left(min_soc: float, fall_percent: float) -> None:
    """Δ falls by 5.23 and 10.46 % as η0 rises from 5 %."""
    mission = optuav.load("paper-table2")
    full = optuav.solve(mission, perspective="battery").hover_time_s
    less = optuav.solve(
        mission.replace({"limits.min_soc": min_soc}), perspective="battery"
    ).hover_time_s
    assert 100 * (1 - less / full) == pytest.approx(fall_percent, abs=0.005)


def test_the_direct_path_saturates_with_a_large_battery() -> None:
    """Without laser, from 46 194 A s a pack the deadline alone binds."""
    charging = ("laser", "flight.charge_current_A", "flight.charge_power_W")
    mission = optuav.load("paper-table2").replace(dict.fromkeys(charging))
    for capacity_As, binds in ((46193.0, "P3.a state of charge"), (46195.0, "P3.b hover time")):
        larger = mission.replace({"battery.capacity_As": capacity_As})
        assert optuav.solve(larger, "P3", perspective="battery").binding == (binds,)


def test_plans_survive_their_file(tmp_path: Path) -> None:
    """Feasible or not, edited or slotted: the round trip is exact."""
    mission = optuav.load("paper")
    graph = optuav.graph(mission)
    graph.edges["origin", "b1"]["duration_s"] *= 1.5
    plans = [
        optuav.solve(mission, perspective="battery"),
        optuav.solve(
            mission, optuav.P4("b1", order="rest-first"), graph=graph, perspective="battery"
        ),
        optuav.solve("paper-table2", engine="grid", problem="P3", perspective="battery"),
        optuav.solve(mission.replace({"limits.deadline_s": 60}), perspective="battery"),
    ]
    for plan in plans:
        plan.save(tmp_path / "plan.json")
        assert optuav.load_plan(tmp_path / "plan.json") == plan
    assert plans[1].phases[0].edited
    with pytest.raises(optuav.NoPlanError, match="deadline_s"):
        _ = plans[-1].hover_time_s


def test_an_unedited_graph_changes_nothing() -> None:
    """The graph is a view: read back as it is, it gives the same plan."""
    mission = optuav.load("paper")
    assert optuav.solve(
        mission, graph=optuav.graph(mission), perspective="battery"
    ) == optuav.solve(mission, perspective="battery")

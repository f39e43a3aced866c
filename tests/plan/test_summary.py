"""The plan in words: within 80 columns whatever the names, and true to the plan."""

from __future__ import annotations

import unicodedata

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav import Plan
from tests.examples import few
from tests.mission.strategies import NAMES
from tests.plan.made import INFEASIBLE, feasible, plans

PAPER = optuav.load("paper")
OPTIMAL = """\
Mission      paper
Problem      P1, trajectory optimal, perspective battery, continuous times
Answer       optimal with at most one rest and one hover in one piece (closed
             form: linear programming duality)
Flyable      NO, as its simulation shows

Hover         719.54 s   at hover, from 442.56 s
Rest          392.14 s   at b1, from 14.46 s
Flight         88.32 s   3 legs, up to 154.9 m/s
Mission      1200.00 s   exactly at the deadline
Route        origin → b1 → hover → destination
Charge left  5 % of the battery
Binding      state of charge; hover time

what    where                start s   for s        A      W  avail. %  bound %
flight  origin → b1             0.00   14.46   −98.99  −1583      97.5    100.0
rest    b1                     14.46  392.14   +10.00   +111     104.3    100.1
flight  b1 → hover            406.61   35.96  −103.27  −1672      97.9    100.1
hover   hover                 442.56  719.54   −87.91  −1205      −9.8     91.4
flight  hover → destination  1162.10   37.90  −103.48  −1677     −16.4     90.6
"""
"""Read by a person and compared with the digits of the specification."""


def columns(text: str) -> int:
    """Columns of a terminal that a line takes, counted letter by letter."""
    return sum(1 + (unicodedata.east_asian_width(letter) in "WF") for letter in text)


def lines(plan: Plan) -> list[str]:
    found = plan.summary().splitlines()
    assert all(columns(line) <= 80 for line in found)
    assert all(line.isprintable() and line == line.rstrip() for line in found)
    return found


@pytest.mark.parametrize("kind", plans())
def test_every_kind_of_plan_fits_into_80_columns(kind: str) -> None:
    lines(plans()[kind])


def test_the_summary_of_the_shipped_optimum() -> None:
    """As a whole, then the warnings."""
    text = plans()["optimal"].summary()
    assert text.startswith(OPTIMAL)
    words = " ".join(text.split())
    assert "runs dry at 1095.50 s: this plan cannot be flown" in words
    assert "past full at 157.03 s" in words


@pytest.mark.parametrize("kind", feasible())
def test_the_table_has_the_phases(kind: str) -> None:
    """One row a phase, with its times to two decimals."""
    plan = plans()[kind]
    found = lines(plan)
    first = found.index(next(line for line in found if line.startswith("what")))
    for phase, row in zip(plan.phases, found[first + 1 :], strict=False):
        what, *rest = row.split()
        assert what == phase.kind + "*" * phase.edited
        start_s, duration_s, current_A, power_W, *_ = rest[-6:]
        assert (start_s, duration_s) == (f"{phase.start_s:.2f}", f"{phase.duration_s:.2f}")
        numbers = f"{phase.current_A:+.2f} {phase.power_W:+.0f}".replace("-", "−")
        assert f"{current_A} {power_W}" == numbers
        assert phase.end_place in row
    assert "*: figures set in the graph." in found if kind == "edited" else "*" not in found


@pytest.mark.parametrize("kind", INFEASIBLE)
def test_an_infeasible_plan_says_so_instead_of_numbers(kind: str) -> None:
    """In capitals, with the reasons."""
    plan = plans()[kind]
    words = " ".join(plan.summary().split())
    assert "Answer INFEASIBLE" in words
    for reason in plan.reasons:
        assert reason in words
    assert "Hover" not in plan.summary()


def test_the_question_stands_at_the_top() -> None:
    """Problem, building, order, perspective, slots."""
    problem = lines(plans()["slots"])[1:3]
    assert " ".join(" ".join(problem).split()).startswith(
        "Problem P4, building b1, perspective battery, slots of 25 s"
    )
    assert "building b3, hover-first" in plans()["rest"].summary()
    assert "passes by b" in plans()["passing by"].summary()


def test_a_mission_that_leaves_time_says_how_much() -> None:
    """The energy perspective ends before the deadline, by 1200 − 75.79 − 524.63 s."""
    assert "599.58 s before the deadline" in plans()["energy"].summary()


@given(st.lists(NAMES | st.text("建物あ→Ωß🚁", min_size=150, max_size=200), min_size=1, max_size=3))
@settings(few(12))
def test_odd_names_fit(names: list[str]) -> None:
    """Long, wide, in any script; the table keeps its columns aligned."""
    reserved = {"origin", "hover", "destination"}
    stated = [
        {"name": name, "position_m": [50 + 1900 * (k % 2), 300, 60]}
        for k, name in enumerate(dict.fromkeys(names))
        if name not in reserved
    ]
    mission = PAPER.replace({"name": names[0], "buildings": stated})
    for each in stated:
        found = lines(optuav.solve(mission, optuav.P4(str(each["name"])), perspective="battery"))
        first = found.index(next(line for line in found if line.startswith("what")))
        assert len({columns(line) for line in found[first : first + 6]}) == 1


def test_very_large_numbers_leave_room_for_the_names() -> None:
    """A tiny battery, a day of flight: two digits and an exponent."""
    tiny = {"battery.capacity_As": 0.01, "limits.min_soc": 0.0}
    plan = plans()["direct"].model_copy(update={"mission": PAPER.replace(tiny)})
    found = [line for line in lines(plan) if line.startswith("flight")]
    assert all("e+" in line and "→ " in line for line in found)
    slow = optuav.load("paper-table2").replace(
        {"flight.max_speed_m_s": 0.05, "limits.deadline_s": 1e7, "battery.capacity_As": 1e8}
    )
    assert any(
        "hover → destination" in line
        for line in lines(optuav.solve(slow, "P3", perspective="battery"))
    )


def test_two_hundred_buildings_in_the_way_are_not_all_named() -> None:
    """Ten legs by name; the rest in passing."""
    wall = {"name": "wall", "position_m": [1000, 2300, 300], "footprint_m": [9000, 10]}
    roofs = [{"name": f"n{k}", "position_m": [k, 300, 20]} for k in range(200)]
    blocked = PAPER.replace({"buildings": [wall, *roofs]})
    plan = optuav.solve(blocked, optuav.P1(trajectory="traj1"), perspective="battery")
    assert len(plan.reasons) <= 4
    view = optuav.graph(blocked.replace({"flight.through_buildings": True}))
    view.remove_edges_from([edge for edge in view.edges if edge[0] in ("n3", "wall")])
    view.remove_edges_from([edge for edge in view.edges if edge[1].startswith("n")])
    plan = optuav.solve(blocked, optuav.P1(trajectory="traj2"), graph=view, perspective="battery")
    assert len(plan.reasons) == 11
    assert plan.reasons[-1] == "and other legs are blocked as well"
    assert len(lines(plan)) < 30

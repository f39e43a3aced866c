"""Figs. 3 to 6: which trajectory and which perspective hover longest, and what charge is left."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from formulations.perspectives import PAPER
from optuav.paper.curves.settings import DEADLINES_S
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value, setting

SAME = ("battery", "adjusted")
TRAJECTORIES = ("direct", "traj1", "traj2", "optimal")
SAME_S = 1e-6


def statements() -> Iterator[Statement]:
    """Deadlines of the captions, and what the text finds."""
    for number, deadline_s, what in (
        (3, DEADLINES_S[0], "hover time"),
        (4, DEADLINES_S[0], "charge left"),
        (5, DEADLINES_S[1], "hover time"),
        (6, DEADLINES_S[1], "charge left"),
    ):
        yield setting(
            f"fig{number}-deadline",
            f"Fig. {number}, caption and text",
            f"T_max of the {what}",
            deadline_s,
        )
    for number, deadline_s, stated, more in (
        (3, DEADLINES_S[0], "direct", "in every perspective"),
        (5, DEADLINES_S[1], "traj2", "which is the optimal one"),
    ):
        yield Statement(
            name=f"fig{number}-best",
            place=f"text on Fig. {number}",
            what=f"trajectory with the longest hover at {deadline_s:g} s, {more}",
            stated=stated,
            how="(P1) by trajectory, in every perspective of the paper",
            compute=partial(_best_trajectory, deadline_s),
        )
    yield Statement(
        name="fig3-energy",
        place="text on Fig. 3",
        what="whether the energy perspective hovers less than the two others",
        stated="yes",
        how="(P1) by trajectory at 800 s",
        compute=partial(_energy_is_shorter, DEADLINES_S[0]),
    )
    yield Statement(
        name="fig5-same",
        place="text on Fig. 5",
        what="whether battery and adjusted perspective have the same best hover time",
        stated="yes",
        how="(P1) at 1200 s, slots of 1 s",
        compute=_same_in_slots,
        reason=_why_same,
    )
    yield Statement(
        name="fig4-least",
        place="text on Fig. 4",
        what="whether η1 keeps η0 in all bars",
        stated="yes",
        how="η1 at the end of every plan at 800 s",
        compute=_keeps_least_charge,
    )


def _best_trajectory(deadline_s: float, scenario: Scenario) -> Value:
    """The trajectory that is best in all perspectives, or the best of each."""
    best = {name: _best_of(deadline_s, name, scenario) for name in PAPER}
    different = dict.fromkeys(best.values())
    if len(different) == 1:
        return best["battery"]
    return ", ".join(f"{name}: {way}" for name, way in best.items())


def _best_of(deadline_s: float, perspective: str, scenario: Scenario) -> str:
    hovers = {
        name: scenario.plan(
            {"limits.deadline_s": deadline_s}, trajectory=name, perspective=perspective
        ).hover_time_s
        for name in TRAJECTORIES
    }
    named = {name: hovers[name] for name in TRAJECTORIES[:-1]}
    best = max(named, key=lambda name: named[name])
    return best if named[best] >= hovers["optimal"] - SAME_S else "none of them"


def _same_in_slots(scenario: Scenario) -> Value:
    hovers = {scenario.plan(perspective=name, slot_s=1.0).hover_time_s for name in SAME}
    return "yes" if len(hovers) == 1 else "no"


def _why_same() -> str:
    battery_s, adjusted_s = (papers()[1].plan(perspective=name).hover_time_s for name in SAME)
    return (
        f"in continuous times of the recovered loads {battery_s:.2f} and {adjusted_s:.2f} s: they "
        f"would be one where E_1 and E_2 were not rounded to the printed voltages"
    )


def _energy_is_shorter(deadline_s: float, scenario: Scenario) -> Value:
    changes = {"limits.deadline_s": deadline_s}
    shorter = all(
        scenario.plan(changes, trajectory=way, perspective="energy").hover_time_s
        < scenario.plan(changes, trajectory=way, perspective=name).hover_time_s
        for way in TRAJECTORIES
        for name in SAME
    )
    return "yes" if shorter else "no"


def _keeps_least_charge(scenario: Scenario) -> Value:
    least = scenario.mission.limits.min_soc - 1e-9
    plans = (
        scenario.plan({"limits.deadline_s": 800}, trajectory=way, perspective=perspective)
        for way in TRAJECTORIES
        for perspective in PAPER
    )
    return "yes" if all((plan.soc or {})["battery"] >= least for plan in plans) else "no"

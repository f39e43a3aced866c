"""Exercises of lessons 15 to 18: brackets, packs that take turns, audits and several stops."""

from collections.abc import Mapping

import optuav
from optuav.exercises.answers import figure, figures, itinerary
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.witness import Condition, Conditions, Witness, flown, within
from optuav.judge import Itinerary, Stop, audit
from optuav.physics.packs import lifetime

ISLAND = {
    "battery.charge_current_A": 90.0,
    "laser.power_W": 12_000.0,
    "battery.available_fraction": 0.09,
}
CELL = {"capacity_As": 7200.0, "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}


def _flies(task: Task, *stops: tuple[str, str, float]) -> bool:
    return bool(audit(Itinerary(task.mission, tuple(Stop(*stop) for stop in stops))))


@Witness(
    "15.1",
    "The mission is the island of the lesson: a charging current of 90 A from a laser of 12 000 W, "
    "and 9 % of the charge available; the flow rate is {battery.flow_rate_per_s} per second. Some "
    "direct hovers are too short to be flown. Why? Answer with the letter, a hover that can be "
    "flown, and one up to 1 s shorter that cannot: ('a', {'flies_s': 400.0, 'fails_s': 399.5}).",
    {"battery.flow_rate_per_s": decimals(2.85e-4, 3.2e-4, 2e-7)},
    fixed=ISLAND,
    reasons={
        "The flight out nearly empties a small well, and the hover lets bound charge follow.": "",
        "A short hover leaves too much charge at the end.": "nothing limits that from above",
        "The laser charges less during a short hover, and the packs fall below 5 %.": (
            "look at what the audit says: which well, and when?"
        ),
        "The audit rounds short hovers down to 0 s.": "it simulates every second",
    },
    form=figures(flies_s=("s", 0.0, 2000.0), fails_s=("s", 0.0, 2000.0)),
)
def _shortest(task: Task, hovers: Mapping[str, float]) -> Conditions:
    flies_s, fails_s = hovers["flies_s"], hovers["fails_s"]
    words = f"{fails_s:g} s is not up to 1 s shorter than {flies_s:g} s"
    yield Condition(0.0 < flies_s - fails_s <= 1.0, words, "halve the interval between them")
    hint = "audit hovers of several lengths: where do they begin to pass?"
    yield Condition(_flies(task, ("hover", "hover", flies_s)), f"{flies_s:g} s cannot be flown", hint)
    words = f"{fails_s:g} s can be flown as well"
    yield Condition(not _flies(task, ("hover", "hover", fails_s)), words, hint)
    yield Condition(True, "the island begins between them")


@Witness(
    "15.2",
    "The battery may be charged with {battery.charge_current_A} A from a laser of 16 000 W, so "
    "that hovering charges it. Design an itinerary that can be flown and hovers at least 99 % of "
    "the best with at most one stop on a roof, which may last 0 s. Which limit ends such a hover?",
    {"battery.charge_current_A": decimals(132.0, 168.0, 0.5)},
    fixed={"laser.power_W": 16_000.0},
    form=itinerary,
)
def _charging(task: Task, plan: Itinerary) -> Conditions:
    yield from flown(plan, optuav.solve(task.mission).hover_time_s, 0.99)


@Witness(
    "16.1",
    "Two packs of {capacity_As} A s, ω = 0.625, k_F = 4.5e-5 per second, carry a constant current "
    "without a pause. Pooled they last longer than one after the other. Why? Answer with the "
    "letter and a current [A] with which they last {gain_s} s longer, within 1 s, as ('a', 5.0).",
    {"capacity_As": range(6000, 9001, 50), "gain_s": range(30, 160)},
    reasons={
        "Each gives half of the current, so more of its bound charge follows in time.": "",
        "Pooled, they hold more charge together.": "how much do the full packs hold either way?",
        "The second pack loses charge while it waits.": "a full pack keeps all its charge",
        "A pooled pack flows faster between its wells.": "k' is the same; what else is halved?",
    },
    form=figure("A", 0.5, 100.0),
)
def _pooled(task: Task, current_A: float) -> Conditions:
    cell = {**CELL, "capacity_As": float(task["capacity_As"])}
    pooled_s = lifetime([(current_A, 1e6)], packs=2, **cell)
    in_turn_s = lifetime([(current_A, 1e6)], packs=2, schedule="sequential", **cell)
    hint = "the gain shrinks as the current grows"
    yield within(pooled_s - in_turn_s, task["gain_s"], 1.0, "s", "the gain", hint)


@Witness(
    "17.1",
    "One pack holds {battery.capacity_As} A s. Somebody rests {first_s} s on b9, hovers 660 s, and "
    "rests {last_s} s on b10. Keep both rests, and design the longest hover between them that "
    "passes the audit: one that is 1 s longer must fail.",
    {
        "battery.capacity_As": range(30_000, 36_001, 100),
        "first_s": range(100, 231, 2),
        "last_s": range(200, 301, 2),
    },
    form=itinerary,
)
def _repaired(task: Task, plan: Itinerary) -> Conditions:
    stops = [(stop.at, stop.kind, stop.duration_s) for stop in plan.stops]
    first, last = ("b9", "rest", task["first_s"]), ("b10", "rest", task["last_s"])
    same = len(stops) == 3 and (stops[0], stops[2]) == (first, last)
    hint = f"keep {first} and {last}"
    yield Condition(same and stops[1][0] == "hover", "its stops are others", hint)
    hover_s = stops[1][2]
    words = f"{hover_s:g} s fails the audit"
    yield Condition(_flies(task, *stops), words, "optuav.audit(itinerary) lists all violations")
    longer = ("hover", "hover", hover_s + 1.0)
    words = f"{hover_s:g} s passes the audit"
    hint = "a hover that is 1 s longer passes as well"
    yield Condition(not _flies(task, first, longer, last), words, hint)


@Witness(
    "18.1",
    "One pack holds {battery.capacity_As} A s. A second rest lengthens the longest hover. Why? "
    "Answer with the letter and an itinerary with two rests that can be flown and hovers at least "
    "99 % of the best with two, which is more than any with one: ('a', [('b1', 'rest', 100.0), "
    "('hover', 'hover', 400.0), ('b2', 'rest', 100.0)]).",
    {"battery.capacity_As": range(29_000, 34_001, 20)},
    reasons={
        "One rest refills the well before the hover, the other saves charge for the way home.": "",
        "Two rests on two roofs charge with twice the current.": "the drone is on one roof at a time",
        "The way by two roofs is shorter than the direct one.": "compare the flight times",
        "By total charge, two rests return more than a longer one.": "that is where one is enough",
    },
    form=itinerary,
)
def _two_rests(task: Task, plan: Itinerary) -> Conditions:
    one_s, two_s = (
        optuav.solve(task.mission, optuav.P1(stops=stops)).hover_time_s for stops in (1, 2)
    )
    yield from flown(plan, two_s, max(0.99, one_s / two_s), rests=2)

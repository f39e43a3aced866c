"""Exercises of lessons 01 to 04 and 15 to 18: plans that fly, wells, packs, audits, stops."""

import math
from collections.abc import Mapping

import numpy as np

import optuav
from optuav.exercises.answers import ITINERARY, figure, figures
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predict, Predictions
from optuav.exercises.witness import Condition, Conditions, Witness, flown, within
from optuav.judge import Itinerary, Stop, audit
from optuav.options import SCHEDULES
from optuav.physics.kibam import Battery, Stage, step, time_to_empty
from optuav.physics.packs import lifetime

CAPACITY = {"battery.capacity_As": range(30_000, 42_001, 40)}
CELL = {"capacity_As": range(15_000, 25_001, 250), "share": decimals(0.4, 0.6, 0.01)}
FLOW_RATE_PER_S = 2e-4
ISLAND = {
    "battery.charge_current_A": 90.0,
    "laser.power_W": 12_000.0,
    "battery.available_fraction": 0.09,
}


def _flies(task: Task, hover_s: float, *rests: Stop) -> bool:
    """Whether a hover can be flown, after the first of two rests if there are any."""
    stops = (*rests[:1], Stop("hover", "hover", hover_s), *rests[1:])
    return bool(audit(Itinerary(task.mission, stops)))


@Witness(
    "01.1",
    "One pack of `paper` holds {battery.capacity_As} A s. Design a direct flight, without a rest, "
    "that can be flown and hovers at least 99 % of the longest such hover. `optuav.audit` says "
    "whether an itinerary can be flown; use no solver.",
    CAPACITY,
    form=ITINERARY,
)
def _direct(task: Task, plan: Itinerary) -> Conditions:
    return flown(plan, optuav.solve(task.mission, "P3").hover_time_s, 0.99, rests=0)


@Witness(
    "01.2",
    "One pack holds {battery.capacity_As} A s. The direct plan that counts all charge alike, "
    "`optuav.solve(task.mission, 'P3', perspective='battery')`, falls from the sky. Why? The "
    "witness is the charge [A s] left in the bound well at that moment, within 50 A s.",
    CAPACITY,
    reasons={
        "The available well is empty, and the charge that is left cannot follow fast enough.": "",
        "It draws more charge than both packs hold.": "how much charge does the plan keep?",
        "The deadline passes before it is back.": "compare the mission time with the deadline",
    },
    form=figure("A s", 0.0, 1e5),
)
def _falls(task: Task, bound_As: float) -> Conditions:
    replay = optuav.replay(optuav.solve(task.mission, "P3", perspective="battery"))
    trace, dry_s = replay.trace, replay.first_s("empty")
    left_As = float(np.interp(dry_s or math.nan, trace.time_s, trace.bound_As[:, 0]))
    hint = "optuav.replay(plan) has first_s('empty'), and its trace the wells over time"
    yield Condition(abs(bound_As - left_As) <= 50.0, f"{bound_As:g} A s are not what is left", hint)


@Predict(
    "02.1",
    "On `matrice350`, hovering draws {more:.1%} more current than stated "
    "(`flight.hover_current_A`). By how many percent does the longest direct hover (P3) shrink?",
    {"more": decimals(0.05, 0.6, 0.004)},
    "matrice350",
    unit="%",
    within=0.1,
)
def _more_current(task: Task) -> Predictions:
    more, stated_A = task["more"], task.mission.to_dict()["flight"]["hover_current_A"]
    hungry = task.mission.replace({"flight.hover_current_A": stated_A * (1.0 + more)})
    long_s, short_s = (optuav.solve(each, "P3").hover_time_s for each in (task.mission, hungry))
    hint = "solve both missions: the laser gives as much as before, and so does the flight take"
    yield 100.0 * (1.0 - short_s / long_s), hint
    yield 100.0 * more / (1.0 + more), "a time is a charge over a current, but the laser helps"
    yield 100.0 * more, "the time is divided by a factor; it does not fall by the same percentage"


def _cell(task: Task) -> Battery:
    return Battery(float(task["capacity_As"]), task["share"], FLOW_RATE_PER_S)


@Witness(
    "03.1",
    "A constant current discharges a battery of {capacity_As} A s with the available fraction "
    "{share} and the flow rate 2e-4 per second. Why does a larger current get less charge out of "
    "it? The witness is the current [A] that gets {out:.2%} out before the available well is "
    "empty, within 0.2 %.",
    {**CELL, "out": decimals(0.7, 0.9, 0.0025)},
    reasons={
        "The bound charge follows at a limited rate, and has less time to do so.": "",
        "The larger current loses charge as heat.": "every ampere-second that is drawn counts here",
        "The available well is smaller for a larger current.": "its width is fixed; what is left?",
    },
    form=figure("A", 0.1, 500.0),
)
def _out(task: Task, current_A: float) -> Conditions:
    battery = _cell(task)
    out_As = current_A * float(time_to_empty(battery, battery.full, -current_A))
    percent, hint = 100.0 * out_As / task["capacity_As"], "a smaller current gets more out"
    yield within("the share that comes out", percent, 100.0 * task["out"], 0.2, "%", hint)


@Witness(
    "03.2",
    "A full battery of {capacity_As} A s has the available fraction {share} and the flow rate "
    "2e-4 per second. Within {time_s} s, draw as much charge as you can: one current of {most_A} "
    "A at most, and then another until the end. The available well must not run dry. Design a "
    "load of at least 98 % of all that any load gets out.",
    {**CELL, "time_s": range(1000, 1501, 20), "most_A": range(40, 61)},
    form=figures(first_A=("A", 0.0, 60.0), first_s=("s", 0.0, 1500.0), then_A=("A", 0.0, 60.0)),
)
def _load(task: Task, load: Mapping[str, float]) -> Conditions:
    battery, most_A, time_s = _cell(task), float(task["most_A"]), float(task["time_s"])
    wells, drawn_As = battery.full, 0.0
    first_s = min(load["first_s"], time_s)
    for current_A, lasts_s in ((load["first_A"], first_s), (load["then_A"], time_s - first_s)):
        yield Condition(current_A <= most_A, f"{current_A:g} A are too much", "see the task")
        dry_s = float(time_to_empty(battery, wells, -current_A)) if current_A else math.inf
        words = f"{current_A:g} A run the available well dry after {dry_s:.1f} s"
        yield Condition(dry_s >= lasts_s, words, "draw less, or for less time")
        wells = step(battery, wells, Stage(-current_A, lasts_s))
        drawn_As += current_A * lasts_s
    # An empty available well makes the flow largest; from then on, draw just what flows in.
    dry_s = float(time_to_empty(battery, battery.full, -most_A))
    bound_As = step(battery, battery.full, Stage(-most_A, dry_s)).bound_As
    rate_per_s = FLOW_RATE_PER_S / (1.0 - task["share"])
    share = drawn_As / (most_A * dry_s - bound_As * math.expm1(-rate_per_s * (time_s - dry_s)))
    words = f"it gets {100.0 * share:.2f} % of the most out"
    hint = "when is the flow between the wells largest, and for how long?"
    yield Condition(share >= 0.98, words, hint, min(share, 1.0), True)


@Witness(
    "04.1",
    "One pack holds {battery.capacity_As} A s. The paper's way by b1, `optuav.solve(task.mission, "
    "optuav.P4('b1', order='rest-first'), perspective='battery')`, rests for minutes before it "
    "hovers. Which limit does it break first, and why? The witness is a plan with the same stops "
    "in the same order that can be flown and hovers at least 99.5 % of the best such plan.",
    CAPACITY,
    reasons={
        "Full: the flight out took little, so a long rest drives the available well past full.": "",
        "Empty: the rest begins with an empty available well.": "how much did one leg take?",
        "Deadline: the rest takes more time than there is.": "compare mission_time_s with it",
    },
    form=ITINERARY,
)
def _overfull(task: Task, plan: Itinerary) -> Conditions:
    same = [stop.at for stop in plan.stops] == ["b1", "hover"]
    yield Condition(same, "it has other stops", "rest on b1, then hover")
    best = optuav.solve(task.mission, optuav.P4("b1", order="rest-first"))
    yield from flown(plan, best.hover_time_s, 0.995)


@Witness(
    "04.2",
    "One pack holds {battery.capacity_As} A s. Design an itinerary with one rest at most that can "
    "be flown and hovers at least 99 % of the longest such hover. Where and when does a rest "
    "help, if the well must neither run dry nor be charged past full? Use `optuav.audit`, and no "
    "solver.",
    CAPACITY,
    form=ITINERARY,
)
def _one_rest(task: Task, plan: Itinerary) -> Conditions:
    return flown(plan, optuav.solve(task.mission).hover_time_s, 0.99)


@Witness(
    "15.1",
    "The mission is the island of the lesson: a charging current of 90 A from a laser of 12 000 "
    "W, and 9 % of the charge available; the flow rate is {battery.flow_rate_per_s} per second. "
    "Some direct hovers are too short to be flown. Why? The witness is a hover that can be flown, "
    "and one up to 1 s shorter that cannot.",
    {"battery.flow_rate_per_s": decimals(2.85e-4, 3.2e-4, 2e-7)},
    fixed=ISLAND,
    reasons={
        "The flight out nearly empties a small well, and the hover lets bound charge follow.": "",
        "A short hover leaves too much charge at the end.": "nothing limits that from above",
        "The laser charges less in a short hover, to below 5 % of the charge.": "ask the audit",
    },
    form=figures(flies_s=("s", 0.0, 2000.0), fails_s=("s", 0.0, 2000.0)),
)
def _shortest(task: Task, hovers: Mapping[str, float]) -> Conditions:
    flies_s, fails_s = hovers["flies_s"], hovers["fails_s"]
    words = f"{fails_s:g} s is not up to 1 s shorter than {flies_s:g} s"
    yield Condition(0.0 < flies_s - fails_s <= 1.0, words, "halve the interval between them")
    hint = "audit hovers of several lengths: where do they begin to pass?"
    yield Condition(_flies(task, flies_s), f"{flies_s:g} s cannot be flown", hint)
    fails = not _flies(task, fails_s)
    yield Condition(fails, f"{fails_s:g} s can be flown as well", hint)


@Witness(
    "15.2",
    "The battery may be charged with {battery.charge_current_A} A from a laser of 16 000 W, so "
    "that hovering charges it. Design an itinerary that can be flown and hovers at least 99 % of "
    "the best with at most one stop on a roof, which may last 0 s. Which limit ends such a hover?",
    {"battery.charge_current_A": decimals(132.0, 168.0, 0.5)},
    fixed={"laser.power_W": 16_000.0},
    form=ITINERARY,
)
def _charging(task: Task, plan: Itinerary) -> Conditions:
    return flown(plan, optuav.solve(task.mission).hover_time_s, 0.99)


@Witness(
    "16.1",
    "Two packs of {capacity_As} A s, ω = 0.625, k_F = 4.5e-5 per second, carry a constant current "
    "without a pause. Pooled they last longer than one after the other. Why? The witness is a "
    "current [A] with which they last {gain_s} s longer, within 1 s.",
    {"capacity_As": range(6000, 9001, 50), "gain_s": range(30, 160)},
    reasons={
        "Each gives half of the current, so more of its bound charge follows in time.": "",
        "Pooled, they hold more charge together.": "how much do the full packs hold either way?",
        "The second pack loses charge while it waits.": "a full pack keeps all its charge",
    },
    form=figure("A", 0.5, 100.0),
)
def _pooled(task: Task, current_A: float) -> Conditions:
    cell = Battery(float(task["capacity_As"]), 0.625, 4.5e-5)
    pooled_s, in_turn_s = (
        lifetime([(current_A, 1e6)], packs=2, schedule=schedule, **vars(cell))
        for schedule in SCHEDULES[:2]
    )
    hint = "the gain shrinks as the current grows"
    yield within("the gain", pooled_s - in_turn_s, task["gain_s"], 1.0, "s", hint)


@Witness(
    "17.1",
    "One pack holds {battery.capacity_As} A s. Somebody rests {first_s} s on b9, hovers 660 s, "
    "and rests {last_s} s on b10. Keep both rests, and design the longest hover between them that "
    "passes the audit: one that is 1 s longer must fail.",
    {
        "battery.capacity_As": range(30_000, 36_001, 100),
        "first_s": range(100, 231, 2),
        "last_s": range(200, 301, 2),
    },
    form=ITINERARY,
)
def _repaired(task: Task, plan: Itinerary) -> Conditions:
    first = Stop("b9", "rest", float(task["first_s"]))
    last = Stop("b10", "rest", float(task["last_s"]))
    same = len(plan.stops) == 3 and (plan.stops[0], plan.stops[2]) == (first, last)
    yield Condition(same and plan.stops[1].at == "hover", "its stops are others", "keep both rests")
    hover_s, hint = plan.stops[1].duration_s, "optuav.audit(itinerary) lists all violations"
    yield Condition(_flies(task, hover_s, first, last), f"{hover_s:g} s fails the audit", hint)
    fails = not _flies(task, hover_s + 1.0, first, last)
    yield Condition(fails, f"{hover_s:g} s passes the audit", "so does 1 s more", None, True)


@Witness(
    "18.1",
    "One pack holds {battery.capacity_As} A s. A second rest lengthens the longest hover. Why? "
    "The witness is an itinerary with two rests that can be flown and hovers at least 99 % of the "
    "best with two, and longer than any with one.",
    {"battery.capacity_As": range(29_000, 34_001, 20)},
    reasons={
        "One rest refills the well before the hover, the other saves charge for the way home.": "",
        "The way by two roofs is shorter than the direct one.": "compare the flight times",
        "By total charge, two rests return more than a longer one.": "there one is enough",
    },
    form=ITINERARY,
)
def _two_rests(task: Task, plan: Itinerary) -> Conditions:
    problems = (optuav.P1(stops=1), optuav.P1(stops=2))
    one_s, two_s = (optuav.solve(task.mission, problem).hover_time_s for problem in problems)
    return flown(plan, two_s, max(0.99, one_s / two_s), rests=2)

"""Exercises of lessons 01 to 04 and 15 to 18: plans that fly, wells, packs, audits, stops."""

import math
from collections.abc import Mapping

import numpy as np

import optuav
from optuav.exercises.answers import ITINERARY, numbers_by_name, one_number
from optuav.exercises.exercise import design, explain, predict
from optuav.exercises.measure import equals, flown, longest, within
from optuav.exercises.task import Condition, Conditions, Task
from optuav.judge import Itinerary, Stop, audit
from optuav.mission import load
from optuav.options import SCHEDULES
from optuav.physics.kibam import Battery, Stage, step, time_to_empty
from optuav.physics.packs import lifetime
from optuav.presentation.numbers import figure, percent, seconds

FLOW_RATE_PER_S = 2e-4


ISLAND = load("paper").replace(
    {
        **{"battery.charge_current_A": 90.0, "battery.available_fraction": 0.09},
        "laser.power_W": 12_000.0,
    }
)


def _flies(task: Task, hover_s: float, *rests: Stop) -> bool:
    """Whether a hover can be flown, after the first of two rests if there are any."""
    stops = (*rests[:1], Stop("hover", "hover", hover_s), *rests[1:])
    return bool(audit(Itinerary(task.mission, stops)))


@design("01.1", ITINERARY)
def _direct(task: Task, plan: Itinerary) -> Conditions:
    """One pack of `paper` holds {battery.capacity_As = 30000, 30040 .. 42000} A s. Design a direct
    flight, without a rest, that can be flown and lands with {left_As = 500, 520 .. 5000} A s in the
    available well, within 100 A s. With `stops = [optuav.judge.Stop('hover', 'hover', 400.0)]`,
    `optuav.replay(optuav.Itinerary(task.mission, stops))` flies your stops: `flyable` is its
    verdict, and `trace.available_As` is the charge over `trace.time_s`.
    """
    yield from flown(plan, rests=0)
    left_As = float(optuav.replay(plan).trace.available_As[-1, 0])
    hint = "each second of hover leaves less: how much does it draw, and which part flows over?"
    yield within("the charge at the landing", left_As, task["left_As"], 100.0, "A s", hint)


@explain("01.2", one_number("A s", 0.0, 1e5))
def _falls(task: Task, bound_As: float) -> Conditions:
    """One pack holds {battery.capacity_As = 30000, 30040 .. 42000} A s. The direct plan that counts
    all charge alike, `plan = optuav.solve(task.mission, 'P3', perspective='battery')`, falls from
    the sky. Why? The witness is the charge [A s] that is left in the bound well at that moment,
    within 50 A s. `optuav.plots.wells([plan])` draws both wells. `optuav.replay(plan)` has them as
    `trace.available_As` and `trace.bound_As` over `trace.time_s`.

    + The available well is empty, and bound charge cannot follow fast enough.
    - The flights and the hover together draw more charge than the two packs hold.
      how much charge is left in the plan?
    - The deadline passes while the drone is still on its way back to the origin.
      compare the mission time with the deadline
    """
    replay = optuav.replay(optuav.solve(task.mission, "P3", perspective="battery"))
    trace, dry_s = replay.trace, replay.first_s("empty")
    left_As = float(np.interp(dry_s or math.nan, trace.time_s, trace.bound_As[:, 0]))
    hint = "optuav.replay(plan).first_s('empty') is the moment at which the available well is empty"
    yield from equals(bound_As, left_As, 50.0, "A s", hint)


@predict("02.1", one_number("%"), "matrice350")
def _more_current(task: Task, percent: float) -> Conditions:
    """On `matrice350`, the longest direct hover (P3) shrinks by {less:.1% = 0.05, 0.051 .. 0.22} if
    hovering draws more current than stated (`flight.hover_current_A`). How many percent more does
    it draw?
    """
    less, stated_A = task["less"], task.mission.to_dict()["flight"]["hover_current_A"]
    factors = np.linspace(1.0, 1.3, 301)
    currents_A = {"flight.hover_current_A": (stated_A * factors).tolist()}
    hovers_s = optuav.batch_arrays(task.mission, currents_A, "P3")["hover_time_s"].ravel()
    factor = float(np.interp(less - 1.0, -hovers_s / hovers_s[0], factors))
    hint = "solve with other currents: the laser gives as much as before, the flights take as much"
    mistakes = (
        (100.0 * less / (1.0 - less), "a time is a charge over a current, but the laser helps"),
        (100.0 * less, "the time is divided by a factor; it does not fall by the same percentage"),
    )
    return equals(percent, 100.0 * (factor - 1.0), 0.05, "%", hint, *mistakes)


def _cell(task: Task) -> Battery:
    return Battery(float(task["capacity_As"]), task["share"], FLOW_RATE_PER_S)


@explain("03.1", one_number("A", 0.1, 500.0))
def _out(task: Task, current_A: float) -> Conditions:
    """A constant current discharges a battery of {capacity_As = 15000, 15250 .. 25000} A s with the
    available fraction {share = 0.4, 0.41 .. 0.6} and the flow rate 2e-4 per second. Why does a
    larger current get less charge out of the battery? The witness is the current [A] that gets
    {out:.2% = 0.7, 0.7025 .. 0.9} of the charge out before the available well is empty, within 0.2
    %.

    + Bound charge follows at a limited rate, and a larger current leaves it less time.
    - A larger current heats the battery, which turns a part of its charge into heat.
      every ampere-second that is drawn counts here
    - A larger current makes the available well narrower, so that it is empty sooner.
      the width of the well is fixed
    """
    battery = _cell(task)
    out_As = current_A * float(time_to_empty(battery, battery.full, -current_A))
    out = 100.0 * out_As / task["capacity_As"]
    hint = "the smaller the current, the more comes out"
    yield within("the share that comes out", out, 100.0 * task["out"], 0.2, "%", hint)


@design("03.2", numbers_by_name(first_A=500.0, first_s=1500.0, then_A=500.0))
def _load(task: Task, load: Mapping[str, float]) -> Conditions:
    """A full battery of {capacity_As = 15000, 15250 .. 25000} A s has the available fraction
    {share = 0.4, 0.41 .. 0.6} and the flow rate 2e-4 per second. Draw as much charge as you can
    within {time_s = 1000, 1020 .. 1500} s: first with one current, then with another until the end.
    Both are {most_A = 40, 41 .. 60} A at most. The available well must not run dry. Design a load
    that draws at least 98 % of the most that any load can draw.
    """
    battery, most_A, time_s = _cell(task), float(task["most_A"]), float(task["time_s"])
    wells, drawn_As = battery.full, 0.0
    first_s = min(load["first_s"], time_s)
    for current_A, lasts_s in ((load["first_A"], first_s), (load["then_A"], time_s - first_s)):
        words = f"{figure(current_A)} A are too much"
        yield Condition(current_A <= most_A, words, f"{figure(most_A)} A at most")
        dry_s = float(time_to_empty(battery, wells, -current_A)) if current_A else math.inf
        words = f"{figure(current_A)} A run the available well dry after {seconds(dry_s, 1)}"
        yield Condition(dry_s >= lasts_s, words, "draw less, or for less time")
        wells = step(battery, wells, Stage(-current_A, lasts_s))
        drawn_As += current_A * lasts_s
    # An empty available well makes the flow largest; from then on, draw just what flows in.
    dry_s = float(time_to_empty(battery, battery.full, -most_A))
    bound_As = step(battery, battery.full, Stage(-most_A, dry_s)).bound_As
    rate_per_s = FLOW_RATE_PER_S / (1.0 - task["share"])
    share = drawn_As / (most_A * dry_s - bound_As * math.expm1(-rate_per_s * (time_s - dry_s)))
    words = f"it draws {percent(share)} of the most"
    hint = "when is the flow between the wells largest, and for how long?"
    yield Condition(share >= 0.98, words, hint, min(share, 1.0), True)


@explain("04.1", one_number("s", 0.0, 1000.0))
def _overfull(task: Task, rest_s: float) -> Conditions:
    """One pack holds {battery.capacity_As = 30000, 30040 .. 42000} A s. The paper's way by b1,
    `optuav.solve(task.mission, optuav.P4('b1', order='rest-first'), perspective='battery')`, rests
    for minutes before it hovers. Which limit does it break first, and why? The witness is the
    length [s] of a rest on b1 before the hover that ends with {room_As = 100, 105 .. 900} A s
    missing from a full available well, within 5 A s.
    `optuav.replay(optuav.Itinerary(task.mission, stops))` flies stops such as
    `optuav.judge.Stop('b1', 'rest', 100.0)`, and has the wells over time as its `trace`.

    + Full: the flight out took little charge, so the rest overfills the available well.
    - Empty: the flight out took so much that the available well is empty before the rest.
      how much did one leg take?
    - Deadline: the rest and the hover last longer than the deadline leaves for both.
      compare mission_time_s with the deadline
    """
    stops = (Stop("b1", "rest", rest_s), Stop("hover", "hover", 60.0))
    replay = optuav.replay(Itinerary(task.mission, stops))
    ended_s = next(phase.end_s for phase in replay.phases if phase.kind == "rest")
    wells_As = replay.trace.available_As[:, 0]
    room_As = float(wells_As[0] - np.interp(ended_s, replay.trace.time_s, wells_As))
    hint = "a longer rest leaves less room, and too long a rest none"
    yield within("the room in the well", room_As, task["room_As"], 5.0, "A s", hint)


@design("04.2", ITINERARY)
def _one_rest(task: Task, plan: Itinerary) -> Conditions:
    """One pack holds {battery.capacity_As = 30000, 30040 .. 42000} A s, and the laser serves others
    as well: a rest may last {rest_s = 170, 171 .. 230} s at most. Design an itinerary with one rest
    at most that can be flown and hovers at least 99.5 % of the longest such hover. Where and when
    does a rest help, if the available well must neither run dry nor be charged past full?
    `optuav.audit(optuav.Itinerary(task.mission, stops))` judges stops such as
    `optuav.judge.Stop('b1', 'rest', 100.0)`.
    """
    most_s = float(task["rest_s"])
    for stop in plan.stops:
        words = f"it rests for {seconds(stop.duration_s, 1)}"
        short = stop.kind != "rest" or stop.duration_s <= most_s
        yield Condition(short, words, f"a rest may last {figure(most_s)} s at most")
    program = optuav.formulate(task.mission)
    for part in program.parts:
        if part.rests:
            part.model.subject_to("short rest", part.model.variables[1] <= most_s)
    yield from longest(plan, program.solve().hover_time_s, 0.995)


@explain("15.1", numbers_by_name(flies_s=2000.0, fails_s=2000.0), ISLAND)
def _shortest(task: Task, hovers: Mapping[str, float]) -> Conditions:
    """The mission is the island of the lesson: a charging current of 90 A from a laser of 12 000 W,
    and 9 % of the charge in the available well. The flow rate is
    {battery.flow_rate_per_s = 0.000285, 0.0002852 .. 0.00032} per second. Some direct hovers are
    too short to be flown. Why? The witness is a hover that can be flown, and one that cannot and is
    up to 1 s shorter.

    + The flight out nearly empties the small well, and a hover gives bound charge time to follow.
    - After a short hover, more charge is left at the end than the limits of the mission allow.
      no limit bounds the charge at the end from above
    - The laser charges too little in a short hover, so the charge ends below the required 5 %.
      which limit does optuav.audit name?
    """
    flies_s, fails_s = hovers["flies_s"], hovers["fails_s"]
    words = (
        f"fails_s must be shorter than flies_s, by 1 s at most: {figure(fails_s)} s, "
        f"{figure(flies_s)} s"
    )
    yield Condition(0.0 < flies_s - fails_s <= 1.0, words, "halve the interval between them")
    hint = "audit hovers of several lengths: where do they begin to pass?"
    yield Condition(_flies(task, flies_s), f"{figure(flies_s)} s cannot be flown", hint)
    fails = not _flies(task, fails_s)
    yield Condition(fails, f"{figure(fails_s)} s can be flown as well", hint)


@explain("16.1", one_number("A", 0.5, 100.0))
def _pooled(task: Task, current_A: float) -> Conditions:
    """Two packs of {capacity_As = 6000, 6050 .. 9000} A s with ω = 0.625 and k_F = 4.5e-5 per
    second carry a constant current without a pause. Pooled, they last longer than one after the
    other. Why? The witness is a current [A] at which the pooled packs last
    {gain_s = 30, 31 .. 159} s longer, within 1 s.

    + Each pack gives half of the current, so more of its bound charge follows in time.
    - Pooled, the two packs hold more charge than they hold when one follows the other.
      how much do the full packs hold either way?
    - The second pack loses a part of its charge while it waits for the first one to end.
      a full pack keeps all its charge
    """
    cell = Battery(float(task["capacity_As"]), 0.625, 4.5e-5)
    pooled_s, in_turn_s = (
        lifetime([(current_A, 1e6)], packs=2, schedule=schedule, **vars(cell))
        for schedule in SCHEDULES[:2]
    )
    hint = "the larger the current, the smaller the gain"
    yield within("the gain", pooled_s - in_turn_s, task["gain_s"], 1.0, "s", hint)


@design("17.1", ITINERARY)
def _repaired(task: Task, plan: Itinerary) -> Conditions:
    """One pack holds {battery.capacity_As = 30000, 30100 .. 36000} A s. An itinerary rests
    {first_s = 100, 102 .. 230} s on b9, hovers 660 s, and rests {last_s = 200, 202 .. 300} s on
    b10. Keep both rests, and design the longest hover between them that passes the audit: a hover
    that is 1 s longer must fail.
    """
    first = Stop("b9", "rest", float(task["first_s"]))
    last = Stop("b10", "rest", float(task["last_s"]))
    same = len(plan.stops) == 3 and (plan.stops[0], plan.stops[2]) == (first, last)
    words, hint = "the rests are not those of the task", "change only the hover between them"
    yield Condition(same and plan.stops[1].at == "hover", words, hint)
    hover_s, hint = plan.stops[1].duration_s, "optuav.audit(itinerary) lists all violations"
    yield Condition(
        _flies(task, hover_s, first, last), f"{figure(hover_s)} s fails the audit", hint
    )
    fails = not _flies(task, hover_s + 1.0, first, last)
    yield Condition(
        fails, f"{figure(hover_s)} s passes the audit", "1 s more passes too", None, True
    )


@explain("18.1", ITINERARY)
def _two_rests(task: Task, plan: Itinerary) -> Conditions:
    """One pack holds {battery.capacity_As = 29000, 29020 .. 34000} A s. A second rest lengthens the
    longest hover. Why? The witness is an itinerary with two rests that can be flown and hovers at
    least 99 % of the longest hover with two rests, and longer than any with one.

    + One rest refills the well before the hover, the other gives charge for the way home.
    - The way by two roofs is shorter than the direct way, so the flights take less charge.
      compare the flight times
    - By total charge, two rests on two roofs return more than one rest of the same time.
      by total charge, is a second rest worth anything?
    """
    problems = (optuav.P1(stops=1), optuav.P1(stops=2))
    one_s, two_s = (optuav.solve(task.mission, problem).hover_time_s for problem in problems)
    return longest(plan, two_s, max(0.99, one_s / two_s), rests=2)

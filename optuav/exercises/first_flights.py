"""Exercises of lessons 01 to 04: a mission, a drone, its battery and when it runs dry."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

import optuav
from optuav.errors import Fault, InputError
from optuav.exercises.answers import figure, finite, itinerary
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predict, Predictions
from optuav.exercises.witness import Condition, Conditions, Witness, flown, within
from optuav.judge import Itinerary
from optuav.mission.messages import shown
from optuav.physics.kibam import Battery, Stage, step, time_to_empty

PACKS = {"battery.capacity_As": range(28_000, 42_001, 40)}
MOST_STAGES = 8


@Witness(
    "01.1",
    "One pack of `paper` holds {battery.capacity_As} A s. Design a direct flight, without a rest, "
    "that can be flown and hovers at least 99 % of the longest such hover. `optuav.audit` says "
    "whether an itinerary can be flown; use no solver. Answer with stops in order, as "
    "[('hover', 'hover', 400.0)].",
    PACKS,
    form=itinerary,
)
def _direct(task: Task, plan: Itinerary) -> Conditions:
    yield from flown(plan, optuav.solve(task.mission, "P3").hover_time_s, 0.99, rests=0)


@Witness(
    "01.2",
    "One pack holds {battery.capacity_As} A s. The direct plan that counts all charge alike, "
    "`optuav.solve(task.mission, 'P3', perspective='battery')`, falls from the sky. Why? Answer "
    "with the letter of the reason and the charge [A s] that the bound well still holds at that "
    "moment, as ('a', 9000.0); 50 A s more or less are accepted.",
    PACKS,
    reasons={
        "The available well is empty, and the charge that is left cannot follow fast enough.": "",
        "It draws more charge than both packs hold.": "how much charge does the plan keep?",
        "The deadline passes before it is back.": "compare the mission time with the deadline",
        "It was charged past full on the way.": "the direct plan rests nowhere",
    },
    form=figure("A s", 0.0, 1e5),
)
def _falls(task: Task, bound_As: float) -> Conditions:
    replay = optuav.replay(optuav.solve(task.mission, "P3", perspective="battery"))
    trace, dry_s = replay.trace, replay.first_s("empty")
    left_As = float(np.interp(dry_s or math.nan, trace.time_s, trace.bound_As[:, 0]))
    hint = "optuav.replay(plan) has first_s('empty'), and its trace the wells over time"
    words = f"{bound_As:.6g} A s are not what is left"
    yield Condition(abs(bound_As - left_As) <= 50.0, words, hint)
    yield Condition(True, "so much charge falls with the drone")


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
    more, flight = task["more"], task.mission.to_dict()["flight"]
    hungry = {"flight.hover_current_A": flight["hover_current_A"] * (1.0 + more)}
    long_s, short_s = (
        optuav.solve(mission, "P3").hover_time_s
        for mission in (task.mission, task.mission.replace(hungry))
    )
    hint = "solve both missions: the laser's share stays, and so does what flying takes"
    yield 100.0 * (1.0 - short_s / long_s), hint
    yield 100.0 * more / (1.0 + more), "a time is a charge over a current, but the laser helps"
    yield 100.0 * more, "the time is divided by a factor; it does not fall by the same percentage"


CELL = {"capacity_As": range(15_000, 25_001, 250), "available_fraction": decimals(0.4, 0.6, 0.01)}


def _cell(task: Task) -> Battery:
    return Battery(float(task["capacity_As"]), task["available_fraction"], 2e-4)


@Witness(
    "03.1",
    "A battery of {capacity_As} A s with the available fraction {available_fraction} and the flow "
    "rate 2e-4 per second is discharged by a constant current. Why does a larger current get less "
    "charge out of it? Answer with the letter of the reason and the current [A] that gets "
    "{share:.1%} out before the available well is empty, as ('a', 20.0).",
    {**CELL, "share": decimals(0.7, 0.95, 0.005)},
    reasons={
        "The bound charge follows at a limited rate, and has less time to do so.": "",
        "The larger current loses charge as heat.": "every ampere-second that is drawn counts here",
        "The available well is smaller for a larger current.": "its width is fixed; what is left?",
        "The bound charge stops flowing when the current is large.": "the flow follows the heights",
    },
    form=figure("A", 1.0, 500.0),
)
def _share(task: Task, current_A: float) -> Conditions:
    battery = _cell(task)
    out = float(time_to_empty(battery, battery.full, -current_A)) * current_A / task["capacity_As"]
    hint = "less current gets more out" if out < task["share"] else "more current gets less out"
    yield within(100.0 * out, 100.0 * task["share"], 0.2, "%", "the share that comes out", hint)


def _stages(task: Task, answer: object) -> list[Stage]:
    """Read a load: pairs of current and duration."""
    words = f"1 to {MOST_STAGES} pairs of a current from 0 to {task['most_A']} A and a time [s]"
    found = list[Stage]()
    pairs: Sequence[Any] = answer if isinstance(answer, list | tuple) else ()
    for pair in pairs[: MOST_STAGES + 1]:
        values = [finite(value) for value in pair] if isinstance(pair, list | tuple) else []
        match values:
            case [float(current_A), float(time_s)] if 0 <= current_A <= task["most_A"]:
                found += [Stage(-current_A, time_s)] if 0 <= time_s <= 1e5 else []
    if not found or len(found) != len(pairs):
        raise InputError([Fault("answer", shown(answer), words)])
    return found


@Witness(
    "03.2",
    "A full battery of {capacity_As} A s has the available fraction {available_fraction} and the "
    "flow rate 2e-4 per second. Within {time_s} s, draw as much charge as you can with {most_A} A "
    "at most: design a load of 1 to 8 stages of constant current, as [(20.0, 300.0), (5.0, 100.0)]. "
    "The available well must not run dry. At least 98.5 % of the most that is possible are "
    "required. When is it best to draw much: early or late?",
    {**CELL, "time_s": range(1000, 1501, 20), "most_A": range(40, 61)},
    form=_stages,
)
def _load(task: Task, load: list[Stage]) -> Conditions:
    battery, most_A, time_s = _cell(task), float(task["most_A"]), float(task["time_s"])
    total_s = sum(stage.duration_s for stage in load)
    words = f"the load takes {total_s:g} s"
    yield Condition(total_s <= time_s + 1e-6, words, f"there are {time_s:g} s")
    wells, drawn_As = battery.full, 0.0
    for number, stage in enumerate(load, 1):
        lasts_s = float(time_to_empty(battery, wells, stage.current_A))
        words = f"stage {number} runs the available well dry after {lasts_s:.1f} s"
        yield Condition(lasts_s >= stage.duration_s - 1e-6, words, "draw less there, or for less time")
        wells = step(battery, wells, stage)
        wells = wells._replace(available_As=max(wells.available_As, 0.0))  # By rounding at the end
        drawn_As -= stage.current_A * stage.duration_s
    # An empty available well makes the flow largest; from then on, draw just what flows in.
    dry_s = float(time_to_empty(battery, battery.full, -most_A))
    bound_As = step(battery, battery.full, Stage(-most_A, dry_s)).bound_As
    rate_per_s = 2e-4 / (1.0 - task["available_fraction"])
    most_As = most_A * dry_s - bound_As * math.expm1(-rate_per_s * (time_s - dry_s))
    share = drawn_As / most_As
    words = f"it draws {100.0 * share:.2f} % of the most that is possible"
    yield Condition(share >= 0.985, words, "when is the flow between the wells largest?", min(share, 1.0))


@Witness(
    "04.1",
    "One pack holds {battery.capacity_As} A s. Design an itinerary with one rest at most that can "
    "be flown and hovers at least 99 % of the longest such hover. Where and when does a rest help, "
    "if the well must neither run dry nor be charged past full? Use `optuav.audit`, and no solver. "
    "Answer with stops in order, as [('b1', 'rest', 100.0), ('hover', 'hover', 400.0)].",
    {"battery.capacity_As": range(30_000, 42_001, 40)},
    form=itinerary,
)
def _one_rest(task: Task, plan: Itinerary) -> Conditions:
    yield from flown(plan, optuav.solve(task.mission).hover_time_s, 0.99)


@Witness(
    "04.2",
    "One pack holds {battery.capacity_As} A s. The paper's way to b1, `optuav.solve(task.mission, "
    "optuav.P4('b1', order='rest-first'), perspective='battery')`, rests for minutes before it "
    "hovers. Which limit does it break first, and why? Answer with the letter and a plan with the "
    "same stops in the same order that can be flown and hovers at least 99.5 % of the best such "
    "plan, as ('a', [('b1', 'rest', 100.0), ('hover', 'hover', 400.0)]).",
    {"battery.capacity_As": range(30_000, 42_001, 40)},
    reasons={
        "Full: the flight out took little, so a long rest drives the available well past full.": "",
        "Empty: the rest begins with an empty available well.": "how much has one leg taken by then?",
        "Empty: the laser is too weak on b1 to charge at all.": "see the current of the rest phase",
        "Deadline: the rest takes more time than there is.": "compare mission_time_s with it",
    },
    form=itinerary,
)
def _overfull(task: Task, plan: Itinerary) -> Conditions:
    stops = [(stop.at, stop.kind) for stop in plan.stops]
    same = stops == [("b1", "rest"), ("hover", "hover")]
    yield Condition(same, "it has other stops", "rest on b1, then hover")
    best = optuav.solve(task.mission, optuav.P4("b1", order="rest-first"))
    yield from flown(plan, best.hover_time_s, 0.995)

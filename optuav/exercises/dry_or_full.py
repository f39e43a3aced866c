"""Exercises of the third part: brackets, packs that take turns, audits and several stops."""

import math

import optuav
from optuav.exercises.design import design
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predictions, predict
from optuav.judge import Stop, audit
from optuav.physics.packs import lifetime

ISLAND = {
    "battery.charge_current_A": 90.0,
    "laser.power_W": 12_000.0,
    "battery.available_fraction": 0.09,
}
CELL = {"capacity_As": 7200.0, "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}


def _limit(task: Task, good_s: float, bad_s: float, *rests: Stop) -> float:
    """Where hovers begin to fail the audit [s], between one that passes and one that does not.

    The first rest is before the hover, the second after it.
    """
    while abs(bad_s - good_s) > 0.01:
        half_s = (good_s + bad_s) / 2.0
        stops = (*rests[:1], Stop("hover", "hover", half_s), *rests[1:])
        if audit(optuav.Itinerary(task.mission, stops)):
            good_s = half_s
        else:
            bad_s = half_s
    return good_s


@predict(
    "15.1",
    "A hover of 0 s can be flown, one of {high_s} s cannot, and every hover shorter than one that "
    "can be flown can be flown too. How often must the interval be halved until it is at most "
    "{within_s:g} s long?",
    draws={"high_s": range(200, 2001, 50), "within_s": tuple(10.0**-k for k in range(10))},
)
def _halvings(task: Task) -> Predictions:
    ratio = task["high_s"] / task["within_s"]
    yield math.ceil(math.log2(ratio)), "n halvings divide the interval by 2 to the power n"
    yield math.floor(math.log2(ratio)), "one more is needed to get below the wanted length"
    yield math.ceil(ratio), "each halving leaves half of what was left, and not a fixed piece less"


@predict(
    "15.2",
    "The mission is the island of the lesson: a charging current of 90 A from a laser of 12 000 W, "
    "and 9 % of the charge available; the flow rate is {battery.flow_rate_per_s} per second. What "
    "is the shortest direct hover [s] that can be flown?",
    unit="s",
    within=1.0,
    draws={"battery.flow_rate_per_s": decimals(2.85e-4, 3.2e-4, 1e-6)},
    fixed=ISLAND,
)
def _shortest(task: Task) -> Predictions:
    hint = "audit hovers of several lengths; a short one leaves too little for the way home"
    yield _limit(task, 500.0, 0.0), hint
    yield 0.0, "the way home takes more from the available well than the flight out has left in it"


@design(
    "15.3",
    "The battery may be charged with {battery.charge_current_A} A from a laser of 16 000 W, so "
    "that hovering charges it. Design an itinerary that can be flown and hovers at least 99 % of "
    "the best with at most one stop on a roof, which may last 0 s. Which limit ends such a hover?",
    least=0.99,
    rests=1,
    draws={"battery.charge_current_A": range(132, 168)},
    fixed={"laser.power_W": 16_000.0},
)
def _charging(task: Task) -> float:
    return optuav.solve(task.mission).hover_time_s


@predict(
    "16.1",
    "{packs} packs take turns so short that they do not matter, under a load of {current_A} A. "
    "Which mean current [A] does each pack give?",
    unit="A",
    within=0.01,
    draws={"packs": (2, 3, 4, 5), "current_A": range(20, 121)},
)
def _mean_current(task: Task) -> Predictions:
    yield task["current_A"] / task["packs"], "each works a share of the time, and rests otherwise"
    yield task["current_A"], "so much it gives while it works, but it does not work always"


@predict(
    "16.2",
    "Two packs of 7200 A s, ω = 0.625, k_F = 4.5e-5 per second, carry {current_A} A without a "
    "pause. By how many seconds do they last longer pooled than one after the other?",
    unit="s",
    within=0.2,
    draws={"current_A": decimals(3.0, 9.0, 0.02)},
)
def _pooled(task: Task) -> Predictions:
    load = [(task["current_A"], 1.0)]
    pooled_s = lifetime(load, packs=2, schedule="pooled", **CELL)
    in_turn_s = lifetime(load, packs=2, schedule="sequential", **CELL)
    hint = "pooled, each pack gives half of the current; a lower current gets more out of a pack"
    yield pooled_s - in_turn_s, hint
    yield pooled_s, "that is how long the pooled packs last"
    yield in_turn_s, "that is how long they last one after the other"
    yield 0.0, "the same charge is in them, but not the same part of it can be drawn"


@predict(
    "16.3",
    "Hovering draws {draw_A} A. The laser charges with {charge_A} A the pack that is not flying, "
    "in turns of 5 s. By how many A s does the charge in both packs together fall in a minute?",
    unit="A s",
    within=1.0,
    draws={"draw_A": range(80, 121), "charge_A": range(4, 25)},
)
def _both_packs(task: Task) -> Predictions:
    draw_A, charge_A = task["draw_A"], task["charge_A"]
    yield 60.0 * (draw_A - charge_A), "one pack always flies, and one is always charged"
    yield 60.0 * draw_A, "the pack that does not fly is charged meanwhile"
    yield 30.0 * (draw_A - charge_A), "there is no time at which neither flies"


@predict(
    "17.1",
    "A plan for `paper` rests {first_s} s on b9, hovers {hover_s} s, and rests {last_s} s on b10. "
    "By how many seconds does it miss the deadline of 1200 s?",
    unit="s",
    within=0.1,
    draws={
        "first_s": range(180, 301),
        "hover_s": range(640, 701, 5),
        "last_s": range(240, 331),
    },
)
def _late(task: Task) -> Predictions:
    rests_s = task["first_s"] + task["last_s"]
    stops = (
        Stop("b9", "rest", task["first_s"]),
        Stop("hover", "hover", task["hover_s"]),
        Stop("b10", "rest", task["last_s"]),
    )
    found = audit(optuav.Itinerary(task.mission, stops)).replay
    assert found
    late_s = found.times_s["mission_time_s"] - 1200.0
    yield late_s, "the audit prints the times of the itinerary; legs take time as well"
    yield rests_s + task["hover_s"] - 1200.0, "the flights are part of the mission"


@predict(
    "17.2",
    "One pack holds {battery.capacity_As} A s. A plan flies straight to the hover point and hovers "
    "until it falls. When [s after take-off] is the available well empty?",
    unit="s",
    within=0.5,
    draws={"battery.capacity_As": range(28_000, 40_001, 100)},
)
def _dry(task: Task) -> Predictions:
    stops = (Stop("hover", "hover", 1000.0),)
    falls = audit(optuav.Itinerary(task.mission, stops)).replay
    assert falls
    dry_s = falls.first_s("empty")
    assert dry_s is not None
    yield dry_s, "audit a hover that is far too long, and read the first violation"
    yield dry_s - falls.phases[0].end_s, "the time counts from the take-off"


@predict(
    "17.3",
    "One pack holds {battery.capacity_As} A s. Somebody rests {first_s} s on b9, hovers 660 s, and "
    "rests {last_s} s on b10. Keep the rests, and shorten the hover until the plan passes the "
    "audit. How long [s] may it be?",
    unit="s",
    within=1.0,
    draws={
        "battery.capacity_As": range(30_000, 36_001, 100),
        "first_s": range(100, 231, 2),
        "last_s": range(200, 301, 2),
    },
)
def _shortened(task: Task) -> Predictions:
    rests = Stop("b9", "rest", task["first_s"]), Stop("b10", "rest", task["last_s"])
    hint = "halve the interval between a hover that passes and one that fails"
    yield _limit(task, 400.0, 660.0, *rests), hint
    yield 660.0, "the audit says that this one falls"


@predict(
    "18.1",
    "The legs b1 to b9 and b9 to hover take {first_s} s and {second_s} s, and b1 to hover "
    "{direct_s} s. By how many seconds is the way by b9 shorter? (Negative if it is longer.)",
    unit="s",
    within=0.05,
    draws={
        "first_s": decimals(4.0, 25.0, 0.5),
        "second_s": decimals(4.0, 25.0, 0.5),
        "direct_s": decimals(20.0, 40.0, 0.5),
    },
)
def _triangle(task: Task) -> Predictions:
    saved_s = task["direct_s"] - task["first_s"] - task["second_s"]
    hint = "if it is shorter, the legs break the triangle inequality"
    yield saved_s, hint


@predict(
    "18.2",
    "The laser gives 10 A during a rest of {rest_s} s, and the available well rises by {rise_As} "
    "A s meanwhile. How many A s came from the bound well?",
    unit="A s",
    within=1.0,
    draws={"rest_s": range(240, 251), "rise_As": range(3050, 3121)},
)
def _flowed(task: Task) -> Predictions:
    # Of all that may be drawn a flow of 2.2 to 3 A, less than the largest one of 3.24 A.
    charged_As = 10.0 * task["rest_s"]
    yield task["rise_As"] - charged_As, "what the laser did not bring has flowed over"
    yield task["rise_As"], "part of it is from the laser"
    yield charged_As, "that is what the laser has brought"


@design(
    "18.3",
    "One pack holds {battery.capacity_As} A s. Design an itinerary with two rests that can be "
    "flown and hovers at least 99 % of the best with two rests.",
    least=0.99,
    rests=2,
    draws={"battery.capacity_As": range(29_000, 34_001, 20)},
)
def _two_rests(task: Task) -> float:
    return optuav.solve(task.mission, optuav.P1(stops=2)).hover_time_s

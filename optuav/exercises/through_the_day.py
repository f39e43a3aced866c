"""Exercises on service through the day: cycles, fleets, the way back, and plans that hold."""

import math

import optuav
from optuav.exercises.design import design
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predictions, predict
from optuav.physics.kibam import Battery, Stage, Tilted, tilted_after


@predict(
    "31.1",
    "From full, {usable_As} A s may be drawn. The flights of a cycle take {flight_s} s and "
    "{flight_As} A s, hovering draws {hover_A} A, and resting returns {rest_A} A. Counted by "
    "charge alone, what share of the time [%] does the best endless cycle hover?",
    unit="%",
    within=0.005,
    draws={
        "usable_As": range(30_000, 70_001, 500),
        "flight_s": range(30, 121, 5),
        "flight_As": range(2000, 6001, 100),
        "hover_A": range(15, 91),
        "rest_A": range(4, 15),
    },
)
def _share(task: Task) -> Predictions:
    usable_As, rest_s = task["usable_As"], task["usable_As"] / task["rest_A"]
    hover_s = (usable_As - task["flight_As"]) / task["hover_A"]
    hint = "the longest hover is the best, and the rest returns all that was drawn"
    yield 100.0 * hover_s / (hover_s + task["flight_s"] + rest_s), hint
    short_s = rest_s - task["flight_As"] / task["rest_A"]
    whole_s = hover_s + task["flight_s"] + short_s
    yield 100.0 * hover_s / whole_s, "the flights draw charge too, and the rest returns it"
    free = 100.0 * task["rest_A"] / (task["rest_A"] + task["hover_A"])
    yield free, "that is the limit for flights that cost neither time nor charge"


@design(
    "31.2",
    "The deadline is {limits.deadline_s} s and the batteries charge with "
    "{battery.charge_current_A} A. Design an itinerary that hovers, rests once on a roof and "
    "hovers again, and hovers in all at least 98.5 % of the best with one rest.",
    least=0.985,
    rests=1,
    draws={
        "limits.deadline_s": range(3000, 6001, 50),
        "battery.charge_current_A": decimals(8.0, 12.0, 0.25),
    },
)
def _twice(task: Task) -> float:
    return optuav.solve(task.mission, optuav.P1(stops=1, hovers=2)).hover_time_s


@predict(
    "32.1",
    "{drones} drones cover all the time. From full, {usable_As} A s may be drawn; the flights of "
    "a cycle take {flight_s} s and {flight_As} A s, and hovering draws {hover_A} A. Counted by "
    "charge alone, which current [A] must each place to rest return at least?",
    unit="A",
    within=0.005,
    draws={
        "drones": range(3, 7),
        "usable_As": range(25_000, 45_001, 250),
        "flight_s": range(40, 121, 5),
        "flight_As": range(1000, 2501, 50),
        "hover_A": decimals(14.0, 20.0, 0.25),
    },
)
def _pad(task: Task) -> Predictions:
    hover_s = (task["usable_As"] - task["flight_As"]) / task["hover_A"]
    away_s = (task["drones"] - 1) * hover_s
    hint = "while the others hover in turn, one flies and rests: how long may it rest?"
    yield task["usable_As"] / (away_s - task["flight_s"]), hint
    yield task["usable_As"] / away_s, "flying there and back takes its part of that time"
    less_As = task["usable_As"] - task["flight_As"]
    yield less_As / (away_s - task["flight_s"]), "the flights draw charge too"


@predict(
    "32.2",
    "{devices} devices at equal distance are covered all the time. A cycle hovers for {hover_s} s, "
    "flies for {flight_s} s and rests for {rest_s} s. How many drones fewer does a shared fleet "
    "need than a ring of drones for each device?",
    draws={
        "devices": range(20, 121),
        "hover_s": range(800, 1801, 10),
        "flight_s": range(40, 121, 5),
        "rest_s": range(1500, 6001, 20),
    },
)
def _shared(task: Task) -> Predictions:
    away = (task["flight_s"] + task["rest_s"]) / task["hover_s"]
    saved = task["devices"] * math.ceil(away) - math.ceil(task["devices"] * away)
    yield saved, "a ring rounds up for each device, and a shared fleet rounds up once"
    flown = task["rest_s"] / task["hover_s"]
    wrong = task["devices"] * math.ceil(flown) - math.ceil(task["devices"] * flown)
    yield wrong, "a drone on the way serves nobody either"


@predict(
    "33.1",
    "A flight home takes {flight_s} s with {flight_A} A. The battery has the available fraction "
    "{available_fraction} and the flow rate {flow_rate_per_s} per second. What is g [A s] of the "
    "rule on board, which leaves when a y1 + b y2 < g?",
    unit="A s",
    within=0.5,
    draws={
        "flight_s": range(60, 301, 5),
        "flight_A": range(40, 121),
        "available_fraction": decimals(0.2, 0.8, 0.05),
        "flow_rate_per_s": decimals(0.0002, 0.002, 0.0001),
    },
)
def _threshold(task: Task) -> Predictions:
    battery = Battery(36_000.0, task["available_fraction"], task["flow_rate_per_s"])
    way = Stage(-task["flight_A"], task["flight_s"])
    gained = tilted_after(battery, Tilted(0.0, 0.0), way).wells(battery).available_As
    hint = "begin with empty wells, and see what the flight leaves in the available one"
    yield -float(gained), hint
    yield task["flight_A"] * task["flight_s"], "some of that flows in from the bound well meanwhile"


@predict(
    "33.2",
    "The drone begins with {start.soc} of its charge, in level wells. At the latest how many "
    "seconds [s] after its arrival must it leave the hover point for the destination?",
    unit="s",
    within=0.05,
    draws={"start.soc": decimals(0.4, 0.99, 0.005)},
)
def _late(task: Task) -> Predictions:
    row = optuav.return_by(task.mission).rows[0]
    yield row["latest_s"], "optuav.return_by takes the mission of the task"
    yield row["soc_s"], "the available well is empty before that"


@predict(
    "34.1",
    "From full, {usable_As} A s may be drawn. Flights draw {flight_As} A s, hovering draws "
    "{hover_A} A and receives {laser_A} A from the laser. All that is drawn may be {percent} % "
    "more or less. Counted by charge alone, for how long [s] may a direct flight hover at every "
    "drain in that range?",
    unit="s",
    within=0.05,
    draws={
        "usable_As": range(50_000, 70_001, 500),
        "flight_As": range(4000, 8001, 100),
        "hover_A": range(60, 101),
        "laser_A": range(5, 16),
        "percent": range(3, 16),
    },
)
def _surely(task: Task) -> Predictions:
    most, usable_As, drawn_A = 1.0 + task["percent"] / 100.0, task["usable_As"], task["hover_A"]
    spare_As = usable_As - most * task["flight_As"]
    yield spare_As / (most * drawn_A - task["laser_A"]), "what is the worst that may be drawn?"
    yield (
        spare_As / (most * (drawn_A - task["laser_A"])),
        "what the laser gives does not grow with what is drawn",
    )
    yield (usable_As - task["flight_As"]) / (drawn_A - task["laser_A"]), "that is without doubt"


@predict(
    "34.2",
    "None of n samples of the box breaks the plan. How large must n be at least, so that a risk of "
    "{risk} or more is excluded with a confidence of {confidence}?",
    draws={
        "risk": decimals(0.002, 0.05, 0.0005),
        "confidence": (0.9, 0.95, 0.975, 0.98, 0.99, 0.995, 0.999),
    },
)
def _samples(task: Task) -> Predictions:
    exact = math.log1p(-task["confidence"]) / math.log1p(-task["risk"])
    yield math.ceil(exact), "how probable are n samples without a failure, if the risk is so large?"
    yield math.floor(exact), "one more is needed"

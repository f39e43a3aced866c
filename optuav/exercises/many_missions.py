"""Exercises of the last part: studies, towns, sites of lasers, clusters, and the paper's table."""

import itertools
import math

import numpy as np

import optuav
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predictions, predict

DEVICES, ROOFS = "abc", range(1, 5)
TABLE = {f"{device}{roof}": range(300, 561) for device in DEVICES for roof in ROOFS}
TABLE |= {each: range(600, 701) for each in ("a1", "b2", "c3")}
"""Hover times [s] of three devices, with a laser on one of four roofs; none is best for all."""

BETWEEN = {
    **{each: range(560, 601) for each in ("a1", "b1", "c1")},
    **{each: range(635, 671) for each in ("a2", "b2")},
    **{each: range(300, 331) for each in ("c2", "a3", "b3")},
    "c3": range(650, 701),
    **{f"{device}4": range(400, 501) for device in DEVICES},
}
"""Such times: roof 1, between the others, is the best alone and not one of the best pair."""


@predict(
    "23.1",
    "A study tries {values} values for each of {keys} parameters, in parts of {size} scenarios. "
    "How many parts is that?",
    draws={"values": range(4, 13), "keys": (3, 4, 5), "size": range(20, 61)},
)
def _parts(task: Task) -> Predictions:
    scenarios = task["values"] ** task["keys"]
    yield math.ceil(scenarios / task["size"]), "each value of one key meets each of the others"
    for started in (scenarios / task["size"], scenarios // task["size"]):
        yield started, "the last part may be smaller than the others"
    yield scenarios, "that is the number of scenarios"
    yield math.ceil(task["values"] * task["keys"] / task["size"]), "keys do not vary one by one"


@predict(
    "23.2",
    "{samples} samples are put into {slices} slices of equal size by a parameter that has no "
    "effect at all. Which share [%] of the variance do the means of the slices explain by "
    "chance, on average?",
    unit="%",
    within=0.025,  # With samples for samples − 1 it is right too
    draws={"samples": range(400, 3001, 50), "slices": range(5, 41)},
)
def _by_chance(task: Task) -> Predictions:
    samples, slices = task["samples"], task["slices"]
    hint = "how many of the means are free, once the mean of all samples is known?"
    yield 100.0 * (slices - 1) / (samples - 1), hint
    yield 100.0 * slices / samples, "one of the means follows from the others and the whole mean"


@predict(
    "24.1",
    "In {towns} random towns the hover has a mean of 587 s and a standard deviation of {spread_s} "
    "s. What is half of the 95 % confidence interval of the mean [s]?",
    unit="s",
    within=0.02,
    draws={"towns": range(30, 401, 5), "spread_s": decimals(8.0, 40.0, 0.5)},
)
def _half_interval(task: Task) -> Predictions:
    error_s = task["spread_s"] / math.sqrt(task["towns"])
    yield (
        1.96 * error_s,
        "how much does a mean of many towns scatter, and how far out do 95 % reach?",
    )
    yield error_s, "one standard error holds the truth two times in three"
    yield 1.96 * task["spread_s"], "that is for one town, and not for the mean of all"


@predict(
    "24.2",
    "{towns} towns give a mean within ± {have_s} s. How many towns give ± {want_s} s?",
    within=1.0,
    draws={
        "towns": range(30, 121, 10),
        "have_s": decimals(4.0, 8.0, 0.1),
        "want_s": decimals(0.5, 2.0, 0.1),
    },
)
def _more_towns(task: Task) -> Predictions:
    ratio = task["have_s"] / task["want_s"]
    yield task["towns"] * ratio**2, "the interval shrinks with the root of the number"
    yield task["towns"] * ratio, "half of the interval takes more than twice the towns"


@predict(
    "24.3",
    "Two deadlines are compared in the same towns. The hover times scatter by {first_s} s and "
    "{second_s} s, with a correlation of {correlation}. By how many seconds do their differences "
    "scatter?",
    unit="s",
    within=0.05,
    draws={
        "first_s": decimals(10.0, 30.0, 0.5),
        "second_s": decimals(10.0, 30.0, 0.5),
        "correlation": decimals(0.5, 0.95, 0.05),
    },
)
def _paired(task: Task) -> Predictions:
    first_s, second_s = task["first_s"], task["second_s"]
    alone = first_s**2 + second_s**2
    common = 2.0 * task["correlation"] * first_s * second_s
    yield math.sqrt(alone - common), "variances add up; what both have in common drops out twice"
    yield math.sqrt(alone), "that is for towns of their own"
    yield abs(first_s - second_s), "standard deviations cannot be subtracted"


@predict(
    "25.1",
    "A place is {degrees} degrees of longitude east of the origin of the map, at {latitude} "
    "degrees north. How many metres is that? A degree of the equator is 111 320 m.",
    unit="m",
    within=0.5,
    draws={"degrees": decimals(0.002, 0.012, 0.0001), "latitude": decimals(35.0, 65.0, 0.5)},
)
def _east(task: Task) -> Predictions:
    at_equator_m = 111_320.0 * task["degrees"]
    angle = math.radians(task["latitude"])
    yield at_equator_m * math.cos(angle), "circles of latitude shrink towards the pole"
    yield at_equator_m, "so long is a degree at the equator only"
    yield at_equator_m * math.sin(angle), "at the equator it is longest, at the pole it vanishes"


@predict(
    "25.2",
    "A laser stands {laser_m} m above the ground, and a flat roof of {roof_m} m lies 400 m away. A "
    "house stands {at_m} m from the laser, on the line to the roof. How high [m] may it be, to "
    "leave the roof in sight?",
    unit="m",
    within=0.1,
    draws={
        "laser_m": range(20, 81, 2),
        "roof_m": range(5, 20),
        "at_m": (*range(50, 191, 10), *range(210, 351, 10)),
    },
)
def _sight(task: Task) -> Predictions:
    laser_m, roof_m, share = task["laser_m"], task["roof_m"], task["at_m"] / 400.0
    yield laser_m + share * (roof_m - laser_m), "the line of sight falls evenly from laser to roof"
    yield roof_m + share * (laser_m - roof_m), "the distance counts from the laser"
    yield 0.5 * (laser_m + roof_m), "that is the height of the line in the middle"


@predict(
    "26.1",
    "In how many ways can {lasers} lasers be put on {roofs} roofs, one on each?",
    draws={"lasers": (2, 3, 4, 5), "roofs": range(8, 31)},
)
def _choices(task: Task) -> Predictions:
    choices = math.comb(task["roofs"], task["lasers"])
    yield choices, "the lasers are alike: their order does not count"
    yield math.perm(task["roofs"], task["lasers"]), "two lasers that change places change nothing"
    yield task["roofs"] ** task["lasers"], "a roof carries one laser, and the lasers are alike"


def _table(task: Task) -> np.ndarray:
    """Hover times of the task, one row a device."""
    return np.array([[task[f"{device}{roof}"] for roof in ROOFS] for device in DEVICES], float)


def _best_pair_s(hover_s: np.ndarray) -> float:
    """The largest mean hover with lasers on two roofs [s]."""
    pairs = itertools.combinations(range(len(ROOFS)), 2)
    return max(float(hover_s[:, pair].max(axis=1).mean()) for pair in pairs)


WITH_TABLE = (
    "Device a hovers {a1}, {a2}, {a3} or {a4} s with a laser on roof 1, 2, 3 or 4, device b {b1}, "
    "{b2}, {b3} or {b4} s, and device c {c1}, {c2}, {c3} or {c4} s. "
)


@predict(
    "26.2",
    WITH_TABLE + "Two lasers are placed, and each device is served by the better one. What is the "
    "largest mean hover [s]?",
    unit="s",
    within=0.1,
    draws=TABLE,
)
def _two_lasers(task: Task) -> Predictions:
    hover_s = _table(task)
    best_s = _best_pair_s(hover_s)
    yield best_s, "try the six pairs; of each device the larger of two numbers counts"
    yield float(hover_s.mean(axis=0).max()), "that is the best of one laser"
    if (everywhere_s := float(hover_s.max(axis=1).mean())) > best_s:
        yield everywhere_s, "for that a laser on every roof is needed"


@predict(
    "26.3",
    WITH_TABLE + "One laser is placed where the mean hover is largest, and then a second one where "
    "it adds most. What is the mean hover [s] of this greedy choice?",
    unit="s",
    within=0.1,
    draws=BETWEEN,
)
def _greedy(task: Task) -> Predictions:
    hover_s = _table(task)
    first = hover_s[:, hover_s.mean(axis=0).argmax()]
    both_s = np.maximum(hover_s, first[:, None]).mean(axis=0)
    yield float(both_s.max()), "keep the best single roof, and try the other three beside it"
    yield float(first.mean()), "that is the first laser alone"
    yield _best_pair_s(hover_s), "that is the best pair; greed keeps the best single roof"


@predict(
    "27.1",
    "A study of {scenarios} scenarios in parts of {size} is computed by {workers} workers, each of "
    "them at one part. One worker dies. How many scenarios have to be begun again at most?",
    draws={
        "scenarios": range(20_000, 50_001, 1000),
        "size": range(200, 2001, 10),
        "workers": range(2, 17),
    },
)
def _lost(task: Task) -> Predictions:
    yield task["size"], "finished parts are kept, and the other workers go on"
    yield task["size"] * task["workers"], "the other workers have not lost theirs"
    yield task["scenarios"], "what is finished stays"


@predict(
    "27.2",
    "A scenario takes {milliseconds} ms. How many hours do {workers} workers need for {millions} "
    "million scenarios, if nothing is lost by sharing? Answer with three decimals.",
    unit="h",
    within=0.001,
    draws={
        "milliseconds": decimals(0.5, 5.0, 0.1),
        "workers": range(10, 201, 10),
        "millions": range(50, 501, 10),
    },
)
def _hours(task: Task) -> Predictions:
    alone_h = task["milliseconds"] * 1000.0 * task["millions"] / 3600.0
    yield alone_h / task["workers"], "the time of all scenarios, shared among the workers"
    yield alone_h, "that is for one worker"


@predict(
    "A1.1",
    "The nominal voltage is 11.1 V, and a UAV draws all of its current at {volts} V. Which share "
    "[%] of the charge is left when the nominal energy of the full battery is used up?",
    unit="%",
    within=0.1,
    draws={"volts": decimals(11.8, 16.5, 0.05)},
)
def _unused(task: Task) -> Predictions:
    ratio = 11.1 / task["volts"]
    yield 100.0 * (1.0 - ratio), "the same energy is less charge at a higher voltage"
    yield 100.0 * ratio, "that is the share that was used"
    yield 100.0 * (1.0 / ratio - 1.0), "compare with the full battery, and not with what was used"


@predict(
    "A1.2",
    "Take `paper-table2` with 1200 s, slots of 1 s and the direct path, and keep "
    "{limits.min_soc:.1%} of the charge. How long [s] is the hover in the perspective energy?",
    unit="s",
    within=0.1,
    mission="paper-table2",
    draws={"limits.min_soc": decimals(0.06, 0.3, 0.005)},
)
def _by_energy(task: Task) -> Predictions:
    by_energy_s, by_charge_s = (
        optuav.solve(task.mission, "P3", perspective=each, slot_s=1.0).hover_time_s
        for each in ("energy", "battery")
    )
    yield by_energy_s, "solve P3 with perspective energy and slots of a second"
    yield by_charge_s, "that is by charge, and not by energy"


ROWS = {"first_percent": decimals(24.0, 32.0, 0.1), "last_percent": decimals(3.0, 9.0, 0.1)}


def _slope(task: Task) -> float:
    """What a second of hover takes off the state of charge [%]."""
    return float((task["first_percent"] - task["last_percent"]) / (950.0 - 697.0))


@predict(
    "A2.1",
    "A table prints that {first_percent} % of 72 000 A s are left after 697 s of hover, and "
    "{last_percent} % after 950 s. What current [A] does the hover draw?",
    unit="A",
    within=0.05,
    draws=ROWS,
)
def _current(task: Task) -> Predictions:
    current_A = _slope(task) * 720.0
    yield current_A, "charge over time, between the two rows"
    yield (100.0 - task["last_percent"]) * 720.0 / 950.0, "the flight has drawn some of it"


@predict(
    "A2.2",
    "A table prints that {first_percent} % are left after 697 s of hover, and {last_percent} % "
    "after 950 s. What must it print for 740.65 s, if the path is the same? "
    "Answer with two decimals.",
    unit="%",
    within=0.03,
    draws=ROWS,
)
def _between(task: Task) -> Predictions:
    value = task["first_percent"] - _slope(task) * (740.65 - 697.0)
    yield value, "on one path the charge falls evenly with the hover"
    yield 0.5 * (task["first_percent"] + task["last_percent"]), "740.65 s is not in the middle"

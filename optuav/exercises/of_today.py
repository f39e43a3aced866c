"""Exercises on drones of today: the reach of a beam, the speed of a flight, ways over houses."""

import math

from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predictions, predict

WAVELENGTH_M, RECEIVER_M = 1.07e-6, 0.25


@predict(
    "28.1",
    "Light of 1070 nm with M² = 1 crosses {distance_m} m without jitter or turbulence. A receiver "
    "of 0.25 m radius should get {share:.0%} of the light that arrives there. What is the smallest "
    "aperture D [m] of the laser for that, if w₀ = D/(2√2)? The share is 1 − exp(−2a²/w²), with "
    "w² = w₀² + (λd/(πw₀))². Answer with five decimals or more.",
    unit="m",
    within=0.00005,
    draws={"distance_m": range(3000, 7001, 50), "share": decimals(0.5, 0.95, 0.01)},
)
def _aperture(task: Task) -> Predictions:
    squared = 2.0 * RECEIVER_M**2 / -math.log1p(-task["share"])  # Of the width w that is needed
    product = WAVELENGTH_M * task["distance_m"] / math.pi  # Of the waist and what diffraction adds
    narrow, wide = (
        math.sqrt(0.5 * squared + sign * math.sqrt(0.25 * squared**2 - product**2))
        for sign in (-1.0, 1.0)
    )
    yield math.sqrt(8.0) * narrow, "find the width that is needed, then the waist that has it there"
    yield narrow, "that is the waist, and the aperture is wider"
    yield math.sqrt(8.0) * wide, "a smaller aperture does it as well"


@predict(
    "28.2",
    "Far away, diffraction widens a beam of {wavelength_nm} nm with M² = 1 to the radius "
    "w = λd/(πw₀), and a jitter of {jitter_urad} µrad per axis widens it to 2σd. Above which "
    "aperture D = 2√2 w₀ [m] does jitter limit the reach, and not diffraction? Answer with "
    "four decimals or more.",
    unit="m",
    within=0.0003,
    draws={"wavelength_nm": range(800, 1601, 10), "jitter_urad": decimals(4.0, 20.0, 0.25)},
)
def _jitter_or_diffraction(task: Task) -> Predictions:
    waist_m = task["wavelength_nm"] * 1e-9 / (2.0 * math.pi * task["jitter_urad"] * 1e-6)
    yield math.sqrt(8.0) * waist_m, "both widths grow with the distance: when are they the same?"
    yield waist_m, "that is the waist, and the aperture is wider"
    yield 2.0 * math.sqrt(8.0) * waist_m, "jitter counts twice in the width"


@predict(
    "29.1",
    "A drone draws {base_W} W + {cubic_W} W·s³/m³ · V³ in level flight at the speed V. What is its "
    "speed of best range [m/s]?",
    unit="m/s",
    within=0.05,
    draws={"base_W": range(150, 601, 10), "cubic_W": decimals(0.01, 0.06, 0.001)},
)
def _best_range(task: Task) -> Predictions:
    cube = task["base_W"] / task["cubic_W"]
    yield (cube / 2.0) ** (1 / 3), "which speed takes the least energy for a metre?"
    yield cube ** (1 / 3), "there both terms are alike, but one of them grows three times as fast"
    yield 0.0, "that is best endurance: this drone stays in the air for longest where it is"


@predict(
    "29.2",
    "Charge and deadline both bind, and the drone rests in between, charging with {rest_A} A. So "
    "each second of flight takes a second of rest. In flight it draws {base_A} A + {cubic_A} "
    "A·s³/m³ · V³. Which speed V [m/s] is best for a long leg?",
    unit="m/s",
    within=0.05,
    draws={
        "rest_A": decimals(4.0, 9.5, 0.1),
        "base_A": range(10, 31),
        "cubic_A": decimals(0.0005, 0.002, 0.0001),
    },
)
def _dear_seconds(task: Task) -> Predictions:
    flown, rested = task["base_A"] / task["cubic_A"], task["rest_A"] / task["cubic_A"]
    yield (
        ((flown + rested) / 2.0) ** (1 / 3),
        "a second of flight costs what it draws, and the charge that the rest would have brought",
    )
    yield (flown / 2.0) ** (1 / 3), "that is best range, for which a second costs nothing"
    yield ((flown - rested) / 2.0) ** (1 / 3), "a second of flight is dearer, and not cheaper"


@predict(
    "30.1",
    "A leg of {length_m} m at an altitude of 50 m crosses a wall in its middle, {depth_m} m deep "
    "and with its roof at {roof_m} m. One apex above the middle should keep 5 m above the whole "
    "roof. What is its lowest altitude [m]?",
    unit="m",
    within=0.05,
    draws={
        "length_m": range(400, 1201, 20),
        "depth_m": range(20, 121, 5),
        "roof_m": range(80, 181, 5),
    },
)
def _apex(task: Task) -> Predictions:
    half_m, rise_m = task["length_m"] / 2.0, task["roof_m"] - 45.0
    hint = "the way is lowest at the edges of the roof: follow it from an end of the leg to an edge"
    yield 50.0 + rise_m * half_m / (half_m - task["depth_m"] / 2.0), hint
    yield 50.0 + rise_m, "there is enough room in the middle, and too little at the edges"
    yield (
        50.0 + rise_m * half_m / (half_m - task["depth_m"]),
        "only half of the roof is on each side",
    )


@predict(
    "30.2",
    "A leg of {distance_m} m is flown from rest to rest, with {rate} m/s² of acceleration and the "
    "same of braking, and no turns. How many seconds longer does it take with one stop in the "
    "middle of the way?",
    unit="s",
    within=0.05,
    draws={"distance_m": range(400, 3001, 20), "rate": decimals(4.0, 14.0, 0.25)},
)
def _one_stop(task: Task) -> Predictions:
    whole_s = 2.0 * math.sqrt(task["distance_m"] / task["rate"])
    yield (
        (math.sqrt(2.0) - 1.0) * whole_s,
        "there are two legs of half the length: how long is one?",
    )
    yield whole_s, "a leg of half the length does not take half of the time, nor all of it"
    yield math.sqrt(2.0) * whole_s, "that is the time of both legs"

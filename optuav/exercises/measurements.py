"""Exercises of lessons 19 to 26: what measurements say, legs, links, lasers, towns and sites."""

import itertools
from collections.abc import Mapping

import numpy as np

import optuav
from optuav.exercises.answers import figure, figures
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predict, Predictions
from optuav.exercises.witness import Condition, Conditions, Witness, within
from optuav.mission.beams.fits import Fits
from optuav.mission.flights.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import laser, six_stages
from optuav.physics.packs import lifetime


@Witness(
    "19.1",
    "A cell of {capacity_As} A s with ω = {share} and k_F = 2.8e-4 per second was discharged ten "
    "times, always with {current_A} A. The fit states no capacity. Why? Answer with the letter and "
    "another cell with the same k_F and at least 30 % more capacity that lasts as long under that "
    "current, within 0.2 %: ('a', {'capacity_As': 900.0, 'available_fraction': 0.2}).",
    {
        "capacity_As": range(500, 801, 10),
        "share": decimals(0.2, 0.5, 0.01),
        "current_A": decimals(0.6, 1.5, 0.05),
    },
    reasons={
        "One lifetime fixes one combination of the three numbers, however often it is measured.": "",
        "Ten measurements are too few against their noise.": "what would a thousand of them show?",
        "A capacity can only be measured at 0 A.": "other currents tell the numbers apart",
        "The lifetime does not depend on the capacity.": "double it, and look",
    },
    form=figures(capacity_As=("A s", 1.0, 1e5), available_fraction=("1", 0.001, 0.999)),
)
def _alike(task: Task, cell: Mapping[str, float]) -> Conditions:
    words = f"{cell['capacity_As']:g} A s is less than 30 % more"
    large = cell["capacity_As"] >= 1.3 * task["capacity_As"] - 1e-6
    yield Condition(large, words, "the larger the cell, the smaller the available share")
    first_s, other_s = (
        lifetime(
            [(task["current_A"], 1e6)],
            capacity_As=capacity_As,
            available_fraction=share,
            flow_rate_per_s=2.8e-4,
        )
        for capacity_As, share in ((task["capacity_As"], task["share"]), cell.values())
    )
    hint = "less ω for a longer life is too little, more is too much: halve an interval"
    yield within(other_s, first_s, 0.002 * first_s, "s", "its lifetime", hint)


@Predict(
    "20.1",
    "The UAV of `paper` weighs {body.mass_kg} kg. By how many percent does the longest hover "
    "shrink if it becomes {more:.1%} heavier? Answer with two decimals or more.",
    {"body.mass_kg": decimals(1.0, 1.4, 0.02), "more": decimals(0.01, 0.08, 0.001)},
    unit="%",
    within=0.02,
)
def _heavier(task: Task) -> Predictions:
    heavy = task.mission.replace({"body.mass_kg": task["body.mass_kg"] * (1.0 + task["more"])})
    light_s, heavy_s = (optuav.solve(each).hover_time_s for each in (task.mission, heavy))
    yield 100.0 * (1.0 - heavy_s / light_s), "solve both missions, over all routes"
    yield 100.0 * task["more"], "not every percent of mass is a percent of hover: solve both"
    power = 100.0 * ((1.0 + task["more"]) ** 1.5 - 1.0)
    yield power, "the rotors of `paper` run at other currents than that rule: solve both"


@Witness(
    "21.1",
    "The UAV weighs {body.mass_kg} kg. A steady wind along the way from the origin to the hover "
    "point makes the leg longer, from whichever end it blows. Why? Answer with the letter and the "
    "force of a wind [N] with which the leg of `six_stages.leg` takes {percent:g} % longer than in "
    "calm air, within 0.1 %, as ('a', 5.0).",
    {"body.mass_kg": decimals(0.9, 1.3, 0.02), "percent": decimals(3.0, 60.0, 0.5)},
    reasons={
        "It helps one half, speeding up or braking, and costs more in the other half.": "",
        "The drone has to fly a longer way.": "the leg is the same line",
        "A wind from behind brakes the rotors.": "the wind is a force on the airframe here",
        "The wind makes the drone turn more often.": "there are three turns in any leg",
    },
    form=figure("N", 0.1, 20.0),
)
def _windy(task: Task, wind_N: float) -> Conditions:
    rotors, origin_m = Rotors(task.mission), task.mission.route.origin_m
    way_m = np.subtract(vehicle.hover_point_m(task.mission), origin_m)
    along = way_m / np.linalg.norm(way_m)
    calm_s, windy_s = (
        float(
            six_stages.leg(
                rotors.airframe, rotors.motor, tuple(way_m), tuple(force_N * along)
            ).loads.duration_s
        )
        for force_N in (0.0, wind_N)
    )
    yield Condition(windy_s > 0.0, "no leg is possible in that wind", "take less wind")
    longer = 100.0 * (windy_s / calm_s - 1.0)
    hint = "a stronger wind makes it longer: halve an interval"
    yield within(longer, task["percent"], 0.1, "%", "the leg is longer, and the part", hint)


@Witness(
    "22.1",
    "The laser of `paper` draws {laser.power_W} W, and the battery takes "
    "{battery.charge_current_A} A at most. Light haze changes no plan. Why? Answer with the letter "
    "and the visibility [km] below which the hover point gets less than without haze, within 1 %, "
    "as ('a', 5.0).",
    {
        "laser.power_W": range(760, 1101, 10),
        "battery.charge_current_A": decimals(7.0, 10.0, 0.1),
    },
    reasons={
        "More light arrives than the battery may take: its cap hides the loss.": "",
        "Light haze absorbs no light of this wavelength.": "see the attenuation at 10 km visibility",
        "The plan never charges from the laser.": "what is the current of its rest?",
        "Haze takes the same watts from every distance.": "it takes the same share of each kilometre",
    },
    form=figure("km", 0.05, 100.0),
)
def _haze(task: Task, visibility_km: float) -> Conditions:
    given = task.mission
    assert given.laser is not None
    apart_m = np.linalg.norm(np.subtract(vehicle.hover_point_m(given), given.laser.position_m))

    def received_W(visibility_km: float) -> float:
        alpha = laser.attenuation(given.laser.wavelength_nm, visibility_km)  # type: ignore[union-attr]
        fits = Fits(given).conversion
        return float(laser.received_power(fits, task["laser.power_W"], alpha, apart_m, np.inf))

    cap_W = task["battery.charge_current_A"] * given.battery.nominal_voltage_V
    hint = "without the cap, when is the received power just charge current times nominal voltage?"
    words = f"at {visibility_km:g} km the receiver would give {received_W(visibility_km):.5g} W"
    ends = received_W(0.99 * visibility_km) <= cap_W <= received_W(1.01 * visibility_km)
    yield Condition(ends, words, hint)


@Witness(
    "24.1",
    "Twenty towns, optuav.layouts('paper', 20, 'uniform', buildings=4, seed={seed}), are solved "
    "with deadlines of 800 s and 1200 s. The gain of the longer one is known better than either "
    "mean. Why? Answer with the letter and half of the 95 % confidence interval [s] of the mean "
    "gain, over the towns with both plans, within 0.02 s, as ('a', 3.0).",
    {"seed": range(1, 500)},
    reasons={
        "A town that is good with one deadline is good with the other, and the difference drops it.": "",
        "A difference has a smaller variance than each of its terms.": "only if they are correlated",
        "There are twice as many measurements.": "twenty differences come from twenty towns",
        "The longer deadline has less spread.": "what if both had the same spread?",
    },
    form=figure("s", 0.0, 1000.0),
)
def _paired(task: Task, half_s: float) -> Conditions:
    towns = optuav.layouts("paper", 20, "uniform", buildings=4, seed=task["seed"])
    hover_s = optuav.batch_arrays(towns, {"limits.deadline_s": [800.0, 1200.0]})["hover_time_s"]
    gains_s = np.diff(hover_s[np.isfinite(hover_s).all(axis=1)], axis=1)
    truth_s = 1.96 * float(gains_s.std(ddof=1)) / np.sqrt(len(gains_s))
    hint = "1.96 standard errors of the mean of the differences"
    yield Condition(abs(half_s - truth_s) <= 0.02, f"it is not ± {half_s:g} s", hint)
    yield Condition(True, "each town is compared with itself")


DEVICES, ROOFS = "abc", range(1, 5)
BETWEEN = {
    **{each: range(560, 601) for each in ("a1", "b1", "c1")},
    **{each: range(635, 671) for each in ("a2", "b2")},
    **{each: range(300, 331) for each in ("c2", "a3", "b3")},
    "c3": range(650, 701),
    **{f"{device}4": range(400, 501) for device in DEVICES},
}
"""Hover times [s]; roof 1, between the others, is the best alone and not one of the best pair."""


@Witness(
    "26.1",
    "Device a hovers {a1}, {a2}, {a3} or {a4} s with a laser on roof 1, 2, 3 or 4, device b {b1}, "
    "{b2}, {b3} or {b4} s, and device c {c1}, {c2}, {c3} or {c4} s; the better of two lasers "
    "serves a device. Greed places two lasers one by one, and misses the best pair. Why? Answer "
    "with the letter and both mean hovers, within 0.1 s: "
    "('a', {'greedy_s': 500.0, 'best_s': 510.0}).",
    BETWEEN,
    reasons={
        "The first roof is good for all devices, and best for none once there are two lasers.": "",
        "Greed never tries more than one roof.": "it tries every roof beside the first one",
        "Two lasers on one roof count twice.": "each roof carries one laser",
        "The mean is not the sum that greed adds up.": "three times the mean is the sum",
    },
    form=figures(greedy_s=("s", 0.0, 2000.0), best_s=("s", 0.0, 2000.0)),
)
def _greedy(task: Task, means: Mapping[str, float]) -> Conditions:
    hover_s = np.array([[task[f"{device}{roof}"] for roof in ROOFS] for device in DEVICES], float)
    first = hover_s[:, hover_s.mean(axis=0).argmax()]
    greedy_s = float(np.maximum(hover_s, first[:, None]).mean(axis=0).max())
    pairs = itertools.combinations(range(len(ROOFS)), 2)
    best_s = max(float(hover_s[:, pair].max(axis=1).mean()) for pair in pairs)
    for name, truth_s, hint in (
        ("greedy_s", greedy_s, "keep the best single roof, and try the other three beside it"),
        ("best_s", best_s, "try all six pairs; of each device the larger of two numbers counts"),
    ):
        words = f"{name} is not {means[name]:g} s"
        yield Condition(abs(means[name] - truth_s) <= 0.1, words, hint)
    yield Condition(True, "the best pair does without the best single roof")

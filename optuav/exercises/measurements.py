"""Exercises of the fourth part: what measurements say, legs, the link and the laser."""

import math

import optuav
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predictions, predict
from optuav.mission.beams.fits import Fits
from optuav.network import vehicle
from optuav.physics import laser


@predict(
    "19.1",
    "With a very small current a cell gives {slow_As} A s before it is empty, with a very large "
    "one {fast_As} A s. Which share ω of its charge is available at once?",
    within=0.002,
    draws={"slow_As": range(500, 801, 5), "fast_As": range(80, 321, 3)},
)
def _share(task: Task) -> Predictions:
    share = task["fast_As"] / task["slow_As"]
    yield share, "a large current leaves no time for bound charge to follow"
    yield 1.0 - share, "that is the share that stays bound"


@predict(
    "19.2",
    "A fit gives ω = {share} and the rate k' = {per_min} per minute. Which k_F [per second] does "
    "the mission need?",
    unit="1/s",
    within=2e-6,
    draws={"share": decimals(0.15, 0.85, 0.01), "per_min": decimals(0.08, 0.2, 0.002)},
)
def _flow_rate(task: Task) -> Predictions:
    widths = task["share"] * (1.0 - task["share"])
    yield (
        task["per_min"] / 60.0 * widths,
        "how does a flow raise one well and lower the other? There are seconds in a minute",
    )
    yield task["per_min"] / 60.0, "k' counts heights of wells, k_F the charge of both"


@predict(
    "19.3",
    "A cell of {capacity_As} A s with ω = {share} lasts for {lifetime_s} s under a current so "
    "large that nothing flows over. How long [s] does another cell last under the same current, "
    "with half the capacity and twice the share?",
    unit="s",
    within=0.1,
    draws={
        "capacity_As": range(500, 801, 10),
        "share": decimals(0.1, 0.5, 0.01),
        "lifetime_s": range(100, 401),
    },
)
def _alike(task: Task) -> Predictions:
    yield task["lifetime_s"], "what is available at once is the product of capacity and share"
    yield task["lifetime_s"] / 2.0, "the share has changed too"
    yield 2.0 * task["lifetime_s"], "the capacity has changed too"


@predict(
    "20.1",
    "The shadow price of a number is {price} s of hover per unit, the number is {value}, and the "
    "hover lasts {hover_s} s. What is its elasticity, in percent of hover per percent? Answer with "
    "three decimals or more.",
    within=0.002,
    draws={
        "price": decimals(0.01, 0.08, 0.001),
        "value": range(15_000, 25_001, 500),
        "hover_s": range(1500, 2501, 10),
    },
)
def _elasticity(task: Task) -> Predictions:
    gain_s = task["price"] * task["value"]
    yield gain_s / task["hover_s"], "what one percent more brings, over one percent of the hover"
    yield gain_s / 100.0, "that is seconds for one percent more"
    yield task["price"] / task["hover_s"], "the number itself counts as well"


@predict(
    "20.2",
    "In samples drawn at random, a plan can be flown in about {share:.0%}. How many samples are "
    "needed to know this share within ± {within:.2%} in 95 of 100 studies (1.96 standard errors)?",
    within=1.0,
    draws={"share": decimals(0.55, 0.95, 0.01), "within": decimals(0.004, 0.02, 0.0005)},
)
def _samples(task: Task) -> Predictions:
    spread, ratio = task["share"] * (1.0 - task["share"]), 1.96 / task["within"]
    yield (
        math.ceil(spread * ratio**2),
        "the variance of one sample is the share that can be flown times the share that cannot; "
        "that of a mean of n samples is n times smaller",
    )
    yield math.ceil(spread / task["within"] ** 2), "one standard error is too little"
    yield math.ceil(math.sqrt(spread) * ratio), "the error shrinks with the root of the number"


@predict(
    "20.3",
    "The deadline of `paper` is {limits.deadline_s} s. By how many percent does the hover of P4 "
    "(b1, rest first, perspective battery) grow if the deadline grows by one percent? Answer with "
    "three decimals or more.",
    unit="%",
    within=0.001,
    draws={"limits.deadline_s": decimals(900.0, 1700.0, 5.0)},
)
def _of_the_deadline(task: Task) -> Predictions:
    program = optuav.formulate(
        task.mission, optuav.P4("b1", order="rest-first"), perspective="battery"
    )
    price, hover_s = program.shadow_prices()["deadline_s"].more, program.solve().hover_time_s
    yield price * task["limits.deadline_s"] / hover_s, "the price of a second times the seconds"
    yield price, "that is seconds of hover for a second, and not percent for a percent"
    yield 1.0, "most of the time that is added goes into the rest"


@predict(
    "21.1",
    "A leg of {distance_m} m is flown from rest to rest, with {rate} m/s² of acceleration and the "
    "same of braking, and no turns. How long [s] does it take?",
    unit="s",
    within=0.05,
    draws={"distance_m": range(400, 3001, 20), "rate": decimals(4.0, 14.0, 0.25)},
)
def _leg_time(task: Task) -> Predictions:
    half_s = math.sqrt(task["distance_m"] / task["rate"])
    yield (
        2.0 * half_s,
        "half of the way is like a free fall along the path, and braking is the same backwards",
    )
    yield math.sqrt(2.0) * half_s, "the UAV has to brake as well"
    yield half_s, "that is the time of one half"


@predict(
    "21.2",
    "What is the peak speed [m/s] on a leg of {distance_m} m that is flown with {rate} m/s² of "
    "acceleration and the same of braking?",
    unit="m/s",
    within=0.05,
    draws={"distance_m": range(400, 3001, 20), "rate": decimals(4.0, 14.0, 0.25)},
)
def _peak_speed(task: Task) -> Predictions:
    speed_m_s = math.sqrt(task["distance_m"] * task["rate"])
    yield speed_m_s, "where is it fastest, and what is the energy gained up to there?"
    yield math.sqrt(2.0) * speed_m_s, "it speeds up for half of the way only"
    yield speed_m_s / 2.0, "that is the mean speed"


@predict(
    "21.3",
    "The rotors of `paper` give 17.2158 N at full speed, and gravity is 9.8 m/s². What is the "
    "largest level wind [N] in which a UAV of {body.mass_kg} kg can fly?",
    unit="N",
    within=0.02,
    draws={"body.mass_kg": decimals(0.8, 1.7, 0.01)},
)
def _largest_wind(task: Task) -> Predictions:
    weight_N = 9.8 * task["body.mass_kg"]
    wind_N = math.sqrt(17.2158**2 - weight_N**2)
    yield wind_N, "thrust has to balance weight and wind, which are at a right angle"
    yield 17.2158 - weight_N, "forces at a right angle do not add up like numbers"


@predict(
    "22.1",
    "The UAV transmits with {link.transmit_power_W} W, and all else is as in `paper`, where 5 W "
    "reach 501.4836 m and the path loss exponent is 2. What is the coverage radius [m]?",
    unit="m",
    within=0.5,
    draws={"link.transmit_power_W": (*decimals(1.0, 4.0, 0.1), *decimals(6.0, 20.0, 0.1))},
)
def _reach(task: Task) -> Predictions:
    ratio = task["link.transmit_power_W"] / 5.0
    hint = "the power over the square of the distance decides how often the link fails"
    yield float(vehicle.coverage_radius_m(task.mission)), hint
    yield 501.4836 * ratio, "the power falls with the square of the distance"
    yield 501.4836 * ratio**2, "the root, and not the square"


@predict(
    "22.2",
    "The attenuation is {alpha} per km. Which share [%] of the light arrives over {distance_m} m?",
    unit="%",
    within=0.1,
    draws={"alpha": decimals(0.1, 0.9, 0.01), "distance_m": range(500, 3001, 50)},
)
def _light(task: Task) -> Predictions:
    share = float(laser.transmission(task["alpha"], task["distance_m"]))
    depth = task["alpha"] * task["distance_m"] / 1000.0
    yield 100.0 * share, "each kilometre lets the same share of the light through"
    yield 100.0 * (1.0 - share), "that is the share that is lost"
    yield 100.0 * (1.0 - depth), "what is lost is a share of what has come so far"


@predict(
    "22.3",
    "The laser of `paper` draws {laser.power_W} W, and the light that is left over 1300 m is 87.6 "
    "%. Which power [W] does the receiver yield there, if the battery takes 111 W at most? Slopes "
    "and offsets are 0.34, −1.1 W and 0.5434, −0.2761 W.",
    unit="W",
    within=0.3,
    draws={"laser.power_W": decimals(150.0, 760.0, 5.0)},
)
def _received(task: Task) -> Predictions:
    given = task.mission
    share = laser.transmission(Fits(given).attenuation_per_km, 1300.0)
    light_W = 0.34 * task["laser.power_W"] - 1.1
    received_W = 0.5434 * float(share) * light_W - 0.2761
    assert given.laser is not None
    x, y, z = given.laser.position_m
    there = vehicle.charging(given, (x + 1300.0, y, z))
    yield float(there.power_W), "two straight lines with the air between"
    yield 0.5434 * light_W - 0.2761, "the air takes its share"
    yield light_W, "that is the light that leaves the laser"
    if received_W > 111.0:
        yield received_W, "the battery takes no more than its cap"

"""Exercises of lessons 28 to 30: the reach of a beam, the speed of a flight, ways over houses."""

import numpy as np

import optuav
from optuav.exercises.answers import figure
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.witness import Condition, Conditions, Witness, within
from optuav.mission.flights.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import six_stages


@Witness(
    "28.1",
    "From the place of the laser of `relay-today`, with a jitter of {urad} µrad, {watts} W are to "
    "reach {reach_m} m in the direction of the hover point. Design the smallest aperture of its "
    "telescope [m] that does it: 1 % less must be too little. `optuav.link_budget(mission, "
    "'hover').reach_m({watts})` gives the reach.",
    {"urad": decimals(8.0, 12.0, 0.1), "watts": range(120, 161, 5), "reach_m": range(3200, 4401, 10)},
    "relay-today",
    form=figure("m", 0.005, 0.3),
)
def _telescope(task: Task, aperture_m: float) -> Conditions:
    def reach_m(aperture_m: float) -> float:
        keys = {"laser.aperture_m": aperture_m, "laser.jitter_rad": 1e-6 * task["urad"]}
        budget = optuav.link_budget(task.mission.replace(keys), "hover")
        return float(budget.reach_m(float(task["watts"])))

    reached_m = reach_m(aperture_m)
    words = f"an aperture of {aperture_m:.5g} m reaches {reached_m:.0f} m"
    hint = "which effect limits a small telescope, and which a large one?"
    yield Condition(reached_m >= task["reach_m"], words, hint)
    yield Condition(reach_m(0.99 * aperture_m) < task["reach_m"], words, "a smaller one does it too")


@Witness(
    "29.1",
    "In `task.mission`, `relay-today` with its device 4 km away, the deadline is "
    "{limits.deadline_s} s. Design the cruise speed [m/s] of the longest direct hover, to 99.95 % "
    "of it. What binds at that speed?",
    {"limits.deadline_s": range(1480, 1631)},
    "relay-today",
    {"link.device_m": [600, 4450, 0], "route.hover_m": [600, 4450, 80]},
    form=figure("m/s", 10.0, 23.0),
)
def _cruise(task: Task, speed_m_s: float) -> Conditions:
    def hover_s(speeds_m_s: list[float]) -> float:
        keys = {"flight.cruise_speed_m_s": speeds_m_s}
        hovers_s = optuav.batch_arrays(task.mission, keys, "P3")["hover_time_s"]
        return float(np.nan_to_num(hovers_s).max())

    share = hover_s([speed_m_s]) / hover_s(np.linspace(10.0, 23.0, 1301).tolist())
    words = f"it hovers for {100.0 * share:.2f} % of the longest time"
    hint = "faster while time is short, slower while charge is: when are both?"
    yield Condition(share >= 0.9995, words, hint, min(share, 1.0))


@Witness(
    "30.1",
    "The UAV of `paper` weighs {body.mass_kg} kg. A bend makes its leg from the origin to the "
    "hover point hardly longer, and yet costs time. Why? Answer with the letter and the distance "
    "[m] from the nearer end at which a stop on the straight line costs {more_s} s, within 0.05 s, "
    "as ('a', 100.0). `six_stages.leg` gives the time of each part.",
    {"body.mass_kg": decimals(1.0, 1.3, 0.02), "more_s": decimals(10.0, 17.0, 0.05)},
    reasons={
        "Each part is flown from rest to rest, and the middle is where the drone is fastest.": "",
        "The climb to the bend draws more charge.": "charge is not time",
        "The bent way is longer, and takes more time by as much.": "compare the two lengths",
        "The drone turns in the bend, which takes seconds.": "how long do all its turns take?",
    },
    form=figure("m", 1.0, 1500.0),
)
def _stop(task: Task, from_end_m: float) -> Conditions:
    rotors, origin_m = Rotors(task.mission), task.mission.route.origin_m
    way_m = np.subtract(vehicle.hover_point_m(task.mission), origin_m)
    near = from_end_m / float(np.linalg.norm(way_m))
    yield Condition(near <= 0.5, f"{from_end_m:g} m is beyond the middle", "take the nearer end")
    whole_s, *parts_s = (
        float(six_stages.leg(rotors.airframe, rotors.motor, tuple(share * way_m)).loads.duration_s)
        for share in (1.0, near, 1.0 - near)
    )
    hint = "a stop costs most in the middle: halve an interval"
    yield within(sum(parts_s) - whole_s, task["more_s"], 0.05, "s", "the cost of the stop", hint)

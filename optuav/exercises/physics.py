"""Exercises of lessons 19 to 30 and A1: fits, legs, beams, speeds, towns, sites, joules."""

from collections.abc import Mapping

import numpy as np

import optuav
from optuav.exercises.answers import figure, figures
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predict, Predictions
from optuav.exercises.witness import Condition, Conditions, Witness, equals, within
from optuav.mission.beams.fits import Fits
from optuav.mission.flights.rotors import Rotors
from optuav.network import vehicle
from optuav.physics import laser, six_stages
from optuav.physics.packs import lifetime


@Witness(
    "19.1",
    "A cell of {capacity_As} A s with ω = {share} and k_F = 2.8e-4 per second was discharged ten "
    "times, each time with {current_A} A. A fit to these ten lifetimes states no capacity. Why? "
    "The witness is another cell with the same k_F and at least 30 % more capacity that lasts as "
    "long with that current, within 0.2 %.",
    {
        "capacity_As": range(500, 801, 10),
        "share": decimals(0.2, 0.5, 0.01),
        "current_A": decimals(0.6, 1.5, 0.05),
    },
    reasons={
        "One lifetime fixes one combination of the numbers, however often it is measured.": "",
        "Ten lifetimes scatter so much that their mean cannot tell two capacities apart.": "what "
        "would a thousand of them show?",
        "Only a discharge at nearly 0 A, during which the wells stay level, shows "
        "a capacity.": "lifetimes with several currents show it too",
    },
    form=figures(capacity_As=("A s", 1.0, 1e5), available_fraction=("1", 0.001, 0.999)),
)
def _alike(task: Task, cell: Mapping[str, float]) -> Conditions:
    large = cell["capacity_As"] >= 1.3 * task["capacity_As"] - 1e-6
    yield Condition(
        large,
        "the capacity is not 30 % more",
        f"it must be at least {1.3 * task['capacity_As']:g} A s",
    )
    measured = {"capacity_As": float(task["capacity_As"]), "available_fraction": task["share"]}
    load = [(task["current_A"], 1e6)]
    first_s, other_s = (lifetime(load, flow_rate_per_s=2.8e-4, **each) for each in (measured, cell))
    hint = "the smaller the available share, the shorter it lasts"
    yield within("its lifetime", other_s, first_s, 0.002 * first_s, "s", hint)


@Predict(
    "20.1",
    "The UAV of `paper` weighs {body.mass_kg} kg. By how many percent does the longest hover "
    "shrink if the UAV becomes {more:.1%} heavier? Answer with two decimals or more.",
    {"body.mass_kg": decimals(1.0, 1.4, 0.02), "more": decimals(0.01, 0.08, 0.001)},
    unit="%",
    within=0.02,
)
def _heavier(task: Task) -> Predictions:
    more = 1.0 + task["more"]
    heavy = task.mission.replace({"body.mass_kg": task["body.mass_kg"] * more})
    light_s, heavy_s = (optuav.solve(each).hover_time_s for each in (task.mission, heavy))
    yield 100.0 * (1.0 - heavy_s / light_s), "solve both missions over all routes"
    yield 100.0 * (more - 1.0), "not every percent of mass is a percent of hover: solve both"
    yield 100.0 * (more**1.5 - 1.0), "the rotors of `paper` do not follow that rule: solve both"


def _way_m(task: Task) -> np.ndarray:
    """Return the way from the origin to the hover point [m]."""
    return np.subtract(vehicle.hover_point_m(task.mission), task.mission.route.origin_m)


def _leg_s(task: Task, share: float = 1.0, wind_N: float = 0.0) -> float:
    """Return how long a share of that way takes in a wind along it [s]."""
    rotors, way_m = Rotors(task.mission), _way_m(task)
    wind = tuple(wind_N * way_m / np.linalg.norm(way_m))
    leg = six_stages.leg(rotors.airframe, rotors.motor, tuple(share * way_m), wind)
    return float(leg.loads.duration_s)


@Witness(
    "21.1",
    "The UAV weighs {body.mass_kg} kg. A steady wind along the way from the origin to the hover "
    "point makes the leg take longer, whether it blows from ahead or from behind. Why? The witness "
    "is the force of a wind [N] with which the leg of `six_stages.leg` takes {percent:g} % longer "
    "than in calm air, within 0.1 %.",
    {"body.mass_kg": decimals(0.9, 1.3, 0.02), "percent": decimals(3.0, 60.0, 0.5)},
    reasons={
        "The wind helps one half, and costs more time in the other half than it saves.": "",
        "A wind from behind slows the rotors down, and a wind from ahead slows the "
        "drone down.": "the wind is a force on the airframe here",
        "The drone has to turn more often in a wind, and each turn takes it a second "
        "or two.": "there are three turns in any leg",
    },
    form=figure("N", 0.1, 20.0),
)
def _windy(task: Task, wind_N: float) -> Conditions:
    longer = 100.0 * (_leg_s(task, 1.0, wind_N) / _leg_s(task) - 1.0)  # NaN in a storm
    hint = "the stronger the wind, the longer the leg, until none is possible"
    yield within("the additional time", longer, task["percent"], 0.1, "%", hint)


@Witness(
    "22.1",
    "The laser of `paper` draws {laser.power_W} W, and the battery takes "
    "{battery.charge_current_A} A at most. Light haze changes no plan. Why? The witness is the "
    "visibility [km] at which the receiver at the hover point gives exactly the power that the "
    "battery may take, within 0.5 %.",
    {
        "laser.power_W": range(760, 1101, 10),
        "battery.charge_current_A": decimals(7.0, 10.0, 0.1),
    },
    reasons={
        "More light arrives than the battery may take, and the cap hides the loss.": "",
        "Light haze absorbs no light at the wavelength of this laser, so nothing "
        "is lost.": "compute the attenuation at a visibility of 10 km",
        "The plan never charges from the laser, so that it does not need the light at all.": "what "
        "is the current of its rest?",
    },
    form=figure("km", 0.05, 100.0),
)
def _haze(task: Task, visibility_km: float) -> Conditions:
    source, battery = task.mission.to_dict()["laser"], task.mission.battery
    apart_m = np.linalg.norm(vehicle.hover_point_m(task.mission) - np.array(source["position_m"]))
    alpha = laser.attenuation(source["wavelength_nm"], visibility_km)
    fits = Fits(task.mission).conversion
    power_W = float(laser.received_power(fits, task["laser.power_W"], alpha, apart_m, np.inf))
    cap_W = battery.charge_current_A * battery.nominal_voltage_V
    hint = "the cap is charge current times nominal voltage"
    yield within("the received power", power_W, cap_W, 0.005 * cap_W, "W", hint)


@Witness(
    "24.1",
    "Twenty towns, `optuav.layouts('paper', 20, 'uniform', buildings=4, seed={seed})`, are solved "
    "with deadlines of 800 s and 1200 s. The mean gain of the longer deadline has a narrower "
    "confidence interval than either mean hover. Why? The witness is half the width of the 95 % "
    "confidence interval [s] of the mean gain, over the towns that have both plans, within 0.02 "
    "s.",
    {"seed": range(1, 500)},
    reasons={
        "A town that is good with one deadline is good with the other; that part drops out.": "",
        "The difference of two measured means always has a smaller variance than "
        "either mean.": "only if they are correlated",
        "Twenty towns with two deadlines give forty measurements, and so a "
        "narrower interval.": "twenty differences come from twenty towns",
    },
    form=figure("s", 0.0, 1000.0),
)
def _paired(task: Task, half_s: float) -> Conditions:
    towns = optuav.layouts("paper", 20, "uniform", buildings=4, seed=task["seed"])
    hover_s = optuav.batch_arrays(towns, {"limits.deadline_s": [800.0, 1200.0]})["hover_time_s"]
    gains_s = np.diff(hover_s[np.isfinite(hover_s).all(axis=1)], axis=1)
    truth_s = 1.96 * float(gains_s.std(ddof=1)) / np.sqrt(len(gains_s))
    hint = "1.96 standard errors of the mean of the differences"
    yield equals(half_s, truth_s, 0.02, "s", hint)


@Witness(
    "26.1",
    "With a laser on roof 1, 2 or 3, device a hovers {a1}, {a2} or {a3} s and device b {b1}, {b2} "
    "or {b3} s; the better of two lasers serves a device. A greedy method places two lasers one by "
    "one, and misses the best pair. Why? The witness is the mean hover of each pair, within 0.1 s.",
    {
        **{name: range(540, 621) for name in ("a1", "b1")},
        **{name: range(640, 721) for name in ("a2", "b3")},
        **{name: range(300, 401) for name in ("a3", "b2")},
    },
    reasons={
        "The first roof is good for both devices, but best for none once there are two lasers.": "",
        "Greed stops after the first roof, and does not try the others for the second laser.": "it "
        "tries every roof beside the first one",
        "Greed adds up the hovers of both devices, and the best pair has the "
        "largest mean.": "twice the mean is the sum",
    },
    form=figures(greedy_s=("s", 0.0, 2000.0), best_s=("s", 0.0, 2000.0)),
)
def _greedy(task: Task, means: Mapping[str, float]) -> Conditions:
    table = np.array([[task[f"{device}{roof}"] for roof in (1, 2, 3)] for device in "ab"], float)
    with_each_s = [np.maximum(table[:, [k]], table).mean(axis=0).max() for k in range(3)]
    hint = "keep the best single roof, and try the others beside it"
    greedy_s = float(with_each_s[table.mean(axis=0).argmax()])
    yield _mean("greedy", means["greedy_s"], greedy_s, hint)
    hint, best_s = "try all three pairs", float(max(with_each_s))
    yield _mean("best", means["best_s"], best_s, hint)


def _mean(name: str, value_s: float, truth_s: float, hint: str) -> Condition:
    condition = equals(value_s, truth_s, 0.1, "s", hint)
    return condition._replace(words=f"the {name} pair: {condition.words}")


@Witness(
    "28.1",
    "In `relay-today`, with a jitter of {urad} µrad, {watts} W must reach {reach_m} m in the "
    "direction of the hover point. Design the smallest aperture of the telescope [m] for this: an "
    "aperture that is 1 % smaller must be too small. The reach is "
    "`optuav.link_budget(mission, 'hover').reach_m({watts})`.",
    {
        "urad": decimals(8.0, 12.0, 0.1),
        "watts": range(120, 161, 5),
        "reach_m": range(3200, 4401, 10),
    },
    "relay-today",
    form=figure("m", 0.005, 0.3),
)
def _telescope(task: Task, aperture_m: float) -> Conditions:
    def reach_m(aperture_m: float) -> float:
        keys = {"laser.aperture_m": aperture_m, "laser.jitter_rad": 1e-6 * task["urad"]}
        budget = optuav.link_budget(task.mission.replace(keys), "hover")
        return float(budget.reach_m(float(task["watts"])))

    words = f"an aperture of {aperture_m:.5g} m reaches {reach_m(aperture_m):.0f} m"
    hint = "which effect limits a small telescope, and which a large one?"
    yield Condition(reach_m(aperture_m) >= task["reach_m"], words, hint)
    is_least = reach_m(0.99 * aperture_m) < task["reach_m"]
    yield Condition(is_least, words, "a smaller one is enough", None, True)


@Witness(
    "29.1",
    "In `task.mission`, `relay-today` with its device 4 km away, the deadline is "
    "{limits.deadline_s} s. Design a cruise speed [m/s] that gives at least 99.95 % of the longest "
    "direct hover. What binds at that speed?",
    {"limits.deadline_s": range(1480, 1631)},
    "relay-today",
    {"link.device_m": [600, 4450, 0], "route.hover_m": [600, 4450, 80]},
    form=figure("m/s", 10.0, 23.0),
)
def _cruise(task: Task, speed_m_s: float) -> Conditions:
    keys = {"flight.cruise_speed_m_s": [speed_m_s, *np.linspace(10.0, 23.0, 1301).tolist()]}
    own_s, *others_s = optuav.batch_arrays(task.mission, keys, "P3")["hover_time_s"].ravel()
    share = float(own_s / np.nanmax(others_s))
    words = f"it hovers for {100.0 * share:.2f} % of the longest time"
    hint = "fly faster while time is short, slower while charge is short: when are both short?"
    yield Condition(share >= 0.9995, words, hint, min(share, 1.0), True)


@Witness(
    "30.1",
    "The UAV of `paper` weighs {body.mass_kg} kg. A bend hardly lengthens its leg from the origin "
    "to the hover point, and yet costs time. Why? The witness is the distance [m] from the nearer "
    "end at which a stop on the straight line costs {more_s} s, within 0.05 s. `six_stages.leg` "
    "gives the time of each part.",
    {"body.mass_kg": decimals(1.0, 1.3, 0.02), "more_s": decimals(8.0, 14.5, 0.05)},
    reasons={
        "Each part is flown from rest to rest, and the drone brakes where it would be fastest.": "",
        "The bent way is longer than the straight one, and the additional metres take "
        "that time.": "compare the two lengths",
        "The drone turns in the bend, and this turn takes as many seconds as the "
        "bend costs.": "how long do all its turns take?",
    },
    form=figure("m", 1.0, 1500.0),
)
def _stop(task: Task, from_end_m: float) -> Conditions:
    near = from_end_m / float(np.linalg.norm(_way_m(task)))
    yield Condition(near <= 0.5, f"{from_end_m:g} m is beyond the middle", "take the nearer end")
    cost_s = _leg_s(task, near) + _leg_s(task, 1.0 - near) - _leg_s(task)
    hint = "a stop costs most in the middle"
    yield within("the cost of the stop", cost_s, task["more_s"], 0.05, "s", hint)


@Witness(
    "A1.1",
    "In `paper-table2`, hovering draws {flight.hover_current_A} A, and flying draws "
    "{flight.flight_power_W} W. The longest direct hover (P3) is much shorter in the perspective "
    "`energy` than in `battery`. Why? The witness is the power of the hover [W], "
    "`flight.hover_power_W`, with which both are equally long, within 0.5 s.",
    {
        "flight.hover_current_A": decimals(68.0, 90.0, 0.5),
        "flight.flight_power_W": range(1250, 1551, 10),
    },
    "paper-table2",
    reasons={
        "A coulomb drawn above the nominal voltage takes more joules than a full pack counts.": "",
        "The battery loses energy in its resistance, and loses more of it with a "
        "larger current.": "neither perspective has a resistance",
        "The wells keep a part of the energy bound, and a count of charge does not "
        "see it.": "neither perspective looks at the wells",
    },
    form=figure("W", 300.0, 1400.0),
)
def _volts(task: Task, power_W: float) -> Conditions:
    mission = task.mission.replace({"flight.hover_power_W": power_W})
    by_energy_s, by_charge_s = (
        optuav.solve(mission, "P3", perspective=perspective).hover_time_s
        for perspective in ("energy", "battery")
    )
    hint = "the lower the power, the longer the hover by energy"
    yield within("the hover by energy", by_energy_s, by_charge_s, 0.5, "s", hint)

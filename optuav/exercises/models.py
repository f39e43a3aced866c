"""Exercises of lessons 19 to 35 and A1: fits, legs, beams, towns, speeds, fleets, devices."""

import itertools
from collections.abc import Mapping

import numpy as np

import optuav
from optuav.exercises.answers import ITINERARY, numbers_by_name, one_number
from optuav.exercises.exercise import design, explain
from optuav.exercises.measure import equals, longest, titled, within
from optuav.exercises.task import Condition, Conditions, Task
from optuav.flight.rotors import Rotors
from optuav.judge import Itinerary, audit
from optuav.laser.fits import Fits
from optuav.mission import load
from optuav.network import vehicle
from optuav.physics import laser, six_stages
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, step, tilted_after
from optuav.physics.packs import lifetime
from optuav.presentation.numbers import figure, fixed, percent


@explain("19.1", numbers_by_name(0.001, capacity_As=1e5, available_fraction=0.999))
def _alike(task: Task, cell: Mapping[str, float]) -> Conditions:
    """A cell of {capacity_As = 500, 510 .. 800} A s with ω = {share = 0.2, 0.21 .. 0.5} and k_F =
    2.8e-4 per second was discharged ten times, each time with {current_A = 0.6, 0.65 .. 1.5} A. A
    fit to these ten lifetimes states no capacity. Why? The witness is another cell with the same
    k_F and at least 30 % more capacity that lasts as long with that current, within 0.2 %.

    + One lifetime fixes one combination of the numbers, however often it is measured.
    - Ten lifetimes scatter so much that their mean cannot tell two capacities apart.
      what would a thousand of them show?
    - Only a discharge at nearly 0 A, during which the wells stay level, shows a capacity.
      lifetimes with several currents show it too
    """
    least_As = 1.3 * task["capacity_As"]
    hint = f"it must be at least {figure(least_As)} A s"
    yield Condition(cell["capacity_As"] >= least_As - 1e-6, "the capacity is not 30 % more", hint)
    measured = {"capacity_As": float(task["capacity_As"]), "available_fraction": task["share"]}
    load = [(task["current_A"], 1e6)]
    first_s, other_s = (lifetime(load, flow_rate_per_s=2.8e-4, **one) for one in (measured, cell))
    hint = "the smaller the available share, the shorter it lasts"
    yield within("its lifetime", other_s, first_s, 0.002 * first_s, "s", hint)


@explain("20.1", one_number("%", 0.0, 50.0))
def _heavier(task: Task, percent: float) -> Conditions:
    """The UAV of `paper` weighs {body.mass_kg = 1.0, 1.02 .. 1.4} kg. If it becomes heavier, the
    longest hover shrinks, but by fewer percent than the UAV gains. Why? The witness is how many
    percent heavier the UAV is if the hover shrinks by {less:g = 1.0, 1.05 .. 4.5} %, within 0.02 %.

    + Most of the current grows with the rotor speed, and the thrust with its square.
    - A heavier drone flies faster, so that more of the time is left for the hover.
      compare the flight times of both plans
    - The laser gives a heavier drone more light, which pays for the additional weight.
      compare the currents of the rests of both plans
    """
    heavy = task.mission.replace({"body.mass_kg": task["body.mass_kg"] * (1.0 + 0.01 * percent)})
    light_s, heavy_s = (optuav.solve(mission).hover_time_s for mission in (task.mission, heavy))
    hint = "solve both missions over all routes: the more mass, the more hover is lost"
    yield within("the loss", 100.0 * (1.0 - heavy_s / light_s), task["less"], 0.02, "%", hint)


def _way_m(task: Task) -> np.ndarray:
    """Return the way from the origin to the hover point [m]."""
    return np.subtract(vehicle.hover_point_m(task.mission), task.mission.route.origin_m)


def _leg_s(task: Task, share: float = 1.0, wind_N: float = 0.0) -> float:
    """Return how long a share of that way takes in a wind along it [s]."""
    rotors, way_m = Rotors.of(task.mission), _way_m(task)
    wind = tuple(wind_N * way_m / np.linalg.norm(way_m))
    leg = six_stages.leg(rotors.airframe, rotors.motor, tuple(share * way_m), wind)
    return float(leg.loads.duration_s)


@explain("21.1", one_number("N", 0.1, 20.0))
def _windy(task: Task, wind_N: float) -> Conditions:
    """The UAV weighs {body.mass_kg = 0.9, 0.92 .. 1.3} kg. A steady wind along the way from the
    origin to the hover point makes the leg take longer, whether it blows from ahead or from behind.
    Why? The witness is the force [N] of a wind in which the leg of `six_stages.leg` takes
    {percent:g = 3.0, 3.5 .. 60.0} % longer than in calm air, within 0.1 %.

    + The wind helps one half, and costs more time in the other half than it saves.
    - A wind from behind slows the rotors down, and a wind from ahead slows the drone down.
      the wind is a force on the airframe here
    - The drone has to turn more often in a wind, and each turn takes it a second or two.
      there are three turns in any leg
    """
    longer = 100.0 * (_leg_s(task, 1.0, wind_N) / _leg_s(task) - 1.0)  # NaN in a storm
    hint = "the stronger the wind, the longer the leg, until none is possible"
    yield within("the additional time", longer, task["percent"], 0.1, "%", hint)


@explain("22.1", one_number("km", 0.05, 100.0))
def _haze(task: Task, visibility_km: float) -> Conditions:
    """The laser of `paper` draws {laser.power_W = 760, 770 .. 1100} W, and the battery takes
    {battery.charge_current_A = 7.0, 7.1 .. 10.0} A at most. Light haze changes no plan. Why? The
    witness is the visibility [km] at which the receiver at the hover point gives exactly the power
    that the battery may take, within 0.5 %.

    + More light arrives than the battery may take, and the cap hides the loss.
    - Light haze absorbs no light at the wavelength of this laser, so nothing is lost.
      compute the attenuation at a visibility of 10 km
    - The plan never charges from the laser, so that it does not need the light at all.
      what is the current of its rest?
    """
    source = task.mission.to_dict()["laser"]
    apart_m = np.linalg.norm(vehicle.hover_point_m(task.mission) - np.array(source["position_m"]))
    alpha = laser.attenuation(source["wavelength_nm"], visibility_km)
    fits = Fits.of(task.mission).conversion
    power_W = float(laser.received_power(fits, task["laser.power_W"], alpha, apart_m, np.inf))
    cap_W = vehicle.charging_limit_W(task.mission)
    hint = "the cap is charge current times nominal voltage"
    yield within("the received power", power_W, cap_W, 0.005 * cap_W, "W", hint)


@explain("24.1", one_number("s", 0.0, 1000.0))
def _paired(task: Task, half_s: float) -> Conditions:
    """Twenty towns, `optuav.layouts('paper', 20, 'uniform', buildings=4,
    seed={seed = 1, 2 .. 499})`, are solved with deadlines of 800 s and 1200 s. The mean gain of the
    longer deadline has a narrower confidence interval than either mean hover. Why? The witness is
    half the width of the 95 % confidence interval [s] of the mean gain, over the towns that have
    both plans, within 0.02 s.

    + A town that is good with one deadline is good with the other; that part drops out.
    - The difference of two measured means always has a smaller variance than either mean.
      only if they are correlated
    - Twenty towns with two deadlines give forty measurements, and so a narrower interval.
      twenty differences come from twenty towns
    """
    towns = optuav.layouts("paper", 20, "uniform", buildings=4, seed=task["seed"])
    hover_s = optuav.batch_arrays(towns, {"limits.deadline_s": [800.0, 1200.0]})["hover_time_s"]
    gains_s = np.diff(hover_s[np.isfinite(hover_s).all(axis=1)], axis=1)
    truth_s = 1.96 * float(gains_s.std(ddof=1)) / np.sqrt(len(gains_s))
    hint = "1.96 standard errors of the mean of the differences"
    yield from equals(half_s, truth_s, 0.02, "s", hint)


@explain("26.1", numbers_by_name(greedy_s=2000.0, best_s=2000.0))
def _greedy(task: Task, means: Mapping[str, float]) -> Conditions:
    """With a laser on roof 1, 2 or 3, device a hovers {a1 = 540, 541 .. 620},
    {a2 = 640, 641 .. 720} or {a3 = 300, 301 .. 400} s and device b {b1 = 540, 541 .. 620},
    {b2 = 300, 301 .. 400} or {b3 = 640, 641 .. 720} s; the better of two lasers serves a device. A
    greedy method places two lasers one by one, and misses the best pair. Why? The witness is the
    mean hover of each pair, within 0.1 s.

    + The first roof is good for both devices, but best for none once there are two lasers.
    - Greed stops after the first roof, and does not try the others for the second laser.
      it tries every roof beside the first one
    - Greed adds up the hovers of both devices, and the best pair has the largest mean.
      twice the mean is the sum
    """
    table = np.array([[task[f"{device}{roof}"] for roof in (1, 2, 3)] for device in "ab"], float)
    with_each_s = [np.maximum(table[:, [k]], table).mean(axis=0).max() for k in range(3)]
    greedy_s, best_s = with_each_s[table.mean(axis=0).argmax()], max(with_each_s)
    hint = "keep the best single roof, and try the others beside it"
    yield from titled("the greedy pair", equals(means["greedy_s"], greedy_s, 0.1, "s", hint))
    hint = "try all three pairs"
    yield from titled("the best pair", equals(means["best_s"], best_s, 0.1, "s", hint))


@design("28.1", one_number("m", 0.005, 0.3), "relay-today")
def _telescope(task: Task, aperture_m: float) -> Conditions:
    """In `relay-today`, with a jitter of {urad = 8.0, 8.1 .. 12.0} µrad, {watts = 120, 125 .. 160}
    W must reach {reach_m = 3200, 3210 .. 4400} m in the direction of the hover point. Design the
    smallest aperture of the telescope [m] for this: an aperture that is 1 % smaller must be too
    small. The reach is `optuav.link_budget(mission, 'hover').reach_m({watts})`.
    """

    def reach_m(aperture_m: float) -> float:
        keys = {"laser.aperture_m": aperture_m, "laser.jitter_rad": 1e-6 * task["urad"]}
        budget = optuav.link_budget(task.mission.replace(keys), "hover")
        return float(budget.reach_m(float(task["watts"])))

    words = f"an aperture of {figure(aperture_m, 5)} m reaches {fixed(reach_m(aperture_m), 0)} m"
    hint = "which effect limits a small telescope, and which a large one?"
    yield Condition(reach_m(aperture_m) >= task["reach_m"], words, hint)
    is_least = reach_m(0.99 * aperture_m) < task["reach_m"]
    yield Condition(is_least, words, "a smaller one is enough", None, True)


FAR = load("relay-today").replace(
    {"link.device_m": [600, 4450, 0], "route.hover_m": [600, 4450, 80]}
)


@design("29.1", one_number("m/s", 10.0, 23.0), FAR)
def _cruise(task: Task, speed_m_s: float) -> Conditions:
    """In `task.mission`, `relay-today` with its device 4 km away, the deadline is
    {limits.deadline_s = 1480, 1481 .. 1630} s. Design a cruise speed [m/s] that gives at least
    99.95 % of the longest direct hover. What binds at that speed?
    """
    keys = {"flight.cruise_speed_m_s": [speed_m_s, *np.linspace(10.0, 23.0, 1301).tolist()]}
    own_s, *others_s = optuav.batch_arrays(task.mission, keys, "P3")["hover_time_s"].ravel()
    share = float(own_s / np.nanmax(others_s))
    words = f"it hovers for {percent(share)} of the longest time"
    hint = "fly faster while time is short, slower while charge is short: when are both short?"
    yield Condition(share >= 0.9995, words, hint, min(share, 1.0), True)


@explain("30.1", one_number("m", 1.0, 1500.0))
def _stop(task: Task, from_end_m: float) -> Conditions:
    """The UAV of `paper` weighs {body.mass_kg = 1.0, 1.02 .. 1.3} kg. A bend hardly lengthens its
    leg from the origin to the hover point, and yet costs time. Why? The witness is the distance [m]
    from the nearer end at which a stop on the straight line costs {more_s = 8.0, 8.05 .. 14.5} s,
    within 0.05 s. `six_stages.leg` gives the time of each part.

    + Each part is flown from rest to rest, and the drone brakes where it would be fastest.
    - The bent way is longer than the straight one, and the additional metres take that time.
      compare the two lengths
    - The drone turns in the bend, and this turn takes as many seconds as the bend costs.
      how long do all its turns take?
    """
    near = from_end_m / float(np.linalg.norm(_way_m(task)))
    yield Condition(
        near <= 0.5, f"{figure(from_end_m)} m is beyond the middle", "take the nearer end"
    )
    cost_s = _leg_s(task, near) + _leg_s(task, 1.0 - near) - _leg_s(task)
    hint = "a stop costs most in the middle"
    yield within("the cost of the stop", cost_s, task["more_s"], 0.05, "s", hint)


@explain("A1.1", one_number("W", 300.0, 1400.0), "paper-table2")
def _volts(task: Task, power_W: float) -> Conditions:
    """In `paper-table2`, hovering draws {flight.hover_current_A = 68.0, 68.5 .. 90.0} A, and flying
    draws {flight.flight_power_W = 1250, 1260 .. 1550} W. The longest direct hover (P3) is much
    shorter in the perspective `energy` than in `battery`. Why? The witness is the power of the
    hover [W], `flight.hover_power_W`, that makes both equally long, within 0.5 s.

    + A coulomb drawn above the nominal voltage takes more joules than a full pack counts.
    - The battery loses energy in its resistance, and loses more of it with a larger current.
      neither perspective has a resistance
    - The wells keep a part of the energy bound, and a count of charge does not see it.
      neither perspective looks at the wells
    """
    mission = task.mission.replace({"flight.hover_power_W": power_W})
    by_energy_s, by_charge_s = (
        optuav.solve(mission, "P3", perspective=perspective).hover_time_s
        for perspective in ("energy", "battery")
    )
    hint = "the lower the power, the longer the hover by energy"
    yield within("the hover by energy", by_energy_s, by_charge_s, 0.5, "s", hint)


@explain("31.1", one_number("A s", 0.0, 1e5))
def _endless(task: Task, bound_As: float) -> Conditions:
    """One pack holds {battery.capacity_As = 32000, 32100 .. 40000} A s. In each cycle the drone
    hovers {hover_s = 100, 105 .. 460} s and rests until its charge has come back;
    `optuav.coverage(task.mission).visit` has its legs and currents. It departs with a full
    available well, but never with a full bound well. Why? The witness is the charge [A s] in the
    bound well at the start of every cycle: after one cycle, it must be the same within 10 A s.

    + Charge comes only through the available well, slower the closer the levels are.
    - The laser charges the available well first, and starts on the bound well in the end.
      it charges only the available well, all the time
    - The flight home draws from both wells, and the drone departs before both are full.
      how much leaves the bound well in half a minute?
    """
    visit, hover_s = optuav.coverage(task.mission).visit, float(task["hover_s"])
    assert visit is not None
    begin = Tilted.of(visit.battery, Wells(visit.battery.full.available_As, bound_As))
    rest = Stage(visit.rest_A, visit.rest_s(hover_s))
    end = tilted_after(visit.battery, begin, *visit.stages(hover_s), rest).wells(visit.battery)
    hint = "start the next cycle with the charge at the end of this one, and a full available well"
    yield within("after a cycle the bound well", float(end.bound_As), bound_As, 10.0, "A s", hint)


@explain("32.1", one_number("W", 1.0, 1e5), "matrice350")
def _pads(task: Task, power_W: float) -> Conditions:
    """The packs of `matrice350` hold {battery.capacity_As = 80000, 80500 .. 120000} A s each.
    Endless coverage with fewer drones needs stronger pads, and each drone that you save costs more
    power than the one before. Why? The witness is the power [W] that each pad needs with
    {drones = 3, 4 .. 6} drones, within 0.5 %.

    + The same charge has to come back while the other drones hover, in ever less time.
    - Fewer drones have to hover longer in all, and so draw more charge during the day.
      the hovers cover all the time either way
    - A stronger pad wastes a larger share of its power before it reaches a battery.
      here its current is proportional to its power
    """
    need_W = optuav.coverage(task.mission).watts(drones=task["drones"]).power_W
    hint = "coverage(task.mission).watts(drones=...) solves it; how long may each drone rest?"
    yield from equals(power_W, need_W, 0.005 * need_W, "W", hint)


CHARGE = {"total_As": lambda n: round(1.3 * n["flight_s"] * n["flight_A"]) + 5000}


@explain("33.1", numbers_by_name(home_As=72_000.0, dry_As=72_000.0), draws=CHARGE)
def _way_home(task: Task, charges: Mapping[str, float]) -> Conditions:
    """The way home takes {flight_s = 60, 65 .. 300} s with {flight_A = 60, 61 .. 120} A. The
    battery has 72 000 A s, the available fraction {available_fraction = 0.3, 0.35 .. 0.7} and the
    flow rate {flow_rate_per_s = 0.0002, 0.0003 .. 0.0006} per second, and {total_As} A s of charge
    are left. This number does not say whether the drone comes home. Why? The witness is two charges
    of the available well [A s] up to 20 A s apart: with one the drone comes home, and with the
    other it runs dry. The bound well has the rest of the charge.

    + Only the available well feeds the rotors, and bound charge hardly follows in that time.
    - The drain of the way home is uncertain, so that no charge is certain to be enough.
      here the drain is stated exactly
    - The charge at the landing must be 5 % of the capacity, which depends on the wells.
      the well runs dry before this limit counts
    """
    home_As, dry_As, total_As = charges["home_As"], charges["dry_As"], float(task["total_As"])
    words, hint = "that is more than the whole charge", f"{figure(total_As)} A s are left"
    yield Condition(home_As <= total_As, words, hint)
    words, hint = f"they are {figure(home_As - dry_As)} A s apart", "home_As must be the larger one"
    yield Condition(0.0 < home_As - dry_As <= 20.0, words, f"{hint}, by 20 A s at most")
    battery = Battery(72_000.0, task["available_fraction"], task["flow_rate_per_s"])
    way = Stage(-float(task["flight_A"]), float(task["flight_s"]))
    home, dry = (
        float(step(battery, Wells(value_As, total_As - value_As), way).available_As)
        for value_As in (home_As, dry_As)
    )
    hint = "the charge at the landing is linear in both wells: a y1 + b y2 − g"
    yield Condition(home >= 0.0, f"{figure(home_As)} A s run dry on the way", hint)
    yield Condition(dry < 0.0, f"{figure(dry_As)} A s are enough as well", hint)


@design("34.1", ITINERARY)
def _robust(task: Task, plan: Itinerary) -> Conditions:
    """The packs may hold {capacity_As = 2.0, 2.1 .. 8.0} % more or less charge than stated, and the
    UAV may weigh {mass_kg = 1.0, 1.1 .. 3.0} % more or less. Design a plan that hovers first and
    then rests on b10, can be flown in every case, and hovers at least 99 % as long as the best such
    plan. Which corners of the box need an audit?
    """
    same = [stop.at for stop in plan.stops] == ["hover", "b10"]
    yield Condition(same, "it has other stops", "hover, then rest on b10")
    packs, body = task["capacity_As"], task["mass_kg"]
    for more, heavier in itertools.product((-packs, packs), (-body, body)):
        corner = {
            "battery.capacity_As": 36_000.0 * (1.0 + 0.01 * more),
            "body.mass_kg": 1.3 * (1.0 + 0.01 * heavier),
        }
        judged = audit(Itinerary(task.mission.replace(corner), plan.stops))
        at = " and ".join(f"{key} = {figure(value)}" for key, value in corner.items())
        yield Condition(bool(judged), f"it cannot be flown with {at}", "audit it there")
    box = {"battery.capacity_As": {"percent": packs}, "body.mass_kg": {"percent": body}}
    best = optuav.robust(task.mission, box, optuav.P4("b10", order="hover-first"))
    yield from longest(plan, best.hover_s, 0.99)


OVER_DEVICES = ITINERARY._replace(example="[('market', 'hover', 600.0), ('b3', 'rest', 100.0)]")


@explain("35.1", OVER_DEVICES, "three-sensors")
def _between(task: Task, plan: Itinerary) -> Conditions:
    """The drone of `three-sensors` has {limits.deadline_s = 3300, 3320 .. 4200} s. A rest between
    two hovers lengthens the longest hover by minutes, and one before the first hover by seconds.
    Why? The witness is an itinerary that rests once, between two hovers, can be flown, and hovers
    at least 99 % of the longest time, a third of it over each device. The hover points have the
    names of the devices.

    + Soon after take-off the full battery takes little charge; later the hovers have made room.
    - The laser charges far faster on a roof that lies between two hover points than on others.
      compare the currents of the rests of two plans, one before the first hover and one between
    - The way with a rest between two hovers takes less time and charge than the direct way.
      compare the flight times of both plans
    """
    kinds = [stop.kind for stop in plan.stops]
    between = kinds.count("rest") == 1 and kinds[0] == kinds[-1] == "hover"
    words = "it must rest once, after the first hover and before the last"
    yield Condition(between, "it has no rest between two hovers", words)
    best_s = optuav.solve(task.mission, optuav.P1(order="between")).hover_time_s
    yield from longest(plan, best_s, 0.99)

"""Exercises of lessons 31 to 34: cycles, fleets, the way back, and plans that hold."""

import itertools
from collections.abc import Mapping

import optuav
from optuav.exercises.answers import ITINERARY, figure, figures
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.witness import Condition, Conditions, Witness, equals, longest, within
from optuav.judge import Itinerary, audit
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, step, tilted_after


@Witness(
    "31.1",
    "One pack holds {battery.capacity_As} A s. In each cycle the drone hovers {hover_s} s and "
    "rests until its charge has come back; `optuav.coverage(task.mission).visit` has its legs and "
    "currents. It departs with a full available well, but never with a full bound well. Why? The "
    "witness is the charge [A s] in the bound well at the start of every cycle: after one cycle, "
    "it must be the same within 10 A s.",
    {"battery.capacity_As": range(32_000, 40_001, 100), "hover_s": range(100, 461, 5)},
    reasons={
        "Charge comes only through the available well, slower the closer the levels are.": "",
        "The laser charges the available well first, and starts on the bound well in "
        "the end.": "it charges only the available well, all the time",
        "The flight home draws from both wells, and the drone departs before both are full.": "how "
        "much leaves the bound well in half a minute?",
    },
    form=figure("A s", 0.0, 1e5),
)
def _endless(task: Task, bound_As: float) -> Conditions:
    visit, hover_s = optuav.coverage(task.mission).visit, float(task["hover_s"])
    assert visit is not None
    begin = Tilted.of(visit.battery, Wells(visit.battery.full.available_As, bound_As))
    rest = Stage(visit.rest_A, visit.rest_s(hover_s))
    end = tilted_after(visit.battery, begin, *visit.stages(hover_s), rest).wells(visit.battery)
    hint = "start the next cycle with the charge at the end of this one, and a full available well"
    yield within("after a cycle the bound well", float(end.bound_As), bound_As, 10.0, "A s", hint)


@Witness(
    "32.1",
    "The packs of `matrice350` hold {battery.capacity_As} A s each. Endless coverage with fewer "
    "drones needs stronger pads, and each drone that you save costs more power than the one "
    "before. Why? The witness is the power [W] that each pad needs with {drones} drones, within "
    "0.5 %.",
    {"battery.capacity_As": range(80_000, 120_001, 500), "drones": (3, 4, 5, 6)},
    "matrice350",
    reasons={
        "The same charge has to come back while the other drones hover, in ever less time.": "",
        "Fewer drones have to hover longer in all, and so draw more charge during the day.": "the "
        "hovers cover all the time either way",
        "A stronger pad wastes a larger share of its power before it reaches a battery.": "here "
        "its current is proportional to its power",
    },
    form=figure("W", 1.0, 1e5),
)
def _pads(task: Task, power_W: float) -> Conditions:
    need_W = optuav.coverage(task.mission).watts(drones=task["drones"]).power_W
    hint = "coverage(task.mission).watts(drones=...) solves it; how long may each drone rest?"
    yield equals(power_W, need_W, 0.005 * need_W, "W", hint)


@Witness(
    "33.1",
    "The way home takes {flight_s} s with {flight_A} A. The battery has 72 000 A s, the available "
    "fraction {available_fraction} and the flow rate {flow_rate_per_s} per second, and {total_As} "
    "A s of charge are left. This number does not say whether the drone comes home. Why? The "
    "witness is two charges of the available well [A s] up to 20 A s apart: with one the drone "
    "comes home, and with the other it runs dry. The bound well has the rest of the charge.",
    {
        "flight_s": range(60, 301, 5),
        "flight_A": range(60, 121),
        "available_fraction": decimals(0.3, 0.7, 0.05),
        "flow_rate_per_s": decimals(0.0002, 0.0006, 0.0001),
        "total_As": lambda drawn: round(1.3 * drawn["flight_s"] * drawn["flight_A"]) + 5000,
    },
    reasons={
        "Only the available well feeds the rotors, and bound charge hardly follows in "
        "that time.": "",
        "The drain of the way home is uncertain, so that no charge is certain to "
        "be enough.": "here the drain is stated exactly",
        "The charge at the landing has to be 5 % of the capacity, which depends on "
        "the wells.": "the well runs dry before this limit counts",
    },
    form=figures(home_As=("A s", 0.0, 72_000.0), dry_As=("A s", 0.0, 72_000.0)),
)
def _way_home(task: Task, charges: Mapping[str, float]) -> Conditions:
    home_As, dry_As, total_As = charges["home_As"], charges["dry_As"], float(task["total_As"])
    yield Condition(
        home_As <= total_As, "that is more than the whole charge", f"{total_As:g} A s are left"
    )
    words = f"they are {home_As - dry_As:g} A s apart"
    yield Condition(
        0.0 < home_As - dry_As <= 20.0, words, "home_As must be larger, by 20 A s at most"
    )
    battery = Battery(72_000.0, task["available_fraction"], task["flow_rate_per_s"])
    way = Stage(-float(task["flight_A"]), float(task["flight_s"]))
    home, dry = (
        float(step(battery, Wells(value_As, total_As - value_As), way).available_As)
        for value_As in (home_As, dry_As)
    )
    hint = "the charge at the landing is linear in both wells: a y1 + b y2 − g"
    yield Condition(home >= 0.0, f"{home_As:g} A s run dry on the way", hint)
    yield Condition(dry < 0.0, f"{dry_As:g} A s are enough as well", hint)


@Witness(
    "34.1",
    "The packs may hold {capacity_As} % more or less charge than stated, and the UAV may weigh "
    "{mass_kg} % more or less. Design a plan that hovers first and then rests on b10, can be flown "
    "in every case, and hovers at least 99 % as long as the best such plan. Which corners of the "
    "box need an audit?",
    {"capacity_As": decimals(2.0, 8.0, 0.1), "mass_kg": decimals(1.0, 3.0, 0.1)},
    form=ITINERARY,
)
def _robust(task: Task, plan: Itinerary) -> Conditions:
    same = [stop.at for stop in plan.stops] == ["hover", "b10"]
    yield Condition(same, "it has other stops", "hover, then rest on b10")
    stated = {
        "battery.capacity_As": 36_000.0,
        "body.mass_kg": task.mission.to_dict()["body"]["mass_kg"],
    }
    box = {key: {"percent": task[key.split(".")[1]]} for key in stated}
    for signs in itertools.product((-0.01, 0.01), repeat=2):
        corner = {
            key: value * (1.0 + sign * box[key]["percent"])
            for sign, (key, value) in zip(signs, stated.items(), strict=True)
        }
        judged = audit(Itinerary(task.mission.replace(corner), plan.stops))
        at = " and ".join(f"{key} = {value:.6g}" for key, value in corner.items())
        yield Condition(bool(judged), f"it cannot be flown with {at}", "audit it there")
    best = optuav.robust(task.mission, box, optuav.P4("b10", order="hover-first"))
    yield from longest(plan, best.hover_s, 0.99)

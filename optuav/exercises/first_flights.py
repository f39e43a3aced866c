"""Exercises of the first part: a mission, a drone, its battery and when it runs dry."""

import optuav
from optuav.exercises.design import design
from optuav.exercises.exercise import Task, decimals
from optuav.exercises.predict import Predictions, predict
from optuav.options import Order
from optuav.physics.kibam import Battery, Stage, Wells, step


@predict(
    "01.1",
    "The deadline of the mission `paper` is {limits.deadline_s} s, and the direct flight takes "
    "75.79 s. For how many seconds does the plan of P3 hover, in the perspective battery? Charge "
    "would last for 688.85 s.",
    unit="s",
    within=0.5,
    draws={"limits.deadline_s": decimals(500.0, 740.0, 2.0)},
)
def _hurried(task: Task) -> Predictions:
    hover_s = optuav.solve(task.mission, "P3", perspective="battery").hover_time_s
    yield hover_s, "two limits bound the hover, charge and time; the nearer one counts"
    yield 688.85, "so long lasts the charge; is there so much time?"
    yield task["limits.deadline_s"], "the flight is part of the mission"


@predict(
    "01.2",
    "At the end of the mission, {limits.min_soc:.1%} of the charge must be left, not 5 %. By how "
    "many seconds is the direct hover (P3, perspective battery) shorter for it? The two packs hold "
    "36 000 A s each, and hovering draws 87.91 A.",
    unit="s",
    within=0.5,
    draws={"limits.min_soc": decimals(0.06, 0.30, 0.002)},
)
def _reserve(task: Task) -> Predictions:
    kept, before = task["limits.min_soc"], task.mission.replace({"limits.min_soc": 0.05})
    long_s, short_s = (
        optuav.solve(each, "P3", perspective="battery").hover_time_s
        for each in (before, task.mission)
    )
    lost_s = long_s - short_s
    yield lost_s, "the charge that is kept back in addition, over the current of the hover"
    yield lost_s / 2.0, "there are two packs"
    yield lost_s * kept / (kept - 0.05), "5 % were kept back before as well"


@predict(
    "01.3",
    "One pack holds {battery.capacity_As} A s. What ends the direct hover (P3, 1200 s, perspective "
    "battery), charge or deadline, and how many seconds later would the other one end it? The "
    "flights take 75.79 s and 7843 A s, hovering draws 87.91 A, and 5 % are kept. Answer with a "
    "pair, as ('charge', 10.0).",
    unit="s",
    within=0.5,
    among=("charge", "deadline"),
    draws={"battery.capacity_As": (*range(40_000, 55_000, 500), *range(61_000, 76_000, 500))},
)
def _what_binds(task: Task) -> Predictions:
    late = task.mission.replace({"limits.deadline_s": 10_000.0})
    plan = optuav.solve(late, "P3", perspective="battery")
    by_charge_s, by_deadline_s = plan.hover_time_s, 1200.0 - plan.flight_time_s
    yield (
        "charge" if by_charge_s < by_deadline_s else "deadline",
        "how long would the charge last, and how long the time?",
    )
    yield abs(by_charge_s - by_deadline_s), "what is left for the hover of the charge, and of time?"
    yield abs(by_charge_s - 1200.0), "the flights take some of the time"
    yield abs(by_charge_s + 7843.1 / 87.91 - by_deadline_s), "the flights draw some of the charge"


@predict(
    "02.1",
    "A drone has two packs of {capacity_mAh} mAh, and hovers for {hover_min} min from full to "
    "empty. Which current [A] does it draw?",
    unit="A",
    within=0.1,
    draws={"capacity_mAh": range(3000, 9001, 100), "hover_min": range(18, 46)},
)
def _hover_current(task: Task) -> Predictions:
    current_A = 2.0 * task["capacity_mAh"] / 1000.0 / (task["hover_min"] / 60.0)
    yield current_A, "a current is a charge over a time; 1000 mAh in an hour are 1 A"
    yield current_A / 2.0, "both packs are emptied"


@predict(
    "02.2",
    "A drone of {mass_kg} kg draws 20 A when it hovers. Which current [A] does it draw with a "
    "payload of {payload_kg} kg?",
    unit="A",
    within=0.1,
    draws={"mass_kg": decimals(2.0, 6.0, 0.1), "payload_kg": decimals(0.5, 2.0, 0.1)},
)
def _with_payload(task: Task) -> Predictions:
    factor = 1.0 + task["payload_kg"] / task["mass_kg"]
    yield 20.0 * factor**1.5, "power grows with the weight to a power that the lesson states"
    yield 20.0 * factor, "twice the weight takes more than twice the power"
    yield 20.0 * factor**2, "power grows more slowly than with the square of the weight"


@predict(
    "02.3",
    "The mission is `matrice350`, without its laser. By how many percent does the direct hover "
    "(P3, perspective battery) shrink if the hover draws {more:.0%} more current?",
    unit="%",
    within=0.1,
    mission="matrice350",
    draws={"more": decimals(0.05, 0.6, 0.01)},
    fixed={"laser.power_W": 0.0},
)
def _more_current(task: Task) -> Predictions:
    more, flight = task["more"], task.mission.to_dict()["flight"]
    hungry = {"flight.hover_current_A": flight["hover_current_A"] * (1.0 + more)}
    long_s, short_s = (
        optuav.solve(each, "P3", perspective="battery").hover_time_s
        for each in (task.mission, task.mission.replace(hungry))
    )
    yield 100.0 * (1.0 - short_s / long_s), "a time is a charge over a current"
    yield 100.0 * more, "the time is divided by what the current is multiplied with"


@predict(
    "03.1",
    "A battery of {capacity_As} A s has {available_fraction:.0%} of its charge in the available "
    "well. No charge flows between the wells (k_F = 0), and {current_A} A are drawn from the full "
    "battery. After how many seconds is it empty?",
    unit="s",
    within=0.5,
    draws={
        "capacity_As": range(10_000, 40_001, 500),
        "available_fraction": (*decimals(0.3, 0.45, 0.05), *decimals(0.55, 0.9, 0.05)),
        "current_A": range(10, 31),
    },
)
def _without_flow(task: Task) -> Predictions:
    all_s = task["capacity_As"] / task["current_A"]
    share = task["available_fraction"]
    yield share * all_s, "the load draws from one of the wells only"
    yield all_s, "the charge of the bound well cannot be drawn"
    yield (1.0 - share) * all_s, "the load draws from the other well"


@predict(
    "03.2",
    "The wells of `paper` hold {available_As} A s (available) and {bound_As} A s (bound). No "
    "current is drawn for a very long time. How many A s are in the available well then? Of a full "
    "battery, 80 % are available.",
    unit="A s",
    within=20.0,
    draws={"available_As": range(2000, 20_001, 500), "bound_As": range(9000, 14_401, 300)},
)
def _levelled(task: Task) -> Predictions:
    wells = Wells(task["available_As"], task["bound_As"])
    after = step(Battery(72_000.0, 0.8, 4.5e-5), wells, Stage(0.0, 1e7))
    yield after.available_As, "charge flows until both wells stand at the same height"
    yield sum(wells) / 2.0, "the same height is not the same charge: the wells have widths"
    yield 0.8 * 72_000.0, "that is a full well; nothing is charged here"


@predict(
    "03.3",
    "A KiBaM battery of {capacity_As} A s, 80 % of it available, has k_F = 4.5e-5 per second. "
    "Which current [A] flows from the bound into the available well at the moment at which the "
    "available well holds {left:.0%} of what it can hold, the bound well still being full?",
    unit="A",
    within=0.02,
    draws={"capacity_As": range(40_000, 90_001, 1000), "left": decimals(0.1, 0.7, 0.1)},
)
def _flow(task: Task) -> Predictions:
    battery = Battery(task["capacity_As"], 0.8, 4.5e-5)
    wells = Wells(task["left"] * battery.full.available_As, battery.full.bound_As)
    after = step(battery, wells, Stage(0.0, 1e-3))
    flow_A = (after.available_As - wells.available_As) / 1e-3
    yield flow_A, "charge flows from the higher well to the lower one: how high does each stand?"
    yield flow_A / (1.0 - task["left"]), "the available well is not empty"


@predict(
    "04.1",
    "One pack holds {battery.capacity_As} A s and the share {battery.available_fraction} of it is "
    "available; k_F = 4.5e-5 per second, two packs. What is the largest current [A] that can flow "
    "from the bound well into the available one?",
    unit="A",
    within=0.01,
    draws={
        "battery.capacity_As": range(28_000, 44_001, 200),
        "battery.available_fraction": decimals(0.5, 0.9, 0.05),
    },
)
def _largest_flow(task: Task) -> Predictions:
    battery = task.mission.battery
    whole = Battery(2.0 * battery.capacity_As, battery.available_fraction, 4.5e-5)
    after = step(whole, Wells(0.0, whole.full.bound_As), Stage(0.0, 1e-3))
    most_A = after.available_As / 1e-3
    yield most_A, "one well is full then, and the other empty; ω divides both"
    yield most_A / 2.0, "there are two packs"


@predict(
    "04.2",
    "Take the best plan of P4 on b1, {order}, in the perspective battery; one pack holds "
    "{battery.capacity_As} A s. Simulated with both wells, which limit does it break first, empty "
    "or full, and how many seconds of hover does it plan? Answer with a pair, as ('empty', 10.0).",
    unit="s",
    within=0.5,
    among=("empty", "full"),
    draws={
        "order": ("rest first", "hover first"),
        "battery.capacity_As": range(30_000, 42_001, 100),
    },
)
def _first_breach(task: Task) -> Predictions:
    order: Order = "rest-first" if task["order"] == "rest first" else "hover-first"
    plan = optuav.solve(task.mission, optuav.P4("b1", order=order), perspective="battery")
    hint = "how full is the available well when the rest begins?"
    yield optuav.replay(plan).violations[0].kind, hint
    yield plan.hover_time_s, "solve P4 on b1 in this order and perspective"


@design(
    "04.3",
    "One pack holds {battery.capacity_As} A s. Design an itinerary with one rest at most that can "
    "be flown and hovers at least 99 % of the longest such hover. Where and when does a rest help, "
    "if the well must neither run dry nor be charged past full? Use `optuav.audit`, and no solver. "
    "Answer with stops in order, as [('b1', 'rest', 100.0), ('hover', 'hover', 400.0)].",
    least=0.99,
    rests=1,
    draws={"battery.capacity_As": range(30_000, 42_001, 200)},
)
def _flown(task: Task) -> float:
    return optuav.solve(task.mission).hover_time_s

"""Exercises of the second part: declarations, duality, slots and routes as programmes."""

import math

import numpy as np

import optuav
from optuav.arrays import Booleans, Floats
from optuav.engines import closed_form
from optuav.exercises.declare import declare
from optuav.exercises.design import design
from optuav.exercises.exercise import Task, decimals, programme
from optuav.exercises.predict import Predictions, predict
from optuav.exercises.prove import prove
from optuav.modelling import Model
from optuav.modelling.classify import traits
from optuav.options import Perspective
from optuav.solving import Program

TIMES = {"hover_time_s": ("Δ", "s", 1.0), "rest_time_s": ("T'", "s", 0.0)}
PERSPECTIVES: tuple[Perspective, ...] = ("battery", "energy", "available")
CURRENTS = {"hover_A": range(60, 121, 2), "rest_A": range(4, 13)}
NUMBERS = {**CURRENTS, "usable_As": range(50_000, 60_001, 500), "left_s": range(1050, 1201, 10)}
"""Of (P4) in whole numbers; charge and deadline bind at most of them."""


def _with_rest(task: Task, **more: tuple[dict[str, float], float]) -> Model:
    """The longest hover with a rest, in whole numbers, with more rows."""
    drawn = {"hover_time_s": task["hover_A"], "rest_time_s": -task["rest_A"]}
    time = {"hover_time_s": 1.0, "rest_time_s": 1.0}
    rows = {"charge": (drawn, task["usable_As"]), "deadline": (time, task["left_s"])}
    return programme("longest hover with a rest", TIMES, rows | more)


@declare(
    "05.1",
    "Declare a Model with the unknowns hover_time_s and rest_time_s: the longest hover, where "
    "hovering draws {hover_A} A and resting returns {rest_A} A, at most {usable_As} A s may be "
    "drawn in all, and both together last {left_s} s at most.",
    draws={**CURRENTS, "usable_As": range(40_000, 59_001, 1000), "left_s": range(1000, 1401, 50)},
)
def _longest_hover(task: Task) -> Model:
    return _with_rest(task)


@declare(
    "05.2",
    "Declare a formulation: as P4, but the UAV is to be back {margin_s} s before the deadline. It "
    "is compared with P4 on {building}, hover first, in the perspective battery.",
    draws={"margin_s": range(20, 201, 5), "building": tuple(f"b{k}" for k in range(1, 11))},
)
def _early(task: Task) -> Program:
    deadline_s = task.mission.limits.deadline_s - task["margin_s"]
    sooner = task.mission.replace({"limits.deadline_s": deadline_s})
    problem = optuav.P4(task["building"], order="hover-first")
    return optuav.formulate(sooner, problem, perspective="battery")


@predict(
    "06.1",
    "One pack of `paper` holds {battery.capacity_As} A s. How long [s] is the hover of P3 in the "
    "perspective battery, if flights draw 7843.1 A s in all, hovering draws 87.91 A and 5 % of the "
    "charge are kept?",
    unit="s",
    within=0.5,
    draws={"battery.capacity_As": range(30_000, 50_001, 100)},
)
def _by_hand(task: Task) -> Predictions:
    hover_s, by_energy_s, flown_s = (
        optuav.solve(task.mission, "P3", perspective=each).hover_time_s for each in PERSPECTIVES
    )
    yield hover_s, "usable charge is 95 % of both packs less what the flights draw"
    yield by_energy_s, "that is the answer of the perspective energy"
    yield flown_s, "that is the answer of the perspective available, in which the wells count"
    yield hover_s + 7843.1 / 87.91, "the flights draw their share first"
    yield hover_s + 3600.0 * task["battery.capacity_As"] / 36_000.0 / 87.91, "5 % stay in the packs"


@predict(
    "06.2",
    "In slots of {slot_s} s, how long [s] is the hover of P3 (1200 s, perspective battery, "
    "min_soc {limits.min_soc:.1%})? In continuous times it is the usable charge over 87.91 A; "
    "flights draw 7843.1 A s of 72 000 A s.",
    unit="s",
    within=0.01,
    draws={"slot_s": range(7, 61), "limits.min_soc": decimals(0.05, 0.2, 0.005)},
)
def _in_slots(task: Task) -> Predictions:
    slot_s = task["slot_s"]
    plan = optuav.solve(task.mission, "P3", perspective="battery", slot_s=slot_s)
    hover_s = plan.hover_time_s
    yield hover_s, "only whole slots count, and the charge of a slot that is begun is needed too"
    yield hover_s + slot_s, "rounded up, the charge does not last"


@prove(
    "06.3",
    "Prove the optimum: give the multiplier of each constraint, as a dict by label, and unrounded.",
    draws={"hover_A": range(60, 121), "usable_As": range(50_000, 60_001, 500)},
)
def _one_unknown(task: Task) -> Model:
    rows = {
        "charge": ({"hover_time_s": task["hover_A"]}, task["usable_As"]),
        "deadline": ({"hover_time_s": 1.0}, 1100.0),
    }
    return programme("longest hover without a rest", {"hover_time_s": TIMES["hover_time_s"]}, rows)


@predict(
    "07.1",
    "Charge and deadline bind. Hovering draws {hover_A} A, resting returns {rest_A} A. How many "
    "seconds of hover does one more second of deadline bring? Answer with three decimals or more.",
    within=0.0005,
    draws=CURRENTS,
)
def _price_of_time(task: Task) -> Predictions:
    hover_A, rest_A = task["hover_A"], task["rest_A"]
    yield (
        rest_A / (hover_A + rest_A),
        "of the second, part is hover and part is rest that pays for it",
    )
    yield rest_A / hover_A, "the rest that pays for the hover takes time of the same second"
    yield hover_A / (hover_A + rest_A), "that is the part of the second that is rest"


@prove(
    "07.2",
    "Prove the optimum of this P4: give the multiplier of each constraint, as a dict by label, and "
    "unrounded. Multipliers of bounds may be left out where they are 0.",
    draws=NUMBERS,
)
def _two_lines(task: Task) -> Model:
    return _with_rest(task)


@predict(
    "07.3",
    "The price of the deadline has a kink where the best plan stops resting. Usable charge is "
    "{usable_As} A s, hovering draws {hover_A} A, and flights take 100 s. At which deadline [s]?",
    unit="s",
    within=1.0,
    draws={**CURRENTS, "usable_As": range(50_000, 60_001, 500)},
)
def _kink(task: Task) -> Predictions:
    hover_s = task["usable_As"] / task["hover_A"]
    yield hover_s + 100.0, "up to there all time is hover; then the charge is used up"
    yield hover_s, "the deadline is that of the whole mission"


@declare(
    "08.1",
    "Declare the dual of this linear programme as a Model with the unknowns charge_price, "
    "time_price and rest_price, one for each row: maximise Δ subject to {hover_A} Δ − {rest_A} T' "
    "≤ {usable_As}, Δ + T' ≤ {left_s} and T' ≤ {most_s}, with Δ ≥ 0 and T' ≥ 0.",
    draws={**NUMBERS, "most_s": range(100, 301, 10)},
)
def _dual(task: Task) -> Model:
    rows = {
        "charge_price": ((task["hover_A"], -task["rest_A"]), task["usable_As"]),
        "time_price": ((1.0, 1.0), task["left_s"]),
        "rest_price": ((0.0, 1.0), task["most_s"]),
    }
    goal = {name: (name, "1", float(limit)) for name, (_, limit) in rows.items()}
    columns = {
        label: ({name: coefficients[k] for name, (coefficients, _) in rows.items()}, least)
        for k, (label, least) in enumerate((("column of Δ", 1.0), ("column of T'", 0.0)))
    }
    return programme("dual", goal, columns, sense="minimise")


@prove(
    "08.2",
    "Give a point and multipliers that satisfy all KKT conditions of this programme: a dict of "
    "hover_time_s, rest_time_s and the multipliers, each by its label.",
    with_point=True,
    draws={**NUMBERS, "most_s": range(100, 301, 10)},
)
def _short_rest(task: Task) -> Model:
    return _with_rest(task, **{"longest rest": ({"rest_time_s": 1.0}, task["most_s"])})


@predict(
    "08.3",
    "The best plan hovers {hover_s} s and rests {rest_s} s. Charge has the price {price} s of "
    "hover per A s. At which rate [s per ampere] does the longest hover change with the hover "
    "current, at the margin?",
    unit="s/A",
    within=0.01,
    draws={
        "hover_s": range(500, 801),
        "rest_s": range(200, 500),
        "price": decimals(0.005, 0.015, 0.001),
    },
)
def _price_of_current(task: Task) -> Predictions:
    price, rate_s_per_A = task["price"], -task["price"] * task["hover_s"]
    hint = "how much more charge does the same plan draw per ampere, and what is that worth?"
    yield rate_s_per_A, hint
    yield -rate_s_per_A, "does more current lengthen the hover?"
    yield rate_s_per_A / (1.0 + price), "so much for a whole ampere; at the margin steps are small"
    yield -task["price"] * (task["hover_s"] + task["rest_s"]), "the rest draws no more than before"


@predict(
    "09.1",
    "The flight leaves {left_s} s of the deadline. How many pairs of a hover and a rest, both of "
    "at least one whole slot of {slot_s} s, does the grid visit?",
    draws={"left_s": range(300, 1101, 7), "slot_s": (2.0, 5.0, 10.0, 20.0)},
)
def _cells(task: Task) -> Predictions:
    slots = math.floor(task["left_s"] / task["slot_s"])
    yield slots * (slots - 1) // 2, "count the pairs for a hover of 1 slot, of 2 slots, and so on"
    yield slots * slots, "hover and rest together must fit into the time that is left"
    yield slots * (slots + 1) // 2, "a rest takes at least one slot as well"


@predict(
    "09.2",
    "Whole slots of {slot_s} s fill the time that is left, and the longest hover in continuous "
    "times is {best_s} s. How long [s] is the hover that the grid finds at least?",
    unit="s",
    within=0.01,
    draws={"slot_s": range(7, 61), "best_s": decimals(600.5, 760.5, 1.0)},
)
def _rounded_down(task: Task) -> Predictions:
    slots = math.floor(task["best_s"] / task["slot_s"])
    yield slots * task["slot_s"], "round the best hover down, and rest in all other slots"
    yield (slots + 1) * task["slot_s"], "a longer hover than the best one is not feasible"
    yield task["best_s"] - task["slot_s"], "less than one slot is lost, and a hover is whole slots"


STRONG_LASER = {
    **{"battery.charge_current_A": 95.0, "laser.power_W": 13_000.0},
    **{"battery.available_fraction": 0.4, "battery.flow_rate_per_s": 1e-3},
}


def _feasible(task: Task, hovers_s: Floats) -> Booleans:
    """Whether hovers before a rest on b9 can be flown, with the strong laser."""
    program = optuav.formulate(task.mission, optuav.P4("b9", order="hover-first"))
    rows = program.check({"hover_time_s": hovers_s, "rest_time_s": task["rest_s"]})
    every = [np.broadcast_to(row.satisfied, hovers_s.shape) for row in rows]
    return np.asarray(np.all(every, axis=0))


@predict(
    "10.1",
    "On the mission with the strong laser, task.mission, hovers of {short_s} s and of {long_s} s "
    "before a rest of {rest_s} s on b9 can both be flown. Can the hover halfway between "
    "them, before the same rest, and how long [s] is it? Answer with a pair, as ('yes', 10.0).",
    unit="s",
    within=0.1,
    among=("yes", "no"),
    draws={
        "short_s": range(5, 21),
        "long_s": range(1000, 1041, 2),
        "rest_s": (*decimals(40.0, 48.0, 1.0), *decimals(53.0, 55.0, 0.25)),
    },
    fixed=STRONG_LASER,
)
def _halfway(task: Task) -> Predictions:
    middle_s = 0.5 * (task["short_s"] + task["long_s"])
    answer = "yes" if _feasible(task, np.array([middle_s]))[0] else "no"
    yield answer, "how full is the available well after each of the hovers, and after the rest?"
    yield middle_s, "as far from the one as from the other"


@predict(
    "10.2",
    "On the same mission the rest on b9 lasts {rest_s} s, and only the hover before it is free. A "
    "walk uphill starts at a hover of 5 s. At which hover [s] does it stop?",
    unit="s",
    within=1.0,
    draws={"rest_s": decimals(52.0, 55.0, 0.01)},
    fixed=STRONG_LASER,
)
def _stuck(task: Task) -> Predictions:
    hovers_s = np.linspace(5.0, 1100.0, 10_951)
    feasible = _feasible(task, hovers_s)
    ends_s = hovers_s[:-1][feasible[:-1] & ~feasible[1:]]
    yield float(ends_s[0]), "it stops where no step up is feasible: look along the hovers"
    yield float(ends_s[-1]), "no way that leads up all the time goes there from 5 s"


@predict(
    "10.3",
    "One pack of `paper` holds {battery.capacity_As} A s. The KKT conditions hold at a plan of P4 "
    "on {building} in the perspective {perspective}, which hovers first. Is that alone a proof "
    "that the plan is optimal, and how many seconds does the best such plan hover? Answer with a "
    "pair, as ('yes', 10.0).",
    unit="s",
    within=0.5,
    among=("yes", "no"),
    draws={
        "building": tuple(f"b{k}" for k in range(1, 11)),
        "perspective": ("battery", "energy", "adjusted", "available"),
        "battery.capacity_As": range(30_000, 42_001, 100),
    },
)
def _is_a_proof(task: Task) -> Predictions:
    problem = optuav.P4(task["building"], order="hover-first")
    program = optuav.formulate(task.mission, problem, perspective=task["perspective"])
    answer = "yes" if traits(program.parts[0].model).linear else "no"
    yield answer, "is the feasible set convex in this perspective?"
    plan = optuav.solve(task.mission, problem, perspective=task["perspective"])
    yield plan.hover_time_s, "solve P4 on this building in this perspective"


@predict(
    "11.1",
    "The charge row of a route reads {hover_A} Δ − {rest_A} T' ≤ {usable_As} + M (1 − λ), and the "
    "deadline leaves {left_s} s. What is the smallest M [A s] that switches the row off where λ = "
    "0, whatever times from 0 to the time left are chosen?",
    unit="A s",
    within=1.0,
    draws=NUMBERS,
)
def _big_m(task: Task) -> Predictions:
    most_As = task["hover_A"] * task["left_s"]
    yield most_As - task["usable_As"], "at which times is the left side largest, and by how much?"
    yield most_As, "the right side has charge without M as well"
    hint = "no rest makes the left side larger"
    yield most_As + task["rest_A"] * task["left_s"] - task["usable_As"], hint


@predict(
    "11.2",
    "One of two routes is chosen: maximise Δ subject to Δ ≤ {first_s} + {M} (1 − λ) and Δ ≤ "
    "{second_s} + {M} λ, λ binary. What is the optimum [s] of the relaxation, 0 ≤ λ ≤ 1?",
    unit="s",
    within=0.5,
    draws={
        "first_s": range(600, 701, 4),
        "second_s": range(702, 803, 4),
        "M": range(200, 1001, 20),
    },
)
def _relaxation(task: Task) -> Predictions:
    goal = {"hover_time_s": ("Δ", "s", 1.0), "first": ("λ", "1", 0.0)}
    rows = {
        "first": ({"hover_time_s": 1.0, "first": task["M"]}, task["first_s"] + task["M"]),
        "second": ({"hover_time_s": 1.0, "first": -task["M"]}, task["second_s"]),
        "choice": ({"first": 1.0}, 1.0),
    }
    relaxed = closed_form.solve(programme("relaxation", goal, rows), 1)
    yield float(relaxed.objective[0]), "both rows bound Δ; for which λ is the nearer one farthest?"
    yield task["second_s"], "that is the optimum with a binary λ, and the bound of the convex hull"
    yield task["second_s"] + task["M"], "with λ = 1 the first row is not switched off"


@declare(
    "11.3",
    "Declare a Model with the unknowns hover_time_s, rest_time_s and by_way (binary): the longest "
    "hover, where by_way = 1 is a route with a rest and by_way = 0 the direct one. On both, "
    "{hover_A} Δ − {rest_A} T' ≤ Q and Δ + T' ≤ T. By way, Q = {usable_As} A s and T = {left_s} s; "
    "direct, Q is 1000 A s more and T is 20 s more, but T' = 0.",
    draws=NUMBERS,
)
def _choice(task: Task) -> Model:
    drawn = {"hover_time_s": task["hover_A"], "rest_time_s": -task["rest_A"]}
    time, left_s = {"hover_time_s": 1.0, "rest_time_s": 1.0}, task["left_s"]
    rows = {
        "charge": ({**drawn, "by_way": 1000.0}, task["usable_As"] + 1000.0),
        "deadline": ({**time, "by_way": 20.0}, left_s + 20.0),
        "no rest on the direct route": ({"rest_time_s": 1.0, "by_way": -left_s}, 0.0),
    }
    goal = {**TIMES, "by_way": ("λ", "1", 0.0)}
    return programme("direct, or by way of a building", goal, rows, binary=["by_way"])


@design(
    "11.4",
    "The roofs b9 and b10 are closed, and one pack holds {battery.capacity_As} A s. Which building "
    "is best now, before or after the hover? Design an itinerary that can be flown and hovers at "
    "least 99.5 % of the best with one rest.",
    least=0.995,
    rests=1,
    draws={"battery.capacity_As": range(30_000, 42_001, 200)},
    fixed={"buildings.b9": None, "buildings.b10": None},
)
def _closed_roofs(task: Task) -> float:
    return optuav.solve(task.mission).hover_time_s


@predict(
    "12.1",
    "The flight leaves {left_s} s for two rests and {hovers}, each of at least one whole slot of "
    "{slot_s} s. How many cells does a grid have?",
    draws={
        "left_s": range(200, 601, 7),
        "hovers": ("one hover", "two hovers"),
        "slot_s": (5, 10, 20),
    },
)
def _many_cells(task: Task) -> Predictions:
    slots = task["left_s"] // task["slot_s"]
    times = 4 if task["hovers"] == "two hovers" else 3
    yield math.comb(slots, times), "choose the slots at which one time ends and the next begins"
    yield slots**times, "all the times together must fit into the time that is left"
    yield math.comb(slots, 2), "that is the number for one hover and one rest"


@predict(
    "12.2",
    "A branch and bound has found a plan of {plan_s} s. The nodes that wait have the bounds {a_s}, "
    "{b_s} and {c_s} s. By how many seconds can the best plan be longer, at most?",
    unit="s",
    within=0.5,
    draws={
        "plan_s": range(600, 681, 3),
        "a_s": range(700, 801, 3),
        "b_s": range(690, 801, 7),
        "c_s": range(620, 691, 3),
    },
)
def _gap(task: Task) -> Predictions:
    bounds_s, plan_s = [task["a_s"], task["b_s"], task["c_s"]], task["plan_s"]
    yield max(bounds_s) - plan_s, "the best plan may be in any of the nodes"
    yield min(bounds_s) - plan_s, "the best plan need not be in the node of the least bound"
    yield max(bounds_s), "the plan is known already; how much is open?"


@predict(
    "12.3",
    "A node is found to hold a plan of {plan_s} s. Waiting nodes have the bounds {a_s}, {b_s}, "
    "{c_s}, {d_s}, {e_s} and {f_s} s. All that can be dropped are dropped. What is the smallest "
    "bound [s] of those that still wait?",
    unit="s",
    within=0.1,
    draws={
        "plan_s": range(650, 711),
        **{f"{x}_s": range(600, 801) for x in "abcde"},
        "f_s": range(711, 801),
    },
)
def _dropped(task: Task) -> Predictions:
    bounds_s = [task[f"{x}_s"] for x in "abcdef"]
    least_s = min(each for each in bounds_s if each > task["plan_s"])
    yield least_s, "a bound says that no plan of the node is longer: where may a longer one be?"
    if (first_s := min(bounds_s)) < least_s:
        yield first_s, "no plan of this node is longer than the one that is found"
    if (last_s := max(bounds_s)) > least_s:
        yield last_s, "that is the largest bound"

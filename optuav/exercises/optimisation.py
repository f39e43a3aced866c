"""Exercises of lessons 05 to 14 and A2: declarations, duality, convexity, whole numbers, proofs."""

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction

import numpy as np

import optuav
from formulations.formulation import Given
from optuav.arrays import Booleans, Floats
from optuav.exercises.answers import ITINERARY, Form, figure, figures, fractions
from optuav.exercises.declare import Declare
from optuav.exercises.exercise import Draws, Task, decimals
from optuav.exercises.linear import linear
from optuav.exercises.predict import Predict, Predictions
from optuav.exercises.prove import (
    added,
    feasibility,
    objective,
    optimality,
    prove,
    text_of,
    two_proofs,
)
from optuav.exercises.witness import Condition, Conditions, Witness, flown, within
from optuav.judge import Itinerary
from optuav.modelling import Model
from optuav.solving import Program

CURRENTS = {"hover_A": range(60, 121), "rest_A": range(4, 13)}
NUMBERS = {**CURRENTS, "usable_As": range(50_000, 60_001, 500), "left_s": range(1050, 1201, 10)}
"""Numbers of (P4); charge and deadline bind at most of them."""


P4 = (
    "longest hover with a rest",
    "max Δ",
    "charge: {hover_A} Δ − {rest_A} T' ≤ {usable_As}",
    "deadline: Δ + T' ≤ {left_s}",
)


@Declare(
    "05.1",
    "Declare a Model with the unknowns hover_time_s and rest_time_s: the longest hover, where "
    "hovering draws {hover_A} A and resting returns {rest_A} A, at most {usable_As} A s may be "
    "drawn in all, and both together last {left_s} s at most.",
    {**CURRENTS, "usable_As": range(40_000, 59_001, 1000), "left_s": range(1000, 1401, 50)},
)
def _longest_hover(task: Task) -> Model:
    return linear(task, P4)


@Declare(
    "05.2",
    "Declare a formulation: as P4, with wells that must not run dry or be charged past full, but "
    "the UAV is to be back {margin_s} s before the deadline. It is compared with P4 on "
    "{building}, hover first, in the perspective available.",
    {"margin_s": range(20, 201, 5), "building": tuple(f"b{k}" for k in range(1, 11))},
)
def _early(task: Task) -> Program:
    deadline_s = task.mission.limits.deadline_s - task["margin_s"]
    sooner = task.mission.replace({"limits.deadline_s": deadline_s})
    return optuav.formulate(sooner, optuav.P4(task["building"], order="hover-first"))


_one_unknown = prove(
    "06.1",
    "Prove the optimum by the multiplier of each constraint, unrounded. Which of the limits binds?",
    {
        "hover_A": range(60, 121),
        "usable_As": range(50_000, 60_001, 500),
        "hover_W": range(800, 1501, 7),
        "energy_J": range(600_000, 800_001, 5000),
    },
    (
        "longest hover without a rest",
        "max Δ",
        "charge: {hover_A} Δ ≤ {usable_As}",
        "energy: {hover_W} Δ ≤ {energy_J}",
        "deadline: Δ ≤ 1100",
    ),
)

_two_lines = prove(
    "07.1",
    "Prove the optimum of this P4 by the multiplier of each constraint, unrounded. Those of "
    "bounds may be left out where they are 0.",
    NUMBERS,
    P4,
)


@Witness(
    "07.2",
    "Here the best plan just stops resting: the price of the deadline has a kink. Why? The "
    "witness is two proofs of the same optimum: multipliers by label with the least possible "
    "price of the deadline, and with the largest.",
    {
        **CURRENTS,
        "left_s": range(500, 801),
        "usable_As": lambda drawn: drawn["hover_A"] * drawn["left_s"],
    },
    reasons={
        "A second less is lost to the hover; a second more also has to earn its own charge.": "",
        "The longest hover jumps there.": "solve with a little less and a little more time",
        "The laser charges with another current from there on.": "resting returns the same current",
    },
    form=two_proofs(*P4),
    programme=P4,
)
def _kink(task: Task, proofs: list[dict[str, Fraction]]) -> Conditions:
    for proof in proofs:
        yield from optimality(linear(task, P4), proof)
    prices = [proof.get("deadline", Fraction(0)) for proof in proofs]
    ends = [Fraction(task["rest_A"], task["hover_A"] + task["rest_A"]), Fraction(1)]
    hint = "at an end, a multiplier of another constraint is 0: which may be?"
    words = f"both prove the optimum, with the prices {' and '.join(map(text_of, prices))}"
    yield Condition(prices == ends, words, hint, None, True)


SHORT_REST = {**NUMBERS, "most_s": range(100, 301, 10)}


@Declare(
    "08.1",
    "Declare the dual of this linear programme as a Model with the unknowns charge_price, "
    "time_price and rest_price, one for each row: maximise Δ subject to {hover_A} Δ − {rest_A} T' "
    "≤ {usable_As}, Δ + T' ≤ {left_s} and T' ≤ {most_s}, with Δ ≥ 0 and T' ≥ 0.",
    SHORT_REST,
)
def _dual(task: Task) -> Model:
    return linear(
        task,
        (
            "dual",
            "min {usable_As} y1 + {left_s} y2 + {most_s} y3",
            "column of Δ: {hover_A} y1 + y2 ≥ 1",
            "column of T': y2 + y3 − {rest_A} y1 ≥ 0",
        ),
    )


_short_rest = prove(
    "08.2",
    "Satisfy all KKT conditions of this programme: give hover_time_s, rest_time_s and the "
    "multiplier of each constraint by its label, all in one dict.",
    SHORT_REST,
    (*P4, "longest rest: T' ≤ {most_s}"),
    with_point=True,
)


@Witness(
    "09.1",
    "One pack of `paper` holds {battery.capacity_As} A s. Slots of {coarse_s} s cut the direct "
    "hover short: optuav.solve(task.mission, 'P3', slot_s={coarse_s}). Finer slots may do worse. "
    "Why? The witness is the length [s] of a finer slot, at least half as long, with which the "
    "hover is shorter and loses at least 97 % of one slot.",
    {"battery.capacity_As": range(30_000, 42_001, 100), "coarse_s": range(30, 61)},
    reasons={
        "Whole coarse slots are whole fine ones only if the one length divides the other.": "",
        "More cells are visited, and the search misses some.": "Algorithm 1 tries every cell",
        "Rounding errors of many slots add up.": "less than a slot is lost, however many there are",
    },
    form=figure("s", 15.0, 60.0),
)
def _finer(task: Task, fine_s: float) -> Conditions:
    coarse_s, hint = float(task["coarse_s"]), "when is nearly a whole slot left over?"
    allowed = coarse_s / 2.0 <= fine_s < coarse_s
    yield Condition(allowed, f"{fine_s:g} s is too long or too short", "see the task")
    best, coarse, fine = (
        optuav.solve(task.mission, "P3", slot_s=slot_s).hover_time_s
        for slot_s in (None, coarse_s, fine_s)
    )
    words = f"{fine_s:g} s hover {fine:g} s, not less than the {coarse:g} s of {coarse_s:g} s"
    yield Condition(fine < coarse, words, hint)
    lost = (best - fine) / fine_s
    yield Condition(lost >= 0.97, f"{100.0 * lost:.2f} % of a slot are lost", hint, None, True)


STRONG_LASER = {
    **{"battery.charge_current_A": 95.0, "laser.power_W": 13_000.0},
    **{"battery.available_fraction": 0.4, "battery.flow_rate_per_s": 1e-3},
}


def _feasible(task: Task, hovers_s: Floats) -> Booleans:
    """Whether hovers before a rest on b9 can be flown, with the strong laser."""
    program = optuav.formulate(task.mission, optuav.P4("b9", order="hover-first"))
    rows = program.check({"hover_time_s": hovers_s, "rest_time_s": task["rest_s"]})
    satisfied = [np.broadcast_to(row.satisfied, hovers_s.shape) for row in rows]
    return np.asarray(np.all(satisfied, axis=0))


@Witness(
    "10.1",
    "On the mission with the strong laser, task.mission, the feasible set of P4 on b9, hover "
    "first, is not convex. Why? The witness is two hovers that can both be flown before a rest of "
    "{rest_s} s, while the hover halfway, of {middle_s} s, cannot.",
    {"rest_s": decimals(53.0, 55.0, 0.25), "middle_s": decimals(505.0, 525.0, 0.25)},
    fixed=STRONG_LASER,
    reasons={
        "Bound charge flows over first, so after middling hovers the rest finds a fuller well.": "",
        "The deadline cuts a piece out of the middle.": "it is linear: it cuts off one side only",
        "The charge at the end is not linear in the times.": "the total charge is",
    },
    form=figures(short_s=("s", 0.0, 1200.0), long_s=("s", 0.0, 1200.0)),
)
def _not_convex(task: Task, point: Mapping[str, float]) -> Conditions:
    short_s, long_s = point["short_s"], point["long_s"]
    middle_s, hint = 0.5 * (short_s + long_s), "as far from the one as from the other"
    yield within("the hover halfway", middle_s, task["middle_s"], 0.01, "s", hint)
    short, long, middle = _feasible(task, np.array([short_s, long_s, middle_s])).tolist()
    hint = "program.check says which constraint fails"
    yield Condition(short, f"the hover of {short_s:g} s cannot be flown", hint)
    yield Condition(long, f"the hover of {long_s:g} s cannot be flown", hint)
    yield Condition(not middle, "the hover halfway can be flown too", "look further apart")


@Predict(
    "10.2",
    "On the mission with the strong laser, task.mission, the rest on b9 lasts {rest_s} s, and "
    "only the hover before it is free. A walk uphill starts at a hover of 5 s. At which hover [s] "
    "does it stop?",
    {"rest_s": decimals(52.0, 55.0, 0.01)},
    fixed=STRONG_LASER,
    unit="s",
    within=1.0,
)
def _stuck(task: Task) -> Predictions:
    hovers_s = np.linspace(5.0, 1100.0, 10_951)
    feasible = _feasible(task, hovers_s)
    ends_s = hovers_s[:-1][feasible[:-1] & ~feasible[1:]]
    yield float(ends_s[0]), "it stops where no step up is feasible: look along the hovers"
    yield float(ends_s[-1]), "no way that leads up all the time goes there from 5 s"


RELAXED = (
    "a route with λ = 1 or λ = 0, relaxed",
    "max Δ",
    "first route: Δ + {M} λ ≤ {first_s} + {M}",
    "second route: Δ − {M} λ ≤ {second_s}",
    "choice: λ ≤ 1",
)


def _point(task: Task, answer: object) -> dict[str, Fraction]:
    return fractions(answer, names := ["hover_time_s", "by_way"], names)


@Witness(
    "11.1",
    "With λ = 1 the first route bounds the hover by {first_s} s, and with λ = 0 the second one by "
    "{second_s} s; M = {M}. The relaxation promises more than both. Why? The witness is a best "
    "point of the relaxation, in whole numbers and Fractions; by_way is λ.",
    {
        "first_s": range(600, 701, 3),
        "second_s": range(702, 803, 3),
        "M": range(200, 1001, 10),
    },
    reasons={
        "A fraction of λ relaxes both rows at once, each by its part of M.": "",
        "Half of each route hovers longer than either.": "that mixture is no better than one",
        "M is too small to switch a row off.": "put λ = 0 and λ = 1 into both rows",
    },
    form=Form("{'hover_time_s': 700, 'by_way': Fraction(1, 3)}", _point),
    programme=RELAXED,
)
def _relaxation(task: Task, point: dict[str, Fraction]) -> Conditions:
    yield feasibility(linear(task, RELAXED), point)[1]
    best_s = Fraction(task["first_s"] + task["second_s"] + task["M"], 2)  # The mean of both rows
    hint = "both rows bound Δ; for which λ is the nearer one farthest?"
    words = f"the point is feasible, with a hover of {text_of(point['hover_time_s'])} s"
    yield Condition(point["hover_time_s"] == best_s, words, hint, None, True)


@Declare(
    "11.2",
    "Declare a Model with the unknowns hover_time_s, rest_time_s and by_way (binary): the longest "
    "hover, where by_way = 1 is a route with a rest and by_way = 0 the direct one. On both, "
    "{hover_A} Δ − {rest_A} T' ≤ Q and Δ + T' ≤ T. By way, Q = {usable_As} A s and T = {left_s} "
    "s; direct, Q is 1000 A s more and T is 20 s more, but T' = 0.",
    NUMBERS,
)
def _choice(task: Task) -> Model:
    lines = (
        "direct, or by way of a building",
        "max Δ",
        "charge: {hover_A} Δ − {rest_A} T' + 1000 λ ≤ {usable_As} + 1000",
        "deadline: Δ + T' + 20 λ ≤ {left_s} + 20",
        "no rest on the direct route: T' − {left_s} λ ≤ 0",
    )
    return linear(task, lines, binary="λ")


@Witness(
    "11.3",
    "The roofs b9 and b10 are closed, and one pack holds {battery.capacity_As} A s. Which "
    "building is best now, before or after the hover? Design an itinerary that can be flown and "
    "hovers at least 99.5 % of the best with one rest.",
    {"battery.capacity_As": range(30_000, 42_001, 40)},
    fixed={"buildings.b9": None, "buildings.b10": None},
    form=ITINERARY,
)
def _closed_roofs(task: Task, plan: Itinerary) -> Conditions:
    yield from flown(plan, optuav.solve(task.mission).hover_time_s, 0.995)


SLOTS: Draws = {
    "near_As": range(80, 111),
    "most": range(8, 16),
    "far_As": range(60, 100),
    "whole": range(3, 9),
    "over_As": range(5, 21),
    "near": range(40, 71),
    "far": lambda drawn: int(
        0.9 * drawn["near"] * (drawn["far_As"] - drawn["over_As"]) / drawn["near_As"]
    ),
    "next": lambda drawn: drawn["whole"] + 1,
    "charge_As": lambda drawn: (
        drawn["near_As"] * drawn["most"] + drawn["far_As"] * drawn["whole"] + drawn["over_As"]
    ),
    "value": lambda drawn: drawn["near"] * drawn["most"] + drawn["far"] * drawn["whole"],
}
"""Slots at two devices: all near ones and the whole far ones are best, with some charge over."""


VALUE = (
    "most valuable slots, relaxed",
    "max {near} n + {far} f",
    "charge: {near_As} n + {far_As} f ≤ {charge_As}",
    "near slots: n ≤ {most}",
)
BRANCHES = ("branch: f ≤ {whole}", "branch: −f ≤ −{next}")


@Witness(
    "12.1",
    "n and f are whole numbers of slots at a near and at a far device, and some slots have the "
    "value {value}. Prove by one branching that none have more: multipliers by label in the "
    "branch with the row f ≤ {whole}, and in the one with −f ≤ −{next}. The label of these rows "
    "is 'branch'.",
    SLOTS,
    form=two_proofs(*VALUE, BRANCHES[0]),
    programme=VALUE,
)
def _branches(task: Task, proofs: list[dict[str, Fraction]]) -> Conditions:
    for name, row, multipliers in zip(("first", "second"), BRANCHES, proofs, strict=True):
        model = linear(task, (*VALUE, row))
        proof, condition = added(model, multipliers, objective(model))
        yield condition._replace(words=f"{name} branch: {condition.words}")
        words = f"{name} branch: no slots have a value above {text_of(proof.limit)}"
        hint = f"the bound must not exceed {task['value']}"
        yield Condition(proof.limit <= task["value"], words, hint)


_conflict = prove(
    "13.1",
    "Prove that no times satisfy all constraints: give a multiplier of each that is needed, so "
    "that the sum is false. The bounds of a time are constraints as well, with the labels 'bounds "
    "of Δ' and \"bounds of T'\". Whole numbers and Fractions are exact.",
    {**CURRENTS, "short_As": range(1500, 2501, 50), "left_s": range(50, 121, 5)},
    (
        "a hover for which there is neither charge nor time",
        "max Δ",
        "charge: {hover_A} Δ − {rest_A} T' ≤ −{short_As}",
        "deadline: Δ + T' ≤ {left_s}",
    ),
    conflict=True,
)


@dataclass(frozen=True)
class _AtLeast(optuav.Formulation):
    """Least rest for a hover of at least so long."""

    hover_s: float

    def declare(self, model: Model, given: Given) -> None:
        hover, pause = given.hover_and_rest(model)
        model.minimise(pause)
        model.subject_to("hover for long enough", hover >= self.hover_s)
        model.subject_to("charge", given.soc_end(hover, pause) >= given.min_soc)
        given.keep_wells(model, "wells", hover, pause)
        given.keep_deadline(model, "in time", hover, pause)


@Declare(
    "14.1",
    "Declare a formulation: the least rest with which the UAV hovers for at least {wanted_s} s, "
    "keeps the charge that it has to keep and its wells within their limits, and is back in time. "
    "It is compared on b10, hover first, in the perspective available.",
    {"wanted_s": decimals(480.0, 590.0, 0.5)},
)
def _wanted(task: Task) -> Program:
    asked = _AtLeast(task["wanted_s"], building="b10", order="hover-first")
    return optuav.formulate(task.mission, asked)


PRINTED: Draws = {
    **{"first_s": range(600, 701), "second_s": range(720, 821), "third_s": range(900, 1001)},
    **{"first": decimals(26.0, 31.0, 0.01), "third": decimals(4.0, 8.0, 0.01)},
    "off": (*decimals(-1.5, -0.3, 0.01), *decimals(0.3, 1.5, 0.01)),
    "second": lambda drawn: round(
        drawn["off"]
        + np.interp(
            drawn["second_s"],
            [drawn["first_s"], drawn["third_s"]],
            [drawn["first"], drawn["third"]],
        ),
        2,
    ),
}
"""Three cells of one path, of which the second is off the line through the others."""


_cells = prove(
    "A2.1",
    "A table prints the charge that is left after hovers of {first_s} s, {second_s} s and "
    "{third_s} s on one path: {first:.2f} %, {second:.2f} % and {third:.2f} %, rounded to two "
    "decimals. Prove that no flight (q %) and no current (r % per second) give all three: "
    "multipliers with which the sum is false.",
    PRINTED,
    (
        "a flight and a current that give the table",
        "max q",
        *(
            f"{name}, at {words}: {sign}q {sign} {{{name}_s}} r ≤ {sign}{whole} {other} {{{name}}}"
            for name in ("first", "second", "third")
            for words, sign, other, whole in (
                ("most", "+", "−", 100.005),
                ("least", "−", "+", 99.995),
            )
        ),
    ),
    conflict=True,
)

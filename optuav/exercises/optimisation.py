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
from optuav.exercises.witness import Condition, Conditions, Witness, longest, within
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
    "Declare a Model with the unknowns hover_time_s and rest_time_s: the longest hover. Hovering "
    "draws {hover_A} A, resting returns {rest_A} A, and the battery gives {usable_As} A s at most. "
    "Hover and rest together last {left_s} s at most. The motors cool only while the drone rests: "
    "every 100 s of hover need at least {cool_s} s of rest.",
    {
        **{**CURRENTS, "usable_As": range(40_000, 59_001, 1000), "left_s": range(1000, 1401, 50)},
        "cool_s": range(40, 121, 5),
    },
)
def _longest_hover(task: Task) -> Model:
    return linear(task, (*P4, "cool: {cool_s} Δ − 100 T' ≤ 0"))


@Declare(
    "05.2",
    "Declare a formulation: the longest hover with the constraints of P4, but the UAV must be back "
    "{margin_s} s before the deadline. P4 also keeps the wells from running dry and from being "
    "charged past full: `given.keep_wells(model, 'wells', hover, rest)` states these limits. The "
    "grader compares your formulation with the right one on the route that hovers first and then "
    "rests on {building}, in the perspective `available`.",
    {"margin_s": range(20, 201, 5), "building": tuple(f"b{k}" for k in range(1, 11))},
)
def _early(task: Task) -> Program:
    deadline_s = task.mission.limits.deadline_s - task["margin_s"]
    sooner = task.mission.replace({"limits.deadline_s": deadline_s})
    return optuav.formulate(sooner, optuav.P4(task["building"], order="hover-first"))


NO_REST = (
    "longest hover without a rest",
    "max Δ",
    "charge: {hover_A} Δ ≤ {usable_As}",
    "energy: {hover_W} Δ ≤ {energy_J}",
    "deadline: Δ ≤ 1100",
)


@Witness(
    "06.1",
    "Give two proofs, each as the multiplier of each constraint by its label, unrounded: one that "
    "bounds the hover by the optimum, and a weaker one that bounds it by exactly {claim_s} s.",
    {
        "hover_A": range(60, 121),
        "usable_As": range(50_000, 60_001, 500),
        "hover_W": range(800, 1501, 7),
        "energy_J": range(600_000, 800_001, 5000),
        "over_s": range(10, 61),
        "claim_s": lambda each: (
            each["over_s"]
            + min(each["usable_As"] // each["hover_A"], each["energy_J"] // each["hover_W"])
        ),
    },
    form=two_proofs(*NO_REST),
    programme=NO_REST,
)
def _two_bounds(task: Task, proofs: list[dict[str, Fraction]]) -> Conditions:
    model, (best, weaker) = linear(task, NO_REST), proofs
    yield from (
        each._replace(words=f"first proof: {each.words}") for each in optimality(model, best)
    )
    proof, condition = added(model, weaker, objective(model))
    yield condition._replace(words=f"second proof: {condition.words}")
    words = f"second proof: it bounds the hover by {text_of(proof.limit)} s"
    yield Condition(proof.limit == task["claim_s"], words, "mix the bounds of two constraints")


_two_lines = prove(
    "07.1",
    "Prove the optimum of this P4: give the multiplier of each constraint by its label, unrounded. "
    "You may leave out multipliers that are 0.",
    NUMBERS,
    P4,
)


@Witness(
    "07.2",
    "With these numbers the best plan only just needs no rest, and the price of the deadline has a "
    "kink. Why? The witness is two proofs of the same optimum as multipliers by label: one with "
    "the lowest possible price of the deadline, and one with the highest.",
    {
        **CURRENTS,
        "left_s": range(500, 801),
        "usable_As": lambda drawn: drawn["hover_A"] * drawn["left_s"],
    },
    reasons={
        "A second less shortens the hover; a second more must also earn its own charge.": "",
        "The longest hover jumps at this deadline, so that its slope is not "
        "defined there.": "solve with a little less and a little more time",
        "From this deadline on, the laser charges the battery with a larger current.": "resting "
        "returns the same current at every deadline",
    },
    form=two_proofs(*P4),
    programme=P4,
)
def _kink(task: Task, proofs: list[dict[str, Fraction]]) -> Conditions:
    for proof in proofs:
        yield from optimality(linear(task, P4), proof)
    prices = [proof.get("deadline", Fraction(0)) for proof in proofs]
    ends = [Fraction(task["rest_A"], task["hover_A"] + task["rest_A"]), Fraction(1)]
    hint = "at the lowest and the highest price, another multiplier is 0: which one?"
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
    "Satisfy all KKT conditions of this linear programme: give hover_time_s, rest_time_s and the "
    "multiplier of each constraint by its label, in one dict.",
    SHORT_REST,
    (*P4, "longest rest: T' ≤ {most_s}"),
    with_point=True,
)


@Witness(
    "09.1",
    "One pack of `paper` holds {battery.capacity_As} A s. Slots of {coarse_s} s cut the direct "
    "hover short: `optuav.solve(task.mission, 'P3', slot_s={coarse_s})`. Finer slots can give a "
    "shorter hover. Why? The witness is the length [s] of such a finer slot, at least half as "
    "long, with which the hover loses at least 97 % of one slot.",
    {"battery.capacity_As": range(30_000, 42_001, 100), "coarse_s": range(30, 61)},
    reasons={
        "Coarse slots are whole fine slots only if one length divides the other.": "",
        "Finer slots give more cells to visit, and the search then misses some "
        "of them.": "Algorithm 1 tries every cell",
        "Each slot has a rounding error, and the errors of many fine slots add up.": "less than "
        "one slot is lost, however many there are",
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
    "With the strong laser of `task.mission`, the feasible set of P4 on b9, hover first, is not "
    "convex. Why? The witness is two hovers that can be flown before a rest of {rest_s} s, while "
    "the hover halfway between them, of {middle_s} s, cannot.",
    {"rest_s": decimals(53.0, 55.0, 0.25), "middle_s": decimals(505.0, 525.0, 0.25)},
    fixed=STRONG_LASER,
    reasons={
        "Bound charge flows over first, so the rest after a middling hover finds a fuller "
        "well.": "",
        "The deadline excludes the hovers in the middle, and allows those on either side of "
        "it.": "the deadline is linear: it cuts off one side only",
        "The charge at the end is a product of both times, so its level curves are bent.": "the "
        "total charge is linear in the times",
    },
    form=figures(short_s=("s", 0.0, 1200.0), long_s=("s", 0.0, 1200.0)),
)
def _not_convex(task: Task, point: Mapping[str, float]) -> Conditions:
    short_s, long_s = point["short_s"], point["long_s"]
    middle_s, hint = 0.5 * (short_s + long_s), "choose them equally far from the hover halfway"
    yield within("the hover halfway", middle_s, task["middle_s"], 0.01, "s", hint)
    short, long, middle = _feasible(task, np.array([short_s, long_s, middle_s])).tolist()
    hint = "program.check says which constraint fails"
    yield Condition(short, f"the hover of {short_s:g} s cannot be flown", hint)
    yield Condition(long, f"the hover of {long_s:g} s cannot be flown", hint)
    yield Condition(not middle, "the hover halfway can be flown too", "look further apart")


@Predict(
    "10.2",
    "With the strong laser of `task.mission`, the rest on b9 lasts {rest_s} s, and only the hover "
    "before it is free. A local search starts at a hover of 5 s and lengthens it step by step "
    "while it can be flown. At which hover [s] does the search stop?",
    {"rest_s": decimals(52.0, 55.0, 0.01)},
    fixed=STRONG_LASER,
    unit="s",
    within=1.0,
)
def _stuck(task: Task) -> Predictions:
    hovers_s = np.linspace(5.0, 1100.0, 10_951)
    feasible = _feasible(task, hovers_s)
    ends_s = hovers_s[:-1][feasible[:-1] & ~feasible[1:]]
    yield float(ends_s[0]), "it stops at the first hover from which no longer step is feasible"
    yield float(ends_s[-1]), "a gap of hovers that cannot be flown lies between 5 s and there"


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
    "With λ = 1 the first route bounds the hover by {first_s} s, and with λ = 0 the second route "
    "bounds it by {second_s} s; M = {M}. The relaxation promises more than both. Why? The witness "
    "is an optimal point of the relaxation, in whole numbers and Fractions; by_way is λ.",
    {
        "first_s": range(600, 701, 3),
        "second_s": range(702, 803, 3),
        "M": range(200, 1001, 10),
    },
    reasons={
        "A fraction of λ relaxes both rows at once, each by its part of M.": "",
        "A drone that flies half of each route hovers longer than on either route.": "a mixture "
        "of two routes hovers no longer than the better one",
        "M is too small, so that one row still binds where it should be off.": "put λ = 0 and λ = "
        "1 into both rows",
    },
    form=Form("{'hover_time_s': 700, 'by_way': Fraction(1, 3)}", _point),
    programme=RELAXED,
)
def _relaxation(task: Task, point: dict[str, Fraction]) -> Conditions:
    yield feasibility(linear(task, RELAXED), point)[1]
    best_s = Fraction(task["first_s"] + task["second_s"] + task["M"], 2)  # The mean of both rows
    hint = "both rows bound Δ: for which λ is the lower bound of the two highest?"
    words = f"the point is feasible, with a hover of {text_of(point['hover_time_s'])} s"
    yield Condition(point["hover_time_s"] == best_s, words, hint, None, True)


@Declare(
    "11.2",
    "Declare a Model with the unknowns hover_time_s, rest_time_s and by_way (binary): the longest "
    "hover, where by_way = 1 is a route with a rest and by_way = 0 is the direct route. On both, "
    "{hover_A} Δ − {rest_A} T' ≤ Q and Δ + T' ≤ T. On the route with a rest, Q = {usable_As} A s "
    "and T = {left_s} s. On the direct route, Q is 1000 A s more, T is 20 s more, and T' = 0.",
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
    "building is best now, and before or after the hover? Design an itinerary with at most one "
    "rest that can be flown and hovers at least 99.5 % of the longest such hover.",
    {"battery.capacity_As": range(30_000, 42_001, 40)},
    fixed={"buildings.b9": None, "buildings.b10": None},
    form=ITINERARY,
)
def _closed_roofs(task: Task, plan: Itinerary) -> Conditions:
    yield from longest(plan, optuav.solve(task.mission).hover_time_s, 0.995)


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
    "n and f are whole numbers of slots at a near and at a far device, and some choice of them has "
    "the value {value}. Prove by one branching that no choice has a higher value: give multipliers "
    "by label for the branch with the additional row f ≤ {whole}, and for the branch with −f ≤ "
    "−{next}. The label of the additional row is 'branch'.",
    SLOTS,
    form=two_proofs(*VALUE, BRANCHES[0]),
    programme=VALUE,
)
def _branches(task: Task, proofs: list[dict[str, Fraction]]) -> Conditions:
    for name, row, multipliers in zip(("first", "second"), BRANCHES, proofs, strict=True):
        model = linear(task, (*VALUE, row))
        proof, condition = added(model, multipliers, objective(model))
        yield condition._replace(words=f"{name} branch: {condition.words}")
        words = f"{name} branch: no choice has a value above {text_of(proof.limit)}"
        hint = f"the bound must not exceed {task['value']}"
        yield Condition(proof.limit <= task["value"], words, hint)


_conflict = prove(
    "13.1",
    "Prove that no times satisfy all constraints: give multipliers with which the sum of the "
    "constraints is false. The bounds of the times are constraints as well, with the labels "
    "'bounds of Δ' and \"bounds of T'\". Whole numbers and Fractions are exact.",
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
    "Declare a formulation: the shortest rest with which the UAV hovers for at least {wanted_s} s, "
    "keeps its charge at or above the required one and its wells within their limits, and is back "
    "in time. The grader compares your formulation with the right one on the route that hovers "
    "first and then rests on b10, in the perspective `available`.",
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
    "decimals. Prove that no flight (q %) and no current (r % per second) give all three: find "
    "multipliers with which the sum of the constraints is false.",
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

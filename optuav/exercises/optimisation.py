"""Exercises of lessons 05 to 14 and A2: declarations, duality, convexity, whole numbers, proofs."""

from collections.abc import Mapping
from fractions import Fraction

import numpy as np

import optuav
from optuav.arrays import Booleans, Floats
from optuav.exercises.answers import (
    EXAMPLE,
    MULTIPLIERS,
    PROOFS,
    exact,
    numbers_by_name,
    one_number,
)
from optuav.exercises.declare import same_problem
from optuav.exercises.exercise import decimals, declare, explain, predict, prove
from optuav.exercises.linear import linear
from optuav.exercises.measure import equals, titled, within
from optuav.exercises.prove import (
    Exact,
    added,
    contradiction,
    exact_figure,
    feasibility,
    optimality,
)
from optuav.exercises.task import Condition, Conditions, Task
from optuav.mission import load
from optuav.presentation.numbers import figure, percent

P4 = (
    "longest hover with a rest",
    "max Δ",
    "charge: {hover_A = 60, 61 .. 120} Δ − {rest_A = 4, 5 .. 12} T' "
    "≤ {usable_As = 50000, 50500 .. 60000}",
    "deadline: Δ + T' ≤ {left_s = 1050, 1060 .. 1200}",  # Charge and deadline bind at most of them
)


@declare("05.1")
def _longest_hover(task: Task, answer: object) -> Conditions:
    """Declare a Model with the unknowns hover_time_s and rest_time_s: the longest hover. Hovering
    draws {hover_A = 60, 61 .. 120} A, resting returns {rest_A = 4, 5 .. 12} A, and the battery
    gives {usable_As = 40000, 41000 .. 59000} A s at most. Hover and rest together last
    {left_s = 1000, 1050 .. 1400} s at most. The motors cool only while the drone rests: every 100 s
    of hover need at least {cool_s = 40, 45 .. 120} s of rest.
    """
    wanted = linear(task.numbers, (*P4, "cool: {cool_s} Δ − 100 T' ≤ 0"))
    return same_problem(task, answer, wanted)


@declare("05.2", draws={"building": [f"b{k}" for k in range(1, 11)]})
def _early(task: Task, answer: object) -> Conditions:
    """Declare a formulation: the longest hover with the constraints of P4, but the UAV must be back
    {margin_s = 20, 25 .. 200} s before the deadline. P4 also keeps the wells from running dry and
    from being charged past full: `given.keep_wells(model, 'wells', hover, rest)` states these
    limits. The grader compares your formulation with the right one on the route that hovers first
    and then rests on {building}, in the perspective `available`.
    """
    deadline_s = task.mission.limits.deadline_s - task["margin_s"]
    sooner = task.mission.replace({"limits.deadline_s": deadline_s})
    wanted = optuav.formulate(sooner, optuav.P4(task["building"], order="hover-first"))
    return same_problem(task, answer, wanted)


NO_REST = (
    "longest hover without a rest",
    "max Δ",
    "charge: {hover_A = 60, 61 .. 120} Δ ≤ {usable_As = 50000, 50500 .. 60000}",
    "energy: {hover_W = 800, 807 .. 1500} Δ ≤ {energy_J = 600000, 605000 .. 800000}",
    "deadline: Δ ≤ 1100",
)


CLAIM = {
    "over_s": range(10, 61),
    "claim_s": lambda n: (
        n["over_s"] + min(n["usable_As"] // n["hover_A"], n["energy_J"] // n["hover_W"])
    ),
}


@prove("06.1", PROOFS, draws=CLAIM, programme=NO_REST)
def _two_bounds(task: Task, proofs: list[Exact]) -> Conditions:
    """Give two proofs as unrounded multipliers of the constraints by their labels: one that
    bounds the hover by the optimum, and a weaker one that bounds it by exactly {claim_s} s.
    """
    model, (best, weaker) = linear(task.numbers, NO_REST), proofs
    yield from titled("first proof", optimality(model, best))
    proof, condition = added(model, weaker)
    words = f"it bounds the hover by {exact_figure(proof.limit)} s"
    hint = "mix the bounds of two constraints"
    claimed = Condition(proof.limit == task["claim_s"], words, hint)
    yield from titled("second proof", (condition, claimed))


@prove("07.1", MULTIPLIERS, programme=P4)
def _two_lines(task: Task, multipliers: Exact) -> Conditions:
    """Prove the optimum of this P4: give the multiplier of each constraint by its label, unrounded.
    You may leave out multipliers that are 0.
    """
    return optimality(linear(task.numbers, P4), multipliers)


KINK = {"left_s": range(500, 801), "usable_As": lambda n: n["hover_A"] * n["left_s"]}


@explain("07.2", PROOFS, draws=KINK, programme=P4)
def _kink(task: Task, proofs: list[Exact]) -> Conditions:
    """With these numbers the best plan only just needs no rest, and the price of the deadline has a
    kink. Why? The witness is two proofs of the same optimum as multipliers by label: one with the
    lowest possible price of the deadline, and one with the highest.

    + A second less shortens the hover; a second more must also earn its own charge.
    - The longest hover jumps at this deadline, so that its slope is not defined there.
      solve with a little less and a little more time
    - From this deadline on, the laser charges the battery with a larger current.
      resting returns the same current at every deadline
    """
    for proof in proofs:
        yield from optimality(linear(task.numbers, P4), proof)
    prices = [proof.get("deadline", Fraction(0)) for proof in proofs]
    ends = [Fraction(task["rest_A"], task["hover_A"] + task["rest_A"]), Fraction(1)]
    hint = "at the lowest and the highest price, another multiplier is 0: which one?"
    words = f"both prove the optimum, with the prices {' and '.join(map(exact_figure, prices))}"
    yield Condition(prices == ends, words, hint, None, True)


KKT = (*P4, "longest rest: T' ≤ {most_s = 100, 110 .. 300}")


@declare("08.1")
def _dual(task: Task, answer: object) -> Conditions:
    """Declare the dual of this linear programme as a Model with the unknowns charge_price,
    time_price and rest_price, one per row: maximise Δ subject to {hover_A = 60, 61 .. 120} Δ −
    {rest_A = 4, 5 .. 12} T' ≤ {usable_As = 50000, 50500 .. 60000}, Δ + T' ≤
    {left_s = 1050, 1060 .. 1200} and T' ≤ {most_s = 100, 110 .. 300}, with Δ ≥ 0 and T' ≥ 0.
    """
    dual = (
        "dual",
        "min {usable_As} y1 + {left_s} y2 + {most_s} y3",
        "column of Δ: {hover_A} y1 + y2 ≥ 1",
        "column of T': y2 + y3 − {rest_A} y1 ≥ 0",
    )
    return same_problem(task, answer, linear(task.numbers, dual))


@prove("08.2", exact(EXAMPLE, point=True), programme=KKT)
def _short_rest(task: Task, numbers: Exact) -> Conditions:
    """Satisfy all KKT conditions of this linear programme: give hover_time_s, rest_time_s and the
    multiplier of each constraint by its label, in one dict.
    """
    model = linear(task.numbers, KKT)
    yield from feasibility(model, numbers, numbers)
    yield from optimality(model, numbers)


@explain("09.1", one_number("s", 15.0, 60.0))
def _finer(task: Task, fine_s: float) -> Conditions:
    """One pack of `paper` holds {battery.capacity_As = 30000, 30100 .. 42000} A s. Slots of
    {coarse_s = 30, 31 .. 60} s cut the direct hover short:
    `optuav.solve(task.mission, 'P3', slot_s={coarse_s})`. Finer slots can give a shorter hover.
    Why? The witness is the length [s] of a finer slot, at least half as long, that makes the hover
    lose at least 97 % of one slot.

    + Coarse slots are whole fine slots only if one length divides the other.
    - Finer slots give more cells to visit, and the search then misses some of them.
      Algorithm 1 tries every cell
    - Each slot has a rounding error, and the errors of many fine slots add up.
      less than one slot is lost, however many there are
    """
    coarse_s, hint = float(task["coarse_s"]), "when is nearly a whole slot left over?"
    allowed = coarse_s / 2.0 <= fine_s < coarse_s
    words = f"a slot of {figure(fine_s)} s is {'too short' if fine_s < coarse_s else 'not finer'}"
    yield Condition(
        allowed, words, f"from {figure(coarse_s / 2.0)} s to less than {figure(coarse_s)} s"
    )
    best, coarse, fine = (
        optuav.solve(task.mission, "P3", slot_s=slot_s).hover_time_s
        for slot_s in (None, coarse_s, fine_s)
    )
    words = (
        f"slots of {figure(fine_s)} s give {figure(fine)} s of hover, not less than the "
        f"{figure(coarse)} s before"
    )
    yield Condition(fine < coarse, words, hint)
    lost = (best - fine) / fine_s
    yield Condition(lost >= 0.97, f"{percent(lost)} of a slot are lost", hint, None, True)


STRONG_LASER = load("paper").replace(
    {
        **{"battery.charge_current_A": 95.0, "laser.power_W": 13_000.0},
        **{"battery.available_fraction": 0.4, "battery.flow_rate_per_s": 1e-3},
    }
)


def _feasible(task: Task, hovers_s: Floats) -> Booleans:
    """Whether hovers before a rest on b9 can be flown, with the strong laser."""
    program = optuav.formulate(task.mission, optuav.P4("b9", order="hover-first"))
    rows = program.check({"hover_time_s": hovers_s, "rest_time_s": task["rest_s"]})
    satisfied = [np.broadcast_to(row.satisfied, hovers_s.shape) for row in rows]
    return np.asarray(np.all(satisfied, axis=0))


@explain("10.1", numbers_by_name(short_s=1200.0, long_s=1200.0), STRONG_LASER)
def _not_convex(task: Task, point: Mapping[str, float]) -> Conditions:
    """With the strong laser of `task.mission`, the feasible set of P4 on b9, hover first, is not
    convex. Why? The witness is two hovers that can be flown before a rest of
    {rest_s = 53.0, 53.25 .. 55.0} s, while the hover halfway between them, of
    {middle_s = 505.0, 505.25 .. 525.0} s, cannot.

    + Bound charge flows over first, so the rest after a middling hover finds a fuller well.
    - The deadline excludes the hovers in the middle, and allows those on either side of it.
      the deadline is linear: it cuts off one side only
    - The charge at the end is a product of both times, so its level curves are bent.
      the total charge is linear in the times
    """
    short_s, long_s = point["short_s"], point["long_s"]
    middle_s, hint = 0.5 * (short_s + long_s), "choose them equally far from the hover halfway"
    yield within("the hover halfway", middle_s, task["middle_s"], 0.01, "s", hint)
    short, long, middle = _feasible(task, np.array([short_s, long_s, middle_s])).tolist()
    hint = "program.check says which constraint fails"
    yield Condition(short, f"the hover of {figure(short_s)} s cannot be flown", hint)
    yield Condition(long, f"the hover of {figure(long_s)} s cannot be flown", hint)
    yield Condition(not middle, "the hover halfway can be flown too", "look further apart")


@predict("10.2", one_number("s"), STRONG_LASER)
def _stuck(task: Task, hover_s: float) -> Conditions:
    """With the strong laser of `task.mission`, the rest on b9 lasts {rest_s = 52.0, 52.01 .. 55.0}
    s, and only the hover before it is free. A local search starts at a hover of 5 s and lengthens
    it step by step while it can be flown. At which hover [s] does the search stop?
    """
    hovers_s = np.linspace(5.0, 1100.0, 10_951)
    feasible = _feasible(task, hovers_s)
    ends_s = hovers_s[:-1][feasible[:-1] & ~feasible[1:]]
    hint = "it stops at the first hover from which no longer step is feasible"
    mistake = ends_s[-1], "a gap of hovers that cannot be flown lies between 5 s and there"
    return equals(hover_s, ends_s[0], 1.0, "s", hint, mistake)


RELAXED = (
    "a route with λ = 1 or λ = 0, relaxed",
    "max Δ",
    "first route: Δ + {M} λ ≤ {first_s} + {M}",
    "second route: Δ − {M} λ ≤ {second_s}",
    "choice: λ ≤ 1",
)

MIXTURE = exact("{'hover_time_s': 700, 'by_way': Fraction(1, 3)}", multipliers=False, point=True)


@explain("11.1", MIXTURE, programme=RELAXED)
def _relaxation(task: Task, point: Exact) -> Conditions:
    """With λ = 1 the first route bounds the hover by {first_s = 600, 603 .. 699} s, and with λ = 0
    the second route bounds it by {second_s = 702, 705 .. 801} s; M = {M = 200, 210 .. 1000}. The
    relaxation promises more than both. Why? The witness is an optimal point of the relaxation, in
    whole numbers and Fractions; by_way is λ.

    + A fraction of λ relaxes both rows at once, each by its part of M.
    - A drone that flies half of each route hovers longer than on either route.
      a mixture of two routes hovers no longer than the better one
    - M is too small, so that one row still binds where it should be off.
      put λ = 0 and λ = 1 into both rows
    """
    yield from feasibility(linear(task.numbers, RELAXED), point)
    best_s = Fraction(task["first_s"] + task["second_s"] + task["M"], 2)  # The mean of both rows
    hint = "both rows bound Δ: for which λ is the lower bound of the two highest?"
    words = f"the point is feasible, with a hover of {exact_figure(point['hover_time_s'])} s"
    yield Condition(point["hover_time_s"] == best_s, words, hint, None, True)


@declare("11.2")
def _choice(task: Task, answer: object) -> Conditions:
    """Declare a Model with the unknowns hover_time_s, rest_time_s and by_way (binary): the longest
    hover, where by_way = 1 is a route with a rest and by_way = 0 is the direct route. On both,
    {hover_A = 60, 61 .. 120} Δ − {rest_A = 4, 5 .. 12} T' ≤ Q and Δ + T' ≤ T. On the route with a
    rest, Q = {usable_As = 50000, 50500 .. 60000} A s and T = {left_s = 1050, 1060 .. 1200} s. On
    the direct route, Q is 1000 A s more, T is 20 s more, and T' = 0.
    """
    lines = (
        "direct, or by way of a building",
        "max Δ",
        "charge: {hover_A} Δ − {rest_A} T' + 1000 λ ≤ {usable_As} + 1000",
        "deadline: Δ + T' + 20 λ ≤ {left_s} + 20",
        "no rest on the direct route: T' − {left_s} λ ≤ 0",
    )
    return same_problem(task, answer, linear(task.numbers, lines, binary="λ"))


VALUE = (
    "most valuable slots, relaxed",
    "max {near = 40, 41 .. 70} n + {far} f",
    "charge: {near_As = 80, 81 .. 110} n + {far_As = 60, 61 .. 99} f ≤ {charge_As}",
    "near slots: n ≤ {most = 8, 9 .. 15}",
)
SLOTS = {
    "over_As": range(5, 21),
    "far": lambda n: int(0.9 * n["near"] * (n["far_As"] - n["over_As"]) / n["near_As"]),
    "next": lambda n: n["whole"] + 1,
    "charge_As": lambda n: n["near_As"] * n["most"] + n["far_As"] * n["whole"] + n["over_As"],
    "value": lambda n: n["near"] * n["most"] + n["far"] * n["whole"],
}
"""Slots at two devices: all near ones and the whole far ones are best, with some charge over."""
BRANCHES = ("branch: f ≤ {whole}", "branch: −f ≤ −{next}")


@prove("12.1", exact(EXAMPLE, "branch", pair=True), draws=SLOTS, programme=VALUE)
def _branches(task: Task, proofs: list[Exact]) -> Conditions:
    """n and f are whole numbers of slots at a near and at a far device, and one choice of them has
    the value {value}. Prove by one branching that no choice has a higher value: give multipliers by
    label for the branch with the additional row f ≤ {whole = 3, 4 .. 8}, and for the branch with
    −f ≤ −{next}. The label of the additional row is 'branch'.
    """
    for name, row, multipliers in zip(("first", "second"), BRANCHES, proofs, strict=True):
        model = linear(task.numbers, (*VALUE, row))
        proof, condition = added(model, multipliers)
        words = f"no choice has a value above {exact_figure(proof.limit)}"
        hint = f"the bound must not exceed {task['value']}"
        low_enough = Condition(proof.limit <= task["value"], words, hint)
        yield from titled(f"{name} branch", (condition, low_enough))


NEITHER = (
    "a hover for which there is neither charge nor time",
    "max Δ",
    "charge: {hover_A = 60, 61 .. 120} Δ − {rest_A = 4, 5 .. 12} T' "
    "≤ −{short_As = 1500, 1550 .. 2500}",
    "deadline: Δ + T' ≤ {left_s = 50, 55 .. 120}",
)


@prove("13.1", MULTIPLIERS, programme=NEITHER)
def _conflict(task: Task, multipliers: Exact) -> Conditions:
    """Prove that no times satisfy all constraints: give multipliers that make the sum of the
    constraints false. The bounds of the times are constraints as well, with the labels 'bounds
    of Δ' and "bounds of T'". Whole numbers and Fractions are exact.
    """
    return contradiction(linear(task.numbers, NEITHER), multipliers)


@declare("14.1")
def _wanted(task: Task, answer: object) -> Conditions:
    """Declare a formulation: the shortest rest with which the UAV hovers for at least
    {wanted_s = 480.0, 480.5 .. 590.0} s, keeps its charge at or above the required one and its
    wells within their limits, and is back in time. The grader compares your formulation with the
    right one on the route that hovers first and then rests on b10, in the perspective `available`.
    """
    wanted = optuav.formulate(task.mission, optuav.P4("b10", order="hover-first"))
    model = wanted.parts[0].model
    hover, rest = model.variables
    model.has_objective, model.preferences = False, []
    model.minimise(rest)
    model.subject_to("hover for long enough", hover >= task["wanted_s"])
    return same_problem(task, answer, wanted)


def _off_the_line(drawn: Mapping[str, float]) -> float:
    """Return the second of three cells on one path, off the line through the others."""
    times_s, percents = (drawn["first_s"], drawn["third_s"]), (drawn["first"], drawn["third"])
    return float(round(drawn["off"] + np.interp(drawn["second_s"], times_s, percents), 2))


OFF = (*decimals(-1.5, -1.49, -0.3), *decimals(0.3, 0.31, 1.5))
LOADS = (
    "a flight and a current that give the table",
    "max q",
    "first, at most: q + {first_s} r ≤ 100.005 − {first}",
    "first, at least: −q − {first_s} r ≤ −99.995 + {first}",
    "second, at most: q + {second_s} r ≤ 100.005 − {second}",
    "second, at least: −q − {second_s} r ≤ −99.995 + {second}",
    "third, at most: q + {third_s} r ≤ 100.005 − {third}",
    "third, at least: −q − {third_s} r ≤ −99.995 + {third}",
)


@prove("A2.1", MULTIPLIERS, draws={"off": OFF, "second": _off_the_line}, programme=LOADS)
def _cells(task: Task, multipliers: Exact) -> Conditions:
    """A table prints the charge that is left after hovers of {first_s = 600, 601 .. 700} s,
    {second_s = 720, 721 .. 820} s and {third_s = 900, 901 .. 1000} s on one path:
    {first:.2f = 26.0, 26.01 .. 31.0} %, {fixed(second)} % and {third:.2f = 4.0, 4.01 .. 8.0} %,
    rounded to two decimals. Prove that no flight (q %) and no current (r % per second) give all
    three: find multipliers that make the sum of the constraints false.
    """
    return contradiction(linear(task.numbers, LOADS), multipliers)

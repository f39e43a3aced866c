"""Problems whose answers are known: values, multipliers and shadow prices by hand.

Every number is worked out in the comment over its case, in fractions, from the conditions of
optimality; none comes from an engine. Most are the paper's P3 and P4 in round numbers:
Δ [s] of hovering draws I Δ, T' [s] of resting brings R T', the flight has drawn Q, all may draw C,
and the flight leaves the time T.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from optuav.engines.registry import takers
from optuav.modelling import Model, Parameter
from optuav.modelling.classify import traits
from optuav.status import Status

Numbers = Mapping[str, float]
Sides = tuple[float, float]
"""Derivatives of the best value to the left and to the right."""


@dataclass(frozen=True)
class Case:
    """A problem and its answer.

    Parameters
    ----------
    name
        What is special about it.
    build
        Makes the model.
    status
        What an engine with a proof says.
    objective
        Best value.
    values
        Those unknowns that are unique, or made so by the tie rule.
    multipliers
        Those multipliers that are unique, by label.
    prices
        By parameter, what one more unit brings; a pair (less, more) where the sides differ.
    slot_s
        Length of the slots; None for continuous times.
    """

    name: str
    build: Callable[[], Model]
    status: Status = Status.OPTIMAL
    objective: float = math.nan
    values: Numbers = field(default_factory=dict)
    multipliers: Numbers = field(default_factory=dict)
    prices: Mapping[str, float | Sides] = field(default_factory=dict)
    slot_s: float | None = None

    @property
    def engines(self) -> tuple[str, ...]:
        """Names of the engines that take the problem.

        The grid only where there are slots; bracket not where nothing bounds the times.
        """
        slots = self.slot_s is not None
        unfit = {"grid" if not slots else "", "bracket" if self.status is Status.UNBOUNDED else ""}
        return tuple(name for name in takers(traits(self.build()), slots) if name not in unfit)


def number(name: str, value: float, unit: str = "s") -> Parameter:
    return Parameter(name, name, unit, value)


def p3(C: float = 900.0, T: float = 150.0) -> Model:
    """max Δ, 100 + 10 Δ ≤ C, Δ ≤ T."""
    model = Model("longest hover without a rest")
    hover = model.variable("Δ", "Δ", unit="s", upper=number("T", T))
    model.maximise(hover)
    drawn = number("Q", 100.0, "A s") + number("I", 10.0, "A") * hover
    model.subject_to("charge", drawn <= number("C", C, "A s"), unit="A s")
    return model


def p3_of_exactly(hover_s: float) -> Model:
    """P3 with T = 150.65, and Δ stated by an equation as well."""
    model = p3(C=9000.0, T=150.65)
    (hover,) = model.variables
    model.subject_to("exactly", hover == number("exact", hover_s), unit="s")
    return model


def p4(C: float = 900.0, T: float = 150.0, R: float = 5.0, most: float | None = None) -> Model:
    """max Δ, 100 + 10 Δ − R T' ≤ C, Δ + T' ≤ T, Δ ≤ most, of equal plans the least T'."""
    model = Model("longest hover with one rest")
    upper = math.inf if most is None else number("most", most)
    hover = model.variable("Δ", "Δ", unit="s", upper=upper, first_slot=1)
    rest = model.variable("T'", "T'", unit="s", first_slot=1)
    model.maximise(hover)
    model.prefer_small(rest)
    drawn = number("Q", 100.0, "A s") + number("I", 10.0, "A") * hover
    drawn = drawn - number("R", R, "A") * rest
    model.subject_to("charge", drawn <= number("C", C, "A s"), unit="A s")
    model.subject_to("deadline", hover + rest <= number("T", T), unit="s")
    return model


def least_rest() -> Model:
    """min T', 100 + 10 Δ − 5 T' ≤ 900, Δ + T' = 150."""
    model = Model("least rest, all time used")
    hover, rest = model.variable("Δ", "Δ", unit="s"), model.variable("T'", "T'", unit="s")
    model.minimise(rest)
    drawn = number("Q", 100.0, "A s") + number("I", 10.0, "A") * hover
    drawn = drawn - number("R", 5.0, "A") * rest
    model.subject_to("charge", drawn <= number("C", 900.0, "A s"), unit="A s")
    model.subject_to("deadline", hover + rest == number("T", 150.0), unit="s")
    return model


def all_time_used() -> Model:
    """max Δ, 100 + 10 Δ − 5 T' ≤ 900, T = Δ + T'."""
    model = p4()
    (deadline,) = (each for each in model.constraints if each.label == "deadline")
    model.constraints.remove(deadline)
    hover, rest = model.variables
    model.subject_to("deadline", number("T", 150.0) == hover + rest, unit="s")
    return model


def cheapest(need: float = 4.0) -> Model:
    """min 2 x + 3 y, x + y ≥ need, x ≤ 3, y ≥ 0, x ≥ 0."""
    model = Model("cheapest")
    x = model.variable("x", "x", unit="s", upper=number("most", 3.0))
    y = model.variable("y", "y", unit="s")
    model.minimise(number("price", 2.0) * x + 3.0 * y)
    model.subject_to("need", x + y >= number("need", need))
    return model


def below_zero() -> Model:
    """max x − y over x ∈ [−9, −2], y ∈ [−4, 5], x + y ≥ p, p = −5."""
    model = Model("below zero")
    x = model.variable("x", "x", unit="s", lower=-9.0, upper=-2.0, first_slot=-9)
    y = model.variable("y", "y", unit="s", lower=-4.0, upper=5.0, first_slot=-4)
    model.maximise(x - y)
    model.subject_to("sum", x + y >= number("p", -5.0))
    return model


def parallel() -> Model:
    """max Δ, Δ ≤ 80 said in three ways, one of them looser."""
    model = Model("said three times")
    hover = model.variable("Δ", "Δ", unit="s")
    model.maximise(hover)
    model.subject_to("once", hover <= number("p", 80.0))
    model.subject_to("twice", 2.0 * hover <= number("q", 160.0))
    model.subject_to("looser", 3.0 * hover <= number("r", 900.0))
    return model


def constant_row(reach: float) -> Model:
    """max Δ, Δ ≤ 80, and 500 ≤ reach, which holds no unknown."""
    model = Model("a row without unknowns")
    hover = model.variable("Δ", "Δ", unit="s", upper=number("p", 80.0))
    model.maximise(hover)
    model.subject_to("reach", number("d", 500.0, "m") <= number("d_max", reach, "m"), unit="m")
    return model


def nothing_to_gain() -> Model:
    """max 7 over Δ ≤ T, of equal answers the least −Δ."""
    model = Model("nothing to gain")
    hover = model.variable("Δ", "Δ", unit="s", upper=number("T", 150.0))
    model.maximise(number("worth", 7.0))
    model.prefer_small(-hover)
    return model


def open_end(unknowns: int) -> Model:
    """max Δ, with a rest that pays for any of it, or with nothing else at all."""
    model = Model("open end")
    hover = model.variable("Δ", "Δ", unit="s")
    model.maximise(hover)
    if unknowns == 2:
        rest = model.variable("T'", "T'", unit="s")
        model.subject_to("charge", 10.0 * hover - 5.0 * rest <= number("C", 800.0))
    return model


def apart() -> Model:
    """Δ + T' ≤ 150, Δ ≥ 120, 10 Δ − 5 T' ≤ 800: each pair can be met, all three cannot."""
    model = p4()
    model.subject_to("service", model.variables[0] >= number("wanted", 120.0))
    return model


def fixed() -> Model:
    """max Δ + T' with T' ∈ [40, 40] and 10 Δ − 5 T' ≤ 800."""
    model = Model("a rest that is given")
    hover = model.variable("Δ", "Δ", unit="s")
    rest = model.variable("T'", "T'", unit="s", lower=40.0, upper=40.0)
    model.maximise(hover + rest)
    model.subject_to("charge", 10.0 * hover - 5.0 * rest <= number("C", 800.0))
    return model


def saturating() -> Model:
    """max t, expm1(k t) ≤ C, k = 1/100, C = 3."""
    model = Model("exponential")
    t = model.variable("t", "t", unit="s", upper=1000.0)
    model.maximise(t)
    model.subject_to("limit", np.expm1(number("k", 0.01, "1/s") * t) <= number("C", 3.0, "1"))
    return model


def diminishing() -> Model:
    """max √x + 2 √y, x + 4 y ≤ P, P = 8."""
    model = Model("diminishing returns")
    x, y = model.variable("x", "x", unit="s"), model.variable("y", "y", unit="s")
    model.maximise(np.sqrt(x) + number("worth", 2.0) * np.sqrt(y))
    model.subject_to("budget", x + 4.0 * y <= number("P", 8.0))
    return model


def hyperbola() -> Model:
    """min x + y, x y ≥ a, x ≤ 10, y ≤ 10, a = 16."""
    model = Model("hyperbola")
    x, y = (model.variable(name, name, unit="s", upper=10.0) for name in ("x", "y"))
    model.minimise(x + y)
    model.subject_to("product", x * y >= number("a", 16.0))
    return model


def two_tops() -> Model:
    """max (x − p)² over x ∈ [0, 10], p = 3."""
    model = Model("two local optima")
    x = model.variable("x", "x", unit="s", upper=number("most", 10.0))
    model.maximise((x - number("p", 3.0)) ** 2)
    return model


def choice() -> Model:
    """max Δ, 10 Δ ≤ 800 + 250 a + 300 b, Δ ≤ 150 − 40 a − 60 b, a + b ≤ 1, a and b binary."""
    model = Model("which building")
    hover = model.variable("Δ", "Δ", unit="s")
    a, b = (model.variable(name, name, unit="1", upper=1.0, binary=True) for name in ("a", "b"))
    model.maximise(hover)
    model.subject_to("charge", 10.0 * hover <= 800.0 + 250.0 * a + 300.0 * b)
    model.subject_to("deadline", hover <= number("T", 150.0) - 40.0 * a - 60.0 * b)
    model.subject_to("one", a + b <= 1.0)
    return model


CASES = (
    # 100 + 10 Δ = 900: Δ = 80. 1 = 10 λ. ∂L/∂C = λ, ∂L/∂Q = −λ, ∂L/∂I = −λ Δ.
    Case(
        "P3 bounded by charge",
        p3,
        objective=80.0,
        values={"Δ": 80.0},
        multipliers={"charge": 0.1, "bounds of Δ": 0.0},
        prices={"C": 0.1, "Q": -0.1, "I": -8.0, "T": 0.0},
    ),
    # Δ = T = 150 needs 1600 of 9000.
    Case(
        "P3 bounded by the deadline",
        lambda: p3(C=9000.0),
        objective=150.0,
        values={"Δ": 150.0},
        multipliers={"charge": 0.0, "bounds of Δ": 1.0},
        prices={"C": 0.0, "Q": 0.0, "I": 0.0, "T": 1.0},
    ),
    # Δ = 150 = (1600 − 100)/10 = T: 10 λ + μ = 1. Less of either costs, more of it alone brings
    # nothing: v = min(T, (C − Q)/I).
    Case(
        "P3 bounded by both",
        lambda: p3(C=1600.0),
        objective=150.0,
        values={"Δ": 150.0},
        prices={"C": (0.1, 0.0), "Q": (0.0, -0.1), "I": (0.0, -15.0), "T": (1.0, 0.0)},
    ),
    # No time, no hover: v = min(T, ...) = 0, and T < 0 is infeasible, where v = −∞.
    Case(
        "P3 with no time at all",
        lambda: p3(T=0.0),
        objective=0.0,
        values={"Δ": 0.0},
        prices={"C": 0.0, "Q": 0.0, "I": 0.0, "T": (math.inf, 1.0)},
    ),
    # 10 Δ − 5 T' = 800 and Δ + T' = 150 meet at Δ = 1550/15, T' = 700/15. 10 λ + μ = 1 and
    # −5 λ + μ = 0: λ = 1/15, μ = 1/3. ∂L/∂I = −λ Δ, ∂L/∂R = λ T'.
    Case(
        "P4 bounded by charge and deadline",
        p4,
        objective=310.0 / 3.0,
        values={"Δ": 310.0 / 3.0, "T'": 140.0 / 3.0},
        multipliers={"charge": 1 / 15, "deadline": 1 / 3, "bounds of Δ": 0.0, "bounds of T'": 0.0},
        prices={"C": 1 / 15, "Q": -1 / 15, "T": 1 / 3, "I": -62.0 / 9.0, "R": 28.0 / 9.0},
    ),
    # Plenty of charge: Δ = 150, T' = 0; μ = 1, and along T' 0 = μ − ν.
    Case(
        "P4 bounded by the deadline, T' = 0",
        lambda: p4(C=9000.0),
        objective=150.0,
        values={"Δ": 150.0, "T'": 0.0},
        multipliers={"charge": 0.0, "deadline": 1.0, "bounds of Δ": 0.0, "bounds of T'": 1.0},
        prices={"C": 0.0, "Q": 0.0, "T": 1.0, "I": 0.0, "R": 0.0},
    ),
    # A rest brings nothing: Δ = 80 with any T' ∈ [0, 70]; the smallest is 0. λ = 1/10. With R more,
    # T' = 70 would bring 70 λ = 7; with R less, T' = 0 loses nothing.
    Case(
        "P4 tied: a rest that brings nothing",
        lambda: p4(R=0.0),
        objective=80.0,
        values={"Δ": 80.0, "T'": 0.0},
        multipliers={"charge": 0.1, "deadline": 0.0, "bounds of Δ": 0.0, "bounds of T'": 0.0},
        prices={"C": 0.1, "Q": -0.1, "T": 0.0, "I": -8.0, "R": (0.0, 7.0)},
    ),
    # Δ ≤ 60 binds alone; 10·60 − 5 T' ≤ 800 and 60 + T' ≤ 150 leave T' ∈ [0, 90].
    Case(
        "P4 tied: bounded by the largest hover time",
        lambda: p4(most=60.0),
        objective=60.0,
        values={"Δ": 60.0, "T'": 0.0},
        multipliers={"charge": 0.0, "deadline": 0.0, "bounds of Δ": 1.0, "bounds of T'": 0.0},
        prices={"C": 0.0, "Q": 0.0, "T": 0.0, "I": 0.0, "R": 0.0, "most": 1.0},
    ),
    # As above at Δ ≤ 100: 10·100 − 5 T' ≤ 800 needs T' ≥ 40, the deadline leaves 50; take 40.
    Case(
        "P4 tied: the smallest rest that its hover time needs",
        lambda: p4(most=100.0),
        objective=100.0,
        values={"Δ": 100.0, "T'": 40.0},
        multipliers={"charge": 0.0, "deadline": 0.0, "bounds of Δ": 1.0, "bounds of T'": 0.0},
        prices={"C": 0.0, "Q": 0.0, "T": 0.0, "I": 0.0, "R": 0.0, "most": 1.0},
    ),
    # Three rows through (100, 50): 10 Δ − 5 T' = 750, Δ + T' = 150, Δ = 100. λ = (1 − ν)/15,
    # μ = (1 − ν)/3 with the multiplier ν ∈ [0, 1] of Δ ≤ 100. Of each price the dearer end holds
    # for less of what is wanted, the cheaper one for more.
    Case(
        "P4 degenerate: three rows through a point",
        lambda: p4(C=850.0, most=100.0),
        objective=100.0,
        values={"Δ": 100.0, "T'": 50.0},
        prices={
            "C": (1 / 15, 0.0),
            "Q": (0.0, -1 / 15),
            "T": (1 / 3, 0.0),
            "I": (0.0, -100 / 15),
            "R": (50 / 15, 0.0),
            "most": (1.0, 0.0),
        },
    ),
    # Charge for exactly 150 s: T' = 0, three rows through (150, 0). 10 λ + μ = 1, −5 λ + μ = ν ≥ 0:
    # λ ∈ [0, 1/15], μ ∈ [1/3, 1].
    Case(
        "P4 degenerate at T' = 0",
        lambda: p4(C=1600.0),
        objective=150.0,
        values={"Δ": 150.0, "T'": 0.0},
        prices={
            "C": (1 / 15, 0.0),
            "Q": (0.0, -1 / 15),
            "T": (1.0, 1 / 3),
            "I": (0.0, -10.0),
            "R": 0.0,
        },
    ),
    # T' has to be the smallest where 10 Δ − 5 T' ≤ 800 meets Δ + T' = 150, as in P4: T' = 700/15.
    # min T' = max −T': 0 = 10 λ + μ, −1 = −5 λ + μ: λ = 1/15, μ = −2/3; v = T', so that prices in
    # T' have the other sign. ∂v/∂I = λ Δ, ∂v/∂R = −λ T'.
    Case(
        "least rest, an equality with a negative multiplier",
        least_rest,
        objective=140.0 / 3.0,
        values={"Δ": 310.0 / 3.0, "T'": 140.0 / 3.0},
        multipliers={"charge": 1 / 15, "deadline": -2 / 3, "bounds of Δ": 0.0, "bounds of T'": 0.0},
        prices={"C": -1 / 15, "Q": 1 / 15, "T": 2 / 3, "I": 62.0 / 9.0, "R": -28.0 / 9.0},
    ),
    # The answer of P4; written the other way round, one more unit of the right side is one second
    # less: μ = −1/3.
    Case(
        "P4 with all time used, an equality turned round",
        all_time_used,
        objective=310.0 / 3.0,
        values={"Δ": 310.0 / 3.0, "T'": 140.0 / 3.0},
        multipliers={"charge": 1 / 15, "deadline": -1 / 3},
        prices={"C": 1 / 15, "Q": -1 / 15, "T": 1 / 3, "I": -62.0 / 9.0, "R": 28.0 / 9.0},
    ),
    # x = 3 is cheap and used up, y = 1: 9. One more unit of need costs 3, one more of x saves 1.
    # −2 = −λ + μ, −3 = −λ: λ = 3, μ = 1.
    Case(
        "minimise, rows ≥, an upper bound that binds",
        cheapest,
        objective=9.0,
        values={"x": 3.0, "y": 1.0},
        multipliers={"need": 3.0, "bounds of x": 1.0, "bounds of y": 0.0},
        prices={"need": 3.0, "most": -1.0, "price": 3.0},
    ),
    # Need = 3: x = 3, y = 0, and λ ∈ [2, 3]. One more costs 3, one less saves 2; a larger upper
    # bound of x brings nothing, a smaller one costs 1.
    Case(
        "minimise, degenerate",
        lambda: cheapest(need=3.0),
        objective=6.0,
        values={"x": 3.0, "y": 0.0},
        prices={"need": (2.0, 3.0), "most": (-1.0, 0.0), "price": 3.0},
    ),
    # x = −2 and y = −5 − x = −3 (≥ −4): −2 + 3 = 1. 1 = −λ + μ, −1 = −λ: λ = 1, μ = 2.
    Case(
        "unknowns below zero",
        below_zero,
        objective=1.0,
        values={"x": -2.0, "y": -3.0},
        multipliers={"sum": 1.0, "bounds of x": 2.0, "bounds of y": 0.0},
        prices={"p": -1.0},
    ),
    # Δ = 80; λ + 2 μ = 1. Less of p costs 1, less of q costs 1/2, more of one alone brings nothing.
    Case(
        "parallel rows",
        parallel,
        objective=80.0,
        values={"Δ": 80.0},
        multipliers={"looser": 0.0},
        prices={"p": (1.0, 0.0), "q": (0.5, 0.0), "r": 0.0},
    ),
    # T' = 40 is given: Δ = 100, 140 in all. λ = 1/10.
    Case(
        "an unknown that is given",
        fixed,
        objective=140.0,
        values={"Δ": 100.0, "T'": 40.0},
        multipliers={"charge": 0.1, "bounds of Δ": 0.0},
        prices={"C": 0.1},
    ),
    Case(
        "a row without unknowns that holds",
        lambda: constant_row(501.0),
        objective=80.0,
        values={"Δ": 80.0},
        multipliers={"bounds of Δ": 1.0},
        prices={"p": 1.0, "d": 0.0, "d_max": 0.0},
    ),
    # The same at its edge: less reach is infeasible, v = −∞ there; more distance too.
    Case(
        "a row without unknowns at its edge",
        lambda: constant_row(500.0),
        objective=80.0,
        values={"Δ": 80.0},
        multipliers={"bounds of Δ": 1.0},
        prices={"p": 1.0, "d": (0.0, -math.inf), "d_max": (math.inf, 0.0)},
    ),
    Case("a row without unknowns that fails", lambda: constant_row(499.0), Status.INFEASIBLE),
    # All Δ are worth 7; the preference takes the largest.
    Case(
        "nothing to gain",
        nothing_to_gain,
        objective=7.0,
        values={"Δ": 150.0},
        prices={"worth": 1.0, "T": 0.0},
    ),
    Case("P3 infeasible by time", lambda: p3(T=-1.0), Status.INFEASIBLE),
    Case("P3 infeasible by charge", lambda: p3(C=99.0), Status.INFEASIBLE),
    Case("P4 infeasible by time", lambda: p4(T=-1.0), Status.INFEASIBLE),
    # 100 − 5 T' ≤ −700 needs T' ≥ 160 > 150.
    Case("P4 infeasible by charge", lambda: p4(C=-700.0), Status.INFEASIBLE),
    Case(
        "P4 infeasible with a rest that costs next to nothing",
        lambda: p4(C=99.0, R=-1e-211),
        Status.INFEASIBLE,
    ),
    # 10·120 − 5 T' ≤ 800 needs T' ≥ 80 > 150 − 120.
    Case("P4 infeasible by three together", apart, Status.INFEASIBLE),
    Case("unbounded, one unknown", lambda: open_end(1), Status.UNBOUNDED),
    Case("unbounded along a rest that pays", lambda: open_end(2), Status.UNBOUNDED),
    # t = ln(1 + C)/k = 100 ln 4. dt/dC = 1/(k (1 + C)) = 25 = λ, dt/dk = −t/k.
    Case(
        "exponential",
        saturating,
        objective=100.0 * math.log(4.0),
        values={"t": 100.0 * math.log(4.0)},
        multipliers={"limit": 25.0, "bounds of t": 0.0},
        prices={"C": 25.0, "k": -10_000.0 * math.log(4.0)},
    ),
    # 1/(2 √x) = λ and 1/√y = 4 λ: x = 1/(4 λ²), 4 y = 1/(4 λ²), so 1/(2 λ²) = 8, λ = 1/4, x = 4,
    # y = 1. ∂L/∂worth = √y.
    Case(
        "diminishing returns",
        diminishing,
        objective=4.0,
        values={"x": 4.0, "y": 1.0},
        multipliers={"budget": 0.25, "bounds of x": 0.0, "bounds of y": 0.0},
        prices={"P": 0.25, "worth": 1.0},
    ),
    # x = y = √a = 4, v = 2 √a. 1 = λ y: λ = 1/4 = dv/da.
    Case(
        "hyperbola",
        hyperbola,
        objective=8.0,
        values={"x": 4.0, "y": 4.0},
        multipliers={"product": 0.25, "bounds of x": 0.0, "bounds of y": 0.0},
        prices={"a": 0.25},
    ),
    # 49 at x = 10, 9 at x = 0. dv/dmost = 2·7 = μ, dv/dp = −14.
    Case(
        "two local optima",
        two_tops,
        objective=49.0,
        values={"x": 10.0},
        multipliers={"bounds of x": 14.0},
        prices={"most": 14.0, "p": -14.0},
    ),
    # Neither: min(80, 150); a: min(105, 110); b: min(110, 90).
    Case("which building", choice, objective=105.0, values={"Δ": 105.0, "a": 1.0, "b": 0.0}),
    # Δ = 103 needs T' ≥ 46, 149 in all; Δ = 104 needs 48, 152 in all.
    Case(
        "P4 in slots of 1 s", p4, objective=103.0, values={"Δ": 103.0, "T'": 46.0}, slot_s=1.0
    ),
    # 21 slots. 14 of hovering need 10·98 − 800 = 180 = 5 T', T' ≥ 36: 6 slots, 20 in all;
    # 15 need T' ≥ 50: 8 slots, 23 in all.
    Case("P4 in slots of 7 s", p4, objective=98.0, values={"Δ": 98.0, "T'": 42.0}, slot_s=7.0),
    # Half slots: Δ = 103 needs 46; 103.5 needs 47, 150.5 in all.
    Case(
        "P4 in slots of 0.5 s", p4, objective=103.0, values={"Δ": 103.0, "T'": 46.0}, slot_s=0.5
    ),
    # A rest takes a slot at least: of 150 s Δ has 149.
    Case(
        "P4 in slots, the rest not needed",
        lambda: p4(C=9000.0),
        objective=149.0,
        values={"Δ": 149.0, "T'": 1.0},
        slot_s=1.0,
    ),
    Case("P4 in slots, no room for two", lambda: p4(T=1.9), Status.INFEASIBLE, slot_s=1.0),
    # T' ≤ (99 − 100)/10⁻²¹¹: no slot, however many.
    Case(
        "P4 in slots, infeasible with a rest that costs next to nothing",
        lambda: p4(C=99.0, R=-1e-211),
        Status.INFEASIBLE,
        slot_s=1.0,
    ),
    # The last slot is cut short by the bound, affordable whole: 151·10 ≤ 9000 − 100.
    Case(
        "P3 in slots, bounded by the deadline",
        lambda: p3(C=9000.0, T=150.65),
        objective=150.65,
        values={"Δ": 150.65},
        slot_s=1.0,
    ),
    # What an equation asks for is whole slots: neither the bound, nor the slot that it cuts short.
    Case(
        "P3 in slots, exactly 150 s",
        lambda: p3_of_exactly(150.0),
        objective=150.0,
        values={"Δ": 150.0},
        slot_s=1.0,
    ),
    *(
        Case(
            f"P3 in slots, exactly {hover_s:g} s",
            partial(p3_of_exactly, hover_s),
            Status.INFEASIBLE,
            slot_s=1.0,
        )
        for hover_s in (150.65, 151.0)
    ),
    # 80.9 s of charge are 80 whole slots.
    Case(
        "P3 in slots, bounded by charge",
        lambda: p3(C=909.0),
        objective=80.0,
        values={"Δ": 80.0},
        slot_s=1.0,
    ),
    Case("P3 in slots, infeasible by charge", lambda: p3(C=99.0), Status.INFEASIBLE, slot_s=1.0),
    Case("P3 in slots, infeasible by time", lambda: p3(T=-0.5), Status.INFEASIBLE, slot_s=1.0),
    # x = −2, y ≥ −3 in whole numbers: the continuous answer.
    Case(
        "unknowns below zero in slots",
        below_zero,
        objective=1.0,
        values={"x": -2.0, "y": -3.0},
        slot_s=1.0,
    ),
    # All time used: Δ = 150 − T', 15 T' ≥ 700: T' = 47.
    Case(
        "least rest in slots", least_rest, objective=47.0, values={"Δ": 103.0, "T'": 47.0},
        slot_s=1.0,
    ),
    # In quarters: 100 ln 4 = 138.629…
    Case(
        "exponential in slots of 0.25 s", saturating, objective=138.5, values={"t": 138.5},
        slot_s=0.25,
    ),
    Case(
        "hyperbola in slots of 4 s", hyperbola, objective=8.0, values={"x": 4.0, "y": 4.0},
        slot_s=4.0,
    ),
    # The hover time in whole slots, the choice binary: 105 by a; in slots of 10 s 100.
    Case(
        "which building in slots of 10 s", choice, objective=100.0, values={"Δ": 100.0, "a": 1.0},
        slot_s=10.0,
    ),
)  # fmt: skip

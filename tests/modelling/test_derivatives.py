"""Derivatives of trees: against complex steps, against differences, and through the physics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fractions import Fraction
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from optuav.modelling import Model, Parameter, Variable, evaluate
from optuav.modelling.traversal import KINKED, PARTIALS, slope
from optuav.physics import kibam, laser, rotor, six_stages
from tests.physics.reference import AIRFRAME, BATTERY, MOTOR
from tests.wells import after

UNARY = [np.negative, np.positive, np.sqrt, np.exp, np.exp2, np.expm1, np.log, np.log1p, np.log2,
         np.log10, np.sin, np.cos, np.tan, np.sinh, np.cosh, np.tanh, np.arcsin, np.arccos,
         np.arctan, np.arcsinh, np.arccosh, np.arctanh, np.square, np.reciprocal]  # fmt: skip
BINARY = [np.add, np.subtract, np.multiply, np.divide, np.power]
REAL_ONLY = [np.absolute, np.fabs, np.floor, np.ceil, np.trunc, np.sign, np.heaviside, np.cbrt,
             np.deg2rad, np.radians, np.rad2deg, np.degrees, np.logaddexp, np.arctan2, np.hypot,
             np.maximum, np.fmax, np.minimum, np.fmin]  # fmt: skip
"""Functions without a continuation to complex numbers in NumPy."""


def unknown(name: str) -> Variable:
    return Model("test").variable(name, name, unit="1")


LEAVES = (unknown("x"), unknown("y"), Parameter("p", "p", "1", 0.7), Parameter("q", "q", "1", 0.4))
POINT = {"x": 0.3, "y": 0.6}


@np.errstate(all="ignore")
def applied(ufunc: np.ufunc, *operands: Any) -> Any:
    return ufunc(*operands)


def trees(unary: list[np.ufunc], binary: list[np.ufunc]) -> st.SearchStrategy[Any]:
    """Expressions of unknowns, parameters and numbers."""
    return st.recursive(
        st.sampled_from(LEAVES) | st.floats(0.1, 3.0),
        lambda inner: (
            st.builds(applied, st.sampled_from(unary), inner)
            | st.builds(applied, st.sampled_from(binary), inner, inner)
        ),
        max_leaves=12,
    )


def usable(*numbers: Any) -> bool:
    """Neither outside a function's domain nor so large that digits are lost."""
    return all(np.isfinite(each) and abs(each) < 1e3 for each in numbers)


@np.errstate(all="ignore")
def by_complex_steps(tree: Any, values: Mapping[str, float]) -> dict[str, float]:
    """Im f(x + i h)/h: exact to the last digits, as nothing is subtracted."""
    return {
        name: float(np.imag(evaluate(tree, {**values, name: complex(value, 1e-30)})) / 1e-30)
        for name, value in values.items()
    }


@np.errstate(all="ignore")
def by_differences(tree: Any, values: Mapping[str, float]) -> dict[str, float]:
    """Central differences of fourth order."""
    found = {}
    for name, value in values.items():
        h = 1e-3 * (abs(value) or 1.0)
        near, far = (
            evaluate(tree, {**values, name: value + k * h})
            - evaluate(tree, {**values, name: value - k * h})
            for k in (1.0, 2.0)
        )
        found[name] = float((8.0 * near - far) / (12.0 * h))
    return found


EVERYTHING = {**POINT, "p": 0.7, "q": 0.4}


@given(trees(UNARY, BINARY))
def test_slopes_are_complex_steps(tree: Any) -> None:
    """Of random trees, to every unknown and every parameter."""
    with np.errstate(all="ignore"):
        found, value = slope(tree, POINT), evaluate(tree, POINT)
    assume(usable(found.value, *found.by.values()))
    assert found.value == value
    for name, expected in by_complex_steps(tree, EVERYTHING).items():
        assume(usable(expected))
        assert found.by.get(name, 0.0) == pytest.approx(expected, rel=1e-9, abs=1e-9), name


@pytest.mark.parametrize("ufunc", [*PARTIALS, *KINKED], ids=lambda ufunc: ufunc.__name__)
def test_every_function_has_its_slope(ufunc: np.ufunc) -> None:
    """At points of its domain, by differences; the arguments on either side of each other."""
    rng = np.random.default_rng(1)
    x, y = unknown("x"), unknown("y")
    for _ in range(20):
        values = dict(zip("xy", rng.uniform(0.1, 0.9, 2) + (ufunc is np.arccosh), strict=True))
        tree = ufunc(*(x, y)[: ufunc.nin])
        found, expected = slope(tree, values), by_differences(tree, values)
        for name in "xy"[: ufunc.nin]:
            assert found.by[name] == pytest.approx(expected[name], rel=1e-7, abs=1e-9)


def test_table_is_all_that_is_tested() -> None:
    assert {*PARTIALS, *KINKED} == {*UNARY, *BINARY, *REAL_ONLY}


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_kinks_have_the_slope_of_their_side(sign: float) -> None:
    """|x|, max and min away from where they bend; signs are flat."""
    x = unknown("x")
    at = {"x": 2.0 * sign}
    assert slope(np.absolute(x), at).by == {"x": sign}
    assert slope(np.maximum(x, 0.0), at).by == {"x": 0.5 * (1.0 + sign)}
    assert slope(np.minimum(x, 0.0), at).by == {"x": 0.5 * (1.0 - sign)}
    assert slope(np.sign(x), at).by == {"x": 0.0}


def test_arrays_are_differentiated_entry_by_entry() -> None:
    """Over unknowns and parameters of several programmes at once."""
    x, p = unknown("x"), Parameter("p", "p", "1", np.array([1.0, 2.0, 3.0]))
    values = np.array([0.5, 1.5, 2.5])
    together = slope(np.sin(p * x) / x, {"x": values})
    for k in range(3):
        alone = slope(np.sin(p * x) / x, {"x": values[k], "p": k + 1.0})
        assert together.value[k] == alone.value
        assert {name: by[k] for name, by in together.by.items()} == alone.by


def test_powers() -> None:
    """xⁿ at zero and below, where a logarithm has no business; and the exponent as an unknown."""
    x, y = unknown("x"), unknown("y")
    assert slope(x**2, {"x": 0.0}).by == {"x": 0.0}
    assert slope(x**3, {"x": -2.0}).by == {"x": 12.0}
    found = slope(x**y, {"x": 2.0, "y": 3.0})
    assert found.by == pytest.approx({"x": 12.0, "y": 8.0 * math.log(2.0)})
    assert slope(2.0**y, {"y": 3.0}).by == pytest.approx({"y": 8.0 * math.log(2.0)})


def test_shared_parts_count_as_often_as_they_occur() -> None:
    """x in both factors, through a named quantity used twice."""
    model = Model("test")
    x = model.variable("x", "x", unit="1")
    square = model.let("square", x * x)
    assert slope(square * square + square, {"x": 3.0}).by == {"x": 4 * 27.0 + 6.0}


def test_numbers_and_other_values_of_parameters() -> None:
    """A bare number has no slope; a parameter may be told another value than its own."""
    assert (slope(5.0, {}).value, slope(5.0, {}).by) == (5.0, {})
    p = Parameter("p", "p", "1", 3.0)
    assert slope(p * p, {}).by == {"p": 6.0}
    assert slope(p * p, {"p": 5.0}).by == {"p": 10.0}


def test_function_without_a_derivative_is_refused_by_name() -> None:
    with pytest.raises(NotImplementedError, match="rint has no derivative here"):
        slope(np.rint(unknown("x")), {"x": 1.0})


def test_long_sums_do_not_exhaust_the_stack() -> None:
    """Ten thousand terms are a tree that deep."""
    x = unknown("x")
    total: Any = x
    for _ in range(10_000):
        total = total + x
    assert slope(total, {"x": 1.0}).by == {"x": 10_001.0}


def through(function: Callable[..., Any], constants: Mapping[str, float]) -> tuple[Any, Any]:
    """A function of physics on unknowns, and the values of all of them."""
    return function(**{name: unknown(name) for name in constants}), dict(constants)


def leg(**numbers: Any) -> Any:
    """Charge of a flight leg plus its time, as a function of everything in it."""
    airframe = six_stages.Airframe(**{name: numbers.pop(name) for name in AIRFRAME._fields})
    motor = rotor.Motor(**{name: numbers.pop(name) for name in MOTOR._fields})
    way_m = tuple(numbers[name] for name in ("dx", "dy", "dz"))
    wind_N = tuple(numbers[name] for name in ("wx", "wy", "wz"))
    flown = six_stages.leg(airframe, motor, way_m, wind_N)
    return flown.loads.charge_As + 100.0 * flown.loads.duration_s


LEG = {**AIRFRAME._asdict(), **MOTOR._asdict(), "dx": 1000.0, "dy": -2501.0, "dz": 30.0,
       "wx": 1.0, "wy": -0.5, "wz": 0.2}  # fmt: skip


def wells(**numbers: Any) -> Any:
    """State of charge after hovering and resting in turn, through both wells."""
    pool = kibam.Battery(numbers["capacity_As"], numbers["share"], numbers["rate_per_s"])
    phases = [
        kibam.Stage(-numbers["flight_A"], 30.0),
        kibam.Stage(-numbers["hover_A"], numbers["hover_s"]),
        kibam.Stage(numbers["rest_A"], numbers["rest_s"]),
        kibam.Stage(-numbers["flight_A"], 40.0),
    ]
    end = after(pool, pool.full, phases)
    return end.available_As / pool.capacity_As + end.total_As / pool.capacity_As


WELLS = {"capacity_As": BATTERY.capacity_As, "share": 0.8, "rate_per_s": 4.5e-5, "flight_A": 107.0,
         "hover_A": 88.0, "hover_s": 500.0, "rest_A": 10.0, "rest_s": 300.0}  # fmt: skip


def beam(**numbers: Any) -> Any:
    """Share of a laser's light that arrives, with the visibility between haze and fog."""
    per_km = laser.attenuation(numbers["wavelength_nm"], numbers["visibility_km"])
    return laser.transmission(per_km, numbers["distance_m"])


BEAM = {"wavelength_nm": 810.0, "visibility_km": 3.0, "distance_m": 2500.0}


@pytest.mark.parametrize(
    ("function", "constants"),
    [pytest.param(leg, LEG, id="leg"), pytest.param(wells, WELLS, id="wells"),
     pytest.param(beam, BEAM, id="beam")],
)  # fmt: skip
def test_physics_goes_through_unchanged(
    function: Callable[..., Any], constants: Mapping[str, float]
) -> None:
    """The functions that floats go through have slopes to all that they depend on."""
    tree, values = through(function, constants)
    found, expected = slope(tree, values), by_differences(tree, values)
    assert found.value == pytest.approx(function(**constants), rel=1e-12)
    assert found.by.keys() <= expected.keys()
    for name, value in values.items():
        size = abs(found.value / value)
        assert found.by.get(name, 0.0) == pytest.approx(
            expected[name], rel=1e-6, abs=1e-8 * size
        ), name


@pytest.mark.parametrize("rate_per_s", [1e-190, 1e-18, 1e-12, 1e-7, 9.9e-6, 1.01e-5, 5e-4, 0.3])
def test_levelling_keeps_its_digits_at_any_rate(rate_per_s: float) -> None:
    """(1 − exp(−kt))/k and its derivative by k, by the series of exp in fractions."""
    k, t = Fraction(rate_per_s), Fraction(100)
    rate = Parameter("k", "k", "1/s", rate_per_s)
    _, integral = kibam.levelling(SimpleNamespace(rate_per_s=rate), 100.0)
    count = 160 if rate_per_s > 1e-3 else 24  # kt up to 30, or 0.05
    terms = [(n, t ** (n + 1) * Fraction((-1) ** n, math.factorial(n + 1))) for n in range(count)]
    value = sum(term * k**n for n, term in terms)
    by_rate = sum(n * term * k ** (n - 1) for n, term in terms[1:])
    found = slope(integral, {})
    assert found.value == pytest.approx(float(value), rel=1e-13)
    assert found.by["k"] == pytest.approx(float(by_rate), rel=1e-9)

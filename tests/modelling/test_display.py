"""Printed programmes: mathematics that means what was declared, in text and in LaTeX."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, reject
from hypothesis import strategies as st

import optuav
from optuav.modelling import Expression, Model, Parameter, Variable, evaluate
from optuav.modelling.display import WIDTH, latex, text
from optuav.modelling.expression import Indexed, PartedLabel
from optuav.modelling.writer import Latex, Text
from optuav.solving.question import problem_of
from tests.mathtext import lines_that_can_be_set

X: Any
Y: Any
X, Y = (Variable(name, name, "1", 0.0, math.inf, name, 0) for name in "xy")


def test_a_model_without_anything_prints() -> None:
    """As it is before the first declaration."""
    assert str(Model("empty")) == "empty\n\nmaximise   0"
    assert "over" not in latex(Model("empty"))


def written(expression: Any) -> str:
    return Text().write(expression).replace("\N{NO-BREAK SPACE}", " ")


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        (X + Y - 2.0, "x + y − 2"),
        (X - (Y - 2.0), "x − (y − 2)"),
        (X + (Y - 2.0), "x + y − 2"),
        (X + -Y, "x − y"),
        (X - -Y, "x + y"),
        (-(X + Y), "−(x + y)"),
        (-X * Y, "−x·y"),
        (X * -Y, "−x·y"),
        (X * (-Y * 2.0), "−x·y·2"),
        (-X * -Y, "x·y"),
        (X - (-Y) * 2.0, "x + y·2"),
        (np.negative(-X), "x"),
        (-X / Y, "−x/y"),
        (X + Y * -2.0, "x − y·2"),
        (2.0 ** (X * -Y), "2^(−x·y)"),
        (X - -Y / 2.0, "x + y/2"),
        (2.0 * (X + Y), "2·(x + y)"),
        (X * Y / 3.0, "x·y/3"),
        (X / (Y * 3.0), "x / (y·3)"),
        (X / (Y / 3.0), "x / (y/3)"),
        ((X + 1.0) / Y, "(x + 1) / y"),
        (X**2, "x²"),
        (X**-12, "x⁻¹²"),
        ((X**2) ** 3, "(x²)³"),
        ((-X) ** 2, "(−x)²"),
        (X**0.5, "x^0.5"),
        (2.0 ** (X + Y), "2^(x + y)"),
        (np.float_power(X, 2), "x²"),
        (np.positive(X), "x"),
        (abs(X - Y), "|x − y|"),
        (np.sqrt(X), "√x"),
        (np.sqrt(X + 1.0) ** 2, "(√(x + 1))²"),
        (np.exp(-X), "exp(−x)"),
        (2.0 * np.expm1(X), "2·(exp(x) − 1)"),
        (-np.expm1(-X), "1 − exp(−x)"),
        (-np.expm1(-X) / Y, "(1 − exp(−x)) / y"),
        (Y - -np.expm1(X), "y + exp(x) − 1"),
        (np.log(X), "ln(x)"),
        (np.log1p(-X), "ln(1 − x)"),
        (np.sin(X) * np.cos(Y), "sin(x)·cos(y)"),
        (np.arcsin(X), "arcsin(x)"),
        (np.arctan2(X, Y + 1.0), "atan2(x, y + 1)"),
        (np.maximum(X, -1.0), "max(x, −1)"),
        (np.maximum(X, 1e-200), "x"),
        (np.maximum(X, 0.0), "max(x, 0)"),
        (np.minimum(X, Y), "min(x, y)"),
        (np.sign(X), "sgn(x)"),
        (np.hypot(X, Y), "hypot(x, y)"),
        (0.0 + X, "x"),
        (X - 0.0, "x"),
        (X + np.array([80.2, 95.1, 90.0]), "x + (3 values, 80.2 to 95.1)"),
        (X + np.array([7.5, 7.5]), "x + 7.5"),
        (4.5e-5 * X, "4.5·10⁻⁵·x"),
        (X + 1e7, "x + 10⁷"),
        (X <= 2.0 * Y, "x ≤ 2·y"),
        (X >= Y, "x ≥ y"),
        (X == Y, "x = y"),
    ],
)
def test_text_of_an_expression(expression: Any, expected: str) -> None:
    """Brackets where precedence needs them and nowhere else; every function under its name."""
    assert written(expression) == expected


@pytest.mark.parametrize(
    ("number", "expected"),
    [
        (0.0, "0"),
        (-0.0, "0"),
        (1, "1"),
        (-1200.0, "−1200"),
        (7953.712345, "7953.712"),
        (1108800.0, "1108800"),
        (0.00045, "0.00045"),
        (4.5e-5, "4.5·10⁻⁵"),
        (-2.5e9, "−2.5·10⁹"),
        (1e-300, "10⁻³⁰⁰"),
        (math.inf, "∞"),
        (-math.inf, "−∞"),
        (math.nan, "NaN"),
        (np.array(3.0), "3"),
        (np.array([5.0]), "5"),
        (np.array([1.0, np.nan, 2.0]), "3 values, 1 to 2"),
    ],
)
def test_text_of_a_number(number: Any, expected: str) -> None:
    assert written(number) == expected


NUMBERS = st.floats(-9.0, 9.0).map(
    lambda number: round(number, 3) + 0.0
)  # no −0, which is 0 in words


def mixed(ufunc: np.ufunc, *parts: Any) -> Any:
    """A call, or a number where there are only numbers: they keep their few digits."""
    if ufunc is np.divide and not isinstance(parts[1], Expression) and parts[1] == 0.0:
        reject()
    return ufunc(*parts) if any(isinstance(part, Expression) for part in parts) else parts[0]


TREES = st.recursive(
    st.sampled_from([X, Y]) | NUMBERS | st.just(4.5e-5),
    lambda parts: st.one_of(
        st.builds(mixed, st.sampled_from([np.negative, np.exp, np.expm1, np.log1p]), parts),
        st.builds(
            mixed,
            st.sampled_from([np.add, np.subtract, np.multiply, np.divide, np.maximum]),
            parts,
            parts,
        ),
        st.builds(mixed, st.just(np.power), parts, st.sampled_from([2, 3, -1, 0.5])),
    ),
    max_leaves=12,
).filter(lambda tree: isinstance(tree, Expression))


def read(line: str) -> str:
    """Printed mathematics as Python source: the same precedence, other signs."""
    line = re.sub(
        "[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+",
        lambda power: f"**{power[0].translate(str.maketrans('⁻⁰¹²³⁴⁵⁶⁷⁸⁹', '-0123456789'))}",
        line,
    )
    return line.replace("−", "-").replace("·", "*").replace("^", "**")


@pytest.mark.campaign
@given(TREES, st.floats(0.1, 5.0), st.floats(0.1, 5.0))
@np.errstate(all="ignore")
def test_text_means_what_was_declared(tree: Expression, x: float, y: float) -> None:
    """Read again by Python's rules of precedence, the line has the tree's value."""
    numbers = {"x": np.float64(x), "y": np.float64(y)}
    value = evaluate(tree, numbers)
    assume(np.isfinite(value))
    functions = {"exp": np.exp, "ln": np.log, "max": np.maximum}
    again = eval(read(written(tree)), {**functions, **numbers})
    assert again == pytest.approx(value, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize(
    ("symbol", "expected"),
    [
        ("Δ", r"\Delta"),
        ("η0", r"\eta_0"),
        ("T'", "T'"),
        ("T_max", r"T_{\max}"),
        ("T_fl", r"T_{\mathrm{fl}}"),
        ("T'_harv", r"T'_{\mathrm{harv}}"),
        ("B_i", "B_i"),
        ("y1", "y_1"),
        ("E_1", "E_1"),
        ("P_0,hv", r"P_{0,\mathrm{hv}}"),
        ("k_F", "k_F"),
        ("Δt", r"\Delta\,t"),
        ("SOC", r"\mathrm{SOC}"),
        ("charge at the end", r"\text{charge at the end}"),
        ("hover_time_s", r"\mathtt{hover\_time\_s}"),
        ("|w_1 − w_0| + |w_F|", "|w_1 - w_0| + |w_F|"),
    ],
)
def test_symbols_in_latex(symbol: str, expected: str) -> None:
    """Letters in italics, words upright, Greek by name, indices below."""
    assert Latex().symbol(symbol) == expected


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ((X + 1.0) / (2.0 * Y), r"\frac{x + 1}{2\,y}"),
        (X * (Y - 1.0), r"x\,\left(y - 1\right)"),
        (X * 3.0, r"x \cdot 3"),
        (4.5e-5 * X, r"4.5 \cdot 10^{-5}\,x"),
        ((X / Y) ** 2, r"\left(\frac{x}{y}\right)^{2}"),
        (np.sqrt(X + Y), r"\sqrt{x + y}"),
        (abs(X), r"\left|x\right|"),
        (np.exp(-X), r"\exp\left(-x\right)"),
        (np.hypot(X, Y), r"\operatorname{hypot}\left(x, y\right)"),
        (X - -np.inf, r"x + \infty"),
        (X - 2.0 * (-Y / X), r"x + 2\,\frac{y}{x}"),
        (X >= Y, r"x \geq y"),
        (X <= Y, r"x \leq y"),
    ],
)
def test_latex_of_an_expression(expression: Any, expected: str) -> None:
    assert Latex().write(expression) == expected


def test_prime_and_power_do_not_meet() -> None:
    """TeX refuses a superscript after a prime and an index."""
    rest = Variable("rest", "T'_harv", "s", 0.0, math.inf, "", 0)
    assert Latex().write(rest**2) == r"{T'_{\mathrm{harv}}}^{2}"


def example() -> Model:
    """Everything that a page may hold: bounds of all kinds, names in names, arrays, long lines."""
    model = Model("Longest hover with a little of everything")
    rate = Parameter("rate_per_s", "k'", "1/s", 4.5e-5)
    share = Parameter("share", "ω", "1", np.array([0.25, 0.5, 0.75]), "battery.available_fraction")
    left = Parameter("left_s", "T_left", "s", 1125.5)
    hover = model.variable("hover_s", "Δ", unit="s", upper=left, label="E.c hover time")
    tilt = model.variable("tilt", "z", unit="1", lower=-math.inf)
    model.variable("chosen", "u_b1", unit="1", upper=1.0, binary=True)
    kept = model.let("kept", np.exp(-rate * hover), symbol="κ")
    model.let("never used", hover + 1.0, symbol="u")
    bound = model.let("bound charge", (1.0 - kept) * share / (1.0 - share), symbol="y2", unit="A s")
    model.minimise(-hover)
    model.prefer_small(abs(tilt))
    model.subject_to("E.a charge", bound + kept**2 >= tilt, unit="A s")
    long = sum((number * hover for number in range(1, 25)), tilt)
    model.subject_to("E.b a long one & 100 % Δ", long <= 1e9)
    return model


EXAMPLE = """\
Longest hover with a little of everything

minimise   −Δ, then smallest |z|
over       Δ ∈ [0, T_left] s  (E.c hover time)
           z ∈ (−∞, ∞)
           u_b1 ∈ {0, 1}
subject to
  E.a charge                y2 + κ² ≥ z
  E.b a long one & 100 % Δ  z + 1·Δ + 2·Δ + 3·Δ + 4·Δ + 5·Δ + 6·Δ + 7·Δ + 8·Δ + 9·Δ + 10·Δ
                              + 11·Δ + 12·Δ + 13·Δ + 14·Δ + 15·Δ + 16·Δ + 17·Δ + 18·Δ + 19·Δ
                              + 20·Δ + 21·Δ + 22·Δ + 23·Δ + 24·Δ ≤ 10⁹
with
  kept          κ = exp(−k'·Δ)
  bound charge  y2 = (1 − κ)·ω / (1 − ω)
where
  T_left  left_s      1125.5                  s
  k'      rate_per_s  4.5·10⁻⁵                1/s
  ω       share       3 values, 0.25 to 0.75  1    battery.available_fraction
"""


def test_page_of_text() -> None:
    """Lined up; quantities that are used are defined once, after those that they are made of."""
    page = text(example())
    assert page.splitlines() == EXAMPLE.splitlines()
    assert str(example()) == page
    assert max(map(len, page.splitlines())) <= WIDTH


@pytest.mark.parametrize("perspective", ["battery", "energy", "adjusted", "wells", "available"])
@pytest.mark.parametrize("problem", ["P1", "P4"])
def test_ranges_over_many_routes_fit_on_the_page(problem: str, perspective: str) -> None:
    """Every parameter is on it, in columns that line up, long symbols above their row."""
    building = "b1" if problem == "P4" else None
    program = optuav.formulate(
        "paper", problem_of(problem, building=building), perspective=perspective
    )
    lines = str(program).splitlines()
    assert max(map(len, lines)) <= WIDTH
    table = lines[-lines[::-1].index("where") :]
    for name, parameter in program.parts[-1].model.parameters.items():
        (row,) = (k for k, line in enumerate(table) if f" {name} " in line)
        assert f"  {parameter.symbol} " in table[row] or table[row - 1] == f"  {parameter.symbol}"
    ends = {line.index("limits.") for line in table if "limits." in line}
    assert len(ends) == 1


def test_goal_that_an_earlier_one_settles_is_not_printed() -> None:
    """Smallest x says nothing after smallest p + 2 x; it does after smallest x² or x + y."""
    for objective, page in (
        (lambda x, y: Parameter("p", "p", "1", 1.0) + 2.0 * x, "p + 2·x, then smallest y"),
        (lambda x, y: x**2, "x², then smallest x, then smallest y"),
        (lambda x, y: x + y, "x + y, then smallest x, then smallest y"),
    ):
        model = Model("Goals")
        x, y = (model.variable(name, name, unit="1") for name in "xy")
        model.minimise(objective(x, y))
        for each in (x, y, -x):
            model.prefer_small(each)
        assert text(model).splitlines()[2] == f"minimise   {page}"


def test_of_a_chain_told_in_words_the_last_is_printed() -> None:
    """And whatever on its way is written out, with the link that it speaks of."""
    model = Model("Chain")
    x = model.variable("x", "x", unit="1")
    first = model.let("first", 2.0 * x, symbol="a", words="by rule")
    second = model.let("second", first + 1.0, symbol="b", words="by rule")
    third = model.let("third", second * x, symbol="c")
    fourth = model.let("fourth", third + 1.0, symbol="d", words="by rule")
    fifth = model.let("fifth", fourth + 1.0, symbol="e", words="by rule")
    model.subject_to("limit", fifth <= 1.0)
    assert text(model).splitlines()[-4:] == [
        "with",
        "  second  b = by rule",
        "  third   c = b·x",
        "  fifth   e = by rule",
    ]


def steps(numbers: Sequence[int]) -> Model:
    """A level after every step, told in words where its number is odd, and kept above 0."""
    model = Model("Steps")
    level: Any = model.variable("x", "x", unit="1")
    for k in numbers:
        words = "by rule" if k % 2 else ""
        name = PartedLabel("level after step", k)
        level = model.let(name, level + 1.0, symbol=Indexed("y", k), words=words)
        model.subject_to(PartedLabel("kept after step", k, "of all"), 2.0 * level >= 0.0)
    model.subject_to("end", level <= 9.0)
    model.subject_to("not of one number", level <= model.lets[0])
    return model


def test_lines_that_differ_in_a_number_alone_are_one() -> None:
    """With the numbers that there are; those of several numbers, or of none, stay as they are."""
    assert text(steps((1, 2, 3, 4, 6))).splitlines()[4:] == [
        "subject to",
        "  kept after step …  2·y_j ≥ 0, j = 1 … 4, 6",
        "  end                y_6 ≤ 9",
        "  not of one number  y_6 ≤ y_1",
        "with",
        "  level after step …  y_j = by rule, j = 1, 3",
        "  level after step 2  y_2 = y_1 + 1",
        "  level after step 4  y_4 = y_3 + 1",
        "  level after step 6  y_6 = y_4 + 1",
    ]


def test_lines_of_latex_are_merged_alike() -> None:
    page = latex(steps((1, 2, 3, 4, 6)))
    name = r"\tag*{\(\text{kept after step }\ldots\)}"
    assert rf"2\,y_j \geq 0,\quad j = 1, \ldots, 4, 6 {name}" in page


def test_lines_of_latex_are_merged_across_the_number_of_digits() -> None:
    """LaTeX writes y_9, but y_{10}."""
    page = latex(steps((9, 10)))
    assert r"2\,y_j \geq 0,\quad j = 9, 10 \tag*" in page


def test_equal_lines_are_told_apart() -> None:
    model = Model("Twice")
    x = model.variable("x", "x", unit="1")
    level = model.let("level", x + 1.0, symbol=Indexed("y", 3))
    for label, stated in (("a", x), ("b", x), ("c", level), ("d", level)):
        model.subject_to(label, stated <= 1.0)
    lines = ["  a  x ≤ 1", "  b  x ≤ 1", "  c  y_3 ≤ 1", "  d  y_3 ≤ 1"]
    assert text(model).splitlines()[-6:-2] == lines


@pytest.mark.parametrize("problem", ["P1", "P3", "P4"])
@pytest.mark.parametrize("perspective", ["available", "wells"])
def test_programmes_through_the_wells_are_short(problem: str, perspective: str) -> None:
    """A page of a terminal, in the notation of a lecture: no expm1 in disguise."""
    asked = {"building": "b1", "order": "rest-first"} if problem == "P4" else {}
    program = optuav.formulate("paper", problem_of(problem, **asked), perspective=perspective)
    for part in program.parts:
        page = str(part.model)
        assert len(page.splitlines()) <= 45
        assert "exp(−k'·Δ)" in page
        assert "(−" not in page.replace("exp(−", "")


def test_programme_of_numbers_alone_prints() -> None:
    """Nothing to seek, nothing to keep: no empty headings."""
    model = Model("Nothing")
    model.variable("x", "x", unit="1")
    assert text(model).splitlines() == ["Nothing", "", "maximise   0", "over       x ∈ [0, ∞)"]


def test_page_of_latex() -> None:
    """Every line but the last of an environment ends in a break, and names are tags."""
    page = example().to_latex()
    assert page == latex(example())
    lines = lines_that_can_be_set(page)
    given = next(k for k, line in enumerate(lines) if line.startswith(r"\text{where}"))
    for some in (lines[:given], lines[given:]):
        assert all(line.endswith(r" \\") for line in some[:-1])
        assert not some[-1].endswith("\\")
    assert lines[0] == r"\text{minimise}\quad & -\Delta,\text{ then smallest }\left|z\right| \\"
    assert lines[1] == (
        r"\text{over}\quad & \Delta \in [0, T_{\mathrm{left}}]\,\mathrm{s}"
        r" \tag*{\(\text{E.c hover time}\)} \\"
    )
    assert lines[3] == r" & u_{\mathrm{b1}} \in \{0, 1\} \\"
    assert (
        lines[4]
        == r"\text{subject to}\quad & y_2 + \kappa^{2} \geq z \tag*{\(\text{E.a charge}\)} \\"
    )
    assert lines[6].startswith(r" & \qquad + 9\,\Delta + 10\,\Delta")
    assert lines[8] == (
        r" & \qquad + 23\,\Delta + 24\,\Delta \leq 10^{9}"
        r" \tag*{\(\text{E.b a long one }\text{\&}\text{ 100 }\%\text{ }\Delta\)} \\"
    )
    assert lines[-1] == (
        r" & \omega = 3 \text{ values, } 0.25 \text{ to } 0.75"
        r" \tag*{\(\mathtt{battery.available\_fraction}\)}"
    )


@pytest.mark.parametrize("perspective", ["battery", "adjusted", "available"])
@pytest.mark.parametrize("problem", ["P1", "P4"])
def test_latex_of_the_paper_is_fit_for_a_page(problem: str, perspective: str) -> None:
    """Only ASCII, so that every TeX compiles it, brackets closed on each line, no endless line."""
    building = "b1" if problem == "P4" else None
    page = optuav.formulate(
        "paper", problem_of(problem, building=building), perspective=perspective
    ).to_latex()
    assert page.isascii()
    for line in page.splitlines():
        assert line.count(r"\left") == line.count(r"\right")
        assert line.count("{") == line.count("}")
        assert len(re.sub(r"\\[A-Za-z]+|[{}_^ ]", "", line.split(r"\tag")[0])) < 56


@pytest.mark.parametrize(
    ("unit", "expected"),
    [("m/s²", "m/s^2"), ("s⁻¹", "s^{-1}"), ("°C", r"^\circ C"), ("µs", r"\mu s"), ("A s", r"A\,s")],
)
def test_signs_of_units_are_known_to_every_tex(unit: str, expected: str) -> None:
    """Where TeX has no such character it stops, or leaves it out."""
    assert Latex().unit(unit) == rf"\,\mathrm{{{expected}}}"


def test_marks_among_words_are_mathematics() -> None:
    """MathJax shows a backslash before what is escaped inside of a text."""
    expected = r"\mathtt{limits.deadline\_s}\text{ of 5 }\%\text{ }\to\text{ }\ldots"
    assert Latex().words("limits.deadline_s of 5 % → …") == expected

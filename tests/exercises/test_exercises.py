"""Graders take right answers, refuse wrong ones with a hint, and never print the answer."""

from __future__ import annotations

import copy
import itertools
import numbers
import re
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import optuav
from optuav import exercises
from optuav.exercises import course
from optuav.exercises.exercise import programme
from optuav.exercises.prove import prove
from optuav.judge import Stop
from optuav.modelling import Model
from tests.exercises.worked import editions, sections, worked

STUDENTS = ("", "ada", "s1234567")
NUMBERS = exercises.numbers()
KINDS = {number: exercises.task(number).kind for number in NUMBERS}
FIGURE = re.compile(r"(?<![\w.])\d+(?:\.\d+)?")


def refused(number: str, answer: object) -> str:
    """What is said of an answer that cannot be graded."""
    grade = exercises.check(number, answer)
    assert (grade.verdict, grade.hint, grade.score) == ("not correct", "", 0.0)
    return grade.words


def test_every_exercise_stands_in_its_lesson_once() -> None:
    found = [
        (name.split("_")[0], check[2])
        for name, cells in sections().items()
        for source in cells
        if (check := editions().CHECK.search(source)) is not None
    ]
    assert sorted(number for _, number in found) == sorted(NUMBERS)
    assert all(number.startswith(f"{lesson}.") for lesson, number in found)
    assert {*KINDS.values()} == {"predict", "declare", "prove", "design"}


@pytest.mark.parametrize("student", STUDENTS)
@pytest.mark.parametrize("number", NUMBERS)
def test_the_worked_solution_is_correct(number: str, student: str) -> None:
    grade = exercises.check(number, worked(number, student), student)
    assert grade, grade
    assert grade.score > 0.9
    assert not grade.hint


@pytest.mark.soak
def test_worked_solutions_are_correct_for_a_whole_school() -> None:
    """Rounding of any of the numbers turns no right answer into a wrong one."""
    for student in map(str, range(20)):
        grades = [exercises.check(each, worked(each, student), student) for each in NUMBERS]
        assert [str(grade) for grade in grades if not grade] == []


@pytest.mark.parametrize("number", NUMBERS)
def test_a_copied_answer_fails(number: str) -> None:
    """With the numbers of four of five others at least."""
    answer = worked(number, "ada")
    others = ("grace", "emmy", "kurt", "alan", "sofia")
    assert sum(not exercises.check(number, answer, each) for each in others) >= 4


@pytest.mark.parametrize("number", [each for each in NUMBERS if KINDS[each] == "predict"])
def test_hints_do_not_print_the_answer(number: str) -> None:
    """No figure in them is near it, whether the answer is off by a little, a unit or a sign."""
    truth = worked(number)
    word, truth = truth if isinstance(truth, tuple) else (None, truth)
    function = course._exercises()[number].grade.args[0]  # type: ignore[attr-defined]
    usual = [x for x, _ in function(exercises.task(number)) if not isinstance(x, str)][1:]
    for wrong in (1.3 * truth, 0.7 * truth, truth / 60, 1000 * truth, -truth, *usual):
        grade = exercises.check(number, (word, wrong) if word else wrong)
        assert not grade, (wrong, truth)
        assert grade.words
        assert grade.hint
        said = [float(each) for each in FIGURE.findall(f"{grade.words} {grade.hint}")]
        assert all(abs(each - truth) > 0.002 * abs(truth) for each in said), grade


@pytest.mark.parametrize("number", [each for each in NUMBERS if KINDS[each] == "predict"])
def test_a_hint_is_no_formula(number: str) -> None:
    """What is said to any wrong answer has neither an equation nor a product of symbols."""
    function = course._exercises()[number].grade.args[0]  # type: ignore[attr-defined]
    said = [(answer, words) for answer, words in function(exercises.task(number))]
    first = said[: 2 if isinstance(said[0][0], str) else 1]
    formula = re.compile(r"[=²√]|\(1 − |1\.96 standard|over \d")
    assert [words for _, words in first if formula.search(words)] == []


@pytest.mark.parametrize("number", [each for each in NUMBERS if KINDS[each] == "predict"])
def test_of_twenty_copied_predictions_nineteen_fail(number: str) -> None:
    """True answers of a hundred students, each compared with those of all others."""
    grade = course._exercises()[number].grade
    function, _, within, among = grade.args  # type: ignore[attr-defined]
    truths = list[tuple[Any, ...]]()
    for student in range(100):
        found = (answer for answer, _ in function(exercises.task(number, f"s{student}")))
        truths.append((next(found) if among else "", next(found)))
    pairs = [*itertools.permutations(truths, 2)]
    alike = sum(a[0] == b[0] and abs(a[1] - b[1]) <= within for a, b in pairs)
    assert alike <= 0.05 * len(pairs)


def test_a_rounded_figure_is_said_to_be_close() -> None:
    """The method is right, and no hint says otherwise."""
    near = exercises.check("17.1", round(worked("17.1")))
    assert (near.words, near.hint) == (
        "close, but not within 0.1 s",
        "keep more digits until the end",
    )


def test_a_count_is_right_or_wrong() -> None:
    """A quotient that was not rounded up is no count."""
    count = worked("23.1")
    right = exercises.check("23.1", count)
    assert (bool(right), right.words) == (True, "")
    assert not exercises.check("23.1", count - 0.04)


@pytest.mark.parametrize("number", ["26.2", "26.3"])
def test_mistakes_with_several_lasers_are_mistakes(number: str) -> None:
    """One laser is never enough, and greed never right, whatever the numbers of a student."""
    exercise = course._exercises()[number]
    for seed in range(100):
        task = exercises.task(number, str(seed))
        figures = [figure for figure, _ in exercise.grade.args[0](task)]  # type: ignore[attr-defined]
        assert all(abs(each - figures[0]) > 1.0 for each in figures[1:])


PAIRS = [number for number in NUMBERS if isinstance(worked(number), tuple)]
PAIRS = [number for number in PAIRS if KINDS[number] == "predict"]


@pytest.mark.parametrize("number", PAIRS)
def test_of_a_pair_the_word_and_the_figure_have_to_be_right(number: str) -> None:
    word, figure = worked(number)
    among = course._exercises()[number].grade.args[3]  # type: ignore[attr-defined]
    (other,) = {*among} - {word}
    assert exercises.check(number, [f" {word.upper()} ", figure])
    assert exercises.check(number, (other, figure)).words == "it is not this word"
    late = exercises.check(number, (word, 1.5 * figure + 5.0))
    assert (bool(late), late.words) == (False, "too large")
    for answer in (word, figure, (word,), (figure, word), ("perhaps", figure), (word, "ten")):
        assert "number [s]" in refused(number, answer)


def test_there_are_pairs() -> None:
    """A word alone would be right for every other student."""
    assert PAIRS == ["01.3", "04.2", "10.1", "10.3"]


def test_numbers_are_the_same_on_every_machine() -> None:
    """By SHA-256 of number, name and student, without blanks around it; Python salts its own."""
    drawn = [exercises.task("01.1", each)["limits.deadline_s"] for each in ("", "ada", " ada ")]
    assert drawn == [548.0, 598.0, 598.0]
    assert exercises.task("06.1", "grace")["battery.capacity_As"] == 40_800


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (548.0, "flight is part of the mission"),
        (688.8, "so long lasts the charge"),
        (472.21 / 60.0, "the unit is s"),
        (-472.21, "the sign is wrong"),
        (480.0, "too large"),
        (460.0, "too small"),
    ],
)
def test_a_usual_mistake_has_a_hint_of_its_own(wrong: float, words: str) -> None:
    grade = exercises.check("01.1", wrong)
    assert not grade
    assert words in str(grade).replace("\n  ", " ")


@pytest.mark.parametrize(
    "answer", [float("nan"), float("inf"), 10**400, True, None, "472", [472.0]]
)
def test_an_answer_that_is_no_figure_is_told_so(answer: object) -> None:
    assert re.match(r"the answer must be a finite number \[s\], not .", refused("01.1", answer))


class Hostile(numbers.Real):
    """A number, a mapping and a text whose every method raises an error without words."""

    class MuteError(Exception):
        """An error that cannot say what it is."""

        def __str__(self) -> str:
            raise RuntimeError

    def _raises(self, *_: object) -> Any:
        raise Hostile.MuteError

    __repr__ = __str__ = __float__ = __iter__ = __getitem__ = __len__ = keys = items = _raises
    locals().update(dict.fromkeys(numbers.Real.__abstractmethods__, _raises))


class Leaving(optuav.Formulation):
    """Code that would end the grader."""

    def declare(self, model: Model, given: Any) -> None:
        raise SystemExit(3)


class Ending:
    """An answer that ends the program where anybody looks at it."""

    class OwnError(BaseException):
        """None of the errors that a program expects."""

        def __str__(self) -> str:
            raise SystemExit

    def _ends(self, *_: object) -> Any:
        raise SystemExit("bye")

    def __float__(self) -> float:
        raise Ending.OwnError

    __repr__ = __str__ = _ends


def nested(levels: int, kind: type = list) -> Any:
    """Lists or tuples in each other."""
    found: Any = 1.0
    for _ in range(levels):
        found = kind([found])
    return found


HOSTILE = {
    "huge": 10**5000,
    "huge fraction": Fraction(10**5000, 3),
    "lists": nested(100_000),
    "tuples": nested(100_000, tuple),
    "object": Hostile(),
    "objects": [Hostile(), (Hostile(), "rest", Hostile())],
    "mapping": {"charge": nested(100_000), "\ud800": 1, 10**5000: Hostile()},
    "surrogates": ("\ud800", "\ud800", 10**5000),
    "model": Model("\ud800"),
    "leaving": Leaving,
    "ending": Ending(),
    "array of objects": np.array([Ending()], dtype=object),
    "array of one object": np.array(Ending(), dtype=object),
    "list of ends": [Ending()],
    "ends by name": {"hover_time_s": np.array([Ending()], dtype=object), "x": Ending()},
}


@pytest.mark.parametrize("answer", HOSTILE.values(), ids=HOSTILE)
@pytest.mark.parametrize("number", ["01.1", "01.2", "05.2", "08.2", "11.3", "11.4"])
def test_whatever_the_answer_there_is_a_grade(number: str, answer: object) -> None:
    """A grade that any file can hold, of every kind of exercise and for any name of a student."""
    grade = exercises.check(number, answer, student="\ud800")
    assert grade.verdict == "not correct"
    assert str(grade).encode()
    assert grade._repr_html_().encode()


@pytest.mark.parametrize(
    "number", [10**5000, nested(100_000), Hostile()], ids=["int", "list", "object"]
)
def test_whatever_the_number_of_an_exercise_it_is_refused(number: Any) -> None:
    with pytest.raises(optuav.InputError, match="no exercise has this number"):
        exercises.check(number, 1.0)


def test_only_an_answer_is_graded(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error of a grader that is no fault of the answer is not called a wrong answer."""

    def broken(task: exercises.Task, answer: object) -> exercises.Grade:
        raise ZeroDivisionError

    spoilt = replace(course._exercises()["01.1"], grade=broken)
    monkeypatch.setattr(course, "_exercises", lambda: {"01.1": spoilt})
    with pytest.raises(ZeroDivisionError):
        exercises.check("01.1", 3.0)
    assert exercises.check("01.1", ...).verdict == "no answer yet"


@pytest.mark.parametrize("number", [each for each in NUMBERS if KINDS[each] == "predict"])
def test_a_mistake_is_told_to_answers_near_it_alone(number: str) -> None:
    """Zero is far from any other number, however large the tolerance."""
    function = course._exercises()[number].grade.args[0]  # type: ignore[attr-defined]
    word = worked(number)[0] if number in PAIRS else None
    usual = dict(x for x in function(exercises.task(number)) if not isinstance(x[0], str))
    for figure in (0.0, 1e-9):
        grade = exercises.check(number, (word, figure) if word else figure)
        assert grade.words != "a common mistake" or (figure == 0.0 and 0.0 in usual)


def test_what_is_asked_must_exist() -> None:
    """All faults at once, with the numbers that there are and the nearest."""
    with pytest.raises(optuav.InputError) as caught:
        exercises.check("1.1", 1.0, student=7)  # type: ignore[arg-type]
    assert [fault.key for fault in caught.value.faults] == ["number", "student"]
    assert ", ".join(NUMBERS) in str(caught.value)
    known = r"the numbers of exercise 02\.2 are mass_kg, .*did you mean 'mass_kg'"
    with pytest.raises(optuav.InputError, match=known):
        exercises.task("02.2")["mass"]


@pytest.mark.parametrize(
    ("number", "meant"), [(7.1, "07.1"), ("1.1", "01.1"), ("7.3", "07.3"), (11.3, "11.3")]
)
def test_a_number_without_its_zero_is_told_the_right_one(number: Any, meant: str) -> None:
    for ask in (exercises.task, lambda given: exercises.check(given, 1.0)):
        with pytest.raises(optuav.InputError, match=f"did you mean '{re.escape(meant)}'"):
            ask(number)


@pytest.mark.parametrize("answer", [np.array(472.21), Decimal("472.21"), np.float32(472.21)])
def test_a_figure_may_be_of_any_type_of_numbers(answer: object) -> None:
    assert exercises.check("01.1", answer)


@pytest.mark.parametrize("answer", [Decimal("NaN"), Decimal("1e999999"), np.array(True)])
def test_a_decimal_or_an_array_that_is_no_figure_is_told_so(answer: object) -> None:
    assert "a finite number [s]" in refused("01.1", answer)


def test_a_name_is_one_name_however_its_accents_are_encoded() -> None:
    composed, combined = "Ren\u00e9", "Rene\u0301"
    for number in ("01.1", "02.1", "05.1"):
        assert exercises.task(number, composed).numbers == exercises.task(number, combined).numbers


def truth_of(task: exercises.Task) -> Any:
    """The answer that the grader of a prediction takes."""
    return next(course._exercises()[task.number].grade.args[0](task))[0]  # type: ignore[attr-defined]


def test_another_unit_is_suspected_only_where_it_is_one() -> None:
    """Not where the answer is 0 (16.2 may be so small), nor of minutes in a speed."""
    numbers = {"first_s": 10.0, "second_s": 10.0, "direct_s": 20.0}
    level = replace(exercises.task("18.1"), numbers=numbers)
    grade = course._exercises()["18.1"].grade(level, 40.0)
    assert (bool(grade), grade.words) == (False, "too large")
    fast = replace(exercises.task("21.2"), numbers={"distance_m": 400, "rate": 9.0})
    assert course._exercises()["21.2"].grade(fast, 60.0)
    assert course._exercises()["21.2"].grade(fast, 1.0).words == "too small"


@pytest.mark.parametrize("student", STUDENTS)
def test_the_price_of_a_current_is_that_of_a_small_step(student: str) -> None:
    """The hover times the current is a charge, so Δ = Δ₀ / (1 + p (I − I₀)): a small step of it."""
    task = exercises.task("08.3", student)
    for step_A in (1e-6, 1e-3):
        after_s = task["hover_s"] / (1.0 + task["price"] * step_A)
        assert exercises.check("08.3", (after_s - task["hover_s"]) / step_A, student)
    assert exercises.check("08.3", -task["price"] * task["hover_s"], student)


def test_what_flows_in_a_rest_is_less_than_the_largest_flow() -> None:
    """Of any numbers that may be drawn, 2 to 3.24 A come from the bound well of `paper`."""
    drawn = course._exercises()["18.2"].draws
    flows_A = np.divide.outer(np.array(drawn["rise_As"]), np.array(drawn["rest_s"])) - 10.0
    assert flows_A.min() > 2.0
    assert flows_A.max() < 3.24


def test_slices_of_samples_explain_what_all_orders_explain_on_average() -> None:
    """Of six samples in three slices, over all 720 orders."""
    orders = np.array([*itertools.permutations([1.0, 2.0, 4.0, 7.0, 11.0, 16.0])])
    explained = orders.reshape(-1, 3, 2).mean(axis=2).var(axis=1) / orders.var(axis=1)
    task = replace(exercises.task("23.2"), numbers={"samples": 6, "slices": 3})
    assert truth_of(task) == pytest.approx(100.0 * explained.mean())


@pytest.mark.parametrize("student", STUDENTS)
def test_one_sample_less_makes_no_mistake(student: str) -> None:
    task = exercises.task("23.2", student)
    assert exercises.check("23.2", 100 * (task["slices"] - 1) / task["samples"], student)
    assert not exercises.check("23.2", 100 * task["slices"] / task["samples"], student)


def test_what_a_mistake_says_is_said_of_it() -> None:
    """The price alone over the hover is a mistake of 2e-5 in 20.1, whose tolerance is 2e-3."""
    task = exercises.task("20.1")
    mistake = task["price"] / task["hover_s"]
    assert exercises.check("20.1", mistake).hint == "the number itself counts as well"
    assert exercises.check("20.1", 0.001).words == "too small"


@pytest.mark.parametrize(
    ("number", "name", "value"),
    [
        ("03.1", "available_fraction", 0.5),
        ("22.1", "link.transmit_power_W", 5.0),
        ("25.2", "at_m", 200),
    ],
)
def test_no_number_makes_a_usual_mistake_right(number: str, name: str, value: float) -> None:
    """Wells that are alike, the power of `paper`, and the middle of the way."""
    assert value not in course._exercises()[number].draws[name]


def test_no_answer_yet() -> None:
    grade = exercises.check("05.1", ...)
    assert (bool(grade), grade.verdict, grade.score) == (False, "no answer yet", 0.0)


# Declarations


def longest(
    task: Any,
    *,
    hover_A: float = 0.0,
    deadline: bool = True,
    minimise: bool = False,
    lower_s: float = 0.0,
    most_rest_s: float | None = None,
) -> Model:
    """An answer to 05.1, right or wrong."""
    model = Model("longest hover")
    hover = model.variable("hover_time_s", "Δ", unit="s", lower=lower_s)
    rest = model.variable("rest_time_s", "T'", unit="s", lower=lower_s)
    if most_rest_s is not None:
        model.subject_to("longest rest of mine", rest <= most_rest_s)
    (model.minimise if minimise else model.maximise)(hover)
    drawn_As = (task["hover_A"] + hover_A) * hover - task["rest_A"] * rest
    model.subject_to("charge of mine", drawn_As <= task["usable_As"])
    if deadline:
        model.subject_to("deadline of mine", hover + rest <= task["left_s"])
    return model


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"hover_A": 1.0}, "is feasible, but your problem excludes it Hint: it violates your "),
        ({"hover_A": -1.0}, "which is not feasible Hint: put these values into each sentence"),
        ({"deadline": False}, "which is not feasible Hint: put these values into each sentence"),
        ({"minimise": True}, "the optimum is another; yours is (hover_time_s = 0"),
    ],
)
def test_a_wrong_declaration_is_told_where_it_differs(options: dict[str, Any], words: str) -> None:
    grade = exercises.check("05.1", longest(exercises.task("05.1"), **options))
    assert not grade
    assert words in " ".join(str(grade).split())


@pytest.mark.parametrize("student", STUDENTS)
@pytest.mark.parametrize("most_rest_s", [130.0, 300.0, 700.0])
def test_a_limit_that_the_optimum_does_not_show_is_found(most_rest_s: float, student: str) -> None:
    """The best rest is shorter; rests up to the deadline are feasible all the same."""
    model = longest(exercises.task("05.1", student), most_rest_s=most_rest_s)
    grade = exercises.check("05.1", model, student)
    assert not grade
    assert grade.words.startswith("(hover_time_s = 0, rest_time_s = ")
    assert grade.hint == "it violates your constraint 'longest rest of mine'"


def test_a_declaration_without_any_feasible_point_excludes_one() -> None:
    model = longest(exercises.task("05.1"), most_rest_s=-1.0)
    assert "is feasible, but your problem excludes it" in exercises.check("05.1", model).words


def test_a_limit_that_changes_nothing_is_right() -> None:
    assert exercises.check("05.1", longest(exercises.task("05.1"), most_rest_s=1e4))


@pytest.mark.parametrize("lower_s", [-1000.0, -1.0])
def test_times_below_zero_are_found(lower_s: float) -> None:
    grade = exercises.check("05.1", longest(exercises.task("05.1"), lower_s=lower_s))
    assert grade.words.startswith(f"your problem allows (hover_time_s = {lower_s:g}, ")


@pytest.mark.parametrize(("scale", "rest", "right"), [(2, 0.0, True), (1, 1.0, False)])
def test_a_dual_is_more_than_its_best_weights(scale: float, rest: float, right: bool) -> None:
    """Twice the objective prefers the same; without the longest rest it bounds no hover."""
    model = copy.copy(worked("08.1"))
    _, _, price = model.variables
    bounded = scale * model.objective - rest * exercises.task("08.1")["most_s"] * price
    model.sense, model.towards, model.objective = "minimise", -1.0, bounded
    grade = exercises.check("08.1", model)
    assert bool(grade) == right
    assert right or grade.words.endswith("but the objective is another")


def test_charge_binds_for_every_student() -> None:
    """In the numbers of the task and at all that may be drawn: charge ends before the deadline."""
    drawn = course._exercises()["05.1"].draws
    assert max(drawn["usable_As"]) / min(drawn["hover_A"]) < min(drawn["left_s"])  # type: ignore[operator, type-var]


def test_a_declaration_has_the_unknowns_of_the_task() -> None:
    model = Model("another")
    model.maximise(model.variable("x", "x", unit="s", upper=1.0))
    words = "the answer must be a problem with the unknowns hover_time_s, rest_time_s, not "
    assert refused("05.1", model) == f"{words}x"
    assert refused("05.1", Model("empty")) == f"{words}one without any"
    assert "a Model of optuav.modelling" in refused("05.1", optuav.P3())


def test_a_formulation_may_be_a_class_or_an_object() -> None:
    """P4 as it is keeps no time in reserve; the point at which that matters is named."""
    grade = exercises.check("05.2", optuav.P4("b1"))
    assert not grade
    assert grade.words.startswith("your problem allows (hover_time_s = ")
    assert "deadline" not in str(grade)  # That row is what is asked for
    assert "takes any building and order" in refused("05.2", optuav.P1())
    assert "an object of an" in refused("05.2", optuav.P4)

    class Reserve(optuav.Formulation):
        """Longest hover with a reserve of time."""

        def declare(self, model: Model, given: Any) -> None:
            hover, rest = given.hover_and_rest(model)
            model.maximise(2.0 * hover)
            model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
            left = given.time_left - exercises.task("05.2")["margin_s"]
            model.subject_to("time", hover + rest <= left)

    assert exercises.check("05.2", Reserve)
    assert exercises.check("05.2", Reserve(building="b3"))

    class NoRest(optuav.Formulation):
        """Longest hover that forgets the rest."""

        def declare(self, model: Model, given: Any) -> None:
            hover = model.variable("hover_time_s", "Δ", unit="s", upper=100.0)
            model.maximise(hover)

    assert "the unknowns hover_time_s, rest_time_s, not " in refused("05.2", NoRest)


class Mistyped(optuav.Formulation):
    """Longest hover, with a name that is none."""

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        model.subject_to("time", hover + rest <= given.time_lef)


class Misspelt(optuav.Formulation):
    """Longest hover, with a variable that is none."""

    def declare(self, model: Model, given: Any) -> None:
        model.maximise(given.hover_and_rest(modell)[0])  # type: ignore[name-defined] # noqa: F821


class Compared(optuav.Formulation):
    """A number for a constraint: the error is raised by the library, in a line of this class."""

    def declare(self, model: Model, given: Any) -> None:
        model.subject_to("time", 3.0)  # type: ignore[arg-type]


class Unwritten(optuav.Formulation):
    """Nothing is declared."""


class Aimless(optuav.Formulation):
    """No objective."""

    def declare(self, model: Model, given: Any) -> None:
        given.hover_and_rest(model)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (
            Mistyped,
            r"AttributeError in line \d+ of your code, 'model\..* <= given\.time_lef\)': .*",
        ),
        (Mistyped(), r".*given has no 'time_lef'; did you mean 'time_left'\? .*"),
        (Misspelt, r"NameError in line \d+ of .* not defined; did you mean 'model'\?"),
        (Compared, r"TypeError in line \d+ of your code, 'model\.subject_to.*: a constraint .*"),
        (Unwritten, r"TypeError: Can't instantiate abstract class Unwritten .*"),
        (Aimless, r"not an answer: Aimless: no objective was stated; .*"),
    ],
)
def test_where_the_code_of_a_formulation_stops(answer: object, words: str) -> None:
    assert re.fullmatch(words, refused("05.2", answer))


def direct_or_not(task: Any, *, more_As: float, binary: bool = True) -> Model:
    """An answer to 11.3, right with 1000 A s more on the direct route."""
    model = Model("longest hover, direct or by way of a building")
    hover = model.variable("hover_time_s", "Δ", unit="s")
    rest = model.variable("rest_time_s", "T'", unit="s")
    by_way = model.variable(
        "by_way", "λ", unit="1", **({"binary": True} if binary else {"upper": 1.0})
    )
    model.maximise(hover)
    limit_As = task["usable_As"] + more_As * (1 - by_way)
    model.subject_to("charge", task["hover_A"] * hover - task["rest_A"] * rest <= limit_As)
    model.subject_to("deadline", hover + rest <= task["left_s"] + 20 * (1 - by_way))
    model.subject_to("rest", rest <= 2000 * by_way)
    return model


def test_points_of_a_choice_have_both_values() -> None:
    """The direct route is compared too, although all of its points have no rest."""
    task = exercises.task("11.3")
    assert exercises.check("11.3", direct_or_not(task, more_As=1000.0))
    grade = exercises.check("11.3", direct_or_not(task, more_As=0.0))
    assert "rest_time_s = 0, by_way = 0) is feasible, but your problem excludes it" in grade.words


def test_a_choice_that_is_not_binary_is_told_so() -> None:
    """The values 0 and 1 of the unknown agree; those between them are the mistake."""
    model = direct_or_not(exercises.task("11.3"), more_As=1000.0, binary=False)
    assert exercises.check("11.3", model).words == "by_way is not binary in your problem"


# Proofs


def test_each_condition_of_a_proof_is_named() -> None:
    task = exercises.task("07.2")
    charge = Fraction(1, task["hover_A"] + task["rest_A"])
    right = {"charge": charge, "deadline": task["rest_A"] * charge}
    assert exercises.check("07.2", right)
    assert exercises.check("07.2", {name: float(each) for name, each in right.items()})
    negative = exercises.check("07.2", {**right, "deadline": -right["deadline"]})
    assert negative.words.startswith("sign: the multiplier of 'deadline'")
    short = exercises.check("07.2", {"charge": charge})
    assert short.words.startswith("stationarity: the rows add up to")
    # Without the charge, the deadline alone bounds Δ, with the bound of T': valid, but too high.
    weak = exercises.check("07.2", {"deadline": 1, "bounds of T'": 1})
    assert weak.words.startswith("gap: ")


def test_a_point_and_its_multipliers_are_checked_together() -> None:
    """The point that lacks hover is feasible, and one more second of rest is not."""
    task, right = exercises.task("08.2"), worked("08.2")
    (used,) = {"deadline", "longest rest"} & right.keys()
    short = exercises.check("08.2", {**right, "hover_time_s": right["hover_time_s"] - 1})
    assert short.words.startswith("complementary slackness: 'charge' has slack")
    late = {**right, "rest_time_s": right["rest_time_s"] + 1}
    late["hover_time_s"] += Fraction(task["rest_A"], task["hover_A"])
    assert exercises.check("08.2", late).words == f"feasibility: the point violates {used!r}"
    assert refused("08.2", {"hover_time_s": 1.0}) == "not an answer: rest_time_s: is missing"


def test_a_proof_needs_numbers_by_known_names() -> None:
    wrong = {"charge": float("nan"), "deadline": "1/98", "time": 1.0, "bounds of Δ": True}
    words = refused("07.2", wrong)
    assert re.findall(r"([^;:]+) = ", words) == [f" {name}" for name in wrong]
    assert "charge, deadline, bounds of Δ, bounds of T'" in words
    assert "numbers by name" in refused("07.2", [1.0, 2.0])


def test_rounded_multipliers_are_told_what_is_exact() -> None:
    right = worked("07.2")
    rounded = exercises.check("07.2", {name: round(float(x), 5) for name, x in right.items()})
    assert rounded.hint.endswith("; whole numbers and Fractions are exact, rounded numbers are not")
    assert "exact" not in exercises.check("07.2", {"deadline": 3}).hint


def test_a_conflict_is_proved_by_a_false_sum() -> None:
    """Δ ≥ 5 by its negative, and Δ ≤ 4: only their plain sum reads 0 ≤ −1."""

    @prove("00.1", "Prove that there is no hover.", what="conflict")
    def none(task: exercises.Task) -> Model:
        goal = {"hover_time_s": ("Δ", "s", 1.0)}
        rows = {"least": ({"hover_time_s": -1.0}, -5.0), "most": ({"hover_time_s": 1.0}, 4.0)}
        return programme("none", goal, rows)

    task = none.task("")
    assert none.grade(task, {"least": 2, "most": 2})
    unbalanced = none.grade(task, {"least": 1})
    assert unbalanced.words == "stationarity: the rows add up to −1 · Δ"
    assert unbalanced.hint == "a contradiction needs 0 · Δ"
    assert none.grade(task, {"most": 1, "bounds of Δ": 1}).words.startswith("the sum is true")
    assert none.grade(task, {}).words.startswith("the sum is true")


# Designs


def test_an_itinerary_is_scored_or_told_what_it_breaks() -> None:
    task = exercises.task("04.3")
    best = optuav.solve(task.mission)
    assert exercises.check("04.3", best).score == pytest.approx(1.0)
    dry = exercises.check("04.3", [("hover", "hover", best.hover_time_s + 50.0)])
    assert "it cannot be flown: at" in dry.words
    short = exercises.check("04.3", [Stop("hover", "hover", 0.5 * best.hover_time_s)])
    assert (bool(short), round(short.score, 6)) == (False, 0.5)
    assert "hovers for 50.0 % of the longest time" in short.words
    elsewhere = exercises.check("04.3", optuav.solve("paper"))
    assert elsewhere.words == "it flies another mission"


def test_two_rests_are_no_answer_where_one_is_asked_for() -> None:
    """Two rests hover longer than the best with one, and need another exercise."""
    task = exercises.task("04.3")
    best = optuav.solve(task.mission, optuav.P1(stops=2))
    grade = exercises.check("04.3", best)
    assert (bool(grade), grade.words) == (False, "it can be flown, but has 2 rests")
    assert grade.hint == "at most 1 is asked for"
    assert "no solver" in task.text


@pytest.mark.parametrize("answer", [3.0, "hover", [("hover", 10.0)], [("roof", "hover", 1.0)]])
def test_an_itinerary_has_stops(answer: object) -> None:
    assert re.match("the answer must be|not an answer: (answer|stops)", refused("04.3", answer))


@pytest.mark.parametrize("number", ["01.1", "05.1", "07.2", "04.3"])
def test_notebooks_show_tasks_and_grades(number: str) -> None:
    """As well-formed HTML, with any name of a student."""
    student = "<script>alert(1)</script>"
    shown = exercises.task(number, student)._repr_html_()
    page = exercises.check(number, worked(number), student)._repr_html_()
    for each in (shown, page):
        assert "<script" not in each
        assert "`" not in each
        ElementTree.fromstring(each.replace("<br>", "<br/>"))


def test_the_stops_of_a_plan_are_an_itinerary() -> None:
    """As a student takes them to see what the best would be; the audit reads them as well."""
    task = exercises.task("04.3", "ada")
    plan = optuav.solve(task.mission)
    assert exercises.check("04.3", plan.stops, "ada")
    assert optuav.audit(optuav.Itinerary(task.mission, plan.stops))  # type: ignore[arg-type]


def test_a_model_without_an_objective_is_told_so() -> None:
    model = Model("All that is feasible")
    hover, rest = (model.variable(f"{each}_time_s", each, unit="s") for each in ("hover", "rest"))
    model.subject_to("charge", 82.0 * hover - 9.0 * rest <= 41_000.0)
    model.subject_to("deadline", hover + rest <= 1100.0)
    grade = exercises.check("05.1", model)
    assert (bool(grade), grade.words) == (False, "your problem has no objective")

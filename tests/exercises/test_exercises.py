"""Graders take right answers, refuse wrong ones with a hint, and never print the answer."""

from __future__ import annotations

import copy
import numbers
import re
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from hashlib import sha256
from itertools import islice
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import optuav
from optuav import exercises
from optuav.exercises import course
from optuav.exercises.linear import linear
from optuav.exercises.prove import contradiction
from optuav.judge import Stop
from optuav.modelling import Model, check, evaluate
from tests.exercises.worked import editions, script, sections, worked

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
    assert {*KINDS.values()} == {"predict", "declare", "design", "prove", "explain-why"}


def test_few_exercises_are_predictions() -> None:
    """A third at most, and every lesson of theory has another."""
    predicted = [number for number in NUMBERS if KINDS[number] == "predict"]
    assert 3 * len(predicted) <= len(NUMBERS)
    others = {number.partition(".")[0] for number in NUMBERS} - {"02"}
    assert others == {n.partition(".")[0] for n in NUMBERS if KINDS[n] != "predict"}


@pytest.mark.parametrize("number", NUMBERS)
def test_the_worked_solution_is_correct(number: str) -> None:
    """With a name; `worked` asserts the same of any student, and other tests use no name."""
    grade = exercises.check(number, worked(number, "ada"), "ada")
    assert grade, grade
    assert grade.score > 0.9
    assert not grade.hint


@pytest.mark.parametrize("number", NUMBERS)
def test_a_key_reads_as_an_answer(number: str) -> None:
    """Without the address of an object; the worked solutions above are the keys of the script."""
    key = script("make_keys").shown(worked(number, "ada"))
    assert key
    assert "object at" not in key


@pytest.mark.soak
def test_worked_solutions_are_correct_for_a_whole_school() -> None:
    """Rounding of any of the numbers turns no right answer into a wrong one."""
    for student in map(str, range(20)):
        grades = [exercises.check(each, worked(each, student), student) for each in NUMBERS]
        assert [str(grade) for grade in grades if not grade] == []


@pytest.mark.parametrize("number", NUMBERS)
def test_a_copied_answer_fails(number: str) -> None:
    """With the numbers of two of three others at least; most fail before the third is asked."""
    answer = worked(number, "ada")
    failed = (
        name for name in ("grace", "emmy", "kurt") if not exercises.check(number, answer, name)
    )
    assert len([*islice(failed, 2)]) == 2


def exercise(number: str) -> Any:
    """The exercise as the bank declares it."""
    return course._exercises()[number]


EXPLAIN = [number for number in NUMBERS if KINDS[number] == "explain-why"]
PREDICT = [number for number in NUMBERS if KINDS[number] == "predict"]


@pytest.mark.parametrize("number", EXPLAIN)
def test_a_reason_and_its_witness_have_to_be_right(number: str) -> None:
    """Every other reason has a hint of its own; a letter alone is no answer."""
    right, witness = worked(number)
    task = exercises.task(number)
    assert exercises.check(number, [f" ({right.upper()}) ", witness])
    hints = set()
    for letter in task.reasons:
        if letter != right:
            grade = exercises.check(number, (letter, witness))
            assert grade.words == "the witness is right, but the reason does not hold"
            hints.add(grade.hint)
    assert "" not in hints
    assert len(hints) == len(task.reasons) - 1 >= 2
    for answer in (right, witness, (right,), (witness, right), ("z", witness), [right, witness, 1]):
        assert "the letter of a reason" in refused(number, answer)
    assert "the answer must be" in refused(number, (right, None))


def test_the_length_of_a_reason_tells_nothing() -> None:
    """Over the bank, the right one is as often the longest as in the middle or the shortest."""
    ranks = []
    for number in EXPLAIN:
        lengths = {reason: len(reason) for reason in exercise(number).reasons}
        assert max(lengths.values()) <= 1.15 * min(lengths.values()), number
        (right,) = (reason for reason, hint in exercise(number).reasons.items() if not hint)
        assert len(lengths) == 3
        ranks.append(sum(length > lengths[right] for length in lengths.values()))
    shares = [ranks.count(rank) / len(ranks) for rank in range(3)]
    assert all(0.2 <= share <= 0.4 for share in shares), shares
    assert shares[0] <= 1 / 3


@pytest.mark.parametrize("number", ["01.2", "11.1", "33.1"])
def test_letters_cannot_be_tested_without_a_witness(number: str) -> None:
    """A wrong witness is told the same with every letter."""
    witness, _ = WITNESSES[number][0]
    letters = exercises.task(number).reasons
    assert len({str(exercises.check(number, (letter, witness))) for letter in letters}) == 1


@pytest.mark.parametrize("number", EXPLAIN)
def test_the_right_letter_differs_from_student_to_student(number: str) -> None:
    right = [reason for reason, hint in exercise(number).reasons.items() if not hint]
    assert len(right) == 1
    letters = set()
    for student in range(30):
        reasons = exercises.task(number, str(student)).reasons
        letters |= {letter for letter, reason in reasons.items() if reason == right[0]}
    assert letters == set(exercises.task(number).reasons)


WITNESSES: dict[str, list[tuple[Any, str]]] = {
    "01.2": [(0.0, "0 A s is too small"), (20_000.0, "20000 A s is too large")],
    "03.1": [(400.0, "%, too little"), (0.1, "%, too much")],
    "04.1": [(0.0, "A s, too much"), (500.0, "A s, too little")],
    "07.2": [([{"deadline": 1, "bounds of T'": 1}] * 2, "with the prices 1 and 1")],
    "09.1": [
        (60.0, "a slot of 60 s is not finer"),
        (20.0, "a slot of 20 s is too short"),
        (44.0, "slots of 44 s give 528 s of hover, not less than the 513 s before"),
    ],
    "10.1": [
        ({"short_s": 500.0, "long_s": 600.0}, "the hover halfway is 550 s"),
        ({"short_s": 300.0, "long_s": 732.5}, "the hover of 300 s cannot be flown"),
    ],
    "11.1": [
        ({"hover_time_s": 900, "by_way": 1}, "feasibility: the point violates 'first route'"),
        ({"hover_time_s": 0, "by_way": 0}, "the point is feasible, with a hover of 0 s"),
    ],
    "15.1": [
        (
            {"flies_s": 400.0, "fails_s": 300.0},
            "fails_s must be shorter than flies_s, by 1 s at most",
        ),
        ({"flies_s": 1.0, "fails_s": 0.5}, "1 s cannot be flown"),
        ({"flies_s": 400.0, "fails_s": 399.5}, "399.5 s can be flown as well"),
    ],
    "16.1": [(1.0, "the gain is ")],
    "19.1": [
        ({"capacity_As": 1.0, "available_fraction": 0.2}, "the capacity is not 30 % more"),
        ({"capacity_As": 1200.0, "available_fraction": 0.9}, "its lifetime is "),
    ],
    "20.1": [(0.0, "the loss is 0 %, too little"), (40.0, "%, too much")],
    "21.1": [(1.0, "the additional time is "), (20.0, "the additional time is – %")],
    "22.1": [(0.05, "the received power is 0 W")],
    "24.1": [(900.0, "too large")],
    "26.1": [({"greedy_s": 0.0, "best_s": 0.0}, "the greedy pair: 0 s is too small")],
    "30.1": [(1400.0, "1400 m is beyond the middle"), (1.0, "the cost of the stop is ")],
    "31.1": [(0.0, "after a cycle the bound well is ")],
    "32.1": [(1.0, "too small"), (90_000.0, "too large")],
    "33.1": [
        ({"home_As": 72_000.0, "dry_As": 1.0}, "that is more than the whole charge"),
        ({"home_As": 9000.0, "dry_As": 9010.0}, "they are −10 A s apart"),
        ({"home_As": 20.0, "dry_As": 10.0}, "20 A s run dry on the way"),
    ],
    "A1.1": [(1400.0, "the hover by energy is ")],
}


@pytest.mark.parametrize(
    ("number", "witness", "words"),
    [(number, *case) for number, cases in WITNESSES.items() for case in cases],
)
def test_a_wrong_witness_is_told_what_it_breaks(number: str, witness: Any, words: str) -> None:
    grade = exercises.check(number, ("a", witness))
    assert not grade
    assert grade.words.startswith(words) or words in grade.words
    assert grade.hint


def test_every_witness_that_explains_has_a_wrong_one() -> None:
    assert {*WITNESSES} | {"18.1", "35.1"} == {*EXPLAIN}


def test_a_witness_may_be_rounded_too_far_or_in_another_unit() -> None:
    letter, left_As = worked("01.2")
    assert exercises.check("01.2", (letter, round(left_As)))
    rounded = exercises.check("01.2", (letter, round(0.993 * left_As)))
    assert rounded.words == "close, but not within 50 A s: it looks rounded"
    two_digits = exercises.check("01.2", (letter, float(f"{left_As:.2g}")))
    assert two_digits.words == rounded.words
    hours = exercises.check("01.2", (letter, left_As / 3600.0))
    assert hours.words == "off by ampere-hours for ampere-seconds"
    assert hours.hint == "the unit is A s"


@pytest.mark.parametrize(("number", "options"), [("01.1", {"problem": "P3"}), ("04.2", {})])
@pytest.mark.parametrize("student", STUDENTS)
def test_a_plan_of_the_solver_is_no_answer(number: str, options: Any, student: str) -> None:
    """Neither that of the student's mission nor the one that the lesson shows."""
    task = exercises.task(number, student)
    plan = optuav.solve(task.mission, **options)
    assert not exercises.check(number, plan, student)
    lesson = optuav.solve("paper", **options)
    assert not exercises.check(
        number, [(s.at, s.kind, s.duration_s) for s in lesson.stops], student
    )


MISTAKES = {
    "02.1": lambda task: (100.0 * task["less"] / (1.0 - task["less"]), 100.0 * task["less"]),
    "10.2": lambda task: (1052.96,),  # By audits
}
"""Figures of usual mistakes: charge over current, and the last of all hovers."""


@pytest.mark.parametrize("number", PREDICT)
def test_hints_do_not_print_the_answer(number: str) -> None:
    """No figure in them is near it, whether the answer is off by a little, a unit or a sign.

    The hint for any wrong answer has neither an equation nor a product of symbols.
    """
    truth, usual = worked(number), MISTAKES[number](exercises.task(number))
    for wrong in (1.3 * truth, 0.7 * truth, truth / 60, 1000 * truth, -truth, 0.0, 1e-9, *usual):
        grade = exercises.check(number, wrong)
        assert not grade, (wrong, truth)
        assert (grade.words == "a common mistake") == (wrong in usual)
        assert grade.hint
        assert not re.search(r"[=²√]|\(1 − |over \d", grade.hint)
        said = [float(each) for each in FIGURE.findall(f"{grade.words} {grade.hint}")]
        assert all(abs(each - truth) > 0.002 * abs(truth) for each in said), grade


def test_a_rounded_figure_is_said_to_be_close() -> None:
    """The method is right, and no hint says otherwise; another unit is named."""
    near = exercises.check("02.1", 0.992 * worked("02.1"))
    assert near.words == "close, but not within 0.05 %: it looks rounded"
    assert near.hint == "keep all digits until the end, and answer within 0.05 %"
    whole = exercises.check("02.1", round(worked("02.1", "ada")), "ada")
    assert abs(round(worked("02.1", "ada")) / worked("02.1", "ada") - 1.0) > 0.01
    assert whole.words == near.words
    minutes = exercises.check("10.2", worked("10.2") / 60.0)
    assert (minutes.words, minutes.hint) == ("off by minutes for seconds", "the unit is s")


def test_numbers_are_the_same_on_every_machine() -> None:
    """By SHA-256 of number, name and student, without blanks around it; Python salts its own."""
    drawn = [exercises.task("01.1", each)["battery.capacity_As"] for each in ("", "ada", " ada ")]
    digests = [
        sha256(f"01.1\nbattery.capacity_As\n{each}".encode()).digest() for each in ("", "ada")
    ]
    first, second = (30_000 + 40 * (int.from_bytes(each[:8], "big") % 301) for each in digests)
    assert drawn == [first, second, second]


def test_a_number_may_follow_from_those_before() -> None:
    """They stand in the task, and the model has them."""
    task = exercises.task("07.2", "ada")
    assert task["usable_As"] == task["hover_A"] * task["left_s"]
    assert str(task["usable_As"]) in str(task.model)


@pytest.mark.parametrize(
    "answer", [float("nan"), float("inf"), 10**400, True, None, "472", [472.0]]
)
def test_an_answer_that_is_no_figure_is_told_so(answer: object) -> None:
    """In the unit that the task states."""
    assert "\nAnswer in %: such as 10.0" in str(exercises.task("02.1"))
    assert re.match(r"the answer must be a finite number \[%\], not .", refused("02.1", answer))


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
@pytest.mark.parametrize(
    "number", ["01.1", "02.1", "03.2", "05.2", "08.2", "11.1", "11.2", "12.1", "15.1", "28.1"]
)
def test_whatever_the_answer_there_is_a_grade(number: str, answer: object) -> None:
    """A grade that any file can hold, of every kind of exercise and for any name of a student."""
    task = exercises.task(number, "\ud800")
    right = next(
        (key for key, each in task.reasons.items() if not exercise(number).reasons[each]), ""
    )
    given = (right, answer) if right else answer  # The witness is hostile, and its reason right
    grade = exercises.check(number, given, student="\ud800")
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

    def broken(task: exercises.Task, percent: float) -> Any:
        """How many percent?"""
        raise ZeroDivisionError

    spoilt = replace(exercise("02.1"), check=broken)
    monkeypatch.setattr(course, "_exercises", lambda: {"02.1": spoilt})
    with pytest.raises(ZeroDivisionError):
        exercises.check("02.1", 3.0)
    assert exercises.check("02.1", ...).verdict == "no answer yet"


def test_what_is_asked_must_exist() -> None:
    """All faults at once, with the numbers that there are and the nearest."""
    with pytest.raises(optuav.InputError) as caught:
        exercises.check("1.1", 1.0, student=7)  # type: ignore[arg-type]
    assert [fault.key for fault in caught.value.faults] == ["number", "student"]
    assert ", ".join(NUMBERS) in str(caught.value)
    known = r"the numbers of exercise 03\.1 are capacity_As, .*did you mean 'capacity_As'"
    with pytest.raises(optuav.InputError, match=known):
        exercises.task("03.1")["capacity_A"]


@pytest.mark.parametrize(
    ("number", "words"),
    [
        ("01.3", r"in lesson 01 there is now 01\.1 \(design\), 01\.2 \(explain-why\)$"),
        ("23.1", r"in lesson 23 there is now no exercise$"),
        ("12.4", r"there is now 12\.1 \(prove\); the lesson that was 12 is 11 now, with 11\.1 \("),
        ("A1.2", r"in lesson A1 there is now A1\.1 \(explain-why\)$"),
    ],
)
def test_the_number_of_an_exercise_that_went_says_what_is_there(number: str, words: str) -> None:
    with pytest.raises(optuav.InputError, match=f"no exercise has this number any more; .*{words}"):
        exercises.task(number)


@pytest.mark.parametrize(
    ("number", "meant"), [(7.1, "07.1"), ("1.1", "01.1"), ("7.2", "07.2"), (11.2, "11.2")]
)
def test_a_number_without_its_zero_is_told_the_right_one(number: Any, meant: str) -> None:
    for ask in (exercises.task, lambda given: exercises.check(given, 1.0)):
        with pytest.raises(optuav.InputError, match=f"did you mean '{re.escape(meant)}'"):
            ask(number)


@pytest.mark.parametrize("kind", [np.array, lambda x: Decimal(str(x)), np.float64])
def test_a_figure_may_be_of_any_type_of_numbers(kind: Any) -> None:
    assert exercises.check("02.1", kind(worked("02.1")))


@pytest.mark.parametrize("answer", [Decimal("NaN"), Decimal("1e999999"), np.array(True)])
def test_a_decimal_or_an_array_that_is_no_figure_is_told_so(answer: object) -> None:
    assert "a finite number [%]" in refused("02.1", answer)


@pytest.mark.parametrize(
    "student", ["", *(pytest.param(name, marks=pytest.mark.soak) for name in STUDENTS[1:])]
)
def test_the_example_of_a_task_can_be_graded_and_is_wrong(student: str) -> None:
    for number in NUMBERS:
        task, asked = exercises.task(number, student), exercise(number)
        if (example := asked.form.example) and "..." not in example:
            value = asked.form.read(task, eval(example, {"Fraction": Fraction}))
            assert not asked.grade(task, "", value), number


def test_a_figure_of_a_witness_has_a_range() -> None:
    letter, _ = worked("03.1")
    assert "a finite number [A] from 0.1 to 500" in refused("03.1", (letter, 0.05))
    letter, _ = worked("15.1")
    words = refused("15.1", (letter, {"flies_s": -1.0, "other": 2.0}))
    assert "flies_s = -1.0: must be a number from 0 to 2000" in words
    assert "fails_s: is missing; a number" in words
    assert "other = 2.0: the names are flies_s, fails_s" in words


def test_a_name_is_one_name_however_its_accents_are_encoded() -> None:
    composed, combined = "Ren\u00e9", "Rene\u0301"
    for number in ("01.1", "02.1", "05.1"):
        assert exercises.task(number, composed).numbers == exercises.task(number, combined).numbers


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
    model.subject_to("cool", 100.0 * rest >= task["cool_s"] * hover)
    drawn_As = (task["hover_A"] + hover_A) * hover - task["rest_A"] * rest
    model.subject_to("charge of mine", drawn_As <= task["usable_As"])
    if deadline:
        model.subject_to("deadline of mine", hover + rest <= task["left_s"])
    return model


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"hover_A": 1.0}, "is feasible, but your problem excludes it Hint it violates your "),
        ({"hover_A": -1.0}, "which is not feasible Hint put these values into each sentence"),
        ({"deadline": False}, "which is not feasible Hint put these values into each sentence"),
        ({"minimise": True}, "the optimum is wrong; yours is (hover_time_s = 0"),
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


@pytest.mark.parametrize(("lower_s", "words"), [(-1000.0, "−1000"), (-1.0, "−1")])
def test_times_below_zero_are_found(lower_s: float, words: str) -> None:
    grade = exercises.check("05.1", longest(exercises.task("05.1"), lower_s=lower_s))
    assert grade.words.startswith(f"your problem allows (hover_time_s = {words}, ")


@pytest.mark.parametrize(("scale", "rest", "right"), [(2, 0.0, True), (1, 1.0, False)])
def test_a_dual_is_more_than_its_best_weights(scale: float, rest: float, right: bool) -> None:
    """Twice the objective prefers the same; without the longest rest it bounds no hover."""
    model = copy.copy(worked("08.1"))
    _, _, price = model.variables
    bounded = scale * model.objective - rest * exercises.task("08.1")["most_s"] * price
    model.sense, model.sign, model.objective = "minimise", -1.0, bounded
    grade = exercises.check("08.1", model)
    assert bool(grade) == right
    assert right or grade.words.endswith("but the objective is wrong")


def test_charge_binds_for_every_student() -> None:
    """In the numbers of the task and at all that may be drawn: charge ends before the deadline."""
    drawn = exercise("05.1").choices
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
    unset = "the answer must be an object with building set, such as P4(building=...)"
    assert refused("05.2", optuav.P4) == f"{unset}, not the class P4"
    assert refused("14.1", Model).endswith("takes any building and order, not the class Model")

    class Reserve(optuav.Formulation):
        """Longest hover with a reserve of time."""

        def declare(self, model: Model, given: Any) -> None:
            hover, rest = given.hover_and_rest(model)
            model.maximise(2.0 * hover)
            model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
            given.keep_wells(model, "wells", hover, rest)
            left = given.time_left - exercises.task("05.2")["margin_s"]
            model.subject_to("time", hover + rest <= left)

    assert exercises.check("05.2", Reserve)
    assert exercises.check("05.2", Reserve(building="b3"))

    class NoRest(optuav.Formulation):
        """Longest hover that forgets the rest."""

        def declare(self, model: Model, given: Any) -> None:
            hover = model.variable("hover_time_s", "Δ", unit="s", upper=100.0)
            model.maximise(hover)
            given.keep_wells(model, "wells", hover, 0.0)

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
    said = refused("05.2", answer)
    assert re.fullmatch(words, said)
    assert said.count("did you mean") <= 1


def direct_or_not(task: Any, *, more_As: float, binary: bool = True) -> Model:
    """An answer to 11.2, right with 1000 A s more on the direct route."""
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
    task = exercises.task("11.2")
    assert exercises.check("11.2", direct_or_not(task, more_As=1000.0))
    grade = exercises.check("11.2", direct_or_not(task, more_As=0.0))
    assert "rest_time_s = 0, by_way = 0) is feasible, but your problem excludes it" in grade.words


def test_a_choice_that_is_not_binary_is_told_so() -> None:
    """The values 0 and 1 of the unknown agree; those between them are the mistake."""
    model = direct_or_not(exercises.task("11.2"), more_As=1000.0, binary=False)
    assert exercises.check("11.2", model).words == "by_way is not binary in your problem"


# Proofs


def test_a_weaker_proof_has_exactly_the_bound_that_is_asked_for() -> None:
    """By the bounds of two constraints; either alone is another one."""
    task, (best, weaker) = exercises.task("06.1"), worked("06.1")
    limits_s = {"charge": task["usable_As"] / task["hover_A"], "deadline": 1100.0}
    limits_s["energy"] = task["energy_J"] / task["hover_W"]
    scales = {"charge": task["hover_A"], "energy": task["hover_W"], "deadline": 1}
    shares = {label: float(each * scales[label]) for label, each in weaker.items()}
    bound_s = sum(share * limits_s[label] for label, share in shares.items())
    assert (bound_s, sum(shares.values())) == pytest.approx((task["claim_s"], 1.0))
    twice = exercises.check("06.1", [best, best])
    assert twice.words.startswith("second proof: it bounds the hover by ")
    assert exercises.check("06.1", [weaker, weaker]).words.startswith("first proof: gap")


def test_each_condition_of_a_proof_is_named() -> None:
    task = exercises.task("07.1")
    charge = Fraction(1, task["hover_A"] + task["rest_A"])
    right = {"charge": charge, "deadline": task["rest_A"] * charge}
    assert exercises.check("07.1", right)
    assert exercises.check("07.1", {name: float(each) for name, each in right.items()})
    negative = exercises.check("07.1", {**right, "deadline": -right["deadline"]})
    assert negative.words.startswith("sign: the multiplier of 'deadline'")
    short = exercises.check("07.1", {"charge": charge})
    assert short.words.startswith("stationarity: the rows add up to")
    # Without the charge, the deadline alone bounds Δ, with the bound of T': valid, but too high.
    weak = exercises.check("07.1", {"deadline": 1, "bounds of T'": 1})
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
    assert refused("08.2", {"hover_time_s": 1.0}) == (
        "not an answer: rest_time_s: is missing; a number, such as Fraction(1, 98)"
    )


def test_a_proof_needs_numbers_by_known_names() -> None:
    wrong = {"charge": float("nan"), "deadline": "1/98", "time": 1.0, "bounds of Δ": True}
    words = refused("07.1", wrong)
    assert re.findall(r"([^;:]+) = ", words) == [f" {name}" for name in wrong]
    assert "charge, deadline, bounds of Δ, bounds of T'" in words
    assert "numbers by name" in refused("07.1", [1.0, 2.0])


def test_rounded_multipliers_are_told_what_is_exact() -> None:
    right = worked("07.1")
    rounded = exercises.check("07.1", {name: round(float(x), 5) for name, x in right.items()})
    assert rounded.hint.endswith("; whole numbers and Fractions are exact, rounded numbers are not")
    assert "exact" not in exercises.check("07.1", {"deadline": 3}).hint


def test_a_conflict_is_proved_by_a_false_sum() -> None:
    """Δ ≥ 5 by its negative, and Δ ≤ 4: only their plain sum reads 0 ≤ −1."""
    model = linear({}, ("none", "max Δ", "least: −Δ ≤ −5", "most: Δ ≤ 4"))

    def broken(**multipliers: int) -> list[tuple[str, str]]:
        """Conditions that multipliers break."""
        exact = {name.replace("_", " "): Fraction(value) for name, value in multipliers.items()}
        return [(each.words, each.hint) for each in contradiction(model, exact) if not each.holds]

    assert broken(least=2, most=2) == []
    unbalanced = "stationarity: the rows add up to −1 · Δ", "a contradiction needs 0 · Δ"
    assert broken(least=1)[0] == unbalanced
    for true in ({"most": 1, "bounds_of_Δ": 1}, {}):
        assert broken(**true)[0][0].startswith("the sum is true")


def test_a_branch_that_is_not_bounded_is_named() -> None:
    task, (first, second) = exercises.task("12.1"), worked("12.1")
    assert exercises.check("12.1", (first, second))
    loose = {"near slots": task["near"], "branch": task["far"] + 1}
    assert exercises.check("12.1", [loose, second]).words.startswith("first branch: stationarity")
    weak = {"charge": Fraction(task["near"], task["near_As"])}
    weak["bounds of f"] = weak["charge"] * task["far_As"] - task["far"]
    grade = exercises.check("12.1", [first, weak])
    assert grade.words.startswith("second branch: no choice has a value above ")
    assert "a list of two dicts of numbers by name: charge, near slots" in refused("12.1", first)
    assert "near slots, bounds of n, bounds of f, branch" in refused("12.1", [first, {"x": 1}])


@pytest.mark.parametrize("student", range(20))
def test_one_branching_proves_the_best_slots(student: int) -> None:
    """By brute force: no whole slots are worth more, and the relaxation promises more."""
    task = exercises.task("12.1", str(student))
    values = [
        task["near"] * near + task["far"] * far
        for near in range(task["most"] + 1)
        for far in range(task["charge_As"] // task["far_As"] + 1)
        if task["near_As"] * near + task["far_As"] * far <= task["charge_As"]
    ]
    assert max(values) == task["value"]
    fraction = Fraction(task["charge_As"] - task["near_As"] * task["most"], task["far_As"])
    assert task["near"] * task["most"] + task["far"] * fraction > task["value"]


def test_a_programme_is_read_from_its_lines() -> None:
    """Signs, coefficients, sums on the right side, and the label of each row."""
    lines = ("t", "min {a} Δ − T'", "on line n: −{a} Δ + 3 T' ≥ {b} − 1.5", "other: T' ≤ −{b}")
    model = linear({"a": 2.5, "b": 40}, lines)
    assert [variable.name for variable in model.variables] == ["hover_time_s", "rest_time_s"]
    point = {"hover_time_s": 10.0, "rest_time_s": 7.0}
    first, second, *bounds = check(model, point)
    assert len(bounds) == 2
    assert (first.label, first.left, first.sense, first.right) == ("on line n", -4.0, ">=", 38.5)
    assert (second.label, second.left, second.sense, second.right) == ("other", 7.0, "<=", -40.0)
    assert (model.sense, float(evaluate(model.objective, point))) == ("minimise", 18.0)


# Designs


def test_an_itinerary_is_scored_or_told_what_it_breaks() -> None:
    task = exercises.task("04.2")
    best = optuav.solve(task.mission)
    assert exercises.check("04.2", worked("04.2")).score == pytest.approx(1.0, abs=5e-3)
    late = exercises.check("04.2", best)
    assert re.fullmatch(r"it rests for 2[45]\d\.\d s", late.words)
    dry = exercises.check("04.2", [("hover", "hover", best.hover_time_s + 50.0)])
    assert "it cannot be flown: at" in dry.words
    short = exercises.check("04.2", [Stop("hover", "hover", 0.5 * best.hover_time_s)])
    assert (bool(short), round(short.score, 2)) == (False, 0.51)  # A short rest: some 2 % less
    assert "% of the longest time" in short.words
    elsewhere = exercises.check("04.2", optuav.solve("paper"))
    assert "an itinerary that flies task.mission" in elsewhere.words


def test_two_rests_are_no_answer_where_one_is_asked_for() -> None:
    """Two rests hover longer than the best with one, and need another exercise."""
    rests = [("b1", "rest", 10.0), ("hover", "hover", 300.0), ("b10", "rest", 10.0)]
    grade = exercises.check("04.2", rests)
    assert (bool(grade), grade.words) == (False, "it can be flown, but has 2 rests")
    assert grade.hint == "the most rests allowed: 1"
    assert exercises.check("01.1", rests[:2]).words == "it can be flown, but has 1 rest"


def test_a_lone_stop_belongs_in_a_list() -> None:
    assert "a list of stops, such as [(" in refused("04.2", ("hover", "hover", 400.0))


@pytest.mark.parametrize("answer", [3.0, "hover", [("hover", 10.0)], [("roof", "hover", 1.0)]])
def test_an_itinerary_has_stops(answer: object) -> None:
    assert re.match("the answer must be|not an answer: (answer|stops)", refused("04.2", answer))


@pytest.mark.parametrize("number", ["01.1", "02.1", "03.1", "05.1", "07.1", "07.2"])
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
    task = exercises.task("18.1", "ada")
    plan = optuav.solve(task.mission, optuav.P1(stops=2))
    assert exercises.check("18.1", (worked("18.1", "ada")[0], plan.stops), "ada")
    assert optuav.audit(optuav.Itinerary(task.mission, plan.stops))  # type: ignore[arg-type]


def test_a_rest_that_is_not_between_two_hovers_explains_nothing() -> None:
    """Neither is a hover too short, nor the right witness with a wrong letter."""
    letter, best = worked("35.1", "ada")
    school, market, rest, quay = best.stops
    late = optuav.Itinerary(best.mission, (school, market, quay, rest))
    grade = exercises.check("35.1", (letter, late), "ada")
    assert (bool(grade), grade.words) == (False, "it has no rest between two hovers")
    short = [replace(stop, duration_s=0.9 * stop.duration_s) for stop in best.stops]
    grade = exercises.check("35.1", (letter, optuav.Itinerary(best.mission, short)), "ada")
    assert not grade
    assert "of the longest time" in grade.words
    wrong = "a" if letter != "a" else "b"
    assert "the reason does not hold" in exercises.check("35.1", (wrong, best), "ada").words


def test_a_model_without_an_objective_is_told_so() -> None:
    model = Model("All that is feasible")
    hover, rest = (model.variable(f"{each}_time_s", each, unit="s") for each in ("hover", "rest"))
    model.subject_to("charge", 82.0 * hover - 9.0 * rest <= 41_000.0)
    model.subject_to("deadline", hover + rest <= 1100.0)
    grade = exercises.check("05.1", model)
    assert (bool(grade), grade.words) == (False, "your problem has no objective")

"""Exercises of the second part, continued: conflicts, and problems of one's own."""

from dataclasses import dataclass

import optuav
from formulations.formulation import Given
from optuav.exercises.declare import declare
from optuav.exercises.exercise import Task, decimals, programme
from optuav.exercises.optimisation import CURRENTS, TIMES
from optuav.exercises.predict import Predictions, predict
from optuav.exercises.prove import prove
from optuav.modelling import Model
from optuav.solving import Program


@prove(
    "13.1",
    "Prove that no times satisfy all constraints: give a multiplier of each that is needed, as a "
    "dict by label, so that the sum is false. The bounds of a time are constraints as well, with "
    "the labels 'bounds of Δ' and \"bounds of T'\". Whole numbers and Fractions are exact.",
    what="conflict",
    draws={
        "hover_A": range(60, 121, 2),
        "rest_A": range(4, 13),
        "short_As": range(1500, 2501, 50),
        "left_s": range(50, 121, 5),
    },
)
def _conflict(task: Task) -> Model:
    drawn = {"hover_time_s": task["hover_A"], "rest_time_s": -task["rest_A"]}
    time = {"hover_time_s": 1.0, "rest_time_s": 1.0}
    rows = {"charge": (drawn, -task["short_As"]), "deadline": (time, task["left_s"])}
    return programme("a hover for which there is neither charge nor time", TIMES, rows)


@predict(
    "13.2",
    "The flights take {flight_s} s and draw {flight_As} A s, of which only {usable_As} A s may be "
    "drawn without a rest. A rest returns {rest_A} A. What is the least deadline [s] with which "
    "there is a plan, even if it hovers for no time at all?",
    unit="s",
    within=0.1,
    draws={
        "flight_s": decimals(60.0, 100.0, 0.5),
        "flight_As": range(6000, 9001, 100),
        "usable_As": range(4500, 5901, 100),
        "rest_A": range(4, 13),
    },
)
def _least_deadline(task: Task) -> Predictions:
    short_s = (task["flight_As"] - task["usable_As"]) / task["rest_A"]
    yield task["flight_s"] + short_s, "rest for what is missing, and fly"
    yield short_s, "the flights are part of the mission"


@dataclass(frozen=True)
class _AtLeast(optuav.Formulation):
    """Least rest for a hover of at least so long."""

    hover_s: float

    def declare(self, model: Model, given: Given) -> None:
        hover, pause = given.hover_and_rest(model)
        model.minimise(pause)
        model.subject_to("hover for long enough", hover >= self.hover_s)
        model.subject_to("charge", given.soc_end(hover, pause) >= given.min_soc)
        given.keep_deadline(model, "in time", hover, pause)


@declare(
    "14.1",
    "Declare a formulation: the least rest with which the UAV hovers for at least {wanted_s} s, "
    "keeps the charge that it has to keep, and is back in time. It is compared on b1, rest first, "
    "in the perspective battery.",
    draws={"wanted_s": range(660, 716)},
)
def _wanted(task: Task) -> Program:
    asked = _AtLeast(task["wanted_s"], building="b1", order="rest-first")
    return optuav.formulate(task.mission, asked, perspective="battery")


@predict(
    "14.2",
    "Hovering draws {hover_A} A, resting returns {rest_A} A, and only charge binds. How many "
    "seconds of rest does one more second of a wanted hover cost? Answer with two decimals or "
    "more.",
    unit="s",
    within=0.01,
    draws=CURRENTS,
)
def _cost_of_hover(task: Task) -> Predictions:
    yield task["hover_A"] / task["rest_A"], "the rest has to return what the second draws"
    yield task["rest_A"] / task["hover_A"], "that is the hover for a second of rest"
    yield (task["hover_A"] + task["rest_A"]) / task["rest_A"], "only charge binds, and not time"

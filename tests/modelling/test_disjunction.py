"""Disjunctions: of several linear models exactly one applies, and the best of them is found."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from optuav.engines import closed_form, linear
from optuav.modelling import Model, NotAffineError, Parameter
from optuav.modelling.disjunction import FORMS, Form, disjunction

DEADLINE = Parameter("T", "T", "s", 100.0)
both_forms = pytest.mark.parametrize("form", FORMS)


def direct(limit: float) -> Model:
    """Longest x alone: 2 x ≤ limit, x ≤ T."""
    model = Model("longest x")
    x = model.variable("x", "x", unit="s", upper=DEADLINE)
    model.maximise(x)
    model.subject_to("charge", 2.0 * x <= Parameter("limit", "c", "A s", limit))
    return model


def resting(limit: float, gain: float, late: float) -> Model:
    """Longest x with a rest y: 2 x − gain y ≤ limit, x + y ≤ T − late."""
    model = Model("longest x")
    x, y = model.variable("x", "x", unit="s"), model.variable("y", "y", unit="s")
    model.maximise(x)
    model.prefer_small(y)
    drawn = 2.0 * x - Parameter("gain", "g", "A", gain) * y
    model.subject_to("charge", drawn <= Parameter("limit", "c", "A s", limit))
    model.subject_to("deadline", x + y <= DEADLINE - Parameter("late", "t", "s", late))
    return model


def alternatives(seed: int) -> dict[str, Model]:
    """One without and three with a rest."""
    rng = np.random.default_rng(seed)
    models = {"direct": direct(rng.uniform(20.0, 180.0))}
    for number in range(3):
        models[f"rest {number}"] = resting(*rng.uniform((20.0, 0.1, 0.0), (150.0, 3.0, 40.0)))
    return models


@both_forms
@pytest.mark.parametrize("seed", range(6))
def test_best_alternative_is_found(form: Form, seed: int) -> None:
    """As solving each of them alone tells; the others are switched off."""
    models = alternatives(seed)
    alone = [float(closed_form.solve(model, 1).objective[0]) for model in models.values()]
    found = linear.solve(disjunction(models, form), 1)
    point = found.point(0)
    assert found.objective[0] == pytest.approx(max(alone), abs=1e-6)
    choices = [point[f"choice[{number}]"] for number in range(1, len(models) + 1)]
    assert choices == [float(value == max(alone)) for value in alone]
    found.verify()


@pytest.mark.parametrize("seed", range(6))
def test_relaxed_hull_is_exact_and_relaxed_big_m_a_bound(seed: int) -> None:
    """Half of two alternatives is no better than the better one; a slackened row may be."""
    models = alternatives(seed)
    best = max(float(closed_form.solve(model, 1).objective[0]) for model in models.values())
    bounds = {
        form: float(linear.solve(disjunction(models, form, relaxed=True), 1).objective[0])
        for form in FORMS
    }
    assert bounds["hull"] == pytest.approx(best, abs=1e-6)
    assert bounds["big-M"] >= best - 1e-6


@both_forms
def test_unknown_that_an_alternative_lacks_is_zero(form: Form) -> None:
    models = {"direct": direct(150.0), "rest": resting(20.0, 0.1, 0.0)}
    point = linear.solve(disjunction(models, form), 1).point(0)
    assert (point["x"], point["y"], point["choice[1]"]) == pytest.approx((75.0, 0.0, 1.0))


@both_forms
def test_parameters_keep_their_names_where_they_are_shared(form: Form) -> None:
    """T is one number for all; limits are told apart, and a change of one counts."""
    models = {"direct": direct(150.0), "rest": resting(20.0, 0.1, 0.0)}
    joined = disjunction(models, form)
    assert {"T", "limit[1]", "limit[2]"} <= joined.parameters.keys()
    compiled = linear.Compiled(joined)
    assert compiled.solve({"limit[1]": 100.0}).objective[0] == pytest.approx(50.0)


@both_forms
def test_page_says_what_is_alike_once(form: Form) -> None:
    """Ten alternatives of one shape take the lines of two, but for the list of their names."""
    pages = [
        str(disjunction({f"rest {k}": resting(50.0 + k, 0.5, k) for k in range(count)}, form))
        for count in (2, 10)
    ]
    lengths = [len(page.splitlines()) for page in pages]
    assert lengths[1] <= lengths[0] + 1 <= 30
    assert "Σλ_r = 1" in pages[1]


def curved() -> Model:
    """Not linear."""
    model = direct(10.0)
    model.subject_to("curved", model.variables[0] ** 2 <= 4.0)
    return model


def endless() -> Model:
    """Bounded by a parameter's own coefficient only."""
    model = Model("endless")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    model.subject_to("charge", Parameter("p", "p", "A", 2.0) * x <= 5.0)
    return model


def shortest() -> Model:
    """Minimises."""
    model = Model("shortest")
    model.minimise(model.variable("x", "x", unit="s"))
    return model


@pytest.mark.parametrize(
    ("models", "form", "error", "words"),
    [
        ({"a": direct(1.0)}, "convex", ValueError, "hull or big-M, not 'convex'"),
        ({}, "hull", ValueError, "all maximise or all minimise"),
        ({"a": direct(1.0), "b": shortest()}, "hull", ValueError, "all maximise or all minimise"),
        ({"a": direct(1.0), "b": curved()}, "hull", NotAffineError, "linear"),
        ({"a": direct(1.0), "b": endless()}, "big-M", ValueError, "needs a bound on x"),
    ],
)
def test_what_cannot_be_joined_is_refused(
    models: dict[str, Model], form: Any, error: type[ValueError], words: str
) -> None:
    with pytest.raises(error, match=words):
        disjunction(models, form)


def test_hull_needs_no_bound() -> None:
    """Where M has nothing to rest on, copies of the unknowns still do."""
    found = linear.solve(disjunction({"a": direct(1.0), "b": endless()}, "hull"), 1)
    assert math.isclose(found.objective[0], 2.5)

"""The registry: engines by name or as objects, and one that is added from outside the package."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pytest

import optuav
from optuav.arrays import Values
from optuav.engines import registry
from optuav.engines.bracket import Bracket
from optuav.engines.casadi_engine import Casadi
from optuav.engines.closed_form import ClosedForm
from optuav.engines.cvxpy_engine import Cvxpy
from optuav.engines.grid import Grid
from optuav.engines.registry import Engine
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.modelling import Model, Parameter
from optuav.modelling.check import evaluated
from optuav.status import Status

OURS: tuple[Engine, ...] = (ClosedForm(), Cvxpy(), Bracket(), Casadi(), Grid())
ASKED = {"perspective": "battery"}


@dataclass(frozen=True)
class Halving(Engine):
    """An engine for one unknown from 0: halves a range until it is short enough."""

    width_s: float = 1e-9
    name: str = "halving"
    nonlinear = True
    most_unknowns = 1
    needs = ("lower bounds",)

    def solve(
        self,
        model: Model,
        programmes: int,
        values: Values | None = None,
        *,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
    ) -> Solution:
        """Solve every programme."""
        (unknown,) = model.variables
        low, high = np.zeros(programmes), np.full(programmes, 1e6)
        while (high - low).max() > self.width_s:
            middle = 0.5 * (low + high)
            rows = evaluated(model, {**(values or {}), unknown.name: middle})
            holds = np.logical_and.reduce(
                [
                    row.left <= row.right if row.sense == "<=" else row.left >= row.right
                    for row in rows
                ]
            )
            low, high = np.where(holds, middle, low), np.where(holds, high, middle)
        statuses = [Status.LOCALLY_OPTIMAL] * programmes
        return Solution(self.name, "halved", model, statuses, low, {unknown.name: low})


@pytest.fixture
def halving() -> Iterator[Halving]:
    """The engine from outside, known by its name."""
    added = Halving()
    optuav.register(added)
    yield added
    optuav.unregister(added.name)


def test_engines_of_the_package_are_found_by_name() -> None:
    assert [each.name for each in OURS] == list(registry.ENGINES) == list(registry.CLASSES)
    for each in OURS:
        assert registry.engine(each.name) == each
        assert registry.engine(each) is each


def test_an_engine_from_outside_answers_by_name(halving: Halving) -> None:
    """SPEC's 688.848 s; it is listed, chosen by name, compiled and refused like any other."""
    assert registry.engine_names()[-1] == "halving"
    plan = optuav.solve("paper", "P3", engine="halving", **ASKED)
    assert (plan.engine, plan.proof, plan.status) == ("halving", "halved", Status.LOCALLY_OPTIMAL)
    assert plan.hover_time_s == pytest.approx(688.848, abs=1e-3)
    program = optuav.formulate("paper", "P3", engine="halving", **ASKED)
    assert "halving" in program.engines
    # The engine does not keep what it was asked: the solution is checked with it all the same.
    for deadline_s in (300.0, 1500.0):
        found = program.compile().solve(deadline_s=deadline_s)
        wanted_s = min(deadline_s - plan.flight_time_s, plan.hover_time_s)
        assert found.objective[0] == pytest.approx(wanted_s, abs=1e-6)
        assert found.parameters_at(0)["deadline_s"] == deadline_s
    with pytest.raises(
        InputError, match=r"halving does not accept this model: .* at most 1 unknown,"
    ):
        optuav.formulate("paper", optuav.P4("b1"), engine="halving", **ASKED)


def test_an_engine_from_outside_answers_as_an_object() -> None:
    """It need not be registered, and its options are its own."""
    coarse = optuav.solve("paper", "P3", engine=Halving(width_s=1.0), **ASKED)
    assert 687.0 < coarse.hover_time_s < 688.848
    with pytest.raises(InputError, match="engine"):
        optuav.solve("paper", "P3", engine="halving", **ASKED)


def test_options_of_an_engine_are_its_own() -> None:
    plan = optuav.solve("paper", "P3", engine=Cvxpy(solver="clarabel"), **ASKED)
    assert plan.hover_time_s == pytest.approx(688.848, abs=1e-3)
    assert plan.engine == "cvxpy"
    rough = optuav.solve("paper", "P3", engine=replace(Casadi(), accuracy=1e-4), **ASKED)
    assert rough.hover_time_s == pytest.approx(688.848, abs=1e-1)


@pytest.mark.parametrize("each", OURS, ids=lambda each: each.name)
def test_a_compiled_model_answers_like_the_engine(each: Engine) -> None:
    """For two programmes at once, with changed parameters and with the model's own."""
    model = Model("longest")
    x = model.variable("x", "x", unit="s")
    model.maximise(x)
    rate, most = Parameter("rate", "r", "1", 2.0), Parameter("most", "m", "s", np.array([6.0, 9.0]))
    model.subject_to("limit", rate * x <= most)
    slot_s = 0.5 if each.slots is None else None
    compiled = each.compile(model, 2, slot_s=slot_s)
    assert compiled({}).objective == pytest.approx([3.0, 4.5])
    changed = {"rate": 1.0, "most": np.array([4.0, 5.0])}
    assert compiled(changed).objective == pytest.approx([4.0, 5.0])
    found = each.solve(model, 2, changed, slot_s=slot_s)
    assert found.objective == pytest.approx([4.0, 5.0])
    assert found.engine == each.name


def test_a_name_of_the_package_is_not_taken_over() -> None:
    with pytest.raises(InputError, match="bracket"):
        optuav.register(replace(Halving(), name="bracket"))


def test_the_grid_needs_slots() -> None:
    (part,) = optuav.formulate("paper", "P3", **ASKED).parts
    with pytest.raises(InputError, match="slot"):
        Grid().solve(part.model, 1)

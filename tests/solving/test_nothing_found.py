"""Infeasible is said where it is proved, and of routes and times only what is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

import optuav
from formulations.formulation import Formulation, Given
from optuav.engines.closed_form import ClosedForm
from optuav.engines.registry import Engine
from optuav.engines.solution import Solution
from optuav.errors import SolverError
from optuav.modelling import Model
from optuav.solving import packs_by_schedule
from optuav.status import Status

PAPER = optuav.load("paper")
NEITHER = "neither a plan nor proof that none exists"


class Curved(Formulation):
    """Longest hover with a bend: its square is at most 100 s²."""

    def declare(self, model: Model, given: Given) -> None:
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        model.subject_to("bend", hover * hover + 1.0 <= 0.0 * hover, unit="s²")
        given.keep_deadline(model, "deadline", hover, rest)


@dataclass(frozen=True)
class Guess(Engine):
    """The closed form, which keeps some of its answers for itself."""

    kept: Sequence[int] = ()  # Numbers of the programmes of the first part that it answers
    answered: Status = Status.OPTIMAL  # What it says of its answers
    name = "guess"
    most_unknowns, needs = ClosedForm.most_unknowns, ClosedForm.needs

    def solve(self, model: Model, programmes: int, *_: object, **__: object) -> Solution:
        found = ClosedForm.solve(model, programmes)
        known = np.isin(np.arange(programmes), self.kept) & (programmes == 1)
        return Solution(
            self.name,
            "guessed",
            model,
            [self.answered if k else Status.UNKNOWN for k in known],
            np.where(known, found.objective, np.nan),
            {name: np.where(known, each, np.nan) for name, each in found.values.items()},
        )


def test_an_engine_that_finds_nothing_is_not_taken_for_a_proof() -> None:
    """Where there is a plan, and where another engine cannot say either."""
    with pytest.raises(SolverError, match=f"guess found {NEITHER}"):
        optuav.solve("paper", perspective="battery", engine=Guess())
    with pytest.raises(SolverError, match=f"casadi found {NEITHER}: .*Infeasible"):
        optuav.solve("paper", Curved(building="b1", order="rest-first"), perspective="battery")
    compiled = optuav.formulate("paper", perspective="battery", engine=Guess()).compile()
    assert compiled.solve().status is Status.UNKNOWN


@pytest.mark.parametrize(
    ("answered", "status"),
    [(Status.OPTIMAL, Status.FEASIBLE), (Status.LOCALLY_OPTIMAL, Status.LOCALLY_OPTIMAL)],
)
def test_a_best_among_some_routes_is_not_called_optimal(answered: Status, status: Status) -> None:
    """It answers the direct route alone, with 688.85 s; b1 gives 719.54 s.

    An explanation says so too, and speaks of that route.
    """
    engine = Guess(kept=(0,), answered=answered)
    plan = optuav.solve("paper", perspective="battery", engine=engine)
    assert plan.hover_time_s == pytest.approx(688.848, abs=1e-3)
    assert plan.status is status
    unproved = "not proved: on some routes guess found neither times nor proof"
    assert unproved in plan.notes
    explained = optuav.explain("paper", perspective="battery", engine=engine)
    assert unproved in explained.notes
    assert "on this route no point that satisfies all of these is better" in str(explained)


def test_what_one_engine_leaves_open_another_may_prove() -> None:
    """CasADi alone takes P2 through the wells, and IPOPT proves nothing there."""
    mission = PAPER.replace({"limits.min_soc": 0.995, "buildings": PAPER.buildings[:1]})
    plan = optuav.solve(mission, optuav.P2(order="rest-first"))
    assert plan.status is Status.INFEASIBLE
    proof = "bracketed: proof that no times satisfy all constraints, by the engine bracket"
    assert plan.proof == proof


def test_packs_in_turns_are_infeasible_only_where_pooled_ones_are_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Steps that miss all plans prove nothing; a rest of some seconds makes one."""
    changes = {"battery.schedule": "sequential", "limits.min_soc": 0.9, "limits.deadline_s": 900}
    mission = PAPER.replace(changes)
    assert optuav.solve(mission).status is Status.FEASIBLE
    monkeypatch.setattr(packs_by_schedule, "STEP_S", 1000.0)
    with pytest.raises(SolverError, match=NEITHER):
        optuav.solve(mission)
    none = optuav.solve(mission.replace({"limits.min_soc": 0.99}))
    assert none.status is Status.INFEASIBLE
    assert "even if the packs were pooled" in none.proof


def test_reasons_speak_of_what_was_evaluated() -> None:
    """The least times on one route: the sentence went on to times that nobody had looked at."""
    mission = PAPER.replace({"limits.min_soc": 0.93})
    plan = optuav.solve(mission, optuav.P3())
    said = "charge left: 89.11 % ≥ 93 % does not hold at Δ = 0 on origin → hover → destination"
    assert plan.reasons == (said,)
    assert optuav.solve(mission).hover_time_s == pytest.approx(72.42, abs=0.01)
    slots = optuav.solve(mission, slot_s=900.0)
    assert slots.reasons == (said,)


@dataclass(frozen=True)
class LeastRest(Formulation):
    """Least rest for a wanted hover time."""

    wanted_hover_s: float

    def declare(self, model: Model, given: Given) -> None:
        hover, rest = given.hover_and_rest(model)
        model.minimise(rest)
        model.subject_to("wanted hover", hover == self.wanted_hover_s, unit="s")
        model.subject_to("state of charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "battery", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


@pytest.mark.parametrize("perspective", ["battery", "available"])
def test_what_other_times_could_satisfy_is_no_reason(perspective: str) -> None:
    """A hover of 730 s is no contradiction, though 0 s are not 730; a charge of 89 % after the
    flight there and back is short of 99 % after any hover."""
    together = (
        "no times satisfy all constraints together: those that satisfy wanted hover break others"
    )
    mission = PAPER.replace({"buildings": PAPER.buildings[:1]})
    assert optuav.solve(mission, LeastRest(730.0), perspective=perspective).reasons == (together,)
    full = mission.replace({"limits.min_soc": 0.99, "buildings": []})
    (reason,) = optuav.solve(full, LeastRest(730.0), perspective=perspective).reasons
    assert reason.startswith("charge left: 0.891068 ≥ 0.99 does not hold at Δ = 0 on ")

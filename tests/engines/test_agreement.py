"""Random missions: all engines against exact arithmetic and against each other.

A few in the suite, ten thousand in the soak; the soak reports how many it has compared.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from formulations.formulation import Formulation
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.parameters import Quantities
from optuav.engines import closed_form, grid
from optuav.engines.cvxpy_engine import Cvxpy
from optuav.engines.solution import Solution
from optuav.status import Status
from tests.engines.optimality import solved
from tests.engines.random_missions import Exact, exact, random_quantities
from tests.formulations.given import LINEAR

WITHIN_S = {"closed-form": 1e-6, "cvxpy": 1e-5, "casadi": 1e-4}
"""How far an engine may be from the exact Δ."""
HOPELESS_S = 1e-6
"""Δ below which an engine may call a programme infeasible, and may not where it is longer."""
SLOTS_S = (0.5, 1.0, 7.0, 10.0, 60.0)


@dataclass
class Tally:
    """How many answers were compared, by engine, and which of them were wrong."""

    compared: Counter[str] = field(default_factory=Counter)
    wrong: list[str] = field(default_factory=list)

    def report(self, title: str) -> None:
        counts = ", ".join(f"{name} {count}" for name, count in sorted(self.compared.items()))
        print(f"\n{title}: {counts}; disagreements: {len(self.wrong)}")
        assert not self.wrong, "\n".join(self.wrong[:20])


def differences(
    answer: Solution, truth: Exact | None, tolerance_s: float, none: Status = Status.INFEASIBLE
) -> Iterator[str]:
    """What is wrong with the answer to a P3 or P4, and `none` is right where there is no plan."""
    if truth is None:
        if answer.status is not none:
            yield f"{answer.status} where nothing is feasible"
        return
    hover_s, rest_s = float(truth.hover_s), float(truth.rest_s)
    if not answer.status.has_answer:
        if hover_s > HOPELESS_S or answer.status is not none:
            yield f"{answer.status} {answer.words} where Δ = {hover_s} s"
        return
    point = answer.point(0)
    if abs(point["hover_time_s"] - hover_s) > tolerance_s:
        yield f"Δ = {point['hover_time_s']} s, exactly {hover_s} s"
    # A Δ that is short by some time may do with a rest that is shorter by many times that.
    if not rest_s - 1e3 * tolerance_s <= point.get("rest_time_s", 0.0) <= rest_s + tolerance_s:
        yield f"T' = {point['rest_time_s']} s, exactly {rest_s} s"


def compare_with_exact(given: Quantities, engine: str, tally: Tally) -> None:
    """P3 and P4 in the perspectives of the paper, and through the wells where it takes them."""
    perspectives = (*LINEAR, "wells") if engine == "casadi" else LINEAR
    for formulation in (P3(), P4("b1")):
        for perspective in perspectives:
            said = "battery" if perspective == "wells" else perspective
            truth = exact(vars(given), said, rests=isinstance(formulation, P4))
            answer = solved(engine, formulation.model(given, perspective))
            tally.compared[engine] += 1
            where = f"{engine} {formulation.name} {perspective} {given}"
            # A local solver proves nothing of a model that is not linear.
            none = Status.UNKNOWN if perspective == "wells" else Status.INFEASIBLE
            wrong = differences(answer, truth, WITHIN_S[engine], none)
            tally.wrong += [f"{what}: {where}" for what in wrong]


def compare_slots(given: Quantities, slot_s: float, tally: Tally) -> None:
    """Branch and bound finds the cell that the grid finds, and the continuum is near."""
    horizon_s = given.deadline_s - given.flight_time_s
    whole = abs(horizon_s / slot_s - round(horizon_s / slot_s)) < 1e-9
    formulations: tuple[Formulation, ...] = (P3(), P4("b1"), P2())
    for formulation in formulations:
        for perspective in LINEAR:
            model = formulation.model(given, perspective)
            searched, branched = (
                grid.solve(model, 1, slot_s=slot_s),
                Cvxpy().solve(model, 1, slot_s=slot_s),
            )
            tally.compared["slots"] += 1
            where = f"{formulation.name} {perspective} slots of {slot_s} s {given}"
            if searched.status is not branched.status:
                tally.wrong.append(f"{searched.status} against {branched.status}: {where}")
                continue
            for name in searched.values:
                if abs(searched.values[name][0] - branched.values[name][0]) > 1e-6:
                    tally.wrong.append(f"{searched.values} {branched.values}: {where}")
            if isinstance(formulation, P2):
                continue
            hover_s = closed_form.solve(model, 1).objective[0]
            lost_s = hover_s - searched.objective[0]
            bound_s = (1.0 if whole else 2.0) * slot_s + 1e-6
            if searched.status.has_answer and not -1e-6 <= lost_s <= bound_s:
                tally.wrong.append(f"the slots lose {lost_s} s: {where}")
            if not searched.status.has_answer and hover_s > bound_s:
                tally.wrong.append(f"no slots where Δ = {hover_s} s: {where}")


def with_whole_horizon(given: Quantities, slot_s: float) -> Quantities:
    """The same with a horizon of whole slots."""
    slots = round((given.deadline_s - given.flight_time_s) / slot_s)
    return replace(given, deadline_s=given.flight_time_s + slots * slot_s)


@pytest.mark.parametrize(
    ("engine", "programmes"), [("closed-form", 25), ("cvxpy", 2), ("casadi", 1)]
)
def test_engine_gives_the_exact_answer(engine: str, programmes: int) -> None:
    """Δ, T' and infeasibility of random P3 and P4; wells as charge balance."""
    rng, tally = np.random.default_rng(4), Tally()
    for _ in range(programmes):
        compare_with_exact(random_quantities(rng), engine, tally)
    tally.report("exact arithmetic")


def test_branch_and_bound_finds_what_the_grid_finds() -> None:
    """Cell for cell, within one or two slots of the continuum."""
    rng, tally = np.random.default_rng(5), Tally()
    for number in range(2):
        slot_s = SLOTS_S[number % len(SLOTS_S)]
        drawn = random_quantities(rng)
        compare_slots(drawn if number % 2 else with_whole_horizon(drawn, slot_s), slot_s, tally)
    tally.report("slots")


def test_comparison_can_fail() -> None:
    """A second too much, a wrong status and a rest that is longer than it need be are told."""
    quantities = random_quantities(np.random.default_rng(0))
    truth = exact(vars(quantities), "battery", rests=True)
    assert truth is not None
    answer = closed_form.solve(P4("b1").model(quantities, "battery"), 1)
    assert not list(differences(answer, truth, 1e-6))
    later = Exact(truth.hover_s + 1, truth.rest_s)
    sooner = Exact(truth.hover_s, truth.rest_s - 1)
    assert [len(list(differences(answer, each, 1e-6))) for each in (later, sooner, None)] == [
        1,
        1,
        1,
    ]


SOAK = {"closed-form": 10_000, "cvxpy": 10_000, "casadi": 10_000}


@pytest.mark.soak
@pytest.mark.parametrize("engine", SOAK)
def test_soak_exact(engine: str) -> None:
    """Ten thousand programmes an engine."""
    rng, tally = np.random.default_rng(), Tally()
    while tally.compared[engine] < SOAK[engine]:
        compare_with_exact(random_quantities(rng), engine, tally)
    tally.report("exact arithmetic")


@pytest.mark.soak
def test_soak_slots() -> None:
    """Ten thousand programmes in slots."""
    rng, tally = np.random.default_rng(), Tally()
    while tally.compared["slots"] < 10_000:
        slot_s = float(rng.choice(SLOTS_S))
        drawn = random_quantities(rng)
        compare_slots(
            drawn if rng.random() < 0.5 else with_whole_horizon(drawn, slot_s), slot_s, tally
        )
    tally.report("slots")

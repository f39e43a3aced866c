"""The answers to the benchmark set: that they are what `solve` finds, and others confirm them.

Some 30 of them are solved again in each run of the tests, all in the soak.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from typing import Any

import pytest

import optuav
from optuav.judge import Stop
from optuav.judge.benchmark import Answer, answers, checked
from optuav.mission import benchmark
from optuav.solving.question import problem_of

CLOSE = 2e-6  # Relative, and in seconds
SLOW = ("set/stops-100", "set/stops-300", "set/stops-1000", "set/packs-")
ENGINES: dict[str, Any] = {"available": "casadi"}
"""The engine beside that of the answer; cvxpy in the linear perspectives."""
MOST_ROOFS = 12  # Of which all are tried by the other engine, where that is quick or in the soak
TRIED = 1  # Roofs beside the best that are tried elsewhere
QUICK = {*random.Random(18).sample([key for key in answers() if not key[0].startswith(SLOW)], 30)}
CASES = [
    pytest.param(each, id="-".join(key), marks=[pytest.mark.soak] * (key not in QUICK))
    for key, each in answers().items()
]


@pytest.mark.parametrize("answer", CASES)
def test_answers_are_found_again_and_confirmed(answer: Answer) -> None:
    """By `solve`, by the simulation, and by another engine over the same roofs or some of them."""
    mission = optuav.load(answer.mission)
    name, options = benchmark.parsed(answer.problem)
    problem, perspective = problem_of(name, **options), answer.perspective
    plan = optuav.solve(mission, problem, perspective=perspective)  # type: ignore[arg-type]
    assert plan.status.value == answer.status
    judged = checked(mission, answer, answer.hover_s, answer.stops)
    assert judged.wrong == ()
    if answer.hover_s is None:
        assert plan.reasons
        stops = [Stop("hover", "hover", 0.001)]
        stops += [Stop(options["building"], "rest", 0.0)] if name == "P4" else []
        wrong = checked(mission, answer, 0.001, stops).wrong
        assert wrong
        assert not wrong[0].startswith("impossible")
    else:
        assert plan.hover_time_s == pytest.approx(answer.hover_s, rel=CLOSE, abs=CLOSE)
    if answer.engine not in ("closed-form", "bracket") or mission.battery.charging == "taper":
        return
    best = [stop.at for stop in answer.stops if stop.kind == "rest"]
    quick = (answer.mission, answer.problem, perspective) in QUICK
    whole = len(mission.buildings) <= MOST_ROOFS and not (quick and perspective == "available")
    found_s = [*others(mission, name, answer, None if whole else best)]
    if answer.hover_s is None:
        assert found_s == []
    else:
        assert max(found_s) == pytest.approx(answer.hover_s, rel=1e-5, abs=1e-4)


def others(mission: optuav.Mission, name: str, answer: Answer, best: list[str]) -> Iterator[float]:
    """Hover times by another engine [s]: over all roofs, or the best and some at random."""
    names, options = mission.buildings.names, benchmark.parsed(answer.problem)[1]
    problems = [problem_of(name, **options)]
    if name == "P1" and best is not None:
        some = random.Random(len(names)).sample(names, min(TRIED, len(names)))
        problems = [optuav.P3(), *(optuav.P4(roof) for roof in {*best, *some})]
    engine = ENGINES.get(answer.perspective, "cvxpy")
    for problem in problems:
        plan = optuav.solve(mission, problem, perspective=answer.perspective, engine=engine)  # type: ignore[arg-type]
        if plan:
            yield plan.hover_time_s

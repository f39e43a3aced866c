"""Writes the answers to the benchmark set: ``python -m benchmarks.missions.make [NAME]...``.

With names, or beginnings of names, only these are solved again. Each answer has to pass the check
that solutions of others have to pass.
"""

from __future__ import annotations

import json
import re
import sys
import time
from collections.abc import Iterator
from typing import Any

import optuav
from optuav.judge.benchmark import FILE, answer_of, checked
from optuav.mission import benchmark
from optuav.mission.files import write_text
from optuav.solving.question import problem_of
from optuav.status import Status

DIGITS = 6  # Decimals of a second, far below any tolerance
SEARCHED = re.compile(r"no plan hovers longer than (\S+) s")
BY_CHARGE = "bound by charge alone, perspective battery (closed form)"


def answer(mission: optuav.Mission, problem: str, perspective: Any) -> dict[str, Any]:
    """The answer to one problem, as plain data."""
    name, options = benchmark.parsed(problem)
    asked = problem_of(name, **options)
    plan = optuav.solve(mission, asked, perspective=perspective)
    found = {"mission": mission.name, "problem": problem, "perspective": perspective}
    found |= {"status": plan.status.value, "hover_s": None, "bound_s": None}
    found |= {"engine": plan.engine, "proof": plan.proof}
    if not plan:
        assert plan.status is Status.INFEASIBLE, plan
        return found | {"reasons": [*plan.reasons]}
    hover_s = bound_s = round(plan.hover_time_s, DIGITS)
    if by_search := SEARCHED.search(plan.proof):
        bound_s = max(hover_s, float(by_search[1]))
    if plan.status is not Status.OPTIMAL:
        by_charge = optuav.solve(mission, asked, perspective="battery")
        assert by_charge.status is Status.OPTIMAL, by_charge
        most_s = round(by_charge.hover_time_s, DIGITS)
        if not by_search or most_s < bound_s:
            bound_s, found["proof"] = most_s, f"{plan.proof}; {BY_CHARGE}"
    stops = [[stop.at, stop.kind, round(stop.duration_s, DIGITS)] for stop in plan.stops]
    return found | {"hover_s": hover_s, "bound_s": bound_s, "stops": stops}


def answers(recipe: benchmark.Recipe) -> Iterator[dict[str, Any]]:
    """The answers to all problems of a mission, each checked."""
    mission = optuav.load(recipe.name)
    for problem in recipe.problems:
        for perspective in recipe.perspectives:
            found = answer(mission, problem, perspective)
            known = answer_of(found)
            result = checked(mission, known, known.hover_s, known.stops)
            assert not result.wrong, result
            yield found


def main(names: list[str]) -> None:
    """Solve what is asked for, and write all answers."""
    known: dict[str, list[dict[str, Any]]] = {}
    for each in json.loads(FILE.read_text("utf-8"))["answers"] if names else ():
        known.setdefault(each["mission"], []).append(each)
    for recipe in benchmark.recipes().values():
        if not names or recipe.name.startswith(tuple(names)):
            begin = time.process_time()
            known[recipe.name] = [*answers(recipe)]
            print(f"{time.process_time() - begin:8.2f} s  {recipe.name}", flush=True)
    lines = [json.dumps(each) for name in benchmark.recipes() for each in known[name]]
    write_text(FILE, '{"answers": [\n' + ",\n".join(lines) + "\n]}\n")
    print(f"{time.process_time():8.2f} s of CPU time, {len(lines)} answers")


if __name__ == "__main__":
    main(sys.argv[1:])

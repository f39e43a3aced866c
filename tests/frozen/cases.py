"""The frozen cases as plain data, and how each is put to the package.

Run as a script, `python -m tests.frozen.cases FILE` writes the answers that the code gives now.
Nothing else writes `answers.json`: its figures are those of version 0.1.0.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import optuav
from optuav.solving.question import problem_of
from tests.wells import SLOW

ANSWERS = Path(__file__).with_name("answers.json")
MISSIONS = ("matrice350", "paper", "paper-table2")
PERSPECTIVES = ("battery", "energy", "adjusted", "wells", "available")
ENGINES = ("closed-form", "cvxpy", "bracket", "casadi", "grid")
BUILDINGS = ("b1", "b9")
SHORT = {"matrice350": 900.0, "paper": 800.0, "paper-table2": 800.0}

BEFORE: dict[str, dict[str, Any]] = {"matrice350": {**SLOW}}
"""Keys of a mission that has changed, as they were in version 0.1.0."""

FIELDS = {"trajectory", "building", "order", "hover_point", "stops", "hovers"}

Case = dict[str, Any]


def cases() -> Iterator[Case]:
    """Every case: a mission with changes, a problem with its options, perspective and engine."""
    for mission in MISSIONS:
        yield from _one_stop(mission)
        yield from _several_stops(mission)
        yield from _schedules(mission)
        yield from _infeasible(mission)


def _one_stop(mission: str) -> Iterator[Case]:
    problems: list[Case] = [
        {"problem": "P1"},
        {"problem": "P2"},
        {"problem": "P2-tight"},
        {"problem": "P3"},
        *({"problem": "P4", "building": each} for each in BUILDINGS),
    ]
    for problem in problems:
        for perspective in PERSPECTIVES:
            for engine in ENGINES:
                slots = {"slot_s": 10.0} if engine == "grid" else {}
                yield {
                    "mission": mission,
                    **problem,
                    "perspective": perspective,
                    "engine": engine,
                    **slots,
                }
    for perspective in PERSPECTIVES:
        for trajectory in ("direct", "traj1", "traj2"):
            yield {
                "mission": mission,
                "problem": "P1",
                "trajectory": trajectory,
                "perspective": perspective,
            }
        for order in ("rest-first", "hover-first"):
            building = BUILDINGS[0]
            yield {
                "mission": mission,
                "problem": "P4",
                "building": building,
                "order": order,
                "perspective": perspective,
            }
            yield {
                "mission": mission,
                "problem": "P1",
                "order": order,
                "perspective": perspective,
                "change": {"limits.deadline_s": SHORT[mission]},
            }
    for perspective in ("battery", "adjusted"):
        yield {"mission": mission, "problem": "P1", "perspective": perspective, "slot_s": 1.0}
        yield {
            "mission": mission,
            "problem": "P1",
            "perspective": perspective,
            "slot_s": 10.0,
            "engine": "cvxpy",
        }


def _several_stops(mission: str) -> Iterator[Case]:
    for perspective in ("battery", "available"):
        for stops, hovers in ((2, 1), (1, 2), (0, 1)):
            yield {
                "mission": mission,
                "problem": "P1",
                "perspective": perspective,
                "stops": stops,
                "hovers": hovers,
            }


def _schedules(mission: str) -> Iterator[Case]:
    for schedule in ("sequential", "alternating", "round-robin", "most-available"):
        yield {
            "mission": mission,
            "problem": "P3",
            "perspective": "available",
            "change": {
                "battery.schedule": schedule,
                **({"battery.period_s": 20.0} if schedule == "alternating" else {}),
            },
        }


def _infeasible(mission: str) -> Iterator[Case]:
    for change in ({"limits.deadline_s": 20.0}, {"limits.min_soc": 0.97}):
        for perspective in ("battery", "available"):
            yield {
                "mission": mission,
                "problem": "P1",
                "perspective": perspective,
                "change": change,
            }
    yield {
        "mission": mission,
        "problem": "P4",
        "building": BUILDINGS[0],
        "perspective": "available",
        "change": {"limits.deadline_s": 60.0},
    }


def ask(case: Case) -> optuav.Plan:
    """The plan that the package gives for a case."""
    options = dict(case)
    source = options.pop("mission")
    changes = BEFORE.get(source, {}) | options.pop("change", {})
    mission = optuav.load(source).replace(changes)
    problem = problem_of(
        options.pop("problem"), **{field: options.pop(field) for field in FIELDS & options.keys()}
    )
    return optuav.solve(mission, problem, **options)


def answer(case: Case) -> dict[str, Any]:
    """What is frozen of the answer to a case."""
    try:
        plan = ask(case)
    except optuav.InputError:
        return {"refused": True}
    found: dict[str, Any] = {"status": plan.status.value}
    if plan:
        found |= {
            "route": list(plan.route),
            "hover_time_s": plan.hover_time_s,
            "rest_time_s": plan.rest_time_s,
            "flight_time_s": plan.flight_time_s,
            "flyable": plan.flyable,
            "runs_dry_s": plan.runs_dry_s,
            "soc": plan.soc,
        }
    return found


def name(case: Case) -> str:
    """The case in a line."""
    changes = case.get("change", {})
    words = [f"{key}={value}" for key, value in case.items() if key != "change"]
    return " ".join([*words, *(f"{key}={value}" for key, value in changes.items())])


if __name__ == "__main__":
    frozen = [{"case": each, "answer": answer(each)} for each in cases()]
    lines = ",\n".join(json.dumps(each) for each in frozen)
    Path(sys.argv[1]).write_text(f"[\n{lines}\n]\n", encoding="utf-8")

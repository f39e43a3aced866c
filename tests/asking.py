"""The public functions with the fields of a problem among their options, for tests over both."""

from __future__ import annotations

from typing import Any

import optuav
from optuav.solving.question import problem_of

FIELDS = ("trajectory", "building", "order", "hover_point", "speed", "stops", "hovers")


def _stated(problem: Any, options: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    fields = {name: options[name] for name in FIELDS if name in options}
    others = {name: value for name, value in options.items() if name not in FIELDS}
    return (problem_of(problem, **fields) if fields else problem), others


def stated(options: dict[str, Any]) -> dict[str, Any]:
    """Options with the problem as an object."""
    problem, others = _stated(options.get("problem", "P1"), options)
    return {**others, "problem": problem}


def solve(mission: Any, problem: Any = "P1", **options: Any) -> optuav.Plan:
    """As `optuav.solve`."""
    stated, others = _stated(problem, options)
    return optuav.solve(mission, stated, **others)


def formulate(mission: Any, problem: Any = "P1", **options: Any) -> optuav.Program:
    """As `optuav.formulate`."""
    stated, others = _stated(problem, options)
    return optuav.formulate(mission, stated, **others)


def explain(subject: Any, problem: Any = "P1", **options: Any) -> Any:
    """As `optuav.explain` of a mission."""
    stated, others = _stated(problem, options)
    return optuav.explain(subject, stated, **others)

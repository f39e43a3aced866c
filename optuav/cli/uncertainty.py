"""``optuav sensitivity`` and ``robust``: hover times when numbers are uncertain."""

from __future__ import annotations

from pathlib import Path

import typer

import optuav
from optuav.cli.options import mission_of
from optuav.cli.output import NO, say
from optuav.cli.study_options import StudyOptions
from optuav.errors import Fault, collected, refuse
from optuav.options import Order, Perspective


def sensitivity(
    mission: str,
    uncertainty: Path | None = None,
    perspective: Perspective = "available",
    plan: Path | None = None,
    samples: int = 10_000,
    seed: int = 0,
    *,
    out: StudyOptions,
) -> None:
    """Find which numbers matter most, and how their uncertainty changes the hover time.

    Exit code 1 if the mission has no plan.
    """
    effects = optuav.sensitivity(
        out.mission(mission),
        uncertainty,
        perspective=perspective,
        plan=plan,
        samples=samples,
        seed=seed,
    )
    out.deliver(effects)
    if not effects.hover_time_s:
        raise typer.Exit(NO)


def robust(
    mission: str,
    uncertainty: Path,
    problem: str = "P1",
    building: str | None = None,
    order: Order | None = None,
    perspective: Perspective = "available",
    chance: float | None = None,
    confidence: float = 0.99,
    samples: int = 20_000,
    seed: int = 0,
    explain: bool = False,
    *,
    out: StudyOptions,
) -> None:
    """Find the longest hover that can be flown with any numbers in a box of ranges.

    Exit code 1 if no plan holds in the whole box, or in the share --chance of it.
    """
    from optuav.service.uncertainty_box import stated_ranges
    from optuav.solving.question import problem_of

    faults, stated_problem = list[Fault](), None
    if explain and out.as_json:
        faults.append(Fault("explain", "", "cannot be combined with --json"))
    with collected(faults):
        stated_problem = problem_of(problem, building=building, order=order)
    if faults:
        with collected(faults):
            mission_of(mission, out.settings)
        with collected(faults):
            stated_ranges(uncertainty)
    refuse(faults)
    assert stated_problem is not None
    plans = optuav.robust(
        out.mission(mission),
        uncertainty,
        stated_problem,
        perspective=perspective,
        chance=chance,
        confidence=confidence,
        samples=samples,
        seed=seed,
    )
    out.deliver(plans)
    if explain:
        say(f"\n{optuav.explain(plans)}")

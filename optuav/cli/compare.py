"""``optuav compare``: answers of all engines, or plans, side by side."""

from __future__ import annotations

import typer

import optuav
from optuav.cli.output import FAILED, NO, progress
from optuav.cli.study_options import WORKERS, StudyOptions
from optuav.errors import Fault, InputError, decimal
from optuav.options import Perspective


def compare(
    mission: str,
    slots_s: str | None = None,
    perspective: Perspective | None = None,
    engines: str | None = None,
    time_limit_s: float | None = None,
    by: str | None = None,
    times: bool = False,
    *,
    out: StudyOptions,
) -> None:
    """Compare the answers of all engines, with slots and continuous times, or compare plans.

    Exit code 1 if answers disagree or there is no feasible plan, 3 if an engine failed.
    """
    from optuav.studies.compare_methods import MethodComparison

    try:
        lengths_s = None if slots_s is None else [decimal(length) for length in slots_s.split(",")]
    except ValueError:
        words = "numbers of seconds with commas between them, such as 0.5,1,60"
        raise InputError([Fault("--slots", repr(slots_s), words)]) from None
    with progress() as bar:
        compared = optuav.compare(
            out.mission(mission),
            by=_names(by) or "method",
            perspective=perspective,
            slots_s=lengths_s,
            engines=_names(engines),
            time_limit_s=time_limit_s,
            times=times,
            progress=bar,
            workers=1 if by else WORKERS,
        )
    out.deliver(compared)
    by_method = compared if isinstance(compared, MethodComparison) else None
    if by_method and by_method.failures:
        raise typer.Exit(FAILED)
    has_plan = any(row["hover_time_s"] is not None for row in compared.rows)
    if not has_plan or (by_method and by_method.disagreements):
        raise typer.Exit(NO)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",")]

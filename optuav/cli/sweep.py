"""``optuav sweep``: long studies in parts, which go on where they were ended."""

from __future__ import annotations

import time
from pathlib import Path

import optuav
from optuav.cli.output import check_places, deliver, progress
from optuav.errors import Fault, InputError


def sweep(
    study: Path,
    workers: int = 1,
    scheduler: str | None = None,
    as_json: bool = False,
    plot: Path | None = None,
) -> None:
    """Solve all scenarios of a study, in parts that are kept (needs pyarrow)."""
    check_places(None, plot)
    if plot is not None:
        from optuav.studies.study import read_study

        if not read_study(study).is_drawable:
            raise InputError(
                [Fault("plot", "", "goes with [grid] alone, of one or two keys with values")]
            )
    began_s = time.monotonic()
    with progress("scenarios") as bar:
        done = optuav.sweep(study, workers=workers, scheduler=scheduler, progress=bar)
    took_s = time.monotonic() - began_s
    written = []
    if plot is not None:
        drawn = optuav.plots.swept(optuav.open_sweep(done.directory))
        written = optuav.plots.save_figures(drawn, plot)
    shown = [
        f"Scenarios  {done.scenarios}",
        f"Parts      {done.parts}" + f", {done.kept} of them from before" * bool(done.kept),
        f"Directory  {done.directory}",
    ]
    without = {name: sum(each.values()) for name, each in done.reasons.items()}
    plans = {name: done.scenarios - count for name, count in without.items()}
    for name, reasons in done.reasons.items():
        why = [f"{count} without: {words}" for words, count in reasons.items()]
        shown.append(f"Plans      {'; '.join([f'{name} {plans[name]}', *why])}")
    deliver(
        lambda: {
            "kind": "optuav sweep",
            **done._asdict(),
            "directory": str(done.directory),
            "plans": plans,
            "without_plan": without,
            "elapsed_s": round(took_s, 3),
        },
        shown,
        as_json=as_json,
        written=written,
    )

"""``optuav sweep``: long studies in parts, which go on where they were ended."""

from __future__ import annotations

import time
from pathlib import Path

from optuav.cli.output import check_places, deliver, progress
from optuav.errors import Fault, refuse


def sweep(
    study: Path,
    workers: int = 1,
    scheduler: str | None = None,
    resume: bool = True,
    as_json: bool = False,
    plot: Path | None = None,
) -> None:
    """Solve all scenarios of a study, in parts that are kept (needs pyarrow)."""
    check_places(None, plot)
    from optuav.studies.sweep import open_sweep, planned, run

    plan = planned(study, workers, scheduler)
    if plot is not None and not plan.is_drawable:
        words = "goes with up to three keys, of several values each, one of them in [grid]"
        refuse([Fault("plot", "", words)])
    began_s = time.monotonic()
    with progress("scenarios") as bar:
        done = run(plan, workers, scheduler, resume, bar)
    took_s = time.monotonic() - began_s
    written = list[Path]()
    if plot is not None:
        from optuav import plots

        written = plots.save_figures(plots.swept(open_sweep(done.directory)), plot)
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
        if ends := done.hover_time_s[name]:
            shown.append(f"Hover      {name} {ends['shortest']:.2f} to {ends['longest']:.2f} s")
    deliver(
        lambda: {
            "kind": "optuav sweep",
            **done._asdict(),
            "directory": str(done.directory),
            "plans": plans,
            "without_plan": without,
            "pictures": [*map(str, written)],
            "elapsed_s": round(took_s, 3),
        },
        shown,
        as_json=as_json,
        written=written,
    )

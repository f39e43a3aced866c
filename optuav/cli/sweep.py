"""``optuav sweep``: all scenarios of a study, saved part by part."""

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
    """Solve all scenarios of a study, saved part by part (needs pyarrow)."""
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

        drawn = plots.swept(open_sweep(done.directory))
        written = plots.files.save_everywhere(drawn, plot)
    more = {"pictures": [str(path) for path in written], "elapsed_s": round(took_s, 3)}
    deliver(lambda: done.to_dict() | more, done.blocks(), as_json=as_json, written=written)

"""``optuav sweep``: all scenarios of a study, saved part by part."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from optuav.cli.output import check_places, deliver, progress
from optuav.errors import Fault, refuse
from optuav.presentation.blocks import Facts

if TYPE_CHECKING:
    from optuav.studies.sweep import Swept


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

        written = plots.save_figures(plots.swept(open_sweep(done.directory)), plot)
    plans = {name: done.scenarios - sum(why.values()) for name, why in done.reasons.items()}
    data = {
        "kind": "optuav sweep",
        **done._asdict(),
        "directory": str(done.directory),
        "plans": plans,
        "without_plan": {name: done.scenarios - count for name, count in plans.items()},
        "pictures": [str(path) for path in written],
        "elapsed_s": round(took_s, 3),
    }
    deliver(
        lambda: data, [Facts([*_swept(done, plans)], whole=True)], as_json=as_json, written=written
    )


def _swept(done: Swept, plans: Mapping[str, int]) -> Iterator[tuple[str, str]]:
    """Yield how many scenarios have a plan, why others have none, and the range of hovers."""
    yield "Scenarios", f"{done.scenarios}"
    yield "Parts", f"{done.parts}" + f", {done.kept} of them from before" * bool(done.kept)
    yield "Directory", f"{done.directory}"
    for name, reasons in done.reasons.items():
        why = [f"{count} without: {words}" for words, count in reasons.items()]
        yield "Plans", "; ".join([f"{name} {plans[name]}", *why])
        if ends := done.hover_time_s[name]:
            yield "Hover", f"{name} {ends['shortest']:.2f} to {ends['longest']:.2f} s"

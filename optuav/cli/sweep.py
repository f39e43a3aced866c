"""``optuav sweep``: long studies in parts, which go on where they were ended."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import optuav
from optuav.cli.output import check_places, deliver, progress


def sweep(
    study: Path,
    workers: int = 1,
    scheduler: str | None = None,
    as_json: bool = False,
    plot: Path | None = None,
) -> None:
    """Solve all scenarios of a study file, in parts that are kept (needs pyarrow)."""
    check_places(None, plot)
    if plot is not None:
        from optuav.studies...
    began_s = time.monotonic()
    with progress() as bar:
        done = optuav.sweep(study, workers=workers, scheduler=scheduler, progress=bar)

"""``optuav audit``: the verdict on a saved plan or on somebody else's itinerary."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from optuav.cli.options import JsonOption
from optuav.cli.output import NO, deliver


def audit(
    plan: Annotated[
        str,
        typer.Argument(
            metavar="FILE",
            help="A saved plan (.json), or an itinerary (.toml): schema, mission and tables "
            'stops with at, kind = "rest" or "hover", and duration_s.',
        ),
    ],
    as_json: JsonOption = False,
    plot: Annotated[
        Path | None,
        typer.Option(
            "--plot",
            metavar="FILE",
            help="Write altitude, speed and power over time as PNG (needs matplotlib).",
        ),
    ] = None,
) -> None:
    """Simulate a plan from its mission, and say whether it can be flown.

    Exit code 1 if it cannot, 2 if the file cannot be read.
    """
    from optuav.judge import audit as judge

    judged = judge(plan)
    written = []
    if plot is not None and judged.replay is not None and judged.replay.phases:
        from optuav import plots

        written.append(plots.save(plots.profile(judged.replay), plot))
    deliver(judged.to_dict, str(judged), as_json=as_json, written=written)
    if not judged:
        raise typer.Exit(NO)

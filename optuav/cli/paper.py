"""``optuav reproduce`` and ``ledger``: the tables, figures and numbers of the paper."""

from __future__ import annotations

from pathlib import Path

import typer

import optuav
from optuav.cli.output import NO, check_places, deliver, progress, say
from optuav.cli.study_options import WORKERS
from optuav.presentation.blocks import Block, Note


def reproduce(
    out: Path = Path("reproduced"), only: list[str] | None = None, mission: str | None = None
) -> None:
    """Reproduce every table and figure of the paper, with a report that opens offline.

    Exit code 1 if the mission has no plan.
    """
    from optuav.paper.curves import solve
    from optuav.paper.figures import why

    check_places(None, out)
    studied = None if mission is None else optuav.load(mission)
    with progress() as bar:
        written = optuav.reproduce(
            out, only=only or (), mission=studied, progress=bar, workers=WORKERS
        )
    say(f"wrote {len(written)} files, among them {out / 'report.html'}")
    if studied is not None and not (plan := solve(studied)):
        say(f"{studied.name} has no plan: {why(plan)}")
        raise typer.Exit(NO)


def ledger(
    names: list[str] | None = None,
    details: bool = False,
    as_json: bool = False,
    save: Path | None = None,
) -> None:
    """Recompute the paper's numbers, and say which match and why others do not."""
    check_places(save, None, ".csv")
    with progress():
        entries = optuav.ledger(names or ())
    if save is not None:
        from optuav.mission.files import write_text

        write_text(save, entries.to_csv())
    blocks: list[Block] = [*(entries.entry_blocks() if names or details else entries.blocks())]
    if not (names or details):
        blocks.append(Note(["With reasons: optuav ledger --details, or NAME..."]))
    deliver(entries.records, blocks, as_json=as_json)

"""Plans by perspective and trajectory as a rich table of at most 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import RenderableType
from rich.text import Text

from optuav.judge.tolerance import TOLERANCE
from optuav.mission.words import counted_in
from optuav.studies.choices import Choice, Choices
from optuav.studies.tables import NONE, add_route_column, between_ends, plain_table

GROUNDED = {
    "dry": "cannot be flown, no available charge is left then",
    "full": "cannot be flown, charging would drive the available well past full",
    "low": "cannot be flown, less than limits.min_soc is left in both wells together",
    "no": "cannot be flown, optuav solve and audit tell why",
}
"""What stands under "flies", its first word, where a plan does not."""


def choice_tables(found: Choices) -> Iterator[RenderableType]:
    """One line a plan with whether it can be flown, and how each is known."""
    times = counted_in(found.slot_s)
    heading = f"{found.mission.name}: longest hover by {' and '.join(found.by)}, {times}"
    yield Text(heading, style="bold")
    yield ""
    table = plain_table()
    for name in ("perspective", "trajectory"):
        table.add_column(name, no_wrap=True)
    for name in ("Δ [s]", "T' [s]", "T [s]", "η1 [%]"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    add_route_column(table)
    table.add_column("flies", no_wrap=True)
    before, answers = "", [_flies(row, found.mission.limits.min_soc) for row in found.rows]
    for row, flies in zip(found.rows, answers, strict=True):
        figures = (row.hover_time_s, row.rest_time_s, row.mission_time_s)
        table.add_row(
            row.perspective if row.perspective != before else "",
            row.trajectory,
            *(NONE if each is None else f"{each:.2f}" for each in figures),
            f"{100.0 * row.soc['battery']:.2f}" if row.soc else "–",
            between_ends(row.route),
            flies,
        )
        before = row.perspective
    yield table
    yield ""
    said = {each.partition(" ")[0] for each in answers}
    if grounded := [word for word in GROUNDED if word in said]:
        yield from (Text(f"{word}: {GROUNDED[word]}") for word in grounded)
        yield ""
    for proof in dict.fromkeys(row.proof for row in found.rows):
        yield Text(f"{', '.join(_known_by(found.rows, proof))}: {proof}")
    for why in dict.fromkeys(why for row in found.rows for why in row.reasons):
        yield Text(f"Because {why}")


def _flies(row: Choice, min_soc: float) -> str:
    """Whether a plan can be flown, or what keeps it from that first and from when on."""
    if row.flyable is None:
        return "–"
    if row.flyable:
        return "yes"
    moments = {"dry": row.runs_dry_s, "full": row.overfull_s}
    known = [(moment_s, word) for word, moment_s in moments.items() if moment_s is not None]
    if known:
        first_s, word = min(known)
        return f"{word} {first_s:.0f} s"
    return "low" if row.soc and row.soc["battery"] < min_soc - TOLERANCE else "no"


def _known_by(rows: Sequence[Choice], proof: str) -> Iterator[str]:
    """Which perspectives, or where they differ in it which plans, are known by a proof."""
    for name in dict.fromkeys(row.perspective for row in rows):
        own = [row for row in rows if row.perspective == name]
        trajectories = [row.trajectory for row in own if row.proof == proof]
        if len(trajectories) == len(own):
            yield name
        else:
            yield from (f"{name} {trajectory}" for trajectory in trajectories)

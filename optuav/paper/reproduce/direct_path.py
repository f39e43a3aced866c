"""Table II: the direct path in every perspective."""

from __future__ import annotations

from collections.abc import Iterator

from formulations.perspectives import PAPER
from optuav import plots
from optuav.mission import Mission
from optuav.paper.ledger import Verdict
from optuav.paper.ledger.cells import whole_slots
from optuav.paper.ledger.scenario import papers
from optuav.paper.ledger.statement import Entry, agrees
from optuav.paper.ledger.table2 import statements
from optuav.paper.reproduce.exhibit import (
    OURS,
    Exhibit,
    LeftOut,
    caption,
    heading,
    is_papers,
    percent,
    stem,
)
from optuav.paper.reproduce.perspectives import deadlines_s
from optuav.paper.reproduce.plans import grounded, no_plan, solve, without
from optuav.plan import Plan

HEAD = ("direct path", "Δ [s]", "T [s]", "η1 [%]", "η2 [%]", "η3 [%]")
WIDTHS = (2.6, 1.0, 1.0, 1.0, 1.0, 1.0)


def direct_path(mission: Mission) -> Iterator[Exhibit | LeftOut]:
    """The table as it comes out for a mission, in slots of one second as in the paper."""
    plans = [
        solve(
            mission.replace({"limits.deadline_s": deadline_s}),
            "P3",
            perspective=perspective,
            slot_s=mission.limits.slot_s,
        )
        for deadline_s in deadlines_s(mission)
        for perspective in (*PAPER, OURS)
    ]
    found = [plan for plan in plans if plan]
    if not found:
        yield no_plan(plans[0])
        return
    rows = [_row(plan) for plan in found]
    yield Exhibit(
        f"direct-path.{stem(mission)}",
        caption(
            mission,
            "Perspectives on the direct path",
            "Table II",
            f"slots of {mission.limits.slot_s:g} s",
        ),
        plots.table(HEAD, rows, title=f"{heading(mission)}: the direct path", widths=WIDTHS),
        [
            {
                "deadline_s": plan.mission.limits.deadline_s,
                "perspective": plan.perspective,
                "hover_time_s": plan.hover_time_s,
                "mission_time_s": plan.mission_time_s,
                **{
                    f"eta{number}_percent": percent((plan.soc or {})[name])
                    for number, name in enumerate(PAPER, start=1)
                },
                "runs_dry_s": plan.runs_dry_s,
                "overfull_s": plan.overfull_s,
            }
            for plan in found
        ],
        (*grounded(found, "rows"), *_missing(plans)),
    )
    if is_papers(mission):
        yield _beside_the_paper(mission)


def _row(plan: Plan) -> tuple[str, ...]:
    soc = plan.soc or {}
    return (
        f"{plan.mission.limits.deadline_s:g} s, {plan.perspective}",
        f"{plan.hover_time_s:.2f}",
        f"{plan.mission_time_s:.2f}",
        *(f"{100.0 * soc[name]:.2f}".replace("-", "\N{MINUS SIGN}") for name in PAPER),
    )


def _missing(plans: list[Plan]) -> Iterator[str]:
    yield from without({f"{p.mission.limits.deadline_s:g} s, {p.perspective}": p for p in plans})


def _beside_the_paper(mission: Mission) -> Exhibit:
    """The paper's cells, each with ours below it."""
    both = papers()
    told = [each for each in statements() if not each.given]
    entries = [Entry(each, *(each.compute(scenario) for scenario in both)) for each in told]
    by_printed = mission.name == "paper"
    ours = [entry.printed if by_printed else entry.recovered for entry in entries]
    rows, marked = [], {}
    for number in range(len(entries) // 5):
        cells = slice(5 * number, 5 * number + 5)
        row, values = entries[cells], ours[cells]
        name = row[0].statement.how.removeprefix("(P3), ").removesuffix(", slots of 1 s")
        rows.append((f"printed: {name}", *(each.statement.stated for each in row)))
        pairs = list(zip(row, values, strict=True))
        slots_s = whole_slots(row[0].statement.stated)
        shown = (each.shown(value) for each, value in pairs)
        rows.append((f"   ours, η at Δ = {slots_s:g} s", *shown))
        for column, (each, value) in enumerate(pairs, start=1):
            if each.verdict is Verdict.CONTRADICTS:
                marked[2 * number, column] = "contradicts other cells of the table"
            if not agrees(each.statement.stated, value):
                marked[2 * number + 1, column] = "other digits than the paper's"
    return Exhibit(
        f"table2.{stem(mission)}",
        f"Table II of the paper, and every cell by {mission.name}; η at the paper's Δ, whole slots",
        plots.table(
            HEAD,
            [tuple(cell.replace("-", "\N{MINUS SIGN}") for cell in row) for row in rows],
            title=f"Table II, and the same cells by {heading(mission)}",
            widths=WIDTHS,
            marked=marked,
        ),
        [
            {
                "cell": each.statement.name,
                "paper": each.statement.stated,
                "ours": value,
                "shows_the_printed_digits": agrees(each.statement.stated, value),
            }
            for each, value in zip(entries, ours, strict=True)
        ],
    )

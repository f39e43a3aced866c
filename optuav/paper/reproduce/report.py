"""The report: studies with their pictures, Table II and its fit, and the whole ledger."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from optuav.mission import Mission
from optuav.paper.ledger import Ledger, Verdict, cells
from optuav.paper.ledger.admitted import loads_exist
from optuav.paper.ledger.entries import NOT_COUNTED
from optuav.paper.reproduce.document import Block, Heading, Listing, Paragraph, Picture, Table
from optuav.paper.reproduce.exhibit import Exhibit, LeftOut, Study
from optuav.paper.reproduce.misprints import all_misprints
from optuav.paper.reproduce.plans import solve, why

PAPER = (
    'W. Jaafar, H. Yanikomeroglu, "Dynamics of Laser-Charged UAVs: A Battery Perspective", IEEE '
    "Internet of Things Journal, 2021 (arXiv:2008.13316)"
)
COLUMNS = ("place", "what", "stated", "unit", "by printed", "by recovered", "verdict", "why")


def title(missions: Sequence[Mission], entries: Ledger | None) -> str:
    """Of the report."""
    if entries is not None:
        return "The paper, reproduced"
    return f"The paper's studies for {', '.join(mission.name for mission in missions)}"


def blocks(
    missions: Sequence[Mission],
    made: Mapping[Study, Sequence[Exhibit]],
    left_out: Sequence[tuple[Study, Mission, LeftOut]],
    entries: Ledger | None,
) -> Iterator[Block]:
    """The report.

    Parameters
    ----------
    missions
        What it is about.
    made
        The studies with their exhibits, in order.
    left_out
        What of them is not there.
    entries
        The ledger; None where it was not asked for.
    """
    yield Heading(title(missions, entries), 1)
    names = " and ".join(mission.name for mission in missions)
    word = "mission" if len(missions) == 1 else "missions"
    yield Paragraph(
        f"Everything here was computed by optuav from the {word} {names}. The paper: {PAPER}."
    )
    for mission in missions:
        if not (plan := solve(mission)):
            yield Paragraph(f"{mission.name} has no plan: {why(plan)}.")
    if entries is not None:
        yield from _in_short(entries)
        yield from _fit(entries)
    for study, exhibits in made.items():
        if not exhibits:
            continue
        yield Heading(study.title)
        for exhibit in exhibits:
            yield Picture(exhibit.name, exhibit.caption)
            if exhibit.findings:
                yield Listing(exhibit.findings)
            if exhibit.name == "misprints.paper":
                yield _misprints(missions)
    yield from _left_out(left_out)
    if entries is not None:
        yield from _whole(entries)


def _left_out(left_out: Sequence[tuple[Study, Mission, LeftOut]]) -> Iterator[Block]:
    """What is not there, by reason."""
    by_reason: dict[tuple[str, str], list[str]] = {}
    for study, mission, each in left_out:
        what = f"{study.title}, {each.what}" if each.what else study.title
        by_reason.setdefault((mission.name, each.why), []).append(what)
    if by_reason:
        yield Heading("Not shown")
        yield Listing(
            tuple(
                f"{name}: {'; '.join(what)}. Why: {reason}."
                for (name, reason), what in by_reason.items()
            )
        )


def _in_short(entries: Ledger) -> Iterator[Block]:
    yield Paragraph(
        "Two missions stand for the paper. `paper` has its printed parameters; they do not give "
        "the flight times and voltages that the paper reports. `paper-table2` has loads recovered "
        "from the paper's own results."
    )
    yield Heading("In short")
    in_words = entries.in_words.counts
    rows = [(verdict.value, n, in_words.get(verdict, 0)) for verdict, n in entries.counts.items()]
    rows.append(("all", len(entries.entries), len(entries.in_words.entries)))
    yield Table(
        ("verdict", "statements of the paper", "of these in words"),
        [tuple(map(str, row)) for row in rows],
    )


def _misprints(missions: Sequence[Mission]) -> Block:
    paper = next(mission for mission in missions if mission.name == "paper")
    return Table(("where", "printed", "right", "effect"), [tuple(e) for e in all_misprints(paper)])


def _fit(entries: Ledger) -> Iterator[Block]:
    found = entries.cells_of_table2()
    if not found:
        return
    fitted, predicted, within, ruled_out = (
        sum(cell.verdict is verdict for cell in found)
        for verdict in (Verdict.FITTED, Verdict.RECOVERED, Verdict.WITHIN, Verdict.CONTRADICTS)
    )
    flight_W, hover_W = cells.SHOW_ALL_W.values()
    yield Heading("Table II and the fit behind it")
    yield Paragraph(
        f"Of the {len(found)} cells of Table II {fitted + predicted + within} agree with "
        f"`paper-table2`: {fitted + predicted} in every printed digit, of which {fitted} were used "
        f"in the fit and {predicted} follow from it, and {within} to one digit less. What these "
        "miss by is less than the fit leaves open, as what it met was rounded: with "
        f"{flight_W} W in flight and {hover_W} W in hover all {fitted + predicted + within} show "
        f"every digit. The other {ruled_out} cannot, whatever the loads."
    )
    yield Paragraph(
        f"The fit has {len(cells.FREE_PARAMETERS)} free parameters and {cells.FIT_NUMBERS} "
        "different numbers to meet, so it must meet them; only what was not fitted tests it, and "
        f"the {predicted} cells test little: that Δ is 697 and 950 s and not one slot more, that "
        "T_max = 800 s binds, and four times a charge between two that were fitted. E_1 and E_2 "
        "are the paper's. Two readings were chosen as well, because they match: the four charges, "
        "24.27 %, are those of Δ = 741 s, the whole slots of the rows' 740.65 s, at which it would "
        "be 24.30 %; and the falls of Fig. 7 are by way of the building that gives the 951 s of "
        "Fig. 8."
    )
    yield Listing(
        (
            f"Free parameters: {'; '.join(cells.FREE_PARAMETERS)}.",
            f"Data: {'; '.join(cells.FIT_DATA)}.",
        )
    )
    yield Paragraph(
        "The adjusted perspective counts joules against E_1 in flight and E_2 in hover, which are "
        "the capacity times the voltage at which each draws its charge: the voltage cancels, and "
        "η3 is η1 by construction. The cells of η3 test only that 15.4 V and 14.33 V are the "
        "voltages of the fitted loads."
    )
    loads = "exists" if loads_exist(cells.consistent_cells()) else "does not exist"
    yield Paragraph(
        f"A set of loads that shows every digit of the {len(found) - ruled_out} cells, of both "
        f"voltages and of the crossing at 39 000 A s at once {loads} (linear programming over the "
        "loads; on one path every η is a straight line in Δ). With any of the other four none "
        "does:"
    )
    yield Table(
        ("cell", "printed", "by paper-table2", "why it cannot be matched"),
        [
            (
                f"{cell.statement.place}, {cell.statement.what}",
                f"{cell.statement.stated} %",
                f"{cell.shown(cell.recovered)} %",
                cell.reason,
            )
            for cell in found
            if cell.verdict is Verdict.CONTRADICTS
        ],
    )


def _whole(entries: Ledger) -> Iterator[Block]:
    yield Heading("The ledger")
    yield Paragraph(
        f"Every number that the paper states, and the findings in words. A "
        "value matches if it shows the printed digits, and not otherwise; a limit that matches "
        "only when it is cut, not rounded, is told apart. `optuav ledger NAME` computes one again; "
        "names and commands stand in data/ledger.csv. A command that names `paper-table2` gives "
        "the recovered value, and with `paper` in its place the printed one. The constants c_1 to "
        f"c_9 count as equation (5). Not counted: {'; '.join(NOT_COUNTED)}."
    )
    yield Table(
        COLUMNS,
        [
            (
                entry.statement.place,
                entry.statement.what,
                entry.statement.stated,
                entry.statement.unit,
                entry.shown(entry.printed),
                entry.shown(entry.recovered),
                entry.verdict.value,
                entry.reason,
            )
            for entry in entries.entries
        ],
    )

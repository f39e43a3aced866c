"""Comparisons as rich tables of at most 80 columns; every detail stands in their data."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from optuav.studies.choices import Choices
from optuav.studies.comparison import Cell, Comparison, Method, Row

WIDTH = 80
SLOTS_ABREAST = 5
MOST_LINES = 12
LONGEST_NAME = 24
NONE, WRONG = "none", "!"


def as_text(pieces: Iterable[RenderableType]) -> str:
    """What a terminal of 80 columns without colours would show."""
    screen = Console(file=io.StringIO(), width=WIDTH, color_system=None, highlight=False)
    for piece in pieces:
        screen.print(piece)
    assert isinstance(screen.file, io.StringIO)
    return "\n".join(line.rstrip() for line in screen.file.getvalue().splitlines())


def comparison_tables(found: Comparison, *, times: bool = False) -> Iterator[RenderableType]:
    """Gaps by programme and length of slot, what each method is worth, and the verdict."""
    heading = f"{found.mission.name}: longest hover Δ, {found.perspective}, by every method"
    yield Text(heading, style="bold")
    by_slot: dict[float, Method] = {}
    for method in found.methods:
        if method.slot_s is not None:
            by_slot.setdefault(method.slot_s, method)
    methods = list(by_slot.values())
    for first in range(0, max(1, len(methods)), SLOTS_ABREAST):
        yield ""
        if methods:
            yield "Δ in continuous times, and what is lost of it in slots of"
        yield _gaps(found, methods[first : first + SLOTS_ABREAST])
    yield ""
    yield _worth(found, times)
    yield ""
    if found:
        yield _proofs(found)
        yield ""
    yield from _verdict(found)


def _gaps(found: Comparison, methods: Sequence[Method]) -> Table:
    table = _table()
    table.add_column("problem", no_wrap=True, max_width=LONGEST_NAME)
    table.add_column(Text("Δ [s]"), justify="right", no_wrap=True)
    for method in methods:
        table.add_column(Text(f"{method.slot_s:g} s"), justify="right", min_width=6)
    table.add_column("agree", justify="right")
    for row in found.rows:
        cells = {cell.method: cell for cell in row.cells}
        reference = next(iter(row.cells), None)
        hover_s = None if reference is None else reference.hover_time_s
        table.add_row(
            Text(row.name),
            NONE if hover_s is None else f"{hover_s:.3f}",
            *(_gap(cells.get(method)) for method in methods),
            _agreement(row),
        )
    return table


def _gap(cell: Cell | None) -> Text:
    """What a cell of the first table says."""
    if cell is None:
        return Text("–")
    if cell.agrees is None:
        return Text("failed", style="bold red")
    text = NONE if cell.gap_s is None else f"{round(cell.gap_s, 2) + 0.0:.2f}"
    return Text(text) if cell.agrees else Text(f"{text}{WRONG}", style="bold red")


def _agreement(row: Row) -> Text:
    if any(cell.agrees is False for cell in row.cells):
        return Text("NO", style="bold red")
    if not row.cells:
        return Text("–")
    return Text("yes" if all(cell.agrees for cell in row.cells) else "?")


def _worth(found: Comparison, times: bool) -> Table:
    table = _table()
    table.add_column("method", no_wrap=True)
    for heading in ("largest gap [s]", "its bound [s]", "agree", *(["time [s]"] if times else [])):
        table.add_column(Text(heading), justify="right", no_wrap=True)
    for method in found.methods:
        cells = [cell for _, cell in found.cells if cell.method == method]
        if not cells:
            continue
        worst = max(cells, key=_size)
        if method is found.methods[0]:
            gap = "reference"
        elif worst.gap_s is None:
            gap = NONE
        else:
            gap = _short(worst.gap_s if method.slot_s else abs(worst.gap_s))
        table.add_row(
            method.name,
            gap,
            NONE if worst.gap_s is None else _allowed(worst),
            f"{sum(cell.agrees is True for cell in cells)} of {len(cells)}",
            *([f"{sum(cell.time_s for cell in cells):.2f}"] if times else []),
        )
    return table


def _proofs(found: Comparison) -> Table:
    """How the methods know, those that differ in the length of slots only as one."""
    proofs: dict[str, dict[str, None]] = {}
    for _, cell in found.cells:
        if cell.hover_time_s is not None:
            kind = cell.method.name.removesuffix(f" {cell.method.slot_s or 0.0:g} s")
            proofs.setdefault(kind, {})[cell.proof.partition(";")[0]] = None
    table = _table()
    table.add_column("method", no_wrap=True)
    table.add_column("how it knows")
    for kind, words in proofs.items():
        table.add_row(kind, Text("; ".join(words).removeprefix(f"{kind}: ")))
    return table


def _allowed(cell: Cell) -> str:
    if cell.method.slot_s is None:
        return _short(cell.allowance_s)
    return "no bound" if cell.largest_gap_s is None else _short(cell.largest_gap_s)


def _size(cell: Cell) -> float:
    """How large a gap is on either side of the reference [s]; -1 where there is none."""
    return -1.0 if cell.gap_s is None else abs(cell.gap_s)


def _short(seconds: float) -> str:
    return f"{seconds:.2f}" if abs(seconds) >= 0.01 else f"{seconds:.0e}" if seconds else "0"


def _verdict(found: Comparison) -> Iterator[Text]:
    for row in found.rows:
        if row.reasons and (row.problem == "P1" or not row.cells):
            yield Text(f"{row.name} has no plan: {'; '.join(row.reasons)}")
    unbounded = {
        cell.words.partition(": ")[2]: None
        for _, cell in found.cells
        if cell.method.slot_s is not None and cell.gap_s is not None and cell.largest_gap_s is None
    }
    for why in unbounded:
        yield Text(f"The theory has no bound where {why}.")
    for heading, remarks in (("DISAGREE", found.disagreements), ("FAILED", found.failures)):
        for remark in remarks[:MOST_LINES]:
            yield Text(f"{heading}  {remark}", style="bold red")
        if len(remarks) > MOST_LINES:
            yield Text(f"{heading}  and {len(remarks) - MOST_LINES} more", style="bold red")
    count = sum(1 for _ in found.cells)
    if not (found.disagreements or found.failures) and count:
        yield Text(f"All {count} answers agree.", style="bold green")


def choice_tables(found: Choices) -> Iterator[RenderableType]:
    """One line a plan."""
    times = "continuous times" if found.slot_s is None else f"slots of {found.slot_s:g} s"
    heading = f"{found.mission.name}: longest hover by {' and '.join(found.by)}, {times}"
    yield Text(heading, style="bold")
    yield ""
    table = _table()
    for name in ("perspective", "trajectory"):
        table.add_column(name, no_wrap=True)
    for name in ("Δ [s]", "T' [s]", "T [s]", "η1 [%]"):
        table.add_column(Text(name), justify="right", no_wrap=True)
    table.add_column("by way of", no_wrap=True, max_width=LONGEST_NAME)
    table.add_column(Text("dry at [s]"), justify="right", no_wrap=True)
    before = ""
    for row in found.rows:
        figures = (row.hover_time_s, row.rest_time_s, row.mission_time_s)
        table.add_row(
            row.perspective if row.perspective != before else "",
            row.trajectory,
            *(NONE if each is None else f"{each:.2f}" for each in figures),
            f"{100.0 * row.soc['battery']:.2f}" if row.soc else "–",
            Text(", ".join(row.route[1:-1]) or "–"),
            "–" if row.runs_dry_s is None else f"{row.runs_dry_s:.0f}",
        )
        before = row.perspective
    yield table
    for why in dict.fromkeys(why for row in found.rows for why in row.reasons):
        yield Text(f"Because {why}")


def _table() -> Table:
    return Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="")

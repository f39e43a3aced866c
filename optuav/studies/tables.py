"""Comparisons of methods as rich tables: 80 columns, or as wide as a screen that has more."""

from __future__ import annotations

import io
from collections.abc import Iterable, Iterator, Sequence

from rich.console import Console, RenderableType
from rich.table import Table
from rich.text import Text

from optuav.studies.comparison import Cell, Comparison, Method, Row

WIDTH = 80
WIDE = 120
"""Columns from which on there is room for every gap beside its bound."""
SLOTS_ABREAST = 5
MOST_LINES = 12
MOST_REASONS = 3
LONGEST_NAME = 24
NONE, WRONG = "none", "!"


def add_route_column(table: Table) -> None:
    """A column for `between_ends`, the only one that gives way where the table is too wide."""
    table.add_column("by way of", max_width=LONGEST_NAME)


def between_ends(route: Sequence[str]) -> Text:
    """The places of a route between its ends, cut short where there is no room."""
    return Text(", ".join(route[1:-1]) or "–", no_wrap=True, overflow="ellipsis")


def as_text(pieces: Iterable[RenderableType]) -> str:
    """What a terminal of 80 columns without colours would show."""
    screen = Console(file=io.StringIO(), width=WIDTH, color_system=None, highlight=False)
    for piece in pieces:
        screen.print(piece)
    assert isinstance(screen.file, io.StringIO)
    return "\n".join(line.rstrip() for line in screen.file.getvalue().splitlines())


def comparison_tables(
    found: Comparison, *, times: bool = False, width: int = WIDTH
) -> Iterator[RenderableType]:
    """Gaps and bounds by programme and method, what each method is worth, and the verdict.

    Where nothing has a plan, the reasons alone.
    """
    heading = f"{found.mission.name}: longest hover Δ, {found.perspective}, by every method"
    yield Text(heading, style="bold")
    yield ""
    if found:
        yield from _gap_tables(found, wide=width >= WIDE)
        yield ""
        yield _worth(found, times)
        yield ""
        yield _proofs(found)
        yield ""
    yield from _verdict(found)


def _gap_tables(found: Comparison, *, wide: bool) -> Iterator[RenderableType]:
    by_slot: dict[float, Method] = {}
    for method in found.methods:
        if method.slot_s is not None:
            by_slot.setdefault(method.slot_s, method)
    methods = list(by_slot.values())
    for first in range(0, max(1, len(methods)), SLOTS_ABREAST):
        if first:
            yield ""
        if methods:
            lost = "≤ its bound [s]" if wide else "[s]"
            yield Text(f"Δ in continuous times, and what is lost of it {lost} in slots of")
        yield _gaps(found, methods[first : first + SLOTS_ABREAST], wide=wide)


def _gaps(found: Comparison, methods: Sequence[Method], *, wide: bool) -> Table:
    """Gaps of one row a programme: each beside its bound, or the bounds in slots at the end."""
    others = [each for each in found.methods[1:] if each.slot_s is None] if wide else []
    table = plain_table(2 if wide else 1)
    table.add_column("problem", no_wrap=True, max_width=LONGEST_NAME)
    table.add_column(Text("Δ [s]"), justify="right", no_wrap=True)
    for method in others:
        table.add_column(method.name, justify="right", no_wrap=True)
    for method in methods:
        table.add_column(Text(f"{method.slot_s:g} s"), justify="right", min_width=5)
    bounds_last = bool(methods) and not wide
    if bounds_last:
        table.add_column("bound", justify="right", no_wrap=True)
    table.add_column("agree", justify="right")
    for row in found.rows:
        cells = {cell.method: cell for cell in row.cells}
        hover_s = row.cells[0].hover_time_s if row.cells else None
        slotted = [cells.get(method) for method in methods]
        table.add_row(
            Text(row.name),
            NONE if hover_s is None else f"{hover_s:.3f}",
            *(_gap(cells.get(method)) for method in others),
            *(_gap(cell, with_bound=wide) for cell in slotted),
            *([_slots_lost(slotted)] if bounds_last else []),
            _agreement(row),
        )
    return table


def _slots_lost(cells: Iterable[Cell | None]) -> str:
    """How many slots the theory lets be lost, which may depend on their length."""
    said = {
        None if cell.largest_gap_s is None else round(cell.largest_gap_s / cell.method.slot_s)
        for cell in cells
        if cell is not None and cell.method.slot_s is not None and cell.gap_s is not None
    }
    if not said:
        return "–"
    known = sorted(each for each in said if each is not None)
    words = [*map(str, known), *([NONE] if None in said else [])]
    unit = " slot" if known == [1] else " slots"
    return "/".join(words) + (unit if len(words) == 1 and known else "")


def _gap(cell: Cell | None, *, with_bound: bool = False) -> Text:
    """What a cell of the first table says."""
    if cell is None:
        return Text("–")
    if cell.agrees is None:
        return Text("failed", style="bold red")
    if cell.gap_s is None:
        text = NONE
    elif cell.method.slot_s is None:
        text = _short(abs(cell.gap_s))
    else:
        text = f"{round(cell.gap_s, 2) + 0.0:.2f}"
    if with_bound and cell.gap_s is not None:
        text += f" ≤ {_allowed(cell)}"
    return Text(text) if cell.agrees else Text(f"{text}{WRONG}", style="bold red")


def _agreement(row: Row) -> Text:
    if any(cell.agrees is False for cell in row.cells):
        return Text("NO", style="bold red")
    if not row.cells:
        return Text("–")
    return Text("yes" if all(cell.agrees for cell in row.cells) else "?")


def _worth(found: Comparison, times: bool) -> Table:
    table = plain_table()
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
    table = plain_table()
    table.add_column("method", no_wrap=True)
    table.add_column("how it knows")
    for kind, words in proofs.items():
        table.add_row(kind, Text("; ".join(words).removeprefix(f"{kind}: ")))
    return table


def _allowed(cell: Cell) -> str:
    if cell.method.slot_s is None:
        return _short(cell.allowance_s)
    return "no bound" if cell.largest_gap_s is None else f"{cell.largest_gap_s:g}"


def _size(cell: Cell) -> float:
    """How large a gap is on either side of the reference [s]; -1 where there is none."""
    return -1.0 if cell.gap_s is None else abs(cell.gap_s)


def _short(seconds: float) -> str:
    return f"{seconds:.2f}" if abs(seconds) >= 0.01 else f"{seconds:.0e}" if seconds else "0"


def _verdict(found: Comparison) -> Iterator[Text]:
    yield from _without_plan(found)
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
        on_what = "" if found else " that nothing is feasible"
        yield Text(f"All {count} answers agree{on_what}.", style="bold green")


def _without_plan(found: Comparison) -> Iterator[Text]:
    """Which programmes have no plan, and why; where none has one, why (P1) over all has none."""
    names: dict[tuple[str, ...], list[str]] = {}
    for row in found.rows if found else found.rows[-1:]:
        if row.reasons:
            names.setdefault(row.reasons, []).append(row.name)
    for reasons, rows in [*names.items()][:MOST_REASONS]:
        who = f"{', '.join(rows)} {_has(len(rows))} no plan" if found else "No problem has a plan"
        yield Text(f"{who}: {'; '.join(reasons)}.")
    left = sum(map(len, [*names.values()][MOST_REASONS:]))
    if left:
        yield Text(f"{left} more {_has(left)} no plan either; --json tells why.")


def _has(count: int) -> str:
    return "has" if count == 1 else "have"


def plain_table(apart: int = 2) -> Table:
    """A table without lines, its columns so many blanks apart."""
    return Table(box=None, pad_edge=False, padding=(0, apart, 0, 0), header_style="")

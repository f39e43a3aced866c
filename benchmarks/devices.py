"""Several devices: how routes through the wells and the programme along edges grow."""

from __future__ import annotations

from collections.abc import Callable

import optuav
from benchmarks.timing import Row, median_s
from benchmarks.towns import town
from formulations.edges import edge_choice
from formulations.p1 import P1
from optuav.engines.registry import AUTO
from optuav.mission import Mission
from optuav.modelling import Model
from optuav.network.graph import network_of
from optuav.options import Perspective
from optuav.solving.edge_choice import best_along_edges
from optuav.solving.question import checked_question, solve_model
from optuav.solving.subtours import relaxed_subtours

ROOFS = 50


def run() -> list[Row]:
    """The programme along edges with rows of subtours and without, and how times grow."""
    rows = [
        Row(
            f"8 devices, {ROOFS} roofs along edges: rows of subtours / none",
            *_with_and_without_subtours(_mission(8)),
            at_least=1.5,
        ),
    ]
    grown: tuple[tuple[int, int, Perspective, float], ...] = (
        (7, 6, "available", 16.0),
        (12, 8, "battery", 8.0),
    )
    for many, few, perspective, limit in grown:
        ours, other = (median_s(_solved(_mission(n), perspective), 3) for n in (many, few))
        what = f"{many} / {few} devices, {ROOFS} roofs, {perspective}"
        rows.append(Row(what, ours, other, at_most=limit))
    return rows


def _mission(count: int) -> Mission:
    """A town with devices in a row across the middle."""
    devices = [
        {"name": f"d{k}", "position_m": [300 + 1400 * k / (count - 1), 2300 + 150 * (k % 3), 0]}
        for k in range(count)
    ]
    return town(ROOFS).replace({"devices": devices, "limits.deadline_s": 1800.0})


def _solved(mission: Mission, perspective: Perspective) -> Callable[[], None]:
    def solved() -> None:
        assert optuav.solve(mission, perspective=perspective)

    return solved


def _with_and_without_subtours(mission: Mission) -> tuple[float, float]:
    """Median times to solve the programme along edges with rows of subtours, and without."""
    question = checked_question(mission, P1(), "battery", None, AUTO, None)
    graph = best_along_edges(question, network_of(mission, None)).edges
    assert graph is not None

    def solved(model: Model) -> None:
        assert solve_model(model, 1, question).status.has_answer

    def without() -> None:
        solved(edge_choice(graph, "battery"))

    def with_rows() -> None:
        subtours = relaxed_subtours(edge_choice(graph, "battery"), graph)
        solved(edge_choice(graph, "battery", subtours))

    return median_s(with_rows, 1), median_s(without, 1)

"""The graph of a mission, which a notebook shows as tables of its places and legs."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import networkx

from optuav.frames import DataFrame, frame
from optuav.presentation.blocks import Block, Fold, Heading, Table
from optuav.presentation.html import as_html
from optuav.presentation.markup import yes_or_no
from optuav.presentation.numbers import figure

if TYPE_CHECKING:
    StringGraph = networkx.DiGraph[str]
else:
    StringGraph = networkx.DiGraph


class MissionGraph(StringGraph):
    """A `networkx.DiGraph` that shows itself."""

    def __repr__(self) -> str:
        return f"<MissionGraph {self.name!r}: {len(self)} places, {self.number_of_edges()} legs>"

    def to_frame(self) -> DataFrame:
        """Return one row per leg; needs pandas.

        Returns
        -------
        DataFrame
            Columns ``start`` and ``end``, and one per figure of a leg, such as ``duration_s``.
        """
        rows = [{"start": start, "end": end, **leg} for start, end, leg in self.edges(data=True)]
        return frame(rows)

    def _repr_html_(self) -> str:
        return as_html(self.blocks())

    def blocks(self) -> Iterator[Block]:
        """Yield a table of the places, and one of the legs."""
        yield Heading(f"Graph of {self.name}")
        places = [({"place": name}, data) for name, data in self.nodes(data=True)]
        legs = [({"from": start, "to": end}, data) for start, end, data in self.edges(data=True)]
        yield Fold(f"Places ({len(places)})", [_table(places)])
        yield Fold(f"Legs ({len(legs)})", [_table(legs)])


def _table(rows: list[tuple[dict[str, str], dict[str, Any]]]) -> Table:
    """Rows of names and data, with a column for every name that occurs."""
    records = [{**names, **data} for names, data in rows]
    heads = dict.fromkeys(head for record in records for head in record)
    cells = [[_shown(record.get(head)) for head in heads] for record in records]
    return Table([*map(str, heads)], cells)


def _shown(value: object) -> str:
    """A value of a graph, whatever a user has put there."""
    match value:
        case None:
            return "–"
        case bool():
            return yes_or_no(value)
        case tuple() | list():
            return f"({', '.join(map(_shown, value))})"
        case int() | float():
            return figure(value)
        case _:
            return str(value)

"""The graph of a mission, which a notebook shows as tables of its places and legs."""

from typing import TYPE_CHECKING, Any
from xml.etree.ElementTree import Element

import networkx

from optuav.frames import DataFrame, frame
from optuav.markup import Cell, figure, folded, paragraph, shown, table

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
        places = [({"place": name}, data) for name, data in self.nodes(data=True)]
        legs = [({"from": start, "to": end}, data) for start, end, data in self.edges(data=True)]
        return shown(
            paragraph(f"Graph of {self.name}"),
            folded(f"Places ({len(places)})", _table(places)),
            folded(f"Legs ({len(legs)})", _table(legs)),
        )


def _table(rows: list[tuple[dict[str, str], dict[str, Any]]]) -> Element:
    """Rows of names and data, with a column for every name that occurs."""
    records = [{**names, **data} for names, data in rows]
    heads = dict.fromkeys(head for record in records for head in record)
    cells = [[_cell(record.get(head)) for head in heads] for record in records]
    return table([*map(str, heads)], cells)


def _cell(value: object) -> Cell:
    """A value of a graph, whatever a user has put there."""
    if isinstance(value, tuple | list):
        return f"({', '.join(str(_cell(component)) for component in value)})"
    if value is None or isinstance(value, bool):
        return value
    return figure(value) if isinstance(value, int | float) else str(value)

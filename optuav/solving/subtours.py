"""Subtours that the linear relaxation of a choice of edges flies, by minimum cuts.

Where edges are flown in part, the rows of Miller, Tucker and Zemlin allow circles beside the way.
Round by round, the relaxation is solved, and a row is added for every group of places out of which
it leads less than one edge (`formulations.edges`). Such a group is one side of a minimum cut
between a hover point and the origin or destination, where edges have their share x as capacity.

References
----------
.. [1] D. Applegate, R. Bixby, V. Chvátal, W. Cook, "The Traveling Salesman Problem: A Computational
   Study", Princeton University Press, 2006, chapters 5 and 6.
"""

from __future__ import annotations

from collections.abc import Iterator

import networkx as nx
import numpy as np

from formulations.edges import DESTINATION, ORIGIN, EdgeGraph, Subtour
from optuav.arrays import Floats
from optuav.engines.linear_form import linear_form
from optuav.modelling import Model
from optuav.silence import silent

LEAST_VIOLATION = 1e-6
"""By how much a sum over edges has to fall short of 1, above the rounding of a relaxation."""
LEAST_SHARE = 1e-9
"""Share from which an edge counts as flown: rounding would join places to groups."""


@silent()
def relaxed_subtours(model: Model, graph: EdgeGraph) -> list[Subtour]:
    """Subtours out of which the relaxation of a model of the edges would not lead.

    With a row for each, the relaxation leads out of every group of places. If the relaxation is
    infeasible, the model is too: the subtours of the rounds so far are returned.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import csr_array

    form = linear_form(model, model.row(0))
    rows = [LinearConstraint(csr_array(form.normals[..., 0]), ub=form.limits[..., 0])]
    flies = [form.names.index(f"edge[{k}]") for k in range(1, len(graph.edges) + 1)]
    subtours = list[Subtour]()
    while True:
        # Without whole numbers asked for, this is a linear programme of sparse rows.
        relaxed = milp(-form.directions[0, :, 0], bounds=Bounds(-np.inf, np.inf), constraints=rows)
        groups = () if relaxed.x is None else _left_alone(graph, relaxed.x[flies])
        new = [group for group in dict.fromkeys(groups) if group not in subtours]
        if not new:
            return subtours
        subtours += new
        leaving = np.zeros((len(new), len(form.names)))
        for row, subtour in zip(leaving, new, strict=True):
            row[flies] = [edge.leaves(subtour) for edge in graph.edges]
        rows.append(LinearConstraint(csr_array(leaving), lb=1.0))


def _left_alone(graph: EdgeGraph, shares: Floats) -> Iterator[Subtour]:
    """The groups around each hover point out of which, or into which, less than one edge leads."""
    ways: nx.DiGraph[str] = nx.DiGraph()
    ways.add_nodes_from((ORIGIN, *graph.hovers, *graph.roofs, DESTINATION))
    for edge, share in zip(graph.edges, shares.tolist(), strict=True):
        if share > LEAST_SHARE:
            ways.add_edge(edge.start, edge.end, capacity=share)
    for point in graph.hovers:
        leaving, (outward, _) = nx.minimum_cut(ways, point, DESTINATION)
        entering, (_, inward) = nx.minimum_cut(ways, ORIGIN, point)
        for flow, group in ((leaving, outward), (entering, inward)):
            if flow < 1.0 - LEAST_VIOLATION:
                yield tuple(name for name in (*graph.hovers, *graph.roofs) if name in group)

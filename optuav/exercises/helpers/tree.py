"""Branch and bound over whole numbers, and its tree drawn step by step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import linprog

import optuav
from optuav.looks import LOOKS, PHASES, SERIES
from optuav.presentation.numbers import figure, fixed
from optuav.silence import silent

FROM_INTEGER = 1e-6  # Largest distance from a whole number that counts as rounding
LOOK = {
    "open": ("white", PHASES["flight"]),
    "branched": (SERIES[3], LOOKS["muted"].light),
    "best": ("#CDEBDD", LOOKS["flies"].light),
    "dropped": ("white", LOOKS["bounds"].light),
    "infeasible": ("white", LOOKS["dry"].light),
}
"""Fill and edge of a node by what became of it."""


@dataclass
class Node:
    """A relaxation: what its branch demands, and its optimum."""

    branch: str
    parent: int | None
    least: np.ndarray
    most: np.ndarray
    bound: float  # −∞ if no point is feasible
    point: np.ndarray  # NaN if no point is feasible
    born: int  # Step in which the node is made
    fates: dict[int, str] = field(default_factory=dict)  # By the step in which they come true

    def fate(self, step: int) -> str:
        """Return what the node is after a step."""
        return next((self.fates[k] for k in sorted(self.fates, reverse=True) if k <= step), "open")


@dataclass
class Tree:
    """All nodes, and after each step the bound of the open ones and the best plan."""

    nodes: list[Node]
    bounds: list[float]
    best: list[float]


@silent()
def branch_and_bound(
    gain: Sequence[float],
    rows: np.ndarray,
    limits: np.ndarray,
    least: Sequence[float],
    most: Sequence[float],
    names: Sequence[str],
) -> Tree:
    """Maximise `gain` · x over whole x with rows · x ≤ limits and least ≤ x ≤ most.

    Each step takes the open node of the largest bound and splits it at the unknown that is
    farthest from a whole number.
    """
    tree, best = Tree([], [], []), -np.inf

    def add(branch: str, parent: int | None, low: np.ndarray, high: np.ndarray, step: int) -> None:
        nonlocal best
        ranges = [*zip(low, high, strict=True)]
        answer = linprog(-np.asarray(gain), rows, limits, bounds=ranges)
        point = np.full(low.size, np.nan) if answer.x is None else answer.x
        bound = -np.inf if answer.fun is None else -float(answer.fun)
        node = Node(branch, parent, low, high, bound, point, step)
        if bound == -np.inf:
            node.fates[step] = "infeasible"
        elif np.abs(point - point.round()).max() < FROM_INTEGER:
            node.fates[step] = "best" if bound > best else "dropped"
            best = max(best, bound)
        tree.nodes.append(node)

    add("relaxation", None, np.asarray(least, float), np.asarray(most, float), step := 0)
    while True:
        waiting = [node for node in tree.nodes if node.fate(step) == "open"]
        for node in waiting:
            if node.bound <= best + FROM_INTEGER:
                node.fates[step] = "dropped"
        waiting = [node for node in waiting if node.fate(step) == "open"]
        tree.bounds.append(max([best, *(node.bound for node in waiting)]))
        tree.best.append(best)
        if not waiting:
            return tree
        step += 1
        node = max(waiting, key=lambda candidate: candidate.bound)
        node.fates[step], number = "branched", tree.nodes.index(node)
        at = int(np.abs(node.point - node.point.round()).argmax())
        below = np.floor(node.point[at])
        low, high = node.least.copy(), node.most.copy()
        high[at], low[at] = below, below + 1.0
        add(f"{names[at]} ≤ {figure(below)}", number, node.least, high, step)
        add(f"{names[at]} ≥ {figure(below + 1.0)}", number, low, node.most, step)


def places(nodes: Sequence[Node]) -> list[tuple[float, int]]:
    """Return the place of each node: leaves side by side, parents above the middle of theirs."""
    children = [
        [k for k, node in enumerate(nodes) if node.parent == at] for at in range(len(nodes))
    ]
    places, leaves = dict[int, tuple[float, int]](), iter(range(len(nodes)))

    def place(at: int, depth: int) -> float:
        xs = [place(child, depth + 1) for child in children[at]]
        places[at] = (sum(xs) / len(xs) if xs else float(next(leaves)), depth)
        return places[at][0]

    place(0, 0)
    return [places[at] for at in range(len(nodes))]


def draw(tree: Tree, unit: str = "s") -> object:
    """Draw the tree after each step, one panel per step."""
    at, steps = places(tree.nodes), len(tree.bounds)
    deepest, widest = max(y for _, y in at), max(x for x, _ in at)
    with optuav.plots.style.applied():
        figure = optuav.plots.style.page(2.1 * -(-steps // 2))
        panels = figure.subplots(-(-steps // 2), 2, squeeze=False).ravel()
        for step, ax in enumerate(panels):
            ax.set(xlim=(-0.6, widest + 0.6), ylim=(-deepest - 0.45, 0.5))
            ax.set_axis_off()
            if step >= steps:
                continue
            best = (
                f"best plan {fixed(tree.best[step], 0)} {unit}"
                if tree.best[step] > 0
                else "no plan yet"
            )
            ax.set_title(f"step {step}: bound {fixed(tree.bounds[step], 1)} {unit}, {best}")
            for node, (x, y) in zip(tree.nodes, at, strict=True):
                if node.born > step:
                    continue
                if node.parent is not None:
                    x_0, y_0 = at[node.parent]
                    ax.plot(
                        [x_0, x], [-y_0, -y], color=LOOKS["muted"].light, linewidth=0.8, zorder=1
                    )
                fill, edge = LOOK[node.fate(step)]
                words = f"{fixed(node.bound, 1)} {unit}" if node.bound > -np.inf else "no point"
                fate = {"best": "\nplan", "dropped": "\ndropped"}.get(node.fate(step), "")
                box = {"boxstyle": "round,pad=0.35", "facecolor": fill, "edgecolor": edge}
                box["linestyle"] = "--" if node.fate(step) in ("dropped", "infeasible") else "-"
                text = f"{node.branch}\n{words}{fate}"
                ax.text(x, -y, text, ha="center", va="center", fontsize=7.5, bbox=box, zorder=2)
    return optuav.plots.style.Panels(panels)

"""The (Δ, T') plane of a problem with two unknowns: its grid, its constraints and its optimum."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from optuav.arrays import Booleans, Floats
from optuav.engines import grid
from optuav.errors import InputError
from optuav.modelling import Constraint, Model, Variable, evaluate
from optuav.modelling.check import relations
from optuav.plan import Plan
from optuav.plots.labels import Label, place, settle
from optuav.plots.moments import in_words
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    YELLOW,
    group_thousands,
    page,
    printed,
    styled,
)

COLOURS = (VERMILLION, BLUE, GREEN, PURPLE, ORANGE, SKY)
BOUND = "#595959"
"""Colour of the bounds of the unknowns."""
BACKING = {"facecolor": "white", "alpha": 0.8, "edgecolor": "none", "pad": 0.3}
"""What keeps a label apart from the points of the grid behind it."""
STEEP = 4.0
"""Slope on the page from which a label runs along its line."""
MOST_POINTS = 40
"""Most points of the grid that are shown along an axis."""
SAMPLES = 241
"""Points along an axis at which the constraints are evaluated."""
PER_STRETCH = 200
"""Points between two corners of a line at which it is looked whether it bounds what is feasible."""
BEYOND = 1.5
"""How far the grid is shown, as a multiple of how far it is feasible."""
MARGIN = 0.07
"""Share of the plane that is shown beyond the grid."""


def plane(
    model: Model,
    parameters: Mapping[str, Any],
    plans: Sequence[Plan] = (),
    *,
    slot_s: float = 1.0,
    ax: Axes | None = None,
) -> Axes:
    """Draw the plane of the two unknowns of a problem: rest time across, hover time upwards.

    Constraints are lines on which the two sides of their declaration meet, with their forbidden
    sides shaded, thick where they bound what is feasible. Those that cut nothing off are left out,
    and the far end of a grid of which only the beginning is feasible. The points are those of
    Algorithm 1's grid, thinned out where there are many.

    Parameters
    ----------
    model
        A declared problem with two unknowns, such as P4 (``Program.parts[k].model``).
    parameters
        Values of its parameters for one itinerary, as ``model.row(entry)`` gives them.
    plans
        Plans to mark, of the same problem and itinerary: continuous ones and ones in slots.
    slot_s
        Length of the slots of the grid [s], > 0.
    ax
        Where to draw; on a page of its own by default.

    Raises
    ------
    InputError
        If the model does not have two unknowns.
    """
    if len(model.variables) != 2:
        names = ", ".join(each.symbol for each in model.variables)
        raise InputError(f"a plane needs two unknowns; the problem has {names or 'none'}")
    upward, across = model.variables
    with styled():
        if ax is None:
            ax = page(7.2, 4.4).subplots()
        marked = [
            (plan, tuple(getattr(plan, each.name) for each in (across, upward)))
            for plan in plans
            if plan
        ]
        counted = _worth_seeing(
            model, parameters, grid.axes(model, parameters, slot_s), [point for _, point in marked]
        )
        (left, right), (bottom, top) = (
            _limits([*values, *(point[k] for _, point in marked)])
            for k, values in enumerate(reversed(counted))
        )
        ax.set(xlim=(left, right), ylim=(bottom, top), title=_title(model, plans))
        ax.set(xlabel=_words(across), ylabel=_words(upward))
        group_thousands(ax)
        cells = _draw_grid(ax, model, parameters, counted, slot_s)
        labels, lines = _draw_constraints(ax, model, parameters, _route(plans))
        for plan, point in marked:
            _mark(ax, plan, point, (across.symbol, upward.symbol))
        ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), labelspacing=0.9)
        settle(ax)
        place(ax, labels, lines, [[point] for point in cells])
    return ax


def _worth_seeing(
    model: Model,
    parameters: Mapping[str, Any],
    counted: Sequence[Floats],
    marked: Sequence[tuple[float, ...]],
) -> list[Floats]:
    """The grid as far as it is feasible and somewhat farther, where that is much less than all."""
    upward, across = model.variables
    y, x = (np.linspace(0.0, values.max(initial=0.0), SAMPLES) for values in counted)
    values = {**parameters, across.name: x, upward.name: y[:, None]}
    tested = (each for each in relations(model) if each.relation.sense != "==")
    feasible = _all((np.asarray(_excess(each, values)) >= 0.0 for each in tested), (len(y), len(x)))
    reached = [y[feasible.any(axis=1)], x[feasible.any(axis=0)]]
    seen = []
    for values_s, inside, points in zip(
        counted,
        reached,
        zip(*(point[::-1] for point in marked), strict=True) if marked else ((), ()),
        strict=True,
    ):
        farthest = max([*inside, *points], default=np.inf)
        cut = values_s[values_s <= BEYOND * farthest]
        seen.append(cut if len(cut) > 1 and BEYOND * farthest < 0.7 * values_s.max() else values_s)
    return seen


def _route(plans: Sequence[Plan]) -> tuple[str, ...]:
    """The places on the way, as far as a plan tells."""
    return next((plan.route for plan in plans if plan), ())


def _title(model: Model, plans: Sequence[Plan]) -> str:
    route = _route(plans)
    return "\n".join([model.title, *([" → ".join(map(printed, route))] if route else [])])


def _limits(values: Sequence[float]) -> tuple[float, float]:
    highest = max([0.0, *values]) or 1.0
    return -MARGIN * highest, (1.0 + MARGIN) * highest


def _words(variable: Variable) -> str:
    words = variable.name.removesuffix(f"_{variable.unit}").replace("_", " ")
    return f"{words} {variable.symbol} [{variable.unit}]"


def _draw_grid(
    ax: Axes, model: Model, parameters: Mapping[str, Any], counted: list[Floats], slot_s: float
) -> Floats:
    """Draw the grid, dots where it is feasible and crosses elsewhere; the points (n, 2) shown."""
    every = [max(1, math.ceil(len(values) / MOST_POINTS)) for values in counted]
    upward, across = (values[::n] for values, n in zip(counted, every, strict=True))
    names = [variable.name for variable in model.variables]
    points = dict(zip(names, (upward, across[:, None]), strict=True))
    feasible = grid.cells(grid.tests(model, parameters), points)
    x, y = np.broadcast_arrays(across[:, None], upward)
    thinned = _thinned(every, model)
    for which, marker, size, colour, words in (
        (feasible, "o", 1.8, BLACK, "feasible"),
        (~feasible, "x", 2.2, GREY, "not feasible"),
    ):
        if not which.any():
            continue
        label = f"{words}\n(slots of {slot_s:g} s{thinned})"
        dots = ax.plot(x[which], y[which], marker, markersize=size, color=colour, label=label)
        dots[0].set_markeredgewidth(0.5)
    return np.stack([x.ravel(), y.ravel()], axis=1)


def _thinned(every: Sequence[int], model: Model) -> str:
    """Which slots are shown, in words; nothing if all are."""
    if max(every) == 1:
        return ""
    if len(set(every)) == 1:
        return f", every {_ordinal(every[0])} shown"
    each = [
        f"every {_ordinal(number)} of {variable.symbol}"
        for number, variable in zip(every, model.variables, strict=True)
        if number > 1
    ]
    return ",\n" + ", ".join(each)


def _ordinal(number: int) -> str:
    endings = {1: "st", 2: "nd", 3: "rd"}
    return f"{number}{'th' if number % 100 in (11, 12, 13) else endings.get(number % 10, 'th')}"


class Cut(NamedTuple):
    """A constraint that cuts something off, sampled on the plane.

    Parameters
    ----------
    constraint
        As declared.
    excess
        By how much it holds; forbidden where negative.
    others_hold
        Where all others hold, so that it alone decides.
    """

    constraint: Constraint
    excess: Floats
    others_hold: Booleans


def _cuts(model: Model, values: Mapping[str, Any], shape: tuple[int, ...]) -> Iterator[Cut]:
    """The constraints without which more would be feasible, one of those that do the same."""
    every = {
        each.label: (each, np.broadcast_to(_excess(each, values), shape))
        for each in relations(model)
    }
    holds = {
        label: excess >= 0.0
        for label, (each, excess) in every.items()
        if each.relation.sense != "=="
    }
    feasible = _all(holds.values(), shape)
    for label, held in list(holds.items()):
        if not held.any():
            continue  # what holds nowhere is told, though another forbids everything as well
        others = _all((each for name, each in holds.items() if name != label), shape)
        if (others == feasible).all():
            del holds[label], every[label]
    for label, (constraint, excess) in every.items():
        others = _all((each for name, each in holds.items() if name != label), shape)
        yield Cut(constraint, excess, others)


def _all(holds: Iterable[Booleans], shape: tuple[int, ...]) -> Booleans:
    return np.asarray(functools.reduce(np.logical_and, holds, np.ones(shape, dtype=bool)))


def _draw_constraints(
    ax: Axes, model: Model, parameters: Mapping[str, Any], route: Sequence[str]
) -> tuple[list[Label], list[Floats]]:
    """Draw the boundaries that cut, with their forbidden sides; their labels and lines."""
    upward, across = model.variables
    x, y = (np.linspace(*limits, SAMPLES) for limits in (ax.get_xlim(), ax.get_ylim()))
    values = {**parameters, across.name: x, upward.name: y[:, None]}
    labels, lines = list[Label](), list[Floats]()
    colours = itertools.cycle(COLOURS)
    for constraint, excess, others_hold in _cuts(model, values, (SAMPLES, SAMPLES)):
        colour = next(colours) if constraint.declared_at else BOUND
        name = in_words(constraint, route)
        if constraint.relation.sense != "==" and excess.min() < 0.0:
            lowest = [excess.min(), min(0.0, excess.max())]
            ax.contourf(x, y, excess, levels=lowest, colors=[colour], alpha=0.1, zorder=0.5)
        if excess.max() < 0.0:
            words = f"{name}\n(holds nowhere here)"
            ax.add_patch(Rectangle((0.0, 0.0), 0.0, 0.0, color=colour, alpha=0.2, label=words))
        if not excess.min() < 0.0 < excess.max():
            continue
        drawn = ax.contour(x, y, excess, levels=[0.0], colors=[colour], linewidths=0.8, zorder=3)
        found = [np.asarray(line) for line in drawn.get_paths()[0].to_polygons(closed_only=False)]
        lines += found
        edges = [edge for line in found for edge in _edges(line, (x, y), others_hold)]
        for edge in edges:
            ax.plot(*edge.T, color=colour, linewidth=2.0, zorder=3, solid_capstyle="round")
        middle, steep = _middle(ax, max(edges or found, key=len))
        style = {"color": colour, "rotation": 90.0 if steep else 0.0, "bbox": BACKING}
        labels.append(Label(name, middle, style=style))
    return labels, lines


def _edges(line: Floats, sampled: tuple[Floats, Floats], others_hold: Booleans) -> list[Floats]:
    """The parts of a line along which its constraint alone parts feasible from not."""
    line = _dense(line)
    column, row = (
        np.clip(np.rint((at - axis[0]) / (axis[1] - axis[0])), 0, SAMPLES - 1).astype(int)
        for at, axis in zip(line.T, sampled, strict=True)
    )
    alone = others_hold[row, column]
    changes = np.flatnonzero(np.diff(alone)) + 1
    parts = np.split(line, changes), np.split(alone, changes)
    return [part for part, here in zip(*parts, strict=True) if here[0] and len(part) > 1]


def _dense(line: Floats) -> Floats:
    """A line with points enough between its corners, which alone a straight one has."""
    corners = np.arange(len(line))
    between = np.linspace(0.0, len(line) - 1.0, (len(line) - 1) * PER_STRETCH + 1)
    return np.stack([np.interp(between, corners, each) for each in line.T], axis=1)


def _middle(ax: Axes, line: Floats) -> tuple[tuple[float, float], bool]:
    """The point half-way along a line as it is seen, and whether the line is steep there."""
    seen = ax.transAxes.inverted().transform(ax.transData.transform(line))
    steps = np.diff(seen, axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*steps.T))])
    half = 0.5 * along[-1]
    x, y = (float(np.interp(half, along, each)) for each in line.T)
    across, upward = np.abs(steps[min(np.searchsorted(along, half), len(steps)) - 1])
    return (x, y), bool(upward > STEEP * across)


def _excess(constraint: Constraint, values: Mapping[str, Any]) -> Any:
    """By how much a constraint holds; forbidden where negative."""
    relation = constraint.relation
    left, right = evaluate(relation.left, values), evaluate(relation.right, values)
    return right - left if relation.sense == "<=" else left - right


def _mark(ax: Axes, plan: Plan, point: tuple[float, ...], symbols: tuple[str, str]) -> None:
    times = ", ".join(f"{s} = {t:.2f} s" for s, t in zip(symbols, point, strict=True))
    continuous = plan.slot_s is None
    words = "optimum" if continuous else f"optimum in slots of {plan.slot_s:g} s"
    ax.plot(
        *point,
        "*" if continuous else "s",
        markersize=11.0 if continuous else 9.0,
        markerfacecolor=YELLOW if continuous else "none",
        markeredgecolor=BLACK,
        markeredgewidth=0.9,
        zorder=6,
        label=f"{words}\n{times}",
    )

"""The (Δ, T') plane of a problem with two unknowns: grid, constraints and optimum."""

import math
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from formulations.soc import StepEnd
from optuav.arrays import Booleans, Floats
from optuav.engines import grid
from optuav.errors import InputError
from optuav.modelling import Constraint, Model, Variable
from optuav.modelling.check import evaluated
from optuav.plan import Plan
from optuav.plots import style
from optuav.plots.style import BLACK, printed

COLOURS = (style.VERMILLION, style.BLUE, style.GREEN, style.PURPLE, style.ORANGE, style.SKY)
REACHED = {"dry": "empty", "past full": "full"}
"""What the available well is where one of its limits binds, by the kind of the constraint."""
MOST_POINTS = 40  # Most points of the grid that are shown along an axis
SAMPLES = 401  # Points along an axis at which the constraints are evaluated
BEYOND = 1.5  # How far the grid is shown, as a multiple of how far it is feasible
MARGIN = 0.07  # Share of the plane that is shown beyond the grid
LETTERS = 30  # Longest line of the legend

Values: TypeAlias = Mapping[str, object]


@style.applied()
def plane(
    model: Model,
    parameters: Values,
    plans: Sequence[Plan] = (),
    *,
    slot_s: float = 1.0,
    ax: Axes | None = None,
) -> Axes:
    """Draw the plane of the two unknowns of a problem: rest time across, hover time upwards.

    Constraints are lines on which the two sides of their declaration are equal, with their
    forbidden sides shaded, thick where they bound what is feasible. Left out are those that cut
    nothing off, and the far end of a grid of which only the beginning is feasible. The points are
    those of Algorithm 1's grid, thinned out where there are many.

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

    Returns
    -------
    The axes, with both times in s.

    Raises
    ------
    InputError
        If the model does not have two unknowns.

    Examples
    --------
    >>> import optuav
    >>> program = optuav.formulate("paper", optuav.P4("b1", order="rest-first"))
    >>> model = program.parts[0].model
    >>> optuav.plots.plane(model, model.row(0), slot_s=20.0).get_xlabel()
    "rest time T' [s]"
    """
    if len(model.variables) != 2:
        names = ", ".join(each.symbol for each in model.variables)
        raise InputError(f"a plane needs two unknowns; the problem has {names or 'none'}")
    upward, across = model.variables
    marked = [
        (plan, (float(getattr(plan, across.name)), float(getattr(plan, upward.name))))
        for plan in plans
        if plan
    ]
    points = [point for _, point in marked]
    route = marked[0][0].route if marked else ()
    ax = ax or style.page(4.4).subplots()
    counted = _worth_seeing(model, parameters, slot_s, points)
    for name, number, values_s in (("ylim", 1, counted[0]), ("xlim", 0, counted[1])):
        highest = max([0.0, *values_s, *(point[number] for point in points)]) or 1.0
        ax.set(**{name: (-MARGIN * highest, (1.0 + MARGIN) * highest)})
    ax.set_title("\n".join([model.title, *[" → ".join(map(printed, route))] * bool(route)]))
    ax.set(xlabel=_axis_label(across), ylabel=_axis_label(upward))
    style.group_thousands(ax)
    handles = list(_draw_constraints(ax, model, parameters, route))
    handles += _draw_grid(ax, model, parameters, counted, slot_s)
    for plan, point in marked:
        kind = ("*", 11.0, style.YELLOW, "optimum")
        if plan.slot_s is not None:
            kind = ("s", 9.0, "none", f"optimum in slots of {plan.slot_s:g} s")
        marker, size, colour, words = kind
        (star,) = ax.plot(*point, marker, markersize=size, markerfacecolor=colour, zorder=6)
        times = f"{across.symbol} = {point[0]:.2f} s, {upward.symbol} = {point[1]:.2f} s"
        star.set(markeredgecolor=BLACK, markeredgewidth=0.9, label=f"{words}\n{times}")
        handles.append(star)
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), labelspacing=0.9)
    style.settle(ax)
    return ax


def constraint_name(constraint: Constraint, route: Sequence[str]) -> str:
    """The label of a constraint; for one of the available well, what happens on the route."""
    moment = constraint.moment
    if constraint.kind not in REACHED or not isinstance(moment, StepEnd):
        return constraint.label
    well = f"available well {REACHED[constraint.kind]}"
    if moment.stay:
        return f"{well} {moment}"
    end = f"to {printed(route[moment.flight])}" if route else f"{moment.flight}"
    if moment.lands:
        return f"{well}, end of flight {end}"
    return f"{well}, stage {moment.stage} of flight {end}"


def _axis_label(variable: Variable) -> str:
    """Words, symbol and unit of an unknown."""
    words = variable.name.removesuffix(f"_{variable.unit}").replace("_", " ")
    return f"{words} {variable.symbol} [{variable.unit}]"


def _excesses(
    model: Model, parameters: Values, x: Floats, y: Floats
) -> Iterator[tuple[Constraint, Floats]]:
    """Constraints and by how much they hold (y, x); they forbid where that is negative."""
    upward, across = model.variables
    for row in evaluated(model, {**parameters, across.name: x, upward.name: y[:, None]}):
        excess = row.left - row.right if row.sense == "==" else row.slack
        yield row.constraint, np.broadcast_to(np.asarray(excess, dtype=float), (len(y), len(x)))


def _worth_seeing(
    model: Model, parameters: Values, slot_s: float, marked: Sequence[tuple[float, float]]
) -> list[Floats]:
    """The grid as far as it is feasible and somewhat farther, where that is much less than all."""
    counted = grid.axes(model, parameters, slot_s)
    y, x = (np.linspace(0.0, values_s.max(initial=0.0), SAMPLES) for values_s in counted)
    excesses = _excesses(model, parameters, x, y)
    holds = [excess >= 0.0 for each, excess in excesses if each.relation.sense != "=="]
    feasible = np.all([np.ones((SAMPLES, SAMPLES), dtype=bool), *holds], axis=0)
    reached = (y[feasible.any(axis=1)], 1), (x[feasible.any(axis=0)], 0)
    seen = []
    for values_s, (inside, number) in zip(counted, reached, strict=True):
        farthest = BEYOND * max([*inside, *(point[number] for point in marked)], default=np.inf)
        cut = values_s[values_s <= farthest]
        seen.append(cut if len(cut) > 1 and farthest < 0.7 * values_s.max() else values_s)
    return seen


def _draw_grid(
    ax: Axes, model: Model, parameters: Values, counted: Sequence[Floats], slot_s: float
) -> Iterator[Artist]:
    """Draw the grid, dots where it is feasible and crosses elsewhere; entries of the legend."""
    every = [max(1, math.ceil(len(values) / MOST_POINTS)) for values in counted]
    upward, across = (values[::n] for values, n in zip(counted, every, strict=True))
    x, y = np.meshgrid(across, upward)
    points = dict(zip((each.name for each in model.variables), (y, x), strict=True))
    rows = evaluated(model, {**parameters, **points})
    feasible = np.all([np.broadcast_to(row.satisfied, x.shape) for row in rows], axis=0)
    fewer = f", one of {every[0] * every[1]} shown" if max(every) > 1 else ""
    slots = f"(slots of {slot_s:g} s{fewer})"
    for which, marker, size, colour, words in (
        (feasible, "o", 1.8, BLACK, "feasible"),
        (~feasible, "x", 2.2, style.GREY, "not feasible"),
    ):
        if which.any():
            (dots,) = ax.plot(x[which], y[which], marker, markersize=size, color=colour)
            dots.set(markeredgewidth=0.5, label=f"{words}\n{slots}")
            yield dots


def _cuts(
    sampled: Sequence[tuple[Constraint, Floats]],
) -> Iterator[tuple[Constraint, Floats, Booleans]]:
    """The constraints without which more would be feasible, one of those that do the same.

    Each with its slack, and where all others hold.
    """
    kept = [(each, excess, excess >= 0.0) for each, excess in sampled]
    bounding = [each for each in kept if each[0].relation.sense != "=="]

    def all_hold(but: Booleans | None = None) -> Booleans:
        others = [held for *_, held in bounding if held is not but]
        return np.all(others, axis=0) if others else np.ones(kept[0][1].shape, dtype=bool)

    feasible = all_hold()
    for cut in list(bounding):
        # What holds nowhere is named, though another constraint forbids everything as well.
        if cut[2].any() and (all_hold(but=cut[2]) == feasible).all():
            bounding.remove(cut)
            kept.remove(cut)
    for constraint, excess, own in kept:
        yield constraint, excess, all_hold(but=own)


def _draw_constraints(
    ax: Axes, model: Model, parameters: Values, route: Sequence[str]
) -> Iterator[Artist]:
    """Draw the boundaries that cut, with their forbidden sides; entries of the legend."""
    x, y = (np.linspace(*limits, SAMPLES) for limits in (ax.get_xlim(), ax.get_ylim()))
    cuts = _cuts(list(_excesses(model, parameters, x, y)))
    for (constraint, excess, others_hold), colour in zip(cuts, cycle(COLOURS), strict=False):
        name = textwrap.fill(constraint_name(constraint, route), LETTERS)
        low, high = float(excess.min()), float(excess.max())
        if constraint.relation.sense != "==" and low < 0.0:
            levels = [low, min(0.0, high)]
            ax.contourf(x, y, excess, levels=levels, colors=[colour], alpha=0.1, zorder=0.5)
        if high < 0.0:
            yield Patch(color=colour, alpha=0.2, label=f"{name}\n(holds nowhere here)")
        if low < 0.0 < high:
            where = np.ma.masked_array(excess, ~others_hold)
            for shown, width in ((excess, 0.8), (where, 2.0)):
                if shown.min() < 0.0 < shown.max():
                    ax.contour(x, y, shown, [0.0], colors=[colour], linewidths=width, zorder=3)
            yield style.entry(name, colour, 2.0)

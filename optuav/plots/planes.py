"""The (Δ, T') plane of a problem with two unknowns: grid, constraints and optimum."""

import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from optuav.arrays import Floats
from optuav.errors import Fault, InputError
from optuav.mission.messages import of_kind, shown
from optuav.modelling import Model, Variable
from optuav.plan import Plans, load_plans
from optuav.plan.plane import ROLES, Plane, constraint_name, kind_of, thinned
from optuav.plots import signs, style
from optuav.plots.style import BLACK, drawable
from optuav.presentation.numbers import figure, seconds

OWN = (style.PINK, style.SKY, style.DARK, style.GREEN)  # Colours of limits that have no role
SAMPLES = 401  # Samples of the constraints along an axis
LETTERS = 30  # Longest line of the legend
MARGIN = 0.07  # Share of the plane that is shown beyond the grid

Values: TypeAlias = Mapping[str, object]


@style.applied()
def plane(
    model: Model,
    parameters: Values,
    plans: Plans = (),
    *,
    slot_s: float = 1.0,
    ax: Axes | None = None,
) -> Axes:
    """Draw the plane of the two unknowns of a problem: rest time across, hover time upwards.

    Constraints that cut something off are lines where their two sides are equal, shaded where they
    forbid, thick where they bound the feasible set. The points are Algorithm 1's grid, thinned out
    where there are many, without the far end of a grid with a feasible beginning.

    Parameters
    ----------
    model
        A declared problem with two unknowns, such as P4 (``Program.parts[k].model``).
    parameters
        Values of its parameters for one itinerary, from ``model.row(entry)``.
    plans
        Plans of that problem and itinerary to mark, in continuous times or slots, or their files.
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
        If the model does not have two unknowns, or the slots no length.

    Examples
    --------
    >>> import optuav
    >>> program = optuav.formulate("paper", optuav.P4("b1", order="rest-first"))
    >>> model = program.parts[0].model
    >>> optuav.plots.plane(model, model.row(0), slot_s=20.0).get_xlabel()
    "rest time $T'$ [s]"
    """
    of_kind("model", model, Model, "a declared model, such as Program.parts[k].model")
    words = "values of all parameters by name, as model.row(entry) gives them"
    if not model.parameters.keys() <= of_kind("parameters", parameters, Mapping, words).keys():
        raise InputError([Fault("parameters", shown(parameters), words)])
    if len(model.variables) != 2:
        names = ", ".join(variable.symbol for variable in model.variables)
        raise InputError(f"a plane needs two unknowns; the problem has {names or 'none'}")
    if not slot_s > 0.0:
        raise InputError([Fault("slot_s", f"{slot_s!r}", "a length > 0 [s]")])
    upward, across = model.variables
    flown = [plan for plan in load_plans(plans, least=0) if plan]
    points = [(getattr(plan, across.name), getattr(plan, upward.name)) for plan in flown]
    route = flown[0].route if flown else ()
    moments = (constraint.moment for constraint in model.constraints)
    if 0 < len(route) <= max((getattr(moment, "flight", 0) for moment in moments), default=0):
        words = "plans of the itinerary of this model"
        raise InputError([Fault("plans", " → ".join(route), words)])
    ax = ax or style.page(4.4).subplots()
    drawn = Plane(model, parameters)
    counted = drawn.worth_seeing(slot_s, points, SAMPLES)
    for name, number, values_s in (("ylim", 1, counted[0]), ("xlim", 0, counted[1])):
        highest_s = max([0.0, *values_s[-1:], *(point[number] for point in points)]) or 1.0
        ax.set(**{name: (-MARGIN * highest_s, (1.0 + MARGIN) * highest_s)})
    way = ["\n" + " → ".join(map(drawable, route))] * bool(route)
    words = model.title.replace(": ", ", ", 1)  # After the mission's own colon
    ax.set_title(style.titled(flown[0].mission.name, words, *way) if flown else model.title)
    ax.set(xlabel=_axis_label(across), ylabel=_axis_label(upward))
    style.group_thousands(ax)
    handles = list(_draw_constraints(ax, drawn, route))
    handles += _draw_grid(ax, drawn, counted, slot_s)
    for plan, point in zip(flown, points, strict=True):
        in_slots = plan.slot_s is not None
        words = "optimum"
        if plan.slot_s is not None:
            words += f" in slots of {figure(plan.slot_s)} s"
        times = f"{across.symbol} = {seconds(point[0])}, {upward.symbol} = {seconds(point[1])}"
        label = f"{words}\n{_set(times)}"
        around: style.Look = {"markersize": 16.0, "markerfacecolor": "none"} if in_slots else {}
        handles += signs.put(ax, "optimum", point, label, **around)
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), labelspacing=0.9)
    style.settle(ax)
    return ax


def _axis_label(variable: Variable) -> str:
    """Words, symbol and unit of an unknown."""
    words = variable.name.removesuffix(f"_{variable.unit}").replace("_", " ")
    return _set(f"{words} {variable.symbol} [{variable.unit}]")


def _set(words: str) -> str:
    """Words with T' as mathematics."""
    return words.replace("T'", "$T'$")


def _draw_grid(
    ax: Axes, drawn: Plane, counted: Sequence[Floats], slot_s: float
) -> Iterator[Artist]:
    """Draw the grid, dots where it is feasible and crosses elsewhere; entries of the legend."""
    (upward, across), one_of = thinned(counted)
    x, y = np.meshgrid(across, upward)
    inside = drawn.feasible(upward, across)
    fewer = f", one of {one_of} shown" if one_of > 1 else ""
    slots = f"(slots of {figure(slot_s)} s{fewer})"
    for which, marker, size, colour, words in (
        (inside, "o", 1.8, BLACK, "feasible"),
        (~inside, "x", 2.2, style.GREY, "not feasible"),
    ):
        if which.any():
            (dots,) = ax.plot(x[which], y[which], marker, markersize=size, color=colour)
            dots.set(markeredgewidth=0.5, label=f"{words}\n{slots}")
            yield dots


def _draw_constraints(ax: Axes, drawn: Plane, route: Sequence[str]) -> Iterator[Artist]:
    """Draw the boundaries that cut, with their forbidden sides; entries of the legend."""
    x, y = (np.linspace(*limits, SAMPLES) for limits in (ax.get_xlim(), ax.get_ylim()))
    names = [*map(drawable, route)]
    colours = cycle(OWN)
    for cut in drawn.cuts(x, y):
        role = ROLES.get(kind_of(cut.constraint))
        look: style.Look = (
            {"color": next(colours), "linestyle": "-"} if role is None else style.limit(role)
        )
        colour, dashes = look["color"], look["linestyle"]
        lines: style.Look = {"colors": [colour], "linestyles": [dashes], "zorder": 3}
        name = _set(textwrap.fill(constraint_name(cut.constraint, names), LETTERS))
        excess = cut.excess
        low, high = float(excess.min()), float(excess.max())
        if cut.forbids and low < 0.0:
            levels = [low, min(0.0, high)]
            ax.contourf(x, y, excess, levels=levels, colors=[colour], alpha=0.1, zorder=0.5)
        if high < 0.0:
            yield Patch(color=colour, alpha=0.2, label=f"{name}\n(holds nowhere here)")
        if low < 0.0 < high:
            where = np.ma.masked_array(excess, ~cut.others_hold)
            for shown, width in ((excess, 0.8), (where, 2.0)):
                if shown.min() < 0.0 < shown.max():
                    ax.contour(x, y, shown, [0.0], linewidths=width, **lines)
            yield style.entry(name, colour, 2.0, dashes)

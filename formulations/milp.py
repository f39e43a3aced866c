"""(P1) over all routes as one mixed-integer linear programme, by a big M or as a convex hull.

λ_r is 1 for the route r that is flown and 0 for the others, Σ λ_r = 1.

- ``"hull"``: every route has times Δ_r and T'_r of its own, and Δ = Σ Δ_r, T' = Σ T'_r. A row
  a·x + c ≥ 0 becomes a·x_r + c·λ_r ≥ 0, so that λ_r = 0 leaves x_r = 0. With 0 ≤ λ_r ≤ 1 these rows
  describe the convex hull of all routes [1]_: no linear relaxation is tighter.
- ``"big-M"``: the routes share Δ and T'. A row a·x + c ≥ 0 becomes a·x + c ≥ −M·(1 − λ_r), with M
  as small as the deadline allows. Fewer unknowns and rows, but a far looser relaxation: a part of
  each route slackens the rows of all of them [2]_.

References
----------
.. [1] E. Balas, "Disjunctive programming: properties of the convex hull of feasible points",
   Discrete Applied Mathematics, 1998.
.. [2] J. P. Vielma, "Mixed integer linear programming formulation techniques", SIAM Review, 2015.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from formulations.parameters import QUANTITIES, Quantities, symbol_for
from formulations.soc import PERSPECTIVES
from optuav.modelling import Expression, Let, Model, Parameter, Variable
from optuav.modelling.expression import Indexed, Operand, Relation, Sense
from optuav.options import Perspective

Form: TypeAlias = Literal["hull", "big-M"]
FORMS: tuple[Form, ...] = ("hull", "big-M")
RESTS = ("rest_current_A", "rest_received_W")
"""Quantities of a rest, which a route without one does not have."""


@dataclass(frozen=True)
class Route:
    """A route that may be chosen.

    Parameters
    ----------
    name
        What its choice and its rows are called.
    given
        Its quantities: numbers.
    hover_s, rest_s
        Least and most Δ and T' [s]. A finite most Δ stands for the deadline.
    cut_s
        By how much the deadline cuts the last slot of Δ short [s].
    """

    name: str
    given: Quantities
    hover_s: tuple[float, float] = (0.0, math.inf)
    rest_s: tuple[float, float] = (0.0, math.inf)
    cut_s: float = 0.0


class _Condition(NamedTuple):
    """A condition on the times of a route: left(Δ, T'), which is affine, compared with right."""

    name: str
    left: Callable[[Operand, Operand], Operand]
    sense: Sense
    right: Operand
    unit: str
    kind: str = ""
    falls: tuple[bool, bool] = (False, False)
    """Whether left falls with Δ, and with T'."""


class _Option(NamedTuple):
    """A route with its number, its symbols, its choice λ and its rows."""

    number: int
    route: Route
    given: Quantities
    choice: Variable
    rows: Sequence[_Condition]


def route_choice(
    routes: Sequence[Route], perspective: Perspective, form: Form, *, relaxed: bool = False
) -> Model:
    """The longest hover time on any one of some routes, as one linear model.

    Of equal plans the shortest mission is preferred, and of those the first route.

    Parameters
    ----------
    routes
        The routes, in the order in which ties are broken.
    perspective
        ``"battery"``, ``"energy"`` or ``"adjusted"``: one in which the state of charge is affine.
    form
        ``"hull"`` or ``"big-M"``, see the module.
    relaxed
        Whether several routes may be flown in part: 0 ≤ λ_r ≤ 1 instead of 0 or 1.

    Returns
    -------
    A model with the unknowns of (P1) and a ``choice[k]`` for every route, k from 1; as a hull also
    with ``hover_time_s[k]`` and ``rest_time_s[k]``. A quantity that differs between the routes is a
    parameter ``name[k]``.
    """
    title = "P1: longest hover within reach of the device, with or without a rest"
    model = Model(f"{title}, on one of {len(routes)} routes")
    model.variable("hover_time_s", "Δ", unit="s")
    model.variable("rest_time_s", "T'", unit="s")
    options = []
    symbols = _symbols(routes)
    for number, (route, own) in enumerate(zip(routes, symbols, strict=True), start=1):
        name, symbol = f"choice[{number}]", Indexed("λ", number)
        choice = model.variable(
            name, symbol, unit="1", upper=1.0, label=route.name, binary=not relaxed
        )
        options.append(_Option(number, route, own, choice, [*_rows(route, own, perspective)]))
    _aim(model, options)
    one = _total(each.choice for each in options)
    model.subject_to("P1 one route", one == 1.0)
    (_hull if form == "hull" else _big_m)(model, options)
    any_of_them = options[0].given
    in_reach = any_of_them.hover_distance_m <= any_of_them.coverage_radius_m
    model.subject_to("P1.a outage", in_reach, unit="m", kind="outage")
    gap = any_of_them.end_gap_m
    if len({each.given.end_gap_m for each in options}) > 1:
        gap = _total(each.given.end_gap_m * each.choice for each in options)
    model.subject_to("P1.c ends", gap <= 0.0, unit="m", kind="ends")
    z = any_of_them.hover_altitude_m
    model.subject_to("P1.e altitude", z >= any_of_them.min_altitude_m, unit="m", kind="altitude")
    highest = z <= any_of_them.max_altitude_m
    model.subject_to("P1.e highest altitude", highest, unit="m", kind="altitude")
    return model


def _total(terms: Iterable[Operand]) -> Operand:
    return reduce(np.add, terms)


def _symbols(routes: Sequence[Route]) -> list[Quantities]:
    """The quantities of every route as parameters, one for all where it has the same value."""
    found: list[dict[str, Operand]] = [{} for _ in routes]
    for each in QUANTITIES:
        values = [getattr(route.given, each.name) for route in routes]
        if each.name in RESTS:
            values = [
                v if route.given.rests else None for v, route in zip(values, routes, strict=True)
            ]
        stated = [float(np.squeeze(value)) for value in values if value is not None]
        shared = symbol_for(each, stated[0]) if stated else None
        alike = np.array_equal(stated, stated[:1] * len(stated), equal_nan=True)
        for number, (symbols, value) in enumerate(zip(found, values, strict=True), start=1):
            if alike or shared is None:
                symbols[each.name] = shared
            else:
                name, symbol = f"{each.name}[{number}]", Indexed(shared.symbol, number)
                own = 0.0 if value is None else float(np.squeeze(value))
                symbols[each.name] = Parameter(name, symbol, shared.unit, own, shared.key)
    return [
        Quantities(**symbols, rests=route.given.rests)
        for symbols, route in zip(found, routes, strict=True)
    ]


def _aim(model: Model, options: Sequence[_Option]) -> None:
    """State the longest hover time, then the shortest mission, then the first route."""
    hover, rest = model.variables[:2]
    hovered = hover
    for each in options:
        if each.route.cut_s > 0.0:
            cut = Parameter(
                f"cut_s[{each.number}]", Indexed("c", each.number), "s", each.route.cut_s
            )
            hovered = hovered - cut * each.choice
    model.maximise(hovered)
    flight = _total(each.given.flight_time_s * each.choice for each in options)
    model.prefer_small(model.let("mission time", flight + hovered + rest, symbol="T", unit="s"))
    place = _total(float(each.number) * each.choice for each in options)
    words = "number of the route"
    model.prefer_small(model.let("place in order", place, symbol="n", words=words))


def _rows(route: Route, given: Quantities, perspective: Perspective) -> Iterator[_Condition]:
    """What the times of a route have to satisfy, apart from being at least 0."""

    def soc(hover: Operand, rest: Operand) -> Operand:
        still = [name for name, time in (("hover", hover), ("rest", rest)) if _is_zero(time)]
        zeros: dict[str, Operand] = {
            f"{stay}_{each}": 0.0 for stay in still for each in ("current_A", "received_W")
        }
        if "hover" in still:
            zeros["hover_power_W"] = 0.0
        return PERSPECTIVES[perspective](replace(given, **zeros), hover, rest)

    def charge(hover_s: float, rest_s: float) -> float:
        return float(np.squeeze(PERSPECTIVES[perspective](route.given, hover_s, rest_s)))

    falls = charge(1.0, 0.0) < charge(0.0, 0.0), charge(0.0, 1.0) < charge(0.0, 0.0)
    yield _Condition(
        "P1.b state of charge", soc, ">=", given.min_soc, "1", "state of charge", falls
    )
    if math.isinf(route.hover_s[1]):
        yield _Condition("P1.d hover time", np.add, "<=", given.time_left, "s", "deadline")
    for symbol, time, (least_s, most_s) in (
        ("Δ", lambda hover, rest: hover, route.hover_s),
        ("T'", lambda hover, rest: rest, route.rest_s),
    ):
        if least_s > 0.0:
            yield _Condition(f"least {symbol}", time, ">=", least_s, "s")
        if math.isfinite(most_s):
            yield _Condition(f"most {symbol}", time, "<=", most_s, "s")


def _is_zero(time: Operand) -> bool:
    return isinstance(time, float) and time == 0.0


def _hull(model: Model, options: Sequence[_Option]) -> None:
    """State the rows on times of each route's own, their constants multiplied by its choice."""
    shared = model.variables[:2]
    own: list[list[Variable]] = [[], []]
    for number, route, _, choice, rows in options:
        times: list[Operand] = [0.0, 0.0]
        for k, each in enumerate(shared[: 1 + route.given.rests]):
            symbol = Indexed(each.symbol, number)
            times[k] = model.variable(f"{each.name}[{number}]", symbol, unit="s")
            own[k].append(times[k])
        for row in rows:
            left, constant = row.left(*times), row.left(0.0, 0.0)
            if isinstance(constant, Expression):
                left = left - (1.0 - choice) * constant
            relation = Relation(left, row.sense, row.right * choice)
            model.subject_to(f"{row.name}, {route.name}", relation, unit=row.unit, kind=row.kind)
    for each, parts in zip(shared, own, strict=True):
        total = _total(parts) if parts else 0.0
        model.subject_to(f"{each.symbol} of the route", each == total, unit="s")


def _big_m(model: Model, options: Sequence[_Option]) -> None:
    """State the rows on the shared times, switched off by M where their route is not flown."""
    hover, rest = model.variables[:2]
    most_hover = _longest(model, hover, [_most_hover(each) for each in options])
    resting = [each.given.time_left for each in options if each.given.rests]
    most_rest = _longest(model, rest, resting if len(resting) == len(options) else [0.0, *resting])
    for number, route, given, choice, rows in options:
        for k, row in enumerate(rows, start=1):
            at_least = row.sense == ">="
            most = (most_hover, most_rest if given.rests else 0.0)
            corner = [
                end if falls is at_least else 0.0
                for end, falls in zip(most, row.falls, strict=True)
            ]
            worst, label = row.left(*corner), f"{row.name}, {route.name}"
            off = (1.0 - choice) * model.let(
                f"M{k} of {label}",
                row.right - worst if at_least else worst - row.right,
                symbol=Indexed(f"M{k}", number),
                unit=row.unit,
            )
            left = row.left(hover, rest if given.rests else 0.0)
            right = row.right - off if at_least else row.right + off
            relation = Relation(left, row.sense, right)
            model.subject_to(label, relation, unit=row.unit, kind=row.kind)
        if not given.rests:
            none = rest <= most_rest * (1.0 - choice)
            model.subject_to(f"no T', {route.name}", none, unit="s")


def _most_hover(option: _Option) -> Operand:
    most_s = option.route.hover_s[1]
    return most_s if math.isfinite(most_s) else option.given.time_left


def _longest(model: Model, time: Variable, bounds: Sequence[Operand]) -> Let:
    """The longest time that any route leaves [s], as a named quantity."""
    words = "the longest that any of the routes leaves"
    symbol = f"U_{time.symbol}"
    most = reduce(np.maximum, bounds)
    return model.let(f"most {time.symbol}", most, symbol=symbol, unit="s", words=words)

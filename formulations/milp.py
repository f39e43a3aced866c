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

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from typing import Literal, NamedTuple, TypeAlias

import numpy as np

from formulations.formulation import Given, named_covered, named_hovers, named_landings
from formulations.limits import state_limits
from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import STAYS, landing_moments, soc_on_landing
from optuav.modelling import Expression, Model, Parameter, Variable, affine
from optuav.modelling.expression import Indexed, Operand, PartedLabel, Relation, Sense
from optuav.options import Perspective

Form: TypeAlias = Literal["hull", "big-M"]
FORMS: tuple[Form, ...] = ("hull", "big-M")


@dataclass(frozen=True)
class Route:
    """A route that may be chosen, with what its choice and its rows are called."""

    name: str
    given: Quantities  # Numbers
    hover_s: tuple[float, float] = (0.0, math.inf)  # A finite most Δ stands for the deadline
    least_rest_s: float = 0.0
    cut_s: float = 0.0  # By how much the deadline cuts the last slot of Δ short [s]


class _Option(NamedTuple):
    """A route with its number, its symbols and its choice λ."""

    number: int
    route: Route
    given: Given
    choice: Variable


class _Row(NamedTuple):
    """A condition on the times of a route: left(Δ, T'), affine in both, and right."""

    name: str
    left: Callable[[Operand, Operand], Operand]
    sense: Sense
    right: Operand
    unit: str
    kind: str = ""


def route_choice(
    routes: Sequence[Route], perspective: Perspective, form: Form, *, relaxed: bool = False
) -> Model:
    """The longest hover time on any one of some routes, as one linear model.

    Of equal plans the shortest mission is preferred, then the first route. Only the paper's
    perspectives are taken, in which the state of charge is affine. The unknowns are those of (P1)
    and a ``choice[k]`` for every route, k from 1, relaxed 0 ≤ λ ≤ 1; as a hull also
    ``hover_time_s[k]`` and ``rest_time_s[k]``. Quantities that differ between routes are parameters
    ``name[k]``.
    """
    devices = "devices" if any(len(route.given.covered) > 1 for route in routes) else "device"
    title = f"P1: longest hover within reach of the {devices}, with or without a rest"
    model = Model(f"{title}, on one of {len(routes)} routes")
    hover = model.variable("hover_time_s", "Δ", unit="s")
    rest = model.variable("rest_time_s", "T'", unit="s")
    options, hovered = [], hover
    pairs = zip(routes, _symbols(routes, perspective), strict=True)
    for number, (route, own) in enumerate(pairs, start=1):
        name, symbol = f"choice[{number}]", Indexed("λ", number)
        choice = model.variable(
            name, symbol, unit="1", upper=1.0, label=route.name, binary=not relaxed
        )
        options.append(_Option(number, route, own, choice))
        if route.cut_s > 0.0:
            cut = Parameter(f"cut_s[{number}]", Indexed("c", number), "s", route.cut_s)
            hovered = hovered - cut * choice
    model.maximise(hovered)
    flight = total([option.given.flight_time_s * option.choice for option in options])
    model.prefer_small(model.let("mission time", flight + hovered + rest, symbol="T", unit="s"))
    place = total([float(option.number) * option.choice for option in options])
    model.prefer_small(model.let("place in order", place, symbol="n", words="number of the route"))
    model.subject_to("P1 one route", total([option.choice for option in options]) == 1.0)
    (_hull if form == "hull" else _big_m)(model, options)
    state_limits(model, options[0].given, "P1")
    return model


def total(terms: Sequence[Operand]) -> Operand:
    """The sum of some terms, 0 of none.

    By halves, as every partial sum has a form of its own: of a thousand terms one after the other
    these would hold half a million.
    """
    if len(terms) < 2:
        return terms[0] if terms else 0.0
    half = (len(terms) + 1) // 2
    return np.add(total(terms[:half]), total(terms[half:]))


def _symbols(routes: Sequence[Route], perspective: Perspective) -> Iterator[Given]:
    """The quantities of every route as parameters, one for all where it has the same value."""
    found: list[dict[str, Operand]] = [{} for _ in routes]
    for quantity in QUANTITIES:
        values = [
            None
            if (quantity.name in STAYS["rest"] and not given.rests)
            or (value := getattr(given, quantity.name)) is None
            else float(np.squeeze(value))
            for given in (route.given for route in routes)
        ]
        noted = [value for value in values if value is not None]
        shared = Parameter(quantity.name, value=noted[0], **quantity.metadata) if noted else None
        alike = np.array_equal(noted, noted[:1] * len(noted), equal_nan=True)
        for number, (symbols, value) in enumerate(zip(found, values, strict=True), start=1):
            symbols[quantity.name] = shared
            if shared is not None and not alike:
                name, symbol = f"{quantity.name}[{number}]", Indexed(shared.symbol, number)
                symbols[quantity.name] = replace(
                    shared, name=name, symbol=symbol, value=value or 0.0
                )
    for number, (symbols, route) in enumerate(zip(found, routes, strict=True), start=1):
        rests = route.given.rests
        of_route = symbols if rests else symbols | dict.fromkeys(STAYS["rest"], 0.0)
        suffix, whole = f"[{number}]", route.given
        yield Given(
            **of_route,
            rests=rests,
            landings=named_landings(whole.landings, suffix),
            hovers=tuple(named_hovers(whole.hovers, suffix)),
            covered=tuple(named_covered(whole.covered)),
            perspective=perspective,
        )


def _rows(option: _Option) -> Iterator[_Row]:
    """Return the constraints on the times of a route, apart from being at least 0."""
    route, given = option.route, option.given
    least_s, most_s = route.hover_s
    charge = given.min_soc, "1", "state of charge"
    yield _Row("P1.b state of charge", given.soc_end, ">=", *charge)
    for landing, moment in zip(given.landings, landing_moments(given), strict=True):
        left = partial(soc_on_landing, given, given.perspective, landing)
        yield _Row(f"P1.b state of charge {moment}", left, ">=", *charge)
    if math.isinf(most_s):
        left = given.time_left
        yield _Row("P1.d hover time", lambda h, r: h + r, "<=", left, "s", "deadline")
    if least_s > 0.0:
        yield _Row("least Δ", lambda h, r: h, ">=", least_s, "s")
    if math.isfinite(most_s):
        yield _Row("most Δ", lambda h, r: h, "<=", most_s, "s")
    if route.least_rest_s > 0.0:
        yield _Row("least T'", lambda h, r: r, ">=", route.least_rest_s, "s")


def _hull(model: Model, options: Sequence[_Option]) -> None:
    """State the rows on times of each route's own, their constants multiplied by its choice."""
    shared = model.variables[:2]
    own: list[list[Variable]] = [[], []]
    for option in options:
        number, route, _, choice = option
        times: list[Operand] = [0.0, 0.0]
        for k, variable in enumerate(shared[: 1 + route.given.rests]):
            symbol = Indexed(variable.symbol, number)
            times[k] = model.variable(f"{variable.name}[{number}]", symbol, unit="s")
            own[k].append(times[k])
        for row in _rows(option):
            left, constant = row.left(*times), row.left(0.0, 0.0)
            if isinstance(constant, Expression):
                left = left - (1.0 - choice) * constant
            relation = Relation(left, row.sense, row.right * choice)
            label = PartedLabel(f"{row.name},", route.name)
            model.subject_to(label, relation, unit=row.unit, kind=row.kind)
    for variable, parts in zip(shared, own, strict=True):
        model.subject_to(f"{variable.symbol} of the route", variable == total(parts), unit="s")


def _big_m(model: Model, options: Sequence[_Option]) -> None:
    """State the rows on the shared times, switched off by M where their route is not flown."""
    hover, rest = model.variables[:2]
    ends_s = ((option.route.hover_s[1], option.given.time_left) for option in options)
    hovers: list[Operand] = [most if math.isfinite(most) else left for most, left in ends_s]
    rests: list[Operand] = [
        option.given.time_left if option.given.rests else 0.0 for option in options
    ]
    most_hover, most_rest = (
        model.let(
            f"most {time.symbol}",
            reduce(np.maximum, bounds),
            symbol=f"U_{time.symbol}",
            unit="s",
            words="the longest that any of the routes leaves",
        )
        for time, bounds in ((hover, hovers), (rest, rests))
    )
    for option in options:
        number, route, given, choice = option
        ends = (most_hover, most_rest if given.rests else 0.0)
        for k, row in enumerate(_rows(option), start=1):
            at_least, label = row.sense == ">=", PartedLabel(f"{row.name},", route.name)
            left, sign = row.left(hover, rest if given.rests else 0.0), -1.0 if at_least else 1.0
            slopes = affine(left, {}).coefficients
            grows = (sign * slopes.get(time.name, 0.0) > 0.0 for time in (hover, rest))
            worst = row.left(*(x if up else 0.0 for x, up in zip(ends, grows, strict=True)))
            missed, symbol = row.right - worst if at_least else worst - row.right, f"M{k}"
            called = PartedLabel(f"{symbol} of", label)
            most = model.let(called, missed, symbol=Indexed(symbol, number), unit=row.unit)
            off = (1.0 - choice) * most
            right = row.right - off if at_least else row.right + off
            model.subject_to(label, Relation(left, row.sense, right), unit=row.unit, kind=row.kind)
        if not given.rests:
            none = rest <= most_rest * (1.0 - choice)
            model.subject_to(PartedLabel("no T',", route.name), none, unit="s")

"""(P1) over the edges of a graph as one mixed-integer linear programme, for several devices.

x_e is 1 for an edge e = (i, j) that is flown and 0 for the others. One edge leads out of the
origin and one into the destination, one into and one out of every hover point, and as many into
every roof as out of it, with one roof at most. Every place on the way has its number u in order; by
Miller, Tucker and Zemlin [1]_

    u_j ≥ u_i + 1 − (U + 2)·(1 − x_ij)

leaves no circle beside the way, for U devices. Flight time and charge are sums over the edges, and
the rest T'_b on a roof is 0 unless an edge leads there, so that all rows are linear. The numbers of
unknowns and rows grow with devices times roofs, while the routes of `formulations.milp` grow with
the factorial of the devices. In exchange, the bound of the linear relaxation is above the optimum.
Rows of Dantzig, Fulkerson and Johnson [2]_ lower it: an edge leads out of every subtour S that
holds a hover point and not the destination,

    Σ x_ij of i in S, j outside ≥ 1.

There are too many to state all of them; `optuav.solving.subtours` finds those that count. If η0
must be left at every landing, the state of charge flows along the edges that are flown.

References
----------
.. [1] C. E. Miller, A. W. Tucker, R. A. Zemlin, "Integer programming formulation of traveling
   salesman problems", Journal of the ACM, 1960.
.. [2] G. Dantzig, R. Fulkerson, S. Johnson, "Solution of a large-scale traveling-salesman problem",
   Journal of the Operations Research Society of America, 1954.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeAlias

import numpy as np

from formulations.formulation import Given
from formulations.limits import state_limits
from formulations.milp import total
from formulations.parameters import Quantities
from formulations.soc import soc_after
from optuav.modelling import Let, Model, Parameter, Variable
from optuav.modelling.expression import Indexed, Operand, PartedLabel
from optuav.options import Perspective

ORIGIN, DESTINATION = "origin", "destination"
FIGURE_UNITS = {"time_s": "s", "charge_As": "A s", "energy_J": "J"}
"""Units of the figures of an edge."""


class Edge(NamedTuple):
    """A leg that may be flown, with its totals."""

    start: str
    end: str
    time_s: float
    charge_As: float
    energy_J: float

    @property
    def name(self) -> str:
        """From where to where."""
        return f"{self.start} → {self.end}"

    def leaves(self, places: "Subtour") -> bool:
        """Whether it leads out of a group of places."""
        return self.start in places and self.end not in places


class Roof(NamedTuple):
    """A building on which the UAV may rest: what charges it there, and the way by it."""

    current_A: float
    received_W: float
    least_flight_s: float  # No route by way of it is shorter


@dataclass(frozen=True)
class EdgeGraph:
    """What routes are made of: edges, hover points and roofs by name."""

    given: Quantities  # Figures of the mission, with a hover of each device
    edges: Sequence[Edge]
    hovers: Sequence[str]  # Names of the hover points, in the mission's order of devices
    roofs: Mapping[str, Roof]
    least_flight_s: float  # No route is shorter
    keeps_landings: bool = False  # Whether η0 must be left at every landing


Subtour: TypeAlias = tuple[str, ...]
"""Names of a group of hover points, and perhaps roofs, joined by legs to each other only."""


def edge_choice(
    graph: EdgeGraph,
    perspective: Perspective,
    subtours: Sequence[Subtour] = (),
    *,
    relaxed: bool = False,
) -> Model:
    """The longest hover time over all routes along some edges, as one linear model.

    An edge has to lead out of each of the `subtours`. Of equal plans the shortest mission is
    preferred. Only the paper's perspectives are taken, in which the state of charge is affine. The
    unknowns are ``hover_time_s``, and by numbers from 1 an ``edge[k]`` for every edge, relaxed
    0 ≤ x ≤ 1, for every place on the way ``order[n]``, hover points first, for every roof
    ``rest_time_s[n]``, and if η0 must be left at landings ``soc[k]`` at the end of every edge.
    """
    title = "P1: longest hover within reach of the devices, with or without a rest"
    model = Model(f"{title}, along {len(graph.edges)} edges")
    given = Given.of(graph.given, perspective)
    hover = model.variable("hover_time_s", "Δ", unit="s")
    ways = _Ways(model, graph, relaxed=relaxed)
    rests = [*_rests(model, given, graph, ways)]
    flown_s = ways.flown("flight time", "T_fl", "time_s", "T")
    rested_s = _named("rest time", "T'", "s", total([rest.time for rest in rests]), "Σ T'_j")
    model.maximise(hover)
    whole_s = model.let("mission time", flown_s + hover + rested_s, symbol="T", unit="s")
    if not relaxed:  # Of a relaxation only the bound counts
        model.prefer_small(whole_s)
    ways.state_flow(subtours)
    whole = replace(given, **_flown(given, ways), **_rested(rests))
    model.subject_to(
        "P1.b state of charge", whole.soc_end(hover, 1.0) >= given.min_soc, kind="state of charge"
    )
    if graph.keeps_landings:
        _keep_landings(model, given, graph, ways, hover, rests)
    model.subject_to("P1.d deadline", whole_s <= given.deadline_s, unit="s", kind="deadline")
    state_limits(model, given, "P1")
    return model


def shortest_way(graph: EdgeGraph, subtours: Sequence[Subtour] = ()) -> Model:
    """The shortest flight over all hover points along some edges, whatever it draws."""
    model = Model(f"shortest flight over all hover points, along {len(graph.edges)} edges")
    ways = _Ways(model, graph, relaxed=False)
    model.minimise(ways.flown("flight time", "T_fl", "time_s", "T"), unit="s")
    ways.state_flow(subtours)
    return model


class _Rest(NamedTuple):
    """A rest on a roof: its time, what charges it, and the longest that a route leaves for it."""

    time: Variable
    current_A: Parameter
    received_W: Parameter
    most_s: Operand


class _Ways:
    """The choice of edges in a model, and the sums over them."""

    def __init__(self, model: Model, graph: EdgeGraph, *, relaxed: bool) -> None:
        self.model, self.edges = model, graph.edges
        self.hovers, self.roofs = [*graph.hovers], [*graph.roofs]
        self._figures = dict[tuple[str, int], Parameter]()
        inner = [*self.hovers, *self.roofs]
        self.number = {name: n for n, name in enumerate((ORIGIN, *inner, DESTINATION))}
        self.flies = [
            model.variable(f"edge[{k}]", Indexed("x", k), unit="1", upper=1.0, binary=not relaxed)
            for k in range(1, len(graph.edges) + 1)
        ]
        most = float(len(self.hovers) + 1)
        self.order = {
            name: model.variable(f"order[{n}]", Indexed("u", n), unit="1", lower=1.0, upper=most)
            for name in inner
            for n in [self.number[name]]
        }
        self.into = {name: self._sum(name, 1) for name in (*inner, DESTINATION)}
        self.out_of = {name: self._sum(name, 0) for name in (ORIGIN, *inner)}

    def _sum(self, place: str, side: int) -> Let:
        """The number of flown edges that begin (0) or end (1) at a place."""
        return self.at("edges", "x", "1", self.flies, place, side)

    def at(
        self, what: str, sign: str, unit: str, figures: Sequence[Operand], place: str, side: int
    ) -> Let:
        """The sum of a figure of the edges, over those that begin (0) or end (1) at a place."""
        terms = [
            term for edge, term in zip(self.edges, figures, strict=True) if edge[side] == place
        ]
        where, verb = (("out", "begin"), ("in", "end"))[side]
        symbol = Indexed(f"{sign.removesuffix('·x')}_{where}", self.number[place])
        words = f"Σ {sign} of the edges that {verb} at place j"
        return _named(
            PartedLabel(f"{what} that {verb} at", place), symbol, unit, total(terms), words
        )

    def flown(self, name: str, symbol: str, figure: str, sign: str) -> Let:
        """The sum of a figure over the edges that are flown."""
        terms = [self.figure(figure, sign, k) * x for k, x in enumerate(self.flies, start=1)]
        return _named(name, symbol, FIGURE_UNITS[figure], total(terms), f"Σ {sign}_j·x_j")

    def figure(self, figure: str, sign: str, k: int) -> Parameter:
        """A figure of an edge by its number."""
        if (figure, k) not in self._figures:
            name, value = f"edge_{figure}[{k}]", getattr(self.edges[k - 1], figure)
            unit = FIGURE_UNITS[figure]
            self._figures[figure, k] = Parameter(name, Indexed(sign, k), unit, value)
        return self._figures[figure, k]

    def order_where(self, place: str, k: int, verb: str) -> Let:
        """The number in order of the place where an edge begins or ends, by the edge's number."""
        label = PartedLabel(f"order where it {verb},", self.edges[k - 1].name)
        symbol = Indexed(f"u_{verb.removesuffix('s')}", k)
        words = f"u of the place where edge j {verb}"
        return _named(label, symbol, "1", self.order[place], words)

    def state_flow(self, subtours: Sequence[Subtour]) -> None:
        """State that the edges are one way over all hover points, and over one roof at most."""
        model, most = self.model, float(len(self.hovers) + 2)
        for place in (ORIGIN, *self.hovers):
            model.subject_to(PartedLabel("P1 out of", place), self.out_of[place] == 1.0)
        for place in (*self.hovers, DESTINATION):
            model.subject_to(PartedLabel("P1 into", place), self.into[place] == 1.0)
        for place in self.roofs:
            same = self.into[place] == self.out_of[place]
            model.subject_to(PartedLabel("P1 into as out of", place), same)
        if self.roofs:
            over = total([self.into[place] for place in self.roofs])
            visits = _named("roofs", "x_roof", "1", over, "Σ x_in,j of all roofs")
            model.subject_to("P1 one roof", visits <= 1.0)
        for k, edge, flies in self.inner():
            start = self.order_where(edge.start, k, "begins")
            end = self.order_where(edge.end, k, "ends")
            later = end >= start + 1.0 - most * (1.0 - flies)
            model.subject_to(PartedLabel("P1 order,", edge.name), later)
        for n, subtour in enumerate(subtours, start=1):
            label = PartedLabel("P1 out of subtour", ", ".join(subtour))
            model.subject_to(label, self._leaving(subtour, n) >= 1.0)

    def _leaving(self, subtour: Subtour, number: int) -> Let:
        """The number of flown edges that lead out of a subtour."""
        ways = zip(self.edges, self.flies, strict=True)
        terms = [x for edge, x in ways if edge.leaves(subtour)]
        name = PartedLabel("edges that leave subtour", number)
        words = "Σ x of the edges that leave subtour j"
        return _named(name, Indexed("x_leave", number), "1", total(terms), words)

    def inner(self) -> Iterator[tuple[int, Edge, Variable]]:
        """The edges between places on the way, with their numbers and choices."""
        for k, (edge, flies) in enumerate(zip(self.edges, self.flies, strict=True), start=1):
            if edge.start != ORIGIN and edge.end != DESTINATION:
                yield k, edge, flies


def _named(name: str, symbol: str, unit: str, expression: Operand, words: str) -> Let:
    """A quantity whose words stand for it on a page."""
    return Let(name, symbol, unit, expression, words)


def _flown(given: Given, ways: _Ways) -> dict[str, Operand]:
    """What all legs draw, as figures of an itinerary."""
    charge_As = ways.flown("flight charge", "Q_fl", "charge_As", "Q")
    if given.perspective == "battery":
        return {"flight_charge_As": charge_As}
    if given.perspective == "adjusted" and given.flight_battery_J is None:
        # E_fl/E_1 with E_1 = B u_fl and u_fl = E_fl/Q_fl is Q_fl/B, at any voltage.
        nominal_V = given.nominal_voltage_V
        return {"flight_energy_J": charge_As * nominal_V, "flight_voltage_V": nominal_V}
    return {"flight_energy_J": ways.flown("flight energy", "E_fl", "energy_J", "E")}


def _rests(model: Model, given: Given, graph: EdgeGraph, ways: _Ways) -> Iterator[_Rest]:
    """Declare the rests, each 0 unless an edge leads to its roof."""
    for name, roof in graph.roofs.items():
        n = ways.number[name]
        time = model.variable(f"rest_time_s[{n}]", Indexed("T'", n), unit="s")
        least = Parameter(f"least_flight_s[{n}]", Indexed("L", n), "s", roof.least_flight_s)
        most_s = given.deadline_s - least
        current = Parameter(f"rest_current_A[{n}]", Indexed("I_rest", n), "A", roof.current_A)
        power = Parameter(f"rest_received_W[{n}]", Indexed("P_0,rest", n), "W", roof.received_W)
        only = time <= most_s * ways.into[name]
        model.subject_to(PartedLabel("P1 rest only on", name), only, unit="s")
        yield _Rest(time, current, power, most_s)


def _rested(rests: Sequence[_Rest]) -> dict[str, Operand]:
    """What all rests charge, as figures of a rest of 1 s."""
    charge_As = total([rest.current_A * rest.time for rest in rests])
    energy_J = total([rest.received_W * rest.time for rest in rests])
    return {
        "rest_current_A": _named("charge of rests", "Q_rest", "A s", charge_As, "Σ I_rest,j·T'_j"),
        "rest_received_W": _named("energy of rests", "E_rest", "J", energy_J, "Σ P_0,rest,j·T'_j"),
    }


class _Stay(NamedTuple):
    """The stay at a place: its figures by name, and its times."""

    figures: Mapping[str, Operand]
    hover: Operand  # Δ, or 0.0
    rest: Operand  # T'_b, or 0.0
    longest: tuple[Operand, Operand]  # Of both


NO_STAY = _Stay({}, 0.0, 0.0, (0.0, 0.0))


def _keep_landings(
    model: Model,
    given: Given,
    graph: EdgeGraph,
    ways: _Ways,
    hover: Variable,
    rests: Sequence[_Rest],
) -> None:
    """State that η0 is left at the end of every edge that is flown.

    The state of charge flows along the edges: 0 at the end of those that are not flown. What leaves
    a place is what arrives there, less what the stay and the next leg draw.
    """
    least = Parameter("least_flight_s", "L", "s", graph.least_flight_s)
    left_s = given.deadline_s - least
    stays = dict([(ORIGIN, NO_STAY), *_stays(given, graph, ways, hover, left_s, rests)])
    most = _named(
        "most charge", "η_most", "1", _most_charge(given, stays), "the most that stays can leave"
    )
    arriving = list[Variable]()
    for k, (edge, flies) in enumerate(zip(ways.edges, ways.flies, strict=True), start=1):
        left = model.variable(f"soc[{k}]", Indexed("η", k), unit="1")
        kept, flown = left >= given.min_soc * flies, left <= most * flies
        model.subject_to(PartedLabel("P1.b on landing,", edge.name), kept, kind="state of charge")
        model.subject_to(PartedLabel("P1.b only along,", edge.name), flown)
        arriving.append(left)
    figure, sign = _drawn(given)
    drawn = [ways.figure(figure, sign, k) * flies for k, flies in enumerate(ways.flies, start=1)]
    for name, stay in stays.items():
        start: Operand = given.start_share
        if name != ORIGIN:
            start = ways.at("charge of edges", "η", "1", arriving, name, 1)
        legs = ways.at("drawn by edges", f"{sign}·x", FIGURE_UNITS[figure], drawn, name, 0)
        figures = {**stay.figures, f"flight_{figure}": legs}
        most_left = _after(given, figures, start, stay.hover, stay.rest)
        leaving = ways.at("charge of edges", "η", "1", arriving, name, 0)
        label = PartedLabel("P1.b state of charge at", name)
        model.subject_to(label, leaving <= most_left, kind="state of charge")


def _stays(
    given: Given,
    graph: EdgeGraph,
    ways: _Ways,
    hover: Variable,
    left_s: Operand,
    rests: Sequence[_Rest],
) -> Iterator[tuple[str, _Stay]]:
    """The stays at hover points, each a share of Δ, and on roofs."""
    for name, (share, current, received) in zip(graph.hovers, given.hovers, strict=True):
        figures = {
            "hover_current_A": ("current", "I", "A", share * current),
            "hover_power_W": ("power", "P", "W", share * given.hover_power_W),
            "hover_received_W": ("received power", "P_0", "W", share * received),
        }
        named = {
            key: _named(
                PartedLabel(what, "over", name), Indexed(sign, ways.number[name]), unit, value, ""
            )
            for key, (what, sign, unit, value) in figures.items()
        }
        yield name, _Stay(named, hover, 0.0, (left_s, 0.0))
    for name, rest in zip(graph.roofs, rests, strict=True):
        charging = {"rest_current_A": rest.current_A, "rest_received_W": rest.received_W}
        yield name, _Stay(charging, 0.0, rest.time, (0.0, rest.most_s))


def _drawn(given: Given) -> tuple[str, str]:
    """The figure of an edge by which its charge counts, with its sign."""
    return ("charge_As", "Q") if given.perspective == "battery" else ("energy_J", "E")


def _after(
    given: Given, figures: Mapping[str, Operand], start: Operand, hover: Operand, rest: Operand
) -> Operand:
    """State of charge after a stay and the edges that leave it, from that before the stay."""
    begun = {"start_soc": start, "start_available_As": None, "start_bound_As": None}
    return soc_after(replace(given, **begun, **figures), given.perspective, hover, rest)


def _most_charge(given: Given, stays: Mapping[str, _Stay]) -> Operand:
    """The most state of charge that any stays can leave, as flights never charge."""
    start, legless = given.start_share, {"flight_charge_As": 0.0, "flight_energy_J": 0.0}
    by_hover: Operand = 0.0
    most: Operand = 0.0
    for stay in stays.values():
        after = _after(given, legless | dict(stay.figures), start, *stay.longest)
        gain = np.maximum(after - start, 0.0)
        if isinstance(stay.hover, Variable):
            by_hover = by_hover + gain
        else:
            most = np.maximum(most, gain)
    return start + np.maximum(most, by_hover)

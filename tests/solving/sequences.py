"""The longest hover over all sequences of stops by charge or energy, each a linear programme.

Written apart from the package: crossings from where a line enters and leaves a box, sequences by
`itertools`, states of charge by hand, and HiGHS for every hover and rest on its own. Of the package
it takes what a single leg draws, the laser and the hover.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import networkx
import numpy as np
import numpy.typing as npt
from scipy.optimize import linprog
from scipy.sparse import block_diag, csr_array

import optuav
from optuav.mission import Mission
from optuav.network import vehicle

LINEAR = ("battery", "energy", "adjusted")
SHIPPED = tuple(map(optuav.load, ("paper", "paper-table2")))
Point = npt.NDArray[np.float64]
Legs = Mapping[tuple[str, str], tuple[float, float, float]]
"""Duration [s], charge [A s] and energy [J] of the legs that can be flown, by places."""


def crosses(start_m: Point, end_m: Point, box: tuple[Point, Point]) -> bool:
    """Whether a line runs through a box of two corners."""
    enter, leave = 0.0, 1.0
    for start, end, low, high in zip(start_m, end_m, *box, strict=True):
        if start == end:
            if not low < start < high:
                return False
            continue
        ends = (low - start) / (end - start), (high - start) / (end - start)
        enter, leave = max(enter, min(ends)), min(leave, max(ends))
    return leave - enter > 1e-9


class Town:
    """Places, boxes and legs of a mission, and what a place charges."""

    def __init__(self, mission: Mission, graph: networkx.DiGraph[str] | None = None) -> None:
        assert mission.laser is not None
        self.mission = mission
        self.position_m = {
            "origin": np.array(mission.route.origin_m),
            "hover": np.array(vehicle.hover_point_m(mission)),
            "destination": np.array(mission.route.destination_m),
            **{each.name: np.array(each.position_m) for each in mission.buildings},
        }
        self.boxes = {}
        for each in mission.buildings:
            x, y, roof = each.position_m
            width, depth = each.footprint_m or (0.0, 0.0)
            half_m = np.array([width / 2, depth / 2, 0.0])
            top_m = np.array([x, y, roof])
            self.boxes[each.name] = np.array([x, y, -np.inf]) - half_m, top_m + half_m
        laser_m = np.array(mission.laser.position_m)
        self.received = {}
        for name, at_m in self.position_m.items():
            sees = self._clear(laser_m, at_m, name)
            flow = vehicle.charging(mission, tuple(at_m))
            self.received[name] = tuple(map(float, flow)) if sees else (0.0, 0.0)
        self.legs = dict(self._legs())
        if graph is not None:
            self._edit(graph)

    def _clear(self, start_m: Point, end_m: Point, *ends: str) -> bool:
        boxes = (box for name, box in self.boxes.items() if name not in ends)
        return not any(crosses(start_m, end_m, box) for box in boxes)

    def _legs(self) -> Iterator[tuple[tuple[str, str], tuple[float, float, float]]]:
        for start, end in itertools.permutations(self.position_m, 2):
            ways_m = self.position_m[start], self.position_m[end]
            if end != "origin" and start != "destination" and self._clear(*ways_m, start, end):
                loads = self.mission.flight_model.leg(tuple((ways_m[1] - ways_m[0]).tolist()))
                drawn = loads.duration_s, loads.charge_As, loads.energy_J
                yield (start, end), tuple(map(float, drawn))

    def _edit(self, graph: networkx.DiGraph[str]) -> None:
        """A graph speaks of the legs with one building on the way, and of those that it adds."""
        for start, end in itertools.permutations(self.position_m, 2):
            roofs = start in self.boxes and end in self.boxes
            if not roofs and {start, end} != {"origin", "destination"}:
                self.legs.pop((start, end), None)
        figures = "duration_s", "charge_As", "energy_J"
        for start, end, data in graph.edges(data=True):
            self.legs[start, end] = tuple(data[name] for name in figures)

    def sequences(self, rests: int, hovers: int) -> Iterator[tuple[str, ...]]:
        """Stops in every order whose legs can all be flown before the deadline."""
        for count in range(1, rests + hovers + 1):
            for stops in itertools.product(["hover", *self.boxes], repeat=count):
                hovered = stops.count("hover")
                ways = [*itertools.pairwise(("origin", *stops, "destination"))]
                if (
                    1 <= hovered <= hovers
                    and count - hovered <= rests
                    and all(way in self.legs for way in ways)
                    and sum(self.legs[way][0] for way in ways) <= self.mission.limits.deadline_s
                ):
                    yield stops


class Programme(NamedTuple):
    """max Σ Δ over the times of all stays ≥ 0 with Σ t ≤ left, Σ cost·t ≤ budget."""

    hovers: list[float]  # 1 for a hover, 0 for a rest
    left_s: float
    cost: list[float]
    budget: float


def programme(town: Town, stops: tuple[str, ...], perspective: str) -> Programme:
    """A sequence as a linear programme, in shares of the battery."""
    mission, battery = town.mission, town.mission.battery
    full_As = battery.packs * battery.capacity_As
    full_J = full_As * battery.nominal_voltage_V
    ways = itertools.pairwise(("origin", *stops, "destination"))
    flight_s, flight_As, flight_J = map(sum, zip(*(town.legs[way] for way in ways), strict=True))
    hover, rest = vehicle.hover_load(mission), mission.flight_model.rest()
    cost = []
    for stop in stops:
        drawn_A, drawn_W = map(float, hover if stop == "hover" else rest)
        charged_A, charged_W = town.received[stop]
        if perspective == "battery":
            cost.append((drawn_A - charged_A) / full_As)
        elif perspective == "adjusted" and stop == "hover":
            stated_J = battery.hover_energy_J
            share = drawn_A / full_As if stated_J is None else drawn_W / stated_J
            cost.append(share - charged_W / full_J)
        else:
            cost.append((drawn_W - charged_W) / full_J)
    flown = {"battery": flight_As / full_As, "energy": flight_J / full_J}.get(perspective)
    if flown is None:
        stated_J = battery.flight_energy_J
        flown = flight_As / full_As if stated_J is None else flight_J / stated_J
    left_s, budget = mission.limits.deadline_s - flight_s, 1.0 - mission.limits.min_soc - flown
    return Programme([float(stop == "hover") for stop in stops], left_s, cost, budget)


def optima(programmes: list[Programme]) -> list[float]:
    """Longest hover of each [s] by HiGHS, all of them as one programme; −∞ where none is feasible.

    A first one finds what each draws at least, so that the second has an answer.
    """
    if not programmes:
        return []
    count = [len(each.cost) for each in programmes]
    costs = np.concatenate([each.cost for each in programmes])
    scale = 1.0 / np.abs(costs).max()  # rows in seconds, for the solver's tolerances
    times = block_diag([csr_array(np.ones((1, k))) for k in count], format="csr")
    left_s = np.array([each.left_s for each in programmes])
    least = linprog(scale * costs, A_ub=times, b_ub=left_s, method="highs")
    assert least.status == 0, least.message
    number = np.repeat(np.arange(len(count)), count)
    drawn = np.bincount(number, costs * least.x)
    feasible = drawn <= np.array([each.budget for each in programmes]) + 1e-12
    found = np.full(len(count), -math.inf)
    if feasible.any():
        kept = [each for each, able in zip(programmes, feasible, strict=True) if able]
        rows = [csr_array([np.ones(len(each.cost)), scale * np.array(each.cost)]) for each in kept]
        limits = np.array([(each.left_s, scale * (each.budget + 1e-12)) for each in kept]).ravel()
        hovers = np.concatenate([each.hovers for each in kept])
        best = linprog(-hovers, A_ub=block_diag(rows, format="csr"), b_ub=limits, method="highs")
        assert best.status == 0, best.message
        which = np.repeat(np.arange(len(kept)), [len(each.cost) for each in kept])
        found[feasible] = np.bincount(which, hovers * best.x)
    return found.tolist()


def longest_hovers_s(town: Town, perspective: str) -> dict[tuple[int, int], float]:
    """Longest hover with at most so many rests and hovers, up to two of each; −∞ for none."""
    stops = [*town.sequences(2, 2)]
    found_s = optima([programme(town, each, perspective) for each in stops])
    longest_s = dict.fromkeys(itertools.product(range(3), (1, 2)), -math.inf)
    for each, hover_s in zip(stops, found_s, strict=True):
        hovered = each.count("hover")
        for rests, hovers in longest_s:
            if hovered <= hovers and len(each) - hovered <= rests:
                longest_s[rests, hovers] = max(longest_s[rests, hovers], hover_s)
    return longest_s


def random_mission(random: np.random.Generator) -> Mission:
    """One of two drones among slim and wide buildings that block legs and the laser's sight."""
    shipped = SHIPPED[random.integers(2)]
    buildings = [
        {
            "name": f"b{number}",
            "position_m": [*random.uniform([0.0, 0.0], [2000.0, 2600.0]), random.uniform(20, 150)],
            "footprint_m": np.exp(random.uniform(math.log(10.0), math.log(500.0), 2)).tolist(),
        }
        for number in range(random.integers(1, 4))
    ]
    changes = {
        "buildings": buildings,
        "limits.deadline_s": random.uniform(100.0, 3000.0),
        "limits.min_soc": random.choice([0.05, random.uniform(0.0, 0.95)]),
        "laser.position_m": [*random.uniform([0.0, -1500.0], [2000.0, 2600.0]), 70.0],
        "laser.power_W": math.exp(random.uniform(math.log(30.0), math.log(1e5))),
        "battery.charge_current_A": random.uniform(1.0, 100.0),
    }
    if shipped.flight.model == "regimes":
        drawn_A = random.choice([0.0, 1.0, 8.0])
        changes |= {"flight.rest_current_A": drawn_A, "flight.rest_power_W": 11.1 * drawn_A}
    return shipped.replace(changes)


def edited_graph(mission: Mission, random: np.random.Generator) -> networkx.DiGraph[str] | None:
    """The mission's graph with edges removed, changed and added; for some missions none."""
    if random.random() < 0.4:
        return None
    graph = optuav.graph(mission)
    for way in [*graph.edges]:
        if random.random() < 0.15:
            graph.remove_edge(*way)
        elif random.random() < 0.3:
            for figure in ("duration_s", "charge_As", "energy_J"):
                graph.edges[way][figure] *= random.uniform(0.05, 3.0)
    names = [each.name for each in mission.buildings]
    for way in itertools.permutations(["origin", "hover", "destination", *names], 2):
        if way[1] != "origin" and way[0] != "destination" and random.random() < 0.15:
            time_s, charge_As, energy_J = random.uniform(1.0, 100.0, 3) * [1.0, 100.0, 1500.0]
            figures = {"duration_s": time_s, "charge_As": charge_As, "energy_J": energy_J}
            graph.add_edge(*way, distance_m=1.0, peak_speed_m_s=1.0, **figures)
    return graph

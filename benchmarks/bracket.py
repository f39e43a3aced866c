"""The engine bracket over arrays of itineraries, against the times it may take."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.timing import Row, median_s
from benchmarks.towns import town
from formulations.parameters import Quantities
from optuav.mission import Mission, load
from optuav.network.network import build_network
from optuav.physics.kibam import Battery, Stage
from optuav.solving import solve
from optuav.solving.assemble import quantities
from optuav.solving.longest import Hovers, longest_hovers

PAIRS = 1_000_000
"""Of a building's two orders, each pair with a battery and a deadline of its own."""


@dataclass(frozen=True)
class Batch:
    """Routes as `longest_hovers` takes them."""

    steps: Any
    figures: dict[str, Any]

    def __len__(self) -> int:
        return np.size(self.figures["rest_current_A"])

    def solve(self) -> Hovers:
        """Longest hovers."""
        return longest_hovers(self.steps, **self.figures)


def run() -> list[Row]:
    """All itineraries of the shipped mission, of towns, and of a million pairs."""
    mission = load("paper")
    few = list(batches(mission))
    count = sum(map(len, few))
    few_s = median_s(lambda: [each.solve() for each in few], 101)
    rows = [
        Row(f"all {count} itineraries of paper / 5 ms", few_s, 5e-3, at_most=1.0),
    ]
    each_s = None
    for buildings in (100, 1_000, 10_000, 100_000):
        many = [each for each in batches(town(buildings)) if "rest" in each.steps]
        seconds = median_s(lambda: [each.solve() for each in many], 5)  # noqa: B023
        if buildings == 10_000:
            rows.append(Row("10 000 buildings, both orders / 0.1 s", seconds, 0.1, at_most=1.0))
            pairs = [_missions(each, PAIRS) for each in many]
        each_s = each_s or seconds / 100
        rows.append(Row(f"a building of {buildings} / of 100", seconds / buildings, each_s))
    seconds = median_s(lambda: [each.solve() for each in pairs], 1)
    what = f"10⁶ pairs, {_peak_bytes(pairs[0]) / 1e6:.0f} MB beside figures and answers / 6 s"
    rows.append(Row(what, seconds, 6.0, at_most=1.0))
    city = town(10_000)

    def whole() -> None:
        build_network.cache_clear()
        solve(city)

    whole_s = median_s(whole, 3)
    worked_out_s = median_s(lambda: build_network.__wrapped__(city), 3)
    rows.append(Row("optuav.solve, 10 000 buildings / its geometry", whole_s, worked_out_s))
    return rows


def batches(mission: Mission) -> Iterator[Batch]:
    """The itineraries of a mission that can be flown, by the order of their stays."""
    network = build_network(mission)
    routes = network.routes
    direct = routes.building < 0
    for which in (direct, ~direct & routes.rest_first, ~direct & ~routes.rest_first):
        yield _batch(quantities(network, np.flatnonzero(which & routes.flyable)))


def _batch(given: Quantities) -> Batch:
    """Itineraries that stay in one order, as arguments of `longest_hovers`."""
    names = ("deadline_s", "min_soc", "hover_current_A", "rest_current_A")
    figures = {name: getattr(given, name) for name in names}
    cells = Battery(given.battery_As, given.available_fraction, given.flow_rate_per_s)
    return Batch(given.steps, {**figures, "battery": cells})


def _missions(batch: Batch, count: int) -> Batch:
    """As many itineraries, the given ones in turn, over batteries and deadlines at random."""
    chance, cells = np.random.default_rng(2), batch.figures["battery"]
    steps = [
        s if isinstance(s, str) else Stage(*(np.resize(figure, count) for figure in s))
        for s in batch.steps
    ]
    figures = batch.figures | {
        "rest_current_A": np.resize(batch.figures["rest_current_A"], count),
        "deadline_s": chance.uniform(600.0, 2000.0, count),
        "battery": Battery(
            cells.capacity_As * chance.uniform(0.8, 1.2, count),
            chance.uniform(0.5, 0.95, count),
            cells.flow_rate_per_s * chance.uniform(0.3, 3.0, count),
        ),
    }
    return replace(batch, steps=steps, figures=figures)


def _peak_bytes(batch: Batch) -> int:
    """Largest memory at work beside the figures that are given and the answers."""
    tracemalloc.start()
    found = batch.solve()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert found.proved.all()
    return peak - sum(each.nbytes for each in found)

"""What the constraints of `available` are reduced to, against integration with events.

The programme looks at the ends of phases alone, and takes several stages of a leg as one stretch;
the differential equations are watched at every moment.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from optuav.modelling import check
from optuav.network.network import Network
from optuav.network.timeline import route_phases
from optuav.solving import Program
from tests.examples import few
from tests.kibam import Floats
from tests.solving.test_flyable_missions import questions

UNDECIDED = 1e-7
"""Share of the capacity from a limit within which neither side is asked."""


def crossings(network: Network, route: int, times_s: tuple[float, float]) -> Iterator[str]:
    """Limits that stays break on an itinerary, met by events on the way; (11)-(12) in shares."""
    battery, limits = network.mission.battery, network.mission.limits
    capacity_As, share = battery.packs * battery.capacity_As, battery.available_fraction
    flow, wells, used_s = battery.flow_rate_per_s, np.array([share, 1.0 - share]), 0.0

    def dry(_: float, y: Floats) -> float:
        return float(y[0] + UNDECIDED)

    def past_full(_: float, y: Floats) -> float:
        return float(share + UNDECIDED - y[0])

    for phase in route_phases(network, route, *times_s):
        for stage in phase.stages:
            current = stage.current_A / capacity_As

            # In shares of the stage, as LSODA does not come to an end over next to no seconds.
            def slope(
                _: float, y: Floats, current: float = current, end_s: float = stage.duration_s
            ) -> list[float]:
                shared = flow * (y[1] / (1.0 - share) - y[0] / share)
                return [end_s * (current + shared), end_s * -shared]

            found = solve_ivp(
                slope,
                (0.0, 1.0),
                wells,
                method="LSODA",
                events=(dry, past_full),
                max_step=0.05,
                rtol=1e-10,
                atol=1e-12,
            )
            names = ("dry", "past full")
            yield from (n for n, t in zip(names, found.t_events, strict=True) if len(t))
            wells, used_s = found.y[:, -1], used_s + stage.duration_s
    if wells.sum() < limits.min_soc - UNDECIDED:
        yield "charge"
    if used_s > limits.deadline_s * (1.0 + 1e-9):
        yield "deadline"


@settings(few(5), suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
@given(questions(), st.data())
def test_ends_of_stretches_tell_all(program: Program, data: st.DataObject) -> None:
    """Any stays: what the programme admits breaks no limit at any moment, what it refuses does."""
    part = data.draw(st.sampled_from(program.parts))
    entry = data.draw(st.integers(0, len(part.routes) - 1))
    deadline_s = program.network.mission.limits.deadline_s
    times_s = [data.draw(st.floats(0.0, 0.7)) ** 2 * deadline_s for _ in part.model.variables]
    names = [each.name for each in part.model.variables]
    point: dict[str, Any] = dict(zip(names, times_s, strict=True))
    rows = check(part.model, {**part.model.row(entry), **point})
    charges = [row.slack for row in rows if "dry" in row.label or "full" in row.label]
    assume(all(abs(slack) > 2.0 * UNDECIDED for slack in charges if not math.isinf(slack)))
    stays = point["hover_time_s"], point.get("rest_time_s", 0.0)
    broken = set(crossings(program.network, int(part.routes[entry]), stays))
    assert all(row.satisfied for row in rows) == (not broken), (broken, [*map(str, rows)])

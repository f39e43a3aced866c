"""Two ways of following the wells of a battery through a stretch of constant current."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.physics import charging, kibam
from optuav.physics.kibam import Battery, Wells

Method = Literal["exact", "solve_ivp"]

RELATIVE, ABSOLUTE = 1e-11, 1e-12
"""Error that `solve_ivp` may make in a step, relative and as a share of the capacity [-]."""


Moment: TypeAlias = Callable[[Battery, Wells, float, float], float]
Current: TypeAlias = Callable[[float], float]
"""What seeps from the available well into the bound one [A] → I [A]."""


class Follower(NamedTuple):
    """A way of following the wells.

    Parameters
    ----------
    at
        (battery, wells at the start, I [A], moments [s]) → wells at moments since the start, which
        rise from 0.
    empty_s, full_s
        (battery, wells at the start, I [A], duration [s]) → moment [s] at which the available well
        falls below 0, or rises above ωB; ``inf`` if it does not within the duration.
    held
        (battery, wells at the start, moments [s]) → wells while the available one is held full.
    """

    at: Callable[[Battery, Wells, float, Floats], Wells]
    empty_s: Moment
    full_s: Moment
    held: Callable[[Battery, Wells, Floats], Wells]


def _exact_at(pool: Battery, wells: Wells, current_A: float, passed_s: Floats) -> Wells:
    return kibam.step(pool, wells, kibam.Stage(current_A, passed_s))


def _exact_empty_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    moment_s = float(kibam.time_to_empty(pool, wells, current_A))
    return moment_s if moment_s <= duration_s else np.inf


def _exact_full_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    moment_s = float(kibam.time_to_full(pool, wells, current_A))
    return moment_s if moment_s <= duration_s else np.inf


def _exact_held(pool: Battery, wells: Wells, passed_s: Floats) -> Wells:
    available_As, bound_As = charging.held(pool, wells, passed_s)
    return Wells(np.full_like(passed_s, available_As), bound_As)


def _integrated_at(pool: Battery, wells: Wells, current_A: float, passed_s: Floats) -> Wells:
    return _integrated(pool, wells, lambda _: current_A, passed_s)


def _integrated_empty_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    return _passing_s(pool, wells, current_A, duration_s, 0.0, -1.0)


def _integrated_full_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    return _passing_s(pool, wells, current_A, duration_s, float(pool.full.available_As), 1.0)


def _integrated_held(pool: Battery, wells: Wells, passed_s: Floats) -> Wells:
    """The charger makes up for what seeps away."""
    return _integrated(pool, wells, lambda seeping_A: seeping_A, passed_s)


def _integrated(pool: Battery, wells: Wells, current_A: Current, passed_s: Floats) -> Wells:
    """Wells at moments that rise from 0, and may coincide, as those of a stay of no time do."""
    end_s = float(passed_s[-1])
    shares, place = np.unique(passed_s / (end_s or 1.0), return_inverse=True)
    return Wells(*_solve(pool, wells, current_A, end_s, t_eval=shares).y[:, place])


def _passing_s(
    pool: Battery,
    wells: Wells,
    current_A: float,
    duration_s: float,
    level_As: float,
    direction: float,
) -> float:
    def beyond(_: float, y: Floats) -> float:
        return float(y[0] - level_As)

    beyond.direction = direction  # type: ignore[attr-defined]
    found_s = _solve(pool, wells, lambda _: current_A, duration_s, events=beyond).t_events[0]
    return float(found_s[0]) * duration_s if len(found_s) else np.inf


def _solve(pool: Battery, wells: Wells, current_A: Current, end_s: float, **options: Any) -> Any:
    """(11)-(12) of the paper, integrated over shares of a duration.

    Over seconds LSODA does not come to an end where there are next to none.
    """
    from scipy.integrate import solve_ivp

    share, rate = pool.available_fraction, pool.flow_rate_per_s

    def slope(_: float, y: Floats) -> list[float]:
        seeping_A = rate * (y[0] / share - y[1] / (1.0 - share))
        return [end_s * (current_A(seeping_A) - seeping_A), end_s * seeping_A]

    return solve_ivp(
        slope,
        (0.0, 1.0),
        np.array(wells, dtype=float),
        method="LSODA",
        rtol=RELATIVE,
        atol=ABSOLUTE * pool.capacity_As,
        **options,
    )


FOLLOWERS: Mapping[Method, Follower] = {
    "exact": Follower(_exact_at, _exact_empty_s, _exact_full_s, _exact_held),
    "solve_ivp": Follower(
        _integrated_at, _integrated_empty_s, _integrated_full_s, _integrated_held
    ),
}
"""The closed form with halving for the moments, and SciPy's integration with events."""

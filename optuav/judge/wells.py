"""Two ways of following the wells of a battery through a stretch of constant current."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.physics import battery, charging
from optuav.physics.battery import Battery, Wells

Method = Literal["exact", "solve_ivp"]

RELATIVE, ABSOLUTE = 1e-11, 1e-12
"""Error that `solve_ivp` may make in a step, relative and as a share of the capacity [-]."""


Moment: TypeAlias = Callable[[Battery, Wells, float, float], float]


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
    return battery.step(pool, wells, battery.Phase(current_A, passed_s))


def _exact_empty_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    moment_s = float(battery.time_to_empty(pool, wells, current_A))
    return moment_s if moment_s <= duration_s else np.inf


def _exact_full_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    moment_s = float(battery.time_to_full(pool, wells, current_A))
    return moment_s if moment_s <= duration_s else np.inf


def _exact_held(pool: Battery, wells: Wells, passed_s: Floats) -> Wells:
    available_As, bound_As = charging.held(pool, wells, passed_s)
    return Wells(np.full_like(passed_s, available_As), bound_As)


def _integrated_at(pool: Battery, wells: Wells, current_A: float, passed_s: Floats) -> Wells:
    end_s = float(passed_s[-1])
    if end_s == 0.0:
        return Wells(*(np.full(len(passed_s), float(each)) for each in wells))
    return Wells(*_solve(pool, wells, current_A, end_s, t_eval=passed_s / end_s).y)


def _integrated_empty_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    return _passing_s(pool, wells, current_A, duration_s, 0.0, -1.0)


def _integrated_full_s(pool: Battery, wells: Wells, current_A: float, duration_s: float) -> float:
    return _passing_s(pool, wells, current_A, duration_s, float(pool.full.available_As), 1.0)


def _integrated_held(pool: Battery, wells: Wells, passed_s: Floats) -> Wells:
    """(12) of the paper with y1 held, integrated: the charger makes up for what seeps away."""
    from scipy.integrate import solve_ivp

    available_As, bound_As = map(float, wells)
    share, rate = pool.available_fraction, pool.flow_rate_per_s
    end_s = max(float(passed_s[-1]), np.finfo(float).tiny)
    found = solve_ivp(
        lambda _, y: end_s * rate * (available_As / share - y / (1.0 - share)),
        (0.0, 1.0),
        [bound_As],
        t_eval=passed_s / end_s,
        method="LSODA",
        rtol=RELATIVE,
        atol=ABSOLUTE * pool.capacity_As,
    )
    return Wells(np.full_like(passed_s, available_As), found.y[0])


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
    found_s = _solve(pool, wells, current_A, duration_s, events=beyond).t_events[0]
    return float(found_s[0]) * duration_s if len(found_s) else np.inf


def _solve(pool: Battery, wells: Wells, current_A: float, end_s: float, **options: Any) -> Any:
    """(11)-(12) of the paper, integrated over shares of a duration.

    Over seconds LSODA does not come to an end where there are next to none.
    """
    from scipy.integrate import solve_ivp

    share, rate = pool.available_fraction, pool.flow_rate_per_s

    def slope(_: float, y: Floats) -> list[float]:
        flow_A = rate * (y[1] / (1.0 - share) - y[0] / share)
        return [end_s * (current_A + flow_A), end_s * -flow_A]

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

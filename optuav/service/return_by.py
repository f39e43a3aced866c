"""When to leave the hover point, and the rule that a monitor carries on board."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from optuav.errors import NoPlanError, printable, refuse
from optuav.mission import Mission, load
from optuav.network import vehicle
from optuav.network.legs import Legs
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, levelling, step, tilted_after
from optuav.physics.roots import largest
from optuav.plan.summary import tabulated
from optuav.service.checks import (
    calm_facts,
    calm_line,
    flyable_network,
    in_calm_air,
    schedule_faults,
)
from optuav.studies.results import Pictures, Results, ResultsWithFacts, fixed

UNITS = {
    **{"place": "", "flight_s": "s", "dry_s": "s", "soc_s": "s", "earliest_s": "s"},
    **{"latest_s": "s", "binds": "", "a": "-", "b": "-", "g_As": "A s"},
}
MONITOR = ("a", 6), ("b", 6), ("g_As", 2)  # With digits
SHOWN = 10  # Places that are printed
POINTS = 100  # Moments of a picture
TOO_LATE = "too late to leave"
LEVEL = 700.0  # Time constants after which wells are level
MOST = 1e-9  # Share of the capacity by which rounding may empty a well


class Rule(NamedTuple):
    """Leave as soon as a·y1 + b·y2 < g, and between which moments that does not hold."""

    earliest_s: float  # After now [s]; inf if it always holds
    latest_s: float  # inf if it never holds again, −inf if it always does
    a: float
    b: float
    g_As: float

    def spare_As(self, wells: Wells) -> float:
        """a·y1 + b·y2 − g [A s]."""
        return self.a * float(wells.available_As) + self.b * float(wells.bound_As) - self.g_As


def return_by(mission: Mission | str | Path) -> ResultsWithFacts:
    """Find the last moment to leave the hover point, for the destination and every building.

    A place is in time while the available well stays above 0 on the whole way to it and
    ``limits.min_soc`` of the charge is left at the landing; the deadline plays no part. Moments
    count from the arrival at the hover point, with the charge that ``start`` and the leg from the
    origin leave. To ask again on the way, state ``start`` and ``route.origin_m`` there.

    The well at the end of a stage of the leg is α + βt + γ·exp(−k't) after a hover of t ([1]_ eqs
    (15)-(16)). It turns once at most, and its zeros are bracketed. Far from level wells may have to
    level out first: on the way to a place the available well may run dry if the drone leaves at
    once, but not later.

    Parameters
    ----------
    mission
        A mission, or its name or path; its packs are pooled.

    Returns
    -------
    ResultsWithFacts
        One row per place that can be reached: ``flight_s``; ``dry_s`` and ``soc_s``, the last
        moments by the available well and by the charge, and ``latest_s``, the smaller [s] (None
        if it is too late at once, inf if hovering draws nothing); ``earliest_s``, the first moment,
        0 as a rule; ``binds``, the limit behind the last one; and the monitor ``a``, ``b`` [-],
        ``g_As`` [A s]: leave as soon as a·y1 + b·y2 < g. They are None where leaving at once would
        run dry. Facts: ``latest_s`` and ``place`` of the place that leaves most time,
        ``available_As`` and ``bound_As`` on arrival [A s], and ``hover_current_A`` [A] beyond
        ``received_current_A``, which the laser gives; remove ``laser`` where nothing charges the
        hover. ``calm_latest_s`` and ``in_calm_air`` are not None if hovering counts on the wind:
        the same last moment in calm air, and in words.

    Raises
    ------
    InputError
        If the packs take turns.
    NoPlanError
        If the hover point cannot be reached, or no place from there.

    Examples
    --------
    >>> import optuav
    >>> times = optuav.return_by("paper")
    >>> f"{times.rows[0]['latest_s']:.3f} s for the destination, {times.latest_s:.3f} s at most"
    '577.524 s for the destination, 597.270 s at most'

    References
    ----------
    .. [1] W. Jaafar, H. Yanikomeroglu, "Dynamics of laser-charged UAVs: a battery perspective",
       IEEE Internet of Things Journal, 2021.
    """
    loaded = load(mission)
    refuse(schedule_faults(loaded))
    network, battery = flyable_network(loaded), loaded.pool
    arriving, landing = _ways(network.legs)
    charge = _arrived(loaded, network.legs.stages_of(arriving))
    received_A = float(network.places.charge_current_A[HOVER])
    hover_A = float(vehicle.hover_load(loaded).current_A) - received_A
    least_As = loaded.limits.min_soc * float(battery.capacity_As)
    rows = list[dict[str, Any]]()
    for leg in landing:
        moments = _moments(battery, charge, hover_A, network.legs.stages_of(leg), least_As)
        place, flight_s = network.legs.end[leg], float(network.legs.duration_s[leg])
        row = network.places.names[place], flight_s, *moments
        rows.append(dict(zip(UNITS, row, strict=True)))
    best = max(rows, key=lambda row: -1.0 if row["latest_s"] is None else row["latest_s"])
    available_As, bound_As = map(float, charge.wells(battery))
    facts = {
        **{"latest_s": best["latest_s"], "place": best["place"], "available_As": available_As},
        **{"bound_As": bound_As, "hover_current_A": hover_A, "received_current_A": received_A},
    }
    calm = in_calm_air(loaded, lambda mission: return_by(mission).latest_s or TOO_LATE)
    facts |= calm_facts("calm_latest_s", calm, "{:.3f} s at most")
    return ResultsWithFacts("optuav return", loaded, facts, UNITS, tuple(rows), _show, _draw)


def _ways(legs: Legs) -> tuple[int, list[int]]:
    """Return the leg to the hover point, and those from there in the order of places."""
    (arriving,) = np.flatnonzero((legs.start == ORIGIN) & (legs.end == HOVER)).tolist()
    lands = (legs.end == DESTINATION) | (legs.end >= FIRST_BUILDING)
    landing = np.flatnonzero(legs.flyable & (legs.start == HOVER) & lands).tolist()
    if not legs.flyable[arriving] or not landing:
        words = "to the hover point" if not legs.flyable[arriving] else "back from the hover point"
        raise NoPlanError(f"no leg {words} can be flown: optuav explain names what is in the way")
    return arriving, sorted(landing, key=lambda leg: int(legs.end[leg]))


def _arrived(mission: Mission, way: Sequence[Stage]) -> Tilted:
    """Return the charge on arrival at the hover point, or refuse a well that runs dry before."""
    battery, charge = mission.pool, vehicle.start(mission)
    for stage in way:
        charge = tilted_after(battery, charge, stage)
        if float(charge.wells(battery).available_As) < -MOST * float(battery.capacity_As):
            raise NoPlanError(
                "the available well runs dry before the drone reaches the hover point"
            )
    return charge


def _moments(
    battery: Battery, charge: Tilted, hover_A: float, way: Sequence[Stage], least_As: float
) -> tuple[object, ...]:
    """Return the moments by both limits and between both, which binds, and its monitor.

    See `UNITS`. The available well stays above 0 while hovering and at the end of every stage.
    """
    by_charge = _by_charge(charge, hover_A, way, least_As)
    by_well = [_at_an_end(battery, charge, hover_A, way[:count]) for count in range(len(way) + 1)]
    first = min(by_well, key=lambda rule: rule.latest_s)
    rules, soc_s = (*by_well, by_charge), by_charge.latest_s
    latest_s = min(first.latest_s, soc_s)
    earliest_s = max(rule.earliest_s for rule in rules)
    if math.isfinite(latest_s):  # Up to when all rules hold, or one holds but later
        wells = tilted_after(battery, charge, Stage(-hover_A, latest_s)).wells(battery)
        in_time = min(rule.spare_As(wells) for rule in by_well) >= -MOST * battery.capacity_As
        earliest_s = min(earliest_s, latest_s) if in_time else math.inf
    if earliest_s == math.inf and soc_s >= 0.0:
        first = first._replace(latest_s=-math.inf)
    binds, rule = "charge", by_charge
    if first.latest_s < soc_s or first.latest_s < 0.0:
        binds, rule = "available well", first
    moments_s = (None if at_s < 0.0 else at_s for at_s in (first.latest_s, soc_s))
    monitor = rule[2:] if earliest_s == 0.0 else (None, None, None)
    if rule.latest_s < 0.0:
        return *moments_s, None, None, binds, *monitor
    return *moments_s, earliest_s, rule.latest_s, binds, *monitor


def _by_charge(charge: Tilted, hover_A: float, way: Sequence[Stage], least_As: float) -> Rule:
    """The rule that keeps the charge at the landing."""
    g_As = least_As - sum(stage.current_A * stage.duration_s for stage in way)
    spare_As = float(charge.total_As) - g_As
    spent_s = spare_As / hover_A if hover_A != 0.0 else math.inf
    earliest_s, latest_s = 0.0, spent_s if hover_A > 0.0 else math.inf
    if spare_As < 0.0:
        earliest_s, latest_s = (spent_s, math.inf) if hover_A < 0.0 else (math.inf, -math.inf)
    return Rule(earliest_s, latest_s, 1.0, 1.0, g_As)


def _at_an_end(battery: Battery, charge: Tilted, hover_A: float, way: Sequence[Stage]) -> Rule:
    """The rule that keeps y1 ≥ 0 at the end of some stages.

    After a hover of t, y1 there is α + βt + γ·exp(−k't), which turns once at most.
    """
    share, rate_per_s = float(battery.available_fraction), float(battery.rate_per_s)
    e = math.exp(-rate_per_s * sum(stage.duration_s for stage in way))
    gained_As = float(tilted_after(battery, Tilted(0.0, 0.0), *way).wells(battery).available_As)
    total_As, tilt_As = map(float, charge)
    drawn_A = (1.0 - share) * hover_A  # From the tilt

    def spare_As(hover_s: float) -> float:
        left, integral_s = levelling(battery, hover_s)
        tilted_As = tilt_As * float(left) - drawn_A * float(integral_s)
        return share * (total_As - hover_A * hover_s) + gained_As + e * tilted_As

    moments_s, falls_A = [0.0], e * (rate_per_s * tilt_As + drawn_A)
    if falls_A and 0.0 < (left := -share * hover_A / falls_A) < 1.0:
        moments_s.append(-math.log(left) / rate_per_s)
    far_s = LEVEL / rate_per_s  # When wells are level, or when charge decides
    if hover_A:
        most_As = share * total_As + gained_As + math.copysign(e * abs(tilt_As), hover_A)
        far_s = 2.0 * max(most_As / (share * hover_A), 0.0) + 1.0
    moments_s.append(max(far_s, moments_s[-1]))
    stretch_s = _first_stretch(spare_As, moments_s)
    return Rule(*stretch_s, share * (1.0 - e) + e, share * (1.0 - e), -gained_As)


def _first_stretch(
    spare_As: Callable[[float], float], moments_s: Sequence[float]
) -> tuple[float, float]:
    """From when, and until when first, a number is not below 0, which turns at some moments only.

    After the last one its sign stays.
    """
    earliest_s = 0.0 if spare_As(0.0) >= 0.0 else math.inf
    for begin_s, end_s in pairwise(moments_s):
        holds = spare_As(end_s) >= 0.0
        if holds and earliest_s == math.inf:
            earliest_s = _last_that_holds(spare_As, end_s, begin_s)
        elif earliest_s < math.inf and not holds:
            return earliest_s, _last_that_holds(spare_As, begin_s, end_s)
    return earliest_s, math.inf if earliest_s < math.inf else -math.inf


def _last_that_holds(spare_As: Callable[[float], float], from_s: float, to_s: float) -> float:
    """Return the last moment on the way to another one at which a number is not below 0."""
    towards = math.copysign(1.0, to_s - from_s)
    found = largest(
        lambda passed_s: spare_As(from_s + towards * passed_s) >= 0.0, abs(to_s - from_s)
    )
    return from_s + towards * (found[0] if found else 0.0)


def _show(times: Results) -> Iterator[str]:
    facts = times.facts
    yield f"When to leave the hover point: {printable(times.mission.name)}"
    wells = f"y1 = {facts['available_As']:.1f} A s, y2 = {facts['bound_As']:.1f} A s"
    drawn = f"draws {facts['hover_current_A']:.4g} A from the battery"
    drawn += f"; the laser gives {facts['received_current_A']:.4g} A"
    yield f"On arrival  {wells}"
    yield f"Hovering    {drawn}"
    yield from calm_line(facts)
    yield ""
    ranked = sorted(
        times.rows[1:], key=lambda row: math.inf if row["latest_s"] is None else -row["latest_s"]
    )
    table = [["place", "flight [s]", "by well [s]", "by charge [s]", "a", "b", "g [A s]"]]
    rows = [times.rows[0], *ranked]
    for row in rows[:SHOWN]:
        moments = (fixed(row[name], 3, otherwise="too late") for name in ("dry_s", "soc_s"))
        rule = (fixed(row[n], digits, otherwise="-") for n, digits in MONITOR)
        table.append([printable(row["place"]), f"{row['flight_s']:.2f}", *moments, *rule])
    yield from tabulated(table)
    if (more := len(rows) - SHOWN) > 0:
        yield f"and {more} more that leave less time"
    yield ""
    yield "Leave at the latest when the smaller of both times has passed after arrival."
    yield "A monitor on board that knows the wells leaves as soon as a·y1 + b·y2 < g."
    for row in rows[:SHOWN]:
        if row["earliest_s"]:
            early = f"not before {row['earliest_s']:.3f} s: the available well would run dry"
            yield f"{printable(row['place'])}: {early} on the way; no monitor says that"


def _draw(times: Results) -> Pictures:
    """Draw the margin of the rule at the landing over the moment of leaving, for two places."""
    from optuav.plots import Line, Mark, curves

    facts, rows = times.facts, {row["place"]: row for row in times.rows}
    latest_s = facts["latest_s"]
    if latest_s is None or not math.isfinite(latest_s):
        return
    passed_s = np.linspace(0.0, 1.05 * latest_s, POINTS)
    begin, hover = Wells(facts["available_As"], facts["bound_As"]), facts["hover_current_A"]
    wells = step(times.mission.pool, begin, Stage(-hover, passed_s))
    lines, marks = list[Line](), list[Mark]()
    for place in dict.fromkeys((times.rows[0]["place"], facts["place"])):
        row = rows[place]
        if row["a"] is None:
            continue
        left_As = row["a"] * wells.available_As + row["b"] * wells.bound_As - row["g_As"]
        words = f"{printable(place)}, {row['binds']}: {fixed(row['latest_s'], 1)} s"
        lines.append(Line(words, passed_s.tolist(), np.asarray(left_As).tolist()))
        marks += [Mark(row["latest_s"], "")] if row["latest_s"] is not None else []
    title = f"When to leave the hover point: {printable(times.mission.name)}"
    x_label, y_label = "hover before leaving [s]", "left at the landing above the limit [A s]"
    yield "return.png", curves(lines, title=title, x_label=x_label, y_label=y_label, marks=marks)

"""When to leave the hover point, and the rule that a monitor carries on board."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from optuav.errors import NoPlanError, printable, refuse
from optuav.mission import Mission, load
from optuav.network import vehicle
from optuav.network.legs import Legs
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, step, tilted_after
from optuav.plan.summary import tabulated
from optuav.service.checks import flyable_network, schedule_faults
from optuav.studies.results import Pictures, Results, ResultsWithFacts, fixed

UNITS = {
    **{"place": "", "flight_s": "s", "dry_s": "s", "soc_s": "s", "latest_s": "s", "binds": ""},
    **{"a": "-", "b": "-", "g_As": "A s"},
}
SHOWN = 10  # Places that are printed
POINTS = 100  # Moments of a picture
MOST = 1e-9  # Share of the capacity by which rounding may empty a well


class Rule(NamedTuple):
    """Leave as soon as a·y1 + b·y2 < g, and the last moment at which that does not hold."""

    latest_s: float  # After now [s]; inf if it never ends, −inf if it is too late
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
    (15)-(16)); the last zero of that is bracketed.

    Parameters
    ----------
    mission
        A mission, or its name or path; its packs are pooled.

    Returns
    -------
    ResultsWithFacts
        One row per place that can be reached: ``flight_s``; ``dry_s`` and ``soc_s``, the last
        moments by the available well and by the charge, and ``latest_s``, the smaller [s] (None
        if it is too late at once, inf if hovering draws nothing); ``binds``, the limit behind it;
        and the monitor ``a``, ``b`` [-], ``g_As`` [A s]: leave as soon as a·y1 + b·y2 < g. Facts:
        ``latest_s`` and ``place`` of the place that leaves most time, ``available_As`` and
        ``bound_As`` on arrival [A s], and ``hover_current_A`` [A] beyond ``received_current_A``,
        which the laser gives; remove ``laser`` where nothing charges the hover.

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
    network, battery = flyable_network(loaded), vehicle.pool(loaded)
    arriving, landing = _ways(network.legs)
    charge = _arrived(loaded, network.legs.stages_of(arriving))
    received_A = float(network.places.charge_current_A[HOVER])
    hover_A = float(vehicle.hover_load(loaded).current_A) - received_A
    least_As = loaded.limits.min_soc * float(battery.capacity_As)
    rows = list[dict[str, Any]]()
    for leg in landing:
        way = network.legs.stages_of(leg)
        by_charge = _by_charge(charge, hover_A, way, least_As)
        rule = _earlier(_by_well(battery, charge, hover_A, way), by_charge)
        place, flight_s = network.legs.end[leg], float(network.legs.duration_s[leg])
        row = network.places.names[place], flight_s, *rule
        rows.append(dict(zip(UNITS, row, strict=True)))
    best = max(rows, key=lambda row: -1.0 if row["latest_s"] is None else row["latest_s"])
    available_As, bound_As = map(float, charge.wells(battery))
    facts = {
        **{"latest_s": best["latest_s"], "place": best["place"], "available_As": available_As},
        **{"bound_As": bound_As, "hover_current_A": hover_A, "received_current_A": received_A},
    }
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
    battery, charge = vehicle.pool(mission), vehicle.start(mission)
    for stage in way:
        charge = tilted_after(battery, charge, stage)
        if float(charge.wells(battery).available_As) < -MOST * float(battery.capacity_As):
            raise NoPlanError(
                "the available well runs dry before the drone reaches the hover point"
            )
    return charge


def _earlier(by_well: Rule, by_charge: Rule) -> tuple[object, ...]:
    """Return both moments and the earlier, which limit binds, and its monitor; see `UNITS`."""
    dry_s, soc_s = by_well.latest_s, by_charge.latest_s
    rule, binds = by_charge, "charge"
    if dry_s < soc_s or dry_s == -math.inf:
        rule, binds = by_well, "available well"
    moments_s = (None if at_s < 0.0 else at_s for at_s in (dry_s, soc_s, rule.latest_s))
    return *moments_s, binds, *rule[1:]


def _by_charge(charge: Tilted, hover_A: float, way: Sequence[Stage], least_As: float) -> Rule:
    """The rule that keeps the charge at the landing."""
    g_As = least_As - sum(stage.current_A * stage.duration_s for stage in way)
    spare_As = float(charge.total_As) - g_As
    lasts_s = spare_As / hover_A if hover_A > 0.0 else math.inf
    return Rule(lasts_s if spare_As >= 0.0 else -math.inf, 1.0, 1.0, g_As)


def _by_well(battery: Battery, charge: Tilted, hover_A: float, way: Sequence[Stage]) -> Rule:
    """The rule that keeps y1 ≥ 0 while hovering and at the end of every stage of the way."""
    ends = range(len(way) + 1)
    rules = [_at_an_end(battery, charge, hover_A, way[:count]) for count in ends]
    first = min(rules, key=lambda rule: rule.latest_s)
    hover = Stage(-hover_A, first.latest_s if math.isfinite(first.latest_s) else 0.0)
    wells = tilted_after(battery, charge, hover).wells(battery)
    in_time = min(rule.spare_As(wells) for rule in rules) >= -MOST * battery.capacity_As
    return first if in_time else first._replace(latest_s=-math.inf)


def _at_an_end(battery: Battery, charge: Tilted, hover_A: float, way: Sequence[Stage]) -> Rule:
    """The rule that keeps y1 ≥ 0 at the end of some stages, and when hovering breaks it for good.

    After a hover of t, y1 there is α + βt + γ·exp(−k't), which may rise at first and then falls.
    """
    from scipy.optimize import brentq

    share, rate_per_s = float(battery.available_fraction), float(battery.rate_per_s)
    e = math.exp(-rate_per_s * sum(stage.duration_s for stage in way))
    gained_As = float(tilted_after(battery, Tilted(0.0, 0.0), *way).wells(battery).available_As)
    rule = Rule(-math.inf, share * (1.0 - e) + e, share * (1.0 - e), -gained_As)

    def spare_As(hover_s: float) -> float:
        hovered = tilted_after(battery, charge, Stage(-hover_A, hover_s))
        return rule.spare_As(hovered.wells(battery))

    total_As, tilt_As = map(float, charge)
    if hover_A <= 0.0:
        return rule._replace(latest_s=math.inf if spare_As(0.0) >= 0.0 else -math.inf)
    rises_A = -e * (rate_per_s * tilt_As + (1.0 - share) * hover_A)
    peak_s = math.log(max(rises_A / (share * hover_A), 1.0)) / rate_per_s
    if spare_As(peak_s) < 0.0:
        return rule
    most_s = (share * total_As + gained_As + e * max(tilt_As, 0.0)) / (share * hover_A)
    if spare_As(most_s) >= 0.0:  # By rounding, where the wells level out at once
        return rule._replace(latest_s=most_s)
    return rule._replace(latest_s=float(brentq(spare_As, peak_s, most_s)))


def _show(times: Results) -> Iterator[str]:
    facts = times.facts
    yield f"When to leave the hover point: {printable(times.mission.name)}"
    wells = f"y1 = {facts['available_As']:.1f} A s, y2 = {facts['bound_As']:.1f} A s"
    drawn = f"draws {facts['hover_current_A']:.4g} A from the battery"
    drawn += f"; the laser gives {facts['received_current_A']:.4g} A"
    yield f"On arrival  {wells}"
    yield f"Hovering    {drawn}\n"
    ranked = sorted(
        times.rows[1:], key=lambda row: math.inf if row["latest_s"] is None else -row["latest_s"]
    )
    table = [["place", "flight [s]", "by well [s]", "by charge [s]", "a", "b", "g [A s]"]]
    rows = [times.rows[0], *ranked]
    for row in rows[:SHOWN]:
        moments = (fixed(row[name], 3, otherwise="too late") for name in ("dry_s", "soc_s"))
        rule = f"{row['a']:.6f}", f"{row['b']:.6f}", f"{row['g_As']:.2f}"
        table.append([printable(row["place"]), f"{row['flight_s']:.2f}", *moments, *rule])
    yield from tabulated(table)
    if (more := len(rows) - SHOWN) > 0:
        yield f"and {more} more that leave less time"
    yield ""
    yield "Leave at the latest when the smaller of both times has passed after arrival."
    yield "A monitor on board that knows the wells leaves as soon as a·y1 + b·y2 < g."


def _draw(times: Results) -> Pictures:
    """Draw the margin of the rule at the landing over the moment of leaving, for two places."""
    from optuav.plots import Line, Mark, curves

    facts, rows = times.facts, {row["place"]: row for row in times.rows}
    latest_s = facts["latest_s"]
    if latest_s is None or not math.isfinite(latest_s):
        return
    passed_s = np.linspace(0.0, 1.05 * latest_s, POINTS)
    begin, hover = Wells(facts["available_As"], facts["bound_As"]), facts["hover_current_A"]
    wells = step(vehicle.pool(times.mission), begin, Stage(-hover, passed_s))
    lines, marks = list[Line](), list[Mark]()
    for place in dict.fromkeys((times.rows[0]["place"], facts["place"])):
        row = rows[place]
        left_As = row["a"] * wells.available_As + row["b"] * wells.bound_As - row["g_As"]
        words = f"{printable(place)}, {row['binds']}: {fixed(row['latest_s'], 1)} s"
        lines.append(Line(words, passed_s.tolist(), np.asarray(left_As).tolist()))
        marks += [Mark(row["latest_s"], "")] if row["latest_s"] is not None else []
    title = f"When to leave the hover point: {printable(times.mission.name)}"
    x_label, y_label = "hover before leaving [s]", "left at the landing above the limit [A s]"
    yield "return.png", curves(lines, title=title, x_label=x_label, y_label=y_label, marks=marks)

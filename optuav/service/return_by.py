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
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, levelling, tilted_after
from optuav.plan.summary import tabulated
from optuav.service.checks import flyable_network, schedule_faults
from optuav.studies.results import Pictures, Results, ResultsWithFacts, fixed

UNITS = {
    **{"place": "", "flight_s": "s", "dry_s": "s", "soc_s": "s", "latest_s": "s", "binds": ""},
    **{"a": "-", "b": "-", "g_As": "A s"},
}
SHOWN = 10  # Places that are printed
POINTS = 100  # Moments of a picture
SMALL = 1e-6  # Share of the tilt that levels out in a hover, below which a root is approached
NEWTON_STEPS = 3  # From an error of SMALL, each step squares it
MOST = 1e-9  # Share of the capacity by which rounding may empty a well


class Rule(NamedTuple):
    """Leave as soon as a·y1 + b·y2 < g, and the last moment at which that does not hold."""

    latest_s: float | None  # After now [s]; inf if it never ends, None if it is too late
    a: float
    b: float
    g_As: float


def return_by(mission: Mission | str | Path) -> ResultsWithFacts:
    """Find the last moment to leave the hover point, for the destination and every building.

    A place is in time while the available well stays above 0 on the whole way to it and
    ``limits.min_soc`` of the charge is left at the landing; the deadline plays no part. Moments
    count from the arrival at the hover point, with the charge that ``start`` and the leg from the
    origin leave. To ask again on the way, state ``start`` and ``route.origin_m`` there.

    The well at the end of a stage of the leg is α + βt + γ·exp(−k't) after a hover of t ([1]_ eqs
    (15)-(16)), so that its last zero is t = −α/β + W(−(k'γ/β)·exp(k'α/β))/k'.

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
        by_well = _by_well(battery, charge, hover_A, way)
        by_charge = _by_charge(charge, hover_A, way, least_As)
        place, flight_s = network.legs.end[leg], float(network.legs.duration_s[leg])
        row = network.places.names[place], flight_s, *_earlier(by_well, by_charge)
        rows.append(dict(zip(UNITS, row, strict=True)))
    best = max(rows, key=lambda row: -1.0 if row["latest_s"] is None else row["latest_s"])
    available_As, bound_As = map(float, charge.wells(battery))
    facts = {
        **{name: best[name] for name in ("latest_s", "place")},
        **{"available_As": available_As, "bound_As": bound_As, "hover_current_A": hover_A},
        "received_current_A": received_A,
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
    dry_s, soc_s = moments_s = by_well.latest_s, by_charge.latest_s
    dry_first = dry_s is None or (soc_s is not None and dry_s < soc_s)
    rule = by_well if dry_first else by_charge
    binds = "available well" if rule is by_well else "charge"
    return *moments_s, None if None in moments_s else rule.latest_s, binds, *rule[1:]


def _by_charge(charge: Tilted, hover_A: float, way: Sequence[Stage], least_As: float) -> Rule:
    """The rule that keeps the charge at the landing."""
    g_As = least_As - sum(stage.current_A * stage.duration_s for stage in way)
    spare_As = float(charge.total_As) - g_As
    if spare_As < 0.0:
        return Rule(None, 1.0, 1.0, g_As)
    return Rule(spare_As / hover_A if hover_A > 0.0 else math.inf, 1.0, 1.0, g_As)


def _by_well(battery: Battery, charge: Tilted, hover_A: float, way: Sequence[Stage]) -> Rule:
    """The rule that keeps y1 ≥ 0 while hovering and at the end of every stage of the way."""
    share, rate_per_s = float(battery.available_fraction), float(battery.rate_per_s)
    total_As, tilt_As = map(float, charge)
    passed_s, response, rules, latest = 0.0, Tilted(0.0, 0.0), list[Rule](), list[float | None]()
    for stage in (Stage(0.0, 0.0), *way):
        response = tilted_after(battery, response, stage)
        passed_s += stage.duration_s
        e = math.exp(-rate_per_s * passed_s)
        gained_As, tilted_As = map(float, response)
        a, b = share * (1.0 - e) + e, share * (1.0 - e)
        rules.append(Rule(None, a, b, -share * gained_As - tilted_As))
        fixed_As = share * (total_As + gained_As) + tilted_As
        latest.append(_last_zero(battery, fixed_As, e, tilt_As, hover_A))
    if None in latest:
        return rules[latest.index(None)]
    times_s = [moment_s for moment_s in latest if moment_s is not None]
    first = int(np.argmin(times_s))
    hover = Stage(-hover_A, times_s[first]) if math.isfinite(times_s[first]) else Stage(0.0, 0.0)
    left = tilted_after(battery, charge, hover).wells(battery)
    spare_As = [r.a * float(left.available_As) + r.b * float(left.bound_As) - r.g_As for r in rules]
    in_time = min(spare_As) >= -MOST * float(battery.capacity_As)
    return rules[first]._replace(latest_s=times_s[first] if in_time else None)


def _last_zero(
    battery: Battery, fixed_As: float, e: float, tilt_As: float, hover_A: float
) -> float | None:
    """Last moment t ≥ 0 at which α + βt + γ·exp(−k't) ≥ 0 [s]; None where there is none."""
    from scipy.special import lambertw, wrightomega

    share, rate_per_s = float(battery.available_fraction), float(battery.rate_per_s)
    if hover_A <= 0.0:
        return math.inf if fixed_As + e * tilt_As >= 0.0 else None
    latest_s = (fixed_As + e * tilt_As) / (hover_A * (share + e * (1.0 - share)))
    if rate_per_s * latest_s < SMALL:  # α and γ would cancel
        for _ in range(NEWTON_STEPS):
            remaining, integral_s = levelling(battery, latest_s)
            drained_As = (1.0 - share) * hover_A
            left_As = fixed_As - share * hover_A * latest_s
            left_As += e * (tilt_As * remaining - drained_As * integral_s)
            slope_A = share * hover_A + e * remaining * (rate_per_s * tilt_As + drained_As)
            latest_s += left_As / slope_A
        return float(latest_s) if latest_s >= 0.0 else None
    settled_As = (1.0 - share) * hover_A / rate_per_s
    α, β, γ = fixed_As - e * settled_As, -share * hover_A, e * (tilt_As + settled_As)
    exponent = rate_per_s * α / β  # In logarithms, as its exponential may overflow
    if γ == 0.0:
        root = 0.0
    elif γ > 0.0:
        root = float(wrightomega(math.log(-rate_per_s * γ / β) + exponent))
    else:
        exponent += math.log(rate_per_s * γ / β)
        if exponent > -1.0:
            return None
        root = float(lambertw(-math.exp(exponent)).real)
    latest_s = -α / β + root / rate_per_s
    return latest_s if latest_s >= 0.0 else None


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
    from optuav.plots import Line, curves

    facts, rows = times.facts, {row["place"]: row for row in times.rows}
    latest_s = facts["latest_s"]
    if latest_s is None or not math.isfinite(latest_s):
        return
    battery, passed_s = vehicle.pool(times.mission), np.linspace(0.0, 1.05 * latest_s, POINTS)
    charge = Tilted.of(battery, Wells(facts["available_As"], facts["bound_As"]))
    hover = Stage(-facts["hover_current_A"], passed_s)
    available_As, bound_As = tilted_after(battery, charge, hover).wells(battery)
    lines = list[Line]()
    for place in dict.fromkeys((times.rows[0]["place"], facts["place"])):
        row = rows[place]
        left_As = row["a"] * available_As + row["b"] * bound_As - row["g_As"]
        words = f"{printable(place)}, {row['binds']}"
        lines.append(Line(words, passed_s.tolist(), np.asarray(left_As).tolist()))
    yield (
        "return.png",
        curves(
            lines,
            title=f"When to leave the hover point: {printable(times.mission.name)}",
            x_label="hover before leaving [s]",
            y_label="left at the landing above the limit [A s]",
        ),
    )

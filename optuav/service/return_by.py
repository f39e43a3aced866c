"""When to leave the hover point, and the rule that a monitor carries on board."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple, TypedDict

import numpy as np

from optuav.errors import NoPlanError, printable, refuse
from optuav.mission import Mission
from optuav.mission.load import load_one_device
from optuav.network import vehicle
from optuav.network.legs import Legs
from optuav.network.places import DESTINATION, FIRST_BUILDING, HOVER, ORIGIN
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, levelling, step, tilted_after
from optuav.physics.roots import bisect_largest
from optuav.presentation.blocks import Block, Facts, Heading, Note, Table
from optuav.presentation.numbers import amperes, fixed, seconds
from optuav.service.calm_air import calm_facts, in_calm_air, with_words
from optuav.service.flyable import flyable_network, schedule_faults
from optuav.studies.results import Pictures, Result

RETURN_TIME_UNITS = {
    **{"place": "", "flight_s": "s", "dry_s": "s", "soc_s": "s", "earliest_s": "s"},
    **{"latest_s": "s", "binds": "", "a": "-", "b": "-", "g_As": "A s"},
}
SHOWN = 10  # Places that are printed
POINTS = 100  # Moments of a picture
TOO_LATE = "too late to leave"
LEVEL = 700.0  # Time constants after which wells are level
ROUNDED_SHARE = 1e-9  # Share of the capacity by which rounding may empty a well


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


class ReturnTime(TypedDict):
    """A row of a return: when to leave for a place, and its monitor."""

    place: str
    flight_s: float
    dry_s: float | None
    soc_s: float | None
    earliest_s: float | None
    latest_s: float | None
    binds: str
    a: float | None
    b: float | None
    g_As: float | None


@dataclass(frozen=True, kw_only=True, repr=False)
class ReturnTimes(Result):
    """When to leave the hover point, one row per place that can be reached.

    Parameters
    ----------
    latest_s, place
        Last moment to leave for the place that leaves most time, None if it is too late [s].
    available_As, bound_As
        Wells on arrival at the hover point [A s].
    hover_current_A, received_current_A
        Drawn while hovering [A], beyond what the laser gives.
    calm_latest_s, in_calm_air
        If the hover depends on the wind, the last moment in calm air [s], None if it is too late
        there, and the same in words; else None.

    Examples
    --------
    >>> import optuav
    >>> times = optuav.return_by("paper")
    >>> f"{times.place}: {times.latest_s:.1f} s"
    'b9: 597.3 s'
    """

    kind = "optuav return"
    units = RETURN_TIME_UNITS
    rows: tuple[ReturnTime, ...]
    latest_s: float | None
    place: str
    available_As: float
    bound_As: float
    hover_current_A: float
    received_current_A: float
    calm_latest_s: float | None
    in_calm_air: str | None

    def blocks(self) -> Iterator[Block]:
        """Yield the wells on arrival, the moments by place, and the rule."""
        yield Heading(f"When to leave the hover point: {printable(self.mission.name)}")
        drawn = f"draws {amperes(self.hover_current_A)} from the battery"
        drawn += f"; the laser gives {amperes(self.received_current_A)}"
        wells = f"{fixed(self.available_As, 1)} A s in the available well (y1), "
        wells += f"{fixed(self.bound_As, 1)} A s in the bound one (y2)"
        facts = [("On arrival", wells), ("Hovering", drawn)]
        yield Facts([*facts, *calm_facts(self.in_calm_air)])
        first, *others = self.rows
        ranked = [first, *sorted(others, key=lambda row: -_leaves_s(row))]
        shown, more = ranked[:SHOWN], len(ranked) - SHOWN
        heads = ["place", "flight [s]", "by well [s]", "by charge [s]", "a", "b", "g [A s]"]
        below = [f"and {more} more with less time"] if more > 0 else []
        yield Table(heads, [*map(_cells, shown)], below=below)
        rule = [
            "Leave no later than the smaller of the two times after arrival.",
            "by well: the available well is empty on landing; by charge: the reserve is reached.",
            "A monitor on board that knows both wells, y1 and y2, leaves as soon as "
            "a·y1 + b·y2 < g.",
        ]
        for row in shown:
            if row["earliest_s"]:
                early = f"not before {seconds(row['earliest_s'])}: the available well would run dry"
                rule.append(f"{printable(row['place'])}: {early} on the way; no monitor says that")
        yield Note(rule)

    def pictures(self) -> Pictures:
        """Yield the margin of the rule at the landing over the moment of leaving, of two places."""
        from optuav.plots import Line, Mark, curves
        from optuav.plots.style import titled

        if self.latest_s is None or not math.isfinite(self.latest_s):
            return
        rows = {row["place"]: row for row in self.rows}
        passed_s = np.linspace(0.0, 1.05 * self.latest_s, POINTS)
        begin = Wells(self.available_As, self.bound_As)
        wells = step(self.mission.pool, begin, Stage(-self.hover_current_A, passed_s))
        lines, marks = list[Line](), list[Mark]()
        for place in dict.fromkeys((self.rows[0]["place"], self.place)):
            row = rows[place]
            if row["a"] is None or row["b"] is None or row["g_As"] is None:
                continue
            left_As = row["a"] * wells.available_As + row["b"] * wells.bound_As - row["g_As"]
            words = f"{printable(place)}, {row['binds']}: {fixed(row['latest_s'], 1)} s"
            lines.append(Line(words, passed_s.tolist(), np.asarray(left_As).tolist()))
            marks += [Mark(row["latest_s"], "")] if row["latest_s"] is not None else []
        ax = curves(
            lines,
            title=titled(self.mission.name, "charge left by the moment of leaving"),
            x_label="hover before leaving [s]",
            y_label="left at the landing above the limit [A s]",
            marks=marks,
        )
        yield "return.png", ax


def _leaves_s(row: ReturnTime) -> float:
    """The last moment [s], below all others where it is too late."""
    return -math.inf if row["latest_s"] is None else row["latest_s"]


def _cells(row: ReturnTime) -> list[str]:
    """A row as it is shown."""
    return [
        printable(row["place"]),
        fixed(row["flight_s"]),
        *(fixed(moment_s, otherwise="too late") for moment_s in (row["dry_s"], row["soc_s"])),
        *(fixed(weight, 6, otherwise="–") for weight in (row["a"], row["b"])),
        fixed(row["g_As"], otherwise="–"),
    ]


def return_by(mission: Mission | str | Path) -> ReturnTimes:
    """Find the last moment to leave the hover point, for the destination and every building.

    The drone leaves in time for a place if the available well stays above 0 on the whole flight and
    ``limits.min_soc`` of the charge is left at the landing; the deadline does not count. Moments
    count from the arrival at the hover point, with the charge that ``start`` and the leg from the
    origin leave. To ask again during the flight, set ``start`` and ``route.origin_m``.

    The well at the end of a stage of the leg is α + βt + γ·exp(−k't) after a hover of t ([1]_ eqs
    (15)-(16)). It turns once at most, and its zeros are bracketed. Wells at very different levels
    may have to level out first: the available well may run dry on the way if the drone leaves at
    once, but not if it leaves later.

    Parameters
    ----------
    mission
        A mission, or its name or path; its packs are pooled.

    Returns
    -------
    ReturnTimes
        One row per place that can be reached: ``flight_s``; ``dry_s`` and ``soc_s``, the last
        moments by the available well and by the charge, and ``latest_s``, the smaller [s] (None if
        it is too late at once, inf if hovering draws nothing); ``earliest_s``, the first moment, 0
        as a rule; ``binds``, the limit behind the last one; and the monitor ``a``, ``b`` [-],
        ``g_As`` [A s]: leave as soon as a·y1 + b·y2 < g. They are None where leaving at once would
        run dry. Of all: ``latest_s`` and ``place`` of the place that leaves most time,
        ``available_As`` and ``bound_As`` on arrival [A s], and ``hover_current_A`` [A] beyond
        ``received_current_A``, which the laser gives; remove ``laser`` where nothing charges the
        hover. If hovering depends on the wind, ``calm_latest_s`` and ``in_calm_air`` hold the same
        last moment in calm air, as a number and in words; otherwise they are None.

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
    loaded = load_one_device(mission, "the time to turn back")
    refuse(schedule_faults(loaded))
    network, battery = flyable_network(loaded), loaded.pool
    arriving, landing = _ways(network.legs)
    charge = _arrived(loaded, network.legs.stages_of(arriving))
    received_A = float(network.places.charge_current_A[HOVER])
    hover_A = float(vehicle.hover_load(loaded).current_A) - received_A
    least_As = loaded.limits.min_soc * float(battery.capacity_As)
    rows = list[ReturnTime]()
    for leg in landing:
        place, flight_s = network.legs.end[leg], float(network.legs.duration_s[leg])
        way, name = network.legs.stages_of(leg), network.places.names[place]
        rows.append(_time_for(name, flight_s, battery, charge, hover_A, way, least_As))
    best = max(rows, key=lambda row: -1.0 if row["latest_s"] is None else row["latest_s"])
    available_As, bound_As = map(float, charge.wells(battery))
    calm = in_calm_air(loaded, lambda mission: return_by(mission).latest_s or TOO_LATE)
    calm_latest_s, words = with_words(calm, lambda latest_s: f"{seconds(latest_s)} at most")
    return ReturnTimes(
        mission=loaded,
        rows=tuple(rows),
        latest_s=best["latest_s"],
        place=best["place"],
        available_As=available_As,
        bound_As=bound_As,
        hover_current_A=hover_A,
        received_current_A=received_A,
        calm_latest_s=calm_latest_s,
        in_calm_air=words,
    )


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
        if float(charge.wells(battery).available_As) < -ROUNDED_SHARE * float(battery.capacity_As):
            raise NoPlanError(
                "the available well runs dry before the drone reaches the hover point"
            )
    return charge


def _time_for(
    place: str,
    flight_s: float,
    battery: Battery,
    charge: Tilted,
    hover_A: float,
    way: Sequence[Stage],
    least_As: float,
) -> ReturnTime:
    """Return the moments by both limits and between both, which binds, and its monitor.

    The available well stays above 0 while hovering and at the end of every stage.
    """
    by_charge = _by_charge(charge, hover_A, way, least_As)
    by_well = [_at_an_end(battery, charge, hover_A, way[:count]) for count in range(len(way) + 1)]
    first = min(by_well, key=lambda rule: rule.latest_s)
    rules, soc_s = (*by_well, by_charge), by_charge.latest_s
    latest_s = min(first.latest_s, soc_s)
    earliest_s = max(rule.earliest_s for rule in rules)
    if math.isfinite(latest_s):  # Up to when all rules hold, or one holds but later
        wells = tilted_after(battery, charge, Stage(-hover_A, latest_s)).wells(battery)
        in_time = (
            min(rule.spare_As(wells) for rule in by_well) >= -ROUNDED_SHARE * battery.capacity_As
        )
        earliest_s = min(earliest_s, latest_s) if in_time else math.inf
    if earliest_s == math.inf and soc_s >= 0.0:
        first = first._replace(latest_s=-math.inf)
    binds, rule = "charge", by_charge
    if first.latest_s < soc_s or first.latest_s < 0.0:
        binds, rule = "available well", first
    dry_s, charge_s = (None if at_s < 0.0 else at_s for at_s in (first.latest_s, soc_s))
    leaves, has_monitor = rule.latest_s >= 0.0, earliest_s == 0.0
    return ReturnTime(
        place=place,
        flight_s=flight_s,
        dry_s=dry_s,
        soc_s=charge_s,
        earliest_s=earliest_s if leaves else None,
        latest_s=rule.latest_s if leaves else None,
        binds=binds,
        a=rule.a if has_monitor else None,
        b=rule.b if has_monitor else None,
        g_As=rule.g_As if has_monitor else None,
    )


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
    sign = math.copysign(1.0, to_s - from_s)
    largest = bisect_largest(
        lambda passed_s: spare_As(from_s + sign * passed_s) >= 0.0, abs(to_s - from_s)
    )
    return from_s + sign * (largest[0] if largest else 0.0)

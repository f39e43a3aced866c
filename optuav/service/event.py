"""Drones that cover some hours without a gap, all full at the start."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.arrays import Floats
from optuav.errors import MOST_SHOWN, Fault, NoPlanError, printable, refuse
from optuav.judge.fleets import FleetReplay, replay_fleet
from optuav.mission.messages import misfits, shown
from optuav.mission.schema import Number
from optuav.network.vehicle import pool
from optuav.physics.kibam import Stage
from optuav.plan import Plan
from optuav.plan.summary import tabulated
from optuav.service.fleet import repeated
from optuav.service.visit import Visit
from optuav.studies.results import Pictures, Results, ResultsWithFacts

if TYPE_CHECKING:
    from optuav.service.cycle import Coverage

HOURS = Number("h", gt=0.0, le=240.0)
MOST = 100
DRONES = Number("-", ge=1, le=MOST, whole=True)
UNITS = {"drone": "-", "start_s": "s", "hover_s": "s", "rest_s": "s"}
SHORTER = (1.0, 0.99, 0.97, 0.95, 0.9, 0.8, 0.7, 0.6)
"""Shares of the longest hover from full wells to which hovers are kept, until a replay holds."""
ROUNDING = 1e-6  # Share of the capacity
RUN = 0.75  # Share of all hovers that a run holds, beside the run of all
MORE = 2  # Hovers beyond the fewest that are tried, per drone


@dataclass(frozen=True)
class Event(ResultsWithFacts):
    """A roster of drones in ring order, one row per hover.

    Parameters
    ----------
    hours, drones, least_drones
        How long is covered [h], by how many drones, and the fewest by charge alone, in ring order.
    longest_hover_s
        Longest hover of the roster [s].
    """

    # Of every drone, or with exchanges of every hover
    plans: tuple[Plan, ...] = field(kw_only=True, repr=False)
    offsets_s: tuple[float, ...] = field(kw_only=True, repr=False)

    def replay(self) -> FleetReplay:
        """Simulate every drone by the judge alone."""
        return _replayed(self.plans, self.offsets_s, self.facts["hours"])


def event_of(coverage: Coverage, visit: Visit, hours: float, drones: int | None) -> Event:
    """The roster of the fewest drones, or of so many, see `Coverage.event`."""
    faults = [*misfits(("hours", hours, HOURS))]
    faults += misfits(*([] if drones is None else [("drones", drones, DRONES)]))
    if coverage.perspective != "available":
        faults.append(Fault("perspective", shown(coverage.perspective), "must be 'available' here"))
    refuse(faults)
    until_s, least = 3600.0 * hours, 1
    while _hovers(visit, least, until_s, visit.balanced_s) is None:
        least += 1
        if least > MOST:
            raise NoPlanError(f"not even {MOST} drones cover {hours:g} h by charge")
    if drones is not None and drones < least:
        words = f"{drones} drones do not cover {hours:g} h: by charge at least {least} are needed"
        raise NoPlanError(words)
    for count in range(least, MOST + 1) if drones is None else [drones]:
        for share in SHORTER:
            hovers_s = _hovers(visit, count, until_s, share * visit.most_s)
            if hovers_s is None:
                continue
            found = _event(coverage, visit, hours, count, least, hovers_s)
            lowest_As = min(phase.available_As[0] for plan in found.plans for phase in plan.phases)
            dry = lowest_As < -ROUNDING * float(visit.battery.capacity_As)
            if not dry and found.replay().flyable:
                return found
    words = (
        f"{count} drones cover {hours:g} h by charge, but no roster that was tried keeps the wells"
    )
    raise NoPlanError(words if drones is None else f"{words}: allow one more")


def _hovers(visit: Visit, drones: int, until_s: float, longest_s: float) -> Floats | None:
    """Hovers in ring order that cover a time by charge alone [s]; None where none do.

    Of these, those whose lowest landing keeps most charge, by a linear programme. Rosters with more
    than two hovers per drone beyond the fewest possible are not looked for: each costs two legs.
    """
    fewest = math.ceil(until_s / longest_s - 1e-9)
    scarce, small = visit, ROUNDING * float(visit.battery.capacity_As)
    if visit.swap_s is not None:  # Time on the ground is then scarce and not charge: 1 A s for 1 s
        away = (Stage(0.0, visit.flight_s + visit.swap_s),)
        whole_As = float(visit.battery.capacity_As)
        scarce = replace(visit, out=away, back=(), hover_A=0.0, rest_A=1.0, least_As=whole_As)
    for count in range(fewest, fewest + MORE * drones + 1):
        runs = (count, math.ceil(RUN * count))
        # Most programmes without an answer are told by sums of their rows, which take no time.
        if max(_overdrawn_As(scarce, drones, until_s, longest_s, count, w) for w in runs) > small:
            continue
        found = _programme(visit, drones, until_s, longest_s, count)
        if found is not None:
            return found
        if drones == 1:
            break
    return None


def _overdrawn_As(
    visit: Visit, drones: int, until_s: float, longest_s: float, count: int, width: int
) -> float:
    """Charge that drones lack in all runs of `width` hovers in a row, at least [A s]: rows, summed.

    In a run, every drone has at most full wells at first, and rests while others hover, but for the
    legs; the run begins and ends anywhere. Hovers are long where that costs least, and else 0.
    """
    number, runs = np.arange(count), count - width + 1
    holding = np.minimum(number, runs - 1) - np.maximum(number - width + 1, 0) + 1
    again, turns = number[: max(count - drones, 0)], max(width - drones, 0)
    resting = np.minimum(again, runs - 1) - np.maximum(again + drones - width + 1, 0) + 1
    before = np.concatenate([[0], np.cumsum(np.maximum(resting, 0))])
    others = before[np.minimum(number, len(again))]
    others -= before[np.clip(number - drones + 1, 0, len(again))]
    drawn_A = np.sort(visit.hover_A * holding - visit.rest_A * others)
    lengths_s = np.clip(until_s - longest_s * number, 0.0, longest_s)
    flights_As = width * visit.flight_As + turns * visit.rest_A * visit.flight_s
    spare_As = min(drones, width) * visit.spare_As
    return float(drawn_A @ lengths_s) + runs * (flights_As - spare_As)


def _programme(
    visit: Visit, drones: int, until_s: float, longest_s: float, count: int
) -> Floats | None:
    """The hovers for a number of them: unknowns are hovers, charges at departure, and a margin."""
    from scipy import sparse
    from scipy.optimize import linprog

    if drones == 1 and count > 1:
        return None
    size_As, each = float(visit.battery.capacity_As), sparse.eye(count)
    blocks: list[list[Any]] = [[visit.hover_A * each, -each, np.ones((count, 1))]]
    limits = [np.full(count, -visit.flight_As - visit.least_As)]
    if (again := count - drones) > 0:
        before, after = sparse.eye(again, count), sparse.eye(again, count, k=drones)
        offsets = range(1, drones)  # Of the others' hovers while a drone is away
        between = sparse.diags([1.0] * len(offsets), offsets, shape=(again, count))
        blocks.append([-between, None, None])
        limits.append(np.full(again, -visit.flight_s - (visit.swap_s or 0.0)))
        if visit.swap_s is None:  # Else every pack is full
            charge = visit.hover_A * before - visit.rest_A * between
            blocks.append([charge, after - before, None])
            limits.append(np.full(again, -visit.flight_As - visit.rest_A * visit.flight_s))
    every = np.repeat([[1.0, 0.0]], [count, count + 1], axis=1)
    bounds = [(0.0, longest_s)] * count + [(0.0, size_As)] * (count + 1)
    objective = np.append(np.zeros(2 * count), -1.0)
    rows: Any = sparse.bmat(blocks, format="csc")
    found = linprog(
        objective, rows, np.concatenate(limits), every, [until_s], bounds, method="highs"
    )
    return None if found.x is None else np.asarray(found.x)[:count]


def _event(
    coverage: Coverage, visit: Visit, hours: float, drones: int, least: int, hovers_s: Floats
) -> Event:
    """The roster with some hovers in ring order."""
    starts_s = np.concatenate([[0.0], np.cumsum(hovers_s)[:-1]])
    drones = min(drones, len(hovers_s))
    rests_s = np.zeros(len(hovers_s))
    away_s = starts_s[drones:] - (starts_s + hovers_s)[:-drones]
    rests_s[:-drones] = away_s - visit.flight_s
    stays_s = [*zip(hovers_s.tolist(), rests_s.tolist(), strict=True)]
    # With exchanges every hover is a course of its own, from full wells.
    courses = len(stays_s) if visit.swap_s is not None else drones
    plans = [repeated(coverage.plan, stays_s[number::courses]) for number in range(courses)]
    rows = tuple(
        dict(zip(UNITS, (number % drones + 1, *figures), strict=True))
        for number, figures in enumerate(
            zip(starts_s.tolist(), hovers_s.tolist(), rests_s.tolist(), strict=True)
        )
    )
    facts: dict[str, Any] = {
        **{"hours": hours, "drones": drones, "least_drones": least},
        **{"longest_hover_s": float(hovers_s.max()), "building": coverage.building},
    }
    return Event(
        *("optuav event", coverage.mission, facts, UNITS, rows, _show, _draw),
        plans=tuple(plans),
        offsets_s=tuple(starts_s[:courses].tolist()),
    )


def _replayed(plans: Sequence[Plan], offsets_s: Sequence[float], hours: float) -> FleetReplay:
    """The judge's simulation of a roster; every drone has a place of its own."""
    out_s = plans[0].phases[0].duration_s
    return replay_fleet(
        plans,
        offsets_s,
        wanted=1,
        allowed_gap_s=1e-6,
        until_s=out_s + 3600.0 * hours,
        places=len(plans),
        place_s=0.0,
    )


def _show(event: Results) -> Iterator[str]:
    facts = event.facts
    yield f"{facts['hours']:g} h without a gap: {printable(event.mission.name)}"
    yield f"Drones      {facts['drones']}; by charge alone at least {facts['least_drones']}"
    yield f"Hovers      {len(event.rows)}, up to {facts['longest_hover_s']:.2f} s\n"
    lines = [
        [str(row["drone"]), *(f"{row[name]:.2f}" for name in [*UNITS][1:])] for row in event.rows
    ]
    yield from tabulated([["drone", "from [s]", "hover [s]", "rest [s]"], *lines[:MOST_SHOWN]])
    if len(lines) > MOST_SHOWN:
        yield f"and {len(lines) - MOST_SHOWN} more"


def _draw(event: Results) -> Pictures:
    """Available wells of all drones over the event."""
    from optuav.plots import Line, curves

    assert isinstance(event, Event)
    full_As, drones = float(pool(event.mission).full.available_As), event.facts["drones"]
    courses, lines = [*zip(event.replay().courses, event.offsets_s, strict=True)], list[Line]()
    for drone in range(drones):
        hours, level = list[float](), list[float]()
        for course, offset_s in courses[drone::drones]:
            hours += ((course.trace.time_s + offset_s) / 3600.0).tolist()
            level += (100.0 * course.trace.available_As[:, 0] / full_As).tolist()
        lines.append(Line(f"drone {drone + 1}", hours, level))
    yield (
        "event.png",
        curves(
            lines,
            title=f"{event.facts['hours']:g} h without a gap: {printable(event.mission.name)}",
            x_label="time $t$ [h]",
            y_label="available well [%]",
            y_from_zero=True,
        ),
    )

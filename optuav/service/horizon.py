"""One drone for a working day: as much hover as greedy visits give, with an upper bound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypedDict

import numpy as np

from optuav.errors import Fault, InputError, NoPlanError, printable, refuse
from optuav.fields import Range
from optuav.judge import Itinerary, Stop, replay
from optuav.mission.messages import misfits, shown
from optuav.network.network import build_network
from optuav.network.one_stop import all_legs
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.presentation.blocks import Block, Facts, Heading, Table
from optuav.presentation.numbers import figure, fixed, percent, seconds
from optuav.search.greedy import greedy, hover_bound_s
from optuav.search.terrain import Terrain
from optuav.service.calm_air import calm_facts
from optuav.service.endless import EndlessCycle, need_laser
from optuav.service.wells_over_time import draw_wells
from optuav.solving.several_stops import terrain
from optuav.studies.results import Pictures, Result

HOURS = Range("h", gt=0.0, le=2000.0)
HORIZON_STOP_UNITS = {"place": "", "kind": "", "duration_s": "s"}


class HorizonStop(TypedDict):
    """A row of a day: a stop at a place."""

    place: str
    kind: Literal["hover", "rest"]
    duration_s: float


@dataclass(frozen=True, kw_only=True, repr=False)
class Horizon(Result):
    """One drone's hovers and rests over some hours, one row per stop.

    Parameters
    ----------
    hours, building
        Length of the day [h], and where the drone rests.
    hover_s, bound_s
        Hover time in all, and one that no visits to this building exceed [s].
    share
        Share of the day in which the drone hovers [-].
    calm_hover_s, in_calm_air
        If the hover depends on the wind, the hover time in calm air [s], None without a day there,
        and the same in words; else None.

    Examples
    --------
    >>> import optuav
    >>> day = optuav.coverage("paper").horizon(2)
    >>> f"{day.hover_s:.1f} s of hover at {day.building} in {len(day.rows)} stops"
    '1188.0 s of hover at b9 in 3 stops'
    """

    kind = "optuav horizon"
    units = HORIZON_STOP_UNITS
    rows: tuple[HorizonStop, ...]
    hours: float
    building: str
    hover_s: float
    bound_s: float
    share: float
    calm_hover_s: float | None = None
    in_calm_air: str | None = None
    itinerary: Itinerary = field(repr=False)  # What `optuav.audit` takes

    def blocks(self) -> Iterator[Block]:
        """Yield the hover in all, and the stops."""
        yield Heading(f"One drone for {figure(self.hours)} h: {printable(self.mission.name)}")
        share = f"{percent(self.share)} of the time"
        hover = f"{seconds(self.hover_s)} of at most {seconds(self.bound_s)}, {share}"
        yield Facts([("Hover", hover), *calm_facts(self.in_calm_air)])
        rows = [[row["place"], row["kind"], fixed(row["duration_s"])] for row in self.rows]
        yield Table(["place", "stop", "for [s]"], rows, words=2)

    def pictures(self) -> Pictures:
        """Yield both wells over the day."""
        title = f"one drone for {figure(self.hours)} h"
        yield "horizon.png", draw_wells(self, title, [(replay(self.itinerary), 0.0)])


def horizon_of(cycle: EndlessCycle, hours: float) -> Horizon:
    """The day of greedy visits on the building of a cycle."""
    refuse(misfits(("hours", hours, HOURS)))
    building = need_laser(cycle).building
    if cycle.perspective != "available":
        words = "must be 'available' here: a day is planned through the wells"
        raise InputError([Fault("perspective", shown(cycle.perspective), words)])
    mission = cycle.mission.replace({"limits.deadline_s": 3600.0 * hours, "start": None})
    network = build_network(mission)
    network = replace(network, legs=all_legs(network))
    number = FIRST_BUILDING + mission.buildings.names.index(building)
    day = _only(terrain(network), np.array([*range(FIRST_BUILDING), number]))
    visit_s = max(cycle.flight_s, 1.0)  # Also where both legs have no length
    most = 1 + int(3600.0 * hours / visit_s)
    plan = greedy(replace(day, least_on_landing_As=day.least_charge_As), most, most + 1)
    if plan is None:
        words = (
            f"{figure(hours)} h leave no time to hover and land with limits.min_soc of the charge"
        )
        raise NoPlanError(words)
    stops = zip(plan.places[1:-1].tolist(), plan.stays_s.tolist(), strict=True)
    rows = tuple(
        HorizonStop(place="hover", kind="hover", duration_s=stay_s)
        if at == HOVER
        else HorizonStop(place=building, kind="rest", duration_s=stay_s)
        for at, stay_s in stops
    )
    return Horizon(
        mission=mission,
        rows=rows,
        hours=hours,
        building=building,
        hover_s=plan.hover_s,
        bound_s=hover_bound_s(day, most, most + 1),
        share=plan.hover_s / (3600.0 * hours),
        itinerary=Itinerary(
            mission, [Stop(row["place"], row["kind"], row["duration_s"]) for row in rows]
        ),
    )


def _only(day: Terrain, places: Any) -> Terrain:
    """The arrays over some of the places."""
    pairs = np.ix_(places, places)
    return replace(
        day,
        duration_s=day.duration_s[pairs],
        stage_durations_s=day.stage_durations_s[(slice(None), *pairs)],
        stage_currents_A=day.stage_currents_A[(slice(None), *pairs)],
        stay_current_A=day.stay_current_A[places],
    )

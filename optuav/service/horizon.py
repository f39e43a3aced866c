"""One drone for a working day: as much hover as greedy visits give, with an upper bound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from optuav.errors import Fault, InputError, NoPlanError, printable, refuse
from optuav.fields import Number
from optuav.judge import Itinerary, Stop, replay
from optuav.mission.messages import misfits, shown
from optuav.network.network import build_network
from optuav.network.one_stop import all_legs
from optuav.network.places import FIRST_BUILDING, HOVER
from optuav.plan.summary import tabulated
from optuav.search.greedy import greedy, hover_bound_s
from optuav.search.terrain import Terrain
from optuav.service.checks import calm_line, need_laser
from optuav.service.levels import draw_wells
from optuav.solving.several_stops import terrain
from optuav.studies.results import Pictures, Results, ResultsWithFacts, labelled_rows

if TYPE_CHECKING:
    from optuav.service.cycle import Coverage

HOURS = Number("h", gt=0.0, le=2000.0)
UNITS = {"place": "", "kind": "", "duration_s": "s"}


@dataclass(frozen=True)
class Horizon(ResultsWithFacts):
    """One drone's hovers and rests over some hours, one row per stop.

    Parameters
    ----------
    hours, building
        Length of the day [h], and where the drone rests.
    hover_s, bound_s
        Hover time in all, and one that no visits to this building exceed [s].
    share
        Share of the day in which the drone hovers [-].
    """

    itinerary: Itinerary = field(kw_only=True, repr=False)  # What `optuav.audit` takes


def horizon_of(coverage: Coverage, hours: float) -> Horizon:
    """The day of greedy visits on the building of a cycle."""
    refuse(misfits(("hours", hours, HOURS)))
    need_laser(coverage)
    if coverage.perspective != "available":
        words = "must be 'available' here: a day is planned through the wells"
        raise InputError([Fault("perspective", shown(coverage.perspective), words)])
    mission = coverage.mission.replace({"limits.deadline_s": 3600.0 * hours, "start": None})
    network = build_network(mission)
    network = replace(network, legs=all_legs(network))
    number = FIRST_BUILDING + mission.buildings.names.index(coverage.building)
    day = _only(terrain(network), np.array([*range(FIRST_BUILDING), number]))
    visit_s = max(coverage.flight_s, 1.0)  # Also where both legs have no length
    most = 1 + int(3600.0 * hours / visit_s)
    plan = greedy(replace(day, least_on_landing_As=day.least_charge_As), most, most + 1)
    if plan is None:
        words = f"{hours:g} h leave no time to hover and land with limits.min_soc of the charge"
        raise NoPlanError(words)
    stops = zip(plan.places[1:-1].tolist(), plan.stays_s.tolist(), strict=True)
    named = {HOVER: ("hover", "hover"), FIRST_BUILDING: (coverage.building, "rest")}
    rows = labelled_rows(UNITS, ((*named[place], stay_s) for place, stay_s in stops))
    facts = {
        **{"hours": hours, "building": coverage.building, "hover_s": plan.hover_s},
        **{"bound_s": hover_bound_s(day, most, most + 1), "share": plan.hover_s / (3600.0 * hours)},
    }
    itinerary = Itinerary(mission, [Stop(*row.values()) for row in rows])
    return Horizon("optuav horizon", mission, facts, UNITS, rows, _show, _draw, itinerary=itinerary)


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


def _show(day: Results) -> Iterator[str]:
    facts = day.facts
    yield f"One drone for {facts['hours']:g} h: {printable(day.mission.name)}"
    share = f"{facts['share']:.2%} of the time"
    yield f"Hover       {facts['hover_s']:.2f} s of at most {facts['bound_s']:.2f} s, {share}"
    yield from calm_line(facts)
    yield ""
    lines = [[row["place"], row["kind"], f"{row['duration_s']:.2f}"] for row in day.rows]
    yield from tabulated([["place", "stop", "for [s]"], *lines], words=2)


def _draw(day: Results) -> Pictures:
    """Both wells over the day."""
    assert isinstance(day, Horizon)
    title = f"One drone for {day.facts['hours']:g} h"
    yield "horizon.png", draw_wells(day, title, [(replay(day.itinerary), 0.0)])

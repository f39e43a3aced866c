"""The endless cycle of one drone: hover and rest in turns, to the same wells."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, Self, TypedDict

import numpy as np

from formulations.soc import PAPER, PERSPECTIVES
from optuav.errors import Fault, InputError, NoPlanError, printable
from optuav.frames import without_rounding
from optuav.judge.replay import replay
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.network import build_network
from optuav.network.timeline import Phase, PhaseStage, route_phases, simulated
from optuav.options import Perspective
from optuav.physics.flight import Flow
from optuav.physics.kibam import tilted_after
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Heading, Table
from optuav.presentation.numbers import fixed, percent, seconds
from optuav.service.calm_air import calm_facts
from optuav.service.visit import Visit
from optuav.service.wells_over_time import draw_wells
from optuav.solving.assemble import quantities
from optuav.status import Status
from optuav.studies.results import Pictures, Result

CYCLE_PHASE_UNITS = {"kind": "", "duration_s": "s", "available_As": "A s", "bound_As": "A s"}
PROVED_GAP = 1e-9  # Distance of share and bound below which the cycle is proved best
PROOFS = {
    "battery": "closed form: no cycle of any hovers, rests and buildings covers more",
    "available": "bisection; no cycle on one building covers more than a hover from full wells",
}
SWAPPED = "longest visit from full wells; every exchange fills them"
DARK = "the laser does not serve the hover, or a pad by cable serves the rest"
WELLS = "available, bound: charge in the two wells of the battery at the end of the phase"
ENDLESS = "the laser gives more than hovering draws"
NEVER_LANDS: dict[str, Any] = {
    **{"share": 1.0, "bound": 1.0, "limit_share": 1.0, "building": None, "hover_s": math.inf},
    **{"rest_s": 0.0, "flight_s": 0.0, "period_s": math.inf, "soc_at_departure": 1.0},
    **{"soc_at_landing": 1.0, "status": "optimal", "proof": ENDLESS},
}
"""The figures of a hover that never ends."""


class CyclePhase(TypedDict):
    """A row of a cycle: a phase, and both wells at its end."""

    kind: str
    duration_s: float
    available_As: float
    bound_As: float


@dataclass(frozen=True, kw_only=True, repr=False)
class EndlessCycle(Result):
    """The best endless cycle of one drone, with one row per phase; see `optuav.Coverage`."""

    kind = "optuav coverage"
    units = CYCLE_PHASE_UNITS
    rows: tuple[CyclePhase, ...]
    share: float
    bound: float
    limit_share: float
    building: str | None
    hover_s: float
    rest_s: float
    flight_s: float
    period_s: float
    soc_at_departure: float
    soc_at_landing: float
    status: str
    proof: str
    charged_by: Literal["laser", "pad", "exchange"]
    lit_hover: bool
    perspective: Perspective
    calm_share: float | None
    in_calm_air: str | None
    visit: Visit | None = field(default=None, repr=False)  # None for a hover that never ends
    visits: tuple[Visit, ...] = field(default=(), repr=False)  # Of other buildings

    def finite_cycle(self) -> Visit:
        """Return the visit, or refuse a hover that never ends."""
        if self.visit is None:
            raise NoPlanError(f"there is no cycle, one drone never lands: {ENDLESS}")
        return self.visit

    @cached_property
    def plan(self) -> Plan:
        """One cycle as a plan that `optuav.replay` takes, from its periodic wells.

        In the perspective `battery` it begins full and only its charge comes back, so that the
        available well may run dry. An exchange of the pack ends it at the landing. `NoPlanError` if
        the hover never ends.
        """
        visit, mission = self.finite_cycle(), self.mission
        building, rests, number = (
            mission.buildings.names.index(visit.building),
            visit.swap_s is None,
            0,
        )
        roof_m = mission.buildings.roof_m[building].tolist()
        cycled = mission.replace(
            {
                "route.origin_m": roof_m,
                "route.destination_m": roof_m,
                "route.hover_m": [*map(float, vehicle.hover_point_m(mission))],
                "limits.deadline_s": min(max(self.period_s, mission.limits.deadline_s), 1e7),
                "start": visit.wells(self.hover_s)._asdict(),
            }
        )
        network = build_network(cycled)
        if rests:
            on_it = (network.routes.building == building) & ~network.routes.rest_first
            number = int(np.flatnonzero(on_it)[0])
        times_s = self.hover_s, self.rest_s if rests else 0.0
        net_A = {"hover": -visit.hover_A, "rest": visit.rest_A}
        phases = route_phases(network, number, *times_s)
        flown = simulated(cycled, [_with_currents(cycled, phase, net_A) for phase in phases])
        received_W = flown[1].power_W + float(vehicle.hover_load(cycled).power_W)
        table = replace(
            quantities(network, np.array([number]), rests=rests, steps=False),
            hover_current_A=visit.hover_A,
            hover_received_W=received_W,
            rest_current_A=visit.rest_A,
            rest_received_W=flown[3].power_W if rests else 0.0,
        )
        return Plan(
            mission=cycled,
            problem="Cycle",
            trajectory=None,
            building=visit.building,
            order="hover-first",
            perspective=visit.perspective,
            slot_s=None,
            engine="coverage",
            proof=self.proof,
            status=Status(self.status),
            notes=(DARK,) if any(phase.edited for phase in flown) else (),
            phases=flown,
            soc={name: float(np.squeeze(PERSPECTIVES[name](table, *times_s))) for name in PAPER},
        )

    def on(self, visit: Visit) -> Self:
        """Return the longest cycle on another building."""
        if visit is self.visit:
            return self
        hover_s = visit.longest_s
        assert hover_s
        return replace(self, **cycle_figures(visit, hover_s, self.bound))

    def blocks(self) -> Iterator[Block]:
        """Yield the share, its cycle and proof, and the phases."""
        yield Heading(f"Coverage by one drone: {printable(self.mission.name)}")
        calm = calm_facts(self.in_calm_air)
        if self.building is None:
            yield Facts([("Share", f"100 %: it hovers without end, {ENDLESS}"), *calm])
            return
        times_s = {"hover": self.hover_s, "flight": self.flight_s, "rest": self.rest_s}
        times = ", ".join(f"{name} {seconds(time_s)}" for name, time_s in times_s.items())
        departing, landing = map(percent, (self.soc_at_departure, self.soc_at_landing))
        share = f"{percent(self.share)} of the time, at most {percent(self.bound)}"
        if self.limit_share < 1.0:
            share += f"; {percent(self.limit_share)} if flights cost nothing"
        facts = [
            ("Share", share),
            ("Building", printable(self.building)),
            ("Cycle", f"{times}: {seconds(self.period_s)}"),
            ("Charge", f"{departing} at departure, {landing} at landing"),
        ]
        yield Facts([*facts, *calm, ("Proof", f"{self.status}: {self.proof}")])
        rows = (
            (row["kind"], row["duration_s"], row["available_As"], row["bound_As"])
            for row in self.rows
        )
        cells = [[kind, *map(fixed, figures)] for kind, *figures in rows]
        yield Table(
            ["phase", "duration [s]", "available [A s]", "bound [A s]"], cells, below=[WELLS]
        )

    def pictures(self) -> Pictures:
        """Yield both wells over two periods."""
        if self.visit is None:
            return
        once = replay(self.plan)
        title = f"two periods of the endless cycle, {percent(self.share)} covered"
        yield "cycle.png", draw_wells(self, title, [(once, 0.0), (once, self.period_s)])


def cycle_figures(visit: Visit, hover_s: float, bound: float) -> dict[str, Any]:
    """The figures and rows of the cycle with a hover [s], whose share is at most a bound [-]."""
    share, size_As = visit.share(hover_s), float(visit.battery.capacity_As)
    departing = visit.periodic(hover_s)
    *_, landing = visit.carried(departing, *visit.stages(hover_s))
    return {
        "share": share,
        "bound": bound,
        "building": visit.building,
        "hover_s": hover_s,
        "rest_s": visit.rest_s(hover_s),
        "flight_s": visit.flight_s,
        "period_s": visit.period_s(hover_s),
        "soc_at_departure": float(departing.total_As) / size_As,
        "soc_at_landing": float(landing.total_As) / size_As,
        "status": (Status.OPTIMAL if bound - share <= PROVED_GAP else Status.FEASIBLE).value,
        "proof": PROOFS[visit.perspective] if visit.swap_s is None else SWAPPED,
        "rows": tuple(_phases(visit, hover_s)),
        "visit": visit,
    }


def _phases(visit: Visit, hover_s: float) -> Iterator[CyclePhase]:
    """Yield the phases of a cycle."""
    charge = visit.periodic(hover_s)
    for kind, stages in visit.phases(hover_s):
        charge = tilted_after(visit.battery, charge, *stages)
        wells = without_rounding(charge.wells(visit.battery), visit.battery.capacity_As).tolist()
        duration_s = sum(stage.duration_s for stage in stages)
        yield CyclePhase(kind=kind, duration_s=duration_s, available_As=wells[0], bound_As=wells[1])
    if visit.swap_s is not None:
        available_As, bound_As = map(float, visit.battery.full)
        yield CyclePhase(
            kind="swap", duration_s=visit.swap_s, available_As=available_As, bound_As=bound_As
        )


def _with_currents(mission: Mission, phase: Phase, net_A: dict[str, float]) -> Phase:
    """Return a stay with the current of the cycle if the mission has another one."""
    stage, cycle_A = phase.stages[0], net_A.get(phase.kind)
    if cycle_A is None or math.isclose(stage.current_A, cycle_A, rel_tol=1e-12):
        return phase
    drawn = vehicle.hover_load(mission) if phase.kind == "hover" else mission.flight_model.rest()
    power_W = (cycle_A + float(drawn.current_A)) * mission.battery.nominal_voltage_V
    net = Flow(cycle_A, power_W - float(drawn.power_W))
    return replace(phase, stages=(PhaseStage(stage.duration_s, *net),), edited=True)


def need_laser(cycle: EndlessCycle) -> Visit:
    """Return the visit; refuse an endless or dark hover, and charging by anything but the laser."""
    visit = cycle.finite_cycle()
    if cycle.charged_by != "laser" or not cycle.lit_hover:
        name = {"pad": "pad_power_W", "exchange": "swap_s"}.get(cycle.charged_by, "lit_hover")
        words = "must be left out: the mission's laser serves hover and rest here"
        raise InputError([Fault(name, "", words)])
    return visit

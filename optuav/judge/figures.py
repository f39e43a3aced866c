"""Whether the figures that a plan states are those of the simulation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from optuav.judge.phases import Phase
from optuav.judge.tolerance import same
from optuav.network import vehicle
from optuav.physics.kibam import Wells
from optuav.plan import Phase as Planned
from optuav.plan import Plan
from optuav.plan.trace import Event

MISMATCH = "mismatch"
"""Kind of the event that a figure is not what it should be."""

IN_SLOTS = ("P1", "P2", "P2-tight", "P3", "P4")
"""Problems whose stays are whole slots; those of one's own may bound them otherwise."""

Compared = tuple[str, float, float, str, float]
"""Name of a figure, as stated, as simulated, its unit, and the scale of its tolerance."""


def mismatches(
    plan: Plan,
    phases: Sequence[Phase],
    ends: Sequence[tuple[Wells, ...]],
    soc: Mapping[str, float],
) -> Iterator[Event]:
    """Figures of a plan that are not those of its simulation.

    Parameters
    ----------
    plan
        As it states itself.
    phases
        The same phases, worked out again.
    ends
        Wells of the packs at the end of every phase [A s].
    soc
        State of charge at the end by perspective [-].
    """
    capacity_As = float(vehicle.pool(plan.mission).capacity_As)
    for number, (stated, found, wells) in enumerate(zip(plan.phases, phases, ends, strict=True)):
        here = f"phases[{number}]"
        for figure in (
            *_motion(stated, found),
            *_loads(stated, found),
            *_charges(stated, wells, capacity_As),
        ):
            yield from _mismatch(here, found.start_s, figure)
        for name, many, few in (
            ("stages", len(stated.stages), len(found.stages)),
            ("available_As", len(stated.available_As), len(wells)),
        ):
            if many != few:
                words = f"{here}.{name}: the plan has {many}, the simulation {few}"
                yield Event(MISMATCH, found.start_s, words, many, few)
    for name, stated_soc in (plan.soc or {}).items():
        if name in soc:
            figure = (name, stated_soc, soc[name], "", 1.0)
            yield from _mismatch("soc", phases[-1].end_s, figure)
    if plan.slot_s is not None and plan.problem in IN_SLOTS:
        yield from _broken_slots(plan, plan.slot_s)


def contradicted_verdict(plan: Plan, events: Sequence[Event]) -> Iterator[Event]:
    """The verdict that a plan states, where its simulation has another.

    Parameters
    ----------
    plan
        As it states itself.
    events
        Of its simulation.
    """
    violations = [event for event in events if event.violation]
    broken = [event for event in violations if event.kind != MISMATCH]
    end_s = plan.mission_time_s
    if plan.flyable is True and broken:
        yield Event(MISMATCH, end_s, "flyable: the plan says that it can be flown, it cannot")
    if plan.flyable is False and not violations:
        yield Event(MISMATCH, end_s, "flyable: the plan says that it cannot be flown, it can")


def _broken_slots(plan: Plan, slot_s: float) -> Iterator[Event]:
    """Stays of no whole slots, other than a hover that the deadline cuts short."""
    at_deadline = same(plan.mission_time_s, plan.mission.limits.deadline_s)
    for number, stay in enumerate(plan.phases):
        cut_short = stay.kind == "hover" and at_deadline
        if stay.kind == "flight" or cut_short:
            continue
        slots = stay.duration_s / slot_s
        if not same(round(slots) * slot_s, stay.duration_s):
            words = (
                f"slot_s: the plan says {slot_s:.10g} s, but phases[{number}] is {slots:.10g} slots"
            )
            yield Event(MISMATCH, stay.start_s, words, slot_s, None, "s")


def _motion(stated: Planned, found: Phase) -> Iterator[Compared]:
    for name, unit in (("start_s", "s"), ("distance_m", "m"), ("peak_speed_m_s", "m/s")):
        yield name, getattr(stated, name), getattr(found, name), unit, 1.0


def _loads(stated: Planned, found: Phase) -> Iterator[Compared]:
    for k, (mine, theirs) in enumerate(zip(stated.stages, found.stages, strict=False)):
        A, W = (sum(pair) for pair in zip(theirs.drawn, theirs.received, strict=True))
        for name, unit, scale in (
            ("duration_s", "s", 1.0),
            ("current_A", "A", A),
            ("power_W", "W", W),
        ):
            here = f"stages[{k}].{name}"
            yield here, getattr(mine, name), getattr(theirs, name), unit, scale


def _charges(stated: Planned, wells: Sequence[Wells], capacity_As: float) -> Iterator[Compared]:
    for name in ("available_As", "bound_As"):
        for pack, (mine, theirs) in enumerate(zip(getattr(stated, name), wells, strict=False)):
            yield f"{name}[{pack}]", mine, float(getattr(theirs, name)), "A s", capacity_As


def _mismatch(here: str, time_s: float, figure: Compared) -> Iterator[Event]:
    name, stated, found, unit, scale = figure
    if not same(stated, found, scale):
        words = f"{here}.{name}: the plan says {stated:.10g}, it is {found:.10g} {unit}".rstrip()
        yield Event(MISMATCH, time_s, words, stated, found, unit)

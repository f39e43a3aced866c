"""A plan as blocks: question and answer, times, its wells, phases and remarks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TypeAlias
from xml.etree.ElementTree import Element

from optuav.mission import Mission
from optuav.mission.files import label
from optuav.options import LONGEST_HOVER
from optuav.plan.data import PlanData
from optuav.presentation.blocks import Block, Cell, Facts, Fold, Heading, Picture, Table
from optuav.presentation.numbers import all_digits, fixed, percent, seconds, with_unit

TABLE = "buildings_file"  # The key under which a plan names the table of its buildings
HEADINGS = ("what", "where", "start s", "for s", "A", "W", "avail. %", "bound %")
LEGEND = (
    "A, W: mean current and power into the battery. avail. %, bound %: how full its two wells are "
    "at the end; the drone draws only from the available one."
)
NUMBERED = re.compile(r"^[\w-]+\.[a-z] ")  # Beginning of a constraint's label that numbers it
CHARGE, AVAILABLE = "battery", "available"  # Perspectives of the charge, and of the wells
EDITED = "*: figures set in the graph."
TOO_LONG = 1e5
"""From here on a number is printed with two digits and an exponent, to leave room for names."""

Line: TypeAlias = tuple[str, str]  # A label and its words


def blocks(plan: PlanData) -> Iterator[Block]:
    """The plan as blocks: question, answer, wells, phases, warnings and notes.

    HTML folds the notes: some give away what a reader may want to find.
    """
    yield from question_blocks(plan)
    if plan:
        yield Facts([*times(plan), *outcome(plan)])
        yield Picture(partial(_wells, plan))
        rows = phase_rows(plan)
        below = [LEGEND] + [EDITED] * any(phase.edited for phase in plan.phases)
        below += counted_otherwise(plan)
        table = Table(HEADINGS, rows, words=2, longest=None, below=below)
        yield Fold(f"Phases ({len(rows)})", [table], is_open=True)
    yield Facts(warnings(plan))
    if notes := [("Note", note) for note in plan.notes]:
        yield Fold(f"Notes ({len(notes)})", [Facts(notes)])


def question_blocks(plan: PlanData) -> Iterator[Block]:
    """The verdict in HTML; the question and its answer, there folded."""
    headline = Heading(verdict(plan), good=bool(plan) and plan.flyable is not False)
    yield Fold("", [headline], in_text=False)
    yield Fold("Question", [Facts(heading(plan))], is_open=not plan)


def verdict(plan: PlanData) -> str:
    """The answer in one sentence."""
    words = f"{plan.problem}, {plan.status.value.replace('_', ' ')}"
    if not plan:
        return f"No plan: {words}"
    flies = {None: "", True: ", can be flown", False: ", cannot be flown"}[plan.flyable]
    return f"Hover {seconds(plan.hover_time_s)} ({words}){flies}"


def heading(plan: PlanData) -> list[Line]:
    """Mission and question, and status of the answer."""
    way = plan.trajectory and f"trajectory {plan.trajectory}"
    along = f"devices in the order {', '.join(plan.device_order)}" if plan.device_order else None
    on = plan.building and f"building {plan.building}"
    options = [option for option in (way, on, plan.order, along) if option]
    question = [plan.problem, *options, f"perspective {plan.perspective}", counted_in(plan.slot_s)]
    lines = [("Mission", plan.mission.name), ("Problem", ", ".join(question))]
    if not plan:
        lines.append(("Answer", f"{plan.status.value.upper()} ({plan.proof})"))
        return lines + [("Because", reason) for reason in plan.reasons]
    longest = plan.problem == "P1" and plan.trajectory == "optimal"
    among = longest and not plan.has_several_stops  # Plans with more stops may be longer.
    which = " with at most one rest" if among else ""
    which += " and one hover in one piece" if among and not plan.mission.devices else ""
    status = plan.status.value.replace("_", " ")
    lines.append(("Answer", f"{status}{which} ({plan.proof})"))
    if plan.flyable is not None:
        words = "yes, simulated again" if plan.flyable else "NO, as its simulation shows"
        lines.append(("Flyable", words))
    return lines


def facts(plan: PlanData) -> list[Line]:
    """Question and answer, times, where the plan leads, and remarks."""
    if not plan:
        return [*heading(plan), *remarks(plan)]
    taken = [(name, f"{time}, {words}") for name, time, words in times(plan)]
    return [*heading(plan), *taken, *outcome(plan), *remarks(plan)]


def remarks(plan: PlanData) -> list[Line]:
    """Warnings, then notes."""
    return [*warnings(plan), *(("Note", note) for note in plan.notes)]


def warnings(plan: PlanData) -> list[Line]:
    """What keeps a plan from being flown, and a table that is not here."""
    sentences = filter(None, (*(plan.warnings if plan else ()), unknown_buildings(plan.mission)))
    return [("Warning", warning) for warning in sentences]


def unknown_buildings(mission: Mission) -> str:
    """Say that the table of a mission is not here; empty where nothing is missing."""
    source, lacking = mission.buildings.source, mission.buildings.lacking
    if source is None or not lacking:
        return ""
    words = f"{lacking} of its {source.buildings} buildings are unknown and in the way of nothing"
    return f"the table {label(Path(source.path))} is not here: {words}"


def counted_in(slot_s: float | None) -> str:
    """Say how times are counted: in slots of a length [s], or continuously."""
    return "continuous times" if slot_s is None else f"slots of {all_digits(slot_s)} s"


def times(plan: PlanData) -> list[tuple[str, str, str]]:
    """Durations of a plan by kind and of the whole, and remarks on them."""
    rows: list[tuple[str, str, str]] = []
    for kind, time_s in (("hover", plan.hover_time_s), ("rest", plan.rest_time_s)):
        stops = [phase for phase in plan.phases if phase.kind == kind]
        lasting = [stop for stop in stops if stop.duration_s]
        served = [f"{seconds(stop.duration_s)} at {stop.end_place}" for stop in lasting]
        if len(served) < 2:
            served = [
                f"at {e.end_place}, from {seconds(e.start_s)}"
                if e.duration_s
                else f"passes by {e.end_place}"
                for e in stops
            ]
        if stops or kind == "hover":
            rows.append((kind.capitalize(), seconds(time_s), ", ".join(served)))
    fastest_m_s = max(phase.peak_speed_m_s for phase in plan.phases)
    flown = f"{len(plan.route) - 1} legs, up to {_cell(fastest_m_s, 1)} m/s"
    if chosen := [_cell(speed_m_s, 2) for leg in plan.speeds_m_s for speed_m_s in leg]:
        flown = f"{len(plan.route) - 1} legs, at {', '.join(chosen)} m/s"
    left_s = plan.mission.limits.deadline_s - plan.mission_time_s
    ends = f"{seconds(abs(left_s))} {'before' if left_s > 0.0 else 'AFTER'} the deadline"
    ends = "exactly at the deadline" if abs(left_s) < 0.005 else ends
    flight, mission = (seconds(time_s) for time_s in (plan.flight_time_s, plan.mission_time_s))
    return [*rows, ("Flight", flight, flown), ("Mission", mission, ends)]


def outcome(plan: PlanData) -> list[Line]:
    """Rows on where a plan leads, what charge it leaves, and what keeps it from being better."""
    levels, counted = plan.soc or {}, _counted_as(plan)
    left = (
        [f"{percent(levels[counted])} by {counted}"]
        if counted != CHARGE and counted in levels
        else []
    )
    left += [f"{percent(levels[CHARGE])} of the battery"] if CHARGE in levels else []
    lines = [("Route", " → ".join(plan.route)), ("Charge left", ", ".join(left) or "unknown")]
    shown_objective = (
        None if plan.problem in LONGEST_HOVER else plan.objective
    )  # The hover is shown above
    for name, value in (("Objective", shown_objective), ("Bound", plan.bound)):
        if value is not None:
            reached = with_unit(value, plan.objective_unit)
            lines.append((name, reached + "; none is better" * (name == "Bound")))
    if plan.binding:
        limits = "; ".join(NUMBERED.sub("", label) for label in plan.binding)
        in_slots = plan.engine == "grid"
        would = f"would break {limits}"
        lines.append(("Next slot", would) if in_slots else ("Binding", limits))
    return lines


def counted_otherwise(plan: PlanData) -> Iterator[str]:
    """Yield the charge left as the other perspectives count it."""
    shown = {CHARGE, _counted_as(plan)}
    levels = (plan.soc or {}).items()
    others = [f"{name} {percent(level)}" for name, level in levels if name not in shown]
    if others:
        yield f"Charge left, as the paper's other perspectives count it: {', '.join(others)}."


def _counted_as(plan: PlanData) -> str:
    """The perspective whose charge a plan keeps; that of the battery under `available`."""
    return CHARGE if plan.perspective == AVAILABLE else plan.perspective


def phase_rows(plan: PlanData) -> list[tuple[Cell, ...]]:
    """Rows of the phases, as the `HEADINGS` name their cells; a flight has both places or one."""
    full = plan.mission.pool.full
    rows = list[tuple[Cell, ...]]()
    for phase in plan.phases:
        stays, end = phase.kind != "flight", phase.end_place
        where: Cell = end if stays else (f"{phase.start_place} → {end}", f"→ {end}")
        times = (_cell(time_s, 2) for time_s in (phase.start_s, phase.duration_s))
        loads = _cell(phase.current_A, 2, "+"), _cell(phase.power_W, 0, "+")
        wells = sum(phase.available_As) / full.available_As, sum(phase.bound_As) / full.bound_As
        levels = (_cell(100.0 * level, 1) for level in wells)
        rows.append((phase.kind + "*" * phase.edited, where, *times, *loads, *levels))
    return rows


def _cell(value: float, decimals: int, sign: str = "") -> str:
    """A number of a table, short where it would leave no room for names."""
    return fixed(value, decimals, sign=sign, less_than=TOO_LONG)


def _wells(plan: PlanData) -> Element:
    """Both wells over time, below the phases."""
    from optuav.plan.display import picture, wells_over_plan

    stays = ((phase.kind, phase.start_s, phase.duration_s) for phase in plan.phases)
    return picture(
        wells_over_plan(plan), stays, plan.mission.pool.full, plan.runs_dry_s, plan.overfull_s
    )

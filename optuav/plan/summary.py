"""The summary of a plan: an aligned block of text, see `line_width`."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence
from itertools import groupby
from operator import itemgetter
from pathlib import Path
from typing import TypeAlias

from optuav.errors import folded, line_width, spelled
from optuav.mission import Mission
from optuav.mission.files import label
from optuav.mission.messages import written_out
from optuav.options import LONGEST_HOVER
from optuav.plan.data import PlanData
from optuav.presentation.text import FILLER, as_wide, tabulated

TABLE = "buildings_file"  # The key under which a plan names the table of its buildings
LABEL = 13
LEAST_ROOM = 15  # Columns for the place of a phase
GAP = "  "
NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(?:s|m|N|A|W|J|%|m/s|A s)\b|%)")
NO_BREAK = "\N{NO-BREAK SPACE}"
HEADINGS = ("what", "where", "start s", "for s", "A", "W", "avail. %", "bound %")
LEGEND = "A, W: mean into the battery. avail., bound: fill of the wells at the end."
EDITED = "*: figures stated in the graph."
TOO_LONG = 1e5
"""From here on a number is printed with two digits and an exponent, to leave room for names."""


Line: TypeAlias = tuple[str, str]  # A label and its words


def summary(plan: PlanData) -> str:
    """The plan as text."""
    lines = [line for label, words in heading(plan) for line in wrapped(label, words)]
    if plan:
        shown = [(name, f"{time_s:10.2f} s   {remark}") for name, time_s, remark in times(plan)]
        shown += outcome(plan)
        lines += ["", *(line for label, words in shown for line in wrapped(label, words))]
        lines += ["", *_timeline(plan)]
    for mark, found in groupby(remarks(plan), itemgetter(0)):
        lines += ["", *(line for _, words in found for line in wrapped(mark, words))]
    return "\n".join(lines)


def heading(plan: PlanData) -> list[Line]:
    """Mission and question, and status of the answer."""
    way = plan.trajectory and f"trajectory {plan.trajectory}"
    stated = filter(None, (way, plan.building and f"building {plan.building}", plan.order))
    question = [plan.problem, *stated, f"perspective {plan.perspective}", counted_in(plan.slot_s)]
    lines = [("Mission", plan.mission.name), ("Problem", ", ".join(question))]
    if not plan:
        lines.append(("Answer", f"{plan.status.value.upper()} ({plan.proof})"))
        return lines + [("Because", reason) for reason in plan.reasons]
    longest = plan.problem == "P1" and plan.trajectory == "optimal"
    among = longest and not plan.has_several_stops  # Plans with more stops may be longer.
    which = " with at most one rest and one hover in one piece" if among else ""
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
    taken = [(name, f"{time_s:.2f} s, {words}") for name, time_s, words in times(plan)]
    return [*heading(plan), *taken, *outcome(plan), *remarks(plan)]


def remarks(plan: PlanData) -> list[Line]:
    """Warnings, then notes."""
    warnings = filter(None, (*(plan.warnings if plan else ()), unknown_buildings(plan.mission)))
    return [("Warning", warning) for warning in warnings] + [("Note", note) for note in plan.notes]


def unknown_buildings(mission: Mission) -> str:
    """Say that the table of a mission is not here; empty where nothing is missing."""
    source, lacking = mission.buildings.source, mission.buildings.lacking
    if source is None or not lacking:
        return ""
    known = f"{lacking} of its {source.buildings} buildings are unknown and in the way of nothing"
    return f"the table {label(Path(source.path))} is not here: {known}"


def counted_in(slot_s: float | None) -> str:
    """Say how times are counted: in slots of a length [s], or continuously."""
    return "continuous times" if slot_s is None else f"slots of {written_out(slot_s)} s"


def wrapped(label: str, text: str, start: str = "", indent: int = LABEL) -> list[str]:
    """A paragraph beside its label, or beside a start; a number keeps its unit on its line."""
    known = NO_BREAK.join(as_wide(spelled(piece)) for piece in text.split(NO_BREAK))
    wide, start = NUMBER_AND_UNIT.sub(NO_BREAK, known), start or f"{label:<{LABEL}}"
    width = line_width() - (FILLER in wide)  # A break may part a letter from its filler.
    lines = textwrap.TextWrapper(width, start, " " * indent, break_on_hyphens=False).wrap(wide)
    return [line.replace(NO_BREAK, " ").replace(FILLER, "") for line in lines or [start.rstrip()]]


def _number(value: float, decimals: int, sign: str = "") -> str:
    """A number with fixed decimals, unless it is too long for that."""
    # Adding 0 turns a negative zero into zero.
    rounded = round(value, decimals) + 0.0
    return f"{rounded:{sign}.{decimals}f}" if abs(value) < TOO_LONG else f"{value:{sign}.2g}"


def times(plan: PlanData) -> list[tuple[str, float, str]]:
    """Durations of a plan by kind and of the whole [s], and remarks on them."""
    rows: list[tuple[str, float, str]] = []
    for kind, time_s in (("hover", plan.hover_time_s), ("rest", plan.rest_time_s)):
        stops = [phase for phase in plan.phases if phase.kind == kind]
        lasting = [stop for stop in stops if stop.duration_s]
        served = [f"{stop.duration_s:.2f} s at {stop.end_place}" for stop in lasting]
        if len(served) < 2:
            served = [
                f"at {e.end_place}, from {e.start_s:.2f} s"
                if e.duration_s
                else f"passes by {e.end_place}"
                for e in stops
            ]
        if stops or kind == "hover":
            rows.append((kind.capitalize(), time_s, ", ".join(served)))
    fastest_m_s = max(phase.peak_speed_m_s for phase in plan.phases)
    flown = f"{len(plan.route) - 1} legs, up to {_number(fastest_m_s, 1)} m/s"
    if chosen := [_number(speed_m_s, 2) for leg in plan.speeds_m_s for speed_m_s in leg]:
        flown = f"{len(plan.route) - 1} legs, at {', '.join(chosen)} m/s"
    left_s = plan.mission.limits.deadline_s - plan.mission_time_s
    ends = f"{abs(left_s):.2f} s {'before' if left_s > 0.0 else 'AFTER'} the deadline"
    ends = "exactly at the deadline" if abs(left_s) < 0.005 else ends
    return [*rows, ("Flight", plan.flight_time_s, flown), ("Mission", plan.mission_time_s, ends)]


def outcome(plan: PlanData) -> list[Line]:
    """Rows on where a plan leads, what charge it leaves, and what keeps it from being better."""
    levels = [f"{name} {_number(100 * level, 2)} %" for name, level in (plan.soc or {}).items()]
    left = f"of the battery, by perspective: {', '.join(levels)}"
    lines = [("Route", " → ".join(plan.route)), ("Charge left", left)]
    known = None if plan.problem in LONGEST_HOVER else plan.objective  # The hover is shown above
    for name, value in (("Objective", known), ("Bound", plan.bound)):
        if value is not None:
            shown = f"{value:.6g} {plan.objective_unit.removeprefix('1')}".rstrip()
            lines.append((name, shown + "; none is better" * (name == "Bound")))
    if plan.binding:
        limits, in_slots = "; ".join(plan.binding), plan.engine == "grid"
        would = f"would break {limits}"
        lines.append(("Next slot", would) if in_slots else ("Binding", limits))
    return lines


def figures(plan: PlanData) -> list[tuple[str, ...]]:
    """Rows of the phases: the kind, and the figures that the `HEADINGS` after its place name."""
    full = plan.mission.pool.full
    rows = []
    for phase in plan.phases:
        times = (_number(time_s, 2) for time_s in (phase.start_s, phase.duration_s))
        loads = _number(phase.current_A, 2, "+"), _number(phase.power_W, 0, "+")
        wells = sum(phase.available_As) / full.available_As, sum(phase.bound_As) / full.bound_As
        levels = (_number(100 * level, 1) for level in wells)
        rows.append((phase.kind + "*" * phase.edited, *times, *loads, *levels))
    return rows


def _timeline(plan: PlanData) -> Iterator[str]:
    cells = figures(plan)
    columns = zip((HEADINGS[0], *HEADINGS[2:]), *cells, strict=True)
    widths = [max(map(len, column)) for column in columns]
    room = max(LEAST_ROOM, line_width() - sum(widths) - len(GAP) * len(widths))
    rows: list[Sequence[str]] = [HEADINGS]
    for phase, (kind, *numbers) in zip(plan.phases, cells, strict=True):
        end = both = phase.end_place
        if phase.kind == "flight":  # both places, or its end
            end = f"→ {end}"
            both = f"{phase.start_place} {end}"
        rows.append((kind, both if len(as_wide(both)) <= room else end, *numbers))
    yield from tabulated(rows, 2, longest=room)
    yield from folded(LEGEND, line_width()).split("\n")
    if any(phase.edited for phase in plan.phases):
        yield EDITED

"""The summary of a plan: an aligned block of text of at most 80 columns."""

from __future__ import annotations

import re
import textwrap
import unicodedata
from collections.abc import Iterator
from typing import TYPE_CHECKING

from optuav.errors import printable
from optuav.mission.messages import counted_in
from optuav.network import vehicle

if TYPE_CHECKING:
    from optuav.plan.plan import Plan

WIDTH = 80
LABEL = 13
GAP = "  "
NUMBER_AND_UNIT = re.compile(r"(?<=\d) (?=(?:s|m|N|A|W|J|%|m/s|A s)\b|%)")
NO_BREAK = "\N{NO-BREAK SPACE}"
FILLER = "\0"
HEADINGS = ("what", "where", "start s", "for s", "A", "W", "avail. %", "bound %")
LEGEND = "A, W: mean into the battery. avail., bound: fill of the wells at the end."
EDITED = "*: figures stated in the graph."
TOO_LONG = 1e5
"""From here on a number is printed with two digits and an exponent, to leave room for names."""


def summary(plan: Plan) -> str:
    """The plan as text of at most 80 columns."""
    question = [
        plan.problem,
        f"trajectory {plan.trajectory}" if plan.trajectory else "",
        f"building {plan.building}" if plan.building else "",
        plan.order or "",
        f"perspective {plan.perspective}",
        counted_in(plan.slot_s),
    ]
    lines = wrapped("Mission", plan.mission.name)
    lines += wrapped("Problem", ", ".join(each for each in question if each))
    if plan:
        kinds = [phase.kind for phase in plan.phases]
        few = kinds.count("rest") <= 1 and kinds.count("hover") <= 1 and plan.engine != "search"
        # Plans with more stops may be longer.
        among = few and plan.problem == "P1" and plan.trajectory == "optimal"
        which = " with at most one rest and one hover in one piece" if among else ""
        lines += wrapped("Answer", f"{plan.status.value}{which} ({plan.proof})")
        if plan.flyable is not None:
            words = "yes, simulated again" if plan.flyable else "NO, as its simulation shows"
            lines += wrapped("Flyable", words)
        lines += ["", *_times(plan), "", *_timeline(plan)]
    else:
        lines += wrapped("Answer", f"{plan.status.value.upper()} ({plan.proof})")
        for reason in plan.reasons:
            lines += wrapped("Because", reason)
    for mark, remarks in (("Warning", plan.warnings if plan else ()), ("Note", plan.notes)):
        lines += [""] if remarks else []
        for remark in remarks:
            lines += wrapped(mark, remark)
    return "\n".join(lines)


def _as_wide(text: str) -> str:
    """Printable text as long as it is wide: a filler before each letter that takes two columns."""
    return "".join(
        FILLER + letter if unicodedata.east_asian_width(letter) in "WF" else letter
        for letter in printable(text)
    )


def wrapped(label: str, text: str, start: str = "", indent: int = LABEL) -> list[str]:
    """A paragraph beside its label, or beside a start; a number keeps its unit on its line."""
    known = NO_BREAK.join(map(_as_wide, text.split(NO_BREAK)))
    wide, start = NUMBER_AND_UNIT.sub(NO_BREAK, known), start or f"{label:<{LABEL}}"
    lines = textwrap.wrap(
        wide,
        # A break may part a letter from its filler.
        WIDTH - (FILLER in wide),
        initial_indent=start,
        subsequent_indent=" " * indent,
        break_on_hyphens=False,
    )
    return [line.replace(NO_BREAK, " ").replace(FILLER, "") for line in lines or [start.rstrip()]]


def _number(value: float, decimals: int, sign: str = "") -> str:
    """A number with fixed decimals, unless it is too long for that."""
    # Adding 0 turns a negative zero into zero.
    rounded = round(value, decimals) + 0.0
    return f"{rounded:{sign}.{decimals}f}" if abs(value) < TOO_LONG else f"{value:{sign}.2g}"


def _times(plan: Plan) -> Iterator[str]:
    rows: list[tuple[str, float, str]] = []
    for kind, time_s in (("hover", plan.hover_time_s), ("rest", plan.rest_time_s)):
        stops = [phase for phase in plan.phases if phase.kind == kind]
        served = [
            f"{each.duration_s:.2f} s at {each.end_place}" for each in stops if each.duration_s
        ]
        if len(served) < 2:
            served = [
                f"at {each.end_place}, from {each.start_s:.2f} s"
                if each.duration_s
                else f"passes by {each.end_place}"
                for each in stops
            ]
        if stops or kind == "hover":
            rows.append((kind.capitalize(), time_s, ", ".join(served)))
    fastest_m_s = max(phase.peak_speed_m_s for phase in plan.phases)
    flown = f"{len(plan.route) - 1} legs, up to {_number(fastest_m_s, 1)} m/s"
    mission_s = plan.mission_time_s
    left_s = plan.mission.limits.deadline_s - mission_s
    ends = f"{abs(left_s):.2f} s {'before' if left_s > 0.0 else 'AFTER'} the deadline"
    rows += [
        ("Flight", plan.flight_time_s, flown),
        ("Mission", mission_s, "exactly at the deadline" if abs(left_s) < 0.005 else ends),
    ]
    for label, time_s, remark in rows:
        yield from wrapped(label, f"{time_s:10.2f} s   {remark}")
    yield from wrapped("Route", " → ".join(plan.route))
    levels = ", ".join(
        f"{name} {_number(100 * level, 2)} %" for name, level in (plan.soc or {}).items()
    )
    yield from wrapped("Charge left", f"of the battery, by perspective: {levels}")
    if plan.binding:
        limits = "; ".join(plan.binding)
        if plan.engine == "grid":
            yield from wrapped("Next slot", f"would break {limits}")
        else:
            yield from wrapped("Binding", limits)


def _timeline(plan: Plan) -> Iterator[str]:
    full = vehicle.pool(plan.mission).full
    cells = [
        (
            phase.kind + "*" * phase.edited,
            _number(phase.start_s, 2),
            _number(phase.duration_s, 2),
            _number(phase.current_A, 2, "+"),
            _number(phase.power_W, 0, "+"),
            _number(100 * sum(phase.available_As) / full.available_As, 1),
            _number(100 * sum(phase.bound_As) / full.bound_As, 1),
        )
        for phase in plan.phases
    ]
    kind, where, *others = HEADINGS
    columns = list(zip((kind, *others), *cells, strict=True))
    widths = [max(map(len, column)) for column in columns]
    room = WIDTH - sum(widths) - len(GAP) * len(widths)
    places = [_as_wide(where)]
    for phase in plan.phases:  # both places of a flight, or its end, cut if need be
        end, flies = _as_wide(phase.end_place), phase.kind == "flight"
        end = f"→ {end}" if flies else end
        both = f"{_as_wide(phase.start_place)} {end}" if flies else end
        end = both if len(both) <= room else end
        places.append(end if len(end) <= room else f"{end[: room - 1].rstrip(FILLER)}…")
    width = max(map(len, places))
    for place, what, *numbers in zip(places, *columns, strict=True):
        texts = [f"{text:>{w}}" for text, w in zip(numbers, widths[1:], strict=True)]
        yield GAP.join([f"{what:<{widths[0]}}", f"{place:<{width}}", *texts]).replace(FILLER, "")
    yield LEGEND
    if any(phase.edited for phase in plan.phases):
        yield EDITED

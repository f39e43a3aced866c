"""A picture of the wells of a plan over time, and landings below the reserve."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple
from xml.etree.ElementTree import Element

import numpy as np

from optuav.looks import LOOKS, PHASES
from optuav.network import vehicle
from optuav.network.places import hover_point_of
from optuav.network.timeline import carry, steps
from optuav.physics.kibam import Wells
from optuav.plan.data import PlanData
from optuav.presentation.markup import element
from optuav.presentation.numbers import figure, percent, seconds

if TYPE_CHECKING:
    from optuav.arrays import Floats
    from optuav.mission import Mission

WIDTH, HEIGHT = 440.0, 120.0  # Size of the levels [px]
ABOVE, LEFT, RIGHT = 20.0, 46.0, 30.0  # Room around them [px]
END, BOTTOM = LEFT + WIDTH, ABOVE + HEIGHT  # Right and lower ends of the levels [px]
LOWEST = BOTTOM + 37.0  # Line of the legend [px]
LINE = {"stroke": "currentColor"}
BOUND, AVAILABLE, LACKING, EXCESS = (
    LOOKS[role].light for role in ("bound", "available", "dry", "overfull")
)
PIECES = 12  # Parts of a stage, as the wells do not change along straight lines
LETTER, ROW = 6.5, 16.0  # About how wide a letter is, and how high a line of words [px]
MOST_BESIDE = 3  # Entries of the legend beside which there is room for moments
MOST_TICKS, MOST_POINTS = 6, 400
AT_END = 0.06  # Part of the mission over which a reserve at its end is drawn
ROUNDED_LEVEL = 1e-6  # Percent of the capacity, and share of a step


class Levels(NamedTuple):
    """Charge in both wells of all packs [A s] at moments [s], for drawing lines."""

    time_s: Floats
    available_As: Floats
    bound_As: Floats


def wells_over_plan(plan: PlanData) -> Levels:
    """Both wells over a plan; of packs that take turns, when one of them changes its part."""
    mission = plan.mission
    changes = [(0.0, *vehicle.start(mission).wells(mission.pool))]
    if mission.battery.takes_turns:
        for stretch in itertools.chain.from_iterable(carry(mission, plan.phases).stretches):
            end_s = stretch.start_s[0] + stretch.duration_s[0]
            changes.append((end_s, *(well[0].sum() for well in stretch.wells)))
    else:
        for step in steps(mission, plan.phases, PIECES):
            changes.append((step.start_s + step.stage.duration_s, *step.after))
    return Levels(*np.array(changes, dtype=float).T)


def reserve_from_s(mission: Mission, end_s: float) -> float:
    """Begin of the line of the reserve [s]: of the mission, or shortly before its end."""
    return 0.0 if mission.limits.keep_soc == "always" else (1.0 - AT_END) * end_s


class LowLanding(NamedTuple):
    """An end of a flight, before the last, that leaves less than the reserve."""

    time_s: float
    charge_As: float  # In both wells of all packs
    words: str


def low_landings(plan: PlanData) -> list[LowLanding]:
    """Landings and arrivals at the hover point with less charge than `limits.min_soc` [A s]."""
    limits = plan.mission.limits
    least_As = limits.min_soc * float(plan.mission.pool.full.total_As)
    *flights, _ = (phase for phase in plan.phases if phase.kind == "flight")
    allowed = "; allowed by keep_soc = end" if limits.keep_soc == "end" else ""
    low, hovers = list[LowLanding](), {device.name for device in plan.mission.served}
    for phase in flights:
        charge_As = sum(phase.available_As) + sum(phase.bound_As)
        if charge_As < least_As * (1.0 - ROUNDED_LEVEL):
            over = phase.end_place in hovers
            where = f"at {hover_point_of(phase.end_place)}" if over else "on the roof"
            words = f"below the reserve {where}{allowed}"
            low.append(LowLanding(phase.end_s, charge_As, words))
    return low


def thinned(course: Levels) -> Levels:
    """Every n-th moment and the last, about `MOST_POINTS`."""
    step = 1 + len(course.time_s) // MOST_POINTS
    return Levels(*(np.append(values[:-1:step], values[-1]) for values in course))


class Frame(NamedTuple):
    """Where a moment [s] and a charge [%] stand in a picture [px]."""

    end_s: float
    low: float
    high: float

    def x(self, time_s: float) -> float:
        """Pixels from the left."""
        return LEFT + WIDTH * min(time_s, self.end_s) / self.end_s

    def y(self, percent: float) -> float:
        """Pixels from above."""
        return ABOVE + HEIGHT * (self.high - percent) / (self.high - self.low)


def picture(
    course: Levels,
    phases: Iterable[tuple[str, float, float]],
    full: Wells,
    dry_s: float | None = None,
    overfull_s: float | None = None,
) -> Element:
    """Both wells over time as an inline SVG: bound below available, in % of the capacity.

    Above them the phases: kind, start and duration [s]. The moments when the available well is
    empty and past full are marked.
    """
    time_s, available_As, bound_As = thinned(course)
    percent = 100.0 / float(full.total_As)
    bound, total = percent * bound_As, percent * (bound_As + available_As)
    excess = percent * np.maximum(available_As - float(full.available_As), 0.0)
    low, high = min(0.0, float(total.min())), max(100.0, float(total.max()))
    frame = Frame(max(float(time_s[-1]), 1e-9), low, high)
    areas = [
        (BOUND, np.zeros_like(bound), bound),
        (AVAILABLE, bound, np.maximum(total, bound)),
    ]
    legend = [(AVAILABLE, "available y₁"), (BOUND, "bound y₂")]
    if (total < bound - ROUNDED_LEVEL).any():
        areas.append((LACKING, np.minimum(total, bound), bound))
        legend.append((LACKING, "not there"))
    if (excess > ROUNDED_LEVEL).any():
        areas.append((EXCESS, total - excess, total))
        legend.append((EXCESS, "past full"))
    moments = (overfull_s, EXCESS, "past full"), (dry_s, LACKING, "dry")
    marks = [(at_s, colour, words) for at_s, colour, words in moments if at_s is not None]
    below = LOWEST + ROW * (bool(marks) and len(legend) > MOST_BESIDE)
    drawn = itertools.chain(
        (_area(frame, time_s, *area) for area in areas),
        _levels(frame),
        _phases(frame, phases),
        _times(frame),
        _legend(legend),
        _marks(frame, marks, below),
    )
    box = f"0 0 {END + RIGHT:g} {below + 9.0:g}"
    named = {"role": "img", "aria_label": "Charge in both wells over time"}
    return element("svg", *drawn, viewBox=box, fill="currentColor", font_size="12", **named)


def _drawn(tag: str, *words: str, **look: str | float) -> Element:
    """A part of the picture; numbers are in pixels."""
    written = {name: v if isinstance(v, str) else f"{v:.1f}" for name, v in look.items()}
    return element(tag, *words, **written)


def _area(frame: Frame, time_s: Floats, colour: str, under: Floats, over: Floats) -> Element:
    """The area between two lines over time."""
    corners = [*zip(time_s, over, strict=True), *reversed([*zip(time_s, under, strict=True)])]
    points = " ".join(f"{frame.x(at_s):.1f},{frame.y(level):.1f}" for at_s, level in corners)
    return _drawn("polygon", points=points, fill=colour, fill_opacity="0.85")


def _levels(frame: Frame) -> Iterator[Element]:
    """Yield a line across for no, half and full charge, with its percentage."""
    for level in (0.0, 50.0, 100.0):
        y = frame.y(level)
        yield _drawn("line", x1=LEFT, x2=END, y1=y, y2=y, **LINE, opacity="0.4")
        yield _drawn("text", percent(level / 100.0), x=LEFT - 4, y=y + 4, text_anchor="end")


def _phases(frame: Frame, phases: Iterable[tuple[str, float, float]]) -> Iterator[Element]:
    """Yield a bar for each phase, with its kind where there is room."""
    for kind, start_s, duration_s in phases:
        start, wide = frame.x(start_s), frame.x(start_s + duration_s) - frame.x(start_s)
        yield _drawn("rect", x=start, y=ABOVE - 5.0, width=wide, height=4.0, fill=PHASES[kind])
        if wide > LETTER * len(kind):
            middle = start + wide / 2.0
            yield _drawn("text", kind, x=middle, y=ABOVE - 8.0, text_anchor="middle")


def _times(frame: Frame) -> Iterator[Element]:
    """Yield ticks of the axis of time, with their times."""
    step_s = round_step(frame.end_s)
    for number in range(int(frame.end_s / step_s) + 1):
        at = frame.x(step_s * number)
        yield _drawn("line", x1=at, x2=at, y1=BOTTOM, y2=BOTTOM + 4.0, **LINE)
        yield _drawn("text", figure(step_s * number), x=at, y=BOTTOM + 16.0, text_anchor="middle")
    yield _drawn("text", "s", x=END + RIGHT, y=BOTTOM + 16.0, text_anchor="end")


def _legend(entries: Iterable[tuple[str, str]]) -> Iterator[Element]:
    """Yield a square of each colour and the words beside it."""
    at = LEFT
    for colour, words in entries:
        yield _drawn("rect", x=at, y=LOWEST - 9.0, width=10.0, height=10.0, fill=colour)
        yield _drawn("text", words, x=at + 14.0, y=LOWEST)
        at += 14.0 + LETTER * (len(words) + 3)


def _marks(
    frame: Frame, marks: Sequence[tuple[float, str, str]], below: float
) -> Iterator[Element]:
    """Yield a line at each moment, and one sentence on all of them."""
    for at_s, colour, _ in marks:
        at = frame.x(at_s)
        yield _drawn("line", x1=at, x2=at, y1=ABOVE, y2=BOTTOM, stroke=colour, stroke_width="2")
    if marks:
        sentence = ", ".join(f"{words} at {seconds(at_s, 1)}" for at_s, _, words in marks)
        yield _drawn("text", sentence, x=END, y=below, text_anchor="end")


def round_step(length: float, most: int = MOST_TICKS) -> float:
    """A step of 1, 2 or 5 times a power of ten that fits into a length > 0 at most so often."""
    size = 10.0 ** math.floor(math.log10(length / most))
    return next(size * factor for factor in (1, 2, 5, 10, 20) if length / (size * factor) <= most)


def rounded_up(length: float) -> float:
    """The least number of round steps that is as long: 1200 for 1108; 1 for nothing."""
    step = round_step(length or 1.0)
    return step * math.ceil((length or 1.0) / step - ROUNDED_LEVEL)

"""Several packs under a schedule: one carries the load, another may be charged meanwhile.

Every pack is a KiBaM battery of its own. A job is carried by the pack that the schedule names; when
that pack is seen empty (y1 = 0) it is taken out of service, and another takes over in the middle of
the job. A charger serves one of the packs that carry nothing, the one with the least y1, until that
is full, then the next; where all are full, the last of them takes what seeps into its bound well.
A single pack has no other beside it: it carries and is charged at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from optuav.physics.battery import Battery, Phase, Wells, step, time_to_empty, time_to_full
from optuav.physics.quantity import Quantity

Schedule: TypeAlias = Literal[
    "pooled", "sequential", "round-robin", "alternating", "most-available"
]

SCHEDULES: tuple[Schedule, ...] = get_args(Schedule)
"""Names of the schedules, the default first."""

ROUNDING = 1e-12
"""Share of the capacity by which rounding may carry a well past its limit [-]."""

NOBODY = -1

Currents: TypeAlias = NDArray[np.float64]
Crossing: TypeAlias = Callable[[Battery, Wells, float], Quantity]


class Load(NamedTuple):
    """A stage of a job.

    Parameters
    ----------
    draw_A
        What the pack that carries the job gives [A], ≥ 0.
    charge_A
        What the charger offers meanwhile [A], ≥ 0.
    duration_s
        For how long [s], ≥ 0.
    """

    draw_A: float
    charge_A: float
    duration_s: float


class Stretch(NamedTuple):
    """A stretch of time in which no pack changes its part.

    Parameters
    ----------
    start_s, duration_s
        When, counted from the first job, and for how long [s]; the duration is > 0.
    carrier, served
        Numbers of the packs that carry the load and are charged; −1 for nobody.
    currents_A
        Into every pack [A], positive while charging; the mean where a full pack takes ever less.
    wells
        Of every pack at the end [A s].
    """

    start_s: float
    duration_s: float
    carrier: int
    served: int
    currents_A: Currents
    wells: Wells


class Event(NamedTuple):
    """A pack seen empty, or found full by the charger.

    Parameters
    ----------
    at_s
        When, counted from the first job [s].
    pack
        Its number.
    what
        ``"empty"`` or ``"full"``.
    """

    at_s: float
    pack: int
    what: Literal["empty", "full"]


@dataclass
class Packs:
    """Equal packs, full at first, that carry one job after the other.

    Parameters
    ----------
    pack
        One of them.
    count
        How many, ≥ 1.
    schedule
        Who carries: ``"pooled"`` (all as one battery of `count` times the capacity),
        ``"sequential"`` (the first until it is empty, then the next), ``"round-robin"`` (the next
        at each job), ``"alternating"`` (the next every `period_s`, by the clock), or
        ``"most-available"`` (the one with the largest y1 when a job starts; the first of equals).
    period_s
        Of ``"alternating"`` [s], > 0.
    """

    pack: Battery
    count: int
    schedule: Schedule = "pooled"
    period_s: float | None = None
    clock_s: float = field(default=0.0, init=False)
    carrier: int = field(default=NOBODY, init=False)
    events: list[Event] = field(default_factory=list, init=False)
    _filled: list[int] = field(default_factory=list, init=False)

    def __post_init__(self) -> None:
        if self.schedule == "pooled":
            whole = self.count * self.pack.capacity_As
            self.pack = Battery(whole, self.pack.available_fraction, self.pack.flow_rate_per_s)
            self.count = 1
        self.wells = Wells(*(np.full(self.count, float(well)) for well in self.pack.full))
        self.in_service = np.ones(self.count, dtype=bool)

    @property
    def exhausted(self) -> bool:
        """Whether every pack was seen empty."""
        return not self.in_service.any()

    def job(self, stages: Iterable[Load]) -> Iterator[Stretch]:
        """Carry a job through its stages; it ends early when no pack is left to carry it."""
        begun = False
        for draw_A, charge_A, duration_s in stages:
            left_s, self._filled = duration_s, []
            while left_s > 0.0 and not self.exhausted:
                longest_s, carrier = left_s, NOBODY
                if draw_A > 0.0:
                    longest_s = min(left_s, self._turn_left_s())
                    self._take_over(begun)
                    begun, carrier = True, self.carrier
                served = self._served(carrier) if charge_A > 0.0 else NOBODY
                stretch = self._stretch(carrier, served, Load(draw_A, charge_A, longest_s))
                left_s -= stretch.duration_s
                if stretch.duration_s > 0.0:
                    yield stretch

    def _take_over(self, begun: bool) -> None:
        """Change the carrier at the start of a job, when it is empty, or when its turn is over."""
        by_the_clock = self.schedule == "alternating"
        if begun and self.in_service[self.carrier] and not by_the_clock:
            return
        chosen = self.next_carrier(self.carrier)
        if chosen != self.carrier:
            self.carrier, self._filled = chosen, []

    def next_carrier(self, before: int) -> int:
        """Number of the pack that carries on after another one, by the schedule."""
        if self.schedule == "round-robin":
            return self._following(before)
        if self.schedule == "alternating":
            return self._following(self._turn() % self.count - 1)
        if self.schedule == "most-available":
            return int(np.argmax(np.where(self.in_service, self.wells.available_As, -np.inf)))
        return int(np.argmax(self.in_service))

    def _following(self, before: int) -> int:
        """The next pack in service, by number and round again."""
        numbers = (np.arange(self.count) + before + 1) % self.count
        return int(numbers[self.in_service[numbers]][0])

    def _turn(self) -> int:
        assert self.period_s is not None
        return int(self.clock_s / self.period_s)

    def _turn_left_s(self) -> float:
        """How long the carrier stays by the clock [s]."""
        if self.schedule != "alternating":
            return np.inf
        assert self.period_s is not None
        left_s = (self._turn() + 1) * self.period_s - self.clock_s
        return max(left_s, float(np.spacing(self.clock_s)))

    def _served(self, carrier: int) -> int:
        """Who is charged: the emptiest idle pack, and the one filled last when all are full."""
        idle = self.in_service.copy()
        if self.count > 1 and carrier != NOBODY:
            idle[carrier] = False
        if not idle.any():
            return NOBODY
        idle[self._filled] = False
        if not idle.any():
            return self._filled[-1]
        return int(np.argmin(np.where(idle, self.wells.available_As, np.inf)))

    def _stretch(self, carrier: int, served: int, load: Load) -> Stretch:
        """Go on until a pack is empty or full, for the duration of the load at most."""
        currents_A = np.zeros(self.count)
        if carrier != NOBODY:
            currents_A[carrier] -= load.draw_A
        if served != NOBODY:
            currents_A[served] += load.charge_A
        full = served if served in self._filled and currents_A[served] > 0.0 else NOBODY
        length_s, end = load.duration_s, self._after(currents_A, load.duration_s, full)
        top_As, slack_As = self.pack.full.available_As, ROUNDING * self.pack.capacity_As
        first: Event | None = None
        if carrier != NOBODY and end.available_As[carrier] < -slack_As:
            length_s = min(length_s, self._moment_s(time_to_empty, carrier, currents_A))
            first = Event(self.clock_s + length_s, carrier, "empty")
        if served != NOBODY and end.available_As[served] > top_As + slack_As:
            full_s = self._moment_s(time_to_full, served, currents_A)
            if full_s < length_s:
                length_s, first = full_s, Event(self.clock_s + full_s, served, "full")
        if first is not None:
            self.events.append(first)
            end = self._after(currents_A, length_s, full)
            if first.what == "empty":
                self.in_service[carrier] = False
            else:
                self._filled.append(served)
        if full != NOBODY and length_s > 0.0:
            gained_As = end.total_As[full] - self.wells.total_As[full]
            currents_A[full] = gained_As / length_s
        stretch = Stretch(self.clock_s, length_s, carrier, served, currents_A, end)
        self.wells, self.clock_s = end, self.clock_s + length_s
        return stretch

    def _moment_s(self, crossing: Crossing, number: int, currents_A: Currents) -> float:
        wells = Wells(*(float(well[number]) for well in self.wells))
        return float(crossing(self.pack, wells, float(currents_A[number])))

    def _after(self, currents_A: Currents, duration_s: float, full: int) -> Wells:
        """Wells after constant currents, but for one full pack that is kept full.

        At y1 = ωB that pack takes I = ωk'((1−ω)B − y2), so that y2 nears (1−ω)B at the rate ωk'.
        """
        end = step(self.pack, self.wells, Phase(currents_A, duration_s))
        if full != NOBODY:
            top = self.pack.full
            missing_As = top.bound_As - self.wells.bound_As[full]
            rate = self.pack.available_fraction * self.pack.rate_per_s
            end.available_As[full] = top.available_As
            end.bound_As[full] = top.bound_As - missing_As * np.exp(-rate * duration_s)
        return end

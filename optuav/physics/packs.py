"""Several packs under a schedule: one carries the load, another may be charged meanwhile.

Every pack is a KiBaM battery of its own. A job is carried by the pack that the schedule names; when
that pack is seen empty (y1 = 0) it is taken out of service, and another takes over in the middle of
the job. A charger serves one of the packs that carry nothing, the one with the least y1, until that
is full, then the next; where all are full, the last of them takes what seeps into its bound well.
A single pack has no other beside it: it carries and is charged at once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.physics.charging import held
from optuav.physics.kibam import Battery, Stage, Wells, step, time_to_empty, time_to_full
from optuav.physics.quantity import Quantity
from optuav.physics.schedules import Schedule

ROUNDING = 1e-12
"""Share of the capacity by which rounding may carry a well past its limit [-]."""

NOBODY = -1


class Load(NamedTuple):
    """A stage of a job.

    Parameters
    ----------
    draw_A
        What the pack that carries the job gives [A], ≥ 0.
    charge_A
        What the charger offers meanwhile [A], ≥ 0.
    duration_s
        For how long [s], ≥ 0; a number, or one for each course.
    """

    draw_A: float
    charge_A: float
    duration_s: float | Floats


class Stretch(NamedTuple):
    """A stretch of time in which no pack changes its part; one entry a course.

    Parameters
    ----------
    start_s, duration_s
        When, counted from the first job, and for how long [s]; 0 where a course stands still.
    carrier, served
        Numbers of the packs that carry the load and are charged; −1 for nobody.
    emptied, filled
        Whether it ends because the carrier is empty, or because the pack that is served is full.
    currents_A
        (course, pack): into every pack [A], positive while charging; the mean where a full pack
        takes ever less.
    wells
        (course, pack): at its end [A s].
    """

    start_s: Floats
    duration_s: Floats
    carrier: Integers
    served: Integers
    emptied: Booleans
    filled: Booleans
    currents_A: Floats
    wells: Wells


@dataclass
class Packs:
    """Equal packs, full at first, that carry one job after the other, in several courses at once.

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

    def __post_init__(self) -> None:
        if self.schedule == "pooled":
            whole = self.count * self.pack.capacity_As
            self.pack = Battery(whole, self.pack.available_fraction, self.pack.flow_rate_per_s)
            self.count = 1
        self._top = Wells(*map(float, self.pack.full))
        self.wells = Wells(*(np.full((1, self.count), well) for well in self._top))
        self.in_service: Booleans = np.ones((1, self.count), dtype=bool)
        self.carrier: Integers = np.array([NOBODY])
        self.clock_s: Floats = np.array([0.0])
        self._courses = np.arange(1)

    @property
    def exhausted(self) -> Booleans:
        """Whether every pack was seen empty, which ends a course; its clock tells when [s]."""
        none: Booleans = ~np.any(self.in_service, axis=1)
        return none

    def take(self, courses: Integers | Sequence[int]) -> Packs:
        """Some courses, each as often as it is named; they go on from here on their own."""
        found = copy(self)
        found.wells = Wells(*(well[courses] for well in self.wells))
        found.in_service, found.carrier = self.in_service[courses], self.carrier[courses]
        found.clock_s, found._courses = self.clock_s[courses], np.arange(len(courses))
        return found

    def job(self, stages: Iterable[Load]) -> list[Stretch]:
        """Carry a job through its stages; a course ends early when no pack is left to carry it."""
        found: list[Stretch] = []
        waiting = np.ones_like(self.exhausted)
        for load in stages:
            left_s = np.zeros_like(self.clock_s) + load.duration_s
            filled = np.zeros_like(self.in_service)
            last = served = carrier = np.full_like(self.carrier, NOBODY)
            while (going := (left_s > 0.0) & ~self.exhausted).any():
                longest_s = np.where(going, left_s, 0.0)
                if load.draw_A > 0.0:
                    carrier = np.where(going, self._carriers(waiting), self.carrier)
                    filled[carrier != self.carrier] = False
                    self.carrier, waiting = carrier, waiting & ~going
                    longest_s = np.minimum(longest_s, self._turn_left_s())
                if load.charge_A > 0.0:
                    served = self._served(carrier, filled, last)
                stretch = self._stretch(load, longest_s, carrier, served, filled)
                last = np.where(stretch.filled, served, last)
                filled[self._courses[stretch.filled], served[stretch.filled]] = True
                left_s = left_s - stretch.duration_s
                found.append(stretch)
        return found

    def next_carrier(self, before: Integers) -> Integers:
        """Numbers of the packs that carry on after others, by the schedule."""
        if self.schedule == "round-robin":
            return self._following(before)
        if self.schedule == "alternating":
            return self._following(self._turn().astype(np.intp) % self.count - 1)
        if self.schedule == "most-available":
            chosen: Integers = np.where(self.in_service, self.wells.available_As, -np.inf).argmax(
                axis=1
            )
            return chosen
        first: Integers = self.in_service.argmax(axis=1)
        return first

    def _following(self, before: Integers) -> Integers:
        """The next packs in service, by number and round again."""
        steps = (np.arange(self.count) - before[:, None] - 1) % self.count
        nearest: Integers = np.where(self.in_service, steps, self.count).argmin(axis=1)
        return nearest

    def _carriers(self, waiting: Booleans) -> Integers:
        """Who carries: another at the start of a job, after an empty one, and when a turn ends."""
        if self.count == 1:
            return np.zeros_like(self.carrier)
        stays = ~waiting & self.in_service[self._courses, self.carrier]
        if self.schedule == "alternating":
            stays[:] = False
        return np.where(stays, self.carrier, self.next_carrier(self.carrier))

    def _turn(self) -> Floats:
        """Which turn of the clock it is."""
        assert self.period_s is not None
        turn: Floats = np.floor(self.clock_s / self.period_s)
        return turn

    def _turn_left_s(self) -> Floats | float:
        """How long carriers stay by the clock [s]."""
        if self.schedule != "alternating" or self.count == 1:
            return np.inf
        assert self.period_s is not None
        left_s = (self._turn() + 1.0) * self.period_s - self.clock_s
        longest_s: Floats = np.maximum(left_s, np.spacing(self.clock_s))
        return longest_s

    def _served(self, carrier: Integers, filled: Booleans, last: Integers) -> Integers:
        """Who is charged: the emptiest idle pack, and the one filled last where all are full."""
        if self.count == 1:
            return np.zeros_like(carrier)
        idle = self.in_service & (np.arange(self.count) != carrier[:, None])
        accepts = idle & ~filled
        emptiest = np.where(accepts, self.wells.available_As, np.inf).argmin(axis=1)
        topped = np.where(idle[self._courses, last], last, NOBODY)
        return np.where(accepts.any(axis=1), emptiest, topped)

    def _stretch(
        self,
        load: Load,
        longest_s: Floats,
        carrier: Integers,
        served: Integers,
        filled: Booleans,
    ) -> Stretch:
        """Go on until a pack is empty or full, for a time at most [s]."""
        packs = np.arange(self.count)
        carries, is_served = packs == carrier[:, None], packs == served[:, None]
        currents_A = load.charge_A * is_served - load.draw_A * carries
        full = filled & is_served & (currents_A > 0.0)
        before, length_s, slack_As = self.wells, longest_s, ROUNDING * self.pack.capacity_As
        end = self._after(currents_A, length_s, full)
        emptied = (carries & (end.available_As < -slack_As)).any(axis=1)
        length_s = self._until(time_to_empty, emptied, carrier, currents_A, length_s)
        over = (is_served & (end.available_As > self._top.available_As + slack_As)).any(axis=1)
        full_s = self._until(time_to_full, over, served, currents_A, longest_s)
        over &= full_s < np.where(emptied, length_s, np.inf)
        emptied, length_s = emptied & ~over, np.where(over, full_s, length_s)
        if emptied.any() or over.any():
            end = self._after(currents_A, length_s, full)
            self.in_service = self.in_service & ~(emptied[:, None] & carries)
        if full.any():
            gained_As = np.where(full, end.total_As - before.total_As, 0.0)
            mean_A = gained_As / np.where(length_s > 0.0, length_s, 1.0)[:, None]
            currents_A = np.where(full, mean_A, currents_A)
        stretch = Stretch(self.clock_s, length_s, carrier, served, emptied, over, currents_A, end)
        self.wells, self.clock_s = end, self.clock_s + length_s
        return stretch

    def _until(
        self,
        crossing: Callable[[Battery, Wells, Floats], Quantity],
        where: Booleans,
        number: Integers,
        currents_A: Floats,
        longest_s: Floats,
    ) -> Floats:
        """When a well of one pack of some courses reaches its limit, at most a time [s]."""
        if not where.any():
            return longest_s
        chosen = self._courses[where], number[where]
        wells = Wells(*(well[chosen] for well in self.wells))
        length_s = longest_s.copy()
        moment_s = crossing(self.pack, wells, currents_A[chosen])
        length_s[where] = np.minimum(moment_s, length_s[where])
        return length_s

    def _after(self, currents_A: Floats, duration_s: Floats, full: Booleans) -> Wells:
        """Wells after constant currents, but for full packs that are kept full."""
        passed_s = duration_s[:, None]
        end = step(self.pack, self.wells, Stage(currents_A, passed_s))
        if not full.any():
            return end
        top = held(self.pack, Wells(self._top.available_As, self.wells.bound_As), passed_s)
        return Wells(*(np.where(full, *each) for each in zip(top, end, strict=True)))

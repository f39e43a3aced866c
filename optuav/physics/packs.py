"""Several packs under a schedule: one carries the load while another may be charged.

Every pack is a KiBaM battery of its own. A job is carried by the pack that the schedule names; when
that pack is seen empty (y1 = 0) it is taken out of service, and another takes over in the middle of
the job. A charger serves one of the packs that carry nothing, the one with the least y1, until that
is full, then the next; where all are full, the last of them takes what seeps into its bound well.
A single pack carries and is charged at once.

References
----------
.. [1] M. R. Jongerden, B. R. Haverkort, "Which battery model to use?", IET Software, 2009.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from copy import copy
from dataclasses import dataclass
from functools import partial
from itertools import accumulate
from numbers import Integral, Real
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats, Integers
from optuav.errors import Fault, SolverError, refuse, shown
from optuav.options import SCHEDULES, Schedule
from optuav.physics import kibam
from optuav.physics.kibam import Battery, Stage, Tilted, Wells, held, step
from optuav.physics.quantity import TINY, Quantity
from optuav.presentation.numbers import figure, short

ROUNDED_WELL = 1e-12  # Share of the capacity that rounding may carry a well past its limit [-]
NOBODY = -1  # Number that stands for no pack
MOST_STRETCHES = 50_000  # Stretches that `lifetime` follows one by one; some ten seconds


class JobStage(NamedTuple):
    """A stage of a job."""

    draw_A: float  # Current of the pack that carries the job [A], ≥ 0
    charge_A: float  # Current offered by the charger meanwhile [A], ≥ 0
    duration_s: float | Floats  # For how long [s], ≥ 0; a number, or one for each course


class Stretch(NamedTuple):
    """A stretch of time where no pack changes its part; one entry per course."""

    # When, counted from the first job, and for how long [s]; 0 where a course stands still.
    start_s: Floats
    duration_s: Floats
    # Numbers of the packs that carry the load and are charged; −1 for nobody.
    carrier: Integers
    served: Integers
    # Whether it ends because the carrier is empty, or because the pack that is served is full.
    emptied: Booleans
    filled: Booleans
    # (course, pack): into every pack [A], positive while charging; the mean where a full pack takes
    # ever less.
    currents_A: Floats
    wells: Wells  # (course, pack): at its end [A s]


@dataclass
class Packs:
    """Equal packs that carry one job after the other, in several courses at once.

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
    begin
        Wells of each pack at the start [A s]; by default full. For pooled packs, of one pack.
    """

    pack: Battery
    count: int
    schedule: Schedule = "pooled"
    period_s: float | None = None
    begin: Wells | None = None

    def __post_init__(self) -> None:
        if self.schedule == "pooled":
            whole = self.count * self.pack.capacity_As
            self.pack = Battery(whole, self.pack.available_fraction, self.pack.flow_rate_per_s)
            if self.begin is not None:
                self.begin = Wells(*(self.count * well for well in self.begin))
            self.count = 1
        # A single pack takes no turns.
        self._turn_s = self.period_s if self.period_s and self.count > 1 else math.inf
        self._top = Wells(*map(float, self.pack.full))
        begin = self.begin or kibam.start(self.pack).wells(self.pack)
        self.wells = Wells(*(np.full((1, self.count), well) for well in begin))
        self.in_service: Booleans = np.ones((1, self.count), dtype=bool)
        self.carrier: Integers = np.array([NOBODY])
        self.clock_s: Floats = np.array([0.0])
        self._courses = np.arange(1)

    @property
    def exhausted(self) -> Booleans:
        """True if every pack was seen empty, which ends a course at its `clock_s` [s]."""
        return np.asarray(~self.in_service.any(axis=1))

    def take(self, courses: Integers | Sequence[int]) -> "Packs":
        """A copy with some courses, by number; a number may be repeated."""
        copied = copy(self)
        copied.wells = Wells(*(well[courses] for well in self.wells))
        copied.in_service, copied.carrier = self.in_service[courses], self.carrier[courses]
        copied.clock_s, copied._courses = self.clock_s[courses], np.arange(len(courses))
        return copied

    def stretches(self, stages: Iterable[JobStage]) -> Iterator[Stretch]:
        """Carry a job through its stages, one stretch at a time.

        A course ends early when no pack is left to carry it.
        """
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
                yield stretch

    def next_carrier(self, before: Integers) -> Integers:
        """Numbers of the packs that carry on after others, by the schedule."""
        if self.schedule == "round-robin":
            return self._following(before)
        if self.schedule == "alternating":
            turn = np.floor(self.clock_s / self._turn_s).astype(np.intp)
            return self._following(turn % self.count - 1)
        if self.schedule == "most-available":
            left_As = np.where(self.in_service, self.wells.available_As, -np.inf)
            return np.asarray(left_As.argmax(axis=1))
        return np.asarray(self.in_service.argmax(axis=1))

    def _following(self, before: Integers) -> Integers:
        """The next packs in service, by number and round again."""
        steps = (np.arange(self.count) - before[:, None] - 1) % self.count
        return np.asarray(np.where(self.in_service, steps, self.count).argmin(axis=1))

    def _carriers(self, waiting: Booleans) -> Integers:
        """Packs that carry; they change with a job, after an empty pack and when a turn ends."""
        if self.count == 1:
            return np.zeros_like(self.carrier)
        stays = ~waiting & self.in_service[self._courses, self.carrier]
        if self.schedule == "alternating":
            stays[:] = False
        return np.where(stays, self.carrier, self.next_carrier(self.carrier))

    def _turn_left_s(self) -> Floats:
        """Time to the end of the turn by the clock [s]."""
        end_s = (np.floor(self.clock_s / self._turn_s) + 1.0) * self._turn_s
        return np.asarray(np.maximum(end_s - self.clock_s, np.spacing(self.clock_s)))

    def _served(self, carrier: Integers, filled: Booleans, last: Integers) -> Integers:
        """Packs that are charged: the emptiest idle one, or the one filled last if all are full."""
        if self.count == 1:
            return np.zeros_like(carrier)
        idle = self.in_service & (np.arange(self.count) != carrier[:, None])
        accepts = idle & ~filled
        emptiest = np.where(accepts, self.wells.available_As, np.inf).argmin(axis=1)
        topped = np.where(idle[self._courses, last], last, NOBODY)
        return np.where(accepts.any(axis=1), emptiest, topped)

    def _stretch(
        self,
        load: JobStage,
        longest_s: Floats,
        carrier: Integers,
        served: Integers,
        filled: Booleans,
    ) -> Stretch:
        """Go on until a pack is empty or full, or for the longest time [s]."""
        packs = np.arange(self.count)
        carries, is_served = packs == carrier[:, None], packs == served[:, None]
        currents_A = load.charge_A * is_served - load.draw_A * carries
        full = filled & is_served & (currents_A > 0.0)
        before, length_s, slack_As = self.wells, longest_s, ROUNDED_WELL * self.pack.capacity_As
        end = self._after(currents_A, length_s, full)
        emptied = (carries & (end.available_As < -slack_As)).any(axis=1)
        length_s = self._until(kibam.time_to_empty, emptied, carrier, currents_A, length_s)
        over = (is_served & (end.available_As > self._top.available_As + slack_As)).any(axis=1)
        full_s = self._until(kibam.time_to_full, over, served, currents_A, longest_s)
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
        """When a well of one pack of some courses reaches its limit, or the longest time [s]."""
        if not where.any():
            return longest_s
        chosen = self._courses[where], number[where]
        wells = Wells(*(well[chosen] for well in self.wells))
        length_s = longest_s.copy()
        moment_s = crossing(self.pack, wells, currents_A[chosen])
        length_s[where] = np.minimum(moment_s, length_s[where])
        return length_s

    def _after(self, currents_A: Floats, duration_s: Floats, full: Booleans) -> Wells:
        """Wells after constant currents; full packs are kept full."""
        passed_s = duration_s[:, None]
        end = step(self.pack, self.wells, Stage(currents_A, passed_s))
        if not full.any():
            return end
        top = held(self.pack, Wells(self._top.available_As, self.wells.bound_As), passed_s)
        return Wells(*(np.where(full, *choice) for choice in zip(top, end, strict=True)))


def lifetime(
    load: Iterable[tuple[float, float]],
    *,
    capacity_As: float,
    available_fraction: float,
    flow_rate_per_s: float,
    packs: int = 1,
    schedule: Schedule = "pooled",
    period_s: float | None = None,
    horizon_s: float = math.inf,
) -> float:
    """Return how long full packs carry a load that is repeated without end [s].

    Mind the sign: here a positive current **discharges**, as is usual for loads, while elsewhere
    I > 0 charges.

    Parameters
    ----------
    load
        Pairs of current [A] and duration [s], > 0. A current > 0 is a job, carried by one pack; 0
        is idle; < 0 charges the pack with the least y1, and what full packs do not take is lost.
    capacity_As
        Of **one** pack [A s], > 0; ``"pooled"`` makes one battery of `packs` times as much.
    available_fraction
        ω [-], in (0, 1).
    flow_rate_per_s
        k_F [1/s], ≥ 0; not k' = k_F/(ω(1−ω)).
    packs
        How many, 1 to 1000.
    schedule
        ``"pooled"``, ``"sequential"``, ``"round-robin"``, ``"alternating"`` or
        ``"most-available"``, see `Packs`. A pack seen empty is not used again; another takes over
        in the middle of the job.
    period_s
        Of ``"alternating"`` and of no other schedule [s], ≥ 1e-3.
    horizon_s
        How long the load is followed [s], > 0; without end by default. A load that recharges what
        it draws needs one.

    Returns
    -------
    First moment without a pack left to carry the load [s]; ``inf`` if the load draws nothing,
    or if the packs still carry it at the horizon.

    Raises
    ------
    InputError
        With everything that is wrong.
    SolverError
        If neither an end nor the horizon is reached in 50 000 stretches, some ten seconds. A
        stretch ends where a job or a turn by the clock does, or where a pack is empty or full.
        Rounds that empty no pack are skipped where nothing charges and the schedule is
        ``"pooled"``, ``"sequential"`` or ``"round-robin"``.

    Examples
    --------
    >>> cell = {"capacity_As": 7200, "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}
    >>> print(f"{lifetime([(0.96, 1.0)], **cell) / 60:.1f} min")
    91.1 min
    >>> print(f"{lifetime([(0.96, 0.5), (0.0, 0.5)], **cell) / 60:.1f} min")
    202.9 min
    >>> lifetime([(1.0, 60.0), (-1.0, 60.0)], **cell, horizon_s=86_400)
    inf
    """
    try:
        entries = list(load)
    except TypeError:
        entries = []
    faults = list(_load_faults(load, entries))
    faults += _range_faults("capacity_As", capacity_As, 1e-3, 1e9, "A s")
    faults += _range_faults("available_fraction", available_fraction, 1e-6, 0.999999, "-")
    faults += _range_faults("flow_rate_per_s", flow_rate_per_s, 0.0, 1e3, "1/s")
    faults += _range_faults("packs", packs, 1, 1000, "-", whole=True)
    if schedule not in SCHEDULES:
        faults.append(Fault("schedule", shown(schedule), f"one of {', '.join(SCHEDULES)}"))
    elif schedule == "alternating":
        faults += _range_faults("period_s", period_s, 1e-3, 1e9, "s")
    elif period_s is not None:
        faults.append(
            Fault("period_s", shown(period_s), "must be left out, unless schedule = 'alternating'")
        )
    faults += _range_faults("horizon_s", horizon_s, 1e-6, math.inf, "s")
    refuse(faults)
    pack = Battery(float(capacity_As), float(available_fraction), float(flow_rate_per_s))
    jobs = [
        JobStage(max(float(current_A), 0.0), max(-float(current_A), 0.0), float(duration_s))
        for current_A, duration_s in entries
    ]
    return _followed(Packs(pack, int(packs), schedule, period_s), jobs, float(horizon_s))


def _load_faults(load: object, entries: Sequence[object]) -> Iterator[Fault]:
    if not entries:
        yield Fault("load", shown(load), "pairs (current_A, duration_s), at least one")
    for number, entry in enumerate(entries):
        if not isinstance(entry, Sequence | np.ndarray) or np.shape(entry) != (2,):
            yield Fault(f"load[{number}]", shown(entry), "a pair (current_A, duration_s)")
            continue
        yield from _range_faults(f"load[{number}].current_A", entry[0], -1e9, 1e9, "A")
        yield from _range_faults(f"load[{number}].duration_s", entry[1], 1e-6, 1e9, "s")


def _range_faults(
    key: str, value: object, least: float, most: float, unit: str, *, whole: bool = False
) -> Iterator[Fault]:
    """The fault of an argument that is not a number within a range."""
    is_number = isinstance(value, Integral if whole else Real) and not isinstance(value, bool)
    if not is_number or not least <= float(value) <= most:  # type: ignore[arg-type]
        noun = "a whole number" if whole else "a number"
        yield Fault(key, shown(value), f"{noun}, {short(least)} <= x <= {short(most)} [{unit}]")


def _followed(packs: Packs, jobs: Sequence[JobStage], horizon_s: float) -> float:
    """Lifetime of packs [s] under jobs that are repeated; ``inf`` beyond the horizon [s]."""
    if not any(job.draw_A for job in jobs):
        return math.inf
    same_packs = packs.count == 1 or packs.schedule in ("sequential", "round-robin")
    may_skip = same_packs and not any(job.charge_A for job in jobs)
    followed = 0
    while True:
        if may_skip:
            _skip(packs, jobs)
        # Every pack takes its turn before rounds are skipped again.
        for job in list(jobs) * (packs.count if may_skip else 1):
            for _ in packs.stretches([job]):
                followed += 1
                if packs.exhausted[0] and packs.clock_s[0] <= horizon_s:
                    return float(packs.clock_s[0])
                if packs.clock_s[0] >= horizon_s:
                    return math.inf
                if followed > MOST_STRETCHES:
                    words = f"after {figure(packs.clock_s[0])} s the packs still carry the load"
                    words = f"{MOST_STRETCHES} stretches do not reach the end: {words}"
                    raise SolverError(f"{words}; a horizon_s says how long to follow it")


def _skip(packs: Packs, jobs: Sequence[JobStage]) -> None:
    """Pass all rounds of discharging jobs that empty no pack.

    In a round every pack in service takes its turn once, with the same currents each time, so it
    acts on a pack as an affine map: after n rounds y = y0 + nq and z = a^n z0 + c (1 − a^n)/(1 −
    a), with z = y1 − ωy. Within a round y1 is α − βn + γa^n, β ≥ 0, which is concave or falls: once
    below 0 it stays there, so bisection finds the first round where a pack is empty.
    """
    stages, carrier = list[Stage](), packs.carrier
    for job in list(jobs) * int(packs.in_service.sum()):
        if job.draw_A > 0.0:
            carrier = packs.next_carrier(carrier)
        stages.append(Stage(-job.draw_A * (np.arange(packs.count) == carrier), job.duration_s))
    pack, share = packs.pack, packs.pack.available_fraction
    start, nothing = Tilted.of(pack, packs.wells), Tilted(*np.zeros((2, packs.count)))
    _, *ends = accumulate(stages, partial(kibam.tilted_after, pack), initial=nothing)
    total_As, tilt_As = map(np.array, zip(*ends, strict=True))
    ends_s = np.cumsum([stage.duration_s for stage in stages])
    remaining = np.exp(-pack.rate_per_s * ends_s)
    exponent = max(float(pack.rate_per_s * ends_s[-1]), TINY)

    def after(rounds: int) -> Tilted:
        """Charge of every pack (1, pack) after some rounds."""
        tilts = math.expm1(-exponent * rounds) / math.expm1(-exponent)
        tilt = start.tilt_As * math.exp(-exponent * rounds) + tilt_As[-1] * tilts
        return Tilted(start.total_As + rounds * total_As[-1], tilt)

    passed, failed = 0, 1 + int(start.total_As.sum() / -total_As[-1].sum())
    while failed - passed > 1:
        middle = (passed + failed) // 2
        total, tilt = after(middle - 1)
        available_As = share * (total + total_As) + remaining[:, None] * tilt + tilt_As
        empty = (available_As[:, packs.in_service[0]] < 0.0).any()
        passed, failed = (passed, middle) if empty else (middle, failed)
    packs.wells = after(passed).wells(pack)
    packs.clock_s = packs.clock_s + passed * ends_s[-1]

"""How long packs carry a load that is repeated for ever; `optuav.physics.kibam.lifetime`.

Most of a long life is skipped. While no pack is seen empty and nothing charges, `pooled`,
`sequential` and `round-robin` repeat the same currents, so that a round of the load acts on every
pack as one affine map: after n rounds y = y0 + n q and z = a^n z0 + c (1 − a^n)/(1 − a), with
z = y1 − ωy. At a moment within the round y1 is then α − βn + γa^n, β ≥ 0, which is concave or
falls: once below 0 it stays there, so that halving finds the first round in which a pack is empty.

A load that draws more than it charges ends: the total charge falls by at least the difference each
time, whatever the schedule, and full packs only take less. Others may last for ever. For a pooled
battery that is proved where a smaller load lasts: its state follows its currents monotonically
(each well fills the other), so that it stays above a cycle that charges less, returns to its own
beginning and keeps within the wells. Elsewhere the jobs are followed until the start is forgotten
(FORGOTTEN time constants of the wells) and the lowest level of the packs no longer falls.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import accumulate
from numbers import Integral, Real
from typing import Any, NamedTuple

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, SolverError
from optuav.physics.kibam import Battery, Stage, Wells, step
from optuav.physics.packs import Load, Packs
from optuav.physics.quantity import TINY
from optuav.physics.schedules import SCHEDULES

FORGOTTEN = 20.0
"""Time constants of the wells after which of their start no more than `SAME` is left."""

SAME = 1e-9
"""Share of the capacity by which levels may differ and still count as the same [-]."""

FEWEST_ROUNDS = 64
"""Rounds of the load before its lowest levels are compared."""

SMALLEST_EXPONENT = 1e-9
"""Of a round, k' times its duration, at which rounding leaves the tilt its digits."""

MOST_STRETCHES = 50_000
"""Stretches in which no pack changes its part that are followed one by one; some ten seconds."""

TURNS_AT_ONCE = 1000
"""Turns by the clock that are followed before it is seen how many there have been."""


def lifetime(
    load: Any,
    capacity_As: Any,
    available_fraction: Any,
    flow_rate_per_s: Any,
    packs: Any,
    schedule: Any,
    period_s: Any,
) -> float:
    """Judge the arguments of `optuav.physics.kibam.lifetime`, then follow the load [s]."""
    scalars = {
        "capacity_As": (capacity_As, CAPACITY),
        "available_fraction": (available_fraction, FRACTION),
        "flow_rate_per_s": (flow_rate_per_s, RATE),
        "packs": (packs, COUNT),
    }
    entries = _entries(load)
    faults = list(_load_faults(load, entries))
    faults += [Fault(k, repr(v), r.words) for k, (v, r) in scalars.items() if not r.accepts(v)]
    if schedule not in SCHEDULES:
        faults.append(Fault("schedule", repr(schedule), f"one of {', '.join(SCHEDULES)}"))
    elif schedule != "alternating" and period_s is not None:
        faults.append(Fault("period_s", repr(period_s), "nothing, unless schedule='alternating'"))
    elif schedule == "alternating" and not PERIOD.accepts(period_s):
        faults.append(Fault("period_s", repr(period_s), PERIOD.words))
    if faults:
        raise InputError(faults)
    pack = Battery(*(float(value) for value, _ in list(scalars.values())[:3]))
    jobs = [(float(current), float(duration)) for current, duration in entries]
    return _seconds(Packs(pack, int(packs), schedule, period_s), jobs)


def _entries(load: Any) -> list[Any]:
    try:
        return list(load)
    except TypeError:
        return []


def _load_faults(load: Any, entries: Sequence[Any]) -> Iterator[Fault]:
    if not entries:
        yield Fault("load", repr(load), "pairs (current_A, duration_s), at least one")
    for number, entry in enumerate(entries):
        if np.shape(entry) != (2,):
            yield Fault(f"load[{number}]", repr(entry), "a pair (current_A, duration_s)")
            continue
        for name, value, allowed in zip(PAIR, entry, (CURRENT, DURATION), strict=True):
            if not allowed.accepts(value):
                yield Fault(f"load[{number}].{name}", repr(value), allowed.words)


class _Range(NamedTuple):
    """The numbers that an argument may be."""

    least: float
    most: float
    unit: str
    noun: str = "a number"

    @property
    def words(self) -> str:
        return f"{self.noun}, {self.least:g} <= x <= {self.most:g} [{self.unit}]"

    def accepts(self, value: Any) -> bool:
        kind = Integral if self.noun == "a whole number" else Real
        if not isinstance(value, kind) or isinstance(value, bool):
            return False
        return self.least <= float(value) <= self.most


REPEATING = ("sequential", "round-robin")
"""Schedules under which the same packs carry the same jobs in every round."""

PAIR = ("current_A", "duration_s")
CURRENT = _Range(-1e9, 1e9, "A")
DURATION = _Range(1e-6, 1e9, "s")
PERIOD = _Range(1e-3, 1e9, "s")
CAPACITY = _Range(1e-3, 1e9, "A s")
FRACTION = _Range(1e-6, 0.999999, "-")
RATE = _Range(0.0, 1e3, "1/s")
COUNT = _Range(1, 1000, "-", "a whole number")


def _seconds(packs: Packs, load: Sequence[tuple[float, float]]) -> float:
    """How long full packs carry pairs of current [A], > 0 while discharging, and duration [s]."""
    drawn_As = sum(current * duration for current, duration in load if current > 0.0)
    charged_As = -sum(current * duration for current, duration in load if current < 0.0)
    if not drawn_As:
        return math.inf
    jobs = [Load(max(current, 0.0), max(-current, 0.0), duration) for current, duration in load]
    may_last = charged_As >= drawn_As
    if may_last and packs.count == 1:
        share = drawn_As / charged_As
        if _returns(packs.pack, [(max(c, c * share), t) for c, t in load]):
            return math.inf
    repeats = not charged_As and (packs.count == 1 or packs.schedule in REPEATING)
    return _followed(packs, jobs, may_last=may_last, repeats=repeats)


def _followed(packs: Packs, jobs: list[Load], *, may_last: bool, repeats: bool) -> float:
    """Follow jobs until no pack is left, or until it is clear that this never comes [s]."""
    lowest_As: list[float] = []
    turns, followed = packs.count if repeats else 1, 0
    while True:
        if repeats:
            _skip(packs, jobs)
        lowest_As.append(math.inf)
        for piece in (piece for _ in range(turns) for job in jobs for piece in _pieces(packs, job)):
            followed += len(packs.job([piece]))
            if packs.exhausted[0]:
                return float(packs.clock_s[0])
            if followed > MOST_STRETCHES:
                raise SolverError(_undecided(float(packs.clock_s[0]), may_last=may_last))
            if may_last:
                level_As = float(packs.wells.available_As[packs.in_service].min())
                lowest_As[-1] = min(lowest_As[-1], level_As)
        if may_last and _settled(packs, lowest_As):
            return math.inf


def _pieces(packs: Packs, job: Load) -> Iterator[Load]:
    """A job in pieces of some turns; who carries by the clock does not mind where a job begins."""
    if packs.schedule != "alternating" or packs.count == 1 or not job.draw_A:
        yield job
        return
    assert packs.period_s is not None
    longest_s, left_s = TURNS_AT_ONCE * packs.period_s, job.duration_s
    while left_s > 0.0:
        yield job._replace(duration_s=min(left_s, longest_s))
        left_s -= longest_s


def _undecided(clock_s: float, *, may_last: bool) -> str:
    """What is known where so much was followed to no end."""
    known = (
        "whether they always will is not decided"
        if may_last
        else "it ends, as it draws more than it charges, but when was not found"
    )
    return (
        f"{MOST_STRETCHES} steps tell no lifetime: after {clock_s:.6g} s the packs still carry the "
        f"load; {known}"
    )


def _settled(packs: Packs, lowest_As: Sequence[float]) -> bool:
    """Whether the lowest level [A s] of every round has stopped falling; looks as rounds double."""
    rounds = len(lowest_As)
    if rounds < FEWEST_ROUNDS or rounds & (rounds - 1):
        return False
    memory_s = FORGOTTEN / rate if (rate := float(packs.pack.rate_per_s)) > 0.0 else 0.0
    if packs.clock_s[0] / 2.0 < max(memory_s, 4.0 * packs.count * (packs.period_s or 0.0)):
        return False
    before, now = lowest_As[rounds // 4 : rounds // 2], lowest_As[rounds // 2 :]
    least_As: float = min(before) - SAME * packs.pack.capacity_As
    return min(now) >= least_As


def _skip(packs: Packs, jobs: Sequence[Load]) -> None:
    """Pass all rounds in which no pack is seen empty; every pack in service takes its turn once."""
    phases, carrier = [], packs.carrier
    for job in list(jobs) * int(packs.in_service.sum()):
        if job.draw_A > 0.0:
            carrier = packs.next_carrier(carrier)
        currents_A = -job.draw_A * (np.arange(packs.count) == carrier)
        phases.append(Stage(currents_A, job.duration_s))
    one = _Round(packs.pack, phases)
    start = Wells(*(well[0] for well in packs.wells))
    passed, failed = 0, 1 + int(start.total_As.sum() / -one.total_As[-1].sum())
    while failed - passed > 1:
        middle = (passed + failed) // 2
        levels_As = one.available_As(one.after(start, middle - 1))[:, packs.in_service[0]]
        passed, failed = (middle, failed) if (levels_As >= 0.0).all() else (passed, middle)
    packs.wells = Wells(*(well[None] for well in one.after(start, passed)))
    packs.clock_s = packs.clock_s + passed * one.ends_s[-1]


def _returns(pack: Battery, load: Sequence[tuple[float, float]]) -> bool:
    """Whether a load that charges what it draws has a cycle that keeps within the wells.

    While discharging y1 is least at an end of a job, while charging it is largest there, if the
    other limits hold at its start: so the ends decide. y2 follows y1 and keeps within as y1 does.
    """
    one = _Round(pack, [Stage(-current, duration) for current, duration in load])
    share, top = pack.available_fraction, pack.full
    if 0.0 < one.exponent < SMALLEST_EXPONENT:
        return False
    tilt_As = one.tilt_As[-1] / -math.expm1(-one.exponent) if one.exponent else 0.0
    available_As = one.available_As(Wells(tilt_As, -tilt_As))
    bound_As = one.total_As - available_As
    room_As = min(
        (top.available_As - available_As.max()) / share,
        (top.bound_As - bound_As.max()) / (1.0 - share),
    )
    return bool(
        available_As.min() + share * room_As >= 0.0
        and bound_As.min() + (1.0 - share) * room_As >= 0.0
    )


class _Round:
    """What a round of phases does to wells: an affine map for each of its moments."""

    def __init__(self, pack: Battery, phases: Sequence[Stage]) -> None:
        none = np.zeros_like(np.asarray(phases[0].current_A, dtype=float))
        ends = list(accumulate(phases, partial(step, pack), initial=Wells(none, none)))[1:]
        self.share = pack.available_fraction
        self.total_As = np.array([wells.total_As for wells in ends])
        self.tilt_As = np.array([wells.available_As for wells in ends]) - self.share * self.total_As
        self.ends_s = np.cumsum([phase.duration_s for phase in phases])
        self.decays = np.exp(-pack.rate_per_s * self.ends_s)
        self.exponent = float(pack.rate_per_s * self.ends_s[-1])

    def after(self, wells: Wells, rounds: int) -> Wells:
        """Wells [A s] after some rounds."""
        exponent = max(self.exponent, TINY)
        total = wells.total_As + rounds * self.total_As[-1]
        tilt = (wells.available_As - self.share * wells.total_As) * math.exp(-exponent * rounds)
        tilt = tilt + self.tilt_As[-1] * (math.expm1(-exponent * rounds) / math.expm1(-exponent))
        return Wells(self.share * total + tilt, (1.0 - self.share) * total - tilt)

    def available_As(self, wells: Wells) -> Floats:
        """y1 [A s] at the end of every phase of a round that starts from some wells."""
        tilt = wells.available_As - self.share * wells.total_As
        level = self.share * (wells.total_As + self.total_As)
        found: Floats = level + np.multiply.outer(self.decays, tilt) + self.tilt_As
        return found

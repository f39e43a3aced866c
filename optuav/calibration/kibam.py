"""The kinetic battery model from lifetimes: capacity, ω and k_F.

The model is linear in the current: when the available well runs dry at time T, ωB equals what the
loads have taken out of it, the sum of the responses to every change of the current. So for given ω
and k_F each observation tells the capacity that it would have taken to last as long as it did, and
the right ω and k_F are those that make all of these agree. What is fitted is their logarithms:
batteries of one kind differ in capacity from one discharge to the next by some percent, and that is
the noise assumed. Unlike the lifetime, which jumps over a pause, all of this is smooth.

What varies by chance are the lifetimes, so their likelihood has a factor |d log B/d log T| for each
observation. It is largest where the sum of squares, over the geometric mean of these factors, is
least, as for the transformations of Box and Cox [3]_; without it the fit would prefer batteries
whose capacity hardly matters for how long they last.

References
----------
.. [1] J. F. Manwell, J. G. McGowan, "Lead acid battery storage model for hybrid energy systems",
   Solar Energy, 1993.
.. [2] M. R. Jongerden, B. R. Haverkort, "Which battery model to use?", IET Software, 2009.
.. [3] G. E. P. Box, D. R. Cox, "An analysis of transformations", J. R. Stat. Soc. B, 1964, eq (8).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeAlias

import numpy as np

from optuav.calibration.data import (
    Column,
    Points,
    Table,
    check_record,
    headings_of,
    read,
    together,
)
from optuav.calibration.estimation import NOTHING, Unknown, estimate
from optuav.calibration.fit import Fit, Panel, unclear, values_of
from optuav.errors import Fault, InputError
from optuav.physics.battery import Battery, Phase, Wells, lifetime, step

Asked: TypeAlias = Callable[[float, float], tuple[Points, Points]]

KEYS = ("battery.capacity_As", "battery.available_fraction", "battery.flow_rate_per_s")
LIFETIMES = (
    Column("load", "text"),
    Column("current", "current"),
    Column("duration", "time", needed=False, blanks=True),
    Column("lifetime", "time"),
)
"""Of a file of lifetimes: a line for every piece of a load, the pieces of one load in order."""
RECORD = (Column("time", "time"), Column("current", "current"))
"""Of a record, whose last line is the moment of cut-off."""
LEAST_OBSERVATIONS = 3
LEAST_SAMPLES = 3
SCATTER = 0.02
"""Relative scatter of lifetimes where there are too few to tell."""
MOST_PIECES = 200_000
"""Most pieces of constant current that a load may have until the battery is empty."""
FAR = 0.2
"""Relative miss of a lifetime that scatter does not explain."""
ALIKE = 1e-3
"""Relative difference below which two currents are of one size."""
EARLIER = 1e-6
"""Share of the lifetime for the difference quotient of a sensitivity."""
LEAST_SENSITIVITY = 1e-3
"""Below it the available well would not run dry but fill up."""
SHARES = (0.1, 0.4, 0.8)
RATES = (0.1, 1.0, 10.0)
"""Where the fit starts: ω, and k' times the typical lifetime."""


@dataclass(frozen=True)
class Observation:
    """A load and how long the battery held it.

    Parameters
    ----------
    name
        Of the load or the record.
    pieces
        Current [A], positive while discharging, and duration [s]; repeated until the end.
    lifetime_s
        When the battery was empty [s].
    """

    name: str
    pieces: tuple[tuple[float, float], ...]
    lifetime_s: float

    @property
    def constant(self) -> bool:
        """Whether the current is always the same."""
        return len({current_A for current_A, _ in self.pieces}) == 1

    @property
    def changes(self) -> tuple[Points, Points]:
        """By how much the current changes [A] and how long before the end [s]."""
        currents_A, durations_s = map(np.array, zip(*self.pieces, strict=True))
        rounds = math.ceil(self.lifetime_s / durations_s.sum()) if not self.constant else 1
        starts_s = np.cumsum(np.tile(durations_s, rounds)) - np.tile(durations_s, rounds)
        changes_A = np.diff(np.tile(currents_A, rounds), prepend=0.0)
        counted = (starts_s < self.lifetime_s) & (changes_A != 0.0)
        return changes_A[counted], self.lifetime_s - starts_s[counted]

    @property
    def ends_in_pause(self) -> bool:
        """Whether nothing is drawn just before the end."""
        return float(self.changes[0].sum()) <= 0.0


def fit_kibam(files: Iterable[str | Path]) -> Fit:
    """Fit capacity [A s], ω [-] and k_F [1/s] of a battery to lifetimes.

    Parameters
    ----------
    files
        CSV files. Of lifetimes under constant or repeating loads: columns ``load`` (a name),
        ``current_A``, ``duration_s`` (empty for a constant load), ``lifetime_s``, with a line for
        every piece of a load, in order. Or a record ``time_s,current_A`` of one discharge, from
        full, whose last line is the moment of cut-off. Currents are positive while discharging;
        other units go in the header, as ``current_mA`` or ``lifetime_min``.

    Returns
    -------
    Fit
        With a warning where the data cannot tell the parameters apart.

    Raises
    ------
    InputError
        With every fault of the files, or if there are fewer than three observations.
    """
    paths = [Path(file) for file in files]
    observations = [each for found in together(paths, _observations) for each in found]
    if len(observations) < LEAST_OBSERVATIONS:
        words = (
            f"at least {LEAST_OBSERVATIONS} discharges for as many parameters; "
            f"there are {len(observations)}"
        )
        raise InputError([Fault("", "", words, ", ".join(map(str, paths)))])
    asked = _asked(observations)

    def residuals(values: Points) -> Points:
        capacity_As, share, rate = values
        capacities_As, sensitivities = asked(share, rate)
        usual = np.exp(np.mean(np.log(sensitivities)))
        left: Points = np.log(capacities_As / capacity_As) / usual
        return left

    unknowns = (Unknown(KEYS[0]), Unknown(KEYS[1], "share"), Unknown(KEYS[2]))
    few = len(observations) == LEAST_OBSERVATIONS
    found = estimate(
        unknowns, residuals, _starts(observations, asked), spread=SCATTER if few else None
    )
    values = values_of(found, KEYS, f"fitted to {len(observations)} discharges")
    capacity_As, share, rate = (each.value for each in values)
    fitted_s = tuple(
        lifetime(
            each.pieces, capacity_As=capacity_As, available_fraction=share, flow_rate_per_s=rate
        )
        for each in observations
    )
    warnings = [
        *unclear(found),
        *_why_unclear(observations, bool(found.undetermined)),
        *_misses(observations, fitted_s),
    ]
    if few:
        warnings.append(
            f"{LEAST_OBSERVATIONS} discharges for as many parameters leave nothing over: the "
            f"intervals take lifetimes to scatter by {SCATTER:.0%}"
        )
    return Fit(
        kind="kibam",
        sources=tuple(map(str, paths)),
        data=f"{len(observations)} discharges of a full battery",
        values=values,
        panels=(
            Panel(
                "lifetime",
                "s",
                tuple(each.lifetime_s for each in observations),
                fitted_s,
                names=tuple(each.name for each in observations),
            ),
        ),
        warnings=tuple(warnings),
    )


def _asked(observations: Sequence[Observation]) -> Asked:
    """What each lifetime asks for at given ω and k_F [1/s].

    That is the capacity [A s], and by how much it grows with the lifetime, d log B/d log T.
    """
    changes = [each.changes for each in observations]
    first = np.cumsum([0, *(len(sizes) for sizes, _ in changes[:-1])])
    changes_A = np.concatenate([sizes for sizes, _ in changes])
    before_end_s = np.concatenate([times for _, times in changes])
    lifetimes_s = np.array([each.lifetime_s for each in observations])
    earlier_s = np.repeat(EARLIER * lifetimes_s, [len(sizes) for sizes, _ in changes])

    def taken(battery: Battery, times_s: Points) -> Points:
        unit = step(battery, Wells(0.0, 0.0), Phase(1.0, times_s)).available_As
        charge_As: Points = np.add.reduceat(changes_A * unit, first)
        return np.maximum(charge_As, NOTHING)

    def asked(share: float, rate_per_s: float) -> tuple[Points, Points]:
        battery = Battery(1.0, share, rate_per_s)
        now, before = taken(battery, before_end_s), taken(battery, before_end_s - earlier_s)
        return now / share, np.maximum((1.0 - before / now) / EARLIER, LEAST_SENSITIVITY)

    return asked


def _starts(
    observations: Sequence[Observation], asked: Asked
) -> Iterator[tuple[float, float, float]]:
    """Values to start from, on a grid of ω and of k'; the capacity follows."""
    typical_s = float(np.median([each.lifetime_s for each in observations]))
    for share in SHARES:
        for rate in RATES:
            flow_rate_per_s = rate / typical_s * share * (1.0 - share)
            capacities_As, _ = asked(share, flow_rate_per_s)
            yield float(np.exp(np.mean(np.log(capacities_As)))), share, flow_rate_per_s


def _why_unclear(observations: Sequence[Observation], unclear_: bool) -> Iterator[str]:
    for each in observations:
        if each.ends_in_pause:
            yield (
                f"{each.name} is told to end in a pause, where a battery cannot run dry: "
                "its lifetime may be wrong"
            )
    if not unclear_:
        return
    sizes = {each.pieces[0][0] for each in observations}
    if all(each.constant for each in observations):
        one = max(sizes) - min(sizes) <= ALIKE * max(sizes)
        yield (
            "all loads are constant and of one size, which says how much charge the battery gives "
            "at that current and nothing else; "
            if one
            else "all loads are constant; "
        ) + "add loads of other sizes, from very small to very large, and with pauses"
    else:
        yield "add loads of other sizes, constant ones and ones with long and short pauses"


def _misses(observations: Sequence[Observation], fitted_s: Sequence[float]) -> Iterator[str]:
    pairs = zip(observations, fitted_s, strict=True)
    far = [each.name for each, own_s in pairs if abs(own_s / each.lifetime_s - 1.0) > FAR]
    if far:
        yield (
            f"no kinetic battery lasts like that: the fit misses {', '.join(far)} by more than "
            f"{FAR:.0%}; look at units, and whether it was one full battery each time"
        )


def _observations(path: Path) -> list[Observation]:
    """What a file holds: lifetimes if it says so, otherwise a record."""
    if any(each.partition("_")[0] in ("load", "lifetime") for each in headings_of(path)):
        return _lifetimes(read(path, LIFETIMES))
    return [_record(path, read(path, RECORD, LEAST_SAMPLES))]


def _lifetimes(table: Table) -> list[Observation]:
    rows: dict[str, list[int]] = {}
    for row, name in enumerate(table.texts["load"]):
        rows.setdefault(name, []).append(row)
    current_A, lifetime_s = table.numbers["current"], table.numbers["lifetime"]
    duration_s = table.numbers.get("duration", np.full(len(current_A), math.nan))
    faults, found = list[Fault](), list[Observation]()
    for name, own in rows.items():
        faults += _faults_of_load(table, own)
        pieces = [(float(current_A[row]), float(duration_s[row])) for row in own]
        if len(own) == 1:
            pieces = [(pieces[0][0], float(lifetime_s[own[0]]))]
        found.append(Observation(name, tuple(pieces), float(lifetime_s[own[0]])))
    if faults:
        raise InputError(faults)
    return found


def _faults_of_load(table: Table, rows: Sequence[int]) -> Iterator[Fault]:
    current_A, lifetime_s = table.numbers["current"], table.numbers["lifetime"]
    duration_s = table.numbers.get("duration", np.full(len(current_A), math.nan))
    name = table.texts["load"][rows[0]]
    for row in rows:
        if not lifetime_s[row] > 0.0:
            yield table.fault(row, "lifetime", float(lifetime_s[row]), "a time above 0")
        if lifetime_s[row] != lifetime_s[rows[0]]:
            words = f"one lifetime for all pieces of {name}; a second discharge gets a second name"
            yield table.fault(row, "lifetime", float(lifetime_s[row]), words)
        if len(rows) > 1 and not duration_s[row] > 0.0:
            words = f"a time above 0, as {name} has several pieces"
            value = "an empty cell" if math.isnan(duration_s[row]) else f"{duration_s[row]:g}"
            yield table.fault(row, "duration", value, words)
    if not max(current_A[row] for row in rows) > 0.0:
        words = f"some current above 0 in {name}: positive is discharge"
        yield table.fault(rows[0], "current", float(current_A[rows[0]]), words)
    if len(rows) > 1 and all(duration_s[row] > 0.0 for row in rows):
        pieces = lifetime_s[rows[0]] / sum(duration_s[row] for row in rows) * len(rows)
        if pieces > MOST_PIECES:
            words = f"at most {MOST_PIECES} pieces of {name} until the battery is empty"
            yield table.fault(rows[0], "duration", float(duration_s[rows[0]]), words)


def _record(path: Path, table: Table) -> Observation:
    check_record(table)
    time_s, current_A = table.numbers["time"], table.numbers["current"]
    if not np.max(current_A[:-1]) > 0.0:
        words = "some current above 0: positive is discharge"
        raise InputError([table.fault(0, "current", float(current_A[0]), words)])
    pieces = zip(current_A[:-1].tolist(), np.diff(time_s).tolist(), strict=True)
    return Observation(path.stem, tuple(pieces), float(time_s[-1] - time_s[0]))

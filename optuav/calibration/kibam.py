"""Capacity, ω and k_F of the kinetic battery model (KiBaM) from lifetimes.

The model is linear in the current: when the available well is empty at time T, ωB equals the sum of
the responses to every change of the current until then. So for given ω and k_F each discharge has
a capacity with which the battery lasts exactly as long, and the right ω and k_F make all of these
agree. The fit is to their logarithms, as the noise assumed is that of the capacity from one
discharge to the next; unlike the lifetime, which jumps over a pause, they are smooth.

What varies by chance are the lifetimes, so their likelihood has a factor |d log B/d log T| for each
discharge. It is largest where the sum of squares, over the geometric mean of these factors, is
least, as for the transformations of Box and Cox [1]_; without it the fit would prefer batteries
whose capacity hardly matters for how long they last.

References
----------
.. [1] G. E. P. Box, D. R. Cox, "An analysis of transformations", J. R. Stat. Soc. B, 1964, eq (8).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv
from optuav.calibration.fit import NOTHING, Fit, Panel, estimate, finished
from optuav.errors import Fault, InputError
from optuav.physics.kibam import Battery, levelling
from optuav.physics.packs import lifetime

Implied: TypeAlias = Callable[[float, float], tuple[Floats, Floats]]

KEYS = ("battery.capacity_As", "battery.available_fraction", "battery.flow_rate_per_s")
LIFETIMES = csv.Format(
    {"load": "text", "current": "current", "duration": "time", "lifetime": "time"},
    optional=("duration",),
    blanks=("duration",),
)
"""A line for every piece of a load, the pieces of one load in order."""
RECORD = csv.Format({"time": "time", "current": "current"}, least=3)
"""The record of one discharge, which ends at the moment of cut-off."""
MOST_PIECES = 200_000  # most pieces of constant current of a load until the battery is empty
LEAST_DISCHARGES = 3
LIFETIME = (60.0, 1e6, "s")  # of a battery that flies a UAV
SCATTER = 0.02  # relative scatter of lifetimes where there are too few to show it
FAR = 0.2  # relative miss of a lifetime beyond which no value is stated
JUMP = 0.1  # relative change of the capacity that may be scatter, for a jump over a pause
ADVICE = "add loads of other sizes, from very small to very large, and with long and short pauses"
LEAST_SENSITIVITY = 1e-3  # below it the available well would not run dry but fill up


class Discharge(NamedTuple):
    """A load, and the lifetime of a full battery under it.

    Pieces are pairs of current [A], positive while discharging, and duration [s], repeated until
    the end.
    """

    name: str
    pieces: tuple[tuple[float, float], ...]
    lifetime_s: float

    @property
    def changes(self) -> tuple[Floats, Floats]:
        """By how much the current changes [A] and how long before the end [s]."""
        currents_A, durations_s = map(np.array, zip(*self.pieces, strict=True))
        rounds = math.ceil(self.lifetime_s / durations_s.sum()) if len(set(currents_A)) > 1 else 1
        starts_s = np.cumsum(np.tile(durations_s, rounds)) - np.tile(durations_s, rounds)
        changes_A = np.diff(np.tile(currents_A, rounds), prepend=0.0)
        counted = (starts_s < self.lifetime_s) & (changes_A != 0.0)
        return changes_A[counted], self.lifetime_s - starts_s[counted]


def fit_kibam(files: Iterable[str | Path]) -> Fit:
    r"""Fit capacity [A s], ω [-] and k_F [1/s] of a battery to lifetimes.

    Parameters
    ----------
    files
        CSV files, the loads those of one pack, as the capacity of a mission is. Of lifetimes under
        constant or repeating loads: columns ``load`` (a name), ``current_A``, ``duration_s``
        (empty for a constant load), ``lifetime_s``, with a line for every piece of a load, in
        order. Or a record ``time_s,current_A`` of one discharge, from full, whose last line is the
        moment of cut-off. Currents are positive while discharging; other units go in the header,
        as ``current_mA`` or ``lifetime_min``.

    Returns
    -------
    Fit
        With a warning, and without values, where the data cannot tell the parameters apart or the
        best fit misses a lifetime by more than a fifth, jumps over a pause aside.

    Raises
    ------
    InputError
        With every fault of the files, or if there are fewer than three discharges.

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> loads = "load,current_A,lifetime_s\na,0.25,729.6\nb,0.5,271.8\nc,0.1,2279.5\n"
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "cell.csv"
    ...     _ = file.write_text(loads)
    ...     optuav.fit_kibam([file]).data
    '3 discharges of one full pack'
    """
    sources = tuple(map(str, files))
    discharges = [each for found in csv.read_all(sources, _discharges) for each in found]
    count, few = len(discharges), len(discharges) == LEAST_DISCHARGES
    if count < LEAST_DISCHARGES:
        words = f"at least {LEAST_DISCHARGES} discharges for as many parameters; there are {count}"
        raise InputError([Fault("", "", words, ", ".join(sources))])
    lifetimes_s = np.array([each.lifetime_s for each in discharges])
    implied = _implied(discharges)

    def residuals(values: Floats) -> Floats:
        capacity_As, share, rate = values
        capacities_As, sensitivities = implied(share, rate)
        usual = np.exp(np.mean(np.log(sensitivities)))
        left: Floats = np.log(capacities_As / capacity_As) / usual
        return left

    def simulated(values: Floats) -> Floats:
        battery = dict(zip((key.partition(".")[2] for key in KEYS), values.tolist(), strict=True))
        return np.array([lifetime(each.pieces, **battery) for each in discharges])

    found = estimate(
        KEYS,
        residuals,
        _starts(lifetimes_s, implied),
        shares=KEYS[1:2],
        spread=SCATTER if few else None,
        # A battery may also last as long by the formula but run dry in an earlier piece.
        miss=lambda values: float(np.max(np.abs(simulated(values) / lifetimes_s - 1.0))),
    )
    values = found.stated(f"fitted to {count} discharges of one pack")
    warnings = [*found.warnings, ADVICE] if found.undetermined else []
    # A lifetime jumps over a whole pause where the capacity is a little less.
    less, more = (simulated(found.values * (1.0 + by, 1.0, 1.0)) for by in (-JUMP, JUMP))
    far = np.abs(np.clip(lifetimes_s, less, more) / lifetimes_s - 1.0) > FAR
    if np.any(far):
        # Such data have several poor optima, and rounding decides in which one the fit ends.
        values = tuple(replace(each, interval=None, determined=False) for each in values)
        missed = ", ".join(each.name for each in itertools.compress(discharges, far))
        warnings = [
            "no kinetic battery lasts like that, so no value is stated: the fit misses "
            f"{missed} by more than {FAR:.0%}; look at units, and whether it was one full battery "
            "each time"
        ]
    warnings += [
        f"{each.name} is stated to end in a pause, where a battery cannot run dry: its lifetime "
        "may be wrong"
        for each in discharges
        if float(each.changes[0].sum()) <= 0.0
    ]
    largest_A = max(current_A for each in discharges for current_A, _ in each.pieces)
    shortest_s = float(lifetimes_s.min())
    warnings += csv.unit_doubts("the largest current", largest_A, "current", "current")
    warnings += csv.unit_doubts("the shortest lifetime", shortest_s, "lifetime", "time", LIFETIME)
    if few:
        warnings.append(
            f"{LEAST_DISCHARGES} discharges for as many parameters leave nothing over: the "
            f"intervals take lifetimes to scatter by {SCATTER:.0%}"
        )
    names, fitted = [each.name for each in discharges], simulated(found.values).tolist()
    panel = Panel("lifetime", "s", lifetimes_s.tolist(), fitted, names)
    data = f"{count} discharges of one full pack"
    return finished(Fit("kibam", sources, data, values, (panel,), tuple(warnings)))


def _implied(discharges: Sequence[Discharge]) -> Implied:
    """The capacity [A s] that each lifetime implies at ω [-] and k_F [1/s], and d log B/d log T."""
    changes = [each.changes for each in discharges]
    first = np.cumsum([0, *(len(sizes) for sizes, _ in changes[:-1])])
    changes_A = np.concatenate([sizes for sizes, _ in changes])
    before_end_s = np.concatenate([times for _, times in changes])
    lifetimes_s = np.array([each.lifetime_s for each in discharges])

    def implied(share: float, rate_per_s: float) -> tuple[Floats, Floats]:
        # y1 after a unit current of t is ω t + (1 − ω)(1 − exp(−k't))/k'.
        remaining, integral_s = levelling(Battery(1.0, share, rate_per_s), before_end_s)
        response_s = share * before_end_s + (1.0 - share) * integral_s
        slope = share + (1.0 - share) * remaining
        taken_As = np.maximum(np.add.reduceat(changes_A * response_s, first), NOTHING)
        sensitivities = np.add.reduceat(changes_A * slope, first) * lifetimes_s / taken_As
        return taken_As / share, np.maximum(sensitivities, LEAST_SENSITIVITY)

    return implied


def _starts(lifetimes_s: Floats, implied: Implied) -> Iterator[tuple[float, float, float]]:
    """Values from which to start: the capacity follows from ω and k'."""
    for share, rate in itertools.product((0.1, 0.4, 0.8), (0.1, 1.0, 10.0)):
        flow_rate_per_s = rate / float(np.median(lifetimes_s)) * share * (1.0 - share)
        capacities_As, _ = implied(share, flow_rate_per_s)
        yield float(np.exp(np.mean(np.log(capacities_As)))), share, flow_rate_per_s


def _discharges(file: csv.Source) -> list[Discharge]:
    """The discharges in a file of lifetimes, or in a record."""
    table = csv.read(file, LIFETIMES, RECORD)
    if "time" in table.numbers:  # a record, each current of which holds until the next line
        if wrong := [*csv.record_faults(table)]:
            raise InputError(wrong)
        time_s, held_A = table.numbers["time"], table.numbers["current"][:-1].tolist()
        record = tuple(zip(held_A, np.diff(time_s).tolist(), strict=True))
        return [Discharge(Path(file.name).stem, record, float(time_s[-1] - time_s[0]))]
    names = np.array(table.texts["load"])
    current_A, lifetime_s = table.numbers["current"], table.numbers["lifetime"]
    duration_s = table.numbers["duration"]
    faults, found = list[Fault](), list[Discharge]()
    for name in dict.fromkeys(table.texts["load"]):
        own = names == name
        several = np.sum(own) > 1
        lasts_s = float(lifetime_s[own][0])
        faults += table.faults(own & ~(lifetime_s > 0.0), "lifetime", "a time above 0")
        words = f"one lifetime for all pieces of {name}; a second discharge gets a second name"
        faults += table.faults(own & (lifetime_s != lasts_s), "lifetime", words)
        if not np.any(current_A[own] > 0.0):
            words = f"some current above 0 in {name}: positive is discharge"
            faults += table.faults(own, "current", words)
        timeless = own & ~(duration_s > 0.0) & several
        words = f"a time above 0, as {name} has several pieces"
        faults += table.faults(timeless, "duration", words)
        if several and not np.any(timeless):
            rounds = lasts_s / float(np.sum(duration_s[own]))
            words = f"at most {MOST_PIECES} pieces of {name} until the battery is empty"
            many = own & (rounds * np.sum(own) > MOST_PIECES)
            faults += table.faults(many, "duration", words)
        durations_s = duration_s[own] if several else lifetime_s[own]
        pieces = tuple(zip(current_A[own].tolist(), durations_s.tolist(), strict=True))
        found.append(Discharge(name, pieces, lasts_s))
    if faults:
        raise InputError(faults)
    return found

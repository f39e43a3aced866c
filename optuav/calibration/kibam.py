"""Capacity, ω and k_F of the kinetic battery model (KiBaM) from lifetimes.

The model is linear in the current: when the available well is empty at time T, ωB equals the
sum of the responses to every change of the current until then. So for given ω and k_F each
discharge has a capacity that makes the battery last exactly as long, and the right ω and k_F make
all of these agree. The fit is to their logarithms, as the noise is assumed in the capacity
from one discharge to the next; unlike the lifetime, which jumps over a pause, they are smooth.

What varies by chance are the lifetimes, so their likelihood has a factor |d log B/d log T| for each
discharge. It is largest where the sum of squares, over the geometric mean of these factors, is
least, as for the transformations of Box and Cox [1]_; without it the fit would prefer batteries
whose capacity hardly matters for how long they last.

Intervals come from the profile likelihood: all values of a parameter such that some battery has a
sum of squares up to 1 + t²/(n − 3) times the least, with t by Student.

Constant loads hardly tell ω and k' apart, but their lag L = (1−ω)/(ωk'): once the wells have
settled, a current I lasts B/I − L. With such data, 30 s of settling are assumed: published models
of lithium cells take 19 to 47 s.

References
----------
.. [1] G. E. P. Box, D. R. Cox, "An analysis of transformations", J. R. Stat. Soc. B, 1964, eq (8).
"""

import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from optuav.arrays import Booleans, Floats
from optuav.calibration import csv, fit
from optuav.calibration.fit import (
    ConfidenceInterval,
    Estimate,
    Fit,
    Panel,
    Value,
    finished,
    quantile,
)
from optuav.calibration.logs import measurements
from optuav.calibration.logs.flight_log import FlightLog
from optuav.calibration.logs.read import flight_log_in
from optuav.errors import Fault, InputError, refuse
from optuav.physics.kibam import Battery, levelling
from optuav.physics.packs import lifetime
from optuav.presentation.numbers import figure, percent

KEYS = ("battery.capacity_As", "battery.available_fraction", "battery.flow_rate_per_s")
LIFETIMES = {"load": "text", "current": "current", "duration": "time", "lifetime": "time"}
FORMATS = (
    # A line for every piece of a load, the pieces of one load in order.
    csv.Format(LIFETIMES, optional=("duration",), blanks=("duration",)),
    # The record of one discharge, which ends at the moment of cut-off.
    csv.Format({"time": "time", "current": "current"}, least=3),
)
MOST_PIECES = 200_000  # most pieces of constant current of a load until the battery is empty
ONGOING_S = 1e9  # for how long the last current of a record goes on, if the battery lasts longer
LEAST_DISCHARGES = 3
LIFETIME = (60.0, 1e6, "s")  # of a battery that flies a UAV
SCATTER = 0.02  # relative scatter of lifetimes where there are too few to show it
HIDDEN_SCATTER = 0.03  # relative scatter of lifetimes that a few of them may hide by chance
CHANCE = 5.0  # how many times smaller theirs may then be
FAR = 0.2  # relative miss of a lifetime beyond which no value is stated
SETTLING_S = 30.0  # 1/k' of wells whose lag is known and whose rate is not
PLATEAU = 1.01  # sum of squares, over the least, that is as good
LAG_KNOWN, RATE_UNKNOWN = 4.0, 10.0  # factors between the ends of an interval, at most and at least
MARGIN = 0.01  # share of the capacity that is taken off so that no lifetime is longer
DIRECTIONS = np.array([*itertools.product((-1.0, 0.0, 1.0), repeat=3)])
"""Directions of log B, logit ω and log L in which the edge of a region is looked for."""
JUMP = 0.1  # relative change of the capacity that may be scatter, for a jump over a pause
NO_RATE = "not how fast it builds up{}: a load with pauses of 30 to 120 s would"
ASSUMED = f" (1/k' = {figure(SETTLING_S)} s is assumed)"
NOTHING = "nothing is determined: a mission keeps its own battery"
ADVICE = "add loads of other sizes, from very small to very large, and with long and short pauses"
LEAST_SENSITIVITY = 1e-6  # sensitivity at the least ω; below it the available well would fill up

CLEAR = 0.99  # confidence of an interval that must end for the data to tell its value apart
LOGIT = math.log(999.0)  # range of the logit of ω: 0.1 % to 99.9 %
SLOWEST, FASTEST = 1e-4, 1e2  # k' times the longest, the shortest lifetime: all beyond is alike
ROWS, FINER, ZOOMS = 161, 33, 8  # places of the first grid and of each finer one, and of these
INTERVAL_HALVINGS = 30  # halvings to the end of an interval
ROUNDED_SUM = 1e-24  # sum of squares that may come from rounding
DENSE_AT_ENDS = 0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, 65))  # places between two ends


class Discharge(NamedTuple):
    """A load, and the lifetime of a full battery under it.

    Pieces of current [A], positive while discharging, and duration [s]. They are repeated until the
    end; of a record, the last current that is drawn goes on.
    """

    name: str
    pieces: tuple[tuple[float, float], ...]
    lifetime_s: float
    recorded: bool = False

    @property
    def load(self) -> tuple[tuple[float, float], ...]:
        """Pieces that, repeated, go on as the discharge would if the battery lasted longer."""
        if not self.recorded:
            return self.pieces
        last_A = next(current_A for current_A, _ in reversed(self.pieces) if current_A > 0.0)
        return (*self.pieces, (last_A, ONGOING_S))

    @property
    def changes(self) -> tuple[Floats, Floats]:
        """Changes of the current [A] and how long before the end each happens [s]."""
        currents_A, durations_s = map(np.array, zip(*self.pieces, strict=True))
        repeats = len(set(currents_A)) > 1 and not self.recorded
        rounds = math.ceil(self.lifetime_s / durations_s.sum()) if repeats else 1
        starts_s = np.cumsum(np.tile(durations_s, rounds)) - np.tile(durations_s, rounds)
        changes_A = np.diff(np.tile(currents_A, rounds), prepend=0.0)
        counted = (starts_s < self.lifetime_s) & (changes_A != 0.0)
        return changes_A[counted], self.lifetime_s - starts_s[counted]

    @property
    def drawn_As(self) -> float:
        """Charge drawn until the end [A s]."""
        changes_A, before_end_s = self.changes
        return float(changes_A @ before_end_s)


class BatteryRegion(NamedTuple):
    """Least and largest values over all batteries up to a sum of squares, in logarithms.

    The logit takes the place of the logarithm of ω.
    """

    values: tuple[Floats, Floats]  # of B, ω and k_F
    lag: tuple[float, float]
    rate: tuple[float, float]
    edge: Floats  # batteries outermost in some direction (battery, [log B, logit ω, log k_F])


class FittedWells(NamedTuple):
    """The wells that fit."""

    estimate: Estimate
    lag: Value
    settled: bool  # Whether they take the assumed rate, as the data tell their lag only
    edge: tuple[dict[str, float], ...]  # Batteries at the edge of the 95 % region


def fit_kibam(
    files: str | Path | Iterable[str | Path],
    *,
    never_longer: bool = False,
    columns: Mapping[str, str] | None = None,
) -> Fit:
    r"""Fit capacity [A s], ω [-] and k_F [1/s] of a battery to lifetimes.

    The battery is the kinetic one, dy1/dt = I + k_F (y2/(1−ω) − y1/ω) and dy2/dt = −k_F (y2/(1−ω) −
    y1/ω) with I > 0 while charging, from y1 = ωB and y2 = (1−ω)B until y1 = 0 [1]_. Intervals are
    from the profile likelihood [2]_.

    Parameters
    ----------
    files
        CSV files with the loads of one pack, to which the capacity of a mission also refers. For
        lifetimes under constant or repeating loads: columns ``load`` (a name), ``current_A``,
        ``duration_s`` (empty for a constant load), ``lifetime_s``, with a line for every piece of a
        load, in order. Or a record ``time_s,current_A`` of one discharge, from full, whose last
        line is the moment of cut-off. Currents are positive while discharging; other units go in
        the header, as ``current_mA`` or ``lifetime_min``. Or logs of PX4 (``.ulg``), ArduPilot
        (``.bin``), AirData or DJI (CSV), each of one discharge from full to cut-off.
    never_longer
        Whether to scale the capacity down until no fitted lifetime is longer than measured, and by
        another 1 %, for plans that will be flown. Wells whose rate is unknown then settle in 30 s.
    columns
        For a CSV of another program: the column that each of its headings stands for, such as
        ``{"Amps": "current_A"}``.

    Returns
    -------
    Fit
        The fit, with the lag, `Fit.lag`, and a warning if the data hardly distinguish the
        parameters. It has no values if the data determine neither them nor the lag, or if the best
        fit misses a lifetime by more than a fifth and no jump over a pause explains it. Constant
        loads determine only the lag: if 1/k' = 30 s fits as well, the fit uses it.

    Raises
    ------
    InputError
        With every fault of the files, or if there are fewer than three discharges.

    References
    ----------
    .. [1] J. F. Manwell, J. G. McGowan, "Lead acid battery storage model for hybrid energy
       systems", Solar Energy, 1993.
    .. [2] D. M. Bates, D. G. Watts, "Nonlinear Regression Analysis and Its Applications", Wiley,
       1988, chapter 6.

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
    flown = list[FlightLog]()

    def read_log(path: Path) -> tuple[list[Discharge], list[str]] | None:
        if log := flight_log_in(path, columns or {}):
            record, log = measurements.discharge(log)
            flown.append(log)
            discharges, doubts = _record(record)
            return discharges, [*log.warnings, *doubts]
        return None

    sources, of_files = csv.read_all(files, FORMATS, _discharges, read_log)
    discharges = [discharge for of_file, _ in of_files for discharge in of_file]
    doubts = [words for _, of_file in of_files for words in of_file]
    count = len(discharges)
    if count < LEAST_DISCHARGES:
        words = f"must have at least {LEAST_DISCHARGES} discharges; there are {count}"
        raise InputError([Fault("", "", words, ", ".join(sources))])
    lifetimes_s = np.array([discharge.lifetime_s for discharge in discharges])

    def simulated(values: Floats, factor: float = 1.0) -> Floats:
        return _simulated_lifetimes_s(discharges, values, factor)

    def miss(values: Floats) -> float:
        return float(np.max(np.abs(simulated(values) / lifetimes_s - 1.0)))

    # A battery may also last as long by the formula but run dry in an earlier piece.
    scatter = SCATTER if count == LEAST_DISCHARGES else None
    wells = _wells(discharges, scatter, miss, never_longer=never_longer)
    best, lag, edge, factor = wells.estimate.values, wells.lag, wells.edge, 1.0
    data = f"{count} discharges of one full pack"
    fitted, warnings = _values_and_warnings(wells, count)
    # A lifetime jumps over a whole pause where the capacity is a little less.
    less, more = (simulated(best, 1.0 + by) for by in (-JUMP, JUMP))
    far = np.abs(np.clip(lifetimes_s, less, more) / lifetimes_s - 1.0) > FAR
    if np.any(far):
        # Such data have several poor optima, and rounding decides where the fit ends.
        *fitted, lag = (
            replace(value, interval=None, determined=False, stated=False)
            for value in (*fitted, lag)
        )
        edge = ()
        missed = ", ".join(discharge.name for discharge in itertools.compress(discharges, far))
        warnings = [
            "no kinetic battery lasts like that, so optuav returns no value: the fit misses "
            f"{missed} by more than {percent(FAR)}; look at units, and whether it was one full "
            "battery each time"
        ]
    elif never_longer and fitted[0].stated:
        factor = (1.0 - MARGIN) * _largest_factor(
            lambda factor: bool(np.all(simulated(best, factor) <= lifetimes_s))
        )
        words = f"never longer than measured, less {percent(MARGIN)}"
        data = f"{data}, {words}"
        fitted[0], edge = _scaled(fitted[0], edge, factor, words)
    warnings += [*doubts, *_doubts_about(discharges)]
    names = [discharge.name for discharge in discharges]
    lasts_s = simulated(best, factor).tolist()
    panel = Panel("lifetime", "s", lifetimes_s.tolist(), lasts_s, names)
    values, said = tuple(fitted), tuple(warnings)
    notes = tuple(words for log in flown for words in (f"{log.source}: {log.format}", *log.notes))
    result = Fit("kibam", sources, data, values, (panel,), said, lag=lag, edge=edge)
    return finished(replace(result, notes=notes, logs=tuple(flown)))


def _simulated_lifetimes_s(
    discharges: Sequence[Discharge], values: Floats, factor: float
) -> Floats:
    """Lifetimes [s] under each load, of a battery with values of `KEYS` and capacity by a factor.

    They are those of a battery of 1 A s, as they depend only on current over capacity.
    """
    capacity_As, share, rate = values.tolist()
    battery = {"capacity_As": 1.0, "available_fraction": share, "flow_rate_per_s": rate}
    unit_As, loads = capacity_As * factor, (discharge.load for discharge in discharges)
    shares = ([(current_A / unit_As, lasts_s) for current_A, lasts_s in load] for load in loads)
    return np.array([lifetime(load, **battery) for load in shares])


def _values_and_warnings(wells: FittedWells, count: int) -> tuple[list[Value], list[str]]:
    """Values for a mission from a number of discharges, and what these leave open."""
    estimated, lag = wells.estimate, wells.lag
    origin = f"fitted to {count} discharges of one pack"
    fitted = [*estimated.values_for_mission(origin, always=lag.determined)]
    if wells.settled:
        origin = f"lag {figure(lag.value, 3)} s; settling {figure(SETTLING_S)} s assumed"
        fitted[1:] = (replace(value, origin=origin) for value in fitted[1:])
    warnings = [*estimated.warnings, ADVICE] if estimated.unsure else []
    if lag.determined and (estimated.undetermined or estimated.unsure or wells.settled):
        ends = " – ".join(figure(end, 3) for end in lag.interval or ())
        no_rate = NO_RATE.format(ASSUMED if wells.settled else "")
        warnings = [f"the data determine the lag, {figure(lag.value, 3)} s ({ends}), and {no_rate}"]
    if not fitted[0].stated:
        warnings.append(NOTHING)
    return fitted, warnings


def _scaled(
    capacity: Value, edge: Sequence[dict[str, float]], factor: float, words: str
) -> tuple[Value, tuple[dict[str, float], ...]]:
    """A capacity by a factor, with words on it, and batteries at the edge by the same factor."""
    batteries = tuple({**battery, KEYS[0]: battery[KEYS[0]] * factor} for battery in edge)
    size_As, origin = capacity.value * factor, f"{capacity.origin}, {words}"
    return replace(capacity, value=size_As, origin=origin, interval=None), batteries


def _doubts_about(discharges: Sequence[Discharge]) -> Iterator[str]:
    """Yield doubts about ends in a pause, units, and too few discharges."""
    pause = "ends in a pause, in which a battery cannot run dry: its lifetime may be wrong"
    idle = (discharge for discharge in discharges if float(discharge.changes[0].sum()) <= 0.0)
    yield from (f"{discharge.name} {pause}" for discharge in idle)
    largest_A = max(current_A for discharge in discharges for current_A, _ in discharge.pieces)
    shortest_s = float(min(discharge.lifetime_s for discharge in discharges))
    yield from csv.unit_doubts("the largest current", largest_A, "current", "current")
    yield from csv.unit_doubts("the shortest lifetime", shortest_s, "lifetime", "time", LIFETIME)
    if len(discharges) == LEAST_DISCHARGES:
        yield (
            f"{LEAST_DISCHARGES} discharges for as many parameters leave nothing over: the "
            f"intervals take lifetimes to scatter by {percent(SCATTER)}"
        )


class SumOfSquares:
    """The sum of squares, least over the capacity, by log k' (rows) and logit ω (columns).

    With ϱ = (1 − ω)/ω a discharge implies B = Q + ϱ q, where Q is the charge drawn and q, the
    lag of the available well, depends only on k'. So a row costs one pass over the currents.
    """

    def __init__(self, discharges: Sequence[Discharge]) -> None:
        changes = [discharge.changes for discharge in discharges]
        self._first = np.cumsum([0, *(len(sizes) for sizes, _ in changes[:-1])])
        self._changes_A, self._before_end_s = map(np.concatenate, zip(*changes, strict=True))
        self._lifetimes_s = np.array([discharge.lifetime_s for discharge in discharges])
        self._drawn_As, self._end_A = self._sums(self._before_end_s), self._sums(1.0)
        slowest, fastest = SLOWEST / self._lifetimes_s.max(), FASTEST / self._lifetimes_s.min()
        self._rates = np.linspace(math.log(slowest), math.log(fastest), ROWS)
        self._step, self._ends = self._rates[1] - self._rates[0], self._rates[[0, -1]]
        self._least = self.valley(self._rates)[1]

    def _sums(self, weights: Floats | float) -> Floats:
        """Sums over the changes of the current, one per discharge."""
        sums: Floats = np.add.reduceat(self._changes_A * weights, self._first)
        return sums

    def implied(self, rows: Floats, logits: Floats) -> tuple[Floats, Floats]:
        """log B by each lifetime (last axis), and the geometric mean of d log B/d log T."""
        lag_As, lag_A = np.exp(-logits)[..., None] * rows
        taken_As = np.maximum(self._drawn_As + lag_As, fit.NOTHING)
        slopes = (self._end_A + lag_A) * self._lifetimes_s / taken_As
        usual = np.exp(np.mean(np.log(np.maximum(slopes, LEAST_SENSITIVITY)), axis=-1))
        return np.log(taken_As), usual

    def squares(self, rows: Floats, logits: Floats) -> Floats:
        """The sum of squares."""
        capacities, usual = self.implied(rows, logits)
        sums: Floats = np.var(capacities, axis=-1) * capacities.shape[-1] / usual**2
        return sums

    def valley(self, rates: Floats) -> tuple[Floats, Floats, Floats]:
        """Minimise the sum along each row: the minimiser, that sum, and the rows.

        q [A s] and its rate of change with the end [A]: (2, row, 1, discharge).
        """
        batteries = [Battery(1.0, 0.5, 0.25 * rate_per_s) for rate_per_s in np.exp(rates)]
        levels = [levelling(battery, self._before_end_s)[::-1] for battery in batteries]
        sums = [[[self._sums(gain)] for gain in level] for level in levels]
        rows, edge = np.swapaxes(sums, 0, 1), np.full(len(rates), LOGIT)
        return *_least(lambda logits: self.squares(rows, logits), -edge, edge), rows

    def optima(self) -> Iterator[tuple[float, Floats, Floats]]:
        """log k', values and residuals at every local minimum, the slowest first.

        A floor that is flat has none inside: the least row and both ends count as well.
        """
        beside = np.pad(self._least, 1, constant_values=np.inf)
        lower = np.minimum(beside[:-2], beside[2:]) * (1.0 - fit.TIE) > self._least + ROUNDED_SUM
        lower[[0, int(np.argmin(self._least)), -1]] = True
        minima = self._rates[lower]
        ends = (np.clip(minima + by * self._step, *self._ends) for by in (-1, 1))
        rates, _ = _least(lambda x: self.valley(x.ravel())[1].reshape(x.shape), *ends)
        yield from self.at(rates)

    def at(self, rates: Floats) -> Iterator[tuple[float, Floats, Floats]]:
        """log k', values and residuals of the best battery of each rate."""
        logits, _, rows = self.valley(rates)
        capacities, usual = self.implied(rows, logits[:, None])
        for place, share in enumerate(1.0 / (1.0 + np.exp(-logits))):
            mean = np.mean(capacities[place])
            values = np.array([np.exp(mean), share, np.exp(rates[place]) * share * (1.0 - share)])
            yield rates[place], values, (capacities[place, 0] - mean) / usual[place]

    def region(self, rate: float, limit: float) -> BatteryRegion:
        """All batteries up to a sum of squares, by the ends of their profile likelihoods.

        One such battery has the rate.
        """
        inside = np.array([rate, *self._rates[self._least <= limit]])
        inner = np.array([inside.min(), inside.max()])
        outer = np.clip(inner + np.array([-1, 1]) * self._step, *self._ends)  # one row further
        ends = _end(lambda rates: self.valley(rates)[1] <= limit, inner, outer)
        rates = ends[0] + (ends[1] - ends[0]) * DENSE_AT_ENDS
        inner, _, rows = self.valley(rates)
        low, high = (
            _end(lambda x: self.squares(rows, x[:, None])[:, 0] <= limit, inner, 0.0 * inner + edge)
            for edge in (-LOGIT, LOGIT)
        )
        logits = low[:, None] + (high - low)[:, None] * DENSE_AT_ENDS
        capacities, usual = self.implied(rows, logits)
        left = np.maximum(limit - self.squares(rows, logits), 0.0) / capacities.shape[-1]
        middle, reach = np.mean(capacities, axis=-1), usual * np.sqrt(left)
        flows = rates[:, None] - np.log(2.0 + np.exp(logits) + np.exp(-logits))
        lags = -logits - rates[:, None]
        both = [np.array([middle - reach, middle + reach])]
        both += [np.array([values, values]) for values in (logits, flows, lags)]
        points = np.reshape(both, (len(both), -1))
        low, high = points.min(axis=1), points.max(axis=1)
        spread = points / np.maximum(high - low, fit.NOTHING)[:, None]
        outermost = np.argmax(DIRECTIONS @ spread[[0, 1, 3]], axis=1)
        edge = points[:3, np.unique(outermost)].T
        return BatteryRegion((low[:3], high[:3]), (low[3], high[3]), tuple(ends), edge)


def _least(
    function: Callable[[Floats], Floats], low: Floats, high: Floats
) -> tuple[Floats, Floats]:
    """Minimise a function between ends on ever finer grids, by row: minimiser and minimum."""
    rows = np.arange(len(low))
    for _ in range(ZOOMS):
        places = np.linspace(low, high, FINER, axis=1)
        values = function(places)
        least = np.argmax(values <= np.min(values, axis=1, keepdims=True) + ROUNDED_SUM, axis=1)
        low = places[rows, np.maximum(least - 1, 0)]
        high = places[rows, np.minimum(least + 1, FINER - 1)]
    return places[rows, least], values[rows, least]


def _end(belongs: Callable[[Floats], Booleans], inner: Floats, outer: Floats) -> Floats:
    """The outermost place that belongs, between one that does and another."""
    for _ in range(INTERVAL_HALVINGS):
        middle = 0.5 * (inner + outer)
        inside = belongs(middle)
        inner, outer = np.where(inside, middle, inner), np.where(inside, outer, middle)
    return inner


def _largest_factor(holds: Callable[[float], bool]) -> float:
    """The largest factor up to 1 that holds, of a condition that holds from 0 on."""
    if holds(1.0):
        return 1.0
    low, high = 0.0, 1.0
    for _ in range(INTERVAL_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low


def _wells(
    discharges: Sequence[Discharge],
    spread: float | None,
    miss: Callable[[Floats], float],
    *,
    never_longer: bool,
) -> FittedWells:
    """The optimum and its profile likelihood; of equally good optima the one that misses least.

    Where the lag is known and the rate is not, the wells settle in a usual time if that is as good.
    With `never_longer` it need only lie in the region: by faster or slower wells of the same lag,
    cells run dry earlier than planned.
    """
    sums, freedom = SumOfSquares(discharges), len(discharges) - len(KEYS)
    optima = list(sums.optima())
    least = min(float(left @ left) for *_, left in optima)
    most = least + fit.TIE * (least + (spread or 0.0) ** 2) + ROUNDED_SUM
    ties = [optimum for optimum in optima if optimum[2] @ optimum[2] <= most]
    if len(ties) > 1:
        misses = [miss(values) for _, values, _ in ties]
        ties = [
            *itertools.compress(
                ties, (missed <= min(misses) + fit.SAME_OPTIMUM for missed in misses)
            )
        ]
    rate, values, left = ties[0]
    sigma = math.sqrt(least / freedom) if spread is None else spread

    deviations = quantile(fit.CONFIDENCE, freedom if spread is None else None)
    limit = least + (sigma * deviations) ** 2
    region = sums.region(rate, limit)
    (usual,) = sums.at(np.array([-math.log(SETTLING_S)]))
    lag_is_known = bool(region.lag[1] - region.lag[0] < math.log(LAG_KNOWN))
    rate_is_unknown = region.rate[1] - region.rate[0] > math.log(RATE_UNKNOWN)
    most = limit if never_longer and lag_is_known else PLATEAU * least + ROUNDED_SUM
    is_usual = rate_is_unknown and float(usual[2] @ usual[2]) <= most
    if is_usual:
        rate, values, left = usual
    settled = is_usual and lag_is_known

    # A few discharges may agree by chance, and would seem clear just where they are wrong.
    largest = sigma if spread else max(sigma, min(HIDDEN_SCATTER, CHANCE * sigma))
    sure = largest * quantile(CLEAR, None)
    clear = np.subtract(*sums.region(rate, least + sure**2).values[::-1])
    low, high = region.values
    wide = np.array([high - low, clear]) > 2.0 * fit.WIDE
    undetermined, unsure = (tuple(itertools.compress(KEYS, row)) for row in wide.tolist())
    low, high = (np.exp(end - (0.0, np.logaddexp(0.0, end[1]), 0.0)) for end in (low, high))
    intervals: list[ConfidenceInterval | None] = [
        *map(ConfidenceInterval, low.tolist(), high.tolist())
    ]
    if settled:
        undetermined, unsure, intervals[1:] = (), (), [None, None]
    lag = Value(
        "lag_s",
        float(Battery(*values).lag_s),
        "(1−ω)²/k_F of the fit",
        ConfidenceInterval(*np.exp(region.lag).tolist()),
        lag_is_known,
        stated=False,
    )
    edge = np.exp(region.edge - np.logaddexp(0.0, region.edge) * (0.0, 1.0, 0.0))
    batteries = tuple(dict(zip(KEYS, battery, strict=True)) for battery in edge.tolist())
    estimated = Estimate(KEYS, values, left, sigma, tuple(intervals), undetermined, unsure)
    return FittedWells(estimated, lag, settled, batteries)


def _discharges(table: csv.Measurements) -> tuple[list[Discharge], list[str]]:
    """The discharges in a file of lifetimes, or in a record, and doubts about its values."""
    if "time" in table.numbers:
        return _record(table)
    names = np.array(table.texts["load"])
    current_A, lifetime_s = table.numbers["current"], table.numbers["lifetime"]
    duration_s = table.numbers["duration"]
    faults, discharges = list[Fault](), list[Discharge]()
    for name in dict.fromkeys(table.texts["load"]):
        of_load, before = names == name, len(faults)
        several = np.sum(of_load) > 1
        lasts_s = float(lifetime_s[of_load][0])
        faults += table.faults(of_load & ~(lifetime_s > 0.0), "lifetime", "a time above 0")
        words = f"one lifetime for all pieces of {name}; a second discharge gets a second name"
        faults += table.faults(of_load & (lifetime_s != lasts_s), "lifetime", words)
        timeless = of_load & ~(duration_s > 0.0) & several
        words = f"a time above 0, because {name} has several pieces"
        faults += table.faults(timeless, "duration", words)
        if several and not np.any(timeless):
            rounds = lasts_s / float(np.sum(duration_s[of_load]))
            words = f"at most {MOST_PIECES} pieces of {name} until the battery is empty"
            many = of_load & (rounds * np.sum(of_load) > MOST_PIECES)
            faults += table.faults(many, "duration", words)
        durations_s = duration_s[of_load] if several else lifetime_s[of_load]
        pieces = tuple(zip(current_A[of_load].tolist(), durations_s.tolist(), strict=True))
        discharges.append(Discharge(name, pieces, lasts_s))
        if len(faults) == before and discharges[-1].drawn_As <= 0.0:
            words = f"more discharge than charge in {name}: positive is discharge"
            faults += table.faults(of_load, "current", words)
    refuse(faults)
    return discharges, []


def _record(table: csv.Measurements) -> tuple[list[Discharge], list[str]]:
    """The discharge of a record: each known current holds until the next one.

    The first holds from the beginning, and of the last line only the time counts.
    """
    refuse(csv.record_faults(table))
    unknown = table.unknown("current")
    unknown[-1] = False
    for rows in (np.ones(len(unknown), bool), ~unknown):
        time_s, current_A = (table.numbers[column][rows] for column in ("time", "current"))
        time_s[0] = table.numbers["time"][0]
        pieces = tuple(zip(current_A[:-1].tolist(), np.diff(time_s).tolist(), strict=True))
        lasts_s = float(time_s[-1] - time_s[0])
        discharge = Discharge(Path(table.source).stem, pieces, lasts_s, recorded=True)
        if not pieces or discharge.drawn_As <= 0.0:
            words = "a record that draws charge: positive is discharge, is the sign the opposite?"
            raise InputError([Fault("current", "", words, table.source)])
    return [discharge], [*table.left_out("current", unknown)]

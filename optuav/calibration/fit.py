"""Least squares over transformed parameters, and the result: values with their uncertainty.

Positive parameters are fitted by their logarithm, so that no bound is needed and intervals stay
inside the range. With r(x) the residuals, independent and of one variance, and J their Jacobian of
rank p at the optimum, the covariance of x is s² (JᵀJ)⁻¹, s² = r·r/(n − p) [1]_.

References
----------
.. [1] G. A. F. Seber, C. J. Wild, "Nonlinear Regression", Wiley, 1989, section 5.1.
.. [2] G. H. Golub, V. Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares
   problems whose variables separate", SIAM J. Numer. Anal., 1973.
"""

import math
import os
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import chain, compress
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
import tomli_w

from optuav.arrays import Floats
from optuav.calibration.logs.flight_log import FlightLog
from optuav.errors import Fault, printable, refuse
from optuav.frames import DataFrame, frame
from optuav.mission.forms import SCHEMA
from optuav.mission.load import shipped
from optuav.mission.messages import first_ten, number
from optuav.presentation.blocks import Block, Fold, Heading, Note, Table
from optuav.presentation.numbers import figure, percent, significant, typed
from optuav.presentation.presented import Presented

Role: TypeAlias = Literal["fitted", "repeat", "predicted"]
FINEST = 1e-9  # least relative distance of an end from its value that decides on digits

CONFIDENCE = 0.95  # share of intervals that hold the truth
SURE = percent(CONFIDENCE)
LINE_POINTS = 101  # Points of the curve of a fit
MOST_ROWS = 40  # Observations that are listed one by one
LONGEST_NAME = 30  # Letters of a name or of an interval
NOT_KEYS = {"lag_s": "lag (1−ω)²/k_F [s], not a key"}
"""Names of values that are no keys of a mission."""
WIDTH = 98  # letters of a comment
LOGARITHM = (-35.0, 20.7)  # range of the logarithm of a positive value: 1e-15 to 1e9
FIT_TOLERANCE = 1e-12  # tolerances of a fit
MOST_STEPS = 100  # of a fit; a few tens do where the data determine all
BLIND = 1e-6  # singular value of the Jacobian, over the largest, that determines nothing
NOTHING = 1e-100  # what replaces 0 in a denominator, far from 1 and from overflow
TIE = 1e-6  # relative difference of two sums of squares that is rounding
SAME_OPTIMUM = 1e-4  # difference of two optima, in logarithms, that is rounding
WIDE = math.log(10.0)  # half width, of a logarithm or logit, of a value that is not determined
ROUNDED_DIRECTION = 1e-3  # component of a blind direction that may come from rounding


class ConfidenceInterval(NamedTuple):
    """The range of a value at a confidence of 95 %."""

    low: float
    high: float


@dataclass(frozen=True)
class Value:
    """A value for a dotted key of the mission, in its unit, and where it comes from, in words.

    Values of one fit are stated together or not at all: beside others than the fitted ones, even a
    value that is determined does not follow the data.
    """

    key: str
    value: float
    origin: str
    interval: ConfidenceInterval | None = None  # None if unknown
    determined: bool = True  # Whether the data determine it
    stated: bool = True  # Whether a mission gets it

    def value_and_interval(self, between: str) -> list[str]:
        """The value to six digits or more, and its interval if it is known, `between` its ends."""
        ends = self.interval or ()
        size = max(map(abs, (self.value, *ends)))
        apart = [gap for end in ends if (gap := abs(end - self.value)) > FINEST * size]
        digits = max(6, 2 - math.floor(math.log10(min(apart) / size))) if apart else 6
        spans = [between.join(typed(end, digits) for end in ends)] if ends else []
        return [typed(self.value, digits), *spans]

    def lines(self) -> Iterator[str]:
        """The value as a line of TOML, below origin and interval; as a comment if it is unsure."""
        entry = _entry(self.key.partition(".")[2], rounded(self.value))
        if self.determined:
            yield _remark(f"; {SURE}: ".join([self.origin, *self.value_and_interval(" to ")[1:]]))
        else:
            together = "; it is valid only together with the other fitted values"
            beside = together if self.stated else ""
            yield _remark(f"{self.origin}; the data do not determine it{beside}")
        yield entry if self.stated else _remark(entry)


@dataclass(frozen=True)
class Panel:
    """Observed and fitted values of one quantity, by observation.

    Parameters
    ----------
    quantity, unit
        The observed quantity, and its unit.
    observed, fitted
        The values, in that unit.
    names, at, at_words
        Names of the observations, or their places on an axis and what that axis is, with its unit.
    roles
        ``"fitted"``, ``"repeat"`` (of a fitted one) or ``"predicted"``; empty if all are fitted.
    groups
        What observations have in common, shown as colours; empty if nothing.
    line
        The fit as a curve: pairs of a place on the axis and the fitted value. Empty if the fit is
        known at the observations only.

    Examples
    --------
    >>> from optuav.calibration import Panel
    >>> panel = Panel("lifetime", "s", (100.0, 120.0), (101.0, 118.0), names=("1 A", "2 A"))
    >>> [fitted - seen for fitted, seen in zip(panel.fitted, panel.observed)]
    [1.0, -2.0]
    """

    quantity: str
    unit: str
    observed: Sequence[float]
    fitted: Sequence[float]
    names: Sequence[str] = ()
    at: Sequence[float] = ()
    at_words: str = ""
    roles: Sequence[Role] = ()
    groups: Sequence[str] = ()
    line: Sequence[tuple[float, float]] = ()

    def block(self) -> Block:
        """The first observations beside the fitted values; of a course of samples what is left."""
        if not self.names:
            left = math.dist(self.observed, self.fitted) / math.sqrt(len(self.observed))
            words = f"{figure(left, 3)} {self.unit} rms left over of {len(self.observed)} samples"
            return Note([f"{self.quantity}: {words}"])
        roles = self.roles or ["fitted"] * len(self.names)
        points = [*zip(self.names, self.observed, self.fitted, roles, strict=True)]
        rows = list[tuple[str, ...]]()
        for name, observed, fitted, role in points[:MOST_ROWS]:
            same = math.isclose(fitted, observed, rel_tol=1e-9)
            apart = "0" if same else figure(fitted - observed, 3, sign="+")
            rows.append((name, figure(observed), figure(fitted), apart, role * (role != "fitted")))
        more = len(points) - len(rows)
        heads = (f"{self.quantity} [{self.unit}]", "observed", "fitted", "difference", "")
        below = [f"and {more} more"] if more else []
        return Table(heads, rows, last=1, longest=LONGEST_NAME, below=below)


@dataclass(frozen=True)
class Fit(Presented):
    """Values for a mission, fitted to data.

    Parameters
    ----------
    kind
        ``"kibam"``, ``"regimes"``, ``"rotor"``, ``"rotary-wing"`` or ``"table"``.
    sources
        Names of the files.
    data
        Content of the files, in a few words.
    values
        The values found, each with ``key``, ``value``, ``origin``, ``interval`` (its ``low`` and
        ``high`` end at a confidence of 95 %, or None), ``determined`` and ``stated``: values that
        the data do not determine are still set if others were fitted together with them.
    panels
        Observed and fitted values, each an `optuav.calibration.Panel`; empty without observations.
    warnings
        Sentences on undetermined values, and on data that look wrong.
    settings
        Further keys of the mission that the values need.
    extends
        Mission that the fragment extends by default.
    lag
        Lag of a battery, (1−ω)²/k_F [s], a value like the others but no key of a mission; None for
        other kinds. Once its wells have settled, a constant current I lasts B/I less the lag.
    edge
        Batteries at the edge of the 95 % region, by dotted key, in all directions of capacity,
        share and lag. The hovers of their plans are, to about a percent, the interval of the hover.
    notes
        Sentences on what was read of flight logs, and what was left out.
    logs
        The flight logs of autopilots among the sources, each an `optuav.calibration.FlightLog`.

    Examples
    --------
    >>> import optuav
    >>> from optuav.calibration import Value
    >>> value = Value("battery.capacity_As", 662.42, "measured")
    >>> fit = optuav.Fit("kibam", ("cell.csv",), "one cell", (value,), ())
    >>> fit.changes
    {'battery.capacity_As': 662.42}
    >>> print(fit.to_toml().splitlines()[-1])
    capacity_As = 662.42
    """

    kind: str
    sources: tuple[str, ...]
    data: str
    values: tuple[Value, ...]
    panels: tuple[Panel, ...]
    warnings: tuple[str, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)
    extends: str = "paper"
    lag: Value | None = None
    edge: tuple[Mapping[str, float], ...] = ()
    notes: tuple[str, ...] = ()
    logs: tuple[FlightLog, ...] = ()

    @property
    def rows(self) -> tuple[Value, ...]:
        """The values, and the lag if there is one."""
        return self.values if self.lag is None else (*self.values, self.lag)

    @property
    def lag_words(self) -> str:
        """The lag and its interval; empty if the data do not determine it."""
        if self.lag is None or not self.lag.determined:
            return ""
        ends = " to ".join(figure(end, 3) for end in self.lag.interval or ())
        return f"lag {figure(self.lag.value, 3)} s ({ends})"

    @property
    def changes(self) -> dict[str, object]:
        """Values to set, by dotted key, ready for `optuav.Mission.replace`."""
        value_of = {value.key: rounded(value.value) for value in self.values if value.stated}
        return {**self.settings, **value_of}

    def __repr__(self) -> str:
        keys = first_ten([value.key for value in self.values])
        return f"<Fit of {self.kind} to {self.data}: {keys}>"

    def blocks(self) -> Iterator[Block]:
        """Yield the values by table of the mission, then observations, notes and warnings."""
        yield Heading(f"{self.kind}: {self.data}", good=not self.warnings)
        tables = dict[str, list[tuple[str, str, str]]]()
        loose = dict[str, list[int]]()
        for value in self.rows:
            name, _, key = value.key.rpartition(".")
            name = name or "battery"
            number, *interval = value.value_and_interval(" – ")
            if not value.determined:
                number, interval = number if value.stated else "?", ["not determined"]
                loose.setdefault(name, []).append(len(tables.get(name, ())))
            row = NOT_KEYS.get(key, key), number, "".join(interval) or "–"
            tables.setdefault(name, []).append(row)
        for name, rows in tables.items():
            heads = f"[{name}]", "value", f"{SURE} between"
            yield Table(heads, rows, longest=LONGEST_NAME, bad=loose.get(name, ()))
        origins = [(value.key, value.origin) for value in self.rows]
        yield Fold("Where the values come from", [Table((), origins, words=2)], in_text=False)
        yield from (panel.block() for panel in self.panels)
        yield Note([*self.notes, *(f"warning: {warning}" for warning in self.warnings)])

    def to_dict(self) -> dict[str, object]:
        """Everything but the flight logs as plain data."""
        data = asdict(replace(self, logs=()))
        del data["logs"]
        return data

    def to_frame(self) -> DataFrame:
        """Return one row per value, and one for the lag of a battery; needs pandas.

        Columns are ``key``, ``value``, ``low`` and ``high`` of its interval (None where that is not
        known), ``determined`` and ``origin``.
        """
        rows = [
            (e.key, e.value, *(e.interval or (None, None)), e.determined, e.origin)
            for e in self.rows
        ]
        return frame(rows, ["key", "value", "low", "high", "determined", "origin"])

    def to_toml(self, extends: str | None = None, file: str | Path = "") -> str:
        """Return a fragment of a mission file: the values, with intervals and origins as comments.

        All other values come from the mission that it `extends`: a shipped one or the path of a
        file, written relative to the `file` of the fragment; by default that of the fit.
        """
        base = self.extends if extends is None else extends
        if base not in shipped():
            base = Path(os.path.relpath(base, Path(file).parent)).as_posix()
        names = ", ".join(Path(source).name for source in self.sources)
        remarks = [f"By optuav calibrate {self.kind} from {names}:", f"{self.data}."]
        remarks += [f"{SURE}: {self.lag_words}."] * bool(self.lag_words)
        remarks += [f"{words}." for words in self.notes]
        remarks += [f"Warning: {words}" for words in self.warnings]
        lines = [*chain.from_iterable(map(_wrapped, remarks)), ""]
        lines += [_entry("schema", SCHEMA), _entry("extends", base)]
        entries: dict[str, list[str]] = {}
        for key, value in self.settings.items():
            table, _, name = key.partition(".")
            entries.setdefault(table, []).append(_entry(name, value))
        for fitted in self.values:
            entries.setdefault(fitted.key.partition(".")[0], []).extend(fitted.lines())
        for table, found in entries.items():
            lines += ["", f"[{table}]", *found]
        return "\n".join(lines) + "\n"


def curve(
    quantity: str,
    unit: str,
    observed: Floats,
    fitted: Floats,
    at: Floats,
    at_words: str,
    model: Callable[[Floats], Floats] | None = None,
) -> Panel:
    """The panel of values along an axis, in its order; with the curve of a model that fits."""
    order = np.argsort(at, kind="stable")
    seen, shown, places = (values[order].tolist() for values in (observed, fitted, at))
    panel = Panel(quantity, unit, seen, shown, (), places, at_words)
    if model is None:
        return panel
    between = np.linspace(places[0], places[-1], LINE_POINTS)
    return replace(panel, line=tuple(zip(between.tolist(), model(between).tolist(), strict=True)))


class Estimate(NamedTuple):
    """The result of a fit: values by key, residuals by observation, and how sure they are."""

    keys: tuple[str, ...]
    values: Floats
    residuals: Floats
    spread: float | None  # s; None without more observations than parameters
    intervals: tuple[ConfidenceInterval | None, ...]  # by the Jacobian; None without a spread
    undetermined: tuple[str, ...]  # keys that the data do not determine or tell apart
    unsure: tuple[str, ...] = ()  # that they hardly do

    def values_for_mission(self, origin: str, *, always: bool = False) -> tuple[Value, ...]:
        """The values for a mission, which gets none unless one is determined, or `always` all."""
        rows, blind = (
            zip(self.keys, self.values.tolist(), self.intervals, strict=True),
            self.undetermined,
        )
        states = always or set(blind) != set(self.keys)
        return tuple(Value(key, x, origin, ends, key not in blind, states) for key, x, ends in rows)

    def ordered(self, keys: Sequence[str]) -> "Estimate":
        """The same, with the keys in another order."""
        places = [self.keys.index(key) for key in keys]
        return self._replace(
            keys=tuple(keys),
            values=self.values[places],
            intervals=tuple(self.intervals[place] for place in places),
            undetermined=tuple(key for key in keys if key in self.undetermined),
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """A sentence on the keys that the data do not determine, if there are any."""
        keys, no = self.undetermined or self.unsure, bool(self.undetermined)
        *names, last = [key.rpartition(".")[2] for key in keys] or [""]
        if not names:
            return (f"the data {'do not' if no else 'hardly'} determine {last}",) if last else ()
        apart = f"{'cannot' if no else 'hardly'} tell {', '.join(names)} and {last} apart"
        return (f"the data {apart}: a change of one is made up for by the others",)


def estimate(
    keys: Sequence[str],
    residuals: Callable[[Floats], Floats],
    starts: Iterable[Sequence[float]],
    *,
    spread: float | None = None,
    eliminated: int = 0,
) -> Estimate:
    """Fit positive parameters from several starts.

    Residuals, at least as many as parameters, are finite everywhere and of one standard deviation:
    `spread` where it is known, though they may show a larger one. They may be least already over
    further parameters, which are `eliminated` [2]_.
    """
    from scipy.optimize import least_squares

    def outer(x: Floats) -> Floats:
        grown: Floats = np.exp(np.clip(x, *LOGARITHM))  # beyond, a mission may state no value
        return grown

    def inside(x: Floats) -> Floats:
        return residuals(outer(x))

    # Steps of "trf" keep out of directions where the data are blind, and one-sided differences
    # leave the optimum uncertain in its seventh digit.
    how: dict[str, Any] = {"method": "trf", "jac": "3-point", "max_nfev": MOST_STEPS}
    how |= dict.fromkeys(("xtol", "ftol", "gtol"), FIT_TOLERANCE)
    found: list[Any] = [least_squares(inside, np.log(start), **how) for start in starts]
    least = min(estimate.cost for estimate in found)
    most = least + TIE * (least + (spread or 0.0) ** 2)
    best, *_ = ties = [estimate for estimate in found if estimate.cost <= most]
    _, sizes, directions = np.linalg.svd(best.jac, full_matrices=False)
    seen = sizes > BLIND * max(sizes[0], NOTHING)
    wide = np.any(np.abs(directions[~seen]) > ROUNDED_DIRECTION, axis=0)
    errors = np.linalg.norm(directions[seen] / sizes[seen, None], axis=0)
    freedom = len(best.fun) - int(seen.sum()) - eliminated
    left = math.sqrt(2.0 * best.cost / freedom) if freedom > 0 else None
    sigma = left if spread is None else max(spread, left or 0.0)
    intervals: tuple[ConfidenceInterval | None, ...] = (None,) * len(keys)
    if sigma is not None:
        deviations = quantile(CONFIDENCE, freedom if spread is None else None)
        reach = np.where(wide, np.inf, sigma * deviations * errors)
        ends = outer(best.x - reach).tolist(), outer(best.x + reach).tolist()
        intervals = tuple(map(ConfidenceInterval, *ends))
        # Rounding would choose one of several equally good optima.
        apart = [np.abs(tie.x - best.x) > np.maximum(reach, SAME_OPTIMUM) for tie in ties]
        wide = wide | (reach > WIDE) | np.any(apart, axis=0)
    undetermined = tuple(compress(keys, wide))
    return Estimate(tuple(keys), outer(best.x), best.fun, sigma, intervals, undetermined)


def quantile(confidence: float, freedom: float | None) -> float:
    """Standard deviations to either end of an interval, by Student if estimated with a freedom."""
    from scipy.special import ndtri, stdtrit

    level = 0.5 + 0.5 * confidence
    return float(ndtri(level) if freedom is None else stdtrit(freedom, level))


def finished(found: Fit, hint: str = "") -> Fit:
    """The fit; refused, with the hint and the warnings, if a value is out of a mission's range."""
    reasons = "".join(f"; {warning}" for warning in (hint, *found.warnings) if warning)
    source = ", ".join(found.sources)
    refuse(
        Fault(f"{e.key}, {e.origin}", typed(e.value, 4), f"{allowed.words}{reasons}", source)
        for e in found.values
        if e.stated and (allowed := number(e.key)) and not allowed.accepts(e.value)
    )
    return found


def rounded(value: float) -> float:
    """A value to seven digits, more than any measurement has."""
    return significant(value, 7)


def _remark(words: str) -> str:
    """A comment in TOML, which ends where its line does."""
    return f"# {printable(words)}"


def _wrapped(words: str) -> list[str]:
    """Comments in TOML, broken between words."""
    wrapper = textwrap.TextWrapper(WIDTH, break_long_words=False, break_on_hyphens=False)
    return [*map(_remark, wrapper.wrap(printable(words)))]


def _entry(key: str, value: object) -> str:
    """A line of TOML."""
    return f"{key} = {tomli_w.dumps({'x': value}).partition('=')[2].strip()}"

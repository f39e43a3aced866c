"""Distributions of uncertain keys, and samples of them for batches, sweeps and sensitivities."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias, get_args
from zlib import crc32

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, collected, refuse
from optuav.fields import Range
from optuav.laser.fits import CONVERSIONS, Laser
from optuav.mission import Mission, load
from optuav.mission.files import label, read_toml
from optuav.mission.keys import (
    BOUND,
    PER_MINUTE,
    PER_SECOND,
    Key,
    as_stated,
    keys_of_missing_tables,
    numeric_keys,
    range_of,
    stated_keys,
    stated_value,
    unknown_keys,
)
from optuav.mission.messages import misfits, path_of, shown, unlisted
from optuav.presentation.numbers import short, significant

Method: TypeAlias = Literal["sobol", "latin-hypercube"]
METHODS: tuple[Method, ...] = get_args(Method)
COUNT = Range("-", ge=1, le=1e7, whole=True)
SEED = Range("-", ge=0, le=2**63, whole=True)
FINITE = Range("-", gt=-math.inf, lt=math.inf)
KNOWN = "body.gravity_m_s2"  # It varies only where its spread is stated
SHARE = 0.1  # Reach of a key to either side if nothing is stated, relative to its value
DEVIATIONS = 2.0  # Half the range that a picture shows of a normal distribution
FORMS = (
    "a table such as { percent = 5 }, { low = 1, high = 2 }, { low = 1, likely = 1.5, high = 2 } "
    'or { deviation = 0.1 }, each with or without along = ["table.key"]'
)
KINDS = ({"percent"}, {"low", "high"}, {"low", "likely", "high"}, {"deviation"})
PARTS = {"along", "count"}.union(*KINDS)
"""What a table of one key states; of other tables, the keys."""
WAVELENGTH, COEFFICIENTS = "laser.wavelength_nm", tuple(CONVERSIONS[810])


def samples(
    mission: Mission | str | Path,
    uncertainty: Mapping[str, object] | str | Path,
    count: int,
    *,
    method: Method = "sobol",
    seed: int = 0,
) -> dict[str, Floats]:
    """Draw samples of uncertain keys that cover their distributions evenly.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    uncertainty
        Distributions of keys, as for `optuav.sensitivity`: a TOML file or a dict, whose keys may
        be dotted, as in ``{"limits.deadline_s": {"low": 600, "high": 1800}}``.
    count
        Number of samples, 1 to 1e7.
    method
        ``"sobol"``: a scrambled Sobol sequence [1]_, whose first samples are the same for any
        count; or ``"latin-hypercube"``: each key has one sample in each of `count` equally likely
        parts of its range [2]_.
    seed
        Seed of the samples, 0 to 2**63.

    Returns
    -------
    dict
        Values by key, one entry per sample, for `optuav.batch` with ``paired=True``. If the
        wavelength is uncertain, the laser's conversion stays fixed, as in a sensitivity.

    Raises
    ------
    InputError
        With all faults of the distributions and options.

    References
    ----------
    .. [1] I. M. Sobol, "On the distribution of points in a cube and the approximate evaluation of
       integrals", USSR Computational Mathematics and Mathematical Physics, 1967.
    .. [2] M. D. McKay, R. J. Beckman, W. J. Conover, "A comparison of three methods for selecting
       values of input variables in the analysis of output from a computer code", Technometrics,
       1979.

    Examples
    --------
    >>> import optuav
    >>> spread = {"battery.capacity_As": {"percent": 10}, "limits.deadline_s": {"deviation": 60}}
    >>> drawn = optuav.samples("paper", spread, 256)
    >>> results = optuav.batch_arrays("paper", drawn, perspective="battery", paired=True)
    >>> f"{results['hover_time_s'].mean():.0f} s of hover on average"
    '720 s of hover on average'
    """
    faults = [*misfits(("count", count, COUNT), ("seed", seed, SEED))]
    faults += unlisted(("method", method, METHODS))
    with collected(faults):
        whole = load(mission)
        if not (spread := spreads(whole, uncertainty)):
            faults.append(Fault("uncertainty", "", "at least one key with its distribution"))
    refuse(faults)
    points = sobol if method == "sobol" else latin_hypercube
    return Draws(whole, spread, count, seed, points).values(0, count)


@dataclass(frozen=True)
class Spread:
    """The distribution of a key: triangular, normal, or else uniform from `low` to `high`."""

    key: Key
    low: float
    high: float
    likely: float | None = None  # Most likely value of a triangular distribution
    # Standard deviation about the mission's value, cut off at the range of the key
    deviation: float | None = None
    along: tuple[Key, ...] = ()  # Keys that change by the same factor

    def at(self, share: Floats) -> Floats:
        """Return the quantiles of the distribution for shares between 0 and 1."""
        low, high, likely = self.low, self.high, self.likely
        if self.deviation is not None:
            from scipy import special

            now, scale = self.key.now, self.deviation
            ends = special.ndtr((np.array([self.key.low, self.key.high]) - now) / scale)
            within = special.ndtri(ends[0] + share * (ends[1] - ends[0]))
            return np.asarray(np.clip(now + scale * within, self.key.low, self.key.high))
        if likely is None:
            return low + share * (high - low)
        up = low + np.sqrt(share * (high - low) * (likely - low))
        down = high - np.sqrt((1.0 - share) * (high - low) * (high - likely))
        return np.where(share * (high - low) < likely - low, up, down)

    def columns(self, values: Floats) -> Iterator[tuple[str, Floats]]:
        """Yield the values by key, including keys that change along with it."""
        yield self.key.name, values
        for other in self.along:
            yield other.name, np.clip(other.now * (values / self.key.now), other.low, other.high)


@dataclass(frozen=True)
class Draws:
    """Samples of uncertain keys, each the same whatever others are drawn with it."""

    mission: Mission
    spreads: tuple[Spread, ...]
    count: int
    seed: int
    # Points of the unit cube (sample, spread) by the names of keys, the seed, and from a number on.
    points: Callable[[Sequence[str], int, int, int], Floats]

    def values(self, first: int, count: int) -> dict[str, Floats]:
        """Values by key of some samples."""
        names, columns = [spread.key.name for spread in self.spreads], dict[str, Floats]()
        shares = self.points(names, self.seed, first, count)
        for spread, column in zip(self.spreads, shares.T, strict=True):
            columns |= spread.columns(spread.at(column))
        return with_conversion(self.mission, columns)


def with_conversion(mission: Mission, values: dict[str, Floats]) -> dict[str, Floats]:
    """The values with the laser's conversion, which is held where its wavelength is uncertain."""
    if not isinstance(laser := mission.laser, Laser) or WAVELENGTH not in values:
        return values
    count = len(values[WAVELENGTH])
    held = {f"laser.{name}": np.full(count, getattr(laser, name)) for name in COEFFICIENTS}
    return held | values


def sobol(names: Sequence[str], seed: int, first: int, count: int) -> Floats:
    """Points of a scrambled Sobol sequence."""
    from scipy.stats import qmc

    points = qmc.Sobol(len(names), rng=seed)
    begin = points.random(1)  # A first draw of other than a power of two would warn
    if first:
        return np.asarray(points.fast_forward(first - 1).random(count))
    return np.concatenate([begin, points.random(count - 1)])


def latin_hypercube(names: Sequence[str], seed: int, _: int, count: int) -> Floats:
    """All points of a Latin hypercube."""
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(len(names), rng=seed).random(count))


def independent(names: Sequence[str], seed: int, first: int, count: int) -> Floats:
    """Random points, each key from a stream of its own."""
    points = np.empty((len(names), count))
    for name, column in zip(names, points, strict=True):
        stream = np.random.PCG64([seed, crc32(name.encode())])
        stream.advance(first)  # each number takes one step
        np.random.Generator(stream).random(out=column)
    return points.T


def unstated(mission: Mission) -> Iterator[Spread]:
    """Yield every key within 10 %, except known ones and ones without a range (whole numbers)."""
    for key in stated_keys(mission).values():
        ends = sorted(significant(key.now * share, 12) for share in (1.0 - SHARE, 1.0 + SHARE))
        low, high = (min(max(end, key.low), key.high) for end in ends)
        if not key.whole and low < high and key.name != KNOWN:
            yield Spread(key, low, high)


def completed(mission: Mission, stated: Sequence[Spread]) -> Mission:
    """Return the mission with values for spread keys that it does not state."""
    now = {spread.key.name: spread.key.now for spread in stated}
    values = {key: value for key, value in now.items() if stated_value(mission, key) is None}
    return mission.replace(as_stated(mission, values))


def spreads(mission: Mission, content: Mapping[str, object] | str | Path) -> tuple[Spread, ...]:
    """Return the spreads that a TOML file or a mapping states, or refuse it with all faults.

    A key that the mission does not state is now at its most likely value, or at the middle.

    A mapping has the form ``{"battery": {"capacity_As": {"percent": 5}}}``, or ``{
    "battery.capacity_As": {"percent": 5}}``; other forms as in `optuav.sensitivity`.
    """
    source = ""
    if not isinstance(content, Mapping):
        path = path_of(content)
        source, content = label(path), read_toml(path)
    spreads_found, faults, forms = list[Spread](), list[Fault](), [*dotted(content)]
    names = dict.fromkeys(name for name, _ in forms)
    faults += unknown_keys(names, mission)
    numeric = [name for name in names if range_of(name) is not None]
    faults += keys_of_missing_tables(mission, numeric)
    wrong = {fault.key for fault in faults}
    forms = [(name, form) for name, form in forms if name not in wrong]
    numbers = _known(mission)
    starts = {name: ends for name, form in forms if name not in numbers and (ends := _start(form))}
    with collected(faults):
        for values in zip(*starts.values(), strict=True):
            now = as_stated(mission, dict(zip(starts, values, strict=True)))
            mission = mission.replace(now)
    numbers = _known(mission)
    for name, form in forms:
        if name in starts.keys() - numbers.keys():
            continue  # It has its fault
        with collected(faults):
            spreads_found.append(_per_second(_spread(numbers, name, form), numbers[PER_SECOND]))
            _refuse_ends(mission, spreads_found[-1])
    varied = Counter(key.name for spread in spreads_found for key in (spread.key, *spread.along))
    words = "varies once, by itself or along another"
    faults += [Fault(name, "", words) for name in sorted(varied) if varied[name] > 1]
    refuse(replace(fault, source=source) for fault in faults)
    return tuple(spreads_found)


def _known(mission: Mission) -> dict[str, Key]:
    """The keys that may vary about a mission's own value."""
    keys = stated_keys(mission)
    rate, allowed = keys[PER_SECOND], numeric_keys()[PER_MINUTE]
    minutes = replace(rate, name=PER_MINUTE, now=60.0 * rate.now, unit=allowed.unit)
    return {**keys, PER_MINUTE: replace(minutes, low=60.0 * rate.low, high=60.0 * rate.high)}


def _per_second(spread: Spread, rate: Key) -> Spread:
    """The spread with the rate as a mission holds it, where it is stated per minute."""
    along = tuple(rate if key.name == PER_MINUTE else key for key in spread.along)
    if spread.key.name != PER_MINUTE:
        return replace(spread, along=along)
    likely, deviation = (
        None if number is None else number / 60.0 for number in (spread.likely, spread.deviation)
    )
    return Spread(rate, spread.low / 60.0, spread.high / 60.0, likely, deviation, along)


def _refuse_ends(mission: Mission, spread: Spread) -> None:
    """Refuse a spread if no mission could state one of its ends."""
    for end in (spread.low, spread.high):
        columns = with_conversion(mission, dict(spread.columns(np.array([end]))))
        values = {name: float(column[0]) for name, column in columns.items() if name not in BOUND}
        mission.replace(as_stated(mission, values))


def _start(form: object) -> tuple[float, float] | None:
    """The lowest value of a range, and its most likely one or its middle; None without a range."""
    ends = form if isinstance(form, dict) else {}
    if not {"low", "high"} <= ends.keys() or not all(map(FINITE.accepts, ends.values())):
        return None
    return float(ends["low"]), float(ends.get("likely", 0.5 * (ends["low"] + ends["high"])))


def dotted(stated: Mapping[str, object]) -> Iterator[tuple[str, object]]:
    """Keys with their values; inner tables, and those of devices in them, give dotted names."""
    for key, content in stated.items():
        name = key if isinstance(key, str) else shown(key)
        if not isinstance(content, dict) or "." in name:
            yield name, content
            continue
        for inner, values in content.items():
            dotted_name = f"{name}.{inner}"
            if name == "devices" and isinstance(values, dict) and not values.keys() <= PARTS:
                yield from ((f"{dotted_name}.{field}", value) for field, value in values.items())
            else:
                yield dotted_name, values


def _spread(known: Mapping[str, Key], name: str, form: object) -> Spread:
    """Return the spread of one key, or refuse its form."""
    key = _key(known, name)
    parts_by_name = form if isinstance(form, dict) else {}
    numbers = {part: value for part, value in parts_by_name.items() if part != "along"}
    if numbers.keys() not in KINDS or not all(map(FINITE.accepts, numbers.values())):
        raise InputError([Fault(name, form_shown(form), FORMS)])
    if key.whole:
        raise InputError(
            [Fault(name, form_shown(form), "is a whole number, which cannot be spread")]
        )
    along = parts_by_name.get("along", [])
    if not isinstance(along, list) or not all(isinstance(key_along, str) for key_along in along):
        raise InputError([Fault(f"{name}.along", shown(along), "a list of keys")])
    if along and key.now == 0.0:
        raise InputError([Fault(f"{name}.along", shown(along), "must not vary along with 0")])
    likely, deviation = numbers.get("likely"), numbers.get("deviation")
    reach = abs(key.now) * numbers.get("percent", 0.0) / 100.0 + DEVIATIONS * (deviation or 0.0)
    low, high = numbers.get("low", key.now - reach), numbers.get("high", key.now + reach)
    if deviation is not None:
        low, high = max(low, key.low), min(high, key.high)
    if not (key.low <= low < high <= key.high and low <= numbers.get("likely", low) <= high):
        within = f"within {short(key.low)} to {short(key.high)} [{key.unit}]"
        raise InputError(
            [Fault(name, form_shown(form), f"must have low < high, likely between, {within}")]
        )
    return Spread(key, low, high, likely, deviation, tuple(_key(known, other) for other in along))


def form_shown(form: object) -> str:
    """A form as TOML writes it."""
    if not isinstance(form, dict) or not form:
        return shown(form)
    return f"{{ {', '.join(f'{part} = {shown(value)}' for part, value in form.items())} }}"


def _key(known: Mapping[str, Key], name: str) -> Key:
    """Return a key that may vary, or refuse its name."""
    if name in known:
        return known[name]
    refuse(unknown_keys([name]))
    raise InputError([Fault(name, "", "the mission does not set it: set low and high")])

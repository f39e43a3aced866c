"""What is uncertain, and how: read from a TOML file, drawn reproducibly."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from scipy import special

from optuav.arrays import Floats
from optuav.diagnosis.keys import Key, keys
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.files import label, read_text, refusal
from optuav.mission.sections import SECTIONS
from optuav.mission.words import nearest, shown
from optuav.studies.uncertain.ensemble import KEY

SHARE = 0.1
"""How far a key goes to either side where nothing is stated, relative to its value."""
WORLD = ("battery", "rotor", "body", "laser", "link", "flight")
"""Tables that state what is measured; [route] and [limits] state what is chosen."""
LARGEST_FILE = 200_000
FARTHEST_M = 1e6
DEVIATIONS = 2.0
"""Half the range that a picture shows of a normal distribution."""

_FORMS = (
    "{ percent = 5 }, { low = 1, high = 2 }, { low = 1, likely = 1.5, high = 2 } or "
    '{ deviation = 0.1 }, each with or without along = ["table.key"]'
)


@dataclass(frozen=True)
class Spread:
    """How a key is spread.

    Parameters
    ----------
    key
        The key, with what it may be; its name may be that of a component.
    low, high
        Ends of its range.
    likely
        Most likely value of a triangular distribution; None for another one.
    deviation
        Standard deviation of a normal distribution about the mission's value, cut off at what the
        key may be; None for another one. With neither, all values of the range are as likely.
    along
        Keys that change by the same factor.
    """

    key: Key
    low: float
    high: float
    likely: float | None = None
    deviation: float | None = None
    along: tuple[Key, ...] = ()

    def at(self, share: Floats) -> Floats:
        """Values below which there is a share of all (its quantile function)."""
        low, high, likely = self.low, self.high, self.likely
        if self.deviation is not None:
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
        """The values by key, and those of the keys that go along."""
        yield self.key.name, values
        for other in self.along:
            yield other.name, np.clip(other.now * (values / self.key.now), other.low, other.high)


def drawn(spreads: Sequence[Spread], seed: int, first: int, count: int) -> dict[str, Floats]:
    """Samples by key, from number `first` on; the same whatever is drawn before or beside them."""
    found: dict[str, Floats] = {}
    for spread in spreads:
        stream = np.random.PCG64([seed, crc32(spread.key.name.encode())])
        stream.advance(first)  # a number takes one step
        found |= spread.columns(spread.at(np.random.Generator(stream).random(count)))
    return found


def around(key: Key) -> Spread | None:
    """A key within 10 %; None where that is no range, as for 0 or a whole number."""
    ends = sorted(float(f"{key.now * share:.12g}") for share in (1.0 - SHARE, 1.0 + SHARE))
    low, high = (min(max(end, key.low), key.high) for end in ends)
    return None if key.whole or low == high else Spread(key, low, high)


def everything(mission: Mission) -> dict[str, Key]:
    """Keys that may vary by name: numbers, and components of places and of the wind."""
    found = {key.name: key for key in keys(mission)}
    for table, name in (
        *(("route", end) for end in ("origin_m", "destination_m", "hover_m")),
        *(("laser", "position_m"), ("link", "device_m"), ("wind", "force_N")),
    ):
        vector = getattr(getattr(mission, table), name, None)
        for axis, now in enumerate(vector or ()):
            unit = name.rpartition("_")[2]
            part = f"{table}.{name}[{axis}]"
            found[part] = Key(part, now, -FARTHEST_M, FARTHEST_M, False, unit)
    return found


def read_spreads(mission: Mission, path: str | Path) -> tuple[Spread, ...]:
    """Read what is uncertain from a TOML file with the tables and keys of a mission.

    Raises
    ------
    InputError
        With every fault of the file.
    """
    path = Path(path)
    try:
        document = tomllib.loads(read_text(path, LARGEST_FILE))
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise refusal(path, f"is not TOML: {error}") from None
    return spreads(mission, document, label(path))


def spreads(mission: Mission, document: Mapping[str, Any], source: str = "") -> tuple[Spread, ...]:
    """Spreads of plain data, as ``{"battery": {"capacity_As": {"percent": 5}}}``.

    Raises
    ------
    InputError
        With every fault; `source` is named in each.
    """
    known = everything(mission)
    found, faults = [], []
    for table, stated in document.items():
        for name, form in stated.items() if isinstance(stated, dict) else ((None, stated),):
            key = table if name is None else f"{table}.{name}"
            try:
                found.append(_spread(known, key, form))
            except InputError as error:
                faults += [replace(fault, source=source) for fault in error.faults]
    names = [each.name for spread in found for each in (spread.key, *spread.along)]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.append(Fault(name, "", "varies once, by itself or along another", source))
    if faults:
        raise InputError(faults)
    return tuple(found)


def _spread(known: Mapping[str, Key], name: str, form: Any) -> Spread:
    key = _key(known, name)
    if not isinstance(form, dict):
        raise InputError([Fault(name, _stated(form), f"a table such as {_FORMS}")])
    numbers = {part: value for part, value in form.items() if part != "along"}
    kinds = ({"percent"}, {"low", "high"}, {"low", "likely", "high"}, {"deviation"})
    sound = all(isinstance(v, int | float) and not isinstance(v, bool) for v in numbers.values())
    if numbers.keys() not in kinds or not sound or not all(map(math.isfinite, numbers.values())):
        raise InputError([Fault(name, _stated(form), f"a table such as {_FORMS}")])
    if key.whole:
        raise InputError([Fault(name, _stated(form), "a whole number cannot be spread")])
    along = form.get("along", [])
    if not isinstance(along, list) or not all(isinstance(each, str) for each in along):
        raise InputError([Fault(f"{name}.along", shown(along), "a list of keys")])
    others = tuple(_key(known, each) for each in along)
    if others and key.now == 0.0:
        raise InputError([Fault(f"{name}.along", shown(along), "nothing goes along with 0")])
    if "percent" in numbers:
        _check_percent(key, numbers["percent"])
        reach = abs(key.now) * numbers["percent"] / 100.0
        low, high = max(key.now - reach, key.low), min(key.now + reach, key.high)
    elif "deviation" in numbers:
        if not numbers["deviation"] > 0.0:
            raise InputError([Fault(f"{name}.deviation", shown(numbers["deviation"]), "above 0")])
        reach = DEVIATIONS * numbers["deviation"]
        low, high = max(key.now - reach, key.low), min(key.now + reach, key.high)
    else:
        low, high = numbers["low"], numbers["high"]
    likely = numbers.get("likely")
    if not (
        key.low <= low < high <= key.high and low <= (low if likely is None else likely) <= high
    ):
        words = f"low < high, likely between, within {key.low:g} to {key.high:g} [{key.unit}]"
        raise InputError([Fault(name, _stated(form), words)])
    return Spread(key, low, high, likely, numbers.get("deviation"), others)


def _check_percent(key: Key, percent: float) -> None:
    """Refuse a share that is no range, or that leads out of what the key may be."""
    name = f"{key.name}.percent"
    if key.now == 0.0:
        raise InputError([Fault(name, shown(percent), "no share of 0 is a range: low and high")])
    most = 100.0 * min(key.now - key.low, key.high - key.now) / abs(key.now)
    if not 0.0 < percent <= most:
        words = f"above 0, at most {most:.6g}: within {key.low:g} to {key.high:g} [{key.unit}]"
        raise InputError([Fault(name, shown(percent), words)])


def _stated(form: Any) -> str:
    """What a key was spread by, as the file has it."""
    if not isinstance(form, dict):
        return shown(form)
    return f"{{ {', '.join(f'{part} = {shown(value)}' for part, value in form.items())} }}"


def _key(known: Mapping[str, Key], name: str) -> Key:
    if name in known:
        return known[name]
    if name.startswith("buildings"):
        raise InputError([Fault(name, "", "buildings stay where they are")])
    found = KEY.fullmatch(name)
    if found is None or found[2] not in getattr(SECTIONS.get(found[1]), "model_fields", {}):
        raise InputError([Fault(name, "", f"unknown key{nearest(name, known)}")])
    parts = [each for each in known if each.startswith(f"{name}[")]
    hint = f", but as {', '.join(parts)}" if parts else ""
    raise InputError([Fault(name, "", f"the mission does not state it as a number{hint}")])

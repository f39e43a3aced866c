"""The result of a calibration: values for a mission, how sure they are, and what they explain."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np
import tomli_w

from optuav.arrays import Floats
from optuav.calibration.least_squares import CONFIDENCE, ConfidenceInterval, Estimate
from optuav.errors import Fault, InputError
from optuav.mission import Mission, shipped
from optuav.mission.messages import number, printable
from optuav.mission.schema import SCHEMA
from optuav.network import vehicle

Role: TypeAlias = Literal["fitted", "repeat", "predicted"]
IN_THE_AIR = ("flight.flight_current_A", "flight.hover_current_A")
LEAST_S = 120.0  # shortest time for which a full battery keeps a UAV in the air, at 30 C
PLAIN = (1e-4, 1e6)  # sizes between which a number has no exponent
FINEST = 1e-9  # least relative distance of an end from its value that decides on decimals


@dataclass(frozen=True)
class Value:
    """A value for a dotted key of the mission, in its unit, and where it comes from.

    The interval holds it at a confidence of 95 %; None if unknown.
    """

    key: str
    value: float
    origin: str
    interval: ConfidenceInterval | None = None
    determined: bool = True

    def written(self, between: str) -> list[str]:
        """The value as text, and its interval if it is known, `between` its ends.

        Both have the same decimals, enough that the nearer end differs by two digits.
        """
        ends = self.interval or ()
        size = max(map(abs, (self.value, *ends)))
        apart = [gap for end in ends if (gap := abs(end - self.value)) > FINEST * size]
        decimals = 1 - math.floor(math.log10(min(apart))) if apart else 0
        if not apart:
            form = ".6g"
        elif PLAIN[0] <= size < PLAIN[1]:
            form = f".{max(decimals, 0)}f"
        else:
            form = f".{max(decimals + math.floor(math.log10(size)), 1)}e"
        spans = [between.join(f"{end:{form}}" for end in ends)] if ends else []
        return [f"{self.value:{form}}", *spans]

    @property
    def remark(self) -> str:
        """Origin and interval, as a comment."""
        if not self.determined:
            return f"{self.origin}; the data do not determine it"
        return f"; {CONFIDENCE:.0%}: ".join([self.origin, *self.written(" to ")[1:]])


@dataclass(frozen=True)
class Panel:
    """Observed and fitted values of one quantity, one an observation.

    Observations have names, or places `at` on an axis that `at_words` describes. Where roles are
    stated, one may also repeat a fitted one, or be predicted; groups stand for colours.
    """

    quantity: str
    unit: str
    observed: tuple[float, ...]
    fitted: tuple[float, ...]
    names: tuple[str, ...] = ()
    at: tuple[float, ...] = ()
    at_words: str = ""
    roles: tuple[Role, ...] = ()
    groups: tuple[str, ...] = ()

    @property
    def each_role(self) -> tuple[Role, ...]:
        """The role of every observation."""
        fitted: Role = "fitted"
        return self.roles or (fitted,) * len(self.observed)


@dataclass(frozen=True)
class Fit:
    """Values for a mission from data.

    Parameters
    ----------
    kind
        ``"kibam"``, ``"regimes"``, ``"rotor"`` or ``"table"``.
    sources
        The files, as they were named.
    data
        Their content, in a few words.
    values
        The values found.
    panels
        Observed and fitted values; empty if there are no observations.
    warnings
        Sentences on what the data do not determine, and on data that look wrong.
    settings
        Further keys of the mission that the values need.
    extends
        Mission that the fragment extends unless another is named.

    Examples
    --------
    >>> value = Value("battery.capacity_As", 662.42, "measured")
    >>> fit = Fit("kibam", ("cell.csv",), "one cell", (value,), ())
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

    @property
    def changes(self) -> dict[str, object]:
        """The values that are determined, by dotted key, as `optuav.Mission.replace` takes them."""
        found = {each.key: rounded(each.value) for each in self.values if each.determined}
        return {**self.settings, **found}

    def beside(self, mission: Mission) -> Fit:
        """The fit with a warning for every load that a mission's battery hardly holds.

        Parameters
        ----------
        mission
            The mission for which the values are; a battery that the fit found replaces its own.
        """
        found = {each.key: each.value for each in self.values if each.determined}
        battery = {key: value for key, value in found.items() if key.startswith("battery.")}
        capacity_As = float(vehicle.pool(mission.replace(battery)).capacity_As)
        doubts = [
            f"{key.rpartition('.')[2]} = {found[key]:.5g} would empty the full battery of the "
            f"mission {printable(mission.name)}, {capacity_As:.5g} A s, in "
            f"{capacity_As / found[key]:.3g} s: look at the units in the names of the columns, and "
            "at the mission that is extended"
            for key in IN_THE_AIR
            if key in found and capacity_As < LEAST_S * found[key]
        ]
        return replace(self, warnings=(*self.warnings, *doubts))

    def to_dict(self) -> dict[str, object]:
        """Everything as plain data."""
        return asdict(self)

    def to_toml(self, extends: str | None = None, file: str | Path = "") -> str:
        """A fragment of a mission file: the values, with intervals and origins as comments.

        Parameters
        ----------
        extends
            A shipped mission or the path of a file, from which all other values come; by default
            the mission to which the fit belongs.
        file
            Where the fragment will be; a path in `extends` is written relative to it.
        """
        base = self.extends if extends is None else extends
        if base not in shipped():
            base = Path(os.path.relpath(base, Path(file).parent)).as_posix()
        names = [printable(Path(source).name) for source in self.sources]
        lines = [
            f"# By optuav calibrate {self.kind} from {', '.join(names)}:",
            f"# {self.data}.",
            *(f"# Warning: {words}" for words in self.warnings),
            "",
            _entry("schema", SCHEMA),
            _entry("extends", base),
        ]
        keys = [*self.settings, *(each.key for each in self.values)]
        for table in dict.fromkeys(key.partition(".")[0] for key in keys):
            lines += ["", f"[{table}]", *self._lines(f"{table}.")]
        return "\n".join(lines) + "\n"

    def _lines(self, table: str) -> Iterator[str]:
        for key, value in self.settings.items():
            if key.startswith(table):
                yield _entry(key.removeprefix(table), value)
        for each in self.values:
            if each.key.startswith(table):
                entry = _entry(each.key.removeprefix(table), rounded(each.value))
                yield f"# {each.remark}"
                yield entry if each.determined else f"# {entry}"


def panel(
    quantity: str,
    unit: str,
    observed: Sequence[float] | Floats,
    fitted: Sequence[float] | Floats,
    at: Sequence[float] | Floats = (),
    at_words: str = "",
    groups: Iterable[str] = (),
) -> Panel:
    """A panel from sequences or arrays."""
    columns = (tuple(np.asarray(each).tolist()) for each in (observed, fitted, at))
    observed, fitted, at = columns
    return Panel(quantity, unit, observed, fitted, (), at, at_words, (), tuple(groups))


def values_of(found: Estimate, keys: Sequence[str], origin: str) -> tuple[Value, ...]:
    """Values of the mission from a fit whose parameters are the keys."""
    pairs = zip(keys, found.values.tolist(), found.intervals or (None,) * len(keys), strict=True)
    return tuple(
        Value(key, value, origin, interval, key not in found.undetermined)
        for key, value, interval in pairs
    )


def undetermined(found: Estimate) -> tuple[str, ...]:
    """A warning that names the parameters that the data do not determine, if there are any."""
    *names, last = [key.rpartition(".")[2] for key in found.undetermined] or [""]
    if not last:
        return ()
    if not names:
        return (f"the data do not determine {last}",)
    listed = f"{', '.join(names)} and {last}"
    return (f"the data cannot tell {listed} apart: a change of one is made up for by the others",)


def finished(found: Fit, hint: str = "") -> Fit:
    """The fit, if a mission may state its values.

    Raises
    ------
    InputError
        Naming every value that is determined and out of range; hint and warnings may say why.
    """
    reasons = "".join(f"; {each}" for each in (hint, *found.warnings) if each)
    faults = [
        Fault(
            f"{each.key}, {each.origin}",
            f"{each.value:.4g}",
            f"{allowed.words}{reasons}",
            ", ".join(found.sources),
        )
        for each in found.values
        if each.determined and (allowed := number(each.key)) and not allowed.accepts(each.value)
    ]
    if faults:
        raise InputError(faults)
    return found


def rounded(value: float) -> float:
    """A value to seven digits, more than any measurement has."""
    return float(f"{value:.7g}")


def counted(count: int, noun: str) -> str:
    """A number of things: ``"2 numbers"``."""
    return f"{count} {noun}{'s' * (count > 1)}"


def _entry(key: str, value: object) -> str:
    """A line of TOML."""
    return f"{key} = {tomli_w.dumps({'x': value}).partition('=')[2].strip()}"

"""What a calibration found: values for a mission, how sure they are, and what they explain."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, Literal, TypeAlias

from optuav.calibration.digits import digits
from optuav.calibration.estimation import CONFIDENCE, Estimate, Interval
from optuav.calibration.plausible import doubts_beside
from optuav.errors import Fault, InputError
from optuav.mission import Mission, shipped
from optuav.mission.sections import SCHEMA
from optuav.mission.words import number

Role: TypeAlias = Literal["fitted", "repeat", "predicted"]
IN_THE_AIR = ("flight.flight_current_A", "flight.hover_current_A")


@dataclass(frozen=True)
class Value:
    """A value for a key of the mission.

    Parameters
    ----------
    key
        Dotted key of the mission.
    value
        In the unit of the key.
    origin
        Where it comes from, in a few words.
    interval, bootstrap
        Where it lies at a confidence of 95 %, by the Jacobian and by refitting; None where that is
        not known.
    determined
        Whether the data tell it.
    """

    key: str
    value: float
    origin: str
    interval: Interval | None = None
    bootstrap: Interval | None = None
    determined: bool = True

    def written(self, between: str) -> list[str]:
        """The value and its intervals as a person writes them, `between` the ends of each."""
        intervals = [each for each in (self.interval, self.bootstrap) if each is not None]
        form = digits(self.value, chain.from_iterable(intervals))
        spans = (between.join(f"{end:{form}}" for end in each) for each in intervals)
        return [f"{self.value:{form}}", *spans]


@dataclass(frozen=True)
class Panel:
    """Observed and fitted values of one quantity.

    Parameters
    ----------
    quantity, unit
        What was observed.
    observed, fitted
        One an observation; in the unit.
    names
        Names of the observations; or empty, and then `at` tells them apart.
    at, at_words
        Where on the axis an observation lies, and what that axis is.
    roles
        Whether an observation is fitted, repeats one that is, or is predicted; empty if all are
        fitted.
    groups
        Which kind an observation is of, for its colour; or empty.
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
        """Of every observation."""
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
        What they hold, in a few words.
    values
        What was found.
    panels
        What it explains, by quantity.
    warnings
        What the data cannot tell, in sentences.
    settings
        Further keys of the mission that the values need.
    extends
        Mission that the fragment extends unless another is named.
    """

    kind: str
    sources: tuple[str, ...]
    data: str
    values: tuple[Value, ...]
    panels: tuple[Panel, ...]
    warnings: tuple[str, ...] = ()
    settings: Mapping[str, float | str] = field(default_factory=dict)
    extends: str = "paper"

    @property
    def changes(self) -> dict[str, float | str]:
        """What is determined, by dotted key, as `optuav.Mission.replace` takes it."""
        found = {each.key: rounded(each.value) for each in self.values if each.determined}
        return {**self.settings, **found}

    def beside(self, mission: Mission) -> Fit:
        """The fit for a mission: a warning more for every load that its battery hardly holds.

        Parameters
        ----------
        mission
            The mission that the values are for; of its battery, what the fit found comes first.
        """
        found = {each.key: each.value for each in self.values if each.determined}
        battery = {key: value for key, value in found.items() if key.startswith("battery.")}
        loads = {key.rpartition(".")[2]: found[key] for key in IN_THE_AIR if key in found}
        more = doubts_beside(mission.replace(battery), loads)
        return replace(self, warnings=(*self.warnings, *more))

    def to_dict(self) -> dict[str, Any]:
        """Everything as plain data."""
        return asdict(self)

    def to_toml(self, extends: str | None = None, file: str | Path = "") -> str:
        """A fragment of a mission file: the values, with intervals and origins as comments.

        Parameters
        ----------
        extends
            A shipped mission or the path of a file, from which all other values come; by default
            the mission the fit belongs to.
        file
            Where the fragment will be; a path in `extends` is told relative to it.
        """
        base = self.extends if extends is None else extends
        if base not in shipped():
            base = Path(os.path.relpath(base, Path(file).parent)).as_posix()
        names = [Path(source).name for source in self.sources]
        lines = [
            f"# By optuav calibrate {self.kind} from {', '.join(names)}:",
            f"# {self.data}.",
            *(f"# Warning: {words}" for words in self.warnings),
            "",
            f"schema = {SCHEMA}",
            f"extends = {_text(base)}",
        ]
        keys = [*self.settings, *(each.key for each in self.values)]
        for table in dict.fromkeys(key.partition(".")[0] for key in keys):
            lines += ["", f"[{table}]", *self._lines(table)]
        return "\n".join(lines) + "\n"

    def _lines(self, table: str) -> Iterator[str]:
        for key, value in self.settings.items():
            if key.startswith(f"{table}."):
                yield f"{key.partition('.')[2]} = {_text(value)}"
        for each in self.values:
            if each.key.startswith(f"{table}."):
                entry = f"{each.key.partition('.')[2]} = {rounded(each.value)!r}"
                yield f"# {remark(each)}"
                yield entry if each.determined else f"# {entry}"


def remark(value: Value) -> str:
    """What is to be said of a value: its origin, and how sure it is."""
    if not value.determined:
        return f"{value.origin}; the data do not determine it"
    if value.interval is None:
        return value.origin
    _, *spans = value.written(" to ")
    return f"{value.origin}; {CONFIDENCE:.0%}: {', by bootstrap '.join(spans)}"


def values_of(
    found: Estimate, keys: Sequence[str], origin: str | Sequence[str]
) -> tuple[Value, ...]:
    """Values of the mission from a fit whose parameters are the keys."""
    origins = [origin] * len(keys) if isinstance(origin, str) else origin
    return tuple(
        Value(
            key,
            float(found.values[number]),
            origins[number],
            found.intervals[number] if found.intervals else None,
            found.bootstrap[number] if found.bootstrap else None,
            key not in found.undetermined,
        )
        for number, key in enumerate(keys)
    )


def unclear(found: Estimate) -> tuple[str, ...]:
    """What the data do not tell, as a sentence if there is anything."""
    names = [key.rpartition(".")[2] for key in found.undetermined]
    if not names:
        return ()
    if len(names) == 1:
        return (f"the data do not determine {names[0]}",)
    listed = f"{', '.join(names[:-1])} and {names[-1]}"
    return (f"the data cannot tell {listed} apart: a change of one is made up for by the others",)


def refuse_outside(values: Iterable[Value], source: str, words: Iterable[str]) -> None:
    """Refuse what no mission may state, with words on where that may come from.

    Raises
    ------
    InputError
        Naming every such value that is determined.
    """
    faults, reasons = list[Fault](), "".join(f"; {each}" for each in words)
    for each in values:
        allowed = number(each.key)
        if each.determined and allowed is not None and not allowed.accepts(each.value):
            name, value = f"{each.key}, {each.origin}", f"{each.value:.4g}"
            faults.append(Fault(name, value, f"{allowed.words}{reasons}", source))
    if faults:
        raise InputError(faults)


def rounded(value: float) -> float:
    """To seven digits, more than any measurement has."""
    return float(f"{value:.7g}")


def _text(value: float | str) -> str:
    return f'"{value}"' if isinstance(value, str) else repr(value)

"""Engines: the protocol that they follow, what each takes, and the registry by name.

An engine is added from outside the package by `register`, or handed over as an object. Those of the
package load when they are first asked for.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Protocol

import numpy as np

from optuav.arrays import Values
from optuav.engines.solution import Solution, stacked
from optuav.errors import Fault, InputError
from optuav.modelling.classify import Traits
from optuav.modelling.model import Model

MOST_UNKNOWNS = 2


@dataclass(frozen=True)
class Capability:
    """What an engine takes and gives.

    Parameters
    ----------
    name
        As `optuav.solve` takes it.
    gives
        What its answer is worth, for a reader.
    nonlinear
        Whether it takes models that are not linear.
    integer
        Whether it takes binary unknowns.
    slots
        Whether it takes times in whole slots; None if it takes nothing else.
    most_unknowns
        Largest number of unknowns; None for any.
    needs_smooth
        Whether it needs derivatives.
    needs_lower_bounds
        Whether every unknown needs a lower bound.
    needs_levelling
        Whether it needs the longest of at most two times as objective, and as constraints what
        phases of constant current give.
    """

    name: str
    gives: str
    nonlinear: bool = False
    integer: bool = False
    slots: bool | None = False
    most_unknowns: int | None = None
    needs_smooth: bool = False
    needs_lower_bounds: bool = False
    needs_levelling: bool = False

    def obstacle(self, model: Traits, slots: bool) -> str:
        """Why the engine does not take a model; empty if it does."""
        if self.most_unknowns is not None and model.unknowns > self.most_unknowns:
            return f"it takes at most {self.most_unknowns} unknowns, the model has {model.unknowns}"
        if not model.linear and not self.nonlinear:
            where, why = model.nonlinear_label, model.nonlinear_words
            return f"it takes linear models only; {where!r} is not: {why}"
        if self.needs_smooth and not model.smooth:
            return f"it needs derivatives; {model.rough} has kinks, or none that are known"
        if self.needs_lower_bounds and model.open_below:
            return f"it needs a lower bound on {', '.join(model.open_below)}"
        if model.integer and not self.integer:
            return "it takes no binary unknowns"
        if self.needs_levelling and not model.longest:
            return "it looks for the largest of at most two unknowns from 0, and for nothing else"
        if self.needs_levelling and model.unlevelled_label:
            where, why = model.unlevelled_label, model.unlevelled_words
            return f"{where!r} is not what phases of constant current give: {why}"
        if slots and self.slots is False:
            return "it takes continuous times only"
        return ""


class Compiled(Protocol):
    """A model handed to an engine once, to be solved with changed parameters."""

    def solve(self, values: Values) -> Solution:
        """Solve with values of parameters that differ from the model's, by name.

        Numbers, or arrays with one entry a programme.
        """
        ...


class Engine(Protocol):
    """What solves models: a small object, whose fields are options of its own.

    Examples
    --------
    >>> from optuav.engines.registry import engine
    >>> engine("cvxpy")
    Cvxpy(solver=None)
    >>> engine("bracket").takes.most_unknowns
    2
    """

    @property
    def name(self) -> str:
        """Name by which `optuav.solve` takes it."""
        ...

    @property
    def takes(self) -> Capability:
        """Which models it takes, and what its answers are worth."""
        ...

    def solve(
        self,
        model: Model,
        programmes: int,
        values: Values | None = None,
        *,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
    ) -> Solution:
        """Solve a model for every entry of its parameters.

        Parameters
        ----------
        model
            A declaration that it takes.
        programmes
            Number of entries of those parameters that are arrays, at least 1.
        values
            Values of parameters that differ from the model's, by name.
        slot_s
            Length of the slots in which times are counted [s]; None for continuous times.
        time_limit_s
            Longest that one programme may take [s]; None for no limit. An engine that always ends
            soon may ignore it.

        Raises
        ------
        SolverError
            If it fails, or the time limit passes.
        """
        ...

    def compile(
        self,
        model: Model,
        programmes: int = 1,
        *,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
    ) -> Compiled:
        """Hand over a model once, to be solved often; the arguments are those of `solve`."""
        ...


@dataclass(frozen=True)
class SolvedAgain:
    """A compiled model of an engine that has nothing to prepare.

    Parameters
    ----------
    engine, model, programmes, slot_s, time_limit_s
        As for `Engine.solve`.
    """

    engine: Engine
    model: Model
    programmes: int
    slot_s: float | None = None
    time_limit_s: float | None = None

    def solve(self, values: Values) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        return self.engine.solve(
            self.model,
            self.programmes,
            values,
            slot_s=self.slot_s,
            time_limit_s=self.time_limit_s,
        )


class Direct:
    """Base of engines that have nothing to prepare: a compiled model is solved again."""

    def compile(
        self: Engine,
        model: Model,
        programmes: int = 1,
        *,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
    ) -> Compiled:
        """Hand over a model, to be solved often; see `Engine`."""
        return SolvedAgain(self, model, programmes, slot_s, time_limit_s)


CAPABILITIES = (
    Capability(
        "closed-form",
        "exact, over all itineraries at once, with the constraints that bind",
        most_unknowns=MOST_UNKNOWNS,
        needs_lower_bounds=True,
    ),
    Capability(
        "cvxpy",
        "global, with multipliers; binary unknowns and slots by branch and bound",
        integer=True,
        slots=True,
    ),
    Capability(
        "bracket",
        "a feasible time and proof that none is longer, through both wells",
        nonlinear=True,
        most_unknowns=MOST_UNKNOWNS,
        needs_lower_bounds=True,
        needs_levelling=True,
    ),
    Capability(
        "casadi",
        "a local optimum, the best of several starts",
        nonlinear=True,
        needs_smooth=True,
    ),
    Capability(
        "grid",
        "exhaustive over whole slots: the verifying reference",
        nonlinear=True,
        slots=None,
        most_unknowns=MOST_UNKNOWNS,
        needs_lower_bounds=True,
    ),
)
"""What the engines of the package take, in the order in which "auto" prefers them."""


class Single(Protocol):
    """One programme of a model, to be solved with changed parameters."""

    def solve(self, values: Mapping[str, float]) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        ...


@dataclass(frozen=True)
class RowByRow:
    """A compiled model of an engine that solves one programme after the other.

    Parameters
    ----------
    single
        What solves one.
    rows
        Values of the parameters of each, by name.
    """

    single: Single
    rows: Sequence[Mapping[str, float]]

    def solve(self, values: Values) -> Solution:
        """Solve with values of parameters that differ from the model's, by name."""
        changed = [
            {name: float(each[index] if np.ndim(each) else each) for name, each in values.items()}
            for index in range(len(self.rows))
        ]
        found = [
            self.single.solve({**row, **more}) for row, more in zip(self.rows, changed, strict=True)
        ]
        return found[0] if len(found) == 1 else stacked(found)


class OneByOne(ABC):
    """Base of engines that prepare a model, and solve one programme after the other."""

    @abstractmethod
    def prepare(self, model: Model, slot_s: float | None, time_limit_s: float | None) -> Single:
        """Hand over a model, to be solved for one programme at a time."""

    def compile(
        self,
        model: Model,
        programmes: int = 1,
        *,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
    ) -> Compiled:
        """Hand over a model, to be solved often; see `Engine`."""
        rows = [model.row(index) for index in range(programmes)]
        return RowByRow(self.prepare(model, slot_s, time_limit_s), rows)

    def solve(
        self,
        model: Model,
        programmes: int,
        values: Values | None = None,
        *,
        slot_s: float | None = None,
        time_limit_s: float | None = None,
    ) -> Solution:
        """Solve a model for every entry of its parameters; see `Engine`."""
        compiled = self.compile(model, programmes, slot_s=slot_s, time_limit_s=time_limit_s)
        return compiled.solve(values or {})


ENGINES = tuple(each.name for each in CAPABILITIES)
"""Names of the engines of the package."""
CLASSES: Mapping[str, str] = {
    "closed-form": "closed_form.ClosedForm",
    "cvxpy": "cvxpy_engine.Cvxpy",
    "bracket": "bracket.Bracket",
    "casadi": "casadi_engine.Casadi",
    "grid": "grid.Grid",
}
"""Module and class of each."""

_registered: dict[str, Engine] = {}


def register(added: Engine) -> None:
    """Add an engine, which `optuav.solve` then knows by its name.

    It comes after those of the package where "auto" looks for one that takes a model.

    Raises
    ------
    InputError
        If the package has an engine of that name.
    """
    if added.name in ENGINES:
        raise InputError(
            [Fault("engine", repr(added.name), "a name that the package does not use")]
        )
    _registered[added.name] = added


def unregister(name: str) -> None:
    """Take out an engine that was added."""
    del _registered[name]


def names() -> tuple[str, ...]:
    """Names of all engines, those of the package first."""
    return (*ENGINES, *_registered)


def engine(wanted: str | Engine) -> Engine:
    """The engine of a name, with its default options; an engine stays what it is.

    Raises
    ------
    InputError
        If there is no engine of that name.
    """
    if not isinstance(wanted, str):
        return wanted
    if wanted in _registered:
        return _registered[wanted]
    if wanted not in CLASSES:
        raise InputError([Fault("engine", repr(wanted), f"one of {', '.join(names())}")])
    module, _, name = CLASSES[wanted].partition(".")
    found: Engine = getattr(import_module(f"optuav.engines.{module}"), name)()
    return found


def capability(name: str) -> Capability:
    """What the engine of a name takes; those of the package are not loaded for it."""
    found = next((each for each in CAPABILITIES if each.name == name), None)
    return engine(name).takes if found is None else found


def takers(model: Traits, slots: bool) -> tuple[str, ...]:
    """Names of the engines that take a model."""
    return tuple(name for name in names() if not capability(name).obstacle(model, slots))


def need(wanted: str | Engine, model: Traits, slots: bool) -> None:
    """Refuse an engine that does not take a model, and name those that do.

    Raises
    ------
    InputError
        With the reason; also if there is no such engine.
    """
    takes = capability(wanted) if isinstance(wanted, str) else wanted.takes
    if why := takes.obstacle(model, slots):
        others = ", ".join(takers(model, slots)) or "none"
        raise InputError(
            f"engine {takes.name} does not take this model: {why}. Engines that do: {others}"
        )

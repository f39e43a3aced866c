"""Engines: their base class, which states what each takes, and the registry by name.

An engine from outside the package is registered by `optuav.register`, or handed over as an object.
Those of the package load when they are first asked for.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Literal, TypeAlias

import numpy as np

from optuav.arrays import Values
from optuav.engines.solution import Solution, concatenated
from optuav.errors import Fault, InputError, shown
from optuav.modelling.classify import Traits
from optuav.modelling.model import Model
from optuav.silence import silent

MOST_UNKNOWNS = 2
Need: TypeAlias = Literal["derivatives", "lower bounds", "levelling"]
Compiled: TypeAlias = Callable[[Values], Solution]
"""A model handed to an engine once: call it with values of parameters that differ from the model's.

They are numbers by name, or arrays with one entry a programme.
"""
Single: TypeAlias = Callable[[Mapping[str, float]], Solution]  # The same for one programme


class Engine(ABC):
    """Base class of engines: small objects that solve models; their fields are their options.

    A subclass states its `name` and, as attributes, which models it takes, and defines `solve`.
    As it stands, an engine takes linear models without binary unknowns, in continuous times.

    Examples
    --------
    >>> from optuav.engines.registry import engine
    >>> engine("cvxpy")
    Cvxpy(solver=None)
    >>> engine("grid").nonlinear, engine("closed-form").nonlinear
    (True, False)
    """

    name: str
    """Name of the engine for `optuav.solve`."""
    nonlinear: bool = False
    """Whether it takes models that are not linear."""
    integer: bool = False
    """Whether it takes binary unknowns."""
    slots: bool | None = False
    """Whether it takes times in whole slots; None if it takes nothing else."""
    most_unknowns: int | None = None
    """The most unknowns that it takes; None for any number."""
    needs: tuple[Need, ...] = ()
    """``"derivatives"`` everywhere; ``"lower bounds"`` on every unknown; ``"levelling"``: the
    longest of at most two times, or a multiple of it, as objective, and as constraints what phases
    of constant current give."""

    def obstacle(self, model: Traits, slots: bool) -> str:
        """Why the engine does not take a model; empty if it does."""
        if self.most_unknowns is not None and model.unknowns > self.most_unknowns:
            most = f"{self.most_unknowns} unknown{'s' * (self.most_unknowns != 1)}"
            return f"it accepts at most {most}, the model has {model.unknowns}"
        if model.nonlinear and not self.nonlinear:
            label, why = model.nonlinear
            return f"it accepts only linear models; {label!r} is not: {why}"
        if "derivatives" in self.needs and model.rough:
            return f"it needs derivatives; {model.rough} has kinks, or none that are known"
        if "lower bounds" in self.needs and model.open_below:
            return f"it needs a lower bound on {', '.join(model.open_below)}"
        if model.integer and not self.integer:
            return "it does not support binary unknowns"
        if "levelling" in self.needs and not model.longest:
            return "it looks for the largest of at most two unknowns from 0, and for nothing else"
        if "levelling" in self.needs and model.unlevelled:
            label, why = model.unlevelled
            return f"{label!r} does not come from phases of constant current: {why}"
        if slots and self.slots is False:
            return "it accepts only continuous times"
        return ""

    @abstractmethod
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
            Length of the slots that count times [s]; None for continuous times.
        time_limit_s
            Time limit for one programme [s]; None for no limit. An engine that always ends
            soon may ignore it.

        Raises
        ------
        SolverError
            If it fails, or the time limit passes.
        """

    def compile(self, model: Model, programmes: int = 1, **limits: float | None) -> Compiled:
        """Hand over a model once, to be solved often; by default each call solves it anew.

        Parameters
        ----------
        model, programmes
            A declaration that it takes, and the number of entries of its arrays, at least 1.
        limits
            ``slot_s`` and ``time_limit_s`` [s], as for `solve`.

        Returns
        -------
        Compiled
            Call it with values of parameters by name for a `Solution`; it raises as `solve` does.

        Raises
        ------
        InputError
            If the model has a form that the engine cannot prepare.
        """
        return lambda values: self.solve(model, programmes, values, **limits)


class OneByOne(Engine):
    """Base of engines that prepare a model, and solve one programme after the other in silence."""

    @abstractmethod
    def prepare(
        self, model: Model, slot_s: float | None = None, time_limit_s: float | None = None
    ) -> Single:
        """Hand over a model, to be solved for one programme at a time."""

    def compile(self, model: Model, programmes: int = 1, **limits: float | None) -> Compiled:
        """Hand over a model, to be solved often; see `Engine`."""
        with silent():
            single = self.prepare(model, **limits)
        rows = [model.row(index) for index in range(programmes)]

        def solve(values: Values) -> Solution:
            solutions = []
            for k, row in enumerate(rows):
                changed = {n: float(v[k] if np.ndim(v) else v) for n, v in values.items()}
                with silent():
                    solutions.append(single({**row, **changed}))
            return solutions[0] if len(solutions) == 1 else concatenated(solutions)

        return solve

    def solve(
        self, model: Model, programmes: int, values: Values | None = None, **limits: float | None
    ) -> Solution:
        """Solve a model for every entry of its parameters; see `Engine`."""
        valued = model.with_values(values) if values else model
        return self.compile(valued, programmes, **limits)({})


AUTO = "auto"  # Stands for the first engine that takes a model
CLASSES = {
    "closed-form": "closed_form.ClosedForm",
    "cvxpy": "cvxpy_engine.Cvxpy",
    "bracket": "bracket.Bracket",
    "casadi": "casadi_engine.Casadi",
    "grid": "grid.Grid",
}
"""Module and class of each engine of the package by name, in the order of "auto"."""
ENGINES = tuple(CLASSES)  # Names of the engines of the package
ADDED: dict[str, Engine] = {}
"""Engines from outside the package by name, see `optuav.register`; `auto` tries them last."""


def engine_names() -> tuple[str, ...]:
    """Names of all engines, in the order in which `auto` tries them."""
    return (*ENGINES, *ADDED)


def of_the_package(given: Engine) -> bool:
    """Return whether an engine is the package's own, whose solutions need no check."""
    return type(given).__module__.startswith("optuav.")


def conforming(given: Engine) -> Engine:
    """Return a given engine; refuse other things, such as a class instead of its object."""
    if isinstance(given, type):
        words = f"must be an instance, such as {given.__name__}(), not the class"
        raise InputError([Fault("engine", shown(given), words)])
    if not isinstance(given, Engine) or not isinstance(getattr(given, "name", None), str):
        words = "a name, or an instance of a subclass of Engine with a name"
        raise InputError([Fault("engine", shown(given), words)])
    if hasattr(given, "takes"):
        words = "must be left out; set nonlinear, integer, slots, most_unknowns and needs instead"
        raise InputError([Fault(f"{type(given).__name__}.takes", "", words)])
    if not of_the_package(given) and given.name in ("", AUTO, *ENGINES):
        raise InputError([Fault("engine", shown(given.name), "a name of its own")])
    return given


def engine(wanted: str | Engine) -> Engine:
    """The engine of a name, with its default options; an engine is returned unchanged."""
    if not isinstance(wanted, str):
        return conforming(wanted)
    if wanted in ADDED:
        return ADDED[wanted]
    if wanted not in CLASSES:
        raise InputError([Fault("engine", shown(wanted), f"one of {', '.join(engine_names())}")])
    module, _, name = CLASSES[wanted].partition(".")
    found: Engine = getattr(import_module(f"optuav.engines.{module}"), name)()
    return found


def takers(model: Traits, slots: bool) -> tuple[str, ...]:
    """Names of the engines that take a model."""
    return tuple(name for name in engine_names() if not engine(name).obstacle(model, slots))

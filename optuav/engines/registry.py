"""Engines: the protocol that they follow, what each takes, and the registry by name.

An engine from outside the package is registered by `optuav.register`, or handed over as an object.
Those of the package load when they are first asked for.
"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Literal, Protocol, TypeAlias

import numpy as np

from optuav.arrays import Values
from optuav.engines.solution import Solution, stacked
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


@dataclass(frozen=True)
class Capability:
    """Capability of an engine: the models it takes.

    Parameters
    ----------
    name
        Name of the engine for `optuav.solve`.
    nonlinear, integer
        Whether it takes models that are not linear, and binary unknowns.
    slots
        Whether it takes times in whole slots; None if it takes nothing else.
    most_unknowns
        None for any number.
    needs
        ``"derivatives"`` everywhere; ``"lower bounds"`` on every unknown; ``"levelling"``: the
        longest of at most two times, or a multiple of it, as objective, and as constraints what
        phases of constant current give.

    Examples
    --------
    >>> from optuav.engines.registry import engine
    >>> engine("grid").takes.nonlinear, engine("closed-form").takes.nonlinear
    (True, False)
    """

    name: str
    nonlinear: bool = False
    integer: bool = False
    slots: bool | None = False
    most_unknowns: int | None = None
    needs: tuple[Need, ...] = ()

    def obstacle(self, model: Traits, slots: bool) -> str:
        """Why the engine does not take a model; empty if it does."""
        if self.most_unknowns is not None and model.unknowns > self.most_unknowns:
            most = f"{self.most_unknowns} unknown{'s' * (self.most_unknowns != 1)}"
            return f"it takes at most {most}, the model has {model.unknowns}"
        if model.nonlinear and not self.nonlinear:
            label, why = model.nonlinear
            return f"it takes linear models only; {label!r} is not: {why}"
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
            return f"{label!r} is not what phases of constant current give: {why}"
        if slots and self.slots is False:
            return "it takes continuous times only"
        return ""


class Engine(Protocol):
    """Protocol of an engine: a small object that solves models; its fields are its options.

    A subclass states `name` and `takes`, and defines `solve`.

    Examples
    --------
    >>> from optuav.engines.registry import engine
    >>> engine("cvxpy")
    Cvxpy(solver=None)
    >>> engine("bracket").takes.most_unknowns
    2
    """

    name: str
    """Name of the engine for `optuav.solve`."""
    takes: Capability
    """The models it takes."""

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
            return solutions[0] if len(solutions) == 1 else stacked(solutions)

        return solve

    def solve(
        self, model: Model, programmes: int, values: Values | None = None, **limits: float | None
    ) -> Solution:
        """Solve a model for every entry of its parameters; see `Engine`."""
        known = model.with_values(values) if values else model
        return self.compile(known, programmes, **limits)({})


AUTO = "auto"  # Stands for the first engine that takes a model
PLACES = {
    "closed_form.ClosedForm": Capability(
        "closed-form", most_unknowns=MOST_UNKNOWNS, needs=("lower bounds",)
    ),
    "cvxpy_engine.Cvxpy": Capability("cvxpy", integer=True, slots=True),
    "bracket.Bracket": Capability(
        "bracket", True, most_unknowns=MOST_UNKNOWNS, needs=("lower bounds", "levelling")
    ),
    "casadi_engine.Casadi": Capability("casadi", nonlinear=True, needs=("derivatives",)),
    "grid.Grid": Capability(
        "grid", True, slots=None, most_unknowns=MOST_UNKNOWNS, needs=("lower bounds",)
    ),
}
"""Capability of each engine of the package by module and class, in the order of "auto".

In slots "auto" prefers one that takes nothing else.
"""
CAPABILITIES = tuple(PLACES.values())
CLASSES = {capability.name: place for place, capability in PLACES.items()}
ENGINES = tuple(CLASSES)  # Names of the engines of the package

ADDED: dict[str, Engine] = {}
"""Engines from outside the package by name, see `optuav.register`; `auto` tries them last."""
capabilities = {capability.name: capability for capability in CAPABILITIES}
"""Capability of each engine by name: built-in engines first, then registered ones."""


def add(engine: Engine) -> None:
    """Make an engine known by its name."""
    ADDED[engine.name], capabilities[engine.name] = engine, engine.takes


def take_out(name: str) -> None:
    """Forget an engine that was added."""
    del ADDED[name], capabilities[name]


def of_the_package(given: Engine) -> bool:
    """Return whether an engine is the package's own, whose solutions need no check."""
    return type(given).__module__.startswith("optuav.")


def conforming(given: Engine) -> Engine:
    """Return a given engine; refuse other things, such as a class instead of its object."""
    if isinstance(given, type):
        words = f"must be an instance, such as {given.__name__}(), not the class"
        raise InputError([Fault("engine", shown(given), words)])
    known = isinstance(getattr(given, "takes", None), Capability)
    known &= isinstance(getattr(given, "name", None), str)
    known &= all(callable(getattr(given, method, None)) for method in ("solve", "compile"))
    if not known:
        words = "a name, or an object with name, takes (a Capability), solve and compile, an Engine"
        raise InputError([Fault("engine", shown(given), words)])
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
        raise InputError([Fault("engine", shown(wanted), f"one of {', '.join(capabilities)}")])
    module, _, name = CLASSES[wanted].partition(".")
    found: Engine = getattr(import_module(f"optuav.engines.{module}"), name)()
    return found


def takers(model: Traits, slots: bool) -> tuple[str, ...]:
    """Names of the engines that take a model."""
    return tuple(name for name, each in capabilities.items() if not each.obstacle(model, slots))


def need(wanted: str | Engine, model: Traits, slots: bool, linear: str = "") -> None:
    """Refuse an engine that does not take a model, and say which do, or how to get a linear one."""
    known = capabilities.get(wanted) if isinstance(wanted, str) else None
    takes = known or engine(wanted).takes  # which refuses a name that is not known
    if why := takes.obstacle(model, slots):
        others = ", ".join(takers(model, slots)) or "none"
        hint = linear if model.nonlinear and not takes.nonlinear else ""
        words = f"engine {takes.name} does not take this model: {why}."
        raise InputError(f"{words} Engines that do: {others}{hint}")


def preferred(model: Traits, slots: bool) -> Engine:
    """The first engine that takes a model, in slots one for only slots; refused if none does."""
    able = takers(model, slots)
    slots_only = [name for name in able if capabilities[name].slots is None]
    others = [name for name in able if name not in slots_only]
    if names := [*slots_only, *others] if slots else others:
        return engine(names[0])
    more = f" in continuous times: state slot_s for engine {slots_only[0]}" if slots_only else ""
    raise InputError(f"no engine takes this model ({model}){more}")

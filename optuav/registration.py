"""Registration: things from outside the package are checked, and known by name from then on."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from inspect import Parameter, get_annotations, isabstract, isfunction, isroutine, signature
from typing import TYPE_CHECKING, Any, TypeVar, get_args

from formulations.formulation import Formulation
from optuav.engines.registry import ADDED, AUTO, ENGINES, Engine, Need, OneByOne, conforming
from optuav.errors import Fault, InputError, nearest, refuse, shown
from optuav.fields import MissionSection
from optuav.flight import FLIGHTS
from optuav.flight.model import FlightModel, FlightTable
from optuav.laser import BEAMS
from optuav.laser.beam import Beam, LaserTable
from optuav.mission import Mission
from optuav.mission.forms import CHOICES, SINGLE, TABLES, forms, table_keys
from optuav.mission.messages import unlisted
from optuav.plan.pictures import OF_THE_PACKAGE, PICTURES, Picture
from optuav.plugins import GROUP, read_plugins
from optuav.solving.question import OWN_PROBLEMS, PROBLEM_NAMES, arguments_of, own_problem_faults

if TYPE_CHECKING:
    from collections.abc import Collection

Thing = TypeVar(
    "Thing", bound=type[FlightModel | Beam | Formulation] | Formulation | Engine | Picture
)
Result = TypeVar("Result")

NAME = re.compile(r"\w[\w-]*")
KINDS = (
    "must be a flight model (a subclass of FlightModel), a beam (a subclass of Beam), a problem (a "
    "subclass of Formulation, or an instance), an engine (an instance of a subclass of Engine) "
    "or a picture (a function of a plan)"
)


@dataclass(frozen=True)
class Kind:
    """One kind of things: where they are known by name, and what is wrong with a new one."""

    words: str
    known: Mapping[str, Any]
    of_the_package: Collection[str]
    faults: Callable[[Any, str], Iterator[Fault]]
    add: Callable[[str, Any], None]
    take_out: Callable[[str], object]

    def registered(self) -> dict[str, Any]:
        """The things from outside the package by name."""
        return {k: thing for k, thing in self.known.items() if k not in self.of_the_package}


def register(thing: Thing) -> Thing:
    """Register a class, function or instance of your own under its name, like those of the package.

    Parameters
    ----------
    thing
        A class of flight models, for ``flight.model``; a class of beams, for ``laser.beam``; a
        problem, as a class or an instance, for ``problem``; an engine, an instance, for ``engine``;
        or a picture, a function of a plan that returns axes of matplotlib, which
        `optuav.plots.save_pictures` saves under the name of the function. It replaces an earlier
        thing of the same name: load missions again after that.

    Returns
    -------
    The thing itself, so that `register` decorates classes and functions.

    Raises
    ------
    InputError
        With everything that the thing lacks, or if the package has a thing of the same name.

    Examples
    --------
    >>> import optuav
    >>> @optuav.register
    ... def my_wells(plan):
    ...     return optuav.plots.wells([plan])
    >>> optuav.unregister("my_wells")
    >>> try:
    ...     optuav.register(optuav.Grid())
    ... except optuav.InputError as error:
    ...     print(error)
    engine = 'grid': must be a name of its own, none of the package
    """
    kind, name = kind_of(thing)
    if not isinstance(name, str) or not NAME.fullmatch(name):
        words = f"the {kind.words} needs a name of letters, digits, - and _"
        raise InputError([Fault(f"{kind.words} name", shown(name), words)])
    if name in kind.of_the_package:
        raise InputError([Fault(kind.words, shown(name), "a name of its own, none of the package")])
    refuse(kind.faults(thing, name))
    kind.add(name, thing)
    return thing


def unregister(name: str) -> None:
    """Remove everything that was registered under a name.

    Parameters
    ----------
    name
        Name of the thing.

    Raises
    ------
    InputError
        If nothing was registered under it.

    Examples
    --------
    >>> import optuav
    >>> try:
    ...     optuav.unregister("my-engine")
    ... except optuav.InputError as error:
    ...     print(error)
    name = 'my-engine': must be one that was registered: none
    """
    kinds = [kind for kind in EVERY_KIND if name in [*kind.registered()]]
    if not kinds:
        names = ", ".join(name for kind in EVERY_KIND for name in kind.registered()) or "none"
        raise InputError([Fault("name", shown(name), f"one that was registered: {names}")])
    for kind in kinds:
        kind.take_out(name)


def with_registered(function: Callable[[int], Result]) -> Callable[[int], Result]:
    """Return a function that registers in a worker of Dask what is registered in this process.

    Things that cannot be sent must come from plugins there.
    """
    from distributed.protocol.pickle import dumps

    sent, unsent = list[Any](), dict[tuple[str, str], str]()
    for kind in EVERY_KIND:
        for name, thing in kind.registered().items():
            try:
                dumps(thing)
                sent.append(thing)
            except Exception as error:  # Of any kind, as things pickle themselves
                unsent[kind.words, name] = f"{type(error).__name__}: {error}"
    return partial(_registering, sent, unsent, function)


def _registering(
    sent: list[Any],
    unsent: Mapping[tuple[str, str], str],
    function: Callable[[int], Result],
    number: int,
) -> Result:
    """The value of a function, by a worker."""
    read_plugins()
    for thing in sent:
        register(thing)
    things = [(kind.words, name) for kind in EVERY_KIND for name in kind.registered()]
    words = f"register it in a plugin, by an entry point of the group {GROUP}"
    refuse(
        Fault(kind, shown(name), f"cannot be sent to a worker ({why}): {words}")
        for (kind, name), why in unsent.items()
        if (kind, name) not in things
    )
    return function(number)


def kind_of(thing: object) -> tuple[Kind, object]:
    """The kind of a thing, and its name."""
    if isinstance(thing, type):
        for kind, base in ((FLIGHT, FlightModel), (BEAM, Beam)):
            if issubclass(thing, base):
                return kind, getattr(thing, "name", None)
        if issubclass(thing, Formulation):
            return PROBLEM, thing.__name__
        if issubclass(thing, Engine):
            conforming(thing)  # type: ignore[arg-type]
    elif isinstance(thing, Formulation):
        return PROBLEM, thing.name
    elif isinstance(thing, FlightModel | Beam):
        name = type(thing).__name__
        raise InputError([Fault("register", name, f"must be the class {name}, not an instance")])
    elif isfunction(thing):
        return PICTURE, thing.__name__
    elif isinstance(thing, Engine) or hasattr(thing, "solve"):
        return ENGINE, conforming(thing).name  # type: ignore[arg-type]
    raise InputError([Fault("register", shown(thing), KINDS)])


def _faults_of_model(
    table: str, base: type, form: type[MissionSection], kind: Any, name: str
) -> Iterator[Fault]:
    """Everything that is wrong with a flight model or a beam, which is made of tables."""
    if isabstract(kind):
        lacks = ", ".join(sorted(kind.__abstractmethods__))
        yield Fault(kind.__name__, "", f"must define {lacks}, as {base.__name__} declares")
    key, own_form = CHOICES[table].key, getattr(kind, "table", None)
    if not (isinstance(own_form, type) and issubclass(own_form, form)):
        words = f"the form of [{table}], a subclass of {form.__name__}"
        yield Fault(f"{kind.__name__}.table", "" if own_form is None else shown(own_form), words)
    else:
        names = get_args(own_form.model_fields[key].annotation)
        if not {name, str} & {*names, own_form.model_fields[key].annotation}:
            words = f'its {key} must be Literal["{name}"], the name of {kind.__name__}'
            yield Fault(f"{own_form.__name__}.{key}", ", ".join(map(shown, names)), words)
        try:
            own_form.model_rebuild()
        except Exception as error:  # Of pydantic, which names a type that it does not know
            yield Fault(
                own_form.__name__, "", f"cannot be read as a table: {str(error).splitlines()[0]}"
            )
    yield from _faults_of_methods(kind, base)
    yield from _faults_of_constructor(kind, table, kind.needs)
    for attribute in ("needs", "refuses"):
        yield from _faults_of_dotted(f"{kind.__name__}.{attribute}", getattr(kind, attribute))


def _faults_of_methods(kind: type, base: type) -> Iterator[Fault]:
    """Methods that are none, or do not take what the base class says they take."""
    for name in vars(base):
        method = getattr(base, name)
        if name.startswith("_") or not isroutine(method):
            continue
        own, place = getattr(kind, name), f"{kind.__name__}.{name}"
        words = f"must be defined as {name}({', '.join(signature(method).parameters)})"
        if not callable(own):
            yield Fault(place, shown(own), f"{words}, as it is called")
            continue
        try:
            signature(own).bind(*signature(method).parameters)
        except (TypeError, ValueError):
            yield Fault(place, "", words)


def _faults_of_constructor(kind: type, table: str, needs: object) -> Iterator[Fault]:
    """Parameters of a constructor that are no tables, or that a mission may not have."""
    allowed = SINGLE
    parameters = signature(kind).parameters
    for name, parameter in parameters.items():
        place = f"{kind.__name__}({name})"
        if parameter.kind not in (Parameter.POSITIONAL_OR_KEYWORD, Parameter.KEYWORD_ONLY):
            yield Fault(place, "", "must be a parameter that is given by its name")
        elif name not in allowed:
            choices = ", ".join(choice for choice in TABLES if choice in allowed)
            words = f"must be the name of a table of a mission: {choices}"
            yield Fault(place, "", words + nearest(name, allowed))
        elif (
            parameter.default is Parameter.empty
            and not Mission.model_fields[name].is_required()
            and Mission.model_fields[name].default is None
            and name not in (table, *(needs if isinstance(needs, tuple | list) else ()))
        ):
            words = f'is not in every mission: add it to needs = ("{name}",), or a default'
            yield Fault(place, "", words)
    declared = set[str]()
    for base in kind.__mro__:
        with suppress(NameError):  # Of types that only a type checker imports
            declared.update(get_annotations(base))
    for name in sorted(declared & {*allowed} - parameters.keys()):
        words = "is not set by the constructor: decorate the class with @dataclass(eq=False)"
        yield Fault(f"{kind.__name__}.{name}", "", words)


def _faults_of_dotted(place: str, keys: object) -> Iterator[Fault]:
    """Tables and dotted keys that no mission has."""
    if not isinstance(keys, tuple | list):
        yield Fault(place, shown(keys), 'a tuple of tables and keys, such as ("body",)')
        return
    for dotted in keys:
        table, _, key = str(dotted).partition(".")
        if not forms(table):
            words = f"is no table of a mission; they are {', '.join(TABLES)}"
            yield Fault(place, shown(dotted), words)
        elif key and key not in table_keys(table):
            yield Fault(
                place, shown(dotted), f"is no key of [{table}]{nearest(key, table_keys(table))}"
            )


def _faults_of_problem(problem: type[Formulation] | Formulation, name: str) -> Iterator[Fault]:
    """Everything that is wrong with a problem."""
    kind = problem if isinstance(problem, type) else type(problem)
    if isabstract(kind):
        yield Fault("problem", name, "must define declare(self, model, given)")
        return
    yield from own_problem_faults(kind, name)
    for field in () if isinstance(problem, type) else arguments_of(kind):
        if not hasattr(problem, field):
            words = f"must keep {field} as an attribute; or register the class {kind.__name__}"
            yield Fault("problem", name, words)


def _faults_of_engine(engine: Engine, name: str) -> Iterator[Fault]:
    """Everything that is wrong with what an engine takes, and with its `solve`."""
    choices = {"nonlinear": (True, False), "integer": (True, False), "slots": (True, False, None)}
    for attribute, known in choices.items():
        if (value := getattr(engine, attribute)) not in known:
            words = f"must be one of {', '.join(map(str, known))}"
            yield Fault(f"engine {name}: {attribute}", shown(value), words)
    if isinstance(engine.needs, tuple | list):
        needs = ((f"engine {name}: needs", need, get_args(Need)) for need in engine.needs)
        yield from unlisted(*needs)
    else:
        words = 'a tuple, such as ("derivatives",)'
        yield Fault(f"engine {name}: needs", shown(engine.needs), words)
    most = engine.most_unknowns
    if most is not None and (type(most) is not int or most < 1):
        words = "a whole number, at least 1, or None for any number"
        yield Fault(f"engine {name}: most_unknowns", shown(most), words)
    limits = {"slot_s": None, "time_limit_s": None}
    methods: list[tuple[Callable[..., Any], int, str]] = [
        (engine.solve, 3, "solve(self, model, programmes, values=None, *, {})"),
        (engine.compile, 2, "compile(self, model, programmes=1, *, {})"),
    ]
    if isinstance(engine, OneByOne):
        methods.append((engine.prepare, 1, "prepare(self, model, {})"))
    for method, count, words in methods:
        try:
            signature(method).bind(*[None] * count, **limits)
        except TypeError:
            call = words.format("slot_s=None, time_limit_s=None")
            yield Fault("engine", shown(name), f"must define {call}")


def _faults_of_picture(picture: Picture, name: str) -> Iterator[Fault]:
    """Everything that is wrong with a function of a plan."""
    try:
        signature(picture).bind(None)
    except TypeError:
        yield Fault("picture", shown(name), f"must be a function of a plan: def {name}(plan)")


def _kind(
    words: str,
    known: dict[str, Any],
    of_the_package: Collection[str],
    faults: Callable[[Any, str], Iterator[Fault]],
) -> Kind:
    return Kind(words, known, of_the_package, faults, known.__setitem__, known.__delitem__)


def _ours(models: Mapping[str, type]) -> tuple[str, ...]:
    """Names of the models that come with the package."""
    return tuple(name for name, model in models.items() if model.__module__.startswith("optuav."))


FLIGHT = _kind(
    "flight model",
    FLIGHTS,
    _ours(FLIGHTS),
    partial(_faults_of_model, "flight", FlightModel, FlightTable),
)
BEAM = _kind("beam", BEAMS, _ours(BEAMS), partial(_faults_of_model, "laser", Beam, LaserTable))
PROBLEM = _kind("problem", OWN_PROBLEMS, PROBLEM_NAMES, _faults_of_problem)
ENGINE = _kind("engine", ADDED, (AUTO, *ENGINES), _faults_of_engine)
PICTURE = _kind("picture", PICTURES, OF_THE_PACKAGE, _faults_of_picture)
EVERY_KIND = (FLIGHT, BEAM, PROBLEM, ENGINE, PICTURE)

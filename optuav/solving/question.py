"""The question about a mission, checked and completed, and the engine that answers it."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

from formulations.cycle import Cycle
from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES
from optuav.arrays import Values
from optuav.engines import dispatch
from optuav.engines.registry import AUTO, Engine, conforming, engine_names
from optuav.engines.solution import Solution
from optuav.errors import Fault, InputError, collected, nearest, refuse
from optuav.fields import MOST_DEVICES, REGISTERED_FIRST, SLOT, Range
from optuav.flight.model import FLIGHTS, CruisingModel
from optuav.mission import Mission, load
from optuav.mission.messages import misfits, no_building, shown, unknown, unlisted
from optuav.modelling import Model
from optuav.options import (
    HOVER_POINTS,
    ORDERS,
    ORDERS_OF_SEVERAL,
    SPEEDS,
    TRAJECTORIES,
    Perspective,
    ProblemName,
)

PROBLEMS: Mapping[str, Formulation] = {e.name: e for e in (P1(), P2(), P2(tight=True), P3())}
"""Names that stand for problems with their defaults."""
PROBLEM_NAMES = (*PROBLEMS, "P4")  # Names of all problems of the paper; P4 needs a building too
OF_THE_PAPER = tuple(dict.fromkeys([*map(type, PROBLEMS.values()), P4]))
OWN_PROBLEMS: dict[str, type[Formulation] | Formulation] = {}
"""Problems from outside the package by name, as classes or with their fields: `optuav.register`."""
ASKED = "one perspective, or a list of different ones"
LIMIT = Range("s", gt=0.0, le=1e9)
WANTED = Range("s", ge=0.0, le=1e7)
RESTS = Range("-", ge=0, le=10, whole=True)
HOVERS = Range("-", ge=1, le=10, whole=True)
MOST_ROWS = 1 << 13  # Routes over several devices that are compared one by one
MOST_FREE = 7  # Devices whose orders are all compared
MOST_ALONG_EDGES = 12  # Devices whose order is chosen along edges, in the paper's perspectives
ONE_DEVICE, WITH_DEVICES = "needs a mission with one device", "with several devices"
MOST_BUILDINGS = 1000  # with several stops: the legs between any two have to fit into memory


@dataclass(frozen=True)
class Question:
    """A problem with the options of `optuav.solve`."""

    problem: Formulation
    perspective: Perspective
    slot_s: float | None
    engine: str | Engine
    time_limit_s: float | None

    @property
    def engine_name(self) -> str:
        """Name of the engine, or "auto"."""
        return self.engine if isinstance(self.engine, str) else conforming(self.engine).name

    @property
    def limits(self) -> dict[str, float | None]:
        """What an engine keeps to: the length of slots, and the longest it may take [s]."""
        return {"slot_s": self.slot_s, "time_limit_s": self.time_limit_s}

    @property
    def p1(self) -> P1:
        """The problem if it is P1; P1 with its defaults, one stop at w_U, for any other."""
        return self.problem if isinstance(self.problem, P1) else P1()

    @property
    def speed_free(self) -> bool:
        """True if the speeds of the legs are unknowns."""
        return isinstance(self.problem, P1 | P3 | P4) and self.problem.speed == "free"

    @property
    def searched(self) -> bool:
        """True if the speeds of the legs, or the hover point, are unknowns."""
        return self.speed_free or self.p1.hover_point == "free"

    @property
    def several(self) -> bool:
        """True unless the question asks for one rest and one hover in one piece."""
        return (self.p1.stops, self.p1.hovers) != (1, 1)


def unknown_engine(name: str) -> Iterator[Fault]:
    """A fault for a name of no engine."""
    names = (AUTO, *engine_names())
    if name not in names:
        yield unknown("engine", name, (*names, REGISTERED_FIRST))


def problem_of(stated_as: str | type[Formulation], **stated: Any) -> Formulation:
    """The problem of a name or class with its fields, None for their defaults.

    Refused with all faults.
    """
    usual: Mapping[str, Any] = {}  # Fields of a registered instance
    registered = OWN_PROBLEMS.get(stated_as, stated_as) if isinstance(stated_as, str) else stated_as
    if isinstance(registered, type):
        kind, name = registered, registered.__name__
    elif isinstance(registered, Formulation):
        kind, name = type(registered), registered.name
        usual = {field: getattr(registered, field) for field in arguments_of(kind)}
    elif stated_as in PROBLEM_NAMES:
        name = stated_as
        kind = P4 if name == "P4" else type(PROBLEMS[name])
    else:
        names = (*PROBLEM_NAMES, *OWN_PROBLEMS, REGISTERED_FIRST)
        raise InputError([unknown("problem", stated_as, names)])
    options = {field: value for field, value in stated.items() if value is not None}
    taken = {problem: arguments_of(problem) for problem in dict.fromkeys((*OF_THE_PAPER, kind))}
    faults = []
    for field, value in options.items():
        if field not in taken[kind]:
            able = [problem.__name__ for problem in taken if field in taken[problem]]
            words = f", {' and '.join(able)} {'does' if len(able) == 1 else 'do'}" if able else ""
            words = words or nearest(field, taken[kind])
            faults.append(Fault(field, shown(value), f"problem {name} takes no {field}{words}"))
    for field, argument in taken[kind].items():
        if field not in {**usual, **options} and argument.default is Parameter.empty:
            what = "the name of a building" if field == "building" else "a value of this field"
            faults.append(Fault(field, "", f"problem {name} needs {what}"))
    refuse(faults)
    options = {**usual, **options} | ({"tight": True} if name == "P2-tight" else {})
    unnamed = [
        n for n, argument in taken[kind].items() if argument.kind is Parameter.POSITIONAL_ONLY
    ]
    by_place = [options.pop(n) for n in unnamed if n in options]
    return kind(*by_place, **options)


def arguments_of(kind: type[Formulation]) -> dict[str, Parameter]:
    """The arguments of a class of problems by name: of a dataclass, its fields."""
    unnamed = Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD
    arguments = signature(kind).parameters.items()
    return {name: argument for name, argument in arguments if argument.kind not in unnamed}


def perspectives_of(stated: Any, faults: list[Fault]) -> list[Perspective]:
    """Return one perspective or several; append their faults to `faults`."""
    single = isinstance(stated, str) or not isinstance(stated, Iterable)
    perspectives, names = [stated] if single else [*stated], tuple(PERSPECTIVES)
    if not perspectives or any(
        counted_by in perspectives[:k] for k, counted_by in enumerate(perspectives)
    ):
        faults.append(Fault("perspective", shown(stated), ASKED))
    faults += unlisted(*(("perspective", counted_by, names) for counted_by in perspectives))
    return perspectives


def mission_and_question(
    source: Mission | str | Path,
    problem: Formulation | ProblemName = "P1",
    perspective: str = AVAILABLE,
    slot_s: float | None = None,
    engine: str | Engine = "auto",
    time_limit_s: float | None = None,
) -> tuple[Mission, Question]:
    """The mission of a source and the question about it; refused with the faults of both."""
    mission, question, faults = None, None, list[Fault]()
    with collected(faults):
        mission = load(source)
    with collected(faults):
        question = checked_question(mission, problem, perspective, slot_s, engine, time_limit_s)
    refuse(faults)
    assert mission is not None
    assert question is not None
    return mission, question


def checked_question(
    mission: Mission | None,
    problem: Formulation | ProblemName = "P1",
    perspective: str = AVAILABLE,
    slot_s: float | None = None,
    engine: str | Engine = "auto",
    time_limit_s: float | None = None,
) -> Question:
    """The options of `optuav.solve`, completed; refused with all that is wrong with them.

    Without a mission, options that it alone may contradict are accepted.
    """
    chosen = PROBLEMS.get(problem, problem) if isinstance(problem, str) else problem
    faults = list[Fault]()
    if isinstance(chosen, str) and chosen in OWN_PROBLEMS:
        with collected(faults):
            chosen = problem_of(chosen)
    # A value of another type is a fault.
    stated: Any = (P1() if faults else chosen, perspective, slot_s, engine, time_limit_s)
    question = Question(*stated)
    refuse([*faults, *_faults(mission, question)])
    if mission is not None and question.engine_name == "grid" and slot_s is None:
        return replace(question, slot_s=mission.limits.slot_s)
    return question


def _faults(mission: Mission | None, question: Question) -> Iterator[Fault]:
    """Everything that is wrong with the options, over a mission if there is one."""
    problem: object = question.problem
    if isinstance(problem, Formulation):
        if problem.order is not None:
            several = mission is None or bool(mission.devices)
            orders = ORDERS_OF_SEVERAL if several else ORDERS
            yield from unlisted(("order", problem.order, orders))
        yield from _faults_of_devices(mission, question)
        if mission is not None and problem.building is not None:
            yield from _building_faults(mission, problem, question.perspective)
        if type(problem) not in OF_THE_PAPER:
            yield from own_problem_faults(type(problem), problem.name)
    elif isinstance(problem, type) and issubclass(problem, Formulation):
        name = problem.__name__
        yield Fault("problem", name, f"must be an instance, such as {name}(…), not the class")
    elif isinstance(problem, str) and problem == "P4":
        yield Fault("problem", "'P4'", 'must be P4 with the name of a building, as P4("b1")')
    else:
        names_too = (*PROBLEMS, "P4(building)", *OWN_PROBLEMS, "or an instance of a Formulation")
        yield unknown("problem", problem, names_too)
    p1 = question.p1
    if isinstance(problem, P1 | P2):
        yield from unlisted(("trajectory", problem.trajectory, TRAJECTORIES))
        if isinstance(problem, P2) and problem.hover_time_s is not None:
            yield from misfits(("hover_time_s", problem.hover_time_s, WANTED))
            yield from not_with("with a wanted hover_time_s", ("tight", problem.tight, (False,)))
        if problem.order is not None and problem.trajectory == "direct":
            yield Fault("order", shown(problem.order), "the direct route has no rest")
    yield from unlisted(("hover_point", p1.hover_point, HOVER_POINTS))
    yield from unlisted(("perspective", question.perspective, tuple(PERSPECTIVES)))
    if isinstance(question.engine, str):
        yield from unknown_engine(question.engine)
    limits = ("slot_s", question.slot_s, SLOT), ("time_limit_s", question.time_limit_s, LIMIT)
    for option, value, number in limits:
        if value is not None and not number.accepts(value):
            yield Fault(option, shown(value), f"{number.words}, or nothing")
    searched = (
        ("perspective", question.perspective, (*PAPER, AVAILABLE)),
        ("slot_s", question.slot_s, (None,)),
        ("engine", question.engine_name, (AUTO,)),
    )
    three = ("trajectory", p1.trajectory, ("optimal", "direct", "traj1"))
    if p1.hover_point == "free":
        yield from not_with("with hover_point = 'free'", three, *searched)
    if isinstance(problem, P1 | P3 | P4):
        yield from unlisted(("speed", problem.speed, SPEEDS))
    if question.speed_free:
        one = ("stops", p1.stops, (1,)), ("hovers", p1.hovers, (1,))
        place = ("hover_point", p1.hover_point, ("w_U",))
        yield from not_with("with speed = 'free'", three, *one, place, *searched)
        yield from () if mission is None else _speed_faults(mission, question.perspective)
    if question.several:
        yield from misfits(("stops", p1.stops, RESTS), ("hovers", p1.hovers, HOVERS))
        by_default = (
            ("trajectory", p1.trajectory, ("optimal",)),
            ("order", p1.order, (None,)),
            ("hover_point", p1.hover_point, ("w_U",)),
        )
        yield from not_with("with several stops", *by_default, *searched)
        yield from () if mission is None else _faults_of_stops(mission, question.perspective)


def _faults_of_devices(mission: Mission | None, question: Question) -> Iterator[Fault]:
    """An order of devices that is none, and what is not answered for several devices."""
    problem, p1, wanted = question.problem, question.p1, question.problem.device_order
    names = [device.name for device in mission.devices] if mission else []
    if wanted is not None and not (
        isinstance(wanted, tuple)
        and all(isinstance(name, str) for name in wanted)
        and (mission is None or sorted(wanted) == sorted(names))
    ):
        rule = f"each device once: {', '.join(names)}" if names else "left out with one device"
        absent = [name for name in names if isinstance(wanted, tuple) and name not in wanted]
        lacks = f"; without {', '.join(absent)} here" if absent else ""
        yield Fault("device_order", shown(wanted), f"must be {rule}{lacks}")
    if not names or mission is None:
        return
    if isinstance(problem, Cycle):
        yield Fault("problem", problem.name, f"{ONE_DEVICE}: a cycle hovers over a single device")
    if isinstance(problem, P1 | P2):
        ways = ("trajectory", problem.trajectory, ("optimal", "direct"))
        yield from not_with(WITH_DEVICES, ways)
    single = ("stops", p1.stops, (1,)), ("hovers", p1.hovers, (1,))
    yield from not_with(WITH_DEVICES, *single, ("hover_point", p1.hover_point, ("w_U",)))
    if isinstance(problem, P1 | P3 | P4):
        yield from not_with(WITH_DEVICES, ("speed", problem.speed, ("mission",)))
    if mission.battery.takes_turns:
        schedule = mission.battery.schedule
        yield Fault("battery.schedule", shown(schedule), f"must be pooled {WITH_DEVICES}")
    if wanted is None:
        yield from _faults_of_orders(mission, question)


def _faults_of_orders(mission: Mission, question: Question) -> Iterator[Fault]:
    """More orders of devices than are compared."""
    count, routes = len(mission.devices), count_of_routes(mission, question.problem)
    by_bounds = type(question.problem) in (P1, P3, P4) and question.engine == AUTO
    by_bounds = by_bounds and question.slot_s is None
    if along_edges(mission, question):
        return
    if count > MOST_FREE:
        words = f"at most {MOST_FREE} in any order here; P1 takes up to {MOST_ALONG_EDGES} in any "
        words += "order, in continuous times by the engine auto, with perspective "
        words += f"{' or '.join(PAPER)}; solve takes up to {MOST_DEVICES} with a device_order"
        yield Fault("devices", str(count), words)
    elif not by_bounds and routes > MOST_ROWS:
        words = f"must be fewer here: in any order they have {routes} routes, one by one at most "
        words += f"{MOST_ROWS} are compared; P1, P3 and P4 take more in continuous times by the "
        words += "engine auto, and so does a stated device_order"
        yield Fault("devices", str(count), words)


def too_many_orders(mission: Mission) -> Fault:
    """The fault of more devices in any order than are compared, where every route is declared."""
    words = f"at most {MOST_FREE} in any order, as every route is declared here; state a "
    words += "device_order, such as that of the plan that solve finds along edges"
    return Fault("devices", str(len(mission.devices)), words)


def along_edges(mission: Mission, question: Question) -> bool:
    """Whether `solve` chooses the order of devices along edges instead of among routes.

    It does so beyond the devices whose orders are compared, and if CVXPY is asked for by name.
    """
    problem, count = question.problem, len(mission.devices)
    linear = question.perspective in PAPER and question.slot_s is None
    if type(problem) is not P1 or problem.device_order is not None or not linear:
        return False
    many = count > MOST_FREE
    if question.engine_name != AUTO:
        if question.engine_name != "cvxpy":
            return False
        many = count > 1 and count_of_routes(mission, problem) > MOST_ROWS
    return many and count <= MOST_ALONG_EDGES


def count_of_routes(mission: Mission, problem: Formulation) -> int:
    """The number of routes over several devices with at most one rest."""
    devices = len(mission.devices)
    orders = math.factorial(devices) if problem.device_order is None else 1
    return orders * (1 + len(mission.buildings) * (devices + 1))


def own_problem_faults(kind: type[Formulation], name: str) -> Iterator[Fault]:
    """Everything that is wrong with a class of problems from outside the package."""
    if issubclass(kind, OF_THE_PAPER):
        words = "must subclass Formulation itself; its declare may call P1's to P4's"
        yield Fault("problem", kind.__name__, words)
    elif name in PROBLEM_NAMES:
        yield Fault("problem", name, "a name of its own, none of the paper's")
    try:
        signature(kind.declare).bind(None, None, None)
    except TypeError:
        words = "its declare must accept a model and the given quantities"
        yield Fault("problem", name, f"{words}: declare(self, model, given)")


def _faults_of_stops(mission: Mission, perspective: str) -> Iterator[Fault]:
    """Missions over which no several stops are searched for."""
    battery, count = mission.battery, len(mission.buildings)
    if perspective == AVAILABLE and battery.takes_turns:
        words = "must be pooled with several stops"
        yield Fault("battery.schedule", shown(battery.schedule), words)
    if count > MOST_BUILDINGS:
        words = f"several stops are searched for over at most {MOST_BUILDINGS} buildings"
        yield Fault("buildings", str(count), words)


def _speed_faults(mission: Mission, perspective: str) -> Iterator[Fault]:
    """Missions whose legs have no speed that may be chosen."""
    if not isinstance(mission.flight_model, CruisingModel):
        able = [shown(name) for name, model in FLIGHTS.items() if issubclass(model, CruisingModel)]
        words = f"{' or '.join(able)} with speed = 'free', as its legs have a speed to choose"
        yield Fault("flight.model", shown(mission.flight.model), words)
    if perspective == AVAILABLE and mission.battery.takes_turns:
        words = "must be pooled with speed = 'free' in the perspective available"
        yield Fault("battery.schedule", shown(mission.battery.schedule), words)


def _building_faults(mission: Mission, problem: Formulation, perspective: str) -> Iterator[Fault]:
    """Buildings that a mission lacks, and cycles that do not begin and end on their roof."""
    names, building = mission.buildings.names, problem.building
    name = building if isinstance(building, str) else ""
    if name not in names:
        yield Fault("building", shown(building), no_building(name, names))
    elif isinstance(problem, Cycle) and name:
        yield from _cycle_faults(mission, problem, perspective)


def _cycle_faults(mission: Mission, problem: Cycle, perspective: str) -> Iterator[Fault]:
    """A cycle begins and ends on the roof where it rests, in two perspectives."""
    roof_m = mission.buildings.roof_m[mission.buildings.names.index(problem.building)].tolist()
    words = f"the roof of {problem.building}, {shown(roof_m)}, in a cycle: solve over the mission "
    words += "of optuav.coverage(mission).plan"
    for name in ("origin_m", "destination_m"):
        if list(at_m := getattr(mission.route, name)) != roof_m:
            yield Fault(f"route.{name}", shown(list(at_m)), f"must be {words}")
    yield from unlisted(("perspective", perspective, (AVAILABLE, "battery")))


def not_with(words: str, *stated: tuple[str, object, tuple[object, ...]]) -> Iterator[Fault]:
    """Options that exclude another; a choice of only None stands for no value."""
    for option, value, choices in stated:
        if value not in choices:
            allowed = [str(choice) for choice in choices if choice is not None]
            start = "must be one of " if len(allowed) > 1 else "must be "
            yield Fault(option, shown(value), f"{start}{', '.join(allowed) or 'left out'} {words}")


def engine_for(model: Model, question: Question) -> Engine:
    """The engine that answers a question about a model; refused if it or none takes it."""
    linear = ". The perspectives of the paper are linear: perspective battery, for example"
    hint = linear * (question.perspective == AVAILABLE)
    return dispatch.chosen_engine(question.engine, model, question.slot_s is not None, hint)


def solve_model(
    model: Model, programmes: int, question: Question, values: Values | None = None
) -> Solution:
    """Answers to all programmes of a model, by the engine that a question names or leaves open.

    Values of parameters that differ from the model's, by name.
    """
    chosen = engine_for(model, question)
    return dispatch.answered(chosen, model, programmes, values, **question.limits)

"""What is asked of a mission: a problem and how to solve it, checked and completed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.soc import AVAILABLE, PAPER, PERSPECTIVES
from optuav.engines.registry import Engine, names
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.messages import nearest, shown
from optuav.mission.schema import SLOT, Number
from optuav.options import (
    HOVER_POINTS,
    ORDERS,
    TRAJECTORIES,
    HoverPoint,
    Order,
    Perspective,
    ProblemName,
    Trajectory,
)

PROBLEMS: Mapping[str, Formulation] = {
    "P1": P1(),
    "P2": P2(),
    "P2-tight": P2(tight=True),
    "P3": P3(),
}
"""Names that stand for problems with their defaults."""
PROBLEM_NAMES = (*PROBLEMS, "P4")
"""Names of all problems of the paper; P4 needs a building too."""
PAPER_PROBLEMS = (P1, P2, P3, P4)
AUTO = "auto"
LIMIT = Number("s", gt=0.0, le=1e9)
RESTS = Number("-", ge=0, le=10, whole=True)
HOVERS = Number("-", ge=1, le=10, whole=True)
MOST_NAMES = 12


@dataclass(frozen=True)
class Question:
    """A problem with the options of `optuav.solve`.

    Parameters
    ----------
    problem
        The formulation.
    perspective
        How the state of charge is written.
    slot_s
        Length of the slots [s]; None for continuous times.
    engine
        Who answers.
    time_limit_s
        Longest that the engine may take [s]; None for no limit.
    """

    problem: Formulation
    perspective: Perspective
    slot_s: float | None
    engine: str | Engine
    time_limit_s: float | None

    @property
    def engine_name(self) -> str:
        """Name of the engine, or "auto"."""
        return self.engine if isinstance(self.engine, str) else self.engine.name

    @property
    def building(self) -> str | None:
        """Name of the building to go by way of; None for any."""
        return self.problem.building

    @property
    def order(self) -> Order | None:
        """Rest first or hover first; None for the better."""
        return self.problem.order

    @property
    def trajectory(self) -> Trajectory | None:
        """Routes that P1 and P2 may take; None for other problems."""
        return self.problem.trajectory if isinstance(self.problem, P1 | P2) else None

    @property
    def hover_point(self) -> HoverPoint:
        """Whether the UAV hovers at the mission's own point or wherever is best."""
        return self.problem.hover_point if isinstance(self.problem, P1) else "w_U"

    @property
    def stops(self) -> int:
        """Most rests."""
        return self.problem.stops if isinstance(self.problem, P1) else 1

    @property
    def hovers(self) -> int:
        """Most pieces in which the UAV hovers."""
        return self.problem.hovers if isinstance(self.problem, P1) else 1


def problem_of(
    name: str,
    *,
    trajectory: str | None = None,
    building: str | None = None,
    order: str | None = None,
    hover_point: str | None = None,
    stops: int | None = None,
    hovers: int | None = None,
) -> Formulation:
    """The problem of a name with options by name, as files and the command line state them.

    Parameters
    ----------
    name
        ``"P1"``, ``"P2"``, ``"P2-tight"``, ``"P3"`` or ``"P4"``.
    trajectory, building, order, hover_point, stops, hovers
        Fields of the problem; None for its default.

    Raises
    ------
    InputError
        If there is no such problem, or it has no such field; with all faults.
    """
    stated = {
        "trajectory": trajectory,
        "building": building,
        "order": order,
        "hover_point": hover_point,
        "stops": stops,
        "hovers": hovers,
    }
    options: dict[str, Any] = {field: value for field, value in stated.items() if value is not None}
    if name not in PROBLEM_NAMES:
        raise InputError([_unknown("problem", name, PROBLEM_NAMES)])
    kind = P4 if name == "P4" else type(PROBLEMS[name])
    allowed = {each.name for each in fields(kind) if each.init}
    faults = [
        Fault(field, shown(value), f"problem {name} takes none{_taker(field)}")
        for field, value in options.items()
        if field not in allowed
    ]
    if name == "P4" and building is None:
        faults.append(Fault("building", "", "problem P4 needs the name of a building"))
    if faults:
        raise InputError(faults)
    if name == "P2-tight":
        options["tight"] = True
    return kind(**options)


def _taker(field: str) -> str:
    """A sentence on which problems take an option."""
    takers = [each.__name__ for each in PAPER_PROBLEMS if field in _options(each)]
    return f", {' and '.join(takers)} {'does' if len(takers) == 1 else 'do'}"


def _options(problem: type[Formulation]) -> set[str]:
    return {each.name for each in fields(problem) if each.init}


def checked_question(
    mission: Mission,
    problem: Formulation | ProblemName,
    perspective: str,
    slot_s: float | None,
    engine: str | Engine,
    time_limit_s: float | None,
) -> Question:
    """Check and complete the options of `optuav.solve`.

    Raises
    ------
    InputError
        Listing every option that does not exist, and every pair that contradicts.
    """
    faults = list(_faults(mission, problem, perspective, slot_s, engine, time_limit_s))
    if faults:
        raise InputError(faults)
    chosen = PROBLEMS[problem] if isinstance(problem, str) else problem
    engine_name = engine if isinstance(engine, str) else engine.name
    if engine_name == "grid" and slot_s is None:
        slot_s = mission.limits.slot_s
    return Question(chosen, perspective, slot_s, engine, time_limit_s)  # type: ignore[arg-type]


def _faults(
    mission: Mission,
    problem: object,
    perspective: str,
    slot_s: float | None,
    engine: str | Engine,
    time_limit_s: float | None,
) -> Iterator[Fault]:
    if isinstance(problem, Formulation):
        yield from _of_problem(mission, problem)
    elif isinstance(problem, type) and issubclass(problem, Formulation):
        name = problem.__name__
        yield Fault("problem", name, f"an instance, as {name}(…), not the class")
    elif problem == "P4":
        yield Fault("problem", "'P4'", 'P4 with the name of a building, as P4("b1")')
    elif not isinstance(problem, str) or problem not in PROBLEMS:
        more = "or an instance of a Formulation"
        yield _unknown("problem", problem, (*PROBLEMS, "P4(building)"), more)
    if perspective not in PERSPECTIVES:
        yield _unknown("perspective", perspective, tuple(PERSPECTIVES))
    engine_name = engine if isinstance(engine, str) else engine.name
    if isinstance(engine, str) and engine not in (AUTO, *names()):
        yield _unknown("engine", engine, (AUTO, *names()))
    for option, value, number in (("slot_s", slot_s, SLOT), ("time_limit_s", time_limit_s, LIMIT)):
        if value is not None and not number.accepts(value):
            yield Fault(option, shown(value), f"{number.words}, or nothing")
    if isinstance(problem, P1) and problem.hover_point == "free":
        yield from _not_with(
            "with hover_point = 'free'",
            ("perspective", perspective, (AVAILABLE, *PAPER)),
            ("slot_s", slot_s, (None,)),
            ("engine", engine_name, (AUTO,)),
        )
    if isinstance(problem, P1) and (problem.stops, problem.hovers) != (1, 1):
        yield from _not_with(
            "with several stops",
            ("perspective", perspective, (*PAPER, AVAILABLE)),
            ("slot_s", slot_s, (None,)),
            ("engine", engine_name, (AUTO,)),
        )


def _of_problem(mission: Mission, problem: Formulation) -> Iterator[Fault]:
    """What is wrong with the fields of a problem."""
    if problem.order not in (None, *ORDERS):
        yield _unknown("order", problem.order, ORDERS)
    buildings = tuple(each.name for each in mission.buildings)
    if problem.building is not None and problem.building not in buildings:
        listed = ", ".join(buildings[:MOST_NAMES]) + (", …" if len(buildings) > MOST_NAMES else "")
        words = f"the mission's buildings are: {listed or 'none'}"
        yield Fault("building", repr(problem.building), words)
    if isinstance(problem, P1 | P2):
        if problem.trajectory not in TRAJECTORIES:
            yield _unknown("trajectory", problem.trajectory, TRAJECTORIES)
        if problem.order is not None and problem.trajectory == "direct":
            yield Fault("order", repr(problem.order), "there is no rest on the direct route")
    if isinstance(problem, P1):
        yield from _of_p1(problem)


def _of_p1(problem: P1) -> Iterator[Fault]:
    if problem.hover_point not in HOVER_POINTS:
        yield _unknown("hover_point", problem.hover_point, HOVER_POINTS)
    if problem.hover_point == "free":
        three = ("optimal", "direct", "traj1")
        yield from _not_with("with hover_point = 'free'", ("trajectory", problem.trajectory, three))
    counts = (("stops", problem.stops, RESTS), ("hovers", problem.hovers, HOVERS))
    for option, value, number in counts:
        if not number.accepts(value) or not isinstance(value, int):
            yield Fault(option, shown(value), number.words)
    if (problem.stops, problem.hovers) != (1, 1):
        yield from _not_with(
            "with several stops",
            ("trajectory", problem.trajectory, ("optimal",)),
            ("order", problem.order, (None,)),
            ("hover_point", problem.hover_point, ("w_U",)),
        )


def _not_with(words: str, *stated: tuple[str, object, tuple[object, ...]]) -> Iterator[Fault]:
    for option, value, choices in stated:
        if value not in choices:
            allowed = ", ".join(str(each) for each in choices if each is not None) or "none"
            yield Fault(option, repr(value), f"{allowed} {words}")


def _unknown(option: str, value: object, allowed: Sequence[str], more: str = "") -> Fault:
    words = ", ".join(allowed) + (f", {more}" if more else "")
    hint = nearest(value, allowed) if isinstance(value, str) else ""
    return Fault(option, repr(value), f"one of {words}{hint}")

"""What is asked of a mission: which options exist and which go together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from inspect import isabstract
from typing import Literal

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.p2 import P2, P2Tight
from formulations.p3 import P3
from formulations.p4 import P4
from formulations.perspectives import AVAILABLE, PAPER, PERSPECTIVES
from optuav.engines.registry import Engine, names
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.messages import nearest, shown
from optuav.mission.schema import SLOT, Number
from optuav.network.network import TRAJECTORIES, Trajectory
from optuav.network.routes import ORDERS, Order

Problem = Literal["P1", "P2", "P2-tight", "P3", "P4"]
PROBLEMS: Mapping[str, type[Formulation]] = {
    "P1": P1,
    "P2": P2,
    "P2-tight": P2Tight,
    "P3": P3,
    "P4": P4,
}
ROUTED = ("P1", "P2", "P2-tight")
"""Problems that choose among routes."""
AUTO = "auto"
HoverPoint = Literal["w_U", "free"]
HOVER_POINTS: tuple[HoverPoint, ...] = ("w_U", "free")
LIMIT = Number("s", gt=0.0, le=1e9)


@dataclass(frozen=True)
class Question:
    """Options of `formulate` and `solve`, checked and completed.

    Parameters
    ----------
    problem
        ``"P1"``, ``"P3"``, ``"P4"``, or a formulation of one's own.
    trajectory
        Routes that P1 may take; None for the other problems.
    building
        Name of the building to rest on; None for any.
    order
        Rest first or hover first; None for the better.
    perspective
        How the state of charge is written.
    slot_s
        Length of the slots [s]; None for continuous times.
    engine
        Who answers.
    time_limit_s
        Longest that the engine may take [s]; None for no limit.
    solver
        Solver behind the engine, where it has several; None for its own choice.
    hover_point
        Whether the UAV hovers at the mission's own point, w_U unless stated, or wherever is best.
    stops, hovers
        Most rests and hovers.
    """

    problem: Problem | type[Formulation]
    trajectory: Trajectory | None
    building: str | None
    order: Order | None
    perspective: str
    slot_s: float | None
    engine: str | Engine
    time_limit_s: float | None
    solver: str | None
    hover_point: HoverPoint = "w_U"
    stops: int = 1
    hovers: int = 1

    @property
    def problem_name(self) -> str:
        """Name of the problem for a reader."""
        return self.problem if isinstance(self.problem, str) else self.problem.__name__

    @property
    def engine_name(self) -> str:
        """Name of the engine, or "auto"."""
        return self.engine if isinstance(self.engine, str) else self.engine.name

    @property
    def formulation(self) -> type[Formulation]:
        """The class that declares it."""
        return PROBLEMS[self.problem] if isinstance(self.problem, str) else self.problem


def question(
    mission: Mission,
    problem: str | type[Formulation],
    trajectory: str | None,
    building: str | None,
    order: str | None,
    perspective: str,
    slot_s: float | None,
    engine: str | Engine,
    time_limit_s: float | None,
    solver: str | None,
    hover_point: str = "w_U",
) -> Question:
    """Check and complete the options of `optuav.solve`.

    Raises
    ------
    InputError
        Listing every option that does not exist, and every pair that contradicts.
    """
    engine_name = engine if isinstance(engine, str) else engine.name
    faults = [
        *_unknown(mission, problem, trajectory, building, order, perspective, engine),
        *_out_of_range(slot_s, time_limit_s),
        *_contradictions(problem, trajectory, building, order, engine_name, solver),
        *_not_among("hover_point", hover_point, HOVER_POINTS),
    ]
    if hover_point == "free":
        faults += _not_with_free(problem, trajectory, perspective, slot_s, engine_name)
    if faults:
        raise InputError(faults)
    if engine_name == "grid" and slot_s is None:
        slot_s = mission.limits.slot_s
    if problem in ROUTED and trajectory is None:
        trajectory = "optimal"
    return Question(
        problem,  # type: ignore[arg-type]
        trajectory,  # type: ignore[arg-type]
        building,
        order,  # type: ignore[arg-type]
        perspective,
        slot_s,
        engine,
        time_limit_s,
        solver,
        hover_point,  # type: ignore[arg-type]
    )


def _unknown(
    mission: Mission,
    problem: str | type[Formulation],
    trajectory: str | None,
    building: str | None,
    order: str | None,
    perspective: str,
    engine: str | Engine,
) -> Iterator[Fault]:
    if not (isinstance(problem, type) and issubclass(problem, Formulation)) or isabstract(problem):
        yield from _not_among("problem", problem, tuple(PROBLEMS), "or a Formulation class")
    yield from _not_among("trajectory", trajectory, (None, *TRAJECTORIES))
    yield from _not_among("order", order, (None, *ORDERS))
    yield from _not_among("perspective", perspective, tuple(PERSPECTIVES))
    if isinstance(engine, str):
        yield from _not_among("engine", engine, (AUTO, *names()))
    buildings = tuple(each.name for each in mission.buildings)
    if building is not None and building not in buildings:
        shown = ", ".join(buildings[:12]) + (", …" if len(buildings) > 12 else "") or "none"
        yield Fault("building", repr(building), f"the mission's buildings are: {shown}")


def _not_among(
    option: str, value: object, allowed: Sequence[str | None], more: str = ""
) -> Iterator[Fault]:
    if value not in allowed:
        names = [each for each in allowed if each is not None]
        words = ", ".join(names) + (f", {more}" if more else "")
        hint = nearest(value, names) if isinstance(value, str) else ""
        yield Fault(option, repr(value), f"one of {words}{hint}")


def _out_of_range(slot_s: float | None, time_limit_s: float | None) -> Iterator[Fault]:
    for option, value, number in (("slot_s", slot_s, SLOT), ("time_limit_s", time_limit_s, LIMIT)):
        if value is not None and not number.accepts(value):
            yield Fault(option, shown(value), f"{number.words}, or nothing")


def _contradictions(
    problem: str | type[Formulation],
    trajectory: str | None,
    building: str | None,
    order: str | None,
    engine: str,
    solver: str | None,
) -> Iterator[Fault]:
    if problem not in ROUTED and trajectory is not None:
        yield Fault("trajectory", repr(trajectory), f"goes with {', '.join(ROUTED)} only")
    if problem == "P4" and building is None:
        yield Fault("building", "", "problem P4 needs the name of a building")
    if building is not None and problem in (*ROUTED, "P3"):
        yield Fault("building", repr(building), f"problem {problem} takes none, P4 does")
    if order is not None and (problem == "P3" or trajectory == "direct"):
        yield Fault("order", repr(order), "there is no rest to order on the direct route")
    if solver is not None and engine != "cvxpy":
        yield Fault("solver", repr(solver), "goes with the engine cvxpy")


def _not_with_free(
    problem: str | type[Formulation],
    trajectory: str | None,
    perspective: str,
    slot_s: float | None,
    engine: str,
) -> Iterator[Fault]:
    """What does not go with a free hover point."""
    allowed: tuple[tuple[str, object, tuple[object, ...]], ...] = (
        ("problem", problem, ("P1",)),
        ("trajectory", trajectory, (None, "optimal", "direct", "traj1")),
        ("perspective", perspective, (AVAILABLE, *PAPER)),
        ("slot_s", slot_s, (None,)),
        ("engine", engine, (AUTO, "casadi")),
    )
    for option, value, choices in allowed:
        if value not in choices:
            words = ", ".join(str(each) for each in choices if each is not None) or "none"
            yield Fault(option, repr(value), f"with hover_point='free': {words}")

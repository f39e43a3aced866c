"""What is asked of a mission: which options exist and which go together."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from formulations.formulation import Formulation
from formulations.perspectives import PERSPECTIVES
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.mission.itineraries import ORDERS, Order
from optuav.mission.routes import TRAJECTORIES, Trajectory

Problem = Literal["P1", "P3", "P4"]
Engine = Literal["auto", "closed-form", "grid"]
PROBLEMS: tuple[Problem, ...] = ("P1", "P3", "P4")
ENGINES: tuple[Engine, ...] = ("auto", "closed-form", "grid")


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
    """

    problem: Problem | type[Formulation]
    trajectory: Trajectory | None
    building: str | None
    order: Order | None
    perspective: str
    slot_s: float | None
    engine: Literal["closed-form", "grid"]
    time_limit_s: float | None

    @property
    def problem_name(self) -> str:
        """Name of the problem for a reader."""
        return self.problem if isinstance(self.problem, str) else self.problem.__name__


def question(
    mission: Mission,
    problem: str | type[Formulation],
    trajectory: str | None,
    building: str | None,
    order: str | None,
    perspective: str,
    slot_s: float | None,
    engine: str,
    time_limit_s: float | None,
) -> Question:
    """Check and complete the options of `optuav.solve`.

    Raises
    ------
    InputError
        Listing every option that does not exist, and every pair that contradicts.
    """
    faults = [
        *_unknown(mission, problem, trajectory, building, order, perspective, engine),
        *_out_of_range(slot_s, time_limit_s),
        *_contradictions(problem, trajectory, building, order, slot_s, engine),
    ]
    if faults:
        raise InputError(faults)
    if engine == "auto":
        engine = "closed-form" if slot_s is None else "grid"
    if engine == "grid" and slot_s is None:
        slot_s = mission.limits.slot_s
    if problem == "P1" and trajectory is None:
        trajectory = "optimal"
    return Question(
        problem,  # type: ignore[arg-type]
        trajectory,  # type: ignore[arg-type]
        building,
        order,  # type: ignore[arg-type]
        perspective,
        slot_s,
        engine,  # type: ignore[arg-type]
        time_limit_s,
    )


def _unknown(
    mission: Mission,
    problem: str | type[Formulation],
    trajectory: str | None,
    building: str | None,
    order: str | None,
    perspective: str,
    engine: str,
) -> Iterator[Fault]:
    if not (isinstance(problem, type) and issubclass(problem, Formulation)):
        yield from _not_among("problem", problem, PROBLEMS, "or a subclass of Formulation")
    yield from _not_among("trajectory", trajectory, (None, *TRAJECTORIES))
    yield from _not_among("order", order, (None, *ORDERS))
    yield from _not_among("perspective", perspective, tuple(PERSPECTIVES))
    yield from _not_among("engine", engine, ENGINES)
    names = tuple(each.name for each in mission.buildings)
    if building is not None and building not in names:
        shown = ", ".join(names[:12]) + (", …" if len(names) > 12 else "") or "none"
        yield Fault("building", repr(building), f"the mission's buildings are: {shown}")


def _not_among(
    option: str, value: object, allowed: Sequence[str | None], more: str = ""
) -> Iterator[Fault]:
    if value not in allowed:
        words = ", ".join(str(each) for each in allowed)
        yield Fault(option, repr(value), f"one of {words}{' ' + more if more else ''}")


def _out_of_range(slot_s: float | None, time_limit_s: float | None) -> Iterator[Fault]:
    for option, value in (("slot_s", slot_s), ("time_limit_s", time_limit_s)):
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, int | float):
            yield Fault(option, repr(value), "a number of seconds, or nothing")
        elif not (math.isfinite(value) and value > 0.0):
            yield Fault(option, repr(value), "0 < x [s]")


def _contradictions(
    problem: str | type[Formulation],
    trajectory: str | None,
    building: str | None,
    order: str | None,
    slot_s: float | None,
    engine: str,
) -> Iterator[Fault]:
    if problem != "P1" and trajectory is not None:
        yield Fault("trajectory", repr(trajectory), "goes with problem P1 only")
    if problem == "P4" and building is None:
        yield Fault("building", "", "problem P4 needs the name of a building")
    if building is not None and problem in ("P1", "P3"):
        yield Fault("building", repr(building), f"problem {problem} takes none, P4 does")
    if order is not None and (problem == "P3" or trajectory == "direct"):
        yield Fault("order", repr(order), "there is no rest to order on the direct route")
    if engine == "closed-form" and slot_s is not None:
        yield Fault(
            "slot_s", repr(slot_s), "the engine closed-form has continuous times; grid takes slots"
        )

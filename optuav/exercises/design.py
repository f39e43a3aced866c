"""Design: an itinerary that the judge audits, its hover time over the best that is proved."""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from optuav.errors import Fault, InputError
from optuav.exercises.exercise import Draws, Exercise, Grade, Task
from optuav.judge import Itinerary, Stop, audit
from optuav.mission.messages import shown
from optuav.plan import Plan

STOP = '("b1", "rest", 100.0)'


def design(
    number: str,
    text: str,
    *,
    least: float,
    rests: int,
    mission: str = "paper",
    draws: Draws | None = None,
    fixed: Mapping[str, object] | None = None,
) -> Callable[[Callable[[Task], float]], Exercise]:
    """An exercise whose answer is an itinerary; its hover is to be a share of the best [s].

    It has so many rests at most.
    """

    def declared(function: Callable[[Task], float]) -> Exercise:
        grade = partial(_grade, function, least, rests)
        return Exercise(number, "design", text, grade, mission, draws or {}, fixed or {})

    return declared


def _grade(
    best_s: Callable[[Task], float], least: float, rests: int, task: Task, answer: object
) -> Grade:
    """The grade of an itinerary: what it breaks, or how long it hovers."""
    itinerary = _itinerary(answer, task)
    if itinerary is None:
        return Grade.wrong(task, "it flies another mission", "build it on task.mission")
    found = audit(itinerary)
    if not found or found.replay is None:
        events = found.replay.violations if found.replay else found.events
        worst = events[0]
        words = f"it cannot be flown: at {worst.time_s:.1f} s {worst.words}"
        return Grade.wrong(task, words, "optuav.audit(itinerary) lists all that it breaks")
    if (own := sum(phase.kind == "rest" for phase in found.replay.phases)) > rests:
        hint = f"at most {rests} {'is' if rests == 1 else 'are'} asked for"
        return Grade.wrong(task, f"it can be flown, but has {own} rests", hint)
    share = found.replay.times_s["hover_time_s"] / best_s(task)
    percent = math.floor(1000.0 * share + 1e-6) / 10.0  # 98.96 is less than 99, and reads so
    words = f"it can be flown, and hovers for {percent:.1f} % of the longest time"
    if share < least:
        return Grade.wrong(task, words, f"at least {100.0 * least:g} % are asked for", score=share)
    return Grade.correct(task, words, min(share, 1.0))


def _itinerary(answer: object, task: Task) -> Itinerary | Plan | None:
    """The itinerary that an answer is; None if it is one of another mission."""
    if isinstance(answer, Plan | Itinerary):
        return answer if answer.mission == task.mission else None
    words = f"an optuav.Itinerary, or stops in order as {STOP}"
    if not isinstance(answer, Sequence) or isinstance(answer, str):
        raise InputError([Fault("answer", shown(answer), words)])
    stops = list[Any]()
    for number, stop in enumerate(answer):
        is_three = isinstance(stop, tuple | list) and len(stop) == 3
        if not is_three and not isinstance(stop, Stop):
            raise InputError([Fault(f"stops.{number}", shown(stop), f"a stop as {STOP}")])
        stops.append(Stop(*stop) if is_three else stop)
    return Itinerary(task.mission, tuple(stops))

"""The best known answers to the benchmark set, and the verdict of the simulation on another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from optuav.judge.replay import Replay, replay, same, short_of
from optuav.judge.timeline import Itinerary
from optuav.mission import Mission, benchmark
from optuav.mission.files import parse_json, read_text
from optuav.network.places import ENDS
from optuav.plan import Stop
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.plan.plan import LARGEST_BYTES
from optuav.presentation.numbers import figure, seconds

FILE = Path(benchmark.__file__).with_name("answers.json")
CLAIM_S = 0.01  # Largest difference of a claimed hover time from the simulated one
SLACK = 4.0  # Tolerances, in hover time, within which two hover times count as equal
WELLS = {"empty", "full"}
IGNORED: Mapping[str, set[str]] = {
    "available": set(),
    "battery": WELLS,
    **dict.fromkeys(("energy", "adjusted"), WELLS | {"state of charge"}),
}
"""Kinds of events that break no limit of a perspective."""

Asked = tuple[str, str, str]
"""Mission, problem and perspective."""


@dataclass(frozen=True)
class Answer:
    """The best known answer to a problem of the set."""

    mission: str
    problem: str
    perspective: str
    status: str  # "optimal" and "infeasible" are proved; "feasible" is the best known
    hover_s: float | None  # None without a plan, as the bound
    bound_s: float | None  # Proved for all plans
    engine: str
    proof: str  # Of the bound, or of no plan
    stops: tuple[Stop, ...] = ()
    reasons: tuple[str, ...] = ()  # For no plan


def answer_of(data: dict[str, Any]) -> Answer:
    """The answer of plain data."""
    stops = tuple(Stop(*stop) for stop in data.get("stops", ()))
    return Answer(**{**data, "stops": stops, "reasons": tuple(data.get("reasons", ()))})


@cache
def answers() -> dict[Asked, Answer]:
    """The best known answers to all problems of the set, in its order."""
    data = parse_json(read_text(FILE, LARGEST_BYTES), FILE.name)["answers"]
    return {(x.mission, x.problem, x.perspective): x for x in map(answer_of, data)}


@dataclass(frozen=True)
class CheckedSolution:
    """Verdict of the simulation on a solution."""

    answer: Answer  # The best known to the same problem
    claimed_s: float | None
    hover_s: float | None  # As simulated
    wrong: tuple[str, ...]  # Why it does not hold; empty if it does
    verdict: str  # In a few words, also compared with the best known answer

    def to_dict(self) -> dict[str, object]:
        """The same as plain data, with the gaps to the best known value and to the bound [s]."""
        reference, hover_s = self.answer, self.hover_s
        values = reference.hover_s, reference.bound_s
        gaps = [None if None in (x, hover_s) else (x or 0.0) - (hover_s or 0.0) for x in values]
        question = ("mission", "problem", "perspective")
        return {
            **{name: getattr(reference, name) for name in question},
            **{"holds": not self.wrong, "verdict": self.verdict, "wrong": [*self.wrong]},
            **{"claimed_s": self.claimed_s, "hover_s": hover_s},
            **dict(zip(("best_known_s", "bound_s"), values, strict=True)),
            **dict(zip(("gap_s", "gap_to_bound_s"), gaps, strict=True)),
        }


def checked(
    mission: Mission, answer: Answer, claimed_s: float | None, stops: Sequence[Stop]
) -> CheckedSolution:
    """The verdict on a solution, which has the best known answer beside it."""
    hover_s, best_s, bound_s = None, answer.hover_s, answer.bound_s
    wrong, verdict = list[str](), "holds, there is no plan"
    if claimed_s is None and best_s is not None:
        wrong.append(f"there is a plan, which hovers {seconds(best_s, 3)}")
    elif claimed_s is not None:
        flown = replay(Itinerary(mission, tuple(stops)))
        wrong += [*_broken_limits(flown, answer.perspective), *_not_asked(flown, stops, answer)]
        hover_s = flown.times_s.get("hover_time_s")
        if hover_s is not None:
            if abs(claimed_s - hover_s) > CLAIM_S:
                wrong.append(
                    f"it claims {seconds(claimed_s, 3)} of hover, and hovers {seconds(hover_s, 3)}"
                )
            slack_s, doubt = _slack_s(flown), "this check or the proof is wrong"
            if not wrong and (best_s is None or bound_s is None):
                wrong.append(f"impossible: it is proved that no plan exists; {doubt}")
            elif not wrong and bound_s is not None and hover_s > bound_s + slack_s:
                longest = f"no plan hovers longer than {seconds(bound_s, 3)}"
                wrong.append(f"impossible: it is proved that {longest}; {doubt}")
            verdict = f"holds, {_compared(answer, hover_s - (best_s or 0.0), slack_s)}"
    return CheckedSolution(
        answer, claimed_s, hover_s, tuple(wrong), "DOES NOT HOLD" if wrong else verdict
    )


def _compared(answer: Answer, more_s: float, slack_s: float) -> str:
    if more_s > slack_s:
        return f"BETTER than the best known by {seconds(more_s, 3)}"
    if more_s < -slack_s:
        return f"{seconds(-more_s, 3)} below the best known"
    return "optimal" if answer.status == "optimal" else "as good as the best known"


def _broken_limits(found: Replay, perspective: str) -> Iterator[str]:
    """Yield the broken limits of a perspective."""
    for event in found.violations:
        if event.kind not in IGNORED[perspective]:
            yield f"at {seconds(event.time_s)} {event.words}{event.value_and_limit}"
    left, least = found.soc.get(perspective, 1.0), found.mission.limits.min_soc
    if "state of charge" in IGNORED[perspective] and left < least - JUDGE_TOLERANCE:
        yield f"the mission ends with {short_of(left, least)}"


def _not_asked(found: Replay, stops: Sequence[Stop], answer: Answer) -> Iterator[str]:
    """Yield what differs from the problem; the simulation judges hovers over several devices."""
    name, options = benchmark.parsed(answer.problem)
    rests, hovers = ([x.at for x in stops if x.kind == kind] for kind in ("rest", "hover"))
    served = [device.name for device in found.mission.served]
    most = {"rests": 0 if name == "P3" else options.get("stops", 1)}
    most["hovers"] = options.get("hovers", len(served))
    for verb, count in (("rests", len(rests)), ("hovers", len(hovers))):
        if count > most[verb]:
            yield f"it {verb} {count} times, at most {most[verb]} are asked for"
    if len(served) == 1:
        if all(stop.at != "hover" for stop in stops):
            yield "it never comes to the hover point"
        if strange := {*hovers} - {"hover"}:
            yield f"it hovers at {', '.join(sorted(map(str, strange)))}, not at the hover point"
    if strange := {*rests} & {*ENDS, *served}:
        yield f"it rests at {', '.join(sorted(map(str, strange)))}, not on a roof"
    if name == "P4" and (rests != [options["building"]] or len(hovers) != len(served)):
        once = "hover and rest" if len(served) == 1 else "hover over each device and rest"
        yield f"it does not {once} on {options['building']}, once each"
    if "order" in options and stops and _order_of(stops) != options["order"]:
        yield f"its order is not {options['order']}"
    if "device_order" in options and ",".join(map(str, hovers)) != options["device_order"]:
        yield f"its order of devices is not {options['device_order']}"
    ends_s, deadline_s = found.mission_time_s, found.mission.limits.deadline_s
    if name == "P2-tight" and ends_s < deadline_s and not same(ends_s, deadline_s):
        yield f"it ends after {figure(ends_s)} s, not at the deadline of {figure(deadline_s)} s"


def _order_of(stops: Sequence[Stop]) -> str:
    """The order of rest and hovers: "rest-first", "hover-first", or "between" two hovers."""
    kinds = [stop.kind for stop in stops]
    inside = "rest" in kinds and kinds[0] == kinds[-1] == "hover"
    return "between" if inside else f"{kinds[0]}-first"


def _slack_s(found: Replay) -> float:
    """Return the tolerances of the simulation as hover time [s].

    A share of the deadline, and a share of the capacity at the current drawn while hovering; the
    available well is emptied faster than all of the battery, by up to 1/ω.
    """
    time_s = found.mission.limits.deadline_s
    stays = [phase for phase in found.phases if phase.kind == "hover"]
    if stays and (drawn_A := min(-stay.stages[0].net.current_A for stay in stays)) > 0.0:
        pool = found.mission.pool
        time_s += float(pool.capacity_As / (pool.available_fraction * drawn_A))
    return SLACK * JUDGE_TOLERANCE * time_s

"""The comparison that is asked for: of methods, of plans or of speeds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

from formulations.p1 import P1
from formulations.soc import AVAILABLE, PAPER
from optuav.errors import Fault, collected, refuse
from optuav.fields import SLOT, Range
from optuav.mission import Mission, load
from optuav.mission.messages import misfits, several, shown, unknown
from optuav.options import Perspective
from optuav.solving.question import LIMIT, MOST_ROWS, count_of_routes
from optuav.studies.compare_methods import (
    MethodComparison,
    Progress,
    compare_methods,
    default_slots_s,
)
from optuav.studies.compare_plans import AXES, PERIODS_S, PlanComparison, compare_plans
from optuav.studies.processes import WORKERS
from optuav.studies.results import Comparison

if TYPE_CHECKING:
    from optuav.studies.compare_speeds import SpeedComparison

COMPARED_ENGINES: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(PAPER, ("closed-form", "cvxpy", "casadi", "grid")),
    AVAILABLE: ("bracket", "casadi", "grid"),
}
"""Engines whose answers are compared by how charge is counted; the first is the reference."""
TAKEN_BY_ALL = {"schedule": "pooled", "charging": "constant"}
"""Settings of the battery that all engines compared under `available` take."""
PERIOD = Range("s", ge=1e-3, le=1e7)
ALONE = {
    **dict.fromkeys(("engines", "time_limit_s", "times", "workers"), "method"),
    "periods_s": "schedule",
}
"""Arguments that go with one comparison only."""

ByPlan: TypeAlias = Literal["perspective", "trajectory", "schedule"]
"""Comparisons of plans."""


@overload
def compare(
    mission: Mission | str | Path,
    *,
    by: Literal["method"] = "method",
    perspective: Perspective | None = None,
    slots_s: float | Sequence[float] | None = None,
    engines: Sequence[str] | None = None,
    time_limit_s: float | None = None,
    times: bool = False,
    progress: Progress | None = None,
    workers: int = 1,
) -> MethodComparison: ...


@overload
def compare(
    mission: Mission | str | Path,
    *,
    by: Literal["speed"],
    perspective: Perspective | None = None,
    progress: Progress | None = None,
) -> SpeedComparison: ...


@overload
def compare(
    mission: Mission | str | Path,
    *,
    by: ByPlan | tuple[ByPlan, ...] | list[ByPlan],
    perspective: Perspective | None = None,
    slots_s: float | Sequence[float] | None = None,
    periods_s: Sequence[float] | None = None,
    progress: Progress | None = None,
) -> PlanComparison: ...


@overload
def compare(
    mission: Mission | str | Path,
    *,
    by: str | Sequence[str],
    perspective: Perspective | None = None,
    slots_s: float | Sequence[float] | None = None,
    engines: Sequence[str] | None = None,
    time_limit_s: float | None = None,
    periods_s: Sequence[float] | None = None,
    times: bool = False,
    progress: Progress | None = None,
    workers: int = 1,
) -> Comparison: ...


def compare(
    mission: Mission | str | Path,
    *,
    by: str | Sequence[str] = "method",
    perspective: Perspective | None = None,
    slots_s: float | Sequence[float] | None = None,
    engines: Sequence[str] | None = None,
    time_limit_s: float | None = None,
    periods_s: Sequence[float] | None = None,
    times: bool = False,
    progress: Progress | None = None,
    workers: int = 1,
) -> Comparison:
    """Compare answers to the problems of a mission: by method, or plans by the options chosen.

    By method, P3, P4 for every building and order, and P1 are solved by the bracket, by CasADi, and
    for each length of slot by the exhaustive grid of Algorithm 1 of the paper. The paper's own
    perspectives are linear. There the closed form replaces the bracket, CVXPY solves linear
    programmes, and with slots integer ones, of which the one for (P1) also chooses the route, and
    CasADi simulates both wells in ``"battery"``. An answer in continuous times agrees if it equals
    the first engine's; an answer in slots agrees if it is within the bound of the theory and equals
    the grid's.

    By perspective, trajectory or schedule, P1 is solved for each of them. By speed, it is solved at
    the named speeds and at free ones, for which CasADi and a grid of all speeds also search.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file.
    by
        ``"method"``; ``"perspective"``, ``"trajectory"`` or both; ``"schedule"`` of the packs; or
        ``"speed"`` of the legs.
    perspective
        How to count charge, as for `optuav.solve` except ``"wells"``; None for ``"available"``,
        which is the only one by schedule.
    slots_s
        Lengths of time slots [s], 0.001 to 1e7. By method several, by default 0.5, 1, 5, 10 and 60,
        or 10 and 60 with several devices, which have many more routes; else one, by default
        continuous times.
    engines
        By method: which engines to compare, the first always; by default all of these.
    time_limit_s
        By method: time limit of an engine for one problem [s], > 0; by default no limit.
    periods_s
        By schedule: periods of the schedule ``"alternating"`` [s], 0.001 to 1e7 and at least
        deadline_s / 20000, by default 60; the mission's own is always among them.
    times
        By method: whether to add a column of the times taken, which differ from run to run.
    progress
        Callback for progress before each problem or plan: receives the number done, their total,
        and words on the next one.
    workers
        By method: number of processes that share the work, 1 to 1000; the results are the same.
        Several processes import the main module again, which must call `compare` only if it is run
        as a script.

    Returns
    -------
    Comparison
        By method, one row per problem and method, with the gap to the optimum in continuous times
        and whether it agrees; ``agrees``, ``disagreements`` and ``failures`` summarise all answers,
        and ``reasons`` say why there is no plan. Otherwise, one row per plan, with whether a
        simulation finds it flyable; ``by`` names what was compared.

    Raises
    ------
    InputError
        If an argument is out of range or does not go with `by`, all faults at once; or by method
        under ``"available"`` for packs that take turns or a charge that tapers.
    SolverError
        If an engine fails; by method, the table says so instead.

    Examples
    --------
    >>> import optuav
    >>> results = optuav.compare("paper", by="trajectory", perspective="battery")
    >>> [(row["trajectory"], round(row["hover_time_s"], 2)) for row in results.rows]
    [('direct', 688.85), ('traj1', 715.05), ('traj2', 719.54), ('optimal', 719.54)]
    """
    names = tuple(several("by", by, str, "the name of a comparison, or several", 0))
    faults = list[Fault]()
    if not (progress is None or callable(progress)):
        faults.append(Fault("progress", shown(progress), "a function, or nothing"))
    slots = _some("slots_s", slots_s, Real, "a length [s], or several")
    periods = _some("periods_s", periods_s, Real, "a period [s], or several")
    chosen = _some("engines", engines, str, "the name of an engine, or several")
    given: dict[str, Any] = {"slots_s": slots, "periods_s": periods, "engines": chosen}
    given["time_limit_s"] = None if time_limit_s is None else (time_limit_s,)
    given |= {"times": times or None, "workers": None if workers == 1 else workers}
    faults += [*_faults(names, perspective, given), *misfits(("workers", workers, WORKERS))]
    with collected(faults):
        studied = load(mission)
    refuse(faults)
    counted = perspective or AVAILABLE
    if names == ("method",):
        rest = "or another perspective: under available not all engines accept it"
        options = ((n, getattr(studied.battery, n), only) for n, only in TAKEN_BY_ALL.items())
        others = (option for option in options if counted == AVAILABLE and option[1] != option[2])
        refuse(Fault(f"battery.{n}", shown(own), f"{only!r}, {rest}") for n, own, only in others)
        if studied.devices and (routes := count_of_routes(studied, P1())) > MOST_ROWS:
            words = f"must be fewer: they have {routes} routes in any order, and by = 'method' "
            words += f"compares at most {MOST_ROWS}; by = 'trajectory' takes more"
            refuse([Fault("devices", str(len(studied.devices)), words)])
        lengths_s = default_slots_s(studied) if slots is None else slots
        able = COMPARED_ENGINES[counted]
        engine_names = able if chosen is None else (able[0], *chosen)
        return compare_methods(
            studied, counted, lengths_s, engine_names, time_limit_s, progress, workers, times=times
        )
    if names == ("speed",):
        from optuav.studies.compare_speeds import compare_speeds

        return compare_speeds(studied, counted)
    slot_s = slots[0] if slots else None
    return compare_plans(studied, names, counted, slot_s, periods or PERIODS_S, progress)


def _some(name: str, stated: Any, kind: type, words: str) -> tuple[Any, ...] | None:
    """One value or several of an option; None for its default."""
    return None if stated is None else tuple(several(name, stated, kind, words, 0))


def _faults(
    names: tuple[str, ...], perspective: Perspective | None, given: Mapping[str, Any]
) -> Iterator[Fault]:
    """Yield values out of range, and options that exclude a comparison."""
    if names not in (("method",), ("schedule",), ("speed",)):
        words = f"some of {', '.join(AXES)}; or only method, schedule or speed"
        yield from (Fault("by", shown(name), words) for name in names if name not in AXES)
        if not names or len(set(names)) < len(names):
            yield Fault("by", shown(names), f"must be at least one of {', '.join(AXES)}, each once")
    for name, number in (("slots_s", SLOT), ("periods_s", PERIOD), ("time_limit_s", LIMIT)):
        yield from misfits(*((name, value, number) for value in given[name] or ()))
    slots = tuple(given["slots_s"] or ())
    if len(set(slots)) < len(slots):
        yield Fault("slots_s", shown(slots), "must have each length once")
    if slots and names == ("speed",):
        yield Fault("slots_s", shown(slots), "left out with by = 'speed'")
    if len(slots) > 1 and names != ("method",):
        yield Fault("slots_s", shown(slots), "one length unless by = 'method'")
    for name, kind in ALONE.items():
        if given[name] is not None and names != (kind,):
            yield Fault(name, shown(given[name]), f"goes with by = {kind!r} only")
    allowed = (AVAILABLE,) if names == ("schedule",) else AXES["perspective"]
    if perspective is not None and perspective not in allowed:
        yield unknown("perspective", perspective, allowed)
    elif perspective is not None and "perspective" in names:
        yield Fault("perspective", shown(perspective), "is compared by already")
    counted = next((name for name in COMPARED_ENGINES if name == perspective), AVAILABLE)
    able = COMPARED_ENGINES[counted]
    others = (engine for engine in given["engines"] or () if engine not in able)
    words = f"some of {', '.join(able)} in the perspective {counted}"
    yield from (Fault("engines", shown(other), words) for other in others)

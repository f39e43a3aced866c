"""``optuav coverage``, ``size`` and ``return``: endless cycles, fleets, and the way back."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import optuav
from optuav.cli.options import number_or_text, numbers_in
from optuav.cli.output import progress, say
from optuav.cli.study_options import StudyOptions
from optuav.errors import Fault, InputError, NoPlanError, collected, refuse
from optuav.options import Perspective
from optuav.presentation.numbers import figure, percent, typed

if TYPE_CHECKING:
    from optuav.mission import Mission
    from optuav.service.cycle import Coverage
    from optuav.studies.results import Result


def coverage(
    mission: str,
    perspective: Perspective = "available",
    swap_s: float | None = None,
    pad_power_W: float | None = None,
    dark_hover: bool = False,
    share: float | None = None,
    overlap_s: float | None = None,
    drones: int | None = None,
    hours: float | None = None,
    separation_m: str | None = None,
    horizon_hours: float | None = None,
    flights: Path | None = None,
    start: str | None = None,
    climb_m: str | None = None,
    *,
    out: StudyOptions,
) -> None:
    """Find the share of the time one drone covers in an endless cycle, or a fleet for more.

    Exit code 1 if there is no endless cycle.
    """
    from optuav.service.fleet import faults_of_fleet

    fleet = share is not None or (overlap_s is not None and hours is None)
    share, overlap_s = 1.0 if share is None else share, overlap_s or 0.0
    faults = [*_faults_of_hours(horizon_hours, hours, drones, fleet=fleet)]
    faults += faults_of_fleet(share, overlap_s)
    of_event = {"separation_m": separation_m, "flights": flights}
    height_m: Any = number_or_text(climb_m)
    faults += [*_goes_with("hours", hours, of_event), *_faults_of_files(flights, start, height_m)]
    apart_m: tuple[float, ...] | None = None
    if separation_m is not None and hours is not None:
        from optuav.service.cycle import step_of

        with collected(faults):
            apart_m = step_of(_separation(separation_m))
    with collected(faults):
        changed = out.mission(mission)
        if flights is not None:
            faults += _faults_of_place(changed)
        cycle = optuav.coverage(
            changed,
            perspective=perspective,
            swap_s=swap_s,
            lit_hover=not dark_hover,
            pad_power_W=pad_power_W,
        )
    refuse(faults)
    notes: tuple[str, ...] = ()
    if flights is not None:
        from optuav.service.flights import save_flights
    results: Result = cycle.fleet(share, overlap_s) if fleet else cycle
    if horizon_hours is not None:
        results = cycle.horizon(horizon_hours)
    if hours is not None:
        with progress() as bar:
            results = event = cycle.event(
                hours,
                drones,
                bar,
                overlap_s=overlap_s,
                separation_m=apart_m,
            )
        if flights is not None:
            assert start is not None
            notes = save_flights(event, flights, start, height_m).notes
    figures, turns = dict[str, object](), list[str]()
    if drones is not None and hours is None:
        figures, turns = _turns(cycle, drones, share, overlap_s)
    out.deliver(results, figures, turns, () if flights is None else [flights])
    for note in notes:
        say(f"Note  {note}", error=out.as_json)


def _faults_of_files(
    flights: Path | None, start: str | None, climb_m: float | str | None
) -> Iterator[Fault]:
    """Yield faults of options for files of flights."""
    yield from _goes_with("flights", flights, {"start": start, "climb_m": climb_m})
    if flights is not None and start is None:
        yield Fault("start", "", "is missing: --flights needs when the event begins")
    elif flights is not None:
        from optuav.service.flights import faults_of_flights

        yield from faults_of_flights(start, climb_m)


def _faults_of_place(mission: Mission | str) -> Iterator[Fault]:
    """Yield that a mission has no place on Earth; one that does not load is refused elsewhere."""
    from optuav.plan.export import system_on_earth

    with suppress(InputError):
        loaded, faults = optuav.load(mission), list[Fault]()
        with collected(faults):
            system_on_earth(loaded)
        yield from faults


def _separation(text: str) -> float | str | Sequence[float]:
    """What --separation-m states: a number, a step, or a text that is neither."""
    numbers = numbers_in(text)
    return numbers[0] if len(numbers) == 1 else numbers or text


def _goes_with(name: str, value: object, options: Mapping[str, object]) -> Iterator[Fault]:
    """Yield options that are set without another one, which they need."""
    for option, setting in options.items():
        if setting is not None and value is None:
            yield Fault(option, str(setting), f"goes with --{name}")


def _faults_of_hours(
    horizon_hours: float | None, hours: float | None, drones: int | None, *, fleet: bool
) -> Iterable[Fault]:
    """Faults of hours together with options that they exclude, and of numbers out of range."""
    from optuav.mission.messages import misfits
    from optuav.service import event, horizon
    from optuav.service.fleet import COUNT

    words = {
        "horizon_hours": "plans one drone: leave out --hours, --share, --overlap-s and --drones",
        "hours": "plans an event without a gap: leave out --share and --horizon-hours",
    }
    named = ("horizon_hours", horizon_hours), ("hours", hours)
    faults = [Fault(name, typed(x), words[name]) for name, x in named if x is not None]
    if len(faults) + fleet > 1 or (horizon_hours is not None and drones is not None):
        return faults
    limits = [("horizon_hours", horizon_hours, horizon.HOURS), ("hours", hours, event.HOURS)]
    limits += [("drones", drones, COUNT)]
    return misfits(*(limit for limit in limits if limit[1] is not None))


def _turns(
    cycle: Coverage, drones: int, share: float, overlap_s: float
) -> tuple[dict[str, object], list[str]]:
    """Return what drones in turns cover and what their pads must deliver, also in words."""
    from optuav.mission.messages import plural
    from optuav.service.fleet import covering

    number, covers = plural(drones, "drone"), drones * (cycle.share - overlap_s / cycle.period_s)
    figures: dict[str, object] = {"pad_drones": drones, "drones_share": min(covers, 1.0)}
    words = f"Turns of {number} cover {percent(min(covers, 1.0))} of the time"
    words += f", {figure(overlap_s)} s of overlap" * (overlap_s > 0.0)
    if cycle.charged_by == "exchange":
        return figures, [words]
    try:
        pads = cycle.watts(drones, share, overlap_s)
    except NoPlanError as error:
        return figures | {"pad_reason": str(error)}, [words, str(error)]
    figures |= {f"pad_{name}": value for name, value in pads._asdict().items()}
    return figures, [words, f"Pads of {number} {covering(share, overlap_s)}: {pads}"]


def size(
    mission: str,
    prices: Path | None = None,
    share: float = 1.0,
    overlap_s: float = 0.0,
    swap_s: float = 120.0,
    hours: float | None = None,
    separation_m: str | None = None,
    *,
    out: StudyOptions,
) -> None:
    """Count the drones, beams, pads, bays and packs of a fleet, for each way to charge."""
    apart_m: Any = None if separation_m is None else _separation(separation_m)
    loaded = out.mission(mission)
    table = optuav.size_fleet(loaded, prices, share, overlap_s, swap_s, hours, apart_m)
    out.deliver(table)


def return_(mission: str, out: StudyOptions) -> None:
    """Find the last moment to leave the hover point, for the destination and every building.

    The laser charges the drone while it hovers. If nothing does, add --set laser= --set receiver=.

    Exit code 1 if the hover point cannot be reached.
    """
    times = optuav.return_by(out.mission(mission))
    out.deliver(times)

"""``optuav compare``, ``map``, ``sweep``, ``reproduce`` and others: many solves at once."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import optuav
from optuav.cli.options import mission_of, numbers_in
from optuav.cli.output import FAILED, NO, check_places, deliver, progress, say
from optuav.errors import Fault, InputError, NoPlanError, collected, decimal, refuse
from optuav.options import Order, Perspective
from optuav.presentation.blocks import Block, Facts, Note
from optuav.presentation.numbers import percent

if TYPE_CHECKING:
    from optuav.mission import Mission
    from optuav.service.cycle import Coverage
    from optuav.studies.results import Result
    from optuav.studies.sweep import Swept

WORKERS = min(os.cpu_count() or 1, 4)  # Processes that share work: each takes a second to start


@dataclass(frozen=True)
class StudyOptions:
    """Options of every study: changes of the mission, and where the results go."""

    settings: list[str] | None = None
    as_json: bool = False
    save: Path | None = None
    plot: Path | None = None

    def mission(self, source: str) -> Mission | str:
        """The mission that is studied; refused with it are places that cannot be written to.

        A mission without changes is left for the study to load, which refuses it with its options.
        """
        faults = list[Fault]()
        mission: Mission | str = source
        with collected(faults):
            check_places(self.save, self.plot, ".csv", ".json")
        with collected(faults):
            if self.settings or faults:
                mission = mission_of(source, self.settings)
        refuse(faults)
        return mission

    def deliver(
        self,
        found: Result,
        more: Mapping[str, object] | None = None,
        below: Sequence[str] = (),
        already: Sequence[Path] = (),
    ) -> None:
        """Write the files asked for of a result, with more figures; print it, more lines below.

        It also names files that were written already.
        """

        def data() -> dict[str, object]:
            whole = found.to_dict()
            figures = takewhile(lambda item: item[0] != "units", whole.items())
            return {**dict(figures), **(more or {}), **whole}

        written = [*already]
        if self.save is not None:
            from optuav.mission.files import write_text

            text = f"{json.dumps(data(), indent=2, ensure_ascii=False)}\n"
            is_csv = self.save.suffix.lower() == ".csv"
            write_text(self.save, found.to_csv() if is_csv else text)
            written.append(self.save)
        if self.plot is not None:
            written += found.save_pictures(self.plot)
        blocks = [*found.blocks(), Note(below)]
        deliver(data, blocks, as_json=self.as_json, written=written)


def compare(
    mission: str,
    slots_s: str | None = None,
    perspective: Perspective | None = None,
    engines: str | None = None,
    time_limit_s: float | None = None,
    by: str | None = None,
    times: bool = False,
    *,
    out: StudyOptions,
) -> None:
    """Compare the answers of all engines, with slots and continuous times, or compare plans.

    Exit code 1 if answers disagree or there is no feasible plan, 3 if an engine failed.
    """
    from optuav.studies.compare_methods import MethodComparison

    try:
        lengths_s = None if slots_s is None else [decimal(length) for length in slots_s.split(",")]
    except ValueError:
        words = "numbers of seconds with commas between them, such as 0.5,1,60"
        raise InputError([Fault("--slots", repr(slots_s), words)]) from None
    with progress() as bar:
        compared = optuav.compare(
            out.mission(mission),
            by=_names(by) or "method",
            perspective=perspective,
            slots_s=lengths_s,
            engines=_names(engines),
            time_limit_s=time_limit_s,
            times=times,
            progress=bar,
            workers=1 if by else WORKERS,
        )
    out.deliver(compared)
    by_method = compared if isinstance(compared, MethodComparison) else None
    if by_method and by_method.failures:
        raise typer.Exit(FAILED)
    has_plan = any(row["hover_time_s"] is not None for row in compared.rows)
    if not has_plan or (by_method and by_method.disagreements):
        raise typer.Exit(NO)


def _names(text: str | None) -> list[str] | None:
    return None if text is None else [name.strip() for name in text.split(",")]


def sensitivity(
    mission: str,
    uncertainty: Path | None = None,
    perspective: Perspective = "available",
    plan: Path | None = None,
    samples: int = 10_000,
    seed: int = 0,
    *,
    out: StudyOptions,
) -> None:
    """Find which numbers matter most, and how their uncertainty changes the hover time.

    Exit code 1 if the mission has no plan.
    """
    effects = optuav.sensitivity(
        out.mission(mission),
        uncertainty,
        perspective=perspective,
        plan=plan,
        samples=samples,
        seed=seed,
    )
    out.deliver(effects)
    if not effects.hover_time_s:
        raise typer.Exit(NO)


def power(mission: str, out: StudyOptions) -> None:
    """Show the power against airspeed, and the speeds of best endurance and best range."""
    out.deliver(optuav.power_curve(out.mission(mission)))


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
    climb_m: float | None = None,
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
    of_flights = {"start": start, "climb_m": climb_m}
    faults += [*_goes_with("hours", hours, of_event), *_goes_with("flights", flights, of_flights)]
    if flights is not None and start is None:
        faults.append(Fault("start", "", "is missing: --flights needs when the event begins"))
    with collected(faults):
        cycle = optuav.coverage(
            out.mission(mission),
            perspective=perspective,
            swap_s=swap_s,
            lit_hover=not dark_hover,
            pad_power_W=pad_power_W,
        )
    refuse(faults)
    notes: tuple[str, ...] = ()
    if flights is not None:
        from optuav.plan.export import system_on_earth
        from optuav.service.flights import save_flights

        system_on_earth(cycle.mission)  # Refused before the work
    results: Result = cycle.fleet(share, overlap_s) if fleet else cycle
    if horizon_hours is not None:
        results = cycle.horizon(horizon_hours)
    if hours is not None:
        step_m = None if separation_m is None else numbers_in(separation_m)
        with progress() as bar:
            results = event = cycle.event(
                hours,
                drones,
                bar,
                overlap_s=overlap_s,
                separation_m=step_m[0] if step_m and len(step_m) == 1 else step_m,
            )
        if flights is not None:
            assert start is not None
            notes = save_flights(event, flights, start, climb_m).notes
    figures, turns = dict[str, object](), list[str]()
    if drones is not None and hours is None:
        figures, turns = _turns(cycle, drones, share, overlap_s)
    out.deliver(results, figures, turns, () if flights is None else [flights])
    for note in notes:
        say(f"Note  {note}", error=out.as_json)


def _goes_with(name: str, value: object, options: Mapping[str, object]) -> Iterator[Fault]:
    """Yield options that are stated without another one, which they need."""
    for option, stated in options.items():
        if stated is not None and value is None:
            yield Fault(option, str(stated), f"goes with --{name}")


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
    faults = [Fault(name, f"{x:g}", words[name]) for name, x in named if x is not None]
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
    words += f", {overlap_s:g} s of overlap" * (overlap_s > 0.0)
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
    *,
    out: StudyOptions,
) -> None:
    """Count the drones, beams, pads, bays and packs of a fleet, for each way to charge."""
    table = optuav.size_fleet(out.mission(mission), prices, share, overlap_s, swap_s, hours)
    out.deliver(table)


def return_(mission: str, out: StudyOptions) -> None:
    """Find the last moment to leave the hover point, for the destination and every building.

    The laser charges the drone while it hovers. If nothing does, add --set laser= --set receiver=.

    Exit code 1 if the hover point cannot be reached.
    """
    times = optuav.return_by(out.mission(mission))
    out.deliver(times)


def robust(
    mission: str,
    uncertainty: Path,
    problem: str = "P1",
    building: str | None = None,
    order: Order | None = None,
    perspective: Perspective = "available",
    chance: float | None = None,
    confidence: float = 0.99,
    samples: int = 20_000,
    seed: int = 0,
    explain: bool = False,
    *,
    out: StudyOptions,
) -> None:
    """Find the longest hover that can be flown with any numbers in a box of ranges.

    Exit code 1 if no plan holds in the whole box, or in the share --chance of it.
    """
    from optuav.solving.question import problem_of

    if explain and out.as_json:
        raise InputError([Fault("explain", "", "cannot be combined with --json")])
    plans = optuav.robust(
        out.mission(mission),
        uncertainty,
        problem_of(problem, building=building, order=order),
        perspective=perspective,
        chance=chance,
        confidence=confidence,
        samples=samples,
        seed=seed,
    )
    out.deliver(plans)
    if explain:
        say(f"\n{optuav.explain(plans)}")


def map(
    mission: str,
    over: str,
    step_m: float,
    bounds: str | None = None,
    height_m: float | None = None,
    perspective: Perspective = "available",
    *,
    out: StudyOptions,
) -> None:
    """Map the longest hover over a grid of places for the device, the laser or the hover point.

    Exit code 1 if there is no plan anywhere.
    """
    from optuav import maps
    from optuav.maps.output import FORMATS, blocks, to_dict
    from optuav.maps.positions import DEVICE, HOVER_POINT, LASER, faults_of, hovers
    from optuav.mission.messages import unknown

    check_places(out.save, out.plot, *FORMATS, file_only="--save")
    places = {"device": DEVICE, "laser": LASER, "hover-point": HOVER_POINT}
    faults, ends = list[Fault](), None
    if over not in places:
        faults.append(unknown("--over", over, [*places]))
    if bounds is not None and not (ends := numbers_in(bounds) or None):
        words = "four numbers of metres with commas between them, such as 0,0,500,800"
        faults.append(Fault("--bounds", repr(bounds), words))
    with collected(faults):
        moved = mission_of(mission, out.settings)
    refuse([*faults, *(faults_of(step_m, ends, height_m, perspective) if faults else ())])
    found = hovers(places[over], moved, step_m, ends, height_m, perspective)
    written = []
    if out.save is not None:
        written.append(maps.save(found.labelled(), out.save))
    if out.plot is not None:
        from optuav.plots import hover_map, save_figures

        pictures = [(f"{over}.png", hover_map(moved, found.labelled()))]
        written += save_figures(pictures, out.plot)
    deliver(lambda: to_dict(found), blocks(found), as_json=out.as_json, written=written)
    if "best_m" not in found.facts:
        raise typer.Exit(NO)


def sweep(
    study: Path,
    workers: int = 1,
    scheduler: str | None = None,
    resume: bool = True,
    as_json: bool = False,
    plot: Path | None = None,
) -> None:
    """Solve all scenarios of a study, saved part by part (needs pyarrow)."""
    check_places(None, plot)
    from optuav.studies.sweep import open_sweep, planned, run

    plan = planned(study, workers, scheduler)
    if plot is not None and not plan.is_drawable:
        words = "goes with up to three keys, of several values each, one of them in [grid]"
        refuse([Fault("plot", "", words)])
    began_s = time.monotonic()
    with progress("scenarios") as bar:
        done = run(plan, workers, scheduler, resume, bar)
    took_s = time.monotonic() - began_s
    written = list[Path]()
    if plot is not None:
        from optuav import plots

        written = plots.save_figures(plots.swept(open_sweep(done.directory)), plot)
    plans = {name: done.scenarios - sum(why.values()) for name, why in done.reasons.items()}
    data = {
        "kind": "optuav sweep",
        **done._asdict(),
        "directory": str(done.directory),
        "plans": plans,
        "without_plan": {name: done.scenarios - count for name, count in plans.items()},
        "pictures": [str(path) for path in written],
        "elapsed_s": round(took_s, 3),
    }
    deliver(
        lambda: data, [Facts([*_swept(done, plans)], whole=True)], as_json=as_json, written=written
    )


def _swept(done: Swept, plans: Mapping[str, int]) -> Iterator[tuple[str, str]]:
    """Yield how many scenarios have a plan, why others have none, and the range of hovers."""
    yield "Scenarios", f"{done.scenarios}"
    yield "Parts", f"{done.parts}" + f", {done.kept} of them from before" * bool(done.kept)
    yield "Directory", f"{done.directory}"
    for name, reasons in done.reasons.items():
        why = [f"{count} without: {words}" for words, count in reasons.items()]
        yield "Plans", "; ".join([f"{name} {plans[name]}", *why])
        if ends := done.hover_time_s[name]:
            yield "Hover", f"{name} {ends['shortest']:.2f} to {ends['longest']:.2f} s"


def reproduce(
    out: Path = Path("reproduced"), only: list[str] | None = None, mission: str | None = None
) -> None:
    """Reproduce every table and figure of the paper, with a report that opens offline.

    Exit code 1 if the mission has no plan.
    """
    from optuav.paper.curves import solve
    from optuav.paper.figures import why

    check_places(None, out)
    studied = None if mission is None else optuav.load(mission)
    with progress() as bar:
        written = optuav.reproduce(
            out, only=only or (), mission=studied, progress=bar, workers=WORKERS
        )
    say(f"wrote {len(written)} files, among them {out / 'report.html'}")
    if studied is not None and not (plan := solve(studied)):
        say(f"{studied.name} has no plan: {why(plan)}")
        raise typer.Exit(NO)


def ledger(
    names: list[str] | None = None,
    details: bool = False,
    as_json: bool = False,
    save: Path | None = None,
) -> None:
    """Recompute the paper's numbers, and say which match and why others do not."""
    check_places(save, None, ".csv")
    with progress():
        entries = optuav.ledger(names or ())
    if save is not None:
        from optuav.mission.files import write_text

        write_text(save, entries.to_csv())
    blocks: list[Block] = [*(entries.entry_blocks() if names or details else entries.blocks())]
    if not (names or details):
        blocks.append(Note(["With reasons: optuav ledger --details, or NAME..."]))
    deliver(entries.records, blocks, as_json=as_json)

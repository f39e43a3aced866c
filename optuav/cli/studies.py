"""``optuav compare`` and ``sensitivity``, ``reproduce`` and ``ledger``: many solves at once."""

import os
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

import optuav
from optuav.cli.options import mission_of
from optuav.cli.output import FAILED, NO, check_places, deliver, deliver_results, progress, say
from optuav.errors import Fault, InputError, NoPlanError, decimal, refuse
from optuav.options import Order, Perspective

if TYPE_CHECKING:
    from optuav.studies.results import Results

WORKERS = min(os.cpu_count() or 1, 4)  # Processes that share work: each takes a second to start


def compare(
    mission: str,
    slots_s: str | None = None,
    perspective: Perspective | None = None,
    engines: str | None = None,
    time_limit_s: float | None = None,
    by: str | None = None,
    times: bool = False,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Compare answers in slots and in continuous times, by all engines, or plans.

    Exit code 1 if answers disagree or there is no feasible plan, 3 if an engine failed.
    """
    check_places(save, plot, ".csv", ".json")
    try:
        lengths_s = None if slots_s is None else [decimal(length) for length in slots_s.split(",")]
    except ValueError:
        words = "numbers of seconds with commas between them, as in 0.5,1,60"
        raise InputError([Fault("--slots", repr(slots_s), words)]) from None
    with progress() as bar:
        compared = optuav.compare(
            mission_of(mission, settings),
            by=_names(by) or "method",
            perspective=perspective,
            slots_s=lengths_s,
            engines=_names(engines),
            time_limit_s=time_limit_s,
            times=times,
            progress=bar,
            workers=1 if by else WORKERS,
        )
    deliver_results(compared, save, plot, as_json=as_json)
    if compared.facts.get("failures"):
        raise typer.Exit(FAILED)
    has_plan = any(row["hover_time_s"] is not None for row in compared.rows)
    if not has_plan or compared.facts.get("disagreements"):
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
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find which numbers matter most, and what their uncertainty means for the hover time.

    Exit code 1 if the mission has no plan.
    """
    check_places(save, plot, ".csv", ".json")
    effects = optuav.sensitivity(
        mission_of(mission, settings),
        uncertainty,
        perspective=perspective,
        plan=None if plan is None else optuav.load_plan(plan),
        samples=samples,
        seed=seed,
    )
    deliver_results(effects, save, plot, as_json=as_json)
    if not effects.facts["hover_time_s"]:
        raise typer.Exit(NO)


def power(
    mission: str,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find the power over the air speed, and the speeds of best endurance and range."""
    check_places(save, plot, ".csv", ".json")
    deliver_results(optuav.power_curve(mission_of(mission, settings)), save, plot, as_json=as_json)


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
    horizon_hours: float | None = None,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find the share of the day that one drone covers, for ever, and the fleet for more.

    Exit code 1 if there is no endless cycle.
    """
    from optuav.mission.messages import counted, misfits
    from optuav.service.fleet import COUNT, covering
    from optuav.service.horizon import HOURS

    check_places(save, plot, ".csv", ".json")
    fleet = share is not None or overlap_s is not None
    hours_stated = {"horizon_hours": horizon_hours, "hours": hours}
    single = [name for name, value in hours_stated.items() if value is not None]
    if len(single) + fleet > 1 or (horizon_hours is not None and drones is not None):
        words = "plans some hours of one drone, so leave out the other hours, --share, --overlap-s "
        words += "and --drones"
        if single == ["hours"]:
            words = "plans an event with all of its time covered: leave out --share and --overlap-s"
            words += ", or leave out --hours for a fleet that covers a share without end"
        raise InputError([Fault(name, f"{hours_stated[name]:g}", words) for name in single])
    share = 1.0 if share is None else share
    covered = optuav.coverage(
        mission_of(mission, settings),
        perspective=perspective,
        swap_s=swap_s,
        lit_hover=not dark_hover,
        pad_power_W=pad_power_W,
    )
    results: Results = covered.fleet(share, overlap_s or 0.0) if fleet else covered
    if horizon_hours is not None:
        refuse(misfits(("horizon_hours", horizon_hours, HOURS)))
        results = covered.horizon(horizon_hours)
    if hours is not None:
        results = covered.event(hours, drones)
    words = ""
    if drones is not None and hours is None:
        refuse(misfits(("drones", drones, COUNT)))
        covers = min(drones * covered.share, 1.0)  # In turns, without overlap
        facts = {"pad_drones": drones, "drones_share": covers}
        words = f"\nTurns of {counted(drones, 'drone')} cover {covers:.2%} of the time"
        if swap_s is None:
            try:
                pads = covered.watts(drones, share, overlap_s or 0.0)
                facts |= {f"pad_{name}": value for name, value in pads._asdict().items()}
                words += f"\nPads {covering(share, overlap_s or 0.0)}: {pads}"
            except NoPlanError as error:
                words += f"\n{error}"
        results = replace(results, facts={**results.facts, **facts})
    deliver_results(results, save, plot, as_json=as_json)
    if words and not as_json:
        say(words)


def size(
    mission: str,
    prices: Path | None = None,
    share: float = 1.0,
    overlap_s: float = 0.0,
    swap_s: float = 120.0,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find the drones, beams, pads, bays and packs that cover a share, by technology."""
    check_places(save, plot, ".csv", ".json")
    table = optuav.size_fleet(mission_of(mission, settings), prices, share, overlap_s, swap_s)
    deliver_results(table, save, plot, as_json=as_json)


def return_(
    mission: str,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find the last moment to leave the hover point, for the destination and every building.

    The laser goes on charging the hover; where nothing does, --set laser= --set receiver=.

    Exit code 1 if the hover point cannot be reached.
    """
    check_places(save, plot, ".csv", ".json")
    times = optuav.return_by(mission_of(mission, settings))
    deliver_results(times, save, plot, as_json=as_json)


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
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find the longest hover that can be flown wherever uncertain numbers lie in a box.

    Exit code 1 if no plan holds in the whole box, or with the chance.
    """
    from optuav.solving.question import problem_of

    check_places(save, plot, ".csv", ".json")
    if explain and as_json:
        raise InputError([Fault("explain", "", "cannot be combined with --json")])
    plans = optuav.robust(
        mission_of(mission, settings),
        uncertainty,
        problem_of(problem, building=building, order=order),
        perspective=perspective,
        chance=chance,
        confidence=confidence,
        samples=samples,
        seed=seed,
    )
    deliver_results(plans, save, plot, as_json=as_json)
    if explain:
        say(f"\n{optuav.explain(plans)}")


def reproduce(
    out: Path = Path("reproduced"), only: list[str] | None = None, mission: str | None = None
) -> None:
    """Make every table and figure of the paper, with a report that opens offline.

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
    """Compute the paper's numbers again, and say which match and why others do not."""
    check_places(save, None, ".csv")
    with progress():
        entries = optuav.ledger(names or ())
    if save is not None:
        from optuav.mission.files import write_text

        write_text(save, entries.to_csv())
    more = f"{entries.summary}\n\nWith reasons: optuav ledger --details, or NAME..."
    deliver(entries.records, entries.details if names or details else more, as_json=as_json)

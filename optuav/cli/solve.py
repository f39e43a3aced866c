"""``optuav solve``, ``explain``, ``audit`` and ``formulate``: one problem and its answer."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import optuav
from optuav.cli.options import ProblemOptions, SolveOptions, by_flags, is_plan, number_or_text
from optuav.cli.output import FAILED, NO, check_places, command, deliver, progress, say
from optuav.errors import Fault, InputError, NoPlanError, collected, refuse
from optuav.options import Perspective
from optuav.presentation.numbers import figure, seconds
from optuav.status import Status

if TYPE_CHECKING:
    from formulations.formulation import Formulation
    from optuav.plan import Plan

OTHER_PERSPECTIVE: dict[str, Perspective] = {"battery": "available", "available": "battery"}
"""The perspective whose plan pictures show beside: one counts charge only, one both wells."""
PRINTED = {".txt": "text", ".tex": "latex"}
"""Printed forms of a problem, by the suffixes of their files."""


def solve(
    mission: str,
    asked: SolveOptions,
    solver: str | None = None,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
    animate: Path | None = None,
) -> None:
    """Find the longest hover for a mission, and show the plan."""
    asked_mission, problem, options = asked.question(mission, settings)
    if solver is not None:
        if asked.engine != "cvxpy":
            raise InputError([Fault("--solver", repr(solver), "goes with --engine cvxpy")])
        options["engine"] = optuav.Cvxpy(solver=solver)
    check_places(save, plot, ".json", "")
    check_places(animate, None, ".gif", file_only="--animate")
    one_stop = not {asked.stops, asked.hovers} - {None, 1}
    in_slots = "grid" in (asked.engine, asked.slot_s and asked.engine.replace("auto", "grid"))
    explained = one_stop and asked.hover_point in (None, "w_U")
    explained = explained and asked.speed in (None, "mission")
    with progress() if in_slots or not explained else nullcontext() as bar:
        if bar is not None and in_slots:
            from optuav.engines.grid import Grid

            words = "pairs of slots of a route"
            options["engine"] = Grid(
                lambda tried, most: bar(tried, most, f"{figure(most, 3)} {words}")
            )
        elif bar is not None and not one_stop:
            words = "hover {} so far, {} boxes examined, {} open"
            options["progress"] = lambda hover_s, examined, left: bar(
                examined, None, words.format(seconds(hover_s), examined, left)
            )
        plan = optuav.solve(asked_mission, problem, **options)
    written = [] if save is None else [plan.save(save)]
    if plot is not None:
        from optuav.plots import save_pictures

        written += save_pictures(plan, plot, _beside(plan, problem) if explained else ())
    if animate is not None:
        written += _animated(plan, animate)
    hint = ""
    if plan.status is Status.INFEASIBLE and explained:
        hint = f"What would make it feasible:\n{_explaining(mission, asked, settings)}"
    deliver(plan.to_dict, plan.blocks(), as_json=as_json, hint=hint, written=written)
    _leave(plan)


def _animated(plan: Plan, file: Path) -> list[Path]:
    """Write the flight as an animation and return the file; without a plan, none."""
    if not plan:
        say(f"{file} is not written: there is no plan to show", error=True)
        return []
    from optuav.plots import save_animation

    return [save_animation(optuav.replay(plan), file)]


def _explaining(mission: str, asked: SolveOptions, settings: list[str] | None) -> str:
    """The command that explains a question."""
    usual, options = vars(SolveOptions()), vars(asked).items()
    pairs = [(f"--{name.replace('_', '-')}", f"{x}") for name, x in options if x != usual[name]]
    pairs += [("--set", setting) for setting in settings or ()]
    return command(["optuav", "explain", mission], *pairs)


def _leave(plan: Plan) -> None:
    """Leave with the exit code of an answer that is not proved, or of no plan."""
    if plan.status in (Status.FEASIBLE, Status.UNKNOWN):
        raise typer.Exit(FAILED)
    if not plan:
        raise typer.Exit(NO)


def _beside(plan: Plan, problem: Formulation) -> list[Plan]:
    """The plan of the same problem in the perspective that pictures compare with, if it has one."""
    if not plan or plan.perspective not in OTHER_PERSPECTIVE or plan.mission.battery.takes_turns:
        return []
    perspective = OTHER_PERSPECTIVE[plan.perspective]
    try:
        other = optuav.solve(plan.mission, problem, perspective=perspective, slot_s=plan.slot_s)
    except InputError:  # Not every perspective takes devices in any order
        return []
    return [other] if other else []


def explain(
    mission: str, asked: SolveOptions, settings: list[str] | None = None, as_json: bool = False
) -> None:
    """Explain why a plan is the best one, or why there is none and which changes would help.

    With --stops or --hovers, search for more stops and say what they gain, for a minute unless
    --time-limit-s says otherwise. Exit code 1 if there is no feasible plan, 3 if
    the answer is not proved.
    """
    from optuav.solving.more_stops import MORE_STOPS

    more: dict[str, Any] = {"stops": asked.stops, "hovers": asked.hovers}
    changed = vars(asked).items() - vars(SolveOptions()).items() - more.items()
    if is_plan(mission, [*(name for name, _ in changed), *(["set"] if settings else [])]):
        from optuav.diagnosis.explain import problem_of_plan, saved_plan

        plan = saved_plan(mission)
        if asked.stops is None and asked.hovers is None:
            explained = optuav.explain(plan)
        else:
            perspective: Any = plan.perspective
            problem = problem_of_plan(plan, **more)
            explained = optuav.explain(plan.mission, problem, perspective=perspective)
    else:
        asked_mission, problem, options = asked.question(mission, settings)
        explained = optuav.explain(asked_mission, problem, **options)
    hint = ""
    if any(note.startswith(f"{MORE_STOPS}: ") for note in explained.notes):
        searched = replace(asked, stops=2, hovers=2, engine="auto", slot_s=None, order=None)
        hint = f"What more stops would gain:\n{_explaining(mission, searched, settings)}"
    deliver(explained.to_dict, explained.blocks(), as_json=as_json, hint=hint)
    _leave(explained.plan)


def audit(
    plan: str, drone: str | None = None, as_json: bool = False, plot: Path | None = None
) -> None:
    """Simulate a plan with only its mission, and say whether it can be flown.

    Exit code 1 if it cannot, 2 if the file cannot be read.
    """
    from optuav.judge.audit import subject_of

    faults = list[Fault]()
    if plot is not None:
        from optuav.plots.files import SEVERAL

        with collected(faults):
            check_places(plot, None, *SEVERAL, file_only="--plot")
    with collected(faults):
        if faults:  # Only what else is wrong, before the work
            subject_of(plan, drone)
        else:
            judged = optuav.audit(plan, drone)
    refuse(
        fault  # A key of a file
        if fault.key and fault.source
        else by_flags(fault, {"mission": "--mission"}, r"(?<=by )mission")
        for fault in faults
    )
    written = []
    if plot is not None and judged.replay is not None and judged.replay.phases:
        from optuav import plots

        written.append(plots.save(plots.profile(judged.replay), plot))
    deliver(judged.to_dict, judged.blocks(), as_json=as_json, written=written)
    if not judged:
        raise typer.Exit(NO)


def export(plan: str, file: Path, climb_m: str | None = None, force: bool = False) -> None:
    """Export a saved plan to files for maps or autopilots.

    A plan with rests becomes one .plan or .waypoints file per flight. Exit code 1 if there is no
    plan.
    """
    from optuav.mission.files import ending_of, write_files
    from optuav.plan.export import SUFFIXES, climb_faults, exported

    faults, saved = list[Fault](), None
    height_m: Any = number_or_text(climb_m)
    with collected(faults):
        faults += climb_faults(height_m, ending_of(file, *SUFFIXES, name="FILE"))
    with collected(faults):
        saved = optuav.load_plan(plan)
    refuse(faults)
    assert saved is not None
    try:
        files, notes = exported(saved, file, climb_m=height_m, force=force)
    except NoPlanError as error:
        say(f"{error}")
        raise typer.Exit(NO) from None
    write_files(files)
    for note in notes:
        say(f"Note  {note}")
    for path in files:
        say(f"wrote {path}", most=None)


def formulate(
    mission: str,
    asked: ProblemOptions,
    settings: list[str] | None = None,
    latex: bool = False,
    lp: bool = False,
    mps: bool = False,
    save: Path | None = None,
) -> None:
    """Print a problem as it is solved, with its parameters.

    --lp and --mps write one linear programme with its numbers and continuous times:
    if there are several routes, the one of the best plan. A .nl, .gms or .bar file can
    hold any programme; writing it needs Pyomo. Exit code 1 if no route can be flown
    with any deadline, so that there is no model; solve finds whether it has an answer.
    """
    from optuav.solving.files import ENDINGS

    forms = [name for name, wanted in (("latex", latex), ("lp", lp), ("mps", mps)) if wanted]
    if len(forms) > 1:
        flags = ", ".join(f"--{name}" for name in forms)
        raise InputError([Fault(flags, "", "one of --latex, --lp, --mps")])
    by_suffix = PRINTED | {ending: ending[1:] for ending in ENDINGS}
    endings = [
        ending for ending, form in by_suffix.items() if form in (forms or by_suffix.values())
    ]
    check_places(save, None, *endings, "")
    form = forms[0] if forms else by_suffix.get("" if save is None else save.suffix.lower(), "text")
    asked_mission, problem, options = asked.question(mission, settings)
    program = optuav.formulate(asked_mission, problem, **options)
    if not program.parts:
        say(str(program))
        raise typer.Exit(NO)
    if form in PRINTED.values():
        text = program.to_latex() if form == "latex" else str(program)
    else:
        text = program.to_file(form).rstrip("\n")
    if save is None:
        say(text, most=96 if form == "text" else None)
    else:
        from optuav.mission.files import write_text

        write_text(save, f"{text}\n")
        if save != Path("-"):
            say(f"wrote {save}", most=None)

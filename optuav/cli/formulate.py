"""``optuav formulate``: a problem as mathematics, or as a file that other solvers read."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Annotated, cast

import typer

import optuav
from optuav.cli.options import (
    BUILDING,
    HOVER_POINT,
    ORDER,
    PERSPECTIVE,
    PROBLEM,
    SLOT,
    TRAJECTORY,
    MissionArgument,
    SetOption,
    mission_of,
)
from optuav.errors import Fault, InputError
from optuav.options import Perspective

NO = 1
WIDTH = 80


def formulate(
    mission: MissionArgument,
    problem: Annotated[str, PROBLEM] = "P1",
    trajectory: Annotated[str | None, TRAJECTORY] = None,
    building: Annotated[str | None, BUILDING] = None,
    order: Annotated[str | None, ORDER] = None,
    perspective: Annotated[str, PERSPECTIVE] = "available",
    slot_s: Annotated[float | None, SLOT] = None,
    hover_point: Annotated[str | None, HOVER_POINT] = None,
    settings: SetOption = None,
    latex: Annotated[bool, typer.Option("--latex", help="Print LaTeX (package amsmath).")] = False,
    lp: Annotated[bool, typer.Option("--lp", help="Print a file in CPLEX LP format.")] = False,
    mps: Annotated[bool, typer.Option("--mps", help="Print a file in free MPS format.")] = False,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="FILE", help="Write to a file instead.")
    ] = None,
) -> None:
    """Print a problem as it is solved, with its parameters.

    --lp and --mps hold one linear programme with numbers, its times continuous:
    of several routes the one that solve takes. Exit code 1 if nothing can fly.
    """
    forms = [name for name, asked in (("latex", latex), ("lp", lp), ("mps", mps)) if asked]
    if len(forms) > 1:
        given = ", ".join(f"--{name}" for name in forms)
        raise InputError([Fault(given, "", "one of --latex, --lp, --mps")])
    from optuav.solving.question import problem_of

    program = optuav.formulate(
        mission_of(mission, settings),
        problem_of(
            problem,
            trajectory=trajectory,
            building=building,
            order=order,
            hover_point=hover_point,
        ),
        perspective=cast(Perspective, perspective),
        slot_s=slot_s,
    )
    if not program.parts:
        typer.echo(textwrap.fill(str(program), WIDTH, subsequent_indent="  "))
        raise typer.Exit(NO)
    from optuav.mission.files import write_text
    from optuav.studies.statement import statement

    text = statement(program, *forms).rstrip("\n")
    if save is None:
        typer.echo(text)
    else:
        write_text(save, f"{text}\n")
        typer.echo(f"wrote {save}")

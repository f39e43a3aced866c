"""``optuav formulate``: a problem as mathematics, or as a file that other solvers read."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Annotated

import typer

import optuav
from optuav.cli import options
from optuav.cli.output import NO, check_places
from optuav.errors import Fault, InputError
from optuav.mission.files import write_text
from optuav.options import Perspective

WIDTH = 80


def formulate(
    mission: options.MissionArgument,
    problem: Annotated[str, options.PROBLEM] = "P1",
    trajectory: Annotated[str | None, options.TRAJECTORY] = None,
    building: Annotated[str | None, options.BUILDING] = None,
    order: Annotated[str | None, options.ORDER] = None,
    perspective: Annotated[Perspective, options.PERSPECTIVE] = "available",
    slot_s: Annotated[float | None, options.SLOT] = None,
    hover_point: Annotated[str | None, options.HOVER_POINT] = None,
    settings: options.SetOption = None,
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
    check_places(save, None)
    stated = options.mission_of(mission, settings)
    fields = {"trajectory": trajectory, "building": building, "order": order}
    fields |= {"hover_point": hover_point}
    asked = options.problem_of(stated, problem, fields, perspective=perspective, slot_s=slot_s)
    program = optuav.formulate(stated, asked, perspective=perspective, slot_s=slot_s)
    if not program.parts:
        typer.echo(textwrap.fill(str(program), WIDTH, subsequent_indent="  "))
        raise typer.Exit(NO)
    from optuav.solving.statement import statement

    text = statement(program, *forms).rstrip("\n")
    if save is None:
        typer.echo(text)
    else:
        write_text(save, f"{text}\n")
        typer.echo(f"wrote {save}")

"""``optuav place``: where lasers should stand."""

from __future__ import annotations

import json
from pathlib import Path

import typer

import optuav
from optuav.cli.options import mission_of
from optuav.cli.output import NO, check_places, deliver, progress
from optuav.errors import Fault, collected, refuse
from optuav.options import Perspective


def place(
    missions: list[str],
    candidates: str,
    lasers: int = 1,
    step_m: float | None = None,
    objective: str = "mean",
    at_least_s: float | None = None,
    perspective: Perspective = "available",
    refine: bool = True,
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    save_missions: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Choose where lasers stand, from the points of a map or of a grid, for one mission or many.

    Exit code 1 if no laser gives any mission a plan.
    """
    from optuav.siting.candidates import GRID, points_of

    faults, loaded = list[Fault](), []
    with collected(faults):
        check_places(save, plot, ".geojson", ".kml", ".json", file_only="--save")
    for mission in missions:
        with collected(faults):
            loaded.append(mission_of(mission, settings))
    if faults:
        from optuav.siting.place_laser import option_faults

        faults += option_faults(lasers, objective, at_least_s, perspective)
        with collected(faults):
            points_of(candidates, step_m)
    refuse(faults)
    if save is not None and save.suffix.lower() != ".json":
        from optuav.plan.export import system_on_earth

        system_on_earth(loaded[0])  # Refused before the work
    with progress("hover times") as bar:
        placed = optuav.place_laser(
            loaded,
            candidates if candidates == GRID else Path(candidates),
            lasers,
            step_m=step_m,
            objective=objective,  # type: ignore[arg-type]  # Refused in words
            at_least_s=at_least_s,
            perspective=perspective,
            refine=refine,
            progress=bar,
        )
    written = _write(placed, save, save_missions, plot)
    deliver(placed.to_dict, str(placed), as_json=as_json, written=written)
    if not placed.selection.sites:
        raise typer.Exit(NO)


def _write(
    placed: optuav.Siting, save: Path | None, save_missions: Path | None, plot: Path | None
) -> list[Path]:
    """Write lasers and hover times, a mission for each laser, and a picture, as asked."""
    written = list[Path]()
    if save is not None and save.suffix.lower() == ".json":
        from optuav.mission.files import write_text

        write_text(save, f"{json.dumps(placed.to_dict(), indent=2, ensure_ascii=False)}\n")
        written.append(save)
    elif save is not None:
        written.append(placed.save(save))
    if save_missions is not None:
        written += placed.save_missions(save_missions)
    if plot is not None:
        from optuav.plots import sites
        from optuav.plots.files import save_everywhere

        written += save_everywhere([("sites", sites(placed))], plot)
    return written

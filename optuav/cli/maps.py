"""``optuav map``: the longest hover over positions."""

from __future__ import annotations

from pathlib import Path

import typer

from optuav.cli.options import mission_of, numbers_in
from optuav.cli.output import NO, check_places, deliver
from optuav.errors import Fault, collected, refuse
from optuav.options import Perspective

MOVED = ("device", "laser", "hover-point")  # Each with its function in `optuav.maps`


def map(
    mission: str,
    over: str,
    step_m: float,
    bounds: str | None = None,
    height_m: float | None = None,
    perspective: Perspective = "available",
    settings: list[str] | None = None,
    as_json: bool = False,
    save: Path | None = None,
    plot: Path | None = None,
) -> None:
    """Find the longest hover with the device, the laser or the hover point anywhere on a grid.

    Exit code 1 if there is no plan anywhere.
    """
    from optuav import maps
    from optuav.maps.output import FORMATS, summary, to_dict
    from optuav.maps.positions import DEVICE, HOVER_POINT, LASER, faults_of, hovers
    from optuav.mission.files import STANDARD
    from optuav.mission.messages import unknown

    check_places(save, plot, *FORMATS)
    faults, ends = list[Fault](), None
    if save == STANDARD:
        faults.append(Fault("--save", "'-'", f"a name that ends in {' or '.join(FORMATS)}"))
    if over not in MOVED:
        faults.append(unknown("--over", over, MOVED))
    if bounds is not None and not (ends := numbers_in(bounds) or None):
        words = "four numbers of metres with commas between them, as in 0,0,500,800"
        faults.append(Fault("--bounds", repr(bounds), words))
    with collected(faults):
        moved = mission_of(mission, settings)
    refuse([*faults, *(faults_of(step_m, ends, height_m, perspective) if faults else ())])
    key = dict(zip(MOVED, (DEVICE, LASER, HOVER_POINT), strict=True))[over]
    hovers_found = hovers(key, moved, step_m, ends, height_m, perspective)
    written = []
    if save is not None:
        written.append(maps.save(hovers_found.labelled(), save))
    if plot is not None:
        from optuav.plots import hover_map, save_figures

        written += save_figures([(f"{over}.png", hover_map(moved, hovers_found.labelled()))], plot)
    deliver(lambda: to_dict(hovers_found), summary(hovers_found), as_json=as_json, written=written)
    if "best_m" not in hovers_found.facts:
        raise typer.Exit(NO)

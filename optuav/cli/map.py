"""``optuav map``: hover times over a grid of positions."""

from __future__ import annotations

import typer

from optuav.cli.options import mission_of, numbers_in
from optuav.cli.output import NO, check_places, deliver
from optuav.cli.study_options import StudyOptions
from optuav.errors import Fault, collected, refuse
from optuav.options import Perspective


def map(
    mission: str,
    over: str,
    step_m: float,
    bounds: str | None = None,
    height_m: float | None = None,
    device: str | None = None,
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
    found = hovers(places[over], moved, step_m, ends, height_m, perspective, device)
    written = []
    if out.save is not None:
        written.append(maps.save(found.labelled(), out.save))
    if out.plot is not None:
        from optuav.plots import hover_map
        from optuav.plots.files import save_everywhere

        pictures = [(f"{over}.png", hover_map(moved, found.labelled()))]
        written += save_everywhere(pictures, out.plot)
    deliver(lambda: to_dict(found), blocks(found), as_json=out.as_json, written=written)
    if "best_m" not in found.facts:
        raise typer.Exit(NO)

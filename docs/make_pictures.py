"""Draw the pictures of the pages from the package itself: ``python docs/make_pictures.py``.

Draw them again after a change of the plots; matplotlib is needed.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

import optuav
from optuav import plots
from optuav.paper.figures import by_perspective

PICTURES = Path(__file__).parent / "pictures"
DATA = Path(__file__).parents[1] / "examples" / "data"
DOTS_PER_INCH = 110


def pictures() -> Iterator[tuple[str, Axes]]:
    """Name of every picture, and one of its axes."""
    plan, promised = (optuav.solve("paper", perspective=each) for each in ("available", "battery"))
    yield "map", plots.mission_map(plan).plan
    yield "promised", plots.wells([promised, plan])[0]
    direct = [
        optuav.solve("paper", "P3", perspective=perspective)
        for perspective in ("battery", "available")
    ]
    yield "wells", plots.wells(direct)[0]
    program = optuav.formulate("paper", optuav.P4("b1", order="rest-first"), perspective="battery")
    (part,) = program.parts
    yield "plane", plots.plane(part.model, part.model.row(0), [program.solve()])
    yield "profile", plots.profile(optuav.replay(promised)).speed
    found = optuav.sensitivity("paper", {})
    yield "tornado", found.plot()["tornado.png"].axes[0]
    by_schedule = optuav.compare(plan.mission, by="schedule", slots_s=10.0)
    yield "packs", by_schedule.plot()["packs.png"].axes[0]
    yield "leg", plots.leg(plan.mission, "origin", "hover").speed
    logged = optuav.fit_regimes([DATA / "flight_log.csv"])
    yield "fit", plots.fit(logged)[0].values
    (bars,) = (
        each.axes
        for each in by_perspective(optuav.load("paper-table2"))
        if each.name == "hover-time.paper-table2.1200s"
    )
    yield "perspectives", bars
    deadlines, sizes = np.arange(300, 1801, 25), np.arange(20_000, 42_001, 500)
    every = ["battery", "energy", "available"]
    lines = optuav.batch("paper", {"limits.deadline_s": deadlines}, perspective=every)
    grid = optuav.batch("paper", {"limits.deadline_s": deadlines, "battery.capacity_As": sizes})
    for name, found in (("lines", lines), ("grid", grid)):
        yield f"sweep-{name}", next(plots.swept(found))[1]
    haze = {"laser.visibility_km": 2, "limits.deadline_s": 1800}
    for name, changed in (("device", {}), ("laser", haze), ("hover_point", {})):
        mission = optuav.load("paper").replace(changed)
        found = getattr(optuav.maps, name)(mission, 12 if name == "hover_point" else 20)
        yield f"map-{name.replace('_', '-')}", plots.hover_map(mission, found)


def draw(directory: Path = PICTURES) -> None:
    """Write all pictures into a directory."""
    directory.mkdir(exist_ok=True)
    for name, ax in pictures():
        figure = ax.get_figure(root=True)
        assert figure is not None
        figure.savefig(directory / f"{name}.png", dpi=DOTS_PER_INCH, metadata={"Software": None})


if __name__ == "__main__":
    draw()

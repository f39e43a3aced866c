"""Things from outside: the examples of the page as a plugin that nobody installed, and refusals."""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pytest

import optuav
from optuav.cli import main
from optuav.engines.nonlinear_form import nonlinear_form
from optuav.engines.registry import Engine, OneByOne
from optuav.engines.solution import Solution
from optuav.errors import InputError
from optuav.fields import Speed
from optuav.flight.model import FLIGHTS, MODEL, FlightModel, FlightTable
from optuav.laser.beam import Beam, LaserTable
from optuav.modelling import Model, Parameter
from optuav.physics.flight import Flow, Loads
from optuav.plugins import GROUP, read_plugins
from optuav.registration import EVERY_KIND, with_registered
from optuav.tables import BatteryPacks, Body

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "extend.md").read_text("utf-8")
MINE = "\n\n".join(
    block
    for block in re.findall(r"^```python\n(.*?)^```$", PAGE, re.M | re.S)
    if "register" in block
)
"""The file ``mine.py`` of the page."""
BY_FUNCTION = (
    re.sub(r"^@optuav.register\n|^optuav.register.*\n", "", MINE, flags=re.M)
    + """

def register_all():
    for thing in (Hops, Tube, SmallestPack, Linprog(), Slsqp(), both_wells):
        optuav.register(thing)
"""
)
"""The same with a function that registers: its import alone does nothing."""
TOWN = """
schema = 1
extends = "paper"

[flight]
model = "hops"
speed_m_s = 15
acceleration_m_s2 = 2
current_A = 70

[laser]
beam = "tube"
width_m = 0.8

[receiver]
radius_m = 0.15
cell_efficiency = 0.5
"""
STUDY = """
mission = "town.toml"

[grid]
flight.speed_m_s = [12.0, 15.0]
laser.width_m = [0.8]
"""


@pytest.fixture(autouse=True)
def nothing_stays() -> Iterator[None]:
    """What a test registers is taken out."""
    yield
    for kind in EVERY_KIND:
        for name in kind.registered():
            kind.take_out(name)


def plugin(folder: Path, entry: str = "mine") -> dict[str, str]:
    """An environment in which a module is installed as a plugin, as far as Python can tell."""
    about = folder / "mine-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: mine\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(f"[{GROUP}]\nmine = {entry}\n")
    (folder / "mine.py").write_text(BY_FUNCTION if ":" in entry else MINE, "utf-8")
    (folder / "town.toml").write_text(TOWN)
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])}


def mine() -> dict[str, Any]:
    """The names of ``mine.py``, run in this process."""
    names: dict[str, Any] = {}
    exec(compile(MINE, "mine.py", "exec", dont_inherit=True), names)
    return names


def run(folder: Path, environment: dict[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    """A command of Python in a process of its own."""
    command = [sys.executable, *words]
    settings: dict[str, Any] = {"cwd": folder, "env": environment, "encoding": "utf-8"}
    return subprocess.run(command, capture_output=True, check=False, **settings)


ENTRIES = [pytest.param("mine", marks=pytest.mark.soak), "mine:register_all"]


@pytest.mark.slow
@pytest.mark.parametrize("entry", ENTRIES)
def test_the_command_line_reads_plugins(tmp_path: Path, entry: str) -> None:
    """Flight model, beam, problem, engine and picture of the page, by their names."""
    pytest.importorskip("matplotlib")
    environment = plugin(tmp_path, entry)
    sought = ("--problem", "SmallestPack", "--set", "wanted_hover_s=400", "--building", "b4")
    own = ("--engine", "slsqp", "--plot", "pictures", *sought)
    done = run(tmp_path, environment, "-m", "optuav", "solve", "town.toml", *own)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"^Hover +400.00 s", done.stdout, re.M)
    assert (tmp_path / "pictures" / "both_wells.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("entry", ENTRIES)
def test_workers_of_a_sweep_read_plugins(tmp_path: Path, entry: str) -> None:
    """Two workers answer a study of the plugin's flight model, beam and problem."""
    pytest.importorskip("distributed")
    environment = plugin(tmp_path, entry)
    problem = '[problem]\nname = "SmallestPack"\nwanted_hover_s = 400.0\nbuilding = "b4"\n'
    (tmp_path / "study.toml").write_text(f"scenarios_per_part = 1\n{STUDY}\n{problem}")
    words = ("-m", "optuav", "sweep", "study.toml", "--workers", "2")
    done = run(tmp_path, environment, *words)
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"^Hover +available 400.00 to 400.00 s", done.stdout, re.M)


EXPLORED = """
if __name__ == "__main__":
    from optuav.explorer.worker import Worker
    read_plugins()
    worker = Worker(optuav.load("town.toml"))
    print(worker.ask({"number": 1})["verdict"])
    worker.end()
"""


@pytest.mark.soak
def test_the_process_of_the_explorer_reads_plugins(tmp_path: Path) -> None:
    """Its answer is a plan, as in the process that asks."""
    environment = plugin(tmp_path, "mine:register_all")
    code = f"import optuav\nfrom optuav.plugins import read_plugins\n{EXPLORED}"
    (tmp_path / "script.py").write_text(code, "utf-8")
    done = run(tmp_path, environment, "script.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert "hover" in done.stdout


SCRIPT = """
if __name__ == "__main__":
    register_all()
    done = [optuav.sweep("study.toml", workers=n, resume=False) for n in (1, 2)]
    print(done[0].hover_time_s == done[1].hover_time_s, done[0].hover_time_s)
"""


@pytest.mark.soak
def test_what_a_script_registers_reaches_the_workers(tmp_path: Path) -> None:
    """Workers, which run the script without its end, register nothing by themselves."""
    pytest.importorskip("distributed")
    environment = plugin(tmp_path)
    (tmp_path / "mine-1.0.dist-info" / "entry_points.txt").unlink()
    (tmp_path / "script.py").write_text(BY_FUNCTION + SCRIPT, "utf-8")
    (tmp_path / "study.toml").write_text(f"scenarios_per_part = 1\n{STUDY}")
    done = run(tmp_path, environment, "script.py")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("True {'available': {'shortest': ")


def test_what_cannot_be_sent_to_workers_is_refused_in_words() -> None:
    """Unless a worker has it by itself, from a plugin."""
    pytest.importorskip("distributed")

    class Unsent(Nothing):
        def __reduce__(self) -> Any:
            raise TypeError("it holds a lock")

    optuav.register(Hops)
    optuav.register(Unsent())
    called = with_registered(abs)
    assert called(-3) == 3
    optuav.unregister("nothing")
    optuav.unregister("hops")
    words = r"engine = 'nothing': cannot be sent .*it holds a lock.* of the group optuav.plugins"
    with pytest.raises(InputError, match=words):
        called(-3)
    assert FLIGHTS["hops"] is Hops


def test_a_plugin_that_fails_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With its entry point, in one line, whatever the command asks."""
    plugin(tmp_path, "mine:no_such_function")
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    read_plugins.cache_clear()
    words = (
        r"plugin mine = mine:no_such_function \(mine, entry point of optuav.plugins\) fails: Attr"
    )
    with pytest.raises(InputError, match=words):
        read_plugins()
    monkeypatch.undo()
    sys.modules.pop("mine", None)
    read_plugins()


class HopFlight(FlightTable):
    """A table of a flight model."""

    speed_m_s: Speed


class Hops(FlightModel):
    """A flight model that lacks nothing."""

    name = "hops"
    table: Any = HopFlight

    def leg(self, way_m: Any) -> Loads:
        return Loads(way_m, ("flight",), (10.0,), (50.0,), (500.0,), 1.0, 1.0)

    def hover(self) -> Flow:
        return Flow(50.0, 500.0)

    def rest(self) -> Flow:
        return Flow(0.0, 0.0)


class Unfinished(FlightModel):
    name, table = "unfinished", HopFlight


class NoWay(Hops):
    def leg(self) -> Loads:  # type: ignore[override]
        raise NotImplementedError


class Attributes(Hops):
    leg, hover, rest, least = None, 3, "x", 3  # type: ignore[assignment]


class Empty(Hops):
    def hover(self) -> Flow:
        return None  # type: ignore[return-value]


class Nameless(Hops):
    name = ""


class Taken(Hops):
    name = "rotors"


class WrongForm(Hops):
    table = Body


class OtherName(HopFlight):
    """A table that only another model has."""

    model: Annotated[Literal["skips"], MODEL]


class Misnamed(Hops):
    table = OtherName


class NotDecorated(Hops):
    body: Body


@dataclass(eq=False)
class NoTable(Hops):
    battry: BatteryPacks


@dataclass(eq=False)
class Needless(Hops):
    body: Body


class OneWord(Hops):
    needs: Any = "body"


class NoKey(Hops):
    needs = "body", "body.mas_kg"
    refuses = ("sails",)


class Starred(Hops):
    def __init__(self, *tables: Any) -> None:
        raise NotImplementedError


class Dark(Beam):
    name, table = "dark", FlightTable  # type: ignore[assignment]


class Plain(Beam):
    """A beam of numbers in place of methods."""

    name, table, received_W, enough_W = "plain", LaserTable, 3, 4.0  # type: ignore[assignment]


class NoDeclare(optuav.Formulation):
    """A problem without a declare."""


class Few(optuav.Formulation):
    """A problem whose declare misses an argument."""

    def declare(self, model: Model) -> None:  # type: ignore[override]
        model.maximise(0.0)


class Third(optuav.P3):
    """A problem of the paper, changed."""


class Forgetful(optuav.Formulation):
    """A problem that does not keep its field."""

    def __init__(self, wanted_s: float) -> None:
        super().__init__()

    def declare(self, model: Model, given: Any) -> None:
        raise NotImplementedError


@dataclass(frozen=True)
class Nothing(Engine):
    """An engine that solves nothing."""

    name: str = "nothing"

    def solve(self, model: Model, programmes: int, *_: Any, **__: Any) -> Solution:
        raise NotImplementedError


class Wordy(Nothing):
    nonlinear = "yes"  # type: ignore[assignment]
    needs = ("derivative",)  # type: ignore[assignment]


class OneNeed(Nothing):
    needs = "derivatives"  # type: ignore[assignment]


class Many(Nothing):
    most_unknowns = "many"  # type: ignore[assignment]


class Unlimited(OneByOne):
    name = "unlimited"

    def prepare(self, model: Model) -> Any:  # type: ignore[override]
        raise NotImplementedError


class Uncompiled(Nothing):
    def compile(self, model: Model) -> Any:  # type: ignore[override]
        raise NotImplementedError


class Dated(Nothing):
    takes = "linear models"


class Short(Nothing):
    def solve(self, model: Model) -> Solution:  # type: ignore[override]
        raise NotImplementedError


def two(plan: optuav.Plan, axes: Any) -> Any:
    return axes


def wells(plan: optuav.Plan) -> Any:
    return plan


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        (3, "register = 3: must be a flight model .* a beam .* a problem .* an engine .* a pict"),
        (dict, "register = the class dict: must be a flight model"),
        (Unfinished, "Unfinished: must define hover, leg, rest, as FlightModel declares"),
        (Hops(HopFlight(model="hops", speed_m_s=5.0)), "must be the class Hops, not an instance"),
        (FlightModel, "flight model name = None: the flight model needs a name of letters"),
        (NoWay, r"NoWay.leg: must be defined as leg\(self, way_m\)"),
        (
            Attributes,
            r"Attributes.leg = None: must be defined as leg\(self, way_m\), as it is call",
        ),
        (Attributes, r"Attributes.hover = 3: must be defined as hover\(self\), as it is called"),
        (Attributes, r"Attributes.rest = 'x': must be defined as rest\(self\), as it is called"),
        (Attributes, r"Attributes.least = 3: must be defined as least\(self, distance_m\), as it"),
        (Plain, r"Plain.received_W = 3: must be defined as received_W\(self, distance_m, most_W"),
        (Plain, r"Plain.enough_W = 4.0: must be defined as enough_W\(self, distance_m, most_W\)"),
        (Nameless, "flight model name = '': the flight model needs a name of letters"),
        (Taken, "flight model = 'rotors': must be a name of its own, none of the package"),
        (
            WrongForm,
            r"WrongForm.table = the class Body: must be the form of \[flight\], a subclass",
        ),
        (Misnamed, "OtherName.model = 'skips': its model must be Literal.\"hops\""),
        (NotDecorated, r"NotDecorated.body: is not set .* decorate the class with @dataclass\("),
        (NoTable, r"NoTable\(battry\): must be the name of a table .*; did you mean 'battery'"),
        (Needless, r"Needless\(body\): is not in every mission: add it to needs = \("),
        (
            OneWord,
            r"OneWord.needs = 'body': must be a tuple of tables and keys, such as \(\"body\",\)",
        ),
        (NoKey, r"NoKey.needs = 'body.mas_kg': is no key of \[body\]; did you mean 'mass_kg'"),
        (NoKey, "NoKey.refuses = 'sails': is no table of a mission; they are route, limits"),
        (Starred, r"Starred\(tables\): must be a parameter that is given by its name"),
        (Dark, "Dark: must define enough_W, received_W, as Beam declares"),
        (
            Dark,
            r"Dark.table = the class FlightTable: must be the form of \[laser\], a sub",
        ),
        (NoDeclare, r"problem = NoDeclare: must define declare\(self, model, given\)"),
        (Few, r"problem = Few: its declare must accept a model and the given quantities"),
        (Third, "problem = Third: must subclass Formulation itself"),
        (Forgetful(3.0), "must keep wanted_s as an attribute; or register the class Forgetful"),
        (Nothing, r"engine = the class Nothing: must be an instance, such as Nothing\(\)"),
        (replace(Nothing(), name="grid"), "engine = 'grid': must be a name of its own"),
        (replace(Nothing(), name="two words"), "engine name = 'two words': the engine needs a n"),
        (Wordy(), "engine nothing: nonlinear = 'yes': must be one of True, False"),
        (Wordy(), "engine nothing: needs = 'derivative': .*derivatives, lower bounds, levelling"),
        (OneNeed(), r"engine nothing: needs = 'derivatives': must be a tuple, such as \("),
        (Many(), "engine nothing: most_unknowns = 'many': must be a whole number, at least 1"),
        (Unlimited(), r"engine = 'unlimited': must define prepare\(self, model, slot_s=None, ti"),
        (Uncompiled(), r"engine = 'nothing': must define compile\(self, model, programmes=1, \*"),
        (
            Dated(),
            "Dated.takes: must be left out; set nonlinear, integer, slots, most_unknowns and needs",
        ),
        (Short(), r"engine = 'nothing': must define solve\(self, model, programmes, values=None"),
        (lambda plan: plan, "picture name = '<lambda>': the picture needs a name of letters"),
        (wells, "picture = 'wells': must be a name of its own, none of the package"),
        (two, r"picture = 'two': must be a function of a plan: def two\(plan\)"),
    ],
)
def test_what_lacks_something_is_refused_when_it_is_registered(thing: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        optuav.register(thing)
    assert not any(kind.registered() for kind in EVERY_KIND)


class Stepwise(Hops):
    def leg(self, way_m: Any) -> Loads:
        long = math.hypot(*way_m) > 100.0
        return Loads(way_m, ("flight",), (10.0 + long,), (50.0,), (500.0,), 1.0, 1.0)


@dataclass(eq=False)
class Calm(Hops):
    flight: Any

    def hover(self) -> Flow:
        return Flow(60.0 if self.flight.speed_m_s > 4.0 else 50.0, 500.0)


def test_formulas_for_single_numbers_only_are_refused_in_words() -> None:
    """Of ways in every answer, of keys where they vary, with the line; alone, keys may be both."""
    keys = {"flight.model": "hops", "flight.speed_m_s": 5}
    optuav.register(Stepwise)
    words = r"Stepwise: leg \(line \d+ of test_extend.py\) does not take arrays .* np.where in pl"
    with pytest.raises(InputError, match=words):
        optuav.solve(optuav.load("paper").replace(keys))
    optuav.register(Calm)
    mission = optuav.load("paper").replace(keys)
    assert optuav.solve(mission).flyable
    words = r"Calm: hover \(line \d+ of test_extend.py\) does not take arrays of keys"
    with pytest.raises(InputError, match=words):
        optuav.batch_arrays(mission, {"flight.speed_m_s": [3.0, 5.0]})


def test_a_method_that_returns_something_else_is_refused_in_words() -> None:
    optuav.register(Empty)
    mission = optuav.load("paper").replace({"flight.model": "hops", "flight.speed_m_s": 5})
    with pytest.raises(InputError, match=r"Empty.hover\(\) = None: must be a Flow"):
        optuav.solve(mission)


def test_a_sweep_over_a_key_that_is_not_registered_asks_for_its_package(tmp_path: Path) -> None:
    """The files are whole: what is missing is the class, in a process that did not import it."""
    mine()
    (tmp_path / "town.toml").write_text(TOWN)
    file, keys = tmp_path / "study.toml", "grid.laser.width_m = [0.3, 0.4]\n"
    file.write_text(f'mission = "town.toml"\nproblem = "SmallestPack"\n{keys}')
    directory = optuav.sweep(file).directory
    assert optuav.open_sweep(directory).sizes == {"laser.width_m": 2}
    optuav.unregister("tube")
    optuav.unregister("SmallestPack")
    words = r"manifest\.json: no key laser\.width_m and no problem SmallestPack here: import the pa"
    with pytest.raises(InputError, match=words):
        optuav.open_sweep(directory)


def test_a_thing_replaces_what_had_its_name_and_is_taken_out() -> None:
    """It returns itself, and is named where a name is wrong."""
    assert optuav.register(Hops) is Hops
    assert FLIGHTS["hops"] is Hops
    hops = {"flight.model": "hops", "flight.speed_m_s": 5}
    mission = optuav.load("paper").replace(hops)
    assert isinstance(mission.flight_model, Hops)
    hover_s = optuav.solve(mission).hover_time_s
    heavy = type("Heavy", (Hops,), {"hover": lambda self: Flow(80.0, 800.0)})
    assert optuav.register(heavy) is FLIGHTS["hops"] is heavy
    again = optuav.load("paper").replace(hops)
    assert again != mission
    assert optuav.solve(again).hover_time_s < 0.9 * hover_s
    optuav.unregister("hops")
    with pytest.raises(InputError, match=r"flight.model = 'hops': .*\"rotary-wing\""):
        optuav.load("paper").replace(hops)


def test_a_registered_problem_goes_by_its_name(capsys: pytest.CaptureFixture[str]) -> None:
    """As a class with its fields stated, and as an instance with those it has."""
    kind = mine()["SmallestPack"]
    asked = {"perspective": "battery", "engine": "casadi"}
    small = optuav.load("paper").replace({f"buildings.b{k}": None for k in range(2, 11)})
    assert optuav.solve(small, "SmallestPack", **asked) == optuav.solve(small, kind(500.0), **asked)
    optuav.register(kind(550.0, building="b1"))
    larger = optuav.solve(small, "SmallestPack", **asked)
    assert larger.hover_time_s == pytest.approx(550.0)
    assert larger.building == "b1"
    main_words = ["solve", "paper", "--problem", "SmallestPack", "--set", "wanted_hover_s=450"]
    with pytest.raises(SystemExit) as left:
        main([*main_words, "--perspective", "battery"])
    assert not left.value.code
    assert re.search(r"^Hover +450.00 s .*\n.* b1,", capsys.readouterr().out, re.M)
    with pytest.raises(SystemExit):
        main([*main_words, "--set", "wanted=4", "--set", "building=7"])
    assert "problem SmallestPack takes no wanted" in capsys.readouterr().err


def test_a_picture_that_draws_nothing_is_named(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")

    @optuav.register
    def empty(plan: optuav.Plan) -> None:
        """No picture."""

    with pytest.raises(
        InputError, match=r"empty = None: must be axes as a function of optuav.plots"
    ):
        optuav.plots.save_pictures(optuav.solve("paper", "P3"), tmp_path)
    assert not [*tmp_path.iterdir()]


def test_a_picture_keeps_the_layout_of_its_figure(tmp_path: Path) -> None:
    """Constrained layout: what the axes show ends its padding of 0.04167 inch from the edges."""
    figure = pytest.importorskip("matplotlib.figure")

    @optuav.register
    def charge(plan: optuav.Plan) -> Any:
        return ax

    ax = figure.Figure(dpi=100, layout="constrained").add_subplot(ylabel="charge")
    optuav.plots.save_pictures(optuav.solve("paper", "P3"), tmp_path)
    edges_in = np.array(ax.get_tightbbox().extents) / 100.0
    around_in = np.array([*edges_in[:2], *(ax.figure.get_size_inches() - edges_in[2:])])
    assert around_in == pytest.approx([0.04167] * 4, abs=0.02)


def test_nonlinear_form_has_exact_values_and_derivatives() -> None:
    """min (x − a)² + y where x y ≥ 2, x + y = 4, a constant row aside: values by hand."""
    model = Model("an example")
    x = model.variable("x", "x", unit="s", upper=9.0)
    y = model.variable("y", "y", unit="m", lower=-1.0)
    a = Parameter("a", "a", "s", 3.0)
    model.minimise((x - a) ** 2 + y)
    model.subject_to("product", x * y >= 2.0)
    model.subject_to("sum", x + y == 4.0)
    model.subject_to("stated", a <= 10.0)
    form = nonlinear_form(model, {"a": 1.0})
    at = np.array([3.0, 5.0])
    assert (form.names, form.labels) == (("x", "y"), ("product", "sum"))
    assert form.equations.tolist() == [False, True]
    assert (form.lower.tolist(), form.upper.tolist()) == ([0.0, -1.0], [9.0, np.inf])
    assert form.objective(at) == 9.0
    assert form.gradient(at).tolist() == [4.0, 1.0]
    assert form.constraints(at).tolist() == [-13.0, 4.0]
    assert form.jacobian(at).tolist() == [[-5.0, -3.0], [1.0, 1.0]]
    assert form.point(at) == {"x": 3.0, "y": 5.0}
    # The same in scaled numbers: points agree, and so do the signs of the rows.
    scaled, u = form.scaled(), (at - form.start) / form.reach
    assert scaled.point(u) == pytest.approx(form.point(at))
    assert np.sign(scaled.constraints(u)).tolist() == [-1.0, 1.0]
    assert np.abs(scaled.gradient(scaled.start)).max() == pytest.approx(1.0)
    assert np.abs(scaled.jacobian(scaled.start)).max(axis=1) == pytest.approx([1.0, 1.0])
    step = 1e-6 * np.array([1.0, -2.0])
    slope = (scaled.constraints(u + step) - scaled.constraints(u - step)) / 2.0
    assert slope == pytest.approx(scaled.jacobian(u) @ step, rel=1e-6)


def test_an_engine_around_slsqp_agrees_with_the_bracket() -> None:
    """The page's engine, on the paper's mission: 597.270 s (SPEC), and the same point."""
    mine()
    plan = optuav.solve("paper", engine="slsqp")
    assert plan.hover_time_s == pytest.approx(optuav.solve("paper").hover_time_s, abs=1e-6)
    assert plan.hover_time_s == pytest.approx(597.270, abs=1e-3)

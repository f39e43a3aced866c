"""What notebooks show of objects: well-formed, safe with any name, and true to the figures."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from functools import cache
from html.parser import HTMLParser
from typing import Any
from xml.etree.ElementTree import tostring

import networkx
import numpy as np
import pytest

import optuav
from optuav.calibration.fit import ConfidenceInterval, Fit, Value
from optuav.judge import Itinerary, Stop
from optuav.judge.benchmark import Answer, CheckedSolution
from optuav.judge.solutions import CheckedSolutions
from optuav.mission import Mission
from optuav.modelling.expression import Indexed
from optuav.modelling.mathml import MathML, as_element
from optuav.modelling.model import Model
from optuav.physics.kibam import Wells
from optuav.plan.display import Levels, picture

EVIL = """<script>alert("b1")</script><img src=x onerror='a()'>&amp;$\\href{javascript:a}{b}$"""


def evil() -> Mission:
    """`paper` with names that a browser or MathJax would run, were they not escaped."""
    names = {f"buildings.{each}.name": EVIL + each for each in ("b1", "b9", "b10")}
    return optuav.load("paper").replace({"name": EVIL, "description": EVIL, **names})


@cache
def objects() -> dict[str, Any]:
    """One object of every kind that shows itself."""
    mission = evil()
    asked = optuav.P4(f"{EVIL}b1", order="rest-first")
    program = optuav.formulate(mission, asked, perspective="battery")
    times = {"hover_time_s": 700.0, "rest_time_s": 9.0}
    plan, late = optuav.solve(mission), mission.replace({"limits.deadline_s": 60})
    turns = mission.replace({"battery.schedule": "sequential"})
    dry = Itinerary(mission, (Stop(f"{EVIL}b9", "rest", 10.0), Stop("hover", "hover", 700.0)))
    model = Model(EVIL)
    model.subject_to(EVIL, model.variable("x", EVIL, unit=EVIL) <= 1.0, unit=EVIL)
    answer = Answer(EVIL, "P1", "available", "optimal", 9.0, None, "bracket", EVIL)
    wrong = CheckedSolution(answer, 9.0, None, (EVIL,), EVIL)
    return {
        "mission": mission,
        "buildings": mission.buildings,
        "plan": plan,
        "no plan": optuav.solve(late),
        "plan by turns": optuav.solve(turns, "P3", slot_s=50.0),
        "program": program,
        "programs": optuav.formulate(mission, "P1", slot_s=1),
        "no program": optuav.formulate(late, "P3", perspective="wells"),
        "model": model,
        "check": program.check(times)[0],
        "checks": program.check(times),
        "solution": program.compile().solve(),
        "shadow prices": program.shadow_prices(),
        "explanation": optuav.explain(mission, asked, perspective="battery"),
        "no plan explained": optuav.explain(late, asked, perspective="battery"),
        "audit": optuav.audit(dry),
        "replay": optuav.replay(plan),
        "comparison": optuav.compare(mission, by="trajectory"),
        "graph": optuav.graph(mission),
        "ledger": optuav.ledger("text-e2"),
        "siting": optuav.place_laser(mission, [[1000.0, 2000.0, 50.0]], refine=False),
        "fit": Fit("kibam", (EVIL,), EVIL, (Value(EVIL, 1.0, EVIL),), (), (EVIL,)),
        "checked solutions": CheckedSolutions(EVIL, (wrong,), (EVIL,)),
    }


KINDS = (
    *("mission", "buildings", "plan", "no plan", "plan by turns", "program", "programs"),
    *("no program", "model", "check", "checks", "solution", "shadow prices", "explanation"),
    *("no plan explained", "audit", "replay", "comparison", "graph"),
    *("ledger", "siting", "fit", "checked solutions"),
)


class Reader(HTMLParser):
    """Reads HTML strictly: every tag closed in order, attributes and texts collected."""

    def __init__(self, page: str) -> None:
        super().__init__(convert_charrefs=True)
        self.open, self.tags, self.attributes = list[str](), set[str](), list[tuple[str, str]]()
        self.texts = list[str]()
        self.feed(page)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.open.append(tag)
        self.tags.add(tag)
        self.attributes += [(name, value or "") for name, value in attrs]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)


@pytest.mark.parametrize("kind", KINDS)
def test_html_is_safe_and_well_formed(kind: str) -> None:
    """No script, nothing loaded, no attribute that runs; MathJax is told to leave it alone."""
    page = Reader(objects()[kind]._repr_html_())
    assert not page.tags & {"script", "img", "a", "link", "iframe", "object", "foreignobject"}
    names = {name for name, _ in page.attributes}
    assert not [name for name in names if name.startswith("on") or "href" in name or name == "src"]
    assert page.attributes[0] == ("class", "optuav tex2jax_ignore mathjax_ignore")
    assert not re.search(r"url\(|@import|https?:", objects()[kind]._repr_html_())


@pytest.mark.parametrize("kind", ["mission", "buildings", "plan", "model", "audit", "graph", "fit"])
def test_names_are_shown_as_they_are(kind: str) -> None:
    """Escaped once, neither lost nor escaped twice."""
    assert any(EVIL in text for text in Reader(objects()[kind]._repr_html_()).texts)


@pytest.mark.parametrize("kind", KINDS)
def test_reprs_are_one_short_line(kind: str) -> None:
    shown = repr(objects()[kind])
    assert "\n" not in shown
    assert len(shown) < 160 + 2 * len(EVIL)


def test_reprs_say_what_matters() -> None:
    assert repr(optuav.load("paper")) == "<Mission 'paper': 10 buildings, within 1200 s>"
    plan = optuav.solve("paper", "P3", perspective="battery")
    assert repr(optuav.audit(plan)) == "<Audit of 'paper': NOT FLYABLE>"
    assert repr(optuav.replay(plan)) == "<Replay for 'paper': 3 phases, 764.64 s, NOT FLYABLE>"
    explained = optuav.explain("paper", "P3", perspective="battery")
    question = "'paper': P3, perspective battery, optimal, Δ = 688.85 s"
    assert repr(explained) == f"<Explanation for {question}, 3 constraints>"
    compared = optuav.compare("paper", by="trajectory", perspective="battery")
    assert repr(compared) == "<optuav comparison of plans for 'paper': 4 rows, 14 columns>"
    assert repr(optuav.graph("paper")) == "<MissionGraph 'paper': 13 places, 42 legs>"


def test_a_mission_states_every_key() -> None:
    """Each with its value, as the file of the mission has it."""
    texts = Reader(optuav.load("paper")._repr_html_()).texts
    sections = optuav.load("paper").to_dict().items()
    keys = [key for _, table in sections if isinstance(table, dict) for key in table]
    assert len(keys) > 40
    assert set(keys) <= set(texts)
    for value in ("(1000, 3000, 0)", "36000", "1750"):
        assert value in texts


def polygons(page: str) -> Iterator[list[tuple[float, float]]]:
    """Corners of the areas of a picture [px]."""
    for points in re.findall(r'<polygon points="([^"]*)"', page):
        yield [ast.literal_eval(f"({point})") for point in points.split()]


@pytest.mark.parametrize("kind", ["plan", "plan by turns"])
def test_the_picture_ends_at_the_wells_of_the_plan(kind: str) -> None:
    """100 % is 120 px high and the last moment on the right; a phase's ends are corners."""
    plan = objects()[kind]
    bound, available = polygons(plan._repr_html_())
    whole_As = plan.mission.battery.packs * plan.mission.battery.capacity_As
    below = max(y for _, y in bound)
    right = max(x for x, _ in bound)
    for phase in plan.phases:
        x = 46.0 + 440.0 * phase.end_s / plan.mission_time_s
        bound_As = sum(phase.bound_As)
        for corners, level_As in (
            (bound, bound_As),
            (available, bound_As + max(0.0, sum(phase.available_As))),
        ):
            at = [below - y for each, y in corners if abs(each - x) < 0.11]
            assert min(abs(120.0 * level_As / whole_As - y) for y in at) < 0.11
    assert right == pytest.approx(486.0)


def test_a_plan_that_runs_dry_says_where() -> None:
    page = optuav.solve("paper", "P3", perspective="battery")._repr_html_()
    assert "dry at 660.3 s" in page
    assert "cannot be flown" in page
    assert len([*polygons(page)]) == 3  # one of what is not there
    assert len([*polygons(optuav.solve("paper", "P3")._repr_html_())]) == 2


def test_tables_show_the_first_rows_and_count_the_rest() -> None:
    columns = {"name": [f"r{k}" for k in range(75)], "x_m": [100.0 * k for k in range(75)]}
    roofs = {**columns, "y_m": [9e4] * 75, "z_m": [50.0] * 75}
    texts = Reader(optuav.load("paper").with_buildings(roofs).buildings._repr_html_()).texts
    assert "r59" in texts
    assert "r60" not in texts
    assert "and 15 more" in texts


def mathml(model: Model) -> str:
    """The mathematics of the page of a model."""
    return "".join(re.findall(r"<math[^>]*>(.*?)</math>", model._repr_html_()))


def test_mathematics_is_mathml() -> None:
    """By hand: fractions, powers, roots, indices, primes, and lines that are written once."""
    model = Model("m")
    x, y = model.variable("x", "T'_max", unit="A s"), model.variable("y", "y1", unit="1")
    levels = [model.let(f"level {k}", x + float(k), symbol=Indexed("y", k)) for k in (3, 4)]
    model.subject_to("a", x / (2.0 * y) <= np.sqrt(x) ** 3)
    for k, each in enumerate(levels):
        model.subject_to(f"b {k}", each >= 0.0)
    shown = mathml(model)
    prime = "<msubsup><mi>T</mi><mrow><mi>max</mi></mrow><mo>′</mo></msubsup>"
    below = "<msub><mi>y</mi><mrow><mn>1</mn></mrow></msub>"
    assert (
        f"<mfrac><mrow>{prime}</mrow><mrow><mn>2</mn>"
        f'<mspace width="0.17em"></mspace>{below}</mrow></mfrac><mo>≤</mo>'
        f"<msup><mrow><mrow><mo>(</mo><msqrt>{prime}</msqrt><mo>)</mo></mrow></mrow>"
        "<mrow><mn>3</mn></mrow></msup>"
    ) in shown
    assert "<msub><mi>y</mi><mrow><mi>j</mi></mrow></msub><mo>≥</mo><mn>0</mn><mo>,</mo>" in shown
    assert "<mtext>A\N{NO-BREAK SPACE}s</mtext>" in shown


def test_mathematics_from_anywhere_is_escaped() -> None:
    """Symbols, units and words may hold anything."""
    written = MathML().symbol(EVIL) + MathML().unit(EVIL)
    assert "<script" not in written
    texts = "".join(each.text or "" for each in as_element(written).iter())
    assert texts.replace("\N{NO-BREAK SPACE}", " ") == EVIL + EVIL


def test_frames_hold_the_figures() -> None:
    """Tables of every kind as data frames, against the attributes that they come from."""
    pytest.importorskip("pandas")
    made = objects()
    roofs = made["buildings"].to_frame()
    assert roofs["x_m"].tolist() == [each.position_m[0] for each in made["buildings"]]
    assert (
        evil().with_buildings(roofs).buildings.roof_m.tolist()
        == roofs.iloc[:, 1:4].to_numpy().tolist()
    )
    checks = made["checks"].to_frame()
    assert checks["satisfied"].tolist() == [bool(each.satisfied) for each in made["checks"]]
    several = optuav.formulate("paper", "P3").check({"hover_time_s": [10.0, 9000.0]}).to_frame()
    assert several.groupby("point")["satisfied"].all().tolist() == [True, False]
    solution = made["solution"]
    binds = solution.to_frame().query("binds")["constraint"].tolist()
    assert binds == [*solution.binding_labels(0)]
    prices = made["shadow prices"].to_frame().set_index("parameter")
    assert prices["more"].to_dict() == {n: p.more for n, p in made["shadow prices"].items()}
    assert len(made["audit"].to_frame()) == len(made["audit"].events)
    explained = made["explanation"]
    assert explained.to_frame()["gain"].tolist() == [each.gain for each in explained.prices]
    assert len(made["no plan explained"].to_frame()) == len(made["no plan explained"].repairs)


def test_a_graph_stays_a_graph() -> None:
    """Copies and parts of it are of its kind; networkx takes it as a DiGraph."""
    graph = objects()["graph"]
    assert isinstance(graph, networkx.DiGraph)
    assert type(graph.copy()) is type(graph)
    assert networkx.shortest_path_length(graph, "origin", "destination") == 2
    graph = graph.copy()
    graph.nodes["hover"]["mark"] = "mine"
    assert "mine" in Reader(graph._repr_html_()).texts


def test_frames_of_ledger_siting_and_fit() -> None:
    pytest.importorskip("pandas")
    entries = optuav.ledger(["text-e1", "text-e2"])
    assert entries.to_frame()["name"].tolist() == ["text-e1", "text-e2"]
    hazy = optuav.load("paper").replace({"laser.visibility_km": 2.0})
    found = optuav.place_laser(hazy, [[1000, 0, 50], [1000, 2000, 50]], refine=False)
    ((mission, laser, hover_s),) = found.to_frame().to_records(index=False).tolist()
    assert (mission, laser, hover_s) == ("paper", 0, pytest.approx(found.value, abs=1e-5))
    fit = optuav.Fit("rotor", (), "", (Value("a.b", 2.0, "c", ConfidenceInterval(1.0, 3.0)),), ())
    assert fit.to_frame().iloc[0].tolist() == ["a.b", 2.0, 1.0, 3.0, True, "c"]


def test_a_long_plan_has_a_short_picture() -> None:
    """However many moments there are, the first and the last are drawn, and few between them."""
    time_s = np.linspace(0.0, 50.0, 12_345)
    course = Levels(time_s, 80.0 - time_s, np.full_like(time_s, 20.0))
    page = tostring(picture(course, [("flight", 0.0, 50.0)], Wells(80.0, 20.0)), encoding="unicode")
    bound, available = polygons(page)
    assert len(bound) == len(available) < 1000
    assert available[0] == (46.0, 20.0)  # 100 % on the left
    assert (486.0, 80.0) in available  # 50 % on the right


def test_a_mission_prints_its_summary() -> None:
    assert str(optuav.load("paper")) == optuav.load("paper").summary()


def test_missions_checks_and_graphs_are_frames_too() -> None:
    """Keys that `replace` takes, with values as stated; one constraint; the legs of the graph."""
    pytest.importorskip("pandas")
    mission = optuav.load("paper")
    keys = mission.to_frame().set_index("key")
    assert keys.value["limits.deadline_s"] == 1200.0
    assert "laser.power_W" in keys.index
    assert not keys.meaning.eq("").any()
    (found,) = (each for each in objects()["checks"][:1])
    assert found.to_frame().constraint.tolist() == [found.label]
    legs = optuav.graph(mission).to_frame()
    assert (len(legs), legs.duration_s.min() > 0.0) == (42, True)


def test_a_solution_of_several_programmes_lists_them() -> None:
    """Status, objective and values of each: the two orders of a rest on a building."""
    answers = optuav.formulate("paper", optuav.P4("b1"), perspective="battery").answers()[0]
    texts = Reader(answers._repr_html_()).texts
    assert len(answers.statuses) == texts.count("optimal") == 2
    assert {"719.54", "Δ [s]"} <= {*texts}

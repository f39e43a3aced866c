"""A problem of one's own asks for any number of the mission, and says what its objective is."""

from __future__ import annotations

import copy
import itertools
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

import optuav
from optuav.engines import closed_form, dispatch
from optuav.engines.registry import Engine
from optuav.engines.solution import Solution
from optuav.mission.keys import stated_keys
from optuav.modelling import Model
from optuav.network.network import build_network
from optuav.status import Status
from tests.diagnosis.missions import only

MISSION = optuav.load("paper").replace({f"buildings.b{k}": None for k in range(3, 11)})


@dataclass(frozen=True)
class LeastLaser(optuav.Formulation):
    """Least energy of the laser for a wanted hover time."""

    wanted_hover_s: float = 700.0

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        model.minimise(given.laser_power_W * (hover + rest), unit="J")
        model.subject_to("wanted hover", hover >= self.wanted_hover_s, unit="s")
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


def looked_at(
    look: Callable[[Any], object], graph: nx.DiGraph[str] | None = None, **fields: Any
) -> list[Any]:
    """What a look at `given` shows on the direct route and on those with a rest."""
    seen = []

    class Look(optuav.Formulation):
        """Look."""

        def declare(self, model: Model, given: Any) -> None:
            seen.append(look(given))
            hover, rest = given.hover_and_rest(model)
            model.maximise(hover)
            given.keep_deadline(model, "deadline", hover, rest)

    optuav.formulate(MISSION, Look(**fields), perspective="battery", graph=graph)
    return seen


@pytest.mark.parametrize("name", ["paper", "matrice350", "paper-table2"])
def test_every_number_of_the_mission_is_a_symbol_of_its_key(name: str) -> None:
    """Taken from the schema: none is left out, and each has its key, unit and value."""
    mission, seen = optuav.load(name), []

    class Look(optuav.Formulation):
        """Look."""

        def declare(self, model: Model, given: Any) -> None:
            seen.append({each: getattr(given, each) for each in dir(given) if each[0] != "_"})
            hover, rest = given.hover_and_rest(model)
            model.maximise(hover)
            given.keep_deadline(model, "deadline", hover, rest)

    optuav.formulate(mission, Look(), perspective="battery")
    for key, stated in stated_keys(mission).items():
        table, _, axis = key.replace(".", "_", 1).partition("[")
        symbol = seen[0][table][int(axis[0])] if axis else seen[0][table]
        assert (symbol.key, symbol.value) == (key, stated.now)
        assert symbol.unit == ("1" if stated.unit == "-" else stated.unit)


def test_a_number_with_two_names_is_one_symbol() -> None:
    """Else a price would miss half of it."""
    looks = [("limits_deadline_s", "deadline_s"), ("battery_packs", "packs")]
    for key, name in looks:
        same = looked_at(lambda given, k=key, n=name: getattr(given, k) is getattr(given, n))
        assert all(same)


def test_lengths_and_places_of_routes() -> None:
    """By hand from the positions of b1 and b2, the ends, and w_U as SPEC states it."""
    hover = np.array([1000.0, 2501.0152, 50.0])
    assert looked_at(lambda given: [each.value for each in given.hover_position_m])[0] == (
        pytest.approx(hover.tolist(), abs=1e-3)
    )
    roofs = {each.name: np.array(each.position_m) for each in MISSION.buildings}
    ends = np.array(MISSION.route.origin_m), np.array(MISSION.route.destination_m)
    (rested,) = looked_at(lambda given: given, building="b2", order="hover-first")
    ways = ends[0], hover, roofs["b2"], ends[1]
    length_m = sum(np.linalg.norm(b - a) for a, b in itertools.pairwise(ways))
    assert rested.flight_distance_m.value == pytest.approx(length_m, abs=1e-3)
    assert [float(np.squeeze(e.value)) for e in rested.rest_position_m] == [*roofs["b2"]]
    assert copy.copy(rested).flight_distance_m is rested.flight_distance_m


def test_lengths_of_an_edited_graph_are_those_of_its_edges() -> None:
    """As durations and charges are."""
    graph = optuav.graph(MISSION)
    for number, (*_, edge) in enumerate(graph.edges(data=True)):
        edge["distance_m"] = 100.0 * 2**number
    (rested,) = looked_at(lambda given: given, graph, building="b2", order="hover-first")
    legs = itertools.pairwise(["origin", "hover", "b2", "destination"])
    length_m = sum(graph.edges[leg]["distance_m"] for leg in legs)
    assert rested.flight_distance_m.value == length_m


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("laser_powr_W", "given has no 'laser_powr_W'; did you mean 'laser_power_W'?"),
        (
            "laser_visibility_km",
            "the mission does not set laser.visibility_km",
        ),
        ("min_sok", "did you mean 'min_soc'?"),
        ("power_W", "by its table and key, such as laser_power_W"),
        ("rest_position_m", "on a route without a rest: ask for it under 'if given.rests:'"),
    ],
)
def test_a_wrong_name_is_an_error_in_words(name: str, words: str) -> None:
    with pytest.raises(AttributeError) as error:
        looked_at(lambda given: getattr(given, name))
    assert words in str(error.value)


def test_the_price_of_a_number_is_that_of_solving_again() -> None:
    """The objective is linear in the laser's power, which its figures of the route are not."""
    program = optuav.formulate(MISSION, LeastLaser(), perspective="battery")
    price, plan = program.shadow_prices()["laser_power_W"], program.solve()
    again = program.compile().solve(laser_power_W=1001.0)
    assert price.more == pytest.approx(again.objective[0] - plan.objective, rel=1e-6)
    assert price.more == pytest.approx(plan.hover_time_s + plan.rest_time_s, rel=1e-9)


def test_a_plan_has_the_objective_in_print_file_and_frame(tmp_path: Path) -> None:
    plan = optuav.solve(MISSION, LeastLaser(), perspective="battery")
    energy_J = 1000.0 * (plan.hover_time_s + plan.rest_time_s)
    assert plan.objective == pytest.approx(energy_J, rel=1e-12)
    assert (plan.objective_unit, plan.bound) == ("J", None)
    assert f"\nObjective    {energy_J:.6g} J\n" in str(plan)
    assert "Bound" not in str(plan)
    assert "Objective" in plan._repr_html_()
    plan.save(tmp_path / "plan.json")
    assert optuav.load_plan(tmp_path / "plan.json") == plan
    pytest.importorskip("pandas")
    assert plan.to_frame().attrs["objective"] == plan.objective


TWICE = optuav.P1(stops=2, hovers=2)
QUESTIONS: list[tuple[Any, dict[str, Any]]] = [
    *((name, {"perspective": "battery"}) for name in ("P1", "P2", "P2-tight", "P3")),
    (optuav.P4("b1"), {"perspective": "available"}),
    ("P1", {"slot_s": 20.0}),
    ("P2", {"engine": "casadi"}),
    (optuav.P1(hover_point="free"), {"perspective": "battery"}),
    (TWICE, {}),
]


@pytest.mark.parametrize(("problem", "options"), QUESTIONS)
def test_plans_of_the_paper_have_their_objective_too(
    problem: Any, options: dict[str, Any], tmp_path: Path
) -> None:
    """A time, of (P2) that of flight and rest; a file without it is read as well."""
    plan = optuav.solve(MISSION, problem, **options)
    least = plan.problem.startswith("P2")
    aim_s = plan.flight_time_s + plan.rest_time_s if least else plan.hover_time_s
    assert plan.objective == pytest.approx(aim_s, abs=1e-9)
    assert plan.objective_unit == "s"
    assert (f"\nObjective    {aim_s:.6g} s\n" in str(plan)) is least
    data = json.loads(plan.save(tmp_path / "plan.json").read_text("utf-8"))
    assert (data["objective"], data["objective_unit"]) == (plan.objective, "s")
    if problem is not TWICE:
        found = optuav.batch_arrays(MISSION, {}, problem, perspective=plan.perspective)
        exact = options.get("slot_s") is None
        assert not exact or float(found["objective"]) == pytest.approx(aim_s, abs=1e-6)
    older = {name: each for name, each in data.items() if not name.startswith("objective")}
    (tmp_path / "older.json").write_text(json.dumps(older), "utf-8")
    assert optuav.load_plan(tmp_path / "older.json").objective is None


class Longest(optuav.Formulation):
    """Longest hover, as (P1)."""

    def declare(self, model: Model, given: Any) -> None:
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        model.subject_to("charge", given.soc_end(hover, rest) >= given.min_soc)
        given.keep_wells(model, "charge", hover, rest)
        given.keep_deadline(model, "deadline", hover, rest)


def test_a_unit_is_that_of_a_bare_symbol() -> None:
    assert optuav.solve(MISSION, Longest(), perspective="battery").objective_unit == "s"


@dataclass(frozen=True)
class Cautious(Engine):
    """Exact answers of which it claims no more than that none is better by 5 s."""

    name: str = "cautious"
    most_unknowns = 2
    needs = ("lower bounds",)

    def solve(
        self, model: Model, programmes: int, values: Any = None, **_: float | None
    ) -> Solution:
        found = closed_form.solve(model, programmes, values)
        return replace(found, beyond=found.objective + 5.0)


def test_where_nothing_is_proved_a_bound_is_stated(tmp_path: Path) -> None:
    """In the plan, its file, in print and in a batch; of the paper's problems in the plan."""
    plan = optuav.solve(MISSION, Longest(), perspective="battery", engine=Cautious())
    assert plan.status is Status.FEASIBLE
    assert plan.bound == pytest.approx(plan.objective + 5.0)
    assert f"\nBound        {plan.bound:.6g} s; none is better\n" in str(plan)
    plan.save(tmp_path / "plan.json")
    assert optuav.load_plan(tmp_path / "plan.json").bound == plan.bound
    paper = optuav.solve(MISSION, perspective="battery", engine=Cautious())
    assert paper.bound == pytest.approx(paper.hover_time_s + 5.0)
    assert f"\nBound        {paper.bound:.6g} s; none is better\n" in str(paper)


def test_a_batch_states_the_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dispatch, "preferred", lambda *_: Cautious())
    found = optuav.batch_arrays(
        MISSION, {"limits.deadline_s": [60.0, 1200.0]}, Longest(), perspective="battery"
    )
    assert np.isnan([found["objective"][0], found["bound"][0]]).all()
    assert found["bound"][1] == pytest.approx(found["objective"][1] + 5.0)


def test_a_batch_has_the_objective_of_every_scenario() -> None:
    """Of columns that the objective has, and of those that it has not: as one mission at a time."""
    keys = {"laser.power_W": [500.0, 1000.0], "limits.deadline_s": [1200.0, 1500.0]}
    found = optuav.batch(MISSION, keys, LeastLaser(), perspective="battery")
    assert found["objective"].attrs["units"] == "J"
    for power_W in keys["laser.power_W"]:
        for deadline_s in keys["limits.deadline_s"]:
            values = {"laser.power_W": power_W, "limits.deadline_s": deadline_s}
            alone = optuav.solve(MISSION.replace(values), LeastLaser(), perspective="battery")
            value = float(found["objective"].sel(values))
            assert value == pytest.approx(alone.objective, rel=1e-9) if alone else np.isnan(value)
    paper = optuav.batch(MISSION, keys, perspective="battery")
    assert paper["objective"].attrs["units"] == "s"
    assert paper["objective"].equals(paper["hover_time_s"])


def test_a_repair_counts_with_each_missions_own_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    """Programmes of changed missions are stacked: half the laser's energy allows half the time."""
    only(monkeypatch, "laser")

    class Budget(Longest):
        """Longest hover of 400 s or more on a budget of the laser's energy."""

        def declare(self, model: Model, given: Any) -> None:
            super().declare(model, given)
            hover, rest = model.variables[0], sum(model.variables[1:], start=0.0)
            energy_J = given.laser_power_W * (hover + rest)
            model.subject_to("budget", energy_J <= 300_000.0, unit="J")
            model.subject_to("wanted", hover >= 400.0, unit="s")

    explained = optuav.explain(MISSION, Budget(), perspective="battery")
    (repair,) = [each for each in explained.repairs if each.key == "laser.power_W"]
    assert repair.value == pytest.approx(750.0, rel=1e-2)


def test_figures_are_made_when_they_are_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Problems of the paper never ask."""
    from optuav.solving import assemble

    def none(*_: object) -> None:
        raise AssertionError("asked for")

    monkeypatch.setattr(assemble, "stated_value", none)
    assert optuav.solve(build_network(MISSION).mission, perspective="battery").status.has_answer

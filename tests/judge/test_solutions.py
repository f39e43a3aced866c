"""Solutions of the benchmark set: those that hold, and each way in which one does not."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav import InputError
from optuav.judge import Stop
from optuav.judge.benchmark import CheckedSolution, answers, checked
from tests.several_devices import three

MISSION = "set/deadline-1200"  # The shipped `paper`; SPEC gives its values
DIRECT_S, ROOF_S, BY_CHARGE_S = 577.524, 597.270, 719.5399


def hover(duration_s: float, at: str = "hover") -> dict[str, Any]:
    return {"at": at, "kind": "hover", "duration_s": duration_s}


def rest(at: str, duration_s: float) -> dict[str, Any]:
    return {"at": at, "kind": "rest", "duration_s": duration_s}


def solution(*stops: dict[str, Any], **stated: Any) -> dict[str, Any]:
    """A solution that claims what its stops hover."""
    hovers_s = sum(stop["duration_s"] for stop in stops if stop["kind"] == "hover")
    return {"mission": MISSION, "hover_s": hovers_s, "stops": [*stops], **stated}


def text(*solutions: Any, **stated: Any) -> str:
    return json.dumps({"schema": 1, "kind": "optuav solutions", "solutions": solutions, **stated})


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "solutions.json"


def verdict(file: Path, *stops: dict[str, Any], **stated: Any) -> CheckedSolution:
    file.write_text(text(solution(*stops, **stated)), "utf-8")
    (found,) = optuav.check_solutions(file).solutions
    assert bool(found.wrong) == (found.verdict == "DOES NOT HOLD")
    return found


BEST = (hover(ROOF_S - 0.001), rest("b9", 400.0))


def test_the_best_known_plan_holds(file: Path) -> None:
    """One of the check numbers of the model, given a rest longer than it needs."""
    found = verdict(file, *BEST)
    assert found.wrong == ()
    assert found.verdict == "holds, optimal"
    assert found.to_dict()["gap_s"] == pytest.approx(0.001, abs=0.001)


def test_a_shorter_hover_holds_and_its_gap_is_told(file: Path) -> None:
    found = verdict(file, hover(570.0), problem="P3")
    assert found.verdict == f"holds, {DIRECT_S - 570.0:.3f} s below the best known"
    assert found.to_dict()["gap_to_bound_s"] == pytest.approx(DIRECT_S - 570.0, abs=0.001)


@pytest.mark.parametrize(
    ("stops", "stated", "why"),
    [
        ([hover(600.0)], {"problem": "P3"}, "runs dry"),
        ([hover(500.0), rest("b9", 700.0)], {}, "the deadline passes"),
        ([rest("b9", 400.0), hover(500.0, "b9")], {}, "out of coverage"),
        ([hover(300.0)], {"hover_s": 300.5}, "it claims 300.500 s of hover, and hovers 300.000 s"),
        ([hover(300.0)], {"hover_s": 299.5}, "it claims 299.500 s of hover, and hovers 300.000 s"),
        ([hover(500.0), rest("b9", 10.0)], {"problem": "P3"}, "it rests 1 times, at most 0"),
        ([rest("b9", 9.0), hover(500.0), rest("b1", 9.0)], {}, "it rests 2 times, at most 1"),
        ([hover(250.0), rest("b9", 9.0), hover(250.0)], {}, "it hovers 2 times, at most 1"),
        ([rest("origin", 10.0), hover(500.0)], {}, "it rests at origin, not on a roof"),
        ([hover(500.0)], {"problem": "P2-tight"}, "it ends after 575.792 s, not at the deadline"),
        ([hover(688.9)], {"problem": "P3", "perspective": "battery"}, "below the reserve of 5 %"),
        ([hover(524.7)], {"problem": "P3", "perspective": "energy"}, "below the reserve of 5 %"),
        ([], {"hover_s": None}, "there is a plan, which hovers 597.270 s"),
        ([rest("b9", 10.0)], {}, "it never comes to the hover point"),
    ],
)
def test_what_does_not_hold(
    file: Path, stops: list[dict[str, Any]], stated: dict[str, Any], why: str
) -> None:
    """It ran dry, came late, claimed more or less than it hovers, or answers another question."""
    found = verdict(file, *stops, **stated)
    assert any(why in words for words in found.wrong), found.wrong
    assert not optuav.check_solutions(file)


@pytest.mark.parametrize(
    ("stops", "problem", "why"),
    [
        ([hover(500.0), rest("b9", 9.0)], "P4 building=b1", "not hover and rest on b1, once each"),
        ([hover(500.0)], "P4 building=b1", "not hover and rest on b1, once each"),
        ([rest("b1", 9.0), hover(500.0)], "P4 building=b1 order=hover-first", "its order is not"),
    ],
)
def test_a_roof_and_an_order_are_held_to(
    file: Path, stops: list[dict[str, Any]], problem: str, why: str
) -> None:
    found = verdict(file, *stops, problem=problem, mission="set/roof-b1")
    assert any(why in words for words in found.wrong), found.wrong


@pytest.mark.parametrize(
    ("perspective", "hover_s"), [("battery", 688.84), ("adjusted", 688.84), ("energy", 524.62)]
)
def test_perspectives_of_the_paper_look_at_the_end_alone(
    file: Path, perspective: str, hover_s: float
) -> None:
    """The plan of 688.84 s runs dry on its way, and holds where nobody asks for that."""
    found = verdict(file, hover(hover_s), problem="P3", perspective=perspective)
    assert found.wrong == ()


def test_better_than_the_best_known_is_said_only_within_the_bound() -> None:
    """Against answers that are made worse than they are."""
    mission, known = optuav.load(MISSION), answers()[MISSION, "P3", "available"]
    open_ = replace(known, status="feasible", hover_s=500.0, bound_s=600.0)
    stops = [Stop("hover", "hover", 577.0)]
    assert checked(mission, open_, 577.0, stops).verdict.startswith("holds, BETTER than the best")
    as_good = checked(mission, replace(open_, hover_s=577.0), 577.0, stops)
    assert as_good.verdict == "holds, as good as the best known"
    false = replace(known, hover_s=500.0, bound_s=510.0)
    (why,) = checked(mission, false, 577.0, stops).wrong
    assert why.startswith("impossible: it is proved that no plan hovers longer than 510.000 s")
    none = replace(known, status="infeasible", hover_s=None, bound_s=None, stops=())
    (why,) = checked(mission, none, 577.0, stops).wrong
    assert why.startswith("impossible: it is proved that no plan exists")
    (why,) = checked(mission, open_, 620.0, [Stop("hover", "hover", 620.0)]).wrong
    assert "runs dry" in why


def over(name: str, duration_s: float) -> Stop:
    return Stop(name, "hover", duration_s)


@pytest.mark.parametrize(
    ("stops", "problem", "why"),
    [
        ([over("east", 170.0), over("north", 170.0), over("west", 170.0)], "P3", ""),
        ([over("east", 170.0), over("north", 170.0)], "P3", "device west is hovered over not at"),
        (
            [over("east", 165.0), over("north", 170.0), over("west", 170.0)],
            "P3",
            "is not its share",
        ),
        ([over("west", 90.0), over("east", 90.0), over("west", 90.0)], "P3", "2 times, not once"),
        (
            [over("east", 90.0), Stop("b9", "rest", 9.0), over("north", 90.0), over("west", 90.0)],
            "P1 order=between",
            "",
        ),
        (
            [over("east", 90.0), over("north", 90.0), over("west", 90.0), Stop("b9", "rest", 9.0)],
            "P1 order=between",
            "its order is not between",
        ),
        (
            [over("east", 90.0), over("north", 90.0), over("west", 90.0)],
            "P3 device_order=west,north,east",
            "its order of devices is not west,north,east",
        ),
    ],
)
def test_solutions_over_several_devices_are_judged(
    stops: list[Stop], problem: str, why: str
) -> None:
    """Each device once, for its share, in the order that is asked for; bound 531 s without rest."""
    known = replace(answers()[MISSION, "P3", "available"], problem=problem)
    known = replace(known, hover_s=500.0, bound_s=648.0)
    hover_s = sum(stop.duration_s for stop in stops if stop.kind == "hover")
    wrong = checked(three(), known, hover_s, stops).wrong
    assert bool(wrong) is bool(why)
    assert any(why in words for words in wrong) or not why, wrong


@pytest.mark.parametrize("stops", [{}, {"stops": None}, {"stops": []}])
def test_no_plan_may_be_claimed_where_there_is_none(file: Path, stops: dict[str, Any]) -> None:
    file.write_text(text({"mission": "set/infeasible-late", "hover_s": None, **stops}), "utf-8")
    found = optuav.check_solutions(file)
    assert found
    assert found.solutions[0].verdict == "holds, there is no plan"
    assert len(found.missing) == 199


def test_a_plan_past_the_hover_point_says_nothing_of_the_proof(file: Path) -> None:
    """No plan can hover in this mission, but the drone can fly past and rest on a roof."""
    (why,) = verdict(file, rest("b9", 1.0), mission="set/link-far").wrong
    assert why == "it never comes to the hover point"


@pytest.mark.parametrize(
    ("content", "faults"),
    [
        ("{", ["is not JSON"]),
        ("[]", ["is not an object"]),
        (text(solution(hover(1.0))).replace("1.0", "NaN"), ["NaN is not a JSON number"]),
        (text(solution(hover(1.0)))[:-1] + ', "kind": ""}', ["contains the key 'kind' more than"]),
        (text(solution(hover(1.0))).replace("1.0", "1e999"), ["solutions.0.hover_s", "duration_s"]),
        (text(solution(hover(-1.0))), ["solutions.0.hover_s", "solutions.0.stops.0.duration_s"]),
        (text(kind="optuav plan"), ["kind"]),
        (text(schema=2), ["schema"]),
        (text(by="me"), ["by"]),
        (text(), ["solutions", "at least one"]),
        (text(3), ["solutions.0"]),
        (text({"mission": MISSION}), ["solutions.0.hover_s", "solutions.0.stops"]),
        (text(solution(hover(1.0), mission="set/town-10-z")), ["did you mean 'set/town-10-"]),
        (text(solution(hover(1.0), mission="paper")), ["solutions.0.mission"]),
        (text(solution(hover(1.0), mission=["set"])), ["solutions.0.mission"]),
        (text(solution(hover(1.0), problem="P4 building=b1")), ["P1, P3, P2-tight"]),
        (text(solution(hover(1.0), problem=[1])), ["solutions.0.problem"]),
        (text(solution(hover(1.0), perspective="wells")), ["solutions.0.perspective"]),
        (text(solution(hover(1.0, "b99"))), ["not a place of the mission set/deadline-1200"]),
        (text(solution(hover(1.0), hover_s=True)), ["solutions.0.hover_s"]),
        (text(solution(hover(1.0), hover_s=None)), ["solutions.0.stops"]),
        (text(solution(hover(1.0)), solution(hover(2.0))), ["solutions.0 answers the same"]),
        (text(solution(*[hover(1.0)] * 101)), ["solutions.0.stops", "at most 100"]),
        (text(*[solution(hover(1.0))] * 2000), ["each for another question"]),
        (text(solution(hover(1.0), times=1)), ["solutions.0.times", "unknown key"]),
    ],
)
def test_files_that_cannot_be_read(file: Path, content: str, faults: list[str]) -> None:
    file.write_text(content, "utf-8")
    with pytest.raises(InputError) as refused:
        optuav.check_solutions(file)
    for words in faults:
        assert words in str(refused.value)


def test_all_faults_are_listed_at_once(file: Path) -> None:
    file.write_text(
        text(solution(hover(1.0), mission="a"), solution(hover(-1.0)), schema=3, more=1), "utf-8"
    )
    with pytest.raises(InputError) as refused:
        optuav.check_solutions(file)
    assert {fault.key for fault in refused.value.faults} == {
        "schema",
        "more",
        "solutions.0.mission",
        "solutions.1.hover_s",
        "solutions.1.stops.0.duration_s",
    }


def test_an_itinerary_may_name_a_mission_of_the_set(tmp_path: Path) -> None:
    stop = '[[stops]]\nat = "hover"\nkind = "hover"\nduration_s = 300\n'
    file = tmp_path / "mine.toml"
    file.write_text(f'schema = 1\nmission = "set/walls-30"\n{stop}', "utf-8")
    assert optuav.audit(file).subject.mission == optuav.load("set/walls-30")


@pytest.mark.parametrize("more_s", [1e-4, 1e-2])
def test_no_tolerance_makes_a_plan_better_than_what_is_proved(more_s: float) -> None:
    """Proved plans that hover a little longer are as good, or do not hold because of a limit."""
    for known in [each for each in answers().values() if each.status == "optimal"][::23]:
        stops = list(known.stops)
        (number,) = [k for k, stop in enumerate(stops) if stop.kind == "hover"][:1]
        stops[number] = replace(stops[number], duration_s=stops[number].duration_s + more_s)
        assert known.hover_s is not None
        found = checked(optuav.load(known.mission), known, known.hover_s + more_s, stops)
        assert found.verdict in ("holds, optimal", "DOES NOT HOLD")
        assert not any("impossible" in words for words in found.wrong)

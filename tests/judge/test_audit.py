"""Audit: plans with one number spoiled, itineraries of others, and files that are neither."""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import optuav
from optuav import InputError, Mission, Plan
from optuav.judge import Audit, Itinerary, Stop
from tests.examples import few
from tests.mission.strategies import missions
from tests.plan.made import INFEASIBLE, feasible, plans

TOLERANCE = 1e-6
SPOILT = 10.0
"""By how many tolerances a number is spoiled at least."""
NO_FIGURES = ("schema", "slot_s", "mission")
"""What a plan's file has in numbers that are no figures of the plan."""

Way = tuple[str | int, ...]


def numbers(data: Any, way: Way = ()) -> Iterator[tuple[Way, float]]:
    """Every number of plain data, and the way to it."""
    if isinstance(data, dict):
        for key, value in data.items():
            if way or key not in NO_FIGURES:
                yield from numbers(value, (*way, key))
    elif isinstance(data, list):
        for place, value in enumerate(data):
            yield from numbers(value, (*way, place))
    elif isinstance(data, int | float) and not isinstance(data, bool):
        yield way, float(data)


def tolerance(data: dict[str, Any], way: Way, value: float) -> float:
    """By how much a figure may be off: charge by a share of the capacity, others of themselves.

    How long a stay takes is not a figure but the plan itself, and shows in what follows from it: in
    moments, which may be off by a share of the mission time.
    """
    battery = data["mission"]["battery"]
    if {"available_As", "bound_As"} & set(way):
        return TOLERANCE * battery["packs"] * battery["capacity_As"]
    if way[0] == "soc":
        return TOLERANCE * max(1.0, abs(value))
    if way[-1] == "duration_s":
        return TOLERANCE * data["mission_time_s"]
    if way[-1] in ("current_A", "power_W"):
        # Drawn and received cancel in part; neither is more than a few times these.
        return TOLERANCE * max(abs(value), {"current_A": 400.0, "power_W": 10_000.0}[way[-1]])
    return TOLERANCE * abs(value)


def spoiled(data: dict[str, Any], way: Way, value: object) -> dict[str, Any]:
    """The data with another value in one place."""
    other = copy.deepcopy(data)
    inner: Any = other
    for part in way[:-1]:
        inner = inner[part]
    inner[way[-1]] = value
    return other


def caught(data: dict[str, Any], path: Path) -> bool:
    """Whether the audit of a file refuses it or finds figures that contradict each other."""
    path.write_text(json.dumps(data), "utf-8")
    try:
        return any(event.kind == "mismatch" for event in optuav.audit(path).violations)
    except InputError:
        return True


@cache
def data_of(name: str) -> dict[str, Any]:
    return plans()[name].to_dict()


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("audit") / "plan.json"


@pytest.mark.campaign
@given(
    st.data(),
    st.one_of(
        st.sampled_from([name for name in feasible() if name != "edited"]).map(data_of),
        missions().map(optuav.solve).filter(bool).map(Plan.to_dict),
    ),
    st.floats(SPOILT, 1e6),
    st.sampled_from([-1.0, 1.0]),
)
@settings(few(10), suppress_health_check=[HealthCheck.filter_too_much, HealthCheck.too_slow])
def test_one_spoiled_number_is_caught(
    path: Path, draw: st.DataObject, data: dict[str, Any], times: float, sign: float
) -> None:
    """Whichever number of a plan's file it is, however large or small."""
    way, value = draw.draw(st.sampled_from(list(numbers(data))))
    change = sign * times * tolerance(data, way, value) or sign * times * 1e-3
    assert caught(spoiled(data, way, value + change), path), (way, value, value + change)


@pytest.mark.parametrize("odd", [-1.0, 1e99, 10**400, "much", {}])
def test_odd_values_are_caught(odd: object, path: Path) -> None:
    """In every field where a plan's file has a number; never an error that is not ours."""
    data = data_of("direct")
    fields = {tuple(part for part in way if isinstance(part, str)): way for way, _ in numbers(data)}
    for way in fields.values():
        assert caught(spoiled(data, way, odd), path), way


def test_an_objective_of_nothing_is_caught(path: Path) -> None:
    """A hover time of 0 is no missing one."""
    assert caught({**data_of("direct"), "objective": 0.0}, path)
    older = {key: value for key, value in data_of("direct").items() if key != "objective"}
    assert not caught(older, path)


@pytest.mark.parametrize("name", ["optimal", "table 2"])
def test_every_spoiled_number_of_a_plan_is_caught(name: str, path: Path) -> None:
    """By a hundredth of itself, one after the other."""
    data = data_of(name)
    for way, value in numbers(data):
        assert caught(spoiled(data, way, value * 1.01 or 0.01), path), way


def test_slots_that_stays_do_not_fill_are_caught(path: Path) -> None:
    """One stay suffices; a hover that the deadline ends may be cut short in its last slot."""
    for name, slot_s in (("slots", 20.0), ("slots", 25.001)):
        assert caught(spoiled(data_of(name), ("slot_s",), slot_s), path), slot_s
    data = data_of("cut short")
    assert data["mission_time_s"] == pytest.approx(800.0)
    assert not caught(data, path)
    assert not caught(spoiled(data, ("slot_s",), 7.0), path)


def test_slots_of_impossible_length_are_no_plan(path: Path) -> None:
    """Among them those of no length, which no stay can be counted in."""
    for slot_s in (0, 0.0, 1e-320, 1e-9, 1e99):
        path.write_text(json.dumps(spoiled(data_of("slots"), ("slot_s",), slot_s)), "utf-8")
        with pytest.raises(InputError, match=r"slot_s.*a number, x [<>]= "):
            optuav.audit(path)


def test_slots_that_divide_every_stay_are_true_of_what_is_flown(path: Path) -> None:
    """No other plan of slots this short is looked for: that would be solving."""
    data = data_of("slots")
    assert {stop["duration_s"] % 5.0 for stop in data["stops"]} == {0.0}
    assert not caught(spoiled(data, ("slot_s",), 5.0), path)


@pytest.mark.parametrize("name", ["flyable", "direct"])
def test_a_verdict_that_was_changed_is_caught(name: str, path: Path) -> None:
    """Both ways; where nothing was simulated, there is nothing to compare."""
    data = data_of(name)
    assert data["flyable"] is (name == "flyable")
    assert caught(spoiled(data, ("flyable",), not data["flyable"]), path)
    assert not caught(spoiled(data, ("flyable",), None), path)


def test_times_of_an_edited_leg_are_compared_with_what_follows(path: Path) -> None:
    """The user's own figures are taken as they are, but the moments and wells follow from them."""
    data = data_of("edited")
    for figure in ("duration_s", "current_A", "power_W"):
        way = ("phases", 0, "stages", 0, figure)
        value = dict(numbers(data))[way]
        assert caught(spoiled(data, way, 1.01 * value), path), figure


@pytest.mark.parametrize("name", feasible())
def test_our_own_files_contradict_nothing(name: str, tmp_path: Path) -> None:
    plan = plans()[name]
    plan.save(tmp_path / "plan.json")
    judged = optuav.audit(tmp_path / "plan.json")
    assert judged.flyable == (plan.runs_dry_s is None and plan.overfull_s is None)
    assert judged.events == optuav.audit(plan).events


@pytest.mark.parametrize("name", INFEASIBLE)
def test_no_plan_is_not_flyable(name: str, tmp_path: Path) -> None:
    plan = plans()[name]
    plan.save(tmp_path / "plan.json")
    judged = optuav.audit(tmp_path / "plan.json")
    (event,) = judged.violations
    assert event.kind == "no plan"
    assert plan.reasons[0] in " ".join(str(judged).split())
    assert judged.to_dict()["route"] == []


def itinerary(tmp_path: Path, text: str) -> Path:
    """A file in a directory of its own."""
    path = tmp_path / "itinerary.toml"
    path.write_text(text, "utf-8")
    return path


STOPS = """
[[stops]]
at = "b9"
kind = "rest"
duration_s = 231.8

[[stops]]
at = "hover"
kind = "hover"
duration_s = 605.4

[[stops]]
at = "b10"
kind = "rest"
duration_s = 254
"""


def test_an_itinerary_of_somebody_else(tmp_path: Path) -> None:
    """Two rests that fit, and then a deadline into which they do not."""
    written = itinerary(tmp_path, f'schema = 1\nmission = "paper"\n{STOPS}')
    judged = optuav.audit(written)
    assert judged
    assert isinstance(judged.subject, Itinerary)
    assert judged.subject.stops[1] == Stop("hover", "hover", 605.4)
    assert "1e−06 of the capacity (0.072 A s)" in str(judged)

    optuav.load("paper").replace({"limits.deadline_s": 1100}).save(tmp_path / "mine.toml")
    nearby = itinerary(tmp_path, f'schema = 1\nmission = "mine.toml"\n{STOPS}')
    (late,) = optuav.audit(nearby).violations
    assert (late.kind, late.time_s) == ("deadline", 1100.0)
    assert late.value == pytest.approx(1091.2 + 108.5, abs=0.1)


def test_all_faults_of_an_itinerary_are_reported_at_once(tmp_path: Path) -> None:
    written = itinerary(
        tmp_path,
        'schema = 2\nmission = "paper"\npilot = "me"\n'
        '[[stops]]\nat = "b99"\nkind = "sleep"\nduration_s = -1\n'
        "[[stops]]\nat = 3\nduration_s = true\n",
    )
    with pytest.raises(InputError) as raised:
        optuav.audit(written)
    assert {fault.key for fault in raised.value.faults} == {
        "schema",
        "pilot",
        "stops.0.at",
        "stops.0.kind",
        "stops.0.duration_s",
        "stops.1.at",
        "stops.1.kind",
        "stops.1.duration_s",
    }


@pytest.mark.parametrize(
    "text",
    [
        "",
        "nonsense",
        "{",
        "{}",
        '{"kind": "optuav plan", "schema": 1}',
        'schema = 1\nmission = "paper"',
        'schema = 1\nmission = "nowhere.toml"\nstops = []',
        'schema = 1\nmission = ""\nstops = []',
        'schema = 1\nmission = "paper"\nstops = 1',
        'schema = 1\nmission = "paper"\n[[stops]]\nat = "b1"\nkind = "rest"\nduration_s = nan',
        'schema = 1\nmission = "paper"\n[[stops]]\nat = "b1"\nkind = "rest"\nduration_s = inf',
    ],
)
def test_what_is_no_plan_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        optuav.audit(itinerary(tmp_path, text))


STOP = '[[stops]]\nat = "b1"\nkind = "rest"\nduration_s = 5\n'
SECONDS = "a number, 0 <= x <= 1e7 [s]"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("stops = 3", "stops = 3: must be tables [[stops]], each a table"),
        (
            'stops = ["b1"]',
            "stops.0 = 'b1': must be a table (in Python a Stop) with at, kind, duration_s",
        ),
        (STOP * 10_001, "at most 10000"),
        (STOP.replace("duration_s = 5", ""), f"stops.0.duration_s: is missing; {SECONDS}"),
        (STOP.replace("_s = 5", "_min = 5"), "unknown key; did you mean 'duration_s'?"),
        *(
            (STOP.replace("= 5", f"= {value}"), f"stops.0.duration_s = {shown}: must be {SECONDS}")
            for value, shown in (
                ("-5", "-5"),
                ("nan", "nan"),
                ("inf", "inf"),
                ("1e300", "1e+300"),
                ("true", "true"),
                ('"long"', "'long'"),
                ("2026-01-01", "2026-01-01"),
                ("1" + "0" * 400, "an integer of 1329 bits"),
            )
        ),
        (STOP.replace('"b1"', "9"), "stops.0.at = 9: must be the name of a place"),
        (STOP.replace('"b1"', '"b99"'), "stops.0.at = 'b99': is not a place of the mission paper"),
        (STOP.replace('"rest"', '"Rest"'), 'stops.0.kind = \'Rest\': must be "rest" or "hover"'),
    ],
)
def test_a_broken_itinerary_is_refused_in_our_words(text: str, words: str, tmp_path: Path) -> None:
    """Field, value and what is allowed, in one line of its file."""
    path = itinerary(tmp_path, f'schema = 1\nmission = "paper"\n{text}')
    with pytest.raises(InputError) as raised:
        optuav.audit(path)
    assert str(raised.value).startswith(f"{path}: stops")
    assert words in str(raised.value)
    assert not re.search("input|field|extra|tuple|dictionary", str(raised.value), re.IGNORECASE)


def test_the_mission_of_an_itinerary_is_refused_as_its_key(tmp_path: Path) -> None:
    """One that does not exist by the itinerary's key and file; one that is broken by its own."""
    for name, words in (
        ("papr", "mission = 'papr': there is no such file; did you mean 'paper'?"),
        (".", "mission = '.': is a directory, not a file"),
        (
            "",
            "mission = '': must be the name of a shipped mission, a path relative to this file",
        ),
    ):
        path = itinerary(tmp_path, f'schema = 1\nmission = "{name}"\nstops = []')
        with pytest.raises(InputError, match=re.escape(f"{path}: {words}")):
            optuav.audit(path)
    (tmp_path / "mine.toml").write_text("schema = 1\n", "utf-8")
    with pytest.raises(InputError, match=r"mine\.toml: route: is missing"):
        optuav.audit(itinerary(tmp_path, 'schema = 1\nmission = "mine.toml"\nstops = []'))


@pytest.mark.parametrize("content", ["[1, 2]", "3", "null", '"x"'])
def test_a_json_file_is_a_plan_or_nothing(content: str, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    path.write_text(content, "utf-8")
    with pytest.raises(InputError, match='is not a plan: "kind": "optuav plan" is missing'):
        optuav.audit(path)


def test_no_stops_at_all_is_a_flight(tmp_path: Path) -> None:
    judged = optuav.audit(itinerary(tmp_path, 'schema = 1\nmission = "paper"\nstops = []'))
    assert judged
    assert judged.to_dict()["route"] == ["origin", "destination"]


@pytest.mark.campaign
@given(missions(), st.data())
@settings(few(16))
def test_any_itinerary_gets_a_verdict(mission: Mission, data: st.DataObject) -> None:
    """Whatever the stops: no error, every violation with a moment of the mission, plain data."""
    names = ["origin", "hover", "destination", *(each.name for each in mission.buildings)]
    stop = st.builds(
        Stop, st.sampled_from(names), st.sampled_from(["rest", "hover"]), st.floats(0.0, 2000.0)
    )
    stops = data.draw(st.lists(stop, max_size=6))
    judged: Audit = optuav.audit(Itinerary(mission, tuple(stops)))
    plain = json.loads(json.dumps(judged.to_dict(), allow_nan=False))
    assert plain["flyable"] == bool(judged)
    assert str(judged).startswith("FLYABLE" if judged else "NOT FLYABLE")
    end_s = plain.get("mission_time_s", 0.0)
    assert all(0.0 <= event["time_s"] <= end_s * (1 + 1e-9) for event in plain["events"])


def test_what_is_no_plan_is_refused_in_words() -> None:
    """Stops without a mission, and stops that are no `Stop`, as students write them."""
    stops = [("hover", "hover", 570.0)]
    with pytest.raises(optuav.InputError, match=r"plan = .*a Plan, an Itinerary of a mission"):
        optuav.audit(stops)  # type: ignore[arg-type]
    with pytest.raises(optuav.InputError, match=r"stops\.0 = .*in Python a Stop"):
        optuav.Itinerary(optuav.load("paper"), stops)  # type: ignore[arg-type]


def test_an_itinerary_is_a_dict_and_json_as_well_as_toml(tmp_path: Path) -> None:
    """With its mission by name or whole: one verdict for all, and all its faults."""
    stops = [{"at": "b9", "kind": "rest", "duration_s": 231.8}]
    stops += [{"at": "hover", "kind": "hover", "duration_s": 605.4}]
    stated = {"schema": 1, "mission": "paper", "stops": stops}
    (file := tmp_path / "theirs.json").write_text(json.dumps(stated))
    itinerary = Itinerary(optuav.load("paper"), tuple(Stop(**each) for each in stops))
    (whole := tmp_path / "whole.json").write_text(json.dumps(itinerary.to_dict()))
    _, route, expected = str(optuav.audit(itinerary)).partition("Route ")
    for each in (stated, file, itinerary.to_dict(), whole):
        assert str(optuav.audit(each)).endswith(f"{route}{expected}")
    plan = optuav.solve("paper", "P3")
    assert optuav.audit(plan.to_dict()).flyable
    for wrong, words in (
        (
            {**stated, "mission": {"limits": {"min_soc": 2}}},
            r"a dict: mission\.limits\.min_soc = 2",
        ),
        ({**stated, "stops": [{**stops[0], "at": "b99"}]}, r"stops\.0\.at = 'b99': is not a place"),
        ({"schema": 1}, "mission: is missing"),
        ([stated], "a dict, or the path"),
    ):
        with pytest.raises(InputError, match=words):
            optuav.audit(wrong)  # type: ignore[arg-type]


def test_a_stop_may_be_a_point_to_hover_at(tmp_path: Path) -> None:
    """Judged by the same limits as the mission's own hover point if that stood there."""
    paper = optuav.load("paper")
    for point, kinds in (([900.0, 2600.0, 60.0], []), ([900, 2600, 40], ["altitude"])):
        there = Itinerary(paper, (Stop(point, "hover", 500.0),))
        moved = paper.replace({"route.hover_m": point})
        own = optuav.audit(Itinerary(moved, (Stop("hover", "hover", 500.0),)))
        found = optuav.audit(there)
        assert [event.kind for event in found.violations] == kinds
        figures = [(each.kind, each.time_s, each.value, each.limit) for each in own.events]
        assert [
            (each.kind, each.time_s, each.value, each.limit) for each in found.events
        ] == figures
        assert f"origin → ({', '.join(f'{x:g}' for x in point)}) → destination" in str(found)
        assert str(optuav.audit(there.to_dict())).splitlines()[1:] == str(found).splitlines()[1:]
    far = Itinerary(paper, (Stop((0, 0, 60), "hover", 5.0), Stop((800, 1750, 200), "rest", 5.0)))
    kinds = [event.kind for event in optuav.audit(far).violations]
    assert kinds == ["coverage", "no roof"]
    for wrong in ([1, 2], [1, 2, "3"], [1, 2, float("nan")], [1, 2, 1e9], [[1], 2, 3], 5, None):
        with pytest.raises(InputError, match=r"the name of a place, or \[x, y, z\] \[m\]"):
            Itinerary(paper, (Stop(wrong, "hover", 1.0),))  # type: ignore[arg-type]


def test_stops_as_tables_are_stops() -> None:
    """A dict with the keys of a stop is taken where an itinerary is made, as its error says."""
    table = {"at": "hover", "kind": "hover", "duration_s": 100.0}
    itinerary = optuav.Itinerary("paper", [table])  # type: ignore[list-item]
    assert itinerary == optuav.Itinerary("paper", optuav.Stop("hover", "hover", 100.0))
    assert optuav.audit(itinerary).flyable


def test_a_point_may_be_an_array() -> None:
    """In a stop and in a dict, of floats or of whole numbers; others are refused as lists are."""
    hover = [1000.0, 2900.0, 50.0]
    expected = optuav.audit(Itinerary("paper", Stop((*hover,), "hover", 3.0)))
    for at in (np.array(hover), np.array(hover, dtype=int), (*np.array(hover),)):
        found = optuav.audit(Itinerary("paper", Stop(at, "hover", 3.0)))
        assert str(found) == str(expected)
        stop = {"at": at, "kind": "hover", "duration_s": 3.0}
        stated = {"schema": 1, "mission": "paper", "stops": [stop]}
        assert optuav.audit(stated).flyable == expected.flyable
    with pytest.raises(InputError, match=r"at = \[1000\.0, 2900\.0\]: must be the name of a place"):
        Itinerary("paper", Stop(np.array(hover[:2]), "hover", 3.0))


def test_a_bent_way_may_begin_beside_a_wall_and_below_its_roof() -> None:
    """Nearer than the clearance, of which only what is above the roof counts there."""
    wall = {"name": "wall", "position_m": [500, 1250, 200], "footprint_m": [800, 60]}
    hut = {"name": "hut", "position_m": [8, 0, 53], "footprint_m": [10, 10]}
    walled = {"buildings": [wall, hut], "flight.obstacles": "over", "flight.clearance_m": 5}
    plan = optuav.solve(optuav.load("paper").replace(walled), "P3", perspective="battery")
    assert plan.phases[0].waypoints_m
    assert {event.kind for event in optuav.audit(plan).violations} == {"empty"}

"""Plans as plain data and as JSON files: exact round trips, clear words about broken files."""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import optuav
from optuav import InputError, Plan
from optuav.plan.plan import DERIVED
from tests.examples import few
from tests.mission.strategies import missions
from tests.plan.made import INFEASIBLE, feasible, plans

TEXTS = {kind: json.dumps(plan.to_dict()) for kind, plan in plans().items()}
HOSTILE: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 1, 0.5, -1e-300, 1e100, 1.1e100, -1e308, 10**400, "", "5", "NaN"),
    *(
        [],
        {},
        [[]],
        [None],
        {"x": 1},
        [1, 2, 3],
        "flight",
        "b1",
        "optimal",
        "infeasible",
        "nowhere",
    ),
    *("\0", "\x1b[31m", "x" * 3000, "line\nbreak", "\ud800", "建物", [{}] * 3, 1e-320, "hover"),
)


def load(text: str | bytes, directory: Path) -> Plan:
    path = directory / "plan.json"
    path.write_bytes(text.encode("utf-8", "surrogatepass") if isinstance(text, str) else text)
    return optuav.load_plan(path)


def refusal(text: str | bytes, directory: Path) -> str:
    with pytest.raises(InputError) as raised:
        load(text, directory)
    return str(raised.value)


def spoilt(kind: str = "optimal", **changes: Any) -> str:
    """A plan as text with some fields changed."""
    return json.dumps(json.loads(TEXTS[kind]) | changes)


def use(plan: Plan) -> None:
    """Everything that a plan states once it was read."""
    text = plan.summary()
    assert all(len(line) <= 80 for line in text.splitlines())
    assert all(line.isprintable() for line in text.splitlines())
    json.dumps(plan.to_dict(), allow_nan=False)
    if plan:
        values = plan.hover_time_s, plan.mission_time_s, plan.peak_speed_m_s
        assert all(math.isfinite(value) for value in values)
        assert plan.route
        assert plan.stops is not None
        assert plan.warnings is not None


@pytest.mark.parametrize("kind", plans())
def test_the_round_trip_is_exact(kind: str, tmp_path: Path) -> None:
    """Every bit of every number, and the mission inside."""
    plan = plans()[kind]
    plan.save(tmp_path / "plan.json")
    again = optuav.load_plan(tmp_path / "plan.json")
    assert again == plan
    assert again.to_dict() == plan.to_dict()
    assert again.mission == plan.mission
    assert again.summary() == plan.summary()
    assert bool(again) == bool(plan)
    again.save(str(tmp_path / "again.json"))
    written = [(tmp_path / name).read_bytes() for name in ("plan.json", "again.json")]
    assert written[0] == written[1]


@pytest.mark.campaign
@given(mission=missions(), slot_s=st.sampled_from([None, 7.0]))
@settings(few(12))
def test_random_plans_survive_their_file(
    mission: optuav.Mission, slot_s: float | None, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Any names, any figures, with and without an answer."""
    plan = optuav.solve(mission, slot_s=slot_s, perspective="battery")
    path = tmp_path_factory.getbasetemp() / "random plan.json"
    plan.save(path)
    assert optuav.load_plan(path) == plan
    use(plan)


@pytest.mark.parametrize("kind", feasible())
def test_the_data_repeat_what_the_plan_says(kind: str) -> None:
    """Times, route, stops and warnings for readers without optuav."""
    plan, data = plans()[kind], plans()[kind].to_dict()
    assert list(data)[:2] == ["schema", "kind"]
    assert data["kind"] == "optuav plan"
    for name in ("hover_time_s", "rest_time_s", "flight_time_s", "mission_time_s"):
        assert data[name] == getattr(plan, name)
        assert type(data[name]) is float
    assert data["route"] == list(plan.route)
    assert [stop["at"] for stop in data["stops"]] == [stop.at for stop in plan.stops]
    assert data["runs_dry_s"] == plan.runs_dry_s
    assert data["mission"] == plan.mission.to_dict()
    assert data["phases"][0]["stages"][0]["current_A"] == plan.phases[0].stages[0].current_A


@pytest.mark.parametrize("kind", INFEASIBLE)
def test_times_are_null_where_there_is_no_plan(kind: str) -> None:
    """And the reasons are there."""
    data = plans()[kind].to_dict()
    assert [data[name] for name in DERIVED] == [None] * len(DERIVED)
    assert data["soc"] is None
    assert data["phases"] == []
    assert data["reasons"]
    assert data["status"] == "infeasible"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "is not JSON"),
        (b"\xff\xfe\x00", "is not text in UTF-8"),
        (b"{", "is not JSON"),
        (b"[" * 100_000, "is not JSON"),
        (b"9" * 5000, "a whole number has more than 4300 digits"),
        (b'{"kind": "optuav plan", "a": {"b": 1, "b": 2}}', "contains the key 'b' more than once"),
        (b"[]", "is not a plan"),
        (b"null", "is not a plan"),
        (b"{}", '"kind": "optuav plan" is missing'),
        (b'{"kind": "optuav plan"}', "schema: 1 is the only"),
        (b'{"kind": "optuav plan", "schema": 2}', "schema = 2: 1"),
        (TEXTS["optimal"].replace("719.5", "NaN719.5").encode(), "is not JSON"),
        (b'{"kind": "optuav plan", "schema": 1, "slot_s": NaN}', "NaN is not a JSON number"),
        (b'{"kind": "optuav plan", "schema": 1, "slot_s": -Infinity}', "-Infinity is not a JSON"),
    ],
)
def test_a_file_that_is_no_plan(content: bytes, words: str, tmp_path: Path) -> None:
    """One line that says what it is instead."""
    text = refusal(content, tmp_path)
    assert words in text
    assert str(tmp_path / "plan.json") in text


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    """A directory, nothing at all, a pipe."""
    with pytest.raises(InputError, match="is a directory"):
        optuav.load_plan(tmp_path)
    with pytest.raises(InputError, match="there is no such file"):
        optuav.load_plan(tmp_path / "none.json")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="no regular file"):
        optuav.load_plan(tmp_path / "pipe")


def test_a_file_too_large_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Before it fills the memory."""
    monkeypatch.setattr("optuav.plan.plan.LARGEST_BYTES", 1000)
    assert "is larger than" in refusal(TEXTS["optimal"], tmp_path)


def test_all_faults_are_reported_at_once(tmp_path: Path) -> None:
    """In the plan and in the mission inside, each by its key."""
    data = json.loads(TEXTS["optimal"])
    data["mission"]["limits"]["deadline_s"] = -5
    del data["mission"]["battery"]
    data["status"] = "splendid"
    data["surprise"] = 1
    del data["engine"]
    data["phases"][0]["stages"][0]["duration_s"] = -1.0
    data["phases"][1]["stages"] = []
    data["phases"][2]["kind"] = "swim"
    data["phases"][3]["available_As"] = [None]
    data["phases"][4]["edited"] = "no"
    text = refusal(json.dumps(data), tmp_path)
    for key in (
        *("mission.limits.deadline_s = -5", "mission.battery", "status = 'splendid'", "surprise"),
        *("engine", "phases.0.stages.0.duration_s = -1.0", "phases.1.stages", "phases.2.kind"),
        *("phases.3.available_As.0", "phases.4.edited = 'no'"),
    ):
        assert f"plan.json: {key}" in text
    assert not re.search("input|field|extra|tuple|dictionary", text, re.IGNORECASE)


def test_a_wrong_list_is_reported_by_its_entries(tmp_path: Path) -> None:
    """And not as too short, though nothing sound is left of it."""
    data = json.loads(TEXTS["optimal"])
    data["phases"][1]["stages"][0]["duration_s"] = -1.0
    text = refusal(json.dumps(data), tmp_path)
    assert text.endswith("phases.1.stages.0.duration_s = -1.0: must be a number, x >= 0")
    assert "\n" not in text


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"phases": []}, "with status optimal, a plan needs phases and soc"),
        ({"soc": None}, "with status optimal, a plan needs phases and soc"),
        ({"status": "infeasible"}, "with status infeasible, a plan has no phases and soc"),
        ({"mission": None}, "mission"),
        ({"mission": {}}, "mission.route"),
        ({"mission": 5}, "mission"),
        ({"slot_s": "1"}, "slot_s = '1'"),
        ({"soc": {"battery": True}}, "soc.battery = true"),
    ],
)
def test_what_does_not_go_together(changes: dict[str, Any], words: str, tmp_path: Path) -> None:
    assert words in refusal(spoilt(**changes), tmp_path)


def test_the_phases_decide_not_what_is_repeated_for_the_reader(tmp_path: Path) -> None:
    """Derived values may be missing; one that contradicts the phases is refused, not ignored."""
    data = json.loads(TEXTS["optimal"])
    for name in DERIVED:
        data.pop(name)
    assert load(json.dumps(data), tmp_path) == plans()["optimal"]
    with pytest.raises(InputError, match=r"hover_time_s = 1000000000\.0: must be 719"):
        load(spoilt(hover_time_s=1e9), tmp_path)


def paths(value: Any, above: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Paths of all values within nested data."""
    items: Any = value.items() if isinstance(value, dict) else ()
    items = enumerate(value) if isinstance(value, list) else items
    for key, item in items:
        yield (*above, key)
        yield from paths(item, (*above, key))


def attempt(content: str | bytes, directory: Path) -> None:
    """Read a file: clear faults, or a plan that answers everything."""
    faults: tuple[optuav.Fault, ...] = ()
    try:
        plan = load(content, directory)
    except InputError as error:
        faults = error.faults
    if faults:
        assert all(str(fault).isprintable() for fault in faults)
    else:
        use(plan)


@given(data=st.data())
def test_a_damaged_file_is_refused_or_read(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Values replaced, left out or doubled: an InputError, or a plan that answers everything."""
    document = json.loads(TEXTS[data.draw(st.sampled_from(list(TEXTS)))])
    for _ in range(data.draw(st.integers(1, 3))):
        *above, key = data.draw(st.sampled_from(list(paths(document))))
        parent = document
        for each in above:
            parent = parent[each]
        match data.draw(st.integers(0, 3)):
            case 0:
                del parent[key]
            case 1 if isinstance(parent, list):
                parent.append(parent[key])
            case _:
                parent[key] = data.draw(st.sampled_from(HOSTILE))
    attempt(json.dumps(document), tmp_path_factory.getbasetemp())


@given(data=st.data())
def test_damaged_bytes_are_refused_or_read(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Bytes deleted, doubled or replaced."""
    content = TEXTS[data.draw(st.sampled_from(list(TEXTS)))].encode()
    start = data.draw(st.integers(0, len(content)))
    end = start + data.draw(st.sampled_from([0, 1, 2, 7, 100]))
    instead = st.sampled_from([b"", content[start:end] * 2, b"9", b"-", b"e9", b'"', b"}", b"]"])
    content = content[:start] + data.draw(instead | st.binary(max_size=3)) + content[end:]
    attempt(content, tmp_path_factory.getbasetemp())


def test_saving_where_nothing_can_be_written(tmp_path: Path) -> None:
    """A missing directory, a directory in place of a file; what was there stays."""
    plan = plans()["optimal"]
    with pytest.raises(InputError, match="there is no directory"):
        plan.save(tmp_path / "none" / "plan.json")
    with pytest.raises(InputError, match="is a directory"):
        plan.save(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_a_plan_of_a_large_mission_survives(tmp_path: Path) -> None:
    """1000 buildings with outlines of 12 corners."""
    ring = [[100 * math.cos(k), 100 * math.sin(k)] for k in [k * math.pi / 6 for k in range(12)]]
    stated = [{"name": f"n{k}", "position_m": [0, 0, 1], "footprint_m": ring} for k in range(1000)]
    plan = optuav.solve(
        optuav.load("paper").replace({"buildings": stated, "flight.through_buildings": True}),
        "P3",
        perspective="battery",
    )
    plan.save(tmp_path / "plan.json")
    assert optuav.load_plan(tmp_path / "plan.json") == plan


def test_a_plan_of_a_million_wrong_values_is_refused_in_a_few_words(tmp_path: Path) -> None:
    """One fault a list, or the limit of phases: not a message for each value."""
    file, plan = tmp_path / "plan.json", optuav.solve("paper", perspective="battery").to_dict()
    for name, value, words in (
        ("phases", [1] * 10_001, "phases: must be a list of at most 10000"),
        ("notes", [1] * 30_000, "notes.0 = 1: must be a string"),
        ("x", [1] * 2_000_000, "has more than 2000000 values"),
    ):
        file.write_text(json.dumps({**plan, name: value}))
        with pytest.raises(optuav.InputError) as caught:
            optuav.load_plan(file)
        assert words in str(caught.value)
        assert len(caught.value.faults) <= 2

"""Answers of the FAQ that name a limit of optuav still hold, and so do the offers beside limits."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

import optuav
from optuav.mission.forms import table_keys
from optuav.physics.cells import CELLS

DOCS = Path(__file__).parents[1] / "docs"
_, *PARTS = re.split(r"^### (.*)\n", (DOCS / "faq.md").read_text("utf-8"), flags=re.M)
ANSWERS = {
    question: re.split(r"^## ", answer, flags=re.M)[0]
    for question, answer in zip(PARTS[::2], PARTS[1::2], strict=True)
}

WALL = {"name": "wall", "position_m": [500, 1250, 200], "footprint_m": [800, 60]}


def walled(rule: str) -> optuav.Mission:
    """The mission of the page on ways: a wall in every direct leg."""
    return optuav.load("paper").replace({"buildings": [WALL], "flight.obstacles": rule})


def falls() -> None:
    """The paper's plan falls, the default's flies, and lithium wells do not save it."""
    answer, paper = ANSWERS["Why does the optimal plan of the paper fall?"], optuav.load("paper")
    assert optuav.solve(paper).flyable
    lipo = CELLS["lipo"]
    wells = {
        "battery.available_fraction": lipo.available_fraction,
        "battery.flow_rate_per_s": lipo.flow_rate_per_s,
    }
    for mission in (paper, paper.replace(wells)):
        dry_s = optuav.solve(mission, perspective="battery").runs_dry_s
        assert dry_s is not None
        assert f"{dry_s:.1f} s" in answer


def wells() -> None:
    assert CELLS["liion"].most_C == 2.0


def no_drag() -> None:
    """No drag in `paper`; a cap in the two missions that the answer names, drag in the third."""
    names = ("paper", "paper-drag", "matrice350", "relay-today")
    paper, drag, *capped = map(optuav.load, names)
    assert not paper.flight_model.has_drag
    assert drag.flight_model.has_drag
    assert drag.body
    assert drag.body.drag_area_m2 > 0.0
    peaks = [phase.peak_speed_m_s for phase in optuav.solve(paper).phases]
    assert f"{max(peaks):.0f} m/s" == "155 m/s"
    assert [mission.flight.model for mission in capped] == ["regimes", "rotary-wing"]
    for mission in capped:
        assert max(phase.peak_speed_m_s for phase in optuav.solve(mission).phases) < 25.0


def stronger_laser() -> None:
    """Ten times the power gives the same hover; with a higher cap it is longer."""
    strong = optuav.load("paper").replace({"laser.power_W": 10_000})
    same, higher = (
        optuav.solve(strong.replace({"battery.charge_current_A": current})) for current in (10, 20)
    )
    assert same.hover_time_s == pytest.approx(optuav.solve("paper").hover_time_s, abs=1e-6)
    assert higher.hover_time_s > same.hover_time_s + 10.0
    assert any("battery.charge_current_A" in note for note in same.notes)


def more_stops() -> None:
    """They gain nothing where only charge counts, and something where a well may run dry."""
    more = optuav.P1(stops=2, hovers=2)
    one, two = (optuav.solve("paper", problem, perspective="battery") for problem in ("P1", more))
    assert two.hover_time_s == pytest.approx(one.hover_time_s, abs=1e-6)
    one, two = (optuav.solve("paper", problem) for problem in ("P1", more))
    assert two.hover_time_s > one.hover_time_s + 1.0
    assert any("--stops 2" in note for note in one.notes)


def buildings() -> None:
    """A blocked leg is refused by default; over and around fly, with a waypoint."""
    default = walled("over").replace({"flight.obstacles": None})
    assert not optuav.solve(default, "P3", perspective="battery")
    for rule in ("over", "around"):
        plan = optuav.solve(walled(rule), "P3", perspective="battery")
        assert plan.phases[0].waypoints_m


def replanning() -> None:
    """A plan begins where and as charged as the mission says, and `return` has a rule."""
    begun = {"route.origin_m": [600, 1000, 30], "start": {"available_As": 3e4, "bound_As": 1.4e4}}
    assert optuav.solve(optuav.load("paper").replace(begun))
    first, *_ = optuav.return_by("paper").rows
    assert None not in (first["a"], first["b"], first["g_As"])


def exports() -> None:
    """The files of both autopilots and of maps exist, and say that no autopilot has flown them."""
    place = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4}
    plan = optuav.solve(optuav.load("matrice350").replace(place))
    for suffix in (".plan", ".waypoints", ".kml", ".geojson"):
        with TemporaryDirectory() as folder:
            plan.export(Path(folder) / f"hill{suffix}")
            words = [file.read_text("utf-8") for file in Path(folder).iterdir()]
        assert any("No autopilot has flown" in text for text in words), suffix


def failing_drone() -> None:
    """A drone more than needed allows a new roster; an endless fleet has no such question."""
    cycle = optuav.coverage("matrice350")
    least = cycle.event(4).drones
    assert cycle.event(4).without(2, at_s=2000).roster is None
    assert cycle.event(4, least + 1).without(2, at_s=2000).roster is not None
    assert not hasattr(cycle.fleet(), "without")


def second_device() -> None:
    """A list of devices is served in one mission; what runs without end serves one place."""
    plan = optuav.solve("three-sensors")
    assert [*plan.hovers.values()] == pytest.approx([plan.hover_time_s / 3] * 3)
    assert plan.rest_time_s > 0.0
    for service in (optuav.coverage, optuav.size_fleet, optuav.return_by):
        with pytest.raises(optuav.InputError, match="must be one device"):
            service("three-sensors")
    turns = {"battery.packs": 2, "battery.schedule": "sequential"}
    with pytest.raises(optuav.InputError, match="must be pooled"):
        optuav.solve(plan.mission.replace(turns))
    cycle = optuav.coverage("matrice350", perspective="battery")
    assert cycle.fleet(share=2.0).drones > cycle.fleet().drones


def steady_wind() -> None:
    """The keys of the wind are a force and a velocity; a flight model takes one of them or none."""
    assert sorted(table_keys("wind")) == ["force_N", "velocity_m_s"]
    blows = {"velocity_m_s": [6, 0, 0], "force_N": [5, 0, 0]}
    for name, known in (("relay-today", "velocity_m_s"), ("paper", "force_N"), ("matrice350", "")):
        mission = optuav.load(name)
        for key, wind in blows.items():
            if key == known:
                mission.replace({f"wind.{key}": wind})
            else:
                with pytest.raises(optuav.InputError):
                    mission.replace({f"wind.{key}": wind})


CHECKS: dict[str, Callable[[], None] | None] = {
    "Why does the optimal plan of the paper fall?": falls,
    "Which wells does my battery have?": wells,
    "Why does the drone fly 155 m/s?": no_drag,
    "Why does a stronger laser change nothing?": stronger_laser,
    "Why do the numbers differ from the paper's?": None,
    "Is the answer the best one, or only a good one?": None,
    "Do more stops help?": more_stops,
    "Why is there no plan?": None,
    "Do answers differ from run to run, or between computers?": None,
    "How long does it take?": None,
    "Can I use my own drone?": None,
    "Can a leg fly over or around a building?": buildings,
    "Can the plan change during the flight?": replanning,
    "Can an autopilot fly the plan?": exports,
    "What if a drone of a fleet fails?": failing_drone,
    "How do I add a second device?": second_device,
    "Does it account for wind and gusts?": steady_wind,
    "Which unit does a number have?": None,
    "Why do I see `Delta` instead of Δ?": None,
    "Why does Python say that `formulations` is hidden?": None,
    "May I use it in my course or product?": None,
}
"""What an answer says that a later version may make false; None if it names no limit."""


def test_every_answer_is_checked_or_names_no_limit() -> None:
    assert [*CHECKS] == [*ANSWERS]


@pytest.mark.parametrize("question", [each for each, check in CHECKS.items() if check])
def test_the_limit_that_an_answer_names_holds(question: str) -> None:
    check = CHECKS[question]
    assert check
    check()


def test_keys_and_commands_beside_limits_exist() -> None:
    """What the FAQ and the page on what is not modelled offer instead of an effect left out."""
    for page in ("faq.md", "not-modelled.md"):
        text = (DOCS / page).read_text("utf-8")
        for table, key in re.findall(r"`([a-z]+)\.([a-z]\w*_?\w*)(?: = |`)", text):
            known = {*optuav.Plan.model_fields} if table == "plan" else {*table_keys(table)}
            assert key in known, (page, table, key)

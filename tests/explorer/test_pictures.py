"""Pictures in place of the plane: the beam, power over speed, and the day."""

from __future__ import annotations

import json
import math
import threading
from collections.abc import Iterator
from itertools import pairwise
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest

pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

import optuav
from optuav.explorer.answers import answers
from optuav.explorer.pictures import lasting
from optuav.explorer.server import Server
from optuav.mission import Mission
from tests.explorer.test_design import APART, CROWDED, domains, rests, same

SHARE = 0.9 * 0.247 * 0.9  # Of the light on the receiver of `relay-today` that becomes DC power


@pytest.fixture(scope="module")
def relay() -> Mission:
    return optuav.load("relay-today")


def shown(mission: Mission, name: str, **state: Any) -> Any:
    """The data of a picture."""
    return answers(mission, {"picture": name, **state})["picture"]


def test_a_mission_has_the_pictures_of_its_models(relay: Mission) -> None:
    """And none is computed while the plane is seen."""
    answer = answers(relay, {})
    assert answer["pictures"] == ["beam", "speed", "day"]
    assert "picture" not in answer
    assert answers(optuav.load("paper"), {})["pictures"] == ["day"]
    (fault,) = answers(relay, {"picture": "sound"})["faults"]
    assert "'beam', 'speed' or 'day'" in fault["words"] or "beam" in fault["words"]


@pytest.mark.parametrize("name", [x for x in optuav.shipped() if not optuav.load(x).devices])
def test_every_shipped_mission_is_answered_in_json(name: str) -> None:
    """Also where no power of the laser reaches the cap of the current."""
    json.dumps(answers(optuav.load(name), {}), allow_nan=False)


@pytest.mark.parametrize("building", [None, "b3"])
def test_power_on_its_way_follows_the_keys(relay: Mission, building: str | None) -> None:
    """To the roof that is chosen, or where the plan rests; the aperture passes 1 − e⁻⁴."""
    answer = answers(relay, {"picture": "beam", "building": building})
    (roof,) = [stop["at"] for stop in answer["map"]["stops"] if stop["kind"] == "rest"]
    assert building in (None, roof)
    at = relay.buildings[relay.buildings.names.index(roof)].position_m
    distance_m = math.dist(at, relay.laser.position_m)
    picture = answer["picture"]
    assert picture["title"] == f"From the laser to {roof}, {distance_m:.4g} m"
    names, powers, before = zip(
        *((row["words"], row["power_W"], row["before_W"]) for row in picture["stations"]),
        strict=True,
    )
    assert names[0] == "source"
    assert powers[:3] == pytest.approx((5000.0, 2000.0, 2000.0 * (1.0 - math.exp(-4.0))))
    assert powers[5] / powers[4] == pytest.approx(SHARE)
    assert powers[6] <= powers[5]
    assert before == (powers[0], *powers[:-1])
    assert all(now <= earlier for now, earlier in zip(powers, before, strict=True))
    assert "60 % lost" in picture["stations"][1]["said"]


def test_power_over_speed_is_that_of_the_paper_of_rotary_wings(relay: Mission) -> None:
    """Zeng, Xu, Zhang 2019, eq (12), written anew; least power and least energy per metre."""
    picture = shown(relay, "speed")
    v = np.array(picture["speed_m_s"])

    def power_W(v: Any) -> Any:
        induced = np.sqrt(np.sqrt(1.0 + v**4 / (4.0 * 6.406**4)) - v**2 / (2.0 * 6.406**2))
        return 131.2 * (1.0 + 3.0 * v**2 / 110.0**2) + 633.2 * induced + 0.049 * v**3

    assert picture["power_W"] == pytest.approx(power_W(v), abs=0.06)
    fine = np.linspace(0.1, 23.0, 22_901)
    hover, endurance, distance = picture["marks"]
    assert hover["power_W"] == pytest.approx(power_W(0.0))
    assert endurance["speed_m_s"] == pytest.approx(fine[power_W(fine).argmin()], abs=0.01)
    assert distance["speed_m_s"] == pytest.approx(fine[(power_W(fine) / fine).argmin()], abs=0.01)
    assert distance["power_W"] == pytest.approx(power_W(distance["speed_m_s"]))


@pytest.mark.parametrize("perspective", ["available", "battery"])
def test_a_ring_covers_every_moment_once(perspective: str) -> None:
    """Of the drawn turns; and with a drone less there would be a gap."""
    picture = shown(optuav.load("matrice350"), "day", perspective=perspective)
    share = {"available": "25.4 %", "battery": "25.43 %"}[perspective]
    assert picture["title"] == f"One drone on b4 covers {share} of the day"
    turns, (end_h, *_) = picture["turns"], picture["axes"]
    assert len(turns) == picture["drones"] == 4
    hovers = sorted(
        (phase["start_h"], phase["end_h"])
        for phases in turns
        for phase in phases
        if phase["kind"] == "hover" and phase["start_h"] < end_h
    )
    for (_, before), (after, _) in pairwise(hovers):
        assert after == pytest.approx(before)
    (flown, hover, *_), ground = turns[0][:3], turns[0][3]
    lasts = sum(phase["end_h"] - phase["start_h"] for phase in (flown, hover, flown, ground))
    assert 3 < lasts / (hover["end_h"] - hover["start_h"]) <= 4


@pytest.mark.parametrize("state", [{}, {"building": "b3"}, {"perspective": "battery"}])
def test_the_day_tells_of_the_roof_on_the_map(state: dict[str, Any]) -> None:
    """Also where another roof would cover more; its share is that of the cycle that is told."""
    mission = optuav.load("paper")
    answer = answers(mission, {"picture": "day", **state})
    (roof,) = [stop["at"] for stop in answer["map"]["stops"] if stop["kind"] == "rest"]
    assert roof != optuav.coverage(mission).building
    picture = answer["picture"]
    flown, hover, _, rest, _ = picture["turns"][0][:5]
    share = (hover["end_h"] - hover["start_h"]) / (rest["end_h"] - flown["start_h"])
    assert picture["title"] == f"One drone on {roof} covers {100 * share:.2f} % of the day"
    assert f"drones leave no gap: {picture['drones'] - 1} places" in picture["notes"][0]
    drawn = {phase["kind"] for turn in picture["turns"] for phase in turn}
    assert drawn == {kind for kind, _ in picture["key"]}


@pytest.mark.parametrize(
    ("time_s", "words"), [(43.4, "43.4 s"), (608.0, "10.1 min"), (5800.0, "1.61 h")]
)
def test_durations_are_in_the_unit_that_a_person_says(time_s: float, words: str) -> None:
    assert lasting(time_s) == words


def test_pads_that_are_stronger_need_no_more_drones() -> None:
    """So many as the power says from which on that number suffices, by another way."""
    mission = optuav.load("matrice350")
    picture = shown(mission, "day", perspective="battery")
    counts = [pad["drones"] for pad in picture["pads"]]
    assert counts == sorted(counts, reverse=True)
    cycle = optuav.coverage(mission, perspective="battery")
    assert cycle.building == "b4"
    for pad in picture["pads"][-3:]:
        least_W = cycle.watts(pad["drones"]).power_W
        assert least_W <= pad["power_W"] * (1.0 + 1e-9)
        assert cycle.watts(pad["drones"] - 1).power_W > pad["power_W"]
    assert picture["pads"][-1]["power_W"] == pytest.approx(picture["most_W"])


def test_a_day_that_nobody_covers_says_why(relay: Mission) -> None:
    assert "available well" in shown(relay, "day", perspective="energy")["words"]
    dark = shown(relay, "day", changes={"laser.power_W": 10.0})
    assert "to a resting drone" in dark["words"]
    assert "laser.beam" in shown(optuav.load("paper"), "beam")["words"]


@pytest.fixture(scope="module")
def address(relay: Mission) -> Iterator[str]:
    with Server(relay) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield server.address
        server.shutdown()


def tab(page: Any, name: str) -> None:
    """Open a picture by its tab, and wait until it is drawn."""
    page.locator(".tabs:visible [role=tab]", has_text=name).click()
    rests(page)


def test_tabs_open_pictures_and_links_keep_them(open_page: Any) -> None:
    """Words keep apart, ten sliders fit beside them, and reset shows the plane again."""
    page = open_page()
    controls = "document.querySelector('.controls')"
    assert page.evaluate(f"{controls}.scrollHeight <= {controls}.clientHeight")
    plane = page.locator("figure.plane")
    for name, words in (
        ("Beam", ("on the receiver", "370.3 W")),
        ("Speed", ("best range: 17.9 m/s", "air speed, m/s")),
        ("Day", ("drone 4", "on station", "laser: 4", "4 drones leave no gap", "each pad")),
    ):
        tab(page, name)
        for word in words:
            assert word in plane.inner_text(), word
        assert page.evaluate(CROWDED) == []
        assert page.evaluate(APART) > 1
        selected = page.locator("figcaption [role=tab][aria-selected=true]")
        assert selected.all_text_contents() == [name]
    again = open_page(fragment=f"#{page.url.partition('#')[2]}")
    assert "on station" in again.locator("figure.plane").inner_text()
    again.get_by_role("button", name="Reset").click()
    rests(again)
    assert "rest time" in again.locator("figure.plane").inner_text()


def test_axes_of_pictures_stand_still_and_are_shared_with_a_pin(open_page: Any) -> None:
    page = open_page()
    for name, key in (("Beam", "laser.power_W"), ("Day", "battery.capacity_As")):
        tab(page, name)
        box = page.locator(f"input[type=range][data-key='{key}|null']").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(x, y)
        page.mouse.down()
        before = domains(page)
        drawn = page.locator("figure.plane svg").first.inner_html()
        page.mouse.move(x - 50, y)
        rests(page)
        assert same(domains(page), before), name
        assert page.locator("figure.plane svg").first.inner_html() != drawn
        page.mouse.up()
        rests(page)
    page.keyboard.press("p")
    page.locator("input[data-key='laser.power_W|null'][type=text]").fill("9000")
    rests(page)
    tab(page, "Beam")
    page.locator(".pinned figure.plane svg", has_text="receiver").wait_for()
    found = domains(page)
    assert found["plan nowpanel plane"] == found["plan pinnedpanel plane"]
    assert "9000" in page.locator(".now figure.plane").inner_text()


def test_on_a_phone_pictures_have_tabs_beside_the_others(open_page: Any) -> None:
    page = open_page(width=400, height=800)
    rests(page)
    for name in ("Beam", "Speed", "Day"):
        tab(page, name)
        picture = page.locator("figure:visible")
        assert picture.count() == 1
        assert picture.bounding_box()["height"] >= 300
        assert page.evaluate(CROWDED) == []
    for each in page.locator(".tabs:visible [role=tab]").all():
        assert each.bounding_box()["height"] >= 44
    tab(page, "Map")
    assert page.locator("figure.map").is_visible()


def test_a_lecture_shows_the_picture_of_its_link(open_page: Any) -> None:
    state = quote(json.dumps({"state": {"picture": "day"}, "pinned": None}))
    page = open_page(1920, "light", f"?lecture#{state}", 1080)
    rests(page)
    assert "on station" in page.locator("figure.plane").inner_text()
    assert page.evaluate(CROWDED) == []

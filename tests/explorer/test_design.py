"""The explorer as a lecturer projects it: one screen, still axes, words that are read, a sheet."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

import pytest

import optuav
from optuav.explorer.server import Server
from optuav.explorer.static import FOLDER
from optuav.looks import LOOKS
from tests.explorer.conftest import Open
from tests.several_devices import eight, three

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")

FALLS = {"perspective": "battery"}
PICTURES = ("map", "plane", "wells")
SCREENS = {
    "falls": FALLS,
    "flies": {},
    "by b3": {"building": "b3", "order": "rest-first"},
    "direct": {"problem": "P3"},
    "trip": {"problem": "P2"},
    "kink": {
        **FALLS,
        "building": "b1",
        "order": "hover-first",
        "changes": {"limits.deadline_s": 1081.16},
    },
}
SIZES = {
    "desktop": (1400, 900, "", None),
    "large": (1920, 1080, "", None),
    "pinned": (1400, 900, "", {}),
    "lecture": (1920, 1080, "?lecture", None),
    "site": (820, 640, "", None),
    "phone": (400, 800, "", None),
    "small lecture": (1280, 720, "?lecture", None),
    "old lecture": (1024, 768, "?lecture", None),
    "pinned lecture": (1920, 1080, "?lecture", {}),
    "pinned in the site": (820, 640, "", {}),
    "pinned phone": (400, 800, "", {}),
}
BOX = """(each) => {
  const {left, top, right, bottom, width, height} = each.getBoundingClientRect();
  return {left, top, right, bottom, width, height};
}"""
CROWDED = """() => {
  const found = [];
  for (const svg of document.querySelectorAll(".draw > svg[role=img]")) {
    const frame = svg.getBoundingClientRect();
    if (!frame.width) continue;
    const texts = [...svg.querySelectorAll("text")].filter((each) => each.textContent);
    const boxes = texts.map((each) => each.getBoundingClientRect());
    boxes.forEach((a, k) => {
      const words = texts[k].textContent;
      const cut = Math.max(frame.left - a.left, a.right - frame.right, a.bottom - frame.bottom);
      if (cut > 1 || frame.top - a.top > 4) found.push(`${words} is cut`);
      boxes.slice(k + 1).forEach((b, j) => {
        const across = Math.min(a.right, b.right) - Math.max(a.left, b.left);
        const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
        const least = 0.3 * Math.min(a.height, b.height);
        if (across > 2 && down > least) found.push(`${words} on ${texts[k + 1 + j].textContent}`);
      });
    });
  }
  return found;
}"""
CUT = """() => [...document.querySelectorAll(
    "figcaption > *, header p, .row label, .foot, .foot span")]
  .filter((each) => each.checkVisibility() && each.scrollWidth > each.clientWidth + 1
    && getComputedStyle(each).display !== "inline")
  .map((each) => each.textContent)"""
APART = """() => {
  const boxes = [...document.querySelectorAll("figure.map text")]
    .map((each) => each.getBoundingClientRect());
  return Math.min(...boxes.flatMap((a, k) => boxes.slice(k + 1).map((b) =>
    Math.max(a.left - b.right, b.left - a.right, a.top - b.bottom + 4, b.top - a.bottom + 4))));
}"""
COVERED = """() => {
  const found = [];
  for (const svg of document.querySelectorAll("figure.map svg[role=img]")) {
    const marks = [...svg.querySelectorAll("[aria-label=dot] :not([transform*=rotate])")]
      .map((each) => each.getBoundingClientRect());
    for (const text of svg.querySelectorAll("text")) {
      const {left, right, top, bottom, height} = text.getBoundingClientRect();
      const words = [left, top + 0.2 * height, right, bottom - 0.2 * height];
      for (const mark of marks) {
        const across = Math.min(words[2], mark.right) - Math.max(words[0], mark.left);
        const down = Math.min(words[3], mark.bottom) - Math.max(words[1], mark.top);
        if (Math.min(across, down) > 3) found.push(text.textContent);
      }
    }
  }
  return found;
}"""
PLACES = """() => Object.fromEntries([...document.querySelectorAll(
    ".optuav-explorer :is(input, select, button, .track)")]
  .filter((each) => each.checkVisibility() && !each.closest(".handles"))
  .map((each) => {
    const {left, top, right, bottom} = each.getBoundingClientRect();
    const name = each.ariaLabel ?? each.dataset.name ?? each.textContent.trim();
    const key = each.closest(".slider")?.querySelector("[data-key]").dataset.key;
    const group = key ?? each.closest(".plan")?.ariaLabel;
    return [`${each.tagName} ${name} of ${group}`, [left, top, right, bottom].map(Math.round)];
  }))"""
NAMES = """(select) => {
  const ruler = document.createElement("canvas").getContext("2d");
  ruler.font = getComputedStyle(select).font;
  const widths = [...select.options].map(({text}) => ruler.measureText(text).width);
  const {paddingLeft, paddingRight} = getComputedStyle(select);
  const room = select.clientWidth - parseFloat(paddingLeft) - parseFloat(paddingRight);
  return [room, Math.max(...widths)];
}"""
ON_ROUTE = """() => {
  const route = document.querySelector("figure.map [aria-label=line][stroke='var(--flight)'] path");
  const {e: x, f: y} = document.querySelector("figure.map .drone g").transform.baseVal[0].matrix;
  return route.isPointInStroke(new DOMPoint(x, y));
}"""
MOVE = """([option, deadline_s]) => {
  const tell = (selector, value, type) => {
    const input = document.querySelector(selector);
    input.value = value;
    input.dispatchEvent(new Event(type, {bubbles: true}));
  };
  tell("select[name=perspective]", option, "change");
  tell("[data-key='limits.deadline_s|null'][type=range]", deadline_s, "input");
}"""
COUNT = """addEventListener("DOMContentLoaded", () => {
  window.drawn = 0;
  const isPicture = (each) => each.matches?.(".draw > svg[role=img]");
  new MutationObserver((changes) => {
    for (const {addedNodes} of changes) window.drawn += [...addedNodes].filter(isPicture).length;
  }).observe(document.body, {childList: true, subtree: true});
});"""
FLOWN = """() => {
  const all = [...document.querySelectorAll("figure.map .drone g")];
  const playhead = document.querySelector(".playhead path").getBoundingClientRect();
  return [all.length, playhead.left, all.at(-1).getBoundingClientRect().top];
}"""
WORDS = """() => {
  const seen = [], walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const node = walker.currentNode, parent = node.parentElement;
    const apart = parent.closest("script, style, option, title");
    if (!node.data.trim() || !parent.checkVisibility() || apart) continue;
    const {width, height} = parent.getBoundingClientRect();
    if (!width || !height) continue;
    const style = getComputedStyle(parent), svg = parent.closest("svg");
    const under = (each) => getComputedStyle(each).backgroundColor;
    let ground = parent;
    while (under(ground) === "rgba(0, 0, 0, 0)") ground = ground.parentElement;
    seen.push({
      words: node.data.trim(), size: parseFloat(style.fontSize), ground: under(ground),
      colour: svg ? style.fill : style.color,
      onFill: Boolean(svg) && /--on-/.test(parent.getAttribute("fill")),
    });
  }
  return seen;
}"""


def fragment(state: Any, pinned: Any = None) -> str:
    """The part of an address that holds a state."""
    return f"#{quote(json.dumps({'state': state, 'pinned': pinned}))}"


def opened(open_page: Open, name: str, state: Any = None) -> Any:
    """The page at one of the sizes of the design, once it rests."""
    width, height, query, pinned = SIZES[name]
    place = query + fragment(FALLS if state is None else state, pinned)
    page = open_page(width, "light", place, height)
    rests(page)
    return page


def rests(page: Any) -> None:
    """Wait until nothing is asked, and the page has had time to draw."""
    playwright.expect(page.locator(".optuav-explorer.busy")).to_have_count(0)
    page.evaluate("() => new Promise((done) => requestAnimationFrame(() => setTimeout(done, 60)))")


def resized(page: Any, name: str) -> tuple[int, int]:
    """Width and height of one of the sizes, once an open page has it and rests."""
    width, height, *_ = SIZES[name]
    page.set_viewport_size({"width": width, "height": height})
    rests(page)
    return width, height


def boxes(page: Any, selector: str) -> list[dict[str, float]]:
    """The places of all visible elements of a selector."""
    found = [each.evaluate(BOX) for each in page.locator(selector).all() if each.is_visible()]
    return [each for each in found if each["width"]]


def domains(page: Any) -> dict[str, list[str]]:
    """The ends of both axes of all pictures that there are, by column and name."""
    read = """(all) => Object.fromEntries(all.map((each) =>
      [each.closest(".plan").className + each.closest("figure").className,
       [each.dataset.x, each.dataset.y]]))"""
    return dict(page.locator(".draw > svg[role=img]").evaluate_all(read))


def same(now: dict[str, list[str]], before: dict[str, list[str]]) -> bool:
    """Whether no axis has moved; without a plan there are fewer."""
    return now.items() <= before.items()


def luminance(colour: str) -> float:
    """Relative luminance of a colour as a browser writes it, WCAG 2.2."""
    shares = [float(each) / 255.0 for each in colour.strip("rgba()").split(",")[:3]]
    linear = [e / 12.92 if e <= 0.04045 else ((e + 0.055) / 1.055) ** 2.4 for e in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("state", SCREENS.values(), ids=SCREENS)
def test_all_is_on_one_screen(open_page: Open, state: Any) -> None:
    """Three pictures and what binds, above the fold; the page does not scroll, nor do controls."""
    page = opened(open_page, "desktop", state)
    for name in ("desktop", "large"):
        width, height = resized(page, name)
        seen = [box for each in (*PICTURES, "foot") for box in boxes(page, f".{each}")]
        assert len(seen) == 4, name
        for box in seen:
            assert 0 <= box["left"] < box["right"] <= width, name
            assert 0 <= box["top"] < box["bottom"] <= height, name
        assert all(box["height"] > 200 for box in seen[:3]), name
        for measured in ("document.documentElement", "document.querySelector('.controls')"):
            fits = page.evaluate(f"{measured}.scrollHeight <= {measured}.clientHeight")
            assert fits, (name, measured)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), name


@pytest.mark.parametrize("name", SIZES)
def test_no_words_overlap_or_are_cut(open_page: Open, name: str) -> None:
    """Nor do words of the map cover a mark."""
    page = opened(open_page, name)
    assert page.evaluate(CROWDED) == []
    assert page.evaluate(CUT) == []
    assert page.evaluate(COVERED) == []
    if name == "phone":
        for tab, words in (("Times", "deadline"), ("Charge", "✕ falls at 1095 s")):
            page.get_by_role("tab", name=tab).click()
            playwright.expect(page.locator("figure:visible svg[role=img]")).to_contain_text(words)
            assert page.evaluate(CROWDED) == []
    if name == "desktop":
        for state in ("available", "energy"):
            page.get_by_label("Judge by", exact=True).select_option(state)
            rests(page)
            assert page.evaluate(CROWDED) == []


@pytest.mark.parametrize("name", ["desktop", "lecture"])
def test_opening_draws_each_picture_once(browser: Any, address: str, name: str) -> None:
    width, height, query, _ = SIZES[name]
    page = browser.new_page(viewport={"width": width, "height": height})
    page.add_init_script(COUNT)
    page.goto(address + query)
    page.locator("figure svg[role=img]").first.wait_for()
    rests(page)
    assert page.evaluate("drawn") == len(PICTURES)
    page.close()


def test_nothing_lies_on_another_thing_in_the_bar_of_a_lecture(open_page: Open) -> None:
    """In small windows the bar breaks into lines, and stays on the screen."""
    page = opened(open_page, "small lecture")
    for name in ("small lecture", "old lecture"):
        width, height = resized(page, name)
        bar = boxes(page, ".presets button, .chosen > *")
        assert len(bar) == 7, name
        for number, one in enumerate(bar):
            assert 0 <= one["left"] < one["right"] <= width, name
            assert 0 <= one["top"] < one["bottom"] <= height, name
            for other in bar[number + 1 :]:
                across = min(one["right"], other["right"]) - max(one["left"], other["left"])
                down = min(one["bottom"], other["bottom"]) - max(one["top"], other["top"])
                assert min(across, down) <= 1, name


def test_words_of_all_presets_are_whole_in_a_lecture(open_page: Open) -> None:
    """In the pictures, their captions and the header, and nothing points to what is hidden."""
    page = open_page(1920, "light", "?lecture", 1080)
    for key in "12345":
        page.keyboard.press(key)
        chosen = page.locator(f".presets [data-digit='{key}']")
        playwright.expect(chosen).to_have_attribute("aria-pressed", "true")
        for name in ("small lecture", "lecture"):
            resized(page, name)
            assert page.evaluate(CROWDED) == [], (key, name)
            assert page.evaluate(CUT) == [], (key, name)
        assert "Details" not in page.locator("header .why").text_content()
    page.keyboard.press("4")
    playwright.expect(page.locator("header .why")).to_have_text(
        "No combination of rest and hover times meets every limit."
    )
    page.keyboard.press("Escape")
    playwright.expect(page.locator("header .why")).to_contain_text("Details show")


def test_a_phone_has_no_lecture(open_page: Open) -> None:
    page = open_page(400, "light", "?lecture", 800)
    rests(page)
    assert page.locator(".optuav-explorer.lecture").count() == 0
    assert page.locator(".controls").is_visible()


def test_a_mission_whose_places_lie_at_the_edge(browser: Any) -> None:
    """Words are whole where the destination lies at the right; keys of presets do not shift."""
    with Server(optuav.load("matrice350")) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        page = browser.new_page()
        for name in ("phone", "site", "lecture"):
            width, height, query, _ = SIZES[name]
            page.set_viewport_size({"width": width, "height": height})
            page.goto(server.address + query)
            page.locator("figure svg[role=img]").first.wait_for()
            rests(page)
            assert page.evaluate(CROWDED) == [], name
            words = page.locator("figure.map text").all_text_contents()
            assert not [each for each in words if each.startswith("-")]  # A minus sign is no hyphen
            assert page.evaluate(APART) > 1, name
        presets = page.locator(".presets button").all_text_contents()
        assert "4 Too small a battery" in presets
        assert not any("falls" in each for each in presets)
        page.close()
        server.shutdown()


@pytest.mark.parametrize("make", [three, eight])
def test_devices_are_named_apart(browser: Any, make: Callable[[], optuav.Mission]) -> None:
    """No word lies on another, on a phone and in a lecture; each device has its name."""
    mission = make()
    with Server(mission) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        page = browser.new_page()
        for name in ("phone", "lecture"):
            width, height, query, _ = SIZES[name]
            page.set_viewport_size({"width": width, "height": height})
            page.goto(server.address + query)
            page.locator("figure svg[role=img]").first.wait_for()
            rests(page)
            assert page.evaluate(CROWDED) == [], name
            words = page.locator("figure.map text").all_text_contents()
            for device in mission.devices:
                assert any(device.name in each for each in words), (name, device.name)
        page.close()
        server.shutdown()


def test_pinned_columns_share_rows_and_axes(open_page: Open) -> None:
    """Also once the deadline has made one of the planes smaller."""
    page = opened(open_page, "pinned")
    for deadline in ("1200", "500"):
        page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill(deadline)
        rests(page)
        page.wait_for_function(
            "() => { const [a, , , , b] = document.querySelectorAll('.draw > svg[role=img]');"
            "return a && b && [...document.querySelectorAll('figure.plane svg[role=img]')]"
            ".every(({dataset}, _, all) => dataset.y === all[0].dataset.y); }"
        )
        for each in PICTURES:
            one, other = boxes(page, f"figure.{each}")
            assert (one["top"], one["height"]) == (other["top"], other["height"])
            assert one["width"] == pytest.approx(other["width"], abs=1)
            drawn, beside = boxes(page, f"figure.{each} svg[role=img]")
            assert (drawn["top"], drawn["height"]) == (beside["top"], beside["height"])
        found = domains(page)
        for each in PICTURES:
            assert found[f"plan nowpanel {each}"] == found[f"plan pinnedpanel {each}"]


def test_no_axis_moves_on_a_drag(open_page: Open) -> None:
    """Of any control, while it is dragged; and of none at all once the axes are locked."""
    page = opened(open_page, "desktop")
    for number in range(page.locator(".controls input[type=range]").count()):
        box = page.locator(".controls input[type=range]").nth(number).evaluate(BOX)
        x, y = (box["left"] + box["right"]) / 2, (box["top"] + box["bottom"]) / 2
        page.mouse.move(x, y)
        page.mouse.down()
        before = domains(page)
        page.mouse.move(x + (-60, 40)[number % 2], y)
        rests(page)
        assert same(domains(page), before), number
        page.mouse.up()
        page.get_by_role("button", name="Reset").click()
        rests(page)
    for key in ("link.device_m", "laser.position_m", "buildings.b1.position_m"):
        box = page.locator(f"circle[data-key='{key}']").evaluate(BOX)
        x, y = (box["left"] + box["right"]) / 2, (box["top"] + box["bottom"]) / 2
        page.mouse.move(x, y)
        page.mouse.down()
        before = domains(page)
        page.mouse.move(x + 40, y - 30, steps=2)
        rests(page)
        assert same(domains(page), before), key
        page.mouse.up()
        rests(page)
    assert page.get_by_label("device, x [m]").input_value() != "1000"  # Places follow a drag
    page.get_by_role("button", name="Reset").click()
    rests(page)
    page.keyboard.press("a")
    before = domains(page)
    field = page.locator("input[data-key='limits.deadline_s|null'][type=text]")
    field.fill("220")
    rests(page)
    assert same(domains(page), before)
    page.get_by_role("button", name="Lock axes").click()
    rests(page)
    assert not same(domains(page), before)


@pytest.mark.parametrize("name", ["desktop", "site", "phone", "lecture", "pinned"])
def test_no_control_moves_under_the_pointer(open_page: Open, name: str) -> None:
    """Whatever words come and go while a slider is dragged to its end; on a desktop, any slider."""
    page = opened(open_page, name, {})
    if name == "site":
        page.get_by_role("button", name="Controls").click()
        rests(page)
    told = set[str]()
    sliders = page.locator("input[type=range]:visible")
    every = range(sliders.count())
    for number in every if name == "desktop" else {every[0], every[-1]}:
        sliders.nth(number).scroll_into_view_if_needed()
        told.update(page.locator(".slider .note:visible").all_text_contents())
        before = page.evaluate(PLACES)
        box = sliders.nth(number).evaluate(BOX)
        y = (box["top"] + box["bottom"]) / 2
        share = float(sliders.nth(number).evaluate("(e) => (e.value - e.min) / (e.max - e.min)"))
        page.mouse.move(box["left"] + 8 + share * (box["right"] - box["left"] - 16), y)
        page.mouse.down()
        end = 0.98 if share < 0.2 else 0.04
        page.mouse.move(box["left"] + end * (box["right"] - box["left"]), y)
        rests(page)
        told.update(page.locator(".slider .note:visible").all_text_contents())
        after = page.evaluate(PLACES)
        assert {key: at for key, at in after.items() if at != before.get(key, at)} == {}, number
        assert len({*before} - {*after}) <= 2  # What cannot be flown has no button to fly it
        page.mouse.up()
        page.locator("[data-name=reset]").evaluate("(reset) => reset.click()")
        rests(page)
        if name == "pinned":
            page.keyboard.press("p")
            rests(page)
    assert len(told) > 1  # Words came and went


def test_the_first_control_changes_something(open_page: Open) -> None:
    """In all states to start from; those that change nothing stand last, and stay on a drag."""
    page = opened(open_page, "desktop", {})
    keys = "(all) => all.map((each) => each.querySelector('[type=range]').dataset.key)"
    sliders = page.locator(".controls .slider")
    for _ in range(page.locator("[aria-label='Start from'] option").count() - 1):
        idle = sliders.evaluate_all("(all) => all.map((e) => e.classList.contains('idle'))")
        assert not idle[0]
        assert idle == sorted(idle)
        page.get_by_role("button", name="next").click()
        rests(page)
    order = sliders.evaluate_all(keys)
    for _ in range(4):
        page.locator("[data-key='limits.deadline_s|null'][type=range]").press("PageDown")
    rests(page)
    deadline = page.locator(".slider", has_text="Deadline")
    playwright.expect(deadline.locator(".note")).to_have_text("")  # It changes something now
    assert sliders.evaluate_all(keys) == order
    page.get_by_role("button", name="Reset").click()
    rests(page)
    page.keyboard.press("l")
    rests(page)
    assert page.locator(".chosen .slider").first.get_attribute("class") == "slider"


def test_names_of_what_to_start_from_are_whole(open_page: Open) -> None:
    page = opened(open_page, "desktop", {})
    for name in ("desktop", "phone"):
        resized(page, name)
        if name == "phone":
            page.get_by_role("tab", name="Start").click()
        room, widest = page.locator("[aria-label='Start from']").evaluate(NAMES)
        assert widest <= room - 20, name  # The arrow of the list


def test_symbols_are_mathematics(open_page: Open) -> None:
    """With indices below, in labels, pictures and tables; no underscore is left."""
    page = opened(open_page, "desktop", {})
    page.keyboard.press("s")
    rests(page)
    label = page.locator(".slider label", has_text="Deadline").locator(".sym")
    assert label.inner_html() == "T<sub>max</sub>"
    page.get_by_role("button", name="Details").click()
    for words in page.locator(".sym, .tables summary, .tables sub").all_text_contents():
        assert "_" not in words
    limits = page.locator(".tables td", has_text="Δ + T' ≤")
    assert limits.first.inner_html() == "Δ + T' ≤ T<sub>max</sub> − T<sub>fl</sub>"
    curve = page.locator("figure.plane text", has_text="deadline").locator(".sym tspan")
    assert curve.all_text_contents() == ["Δ + T′ ≤ T", "max", " − T", "fl"]


def test_a_picture_that_is_cut_says_so(open_page: Open) -> None:
    """With an arrow and the value, where axes stand still: charge, end, optimum and places."""
    page = opened(open_page, "desktop", {})
    page.keyboard.press("a")
    assert page.locator(".beyond").count() == 0
    for key, value in (("battery.capacity_As", "20"), ("limits.deadline_s", "2400")):
        page.locator(f"input[data-key='{key}|null'][type=text]").fill(value)
        rests(page)
    hover_s = optuav.solve(
        optuav.load("paper").replace({"battery.capacity_As": 72e3, "limits.deadline_s": 2400.0})
    ).hover_time_s
    told = ("wells", "up to 40 Ah"), ("wells", "until "), ("plane", f"{hover_s:.2f}")
    for figure, words in told:
        assert page.locator(f"figure.{figure} .beyond").count()
        playwright.expect(page.locator(f"figure.{figure} svg").first).to_contain_text(words)
    assert page.locator("figure.plane .optimum").count() == 0
    page.get_by_label("device, x [m]", exact=True).fill("9000")
    rests(page)
    assert page.locator("figure.map .beyond").count() == 2  # Device and hover point
    assert page.evaluate(CROWDED) == []


def test_without_a_plan_the_flight_is_drawn(open_page: Open) -> None:
    """On the map and over time, until the well is empty; and it is flown and falls."""
    page = opened(open_page, "desktop", {"changes": {"battery.capacity_As": 1800}})
    playwright.expect(page.locator("header .verdict")).to_contain_text("no plan")
    wells = page.locator("figure.wells")
    playwright.expect(wells).to_contain_text("on the shortest flight, without a stay")
    playwright.expect(wells.locator("svg")).to_contain_text("✕ falls at 28 s")
    assert page.locator("figure.map [aria-label=line][stroke='var(--flight)'] path").count() == 1
    page.get_by_role("button", name="Fly it").click()
    playwright.expect(page.locator("figure.map .drone")).to_contain_text("falls at 28 s")
    assert page.evaluate(CROWDED) == []


def test_the_day_is_read_on_a_phone(open_page: Open) -> None:
    """Its axes have numbers, its words keep apart, and it says of which roof it tells."""
    page = open_page(400, "light", fragment({"picture": "day"}), 800)
    page.get_by_role("tab", name="Day").click()
    rests(page)
    assert page.evaluate(CROWDED) == []
    playwright.expect(page.locator("figure.plane")).to_contain_text(
        "One drone on b10 covers 9.45 %"
    )
    ticks = page.locator("figure.plane [aria-label='x-axis tick label'] text").all_text_contents()
    assert {"0", "50", "100"} <= {*ticks}


@pytest.mark.parametrize("name", ["desktop", "lecture", "site", "phone"])
def test_pictures_keep_their_place_while_words_change(open_page: Open, name: str) -> None:
    """From a plan that falls to one that flies, and to a control that changes nothing."""
    page = opened(open_page, name)
    still = "figure, .stage input[type=range]"
    before = boxes(page, still)
    for option, deadline_s, says in (("battery", 600, "flies"), ("available", 1400, "b10")):
        page.evaluate(MOVE, [option, deadline_s])
        playwright.expect(page.locator("header")).to_contain_text(says)
        rests(page)
        after = zip(boxes(page, still), before, strict=True)
        assert all(now == pytest.approx(box, abs=2) for now, box in after)


def test_the_drone_stands_at_its_destination_once_it_has_landed(open_page: Open) -> None:
    page = opened(open_page, "desktop", {})
    page.get_by_role("button", name="Fly it").click()
    page.locator("figure.map .drone g").wait_for()
    assert page.evaluate(ON_ROUTE)


def test_the_trail_holds_six_optima_and_is_cleared(open_page: Open) -> None:
    """Fading, the oldest most; reset clears it, and the pin."""
    page = opened(open_page, "desktop")
    page.keyboard.press("a")  # A slow machine would let the control go, and the axes change
    slider = page.locator("input[type=range][data-key='battery.capacity_As|null']")
    for _ in range(9):
        slider.press("Shift+ArrowLeft")
        rests(page)
    dots = page.locator("figure.plane .trail circle")
    assert dots.count() == 6
    strength = [
        float(each) for each in dots.evaluate_all("(a) => a.map((e) => e.getAttribute('opacity'))")
    ]
    assert strength == sorted(strength)
    assert strength[0] == 0.25
    page.keyboard.press("p")
    playwright.expect(page.locator(".plan.pinned")).to_have_count(1)
    page.get_by_role("button", name="Reset").click()
    rests(page)
    assert (dots.count(), page.locator(".plan.pinned").count()) == (0, 0)


def test_a_trail_is_of_one_control_alone(open_page: Open) -> None:
    """It says where that control was; another one begins anew, where the plan was before."""
    page = opened(open_page, "large")
    page.keyboard.press("a")
    words = page.locator("figure.plane text", has_text="trail: from")
    dots = page.locator("figure.plane .trail circle")
    for name, start in (("battery.capacity_As|null", "10 Ah"), ("limits.min_soc|null", "5 %")):
        slider = page.locator(f"input[type=range][data-key='{name}']")
        for count in (1, 2, 3):
            slider.press("PageUp" if "soc" in name else "PageDown")
            playwright.expect(dots).to_have_count(count)
        playwright.expect(words).to_have_text(f"trail: from {start}")


def test_the_drone_flies_its_route_and_falls(browser: Any, address: str) -> None:
    """In steps of time: it moves on the route first, and where the well is empty it falls."""
    page = browser.new_page(viewport={"width": 1400, "height": 900})
    page.clock.install()
    page.goto(address + fragment(FALLS))
    page.locator("figure.map svg[role=img]").wait_for()
    page.get_by_role("button", name="Fly it").click()
    seen = []
    for second in range(9):
        page.clock.run_for(1000)
        count, *places = page.evaluate(FLOWN)
        assert count == 1 or second > 5
        seen.append(places)
    (plan,) = boxes(page, "figure.wells .draw")
    moments = [moment for moment, _ in seen]
    assert moments == sorted(moments)
    assert plan["left"] < moments[0] < moments[3] < moments[-1] < plan["right"]
    assert seen[5][1] < seen[0][1]  # North of the roof where it rests, at the hover point
    assert seen[-1][1] > seen[5][1] + 40  # Below it
    playwright.expect(page.locator("figure.map .drone")).to_contain_text("falls at 1095 s")
    page.close()


def test_the_drone_follows_a_way_that_bends(browser: Any) -> None:
    """Around a wall that the straight leg would meet: it stays on the line of the route."""
    changes = {
        "flight.obstacles": "around",
        "flight.max_altitude_m": 100,
        "buildings.b5.footprint_m": [600.0, 20.0],
        "buildings.b5.position_m": [600, 1250, 98],
    }
    mission = optuav.load("paper").replace(changes)
    (by_m, *_) = optuav.solve(mission, "P3").waypoints_m
    assert max(abs(x_m - 0.4 * y_m) for x_m, y_m, _ in by_m) > 100.0  # Beside the straight leg
    with Server(mission) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.clock.install()
        page.goto(server.address + fragment({"problem": "P3"}))
        page.locator("figure.map svg[role=img]").wait_for()
        page.get_by_role("button", name="Fly it").click()
        for _ in range(6):
            page.clock.run_for(100)
            assert page.evaluate(ON_ROUTE)
        page.close()
        server.shutdown()


def test_a_control_that_changes_nothing_says_why_beside_it(open_page: Open) -> None:
    page = opened(open_page, "desktop")
    laser = page.locator(".slider", has_text="Laser power")
    words = "No effect above 790 W: the charging current is capped at 10 A"
    playwright.expect(laser.locator(".note")).to_have_text(words)
    assert laser.locator(".inert").evaluate("(each) => each.getBoundingClientRect().width") > 100
    page.get_by_label("Route", exact=True).select_option("direct")
    rests(page)
    order = page.locator(".choice[data-name=order]")
    playwright.expect(order.locator(".note")).to_have_text("there is no rest")


def test_the_header_says_verdict_and_reason(open_page: Open) -> None:
    """Of plans that fall, fly, overfill, and of none; with sign and word, not by colour alone."""
    page = opened(open_page, "desktop")
    verdict, why = page.locator("header .verdict"), page.locator("header .why")
    judge = page.get_by_label("Judge by", exact=True)
    for perspective, words, binds in (
        ("battery", "✕ falls at 1095 s: the available well is empty", "Charge and deadline bind."),
        ("available", "597.27 s of hover; ✓ flies", "The available well binds, the deadline does"),
        ("energy", "✕ overfills at 157 s: the available well is full", "Charge and deadline bind."),
    ):
        judge.select_option(perspective)
        playwright.expect(verdict).to_contain_text(words)
        playwright.expect(why).to_contain_text(binds)
    page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill("60")
    playwright.expect(verdict).to_have_text("✕ no plan: the deadline is shorter than the flight")
    violated = page.locator("figure.plane text").filter(has_text="violated everywhere")
    playwright.expect(violated).to_have_count(1)


def test_a_lecture_is_large_and_has_the_chosen_controls_alone(open_page: Open) -> None:
    """No text below 20 px; presets by keys; the drone falls at the moment the well is empty."""
    page = opened(open_page, "lecture")
    small = [e["words"] for e in page.evaluate(WORDS) if e["size"] < 20]
    assert small == []
    assert not page.locator(".controls").is_visible()
    assert page.locator(".stage input[type=range]").count() == 1
    page.keyboard.press(" ")
    drone = page.locator("figure.map .drone")
    playwright.expect(drone).to_contain_text("falls at 1095 s")
    assert drone.locator("g").last.get_attribute("stroke") == "var(--dry)"
    page.keyboard.press("1")
    playwright.expect(page.locator(".playhead, .drone")).to_have_count(0)
    page.keyboard.press(" ")
    playwright.expect(page.locator(".playhead")).to_have_count(1)
    page.locator(".segments button", has_text="the available well").click()
    playwright.expect(page.locator("header .verdict")).to_contain_text("✓ flies")
    playwright.expect(page.locator(".playhead, .drone")).to_have_count(0)  # Another plan
    for key, words in (("2", "674.93 s"), ("3", "✓ flies"), ("4", "no plan"), ("5", "✕ falls")):
        page.keyboard.press(key)
        playwright.expect(page.locator("header .verdict")).to_contain_text(words)
        assert page.locator(".presets [aria-pressed=true]").count() == 1
    page.keyboard.press("Escape")
    assert page.locator(".controls").is_visible()
    assert page.locator(".controls .slider").count() == 7


def test_a_link_chooses_the_controls_of_a_lecture(open_page: Open) -> None:
    page = open_page(1920, "light", "?lecture=order,laser.power_W#", 1080)
    rests(page)
    assert page.locator(".stage .choice[data-name=order]").count() == 1
    assert (
        page.locator(".stage input[type=range]").get_attribute("data-key") == "laser.power_W|null"
    )


def test_space_flies_after_a_choice_in_a_lecture(open_page: Open) -> None:
    """Whether the choice is a row of buttons or a menu, which keeps the focus."""
    page = open_page(1400, "light", "?lecture=perspective,limits.deadline_s,problem", 900)
    drone = page.locator("figure.map .drone")
    page.locator(".chosen .segments button", has_text="charge at the end").click()
    playwright.expect(page.locator("header .verdict")).to_contain_text("✕ falls")
    page.keyboard.press(" ")
    playwright.expect(drone).to_contain_text("falls at 1095 s")
    page.locator(".chosen .choice[data-name=problem] select").select_option("P3")
    playwright.expect(page.locator("header .verdict")).to_contain_text("688.85 s")
    page.locator(".chosen .choice[data-name=problem] select").focus()
    page.keyboard.press(" ")
    playwright.expect(drone).to_contain_text("falls at 660 s")


def test_a_slider_of_a_lecture_keeps_the_focus(open_page: Open) -> None:
    """A second step of the arrows needs it."""
    page = open_page(1400, "light", "?lecture", 900)
    slider = page.locator(".chosen input[type=range]").first
    start = float(slider.input_value())
    slider.focus()
    page.keyboard.press("ArrowLeft")
    rests(page)
    page.keyboard.press("ArrowLeft")
    rests(page)
    page.keyboard.press("Shift+ArrowLeft")
    rests(page)
    step = float(slider.get_attribute("step"))
    assert float(slider.input_value()) == start - 12 * step  # With Shift ten steps
    assert json.loads(unquote(page.url.partition("#")[2]))["state"]["changes"] == {
        slider.get_attribute("data-key").partition("|")[0]: start - 12 * step
    }


def test_in_a_page_of_the_site_the_controls_are_a_sheet(open_page: Open) -> None:
    """And the pictures stay whole above it."""
    page = opened(open_page, "site")
    assert not page.locator(".controls").is_visible()
    page.get_by_role("button", name="Controls").click()
    rests(page)
    (sheet,) = boxes(page, ".controls")
    shown = [box for each in PICTURES for box in boxes(page, f"figure.{each}")]
    assert len(shown) == 3
    assert all(box["bottom"] <= sheet["top"] + 1 and box["height"] > 80 for box in shown)
    assert sheet["bottom"] <= 641
    page.keyboard.press("Escape")
    assert not page.locator(".controls").is_visible()
    assert not page.get_by_text("Share").is_visible()
    page.locator(".more").click()
    page.get_by_text("Share").click()
    assert page.get_by_role("button", name="Picture (SVG)").is_visible()


def test_on_a_phone_the_picture_stays_beside_the_sheet(open_page: Open) -> None:
    """At least 300 px of it; what is touched has 44 px, and fields 16 px, so that nothing zooms."""
    page = opened(open_page, "phone")
    (picture,), (sheet,) = boxes(page, "figure"), boxes(page, ".controls")
    assert picture["height"] >= 300
    assert picture["bottom"] <= sheet["top"] + 1
    page.get_by_label("Height of the controls").click()
    (lower,) = boxes(page, ".controls")
    assert lower["height"] == 96
    assert len(boxes(page, ".controls input[type=range]")) == 1
    page.get_by_label("Height of the controls").click(click_count=2, delay=20)
    page.locator(".more").click()
    page.get_by_role("button", name="Details").click()
    playwright.expect(page.locator(".tables")).to_contain_text("charge left")
    page.evaluate("scrollTo(0, 0)")
    page.locator(".more").click()
    for tab in ("Start", "Question", "Mission", "Places"):
        page.get_by_role("tab", name=tab).click()
        rests(page)
        for box in boxes(page, "button, select, input:not([type=checkbox])"):
            assert box["height"] >= 44, (tab, box)
        read = "(all) => all.map((each) => parseFloat(getComputedStyle(each).fontSize))"
        assert min(page.locator("select, input[type=text]").evaluate_all(read)) >= 16
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_all_words_are_read_on_their_ground(open_page: Open) -> None:
    """By computation: 4.5 to 1 in both themes, in pictures too; on fills the table is tested."""
    page = opened(open_page, "pinned")
    page.get_by_role("button", name="Details").click()
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        rests(page)
        ground = luminance(
            page.evaluate("getComputedStyle(document.body.parentElement).backgroundColor")
        )
        assert (ground > 0.5) == (scheme == "light")
        for each in page.evaluate(WORDS):
            if each["onFill"]:
                continue
            low, high = sorted(luminance(each[name]) + 0.05 for name in ("colour", "ground"))
            assert high / low >= 4.5, (scheme, each)


def test_pictures_take_their_colours_from_the_table(open_page: Open) -> None:
    """One colour and one line for charge and deadline, in the plane, the wells and what binds."""
    page = opened(open_page, "desktop")
    for role in ("charge", "deadline"):
        dash = " ".join(f"{each:g}" for each in LOOKS[role].dash)
        for place in ("figure.plane", "figure.wells", ".foot"):
            lines = page.locator(f"{place} [stroke='var(--{role})']")
            assert lines.count(), (role, place)
            read = "(each) => (each.getAttribute('stroke-dasharray') || '').replaceAll(',', ' ')"
            assert lines.first.evaluate(read) == dash


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.js")), ids=lambda path: path.stem)
def test_the_script_is_read_without_scrolling_sideways(path: Path) -> None:
    """Lines of at most 110 characters."""
    assert max(map(len, path.read_text("utf-8").splitlines())) <= 110

"""The explorer's page in a headless Chromium, driven as a reader would drive it."""

from __future__ import annotations

import json
import re
import threading
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any
from urllib.parse import quote, unquote

import pytest

import optuav
from optuav.explorer.answers import answers
from optuav.explorer.server import Server
from optuav.explorer.static import script, style
from tests.explorer.conftest import EVIL, Open
from tests.several_devices import THREE, three

playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
KEPT = "Charge left"


def says(page: Any, words: str | re.Pattern[str]) -> None:
    """Wait until the verdict is as it should be."""
    playwright.expect(page.locator("header .verdict")).to_contain_text(words)


def state(page: Any) -> Any:
    """The state in the address, once it has been answered."""
    playwright.expect(page.locator(".optuav-explorer.busy")).to_have_count(0)
    return json.loads(unquote(page.url.partition("#")[2]))


def test_every_slider_moves_its_key_and_the_plan(open_page: Open) -> None:
    """By the keyboard, as a reader without a mouse does; and reset takes all back."""
    page = open_page()
    says(page, "597.27 s of hover; ✓ flies")
    sliders = page.locator("input[type=range]")
    seen = set()
    for number in range(sliders.count()):
        slider = sliders.nth(number)
        before = page.locator("header .verdict").text_content()
        key, _, axis = slider.get_attribute("data-key").partition("|")
        for _ in range(2):
            slider.press("PageDown" if key == "battery.capacity_As" else "PageUp")
        value = float(slider.input_value())
        field = page.locator(f"input[type=text][data-key='{key}|{axis}']")
        scale = {"limits.min_soc": 0.01, "battery.capacity_As": 3600.0}.get(key, 1.0)
        shown = field.input_value().replace("\N{THIN SPACE}", "")
        assert float(shown) == pytest.approx(value / scale)
        stated = state(page)["state"]["changes"][key]
        assert (stated if axis == "null" else stated[int(axis)]) == value
        if key in ("battery.capacity_As", "battery.charge_current_A", "wind.force_N"):
            playwright.expect(page.locator("header .verdict")).not_to_have_text(before)
        seen.add(key)
    assert len(seen) == 6
    page.get_by_role("button", name="Reset").click()
    says(page, "597.27 s of hover")
    assert state(page)["state"] == {"changes": {}}


def test_the_question_is_chosen(open_page: Open) -> None:
    """Known answers by perspective, trajectory, building and problem; none contradicts another."""
    page = open_page()
    for name, value, words in (
        ("Judge by", "battery", "719.54 s of hover promised; ✕ falls"),
        ("Route", "direct", "688.85 s of hover"),
        ("Route", "optimal", "719.54 s of hover"),
        ("Rest on", "b1", "719.54 s of hover"),
        ("Order", "rest-first", "719.54 s of hover"),
        ("Rest on", "", "719.54 s of hover"),
        ("Find", "P3", "688.85 s of hover"),
        ("Judge by", "available", "577.52 s of hover"),
        ("Find", "P2", "75.79 s of travel; ✓ flies"),
    ):
        page.get_by_label(name, exact=True).select_option(value)
        says(page, words)
        assert page.locator(".faults li").count() == 0


def test_points_are_dragged_and_moved_by_keys(open_page: Open) -> None:
    """The map, the state and the label of the point follow; the focus stays where it is."""
    page = open_page()
    for key, name in (
        ("link.device_m", "device"),
        ("laser.position_m", "laser"),
        ("buildings.b10.position_m", "roof of b10"),
    ):
        point = page.locator(f"circle[data-key='{key}']")
        point.scroll_into_view_if_needed()
        box = point.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        before = point.get_attribute("aria-label")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 10, y + 12)
        page.mouse.move(x - 25, y + 30, steps=2)
        page.mouse.up()
        playwright.expect(point).not_to_have_attribute("aria-label", before)
        at = state(page)["state"]["changes"][key]
        label = f"{name} at x {at[0]} m, y {at[1]} m"
        playwright.expect(point).to_have_attribute("aria-label", re.compile(label))
        page.keyboard.press("ArrowUp")
        page.keyboard.press("Shift+ArrowRight")
        moved = [at[0] + 100, at[1] + 10]
        label = f"{name} at x {moved[0]} m, y {moved[1]} m"
        playwright.expect(point).to_have_attribute("aria-label", re.compile(label))
        assert state(page)["state"]["changes"][key][:2] == moved
        assert page.evaluate("document.activeElement.dataset.key") == key
        plan = optuav.solve(optuav.load("paper").replace(state(page)["state"]["changes"]))
        says(page, f"{plan.hover_time_s:.2f} s of hover" if plan else "no plan")


def test_each_of_several_devices_has_a_handle(browser: Any) -> None:
    """Moving one by keys changes that one; its row of numbers and the hover follow."""
    errors = list[str]()
    with Server(three()) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        page = browser.new_page(viewport={"width": 1400, "height": 900})
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(server.address)
        says(page, "647.33 s of hover; ✓ flies")
        for name, (x, y, _) in THREE.items():
            point = page.locator(f"circle[data-key='devices.{name}.position_m']")
            label = re.compile(f"^{name} at x {x} m, y {y} m")
            playwright.expect(point).to_have_attribute("aria-label", label)
        point = page.locator("circle[data-key='devices.west.position_m']")
        point.focus()
        page.keyboard.press("Shift+ArrowRight")
        moved = three().replace({"devices.west.position_m": [500, 2600, 0]})
        says(page, f"{optuav.solve(moved).hover_time_s:.2f} s of hover")
        playwright.expect(page.get_by_label("west, x [m]", exact=True)).to_have_value("500")
        playwright.expect(page.get_by_label("north, x [m]", exact=True)).to_have_value("1000")
        page.close()
        server.shutdown()
    assert errors == []


def test_a_pinned_plan_stands_beside_and_a_link_has_both(open_page: Open) -> None:
    page = open_page()
    page.get_by_role("button", name="Pin to compare").click()
    page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill("900")
    says(page, "The pinned plan hovers 5.70 s more, and both land")
    playwright.expect(page.locator(".pinned .title")).to_contain_text("Pinned: 597.27 s, ✓ flies")
    again = open_page(fragment=f"#{page.url.partition('#')[2]}")
    says(again, "The pinned plan hovers 5.70 s more")
    playwright.expect(again.locator(".pinned .title")).to_contain_text("Pinned: 597.27 s, ✓ flies")
    assert (
        again.locator("input[data-key='limits.deadline_s|null'][type=text]").input_value() == "900"
    )
    again.get_by_label("Find", exact=True).select_option("P2")
    says(again, "The pinned plan hovers 597.27 s more")
    playwright.expect(again.locator(".now .title")).to_contain_text("Now: 75.79 s of travel, ✓")
    again.get_by_role("button", name="Unpin").click()
    playwright.expect(again.locator(".pinned")).to_have_count(0)


def test_a_bad_value_is_told_and_the_picture_stays(open_page: Open) -> None:
    page = open_page()
    drawn = page.locator("figure.map svg").first.inner_html()
    field = page.locator("input[data-key='limits.min_soc|null'][type=text]")
    field.fill("much")
    told = page.locator(".faults li")
    playwright.expect(told).to_have_text(
        f"{KEPT}: limits.min_soc = 'much': must be a number, 0 <= x < 1 [-]"
    )
    playwright.expect(field).to_have_attribute("aria-invalid", "true")
    assert page.locator("figure.map svg").first.inner_html() == drawn
    field.fill("10")
    playwright.expect(told).to_have_count(0)
    page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill("60")
    says(page, "no plan")
    page.get_by_role("button", name="Details").click()
    playwright.expect(page.locator(".tables")).to_contain_text("deadline ≥ 75.8 s")
    page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill("50")
    page.get_by_role("button", name="Which change would make a plan possible?").click()
    playwright.expect(page.locator(".tables")).to_contain_text("now 50 s")


def test_files_are_saved(open_page: Open, tmp_path: Path) -> None:
    """A mission and a plan that are read back, and pictures of all figures."""
    page = open_page()
    begins = {}
    for name in ("Mission (TOML)", "Plan (JSON)", "Picture (SVG)", "Picture (PNG)"):
        page.locator(".menu").evaluate("(menu) => { menu.open = true; }")
        with page.expect_download() as download:
            page.get_by_role("button", name=name).click()
        kind = Path(download.value.suggested_filename).suffix
        download.value.save_as(tmp_path / f"saved{kind}")
        begins[kind] = (tmp_path / f"saved{kind}").read_bytes()[:5]
    assert optuav.load(tmp_path / "saved.toml").name == f"{EVIL} paper"
    assert optuav.load_plan(tmp_path / "saved.json").hover_time_s == pytest.approx(597.27, abs=0.01)
    assert (begins[".svg"], begins[".png"]) == (b"<svg ", b"\x89PNG\r")
    picture = (tmp_path / "saved.svg").read_text("utf-8")
    assert picture.count("<svg") >= 4
    assert "var(" not in picture
    assert "597.27 s of hover" in picture


def test_names_stay_text(open_page: Open) -> None:
    """Whatever a mission calls itself or its buildings."""
    page = open_page()
    page.get_by_label("Rest on", exact=True).select_option(EVIL)
    says(page, "583.47 s of hover")
    playwright.expect(page.locator("header .route")).to_contain_text(EVIL)
    playwright.expect(page.locator("figure.map")).to_contain_text(EVIL[:20])
    assert page.locator("img").count() == 0
    assert page.title() == f"{EVIL} paper – optuav explore"


def told(page: Any, *words: str) -> None:
    """Wait until the faults contain words, one each."""
    playwright.expect(page.locator(".faults li")).to_contain_text([*words])


def fragment(**states: object) -> str:
    """States as an address has them."""
    return f"#{quote(json.dumps(states))}"


@pytest.mark.parametrize(
    ("stated", "words"),
    [
        ({"changes": {"limits.deadline_s": -1}}, "limits.deadline_s = -1"),
        ({"building": "zzz"}, "zzz"),
        ({"other": 1}, "other"),
        ({"changes": None}, "changes"),
    ],
)
def test_a_link_with_a_refused_state_opens_the_mission_itself(
    open_page: Open, stated: object, words: str
) -> None:
    """With the reason; and no page is dead."""
    page = open_page(fragment=fragment(state=stated))
    told(page, "so the mission is shown unchanged", words)
    says(page, "597.27 s of hover")
    page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill("900")
    says(page, "591.57 s of hover")
    playwright.expect(page.locator(".faults li")).to_have_count(0)
    assert state(page)["state"] == {"changes": {"limits.deadline_s": 900}}
    page.get_by_role("button", name="Reset").click()
    says(page, "597.27 s of hover")


@pytest.mark.parametrize("cut", ["#%7B%22state%22", "#%", "#%7B%22state%22:5%7D"])
def test_a_link_that_was_cut_says_so(open_page: Open, cut: str) -> None:
    """The mission is shown, but not as if the link had stated it."""
    page = open_page(fragment=cut)
    told(page, "The address cannot be read")
    says(page, "597.27 s of hover")


def test_a_link_with_a_refused_pin_opens_the_rest(open_page: Open) -> None:
    late = {"changes": {"limits.deadline_s": 900}}
    page = open_page(fragment=fragment(state=late, pinned={"building": "zzz"}))
    told(page, "The pinned plan in the address was ignored", "zzz")
    says(page, "591.57 s of hover")
    assert page.locator(".pinned").count() == 0
    page.locator("input[data-key='limits.deadline_s|null'][type=text]").fill("1200")
    says(page, "597.27 s of hover")
    assert state(page)["pinned"] is None


def test_refused_values_stay_out_of_the_address(open_page: Open) -> None:
    """A reload shows what was last seen; and a comma is told to be none."""
    page = open_page()
    field = page.locator("input[data-key='limits.deadline_s|null'][type=text]")
    field.fill("900")
    says(page, "591.57 s of hover")
    field.fill("900,5")
    told(page, "a decimal point is a point")
    assert state(page)["state"] == {"changes": {"limits.deadline_s": 900}}
    page.reload()
    says(page, "591.57 s of hover")


def test_a_slow_answer_is_told_and_given_up_for_a_newer_question(open_page: Open) -> None:
    """After a moment it stands beside the verdict; what is asked meanwhile does not wait for it."""
    page = open_page()
    page.evaluate(SLOW)
    field = page.locator("input[data-key='limits.deadline_s|null'][type=text]")
    field.fill("900")
    waits = page.locator(".waits[aria-live=polite]")
    playwright.expect(waits).to_contain_text("computing …")
    page.evaluate("window.slow = false")
    field.fill("800")
    says(page, "579.91 s of hover")
    assert page.evaluate("window.given_up")
    playwright.expect(waits).to_have_text("")


def test_places_are_set_by_numbers(open_page: Open) -> None:
    """Device and laser, and the roof that is chosen: without a mouse, in any town."""
    page = open_page()
    fields = page.locator("input[data-place]:visible")
    playwright.expect(fields).to_have_count(4)
    page.get_by_label("device, x [m]", exact=True).fill("1100")
    playwright.expect(page.locator("circle[data-key='link.device_m']")).to_have_attribute(
        "aria-label", re.compile("x 1100 m")
    )
    page.get_by_label("Rest on", exact=True).select_option("b3")
    page.get_by_label("roof of b3, y [m]", exact=True).fill("777")
    point = page.locator("circle[data-key='buildings.b3.position_m']")
    playwright.expect(point).to_have_attribute("aria-label", re.compile("y 777 m"))
    assert state(page)["state"]["changes"]["buildings.b3.position_m"][1] == 777
    page.get_by_label("device, x [m]", exact=True).fill("here")
    told(page, "link.device_m")
    playwright.expect(page.get_by_label("device, x [m]")).to_have_attribute("aria-invalid", "true")


def test_a_point_is_not_dragged_off_the_map(open_page: Open) -> None:
    page = open_page()
    point = page.locator("circle[data-key='laser.position_m']")
    point.scroll_into_view_if_needed()
    box = point.bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(5, 890, steps=2)
    page.mouse.up()
    assert state(page)["state"]["changes"]["laser.position_m"] != [1000, 0, 50]
    inside, frame = point.bounding_box(), page.locator("figure.map").bounding_box()
    for side, size in (("x", "width"), ("y", "height")):
        middle = inside[side] + inside[size] / 2
        assert frame[side] - 1 <= middle <= frame[side] + frame[size] + 1


def test_names_and_roles_are_told_apart(open_page: Open) -> None:
    """By assistive technology: pictures are pictures, sliders and fields differ."""
    page = open_page()
    assert page.locator("figure svg[role=img]").count() == 3
    assert page.locator("svg[role=group]").count() == 1
    names = page.locator("input:visible").evaluate_all("(all) => all.map((each) => each.ariaLabel)")
    assert len(set(names)) == len(names)
    assert "η2" in page.locator("option[value=energy]").get_attribute("title")


SLOW = """() => {
  const fetched = window.fetch;
  window.slow = true;
  window.fetch = (place, options) => !window.slow ? fetched(place, options) :
    new Promise((_, refuse) => options.signal.addEventListener("abort", () => {
      window.given_up = true;
      refuse(options.signal.reason);
    }));
}"""

NOTEBOOK = """async ({code, answer}) => {
  globalThis.d3 = "theirs";
  globalThis.define = () => { throw new Error("a library was handed to the notebook"); };
  globalThis.define.amd = {};
  const values = {answer, state: {}, pinned: null}, heard = [];
  const model = {
    get: (name) => values[name],
    set: (name, value) => { values[name] = value; },
    save_changes: () => heard.push(values.state),
    on: (_, listener) => { values.answered = listener; },
  };
  const place = URL.createObjectURL(new Blob([code], {type: "text/javascript"}));
  const {default: page} = await import(place);
  page.render({model, el: document.body.appendChild(document.createElement("div"))});
  const slider = document.querySelector("input[type=range]");
  slider.focus();
  const controls = answer.controls.map((each) => ({...each, value: each.value / 2}));
  values.answer = {...answer, controls};
  values.answered();
  document.querySelector("[data-name=pin]").click();
  return [globalThis.d3, typeof globalThis.Plot, heard.length, slider.value];
}"""


def test_a_touch_drags_a_point_through_its_answers(browser: Any, address: str) -> None:
    """An answer that is drawn meanwhile does not end the drag, and its end lets the axes go."""
    page = browser.new_page(viewport={"width": 1400, "height": 900}, has_touch=True)
    page.goto(address)
    point = page.locator("circle[data-key='link.device_m']")
    playwright.expect(point).to_be_visible()
    box = point.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    touches = page.context.new_cdp_session(page)
    kinds = ("touchStart", "touchMove", "touchMove", "touchMove", "touchEnd")
    for kind, step in zip(kinds, (0, 1, 2, 3, None), strict=True):
        before = point.get_attribute("aria-label")
        at = [] if step is None else [{"x": x - 20 * step, "y": y + 20 * step}]
        touches.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": at})
        if kind == "touchMove":
            playwright.expect(point).not_to_have_attribute("aria-label", before)
    wells = page.locator(".draw > svg[role=img]").nth(2)
    field = page.locator("input[data-key='limits.deadline_s|null'][type=text]")
    before = wells.get_attribute("data-x")
    field.fill("5000")
    playwright.expect(wells).not_to_have_attribute("data-x", before)
    page.close()


def test_a_notebook_runs_the_same_page_beside_its_own_libraries(browser: Any) -> None:
    """One text without imports: it draws answers of the kernel, and hands it states."""
    page = browser.new_page()
    answer = json.loads(json.dumps(answers(optuav.load("paper"), {})))
    page.add_style_tag(content=style())
    found = page.evaluate(NOTEBOOK, {"code": script(), "answer": answer})
    assert found == ["theirs", "undefined", 0, "18000"]  # The capacity of a pack
    assert page.locator("figure .draw > svg[role=img]").count() == 6  # Three figures twice
    page.close()


def test_in_vs_code_the_ground_is_that_of_its_theme(browser: Any) -> None:
    """It sets Jupyter's colour to white in dark themes too, below a text that is light."""
    page = browser.new_page()
    theme = ":root { --jp-layout-color0: white; --vscode-editor-background: rgb(31, 31, 31) }"
    page.set_content(f"<style>{theme}{style()}</style><p class='optuav-frame'>")
    ground = "getComputedStyle(document.querySelector('.optuav-frame')).backgroundColor"
    assert page.evaluate(ground) == "rgb(31, 31, 31)"
    page.close()


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The address of the page that the site embeds, with some of its stops."""
    maker = load_script("make_explorer")
    some = {"limits.deadline_s": (600, 650, 654, 1200), "battery.capacity_As": (36_000,)}
    assert all({*few} <= {*maker.STOPS[key]} for key, few in some.items())
    place = tmp_path_factory.mktemp("site") / "explorer.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(maker, "STOPS", some)
        place.write_text(maker.page(), "utf-8")
    return place.as_uri()


def test_what_the_page_to_try_promises_happens(browser: Any, stored: str) -> None:
    """It opens where the plan falls, the deadline first; the text has the numbers that are seen."""
    text = (Path(__file__).parents[2] / "docs" / "try.md").read_text("utf-8")
    for number in ("719.54 s", "1095 s", "650 s", "654 s"):
        assert number in text
    page = browser.new_page(viewport={"width": 1336, "height": 700})
    page.goto(stored)
    says(page, "719.54 s of hover promised; ✕ falls at 1095 s")
    shown = page.locator("[aria-label='Start from'] option:checked")
    assert shown.text_content() == "A plan that falls"
    deadline = page.locator("input[type=range]").first
    assert deadline.get_attribute("data-key") == "limits.deadline_s|null"
    field = page.locator("input[type=text]").first
    for seconds, words in (("654", "✕ falls"), ("650", "✓ flies"), ("600", "✓ flies")):
        deadline.press("ArrowLeft")
        says(page, words)
        assert field.input_value() == seconds
    page.get_by_label("Judge by", exact=True).select_option("available")
    for _ in range(4):
        says(page, "✓ flies")
        deadline.press("ArrowRight")
    says(page, "597.27 s of hover; ✓ flies")
    page.close()


def test_stored_answers_are_shown_from_a_file(browser: Any, stored: str) -> None:
    """No server, and the answers that `solve` gives."""
    page, errors = browser.new_page(), list[str]()
    page.on("pageerror", lambda each: errors.append(str(each)))
    page.goto(f"{stored}#perspective=available")
    says(page, "597.27 s of hover")
    page.locator("input[type=text]").first.fill("1000")
    playwright.expect(page.locator(".faults")).to_contain_text("600, 650, 654, 1200 s")
    playwright.expect(page.locator(".faults")).to_contain_text("Capacity of a pack = 10 Ah")
    assert page.get_by_role("button", name="Plan (JSON)").count() == 0
    assert page.locator("circle[data-key]").count() == 0
    page.get_by_role("button", name="Reset").click()
    page.keyboard.press("l")
    page.keyboard.press("1")
    says(page, "719.54 s of hover promised; ✕ falls")
    page.goto(f"{stored}?lecture#perspective=battery")
    says(page, "719.54 s of hover promised; ✕ falls")
    assert errors == []
    page.close()


MODEL = """async (text) => {
    const source = URL.createObjectURL(new Blob([text], {type: "text/javascript"}));
    const {Model} = await import(source), heard = [];
    const model = new Model([["answer", 1], ["state", 2]]);
    model.on("change:answer", () => heard.push(model.get("answer")));
    heard.push(model.get("answer"), model.get("state"), model.get("pinned") ?? null);
    model.set("state", 3);
    model.set("answer", 4);
    return heard;
}"""


def test_values_from_the_start_call_no_listener(browser: Any) -> None:
    """A model may begin with an answer; its listener hears the next one, and of no other value."""
    page = browser.new_page()
    assert page.evaluate(MODEL, script()) == [1, 2, None, 4]
    page.close()


def load_script(name: str) -> ModuleType:
    """A script of the documentation."""
    place = Path(__file__).parents[2] / "docs" / f"{name}.py"
    found = spec_from_file_location(name, place)
    module = module_from_spec(found)
    found.loader.exec_module(module)
    return module

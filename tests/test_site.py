"""The built site: what its pages load, say and show. ``make docs`` runs this on what it built."""

from __future__ import annotations

import os
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from tests.explorer import conftest as explorer

BUILT = os.environ.get("BUILT_SITE")
pytestmark = pytest.mark.skipif(not BUILT, reason="make docs runs this on the site it has built")
SITE = Path(BUILT or ".")
LESSONS = [*(Path(__file__).parents[1] / "examples").glob("[0-9A]*_*.py")]
browser = explorer.browser
LESSON = "lessons/01_first_mission.html"


class Elements(HTMLParser):
    """Start tags of a page with their attributes."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.found = list[tuple[str, dict[str, str | None]]]()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))


@pytest.fixture(scope="module")
def pages() -> dict[str, list[tuple[str, dict[str, str | None]]]]:
    """Elements of each page by its place in the site."""
    return {
        path.relative_to(SITE).as_posix(): Elements(path.read_text("utf-8")).found
        for path in SITE.rglob("*.html")
    }


def test_every_picture_has_words(pages: Any) -> None:
    """A name of a file is none."""
    images = [
        (page, about.get("src"), about.get("alt"))
        for page, elements in pages.items()
        for tag, about in elements
        if tag == "img"
    ]
    assert len(images) > 50
    silent = [each for each in images if not each[2] or " " not in each[2].strip()]
    assert silent == []


def test_no_page_loads_anything_from_another_host(pages: Any) -> None:
    loading = {"img": "src", "script": "src", "iframe": "src", "link": "href", "source": "srcset"}
    loaded = [
        (page, about[loading[tag]])
        for page, elements in pages.items()
        for tag, about in elements
        if about.get(loading.get(tag, ""))
    ]
    assert len(loaded) > 500
    assert [each for each in loaded if re.match(r"(\w+:)?//", each[1])] == []
    styles = [path.read_text("utf-8") for path in SITE.rglob("*.css")]
    assert [
        each for each in styles if re.search(r"(@import|url\()\s*[\"']?(https?:)?//", each)
    ] == []


def test_the_kit_of_teachers_is_off_the_way_of_students(pages: Any) -> None:
    """No lesson, and neither the list of lessons nor the homework, leads into it."""
    kit = {page for page in pages if page.startswith("teaching")}
    assert len(kit) == 5
    students = [page for page in pages if page.startswith("lessons")] + ["teaching-homework.html"]
    for page in students:
        text = (SITE / page).read_text("utf-8")
        article = text.partition("<article")[2].partition("</main>")[0] or text
        assert not re.search(r'href="[^"#]*teaching', article), page
    assert 'href="teaching.html"' in (SITE / "index.html").read_text("utf-8")


class Opened:
    """Pages in a browser that notes what they ask for and which errors they print."""

    def __init__(self, browser: Any) -> None:
        self.browser = browser
        self.asked, self.errors = list[str](), list[str]()

    def page(self, place: str, width: int = 1400, theme: str = "light", height: int = 900) -> Any:
        context = self.browser.new_context(
            viewport={"width": width, "height": height},
            color_scheme=theme,
            reduced_motion="reduce",
        )
        page = context.new_page()
        page.on("request", lambda request: self.asked.append(request.url))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(f"{SITE.as_uri()}/{place}")
        return page


@pytest.fixture
def opened(browser: Any) -> Any:
    found = Opened(browser)
    yield found
    assert [each for each in found.asked if not re.match("file:|data:|blob:", each)] == []
    assert found.errors == []


@pytest.mark.parametrize(
    ("words", "first"),
    [
        ("load mission", "api/optuav.load.html"),
        ("solve", "api/optuav.solve.html"),
        ("replay plan", "api/optuav.replay.html"),
    ],
)
def test_a_name_is_found_first_and_with_an_excerpt(opened: Any, words: str, first: str) -> None:
    """From a file, where a browser fetches no other page."""
    page = opened.page(f"search.html?q={words.replace(' ', '+')}")
    result = page.locator("#search-results li").first
    result.locator(".context").wait_for()
    assert result.locator("a").first.get_attribute("href").partition("#")[0].endswith(first)
    assert words.partition(" ")[0] in result.locator(".context").inner_text()


def test_code_has_14_px_beside_text_of_16_px(opened: Any) -> None:
    page = opened.page(LESSON)
    sizes = "every => getComputedStyle(document.querySelector(every)).fontSize"
    assert page.evaluate(sizes, ".bd-article p") == "16px"
    assert page.evaluate(sizes, ".bd-article pre") == "14px"
    assert page.evaluate(sizes, ".bd-article p code") == "14px"


@pytest.mark.parametrize("place", ["index.html", LESSON, "gallery.html", "teaching.html"])
def test_on_a_phone_neither_a_page_nor_a_picture_is_cut(opened: Any, place: str) -> None:
    page = opened.page(place, 400, height=800)
    assert page.evaluate("document.documentElement.scrollWidth") <= 400
    right = page.evaluate(
        "[...document.querySelectorAll('.bd-article img, .films svg')]"
        ".map(each => each.getBoundingClientRect().right)"
    )
    assert max(right, default=0) <= 400


FIRST = (".films svg", ".bd-article a[href='try.html']")
INSTALLS = ".bd-article pre"


@pytest.mark.parametrize(
    ("width", "height", "seen"), [(1400, 900, (*FIRST, INSTALLS)), (400, 800, FIRST)]
)
def test_the_first_screen_says_why_and_how(
    opened: Any, width: int, height: int, seen: tuple[str, ...]
) -> None:
    """The plan that falls, a page to try it, and the line that installs but for a phone."""
    page = opened.page("index.html", width, height=height)
    for part in seen:
        assert page.locator(part).first.bounding_box()["y"] < height - 60, part


@pytest.mark.parametrize(("width", "height"), [(1400, 900), (1920, 1080)])
def test_the_first_screen_ends_below_the_cards(opened: Any, width: int, height: int) -> None:
    """All three cards and both films are whole on it."""
    page = opened.page("index.html", width, height=height)
    boxes = [each.bounding_box() for each in page.locator(".card, .film").all()]
    assert len(boxes) == 5
    assert max(box["y"] + box["height"] for box in boxes) <= height
    assert max(box["x"] + box["width"] for box in boxes) <= width


ANIMATIONS = "document.querySelector('.films').getAnimations({subtree: true})"
COVERED = """film => {
  const at = node => node.getBoundingClientRect();
  const apart = (a, b) =>
    a.right <= b.left || b.right <= a.left || a.bottom <= b.top || b.bottom <= a.top;
  const seen = [...film.querySelectorAll("text")]
    .filter(text => getComputedStyle(text).visibility === "visible");
  const over = [...film.querySelectorAll(".drone, .vessel, .laser, .device, .now")];
  return seen.flatMap(text => [...over, ...seen.filter(other => other !== text)]
    .filter(mark => !apart(at(text), at(mark)))
    .map(mark => `${text.textContent}: ${mark.getAttribute("class")} ${mark.textContent}`));
}"""


@pytest.mark.parametrize("width", [1400, 400])
def test_nothing_covers_a_word_of_the_films(browser: Any, width: int) -> None:
    """Neither the drone nor a sign, nor another word, at any of 120 moments."""
    page = browser.new_context(viewport={"width": width, "height": 900}).new_page()
    page.goto(f"{SITE.as_uri()}/index.html")
    films = page.locator(".film")
    assert films.count() == 2
    (lasts_ms,) = page.evaluate(
        f"[...new Set({ANIMATIONS}.map(each => each.effect.getTiming().duration))]"
    )
    for number in range(121):
        page.evaluate(
            f"ms => {{ for (const each of {ANIMATIONS})"
            " { each.pause(); each.currentTime = ms; } }",
            lasts_ms * number / 120,
        )
        for film in films.all():
            assert film.evaluate(COVERED) == [], number


def test_the_films_play_once_and_again(browser: Any) -> None:
    """The button stops them, starts them again, and says which."""
    page = browser.new_context(viewport={"width": 1400, "height": 900}).new_page()
    page.goto(f"{SITE.as_uri()}/index.html")
    button = page.locator(".films button")
    states = f"[...new Set({ANIMATIONS}.map(each => each.playState))]"
    assert page.evaluate(states) == ["running"]
    button.click()
    assert button.inner_text() == "Play again"
    assert page.evaluate(states) == ["paused"]
    button.click()
    assert button.inner_text() == "Pause"
    page.evaluate(f"{ANIMATIONS}.forEach(each => each.finish())")
    page.wait_for_function("document.querySelector('.films button').innerText === 'Play again'")


def test_every_page_tells_what_it_is(pages: Any) -> None:
    """Its icon, its description, and its picture for a link, which is 1200 by 630 pixels."""
    made = {"search.html", "genindex.html", "py-modindex.html"}
    articles = {page for page in pages if 'class="bd-article"' in (SITE / page).read_text("utf-8")}
    assert len(articles - made) > 100
    pictures = set[Path]()
    for page in articles - made:
        about = {
            each.get("name") or each.get("property"): each.get("content")
            for tag, each in pages[page]
            if tag == "meta"
        }
        assert about["og:title"], page
        pictures.add((SITE / Path(page).parent / str(about["og:image"])).resolve())
        (icon,) = [each["href"] for tag, each in pages[page] if each.get("rel") == "icon"]
        assert (SITE / Path(page).parent / icon).exists(), page
    (picture,) = pictures
    with Image.open(picture) as preview:
        assert preview.size == (1200, 630)
    home = (SITE / "index.html").read_text("utf-8")
    assert '<meta name="description" content="A drone hovers where it is needed.' in home


def test_each_lesson_in_the_list_has_its_picture(pages: Any) -> None:
    """And so has all but a few of the other lists."""
    lessons = (SITE / "lessons.html").read_text("utf-8").partition('class="bd-article"')[2]
    rows = [row for row in lessons.split("<tr")[1:] if 'href="lessons/' in row]
    assert len(rows) == len(LESSONS)
    assert [row for row in rows if '<a class="thumbnail"' not in row] == []
    for page, share in (("how-to.html", 0.9), ("understand.html", 0.7)):
        text = (SITE / page).read_text("utf-8").partition('class="bd-article"')[2]
        items = text.count('<li><a class="thumbnail"')
        whole = text.partition("<footer")[0].count("<li><")
        assert items >= share * whole > 0, page


def test_the_gallery_begins_with_all_its_pictures(pages: Any) -> None:
    """Each leads to its section."""
    text = (SITE / "gallery.html").read_text("utf-8")
    grid = text.partition('<nav class="overview"')[2].partition("</nav>")[0]
    led = re.findall(r'class="thumbnail" href="#([^"]+)"', grid)
    assert led == re.findall(r'<section id="([^"]+)">\s*(?:<span[^>]*></span>)*<h2>', text)
    assert len(led) > 40


def test_the_explorer_to_try_is_on_one_screen(opened: Any) -> None:
    """Controls, map, plane and charge, without side bars; on a phone the picture has 300 px."""
    page = opened.page("try.html")
    stored = page.frame_locator("#stored")
    stored.locator(".draw > svg[role=img]").first.wait_for()
    assert not page.locator(".bd-sidebar-secondary, .bd-sidebar-primary").first.is_visible()
    frame = page.locator("#stored").bounding_box()
    assert frame["x"] <= 20
    assert frame["width"] >= 1360
    assert frame["y"] + frame["height"] <= 900
    for name in (".controls", "figure.map", "figure.plane", "figure.wells", ".foot"):
        box = stored.locator(name).first.bounding_box()
        assert 0 <= box["y"] < box["y"] + box["height"] <= 900, name
    assert stored.locator(".controls .slider label").first.inner_text() == "Deadline"
    phone = opened.page("try.html", 400, height=800)
    stored = phone.frame_locator("#stored")
    stored.locator(".draw > svg[role=img]").first.wait_for()
    assert stored.locator("figure.map").bounding_box()["height"] >= 300
    assert phone.evaluate("document.documentElement.scrollWidth") <= 400


def test_a_wide_table_shows_that_it_scrolls(opened: Any) -> None:
    """Shadows stay at the edges, and covers move with the table."""
    page = opened.page("teaching.html", 400)
    shown = page.evaluate(
        "[...document.querySelectorAll('.bd-article table')]"
        ".filter(each => each.scrollWidth > each.clientWidth)"
        ".map(each => getComputedStyle(each).backgroundAttachment)"
    )
    assert shown
    assert set(shown) == {"local, local, scroll, scroll"}
    widths = "[...document.querySelectorAll('td:nth-child(3)')].map(each => each.offsetWidth)"
    assert min(page.evaluate(widths)) > 120


@pytest.mark.parametrize("place", ["gallery.html", LESSON, "teaching-slides.html"])
def test_pictures_have_the_ground_of_a_dark_page(opened: Any, place: str) -> None:
    page = opened.page(place, theme="dark")
    names, ground = page.evaluate(
        "[[...document.querySelectorAll('article img, section img')].filter("
        "each => each.checkVisibility()).map(each => each.getAttribute('src')),"
        " getComputedStyle(document.body).backgroundColor]"
    )
    assert names
    channels = tuple(map(int, re.findall(r"\d+", ground)))
    for name in names:
        assert name.endswith("-dark.png")
        assert Image.open((SITE / place).parent / name).getpixel((0, 0)) == channels


def test_slides_are_turned_by_keys(opened: Any) -> None:
    page = opened.page("teaching-slides.html")
    for _ in range(3):
        page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowLeft")
    page.wait_for_function(
        "Math.abs([...document.querySelectorAll('section section')][1]"
        ".getBoundingClientRect().top) < 2"
    )
    page.keyboard.press("End")
    last = "[...document.querySelectorAll('section section')].at(-1)"
    page.wait_for_function(f"Math.abs({last}.getBoundingClientRect().top) < 2")
    assert page.evaluate(f"{last}.querySelector('h2').innerText").startswith("Three sentences")


def test_each_prediction_sheet_is_a_page(opened: Any) -> None:
    page = opened.page("teaching-sheet.html")
    assert page.pdf(prefer_css_page_size=True).count(b"/Type /Page\n") == 2

"""Plans that the pictures show, and what a reader would see of a figure."""

from __future__ import annotations

import gc
import itertools
from collections.abc import Callable, Iterator

import pytest

matplotlib = pytest.importorskip("matplotlib")
from matplotlib.figure import Figure  # noqa: E402
from matplotlib.text import Text  # noqa: E402
from matplotlib.transforms import Bbox  # noqa: E402

import optuav  # noqa: E402

TOUCHING = 0.5
"""Overlap that nobody sees [px]."""
TESTS = itertools.count(1)


@pytest.fixture(autouse=True)
def pictures_are_thrown_away() -> Iterator[None]:
    """Free their memory now and then: of few objects but many megabytes, it would pile up."""
    yield
    if next(TESTS) % 8 == 0:
        gc.collect()


@pytest.fixture(scope="session")
def paper() -> optuav.Plan:
    """The plan of the shipped mission `paper`: rest on b1, then hover."""
    return optuav.solve("paper", perspective="battery")


@pytest.fixture(scope="session")
def table2() -> optuav.Plan:
    """The plan of the shipped mission `paper-table2`, whose loads are by regime."""
    return optuav.solve("paper-table2", perspective="battery")


@pytest.fixture
def overlaps(monkeypatch: pytest.MonkeyPatch) -> Callable[[Figure], list[tuple[str, str]]]:
    """A function that lists the texts of a figure, as drawn, that lie on each other or are cut."""
    drawn: list[Text] = []
    draw = Text.draw

    def recorded(self: Text, renderer: object, *arguments: object, **options: object) -> None:
        drawn.append(self)
        draw(self, renderer, *arguments, **options)  # type: ignore[arg-type]

    monkeypatch.setattr(Text, "draw", recorded)

    def found(figure: Figure) -> list[tuple[str, str]]:
        drawn.clear()
        figure.set_layout_engine("none")  # the picture is laid out already
        figure.draw_without_rendering()
        return [*_meeting(drawn), *_cut(drawn, figure)]

    return found


def _boxes(drawn: list[Text]) -> list[tuple[str, Bbox]]:
    """Words and where they stand."""
    seen = {id(text): text for text in drawn if text.get_visible() and text.get_text().strip()}
    # The extent of an annotation would include its leading line.
    return [(text.get_text(), Text.get_window_extent(text)) for text in seen.values()]


def _cut(drawn: list[Text], figure: Figure) -> Iterator[tuple[str, str]]:
    page = figure.bbox.padded(TOUCHING)
    for words, box in _boxes(drawn):
        if box.x0 < page.x0 or box.y0 < page.y0 or box.x1 > page.x1 or box.y1 > page.y1:
            yield words, "the edge of the page"


def _meeting(drawn: list[Text]) -> Iterator[tuple[str, str]]:
    for (one, here), (other, there) in itertools.combinations(_boxes(drawn), 2):
        common = Bbox.intersection(here, there)
        if common is not None and min(common.width, common.height) > TOUCHING:
            yield one, other

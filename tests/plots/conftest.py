"""Plans that the pictures show, and what a reader would see of a figure."""

from __future__ import annotations

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
    """A function that lists the texts of a figure, as drawn, that lie on each other."""
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
        return list(_meeting(drawn))

    return found


def _meeting(drawn: list[Text]) -> Iterator[tuple[str, str]]:
    seen = {id(text): text for text in drawn if text.get_visible() and text.get_text().strip()}
    # The extent of an annotation would include its leading line.
    boxes = [(text.get_text(), Text.get_window_extent(text)) for text in seen.values()]
    for (one, here), (other, there) in itertools.combinations(boxes, 2):
        common = Bbox.intersection(here, there)
        if common is not None and min(common.width, common.height) > TOUCHING:
            yield one, other

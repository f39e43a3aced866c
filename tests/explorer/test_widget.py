"""The explorer in a notebook: mission and plan follow what the page states."""

from __future__ import annotations

import sys

import pytest

import optuav
from optuav.errors import InputError


def test_without_anywidget_a_sentence_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "anywidget", None)
    with pytest.raises(InputError, match=r'python -m pip install "\.\[notebook\]"'):
        optuav.explore("paper")


def test_mission_and_plan_follow_the_page() -> None:
    """And keep their last values where it states what is no mission."""
    pytest.importorskip("anywidget", reason="the widget needs anywidget")
    widget = optuav.explore("paper")
    assert widget.plan.hover_time_s == pytest.approx(597.270, abs=1e-3)
    widget.state = {"changes": {"limits.deadline_s": 800}, "perspective": "battery", "number": 1}
    assert widget.mission.limits.deadline_s == 800.0
    assert widget.plan.hover_time_s == pytest.approx(688.848, abs=1e-3)
    assert widget.answer["number"] == 1
    widget.state = {"changes": {"limits.deadline_s": -1}, "number": 2}
    assert widget.answer["faults"][0]["key"] == "limits.deadline_s"
    assert widget.mission.limits.deadline_s == widget.plan.mission.limits.deadline_s == 800.0


def test_the_page_comes_whole_and_without_a_global_name() -> None:
    """A notebook's own d3, and its loader of modules, see nothing of the explorer's."""
    pytest.importorskip("anywidget", reason="the widget needs anywidget")
    widget = optuav.explore("paper")
    start, rest = widget._esm.split("\n", 1)
    assert start == "const {d3, Plot} = (function (define, exports, module, globalThis, self) {"
    assert "import " not in rest.splitlines()[0][:80]
    assert "export default {render}" in rest


def test_a_saved_notebook_tells_how_to_show_the_explorer() -> None:
    """VS Code shows the text after the window was loaded again, GitHub always."""
    pytest.importorskip("anywidget", reason="the widget needs anywidget")
    bundle, _ = optuav.explore("paper")._repr_mimebundle_()
    assert bundle["text/plain"] == "Explorer of paper: run the cell to show it"

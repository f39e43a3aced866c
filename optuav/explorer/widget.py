"""The explorer in a notebook: the same page, with a kernel in place of a server."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from optuav.errors import require
from optuav.explorer.answers import answered, refuse_many
from optuav.explorer.static import script, style
from optuav.mission import Mission, load

if TYPE_CHECKING:
    import anywidget


def explore(mission: Mission | str | Path = "paper") -> anywidget.AnyWidget:
    """Show a mission with sliders in a notebook, and its plan while they move.

    The controls are as in ``optuav explore``: deadline, charge to be kept, capacity, laser,
    charging current, wind and question; device, laser and roofs are dragged on the map. It works in
    Jupyter, VS Code, Colab and marimo, and needs anywidget (``python -m pip install anywidget``).

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file; of at most 2000
        buildings.

    Returns
    -------
    AnyWidget
        Its attributes ``mission`` and ``plan`` follow the controls: a `Mission`, and the `Plan` of
        the question that is shown. While the controls describe no valid mission, both keep their
        last values.

    Raises
    ------
    InputError
        If the mission is invalid or has too many buildings, or anywidget is missing.

    Examples
    --------
    >>> import optuav
    >>> widget = optuav.explore("paper")
    >>> f"{widget.plan.hover_time_s:.2f} s"
    '597.27 s'
    """
    base = load(mission)
    require("anywidget", "explorers in notebooks")
    refuse_many(base)
    return _widget_class()(base)


@cache
def _widget_class() -> Any:
    """The class of the widget, made when anywidget is known to be there."""
    import anywidget
    import traitlets

    class Explorer(anywidget.AnyWidget):  # type: ignore[misc]
        """A mission and its plan, which follow the controls."""

        _esm, _css = script(), style()
        state = traitlets.Dict().tag(sync=True)
        pinned = traitlets.Dict(allow_none=True, default_value=None).tag(sync=True)
        answer = traitlets.Dict().tag(sync=True)

        def __init__(self, base: Mission) -> None:
            super().__init__()
            self._base = self.mission = base
            self._answer({})

        def __repr__(self) -> str:
            """Words that a saved notebook shows before the cell runs again."""
            return f"Explorer of {self._base.name}: run the cell to show it"

        @traitlets.observe("state")  # type: ignore[untyped-decorator]
        def _asked(self, change: Any) -> None:
            self._answer(change["new"])

        def _answer(self, stated: object) -> None:
            self.answer, plan = answered(self._base, stated)
            if plan is not None:
                self.mission, self.plan = plan.mission, plan

    return Explorer

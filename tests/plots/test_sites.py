"""Pictures of sites: everything where the answer says, with no text on another."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.image import imread

import optuav
from optuav import plots

Overlaps = Callable[[Figure], list[tuple[str, str]]]
HAZE = optuav.load("paper").replace({"laser.visibility_km": 2, "limits.deadline_s": 1800})
ROOFS_M = HAZE.buildings.roof_m + np.array([0.0, 0.0, 3.0])
DEVICES_M = [(200, 1000), (700, 1700), (1300, 2400), (1800, 1000), (200, 1700)]


def artists(ax: Axes) -> dict[str, list[Any]]:
    """Points, and both ends of lines, by the words of the legend [m]."""
    drawn = {str(line.get_label()): np.asarray(line.get_xydata()) for line in ax.lines}
    lines = ("device and its laser", "moved")
    return {
        words: (at_m.reshape(-1, 3, 2)[:, :2] if words in lines else at_m).tolist()
        for words, at_m in drawn.items()
    }


def test_all_is_where_the_answer_says(overlaps: Overlaps) -> None:
    """Each device at the laser that lets it hover longest, computed again one by one."""
    missions = [HAZE.replace({"link.device_m": [*at, 0]}) for at in DEVICES_M[:4]]
    found = optuav.place_laser(missions, ROOFS_M, 2)
    ax = plots.sites(found)
    drawn = artists(ax)
    assert drawn["candidate"] == ROOFS_M[:, :2].tolist()
    assert drawn["selected"] == ROOFS_M[[*found.selection.sites], :2].tolist()
    assert drawn["laser"] == found.position_m[:, :2].tolist()
    assert [*map(tuple, drawn["device"])] == DEVICES_M[:4]
    for mission, (device_m, laser_m) in zip(missions, drawn["device and its laser"], strict=True):
        assert tuple(device_m) == mission.link.device_m[:2]
        hover_s = [
            optuav.solve(mission.replace({"laser.position_m": each})).hover_time_s
            for each in found.position_m.tolist()
        ]
        assert laser_m == found.position_m[np.argmax(hover_s), :2].tolist()
    assert len(drawn["moved"]) == 2
    assert overlaps(ax.figure) == []


def test_devices_that_none_serves_are_hollow_and_lasers_that_stay_have_no_line() -> None:
    missions = [HAZE.replace({"link.device_m": [*DEVICES_M[k], 0]}) for k in (0, 4)]
    drawn = artists(plots.sites(optuav.place_laser(missions, ROOFS_M, refine=False)))
    assert [*map(tuple, drawn["device without a plan"])] == DEVICES_M[4:]
    assert len(drawn["device and its laser"]) == 1
    assert "moved" not in drawn
    nobody = artists(plots.sites(optuav.place_laser(missions[1], ROOFS_M)))
    assert not {"selected", "laser", "device", "device and its laser"} & {*nobody}


def test_a_picture_as_it_is_saved_has_room_for_its_legend(overlaps: Overlaps) -> None:
    """Below the axes and their label, also where it is higher than wide."""
    missions = [HAZE.replace({"link.device_m": [x, 2400, 0]}) for x in (200, 1800)]
    sites_m = [[1000, 0, 50], [400, 1300, 83], [1600, 1300, 83]]
    ax = plots.sites(optuav.place_laser(missions, sites_m, 2))
    assert overlaps(ax.figure) == []
    (legend,) = ax.figure.legends
    assert legend.get_window_extent().y1 < ax.xaxis.label.get_window_extent().y0


def test_what_is_no_answer_is_refused() -> None:
    with pytest.raises(
        optuav.InputError, match=r"found = 3: must be an answer of optuav.place_laser"
    ):
        plots.sites(3)  # type: ignore[arg-type]


def test_the_title_of_a_wide_map_is_whole(tmp_path: Path) -> None:
    """The first rows of the picture are white, though one scale for both axes moved them."""
    flat = {"link.device_m": [285, 222, 0], "buildings": []}
    mission = optuav.load("matrice350").replace(flat)
    masts_m = [[0, 200, 6], [714, 0, 6], [300, 390, 6]]
    found = optuav.place_laser(mission, masts_m, refine=False)
    file = plots.save(plots.sites(found), tmp_path / "sites.png")
    assert imread(file)[:4, :, :3].min() == 1.0

"""The mission in motion: where the UAV is, what the wells hold, and a file that is whole."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from PIL import Image, ImageColor

import optuav
from optuav import plots
from optuav.errors import InputError, NoPlanError
from optuav.plan.display import LACKING
from optuav.plots import animation
from optuav.plots.style import BLACK, LASER, NAMES_PT, applied


@pytest.fixture(scope="module")
def falling() -> optuav.Replay:
    """The direct route of `paper` by charge alone: dry at 660.26 s, while it hovers."""
    return optuav.replay(optuav.solve("paper", "P3", perspective="battery"))


def lines(replayed: optuav.Replay, moment_s: float) -> dict[str, Line2D]:
    """The lines that move on the map at a moment, by what they are."""
    left, _ = Figure().subplots(1, 2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(animation, "_still", lambda _: (left.figure, NAMES_PT))
        list(animation.frames(replayed, [moment_s]))
    return dict(zip(("trail", "beam", "craft"), left.lines, strict=True))


def test_the_uav_is_where_the_replay_has_it(falling: optuav.Replay) -> None:
    """Half-way over the first leg it has flown no farther than that, and gets no power."""
    trace = falling.trace
    moment_s = 0.5 * falling.phases[0].end_s
    shown = lines(falling, moment_s)
    expected = [np.interp(moment_s, trace.time_s, each) for each in trace.position_m.T[:2]]
    assert np.ravel(shown["craft"].get_data()) == pytest.approx(expected)
    trail = np.asarray(shown["trail"].get_xydata())
    assert trail[0] == pytest.approx((0.0, 0.0))
    assert trail[-1] == pytest.approx(expected)
    assert len(shown["beam"].get_xydata()) == 0


def test_power_comes_from_the_laser_while_it_hovers(falling: optuav.Replay) -> None:
    beam = lines(falling, 300.0)["beam"]
    assert beam.get_color() == LASER
    (source, end) = np.asarray(beam.get_xydata())
    assert source == pytest.approx((1000.0, 0.0))
    assert end == pytest.approx((1000.0, 2501.0152), abs=1e-3)


@pytest.mark.parametrize(("moment_s", "colour"), [(660.0, BLACK), (661.0, LACKING)])
def test_it_turns_red_when_it_is_dry(moment_s: float, colour: str, falling: optuav.Replay) -> None:
    craft = lines(falling, moment_s)["craft"]
    assert to_rgba(craft.get_markeredgecolor()) == to_rgba(colour)


@pytest.mark.parametrize("name", ["paper", pytest.param("matrice350", marks=pytest.mark.soak)])
def test_places_of_the_route_are_named_beside_them(
    name: str, overlaps: Callable[[Figure], list[tuple[str, str]]]
) -> None:
    """Within half an inch, and without names on each other."""
    plan = optuav.solve(name)
    with applied():
        still, _ = animation._still(optuav.replay(plan))
    named = {text.get_text(): text for text in still.axes[0].texts}
    route = ["hover point" if place == "hover" else place for place in plan.route]
    assert {*route, "device", "laser"} <= named.keys()
    assert overlaps(still) == []
    for place in route:
        box = Text.get_window_extent(named[place])
        point = still.axes[0].transData.transform(named[place].xy)
        nearest = np.clip(point, box.min, box.max)
        assert np.hypot(*(point - nearest)) < 0.5 * still.dpi


@pytest.mark.soak
def test_a_small_file(falling: optuav.Replay, tmp_path: Path) -> None:
    """A GIF of all moments, at most 1 MB and 20 s."""
    file = plots.save_animation(falling, tmp_path / "mission.gif")
    with Image.open(file) as shown:
        durations = []
        for frame in range(shown.n_frames):  # type: ignore[attr-defined]
            shown.seek(frame)
            durations.append(shown.info["duration"])
        assert len(durations) >= animation.FRAMES - 10
    assert 10_000 < sum(durations) <= 20_000
    assert file.stat().st_size <= 1_000_000


def test_the_same_bytes_again(falling: optuav.Replay) -> None:
    one, other = (animation.gif([*animation.frames(falling, [700.0])][:3]) for _ in range(2))
    assert one == other
    with Image.open(io.BytesIO(one)) as shown:
        assert shown.format == "GIF"


def test_the_ground_is_white_as_that_of_a_page(falling: optuav.Replay) -> None:
    """And the colour of the beam is that of the table, though each frame has 256 colours."""
    images = [*animation.frames(falling, [100.0, 700.0])]
    with Image.open(io.BytesIO(animation.gif(images))) as shown:
        frame = np.array(shown.convert("RGB"))
    assert (frame[:2] == 255).all()
    assert (frame[:, :2] == 255).all()
    lit = np.all(np.asarray(images[0]) == ImageColor.getrgb(LASER), axis=-1)
    assert lit.any()
    assert (frame[lit] == ImageColor.getrgb(LASER)).all()


def test_nothing_is_left_behind_where_it_cannot_be_written(
    falling: optuav.Replay, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(animation, "frames", lambda *_: iter([Image.new("RGB", (2, 2))]))
    with pytest.raises(InputError, match="there is no directory"):
        plots.save_animation(falling, tmp_path / "missing" / "mission.gif")
    assert list(tmp_path.iterdir()) == []


def test_a_mission_that_cannot_be_flown_has_no_animation(tmp_path: Path) -> None:
    windy = optuav.load("paper").replace({"wind.force_N": [50.0, 0.0, 0.0]})
    stops = (optuav.judge.Stop("hover", "hover", 10.0),)
    with pytest.raises(NoPlanError):
        plots.save_animation(optuav.replay(optuav.Itinerary(windy, stops)), tmp_path / "a.gif")

"""A simulated plan in motion: the map, and the wells of the battery as they are emptied."""

import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image, ImageColor

from optuav.judge import Itinerary, Replay, replay
from optuav.mission.files import ending_of, write_files
from optuav.mission.messages import path_of
from optuav.network.map_extent import scene
from optuav.plan import Plan, Stop
from optuav.plan.display import LACKING
from optuav.plots import signs, style
from optuav.plots.charge import draw_wells
from optuav.plots.map import FEW, Way, draw_from_above, draw_plan_view, links, plan_labels
from optuav.plots.profiles import timed
from optuav.plots.style import BLACK, BLUE, GREEN, GREY, LASER, ORANGE, SKY, place
from optuav.presentation.numbers import seconds

FRAMES, FRAME_MS, HELD = 120, 100, 20  # Moments, for how long each, how often the last
DOTS_PER_INCH = 100
COLOURS = 256
PALETTE = (BLACK, ORANGE, SKY, GREEN, BLUE, LACKING, LASER, GREY)
"""Colours that stay as they are in a GIF, however little of the picture they fill."""


def save_animation(replayed: Replay | Plan | Itinerary | str | Path, path: str | Path) -> Path:
    """Write a simulated plan in motion as a GIF of a quarter of a minute: map and wells together.

    On the map the UAV flies its way, joined to the laser while that delivers power, and orange-red
    from the first violated limit on. The same plan gives the same bytes.

    Parameters
    ----------
    replayed
        From `optuav.replay`, or what that takes: a plan, an itinerary, or the file of one.
    path
        The file, whose name ends in ``.gif``; an existing file is replaced, whole or not at all.

    Returns
    -------
    The file.

    Raises
    ------
    NoPlanError
        If nothing is flown.
    InputError
        If the file cannot be written or has another ending.

    Examples
    --------
    >>> import optuav
    >>> replayed = optuav.replay(optuav.solve("paper", "P3"))
    >>> optuav.plots.save_animation(replayed, "mission.mp4")
    Traceback (most recent call last):
    ...
    optuav.errors.InputError: path = 'mission.mp4': must be a name that ends in .gif
    """
    file = path_of(path)
    ending_of(file, ".gif")
    replayed = replay(replayed)
    moments_s = np.linspace(0.0, replayed.trace.time_s[-1], FRAMES).tolist()
    write_files({file: gif([*frames(replayed, moments_s)])})
    return file


def frames(replayed: Replay, moments_s: Sequence[float]) -> Iterator[Image.Image]:
    """The pictures of an animation at moments [s], and the last of them for a while."""
    trace, laser, events = replayed.trace, replayed.mission.laser, timed(replayed)
    end_s, name = float(trace.time_s[-1]), style.drawable(replayed.mission.name)
    served = {device.name for device in replayed.mission.devices}
    with style.applied():
        figure, room_pt = _still(replayed)
        left, right = figure.axes
        canvas: Any = FigureCanvasAgg(figure)
        canvas.draw()
        still = canvas.copy_from_bbox(figure.bbox)
        left.set_autoscale_on(False)
        (trail,) = left.plot([], [], color=BLUE, linewidth=1.6)
        (beam,) = left.plot([], [], **style.limit("laser"))
        (craft,) = left.plot([], [], **signs.look("drone"))
        veil = right.axvspan(0.0, end_s, color="white", alpha=0.85, linewidth=0.0)
        (now,) = right.plot([], [], color=BLACK, linewidth=0.8)
        clock = left.set_title("", y=1.0)
        verdict = right.set_title("", y=1.0, pad=room_pt, color=LACKING)
        for moment_s in moments_s:
            at = max(0, int(np.searchsorted(trace.time_s, moment_s, side="right")) - 1)
            here = [float(np.interp(moment_s, trace.time_s, x)) for x in trace.position_m.T[:2]]
            trail.set_data(*np.concatenate([trace.position_m[: at + 1, :2], [here]]).T)
            lit = laser is not None and trace.received_power_W[at] > 0.0
            beam.set_data(*np.array([laser.position_m[:2], here]).T if laser and lit else ([], []))
            past = [words for words, event in events if event.time_s <= moment_s]
            craft.set_data(here[:1], here[1:])
            craft.set_markeredgecolor(LACKING if past else BLACK)
            veil.set_bounds(moment_s, 0.0, end_s - moment_s, 1.0)
            now.set_data([moment_s, moment_s], right.get_ylim())
            place = trace.end_place[at] if trace.kind[at] == "hover" else ""
            over = f" over {style.drawable(place)}" if place in served else ""
            clock.set_text(
                style.titled(name, trace.kind[at] + over, f"$t$ = {seconds(moment_s, 0)}")
            )
            verdict.set_text(", ".join(past[:2]))
            canvas.restore_region(still)
            for artist in (trail, beam, craft, veil, now, clock, verdict):
                artist.draw(canvas.get_renderer())
            image = Image.fromarray(np.array(canvas.buffer_rgba())).convert("RGB")
            yield image
    yield from [image] * HELD


def _still(replayed: Replay) -> tuple[Figure, float]:
    """All that does not move: the map on the left, the wells over the mission on the right.

    And the room between the wells and their title [pt].
    """
    trace = replayed.trace
    figure = style.page(3.8, 7.6)
    figure.set_dpi(DOTS_PER_INCH)
    left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.0))
    right.set(xlim=(0.0, trace.time_s[-1] or 1.0), xlabel=style.TIME)
    _, *bands, _, _ = draw_wells(right, replayed)
    right.set_title(" ", pad=style.NAMES_PT)
    left.set_title(" ")
    view = scene(replayed.mission)
    names = tuple(replayed.route)
    stops = tuple(
        Stop(phase.end.name, phase.kind, phase.duration_s, phase.start_s)
        for phase in replayed.phases
        if phase.kind != "flight"
    )
    look: style.Look = {"color": GREY, "linewidth": 0.8, "linestyle": style.DASHED}
    flights = [phase for phase in replayed.phases if phase.kind == "flight"]
    ends = (phase.end.position_m for phase in flights)
    points = np.array([replayed.phases[0].start.position_m, *ends])
    way = Way.bent(names, points, tuple(phase.waypoints_m for phase in flights), stops, look)
    draw_plan_view(left, view, [way])
    clear = draw_from_above(left, view, [way])
    style.group_thousands(left, right)
    beam = Line2D([], [], label="power from the laser", **style.limit("laser"))
    entries = [beam, *bands, *style.swatches(trace.kind)]
    figure.legend(handles=entries, loc="outside lower center", ncols=7)
    style.settle(left)
    room_pt = style.draw_bands([right], style.phase_bands(replayed))
    labels = plan_labels(view, [way], times=False)
    # A small map has no room for symbols.
    short = [replace(label, text=label.text.partition(" $")[0]) for label in labels]
    faint = [*view.sight_lines(names, FEW)[0], *links(view)]
    place(left, short, [way.points[:, :2]], faint, clear)
    figure.set_layout_engine("none")
    return figure, room_pt


def gif(images: Sequence[Image.Image], kept: Sequence[str] = PALETTE) -> bytes:
    """A GIF, small as all frames share the colours of three; white and those kept stay exact."""
    samples = [images[at] for at in (0, len(images) // 2, -1)]
    width, height = samples[0].size
    samples += [Image.new("RGB", (width, height // 8), colour) for colour in kept]
    sheet = Image.fromarray(np.concatenate([np.asarray(sample) for sample in samples]))
    palette = sheet.quantize(COLOURS)
    plain = Image.Dither.NONE
    first, *rest = frames = [image.quantize(palette=palette, dither=plain) for image in images]
    colours = np.array(palette.getpalette(), np.uint8).reshape(-1, 3)
    exact = np.array([[ImageColor.getrgb(colour) for colour in ("white", *kept)]], np.uint8)
    near = Image.fromarray(exact).quantize(palette=palette, dither=plain)
    colours[np.asarray(near)] = exact
    for frame in frames:
        frame.putpalette(colours.tobytes())
    file = io.BytesIO()
    first.save(file, "GIF", save_all=True, append_images=rest, duration=FRAME_MS, loop=0)
    return file.getvalue()

"""Flying over time: a replayed plan with altitude, speed and power, and one leg in its stages."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, refuse
from optuav.flight.model import FlightModel
from optuav.judge import Itinerary, Replay, replay
from optuav.judge.flight_plan import FlightPlan
from optuav.mission import Mission, load
from optuav.mission.messages import first_ten, shown
from optuav.network.map_extent import scene
from optuav.physics.flight import LegState, Loads
from optuav.plan import Plan
from optuav.plan.trace import FlightEvent
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, GREEN, GREY, LASER, ORANGE, PINK, SKY, Band, mark
from optuav.presentation.numbers import fixed, seconds

MOST_MARKED = 12  # Violations that are marked one by one
WORDS = {"empty": "dry", "full": "driven past full"}  # For kinds of violations
COLOURS = {"turn": ORANGE, "accelerate": BLUE, "brake": SKY, "hover": GREEN}  # Colours of stages
HOVER_SHARE = 0.06  # Duration of the hover that is shown after the leg, as a share of the leg's
POINTS_PER_STAGE = 129


class ProfileAxes(NamedTuple):
    """Panels of a simulated plan over time [s].

    Parameters
    ----------
    altitude, speed, power
        Altitude [m], speed [m/s], and power into the battery [W].

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.profile(optuav.replay(optuav.solve("paper", "P3"))).speed.get_ylabel()
    'speed [m/s]'
    """

    altitude: Axes
    speed: Axes
    power: Axes

    def _repr_png_(self) -> style.Shown:
        return style.picture_of(self)


@style.applied()
def profile(
    replayed: Replay | Plan | Itinerary | str | Path, *, figure: style.AnyFigure | None = None
) -> ProfileAxes:
    """Draw altitude, speed and power into the battery over a simulated plan.

    While a leg turns, the flight model freezes the position: no speed is drawn there. The
    altitudes between which the UAV may hover are dashed, but not those of a flight plan, where they
    are not judged. Each violated limit is marked when it is first passed.

    Parameters
    ----------
    replayed
        From `optuav.replay`, or what that takes: a plan, an itinerary, or the file of one.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with altitude in m, speed in m/s and power in W over time in s.

    Raises
    ------
    NoPlanError
        If nothing is flown.

    Examples
    --------
    >>> import optuav
    >>> replayed = optuav.replay(optuav.solve("paper", "P3"))
    >>> optuav.plots.profile(replayed).altitude.get_title(loc="left")
    'paper: flight over time, can be flown'
    """
    replayed = replay(replayed)
    trace, mission = replayed.trace, replayed.mission
    time_s, height_m, power_W = trace.time_s, trace.position_m[:, 2], trace.power_W
    axes = ProfileAxes(*(figure or style.page(5.0)).subplots(3, 1, sharex=True))
    lowest_m, highest_m = mission.limits.min_altitude_m, mission.limits.max_altitude_m
    flight_plan = replayed.subject if isinstance(replayed.subject, FlightPlan) else None
    for level_m in () if flight_plan else (lowest_m, highest_m):
        axes.altitude.axhline(level_m, color=GREY, linewidth=0.8, linestyle=style.DASHED)
    axes.altitude.plot(time_s, height_m, color=BLACK)
    levels_m = [*height_m, *([] if flight_plan else [lowest_m])]
    levels_m += [highest_m] if not flight_plan and highest_m <= 3.0 * max(levels_m) else []
    axes.altitude.set(ylabel="altitude $z$ [m]", ylim=style.margins(levels_m, 0.15))
    axes.speed.plot(time_s, np.where(trace.stage == "turn", np.nan, trace.speed_m_s), color=BLACK)
    axes.speed.set(ylabel="speed [m/s]", ylim=style.margins([0.0, *trace.speed_m_s], 0.12))
    axes.power.axhline(0.0, color=BLACK, linewidth=0.5)
    axes.power.plot(time_s, trace.received_power_W, color=LASER, linewidth=1.0)
    axes.power.plot(time_s, power_W, color=BLACK)
    limits = style.margins([0.0, *power_W, *trace.received_power_W], 0.12)
    axes.power.set(ylabel="power into\nthe battery [W]", ylim=limits)
    axes.power.set(xlim=(0.0, time_s[-1] or 1.0), xlabel=style.TIME)
    verdict = "can be flown" if replayed.flyable else "cannot be flown"
    name = flight_plan.name if flight_plan else mission.name
    title = style.titled(name or mission.name, "flight over time", verdict)
    axes.altitude.set_title(title, pad=style.NAMES_PT)
    entries = [style.entry("net power", BLACK), style.entry("from the laser", LASER, 1.0)]
    if not flight_plan:
        entries.append(style.entry("altitudes for hovering", GREY, 0.8, "--"))
    style.group_thousands(*axes)
    below: style.Look = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.42)}
    handles = [*entries, *style.swatches(trace.kind)]
    axes.power.legend(handles=handles, ncols=6, columnspacing=1.4, **below)
    style.settle(axes.altitude)
    style.draw_bands(axes, style.phase_bands(replayed))
    events = list[tuple[str, float, float, str]]()
    for words, event in timed(replayed)[:MOST_MARKED]:
        role = "overfull" if event.kind == "full" else "dry"
        at_m = np.interp(event.time_s, time_s, height_m)
        events.append((words, event.time_s, float(at_m), role))
    mark(axes.altitude, events, [np.stack([time_s, height_m], axis=1)])
    return axes


def timed(replayed: Replay) -> list[tuple[str, FlightEvent]]:
    """Violations with their words; figures that contradict themselves have no moment."""
    return [
        (f"{WORDS.get(event.kind, event.kind)} at {seconds(event.time_s, 1)}", event)
        for event in replayed.violations
        if event.kind != "mismatch"
    ]


class LegAxes(NamedTuple):
    """Panels of a leg over time [s].

    Parameters
    ----------
    speed, attitude, current
        Speed along the path [m/s]; pitch and roll [°], None where the flight model has none; and
        the current that is drawn [A].

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.leg(optuav.load("paper"), "origin", "hover").attitude.get_ylabel()
    'attitude [°]'
    """

    speed: Axes
    attitude: Axes | None
    current: Axes

    def _repr_png_(self) -> style.Shown:
        return style.picture_of(self)


@style.applied()
def leg(
    mission: Mission | str | Path, start: str, end: str, *, figure: style.AnyFigure | None = None
) -> LegAxes:
    """Draw one leg over time by the mission's flight model.

    Where the model freezes the position while the UAV turns at speed, the speed that it keeps is
    dotted.

    Parameters
    ----------
    mission
        The mission, also by its name or path.
    start, end
        Names of places: ``"origin"``, ``"hover"`` or one of several devices, ``"destination"`` or
        a building's.
    figure
        Where to draw; on a page of its own by default.

    Returns
    -------
    The axes, with speed in m/s, attitude in degrees and current in A over time in s.

    Raises
    ------
    InputError
        If the place does not exist, or the leg cannot be flown or has no length.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.leg(optuav.load("paper"), "origin", "hover").speed.get_title(loc="left")
    'paper: leg origin → hover, 2693.5 m in 37.90 s'
    """
    mission = load(mission)
    way_m, model = _displacement(mission, start, end), mission.flight_model
    loads = model.leg(way_m)
    stages = [*_stages(model, loads)]
    attitudes = any(np.isfinite(stage.state.attitude.pitch_rad).any() for stage in stages)
    grid = (figure or style.page(5.0 if attitudes else 3.6)).subplots(2 + attitudes, 1, sharex=True)
    axes = LegAxes(grid[0], grid[1] if attitudes else None, grid[-1])
    peak_m_s, duration_s = float(loads.peak_speed_m_s), float(loads.duration_s)
    _draw_speed(axes.speed, stages, peak_m_s)
    if axes.attitude is not None:
        _draw_attitude(axes.attitude, stages)
    _draw_current(axes.current, stages)
    ends = " → ".join(map(style.drawable, (start, end)))
    flown = f"{fixed(math.hypot(*way_m), 1)} m in {seconds(duration_s)}"
    several = len(stages) > 1
    title = style.titled(mission.name, f"leg {ends}", flown)
    axes.speed.set_title(title, pad=style.NAMES_PT if several else 6.0)
    axes.current.set(xlabel="time since the leg began $t$ [s]", xlim=(0.0, stages[-1].time_s[-1]))
    style.group_thousands(*grid)
    style.settle(axes.speed)
    style.draw_bands(grid, [stage.band for stage in stages] if several else [])
    return axes


def _displacement(mission: Mission, start: str, end: str) -> tuple[float, float, float]:
    """End minus start [m]; an error where no leg leads there."""
    all_places = scene(mission).places
    refuse(
        Fault(option, shown(name), f"one of {first_ten(all_places.names)}")
        for option, name in (("start", start), ("end", end))
        if name not in all_places.names
    )
    first_m, last_m = (all_places.position_m[all_places.names.index(name)] for name in (start, end))
    x, y, z = (last_m - first_m).tolist()
    if x == y == z == 0.0:
        raise InputError(f"the leg {start} → {end} has no length")
    unknown = "there is no hover point within reach" if math.isnan(x) else None
    if why := unknown or mission.flight_model.impossible():
        raise InputError(f"the leg {start} → {end} cannot be flown: {why}")
    return x, y, z


class _Stage(NamedTuple):
    """A stage of a leg, or the hover after it: its number from 1, moments [s], and figures."""

    number: int
    name: str
    time_s: Floats
    current_A: float
    state: LegState

    @property
    def band(self) -> Band:
        """The stretch of time of the stage."""
        names = f"{self.number} {self.name}", f"{self.number}"
        return Band(self.time_s[0], self.time_s[-1], COLOURS.get(self.name, GREY), names)


def _stages(model: FlightModel, loads: Loads) -> Iterator[_Stage]:
    """The stages of a leg that take time; after several of them, the hover at its end."""
    duration_s, peak_s = float(loads.duration_s), float(loads.peak_s)
    names, currents_A, ends_s = loads.stages, loads.currents_A, np.cumsum(loads.durations_s)
    if len(names) > 1:
        names, currents_A = (*names, "hover"), (*currents_A, model.hover().current_A)
        ends_s = np.append(ends_s, (1.0 + HOVER_SHARE) * duration_s)
    moments = enumerate(pairwise([0.0, *ends_s.tolist()]))
    for (number, (begin, finish)), name, current_A in zip(moments, names, currents_A, strict=True):
        if begin < finish:
            # The last moment is just before the next stage begins.
            last_s = np.nextafter(finish, begin)
            corners_s = np.clip([peak_s, duration_s - peak_s], begin, last_s)
            time_s = np.union1d(np.linspace(begin, last_s, POINTS_PER_STAGE), corners_s)
            yield _Stage(number + 1, name, time_s, float(current_A), model.state(loads, time_s))


def _draw_speed(ax: Axes, stages: Sequence[_Stage], peak_m_s: float) -> None:
    """Draw the speed along the path, dotted where the model freezes the position at speed."""
    handles = [style.entry("speed along the path", BLACK)]
    for before, stage in zip([None, *stages], stages, strict=False):
        kept_m_s = before.state.speed_m_s[-1] if before else 0.0
        frozen = bool(kept_m_s > 0.5 * peak_m_s and not stage.state.speed_m_s.any())
        shown_m_s = np.full_like(stage.time_s, peak_m_s) if frozen else stage.state.speed_m_s
        ax.plot(stage.time_s, shown_m_s, color=BLACK, linestyle=":" if frozen else "-")
        if frozen:
            kept = f"speed kept for stage {stage.number + 1}"
            words = f"stage {stage.number}: position frozen,\n{kept}"
            handles.append(style.entry(words, BLACK, linestyle=":"))
    ax.set(ylabel="speed [m/s]", ylim=(-0.04 * peak_m_s, 1.12 * peak_m_s))
    if len(stages) > 1:
        _legend_beside(ax, handles)


def _draw_attitude(ax: Axes, stages: Sequence[_Stage]) -> None:
    """Draw pitch and roll."""
    time_s = np.concatenate([stage.time_s for stage in stages])
    attitudes = zip(*(stage.state.attitude for stage in stages), strict=True)
    pitch, roll = (np.rad2deg(np.concatenate(attitude)) for attitude in attitudes)
    lines = ax.plot(time_s, pitch, color=BLUE, label="pitch $ψ_p$")
    dashed: style.Look = {"color": PINK, "linestyle": (0.0, (4.0, 1.5))}
    lines += ax.plot(time_s, roll, label="roll $ψ_r$", **dashed)
    ax.set(ylabel="attitude [°]")
    _legend_beside(ax, lines)


def _draw_current(ax: Axes, stages: Sequence[_Stage]) -> None:
    """Draw the current that is drawn, with the names of several stages."""
    time_s = np.concatenate([stage.time_s for stage in stages])
    drawn_A = np.concatenate([np.full_like(stage.time_s, stage.current_A) for stage in stages])
    ax.plot(time_s, drawn_A, color=BLACK)
    ax.set(ylabel="current drawn\nin flight [A]", ylim=style.margins([0.0, *drawn_A]))
    if len(stages) > 1:
        numbers = dict[str, list[str]]()
        for stage in stages:
            numbers.setdefault(stage.name, []).append(f"{stage.number}")
        words = {name: f"{name} ({', '.join(own)})" for name, own in numbers.items()}
        entries = [style.swatch(COLOURS.get(name, GREY), label) for name, label in words.items()]
        _legend_beside(ax, entries, "stages")


def _legend_beside(ax: Axes, handles: Sequence[Artist], title: str | None = None) -> None:
    """Put a legend to the right of axes."""
    ax.legend(handles=handles, title=title, loc="center left", bbox_to_anchor=(1.0, 0.5))

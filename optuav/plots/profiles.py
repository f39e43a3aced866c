"""Flying over time: a replayed plan with altitude, speed and power, and one leg in its stages."""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from optuav.errors import Fault, InputError, refuse
from optuav.judge import Replay
from optuav.mission import Mission
from optuav.mission.messages import listed
from optuav.network import vehicle
from optuav.network.scene import scene
from optuav.physics import flight, rotor
from optuav.plan.trace import Event
from optuav.plots import style
from optuav.plots.style import BLACK, BLUE, GREEN, GREY, LASER, ORANGE, PINK, SKY, Band, mark

MOST_MARKED = 12  # Violations that are marked one by one
WORDS = {"empty": "dry", "full": "driven past full"}  # For kinds of violations
STAGES = (*flight.STAGES, "hover")  # The stages of the six-stage model, and the hover after them
COLOURS = {"turn": ORANGE, "accelerate": BLUE, "brake": SKY, "hover": GREEN}
HOVER_SHARE = 0.06  # Duration of the hover that is shown after the leg, as a share of the leg's
FREEZING_STAGE = 3
POINTS_PER_STAGE = 129


class ProfileAxes(NamedTuple):
    """Panels of a simulated plan over time [s].

    Parameters
    ----------
    altitude, speed, power
        Axes with the altitude [m], the speed [m/s] and the power into the battery [W].

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
        return style.shown(self)


@style.applied()
def profile(replayed: Replay, *, figure: style.AnyFigure | None = None) -> ProfileAxes:
    """Draw altitude, speed and power into the battery over a simulated plan.

    While a leg turns, the flight model freezes the position: no speed is drawn there. The
    altitudes between which the UAV may hover are dashed, and each violated limit is marked when it
    is first passed.

    Parameters
    ----------
    replayed
        From `optuav.replay`.
    figure
        Figure or subfigure to draw into, best laid out with ``layout="constrained"``; a page of
        its own by default.

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
    'paper: can be flown'
    """
    trace, mission = replayed.trace, replayed.mission
    time_s, height_m, power_W = trace.time_s, trace.position_m[:, 2], trace.power_W
    axes = ProfileAxes(*(figure or style.page(5.0)).subplots(3, 1, sharex=True))
    lowest_m, highest_m = mission.limits.min_altitude_m, mission.limits.max_altitude_m
    for level_m in (lowest_m, highest_m):
        axes.altitude.axhline(level_m, color=GREY, linewidth=0.8, linestyle=style.DASHED)
    axes.altitude.plot(time_s, height_m, color=BLACK)
    levels_m = [*height_m, lowest_m]
    levels_m += [highest_m] if highest_m <= 3.0 * max(levels_m) else []
    axes.altitude.set(ylabel="altitude $z$ [m]", ylim=style.margins(levels_m, 0.15))
    axes.speed.plot(time_s, np.where(trace.stage == "turn", np.nan, trace.speed_m_s), color=BLACK)
    axes.speed.set(ylabel="speed [m/s]", ylim=style.margins([0.0, *trace.speed_m_s], 0.12))
    axes.power.axhline(0.0, color=BLACK, linewidth=0.5)
    axes.power.plot(time_s, trace.received_power_W, color=LASER, linewidth=1.0)
    axes.power.plot(time_s, power_W, color=BLACK)
    limits = style.margins([0.0, *power_W, *trace.received_power_W], 0.12)
    axes.power.set(ylabel="power into\nthe battery [W]", ylim=limits)
    axes.power.set(xlim=(0.0, time_s[-1] or 1.0), xlabel=style.TIME)
    verdict = "can be flown" if not replayed.violations else "cannot be flown"
    axes.altitude.set_title(f"{style.printed(mission.name)}: {verdict}", pad=style.NAMES_PT)
    entries = [
        style.entry("net power", BLACK),
        style.entry("from the laser", LASER, 1.0),
        style.entry("altitudes for hovering", GREY, 0.8, "--"),
        *style.swatches(trace.kind),
    ]
    style.group_thousands(*axes)
    below: style.Look = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.42)}
    axes.power.legend(handles=entries, ncols=6, columnspacing=1.4, **below)
    style.settle(axes.altitude)
    style.draw_bands(axes, style.phase_bands(replayed))
    events = [
        (words, each.time_s, height, "overfull" if each.kind == "full" else "dry")
        for words, each in timed(replayed)[:MOST_MARKED]
        for height in [float(np.interp(each.time_s, time_s, height_m))]
    ]
    mark(axes.altitude, events, [np.stack([time_s, height_m], axis=1)])
    return axes


def timed(replayed: Replay) -> list[tuple[str, Event]]:
    """Violations with their words; figures that contradict themselves have no moment."""
    return [
        (f"{WORDS.get(event.kind, event.kind)} at {event.time_s:.1f} s", event)
        for event in replayed.violations
        if event.kind != "mismatch"
    ]


class LegAxes(NamedTuple):
    """Panels of a leg over time [s].

    Parameters
    ----------
    speed, attitude, current
        Axes with the speed along the path [m/s], pitch and roll [°] (None for legs of constant
        load), and the current that is drawn [A].

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
        return style.shown(self)


@style.applied()
def leg(
    mission: Mission, start: str, end: str, *, figure: style.AnyFigure | None = None
) -> LegAxes:
    """Draw one leg over time by the mission's flight model.

    For the six-stage model: the speed along the path, pitch and roll, and the current of the
    rotors; where it freezes the position while the UAV turns at speed, the speed that it keeps is
    dotted. For the regime loads: the speed and the constant current.

    Parameters
    ----------
    mission
        The mission.
    start, end
        Names of places: ``"origin"``, ``"hover"``, ``"destination"`` or a building's.
    figure
        Figure or subfigure to draw into, best laid out with ``layout="constrained"``; a page of
        its own by default.

    Returns
    -------
    The axes, with speed in m/s, attitude in degrees and current in A over time in s.

    Raises
    ------
    InputError
        If there is no such place, the leg cannot be flown, or has no length.

    Examples
    --------
    >>> import optuav
    >>> optuav.plots.leg(optuav.load("paper"), "origin", "hover").speed.get_title(loc="left")
    'paper: leg origin → hover, 2693.5 m in 37.90 s'
    """
    displacement_m = _displacement(mission, start, end)
    rotors = mission.flight.model == "rotors"
    page = figure or style.page(5.0 if rotors else 3.6)
    grid = page.subplots(3 if rotors else 2, 1, sharex=True)
    axes = LegAxes(grid[0], grid[1] if rotors else None, grid[-1])
    draw = _draw_six_stages if rotors else _draw_constant_load
    duration_s, bands = draw(mission, displacement_m, axes)
    ends, length_m = " → ".join(map(style.printed, (start, end))), math.hypot(*displacement_m)
    heading = f"{style.printed(mission.name)}: leg {ends}, {length_m:.1f} m in {duration_s:.2f} s"
    axes.speed.set_title(heading, pad=style.NAMES_PT if rotors else 6.0)
    axes.current.set(xlabel="time since the leg began $t$ [s]")
    axes.current.set_xlim(0.0, bands[-1].end_s if bands else duration_s)
    style.group_thousands(*grid)
    style.settle(axes.speed)
    style.draw_bands(grid, bands)
    return axes


def _displacement(mission: Mission, start: str, end: str) -> tuple[float, float, float]:
    """End minus start [m]; an error where no leg leads there."""
    known = scene(mission).places
    refuse(
        Fault(option, repr(name), f"one of {listed(known.names)}")
        for option, name in (("start", start), ("end", end))
        if name not in known.names
    )
    first_m, last_m = (known.position_m[known.names.index(name)] for name in (start, end))
    x, y, z = (last_m - first_m).tolist()
    if x == y == z == 0.0:
        raise InputError(f"the leg {start} → {end} has no length")
    why = "there is no hover point within reach" if math.isnan(x) else vehicle.impossible(mission)
    if why is not None:
        raise InputError(f"the leg {start} → {end} cannot be flown: {why}")
    return x, y, z


def _draw_six_stages(
    mission: Mission, displacement_m: tuple[float, float, float], axes: LegAxes
) -> tuple[float, list[Band]]:
    """Draw a leg of the six-stage model; its duration [s], and its stages."""
    airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
    flown = flight.leg(airframe, motor, displacement_m, mission.wind.force_N)
    hover_speed = rotor.hover_speed(motor, airframe.external_force_N(mission.wind.force_N))
    currents_A = (*flown.loads.currents_A, rotor.ROTORS * rotor.current(motor, hover_speed))
    duration_s, peak_m_s = float(flown.loads.duration_s), float(flown.peak_speed_m_s)
    ends_s = np.cumsum([0.0, *map(float, flown.loads.durations_s), HOVER_SHARE * duration_s])
    bands, states = list[Band](), []
    for number, (name, (begin, finish)) in enumerate(zip(STAGES, pairwise(ends_s), strict=True), 1):
        if not begin < finish:
            continue
        bands.append(Band(begin, finish, COLOURS[name], (f"{number} {name}", f"{number}")))
        # The last moment is just before the next stage begins.
        within_s = np.linspace(begin, np.nextafter(finish, begin), POINTS_PER_STAGE)
        state = flight.state_at(flown, within_s)
        turns = [np.rad2deg(each) for each in (state.attitude.pitch_rad, state.attitude.roll_rad)]
        current_A = np.full(POINTS_PER_STAGE, currents_A[number - 1])
        states.append(np.stack([within_s, *turns, current_A]))
        freezes = number == FREEZING_STAGE
        shown_m_s = np.full(POINTS_PER_STAGE, peak_m_s) if freezes else state.speed_m_s
        axes.speed.plot(within_s, shown_m_s, color=BLACK, linestyle=":" if freezes else "-")
    time_s, pitch, roll, drawn_A = np.concatenate(states, axis=1)
    axes.speed.set(ylabel="speed [m/s]", ylim=(-0.04 * peak_m_s, 1.12 * peak_m_s))
    frozen = "stage 3: position frozen,\nspeed kept for stage 4"
    speed = style.entry("speed along the path", BLACK)
    _legend_beside(axes.speed, [speed, style.entry(frozen, BLACK, linestyle=":")])
    assert axes.attitude is not None
    lines = axes.attitude.plot(time_s, pitch, color=BLUE, label="pitch $ψ_p$")
    dashed: style.Look = {"color": PINK, "linestyle": (0.0, (4.0, 1.5))}
    lines += axes.attitude.plot(time_s, roll, label="roll $ψ_r$", **dashed)
    axes.attitude.set(ylabel="attitude [°]")
    _legend_beside(axes.attitude, lines)
    axes.current.plot(time_s, drawn_A, color=BLACK)
    axes.current.set(ylabel="current drawn by\nthe rotors [A]")
    axes.current.set(ylim=style.margins([0.0, *drawn_A]))
    numbers = {kind: [n for n, each in enumerate(STAGES, 1) if each == kind] for kind in COLOURS}
    words = {kind: f"{kind} ({', '.join(map(str, own))})" for kind, own in numbers.items()}
    entries = [style.swatch(COLOURS[kind], words[kind]) for kind in words]
    _legend_beside(axes.current, entries, "stages")
    return duration_s, bands


def _legend_beside(ax: Axes, handles: Sequence[Artist], title: str | None = None) -> None:
    """Put a legend to the right of axes."""
    ax.legend(handles=handles, title=title, loc="center left", bbox_to_anchor=(1.0, 0.5))


def _draw_constant_load(
    mission: Mission, displacement_m: tuple[float, float, float], axes: LegAxes
) -> tuple[float, list[Band]]:
    """Draw a leg of the regime loads; its duration [s], and no stages."""
    given, (loads, peak) = mission.flight, vehicle.leg_loads(mission, displacement_m)
    assert given.model == "regimes"
    duration_s, current_A = float(loads.duration_s), given.flight_current_A
    rise_s = float(peak) / given.acceleration_m_s2
    corners_s = [0.0, rise_s, duration_s - rise_s, duration_s]
    axes.speed.plot(corners_s, [0.0, peak, peak, 0.0], color=BLACK)
    axes.speed.set(ylabel="speed [m/s]", ylim=(-0.04 * peak, 1.12 * peak))
    axes.current.plot([0.0, duration_s], [current_A] * 2, color=BLACK)
    axes.current.set(ylabel="current drawn\nin flight [A]", ylim=(0.0, 1.2 * current_A))
    return duration_s, []

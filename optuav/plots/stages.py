"""One leg over time: speed, attitude and current in its stages."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple, TypeAlias

import numpy as np
from matplotlib.axes import Axes

from optuav.arrays import Floats
from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import prisms
from optuav.network.places import Places, build_places
from optuav.physics import flight
from optuav.physics.flight import regime_leg
from optuav.physics.trajectory import state_at
from optuav.plots.bands import NAMES_PT, Band, draw_bands, swatch
from optuav.plots.labels import settle
from optuav.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    ORANGE,
    SKY,
    VERMILLION,
    group_thousands,
    margins,
    need_panels,
    page,
    printed,
    styled,
)

NAMES = (*flight.STAGES, "hover")
"""What the stages of the six-stage model do."""
COLOURS = {"turn": ORANGE, "accelerate": BLUE, "brake": SKY, "hover": GREEN}
HOVER_SHARE = 0.06
"""How much of the hover after the leg is shown, as a share of the leg."""
FREEZING_STAGE = 3
POINTS_PER_STAGE = 129


Drawn: TypeAlias = tuple[float, list[Band]]
"""Duration of the leg [s], and its stages."""


class LegAxes(NamedTuple):
    """Speed, attitude and current over time; legs of constant load have no attitude."""

    speed: Axes
    attitude: Axes | None
    current: Axes


def leg(mission: Mission, start: str, end: str, axes: LegAxes | None = None) -> LegAxes:
    """Draw one leg over time, as the mission's flight model has it.

    Of the six-stage model the speed along the path, pitch and roll, and the current of the rotors.
    Where the model freezes the position while the UAV turns at speed, the speed that it keeps is
    dotted. Of the regime loads the speed and the constant current.

    Parameters
    ----------
    mission
        The mission.
    start, end
        Names of places: ``"origin"``, ``"hover"``, ``"destination"`` or a building's.
    axes
        Where to draw; on a page of its own by default.

    Raises
    ------
    InputError
        If there is no such place, the leg cannot be flown, or has no length.
    """
    way = _displacement(mission, start, end)
    rotors = mission.flight.model == "rotors"
    need_panels(axes, LegAxes)
    with styled():
        if axes is None:
            figure = page(7.2, 5.0 if rotors else 3.6)
            panels = figure.subplots(3 if rotors else 2, 1, sharex=True)
            axes = LegAxes(panels[0], panels[1] if rotors else None, panels[-1])
        duration_s, bands = (_six_stages if rotors else _constant_load)(mission, way, axes)
        heading = f"{printed(mission.name)}: leg {printed(start)} → {printed(end)}"
        heading += f", {math.hypot(*way):.1f} m in {duration_s:.2f} s"
        axes.speed.set_title(heading, pad=NAMES_PT if rotors else 6.0)
        axes.current.set_xlabel("time since the leg began $t$ [s]")
        panels = [ax for ax in axes if ax is not None]
        group_thousands(*panels)
        settle(axes.speed)
        if bands:
            draw_bands(panels, bands)
    return axes


def _displacement(mission: Mission, start: str, end: str) -> tuple[float, float, float]:
    """End minus start [m]; an error where no leg leads there."""
    where = build_places(mission, prisms(mission))
    faults = [
        Fault(option, repr(name), f"one of {_shown(where)}")
        for option, name in (("start", start), ("end", end))
        if name not in where.names
    ]
    if faults:
        raise InputError(faults)
    positions = where.position_m[[where.names.index(name) for name in (start, end)]]
    x, y, z = (positions[1] - positions[0]).tolist()
    here = f"the leg {start} → {end}"
    if math.isnan(x):
        raise InputError(f"{here} cannot be flown: there is no hover point within reach")
    if x == y == z == 0.0:
        raise InputError(f"{here} has no length")
    if mission.flight.model == "rotors":
        airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
        why = flight.impossible(airframe, motor, mission.wind.force_N)
        if why is not None:
            raise InputError(f"{here} cannot be flown: {why}")
    return x, y, z


def _shown(where: Places) -> str:
    return ", ".join(where.names[:12]) + (", …" if len(where.names) > 12 else "")


def _six_stages(mission: Mission, way: tuple[float, float, float], axes: LegAxes) -> Drawn:
    """Draw a leg of the six-stage model."""
    airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
    flown = flight.leg(airframe, motor, way, mission.wind.force_N)
    force_N = airframe.external_force_N(mission.wind.force_N)
    duration_s = float(flown.loads.duration_s)
    durations_s = [float(each) for each in flown.loads.durations_s]
    edges = np.cumsum([0.0, *durations_s, HOVER_SHARE * duration_s])
    pitch, roll, current, times = [], [], [], []
    for number, (begin, finish) in enumerate(itertools.pairwise(edges), 1):
        if begin == finish:
            continue
        time_s = _within(begin, finish)
        state = state_at(motor, force_N, flown, time_s)
        freezes = number == FREEZING_STAGE
        speed = np.full(len(time_s), flown.peak_speed_m_s) if freezes else state.speed_m_s
        axes.speed.plot(time_s, speed, color=BLACK, linestyle=":" if freezes else "-")
        times.append(time_s)
        pitch.append(np.rad2deg(state.attitude.pitch_rad))
        roll.append(np.rad2deg(state.attitude.roll_rad))
        current.append(state.current_A)
    time_s = np.concatenate(times)
    axes.speed.plot([], [], color=BLACK, label="speed along the path")
    axes.speed.plot(
        [], [], ":", color=BLACK, label="stage 3: position frozen,\nspeed kept for stage 4"
    )
    peak = float(flown.peak_speed_m_s)
    axes.speed.set(ylabel="speed [m/s]", ylim=(-0.04 * peak, 1.12 * peak))
    _legend(axes.speed)
    if axes.attitude is not None:
        axes.attitude.plot(time_s, np.concatenate(pitch), color=BLUE, label="pitch $ψ_p$")
        dashes = (0.0, (4.0, 1.5))
        axes.attitude.plot(
            time_s, np.concatenate(roll), color=VERMILLION, linestyle=dashes, label="roll $ψ_r$"
        )
        axes.attitude.set(ylabel="attitude [°]")
        _legend(axes.attitude)
    axes.current.plot(time_s, np.concatenate(current), color=BLACK)
    axes.current.set(
        ylabel="current drawn by\nthe rotors [A]", ylim=margins([0.0, *np.concatenate(current)])
    )
    for ax in (each for each in axes if each is not None):
        ax.set_xlim(0.0, edges[-1])
    _stage_legend(axes.current)
    numbered = zip(NAMES, edges[:-1], edges[1:], strict=True)
    return duration_s, [
        Band(begin, finish, COLOURS[name], (f"{number} {name}", f"{number}"))
        for number, (name, begin, finish) in enumerate(numbered, 1)
        if begin < finish
    ]


def _within(begin: float, finish: float) -> Floats:
    """Moments of a stage, its last just before the next begins."""
    return np.linspace(begin, np.nextafter(finish, begin), POINTS_PER_STAGE)


def _constant_load(mission: Mission, way: tuple[float, float, float], axes: LegAxes) -> Drawn:
    """Draw a leg of the regime loads."""
    given = mission.flight
    assert given.model == "regimes"
    rate = given.acceleration_m_s2
    loads, peak = regime_leg(
        math.hypot(*way),
        rate,
        given.flight_current_A,
        given.flight_power_W,
        math.inf if given.max_speed_m_s is None else given.max_speed_m_s,
    )
    duration_s, rise_s = float(loads.duration_s), float(peak) / rate
    corners = [0.0, rise_s, duration_s - rise_s, duration_s]
    axes.speed.plot(corners, [0.0, peak, peak, 0.0], color=BLACK)
    axes.speed.set(ylabel="speed [m/s]", ylim=(-0.04 * peak, 1.12 * peak))
    axes.current.plot([0.0, duration_s], [given.flight_current_A] * 2, color=BLACK)
    axes.current.set(
        ylabel="current drawn\nin flight [A]", ylim=(0.0, 1.2 * given.flight_current_A)
    )
    for ax in (axes.speed, axes.current):
        ax.set_xlim(0.0, duration_s)
    return duration_s, []


def _legend(ax: Axes) -> None:
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


def _stage_legend(ax: Axes) -> None:
    kinds = {name: [n for n, each in enumerate(NAMES, 1) if each == name] for name in NAMES}
    entries = [
        swatch(COLOURS[name], f"{name} ({', '.join(map(str, numbers))})")
        for name, numbers in kinds.items()
    ]
    ax.legend(handles=entries, loc="center left", bbox_to_anchor=(1.0, 0.5), title="stages")

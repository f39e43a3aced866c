"""One leg over time: speed, attitude and current in its stages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes

from optuav.errors import Fault, InputError
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.network.obstacles import prisms
from optuav.network.places import build_places
from optuav.physics import flight
from optuav.physics.flight import regime_leg
from optuav.physics.trajectory import state_at
from optuav.plots import style
from optuav.plots.bands import NAMES_PT, Band, draw_bands, swatch
from optuav.plots.style import BLACK

STAGES = (*flight.STAGES, "hover")
"""The stages of the six-stage model, and the hover after them."""
COLOURS = {
    "turn": style.ORANGE,
    "accelerate": style.BLUE,
    "brake": style.SKY,
    "hover": style.GREEN,
}
HOVER_SHARE = 0.06
"""Duration of the hover that is shown after the leg, as a share of the leg's."""
FREEZING_STAGE = 3
POINTS_PER_STAGE = 129


class LegAxes(NamedTuple):
    """Speed, attitude and current over time; legs of constant load have no attitude."""

    speed: Axes
    attitude: Axes | None
    current: Axes


@style.applied()
def leg(mission: Mission, start: str, end: str) -> LegAxes:
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
    grid = style.page(5.0 if rotors else 3.6).subplots(3 if rotors else 2, 1, sharex=True)
    axes = LegAxes(grid[0], grid[1] if rotors else None, grid[-1])
    draw = _draw_six_stages if rotors else _draw_constant_load
    duration_s, bands = draw(mission, displacement_m, axes)
    ends, length_m = " → ".join(map(style.printed, (start, end))), math.hypot(*displacement_m)
    heading = f"{style.printed(mission.name)}: leg {ends}, {length_m:.1f} m in {duration_s:.2f} s"
    axes.speed.set_title(heading, pad=NAMES_PT if rotors else 6.0)
    axes.current.set_xlabel("time since the leg began $t$ [s]")
    panels = [ax for ax in axes if ax is not None]
    for ax in panels:
        ax.set_xlim(0.0, bands[-1].end_s if bands else duration_s)
    style.group_thousands(*panels)
    style.settle(axes.speed)
    draw_bands(panels, bands)
    return axes


def _displacement(mission: Mission, start: str, end: str) -> tuple[float, float, float]:
    """End minus start [m]; an error where no leg leads there."""
    known = build_places(mission, prisms(mission))
    names = ", ".join(known.names[:12]) + (", …" if len(known.names) > 12 else "")
    faults = [
        Fault(option, repr(name), f"one of {names}")
        for option, name in (("start", start), ("end", end))
        if name not in known.names
    ]
    if faults:
        raise InputError(faults)
    positions = known.position_m[[known.names.index(name) for name in (start, end)]]
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


def _draw_six_stages(
    mission: Mission, displacement_m: tuple[float, float, float], axes: LegAxes
) -> tuple[float, list[Band]]:
    """Draw a leg of the six-stage model; its duration [s], and its stages."""
    airframe, motor = vehicle.airframe(mission), vehicle.motor(mission)
    flown = flight.leg(airframe, motor, displacement_m, mission.wind.force_N)
    force_N = airframe.external_force_N(mission.wind.force_N)
    duration_s, peak_m_s = float(flown.loads.duration_s), float(flown.peak_speed_m_s)
    lengths_s = [*map(float, flown.loads.durations_s), HOVER_SHARE * duration_s]
    stages = zip(STAGES, pairwise(np.cumsum([0.0, *lengths_s]).tolist()), strict=True)
    lasting = [(n, name, *ends) for n, (name, ends) in enumerate(stages, 1) if ends[0] < ends[1]]
    bands = [
        Band(begin, finish, COLOURS[name], (f"{n} {name}", f"{n}"))
        for n, name, begin, finish in lasting
    ]
    # The last moment is just before the next stage begins.
    times_s = [
        np.linspace(begin, np.nextafter(finish, begin), POINTS_PER_STAGE)
        for *_, begin, finish in lasting
    ]
    time_s = np.concatenate(times_s)
    state = state_at(motor, force_N, flown, time_s)
    parts = np.split(state.speed_m_s, len(lasting))
    for (number, *_), within_s, speed_m_s in zip(lasting, times_s, parts, strict=True):
        freezes = number == FREEZING_STAGE
        shown = np.full(len(within_s), peak_m_s) if freezes else speed_m_s
        axes.speed.plot(within_s, shown, color=BLACK, linestyle=":" if freezes else "-")
    axes.speed.set(ylabel="speed [m/s]", ylim=(-0.04 * peak_m_s, 1.12 * peak_m_s))
    frozen = "stage 3: position frozen,\nspeed kept for stage 4"
    speed = style.entry("speed along the path", BLACK)
    _legend_beside(axes.speed, [speed, style.entry(frozen, BLACK, linestyle=":")])
    if axes.attitude is not None:
        pitch = style.entry("pitch $ψ_p$", style.BLUE)
        roll = style.entry("roll $ψ_r$", style.VERMILLION, linestyle=(0.0, (4.0, 1.5)))
        attitude = state.attitude
        for look, angle_rad in ((pitch, attitude.pitch_rad), (roll, attitude.roll_rad)):
            (line,) = axes.attitude.plot(time_s, np.rad2deg(angle_rad), color=look.get_color())
            line.set_dashes((4.0, 1.5) if look is roll else ())
        axes.attitude.set(ylabel="attitude [°]")
        _legend_beside(axes.attitude, [pitch, roll])
    axes.current.plot(time_s, state.current_A, color=BLACK)
    limits = style.margins([0.0, *state.current_A])
    axes.current.set(ylabel="current drawn by\nthe rotors [A]", ylim=limits)
    numbers = {kind: [n for n, each in enumerate(STAGES, 1) if each == kind] for kind in STAGES}
    words = {kind: f"{kind} ({', '.join(map(str, own))})" for kind, own in numbers.items()}
    entries = [swatch(COLOURS[kind], words[kind]) for kind in words]
    _legend_beside(axes.current, entries, "stages")
    return duration_s, bands


def _legend_beside(ax: Axes, handles: Sequence[Artist], title: str = "") -> None:
    corner = (1.0, 0.5)
    ax.legend(handles=handles, title=title or None, loc="center left", bbox_to_anchor=corner)


def _draw_constant_load(
    mission: Mission, displacement_m: tuple[float, float, float], axes: LegAxes
) -> tuple[float, list[Band]]:
    """Draw a leg of the regime loads; its duration [s], and no stages."""
    given = mission.flight
    assert given.model == "regimes"
    rate, current_A, cap_m_s = given.acceleration_m_s2, given.flight_current_A, given.max_speed_m_s
    cap_m_s = math.inf if cap_m_s is None else cap_m_s
    length_m = math.hypot(*displacement_m)
    loads, peak = regime_leg(length_m, rate, current_A, given.flight_power_W, cap_m_s)
    duration_s, rise_s = float(loads.duration_s), float(peak) / rate
    corners_s = [0.0, rise_s, duration_s - rise_s, duration_s]
    axes.speed.plot(corners_s, [0.0, peak, peak, 0.0], color=BLACK)
    axes.speed.set(ylabel="speed [m/s]", ylim=(-0.04 * peak, 1.12 * peak))
    axes.current.plot([0.0, duration_s], [current_A] * 2, color=BLACK)
    axes.current.set(ylabel="current drawn\nin flight [A]", ylim=(0.0, 1.2 * current_A))
    return duration_s, []

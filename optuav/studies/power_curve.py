"""The power of a UAV over its air speed, with the speeds of best endurance and of best range."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TypedDict

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, printable
from optuav.flight.model import FLIGHTS, FlightModel
from optuav.mission import Mission, load
from optuav.mission.messages import several, shown
from optuav.presentation.blocks import Block, Facts, Heading, Table
from optuav.presentation.numbers import fixed
from optuav.studies.results import Pictures, Result

POWER_UNITS = {"speed_m_s": "m/s", "rotor_power_W": "W", "battery_power_W": "W", "current_A": "A"}
POWER_HEADS = dict(
    zip(POWER_UNITS, ("speed", "rotor power", "battery power", "current"), strict=True)
)
SPEED_STEPS = 100  # Intervals up to the cap, if no speeds are given
PRINTED = 11  # Most rows of the printed table
FASTEST_M_S = 1e6
SPEEDS = "numbers, 0 <= x <= 1e6 [m/s], at least one"


class PowerAtSpeed(TypedDict):
    """A row of a power curve."""

    speed_m_s: float
    rotor_power_W: float
    battery_power_W: float
    current_A: float


@dataclass(frozen=True, kw_only=True, repr=False)
class PowerCurve(Result):
    """Power against airspeed, one row per speed.

    Parameters
    ----------
    speeds_m_s, rotor_power_W, battery_power_W, current_A
        (speed,) air speeds [m/s], the power at the rotors [W] (also `power_W`), and the power [W]
        and the current [A] of the battery. The battery's power is the rotors' divided by
        ``flight.efficiency``.
    hover_power_W
        Power of the hover at the rotors, in the mission's wind [W].
    best_endurance_m_s, best_endurance_power_W, best_range_m_s, best_range_power_W
        Air speeds of least power and of least energy per metre, up to ``flight.max_speed_m_s``, in
        air at rest [m/s], and the power at the rotors there [W].

    Examples
    --------
    >>> import optuav
    >>> curve = optuav.power_curve("relay-today", [0, 10, 20])
    >>> curve.rotor_power_W.round().tolist(), round(curve.best_endurance_m_s, 1)
    ([764.0, 562.0, 738.0], 12.3)
    """

    kind = "optuav power curve"
    units = POWER_UNITS
    rows: tuple[PowerAtSpeed, ...]
    hover_power_W: float
    best_endurance_m_s: float
    best_endurance_power_W: float
    best_range_m_s: float
    best_range_power_W: float

    @property
    def speeds_m_s(self) -> Floats:
        """(speed,) air speeds [m/s]."""
        return np.array([row["speed_m_s"] for row in self.rows])

    @property
    def rotor_power_W(self) -> Floats:
        """(speed,) power at the rotors [W]."""
        return np.array([row["rotor_power_W"] for row in self.rows])

    @property
    def power_W(self) -> Floats:
        """(speed,) `rotor_power_W` [W]."""
        return self.rotor_power_W

    @property
    def battery_power_W(self) -> Floats:
        """(speed,) power that the battery delivers [W]."""
        return np.array([row["battery_power_W"] for row in self.rows])

    @property
    def current_A(self) -> Floats:
        """(speed,) current that the battery delivers [A]."""
        return np.array([row["current_A"] for row in self.rows])

    @property
    def named(self) -> dict[str, tuple[float, float]]:
        """Speeds that stand out [m/s], with the power at the rotors there [W]."""
        return {
            "best endurance": (self.best_endurance_m_s, self.best_endurance_power_W),
            "best range": (self.best_range_m_s, self.best_range_power_W),
        }

    def blocks(self) -> Iterator[Block]:
        """Yield the hover, the speeds that stand out, and a table of the curve."""
        yield Heading(f"Power against airspeed: {printable(self.mission.name)}")
        hover = f"{fixed(self.hover_power_W)} W", "at the rotors, in the mission's wind"
        named = (
            (
                words.capitalize(),
                f"{fixed(power)} W",
                f"at the rotors, {fixed(speed)} m/s in still air",
            )
            for words, (speed, power) in self.named.items()
        )
        yield Facts([("Hover", *hover), *named])
        step = -(-(len(self.rows) - 1) // (PRINTED - 1)) or 1
        heads = (f"{POWER_HEADS[name]} [{unit}]" for name, unit in POWER_UNITS.items())
        columns = self.speeds_m_s, self.rotor_power_W, self.battery_power_W, self.current_A
        rows = np.column_stack(columns)[::step].tolist()
        yield Table(["", *heads], [["", *map(fixed, row)] for row in rows])

    def pictures(self) -> Pictures:
        """Yield the power in level flight, with hover and the speeds that stand out."""
        from optuav.plots import Line, Mark, curves
        from optuav.plots.style import titled

        hover = Line("hover, in the mission's wind", [0.0], [self.hover_power_W], "o")
        named = {words: speed for words, (speed, _) in self.named.items()}
        ax = curves(
            [Line("level flight", self.speeds_m_s, self.rotor_power_W), hover],
            title=titled(self.mission.name, "power by air speed"),
            x_label="air speed $V$ [m/s]",
            y_label="power at the rotors $P$ [W]",
            marks=[
                Mark(speed, f"{words}: {fixed(speed, 1)} m/s") for words, speed in named.items()
            ],
            y_from_zero=True,
        )
        yield "power.png", ax


def power_curve(
    mission: Mission | str | Path, speeds_m_s: Iterable[float] | None = None
) -> PowerCurve:
    """Compute the power of level flight against airspeed, and its best speeds.

    Parameters
    ----------
    mission
        A mission whose flight model has such a curve ("rotary-wing" has), its name or path.
    speeds_m_s
        Air speeds [m/s], 0 to 1e6; by default 101 from 0 to ``flight.max_speed_m_s``.

    Returns
    -------
    PowerCurve
        With a picture (``plot()``), a table (``to_frame()``) and the named speeds.

    Raises
    ------
    InputError
        If the flight model has no power over speed, or a speed is not such a number.

    References
    ----------
    Y. Zeng, J. Xu, R. Zhang, "Energy minimization for wireless communication with rotary-wing UAV",
    IEEE Transactions on Wireless Communications, 2019, eq (12).

    Examples
    --------
    >>> import optuav
    >>> curve = optuav.power_curve("relay-today")
    >>> print(f"{curve.best_range_m_s:.1f} m/s")
    17.9 m/s
    """
    whole = load(mission)
    flight = whole.flight_model
    hover = flight.power_over_speed(0.0)
    if hover is None:
        silent = FlightModel.power_over_speed
        able = [name for name, model in FLIGHTS.items() if model.power_over_speed is not silent]
        words = f"{' or '.join(map(shown, able))}, which has a curve of power against airspeed"
        raise InputError([Fault("flight.model", shown(whole.flight.model), words)])
    if speeds_m_s is None:
        speeds = np.linspace(0.0, float(hover.max_speed_m_s), SPEED_STEPS + 1)
    else:
        speeds = np.array(several("speeds_m_s", speeds_m_s, Real, SPEEDS), dtype=float)
        if not ((speeds >= 0.0) & (speeds <= FASTEST_M_S)).all():
            raise InputError([Fault("speeds_m_s", shown(speeds.tolist()), SPEEDS)])
    level = flight.power_over_speed(speeds)
    assert level is not None
    columns = speeds, level.power_W, level.drawn.power_W, level.drawn.current_A
    (endurance, endurance_W), (furthest, furthest_W) = level.best_endurance, level.best_range
    return PowerCurve(
        mission=whole,
        rows=tuple(
            PowerAtSpeed(
                speed_m_s=speed_m_s, rotor_power_W=rotor_W, battery_power_W=battery_W, current_A=A
            )
            for speed_m_s, rotor_W, battery_W, A in np.stack(columns, axis=1).tolist()
        ),
        hover_power_W=float(level.hover_power_W),
        best_endurance_m_s=float(endurance),
        best_endurance_power_W=float(endurance_W),
        best_range_m_s=float(furthest),
        best_range_power_W=float(furthest_W),
    )

"""The power of a UAV over its air speed, with the speeds of best endurance and of best range."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from numbers import Real
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.errors import Fault, InputError, printable
from optuav.flight.model import FLIGHTS, FlightModel
from optuav.mission import Mission, load
from optuav.mission.messages import several, shown
from optuav.plan.summary import tabulated
from optuav.studies.results import Pictures, Results, ResultsWithFacts, labelled_rows

UNITS = {"speed_m_s": "m/s", "rotor_power_W": "W", "battery_power_W": "W", "current_A": "A"}
HEADS = dict(zip(UNITS, ("speed", "rotor power", "battery power", "current"), strict=True))
STEPS = 100  # Intervals up to the cap, if no speeds are given
PRINTED = 11  # Most rows of the printed table
NAMED = {"best_endurance": "best endurance", "best_range": "best range"}
FASTEST_M_S = 1e6
SPEEDS = "numbers, 0 <= x <= 1e6 [m/s], at least one"


class PowerCurve(ResultsWithFacts):
    """The power over air speed, one row per speed.

    Parameters
    ----------
    speeds_m_s, rotor_power_W, battery_power_W, current_A
        (speed,) air speeds [m/s], the power at the rotors [W] (also `power_W`), and the power [W]
        and the current [A] of the battery; it delivers more by 1 over ``flight.efficiency``.
    hover_power_W
        At the rotors, in the mission's wind [W].
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

    @property
    def speeds_m_s(self) -> Floats:
        """(speed,) air speeds [m/s]."""
        return self._column("speed_m_s")

    @property
    def rotor_power_W(self) -> Floats:
        """(speed,) power at the rotors [W]."""
        return self._column("rotor_power_W")

    @property
    def power_W(self) -> Floats:
        """(speed,) `rotor_power_W` [W]."""
        return self.rotor_power_W

    @property
    def battery_power_W(self) -> Floats:
        """(speed,) power that the battery delivers [W]."""
        return self._column("battery_power_W")

    @property
    def current_A(self) -> Floats:
        """(speed,) current that the battery delivers [A]."""
        return self._column("current_A")

    def _column(self, name: str) -> Floats:
        return np.array([row[name] for row in self.rows])


def power_curve(
    mission: Mission | str | Path, speeds_m_s: Iterable[float] | None = None
) -> PowerCurve:
    """Find the power in level flight over the air speed, and the speeds that stand out.

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
        words = f"{' or '.join(map(shown, able))}, which tells the power over the air speed"
        raise InputError([Fault("flight.model", shown(whole.flight.model), words)])
    if speeds_m_s is None:
        speeds = np.linspace(0.0, float(hover.max_speed_m_s), STEPS + 1)
    else:
        speeds = np.array(several("speeds_m_s", speeds_m_s, Real, SPEEDS), dtype=float)
        if not ((speeds >= 0.0) & (speeds <= FASTEST_M_S)).all():
            raise InputError([Fault("speeds_m_s", shown(speeds.tolist()), SPEEDS)])
    level = flight.power_over_speed(speeds)
    assert level is not None
    columns = speeds, level.power_W, level.drawn.power_W, level.drawn.current_A
    rows = labelled_rows(UNITS, np.stack(columns, axis=1).tolist())
    facts = {"hover_power_W": float(level.hover_power_W)}
    for name in NAMED:
        speed, power = getattr(level, name)
        facts |= {f"{name}_m_s": float(speed), f"{name}_power_W": float(power)}
    return PowerCurve("optuav power curve", whole, facts, UNITS, rows, _show, _draw)


def _show(curve: Results) -> Iterator[str]:
    facts = curve.facts
    yield f"Power over air speed: {printable(curve.mission.name)}"
    yield f"Hover            in the mission's wind  {facts['hover_power_W']:9.2f} W at the rotors"
    for name, words in NAMED.items():
        speed, power = facts[f"{name}_m_s"], facts[f"{name}_power_W"]
        yield f"{words.capitalize():15}{speed:9.2f} m/s in still air  {power:9.2f} W at the rotors"
    yield ""
    step = -(-(len(curve.rows) - 1) // (PRINTED - 1)) or 1
    head = [f"{HEADS[name]} [{unit}]" for name, unit in UNITS.items()]
    lines = ([f"{value:.2f}" for value in row.values()] for row in curve.rows[::step])
    yield from tabulated([("", *head), *(("", *line) for line in lines)])


def _draw(curve: Results) -> Pictures:
    """Power in level flight, with hover and the speeds that stand out."""
    from optuav.plots import Line, Mark, curves

    facts, name = curve.facts, curve.mission.name
    speeds, powers = ([row[key] for row in curve.rows] for key in ("speed_m_s", "rotor_power_W"))
    hover = Line("hover, in the mission's wind", [0.0], [facts["hover_power_W"]], "o")
    named = {words: facts[f"{key}_m_s"] for key, words in NAMED.items()}
    ax = curves(
        [Line("level flight", speeds, powers), hover],
        title=f"Power over air speed: {printable(name)}",
        x_label="air speed $V$ [m/s]",
        y_label="power at the rotors $P$ [W]",
        marks=[Mark(speed, f"{words}: {speed:.1f} m/s") for words, speed in named.items()],
        y_from_zero=True,
    )
    yield "power.png", ax

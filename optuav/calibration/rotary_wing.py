"""The power of a rotary wing over its air speed from steady level flight."""

import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv, separable
from optuav.calibration.fit import Estimate, Fit, curve, finished
from optuav.calibration.logs import measurements
from optuav.calibration.logs.flight_log import FlightLog
from optuav.calibration.logs.read import flight_log_in
from optuav.errors import refuse
from optuav.mission.messages import number
from optuav.physics.rotary_wing import PowerCoefficients, power
from optuav.presentation.numbers import figure

LEAST_SPEEDS = 6
LOG = csv.Format(
    {"speed": "speed", "power": "power"},
    least=LEAST_SPEEDS,
    also={"battery_power": ("power", "power")},
    unread=("rotor_power_W", "current_A"),  # which `optuav power` shows beside the battery's power
)
KEYS = tuple(f"flight.{name}" for name in PowerCoefficients._fields)
BLADES, LIFT, INDUCED, TIP, FUSELAGE = range(len(KEYS))  # places of the coefficients
ORDER = (INDUCED, TIP, BLADES, LIFT, FUSELAGE)  # in a fit: the last three enter linearly
INDUCED_M_S, TIP_M_S = (0.1, 100.0), (1.0, 340.0)  # ranges; no tip is faster than sound
STARTS = tuple(itertools.product(np.geomspace(0.5, 50.0, 10), np.geomspace(20.0, 330.0, 5)))
AT_END = 1e-3  # relative distance to an end of a range that is none
FASTEST = (1.0, 60.0, "m/s")  # usual largest speeds of a log, by least and most
INDUCED_SPEED = (1.0, 12.0, "m/s")  # usual ones
DISC_AREA = (3e-3, 100.0, "m2")  # usual areas of all rotors
AIR_KG_M3 = 1.225
OVER_GROUND = "speeds of flight logs are over ground: fly in calm air, or there and back"


def fit_rotary_wing(
    files: str | Path | Iterable[str | Path], *, columns: Mapping[str, str] | None = None
) -> Fit:
    r"""Fit the coefficients of the power against airspeed.

    Parameters
    ----------
    files
        CSV files with ``speed_m_s`` (or ``speed_km_h``), the air speed in steady level flight, and
        ``power_W`` (or ``battery_power_W``, and in ``mW`` or ``kW``), which the battery delivers:
        at least six speeds, hover (0) among them if known. Or logs of PX4 (``.ulg``), ArduPilot
        (``.bin``), AirData or DJI (CSV), in which steady level flight is recognised, see
        `Fit.logs`; its speeds are over ground.
    columns
        For a CSV of another program: the column that each of its headings stands for, such as
        ``{"Amps": "current_A"}``.

    Returns
    -------
    Fit
        ``blade_power_W``, ``induced_power_W``, ``induced_speed_m_s``, ``tip_speed_m_s`` and
        ``parasite_W_s3_m3`` of [flight] for ``flight.model = "rotary-wing"``, with 95 % intervals
        by profile likelihood; tips are at most as fast as sound, 340 m/s. As the power is the
        battery's, ``flight.efficiency`` is 1 beside them. The fit returns all five, with a warning
        for those that the data do not determine, because only all five together reproduce the
        power. If the data determine none of them, it returns none.

    Raises
    ------
    InputError
        With every fault of the files, or if a coefficient is outside the range of its key.

    References
    ----------
    .. [1] Y. Zeng, J. Xu, R. Zhang, "Energy minimization for wireless communication with
       rotary-wing UAV", IEEE Transactions on Wireless Communications, 2019, eq (12).

    Examples
    --------
    >>> import optuav, pathlib, tempfile
    >>> log = {0: 168.5, 4: 149.4, 8: 129.7, 12: 127.6, 16: 144.8, 20: 179.5, 24: 231.1}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder) / "log.csv"
    ...     lines = ["speed_m_s,power_W", *(f"{speed},{power}" for speed, power in log.items())]
    ...     _ = file.write_text("\n".join(lines))
    ...     fitted = optuav.fit_rotary_wing(file)
    >>> [value.key for value in fitted.values][2:4]
    ['flight.induced_speed_m_s', 'flight.tip_speed_m_s']
    """
    flown, notes = list[FlightLog](), list[str]()

    def read_log(path: Path) -> tuple[csv.Measurements, tuple[str, ...]] | None:
        if log := flight_log_in(path, columns or {}):
            points, log = measurements.steady(log)
            flown.append(log)
            shares = [*log.shares("are steady")]
            notes.extend((f"{log.source}: {log.format}", *log.notes, *shares))
            table, left_out = _checked(points, shares)
            return table, (*log.warnings, *left_out, OVER_GROUND)
        return None

    sources, logs = csv.read_all(files, [LOG], _checked, read_log)
    tables, left_out = zip(*logs, strict=True)
    parts = [(table.numbers["speed"], table.numbers["power"]) for table in tables]
    speed, drawn_W = map(np.concatenate, zip(*parts, strict=True))
    estimated = _estimate(speed, drawn_W)
    seen = "power", "W", drawn_W, drawn_W + estimated.residuals
    coefficients = PowerCoefficients(*estimated.values.tolist())

    def along(speed_m_s: Floats) -> Floats:
        return np.asarray(power(coefficients, speed_m_s))

    panel = curve(*seen, speed, "air speed $V$ [m/s]", along)
    of_columns = (words for table in tables for words in table.doubts())
    doubts = dict.fromkeys(itertools.chain(*left_out, of_columns, _doubts(estimated, speed)))
    data = f"{len(speed)} points of steady level flight"
    values = estimated.values_for_mission(f"fitted to {len(speed)} points")
    said = (*estimated.warnings, *doubts)
    result = Fit("rotary-wing", sources, data, values, (panel,), said)
    result = replace(result, notes=tuple(notes), logs=tuple(flown))
    if result.changes:  # otherwise the mission keeps its own
        result = replace(result, settings={"flight.model": "rotary-wing", "flight.efficiency": 1.0})
    return finished(replace(result, extends="relay-today"))


def _estimate(speed_m_s: Floats, drawn_W: Floats) -> Estimate:
    """Fit the coefficients, in the order of their keys."""

    def columns(others: Floats) -> tuple[Floats, Floats]:
        blades, lift, fuselage = np.identity(3)  # one of each column
        induced_m_s, tip_m_s = others
        unit = PowerCoefficients(blades, lift, induced_m_s, tip_m_s, fuselage)
        return np.asarray(power(unit, speed_m_s[:, None])), drawn_W

    keys = [KEYS[place] for place in ORDER]
    linear = [allowed.ge or 0.0 for key in keys[2:] if (allowed := number(key))]
    problem = separable.Problem(columns, (INDUCED_M_S, TIP_M_S), linear)
    freedom = len(speed_m_s) - len(keys)
    return separable.estimate(keys, problem, problem.best(STARTS), freedom).ordered(KEYS)


def _doubts(estimated: Estimate, speed_m_s: Floats) -> Iterator[str]:
    """Doubts about units, about rotors that no UAV has, and about the power past the log."""
    fastest = float(np.max(speed_m_s))
    yield from csv.unit_doubts("the largest speed", fastest, "speed", "speed", FASTEST)
    if {KEYS[LIFT], KEYS[INDUCED]}.isdisjoint(estimated.undetermined):
        lift_W, induced_m_s = estimated.values[[LIFT, INDUCED]].tolist()
        words = "the induced speed that fits"
        yield from csv.unit_doubts(words, induced_m_s, "speed", "speed", INDUCED_SPEED)
        area_m2 = lift_W / (2.0 * AIR_KG_M3 * induced_m_s**3)  # by P = F v and F = 2 ρ A v²
        words = "the area of the rotors that fits"
        yield from csv.unit_doubts(words, area_m2, "power", "power", DISC_AREA)
    if len(estimated.undetermined) == len(KEYS):
        return
    if estimated.undetermined:
        yield f"the power is unsure above {figure(fastest, 3)} m/s, the largest speed of the log"
    tip_m_s, (least, most) = float(estimated.values[TIP]), TIP_M_S
    if min(abs(tip_m_s / end - 1.0) for end in TIP_M_S) < AT_END:
        words = f"an end of its range, {figure(least)} to {figure(most)} m/s"
        yield f"the tip speed that fits is {figure(tip_m_s, 4)} m/s, {words}: it is no measurement"


def _checked(
    log: csv.Measurements, shares: Sequence[str] = ()
) -> tuple[csv.Measurements, tuple[str, ...]]:
    """The lines of known values, and sentences on the others; the shares of a log say more.

    With enough different speeds, none below 0, and powers above 0.
    """
    unknown = {column: log.unknown(column) for column in ("speed", "power")}
    left_out = [*log.not_read()]
    left_out += [words for column, rows in unknown.items() for words in log.left_out(column, rows)]
    table = log.only(~np.any([*unknown.values()], axis=0))
    faults = [*table.faults(table.numbers["speed"] < 0.0, "speed", "a number, x >= 0")]
    faults += table.faults(table.numbers["power"] <= 0.0, "power", "a number, x > 0")
    refuse([*faults, *table.few("speed", LEAST_SPEEDS, *left_out, *shares)])
    return table, tuple(left_out)

"""The power of a rotary wing over its air speed from steady level flight."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from optuav.arrays import Floats
from optuav.calibration import csv
from optuav.calibration.fit import Fit, curve, estimate, finished
from optuav.errors import refuse
from optuav.physics.rotary_wing import PowerCoefficients, power

LEAST_SPEEDS = 6
LOG = csv.Format({"speed": "speed", "power": "power"}, least=LEAST_SPEEDS)
KEYS = tuple(f"flight.{name}" for name in PowerCoefficients._fields)
INDUCED_M_S = (2.0, 5.0, 10.0)  # Starting values of v_0 for fits
TIP_M_S, BLADES = 120.0, 0.45  # Usual tip speed, and share of the blades in the hover power
PARASITE = 0.1  # Share of the fuselage in the power at the largest speed


def fit_rotary_wing(files: str | Path | Iterable[str | Path]) -> Fit:
    r"""Find the coefficients of the power over air speed.

    Parameters
    ----------
    files
        CSV files with ``speed_m_s`` (or ``speed_km_h``), the air speed in steady level flight, and
        ``power_W`` (or ``power_kW``) of the battery: at least six speeds, hover (0) among them if
        known.

    Returns
    -------
    Fit
        ``blade_power_W``, ``induced_power_W``, ``induced_speed_m_s``, ``tip_speed_m_s`` and
        ``parasite_W_s3_m3`` of [flight] for ``flight.model = "rotary-wing"``, with 95 % intervals.
        As the power is the battery's, ``flight.efficiency`` is 1 beside them.

    Raises
    ------
    InputError
        With every fault of the files, or if no mission may state a coefficient.

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
    sources, tables = csv.read_all(files, [LOG], _checked)
    parts = [(table.numbers["speed"], table.numbers["power"]) for table in tables]
    speed, drawn_W = map(np.concatenate, zip(*parts, strict=True))

    def modelled(values: Floats) -> Floats:
        return np.asarray(power(PowerCoefficients(*values), speed))

    slowest, fastest = int(np.argmin(speed)), int(np.argmax(speed))
    hover_W = float(drawn_W[slowest])
    fuselage = PARASITE * float(drawn_W[fastest]) / float(speed[fastest]) ** 3
    powers_W = BLADES * hover_W, (1.0 - BLADES) * hover_W
    starts = [(*powers_W, induced, TIP_M_S, fuselage) for induced in INDUCED_M_S]
    estimated = estimate(KEYS, lambda values: modelled(values) - drawn_W, starts)
    seen = "power", "W", drawn_W, modelled(estimated.values)
    panel = curve(*seen, speed, "air speed $V$ [m/s]")
    doubts = dict.fromkeys(words for table in tables for words in table.doubts())
    data = f"{len(speed)} points of steady level flight"
    values = estimated.stated(f"fitted to {len(speed)} points")
    found = Fit("rotary-wing", sources, data, values, (panel,), (*estimated.warnings, *doubts))
    settings = {"flight.model": "rotary-wing", "flight.efficiency": 1.0}
    return finished(replace(found, settings=settings, extends="relay-today"))


def _checked(table: csv.Measurements) -> csv.Measurements:
    """A file with enough different speeds, none below 0, and powers above 0."""
    speed, drawn_W = table.numbers["speed"], table.numbers["power"]
    faults = [*table.faults(speed < 0.0, "speed", "0 or above")]
    faults += table.faults(drawn_W <= 0.0, "power", "above 0")
    refuse([*faults, *table.few("speed", LEAST_SPEEDS)])
    return table

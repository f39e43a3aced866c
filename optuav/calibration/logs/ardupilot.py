"""DataFlash logs of ArduPilot, by pymavlink."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from optuav.arrays import Floats, Integers
from optuav.calibration.logs.samples import Pack, Readings, Velocity, side_by_side
from optuav.mission.files import refusal

INSTALL = 'python -m pip install "optuav[logs]"'
BATTERIES = ("BAT", "CURR")
CORES = ("XKF1", "NKF1", "EKF1")
MESSAGES: Mapping[str, tuple[str, ...]] = {
    **dict.fromkeys(BATTERIES, ("Curr", "Volt", "RemPct")),
    **dict.fromkeys(CORES, ("VN", "VE", "VD")),
    **{"GPS": ("Spd", "VZ"), "EV": ("Id",)},
}
EVENTS = {"armed": (10, 11), "landed": (18, 28)}
"""Numbers of the events that turn a state on and off."""


def read(path: Path) -> Readings:
    """Samples at the moments of the battery's messages."""
    try:
        from optuav.calibration.logs.dataflash import DAMAGED, messages
    except ImportError:
        words = f"is a DataFlash log of ArduPilot, which needs pymavlink: {INSTALL}"
        raise refusal(path, words) from None
    rows: dict[str, list[tuple[float, ...]]] = {}
    now_s, faults, broken = 0.0, list[str](), set[str]()
    for kind, values, codes in messages(path, MESSAGES, faults):
        if kind in CORES and values.get("C", values.get("I", 0)):
            continue
        try:
            if "TimeUS" in values:
                now_s = values["TimeUS"] / 1e6
            elif "TimeMS" in values and kind != "GPS":  # whose milliseconds are of a week
                now_s = values["TimeMS"] / 1e3
            # Firmware of before 2015 logs whole hundredths of amperes and volts.
            size = 0.01 if kind in BATTERIES and codes["Curr"] in "bBhHiI" else 1.0
            numbers = (size * float(values.get(name, np.nan)) for name in MESSAGES[kind])
            row = (now_s, *numbers)
        except (KeyError, TypeError, ValueError):  # No such column, texts in place of numbers
            broken.add(kind)
            continue
        inst = values.get("Inst", values.get("Instance", 0))
        rows.setdefault(f"{kind}{inst}" if kind in BATTERIES else kind, []).append(row)
    series = {name: np.array(columns).T for name, columns in rows.items()}
    batteries = [name for kind in BATTERIES for name in sorted(series) if name[:-1] == kind]
    faults += [f"the format of {kind} is damaged: it is not read" for kind in sorted(broken)]
    if not batteries and broken:
        raise refusal(path, "; ".join([DAMAGED, *faults]))
    if not batteries:
        words = "has no BAT or CURR messages: ArduPilot logged no battery"
        raise refusal(path, "; ".join([words, *faults]))
    of_packs = [name for name in batteries if name[:-1] == batteries[0][:-1]]
    packs = [
        Pack(t, amps, volts, left / 100.0)
        for t, amps, volts, left in map(series.__getitem__, of_packs)
    ]
    velocity = next((Velocity(*series[kind]) for kind in CORES if kind in series), None)
    if velocity is None and "GPS" in series:
        t, ground, down = series["GPS"]
        velocity = Velocity(t, ground, np.zeros_like(ground), down)
    states = _states(*series["EV"]) if "EV" in series else {}
    return Readings(*side_by_side(packs, velocity, states), faults, bool(faults))


def _states(time_s: Floats, events: Floats) -> dict[str, tuple[Floats, Integers]]:
    """Moments and values of each state that events turn on (1) and off (0)."""
    states = dict[str, tuple[Floats, Integers]]()
    for key, (on, off) in EVENTS.items():
        if np.any(changes := np.isin(events, (on, off))):
            values = (events[changes] == on).astype(int)
            # Before its first change a state was the other one
            begins_s = np.append(-np.inf, time_s[changes])
            states[key] = begins_s, np.append(1 - values[0], values)
    return states

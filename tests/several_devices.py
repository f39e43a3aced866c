"""Missions over three and over eight devices, for pictures, files and studies of them."""

from __future__ import annotations

from functools import cache

import optuav

THREE = {"west": (400, 2600, 0), "north": (1000, 3000, 0), "east": (1700, 2400, 0)}
EIGHT = {
    **{"sensor-6": (1600, 2600, 0), "sensor-8": (1950, 2250, 0), "sensor-7": (1750, 2200, 0)},
    **{"sensor-5": (1300, 2950, 0), "sensor-4": (1000, 2700, 0), "sensor-3": (900, 3100, 0)},
    **{"sensor-1": (150, 2350, 0), "sensor-2": (500, 2900, 0)},
}
"""Devices in an order that can be flown."""
CLOSE = {"market": (600, 450, 0), "harbour": (150, 700, 0), "school": (850, 150, 0)}
"""Devices of `three-sensors` whose hover points lie within 70 m of each other."""
PLACE = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4, "earth.altitude_m": 34.0}


def _over(devices: dict[str, tuple[int, int, int]], **changes: object) -> optuav.Mission:
    listed = [{"name": name, "position_m": [*at_m]} for name, at_m in devices.items()]
    return optuav.load("paper").replace({**PLACE, "devices": listed, **changes})


@cache
def three() -> optuav.Mission:
    """The first of the check numbers: `paper` until 1800 s over three devices, equal shares."""
    return _over(THREE, **{"limits.deadline_s": 1800, "name": "three"})


@cache
def eight() -> optuav.Mission:
    """Eight devices whose discs overlap, with packs that last."""
    changes = {"limits.deadline_s": 2400, "battery.capacity_As": 90_000, "name": "eight"}
    return _over(EIGHT, **changes)


@cache
def plan_over_close() -> optuav.Plan:
    """The best plan over devices that are served from nearly one place."""
    listed = [{"name": name, "position_m": [*at_m]} for name, at_m in CLOSE.items()]
    return optuav.solve(optuav.load("three-sensors").replace({"devices": listed}))


@cache
def plan_over_three() -> optuav.Plan:
    """Its best plan: east, north, a rest on b9, west."""
    return optuav.solve(three())


@cache
def plan_over_eight() -> optuav.Plan:
    """Its best plan in one order, with a rest between."""
    return optuav.solve(eight(), optuav.P1(device_order=tuple(EIGHT)))

"""States that a lecture starts from, made from a mission."""

import math
from functools import lru_cache
from typing import Any

from formulations.p1 import P1
from optuav.diagnosis.explain import explain
from optuav.explorer.state import stated_order
from optuav.mission import Mission
from optuav.network.network import build_network
from optuav.network.places import laser_reach
from optuav.solving import solve

BATTERY = {"perspective": "battery"}


@lru_cache(maxsize=4)
def presets(mission: Mission) -> list[dict[str, Any]]:
    """Return words, short words and state of each preset that a mission has."""
    found: list[Any] = [("The mission", "Mission", {})]
    plan = solve(mission, P1(device_order=stated_order(mission)), perspective="battery")
    if plan and plan.runs_dry_s is not None:
        found.append(("A plan that falls", "Fall", BATTERY))
    if plan and plan.rest_time_s:
        stops = [stop for stop in plan.stops if stop.duration_s]
        rest = {"building": next(e.at for e in stops if e.kind == "rest")}
        kinds = [stop.kind for stop in stops]
        order = "between" if "rest" in kinds[1:-1] else f"{kinds[0]}-first"
        price = {cost.key: cost for cost in explain(plan).prices}.get("limits.deadline_s")
        if price and price.matters and price.less < 1.0:
            # As charge binds too, the rest shrinks with the deadline along a straight line.
            time_s = mission.limits.deadline_s - plan.rest_time_s / (1.0 - price.less)
            changes = {"limits.deadline_s": round(time_s, 2)}
            kink = {**BATTERY, **rest, "order": order, "changes": changes}
            found.append(("The kink: no time for a rest", "Kink", kink))
        found.append(("Hover first or rest first", "Order", {**rest, "order": "rest-first"}))
    changes = {"battery.capacity_As": round(mission.battery.capacity_As / 20.0, 3)}
    found.append(("Too small a battery", "Small battery", {"changes": changes}))
    reach = laser_reach(mission, build_network(mission).places) if mission.laser else None
    if reach and 0.0 < (capped_W := reach.capped_W) < math.inf:
        changes = {"laser.power_W": round(0.5 * capped_W, -1)}
        found.append(("The reach of the laser", "Laser", {**BATTERY, "changes": changes}))
    return [dict(zip(("words", "short", "state"), preset, strict=True)) for preset in found]

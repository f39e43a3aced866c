"""What stands above a declared model in writing: the routes it speaks of, and its slots."""

from __future__ import annotations

from collections.abc import Iterator

from optuav.engines.ranges import cut_short
from optuav.mission.messages import written_out
from optuav.modelling import Model
from optuav.network.network import Network
from optuav.solving.planning import Part


def routes_of(worked_out: Network, part: Part) -> str:
    """Which routes a model speaks of."""
    orders = {worked_out.routes.order(route) for route in part.routes}
    rests = any(each.name == "rest_time_s" for each in part.model.variables)
    order = orders.pop() if len(orders) == 1 else "with a rest"
    words = order.replace("-", " ") if order and rests else "without a rest"
    return words + (f", {len(part.routes)} routes" if len(part.routes) > 1 else "")


def slots_of(model: Model, slot_s: float) -> str:
    """What slots ask of the unknowns; the model does not say it, counting is up to engines."""
    return ", ".join([f"in whole slots of {written_out(slot_s)} s", *_ends(model, slot_s)])


def _ends(model: Model, slot_s: float) -> Iterator[str]:
    """Where the slots of each unknown begin and end, if not where its bounds do."""
    cut = cut_short(model)
    for time in (each for each in model.variables if not each.binary):
        if time.first_slot > 0:
            yield f"{time.symbol} ≥ {written_out(time.first_slot * slot_s)} s"
        if time.name in cut:
            yield f"the last of {time.symbol} cut short by its bound"

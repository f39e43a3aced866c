"""Hover time that one percent more of a key of a flight model or a beam gives, solved again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from optuav.errors import InputError
from optuav.mission import Mission
from optuav.mission.keys import Key, as_stated, stated_keys
from optuav.network.network import Network
from optuav.network.variants import Variants
from optuav.presentation.numbers import significant
from optuav.solving.best_plans import best_plans, takes_arrays
from optuav.solving.question import Question

PERCENT = 0.01
NEGLIGIBLE = 1e-3  # Change of the objective that is as good as none, in a second's worth


@dataclass(frozen=True)
class KeyPrice:
    """What a percent of a key of the flight model, the beam or the drag brings.

    The programme has no parameter for such a key: it moves currents, powers and times of all routes
    at once. So the mission is solved again, over all routes.

    Parameters
    ----------
    key, unit
        The mission's key, and its unit.
    value
        Its present value, in its unit.
    less, more
        Change of the objective (s of hover) by one percent less and by one percent more: −∞ where
        that leaves no plan, NaN where it is no mission.

    Examples
    --------
    >>> import optuav
    >>> best, *_ = optuav.explain("relay-today").key_prices
    >>> best.key, best.more > 0.0
    ('flight.efficiency', True)
    """

    key: str
    unit: str
    value: float
    less: float
    more: float

    @property
    def size(self) -> float:
        """The larger change without its sign, to six digits: keys that do the same tie."""
        sides = (abs(side) for side in (self.less, self.more) if not math.isnan(side))
        return max((significant(side, 6) for side in sides), default=0.0)


def key_prices(question: Question, network: Network, second: float) -> tuple[KeyPrice, ...]:
    """The prices of the keys that flight model, beam and drag have, the largest first.

    A second of a time is worth `second` in the unit of the objective.

    None for a mission with the paper's own models, for an edited graph, and for questions whose
    plan is searched for.
    """
    mission, edited = network.mission, network.legs.edited.any() or network.places.edited.any()
    keys = [key for key in stated_keys(mission).values() if _of_a_model(mission, key)]
    if not keys or edited or not takes_arrays(mission, question):
        return ()
    now, one = np.array([key.now for key in keys]), np.eye(len(keys))
    values = now * (1.0 + PERCENT * np.vstack([0.0 * now, -one, one]))
    columns = dict(zip((key.name for key in keys), values.T, strict=True))
    objective = best_plans(Variants(network, columns), question).objective
    if np.isnan(objective[0]):
        return ()
    change = np.nan_to_num(objective[1:] - objective[0], nan=-np.inf)
    change[np.abs(change) < NEGLIGIBLE * second] = 0.0
    valid = [_valid(mission, dict(zip(columns, row, strict=True))) for row in values[1:].tolist()]
    change[np.logical_not(valid)] = np.nan
    units = ("1" if key.unit == "-" else key.unit for key in keys)
    rows = map(KeyPrice, columns, units, now.tolist(), *change.reshape(2, -1).tolist())
    return tuple(sorted(rows, key=lambda row: -row.size))


def _of_a_model(mission: Mission, key: Key) -> bool:
    """Return whether a number that is not 0 belongs to the flight model, a beam or the drag."""
    table, _, name = key.name.partition(".")
    shines = table == "laser" and mission.receiver is not None and "[" not in name
    model = table in ("flight", "receiver") or name == "drag_area_m2" or shines
    return model and key.now != 0.0


def _valid(mission: Mission, values: Mapping[str, float]) -> bool:
    """Return whether a mission with these values is one."""
    with suppress(InputError):
        mission.replace(as_stated(mission, values))
        return True
    return False

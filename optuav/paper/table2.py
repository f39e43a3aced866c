"""Table II: its states of charge, and the loads that they allow, by linear programming."""

import math
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal
from functools import cache
from typing import Any, TypeAlias

import numpy as np

from optuav.arrays import Floats
from optuav.paper.curves import DATA, PAPERS
from optuav.silence import silent

Interval: TypeAlias = tuple[float, float]
Charge: TypeAlias = tuple[int, float, str]  # Number of η, hover time [s], percent as printed

TABLE = DATA["table2"]
PACKS = PAPERS[0].battery.packs
BATTERY_AS = PACKS * PAPERS[0].battery.capacity_As
NOMINAL_J = BATTERY_AS * TABLE["nominal_V"]
FLIGHT_J = BATTERY_AS * float(TABLE["flight_V"])
HOVER_J = BATTERY_AS * float(TABLE["hover_V"])  # B, E_0, E_1 and E_2 as the paper composes them


def cells(rows: Sequence[Sequence[Any]], columns: Mapping[str, Any]) -> Iterator[dict[str, Any]]:
    """The statements of the table, row by row; a column says what its cells share."""
    for number, (deadline_s, perspective, slots_s, *printed) in enumerate(rows, start=1):
        options = {"deadline_s": deadline_s, "perspective": perspective, "slots_s": slots_s}
        for (name, column), stated in zip(columns.items(), printed, strict=True):
            texts = ((key, text) for key, text in column.items() if isinstance(text, str))
            cell = {key: text.format(**options, hover_s=printed[0]) for key, text in texts}
            at = (column["eta"], slots_s) if "eta" in column else (deadline_s, perspective)
            yield {
                **cell,
                **{key: [cell[key], *at] for key in ("compute", "room") if key in cell},
                **{"name": f"table2-{number}-{name}", "place": f"Table II, row {number}"},
                **{"stated": stated, "fitted": stated in column.get("fitted", ())},
                "reason": column["reasons"].get(stated, ""),
            }


STATEMENTS = tuple(
    statement
    for fields in DATA["statement"]
    for statement in (cells(**fields) if "rows" in fields else [fields])
)
"""Fields of the statements, about in the paper's order."""
CONSISTENT: tuple[Charge, ...] = tuple(
    dict.fromkeys(
        (*statement["compute"][1:], statement["stated"])
        for statement in STATEMENTS
        if statement["compute"][0] == "charge_left"
        and [statement["compute"][1], statement["stated"]] not in TABLE["impossible"]
    )
)
"""The different states of charge, without those that the others rule out."""


def printed_interval(stated: str) -> Interval:
    """All values that a printed number stands for."""
    half = 0.5 * 10.0 ** last_digit(stated)
    return float(stated) - half, float(stated) + half


def last_digit(stated: str) -> int:
    """Power of ten of the last printed digit."""
    exponent = Decimal(stated).as_tuple().exponent
    assert isinstance(exponent, int)
    return exponent


# On the direct path every state of charge is a straight line in the hover time. It depends on five
# loads: the flight's charge [A s], the hover current without laser [A], the charging current c [A],
# the flight's energy [J] and the hover power [W]; 11.1 V × c is received. A printed cell is
# two linear inequalities in them, half a unit of its last digit to either side. The formulas stand
# here again because the loads are unknown: `formulations.soc` takes a mission's loads.


def _percent(eta: int, hover_s: float) -> tuple[Floats, float]:
    """η1, η2 or η3 [%]: its coefficients of the loads, and its constant."""
    harvested = TABLE["nominal_V"] * hover_s / NOMINAL_J
    lost = {
        1: (1.0 / BATTERY_AS, hover_s / BATTERY_AS, -hover_s / BATTERY_AS, 0.0, 0.0),
        2: (0.0, 0.0, -harvested, 1.0 / NOMINAL_J, hover_s / NOMINAL_J),
        3: (0.0, 0.0, -harvested, 1.0 / FLIGHT_J, hover_s / HOVER_J),
    }[eta]
    return -100.0 * np.array(lost), 100.0


def _inequalities(charges: Sequence[Charge]) -> Iterator[tuple[Floats, float]]:
    """a·x ≤ b of the charges, of both voltages, and of the crossing in Fig. 8."""
    for eta, hover_s, stated in charges:
        slope, constant = _percent(eta, hover_s)
        low, high = printed_interval(stated)
        yield slope, high - constant
        yield -slope, constant - low
    unit = np.eye(5)
    for stated, energy, current in ((TABLE["flight_V"], 3, 0), (TABLE["hover_V"], 4, 1)):
        low, high = printed_interval(stated)
        yield unit[energy] - high * unit[current], 0.0
        yield low * unit[current] - unit[energy], 0.0
    low, high = printed_interval(TABLE["crossing_hover_s"])
    usable_As = (1.0 - PAPERS[0].limits.min_soc) * PACKS * TABLE["crossing_As"]
    yield unit[0] + low * unit[1], usable_As
    yield -unit[0] - high * unit[1], -usable_As


@silent()
def _least(objective: Floats, charges: Sequence[Charge]) -> float:
    """Least value of a linear objective over the loads that are admitted; ∞ if none are."""
    from scipy.optimize import linprog

    left, right = zip(*_inequalities(charges), strict=True)
    answer = linprog(objective, A_ub=np.array(left), b_ub=np.array(right), method="highs")
    return math.inf if answer.fun is None else float(answer.fun)


@cache
def admitted(eta: int, hover_s: float) -> Interval:
    """Least and largest η1, η2 or η3 [%] by all loads that show every digit of the other cells.

    The others are the consistent charges, both voltages and the crossing of Fig. 8.
    """
    others = [charge for charge in CONSISTENT if charge[:2] != (eta, hover_s)]
    slope, constant = _percent(eta, hover_s)
    low, high = (side * _least(side * slope, others) + constant for side in (1.0, -1.0))
    return low, high


def loads_exist(charges: Sequence[Charge]) -> bool:
    """Return whether one set of loads shows all these charges, both voltages and the crossing."""
    return math.isfinite(_least(np.zeros(5), charges))

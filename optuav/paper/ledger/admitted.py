"""What loads Table II admits, and what they give in other cells: linear programmes.

On the direct path every state of charge is a straight line in the hover time: η1 = 1 − q − i Δ,
η2 = 1 − (E_fl + (P_hv − P_0) Δ)/E_0, η3 = 1 − E_fl/E_1 − P_hv Δ/E_2 + P_0 Δ/E_0. Loads enter as the
five numbers Q_fl [A s], the hover current without laser I [A], the charging current c [A],
E_fl [J] and P_hv [W], in this order, with P_0 = 11.1 V × c. All that a printed cell says of them is
two linear inequalities, half a unit of its last digit to either side.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np

from optuav.arrays import Floats
from optuav.paper.ledger.cells import FLIGHT_J, HOVER_J, NOMINAL_J, Cell, consistent_cells
from optuav.paper.ledger.statement import Interval, printed_interval

Line = tuple[Floats, float]
"""Coefficients and constant of a quantity that is linear in the loads."""


def _percent(eta: int, hover_s: float) -> Line:
    """η1, η2 or η3 [%] as a line in the loads."""
    harvested = 11.1 * hover_s / NOMINAL_J
    lost = {
        1: (1.0 / 72000.0, hover_s / 72000.0, -hover_s / 72000.0, 0.0, 0.0),
        2: (0.0, 0.0, -harvested, 1.0 / NOMINAL_J, hover_s / NOMINAL_J),
        3: (0.0, 0.0, -harvested, 1.0 / FLIGHT_J, hover_s / HOVER_J),
    }[eta]
    return -100.0 * np.array(lost), 100.0


def _rows(cells: Sequence[Cell]) -> Iterator[tuple[Floats, float]]:
    """Inequalities a·x ≤ b: the cells, both voltages, and the crossing at 39 000 A s."""
    for cell in cells:
        slope, constant = _percent(cell.number, cell.hover_s)
        low, high = printed_interval(cell.stated)
        yield slope, high - constant
        yield -slope, constant - low
    for stated, energy, charge in (("15.4", 3, 0), ("14.33", 4, 1)):
        low, high = printed_interval(stated)
        unit = np.eye(5)
        yield unit[energy] - high * unit[charge], 0.0
        yield low * unit[charge] - unit[energy], 0.0
    low, high = printed_interval("951")
    drawn = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    unit = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
    usable = 0.95 * 2 * 39000.0
    yield drawn + low * unit, usable
    yield -drawn - high * unit, -usable


@cache
def admitted(eta: int, hover_s: float) -> Interval:
    """Least and largest η1, η2 or η3 [%] at a hover time, over all loads that the table admits.

    They show every printed digit of all other states of charge, but for the four impossible ones,
    of both voltages and of the crossing.
    """
    others = [cell for cell in consistent_cells() if (cell.number, cell.hover_s) != (eta, hover_s)]
    slope, constant = _percent(eta, hover_s)
    low, high = (side * _least(side * slope, others) + constant for side in (1.0, -1.0))
    return low, high


def loads_exist(cells: Sequence[Cell]) -> bool:
    """Whether one set of loads shows all these cells, both voltages and the crossing."""
    return math.isfinite(_least(np.zeros(5), cells))


def _least(objective: Floats, cells: Sequence[Cell]) -> float:
    """The least value of a linear objective over the admitted loads; ∞ where there are none."""
    from scipy.optimize import linprog

    left, right = zip(*_rows(cells), strict=True)
    found = linprog(objective, A_ub=np.array(left), b_ub=np.array(right), method="highs")
    return math.inf if found.fun is None else float(found.fun)

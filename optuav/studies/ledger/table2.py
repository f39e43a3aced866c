"""Table II: its 30 cells, what the fit leaves open, and why four of them cannot be matched.

On the direct path every state of charge is a straight line in the hover time: η1 = 1 − q − i Δ,
η2 = 1 − (E_fl + (P_hv − P_0) Δ)/E_0, η3 = 1 − E_fl/E_1 − P_hv Δ/E_2 + P_0 Δ/E_0. Loads enter as the
five numbers q = Q_fl/B, i = I_hv/B, E_fl, P_hv, P_0. All that a printed cell says of them is two
linear inequalities, half a unit of its last digit to either side: what loads the table admits, and
what they give elsewhere in it, are linear programmes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from formulations.perspectives import PAPER, PERSPECTIVES
from optuav.mission import vehicle
from optuav.solving.given import quantities
from optuav.studies.ledger.scenario import Scenario, papers
from optuav.studies.ledger.statement import Interval, Statement, Value, meets, printed_interval

NOMINAL_J, FLIGHT_J, HOVER_J = 2 * 36000 * 11.1, 2 * 36000 * 15.4, 2 * 36000 * 14.33
"""E_0, E_1, E_2 as the paper composes them [J]."""


class Row(NamedTuple):
    """A row of the table: deadline [s], perspective, and its cells as printed."""

    deadline_s: int
    perspective: str
    hover: str
    mission: str
    soc: tuple[str, str, str]


class Cell(NamedTuple):
    """A state of charge in the table: η number, hover time [s] and percent as printed."""

    number: int
    hover_s: float
    stated: str


ROWS = (
    Row(800, "battery", "740.65", "800", ("24.27", "-12.79", "24.27")),
    Row(800, "energy", "697", "756.35", ("28.31", "5.01", "28.30")),
    Row(800, "adjusted", "740.65", "800", ("24.27", "-12.79", "24.27")),
    Row(1200, "battery", "950", "1009.35", ("5.09", "-25.58", "11.71")),
    Row(1200, "energy", "697", "756.35", ("28.31", "5.01", "33.17")),
    Row(1200, "adjusted", "950", "1009.35", ("5.09", "-25.58", "5.09")),
)
CELLS = 30
FITTED = {(1, 697.0), (1, 950.0), (2, 697.0), (2, 950.0)}
"""η number and hover time [s] of the cells that `paper-table2` was fitted to."""
IMPOSSIBLE = {(2, "-12.79"), (3, "11.71"), (3, "33.17")}
"""η number and printed cell of the four that other cells rule out."""
FREE_PARAMETERS = (
    "acceleration",
    "flight current",
    "flight power",
    "hover current",
    "hover power",
    "charging current (its power follows at 11.1 V)",
)
FIT_DATA = (
    "T − Δ = 59.35 s in every row",
    "η1 of the rows Δ = 697 s and 950 s",
    "η2 of the rows Δ = 697 s and 950 s",
    "the crossing at 39 000 A s, Δ = 951 s, of the figure on battery size",
)
FIT_NUMBERS = 6
"""Different numbers in the data of the fit."""


def whole_slots(hover: str) -> float:
    """Hover time [s] for which a row prints its states of charge: 740.65 s fills 741 slots."""
    return float(math.ceil(float(hover)))


def statements() -> Iterator[Statement]:
    """Every cell of the table."""
    for number, row in enumerate(ROWS, start=1):
        place = f"Table II, row {number}"
        name = f"table2-{number}"
        asked = f"(P3), {row.perspective}, T_max = {row.deadline_s} s, slots of 1 s"
        command = (
            f"optuav solve paper-table2 --problem P3 --perspective {row.perspective} "
            f"--slot-s 1 --set limits.deadline_s={row.deadline_s}"
        )
        yield Statement(
            name=f"{name}-deadline",
            place=place,
            what="deadline T_max",
            stated=str(row.deadline_s),
            unit="s",
            how="limits.deadline_s of the question",
            compute=partial(_deadline, row),
            command=command,
            given=True,
        )
        yield Statement(
            name=f"{name}-hover",
            place=place,
            what="hover time Δ",
            stated=row.hover,
            unit="s",
            how=asked,
            compute=partial(_time, row, "hover_time_s"),
            reason=_why_hover(row),
            command=command,
        )
        yield Statement(
            name=f"{name}-mission",
            place=place,
            what="mission time T",
            stated=row.mission,
            unit="s",
            how=asked,
            compute=partial(_time, row, "mission_time_s"),
            reason="the deadline binds" if row.mission == "800" else "T − Δ = 59.35 s was fitted",
            command=command,
            fitted=row.mission != "800",
        )
        for eta, stated in enumerate(row.soc, start=1):
            yield _charge(name, place, row, eta, stated)


def _charge(name: str, place: str, row: Row, eta: int, stated: str) -> Statement:
    hover_s = whole_slots(row.hover)
    ruled_out = (eta, stated) in IMPOSSIBLE
    slots = f"at Δ = {hover_s:g} s, the whole slots of the row's Δ"
    return Statement(
        name=f"{name}-eta{eta}",
        place=place,
        what=f"charge left η{eta}, {PAPER[eta - 1]}",
        stated=stated,
        unit="%",
        how=f"η{eta} of the direct path {slots}",
        compute=lambda s: charge_left(s, eta, hover_s),
        reason=partial(_why_impossible if ruled_out else _why, row, eta),
        fitted=(eta, hover_s) in FITTED,
        contradicted=(lambda: not meets(stated, admitted(eta, hover_s))) if ruled_out else None,
        leeway=(lambda: admitted(eta, hover_s)) if eta == 3 and not ruled_out else None,
    )


def _deadline(row: Row, _: Scenario) -> Value:
    return float(row.deadline_s)


def _time(row: Row, which: str, scenario: Scenario) -> Value:
    changes = {"limits.deadline_s": row.deadline_s}
    plan = scenario.plan(changes, problem="P3", perspective=row.perspective, slot_s=1.0)
    return float(getattr(plan, which))


def charge_left(scenario: Scenario, eta: int, hover_s: float) -> float:
    """η1, η2 or η3 at the end of the direct path [%] after a hover time [s]."""
    direct = np.array([0])
    given = scenario.once("direct", lambda: quantities(scenario.worked_out, direct, rests=False))
    soc = PERSPECTIVES[PAPER[eta - 1]](given, hover_s, 0.0)
    return 100.0 * float(np.squeeze(soc))


def _why_hover(row: Row) -> str:
    if row.hover == "740.65":
        return "the deadline binds; its decimals are those of T − Δ = 59.35 s, which was fitted"
    return "the charge binds: one slot more would leave less than 5 %"


def _why(row: Row, eta: int) -> str:
    parts = []
    if row.hover == "740.65":
        exact = charge_left(papers()[1], eta, float(row.hover))
        parts.append(f"the digits belong to Δ = 741 s; at the row's own Δ they are {exact:.2f} %")
    if eta == 3:
        low, high = admitted(eta, whole_slots(row.hover))
        parts.append("nearly η1 by construction: E_1 and E_2 are B times the voltages of the fit")
        parts.append(f"loads that show all other cells give {low:.3f} to {high:.3f} %")
    return "; ".join(parts)


def _why_impossible(row: Row, eta: int) -> str:
    stated = row.soc[eta - 1]
    low, high = admitted(eta, float(row.hover))
    if eta == 2:
        return (
            f"on one path η2 is a straight line in Δ, and the rows Δ = 697 s and 950 s fix it: "
            f"{low:.2f} to {high:.2f} % at Δ = {row.hover} s; printed is half of the −25.58 % of "
            f"another row"
        )
    other = next(each.soc[2] for each in ROWS if each.hover == row.hover and each.soc[2] != stated)
    scenario = papers()[1]
    hover_J = float(vehicle.hover_load(scenario.mission).power_W) * float(row.hover)
    by_flight = charge_left(scenario, 3, float(row.hover))
    by_flight += 100.0 * hover_J * (1.0 / HOVER_J - 1.0 / FLIGHT_J)
    return (
        f"same path and Δ as the row that prints {other} %, and one flight has one η3: "
        f"{low:.2f} to {high:.2f} % by the other cells; hover energy over E_1 instead of E_2 would "
        f"give {by_flight:.2f} %"
    )


# What loads the table admits. Unknown are, in this order, Q_fl [A s], the hover current without
# laser I [A], the charging current c [A], E_fl [J] and P_hv [W]; P_0 = 11.1 V × c.

Line = tuple[npt.NDArray[np.float64], float]
"""Coefficients and constant of a quantity that is linear in the loads."""


def consistent_cells() -> tuple[Cell, ...]:
    """The different states of charge in the table, without the four impossible ones."""
    return tuple(
        dict.fromkeys(
            Cell(eta, whole_slots(row.hover), stated)
            for row in ROWS
            for eta, stated in enumerate(row.soc, start=1)
            if (eta, stated) not in IMPOSSIBLE
        )
    )


def _percent(eta: int, hover_s: float) -> Line:
    """η1, η2 or η3 [%] as a line in the loads."""
    harvested = 11.1 * hover_s / NOMINAL_J
    lost = {
        1: (1.0 / 72000.0, hover_s / 72000.0, -hover_s / 72000.0, 0.0, 0.0),
        2: (0.0, 0.0, -harvested, 1.0 / NOMINAL_J, hover_s / NOMINAL_J),
        3: (0.0, 0.0, -harvested, 1.0 / FLIGHT_J, hover_s / HOVER_J),
    }[eta]
    return -100.0 * np.array(lost), 100.0


def _rows(cells: Sequence[Cell]) -> Iterator[tuple[npt.NDArray[np.float64], float]]:
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


def _least(objective: npt.NDArray[np.float64], cells: Sequence[Cell]) -> float:
    """The least value of a linear objective over the admitted loads; ∞ where there are none."""
    from scipy.optimize import linprog

    left, right = zip(*_rows(cells), strict=True)
    found = linprog(objective, A_ub=np.array(left), b_ub=np.array(right), method="highs")
    return math.inf if found.fun is None else float(found.fun)

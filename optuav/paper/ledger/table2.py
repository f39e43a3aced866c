"""Table II: each cell beside ours, and why four of them cannot be matched."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache, partial

import numpy as np

from formulations.perspectives import PAPER, PERSPECTIVES
from optuav.network import vehicle
from optuav.paper.ledger.admitted import admitted
from optuav.paper.ledger.cells import (
    FITTED,
    FLIGHT_J,
    HOVER_J,
    IMPOSSIBLE,
    ROWS,
    SHOW_ALL_W,
    Row,
    whole_slots,
)
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value, meets
from optuav.solving.given import quantities


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
            what="deadline T_max, in the text too",
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
            fitted=row.mission == "800",
        )
        yield Statement(
            name=f"{name}-mission",
            place=place,
            what="mission time T",
            stated=row.mission,
            unit="s",
            how=asked,
            compute=partial(_time, row, "mission_time_s"),
            reason="that the deadline binds follows from the fit"
            if row.mission == "800"
            else "T − Δ = 59.35 s was fitted",
            command=command,
            fitted=row.mission != "800",
        )
        for eta, stated in enumerate(row.soc, start=1):
            yield _charge(name, place, row, eta, stated)


def _charge(name: str, place: str, row: Row, eta: int, stated: str) -> Statement:
    hover_s = whole_slots(row.hover)
    ruled_out = (eta, stated) in IMPOSSIBLE
    return Statement(
        name=f"{name}-eta{eta}",
        place=place,
        what=f"charge left η{eta}, {PAPER[eta - 1]}, at Δ = {hover_s:g} s",
        stated=stated,
        unit="%",
        how=f"η{eta} of the direct path after the whole slots of the row's Δ = {row.hover} s",
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
        return "800 s, the deadline that binds, less 59.35 s, which was fitted"
    return "the charge binds: one slot more would leave less than 5 %"


def _why(row: Row, eta: int) -> str:
    parts = []
    if row.hover == "740.65":
        exact = charge_left(papers()[1], eta, float(row.hover))
        parts.append(f"the digits belong to Δ = 741 s; at the row's own Δ they are {exact:.2f} %")
    if eta == 3:
        parts.append("nearly η1 by construction: E_1 and E_2 are B times the voltages of the fit")
        if row.hover != "740.65":
            flight_W, hover_W = SHOW_ALL_W.values()
            shown = charge_left(show_all(), eta, float(row.hover))
            parts.append(
                f"{shown:.4f} % with {flight_W} W in flight and {hover_W} W in hover, which the "
                f"data of the fit admit as well"
            )
    return "; ".join(parts)


@cache
def show_all() -> Scenario:
    """`paper-table2` with the loads that show all cells but the four that cannot match."""
    return Scenario(papers()[1].mission.replace(SHOW_ALL_W))


def _why_impossible(row: Row, eta: int) -> str:
    stated = row.soc[eta - 1]
    if eta == 2:
        left = " and ".join(
            "{:.2f} to {:.2f} % at {:g} s".format(*admitted(eta, hover_s), hover_s)
            for hover_s in (float(row.hover), whole_slots(row.hover))
        ).replace("-", "\N{MINUS SIGN}")
        return (
            f"on one path η2 is a straight line in Δ, and the rows Δ = 697 s and 950 s leave it "
            f"{left}; printed is half of the −25.58 % of another row"
        )
    low, high = admitted(eta, float(row.hover))
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

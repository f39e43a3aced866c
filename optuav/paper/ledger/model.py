"""Numbers in the models of sections III and IV: counts, two footnotes, a misprinted equation."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import partial

from formulations.algorithm1 import algorithm1
from optuav.network import vehicle
from optuav.network.one_stop import find_shortcuts
from optuav.network.places import HOVER
from optuav.paper.ledger.cells import FLIGHT_J, HOVER_J, NOMINAL_J
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value
from optuav.physics import kibam


def statements() -> Iterator[Statement]:
    """Every number of these sections, and the equation that carries a misprint."""
    yield from _counts()
    yield Statement(
        name="eq25-signs",
        place="eq (25)",
        what="signs of E_fl, E_hv and E_harv in η3",
        stated="− + −",
        how="how η3 must answer to more of each for Table II to come out",
        compute=_signs,
        reason=lambda: (
            f"with the printed signs the row Δ = 697 s of Table II would end at "
            f"{_percent_at_697((-1.0, 1.0, -1.0)):.0f} %"
        ),
        contradicted=lambda: abs(_percent_at_697((-1.0, 1.0, -1.0)) - 28.30) > 1.0,
    )


def _counts() -> Iterator[Statement]:
    for name, place, what, stated, how, count in (
        (
            "marcum",
            "eq (17)",
            "order of the Marcum Q-function",
            "1",
            "half of the degrees of freedom of χ²",
            1,
        ),
        (
            "wells",
            "section III",
            "wells of KiBaM, and its differential equations",
            "2",
            "y1 and y2",
            len(kibam.Wells._fields),
        ),
    ):
        yield Statement(
            name=f"model-{name}",
            place=place,
            what=what,
            stated=stated,
            how=how,
            compute=partial(_count, count),
        )
    yield Statement(
        name="model-one-rest",
        place="section IV, footnote",
        what="buildings on which resting pays",
        stated="1",
        how="1 where times, charges and energies of the legs obey the triangle inequality",
        compute=lambda s: None if find_shortcuts(s.worked_out) else 1.0,
        reason=_why_one_rest,
    )
    yield Statement(
        name="model-altitude",
        place="section IV, footnote",
        what="altitude of w_U, typically",
        stated="z_min",
        how="that of the hover point",
        compute=_altitude,
    )
    yield Statement(
        name="model-first-slot",
        place="Algorithm 1, lines 3 and 4",
        what="first slot of Δ and of T'",
        stated="1",
        how="least Δ in the table of Algorithm 1",
        compute=lambda _: float(algorithm1(lambda hover, rest: 1.0, 3.0, 0.0)[0][0, 0]),
        given=True,
    )
    yield Statement(
        name="model-phases",
        place="section III-B, footnote",
        what="phases of charging, constant current and then constant voltage",
        stated="2",
        how="not computed: the paper charges at constant current",
        compute=lambda _: None,
        undecided="its second phase has no part in the paper",
    )


def _count(count: float, _: Scenario) -> Value:
    return float(count)


def _why_one_rest() -> str:
    one, two = (papers()[0].plan(perspective="available", stops=most) for most in (1, 2))
    return (
        f"true while the available well is not asked; with it, two rests hover "
        f"{two.hover_time_s:.3f} s in `paper`, one {one.hover_time_s:.3f} s"
    )


def _altitude(scenario: Scenario) -> Value:
    altitude_m = float(scenario.worked_out.places.position_m[HOVER][2])
    return "z_min" if altitude_m == scenario.mission.limits.min_altitude_m else f"{altitude_m:g} m"


def _signs(scenario: Scenario) -> Value:
    """The signs with which η3 of the row Δ = 697 s comes out within a percent."""
    if scenario.has_rotors:
        return None
    found = [
        signs
        for signs in itertools.product((-1.0, 1.0), repeat=3)
        if abs(_percent_at_697(signs) - 28.30) < 1.0
    ]
    return " or ".join(" ".join("−" if sign < 0.0 else "+" for sign in each) for each in found)


def _percent_at_697(signs: tuple[float, ...]) -> float:
    """η3 of the row Δ = 697 s with given signs of E_fl, E_hv and E_harv [%]."""
    scenario, hover_s = papers()[1], 697.0
    direct_J = float(scenario.worked_out.routes.flight_energy_J[0])
    hover_J = float(vehicle.hover_load(scenario.mission).power_W) * hover_s
    harvested_J = float(vehicle.charging(scenario.mission, 0.0).power_W) * hover_s
    shares = (direct_J / FLIGHT_J, hover_J / HOVER_J, harvested_J / NOMINAL_J)
    return 100.0 * (1.0 + sum(sign * share for sign, share in zip(signs, shares, strict=True)))

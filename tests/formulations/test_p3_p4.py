"""(P3) and (P4): what is declared, what is printed, what the answer is by hand."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import formulations
from formulations.formulation import Formulation, Given
from formulations.p3 import P3
from formulations.p4 import P4
from optuav.engines import closed_form
from optuav.modelling import Model, affine
from optuav.status import Status
from tests.formulations.given import LINEAR, TABLE_II, quantities
from tests.mathtext import lines_that_can_be_set

P3_PAGE = """\
P3: longest hover on a given route without a rest

maximise   Δ
over       Δ ∈ [0, T_max − T_fl] s  (P3.b hover time)
subject to
  P3.a state of charge  1 − (Q_fl + I_hv·Δ) / (N·B_i) ≥ η0
where
  T_max  deadline_s        800       s    limits.deadline_s
  T_fl   flight_time_s     59.35     s
  Q_fl   flight_charge_As  5558.602  A s
  I_hv   hover_current_A   66.081    A
  N      packs             2         1    battery.packs
  B_i    capacity_As       36000     A s  battery.capacity_As
  η0     min_soc           0.05      1    limits.min_soc
"""

P4_PAGE = """\
P4: longest hover with one rest on a given building

maximise   Δ, then smallest T'
over       Δ ∈ [0, ∞) s
           T' ∈ [0, ∞) s
subject to
  P4.a state of charge  1 − (E_fl + P_hv·Δ − (P_0,hv·Δ + P_0,rest·T')) / (N·B_i·e_nom) ≥ η0
  P4.b deadline         Δ + T' ≤ T_max − T_fl
where
  E_fl      flight_energy_J    1500                       J
  P_hv      hover_power_W      105                        W
  P_0,hv    hover_received_W   15                         W
  P_0,rest  rest_received_W    50                         W
  N         packs              2                          1    battery.packs
  B_i       capacity_As        500                        A s  battery.capacity_As
  e_nom     nominal_voltage_V  10                         V    battery.nominal_voltage_V
  η0        min_soc            0.1                        1    limits.min_soc
  T_max     deadline_s         200                        s    limits.deadline_s
  T_fl      flight_time_s      20 values, 80.2 to 95.125  s
"""

P4_LATEX = r"""\begin{align*}
\text{maximise}\quad & \Delta,\text{ then smallest }T' \\
\text{over}\quad & \Delta \in [0, \infty)\,\mathrm{s} \\
 & T' \in [0, \infty)\,\mathrm{s} \\
\text{subject to}\quad & 1 - \frac{Q_{\mathrm{fl}} + I_{\mathrm{hv}}\,\Delta - I_{\mathrm{rest}}\,T'}{N\,B_i} \geq \eta_0 \tag*{\(\text{P4.a state of charge}\)} \\
 & \Delta + T' \leq T_{\max} - T_{\mathrm{fl}} \tag*{\(\text{P4.b deadline}\)}
\end{align*}
\begin{align*}
\text{where}\quad & Q_{\mathrm{fl}} = 100\,\mathrm{A\,s} \\
"""  # noqa: E501


def test_p3_as_printed() -> None:
    """The problem, its quantities with units and keys; nothing of a rest occurs in it."""
    page = str(P3().model(quantities(TABLE_II, deadline_s=800.0), "battery"))
    assert page.splitlines() == P3_PAGE.splitlines()


def test_p4_as_printed() -> None:
    """For several routes at once: one page, the range of what differs."""
    page = str(P4("b1").model(quantities(flight_time_s=np.linspace(80.2, 95.125, 20)), "energy"))
    assert page.splitlines() == P4_PAGE.splitlines()


def test_p4_in_latex() -> None:
    assert P4("b1").model(quantities(), "battery").to_latex().startswith(P4_LATEX)


@pytest.mark.parametrize("perspective", LINEAR)
def test_every_line_of_latex_can_be_set(perspective: str) -> None:
    """By matplotlib's mathtext, without the marks of alignment."""
    page = P4("b1").model(quantities(), perspective).to_latex()
    assert r"\text{maximise}" in lines_that_can_be_set(page)[0]


@pytest.mark.parametrize("perspective", LINEAR)
@pytest.mark.parametrize("formulation", [P3(), P4("b1")])
def test_statements_are_linear(formulation: Formulation, perspective: str) -> None:
    """In every perspective of the paper."""
    model = formulation.model(quantities(), perspective)
    for constraint in model.constraints:
        affine(constraint.relation.left, {})
        affine(constraint.relation.right, {})


def test_constraints_point_to_the_formulation() -> None:
    """Their lines are those of the statement, whoever builds the model."""
    places = [
        constraint.declared_at for constraint in P4("b1").model(quantities(), "battery").constraints
    ]
    assert all(re.fullmatch(r"p4\.py:\d+", place) for place in places)
    assert len(set(places)) == 2


@pytest.mark.parametrize(
    ("perspective", "hover_s", "rest_s"),
    [
        # 10 Δ − 5 T' = 800 meets Δ + T' = 150
        ("battery", 310.0 / 3.0, 140.0 / 3.0),
        # 90 Δ − 50 T' = 7500 meets it at Δ = 15 000/140
        ("energy", 15000.0 / 140.0, 150.0 - 15000.0 / 140.0),
        # 0.01 Δ − 0.0015 Δ − 0.005 T' = 0.8 at Δ = 1.55/0.0135
        ("adjusted", 1.55 / 0.0135, 150.0 - 1.55 / 0.0135),
    ],
)
def test_p4_by_hand(perspective: str, hover_s: float, rest_s: float) -> None:
    """Where the line of charge crosses the line of time."""
    found = closed_form.solve(P4("b1").model(quantities(), perspective), 1)
    assert found.point(0) == pytest.approx({"hover_time_s": hover_s, "rest_time_s": rest_s})
    assert set(found.binding_labels(0)) == {"P4.a state of charge", "P4.b deadline"}


@pytest.mark.parametrize(
    ("changes", "hover_s", "rest_s", "binding"),
    [
        pytest.param(
            {"capacity_As": 5000.0}, 150.0, 0.0, {"P4.b deadline", "bounds of T'"}, id="by time"
        ),
        pytest.param(
            {"rest_current_A": 0.0},
            80.0,
            0.0,
            {"P4.a state of charge", "bounds of T'"},
            id="by charge, a rest brings nothing",
        ),
        pytest.param(
            {"capacity_As": 8000.0 / 9.0},
            150.0,
            0.0,
            {"P4.a state of charge", "P4.b deadline", "bounds of T'"},
            id="by both at once",
        ),
        pytest.param(
            {"rest_current_A": np.inf}, None, None, set(), id="infinite current is no number"
        ),
    ],
)
def test_what_binds_p4(
    changes: dict[str, float], hover_s: float | None, rest_s: float, binding: set[str]
) -> None:
    """1600/9 A s above η0 = 0.1 and the flight are what 150 s at 10 A draw."""
    found = closed_form.solve(P4("b1").model(quantities(**changes), "battery"), 1)
    assert set(found.binding_labels(0)) == binding
    if hover_s is None:
        assert found.statuses == [Status.ERROR]
    else:
        assert found.point(0) == pytest.approx(
            {"hover_time_s": hover_s, "rest_time_s": rest_s}, abs=1e-9
        )


@pytest.mark.parametrize(
    ("changes", "status"),
    [({"deadline_s": 49.0}, "infeasible"), ({"flight_charge_As": 901.0}, "infeasible")],
)
@pytest.mark.parametrize("formulation", [P3(), P4("b1")])
def test_infeasible_by_time_or_by_charge(
    formulation: Formulation, changes: dict[str, float], status: str
) -> None:
    """A second or an ampere second too little, and no rest to make up for it."""
    given = quantities(**changes, rest_current_A=0.0)
    found = closed_form.solve(formulation.model(given, "battery"), 1)
    assert found.statuses[0].value == status


@pytest.mark.parametrize(("deadline_s", "hover_s"), [(800.0, 740.65), (1200.0, 950.9750)])
def test_p3_of_table_ii(deadline_s: float, hover_s: float) -> None:
    """Bound by time at 800 s, by charge at 1200 s."""
    found = closed_form.solve(P3().model(quantities(TABLE_II, deadline_s=deadline_s), "battery"), 1)
    assert found.point(0)["hover_time_s"] == pytest.approx(hover_s, abs=1e-3)


def test_rest_of_another_route_does_not_reach_p3() -> None:
    """A route without a rest has no numbers of one, not even missing ones."""
    given = quantities(rest_current_A=np.nan, rest_received_W=np.nan)
    for perspective in LINEAR:
        assert closed_form.solve(P3().model(given, perspective), 1).statuses == [Status.OPTIMAL]


def test_formulation_of_ones_own() -> None:
    """One class with one method; its first line is the title, the class's name where none is."""

    class Least(Formulation):
        def declare(self, model: Model, given: Given) -> None:
            """State the shortest hover."""
            model.minimise(model.variable("hover_time_s", "Δ", unit="s"))

    assert Least().model(quantities(), "battery").title == "Least"
    assert (
        P3().model(quantities(), "battery").title
        == "P3: longest hover on a given route without a rest"
    )


@pytest.mark.parametrize("name", ["p1", "p2", "p3", "p4", "algorithms"])
def test_a_statement_stays_short(name: str) -> None:
    """Under 75 lines a file, so that it can be shown to a class."""
    text = (Path(formulations.__file__).parent / f"{name}.py").read_text("utf-8")
    assert len(text.splitlines()) < 75

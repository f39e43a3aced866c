"""The (Δ, T') plane draws what the model declares."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib.axes import Axes
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure

import optuav
from formulations.soc import StepEnd
from optuav import plots
from optuav.errors import InputError
from optuav.modelling import Constraint, Relation
from optuav.plan.plane import constraint_name
from optuav.plots import style

Drawn = tuple[Axes, list[optuav.Plan]]
Overlaps = Callable[[Figure], list[tuple[str, str]]]


def plane(mission: optuav.Mission | str, slot_s: float) -> Drawn:
    """The plane of a P4 that rests first on b1, with its optima marked."""
    problem = optuav.P4("b1", order="rest-first")
    program = optuav.formulate(mission, problem, perspective="battery")
    (part,) = program.parts
    in_slots = optuav.solve(mission, problem, perspective="battery", engine="grid", slot_s=slot_s)
    plans = [program.solve(), in_slots]
    ax = plots.plane(part.model, part.model.row(0), plans, slot_s=slot_s)
    return ax, plans


@pytest.fixture(scope="module")
def drawn() -> Drawn:
    """The plane of `paper`."""
    return plane("paper", 1.0)


def boundaries(ax: Axes, width: float = 0.8) -> list[np.ndarray[Any, Any]]:
    """Corners of the lines of a width on which constraints hold with equality."""
    contours = [each for each in ax.collections if isinstance(each, ContourSet)]
    lines = [each for each in contours if not each.filled and each.get_linewidth()[0] == width]
    return [np.concatenate([path.vertices for path in each.get_paths()]) for each in lines]


def named(ax: Axes) -> set[str]:
    """What the legend names, apart from the grid and the optima."""
    words = {text.get_text().replace("\n", " ") for text in ax.get_legend().get_texts()}
    return {each for each in words if "feasible" not in each and "optimum" not in each}


def distance(point: tuple[float, float], line: np.ndarray[Any, Any]) -> float:
    """Distance of a point from a chain of corners."""
    steps = np.diff(line, axis=0)
    squared = np.maximum((steps**2).sum(axis=1), 1e-300)
    share = np.clip(((point - line[:-1]) * steps).sum(axis=1) / squared, 0.0, 1.0)
    return float(np.hypot(*(line[:-1] + share[:, None] * steps - point).T).min())


def test_both_binding_constraints_pass_through_the_optimum(drawn: Drawn) -> None:
    ax, (continuous, _) = drawn
    assert continuous.hover_time_s == pytest.approx(719.5399, abs=1e-4)
    point = (continuous.rest_time_s, continuous.hover_time_s)
    near = sorted(distance(point, line) for line in boundaries(ax))
    assert len(near) == 4
    assert near[:2] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert near[2] > 100.0


def test_optima_are_marked_where_they_are(drawn: Drawn) -> None:
    ax, plans = drawn
    stars = [line for line in ax.lines if line.get_marker() == "*"]
    marked = {line.get_label().partition("\n")[0]: line.get_xydata().tolist() for line in stars}
    for name, plan in zip(marked, plans, strict=True):
        assert marked[name] == [[plan.rest_time_s, plan.hover_time_s]]
    assert "optimum" in marked
    ((slots, point),) = [item for item in marked.items() if "slots" in item[0]]
    assert slots.startswith("optimum in slots")
    assert point[0][1] == 719.0


def test_points_of_the_grid_are_feasible_where_the_battery_and_the_deadline_allow(
    drawn: Drawn,
) -> None:
    """Counted again, ampere second by ampere second, from the phases of the plan."""
    ax, (plan, _) = drawn
    current = {phase.kind: phase.current_A for phase in plan.phases}
    flights = [phase for phase in plan.phases if phase.kind == "flight"]
    flown_As = sum(phase.current_A * phase.duration_s for phase in flights)
    points = {line.get_marker(): np.asarray(line.get_xydata()) for line in ax.lines}
    for marker, feasible in (("o", True), ("x", False)):
        rest_s, hover_s = points[marker].T
        left_As = 72_000.0 + flown_As + current["rest"] * rest_s + current["hover"] * hover_s
        allowed = (left_As >= 0.05 * 72_000.0) & (rest_s + hover_s <= 1200.0 - plan.flight_time_s)
        assert (allowed == feasible).all()
        assert len(rest_s) > 300


def test_constraints_are_named_as_declared(drawn: Drawn, overlaps: Overlaps) -> None:
    ax, _ = drawn
    assert overlaps(ax.figure) == []
    assert named(ax) == {
        "P4.a state of charge",
        "P4.b deadline",
        "bounds of Δ",
        "bounds of $T'$",
    }
    assert ax.get_xlabel() == "rest time $T'$ [s]"
    assert ax.get_ylabel() == "hover time Δ [s]"


@pytest.mark.parametrize(
    ("name", "values", "slot_s"),
    [
        pytest.param("paper-table2", {}, 20.0, marks=pytest.mark.soak),
        ("paper", {"limits.deadline_s": 800}, 60.0),
        pytest.param("paper", {"laser": None}, 7.0, marks=pytest.mark.soak),
        pytest.param("paper", {"limits.deadline_s": 60}, 1.0, marks=pytest.mark.soak),
        ("paper", {"battery.capacity_As": 1000}, 1.0),
    ],
    ids=["paper-table2", "coarse", "no laser", "too late", "too small a battery"],
)
def test_planes_are_drawn_without_texts_on_each_other(
    name: str,
    values: dict[str, Any],
    slot_s: float,
    overlaps: Overlaps,
) -> None:
    ax, _ = plane(optuav.load(name).replace(values), slot_s)
    assert overlaps(ax.figure) == []


def test_a_problem_with_one_unknown_has_no_plane() -> None:
    (part,) = optuav.formulate("paper", "P3", perspective="battery").parts
    with pytest.raises(InputError, match="needs two unknowns; the problem has Δ"):
        plots.plane(part.model, part.model.row(0))


BRIGHT = {"battery.charge_current_A": 150.0, "laser.power_W": 15_000.0}


Lasting = tuple[Axes, optuav.Plan]


@pytest.fixture(scope="module")
def b10() -> Lasting:
    """The plane of hovering first and resting on b10, under `available`."""
    return lasting({}, "b10", "hover-first")


def lasting(values: dict[str, float], building: str, order: str) -> Lasting:
    """The plane under `available`, with its optimum."""
    mission = optuav.load("paper").replace(values)
    program = optuav.formulate(mission, optuav.P4(building, order=order), perspective="available")
    (part,) = program.parts
    plan = program.solve()
    return plots.plane(part.model, part.model.row(0), [plan]), plan


def test_of_the_steps_of_the_wells_only_those_that_cut_are_drawn(
    b10: Lasting,
    overlaps: Overlaps,
) -> None:
    """Hovering first and resting on b10: the landings there and at the end, of 17 steps."""
    ax, plan = b10
    assert named(ax) == {
        "available well dry, end of flight to b10",
        "available well dry, end of flight to destination",
        "available well full after the rest",
        "P4.b deadline",
        "bounds of Δ",
        "bounds of $T'$",
    }
    near = sorted(distance((plan.rest_time_s, plan.hover_time_s), line) for line in boundaries(ax))
    assert near[:2] == pytest.approx([0.0, 0.0], abs=0.1)
    assert near[2] > 100.0
    assert overlaps(ax.figure) == []


def test_limits_of_the_well_are_named_by_the_route_where_a_plan_has_it() -> None:
    """By the number of the flight otherwise, and by its stage before the last one."""
    moments = StepEnd(2, 1, "", lands=False), StepEnd(2, 2, "", lands=True)
    some = Relation(0.0, ">=", 0.0)
    dry = [Constraint("P1.b not dry", some, kind="dry", moment=each) for each in moments]
    route = [*map(style.drawable, ("origin", "hover", "the $ roof", "destination"))]
    assert constraint_name(dry[0], route) == (
        "available well dry, stage 1 of flight to the \\$ roof"
    )
    assert constraint_name(dry[1], ()) == "available well dry, end of flight 2"
    assert constraint_name(Constraint("P1.d hover time", some), route) == "P1.d hover time"


def test_lines_are_thick_where_they_alone_decide(b10: Lasting) -> None:
    """The landing on b10 ends the hover from the optimum to the deadline, and nowhere else."""
    ax, plan = b10
    thick = boundaries(ax, 2.0)
    (level,) = [line for line in thick if np.ptp(line[:, 1]) < 1.0 and line[0, 1] > 500.0]
    deadline_s = 1200.0 - plan.flight_time_s - plan.hover_time_s
    assert (level[:, 0].min(), level[:, 0].max()) == pytest.approx(
        (plan.rest_time_s, deadline_s), abs=16.0
    )


def test_a_small_feasible_set_fills_the_plane() -> None:
    """Rest first where hovering charges: none is possible after 30 s of rest, of 1100 s."""
    ax, plan = lasting(BRIGHT, "b9", "rest-first")
    assert plan.hover_time_s == pytest.approx(106.0, abs=0.05)
    assert 22.0 < ax.get_xlim()[1] < 45.0
    assert 106.0 < ax.get_ylim()[1] < 200.0

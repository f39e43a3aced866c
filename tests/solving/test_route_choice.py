"""(P1) over all routes as one mixed-integer programme."""

from __future__ import annotations

import pytest

import optuav
from formulations.milp import FORMS, Form
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.status import Status

PERSPECTIVES = ("battery", "energy", "adjusted")


def three_buildings(**limits: float) -> Mission:
    """The mission ``paper`` with b1, b5 and b9."""
    gone = {f"buildings.b{k}": None for k in (2, 3, 4, 6, 7, 8, 10)}
    return optuav.load("paper").replace(
        gone | {f"limits.{key}": value for key, value in limits.items()}
    )


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("deadline_s", [800.0, 1200.0])
@pytest.mark.parametrize("perspective", PERSPECTIVES)
def test_choice_is_the_best_of_all_routes(form: Form, deadline_s: float, perspective: str) -> None:
    """As the closed form finds it route by route, the rest that is not unique included."""
    mission = three_buildings(deadline_s=deadline_s)
    expected = optuav.solve(mission, perspective=perspective)
    found = optuav.route_choice(mission, form=form, perspective=perspective)
    assert found.plan.status is Status.OPTIMAL
    assert found.plan.route == expected.route
    assert found.plan.hover_time_s == pytest.approx(expected.hover_time_s, abs=1e-5)
    assert found.plan.rest_time_s == pytest.approx(expected.rest_time_s, abs=1e-3)
    assert found.relaxation_s is not None
    assert found.relaxation_s >= expected.hover_time_s - 1e-5
    if form == "hull":
        assert found.gap_s == pytest.approx(0.0, abs=1e-5)


@pytest.mark.parametrize("form", FORMS)
def test_choice_in_slots_is_the_grid(form: Form) -> None:
    """Also where the last slot of the direct flight is cut short by the deadline."""
    for deadline_s in (600.0, 1200.0):
        mission = three_buildings(deadline_s=deadline_s)
        grid = optuav.solve(mission, perspective="battery", slot_s=50.0)
        found = optuav.route_choice(mission, perspective="battery", form=form, slot_s=50.0)
        assert (found.plan.route, found.plan.rest_time_s) == (grid.route, grid.rest_time_s)
        assert found.plan.hover_time_s == pytest.approx(grid.hover_time_s, abs=1e-9)


class ForAll(optuav.Formulation):
    """P1 for all the devices"""

    def declare(self, model: optuav.Model, given: optuav.Itinerary) -> None:
        """Declare P1."""
        optuav.P1().declare(model, given)


def test_routes_over_three_near_devices_are_chosen_among() -> None:
    """Many routes are all but alike; the text speaks of devices if there are several."""
    near = ((1010, 1470), (955, 1522), (1030, 1550))
    devices = [{"name": f"u{k}", "position_m": [*at, 0]} for k, at in enumerate(near)]
    mission = optuav.load("paper").replace({"devices": devices, "limits.deadline_s": 1800})
    choice = optuav.route_choice(mission, perspective="battery")
    assert choice.form == "hull"
    assert choice.relaxation_s == pytest.approx(785.902756, abs=1e-5)
    assert choice.model is not None
    assert choice.model.title.startswith("P1: longest hover within reach of the devices,")
    order = ("u0", "u1", "u2")
    program = optuav.formulate(mission, optuav.P1(device_order=order), perspective="battery")
    assert "within reach of the devices," in str(program)
    assert "P1 for all the devices\n" in str(
        optuav.formulate(mission, ForAll(), perspective="battery")
    )


def test_no_route_is_no_plan() -> None:
    """Infeasible with its reason, and no bound."""
    found = optuav.route_choice(three_buildings(deadline_s=60.0), perspective="battery")
    assert found.plan.status is Status.INFEASIBLE
    assert (found.relaxation_s, found.gap_s) == (None, None)
    assert "the flight takes 75.79 s" in str(found)


def test_what_is_not_linear_or_no_form_is_refused_at_once() -> None:
    with pytest.raises(InputError) as refusal:
        optuav.route_choice("paper", form="convex", perspective="available")  # type: ignore[arg-type]
    assert [fault.key for fault in refusal.value.faults] == ["form", "perspective"]

"""Who changes a number in a lesson sees what follows from it, and no error."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAPER = 'optuav.load("paper")'


def hurried(deadline_s: int) -> str:
    return f'{PAPER}.replace({{"limits.deadline_s": {deadline_s}}})'


CHANGES = [
    ("01_first_mission", PAPER, hurried(700)),
    ("01_first_mission", PAPER, 'optuav.load("matrice350")'),
    ("04_when_the_battery_runs_dry", PAPER, f'{PAPER}.replace({{"battery.capacity_As": 30000}})'),
    ("06_hover_without_a_rest", PAPER, hurried(600)),
    ("07_p4_plane_and_shadow_prices", PAPER, hurried(1500)),
    ("08_duality_and_kkt", PAPER, hurried(1500)),
    ("09_grid_or_continuous", PAPER, hurried(1500)),
    ("10_discrete_relaxed_continuous", PAPER, hurried(1500)),
    ("11_convexity_and_a_bad_local_optimum", "LEAST_REST_S = 54.0", "LEAST_REST_S = 50.0"),
    ("12_which_building_milp", PAPER, hurried(900)),
    ("13_why_infeasible", '"limits.deadline_s": 200}', '"limits.deadline_s": 150}'),
    ("14_your_own_formulation", "WANTED_S = 700.0", "WANTED_S = 650.0"),
    ("15_bracket_or_solver", PAPER, hurried(1500)),
    ("17_audit_somebody_elses_plan", "duration_s = 660", "duration_s = 700"),
    ("18_is_one_stop_enough", PAPER, hurried(1300)),
    ("21_one_leg", PAPER, f'{PAPER}.replace({{"body.mass_kg": 1.2}})'),
    ("22_link_and_laser", PAPER, f'{PAPER}.replace({{"link.rice_factor": 5.0}})'),
]


@pytest.mark.soak
@pytest.mark.parametrize(("lesson", "stated", "changed"), CHANGES)
def test_a_changed_number_ends_in_no_error(lesson: str, stated: str, changed: str) -> None:
    text = (ROOT / "examples" / f"{lesson}.py").read_text("utf-8")
    body, _, _ = text.partition("# ## Exercises")
    assert stated in body
    code = compile(body.replace(stated, changed, 1), lesson, "exec")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(code, {"__name__": "__main__"})

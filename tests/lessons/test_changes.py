"""Who changes a number in a lesson sees what follows from it, and no error."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

import optuav

ROOT = Path(__file__).parents[2]
PAPER = 'optuav.load("paper")'
ENERGY = 'formulate(mission, problem, perspective="energy"'


def hurried(deadline_s: int) -> str:
    return f'{PAPER}.replace({{"limits.deadline_s": {deadline_s}}})'


def with_battery(**values: float) -> str:
    return f"{PAPER}.replace({ {f'battery.{name}': value for name, value in values.items()} })"


CHANGES = [
    ("01_first_mission", PAPER, hurried(700)),
    ("01_first_mission", PAPER, 'optuav.load("matrice350")'),
    ("04_when_the_battery_runs_dry", PAPER, f'{PAPER}.replace({{"battery.capacity_As": 30000}})'),
    ("06_hover_without_a_rest", PAPER, hurried(600)),
    ("07_p4_plane_and_shadow_prices", PAPER, hurried(1500)),
    ("08_duality_and_kkt", PAPER, hurried(1500)),
    ("09_grid_or_continuous", PAPER, hurried(1500)),
    ("12_discrete_relaxed_continuous", PAPER, hurried(1500)),
    ("10_convexity_and_a_bad_local_optimum", "LEAST_REST_S = 54.0", "LEAST_REST_S = 50.0"),
    ("11_which_building_milp", PAPER, hurried(900)),
    ("13_why_infeasible", '"limits.deadline_s": 200}', '"limits.deadline_s": 150}'),
    ("14_your_own_formulation", "WANTED_S = 700.0", "WANTED_S = 650.0"),
    ("15_bracket_or_solver", PAPER, hurried(1500)),
    ("17_audit_somebody_elses_plan", "duration_s = 660", "duration_s = 700"),
    ("18_is_one_stop_enough", PAPER, hurried(1300)),
    ("21_one_leg", PAPER, f'{PAPER}.replace({{"body.mass_kg": 1.2}})'),
    ("22_link_and_laser", PAPER, f'{PAPER}.replace({{"link.rice_factor": 5.0}})'),
    ("04_when_the_battery_runs_dry", PAPER, with_battery(packs=4)),
    ("04_when_the_battery_runs_dry", PAPER, with_battery(available_fraction=0.99)),
    ("04_when_the_battery_runs_dry", PAPER, hurried(300)),
    ("07_p4_plane_and_shadow_prices", PAPER, f'{PAPER}.replace({{"limits.min_soc": 0.0}})'),
    ("07_p4_plane_and_shadow_prices", PAPER, with_battery(charge_current_A=0.0)),
    ("07_p4_plane_and_shadow_prices", PAPER, f'{PAPER}.replace({{"laser.power_W": 0.0}})'),
    ("04_when_the_battery_runs_dry", 'e="available")\nvalues', 'e="battery")\nvalues'),
    ("07_p4_plane_and_shadow_prices", PAPER, with_battery(packs=1)),
    ("08_duality_and_kkt", PAPER, f'{PAPER}.replace({{"limits.min_soc": 0.0}})'),
    ("08_duality_and_kkt", PAPER, f'{PAPER}.replace({{"laser.power_W": 0.0}})'),
    ("13_why_infeasible", "2900", "36000"),
    ("13_why_infeasible", '"limits.deadline_s": 200}', '"limits.deadline_s": 1200}'),
    ("13_why_infeasible", 'formulate(mission, problem, perspective="battery"', ENERGY),
    ("17_audit_somebody_elses_plan", '{ at = "b10", kind = "rest", duration_s = 254.2 },', ""),
    ("17_audit_somebody_elses_plan", "duration_s = 254.2", "duration_s = 20000"),
    ("17_audit_somebody_elses_plan", "duration_s = 660", "duration_s = 60"),
    ("18_is_one_stop_enough", PAPER, hurried(800)),
    ("19_fit_a_battery", 'perspective="battery"', 'perspective="available"'),
    ("A1_energy_or_battery", "SHORT_S, LONG_S = 800, 1200", "SHORT_S, LONG_S = 300, 1200"),
    ("A1_energy_or_battery", "SHORT_S, LONG_S = 800, 1200", "SHORT_S, LONG_S = 300, 400"),
    ("23_sweep_ten_parameters", "SLICES = 16", "SLICES = 15"),
    ("24_random_layouts_with_confidence", 'layouts("paper", 60', 'layouts("paper", 3'),
    ("26_where_to_put_the_laser", "ENOUGH_S = 616.0", "ENOUGH_S = 5000.0"),
    ("26_where_to_put_the_laser", "LASERS = 3", "LASERS = 1"),
    ("26_where_to_put_the_laser", '"laser.visibility_km": 2', '"laser.visibility_km": 0.2'),
    ("26_where_to_put_the_laser", '"limits.deadline_s": 1800', '"limits.deadline_s": 60'),
    ("22_link_and_laser", PAPER, f'{PAPER}.replace({{"laser.power_W": 100.0}})'),
    ("26_where_to_put_the_laser", "LASERS = 3", "LASERS = 11"),
    ("A1_energy_or_battery", '"energy", "adjusted")\n', '"energy", "available")\n'),
    ("27_on_a_cluster", "scenarios_per_part = 1000", "scenarios_per_part = 20000"),
    ("27_on_a_cluster", "for _ in range(2)]", "for _ in range(1)]"),
    ("28_how_far_does_a_laser_reach", "NEEDED_W = 150.0", "NEEDED_W = 1500.0"),
    ("29_how_fast_to_fly", "SHORT_S = 7200.0, 1500.0", "SHORT_S = 3000.0, 900.0"),
    ("30_over_the_houses", "HEIGHT_M = 200.0", "HEIGHT_M = 120.0"),
    ("35_three_sensors_one_rest", "MISSIONS = 60", "MISSIONS = 5"),
]
STOPS = [
    ("01_first_mission", PAPER, hurried(60)),
]


@pytest.mark.soak
@pytest.mark.parametrize(("lesson", "stated", "changed"), CHANGES)
def test_a_changed_number_ends_in_no_error(lesson: str, stated: str, changed: str) -> None:
    run(lesson, stated, changed)


@pytest.mark.soak
@pytest.mark.parametrize(("lesson", "stated", "changed"), STOPS)
def test_a_number_with_nothing_to_show_ends_in_words(
    lesson: str, stated: str, changed: str
) -> None:
    with pytest.raises((SystemExit, optuav.NoPlanError)) as stop:
        run(lesson, stated, changed)
    assert str(stop.value).endswith(".") or isinstance(stop.value, optuav.NoPlanError)


def run(lesson: str, stated: str, changed: str) -> None:
    text = (ROOT / "examples" / f"{lesson}.py").read_text("utf-8")
    body, _, _ = text.partition("# ## Exercises")
    assert stated in body
    code = compile(body.replace(stated, changed, 1), lesson, "exec")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(code, {"__name__": "__main__", "__file__": f"{ROOT}/examples/{lesson}.py"})

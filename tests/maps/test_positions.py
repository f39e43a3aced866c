"""Maps have the hover times of single solves at every point, and the reason where there is none."""

from __future__ import annotations

import itertools
import math
import re
import subprocess
import sys
from typing import Any, get_args

import numpy as np
import pytest

pytest.importorskip("xarray")

import optuav
from optuav.maps.output import blocks
from optuav.maps.positions import hovers
from optuav.mission import Mission
from optuav.options import Perspective
from optuav.presentation.text import as_text
from tests.several_devices import three

PAPER = optuav.load("paper")
SMALL = PAPER.replace({"buildings": PAPER.buildings[6:8]})
"""Two roofs near the middle, so that single solves are quick."""
NEAR = SMALL.replace({"link.device_m": [1000, 300, 0]})
"""With the device so near to the direct route that the hover point follows the laser."""
KEYS = {"device": "link.device_m", "laser": "laser.position_m", "hover_point": "route.hover_m"}
AROUND = {"device": (200, 1500), "laser": (0, 0), "hover_point": (600, 2550)}


def moved(mission: Mission, over: str, x: float, y: float, z: float) -> Mission:
    return mission.replace({KEYS[over]: [x, y, z]})


@pytest.mark.parametrize("perspective", get_args(Perspective))
@pytest.mark.parametrize("over", KEYS)
def test_points_are_single_solves(over: str, perspective: Any) -> None:
    """Some of them without a plan: the same hover, or none."""
    x, y = (low + 431.7 * np.arange(4) for low in AROUND[over])
    height_m = {"device": 3.0, "laser": 70.0, "hover_point": 60.0}[over]
    bounds = x[0], y[0], x[-1], y[-1]
    function, mission = getattr(optuav.maps, over), NEAR if over == "laser" else SMALL
    found = function(mission, 431.7, bounds=bounds, height_m=height_m, perspective=perspective)
    assert found.x.values.tolist() == pytest.approx(x)
    assert found.y.values.tolist() == pytest.approx(y)
    words = found.reason.attrs["flag_meanings"].split()
    for row, column in np.ndindex(4, 4):
        one = moved(mission, over, x[column], y[row], height_m)
        plan = optuav.solve(one, perspective=perspective)
        hover_s = plan.hover_time_s if plan else math.nan
        here = found[row, column]
        assert float(here) == pytest.approx(hover_s, abs=1e-8, nan_ok=True)
        assert (words[int(here.reason)] == "none") == bool(plan)
    assert found.attrs["over"] == KEYS[over]
    assert found.attrs["height_m"] == height_m


def test_behind_a_wall_the_laser_brings_no_rest() -> None:
    """A wall, too high to rest on, hides it from roof and hover point: as if there were none."""
    wall = {"name": "wall", "position_m": [700, 300, 1e5], "footprint_m": [600, 20]}
    roof = {"name": "roof", "position_m": [700, 500, 80], "footprint_m": [40, 40]}
    mission = PAPER.replace({"buildings": [roof, wall], "flight.through_buildings": True})
    found = optuav.maps.laser(mission, 400, bounds=(700, 0, 1900, 400))
    dark_s = optuav.solve(mission.replace({"laser": None}), "P3").hover_time_s
    assert float(found.sel(x=700, y=0)) == pytest.approx(dark_s, abs=1e-8)
    rested = optuav.solve(moved(mission, "laser", 1900, 400, 50))
    assert rested.route == ("origin", "hover", "roof", "destination")
    assert float(found.sel(x=1900, y=400)) == pytest.approx(rested.hover_time_s, abs=1e-8)
    assert rested.hover_time_s > dark_s + 50.0


def test_out_of_reach_there_is_no_plan_and_the_reason() -> None:
    """The coverage at 50 m height is a disc of 499 m around the device, by d_max = 501.48 m."""
    empty = PAPER.replace({"buildings": []})
    found = optuav.maps.hover_point(empty, 100, bounds=(300, 2300, 1700, 3700))
    away_m = np.hypot(found.x - 1000, found.y - 3000).transpose("y", "x").to_numpy()
    reach_m = math.sqrt(501.4836**2 - 50**2)
    assert np.array_equal(np.isnan(found.to_numpy()), away_m > reach_m)
    words = found.reason.attrs["flag_meanings"].split()
    outside = found.reason.to_numpy()[away_m > reach_m]
    assert {words[code] for code in outside} == {"out_of_reach"}
    assert not found.reason.to_numpy()[away_m < reach_m].any()


def test_a_hover_point_too_high_is_said_to_be_so() -> None:
    found = optuav.maps.hover_point(SMALL, 100, bounds=(900, 2700, 1000, 2800), height_m=120.0)
    assert np.isnan(found).all()
    assert "best_m" not in found.attrs
    words = found.reason.attrs["flag_meanings"].split()
    assert {words[code] for code in found.reason.to_numpy().ravel()} == {"altitude"}


def test_the_best_point_is_the_nearest_of_those_that_tie() -> None:
    """Every place in sight charges as much, as the battery caps it: the laser stays where it is."""
    for x, y in ((1000.0, 0.0), (1300.0, 1100.0)):
        mission = moved(PAPER.replace({"buildings": PAPER.buildings[8:]}), "laser", x, y, 200)
        found = optuav.maps.laser(mission, 100, bounds=(0, 0, 2000, 1500))
        assert found.attrs["best_m"] == [x, y, 200.0]
        assert found.attrs["best_at"] == ("inside" if y > 0.0 else "edge")
        assert found.attrs["height_m"] == 200.0


def test_by_default_a_map_shows_all_there_is_and_whole_multiples() -> None:
    """Origin, destination and device, with some room; for the hover point the disc in reach."""
    found = optuav.maps.device(SMALL, 250)
    assert (np.diff(found.x) == 250).all()
    assert (np.mod(found.x, 250) == 0).all()
    assert found.x[0] < 0
    assert found.x[-1] > 2000
    assert found.y[-1] > 3000
    disc = optuav.maps.hover_point(SMALL, 50)
    assert (disc.x[0], disc.x[-1], disc.y[0], disc.y[-1]) == (450, 1550, 2450, 3550)


def test_the_reference_system_of_the_mission_goes_with_its_maps() -> None:
    assert "crs" not in optuav.maps.laser(SMALL, 1000).attrs
    there = SMALL.replace({"crs": "EPSG:25832"})
    assert optuav.maps.laser(there, 1000).attrs["crs"] == "EPSG:25832"
    assert optuav.Mission.from_dict(there.to_dict()) == there


def test_a_map_is_a_labelled_array_with_units() -> None:
    found = optuav.maps.laser("paper", 1000)
    assert (found.name, found.dims, found.attrs["units"]) == ("hover_time_s", ("y", "x"), "s")
    assert {found[name].attrs["units"] for name in ("x", "y")} == {"m"}
    assert found.attrs["mission"] == "paper"
    assert found.attrs["perspective"] == "available"


@pytest.mark.parametrize(
    ("grid", "options", "words"),
    [
        (0, {}, "step_m = 0: must be a number, 0.001 <= x <= 1e6 [m]"),
        (-5.0, {}, "step_m = -5.0: "),
        (math.nan, {}, "step_m = nan: "),
        (True, {}, "step_m = true: "),
        ("25", {}, "step_m = '25': "),
        (([0, 1], [1, 2]), {}, "step_m = [[0, 1], [1, 2]]: "),
        (10, {"bounds": 3}, "bounds = 3: must be least x"),
        (10, {"bounds": "wide"}, "bounds = 'wide': must be least x"),
        (10, {"bounds": (0, 0, 0, 100)}, "bounds = [0, 0, 0, 100]: must be least x"),
        (10, {"bounds": (0, 100, 50, 0)}, "bounds = [0, 100, 50, 0]: must be least x"),
        (10, {"bounds": (0, 0, 100)}, "bounds = [0, 0, 100]: must be least x"),
        (10, {"bounds": (0, 0, math.nan, 1)}, "bounds = [0, 0, nan, 1]: must be least x"),
        (10, {"bounds": (0, 0, 2e6, 1e6)}, "|x| <= 1e6"),
        (60, {"bounds": (0, 0, 50, 500)}, "at least two points each way"),
        (100, {"height_m": math.inf}, "height_m = inf: must be a number, |x| <= 1e6 [m]"),
        (100, {"perspective": "none"}, "perspective = 'none': must be one of"),
        (0.01, {}, "at most 4000000 points, which take 0.4 GB"),
        (1, {"bounds": (0, 0, 2999, 2999)}, "3000 × 3000 = 9000000 points: must be at most"),
    ],
)
def test_faults_are_named(grid: Any, options: dict[str, Any], words: str) -> None:
    with pytest.raises(optuav.InputError) as caught:
        optuav.maps.laser(SMALL, grid, **options)
    assert words in str(caught.value)


def test_all_faults_are_named_at_once() -> None:
    dark = SMALL.replace({"laser": None})
    with pytest.raises(optuav.InputError) as caught:
        optuav.maps.laser(dark, 0, bounds=(1, 1, 0, 0), height_m=1e9, perspective="x")  # type: ignore[arg-type]
    keys = [fault.key for fault in caught.value.faults]
    assert keys == ["height_m", "step_m", "bounds", "perspective", "laser"]


def test_a_mission_that_is_missing_hides_no_fault_of_the_grid() -> None:
    with pytest.raises(optuav.InputError) as caught:
        optuav.maps.laser("nosuch", 0, height_m="x", perspective="y")  # type: ignore[arg-type]
    keys = [fault.key for fault in caught.value.faults]
    assert keys == ["height_m", "step_m", "perspective", ""]


def test_numbers_and_arrays_of_numpy_are_taken() -> None:
    """As they come out of a computation: the same map."""
    corners_m = np.array([0, 0, 2000, 1000])
    found = optuav.maps.laser(SMALL, np.int64(1000), bounds=corners_m, height_m=np.float32(50))
    assert found.identical(optuav.maps.laser(SMALL, 1000.0, bounds=(0, 0, 2000, 1000)))
    assert found.attrs["best_at"] == "edge"


def test_points_that_are_as_good_are_counted_with_the_reason() -> None:
    """Where the charger caps the current most of a map is one number; in haze one point is best."""
    found = optuav.maps.laser("paper", 500, bounds=(0, 0, 2000, 2000))
    values = found.to_numpy()
    assert found.attrs["best_points"] == (values > values.max() - 1e-6).sum() > 10
    others = f"and at {found.attrs['best_points'] - 1} other points; "
    bounds = (0, 0, 2000, 2000)
    words = as_text(blocks(hovers("laser.position_m", "paper", 500, bounds, None, "available")))
    assert f"{others}battery.charge_current_A = 10 A caps the charging current" in " ".join(
        words.split()
    )
    haze = PAPER.replace({"laser.visibility_km": 1.0})
    alone = optuav.maps.laser(haze, 500, bounds=(0, 0, 2000, 2000))
    assert alone.attrs["best_points"] == 1
    words = as_text(blocks(hovers("laser.position_m", haze, 500, bounds, None, "available")))
    assert "other point" not in words


def test_a_map_does_not_import_dask() -> None:
    """No map has chunks: xarray asks Dask of data that it wraps itself."""
    code = "import sys, optuav; optuav.maps.device('paper', 500); print('dask' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_a_map_over_one_of_several_devices_moves_only_that_one() -> None:
    """Point by point as solved with the device, or its hover point, stated there."""
    mission = three()
    found = optuav.maps.device(mission, 300, device="west", bounds=(300, 2400, 600, 2700))
    assert found.attrs["over"] == "devices.west.position_m"
    for x, y in itertools.product((300, 600), (2400, 2700)):
        moved = mission.replace({"devices.west.position_m": [x, y, 0]})
        assert float(found.sel(x=x, y=y)) == pytest.approx(optuav.solve(moved).hover_time_s)
    found = optuav.maps.hover_point(mission, 400, device="west", bounds=(300, 2600, 1100, 3000))
    stated = mission.replace({"devices.west.hover_m": [300, 2600, 50]})
    assert float(found[0, 0]) == pytest.approx(optuav.solve(stated).hover_time_s)
    assert bool(found.sel(x=1100, y=3000).isnull())  # Beyond the reach of west


@pytest.mark.parametrize(
    ("mission", "device", "words"),
    [
        ("three", None, "device: is missing; the mission has several devices: one of west, north"),
        ("three", "nord", "device = 'nord': must be one of the devices west, north, east; did you"),
        ("paper", "west", "device = 'west': goes with several devices, and the mission has one"),
    ],
)
def test_the_device_of_a_map_is_named_where_there_are_several(
    mission: str, device: str | None, words: str
) -> None:
    source = three() if mission == "three" else mission
    for function in (optuav.maps.device, optuav.maps.hover_point):
        with pytest.raises(optuav.InputError, match=re.escape(words)):
            function(source, 300, device=device)

"""Link budgets by the public API: check numbers, quadrature, jitter, limits, reach, faults."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1
from scipy.stats import ncx2

import optuav
from optuav.errors import InputError
from optuav.mission import Mission
from tests.physics.reference import printed
from tests.several_devices import three

PAPER = optuav.load("paper").replace({"battery.charge_current_A": 1e5})
RECEIVER = {"radius_m": 0.25, "optics_efficiency": 0.9, "cell_efficiency": 0.5}


def gaussian(receiver: dict[str, float] | None = None, **laser: float) -> Mission:
    """A beam at (0, 0, 50) with the figures of the check numbers, but for some."""
    keys: dict[str, Any] = {"beam": "gaussian", "aperture_m": 0.3, "source_efficiency": 0.4}
    keys |= {"wavelength_nm": 1070.0, "power_W": 5000.0, "attenuation_per_km": 0.0} | laser
    stated = {f"laser.{key}": value for key, value in keys.items()}
    stated |= {"laser.position_m": [0, 0, 50]}
    return PAPER.replace({**stated, "receiver": RECEIVER | (receiver or {})})


def divergence(**changes: float) -> Mission:
    """The beam of Chen and Jiang, table II."""
    keys = {"beam": "divergence", "aperture_m": 0.1, "divergence_rad": 3.4e-5, "power_W": 600.0}
    stated = {f"laser.{key}": value for key, value in keys.items()}
    stated |= {"laser.attenuation_per_km": 1e-3, "receiver.area_m2": 0.004}
    return PAPER.replace({**stated, **changes})


def budget(mission: Mission, distance_m: float) -> optuav.LinkBudget:
    """The budget at a distance along x."""
    x, y, z = mission.laser.position_m if mission.laser else (0.0, 0.0, 0.0)
    return optuav.link_budget(mission, (x + distance_m, y, z))


def test_check_numbers_of_shares() -> None:
    """λ 1070 nm at 1000 m; and jitter of 50 µrad at 1550 nm and 2000 m."""
    assert budget(gaussian(), 1000).share == printed("0.999984902")
    jittery = gaussian(jitter_rad=5e-5, waist_m=0.15, wavelength_nm=1550.0)
    assert budget(jittery, 2000).share == printed("0.864477303")


def test_check_numbers_of_a_chain() -> None:
    """5 kW of electricity to DC power over 500 m, every station of it."""
    mission = gaussian({"dc_efficiency": 0.95}, m2=1.1, jitter_rad=1e-5, turbulence_cn2=1e-15)
    clear = mission.replace({"laser.visibility_km": 10.0})
    found = budget(clear, 500)
    assert found.light_W == pytest.approx(2000.0, rel=1e-12)
    assert found.after_aperture_W == pytest.approx(2000.0 * (1.0 - math.exp(-4.0)), rel=1e-12)
    assert found.share == printed("0.999973413")
    assert found.on_receiver_W == printed("1807.82")
    assert found.dc_W == printed("772.842")
    assert found.current_A == pytest.approx(found.dc_W / 11.1)
    assert found.peak_irradiance_W_m2 == pytest.approx(101_340.0, abs=1.0)
    assert found.distance_m == pytest.approx(500.0)
    assert found.limit is None
    assert found.in_sight


@pytest.mark.parametrize(("visibility_km", "km"), [(None, 1571.0), (10.0, 41.0)])
def test_hazard_distance_of_2_kw(visibility_km: float | None, km: float) -> None:
    """In vacuum and in clear air, whatever jitter and turbulence are."""
    mission = gaussian(jitter_rad=1e-4, turbulence_cn2=1e-13)
    if visibility_km:
        mission = mission.replace({"laser.visibility_km": visibility_km})
    found = budget(mission, 500)
    assert found.hazard_distance_m / 1e3 == pytest.approx(km, abs=0.5)
    assert found.eye_limit_W_m2 == 50.0


def test_turbulence_is_the_integral_of_the_second_moment() -> None:
    """a ∫ J₁(aκ) exp(−κ² w²/8 − ½·1.09275 C_n² k² d (dκ/k)^(5/3)) dκ, between zeros of J₁."""
    d, a, cn2, k = 3000.0, 0.25, 5e-14, 2.0 * math.pi / 1070e-9
    w0 = 0.3 / math.sqrt(8.0)
    w2 = w0**2 * (1.0 + (1070e-9 * d / (math.pi * w0**2)) ** 2)

    def integrand(κ: float) -> float:
        phase = 0.5 * 1.09275 * cn2 * k**2 * d * (d * κ / k) ** (5.0 / 3.0)
        return float(a * j1(a * κ)) * math.exp(-(κ**2) * w2 / 8.0 - phase)

    edges = np.arange(0.0, 200.0, math.pi / a)
    expected = sum(quad(integrand, *e)[0] for e in itertools.pairwise(edges))
    found = budget(gaussian(turbulence_cn2=cn2), d)
    assert 0.1 < expected < 0.95
    assert found.share == pytest.approx(expected, abs=1e-8)
    assert found.peak_irradiance_W_m2 < budget(gaussian(), d).peak_irradiance_W_m2


@pytest.mark.parametrize("key", ["max_irradiance_W_m2", "max_power_W", "charge_current_A"])
def test_limits_act_on_each_moment_of_jitter(key: str) -> None:
    """100 000 drawn displacements, each with its power within the limit; the key is named."""
    d, σ, a = 3000.0, 5e-5, 0.25
    arriving_W = 2000.0 * (1.0 - math.exp(-4.0))
    most_W = 500.0
    value = {
        "max_irradiance_W_m2": most_W / 0.45 / (math.pi * a**2),
        "max_power_W": most_W,
        "charge_current_A": most_W / 11.1,
    }[key]
    limit = {key: value} if key.startswith("max") else {}
    mission = gaussian(limit, jitter_rad=σ)
    if not limit:
        mission = mission.replace({"battery.charge_current_A": value})
    w0 = 0.3 / math.sqrt(8.0)
    w2 = w0**2 + (1070e-9 * d / (math.pi * w0)) ** 2
    r = np.hypot(*np.random.default_rng(4).normal(0.0, σ * d, (2, 100_000)))
    power_W = arriving_W * 0.45 * ncx2.cdf(4.0 * a**2 / w2, 2, 4.0 * r**2 / w2)
    drawn = np.minimum(power_W, most_W)
    found = budget(mission, d)
    assert found.dc_W == pytest.approx(drawn.mean(), abs=5.0 * drawn.std() / math.sqrt(len(r)))
    assert found.dc_W < 0.99 * min(most_W, found.on_receiver_W * 0.45)
    assert found.limit is not None
    assert key in found.limit
    assert "upper bound" not in str(found)
    turbulent = mission.replace({"laser.turbulence_cn2": 1e-14})
    assert "upper bound" in str(budget(turbulent, d)).replace("\n", " ")


def test_the_formula_of_the_literature() -> None:
    """χAP e^(−αd)/(D + dΔθ)² by hand, reaches of 568 m and 1216 m, and a uniform disc's peak."""
    found = budget(divergence(), 700)
    width = 0.1 + 700 * 3.4e-5
    light = 600.0 * math.exp(-1e-6 * 700)
    assert found.dc_W == pytest.approx(0.004 * light / width**2, rel=1e-12)
    assert found.on_receiver_W == pytest.approx(found.dc_W, rel=1e-12)
    assert found.peak_irradiance_W_m2 == pytest.approx(4.0 * light / (math.pi * width**2))
    assert found.reach_m(168.5) == pytest.approx(568.0, abs=0.5)
    weaker = budget(divergence(**{"laser.power_W": 500.0}), 700)
    assert weaker.reach_m(100.0) == pytest.approx(1216.0, abs=0.5)
    assert budget(divergence(), 0).share == pytest.approx(0.4)
    large = divergence(**{"receiver.area_m2": 0.04, "receiver.optics_efficiency": 0.25})
    assert budget(large, 0).on_receiver_W == 600.0


@pytest.mark.parametrize("mission", [gaussian(jitter_rad=2e-5), divergence()])
def test_reach_is_where_the_power_is_received(mission: Mission) -> None:
    """Power at the reach is the power that was asked for; limits, none and all."""
    here = budget(mission, 500)
    for share in (0.2, 0.5, 0.9):
        wanted_W = share * here.dc_W
        assert budget(mission, here.reach_m(wanted_W)).dc_W == pytest.approx(wanted_W, rel=1e-9)
    assert here.reach_m(0.0) == math.inf
    assert here.reach_m(1e6) == 0.0
    capped = budget(mission.replace({"battery.charge_current_A": 1.0}), 500)
    assert capped.reach_m(11.2) == 0.0
    assert capped.reach_m(11.0) > 500.0


def test_places_and_sight() -> None:
    """A building by its name, its own roof never in the way; a point behind a wall is not seen."""
    mission = gaussian()
    b3, there = optuav.link_budget(mission, "b3"), mission.buildings[2].position_m
    assert b3.in_sight
    assert b3.distance_m == pytest.approx(math.dist((0, 0, 50), there))
    wall = {"name": "wall", "position_m": [100, 0, 90], "footprint_m": [10, 50]}
    hidden = mission.replace({"buildings": [wall]})
    assert not budget(hidden, 200).in_sight
    assert "a building hides the laser" in str(budget(hidden, 200))


def test_table_display_and_picture() -> None:
    """The same figures in a frame, as HTML and as bars that end at the power into the battery."""
    pytest.importorskip("matplotlib")
    pytest.importorskip("pandas")
    mission = gaussian({"max_power_W": 300.0})
    found = budget(mission, 500)
    frame = found.to_frame().set_index("quantity")
    assert frame.loc["DC power", "value"] == found.dc_W == pytest.approx(300.0)
    assert "receiver.max_power_W = 300 W limits the power" in found._repr_html_()
    assert "not a safety assessment" in found._repr_html_()
    ax = found.plot()
    heights = [bar.get_height() for bar in ax.patches[::2]]
    expected = [5000.0, 2000.0, found.after_aperture_W, found.after_aperture_W]
    expected += [found.on_receiver_W, 0.45 * found.on_receiver_W, 300.0]
    assert heights == pytest.approx(expected)
    assert len(budget(divergence(), 500).plot().get_xticks()) == 6


@pytest.mark.parametrize(
    ("at", "words"),
    [
        ("b33", "did you mean"),
        ((1.0, 2.0), "its x, y and z, each a number"),
        ((1.0, 2.0, 1e9), "|x| <= 1e6"),
        (5, "the name of a place"),
    ],
)
def test_other_places_are_refused(at: Any, words: str) -> None:
    with pytest.raises(InputError) as refusal:
        optuav.link_budget(gaussian(), at)
    assert "at" in str(refusal.value)
    assert words in str(refusal.value)


def test_what_has_no_budget() -> None:
    """A mission without a beam, a hover point that does not exist, a power that is no number."""
    with pytest.raises(InputError, match=r"laser.beam: is missing"):
        optuav.link_budget("paper", "hover")
    far = gaussian().replace({"link.device_m": [0, 0, -900]})
    with pytest.raises(InputError, match="none is in reach"):
        optuav.link_budget(far, "hover")
    with pytest.raises(InputError, match=r"dc_W = nan: must be a number"):
        budget(gaussian(), 500).reach_m(math.nan)


def test_a_device_of_several_is_a_place() -> None:
    """The light at w_U of the check numbers, and a roof is not the building of another place."""
    keys = {"beam": "gaussian", "aperture_m": 0.3, "source_efficiency": 0.4, "power_W": 5000}
    laser = {f"laser.{key}": value for key, value in keys.items()}
    mission = three().replace({**laser, "receiver": {"radius_m": 0.25, "cell_efficiency": 0.45}})
    budget = optuav.link_budget(mission, "west")
    laser_m = mission.laser.position_m if mission.laser else (0.0, 0.0, 0.0)
    west_m = (496.2356, 2110.3833, 50.0)
    assert budget.distance_m == pytest.approx(math.dist(laser_m, west_m), abs=1e-3)
    assert all(optuav.link_budget(mission, name).in_sight for name in mission.buildings.names)
    with pytest.raises(InputError, match="did you mean 'west'"):
        optuav.link_budget(mission, "wets")

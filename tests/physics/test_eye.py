"""Exposure limits, hazard distances, and the roots that they and other reaches are found by."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.physics import eye, laser, roots
from optuav.physics.beams import divergence, gaussian

BEAM = gaussian.Emitter(1070.0, 0.3, gaussian.default_waist(0.3))
LIMITS_W_M2 = {810.0: 16.60, 980.0: 36.31, 1064.0: 50.0, 1070.0: 50.0, 1550.0: 1000.0}


@pytest.mark.parametrize(("wavelength", "limit"), LIMITS_W_M2.items())
def test_published_limits(wavelength: float, limit: float) -> None:
    assert eye.exposure_limit(wavelength) == pytest.approx(limit, abs=0.005)


def test_limits_by_band() -> None:
    """C7 from 1150 nm on, as published; nothing is known below 700 nm and beyond 1 mm."""
    wavelengths = np.array([699.9, 700.0, 1100.0, 1150.0, 1175.0, 1200.0, 1250.0, 1400.0, 1e6, 2e6])
    expected = [math.nan, 10.0, 50.0, 50.0, 50.0 * 10.0**0.45, 50.0 * (8.0 + 0.01), 450.0]
    limits = eye.exposure_limit(wavelengths)
    np.testing.assert_allclose(limits, [*expected, 1000.0, 1000.0, math.nan], rtol=1e-12)
    assert eye.exposure_limit(1049.999) == pytest.approx(eye.exposure_limit(1050.001), rel=0.003)


@pytest.mark.soak
def test_limits_of_another_program() -> None:
    """The package lasercalc, which has C7 = 8 from 1200 to 1400 nm, as older editions have."""
    from lasercalc import mpe_eye

    for wavelength in (*range(705, 1200, 10), *range(1400, 2001, 50), 1e5):
        other = mpe_eye(float(wavelength), 100.0).irradiance_w_m2
        assert eye.exposure_limit(float(wavelength)) == pytest.approx(other, rel=1e-6)


@pytest.mark.parametrize(
    ("wavelength", "visibility_km", "km"),
    [(1070.0, None, 1571.0), (1070.0, 10.0, 41.0), (1550.0, None, 242.0), (1550.0, 10.0, 35.0)],
)
def test_hazard_distance_of_2_kw(wavelength: float, visibility_km: float | None, km: float) -> None:
    """In vacuum and in clear air; in vacuum the width at which the peak is the limit."""
    beam = BEAM._replace(wavelength_nm=wavelength)
    limit = eye.exposure_limit(wavelength)
    per_km = 0.0 if visibility_km is None else laser.attenuation(wavelength, visibility_km)

    def irradiance(d: float) -> float:
        return gaussian.axis_irradiance(beam, d)

    r = eye.hazard_distance(irradiance, 2000.0, per_km, limit)
    assert r / 1e3 == pytest.approx(km, abs=0.5)
    air = math.exp(-per_km * r / 1e3)
    assert 2.0 * 2000.0 * air / (math.pi * gaussian.width(beam, r) ** 2) == pytest.approx(limit)


def test_hazard_distances_at_the_ends() -> None:
    """A harmless beam, one that never spreads in vacuum, and several at once."""
    lamp = divergence.Divergence(0.1, 0.0, 0.004, 1.0)

    def irradiance(d: float) -> float:
        return divergence.disc_irradiance(lamp, d)

    powers = np.array([0.1, 0.5, 2000.0])
    far = eye.hazard_distance(irradiance, powers, 0.0, 50.0)
    np.testing.assert_array_equal(far, [0.0, math.inf, math.inf])
    air = eye.hazard_distance(irradiance, powers, 0.1, 50.0)
    expected = np.log(powers[1:] * irradiance(0.0) / 50.0) / 1e-4
    np.testing.assert_allclose(air, [0.0, *expected], rtol=1e-12)
    assert math.isnan(eye.hazard_distance(irradiance, 1.0, 0.0, math.nan))


@given(st.floats(-8.0, 8.0), st.floats(-6.0, 6.0))
def test_last_finds_the_root_from_any_scale(log_root: float, log_scale: float) -> None:
    root = 10.0**log_root
    found = roots.last_nonnegative(lambda x: root - x, 10.0**log_scale)
    assert found == pytest.approx(root, rel=1e-9, abs=1e-17 * 10.0**log_scale)


def test_last_where_there_is_no_root() -> None:
    """Below 0 at once, never below 0, undefined."""
    values = np.array([-1.0, 1.0, math.nan, 0.0])
    last = roots.last_nonnegative(lambda x: values + 0.0 * x, 1.0)
    np.testing.assert_array_equal(last, [0.0, math.inf, math.nan, math.inf])

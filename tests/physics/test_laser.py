"""Laser charging: attenuation by weather, received power, its limit and its floor."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import laser
from tests.physics.reference import CHARGE_A, CONVERSION, NOMINAL_V, printed

AT_810_NM = laser.Conversion(0.445, -0.75, 0.5414, -0.2313)
LIMIT_W = CHARGE_A * NOMINAL_V

CONVERSIONS = st.builds(
    laser.Conversion,
    emitter_slope=st.floats(0.05, 0.9),
    emitter_offset_W=st.floats(-5.0, 0.0),
    receiver_slope=st.floats(0.05, 0.9),
    receiver_offset_W=st.floats(-2.0, 0.0),
)
SHARES = st.floats(0.01, 1.0)
SOURCES = st.floats(0.0, 5000.0)
LIMITS = st.floats(0.0, 500.0)


def unlimited_power(conversion: laser.Conversion, source_W: float, share: Any) -> Any:
    """Power received of a source where a share of the light arrives, however much that is."""
    return laser.received_power(conversion, source_W, -np.log(share), 1000.0, math.inf)


@pytest.mark.parametrize(
    ("visibility_km", "exponent"),
    [
        *((60.0, 1.6), (50.0, 1.3), (23.0, 1.3), (10.0, 1.3), (6.0, 1.3)),
        *((3.0, 0.82), (1.0, 0.5), (0.8, 0.3), (0.5, 0.0), (0.4, 0.0), (0.05, 0.0)),
    ],
)
def test_exponent_in_clear_air_haze_and_fog(visibility_km: float, exponent: float) -> None:
    """Kim's model, by the visibility."""
    assert laser.size_exponent(visibility_km) == pytest.approx(exponent, abs=1e-15)


@pytest.mark.parametrize("visibility_km", [0.5, 1.0, 6.0])
def test_exponent_is_continuous_up_to_50_km(visibility_km: float) -> None:
    below, above = laser.size_exponent(visibility_km + np.array([-1e-9, 1e-9]))
    assert above == pytest.approx(below, abs=1e-8)


def test_attenuation_of_the_paper() -> None:
    """Clear air at 1550 nm."""
    assert laser.attenuation(1550.0, 10.0) == printed("0.1019")


@pytest.mark.parametrize(
    ("visibility_km", "per_km"),
    [
        (10.0, 3.92 / 10 / (810 / 550) ** 1.3),
        (3.0, 3.92 / 3 / (810 / 550) ** 0.82),
        (0.4, 9.8),
    ],
)
def test_attenuation_at_810_nm(visibility_km: float, per_km: float) -> None:
    """In fog the wavelength does not matter."""
    assert laser.attenuation(810.0, visibility_km) == pytest.approx(per_km, rel=1e-14)


def test_transmission_counts_kilometres() -> None:
    assert laser.transmission(0.1019, 0.0) == 1.0
    assert laser.transmission(0.1019, 2500.0) == pytest.approx(math.exp(-0.25475), rel=1e-14)


@pytest.mark.parametrize("source_power_W", [500.0, 1000.0])
def test_efficiency_below_a_kilometre(source_power_W: float) -> None:
    """Around 17.5 % for Table I, as the paper says, and less with every metre."""
    share = laser.transmission(0.1019, np.linspace(0.0, 1000.0, 101))
    efficiency = laser.efficiency(
        unlimited_power(CONVERSION, source_power_W, share), source_power_W
    )
    assert efficiency.mean() == pytest.approx(0.175, abs=0.002)
    assert np.abs(efficiency - 0.175).max() < 0.011
    assert (np.diff(efficiency) < 0.0).all()


def test_received_power_by_hand() -> None:
    """Both wavelengths one kilometre away, without a limit."""
    for conversion, per_km, expected in (
        (CONVERSION, 0.1019, 0.5434 * math.exp(-0.1019) * (0.34 * 600 - 1.1) - 0.2761),
        (AT_810_NM, 0.2369, 0.5414 * math.exp(-0.2369) * (0.445 * 600 - 0.75) - 0.2313),
    ):
        received = laser.received_power(conversion, 600.0, per_km, 1000.0, math.inf)
        assert received == pytest.approx(expected, rel=1e-13)


def test_source_of_the_paper_is_turned_down() -> None:
    """1000 W would give more than 10 A as far as the hover point, 2501 m from the laser."""
    distances_m = np.array([0.0, 2501.0152])
    share = laser.transmission(0.1019, distances_m)
    assert (unlimited_power(CONVERSION, 1000.0, share) > LIMIT_W).all()
    received_W = laser.received_power(CONVERSION, 1000.0, 0.1019, distances_m, LIMIT_W)
    np.testing.assert_array_equal(received_W, LIMIT_W)
    assert laser.source_limit(CONVERSION, LIMIT_W, 1.0) == pytest.approx(
        (111 - 0.5434 * -1.1 + 0.2761) / (0.34 * 0.5434), rel=1e-13
    )


@given(CONVERSIONS, LIMITS, SHARES)
def test_source_limit_is_the_inverse(
    conversion: laser.Conversion, limit_W: float, share: float
) -> None:
    """At the source power it names, exactly the limit is received."""
    source_W = laser.source_limit(conversion, limit_W, share)
    assert source_W >= 0.0
    assert unlimited_power(conversion, source_W, share) == pytest.approx(
        limit_W, rel=1e-12, abs=1e-12
    )


@given(CONVERSIONS, SOURCES, st.floats(0.0, 10.0), st.floats(0.0, 2e4), LIMITS)
def test_received_power_is_that_of_the_limited_source(
    conversion: laser.Conversion,
    source_W: float,
    per_km: float,
    distance_m: float,
    limit_W: float,
) -> None:
    """P_0 at min(P_s, limit of the source), never below 0, never above the limit."""
    received = laser.received_power(conversion, source_W, per_km, distance_m, limit_W)
    a1, b1 = conversion.emitter_slope, conversion.emitter_offset_W
    a2, b2 = conversion.receiver_slope, conversion.receiver_offset_W
    ν = math.exp(-per_km * distance_m / 1000)
    assert 0.0 <= received <= limit_W
    if ν > 1e-200:
        P_s = min(source_W, (limit_W - a2 * b1 * ν - b2) / (a1 * a2 * ν))
        line = a1 * a2 * ν * P_s + a2 * b1 * ν + b2
        assert received == pytest.approx(max(line, 0.0), rel=1e-10, abs=1e-10)
    further = laser.received_power(conversion, source_W, per_km, 2 * distance_m + 1, limit_W)
    stronger = laser.received_power(conversion, 2 * source_W + 1, per_km, distance_m, limit_W)
    assert further <= received * (1 + 1e-12) or received < 1e-12
    assert received <= stronger * (1 + 1e-12)


def test_nothing_is_received_below_the_threshold() -> None:
    """A weak source, a source switched off, fog, and no light at all."""
    for source_W, per_km, distance_m in (
        *((4.5, 0.1019, 100.0), (0.0, 0.1019, 0.0)),
        *((1000.0, 9.8, 1000.0), (1000.0, 39.2, 1e5)),
    ):
        assert laser.received_power(CONVERSION, source_W, per_km, distance_m, LIMIT_W) == 0.0


def test_arrays_are_scalars_element_by_element() -> None:
    distances = np.array([0.0, 1e3, 3e3, 1e4, 4e4, 1e6])
    sources = np.array([10.0, 1000.0])[:, np.newaxis]
    np.testing.assert_allclose(
        laser.received_power(CONVERSION, sources, 0.1019, distances, LIMIT_W),
        [
            [laser.received_power(CONVERSION, P_s, 0.1019, d, LIMIT_W) for d in distances]
            for (P_s,) in sources
        ],
        rtol=1e-14,
    )
    visibilities = np.array([0.2, 0.7, 3.0, 10.0, 80.0])
    np.testing.assert_allclose(
        laser.attenuation(1550.0, visibilities),
        [laser.attenuation(1550.0, V) for V in visibilities],
        rtol=1e-14,
    )


def test_symbols_give_what_floats_give() -> None:
    """Received power as a tree over the source power and the place, weather as a parameter."""
    P_s = Variable("source", "P_s", "W", 0.0, 2000.0, "", 0)
    d = Variable("distance", "d", "m", 0.0, 1e4, "", 0)
    V = Parameter("visibility", "V", "km", 10.0)
    conversion = laser.Conversion(
        *(Parameter(name, name, "1", getattr(CONVERSION, name)) for name in CONVERSION._fields)
    )
    α = laser.attenuation(1550.0, V)
    tree = laser.received_power(conversion, P_s, α, d, LIMIT_W)
    for source, distance in ((300.0, 800.0), (1000.0, 800.0), (1.0, 800.0)):
        assert evaluate(tree, {"source": source, "distance": distance}) == laser.received_power(
            CONVERSION, source, laser.attenuation(1550.0, 10.0), distance, LIMIT_W
        )

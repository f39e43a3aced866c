"""The radio link: outage against the Rice density, coverage, and the best point to hover."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import ive

from optuav.physics import link
from tests.examples import few
from tests.physics.reference import (
    CHANNEL,
    DESTINATION_M,
    DEVICE_M,
    LASER_M,
    MIN_ALTITUDE_M,
    ORIGIN_M,
    OUTAGE_LIMIT,
    printed,
)

Point = tuple[float, float, float]
CENTRE = (0.0, 0.0, 0.0)

CHANNELS = st.builds(
    link.Channel,
    noise_power_W=st.floats(1e-12, 1e-3),
    transmit_power_W=st.floats(1e-3, 100.0),
    rice_factor=st.just(0.0) | st.floats(0.01, 100.0),
    snr_threshold_dB=st.floats(-20.0, 20.0),
    path_loss_exponent=st.floats(1.5, 4.0),
)


def rice_outage(channel: link.Channel, distance_m: float) -> float:
    """Probability that the received power is below the threshold: the Rice density integrated.

    The amplitude r of mean power 1 has the density 2 r (1+K) exp(−K − (1+K) r²) I0(2 r
    sqrt(K (1+K))); outage means P_u r² d^(−β) < γ_th N0.
    """
    K = channel.rice_factor
    needed_W = 10 ** (channel.snr_threshold_dB / 10) * channel.noise_power_W
    path_loss = distance_m**channel.path_loss_exponent
    weakest = math.sqrt(needed_W * path_loss / channel.transmit_power_W)

    def density(r: float) -> float:
        bessel = 2 * r * math.sqrt(K * (1 + K))
        return 2 * r * (1 + K) * math.exp(bessel - K - (1 + K) * r * r) * ive(0, bessel)

    return quad(density, 0.0, weakest, epsabs=0.0, epsrel=1e-12, limit=200)[0]


# Outage


def test_coverage_of_the_paper() -> None:
    assert link.coverage_radius(CHANNEL, OUTAGE_LIMIT) == printed("501.4836")


def test_where_any_outage_is_allowed_all_is_covered() -> None:
    assert link.coverage_radius(CHANNEL, 1.0) == math.inf
    radii_m = link.coverage_radius(CHANNEL, np.array([1.0, OUTAGE_LIMIT]))
    assert radii_m.tolist() == [math.inf, link.coverage_radius(CHANNEL, OUTAGE_LIMIT)]


@given(CHANNELS, st.floats(1e-4, 0.99))
def test_outage_at_the_coverage_radius_is_the_limit(channel: link.Channel, limit: float) -> None:
    """Nearer is better, further is worse."""
    radius_m = link.coverage_radius(channel, limit)
    assert link.outage_probability(channel, radius_m) == pytest.approx(limit, rel=1e-12)
    assert link.outage_probability(channel, 0.99 * radius_m) < limit
    assert link.outage_probability(channel, 1.01 * radius_m) > limit


@given(CHANNELS, st.floats(1e-6, 0.9999))
def test_outage_is_the_integral_of_the_rice_density(channel: link.Channel, limit: float) -> None:
    """The coverage radius serves to choose a distance at which something is to be seen."""
    distance_m = float(link.coverage_radius(channel, limit))
    assert link.outage_probability(channel, distance_m) == pytest.approx(
        rice_outage(channel, distance_m), rel=1e-8
    )


@pytest.mark.parametrize("rice_factor", [0.0, 1e-3, 0.5, 20.0, 100.0, 350.0, 1e4])
def test_outage_is_a_noncentral_chi_squared_distribution(rice_factor: float) -> None:
    """Probability and coverage against SciPy's, with noncentrality 2K, over the ranges allowed."""
    # Unlike scipy.special's, this distribution is as exact in the oldest SciPy that is allowed.
    from scipy.stats import ncx2

    channel = CHANNEL._replace(rice_factor=rice_factor)
    at_1_m = 2.0 * 10.0 ** (channel.snr_threshold_dB / 10.0) * (1.0 + rice_factor)
    at_1_m *= channel.noise_power_W / channel.transmit_power_W
    limits = np.array([1e-12, 1e-6, 1e-4, 0.01, 0.5, 0.9, 0.99])
    radii_m = link.coverage_radius(channel, limits)
    arguments = at_1_m * radii_m**channel.path_loss_exponent
    # Where F is flat, its rounding of 1e-16 moves the quantile further.
    expected = ncx2.ppf(limits, 2.0, 2.0 * rice_factor)
    np.testing.assert_allclose(arguments, expected, rtol=2e-13)
    for share in (0.9, 1.0, 1.1):
        np.testing.assert_allclose(
            link.outage_probability(channel, share * radii_m),
            ncx2.cdf(arguments * share**channel.path_loss_exponent, 2.0, 2.0 * rice_factor),
            rtol=1e-12,
            atol=1e-20,
        )


@given(CHANNELS, st.floats(1e-3, 2.0))
def test_outage_without_line_of_sight(channel: link.Channel, share: float) -> None:
    """K = 0 is Rayleigh's channel: 1 − exp(−γ_th N0 d^β / P_u)."""
    rayleigh = channel._replace(rice_factor=0.0)
    noise_W = 10 ** (channel.snr_threshold_dB / 10) * channel.noise_power_W
    distance_m = share * (channel.transmit_power_W / noise_W) ** (1 / channel.path_loss_exponent)
    expected = -math.expm1(
        -noise_W * distance_m**channel.path_loss_exponent / channel.transmit_power_W
    )
    assert link.outage_probability(rayleigh, distance_m) == pytest.approx(expected, rel=1e-11)


def test_outage_from_beside_the_device_to_far_away() -> None:
    """From 0 to 1, never falling, and element by element what scalars give."""
    distances = np.array([0.0, 1e-3, 1.0, 100.0, 400.0, 501.4836, 600.0, 1e3, 1e5, 1e9])
    together = link.outage_probability(CHANNEL, distances)
    np.testing.assert_array_equal(
        together, [link.outage_probability(CHANNEL, each) for each in distances]
    )
    assert together[0] == 0.0
    assert together[-1] == pytest.approx(1.0, abs=1e-12)
    assert (np.diff(together) >= -1e-12).all()
    radii = link.coverage_radius(CHANNEL, np.array([0.001, 0.01, 0.1]))
    assert (np.diff(radii) > 0).all()
    assert radii[1] == link.coverage_radius(CHANNEL, 0.01)


@pytest.mark.parametrize(("decibel", "ratio"), [(-10.0, 0.1), (0.0, 1.0), (20.0, 100.0)])
def test_threshold_is_in_decibel(decibel: float, ratio: float) -> None:
    found, at_0_dB = (CHANNEL._replace(snr_threshold_dB=each) for each in (decibel, 0.0))
    expected = ratio * at_0_dB.squared_argument_at_1_m
    assert found.squared_argument_at_1_m == pytest.approx(expected)


# Hover point


def way(origin_m: Point, destination_m: Point, points: np.ndarray) -> np.ndarray:
    """Length of origin → point → destination for points in the last axis."""
    return np.linalg.norm(points - np.array(origin_m), axis=-1) + np.linalg.norm(
        points - np.array(destination_m), axis=-1
    )


def in_disc(device_m: Point, radius_m: float, altitude_m: float, point: Point) -> bool:
    reach = math.sqrt(radius_m**2 - (altitude_m - device_m[2]) ** 2)
    beside = math.hypot(point[0] - device_m[0], point[1] - device_m[1])
    return point[2] == altitude_m and beside <= reach * (1 + 1e-12) + 1e-12


def dense_disc(device_m: Point, radius_m: float, altitude_m: float) -> np.ndarray:
    """Points all over the covered disc, its rim most of all."""
    reach = math.sqrt(radius_m**2 - (altitude_m - device_m[2]) ** 2)
    rim = np.exp(1j * np.linspace(0.0, 2 * math.pi, 2000, endpoint=False))
    inside = np.linspace(0.0, 0.99, 60)[:, np.newaxis] * rim[::20]
    plan = reach * np.concatenate([rim, inside.ravel()])
    x, y = device_m[0] + plan.real, device_m[1] + plan.imag
    return np.stack([x, y, np.full(plan.shape, altitude_m)], axis=-1)


PLAN = st.floats(-3.0, 3.0)
HEIGHT = st.sampled_from([0.0, 0.0, 1e-3, 0.3]) | st.floats(-1.0, 1.0)
ENDS = st.tuples(PLAN, PLAN, HEIGHT)


def test_hover_point_of_the_paper() -> None:
    x, y, z = link.hover_point(
        ORIGIN_M,
        DESTINATION_M,
        DEVICE_M,
        link.coverage_radius(CHANNEL, OUTAGE_LIMIT),
        MIN_ALTITUDE_M,
        LASER_M,
    )
    assert x == printed("1000")
    assert x == pytest.approx(1000.0, abs=1e-9)
    assert y == printed("2501.0152")
    assert z == 50.0


@settings(few(40))
@given(ENDS, ENDS, st.floats(0.05, 2.0), st.tuples(PLAN, PLAN, HEIGHT))
@example((-1.0001, 0.0, 0.0), (0.99, 0.0, 0.01), 1.0, (0.0, 0.0, 0.0))
@example((-1.0000001, 0.0, 0.0), (1.1, 0.2, 0.001), 1.0, (0.0, 0.0, 0.0))
@example((0.0, 2.0, 0.0), (0.0, 3.0, 0.0), 1.0, (0.0, 0.0, 0.0))
@example((-2.0, 1.0, 0.0), (2.0, 1.0, 0.0), 1.0, (0.0, 0.0, 0.0))
@example((1.5, 1.5, 0.2), (1.5, 1.5, -0.7), 1.0, (0.0, 0.0, 0.0))
def test_no_point_of_the_disc_is_better(
    origin: Point, destination: Point, radius: float, laser: Point
) -> None:
    """Against a dense search: ends at any height, near the rim, above and below, in line."""
    shift = np.array([400.0, -300.0, 50.0])
    ends = [tuple((1000.0 * np.array(end) + shift).tolist()) for end in (origin, destination)]
    device_m = (400.0, -300.0, 20.0)
    radius_m = math.hypot(1000.0 * radius, 30.0)
    laser_m = tuple((1000.0 * np.array(laser) + shift).tolist())
    point = link.hover_point(ends[0], ends[1], device_m, radius_m, 50.0, laser_m)
    assert in_disc(device_m, radius_m, 50.0, point)
    best_m = way(ends[0], ends[1], dense_disc(device_m, radius_m, 50.0)).min()
    assert way(ends[0], ends[1], np.array(point)) <= best_m + 1e-9
    swapped = link.hover_point(ends[1], ends[0], device_m, radius_m, 50.0, laser_m)
    assert point == pytest.approx(swapped, abs=1e-5)


def test_a_point_does_not_depend_on_those_that_are_found_along_with_it() -> None:
    """To the last bit: who has arrived does not move on while others are under way."""
    draw = np.random.default_rng(0)
    x, y = 1000.0 * draw.uniform(-3.0, 3.0, (2, 300))
    many = link.hover_point((x, y, 20.0), (700.0, 400.0, 10.0), CENTRE, 500.0, 60.0, CENTRE)
    for number in range(300):
        own = (x[[number]], y[[number]], 20.0)
        one = link.hover_point(own, (700.0, 400.0, 10.0), CENTRE, 500.0, 60.0, CENTRE)
        assert [float(each[0]) for each in one[:2]] == [float(each[number]) for each in many[:2]]


@pytest.mark.parametrize("bearing", [0.0, 0.3, 1.2345, math.pi])
def test_point_near_an_end_just_outside_the_rim(bearing: float) -> None:
    """Two points of the rim are locally best; the global one is hidden in a narrow dent.

    The origin is a decimetre outside the rim at the altitude, the destination 10 m outside on the
    other side and 1 m higher: best is to enter beside the origin.
    """
    ahead = np.array([math.cos(bearing), math.sin(bearing), 0.0])
    origin, destination = 500.1 * ahead, -510.0 * ahead + (0.0, 0.0, 1.0)
    point = link.hover_point(tuple(origin), tuple(destination), CENTRE, 500.0, 0.0, CENTRE)
    assert point == pytest.approx(tuple(500.0 * ahead), abs=1e-9)


@given(
    st.tuples(PLAN, PLAN), st.tuples(PLAN, PLAN), st.floats(0.1, 3.0), st.tuples(PLAN, PLAN, PLAN)
)
@example((-2.0, 0.0), (2.0, 0.0), 1.0, (0.5, 1.0, 0.0))
@example((-2.0, 0.0), (2.0, 0.0), 1.0, (5.0, 0.0, 0.0))
@example((-0.5, 0.0), (0.5, 0.0), 1.0, (5.0, 0.0, 0.0))
@example((0.3, 0.3), (0.3, 0.3), 1.0, (5.0, 0.0, 0.0))
@example((2.0, -1.4), (2.0, 0.0), 2.0, (0.0, 1.0, 0.0))
def test_covered_line_is_met_nearest_the_laser(
    origin: tuple[float, float], destination: tuple[float, float], radius: float, laser: Point
) -> None:
    """Both ends at the altitude: the whole chord is equally short, the laser decides."""
    shares = np.linspace(0.0, 1.0, 20_001)[:, np.newaxis]
    line = (1 - shares) * np.array(origin) + shares * np.array(destination)
    covered = line[np.hypot(*line.T) <= radius]
    point = link.hover_point((*origin, 0.0), (*destination, 0.0), CENTRE, radius, 0.0, laser)
    assert in_disc(CENTRE, radius, 0.0, point)
    if len(covered):
        direct = math.dist(origin, destination)
        assert way((*origin, 0.0), (*destination, 0.0), np.array(point)) == pytest.approx(direct)
        nearest = np.hypot(*(covered - laser[:2]).T).min()
        # Where the line touches the disc, rounding shifts the ends of the chord by its root.
        assert math.dist(point[:2], laser[:2]) <= nearest + 1e-6


def test_point_where_the_straight_way_is_covered() -> None:
    """With an end off the altitude, the shortest way meets it in one point, mirrored or crossed."""
    for sign in (1.0, -1.0):
        point = link.hover_point(
            (-100.0, 0.0, 60.0), (300.0, 80.0, 50.0 + sign * 30.0), CENTRE, 400.0, 50.0, LASER_M
        )
        assert point == pytest.approx((0.0, 20.0, 50.0), abs=1e-12)


def test_device_out_of_reach_of_the_altitude() -> None:
    """No point at that height is covered; at exactly the radius there is one."""
    ends = (-100.0, 7.0, 50.0), (300.0, -20.0, 60.0)
    assert all(map(math.isnan, link.hover_point(*ends, DEVICE_M, 49.999, 50.0, LASER_M)))
    assert all(map(math.isnan, link.hover_point(*ends, DEVICE_M, math.nan, 50.0, LASER_M)))
    for each in itertools.permutations(ends):
        assert link.hover_point(*each, DEVICE_M, 50.0, 50.0, LASER_M) == (1000.0, 3000.0, 50.0)
    below = link.hover_point(*ends, (5.0, 6.0, 100.0), 50.0, 50.0, LASER_M)
    assert below == (5.0, 6.0, 50.0)


def test_many_hover_points_at_once_are_those_of_each_alone() -> None:
    """Rim, covered stretch, ends at the hover altitude and out of reach, side by side."""
    draw = np.random.default_rng(0)
    ends = draw.uniform(-1000.0, 1000.0, (2, 3, 200))
    ends[:, 2, ::2] = 50.0
    device = (draw.uniform(-500, 500, 200), draw.uniform(-500, 500, 200), np.zeros(200))
    radius = draw.uniform(40.0, 600.0, 200)
    found = np.stack(
        link.hover_point(tuple(ends[0]), tuple(ends[1]), device, radius, 50.0, LASER_M)
    )
    for k in range(200):
        centre = tuple(float(each[k]) for each in device)
        alone = link.hover_point(
            tuple(ends[0, :, k]), tuple(ends[1, :, k]), centre, radius[k], 50.0, LASER_M
        )
        np.testing.assert_allclose(found[:2, k], alone[:2], atol=1e-9)
        assert np.isnan(found[0, k]) == (radius[k] < 50.0)


def test_no_radius_depends_on_those_beside_it() -> None:
    """To the last bit: strong and weak channels need sums of very different lengths."""
    draw = np.random.default_rng(3)
    keys = {
        "noise_power_W": 10.0 ** draw.uniform(-13.0, -9.0, 60),
        "transmit_power_W": draw.uniform(0.1, 2.0, 60),
        "rice_factor": draw.uniform(0.0, 200.0, 60),
        "snr_threshold_dB": draw.uniform(0.0, 20.0, 60),
        "path_loss_exponent": draw.uniform(2.0, 3.0, 60),
    }
    limit = 10.0 ** draw.uniform(-9.0, -0.1, 60)
    together = link.coverage_radius(link.Channel(**keys), limit)
    for k in range(60):
        one = link.Channel(**{name: each[k : k + 1] for name, each in keys.items()})
        assert link.coverage_radius(one, limit[k : k + 1]).tobytes() == together[k].tobytes()

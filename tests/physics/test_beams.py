"""Beams that spread: check numbers, quadrature, sampled jitter, limits, reach, arrays, symbols."""

from __future__ import annotations

import itertools
import math
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import j1, lambertw
from scipy.stats import ncx2

from optuav.modelling import Parameter, Variable, evaluate
from optuav.physics import laser
from optuav.physics.beams import divergence, gaussian, turbulence
from optuav.physics.beams.divergence import Divergence
from optuav.physics.beams.gaussian import Emitter, Receiver
from tests.examples import few
from tests.physics.reference import printed

WIDE = Emitter(1070.0, 0.3, gaussian.default_waist(0.3))
HALF_METRE = Receiver(0.25)
STATED = Emitter(1070.0, 0.3, gaussian.default_waist(0.3), 1.1, 1e-5, 1e-15, 0.4)
CELLS = Receiver(0.25, 0.9, 0.5, 0.95)
CLEAR_PER_KM = laser.attenuation(1070.0, 10.0)
CHEN = Divergence(0.1, 3.4e-5, 0.004, 1.0)
"""Chen and Jiang, table II; χ is part of the area."""


# Check numbers


def test_check_numbers_of_shares() -> None:
    assert gaussian.share(WIDE, 0.25, 1000.0) == printed("0.999984902")
    jittery = Emitter(1550.0, 0.3, 0.15, 1.0, 5e-5)
    assert gaussian.share(jittery, 0.25, 2000.0) == printed("0.864477303")
    assert gaussian.aperture_share(WIDE) == printed("0.9817")


def test_check_numbers_of_a_chain() -> None:
    """5 kW, M² 1.1, jitter, turbulence and 10 km of visibility over 500 m."""
    chain = gaussian.chain(STATED, CELLS, 5000.0, CLEAR_PER_KM, 500.0)
    assert chain.light_W == pytest.approx(2000.0, rel=1e-12)
    assert chain.share == printed("0.999973413")
    assert chain.on_receiver_W == printed("1807.82")
    assert chain.dc_W == printed("772.842")
    peak = chain.after_aperture_W * chain.air * gaussian.axis_irradiance(STATED, 500.0)
    assert peak == pytest.approx(101_340.0, abs=1.0)


def test_jitter_of_the_literature() -> None:
    """50 µrad on a receiver of 0.5 m: 91 % at 2 km and 15 % at 8.6 km; 86 % with w_0 = 0.15 m."""
    jittery = WIDE._replace(jitter_rad=5e-5)
    assert gaussian.share(jittery, 0.25, 2000.0) == printed("0.91")
    assert gaussian.share(jittery, 0.25, 8600.0) == printed("0.15")
    assert gaussian.share(jittery._replace(waist_m=0.15), 0.25, 2000.0) == printed("0.86")


# Spread


@given(st.floats(0.0, 5e3), st.floats(0.02, 0.3), st.floats(1.0, 4.0))
def test_width_is_a_hyperbola_of_the_divergence(d: float, waist: float, m2: float) -> None:
    """w² = w_0² + (θd)², θ = M²λ/(πw_0)."""
    θ = m2 * 1550e-9 / (math.pi * waist)
    beam = Emitter(1550.0, 1.0, waist, m2)
    assert gaussian.width(beam, d) == pytest.approx(math.hypot(waist, θ * d), rel=1e-12)


def transfer_integral(p: float, s: float) -> float:
    """∫ J₁(t) exp(−p t² − s t^(5/3)) dt, between the sign changes of J₁."""
    end = min(math.sqrt(40.0 / p), (40.0 / s) ** 0.6 if s else math.inf)
    edges = np.append(np.arange(0.0, end, math.pi), end)

    def integrand(t: float) -> float:
        return float(j1(t)) * math.exp(-p * t**2 - s * t ** (5.0 / 3.0))

    panels = itertools.pairwise(edges.tolist())
    return math.fsum(quad(integrand, *panel, epsabs=1e-13, epsrel=1e-12)[0] for panel in panels)


def beam_of(p: float, s: float, radius_m: float = 0.25) -> tuple[Emitter, float]:
    """A beam with κ² (w² + 4σ²d²)/8 = p t² and c κ^(5/3) = s t^(5/3), for t = aκ, at 1 km."""
    k, d = 2.0 * math.pi / 1e-6, 1000.0
    waist = radius_m * math.sqrt(8.0 * p)
    cn2 = s * radius_m ** (5.0 / 3.0) / (0.5 * 1.09275 * k**2 * d * (d / k) ** (5.0 / 3.0))
    # So little diffraction that w is w_0.
    return Emitter(1000.0, 1.0, waist, 1e-12, 0.0, cn2), d


@given(st.floats(-3.0, 3.0), st.floats(-4.0, 3.0))
@example(-3.0, -4.0)
@example(0.0, 0.0)
@example(3.0, 3.0)
@few(12)
def test_share_in_turbulence_is_the_integral(log_p: float, log_s: float) -> None:
    """a ∫ J₁(aκ) exp(−κ² w²/8 − c κ^(5/3)) dκ by quadrature, weak and strong turbulence alike."""
    p, s = 10.0**log_p, 10.0**log_s
    beam, d = beam_of(p, s)
    assert gaussian.share(beam, 0.25, d) == pytest.approx(
        transfer_integral(p, s), rel=1e-9, abs=1e-9
    )


@given(st.floats(-3.0, 3.0), st.floats(-4.0, 3.0))
def test_peak_in_turbulence_is_the_integral(log_p: float, log_s: float) -> None:
    """(1/2π) ∫ κ exp(−κ² w²/8 − c κ^(5/3)) dκ, which no wave oscillates in."""
    p, s = 10.0**log_p, 10.0**log_s
    beam, d = beam_of(p, s)
    end = min(math.sqrt(40.0 / p), (40.0 / s) ** 0.6)
    area, _ = quad(
        lambda t: t * math.exp(-p * t**2 - s * t ** (5.0 / 3.0)), 0.0, end, epsabs=0.0, epsrel=1e-11
    )
    expected = area / (2.0 * math.pi * 0.25**2)
    assert gaussian.axis_irradiance(beam, d) == pytest.approx(expected, rel=1e-9)


def test_the_mixture_is_the_blur() -> None:
    """exp(−t^(5/3)) from weights that are positive and sum up to 1."""
    weights, S = turbulence.mixture()
    assert (weights >= 0.0).all()
    t = np.geomspace(1e-6, 30.0, 60)
    mixed = np.exp(-np.outer(t**2, S)) @ weights
    np.testing.assert_allclose(mixed, np.exp(-(t ** (5.0 / 3.0))), rtol=0, atol=1e-10)


def test_the_weak_formula_promises_too_much_light() -> None:
    """w² (1 + 1.33 σ_R² Λ^(5/6)) where σ_R² is 10: 8.6 km with C_n² = 10⁻¹⁴."""
    beam, d = WIDE._replace(wavelength_nm=1550.0, turbulence_cn2=1e-14), 8600.0
    k, w = 2.0 * math.pi / 1550e-9, gaussian.width(beam, d)
    rytov = 1.23 * 1e-14 * k ** (7.0 / 6.0) * d ** (11.0 / 6.0)
    weak = w**2 * (1.0 + 1.33 * rytov * (2.0 * d / (k * w**2)) ** (5.0 / 6.0))
    by_formula = -math.expm1(-2.0 * 0.25**2 / weak)
    assert rytov == pytest.approx(10.0, abs=0.5)
    assert gaussian.share(beam, 0.25, d) < by_formula - 0.05


@given(st.floats(0.05, 2.0), st.floats(0.0, 2e-4), st.floats(-18.0, -13.0), st.floats(10.0, 2e4))
def test_shares_fall_with_distance_jitter_and_turbulence(
    radius: float, jitter: float, log_cn2: float, d: float
) -> None:
    """And stay within 0 and 1."""
    beam = WIDE._replace(jitter_rad=jitter, turbulence_cn2=10.0**log_cn2)
    share = gaussian.share(beam, radius, d)
    assert 0.0 < share <= 1.0 + 1e-9
    for worse in (
        gaussian.share(beam, radius, 1.5 * d),
        gaussian.share(beam._replace(jitter_rad=1.5 * jitter + 1e-7), radius, d),
        gaussian.share(beam._replace(turbulence_cn2=1.5 * 10.0**log_cn2), radius, d),
        gaussian.share(beam, 0.7 * radius, d),
    ):
        assert worse <= share * (1.0 + 1e-12)


# Limited light


def displaced_share(radius: float, w: float, r: float) -> float:
    """Share on a disc of a beam displaced by r: a noncentral χ² law."""
    if r < 1e-9 * w:
        return -math.expm1(-2.0 * (radius / w) ** 2)
    return float(ncx2.cdf(4.0 * (radius / w) ** 2, 2, 4.0 * (r / w) ** 2))


def limited_by_quadrature(radius: float, w: float, away: float, most: float) -> float:
    """E min(s(r), most) over r exp(−r²/2σ²)/σ², with the kink between two panels."""

    def integrand(r: float) -> float:
        law = r / away**2 * math.exp(-0.5 * (r / away) ** 2)
        return min(displaced_share(radius, w, r), most) * law

    kinks = [radius + side * w for side in (-3.0, -1.0, 0.0, 1.0, 3.0, 9.0)]
    if displaced_share(radius, w, 0.0) > most:
        kinks.append(brentq(lambda r: displaced_share(radius, w, r) - most, 0.0, radius + 20.0 * w))
    ends = sorted({0.0, *(k for k in (*kinks, away, 3.0 * away) if 0.0 < k < 9.0 * away)})
    panels = itertools.pairwise([*ends, 9.0 * away])
    return math.fsum(quad(integrand, *panel, epsabs=1e-13, limit=200)[0] for panel in panels)


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(0.01, 1.2))
@example(-1.5, -1.5, 0.5)
@example(1.5, -1.5, 1e-4)
@example(0.0, 1.5, 0.9)
def test_limited_share_is_the_mean_over_the_displacement(
    log_w: float, log_away: float, most: float
) -> None:
    """Narrow and wide beams, little and much jitter, limits that bind or not."""
    w, away, d = 0.25 * 10.0**log_w, 0.25 * 10.0**log_away, 1000.0
    beam = Emitter(1e-6, 1.0, w, 1.0, away / d)
    limited = gaussian.limited_share(beam, 0.25, d, most)
    assert limited == pytest.approx(limited_by_quadrature(0.25, w, away, most), rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("cn2", [0.0, 3e-14])
def test_limited_share_by_drawn_displacements(cn2: float) -> None:
    """200 000 displacements in two axes; with turbulence each sees the blurred beam."""
    beam = WIDE._replace(jitter_rad=5e-5, turbulence_cn2=cn2)
    d, radius, most = 3000.0, 0.25, 0.6
    x, y = np.random.default_rng(31).normal(0.0, 5e-5 * d, (2, 200_000))
    r = np.hypot(x, y)
    grid = np.linspace(0.0, r.max(), 2000)
    weights, S = turbulence.mixture()
    blur = 8.0 * turbulence.blur(cn2, 1070.0, d) * S
    w2 = gaussian.width(beam, d) ** 2 + (blur if cn2 else np.zeros(1))
    law = weights if cn2 else np.ones(1)
    # The noncentral χ² law is slow for far-out parts of the mixture, which hardly weigh.
    heavy = law > 1e-7
    shares = ncx2.cdf(4.0 * radius**2 / w2[heavy], 2, 4.0 * grid[:, None] ** 2 / w2[heavy])
    at = np.interp(r, grid, shares @ law[heavy])
    drawn = np.minimum(at, most)
    error = 5.0 * drawn.std() / math.sqrt(len(r)) + 1e-6
    assert at.mean() == pytest.approx(gaussian.share(beam, radius, d), abs=5e-3)
    assert gaussian.limited_share(beam, radius, d, most) == pytest.approx(drawn.mean(), abs=error)


@given(st.floats(1e-6, 2e-4), st.floats(50.0, 9e3), st.floats(0.02, 1.5), st.booleans())
@example(1.7709002543561496e-04, 50.0, 0.99999, False)
@few(8)
def test_the_mean_of_limited_light_is_below_the_limited_mean(
    jitter: float, d: float, most: float, turbulent: bool
) -> None:
    """By Jensen; and a limit that is none leaves the mean."""
    beam = WIDE._replace(jitter_rad=jitter, turbulence_cn2=1e-14 if turbulent else 0.0)
    mean = gaussian.share(beam, 0.25, d)
    limited = gaussian.limited_share(beam, 0.25, d, most)
    assert 0.0 < limited <= min(mean, most) * (1.0 + 1e-9)
    assert gaussian.limited_share(beam, 0.25, d, 1.0 - 1e-12) == pytest.approx(mean, rel=1e-9)
    assert gaussian.limited_share(beam, 0.25, d, math.inf) == mean


def test_clipping_the_mean_errs_by_up_to_6_percent() -> None:
    """The light of each moment is limited: at some distance that costs 5 % to 7 % of the power."""
    beam = WIDE._replace(jitter_rad=5e-5)
    d = np.linspace(500.0, 9000.0, 60)
    mean = gaussian.share(beam, 0.25, d)
    ratios = [
        (np.minimum(mean, most) / gaussian.limited_share(beam, 0.25, d, most)).max()
        for most in (0.3, 0.5, 0.7, 0.9)
    ]
    assert max(ratios) > 1.05


def test_a_little_turbulence_changes_little() -> None:
    """The limited share is continuous where C_n² vanishes."""
    beam = WIDE._replace(jitter_rad=5e-5)
    without = gaussian.limited_share(beam, 0.25, 3000.0, 0.5)
    with_little = gaussian.limited_share(beam._replace(turbulence_cn2=1e-22), 0.25, 3000.0, 0.5)
    assert with_little == pytest.approx(without, rel=1e-8)


def test_received_power_keeps_the_tightest_limit() -> None:
    """Irradiance, DC power and battery, each where it is the tightest."""
    chain = gaussian.chain(STATED, CELLS, 5000.0, CLEAR_PER_KM, 500.0)
    assert gaussian.received_power(STATED, CELLS, 5000.0, CLEAR_PER_KM, 500.0) == pytest.approx(
        chain.dc_W, rel=1e-12
    )
    area = math.pi * 0.25**2
    bound = CELLS._replace(max_irradiance_W_m2=5000.0, max_power_W=600.0)
    still = STATED._replace(jitter_rad=0.0)
    for receiver, most_W, expected in (
        (bound, math.inf, 5000.0 * area * 0.9 * 0.5 * 0.95),
        (bound._replace(max_irradiance_W_m2=1e9), math.inf, 600.0),
        (bound, 250.0, 250.0),
    ):
        power = gaussian.received_power(still, receiver, 5000.0, CLEAR_PER_KM, 500.0, most_W)
        assert power == pytest.approx(expected, rel=1e-12)
        jittery = gaussian.received_power(STATED, receiver, 5000.0, CLEAR_PER_KM, 500.0, most_W)
        assert expected * 0.99 < jittery <= expected
        arriving_W = chain.after_aperture_W * chain.air
        shares = gaussian.largest_shares(receiver, arriving_W, most_W)
        limited_W = min(shares) * arriving_W * receiver.efficiency
        assert limited_W == pytest.approx(expected, rel=1e-12)
    assert gaussian.received_power(STATED, bound, 0.0, CLEAR_PER_KM, 500.0) == 0.0


def test_arrays_are_scalars_element_by_element() -> None:
    """Over distances and jitters, with and without limits and turbulence."""
    d, jitters = np.array([0.0, 300.0, 4000.0]), np.array([0.0, 2e-5, 1e-4])[:, np.newaxis]
    for cn2, most_W in itertools.product((0.0, 1e-14), (math.inf, 400.0)):
        beam = STATED._replace(jitter_rad=jitters, turbulence_cn2=cn2)
        table = gaussian.received_power(beam, CELLS, 5000.0, CLEAR_PER_KM, d, most_W)
        for i, j in np.ndindex(3, 3):
            one = STATED._replace(jitter_rad=float(jitters[i, 0]), turbulence_cn2=cn2)
            alone = gaussian.received_power(one, CELLS, 5000.0, CLEAR_PER_KM, d[j], most_W)
            np.testing.assert_allclose(table[i, j], alone, rtol=1e-9)


@pytest.mark.parametrize("cn2", [0.0, 1e-14])
def test_limited_light_of_a_place_does_not_depend_on_others(cn2: float) -> None:
    """Searches that end sooner stay where they are while others go on."""
    d = np.geomspace(100.0, 2e4, 12)
    for radius, most in itertools.product((0.06, 0.25), (1e-3, 0.3, 0.9)):
        beam = WIDE._replace(jitter_rad=9e-5, turbulence_cn2=cn2)
        together = gaussian.limited_share(beam, radius, d, most)
        alone = [gaussian.limited_share(beam, radius, float(each), most) for each in d]
        np.testing.assert_allclose(together, alone, rtol=1e-10)


def test_symbols_give_what_floats_give() -> None:
    """Received power as a tree over the distance and the aim's noise, in turbulence too."""
    d = Variable("d", "d", "m", 0.0, 1e4, "", 0)
    cn2 = Parameter("cn2", "C_n²", "1", 0.0)
    beam = STATED._replace(jitter_rad=0.0, turbulence_cn2=cn2)
    tree = gaussian.received_power(beam, CELLS, 5000.0, CLEAR_PER_KM, d, 400.0)
    for values in ({"d": 500.0, "cn2": 1e-15}, {"d": 9000.0, "cn2": 1e-13}):
        one = beam._replace(turbulence_cn2=values["cn2"])
        number = gaussian.received_power(one, CELLS, 5000.0, CLEAR_PER_KM, values["d"], 400.0)
        assert evaluate(tree, values) == pytest.approx(number, rel=1e-12)


def test_no_special_functions_are_loaded_before_they_are_needed() -> None:
    """Without jitter, or a limit that acts on it, a beam needs NumPy alone."""
    lines = (
        "import sys",
        "from optuav.physics.beams import divergence, gaussian",
        "from optuav.physics import drag, eye, rotary_wing",
        "beam = gaussian.Emitter(1070.0, 0.3, 0.1, 1.1, 1e-5, 1e-15)",
        "gaussian.received_power(beam, gaussian.Receiver(0.25), 5e3, 0.1, 500.0)",
        "print([name for name in sys.modules if name.startswith('scipy')])",
    )
    done = subprocess.run([sys.executable, "-c", "\n".join(lines)], capture_output=True, check=True)
    assert done.stdout.strip() == b"[]"


# Constant divergence


def test_reaches_of_the_literature() -> None:
    """168.5 W of 600 W to 568 m, 100 W of 500 W to 1 216 m; 100 W of 10 W nowhere."""
    assert divergence.reach(CHEN, 600.0, 1e-3, 168.5) == pytest.approx(568.0, abs=0.5)
    assert divergence.reach(CHEN, 500.0, 1e-3, 100.0) == pytest.approx(1216.0, abs=0.5)
    panahi = Divergence(0.1, 1e-4, 0.004, 1.0)
    assert divergence.received_power(panahi, 10.0, 1e-3, 0.0) == pytest.approx(4.0)
    assert divergence.reach(panahi, 10.0, 1e-3, 100.0) == 0.0
    for distance, efficiency in ((325.0, 0.32), (1000.0, 0.22)):
        received = divergence.received_power(CHEN, 1.0, 1e-3, distance)
        assert received == pytest.approx(efficiency, abs=0.005)


@given(st.floats(0.02, 1.0), st.floats(-18.0, 0.0), st.floats(-12.0, 4.0), st.floats(-9.0, -0.001))
@example(0.1, -5.0, -12.0, -1.0)
@example(0.1, -18.0, 0.0, -1.0)
@example(0.1, -9.0, 4.0, -6.0)
def test_reach_receives_what_is_needed(
    D: float, log_Δθ: float, log_α: float, log_needed: float
) -> None:
    """Put back in, also where e^(αD/2Δθ) is no number."""
    beam = Divergence(D, 10.0**log_Δθ, 0.5 * D**2, 0.8)
    per_km, needed = 10.0**log_α, 0.4 * 10.0**log_needed
    d = divergence.reach(beam, 1.0, per_km, needed)
    received = divergence.received_power(beam, 1.0, per_km, d)
    assert received == pytest.approx(needed, rel=1e-9)


@given(st.floats(0.02, 1.0), st.floats(-6.0, -1.0), st.floats(-1.0, 1.0), st.floats(-6.0, -0.1))
def test_reach_is_lamberts_w(D: float, log_Δθ: float, log_α: float, log_needed: float) -> None:
    """d = W(β √(χAP/P_r) e^(βD))/(βΔθ) − D/Δθ, where its exponential is a number."""
    Δθ, per_m, needed = 10.0**log_Δθ, 10.0**log_α / 1e3, 0.4 * 10.0**log_needed
    β = per_m / (2.0 * Δθ)
    assume(β * D < 600.0)
    d = (lambertw(β * math.sqrt(0.4 * D**2 / needed) * math.exp(β * D)).real / β - D) / Δθ
    beam = Divergence(D, Δθ, 0.5 * D**2, 0.8)
    assert divergence.reach(beam, 1.0, 1e3 * per_m, needed) == pytest.approx(d, rel=1e-7, abs=1e-6)


def test_reach_in_its_branches() -> None:
    """No air, no divergence, neither; nothing needed, too much needed; in one array too."""
    straight = CHEN._replace(divergence_rad=0.0)
    assert divergence.reach(CHEN, 600.0, 0.0, 168.5) == pytest.approx(
        (math.sqrt(0.004 * 600.0 / 168.5) - 0.1) / 3.4e-5
    )
    no_spread = divergence.reach(straight, 600.0, 1e-3, 168.5)
    assert no_spread == pytest.approx(math.log(240.0 / 168.5) / 1e-6)
    assert divergence.reach(straight, 600.0, 0.0, 168.5) == math.inf
    assert divergence.reach(straight, 600.0, 0.0, 240.1) == 0.0
    assert divergence.reach(CHEN, 600.0, 1e-3, 0.0) == math.inf
    assert divergence.reach(CHEN, 600.0, 1e-3, -1.0) == math.inf
    assert divergence.reach(CHEN, 0.0, 1e-3, 1.0) == 0.0
    assert divergence.reach(CHEN, 600.0, 1e-3, 239.99) == pytest.approx(0.06, abs=0.01)
    needed = np.array([0.0, 100.0, 1e3])
    alone = [divergence.reach(CHEN, 600.0, 1e-3, each) for each in needed]
    np.testing.assert_array_equal(divergence.reach(CHEN, 600.0, 1e-3, needed), alone)


def test_a_limit_of_the_battery_holds() -> None:
    assert divergence.received_power(CHEN, 600.0, 1e-3, 0.0, 99.0) == 99.0
    assert divergence.disc_irradiance(CHEN, 0.0) == pytest.approx(1.0 / (math.pi * 0.05**2))
    ratio = divergence.disc_irradiance(CHEN, 700.0) * 0.004 / divergence.share(CHEN, 700.0)
    assert ratio == pytest.approx(4.0 / math.pi)

"""Lifetimes of packs under schedules: known values, identities, and another simulation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from optuav.errors import InputError, SolverError
from optuav.physics.kibam import Battery, time_to_empty
from optuav.physics.packs import lifetime
from tests.physics.reference import printed

MINUTE_S = 60.0
SCHEDULES = {
    "pooled": {},
    "sequential": {},
    "round-robin": {},
    "alternating": {"period_s": 45.0},
    "most-available": {},
}
JONGERDEN = {
    "available_fraction": 0.166,
    "flow_rate_per_s": 0.122 / MINUTE_S * 0.166 * (1 - 0.166),
}
CELL = {"capacity_As": 7200.0, "available_fraction": 0.625, "flow_rate_per_s": 4.5e-5}


def jobs(idle_min: float, *currents_A: float) -> list[tuple[float, float]]:
    """One minute of each current, each followed by some idle time."""
    entries = []
    for current_A in currents_A:
        entries.append((current_A, MINUTE_S))
        if idle_min:
            entries.append((0.0, idle_min * MINUTE_S))
    return entries


@pytest.mark.parametrize(
    ("load", "small_min", "large_min"),
    [
        pytest.param(jobs(0, 0.25), "4.53", "12.16", id="CL250"),
        pytest.param(jobs(0, 0.5), "2.02", "4.53", id="CL500"),
        pytest.param(jobs(0, 0.5, 0.25), "2.58", "6.45", id="CLalt"),
        pytest.param(jobs(1, 0.25), "10.80", "44.78", id="ILs250"),
        pytest.param(jobs(1, 0.5), "4.30", "10.80", id="ILs500"),
        pytest.param(jobs(1, 0.5, 0.25), "4.80", "16.93", id="ILsalt"),
        pytest.param(jobs(2, 0.25), "21.86", "84.90", id="ILl250"),
        pytest.param(jobs(2, 0.5), "6.53", "21.86", id="ILl500"),
    ],
)
def test_known_lifetimes(load: list[tuple[float, float]], small_min: str, large_min: str) -> None:
    """Test loads of Jongerden and Haverkort on one pack of 5.5 and of 11 A min."""
    for capacity_Amin, expected in ((5.5, small_min), (11.0, large_min)):
        found_s = lifetime(load, capacity_As=capacity_Amin * MINUTE_S, **JONGERDEN)
        assert found_s / MINUTE_S == printed(expected)


def test_one_hertz() -> None:
    """Twelve thousand short jobs: half the load lasts more than twice as long."""
    assert lifetime([(0.96, 1.0)], **CELL) / MINUTE_S == printed("91.1")
    assert lifetime([(0.96, 0.5), (0.0, 0.5)], **CELL) / MINUTE_S == printed("202.9")


# Another simulation: the differential equations of every pack, and the rules once more


def simulated(
    load: list[tuple[float, float]], pack: Battery, count: int, schedule: str, period_s: float
) -> float:
    """Lifetime by solve_ivp with events; discharge only."""
    ω, k_F = pack.available_fraction, pack.flow_rate_per_s
    full = [ω * pack.capacity_As, (1 - ω) * pack.capacity_As]
    levels, alive = [list(full) for _ in range(count)], list(range(count))
    clock_s, last = 0.0, -1

    def drain(number: int, current_A: float, duration_s: float) -> float:
        """Run one pack; how long it lasted."""

        def flow(_: float, y: np.ndarray) -> list[float]:
            between = k_F * (y[1] / (1 - ω) - y[0] / ω)
            return [between - current_A, -between]

        def empty(_: float, y: np.ndarray) -> float:
            return float(y[0])

        empty.terminal, empty.direction = True, -1  # type: ignore[attr-defined]
        found = solve_ivp(
            flow, (0.0, duration_s), levels[number], events=empty, rtol=1e-10, atol=1e-9
        )
        levels[number] = list(found.y[:, -1])
        return float(found.t[-1])

    def named() -> int:
        after = sorted(alive, key=lambda number: (number - last - 1) % count)
        if schedule == "round-robin":
            return after[0]
        if schedule == "alternating":
            turn = math.floor(clock_s / period_s + 1e-9) % count
            return min(alive, key=lambda number: (number - turn) % count)
        if schedule == "most-available":
            return max(alive, key=lambda number: (round(levels[number][0], 6), -number))
        return alive[0]

    while True:
        for current_A, duration_s in load:
            left_s, carrier = duration_s, None
            while left_s > 1e-9:
                length_s = left_s
                if schedule == "alternating":
                    length_s = min(left_s, period_s - (clock_s + 1e-9) % period_s + 1e-9)
                if current_A and (carrier not in alive or schedule == "alternating"):
                    carrier = named()
                    last = carrier
                lasted_s = drain(carrier, current_A, length_s) if current_A else length_s
                for number in range(count):
                    if number != carrier:
                        drain(number, 0.0, lasted_s)
                clock_s, left_s = clock_s + lasted_s, left_s - lasted_s
                if lasted_s < length_s:
                    alive.remove(carrier)
                    if not alive:
                        return clock_s


@settings(max_examples=12)
@given(
    st.lists(st.tuples(st.floats(0.2, 4.0), st.floats(5.0, 200.0), st.booleans()), min_size=1),
    st.integers(1, 3),
    st.sampled_from([name for name in SCHEDULES if name != "pooled"]),
    st.floats(0.1, 0.9),
    st.sampled_from([0.0, 1e-5, 1e-3]),
)
def test_lifetime_by_another_simulation(
    drawn: list[tuple[float, float, bool]], packs: int, schedule: str, share: float, rate: float
) -> None:
    """Jobs of any length, pauses, takeovers in the middle of a job, turns by the clock."""
    load = [
        entry
        for current_A, duration_s, pause in drawn[:4]
        for entry in [(current_A, duration_s)] + [(0.0, 33.0)] * pause
    ]
    pack = Battery(400.0, share, rate)
    found_s = lifetime(
        load,
        capacity_As=400.0,
        available_fraction=share,
        flow_rate_per_s=rate,
        packs=packs,
        schedule=schedule,
        **SCHEDULES[schedule],
    )
    assert found_s == pytest.approx(simulated(load, pack, packs, schedule, 45.0), rel=1e-6)


# Identities

LOADS = [
    pytest.param([(4.0, 1.0)], id="constant"),
    pytest.param([(6.0, 60.0), (0.0, 60.0)], id="half"),
    pytest.param([(6.0, 60.0), (0.0, 10.0), (2.0, 30.0)], id="mixed"),
]


@pytest.mark.parametrize("load", LOADS)
def test_pooled_packs_are_one_large_battery(load: list[tuple[float, float]]) -> None:
    twice = CELL | {"capacity_As": 2 * CELL["capacity_As"]}
    assert lifetime(load, packs=2, **CELL) == pytest.approx(lifetime(load, **twice), rel=1e-12)
    halves = [(current_A / 2, duration_s) for current_A, duration_s in load]
    assert lifetime(load, packs=2, **CELL) == pytest.approx(lifetime(halves, **CELL), rel=1e-12)


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("schedule", SCHEDULES)
def test_one_pack_knows_no_schedule(load: list[tuple[float, float]], schedule: str) -> None:
    found_s = lifetime(load, schedule=schedule, **SCHEDULES[schedule], **CELL)
    assert found_s == pytest.approx(lifetime(load, **CELL), rel=1e-12)


@pytest.mark.parametrize("packs", [1, 2, 5])
def test_in_sequence_a_constant_load_takes_the_packs_one_by_one(packs: int) -> None:
    """Idle packs stay full, and each lasts as long as the first."""
    alone_s = time_to_empty(Battery(7200.0, 0.625, 4.5e-5), Battery(7200.0, 0.625, 4.5e-5).full, -3)
    found_s = lifetime([(3.0, 7.0)], packs=packs, schedule="sequential", **CELL)
    assert found_s == pytest.approx(packs * alone_s, rel=1e-12)


def test_short_turns_are_as_good_as_pooling() -> None:
    """Quick changes share a constant load evenly: the limit is the pooled battery."""
    pooled_s = lifetime([(8.0, 1.0)], packs=2, **CELL)
    apart_s = [
        pooled_s - lifetime([(8.0, job_s)], packs=2, schedule="round-robin", **CELL)
        for job_s in (8.0, 4.0, 2.0, 1.0)
    ]
    assert all(abs(gap) < job_s for gap, job_s in zip(apart_s, (8.0, 4.0, 2.0, 1.0), strict=True))
    assert 0.0 < apart_s[-1] < 0.05


def test_resting_in_turn_beats_one_after_the_other() -> None:
    """A pack recovers while the other works, which the sequence gives away."""
    load = [(12.0, 30.0)]
    in_turn_s = lifetime(load, packs=2, schedule="round-robin", **CELL)
    assert in_turn_s > 1.01 * lifetime(load, packs=2, schedule="sequential", **CELL)


def test_turns_by_the_clock_are_jobs_of_that_length() -> None:
    """Alternating every 30 s under a constant load is round robin with jobs of 30 s."""
    by_clock_s = lifetime([(6.0, 500.0)], packs=2, schedule="alternating", period_s=30.0, **CELL)
    by_job_s = lifetime([(6.0, 30.0)], packs=2, schedule="round-robin", **CELL)
    assert by_clock_s == pytest.approx(by_job_s, rel=1e-9)


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_without_flow_the_available_charge_is_all(schedule: str) -> None:
    """With k_F = 0 every schedule delivers ωB of every pack, and nothing more."""
    cell = CELL | {"flow_rate_per_s": 0.0}
    found_s = lifetime([(3.0, 7.0)], packs=2, schedule=schedule, **SCHEDULES[schedule], **cell)
    assert found_s == pytest.approx(2 * 4500.0 / 3.0, rel=1e-9)


def test_a_life_of_very_many_jobs() -> None:
    """A billion and more jobs are skipped: so small a load empties the whole battery evenly."""
    found_s = lifetime([(1e-6, 0.5), (0.0, 0.5)], packs=2, schedule="round-robin", **CELL)
    assert found_s == pytest.approx(2 * 7200.0 / 0.5e-6, rel=1e-6)


# Loads that last


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_idle_and_charging_never_end(schedule: str) -> None:
    given_packs = {"packs": 2, "schedule": schedule, **SCHEDULES[schedule], **CELL}
    assert lifetime([(0.0, 10.0)], **given_packs) == math.inf
    assert lifetime([(-2.0, 10.0)], **given_packs) == math.inf


@pytest.mark.parametrize("rate", [0.0, 4.5e-5, 1e-2])
def test_what_is_recharged_lasts_to_the_horizon(rate: float) -> None:
    """Balance decides, whatever flows; but the available well must bear the swing."""
    cell = CELL | {"flow_rate_per_s": rate, "horizon_s": 12_000.0}
    assert lifetime([(1.0, 60.0), (-1.0, 60.0)], **cell) == math.inf
    assert lifetime([(1.0, 60.0), (-3.0, 60.0)], **cell) == math.inf
    assert lifetime([(1.0, 6000.0), (-1.0, 6000.0)], **(cell | {"capacity_As": 900})) < 6000.0


def test_a_life_beyond_the_horizon_is_infinite() -> None:
    """Also where rounds are skipped, and inside one long job; an end on the horizon counts."""
    for load in ([(0.96, 1.0)], [(0.96, 1e6)]):
        life_s = lifetime(load, **CELL)
        assert lifetime(load, horizon_s=life_s, **CELL) == life_s
        assert lifetime(load, horizon_s=0.999 * life_s, **CELL) == math.inf


def test_what_is_nearly_recharged_ends() -> None:
    """Each round takes 6 A s net, and the last dip is 60 A s deep."""
    cell = CELL | {"capacity_As": 720.0, "flow_rate_per_s": 0.0}
    found_s = lifetime([(1.0, 60.0), (-0.9, 60.0)], **cell)
    rounds = math.floor((450.0 - 60.0) / 6.0) + 1
    assert found_s == pytest.approx(120.0 * rounds + 450.0 - 6.0 * rounds, abs=1e-6)


def test_packs_that_are_charged_in_turn() -> None:
    """Between jobs the emptier pack is charged; a full one takes nothing: both go on."""
    cell = CELL | {"flow_rate_per_s": 1e-3, "horizon_s": 24_000.0}
    for schedule in ("round-robin", "most-available"):
        load = [(2.0, 60.0), (-2.5, 60.0)]
        assert lifetime(load, packs=2, schedule=schedule, **cell) == math.inf


@pytest.mark.parametrize("schedule", SCHEDULES)
def test_what_nearly_lasts_asks_for_a_horizon(
    schedule: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the schedule, a load that nearly recharges is not followed without end."""
    monkeypatch.setattr("optuav.physics.packs.MOST_STRETCHES", 300)
    given_packs = {"packs": 2, "schedule": schedule, **SCHEDULES[schedule], **CELL}
    with pytest.raises(SolverError, match=r"300 stretches do not reach the end.* horizon_s"):
        lifetime([(1.0, 60.0), (-0.9999, 60.0)], **given_packs)


def test_turns_within_one_long_job_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """A single job of millions of turns; one that ends within the limit is followed to its end."""
    short = {"packs": 2, "schedule": "alternating", **CELL}
    whole_s = lifetime([(8.0, 1e9)], period_s=5.0, **short)
    assert whole_s == pytest.approx(lifetime([(8.0, 5.0)], packs=2, **CELL), abs=10.0)
    monkeypatch.setattr("optuav.physics.packs.MOST_STRETCHES", 500)
    with pytest.raises(SolverError, match="500 stretches do not reach the end"):
        lifetime([(1.0, 1e9)], period_s=1e-3, **short)


# Bad input


def test_all_faults_at_once() -> None:
    with pytest.raises(InputError) as raised:
        lifetime(
            [(1.0, 0.0), (math.nan, 5.0), (1.0,), ("1", True)],  # type: ignore[list-item]
            capacity_As=-1.0,
            available_fraction=1.0,
            flow_rate_per_s=math.inf,
            packs=0,
            schedule="parallel",  # type: ignore[arg-type]
            horizon_s=math.nan,
        )
    assert [fault.key for fault in raised.value.faults] == [
        "load[0].duration_s",
        "load[1].current_A",
        "load[2]",
        "load[3].current_A",
        "load[3].duration_s",
        "capacity_As",
        "available_fraction",
        "flow_rate_per_s",
        "packs",
        "schedule",
        "horizon_s",
    ]


@pytest.mark.parametrize(
    ("schedule", "period_s"),
    [("alternating", None), ("alternating", 0.0), ("pooled", 5.0), ("alternating", True)],
)
def test_the_period_belongs_to_alternating(schedule: str, period_s: float | None) -> None:
    with pytest.raises(InputError, match="period_s"):
        lifetime([(1.0, 1.0)], packs=2, schedule=schedule, period_s=period_s, **CELL)


@pytest.mark.parametrize("load", [[], 3.0, None, "ab", [1.0, 2.0]])
def test_a_load_is_pairs(load: object) -> None:
    with pytest.raises(InputError, match="load"):
        lifetime(load, **CELL)  # type: ignore[arg-type]


def test_arrays_and_generators_are_loads() -> None:
    load = [(4.0, 30.0), (0.0, 20.0)]
    expected_s = lifetime(load, **CELL)
    assert lifetime(np.array(load), **CELL) == expected_s  # type: ignore[arg-type]
    assert lifetime((pair for pair in load), **CELL) == expected_s  # type: ignore[arg-type]

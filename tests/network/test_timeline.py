"""Packs of a mission under their schedule: the keys, and what phases do to the packs."""

from __future__ import annotations

import numpy as np
import pytest

from optuav.errors import InputError
from optuav.mission import Mission, load
from optuav.network import vehicle
from optuav.network.timeline import Kind, Phase, PhaseStage, carry, simulated, steps
from optuav.physics import kibam
from optuav.physics.kibam import Battery, Stage
from tests.wells import after

PAPER = load("paper")
DRAWN_A, CHARGE_A = float(vehicle.hover_load(PAPER).current_A), 10.0
PACK = Battery(36_000.0, 0.8, 4.5e-5)
SEQUENTIAL = PAPER.replace({"battery.schedule": "sequential"})


def phase(kind: Kind, *stages: tuple[float, float]) -> Phase:
    """Stages of net current [A] and duration [s]; the rest has no part in what packs do."""
    parts = tuple(PhaseStage(duration_s, current_A, 0.0) for current_A, duration_s in stages)
    return Phase(kind, "", "", 0.0, parts, 0.0, 0.0, False, (), ())


def hover(duration_s: float) -> Phase:
    return phase("hover", (CHARGE_A - DRAWN_A, duration_s))


def rest(duration_s: float) -> Phase:
    return phase("rest", (CHARGE_A, duration_s))


def flight(*stages: tuple[float, float]) -> Phase:
    return phase("flight", *((-current_A, duration_s) for current_A, duration_s in stages))


# Keys


def test_packs_are_pooled_unless_stated() -> None:
    assert (PAPER.battery.schedule, PAPER.battery.period_s) == ("pooled", None)


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"battery.schedule": "parallel"}, "battery.schedule", 'one of "pooled", "sequential"'),
        ({"battery.period_s": 60}, "battery.period_s", 'goes with schedule = "alternating" only'),
        ({"battery.schedule": "alternating"}, "battery.period_s", "is missing; a number"),
        (
            {"battery.schedule": "alternating", "battery.period_s": 0},
            "battery.period_s",
            "a number, 0.001 <= x",
        ),
    ],
)
def test_faults_of_a_schedule(change: dict[str, object], key: str, words: str) -> None:
    with pytest.raises(InputError) as told:
        PAPER.replace(change)
    (fault,) = told.value.faults
    assert fault.key == key
    assert words in fault.allowed


def test_a_new_schedule_displaces_the_period_of_the_old_one() -> None:
    by_clock = PAPER.replace({"battery.schedule": "alternating", "battery.period_s": 60})
    assert by_clock.battery.period_s == 60.0
    assert by_clock.replace({"battery.schedule": "sequential"}).battery.period_s is None
    assert Mission.from_dict(by_clock.to_dict()) == by_clock


# Phases


def test_one_pack_flies_while_the_laser_charges_the_other() -> None:
    """What the hover draws comes from one pack, what the laser gives goes to the other."""
    flown = carry(
        PAPER.replace({"battery.schedule": "round-robin"}), [flight((100, 40)), hover(60)]
    )
    first, second = (
        after(PACK, PACK.full, phases)
        for phases in (
            [Stage(-100.0, 40.0), Stage(CHARGE_A, 60.0)],
            [Stage(0.0, 40.0), Stage(-DRAWN_A, 60.0)],
        )
    )
    assert flown.wells[-1].available_As == pytest.approx(
        [first.available_As, second.available_As], rel=1e-12
    )
    assert flown.wells[-1].bound_As == pytest.approx([first.bound_As, second.bound_As], rel=1e-12)
    assert flown.ended_s is None


def test_a_full_pack_refuses_charge() -> None:
    """In sequence the idle pack is full from the start: what the laser offers is lost."""
    flown = carry(SEQUENTIAL, [hover(100.0)])
    assert flown.wells[0].available_As[1] == pytest.approx(28_800.0, rel=1e-12)
    left_As = sum(flown.wells[0].available_As) + sum(flown.wells[0].bound_As)
    assert left_As == pytest.approx(72_000.0 - 100.0 * DRAWN_A, rel=1e-9)


def test_the_other_takes_over_in_the_middle_of_a_job() -> None:
    """At the moment the first is seen empty, which is then neither flown nor charged."""
    empty_s = float(kibam.time_to_empty(PACK, PACK.full, -DRAWN_A))
    flown = carry(SEQUENTIAL, [hover(empty_s + 50.0), rest(200.0)])
    second = after(PACK, PACK.full, [Stage(-DRAWN_A, 50.0), Stage(CHARGE_A, 200.0)])
    assert flown.wells[-1].available_As[1] == pytest.approx(second.available_As, rel=1e-9)
    emptied = [
        float(each.start_s[0] + each.duration_s[0])
        for phase in flown.stretches
        for each in phase
        if each.emptied[0]
    ]
    assert emptied == pytest.approx([empty_s], rel=1e-12)
    assert flown.ended_s is None
    assert sum(well[0] for well in flown.wells[0]) == pytest.approx(
        sum(well[0] for well in flown.wells[1])
    )


def test_a_load_that_no_pack_is_left_to_carry_ends() -> None:
    empty_s = float(kibam.time_to_empty(PACK, PACK.full, -DRAWN_A))
    assert carry(SEQUENTIAL, [hover(3 * empty_s)]).ended_s == pytest.approx(2 * empty_s)


def test_at_rest_the_emptier_is_charged_until_it_is_full_and_then_the_other() -> None:
    """The last of them takes what seeps into its bound well, and never more than it is offered."""
    flown = carry(SEQUENTIAL, [flight((100.0, 60.0)), rest(3000.0)])
    (_, resting) = flown.stretches
    assert [int(each.served[0]) for each in resting] == [0, 1, 1]
    assert resting[0].filled[0]
    assert all((each.currents_A <= CHARGE_A).all() for each in resting)
    assert (flown.wells[-1].available_As <= 28_800.0 * (1 + 1e-12)).all()
    assert (flown.wells[-1].bound_As <= 7200.0 * (1 + 1e-12)).all()
    assert flown.wells[-1].available_As[1] == pytest.approx(28_800.0, rel=1e-12)


def test_what_a_full_pack_takes_keeps_it_full() -> None:
    """One pack alone at rest: y1 stays at ωB, and y2 nears (1−ω)B as dy2/dt = −ωk'(y2 − (1−ω)B)."""
    alone = PAPER.replace({"battery.packs": 1, "battery.schedule": "sequential"})
    flown = carry(alone, [flight((100.0, 60.0)), rest(5000.0)])
    filling, topping = flown.stretches[1]
    bound_As = float(filling.wells.bound_As[0, 0])
    k = 4.5e-5 / 0.2
    after_s = 5000.0 - float(filling.duration_s[0])
    assert filling.filled[0]
    assert flown.wells[1].available_As[0] == pytest.approx(28_800.0, rel=1e-12)
    assert flown.wells[1].bound_As[0] == pytest.approx(
        7200.0 - (7200.0 - bound_As) * np.exp(-k * after_s), rel=1e-12
    )
    assert 0.0 < topping.currents_A[0, 0] < CHARGE_A


@pytest.mark.parametrize("schedule", ["sequential", "round-robin", "most-available"])
def test_one_pack_is_pooled_whatever_the_schedule(schedule: str) -> None:
    """It carries and is charged at once, by the net current."""
    alone = PAPER.replace({"battery.packs": 1, "battery.schedule": schedule})
    flown = carry(alone, [flight((100.0, 40.0)), hover(100.0), flight((100.0, 40.0))])
    phases = [Stage(-100.0, 40.0), Stage(CHARGE_A - DRAWN_A, 100.0), Stage(-100.0, 40.0)]
    expected = after(PACK, PACK.full, phases)
    assert flown.wells[-1].available_As[0] == pytest.approx(expected.available_As, rel=1e-12)
    assert flown.wells[-1].bound_As[0] == pytest.approx(expected.bound_As, rel=1e-12)


# Both wells along a plan


def test_a_mission_begins_with_both_wells_full() -> None:
    """y1 = ωB and y2 = (1−ω)B, to the last bit."""
    assert kibam.start(PACK).wells(PACK) == (0.8 * 36_000.0, (1.0 - 0.8) * 36_000.0)


@pytest.mark.parametrize("charging", ["constant", "taper"])
@pytest.mark.parametrize("pieces", [1, 7])
def test_pieces_of_stages_lead_to_the_same_wells(charging: str, pieces: int) -> None:
    """However finely a phase is cut, the wells at its end are those of a plan."""
    mission = PAPER.replace({"battery.charging": charging})
    phases = [flight((90.0, 40.0), (70.0, 20.0)), hover(300.0), rest(200.0), flight((90.0, 40.0))]
    flown = simulated(mission, phases)
    ends = {piece.phase: piece for piece in steps(mission, phases, pieces)}
    for number, planned in enumerate(flown):
        end_s = ends[number].start_s + ends[number].stage.duration_s
        assert end_s == pytest.approx(planned.end_s, rel=1e-12)
        wells_As = (*planned.available_As, *planned.bound_As)
        assert ends[number].after == pytest.approx(wells_As, rel=1e-9)

"""A flight model that is added from outside: the whole package reads it by its interface."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

import numpy as np
import pytest

import optuav
from optuav.errors import InputError
from optuav.fields import LoadCurrent, Range
from optuav.flight.model import FLIGHTS, MODEL, FlightModel, FlightTable
from optuav.judge import Stop
from optuav.physics.flight import Attitude, Flow, LegState, Loads
from optuav.physics.quantity import Quantity, Vector, norm

Speed = Annotated[float, Range("m/s", ge=0.1, le=100)]


class HopTable(FlightTable):
    """Flight in hops with a climb, a glide and a descent."""

    model: Annotated[Literal["hops"], MODEL]
    """Flight model: "hops" climbs, glides and descends."""
    glide_speed_m_s: Speed
    """Speed of the glide [m/s]."""
    glide_current_A: LoadCurrent
    """Current in the glide [A]."""
    climb_s: Annotated[float, Range("s", gt=0, le=1e3)] = 10.0
    """Duration of the climb, and of the descent [s]."""


class Hops(FlightModel):
    """Ten seconds up, a glide at constant speed, ten seconds down; currents differ by leg."""

    name: ClassVar[str] = "hops"
    table: ClassVar[type[FlightTable]] = HopTable
    needs: ClassVar[tuple[str, ...]] = ("body",)
    refuses: ClassVar[tuple[str, ...]] = ("wind.force_N",)

    flight: HopTable

    def leg(self, way_m: Vector) -> Loads:
        keys, distance = self.flight, norm(way_m)
        glide_s = distance / keys.glide_speed_m_s
        rising_A = keys.glide_current_A * (1.0 + distance / 1e4)
        currents_A = rising_A, keys.glide_current_A, 0.5 * rising_A
        powers_W = tuple(14.8 * each for each in currents_A)
        durations_s = keys.climb_s * np.sign(distance), glide_s, keys.climb_s * np.sign(distance)
        names, top = ("climb", "glide", "descend"), keys.glide_speed_m_s
        return Loads(way_m, names, durations_s, currents_A, powers_W, top, keys.climb_s)

    def hover(self) -> Flow:
        return Flow(60.0, 888.0)

    def rest(self) -> Flow:
        return Flow(0.0, 0.0)

    def state(self, leg: Loads, passed_s: Quantity) -> LegState:
        passed = np.asarray(passed_s, dtype=float)
        first_s, second_s, _ = map(float, leg.durations_s)
        stage = np.searchsorted(np.cumsum([first_s, second_s]), passed, side="right") + 1
        share = np.clip((passed - first_s) / second_s, 0.0, 1.0)
        speed = np.where(stage == 2, leg.distance_m / second_s, 0.0)
        unknown = np.full_like(passed, math.nan)
        x, y, z = (share * each for each in leg.way_m)
        return LegState(stage, (x, y, z), speed, Attitude(unknown, unknown))

    def figures(self) -> Iterator[tuple[str, float, str]]:
        yield "glide speed", self.flight.glide_speed_m_s, "m/s"


FLIGHT = {"model": "hops", "glide_speed_m_s": 15.0, "glide_current_A": 70.0}


@pytest.fixture
def hops(monkeypatch: pytest.MonkeyPatch) -> optuav.Mission:
    """The paper's mission, flown by a model that the package does not know."""
    monkeypatch.setitem(FLIGHTS, "hops", Hops)
    return optuav.load("paper").replace(
        {"flight": FLIGHT, "laser.power_W": 40_000, "battery.charge_current_A": 80}
    )


def by_hand(distance_m: float) -> tuple[float, float]:
    """Duration [s] and charge [A s] of a leg."""
    glide_s, rising_A = distance_m / 15.0, 70.0 * (1.0 + distance_m / 1e4)
    return 20.0 + glide_s, 10.0 * rising_A + 70.0 * glide_s + 5.0 * rising_A


def test_plan_replay_and_trace_agree(hops: optuav.Mission) -> None:
    """Durations and charges of legs are the model's; the judge finds the same, and the speed."""
    plan = optuav.solve(hops)
    flights = [phase for phase in plan.phases if phase.kind == "flight"]
    assert len(flights) >= 2
    for phase in flights:
        duration_s, charge_As = by_hand(phase.distance_m)
        assert phase.duration_s == pytest.approx(duration_s, rel=1e-12)
        assert phase.charge_As == pytest.approx(-charge_As, rel=1e-12)
        assert phase.peak_speed_m_s == 15.0
    replayed = optuav.replay(plan)
    assert replayed.flyable
    (peak,) = (event for event in replayed.events if event.kind == "peak speed")
    assert peak.value == 15.0
    trace = replayed.trace
    assert trace.speed_m_s.max() == pytest.approx(15.0, rel=1e-12)
    assert {"climb", "glide", "descend", "hover"} <= set(trace.stage)
    gliding = trace.stage == "glide"
    assert trace.current_A[gliding] == pytest.approx(-70.0)
    end_m = trace.position_m[-1]
    assert end_m == pytest.approx(hops.route.destination_m, abs=1e-6)


@pytest.mark.parametrize(
    "problem", [optuav.P1(stops=2, hovers=2), optuav.P1(hover_point="free"), optuav.P2(tight=True)]
)
def test_every_search_takes_it(hops: optuav.Mission, problem: optuav.P1) -> None:
    """Several stops and a free hover point are never worse than one stop at w_U, and fly."""
    hops = hops.replace({"buildings": hops.buildings[5:6]})
    plan = optuav.solve(hops, problem)
    assert optuav.replay(plan).flyable
    if isinstance(problem, optuav.P1):
        assert plan.hover_time_s >= optuav.solve(hops).hover_time_s - 1e-6


def test_batch_agrees_with_solves(hops: optuav.Mission) -> None:
    """Keys of the model are swept like all others, and each scenario is the mission solved."""
    pytest.importorskip("xarray")
    speeds = [10.0, 15.0, 25.0]
    found = optuav.batch(hops, {"flight.glide_speed_m_s": speeds})
    for speed, hover_s in zip(speeds, found["hover_time_s"].to_numpy(), strict=True):
        alone = optuav.solve(hops.replace({"flight.glide_speed_m_s": speed}))
        assert hover_s == pytest.approx(alone.hover_time_s, abs=1e-6)


def test_audit_and_pictures_take_it(hops: optuav.Mission) -> None:
    """An itinerary is flown by the model, and a leg is drawn with its stages."""
    direct = optuav.Itinerary(hops, (Stop("hover", "hover", 100.0),))
    assert optuav.audit(direct).flyable
    pytest.importorskip("matplotlib")
    axes = optuav.plots.leg(hops, "origin", "hover")
    assert axes.attitude is None
    shown = [text.get_text() for text in axes.current.get_legend().get_texts()]
    assert shown == ["climb (1)", "glide (2)", "descend (3)", "hover (4)"]


def test_faults_name_its_keys_and_tables(hops: optuav.Mission) -> None:
    """Ranges, needed and refused tables follow from the declaration of the model."""
    with pytest.raises(InputError, match=r"glide_speed_m_s = 200.*0\.1 <= x <= 100 \[m/s\]"):
        hops.replace({"flight.glide_speed_m_s": 200})
    with pytest.raises(InputError, match=r'body: is missing; .* flight\.model = "hops"'):
        hops.replace({"body": None, "rotor": None})
    with pytest.raises(InputError, match=r'\[0, 0, 0\] with flight\.model = "hops"'):
        hops.replace({"wind.force_N": [1, 0, 0]})
    with pytest.raises(InputError, match=r'"rotors" or "regimes".* or "hops"'):
        hops.replace({"flight.model": "hop"})
    with pytest.raises(InputError, match=r'glide_speed_m_s.*only with flight\.model = "hops"'):
        optuav.load("paper").replace({"flight.glide_speed_m_s": 10})


def test_a_new_model_displaces_the_keys_of_the_old_one(hops: optuav.Mission) -> None:
    """`replace` drops what only the old model knows, and a file holds the model's own keys."""
    assert optuav.Mission.from_dict(hops.to_dict()) == hops
    assert hops.replace({"flight.model": "rotors"}).flight.model_fields_set <= {
        "model",
        "through_buildings",
    }

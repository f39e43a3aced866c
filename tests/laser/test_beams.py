"""Missions whose beam spreads: keys and refusals, plans, batches, replays, a beam from outside."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import optuav
from optuav.errors import InputError
from optuav.explorer.state import controls
from optuav.fields import Length
from optuav.laser.beam import BEAM, BEAMS, Beam, LaserTable, SpreadingBeam
from optuav.mission import Mission
from optuav.mission.template import template
from optuav.network.network import build_network
from optuav.network.places import charging_cap, laser_reach
from optuav.physics.beams.gaussian import Chain
from optuav.physics.quantity import Quantity
from tests.examples import few

PAPER, TABLE2 = optuav.load("paper"), optuav.load("paper-table2")
GAUSSIAN: dict[str, Any] = {
    **{"laser.beam": "gaussian", "laser.wavelength_nm": 1070, "laser.visibility_km": 10},
    **{"laser.aperture_m": 0.3, "laser.source_efficiency": 0.4, "laser.power_W": 5000},
    "receiver": {"radius_m": 0.25, "cell_efficiency": 0.45},
    "battery.charge_current_A": 40,
}
DIVERGENCE: dict[str, Any] = {
    **{"laser.beam": "divergence", "laser.aperture_m": 0.1, "laser.divergence_rad": 3.4e-5},
    "receiver": {"area_m2": 0.004},
    **{"laser.power_W": 3000, "battery.charge_current_A": 40},
}
ROUND, WIDE = PAPER.replace(GAUSSIAN), PAPER.replace(DIVERGENCE)


def faults(mission: Mission, changes: dict[str, Any]) -> str:
    """The message that refuses some changes."""
    with pytest.raises(InputError) as refusal:
        mission.replace(changes)
    return str(refusal.value)


# Keys


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("laser.beam", "gauss", 'must be "gaussian" or "divergence"'),
        ("laser.aperture_m", 0, "0.001 <= x <= 100 [m]"),
        ("laser.waist_m", -1, "0.001 <= x <= 100 [m]"),
        ("laser.m2", 0.9, "1 <= x <= 10000 [-]"),
        ("laser.jitter_rad", -1e-6, "0 <= x <= 0.1 [rad]"),
        ("laser.turbulence_cn2", math.nan, "0 <= x <= 1e-8 [m^(-2/3)]"),
        ("laser.source_efficiency", 1.1, "0 < x <= 1 [-]"),
        ("laser.emitter_slope", 0.4, "only without laser.beam"),
        ("laser.receiver_offset_W", 0, "only without laser.beam"),
        ("laser.divergence_rad", 1e-4, 'only with laser.beam = "divergence"'),
        ("receiver.radius_m", "wide", "0.001 <= x <= 100 [m]"),
        ("receiver.area_m2", 0.1, 'not with laser.beam = "gaussian"'),
        ("receiver.optics_efficiency", 0, "0 < x <= 1 [-]"),
        ("receiver.cell_efficiency", None, 'needed by laser.beam = "gaussian"'),
        ("receiver.dc_efficiency", 2, "0 < x <= 1 [-]"),
        ("receiver.max_irradiance_W_m2", 0, "0 < x <= 1e12 [W/m2]"),
        ("receiver.max_power_W", True, "1e-6 <= x <= 1e9 [W]"),
        ("receiver.diameter_m", 1, "unknown key"),
    ],
)
def test_a_value_that_is_none_is_refused_by_its_key(key: str, value: object, words: str) -> None:
    """One fault, with key, value and what would be accepted."""
    (line,) = faults(ROUND, {key: value}).splitlines()
    assert line.startswith(key)
    assert words in line


def test_all_faults_of_both_tables_at_once() -> None:
    """A new beam names what it lacks and what it cannot use."""
    words = faults(ROUND, {"laser.beam": "divergence"})
    for part in (
        "laser.divergence_rad: is missing",
        "receiver.area_m2: is missing; a number, 1e-6 <= x <= 10000 [m2], needed by laser.b",
        'receiver.radius_m = 0.25: not with laser.beam = "divergence"',
        'receiver.cell_efficiency = 0.45: not with laser.beam = "divergence"',
    ):
        assert part in words
    for key in ("dc_efficiency", "max_irradiance_W_m2", "max_power_W"):
        assert f"receiver.{key} = 0.5: not with" in faults(WIDE, {f"receiver.{key}": 0.5})


def test_tables_that_belong_together() -> None:
    """No beam without a receiver, and no receiver without a beam."""
    assert "receiver: is missing; a table [receiver]" in faults(ROUND, {"receiver": None})
    only = 'receiver = a table: only with laser.beam = "gaussian" or "divergence"'
    assert only in faults(PAPER, {"receiver": {"radius_m": 0.2}})
    assert only in faults(ROUND, {"laser": None})
    assert faults(PAPER, {"laser.beam": "gauss"}).splitlines() == [
        "laser.beam = 'gauss': must be "
        '"gaussian" or "divergence", or one that is registered first'
    ]


@pytest.mark.parametrize("changes", [GAUSSIAN, DIVERGENCE])
def test_a_stated_charging_current_is_refused_beside_a_beam(changes: dict[str, Any]) -> None:
    """Even one of 0 A; without it the beam decides."""
    words = faults(TABLE2, changes | {"flight.charge_current_A": 0})
    assert "flight.charge_current_A = 0: not with laser.beam" in words
    assert "flight.charge_power_W = 66.515: not with laser.beam" in words
    gone = dict.fromkeys(("flight.charge_current_A", "flight.charge_power_W"))
    assert optuav.solve(TABLE2.replace(changes | gone)).flyable


def test_a_receiver_cannot_get_more_than_all_light() -> None:
    """χA > D² is refused, χA = D² is not, whatever rounding does to it."""
    words = faults(WIDE, {"receiver.area_m2": 0.0101})
    most = "x <= 0.01 [m2], which is laser.aperture_m squared / receiver.optics_efficiency"
    assert f"receiver.area_m2 = 0.0101: must be a number, {most}" in words
    dim = faults(WIDE, {"receiver.area_m2": 0.05, "receiver.optics_efficiency": 0.3})
    assert "receiver.area_m2 = 0.05: must be a number, x <= 0.03333333333 [m2]" in dim
    WIDE.replace({"receiver.area_m2": 0.03333333333, "receiver.optics_efficiency": 0.3})
    for aperture_m in np.linspace(0.1, 1.0, 10):
        area_m2 = round(float(aperture_m) ** 2, 10)
        WIDE.replace({"laser.aperture_m": float(aperture_m), "receiver.area_m2": area_m2})
    WIDE.replace({"receiver.area_m2": 0.02, "receiver.optics_efficiency": 0.5})


@pytest.mark.parametrize("mission", [ROUND, WIDE])
def test_files_keep_a_beam(mission: Mission, tmp_path: Path) -> None:
    """A saved file, a commented one, a file that extends it, and plain data are one mission."""
    file = mission.save(tmp_path / "beam.toml")
    assert optuav.load(file) == mission.replace({"name": "paper"})
    written = tmp_path / "new.toml"
    written.write_text(template(mission, "paper"), "utf-8")
    assert optuav.load(written).laser == mission.laser
    assert optuav.load(written).receiver == mission.receiver
    (tmp_path / "more.toml").write_text('schema = 1\nextends = "beam.toml"\n[laser]\npower_W = 1\n')
    assert optuav.load(tmp_path / "more.toml") == mission.replace(
        {"name": "more", "description": "", "laser.power_W": 1}
    )
    assert Mission.from_dict(mission.to_dict()) == mission


def test_a_beam_displaces_the_fits_and_another_beam() -> None:
    """As a new flight model displaces the loads of the other one."""
    assert PAPER.laser is not None
    assert "emitter_slope" not in ROUND.to_dict()["laser"]
    radius = dict.fromkeys(("receiver.radius_m", "receiver.cell_efficiency"))
    other = ROUND.replace({**DIVERGENCE, **radius})
    keys = other.to_dict()["laser"].keys() - {"visibility_km"}
    assert keys == WIDE.to_dict()["laser"].keys() - {"attenuation_per_km"}
    again = WIDE.replace({"laser.beam": None, "laser.aperture_m": None, "receiver": None} | {
        "laser.divergence_rad": None, "laser.emitter_slope": 0.34, "laser.emitter_offset_W": -1.1,
        "laser.receiver_slope": 0.5434, "laser.receiver_offset_W": -0.2761,
        "laser.power_W": 1000, "battery.charge_current_A": 10,
    })  # fmt: skip
    assert again == PAPER


# Plans


def random_mission(draw: np.random.Generator) -> Mission:
    """Any beam over any of two missions, weak and strong, narrow and wide, limited or not."""

    def ten(low: float, high: float) -> float:
        return float(10.0 ** draw.uniform(low, high))

    own = {"flight.charge_current_A": None, "flight.charge_power_W": None}
    base, gone = ((PAPER, {}), (TABLE2, own))[draw.integers(2)]
    changes: dict[str, Any] = {
        "limits.deadline_s": draw.uniform(300, 2500),
        "laser.wavelength_nm": float(draw.choice([810.0, 1064.0, 1250.0, 1550.0])),
        "laser.visibility_km": ten(0.3, 1.5),
        "battery.charge_current_A": ten(0.5, 2.0),
        "laser.power_W": ten(2.5, 5.0),
        "laser.aperture_m": (aperture_m := ten(-1.5, 0.0)),
    }
    if draw.random() < 0.4:
        changes["laser.beam"] = "divergence"
        changes["laser.divergence_rad"] = ten(-5.5, -3.5)
        changes["receiver"] = {"area_m2": aperture_m**2 * draw.uniform(0.1, 1.0)}
        return base.replace(changes | gone)
    receiver = {"radius_m": ten(-1.3, 0.0), "cell_efficiency": draw.uniform(0.2, 0.6)}
    changes |= {"laser.beam": "gaussian", "laser.source_efficiency": draw.uniform(0.2, 0.6)}
    for key, value in (
        ("laser.jitter_rad", ten(-6.0, -4.0)),
        ("laser.turbulence_cn2", ten(-16.0, -13.0)),
        ("laser.waist_m", aperture_m * draw.uniform(0.2, 0.5)),
        ("laser.m2", draw.uniform(1.0, 3.0)),
    ):
        changes |= {key: value} if draw.random() < 0.5 else {}
    limits = {"max_irradiance_W_m2": ten(2.5, 4.5), "max_power_W": ten(1.0, 3.0)}
    receiver |= {key: value for key, value in limits.items() if draw.random() < 0.3}
    return base.replace(changes | gone | {"receiver": receiver})


def check(seed: int) -> None:
    """The plan flies, its charging is the budget's, and a batch finds the same hover time."""
    mission = random_mission(np.random.default_rng(seed))
    plan = optuav.solve(mission)
    if not plan:
        return
    replayed = optuav.replay(plan)
    assert replayed.flyable, (seed, replayed.violations)
    assert optuav.audit(plan)
    for phase in plan.phases:
        if phase.kind == "rest":
            budget = optuav.link_budget(mission, phase.end_place)
            rest_A = getattr(mission.flight, "rest_current_A", 0.0)
            current_A = budget.current_A * budget.in_sight - rest_A
            assert phase.current_A == pytest.approx(current_A, rel=1e-9, abs=1e-9)
    factors = np.array([0.7, 1.0])
    assert mission.laser is not None
    keys = {
        "laser.power_W": mission.laser.power_W,
        "laser.aperture_m": vars(mission.laser)["aperture_m"],
    }
    wide = mission.laser.beam == "divergence"  # where a smaller aperture may be refused
    factors = factors if not wide else np.array([1.0, 1.3])
    columns = {key: value * factors for key, value in keys.items()}
    found = optuav.batch_arrays(mission, columns)["hover_time_s"]
    for row, factor in enumerate(factors):
        changes = {key: float(value * factor) for key, value in keys.items()}
        alone = optuav.solve(mission.replace(changes))
        hover_s = alone.hover_time_s if alone else math.nan
        assert found[row, row] == pytest.approx(hover_s, abs=2e-6, nan_ok=True), (seed, factor)


@few(6)
@given(st.integers(0, 10**6))
def test_plans_of_any_beam_replay_and_are_those_of_a_batch(seed: int) -> None:
    """Random missions over all keys of both beams."""
    check(seed)


@pytest.mark.soak
@pytest.mark.parametrize("block", range(20))
def test_plans_of_two_thousand_beams_replay(block: int) -> None:
    """The same at length."""
    for seed in range(100 * block, 100 * (block + 1)):
        check(10**7 + seed)


def test_hovering_in_sight_charges_by_its_own_distance() -> None:
    """Power at the hover point and on roofs by position, none without sight."""
    mission = ROUND.replace({"laser.visibility_km": 3, "battery.charge_current_A": 1e3})
    places = build_network(mission).places
    for place, name in enumerate(places.names):
        budget = optuav.link_budget(mission, name)
        assert places.laser_sight[place] == budget.in_sight
        assert places.received_power_W[place] == pytest.approx(budget.dc_W * budget.in_sight)
    hover = next(each for each in optuav.solve(mission, "P3").phases if each.kind == "hover")
    dark = optuav.solve(mission.replace({"laser.power_W": 0}), "P3")
    unlit = next(each for each in dark.phases if each.kind == "hover")
    gained_A = optuav.link_budget(mission, "hover").current_A
    assert hover.current_A - unlit.current_A == pytest.approx(gained_A)


def test_swept_keys_of_a_beam_are_missions_alone() -> None:
    """Keys that the mission leaves out too; where a batch breaks χA <= D² there is no plan."""
    pytest.importorskip("xarray")
    for mission, ranges in (
        (ROUND, {"laser.jitter_rad": [0.0, 5e-5], "receiver.max_power_W": [100.0, 300.0]}),
        (ROUND, {"laser.waist_m": [0.05, 0.1], "laser.wavelength_nm": [900.0, 1550.0]}),
        (WIDE, {"receiver.area_m2": [0.002, 0.02], "laser.divergence_rad": [0.0, 1e-4]}),
    ):
        few_roofs = mission.replace({"buildings": mission.buildings[5:8]})
        table = optuav.batch(few_roofs, ranges)["hover_time_s"].to_numpy()
        (first, ones), (second, others) = ranges.items()
        for (row, column), found in np.ndenumerate(table):
            changes = {first: ones[row], second: others[column]}
            if changes.get("receiver.area_m2", 0.0) > 0.01:
                assert np.isnan(found)
                assert "receiver.area_m2" in faults(few_roofs, changes)
            else:
                alone = optuav.solve(few_roofs.replace(changes)).hover_time_s
                assert found == pytest.approx(alone, abs=2e-6)


def test_maps_sites_and_sensitivity_take_a_beam() -> None:
    """A map of the laser is the batch of its places; sites and samples have figures."""
    pytest.importorskip("xarray")
    hazy = ROUND.replace({"laser.visibility_km": 2, "battery.charge_current_A": 1e3})
    hovers = optuav.maps.laser(hazy, 1000, bounds=(0, 0, 2000, 1000))
    for x in (0.0, 1000.0):
        own = hazy.replace({"laser.position_m": [x, 1000, 50]})
        found = float(hovers.sel(x=x, y=1000.0))
        assert found == pytest.approx(optuav.solve(own).hover_time_s, abs=2e-6)
    assert optuav.place_laser(hazy, [[1000, 0, 50], [0, 0, 50]], refine=False).value > 0.0
    ranges = {"laser.wavelength_nm": {"low": 1000, "high": 1100}}
    drawn = optuav.sensitivity(hazy, ranges, samples=4)
    assert "receiver.radius_m" in str(drawn.to_frame()["key"].tolist())


# What is said


def test_every_plan_with_a_beam_speaks_of_the_eye() -> None:
    """The distance and that it is no assessment; in turbulence that a limited power is a bound."""
    notes = optuav.solve(ROUND).notes
    (eye,) = (note for note in notes if "the eye" in note)
    assert eye.startswith("the beam exceeds the limit for the eye, 50 W/m², up to 41.13 km")
    assert eye.endswith("this is not a safety assessment")
    assert not any("upper bound" in note for note in notes)
    turbulent = optuav.solve(ROUND.replace({"laser.turbulence_cn2": 1e-15})).notes
    assert any("upper bound" in note for note in turbulent)
    visible = optuav.solve(ROUND.replace({"laser.wavelength_nm": 650})).notes
    assert any("no limit for the eye is known" in note for note in visible)
    assert not any("the eye" in note for note in optuav.solve(PAPER).notes)


def test_the_limit_that_acts_is_named() -> None:
    """A stronger laser then changes nothing; with jitter it always does."""

    def cap(changes: dict[str, Any]) -> str:
        mission = ROUND.replace(changes)
        found = charging_cap(mission, build_network(mission).places)
        return found.words if found else ""

    assert cap({}).startswith("battery.charge_current_A = 40 A caps the charging current ")
    assert cap({"receiver.max_power_W": 200}).startswith("receiver.max_power_W = 200 W caps")
    assert cap({"receiver.max_irradiance_W_m2": 900}).startswith(
        "receiver.max_irradiance_W_m2 = 900"
    )
    assert cap({"laser.jitter_rad": 5e-5}) == ""
    assert cap({"battery.charge_current_A": 1e3}) == ""
    for mission in (ROUND, WIDE):
        places = build_network(mission).places
        enough_W = laser_reach(mission, places).capped_W
        weaker, stronger = (
            build_network(mission.replace({"laser.power_W": factor * enough_W})).places
            for factor in (0.999, 1.001)
        )
        lit = places.laser_sight[1:] & (np.arange(1, len(places.names)) != 2)
        assert stronger.charge_current_A[1:][lit] == pytest.approx(40.0)
        assert weaker.charge_current_A[1:][lit].min() < 40.0


def test_a_free_hover_point_needs_a_beam_without_jitter() -> None:
    """The declared program is one of formulas; else the reason names the key."""
    free = optuav.P1(hover_point="free")
    lit = ROUND.replace({"battery.charge_current_A": 20, "buildings": []})
    plan = optuav.solve(lit, free, time_limit_s=5)
    assert plan.flyable
    with pytest.raises(InputError, match=r"laser.jitter_rad = 0"):
        optuav.formulate(ROUND.replace({"laser.jitter_rad": 1e-5}), free)


@pytest.mark.parametrize(
    ("mission", "keys"),
    [
        (ROUND, ["laser.aperture_m", "laser.jitter_rad", "receiver.radius_m"]),
        (WIDE, ["laser.aperture_m", "laser.divergence_rad"]),
    ],
)
def test_the_explorer_moves_a_beam(mission: Mission, keys: list[str]) -> None:
    """A slider for each, whose ends are missions too."""
    found = {each.key: each for each in controls(mission) if each.key in keys}
    assert [*found] == keys
    for key, control in found.items():
        assert control.low <= control.value <= control.high
        for end in (control.low, control.high):
            assert mission.replace({key: end}).laser is not None
    assert not {*keys} & {each.key for each in controls(PAPER)}


# From outside


class LampTable(LaserTable):
    """A lamp with a light that falls with the squared distance."""

    beam: Annotated[Literal["lamp"], BEAM]
    glow_m: Length
    """Distance at which all light is received [m]."""


class Lamp(SpreadingBeam):
    """P (glow/d)², not above a half of the light."""

    name: ClassVar[str] = "lamp"
    table: ClassVar[type[LaserTable]] = LampTable
    refuses: ClassVar[tuple[str, ...]] = ("receiver",)

    laser: LampTable

    def share(self, distance_m: Quantity) -> Quantity:
        return np.minimum((self.laser.glow_m / np.maximum(distance_m, 1.0)) ** 2, 0.5)

    def chain(self, distance_m: Quantity) -> Chain:
        light, share = self.laser.power_W, self.share(distance_m)
        return Chain(light, light, 1.0, share, light * share, light * share)

    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        return np.minimum(self.chain(distance_m).dc_W, most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        return most_W / self.share(distance_m)

    def peak(self, distance_m: Quantity, *, still: bool = False) -> Quantity:
        return 1.0 / np.maximum(distance_m, 1.0) ** 2


class GlowTable(LaserTable):
    """A glow, without a key of its own."""

    beam: Annotated[Literal["glow"], BEAM]


class Glow(Beam):
    """A tenth of the power wherever the laser is in sight, by what `Beam` declares alone."""

    name: ClassVar[str] = "glow"
    table: ClassVar[type[LaserTable]] = GlowTable

    def received_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        return np.minimum(0.1 * self.laser.power_W + 0.0 * distance_m, most_W)

    def enough_W(self, distance_m: Quantity, most_W: Quantity) -> Quantity:
        return 10.0 * most_W + 0.0 * distance_m


def test_a_beam_from_outside_needs_no_more_than_beam_declares(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It is read, solved, replayed, shown and saved; only a link budget needs a beam that spreads.

    100 W charge at 100 W / e_nom: that is what [flight] can state too.
    """
    monkeypatch.setitem(BEAMS, "glow", Glow)
    glow = PAPER.replace({"laser.beam": "glow"})
    assert isinstance(glow.beam, Glow)
    plan = optuav.solve(glow)
    assert optuav.replay(plan).flyable
    rests = [phase for phase in plan.phases if phase.kind == "rest"]
    nominal_V = PAPER.battery.nominal_voltage_V
    assert rests
    assert rests[0].charge_As == pytest.approx(
        rests[0].duration_s * min(100.0 / nominal_V, PAPER.battery.charge_current_A)
    )
    found = optuav.batch_arrays(glow, {"laser.power_W": np.array([500.0, 1000.0])})
    assert found["hover_time_s"][1] == pytest.approx(plan.hover_time_s, abs=2e-6)
    assert str(optuav.explain(plan))
    assert optuav.coverage(glow)
    assert optuav.load(glow.save(tmp_path / "glow.toml")) == glow
    assert "eye" not in plan.summary()
    words = r"laser\.beam = 'glow': must be 'gaussian' or 'divergence', a beam that spreads"
    with pytest.raises(InputError, match=words):
        optuav.link_budget(glow, "b7")


def test_a_beam_from_outside_is_read_by_its_interface(monkeypatch: pytest.MonkeyPatch) -> None:
    """Keys, messages, plan, replay, batch and budget follow from its declaration."""
    monkeypatch.setitem(BEAMS, "lamp", Lamp)
    lamp = PAPER.replace(
        {"laser.beam": "lamp", "laser.glow_m": 200, "battery.charge_current_A": 100}
    )
    assert isinstance(lamp.beam, Lamp)
    budget = optuav.link_budget(lamp, "b7")
    assert budget.dc_W == pytest.approx(1000 * (200 / budget.distance_m) ** 2)
    assert budget.reach_m(250.0) == pytest.approx(400.0)
    plan = optuav.solve(lamp)
    assert optuav.replay(plan).flyable
    found = optuav.batch_arrays(lamp, {"laser.glow_m": np.array([100.0, 200.0])})
    assert found["hover_time_s"][1] == pytest.approx(plan.hover_time_s, abs=2e-6)
    assert 'only with laser.beam = "lamp"' in faults(ROUND, {"laser.glow_m": 5})
    assert 'receiver = a table: not with laser.beam = "lamp"' in faults(lamp, {"receiver": {}} | {
        "receiver.radius_m": 1.0
    })  # fmt: skip

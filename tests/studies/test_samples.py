"""Samples that fill their ranges, and random towns with the statistics that were asked for."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import optuav
from optuav.errors import InputError
from optuav.mission.keys import numeric_keys, stated_value

SPREAD = {
    "battery.capacity_As": {"low": 30e3, "high": 40e3},
    "limits.deadline_s": {"low": 600, "likely": 900, "high": 1500},
    "wind": {"force_N[0]": {"deviation": 1.0}},
}


@pytest.mark.parametrize("method", ["sobol", "latin-hypercube"])
def test_samples_fill_every_part_of_a_range_evenly(method: Any) -> None:
    """Of 256 uniform samples exactly one in each of 256 parts; the mean of a triangle is known."""
    found = optuav.samples("paper", SPREAD, 256, method=method, seed=4)
    assert found.keys() == {"battery.capacity_As", "limits.deadline_s", "wind.force_N[0]"}
    parts = np.floor((found["battery.capacity_As"] - 30e3) / 10e3 * 256)
    assert sorted(parts.tolist()) == list(range(256))
    assert found["limits.deadline_s"].mean() == pytest.approx(1000.0, abs=1.0)
    assert found["wind.force_N[0]"].std() == pytest.approx(1.0, abs=0.03)


def test_samples_depend_on_the_seed_alone() -> None:
    """And the first points of a Sobol sequence not on how many follow."""
    few, many = (optuav.samples("paper", SPREAD, count, seed=1) for count in (100, 1000))
    other = optuav.samples("paper", SPREAD, 100, seed=2)
    for key, column in few.items():
        assert (column == many[key][:100]).all()
        assert (column != other[key]).any()


def test_an_uncertain_wavelength_holds_the_conversion_as_in_a_sensitivity() -> None:
    """Which `optuav.batch` takes: one statement of what is uncertain has one meaning."""
    mission = optuav.load("matrice350")
    drawn = optuav.samples(mission, {"laser.wavelength_nm": {"percent": 5}}, 4)
    found = optuav.batch_arrays(mission, drawn, paired=True)["hover_time_s"]
    for number, hover_s in enumerate(found):
        row = {key: float(column[number]) for key, column in drawn.items()}
        assert row.keys() > {"laser.wavelength_nm", "laser.emitter_slope"}
        assert hover_s == pytest.approx(optuav.solve(mission.replace(row)).hover_time_s, abs=1e-9)
    assert len({*found}) == 4
    laser = mission.laser
    assert laser is not None
    assert (drawn["laser.emitter_slope"] == laser.emitter_slope).all()
    both = {"laser": {"wavelength_nm": {"percent": 5}, "emitter_slope": {"percent": 5}}}
    assert len({*optuav.samples(mission, both, 4)["laser.emitter_slope"]}) == 4


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 0}, "count = 0"),
        ({"count": 2.5}, "count = 2.5"),
        ({"seed": -1}, r"seed = -1: must be a whole number, 0 <= x <= 2\*\*63 "),
        ({"method": "sobel"}, "did you mean 'sobol'"),
        ({"uncertainty": {}}, "at least one key"),
        ({"uncertainty": {"battery.capacity": {"percent": 5}}}, "battery.capacity_As"),
    ],
)
def test_samples_refuse_what_they_cannot_draw(options: dict[str, Any], words: str) -> None:
    """Each with its field and what is allowed."""
    stated = {"uncertainty": SPREAD, "count": 10, **options}
    with pytest.raises(InputError, match=words):
        optuav.samples("paper", **stated)


def test_towns_after_itu_r_p1410_have_its_statistics() -> None:
    """α of the land is built on, β buildings stand on a km², heights are Rayleigh of scale γ."""
    options: dict[str, Any] = {"built_up": 0.3, "per_km2": 300.0, "height_scale_m": 20.0}
    (town,) = optuav.layouts("paper", 1, "manhattan", area_m=(-3e3, -3e3, 3e3, 3e3), **options)
    count = len(town.buildings)
    assert count / 36.0 == pytest.approx(300.0, rel=0.03)
    sizes = np.array([each.footprint_m for each in town.buildings])
    assert sizes.prod(axis=1).sum() / 36e6 == pytest.approx(0.3, rel=0.03)
    heights_m = np.array([each.position_m[2] for each in town.buildings])
    assert heights_m.mean() == pytest.approx(20.0 * np.sqrt(np.pi / 2.0), rel=0.02)
    assert (heights_m**2).mean() == pytest.approx(2.0 * 20.0**2, rel=0.04)


@pytest.mark.parametrize("kind", ["uniform", "grid", "manhattan"])
def test_no_building_stands_around_an_end_and_none_outside(kind: Any) -> None:
    """Origin, destination and laser stay free; the first towns do not depend on how many follow."""
    base = optuav.load("paper")
    squares = {"buildings": 400, "size_m": 60.0}
    options: dict[str, Any] = {"per_km2": 80.0} if kind == "manhattan" else squares
    options["seed"] = 5
    towns = optuav.layouts(base, 3, kind, **options)
    assert base.laser is not None
    ends = base.route.origin_m, base.route.destination_m, base.laser.position_m
    for town in towns:
        at_m = np.array([each.position_m[:2] for each in town.buildings])
        assert ((at_m >= 0.0) & (at_m <= 2000.0)).all()
        half_m = 0.5 * town.buildings[0].footprint_m[0]  # type: ignore[operator, index]
        for x, y, _ in ends:
            assert (np.abs(at_m - (x, y)).max(axis=1) >= half_m).all()
    if kind == "uniform":
        assert {len(town.buildings) for town in towns} == {400}
    assert optuav.layouts(base, 1, kind, **options) == towns[:1]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"count": 0}, "count = 0"),
        ({"kind": "manhatten"}, "did you mean 'manhattan'"),
        ({"heights_m": (100.0, 60.0)}, "the lower first"),
        ({"area_m": (0.0, 0.0, 0.0, 1.0)}, "low < high"),
        ({"area_m": (0.0, 0.0, 10.0, 10.0)}, "with room for the buildings"),
        ({"built_up": 1.0}, "built_up"),
        ({"kind": "manhattan", "per_km2": 1e6}, "at most 100000 buildings"),
        ({"kind": "grid", "per_km2": 9}, "per_km2 = 9: goes with the kind manhattan"),
        ({"kind": "manhattan", "size_m": 9}, "size_m = 9: goes with the kind uniform or grid"),
    ],
)
def test_layouts_refuse_what_cannot_be_built(options: dict[str, Any], words: str) -> None:
    """Each with its field and what is allowed."""
    with pytest.raises(InputError, match=words):
        optuav.layouts("paper", **{"count": 2, **options})


def test_the_area_and_the_heights_may_be_arrays() -> None:
    area_m, heights_m = (100.0, 0.0, 900.0, 800.0), (20.0, 30.0)
    listed = optuav.layouts("paper", 1, area_m=area_m, heights_m=heights_m)
    arrays = {"area_m": np.array(area_m), "heights_m": np.array(heights_m)}
    assert optuav.layouts("paper", 1, **arrays) == listed


def test_what_is_no_path_and_no_mapping_is_refused() -> None:
    with pytest.raises(InputError, match="None: must be a path"):
        optuav.samples("paper", None, 5)  # type: ignore[arg-type]


def test_faults_of_samples_are_said_at_once() -> None:
    with pytest.raises(InputError) as caught:
        optuav.samples("paper", {"nosuch.key": {"percent": 1}}, 0, method="x")  # type: ignore[arg-type]
    assert [fault.key for fault in caught.value.faults] == ["count", "method", "nosuch.key"]


def test_uncertain_keys_are_those_of_a_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every shipped mission, with the same words for those that are refused.

    Of each mission every key is asked of one function, and of another for the next mission. A batch
    also takes whole numbers; of wavelengths between the known ones only samples hold the
    conversion.
    """

    def taken(*_: object, **__: object) -> None:
        raise InputError("taken")  # Before anything is solved

    for solving in ("batch.variables", "sensitivity.solve"):
        monkeypatch.setattr(f"optuav.studies.{solving}", taken)
    monkeypatch.setattr("optuav.service.robust.solve", taken)

    def answer(question: Callable[[], object]) -> list[str]:
        try:
            question()
        except InputError as error:
            return [str(fault) for fault in error.faults]
        return ["taken"]

    uncertain = [
        lambda name, spread: optuav.samples(name, spread, 1),
        lambda name, spread: optuav.sensitivity(name, spread, samples=1),
        lambda name, spread: optuav.robust(name, spread, samples=1),
    ]
    refused = Counter[str]()
    one = [name for name in optuav.shipped() if not optuav.load(name).devices]
    for number, name in enumerate(one):
        mission = optuav.load(name)
        for place, (key, allowed) in enumerate(numeric_keys().items(), number):
            if allowed.whole or key == "laser.wavelength_nm":
                continue
            now = stated_value(mission, key) if getattr(mission, key.partition(".")[0]) else None
            least = (allowed.ge or 0.0) if allowed.gt is None else allowed.gt + 1e-6
            most = (allowed.lt if allowed.le is None else allowed.le) or least + 1.0
            low, high = least, least + min(1e-3, 0.5 * (most - least))
            if now:
                low, high = sorted((0.99 * now, 1.01 * now))
            by_batch = answer(lambda: optuav.batch_arrays(name, {key: [low, high]}))  # noqa: B023
            spread = {key: {"low": low, "high": high}}
            ask = uncertain[place % (3 if by_batch != ["taken"] else 2)]
            assert answer(lambda: ask(name, spread)) == by_batch, (name, key)  # noqa: B023
            refused[name] += by_batch != ["taken"]
    assert min(refused.values()) > 20
    assert max(refused.values()) < len(numeric_keys()) - 20


@pytest.mark.parametrize("ask", [optuav.sensitivity, optuav.robust, optuav.samples])
def test_no_end_of_a_range_is_beyond_a_mission(ask: Any) -> None:
    """A wind that would be ignored, from 0 on or below 0; and more charge than fits."""
    options: dict[str, Any] = {"count" if ask is optuav.samples else "samples": 1}
    paper = optuav.load("paper").replace({"start.available_As": 5000, "start.bound_As": 5000})
    for mission, key, low, high, words in (
        ("paper", "wind.velocity_m_s[0]", 0.0, 2.0, '[0, 0, 0] with flight.model = "rotors"'),
        ("matrice350", "wind.velocity_m_s[1]", -1.0, 0.0, "[0, 0, 0] with flight.model"),
        ("matrice350", "wind.force_N[2]", 0.0, 1.0, "[0, 0, 0] with flight.model"),
        (paper, "start.bound_As", 0.0, 1e6, "the full well"),
    ):
        with pytest.raises(InputError) as refusal:
            ask(mission, {key: {"low": low, "high": high}}, **options)
        assert words in str(refusal.value)


def test_a_batch_refuses_what_its_first_value_hides() -> None:
    """Where 0 means none, other values decide whether the mission takes the key."""
    for mission, key, words in (
        ("paper", "wind.velocity_m_s[0]", "with flight.model"),
        ("matrice350", "wind.force_N[2]", "with flight.model"),
        ("relay-today", "body.drag_area_m2", "not with flight.model"),
    ):
        with pytest.raises(InputError, match=words):
            optuav.batch_arrays(mission, {key: [0.0, -1.0 if "wind" in key else 1.0]})


def test_a_hover_point_and_a_rate_per_minute_may_be_uncertain() -> None:
    """As a batch takes them: all of a place together, and the rate as missions hold it."""
    point_m = dict(zip((f"route.hover_m[{k}]" for k in range(3)), (1000, 2600, 60), strict=True))
    box = {key: {"low": x - 1.0, "high": x + 1.0} for key, x in point_m.items()}
    (hover,) = {key: r for key, r in optuav.samples("paper", box, 4).items() if key[-2] == "0"}
    assert hover == "route.hover_m[0]"
    found = optuav.sensitivity("paper", box, perspective="battery", samples=4)
    moved = optuav.load("paper").replace({"route.hover_m": [1000, 2600, 60]})
    alone_s = optuav.solve(moved, perspective="battery").hover_time_s
    assert found.hover_time_s == pytest.approx(alone_s, rel=1e-9)
    minutes = optuav.samples("paper", {"battery.flow_rate_per_min": {"low": 30, "high": 60}}, 64)
    (rates_per_s,) = minutes.values()
    assert [*minutes] == ["battery.flow_rate_per_s"]
    assert 0.5 <= rates_per_s.min() < 0.55
    assert 0.95 < rates_per_s.max() <= 1.0
    both = {"flow_rate_per_min": {"percent": 5}, "flow_rate_per_s": {"percent": 5}}
    with pytest.raises(InputError, match="varies once"):
        optuav.samples("paper", {"battery": both}, 4)

"""Diagnosis under `available`: what the wells forbid is told, proved and repaired in seconds."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

import optuav
from optuav.diagnosis import explain
from optuav.diagnosis.infeasibility import Conflict, conflicts
from optuav.diagnosis.report import conflict_blocks
from optuav.errors import InputError
from optuav.mission import Mission
from optuav.presentation.text import as_text
from tests.asking import formulate, solve, stated
from tests.diagnosis.missions import PAPER, SMALL, only, repairs


def diagnosed(mission: Mission, **options: Any) -> tuple[Conflict, ...]:
    return conflicts(formulate(mission, **options))


def flowing(conflict: Conflict) -> str:
    """A conflict as one line of words."""
    return " ".join(as_text(conflict_blocks(conflict, None)).split())


def test_linear_constraints_that_conflict_have_their_certificate() -> None:
    """75.79 s of flight in 50 s: exact, though the wells beside it are not linear."""
    (conflict,) = diagnosed(SMALL.replace({"limits.deadline_s": 50}), problem="P3")
    (proof,) = conflict.certificates
    assert proof.holds()
    assert proof.keys == ("limits.deadline_s",)
    assert 50 + float(-proof.limit) > 75.79
    assert conflict.clash is None


def test_wells_that_conflict_are_told_by_their_moments() -> None:
    """A reserve of 99 %: the rest that it asks for drives the available well past full."""
    mission = SMALL.replace({"limits.min_soc": 0.99})
    (conflict,) = diagnosed(mission, problem=optuav.P4("b1", order="hover-first"))
    assert conflict.certificates == ()
    assert conflict.clash is not None
    assert conflict.clash.labels == (
        "P4.a state of charge",
        "P4.a not past full after the rest at b1",
    )
    (broken,) = conflict.clash.broken
    assert re.fullmatch(r"charge left: 8\d\.\d+ % ≥ 99 % would be false", broken)


def test_how_far_a_clash_is_proved_is_said() -> None:
    """Both of its constraints could hold after a rest without end, for all that was looked at."""
    mission = SMALL.replace({"limits.min_soc": 0.99})
    asked = {"problem": optuav.P4("b1", order="hover-first")}
    (conflict,) = diagnosed(mission, **asked)
    assert conflict.clash is not None
    assert conflict.clash.far_s == 1e4
    assert conflict.to_dict()["clash"]["far_s"] == 1e4
    assert "no times whose sum is at most 10000 s satisfy them" in flowing(conflict)


def test_a_well_that_runs_dry_in_flight_is_told_by_stage_and_leg() -> None:
    """1.5 · 5600 A·s hold 8400, of which 6720 are available: 7843 are drawn on the way."""
    mission = SMALL.replace({"battery.packs": 1, "battery.capacity_As": 8400})
    (conflict,) = diagnosed(mission, problem="P3")
    assert conflict.clash is not None
    (label,) = conflict.clash.labels
    assert label.startswith("P3.a not dry")
    assert "the flight hover → destination" in label
    (broken,) = conflict.clash.broken
    assert broken.startswith("the available well would be dry after stage 4 (brake) of the fl")
    assert "hover → destination, even without any stay" in flowing(conflict)


def test_repairs_repair_and_one_digit_less_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    """Solved again from the mission and simulated, with the digit and without."""
    only(monkeypatch, "limits", "battery")
    mission = SMALL.replace({"limits.min_soc": 0.99})
    options = {"problem": optuav.P4("b1", order="hover-first")}
    found = {each.key: each for each in repairs(mission, **stated(options))}
    assert found.keys() >= {"limits.min_soc", "battery.capacity_As", "battery.packs"}
    for key in ("limits.min_soc", "battery.capacity_As", "battery.packs"):
        repair = found[key]
        sign = 1 if repair.comparison == ">=" else -1
        plan = solve(mission.replace({key: repair.value}), **options)
        assert plan.flyable
        short = repair.value - sign * repair.resolution
        short = int(short) if key == "battery.packs" else float(f"{short:.12g}")
        assert not solve(mission.replace({key: short}), **options)


def test_only_what_unknowns_move_binds_or_is_to_spare() -> None:
    """Outage, ends and altitude compare figures of the route: no choice of times moves them."""
    explained = explain("paper")
    labels = [each.label for each in explained.constraints]
    assert not [each for each in labels if each.startswith(("P1.a", "P1.c", "P1.e"))]
    binding = {each.label for each in explained.constraints if each.binds}
    assert binding == set(explained.plan.binding)
    words = str(explained)
    assert "in flight to b10, the least of 8 such moments" in " ".join(words.split())
    assert max(map(len, words.splitlines())) <= 80
    assert "1e−06 1/s more of the flow between the wells gives 0.252 s" in words


def test_packs_that_take_turns_are_not_explained_by_constraints() -> None:
    """The plan is simulated: pooled constraints and prices would be those of another question."""
    explained = explain(PAPER.replace({"battery.schedule": "sequential"}), problem="P3")
    assert (explained.constraints, explained.prices) == ((), ())
    assert "packs that take turns" in str(explained)


def test_packs_that_take_turns_have_no_repairs() -> None:
    """No declaration knows of the turns, so that none could be verified."""
    turns = PAPER.replace({"battery.schedule": "sequential", "limits.min_soc": 0.99})
    assert explain(turns, problem="P3").repairs == ()


@pytest.mark.parametrize("min_soc", [0.05, 0.99])
def test_a_saved_plan_of_packs_that_take_turns_is_told_as_its_mission(
    min_soc: float, tmp_path: Path
) -> None:
    """Whatever answered it, and whether or not there is a plan: as if the mission were asked."""
    turns = PAPER.replace({"battery.schedule": "sequential", "limits.min_soc": min_soc})
    solve(turns, "P3", slot_s=50).save(tmp_path / "turns.json")
    saved = optuav.load_plan(tmp_path / "turns.json")
    assert bool(saved) == (min_soc == 0.05)
    assert str(explain(saved)) == str(explain(turns, problem="P3", slot_s=50))


@pytest.mark.parametrize("min_soc", [0.05, 0.99])
def test_a_plan_of_several_stops_is_not_explained_by_those_of_one(min_soc: float) -> None:
    """No programme declares them; its repairs cannot be sought either."""
    mission = SMALL.replace({"limits.min_soc": min_soc, "limits.deadline_s": 200})
    plan = solve(mission, optuav.P1(stops=2))
    assert plan.engine == "search"
    assert bool(plan) == (min_soc == 0.05)
    explained = explain(plan)
    assert (explained.constraints, explained.prices, explained.repairs) == ((), (), ())
    assert "several stops have no single programme" in " ".join(str(explained).split())
    with pytest.raises(InputError, match="several stops have no single programme"):
        repairs(plan)

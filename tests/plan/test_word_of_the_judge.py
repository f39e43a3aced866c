"""Whether a plan can be flown is the judge's word, wherever it is said; and all causes are told."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import pytest

import optuav
from optuav.diagnosis.in_words import verdict
from optuav.network.timeline import simulated
from optuav.paper.figures import grounded
from optuav.plan.data import CANNOT
from optuav.service.fleet import lasting
from tests.wells import SLOW

RELAY = optuav.load("relay-today").replace(SLOW)
PLACED = {"earth.latitude_deg": 52.5, "earth.longitude_deg": 13.4}


@cache
def overfilled() -> optuav.Plan:
    """Rests first: the well is full after a minute, and the battery of 42 336 A s holds 70 000."""
    return optuav.solve(RELAY, perspective="battery")


@cache
def late() -> optuav.Plan:
    """A plan whose only fault is that it comes home after the deadline."""
    mission = optuav.load("paper").replace({**PLACED, "limits.deadline_s": 600.0})
    plan = optuav.solve("paper").model_copy(update={"mission": mission})
    (fault,) = (e for e in optuav.replay(plan).violations if e.kind == "deadline")
    note = f"{CANNOT}{fault.words}"
    return plan.model_copy(update={"flyable": False, "notes": ("a remark", note)})


def promised(mission: optuav.Mission) -> str:
    """The note on what the perspective battery promises."""
    (note,) = (each for each in optuav.solve(mission).notes if "promises" in each)
    return note


def test_a_promise_that_overfills_is_told() -> None:
    """At the judge's moment; only a battery that runs dry had been told."""
    full_s = optuav.replay(overfilled()).first_s("full")
    assert overfilled().runs_dry_s is None
    assert full_s == pytest.approx(90.94, abs=0.01)
    words = f"; that plan would overfill the available well at {full_s:.2f} s"
    assert promised(RELAY).endswith(words)


def test_a_promise_that_overfills_and_falls_is_told_as_both() -> None:
    """SPEC: the paper's plan reaches 104 % of the well first, and runs dry at 1095.50 s."""
    ends = "would overfill the available well at 157.03 s and run dry and fall at 1095.50 s"
    assert promised(optuav.load("paper")).endswith(ends)


def test_a_promise_that_fails_otherwise_is_told_by_the_judge() -> None:
    """Where charging tapers nothing overfills: what is refused is missing at the end."""
    tapered = {"battery.charging": "taper", "limits.min_soc": 0.95}
    said = promised(RELAY.replace(tapered))
    assert "; that plan cannot be flown: the mission ends with 6.37 % of the charge, below" in said
    assert "which checks only charge, and not the wells, promises" in said


def test_pictures_mark_charge_past_full() -> None:
    """In notebooks: the moment, the charge that is not taken, and the judge's picture alike."""
    plan = overfilled()
    for html in (plan._repr_html_(), optuav.replay(plan)._repr_html_()):
        assert "past full at 90.9 s" in html
        assert html.count(">past full<") == 1
    flown = optuav.solve(RELAY)._repr_html_()
    assert "past full" not in flown


def test_both_moments_are_marked() -> None:
    html = optuav.solve("paper", perspective="battery")._repr_html_()
    assert "past full at 157.0 s, dry at 1095.5 s" in html


def test_the_plotted_wells_have_the_judges_title_and_the_charge_past_full() -> None:
    """Also where a plan neither runs dry nor overfills, but is late."""
    pytest.importorskip("matplotlib")
    from optuav import plots

    over, flies, after = plots.wells([overfilled(), optuav.solve(RELAY), late()])
    titles = [ax.get_title(loc="left") for ax in (over, flies, after)]
    assert ["cannot be flown" in title for title in titles] == [True, False, True]
    (band,) = (each for each in over.collections if each.get_label() == "past full")
    levels_As = band.get_paths()[0].vertices[:, 1]
    full_As = float(RELAY.pool.capacity_As)
    assert levels_As.max() == pytest.approx(69_500.0, abs=500.0)  # 42 336 + 8 A · 3484 s − flights
    assert levels_As[levels_As < levels_As.max()].min() <= full_As
    legend = over.get_figure(root=True).legends[0]
    assert "past full" in [text.get_text() for text in legend.get_texts()]
    assert "not there" not in [text.get_text() for text in legend.get_texts()]


def test_a_verdict_names_the_fault_and_no_other_note() -> None:
    """Of the explorer; it had quoted the first note, whatever that was about."""
    said = verdict(late())
    assert (said.event, said.good) == ("cannot be flown", False)
    assert "deadline" in said.reason


def test_an_export_of_a_plan_says_every_fault(tmp_path: Path) -> None:
    pytest.importorskip("pyproj")
    with pytest.raises(optuav.InputError, match="deadline"):
        late().export(tmp_path / "a.kml")
    text = late().export(tmp_path / "a.kml", force=True)[0].read_text("utf-8")
    assert any(fault in text for fault in late().faults)
    assert "deadline" in text


def test_the_report_counts_every_plan_that_cannot_be_flown() -> None:
    plans = {"late": late(), "over": overfilled(), "good": optuav.solve("paper")}
    said = [*grounded(plans, "rows")]
    assert [words.partition(" rows ")[0] for words in said] == ["In 1 of 3", "In 1 of 3"]


def test_a_plan_that_the_judge_lets_fly_has_no_warning() -> None:
    """A well may pass its limits by a millionth of the capacity: neither sees a fault in less."""
    plan = optuav.solve("paper", "P3")
    for share, flies in ((5e-7, True), (2e-6, False)):
        longer_s = share * 72_000.0 / 87.91
        out, hover, back = plan.phases
        phases = [out, lasting(hover, hover.duration_s + longer_s), back]
        longer = plan.model_copy(update={"phases": simulated(plan.mission, phases)})
        stop = optuav.Stop("hover", "hover", plan.hover_time_s + longer_s)
        judged = optuav.replay(optuav.Itinerary(plan.mission, (stop,)))
        assert (judged.flyable, longer.runs_dry_s is None) == (flies, flies)

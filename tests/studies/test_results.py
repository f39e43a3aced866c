"""The labelled table: the same rows in every form, and examples that run."""

from __future__ import annotations

import csv
import io
import json
import re
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace

import numpy as np
import pytest

import optuav
from optuav.presentation.blocks import Block, Heading
from optuav.service.cycle import Coverage
from optuav.service.declared import CycleComparison
from optuav.service.endless import EndlessCycle
from optuav.service.event import Event
from optuav.service.event_roster import EventRoster
from optuav.service.failure import Failure
from optuav.service.fleet import Fleet
from optuav.service.horizon import Horizon
from optuav.service.return_by import ReturnTimes
from optuav.service.robust import RobustPlan
from optuav.service.size_fleet import FleetSizes
from optuav.studies.compare_methods import MethodComparison
from optuav.studies.compare_plans import PlanComparison
from optuav.studies.compare_speeds import SpeedComparison
from optuav.studies.power_curve import PowerCurve
from optuav.studies.results import Comparison, Pictures, Result
from optuav.studies.sensitivity import Sensitivity
from optuav.studies.uncertainty import Chances


@dataclass(frozen=True, kw_only=True, repr=False)
class ByHand(Result):
    """A result with figures of every kind."""

    kind = "by hand"
    units = {"name": "", "time_s": "s", "route": ""}  # noqa: RUF012
    shares: Mapping[float, float]
    names: tuple[str, ...]
    chances: Chances | None = None
    plan: object = field(default=None, repr=False)

    def blocks(self) -> Iterator[Block]:
        yield Heading("text")

    def pictures(self) -> Pictures:
        yield from ()


@pytest.fixture
def table() -> ByHand:
    """Two rows by hand, one without a value."""
    rows = (
        {"name": "one", "time_s": 1.5, "route": ("a", "b"), "why": ("x",)},
        {"name": "two", "time_s": None, "route": (), "why": ()},
    )
    shares = {0.25: np.float64(3.0)}
    return ByHand(mission=optuav.load("paper"), rows=rows, shares=shares, names=("p", "q"))


def test_records_have_the_columns_and_nothing_else(table: ByHand) -> None:
    assert table.records() == [
        {"name": "one", "time_s": 1.5, "route": "a > b"},
        {"name": "two", "time_s": None, "route": ""},
    ]


def test_csv_and_frame_hold_the_records(table: ByHand) -> None:
    first, second = csv.DictReader(io.StringIO(table.to_csv()))
    assert first == {"name": "one", "time_s": "1.5", "route": "a > b"}
    assert second == {"name": "two", "time_s": "", "route": ""}
    pytest.importorskip("pandas")
    frame = table.to_frame()
    assert list(frame.columns) == ["name", "time_s", "route"]
    assert frame.time_s[0] == 1.5


def test_plain_data_hold_everything_and_are_json(table: ByHand) -> None:
    data = table.to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["shares"] == {"0.25": 3.0}
    assert data["names"] == ["p", "q"]
    assert data["rows"][0] == {"name": "one", "time_s": 1.5, "route": ["a", "b"], "why": ["x"]}
    assert data["units"]["time_s"] == "s"
    assert data["mission"] == table.mission.to_dict()


def test_figures_are_what_is_shown_and_no_object_beside_them(table: ByHand) -> None:
    """A plan that a result holds is no figure: files stay small."""
    assert [*replace(table, plan="a plan").figures()] == ["shares", "names", "chances"]
    assert "plan" not in replace(table, plan="a plan").to_dict()


def test_single_samples_stay_out_of_plain_data(table: ByHand) -> None:
    """They may be millions."""
    share = Chances(1, 0, ("k",), True, 2.0, {0.5: 2.0}, 0.0, {}, None, None, np.array([2.0]))
    found = replace(table, chances=share)
    assert found.to_dict()["chances"]["mean_s"] == 2.0
    assert "hover_times_s" not in found.to_dict()["chances"]


def test_a_table_without_rows_keeps_its_columns(table: ByHand) -> None:
    found = replace(table, rows=())
    assert found.to_csv() == "name,time_s,route\n"
    assert str(found) == "text"
    assert found.plot() == {}


def test_numbers_of_a_row_are_written_in_one_cell(table: ByHand) -> None:
    """Speeds of the legs: files and frames of a comparison of speeds were refused."""
    rows = ({"name": "free", "time_s": None, "route": (7.9, 12.25)},)
    assert replace(table, rows=rows).to_csv() == "name,time_s,route\nfree,,7.9 > 12.25\n"


KINDS: tuple[type[Result], ...] = (
    *(Coverage, CycleComparison, Event, Fleet, FleetSizes, Horizon, ReturnTimes, RobustPlan),
    *(Failure, MethodComparison, PlanComparison, PowerCurve, Sensitivity, SpeedComparison),
)


@pytest.mark.parametrize("kind", KINDS, ids=lambda each: each.__name__)
def test_figures_are_fields_of_known_types(kind: type[Result]) -> None:
    """An editor completes them, and no type is `Any` but in rows whose columns are asked for."""
    types = typing.get_type_hints(kind)
    own = {each.name for each in fields(kind)} - {each.name for each in fields(Result)}
    assert own <= set(types)
    assert not [name for name in own if "Any" in str(types[name])]
    assert not hasattr(kind, "__getattr__")
    if not issubclass(kind, Comparison):
        (row, _) = typing.get_args(types["rows"])
        assert set(kind.units) <= set(typing.get_type_hints(row))


def test_every_kind_of_result_is_held_to_it() -> None:
    """A new one stands in the list above."""

    def below(kind: type[Result]) -> Iterator[type[Result]]:
        for each in kind.__subclasses__():
            yield each
            yield from below(each)

    known = {*KINDS, EndlessCycle, EventRoster, Comparison, ByHand}
    assert {each for each in below(Result) if each.__module__.startswith("optuav")} <= known


def test_text_and_html_hold_the_same_words() -> None:
    """Both are written from one list of blocks."""
    cycle = optuav.coverage("paper")
    page = re.sub("<[^>]*>", " ", cycle._repr_html_())
    for line in str(cycle).splitlines():
        for word in line.split():
            assert word in page, word

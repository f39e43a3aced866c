"""The longest part of a time: evaluated, taken as an unknown, and taken whole."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from optuav.modelling import Model, Parameter, Relation, Variable, evaluate
from optuav.modelling.expression import Let
from optuav.modelling.longest import LongestPart, lifted, speaks_of_parts, uncapped
from optuav.modelling.printing import text

ROOM = Parameter("room", "R", "1", 3.0)


def filling(name: str = "fill") -> LongestPart:
    """How long a tank of some room can be filled, at one a second."""

    def limits(share: Any, time: Any, room: Any) -> Any:
        yield "not over", Relation(share * time, "<=", room)
        yield "no less", Relation(share * time, ">=", -room)

    return LongestPart(
        name=name,
        symbol="s",
        share=f"{name}_share",
        words="until it is full",
        value=np.minimum,
        limits=limits,
        least_share=lambda time, room: 0.0 * room,
    )


def tank() -> tuple[Model, Variable]:
    """Fill for a time, then lose a tenth a second of what is over; the part occurs twice."""
    model = Model("tank")
    time = model.variable("time", "t", unit="s", upper=10.0)
    model.maximise(time)
    for number in (1, 2):
        part = filling().of(time, ROOM)
        model.subject_to(f"kept {number}", part - 0.1 * (time - part) >= 2.6)
    return model, time


def test_numbers_and_arrays() -> None:
    model, time = tank()
    left = model.constraints[0].relation.left
    assert evaluate(left, {"time": 2.0}) == pytest.approx(2.0)
    assert evaluate(left, {"time": np.array([2.0, 7.0])}) == pytest.approx([2.0, 2.6])
    assert evaluate(left, {"time": 7.0, "room": 5.0}) == pytest.approx(4.8)
    assert speaks_of_parts(left)
    assert not speaks_of_parts(time, 1.0)


def test_lifted_parts_are_unknowns_with_their_limits() -> None:
    """Equal parts become one unknown; at the share that is true nothing changes."""
    model, _ = tank()
    smooth = lifted(model)
    assert [each.name for each in smooth.model.variables] == ["time", "fill_share"]
    labels = [each.label for each in smooth.model.constraints]
    assert labels == ["kept 1", "kept 2", "not over", "no less"]
    assert smooth.silent == {"fill", "not over", "no less"}
    for time_s, share in ((2.0, 1.0), (7.0, 3.0 / 7.0), (0.0, 1.0)):
        found = smooth.shares({"time": time_s})
        assert found == {"fill_share": pytest.approx(share)}
        for stated, rewritten in zip(model.constraints, smooth.model.constraints, strict=False):
            at = {"time": time_s, **found}
            assert evaluate(rewritten.relation.left, at) == pytest.approx(
                evaluate(stated.relation.left, at)
            )


def test_uncapped_takes_the_whole_time() -> None:
    """What is left after the part is nothing then, and the rest is as it was."""
    model, _ = tank()
    whole = uncapped(model)
    assert not speaks_of_parts(*whole.expressions)
    assert evaluate(whole.constraints[0].relation.left, {"time": 7.0}) == pytest.approx(7.0)
    assert whole.constraints[0].label == "kept 1"
    assert uncapped(whole) is whole
    assert lifted(whole).model is whole


def test_two_parts_of_one_name_are_refused() -> None:
    """Otherwise two unknowns of a solver would share one value."""
    model, time = tank()
    model.subject_to("other", filling().of(time, 2.0 * ROOM) >= 0.0)
    with pytest.raises(ValueError, match="one name"):
        lifted(model)


def test_printed_in_words() -> None:
    model, _ = tank()
    assert "s = until it is full" in text(model)
    assert isinstance(filling().of(1.0, ROOM), Let)

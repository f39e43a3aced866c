"""The answers of version 0.1.0, which a redrawing of the house must not change."""

from __future__ import annotations

import json
import zlib
from typing import Any

import pytest

from tests.frozen.cases import ANSWERS, answer, cases, name

FROZEN = json.loads(ANSWERS.read_text(encoding="utf-8"))
WITHIN_S = {"closed-form": 1e-9, "grid": 1e-9, "casadi": 1e-4}
"""Times agree to this [s]; by the other engines, and by the default one, to 1e-6 s."""
SEVERAL_STOPS_S = 1e-4
QUICK = (("P4", "available"), ("P3", "wells"))
"""Problems and perspectives that are solved by CasADi in the quick run, on `paper`."""


def tolerance_s(case: dict[str, Any]) -> float:
    """Within what the times of a case agree [s]."""
    if "stops" in case:
        return SEVERAL_STOPS_S
    return WITHIN_S.get(case.get("engine", ""), 1e-6)


def drawn(case: dict[str, Any]) -> bool:
    """Whether a case is one of the third of the other missions that is asked in every run."""
    return case["mission"] == "paper" or zlib.crc32(name(case).encode()) % 3 == 0


def parameters() -> list[Any]:
    """All cases; many of CasADi, cvxpy, the grid and missions other than `paper` are soak."""
    found = []
    for each in FROZEN:
        case = each["case"]
        quick = case["mission"] == "paper" and (case["problem"], case["perspective"]) in QUICK
        engine = case.get("engine")
        slow = engine == "casadi" and not quick
        slow |= engine in ("cvxpy", "grid") and case["perspective"] != "battery"
        slow |= not drawn(case)
        marks = [pytest.mark.soak] if slow else []
        found.append(pytest.param(case, each["answer"], id=name(case), marks=marks))
    return found


def test_every_case_is_frozen() -> None:
    """No case is lost from the file, and none is new."""
    assert [each["case"] for each in FROZEN] == list(cases())


@pytest.mark.parametrize(("case", "frozen"), parameters())
def test_the_answer_is_that_of_0_1_0(case: dict[str, Any], frozen: dict[str, Any]) -> None:
    """Status, times, route, charge left and the verdict of the simulation are as they were."""
    found = answer(case)
    assert found.keys() == frozen.keys()
    for key in {"refused", "status", "route", "flyable"} & frozen.keys():
        assert found[key] == frozen[key], key
    within_s = tolerance_s(case)
    for key in {"hover_time_s", "rest_time_s", "flight_time_s"} & frozen.keys():
        assert found[key] == pytest.approx(frozen[key], rel=0.0, abs=within_s), key
    if "soc" in frozen:
        assert found["soc"] == pytest.approx(frozen["soc"], rel=0.0, abs=1e-6)
        both = found["runs_dry_s"], frozen["runs_dry_s"]
        assert [each is None for each in both] in ([True, True], [False, False])
        if None not in both:
            assert both[0] == pytest.approx(both[1], rel=0.0, abs=max(1e-3, 100.0 * within_s))

"""Least squares, values and intervals as text, warnings, and fragments of TOML."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from optuav.arrays import Floats
from optuav.calibration import Fit, Value
from optuav.calibration.fit import ConfidenceInterval, Estimate, estimate
from optuav.mission import load


@pytest.mark.parametrize(
    ("value", "low", "high", "words"),
    [
        (37726.86, 37405.1, 38051.2, ["37726.9", "37405.1 – 38051.2"]),
        (20000.476, 20000.4, 20000.552, ["20000.476", "20000.4 – 20000.552"]),
        (662.419, 656.6, 668.3, ["662.419", "656.6 – 668.3"]),
        (2.7985e-4, 2.759e-4, 2.838e-4, ["0.00027985", "0.0002759 – 0.0002838"]),
        (3.817e-6, 3.8e-6, 3.835e-6, ["3.817e-06", "3.8e-06 – 3.835e-06"]),
        (4.400105e8, 4.400088e8, 4.400122e8, ["4.400105e+08", "4.400088e+08 – 4.400122e+08"]),
        (20.0, 20.0, 20.0, ["20", "20 – 20"]),
        (0.0, 0.0, 0.0, ["0", "0 – 0"]),
    ],
)
def test_value_and_ends_have_digits_enough(
    value: float, low: float, high: float, words: list[str]
) -> None:
    assert Value("a.b", value, "", ConfidenceInterval(low, high)).value_and_interval(" – ") == words


@given(st.floats(1e-9, 1e8), st.floats(1e-6, 0.9), st.floats(1e-6, 9.0))
def test_the_ends_always_differ_from_the_value(value: float, below: float, above: float) -> None:
    interval = ConfidenceInterval(value * (1.0 - below), value * (1.0 + above))
    text, span = Value("a.b", value, "", interval).value_and_interval(" ")
    low, high = span.split()
    assert float(low) < float(text) < float(high)
    assert ("e" in text) <= (not 1e-4 <= value < 1e6 * (1.0 - 1e-6))


def test_a_fragment_is_toml_whatever_its_words() -> None:
    """Settings of every type, quotes in the name of a mission, a line break in that of a file."""
    settings = {"flight.model": "regimes", "route.hover_m": [1, 2.5, 3], "laser.tracked": True}
    fit = Fit("table", ("a\nb = 3.csv",), "few", (), (), settings=settings)
    document = tomllib.loads(fit.to_toml('C:\\a "b".toml'))
    assert document["extends"].endswith('a "b".toml')
    assert document["route"]["hover_m"] == [1, 2.5, 3]
    assert document["laser"]["tracked"] is True
    assert "b" not in document


# Least squares over transformed parameters


def test_a_long_record_needs_no_square_of_its_length() -> None:
    """A mean of 100 000 samples; its standard error is s over the root of their number."""
    samples = np.random.default_rng(1).normal(5.0, 0.1, 100_000)
    found = estimate(["mean"], lambda x: x - samples, [(1.0,)])
    assert found.intervals is not None
    (interval,) = found.intervals
    reach = 1.959964 * np.std(samples, ddof=1) / math.sqrt(len(samples))
    assert found.values[0] == pytest.approx(np.mean(samples), rel=1e-9)
    assert (interval.high - interval.low) / 2.0 == pytest.approx(reach, rel=1e-4)


def test_what_is_not_seen_takes_no_freedom() -> None:
    """Of a product only one parameter counts: three numbers leave two to tell their scatter."""
    observed = np.log([2.0, 3.0, 6.0])

    def residuals(values: Floats) -> Floats:
        return np.log(values[0] * values[1]) - observed

    found = estimate(["a", "b"], residuals, [(1.0, 1.0)])
    assert found.undetermined == ("a", "b")
    assert found.spread == pytest.approx(np.std(observed, ddof=1), rel=1e-9)


def test_parameters_that_are_eliminated_take_their_freedom() -> None:
    """The slope through ten points, their level taken out before: eight are left, not nine."""
    random = np.random.default_rng(2)
    place = np.arange(10.0) - 4.5
    observed = 3.0 + 0.5 * place + random.normal(0.0, 0.1, 10)
    level = np.mean(observed)

    found = estimate(
        ["slope"],
        lambda values: level + values[0] * place - observed,
        [(1.0,)],
        eliminated=1,
    )
    slope = place @ observed / (place @ place)
    left = observed - level - slope * place
    assert found.spread == pytest.approx(math.sqrt(left @ left / 8.0), rel=1e-6)


def test_of_equally_good_optima_none_is_stated() -> None:
    """(x − 1)(x − 3) = 0 from either side; rounding alone would choose."""

    def residuals(values: Floats) -> Floats:
        return (values - 1.0) * (values - 3.0)

    starts = [(0.9,), (3.2,)]
    both = estimate(["x"], residuals, starts, spread=1e-3)
    assert both.undetermined == ("x",)
    assert both.values == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("undetermined", "always", "written"),
    [((), False, 2), (("a.y",), False, 2), (("a.x", "a.y"), False, 0), (("a.x", "a.y"), True, 2)],
)
def test_values_of_one_fit_are_stated_together_or_not_at_all(
    undetermined: tuple[str, ...], always: bool, written: int
) -> None:
    """One of two beside the other value of a base follows no data."""
    estimated = Estimate(
        ("a.x", "a.y"), np.array([1.5, 2.5]), np.zeros(3), 1.0, (None, None), undetermined
    )
    fit = Fit("kibam", (), "few", estimated.values_for_mission("fitted", always=always), ())
    assert len(fit.changes) == written
    table = tomllib.loads(fit.to_toml()).get("a", {})
    assert table == ({"x": 1.5, "y": 2.5} if written else {})
    told = "it is valid only together with the other fitted values"
    assert fit.to_toml().count(told) == (len(undetermined) if written else 0)


def test_no_word_of_a_fragment_ends_its_comment(tmp_path: Path) -> None:
    """Names of files, cells and warnings may hold line breaks and other control characters."""
    hostile = "a\nschema = 2\r\x0b\x85\u2028.csv"
    value = Value("battery.capacity_As", 5.0, hostile)
    unsure = Value("battery.charge_current_A", 5.0, hostile, determined=False, stated=False)
    fit = Fit("kibam", (hostile,), hostile, (value, unsure), (), (hostile,))
    base = tmp_path / 'we"ird \\name.toml'
    base.write_text("schema = 1\nextends = 'paper'\n")
    file = tmp_path / "fragment.toml"
    file.write_text(fit.to_toml(str(base), file))
    assert load(file).battery.capacity_As == 5.0

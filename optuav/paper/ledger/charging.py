"""Fig. 10: harvested energy and efficiency against the distance from the source."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav.paper.curves.charging import Harvest, harvest
from optuav.paper.curves.settings import HOVER_S
from optuav.paper.ledger.scenario import Scenario, papers
from optuav.paper.ledger.statement import Statement, Value, setting

PLACE = "text on Fig. 10"
NEAR_M = np.linspace(0.0, 1000.0, 101)
FAR_M = np.linspace(0.0, 5000.0, 101)
SOURCES_W = (500.0, 1000.0)


def statements() -> Iterator[Statement]:
    """The hover time, an efficiency, and two trends."""
    yield setting("fig10-hover", PLACE, "hover time", HOVER_S)
    yield Statement(
        name="fig10-falls",
        place=PLACE,
        what="how harvested energy and efficiency change with the distance",
        stated="both fall",
        how="every 50 m up to 5 km, for sources of 500 and 1000 W",
        compute=_trend_with_distance,
    )
    yield Statement(
        name="fig10-efficiency",
        place=PLACE,
        what="efficiency ζ = P_0/P_s below 1 km, around",
        stated="17.5",
        unit="%",
        how="least and largest ζ from 0 to 1 km for sources of 500 and 1000 W",
        compute=lambda s: _span(*(_percent(each) for each in _near(s))),
        undecided="the source powers of the figure are not printed in the text",
        reason=_why_around,
    )
    yield Statement(
        name="fig10-power",
        place=PLACE,
        what="how harvested energy changes with the source power",
        stated="rises",
        how="1000 W against 500 W at every distance up to 1 km",
        compute=_trend_with_power,
    )


def _near(scenario: Scenario) -> list[Harvest]:
    return [harvest(scenario.mission, power_W, NEAR_M, HOVER_S) for power_W in SOURCES_W]


def _percent(found: Harvest) -> tuple[float, float]:
    return 100.0 * float(np.min(found.efficiency)), 100.0 * float(np.max(found.efficiency))


def _span(*pairs: tuple[float, float]) -> str:
    return f"{min(low for low, _ in pairs):.1f} to {max(high for _, high in pairs):.1f}"


def _why_around() -> str:
    means = [100.0 * float(np.mean(each.efficiency)) for each in _near(papers()[0])]
    watts = " and ".join(f"{power_W:g}" for power_W in SOURCES_W)
    return (
        f"for sources of {watts} W it is {min(means):.2f} and {max(means):.2f} % on average "
        "below 1 km"
    )


def _trend_with_distance(scenario: Scenario) -> Value:
    curves = [harvest(scenario.mission, power_W, FAR_M, HOVER_S) for power_W in SOURCES_W]
    falls = all(
        np.all(np.diff(values) < 0.0)
        for curve in curves
        for values in (curve.energy_J, curve.efficiency)
    )
    return "both fall" if falls else "do not always fall"


def _trend_with_power(scenario: Scenario) -> Value:
    less, more = _near(scenario)
    return "rises" if np.all(more.energy_J > less.energy_J) else "does not always rise"

"""Sizes of a fleet for a share of the time: drones, beams, pads, bays and packs, by technology."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from optuav.errors import Fault, InputError, NoPlanError, collected, printable, refuse
from optuav.fields import Number
from optuav.mission import Mission, load
from optuav.mission.files import read_toml
from optuav.mission.messages import misfits, of_kind, path_of, unknown
from optuav.plan.summary import tabulated
from optuav.service.checks import calm_line, in_calm_air
from optuav.service.cycle import DURATION, Coverage, coverage
from optuav.service.fleet import OVERLAP, SHARE, covering, upwards
from optuav.studies.results import Pictures, Results, ResultsWithFacts

PRICED = ("drone", "laser", "pad", "charger", "battery_set", "tether")
"""Names of prices: a drone without its packs, a beam, a pad by cable, a charger for packs outside
a drone, the packs of one drone, and a tethered drone in place of all of them."""
PRICE = Number("-", ge=0.0, le=1e12)
COUNTS = ("drones", "beams", "pads", "bays", "chargers", "battery_sets")
PRICE_OF = {
    **{"drones": "drone", "beams": "laser", "pads": "pad", "chargers": "charger"},
    "battery_sets": "battery_set",
}
SCARCE = (*COUNTS, "share")  # In this order least, among rings
UNITS = {"technology": "", **dict.fromkeys((*COUNTS, "cost", "share"), "-"), "why": ""}
SHARES = 100  # Shares in a picture


def size_fleet(
    mission: Mission | str | Path,
    prices: Mapping[str, float] | str | Path | None = None,
    share: float = 1.0,
    overlap_s: float = 0.0,
    swap_s: float = 120.0,
) -> ResultsWithFacts:
    """Find the least counts that cover at least a share of the time, for each way to charge.

    Drones rest under lasers that also serve the hover (``"laser, lit hover"``) or do not (``"laser,
    dark hover"``), on pads by cable at ``battery.charge_current_A`` times the nominal voltage
    (``"pad"``), or have their packs exchanged (``"swap"``). A tether is only its price.

    Parameters
    ----------
    mission
        A mission, or its name or path.
    prices
        A price for each of ``drone`` (without packs), ``laser`` (a beam), ``pad``, ``charger``,
        ``battery_set`` (the packs of one drone) and ``tether``, in any currency, 0 to 1e12, not all
        0; or the path of a TOML file with these keys. None: counts alone.
    share
        Mean number of drones that hover [-], > 0 and up to 1000.
    overlap_s
        For how long a hover goes on after the next one began [s], at most half of the hover.
    swap_s
        Duration of an exchange of the packs [s], > 0 and up to 1e7.

    Returns
    -------
    ResultsWithFacts
        One row per technology with its counts, its cost and the ``share`` of its ring, which may
        start faster than asked for to need fewer places; ``why`` says why there is none. `plot`
        draws cost, or drones, over the share.

    Raises
    ------
    InputError
        If an argument or a price is out of range, a price is missing or unknown, or no technology
        can serve the mission.

    Examples
    --------
    >>> import optuav
    >>> table = optuav.size_fleet("matrice350")
    >>> [(row["technology"], row["drones"]) for row in table.rows[:4]]
    [('laser, lit hover', 4), ('laser, dark hover', 6), ('pad', 4), ('swap', 2)]
    """
    faults = [*misfits(("share", share, SHARE), ("overlap_s", overlap_s, OVERLAP))]
    faults += misfits(("swap_s", swap_s, DURATION))
    stated: Mapping[str, Any] | None = None
    with collected(faults):
        stated = None if prices is None else _prices(prices)
    with collected(faults):
        loaded = load(mission)
    refuse(faults)
    service = _Service(share, overlap_s, stated)
    cycles = dict(_cycles(loaded, swap_s))
    rows = [service.row(name, cycle) for name, cycle in cycles.items()]
    if all(row["why"] for row in rows):
        words = ["no way to charge serves this mission:", *_reasons(rows)]
        raise InputError(Fault("", "", line) for line in words)
    if stated is not None:
        tether = {"technology": "tether", "why": "", "cost": service.tether_cost(share)}
        rows.append(dict.fromkeys(UNITS) | tether)
    calm = in_calm_air(loaded, lambda mission: _drones(mission, share, overlap_s, swap_s))
    facts: dict[str, Any] = {"share": share, "overlap_s": overlap_s, "swap_s": swap_s}
    facts |= {"prices": stated, "in_calm_air": calm}

    def draw(_: Results) -> Pictures:
        return _draw(loaded, cycles, service)

    return ResultsWithFacts("optuav fleet sizes", loaded, facts, UNITS, tuple(rows), _show, draw)


def _drones(mission: Mission, share: float, overlap_s: float, swap_s: float) -> str:
    """The drones of each technology, in words."""
    rows = size_fleet(mission, None, share, overlap_s, swap_s).rows
    return ", ".join(f"{row['drones'] or 'no'} drones ({row['technology']})" for row in rows)


def _cycles(mission: Mission, swap_s: float) -> Iterator[tuple[str, Coverage | str]]:
    """Yield the cycle of each technology, or why there is none."""
    battery = mission.battery
    ways: dict[str, dict[str, Any]] = {"laser, lit hover": {}}
    ways["laser, dark hover"] = {"lit_hover": False}
    ways["pad"] = {"pad_power_W": battery.charge_current_A * battery.nominal_voltage_V}
    ways["swap"] = {"swap_s": swap_s}
    for name, options in ways.items():
        try:
            yield name, coverage(mission, **options)
        except (InputError, NoPlanError) as error:
            yield name, str(error)


def _prices(prices: Mapping[str, float] | str | Path) -> Mapping[str, Any]:
    """The prices that a mapping or a file states, or a refusal with all faults."""
    words = "prices by name, or the path of a TOML file with them"
    of_kind("prices", prices, Mapping | str | Path, words)
    stated = prices if isinstance(prices, Mapping) else read_toml(path_of(prices))
    faults = [unknown("prices", name, PRICED) for name in stated if name not in PRICED]
    known, missing = ([n for n in PRICED if (n in stated) is there] for there in (True, False))
    faults += misfits(*((f"prices.{name}", stated[name], PRICE) for name in known))
    if missing:
        faults.append(Fault("prices", "", f"needs also {', '.join(missing)}: each {PRICE.words}"))
    refuse(faults)
    if not any(stated.values()):
        words = f"at least one above 0, each {PRICE.words}; leave prices out to see counts alone"
        raise InputError([Fault("prices", "all 0", words)])
    return stated


class _Service(NamedTuple):
    """A share of the time that a fleet covers, the overlap of hovers [s], and prices, if any."""

    share: float
    overlap_s: float
    prices: Mapping[str, Any] | None

    def row(self, technology: str, cycle: Coverage | str) -> dict[str, Any]:
        """The counts of a technology and its cost, or why there are none."""
        row: dict[str, Any] = dict.fromkeys(UNITS) | {"technology": technology, "why": ""}
        if isinstance(cycle, str):
            return row | {"why": cycle}
        try:
            asked = self.counts(cycle, self.share)
        except (InputError, NoPlanError) as error:
            return row | {"why": str(error)}
        # As many drones may start faster: without waiting, or as often as one beam more allows.
        counted_s = cycle.hover_s - self.overlap_s
        fastest = max(self.share, asked["drones"] * counted_s / cycle.period_s)
        part = counted_s / cycle.hover_s  # Of the hovers, which counts
        shares = {min(fastest, upwards(self.share / part) * part), fastest} - {self.share}
        rings = [self.counts(cycle, share) for share in shares if SHARE.accepts(share)]
        row |= min([asked, *rings], key=lambda ring: [ring[count] for count in SCARCE])
        if self.prices is not None:
            row["cost"] = sum(row[count] * self.prices[price] for count, price in PRICE_OF.items())
        return row

    def counts(self, cycle: Coverage, share: float) -> dict[str, Any]:
        """The counts of the ring that covers exactly a share."""
        fleet = cycle.fleet(share, self.overlap_s)
        places, chargers = {cycle.charged_by: fleet.places}, 0
        if cycle.charged_by == "exchange":  # ⌈c·D/I_ch/(h − o)⌉, D the charge of a visit
            battery = cycle.mission.battery
            visit_As = (cycle.soc_at_departure - cycle.soc_at_landing) * battery.packs
            visit_As *= battery.capacity_As
            chargers = upwards(visit_As / battery.charge_current_A / fleet.starts_every_s)
        row = {"share": share, "drones": fleet.drones, "beams": fleet.beams, "chargers": chargers}
        row |= {"pads": places.get("pad", 0), "bays": places.get("exchange", 0)}
        return row | {"battery_sets": fleet.drones + chargers}

    def tether_cost(self, share: float) -> float:
        """Cost of a tethered drone for each device."""
        assert self.prices is not None
        return float(self.prices["tether"] * math.ceil(share))


def _show(table: Results) -> Iterator[str]:
    facts = table.facts
    words = covering(facts["share"], facts["overlap_s"])
    yield f"Fleets {words}: {printable(table.mission.name)}"
    yield from calm_line(facts)
    yield ""
    names = [*COUNTS, *(["cost"] if facts["prices"] is not None else [])]
    lines = [["technology", *(name.replace("_", " ") for name in names)]]
    for row in table.rows:
        cells = ("-" if row[name] is None else f"{row[name]:.8g}" for name in names)
        lines.append([row["technology"], *cells])
    yield from tabulated(lines)
    if reasons := _reasons(table.rows):
        yield ""
        yield from reasons


def _reasons(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return why technologies have no counts, each reason once with their names."""
    reasons = dict[str, list[str]]()
    for row in rows:
        if row["why"]:
            reasons.setdefault(row["why"], []).append(row["technology"])
    return [f"{'; '.join(names)}: {words}" for words, names in reasons.items()]


def _draw(mission: Mission, cycles: Mapping[str, Coverage | str], service: _Service) -> Pictures:
    """Cost, or the number of drones without prices, over the share."""
    from optuav.plots import Line, curves

    def steps(name: str, values: Mapping[float, float]) -> Line:
        """A line that holds the value of each share from the one before."""
        x, y = np.repeat([0.0, *values], 2)[1:-1], np.repeat([*values.values()], 2)
        return Line(name, x, y)

    shares = np.linspace(0.0, max(service.share, 1.0), SHARES + 1)[1:].tolist()
    priced, lines = service.prices is not None, list[Line]()
    overlap = f", {service.overlap_s:g} s of overlap" * (service.overlap_s > 0.0)
    for name, cycle in cycles.items():
        rows = {part: service._replace(share=part).row(name, cycle) for part in shares}
        y = {x: row["cost" if priced else "drones"] for x, row in rows.items() if not row["why"]}
        if y:
            lines.append(steps(name, y))
    if priced:
        lines.append(steps("tether", {part: service.tether_cost(part) for part in shares}))
    title = f"Fleets by what they cover{overlap}: {printable(mission.name)}"
    y_label = "cost [currency of the prices]" if priced else "drones"
    x_label = "mean number of drones that hover"
    ax = curves(lines, title=title, x_label=x_label, y_label=y_label, y_from_zero=True)
    yield "sizes.png", ax

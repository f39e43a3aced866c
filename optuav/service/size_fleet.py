"""Sizes of a fleet for a share of the time: drones, beams, pads, bays and packs, by technology."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypedDict

import numpy as np

from optuav.errors import Fault, InputError, NoPlanError, collected, printable, refuse
from optuav.fields import Range
from optuav.judge.fleets import busiest
from optuav.mission import Mission
from optuav.mission.files import label, read_toml
from optuav.mission.load import load_one_device
from optuav.mission.messages import misfits, of_kind, path_of, shown, unknown
from optuav.network import vehicle
from optuav.plan.data import JUDGE_TOLERANCE
from optuav.presentation.blocks import Block, Facts, Heading, Note, Table
from optuav.presentation.numbers import figure
from optuav.service.calm_air import calm_facts, in_calm_air
from optuav.service.cycle import DURATION, Coverage, coverage, step_of
from optuav.service.event import HOURS
from optuav.service.event_roster import step_in_words
from optuav.service.fleet import SHARE, covering, faults_of_fleet, upwards
from optuav.studies.results import Pictures, Result

PRICED = ("drone", "laser", "pad", "charger", "battery_set", "tether")
"""Names of prices: a drone without its packs, a beam, a pad by cable, a charger for packs outside
a drone, the packs of one drone, and a tethered drone in place of all of them."""
PRICE = Range("-", ge=0.0, le=1e12)
WORDS = (
    "lit hover: the laser also charges the hovering drone; dark hover: only resting drones. pad: a "
    "drone rests on a pad with a cable. swap: packs are exchanged in a bay, and recharged "
    "separately."
)
COUNTS = ("drones", "beams", "pads", "bays", "chargers", "battery_sets")
TECHNOLOGY_UNITS = {"technology": "", **dict.fromkeys((*COUNTS, "cost", "share"), "-"), "why": ""}
SHARES = 100  # Shares in a picture


class Ring(NamedTuple):
    """What a ring of drones consists of, in the order in which it is scarce."""

    drones: int
    beams: int
    pads: int
    bays: int
    chargers: int
    battery_sets: int
    share: float  # Of the time, that it covers

    def cost(self, prices: Mapping[str, float]) -> float:
        """Its price."""
        return (
            self.drones * prices["drone"]
            + self.beams * prices["laser"]
            + self.pads * prices["pad"]
            + self.chargers * prices["charger"]
            + self.battery_sets * prices["battery_set"]
        )


class TechnologySize(TypedDict):
    """A row of sizes: the counts of a way to charge, None without a ring, and why there is none."""

    technology: str
    drones: int | None
    beams: int | None
    pads: int | None
    bays: int | None
    chargers: int | None
    battery_sets: int | None
    cost: float | None
    share: float | None
    why: str


@dataclass(frozen=True, kw_only=True, repr=False)
class FleetSizes(Result):
    """The least counts that cover a share of the time, one row per way to charge.

    Parameters
    ----------
    share, overlap_s, swap_s, hours, separation_m
        As asked: mean number of drones that hover, overlap of hovers and an exchange of packs [s],
        and of an event its length [h] and the step to the next hover point (x, y, z) [m], or None.
    prices
        As asked, by name, or None.
    in_calm_air
        If the hover depends on the wind, the drones in calm air, in words; else None.

    Examples
    --------
    >>> import optuav
    >>> sizes = optuav.size_fleet("matrice350", share=0.5)
    >>> sizes.share, sizes.rows[0]["drones"]
    (0.5, 2)
    """

    kind = "optuav fleet sizes"
    units = TECHNOLOGY_UNITS
    rows: tuple[TechnologySize, ...]
    share: float
    overlap_s: float
    swap_s: float
    prices: Mapping[str, float] | None
    hours: float | None
    separation_m: tuple[float, ...] | None
    in_calm_air: str | None
    cycles: Mapping[str, Coverage | str] = field(repr=False)
    """The cycle of each technology, or why there is none."""

    def blocks(self) -> Iterator[Block]:
        """Yield the counts by technology, and why some have none."""
        words = covering(self.share, self.overlap_s)
        if self.hours is not None:
            overlap = f", {figure(self.overlap_s)} s of overlap" * (self.overlap_s > 0.0)
            words = f"for an event of {figure(self.hours)} h{overlap}"
            if self.separation_m:
                words += f", next drone {step_in_words(self.separation_m)}"
        yield Heading(f"Fleets {words}: {printable(self.mission.name)}")
        if calm := [*calm_facts(self.in_calm_air)]:
            yield Facts(calm)
        rows = list[list[str]]()
        for row in self.rows:
            counts = row["drones"], row["beams"], row["pads"], row["bays"], row["chargers"]
            figures: list[float | None] = [*counts, row["battery_sets"]]
            figures += [row["cost"]] if self.prices is not None else []
            rows.append([row["technology"], *("–" if n is None else figure(n, 8) for n in figures)])
        names = [*COUNTS, *(["cost"] if self.prices is not None else [])]
        heads = ["technology", *(name.replace("_", " ") for name in names)]
        yield Table(heads, rows, below=[WORDS])
        if reasons := _reasons(self.rows):
            yield Note(reasons)

    def pictures(self) -> Pictures:
        """Yield the cost, or the number of drones without prices, over the share.

        For an event, yield it by technology.
        """
        from optuav.plots import Bar, Line, bars, curves
        from optuav.plots.style import titled

        what: Literal["drones", "cost"] = "drones" if self.prices is None else "cost"
        unit = "drones" if self.prices is None else "cost [currency of the prices]"
        if self.hours is not None:
            values: list[tuple[str, Any]] = [(row["technology"], row[what]) for row in self.rows]
            title = titled(
                self.mission.name, f"{what} of fleets for an event of {figure(self.hours)} h"
            )
            shown = [Bar(name.replace(", ", ",\n"), "", value) for name, value in values]
            yield "sizes.png", bars(shown, title=title, y_label=unit)
            return

        def steps(name: str, values: Mapping[float, float]) -> Line:
            """A line that holds the value of each share from the one before."""
            x, y = np.repeat([0.0, *values], 2)[1:-1], np.repeat([*values.values()], 2)
            return Line(name, x, y)

        shares = np.linspace(0.0, max(self.share, 1.0), SHARES + 1)[1:].tolist()
        lines = list[Line]()
        overlap = f", {figure(self.overlap_s)} s of overlap" * (self.overlap_s > 0.0)
        for name, cycle in self.cycles.items():
            rows = {part: _row(name, cycle, part, self.overlap_s, self.prices) for part in shares}
            known: dict[float, Any] = {x: row[what] for x, row in rows.items()}
            if y := {x: value for x, value in known.items() if value is not None}:
                lines.append(steps(name, y))
        if self.prices is not None:
            price = self.prices["tether"]
            lines.append(steps("tether", {part: _tethers(part, price) for part in shares}))
        ax = curves(
            lines,
            title=titled(self.mission.name, f"{what} of fleets by what they cover{overlap}"),
            x_label="mean number of drones that hover",
            y_label=unit,
            y_from_zero=True,
        )
        yield "sizes.png", ax


def size_fleet(
    mission: Mission | str | Path,
    prices: Mapping[str, float] | str | Path | None = None,
    share: float = 1.0,
    overlap_s: float = 0.0,
    swap_s: float = 120.0,
    hours: float | None = None,
    separation_m: float | Sequence[float] | None = None,
) -> FleetSizes:
    """Count the drones and equipment that cover a share of the time, for each way to charge.

    With `hours`, count those that an event without a gap needs if it begins with full batteries.

    Drones rest under lasers that also serve the hover (``"laser, lit hover"``) or do not (``"laser,
    dark hover"``), on pads by cable at ``battery.charge_current_A`` times the nominal voltage
    (``"pad"``), or have their packs exchanged (``"swap"``). A tether counts only by its price.

    Parameters
    ----------
    mission
        A mission, or its name or path.
    prices
        A price for each of ``drone`` (without packs), ``laser`` (a beam), ``pad``, ``charger``,
        ``battery_set`` (the packs of one drone) and ``tether``, in any currency, 0 to 1e12, not all
        0; or the path of a TOML file with these keys; None for only the counts.
    share
        Mean number of drones that hover [-], > 0 and up to 1000.
    overlap_s
        Time that two drones hover together at a handover [s], at most half of the hover.
    swap_s
        Duration of an exchange of the packs [s], > 0 and up to 1e7.
    hours
        Duration of an event [h], > 0 and up to 240, see `Coverage.event`: then every drone has its
        own beam or pad, and `share` must be 1. An exchange needs a battery set for every hover, or
        fewer sets and some chargers if that costs less.
    separation_m
        For `hours`: distance between the hover points of drones that take turns [m], see
        `Coverage.event`.

    Returns
    -------
    FleetSizes
        One row per technology with its counts, its cost and the ``share`` of its ring, which may
        exceed the requested share if that needs fewer places; ``why`` says why a technology has no
        fleet. `plot` draws cost, or drones, against the share, or for an event by technology.

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
    faults = [*faults_of_fleet(share, overlap_s), *misfits(("swap_s", swap_s, DURATION))]
    if hours is not None:
        faults += misfits(("hours", hours, HOURS))
        if share != 1.0:
            faults.append(Fault("share", shown(share), "must be left out for an event"))
    step_m: tuple[float, ...] | None = None
    if separation_m is not None:
        if hours is None:
            faults.append(
                Fault("separation_m", shown(separation_m), "is for an event: set hours too")
            )
        with collected(faults):
            step_m = step_of(separation_m)
    tariff: Mapping[str, float] | None = None
    with collected(faults):
        tariff = None if prices is None else _prices(prices)
    with collected(faults):
        loaded = load_one_device(mission, "the size of a fleet")
    refuse(faults)
    cycles = dict(_cycles(loaded, swap_s))
    rows = [
        _row(name, cycle, share, overlap_s, tariff, hours, step_m) for name, cycle in cycles.items()
    ]
    if all(row["why"] for row in rows):
        words = ["no way to charge serves this mission:", *_reasons(rows)]
        raise InputError(Fault("", "", line) for line in words)
    if tariff is not None:
        rows.append(_sized("tether", None, cost=_tethers(share, tariff["tether"])))
    return FleetSizes(
        mission=loaded,
        rows=tuple(rows),
        share=share,
        overlap_s=overlap_s,
        swap_s=swap_s,
        prices=tariff,
        hours=hours,
        separation_m=step_m,
        in_calm_air=in_calm_air(
            loaded, lambda calm: _drones(calm, share, overlap_s, swap_s, hours, step_m)
        ),
        cycles=cycles,
    )


def _drones(
    mission: Mission,
    share: float,
    overlap_s: float,
    swap_s: float,
    hours: float | None,
    step_m: tuple[float, ...] | None,
) -> str:
    """The drones of each technology, in words."""
    rows = size_fleet(mission, None, share, overlap_s, swap_s, hours, step_m).rows
    return ", ".join(f"{row['drones'] or 'no'} drones ({row['technology']})" for row in rows)


def _cycles(mission: Mission, swap_s: float) -> Iterator[tuple[str, Coverage | str]]:
    """Yield the cycle of each technology, or why there is none."""
    ways: dict[str, dict[str, Any]] = {"laser, lit hover": {}}
    ways["laser, dark hover"] = {"lit_hover": False}
    ways["pad"] = {"pad_power_W": vehicle.charging_limit_W(mission)}
    ways["swap"] = {"swap_s": swap_s}
    for name, options in ways.items():
        try:
            yield name, coverage(mission, **options)
        except (InputError, NoPlanError) as error:
            yield name, str(error)


def _prices(prices: Mapping[str, float] | str | Path) -> Mapping[str, float]:
    """The prices that a mapping or a file states, or a refusal with all faults."""
    words = "prices by name, or the path of a TOML file with them"
    of_kind("prices", prices, Mapping | str | Path, words)
    source = "" if isinstance(prices, Mapping) else label(path_of(prices))
    tariff = prices if isinstance(prices, Mapping) else read_toml(path_of(prices))
    faults = [unknown("prices", name, PRICED) for name in tariff if name not in PRICED]
    present, missing = ([n for n in PRICED if (n in tariff) is there] for there in (True, False))
    faults += misfits(*((f"prices.{name}", tariff[name], PRICE) for name in present))
    if missing:
        faults.append(Fault("prices", "", f"needs also {', '.join(missing)}: each {PRICE.words}"))
    refuse(replace(fault, source=source) for fault in faults)
    if not any(tariff.values()):
        words = f"at least one above 0, each {PRICE.words}; leave prices out to see only the counts"
        raise InputError([Fault("prices", "all 0", words, source)])
    return tariff


def _row(
    technology: str,
    cycle: Coverage | str,
    share: float,
    overlap_s: float,
    prices: Mapping[str, float] | None,
    hours: float | None = None,
    step_m: tuple[float, ...] | None = None,
) -> TechnologySize:
    """The counts of a technology and its cost, or why there are none."""
    if isinstance(cycle, str):
        return _sized(technology, None, why=cycle)
    try:
        if hours is not None:
            rings = _rings_of_event(cycle, hours, overlap_s, step_m)
            best = min(rings, key=lambda ring: 0.0 if prices is None else ring.cost(prices))
            return _sized(technology, best, cost=None if prices is None else best.cost(prices))
        shared = _ring(cycle, share, overlap_s)
    except (InputError, NoPlanError) as error:
        return _sized(technology, None, why=str(error))
    # As many drones may start faster: without waiting, or as often as one beam more allows.
    counted_s = cycle.hover_s - overlap_s
    fastest = max(share, shared.drones * counted_s / cycle.period_s)
    part = counted_s / cycle.hover_s  # Of the hovers, which counts
    shares = {min(fastest, upwards(share / part) * part), fastest} - {share}
    rings = [_ring(cycle, faster, overlap_s) for faster in shares if SHARE.accepts(faster)]
    best = min([shared, *rings])
    return _sized(technology, best, cost=None if prices is None else best.cost(prices))


def _ring(cycle: Coverage, share: float, overlap_s: float) -> Ring:
    """The ring that covers exactly a share."""
    fleet, chargers = cycle.fleet(share, overlap_s), 0
    if cycle.charged_by == "exchange":  # ⌈c·D/I_ch/(h − o)⌉, D the charge of a visit
        battery = cycle.mission.battery
        visit_As = (cycle.soc_at_departure - cycle.soc_at_landing) * battery.packs
        visit_As *= battery.capacity_As
        chargers = upwards(visit_As / battery.charge_current_A / fleet.starts_every_s)
    return Ring(
        drones=fleet.drones,
        beams=fleet.beams,
        pads=fleet.places if cycle.charged_by == "pad" else 0,
        bays=fleet.places if cycle.charged_by == "exchange" else 0,
        chargers=chargers,
        battery_sets=fleet.drones + chargers,
        share=share,
    )


def _rings_of_event(
    cycle: Coverage, hours: float, overlap_s: float, step_m: tuple[float, ...] | None
) -> list[Ring]:
    """Return what an event consists of, with any number of chargers for exchanged packs."""
    event = cycle.event(hours, overlap_s=overlap_s, separation_m=step_m)
    swap_s, drones = event.ring.swap_s, event.drones
    if swap_s is None:
        lit = drones if cycle.charged_by == "laser" else 0
        pads = drones if cycle.charged_by == "pad" else 0
        return [Ring(drones, lit, pads, 0, 0, drones, 1.0)]
    landings = list[tuple[float, float]]()  # Of packs that are exchanged: when, and their charge
    last = {course.drone: number for number, course in enumerate(event.courses)}
    for number, course in enumerate(event.courses):
        if number != last[course.drone]:
            drawn_As = -sum(phase.charge_As for phase in course.plan.phases)
            landings.append((course.offset_s + course.plan.phases[-1].end_s, drawn_As))
    stays = [(landed_s, landed_s + swap_s) for landed_s, _ in landings]
    bays, _ = busiest(stays, JUDGE_TOLERANCE * 3600.0 * hours)
    charge_A = cycle.mission.battery.charge_current_A
    return [
        Ring(drones, 0, 0, bays, count, drones + _further_sets(landings, count, charge_A), 1.0)
        for count in range(len(landings) + 1)
    ]


def _further_sets(landings: Sequence[tuple[float, float]], chargers: int, charge_A: float) -> int:
    """Battery sets beside those in the drones: each exchange takes one that is charged by then.

    Packs are charged in the order in which they land.
    """
    free_s, ready_s, sets = [-math.inf] * chargers, list[float](), 0
    for landed_s, drawn_As in sorted(landings):
        charged = [at_s for at_s in ready_s if at_s <= landed_s]
        if charged:
            ready_s.remove(min(charged))
        else:
            sets += 1
        if chargers:
            first = free_s.index(min(free_s))
            free_s[first] = max(free_s[first], landed_s) + drawn_As / charge_A
            ready_s.append(free_s[first])
    return sets


def _sized(
    technology: str, ring: Ring | None, *, cost: float | None = None, why: str = ""
) -> TechnologySize:
    """A row with the counts of a ring, if there is one."""
    return TechnologySize(
        technology=technology,
        drones=ring and ring.drones,
        beams=ring and ring.beams,
        pads=ring and ring.pads,
        bays=ring and ring.bays,
        chargers=ring and ring.chargers,
        battery_sets=ring and ring.battery_sets,
        cost=cost,
        share=ring and ring.share,
        why=why,
    )


def _tethers(share: float, price: float) -> float:
    """Cost of a tethered drone for each device."""
    return float(price * math.ceil(share))


def _reasons(rows: Sequence[TechnologySize]) -> list[str]:
    """Return why technologies have no counts, each reason once with their names."""
    reasons = dict[str, list[str]]()
    for row in rows:
        if row["why"]:
            reasons.setdefault(row["why"], []).append(row["technology"])
    return [f"{'; '.join(names)}: {words}" for words, names in reasons.items()]

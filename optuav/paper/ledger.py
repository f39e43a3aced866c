"""The ledger: our values for the paper's statements, computed when it is called."""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from decimal import ROUND_DOWN, ROUND_HALF_EVEN, Decimal, InvalidOperation
from enum import StrEnum
from typing import Any, TypeAlias

import numpy as np

from formulations.p4 import P4
from formulations.soc import PAPER, PERSPECTIVES
from optuav.arrays import Floats
from optuav.errors import Fault, refuse, shown
from optuav.flight.rotors import Rotors
from optuav.frames import DataFrame, frame
from optuav.laser.fits import Fits
from optuav.mission import Mission
from optuav.mission.messages import nearest, plural, several
from optuav.network import vehicle
from optuav.network.network import build_network
from optuav.network.one_stop import one_stop_is_enough
from optuav.network.places import HOVER
from optuav.options import Perspective
from optuav.paper import curves, table2
from optuav.paper.curves import DATA, PAPERS, solve, with_deadline
from optuav.paper.table2 import Interval, last_digit, printed_interval
from optuav.physics import laser, rotor
from optuav.plan import Plan
from optuav.presentation.blocks import Block, Facts, Fold, Heading, Note, Table
from optuav.presentation.markup import yes_or_no
from optuav.presentation.numbers import fixed, minus
from optuav.presentation.presented import Presented
from optuav.presentation.text import as_text
from optuav.solving.assemble import quantities
from optuav.status import SAME_S
from optuav.studies.results import as_csv

Value: TypeAlias = float | str | None
SIGNIFICANT = 12  # Digits of our values that count; those after them are rounding of floats
HEAD = ("name", "place", "what", "stated", "unit")
"""Fields of a statement at the head of its record."""
NEAR_M, FAR_M = np.linspace(0.0, 1000.0, 101), np.linspace(0.0, 5000.0, 101)
SOURCES_W = (500.0, 1000.0)
"""Distances of Fig. 10, and sources for checking its trends."""
FIGURES: dict[str, Callable[[Plan], float]] = {
    "hover_time_s": lambda plan: plan.hover_time_s,
    "flight_energy_J": lambda plan: -sum(p.energy_J for p in plan.phases if p.kind == "flight"),
}
SAME_ANSWERS: tuple[Perspective, ...] = ("battery", "adjusted")
"""Perspectives that the paper finds the same."""


class Verdict(StrEnum):
    """Verdict on a number of the paper beside ours."""

    MATCHED = "matched"
    CUT = "matched when cut, not rounded"
    RECOVERED = "matched with recovered parameters"
    FITTED = "used in the fit"
    WITHIN = "differs, but within the rounding of the fitted numbers"
    CONTRADICTS = "contradicts the paper's own numbers"
    UNDECIDED = "cannot be decided"
    DIFFERS = "does not match"


UNMATCHED = (Verdict.WITHIN, Verdict.CONTRADICTS, Verdict.UNDECIDED, Verdict.DIFFERS)


@dataclass(frozen=True, kw_only=True)
class PaperStatement:
    """A number of the paper, or a finding in words, as the file of the statements describes it.

    `compute` and `room` name the functions, with arguments, of our value and of the values that the
    paper's other numbers allow, for only the `flight` model if it is stated.
    """

    name: str
    place: str
    what: str
    stated: str
    unit: str = ""
    how: str
    compute: Sequence[object] = ()
    room: Sequence[object] = ()
    flight: str = ""
    reason: str = ""
    undecided: str = ""
    command: str = ""
    limit: bool = False
    fitted: bool = False

    @property
    def is_number(self) -> bool:
        """Whether a number is stated, and not a finding in words, a formula or a range."""
        with suppress(InvalidOperation):
            return Decimal(self.stated).is_finite()
        return False


STATEMENTS = tuple(PaperStatement(**fields) for fields in table2.STATEMENTS)


@dataclass(frozen=True)
class Entry:
    """A statement with our value by the printed parameters, and by the recovered loads.

    The missions are ``paper`` and ``paper-table2``; a value is None where it does not apply. `room`
    is the range under the other numbers of the paper, if the statement asks for it.
    """

    statement: PaperStatement
    printed: Value
    recovered: Value
    room: Value | Interval = None

    @property
    def command(self) -> str:
        """The command that computes our values again."""
        return self.statement.command or f"optuav ledger {self.statement.name}"

    @property
    def verdict(self) -> Verdict:
        """The verdict at the digits that the paper prints."""
        paper = self.statement
        if agrees(paper.stated, self.printed):
            return Verdict.MATCHED
        if paper.limit and agrees(paper.stated, self.printed, ROUND_DOWN):
            return Verdict.CUT
        if agrees(paper.stated, self.recovered):
            return Verdict.FITTED if paper.fitted else Verdict.RECOVERED
        if paper.room:
            return Verdict.WITHIN if fits(paper.stated, self.room) else Verdict.CONTRADICTS
        return Verdict.UNDECIDED if paper.undecided else Verdict.DIFFERS

    @property
    def reason(self) -> str:
        """The reason for the verdict; may be empty."""
        undecided = self.statement.undecided if self.verdict is Verdict.UNDECIDED else ""
        return "; ".join(part for part in (undecided, self.statement.reason) if part)

    def figure(self, value: Value) -> str:
        """A value of ours with two digits more than the paper prints, or a dash."""
        if value is None or isinstance(value, str):
            return value or "–"
        last = last_digit(self.statement.stated)
        if abs(last) > 6:
            return f"{value:.6e}"
        text = f"{value:.{max(0, 2 - last)}f}"
        return f"{value:.0f}" if float(text) == round(value) else text


def agrees(stated: str, value: Value, rounding: str = ROUND_HALF_EVEN) -> bool:
    """Return whether our value, rounded to the printed digits, is the printed one."""
    if value is None or isinstance(value, str):
        return value == stated
    step = Decimal(1).scaleb(last_digit(stated))
    return Decimal(f"{value:.{SIGNIFICANT}g}").quantize(step, rounding=rounding) == Decimal(stated)


def fits(stated: str, room: Value | Interval) -> bool:
    """Return whether a printed value, rounding included, may be a given value or in an interval."""
    if room is None or isinstance(room, str):
        return room == stated
    least, most = room if isinstance(room, tuple) else (room, room)
    low, high = printed_interval(stated)
    return low <= most and least <= high


@dataclass(frozen=True)
class Ledger(Presented):
    """Entries of the ledger, in the paper's order.

    Printed, it is a summary; `details` has every entry in full.

    Parameters
    ----------
    entries
        One a statement of the paper, with its ``statement`` as printed, our values by the
        ``printed`` and by the ``recovered`` parameters, both in the unit of the statement, and the
        ``verdict``.

    Examples
    --------
    >>> import optuav
    >>> claims = optuav.ledger(["text-e1", "text-e2"])
    >>> [entry.verdict.value for entry in claims.entries]
    ['matched', "contradicts the paper's own numbers"]
    """

    entries: tuple[Entry, ...]

    @property
    def counts(self) -> Mapping[Verdict, int]:
        """Number of entries with each verdict, in the order of the verdicts."""
        counts = Counter(entry.verdict for entry in self.entries)
        return {verdict: counts[verdict] for verdict in Verdict if counts[verdict]}

    @property
    def table2(self) -> tuple[Entry, ...]:
        """The entries that are cells of Table II, row by row."""
        return tuple(entry for entry in self.entries if entry.statement.name.startswith("table2-"))

    @property
    def summary(self) -> str:
        """The counts, and a line for each statement that does not match."""
        return str(self)

    @property
    def details(self) -> str:
        """Every entry as a few lines."""
        return as_text(self.entry_blocks())

    def blocks(self) -> Iterator[Block]:
        """Yield the counts, and a row for each statement that does not match."""
        wrong = sum(count for verdict, count in self.counts.items() if verdict in UNMATCHED)
        words = sum(not entry.statement.is_number for entry in self.entries)
        head = f"{len(self.entries)} statements of the paper, {words} of them in words"
        yield Heading(head, good=not wrong)
        counts = [(str(count), verdict.value) for verdict, count in self.counts.items()]
        yield Table((), counts, words=0, last=1)
        for verdict in UNMATCHED:
            entries = [entry for entry in self.entries if entry.verdict is verdict]
            rows = [
                (
                    entry.statement.name,
                    minus(f"{entry.statement.stated} {entry.statement.unit}").rstrip(),
                    *(minus(entry.figure(value)) for value in (entry.printed, entry.recovered)),
                )
                for entry in entries
            ]
            above = f"{verdict.value[0].upper()}{verdict.value[1:]}:"
            heads = ("name", "paper", "by printed parameters", "by recovered")
            if rows:
                yield Table(heads, rows, longest=34, above=above)
        all_heads = ("name", "what", "stated", "unit", "by printed parameters", "verdict")
        all_rows = [[record[head] for head in all_heads] for record in self.records()]
        all_rows.sort(key=lambda row: row[-1] not in UNMATCHED)
        table = Table(all_heads, all_rows, bad=range(wrong))
        yield Fold("Statements", [table], is_open=True, in_text=False)
        yield Note([DATA["paper"]["missions"]])

    def entry_blocks(self) -> Iterator[Block]:
        """Yield every entry with its place, our values, its verdict and reason."""
        for entry, record in zip(self.entries, self.records(), strict=True):
            yield Heading(f"{record['name']}  {record['place']}: {record['what']}")
            yield Facts(
                [
                    ("paper", f"{record['stated']} {record['unit']}".rstrip()),
                    ("printed", record["by printed parameters"]),
                    ("recovered", record["by recovered parameters"]),
                    ("verdict", ": ".join(filter(None, (record["verdict"], record["reason"])))),
                    ("how", "; ".join(filter(None, (record["how"], entry.statement.command)))),
                ]
            )
        yield Note([DATA["paper"]["missions"]])

    def __repr__(self) -> str:
        wrong = sum(count for verdict, count in self.counts.items() if verdict in UNMATCHED)
        return f"<Ledger of {plural(len(self.entries), 'statement')}, {wrong} not matched>"

    def to_frame(self) -> DataFrame:
        """Return `records` as a data frame; needs pandas (``python -m pip install pandas``)."""
        return frame(self.records())

    def records(self) -> list[dict[str, str]]:
        """One flat record an entry."""
        return [
            {
                **{name: getattr(entry.statement, name) for name in HEAD},
                "by printed parameters": entry.figure(entry.printed),
                "by recovered parameters": entry.figure(entry.recovered),
                "verdict": entry.verdict.value,
                "reason": entry.reason,
                "how": entry.statement.how,
                "command": entry.command,
            }
            for entry in self.entries
        ]

    def to_csv(self) -> str:
        """`records` as comma-separated values with a line of headings."""
        return as_csv(self.records())


def ledger(names: str | Collection[str] = ()) -> Ledger:
    """Recompute the paper's numbers, with a verdict on each.

    Parameters
    ----------
    names
        A name of an entry, or several; or beginnings of names if no entry has exactly this name.
        All entries by default.

    Returns
    -------
    Ledger
        The entries in the paper's order, with their verdicts: see `optuav.paper.ledger.Ledger`.

    Raises
    ------
    InputError
        If a name belongs to no entry.

    Examples
    --------
    >>> import optuav
    >>> (hover,) = optuav.ledger("text-voltage-hover").entries
    >>> hover.statement.stated, f"{hover.recovered:.2f}", hover.verdict.value
    ('14.33', '14.33', 'matched with recovered parameters')
    """
    names = several("names", names, str, "names of entries, or beginnings of names", 0)
    names_known = [statement.name for statement in STATEMENTS]
    beginnings = dict.fromkeys(name.partition("-")[0] for name in names_known)
    words = f"the name of an entry, or a beginning of names: {', '.join(beginnings)}"
    refuse(
        Fault("name", shown(name), f"{words}{nearest(name, (*beginnings, *names_known))}")
        for name in names
        if not any(known.startswith(name) for known in names_known)
    )
    begun = tuple(name for name in names or [""] if name not in names_known)
    chosen = (paper for paper in STATEMENTS if paper.name in names or paper.name.startswith(begun))
    return Ledger(tuple(map(_entry, chosen)))


def _entry(paper: PaperStatement) -> Entry:
    """A statement with its values; None for a mission of another flight model than it states."""
    values = list[Any]()
    for name, *options in filter(None, (paper.compute, paper.room)):
        function = FORMULAS.get(str(name)) or globals()[str(name)]
        for mission in PAPERS:
            defined = paper.flight in ("", mission.flight.model)
            values.append(function(mission, *options) if defined else None)
    printed, recovered, *rooms = values
    return Entry(paper, printed, recovered, next((v for v in rooms if v is not None), None))


def source_for_full_charge(mission: Mission) -> Value:
    """Source that gives the battery its largest current wherever the UAV may charge."""
    assert mission.laser is not None
    places = build_network(mission).places
    there_m = places.position_m[[HOVER, *places.buildings]] - np.array(mission.laser.position_m)
    beam, distance_m = Fits.of(mission), np.linalg.norm(there_m, axis=1)
    share = laser.transmission(beam.attenuation_per_km, distance_m)
    most_W = vehicle.charging_limit_W(mission)
    needed_W = np.max(laser.source_limit(beam.conversion, most_W, share))
    return "below 1 kW" if needed_W < 1000.0 else f"{fixed(needed_W, 0)} W"


def c9_over_c6(mission: Mission) -> Value:
    """The quotient that makes the polynomial of eq (4) voltage times current."""
    motor, speeds = Rotors.of(mission).motor, np.array([500.0, 1000.0, 1500.0])
    # The odd part in v̇ is v̇ (c6 + c8 v + c9 v²).
    odd = rotor.power(motor, speeds, 100.0) - rotor.power(motor, speeds, -100.0)
    c9, _, c6 = np.polyfit(speeds, odd, 2)
    quotients = {
        "κ_T/T_f": motor.torque_constant_Nm_A / motor.friction_torque_Nm,
        "κ_0/T_f": motor.drag_coefficient_Nm_s2_rad2 / motor.friction_torque_Nm,
    }
    right = (name for name, q in quotients.items() if math.isclose(q * c6, c9, rel_tol=1e-6))
    return next(right, None)


def eta3_signs(mission: Mission) -> Value:
    """Signs of E_fl, E_hv, E_harv that give the row Δ = 697 s within a percent."""
    start, end = (charge_left(mission, 3, hover_s) / 100.0 for hover_s in (0.0, 697.0))
    hover = float(vehicle.hover_load(mission).power_W) * 697.0 / table2.HOVER_J
    shares = (1.0 - start, hover, end - start + hover)
    (stated,) = (charge[2] for charge in table2.CONSISTENT if charge[:2] == (3, 697))
    fitting = (
        " ".join("−" if sign < 0.0 else "+" for sign in signs)
        for signs in itertools.product((-1.0, 1.0), repeat=3)
        if abs(1.0 + float(np.dot(signs, shares)) - float(stated) / 100.0) < 0.01
    )
    return " or ".join(fitting)


def charge_left(mission: Mission, eta: int, hover_s: float) -> float:
    """η1, η2 or η3 at the end of the direct path [%] after a hover time [s]."""
    direct = quantities(build_network(mission), np.array([0]), rests=False)
    return 100.0 * float(np.squeeze(PERSPECTIVES[PAPER[eta - 1]](direct, hover_s, 0.0)))


def rotor_voltage(mission: Mission, regime: str) -> Value:
    """Voltage e_r of the motors [V], power over current where loads are stated by regime."""
    if regime == "flight":
        legs = build_network(mission).legs
        return float(legs.energy_J[0] / legs.charge_As[0])
    if mission.flight.model == "rotors":
        motor = Rotors.of(mission).motor
        force_N = Rotors.of(mission).airframe.external_force_N((0.0, 0.0, 0.0))
        return float(rotor.voltage(motor, rotor.hover_speed(motor, force_N)))
    load = vehicle.hover_load(mission)
    return float(load.power_W) / float(load.current_A)


def longest_perspectives(mission: Mission) -> Value:
    """The perspectives with the longest hover on the direct path, at either deadline."""
    longest: set[str] = set()
    for deadline_s in curves.DEADLINES_S:
        hovers = {name: curves.table2_row(mission, deadline_s, name).hover_time_s for name in PAPER}
        longest |= {name for name in hovers if hovers[name] >= max(hovers.values()) - SAME_S}
    return ", ".join(name for name in PAPER if name in longest)


def best_trajectory(mission: Mission, deadline_s: float) -> Value:
    """The trajectory that is best in all perspectives, or the best of each."""
    changed, best = with_deadline(mission, deadline_s), {}
    for perspective in PAPER:
        _, names = curves.longest(changed, perspective)
        best[perspective] = names[0] if names else "none of them"
    by_perspective = ", ".join(f"{perspective}: {name}" for perspective, name in best.items())
    return best["battery"] if len({*best.values()}) == 1 else by_perspective


def energy_is_shorter(mission: Mission) -> Value:
    """Return whether the energy perspective hovers less than the others at 800 s on every path."""
    changed = with_deadline(mission, 800.0)
    energy, *others = (curves.by_trajectory(changed, name) for name in ("energy", *SAME_ANSWERS))
    pairs = [(energy[name], plans[name]) for plans in others for name in energy]
    return yes_or_no(all(less.hover_time_s < more.hover_time_s for less, more in pairs))


def least_charge_is_kept(mission: Mission) -> Value:
    """Return whether η1 is at least η0 at the end of every plan at 800 s."""
    changed, least = with_deadline(mission, 800.0), mission.limits.min_soc - 1e-9
    plans = (plan for name in PAPER for plan in curves.by_trajectory(changed, name).values())
    return yes_or_no(all((plan.soc or {})["battery"] >= least for plan in plans))


def hover_drop(mission: Mission, percent: float, building: str) -> Value:
    """Return the fall of Δ from η0 = 5 % to another [%], with a rest on a building."""
    missions = [mission.replace({"limits.min_soc": min_soc}) for min_soc in (0.05, percent / 100.0)]
    plans = (solve(variant, P4(building), perspective="battery") for variant in missions)
    first_s, later_s = (plan.hover_time_s for plan in plans)
    return 100.0 * (1.0 - later_s / first_s)


def by_speed(mission: Mission, figure: str, charges: Sequence[float]) -> Value:
    """Return the change of a figure of the optimal plans with v_max, for every η0."""
    assert mission.rotor is not None
    speeds = [mission.rotor.max_speed_rad_s * share for share in curves.SPEED_SHARES]
    for least in charges:
        changes = ({"limits.min_soc": least, "rotor.max_speed_rad_s": speed} for speed in speeds)
        plans = [solve(mission.replace(change), perspective="battery") for change in changes]
        figures = [FIGURES[figure](plan) for plan in plans]
        if figures != sorted(figures):
            return "does not always rise"
    return "rises"


def _harvests(mission: Mission, distance_m: Floats) -> Floats:
    """Energy and efficiency by source and distance."""
    return np.array([curves.harvest(mission, power_W, distance_m) for power_W in SOURCES_W])


def _crossing_As(mission: Mission, hover_s: float) -> float:
    """Pack that hovers for a given time on the direct path without laser [A s]."""
    return curves.least_pack(curves.without_laser(mission), "battery", hover_s) or math.nan


FORMULAS: dict[str, Callable[..., Any]] = {
    "hover_altitude": lambda m: (
        "z_min" if build_network(m).places.position_m[HOVER][2] == m.limits.min_altitude_m else None
    ),
    "rests_that_pay": lambda m: 1.0 if one_stop_is_enough(build_network(m)) else None,
    "weight_N": lambda m: -float(Rotors.of(m).airframe.weight_N),
    "nominal_energy_J": lambda m: m.pool.capacity_As * m.battery.nominal_voltage_V,
    "full_battery_J": lambda m, voltage_V: m.pool.capacity_As * voltage_V,
    # The propeller of Morbidi et al. (2016) in air of 1.225 kg/m³
    "lift_coefficient": lambda m: 4.8e-3 * 1.225 * math.pi * 0.12**4,
    "drag_coefficient": lambda m: 2.3515e-4 * 1.225 * math.pi * 0.12**5,
    # The visibility of clear air in Zhang et al. (2018), for its attenuation
    "attenuation_per_km": lambda m: float(laser.attenuation(m.laser.wavelength_nm, 10.0)),
    "admitted": lambda m, eta, hover_s: table2.admitted(eta, hover_s),
    "hover_time_s": lambda m, *row: curves.table2_row(m, *row).hover_time_s,
    "mission_time_s": lambda m, *row: curves.table2_row(m, *row).mission_time_s,
    "optimum_in_slots": lambda m: solve(m, perspective="battery", slot_s=1.0).hover_time_s,
    "same_in_slots": lambda m: yes_or_no(
        len({solve(m, perspective=p, slot_s=1).hover_time_s for p in SAME_ANSWERS}) == 1
    ),
    "crossing_As": _crossing_As,
    "saving_As": lambda m, *at: _crossing_As(m, *at) - m.battery.capacity_As,
    "saving_percent": lambda m, *at: 100.0 * (_crossing_As(m, *at) / m.battery.capacity_As - 1.0),
    "saturation_As": lambda m: curves.least_pack(curves.without_laser(m), "battery"),
    "calmest_wind_N": curves.calmest_N,
    "least_wind_N": lambda m, axis: curves.wind_limits_N(m, axis)[0],
    "largest_wind_N": lambda m, axis: curves.wind_limits_N(m, axis)[1],
    # By the printed 11.57 N, which may be cut or rounded, and 12.74 N: m g − F
    "wind_limit_by_level": lambda _: tuple(12.74 - math.hypot(F, 12.74) for F in (11.58, 11.565)),
    "harvest_by_distance": lambda m: (
        "both fall" if np.all(np.diff(_harvests(m, FAR_M)) < 0.0) else "do not always fall"
    ),
    "harvest_by_power": lambda m: (
        "rises" if np.diff(_harvests(m, NEAR_M)[:, 0], axis=0).min() > 0 else "does not always rise"
    ),
    "efficiency_near": lambda m: " to ".join(
        fixed(100.0 * end(_harvests(m, NEAR_M)[:, 1]), 1) for end in (np.min, np.max)
    ),
}
"""Values of one line, by name."""

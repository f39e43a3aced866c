"""Fly our plans on published models of lithium cells: ``make cells`` writes ``cells.json``.

PyBaMM [1]_ simulates a cell at 25 °C from full until its voltage under load falls below a cut-off.
Plans are made for a pack of 10 Ah, and a cell carries its share of each current. Rates are in C,
multiples of the rated charge (at 0.2 C) per hour.

References
----------
.. [1] V. Sulzer, S. G. Marquis, R. Timms, M. Robinson, S. J. Chapman, "Python Battery Mathematical
   Modelling (PyBaMM)", Journal of Open Research Software, 2021.
"""

from __future__ import annotations

import itertools
import json
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

import numpy as np

import optuav
from optuav.options import BatteryName
from optuav.physics.cells import CELLS
from optuav.physics.kibam import Battery, Stage
from optuav.physics.packs import lifetime
from optuav.plan import Plan

FILE = Path(__file__).with_name("cells.json")
SEED, MISSIONS = 1, 100
PACK_A = 10.0  # Current of 1 C
PACK_As = 3600.0 * PACK_A
RATES_C = (0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # Data sheets state a charge at the first.
PULSES = ((1.0, 60.0, 60.0), (0.5, 120.0, 60.0), (0.75, 60.0, 120.0))
"""Loads with pauses: share of the largest rate, and seconds of load and of pause."""
STAGE_S, ROUNDS = 3600.0, 200  # Pieces of a constant load, and more pieces than any cell carries
NO_CEILING_V = 1e6
ONE_WELL = (0.999999, 1e3)  # ω and k_F [1/s] with which all charge is available at any time
SAME_S, SHIPPED_C = 0.05, 5.0  # Width of the last bracket; rates of the shipped missions

Load = Sequence[tuple[float, float]]
"""Currents [A], positive while discharging, or rates [C], and how long each flows [s]."""


class Kind(NamedTuple):
    """A parameter set of PyBaMM, trusted up to `most_C`, and the shipped wells for its kind.

    Missions are flown by the single-particle model with electrolyte (SPMe). Lifetimes come from it
    too, or from the full model (DFN) of sets for which the simpler one is too kind at `most_C`.
    """

    chemistry: str
    most_C: float
    cut_off_V: float = 3.0
    model: Literal["SPMe", "DFN"] = "SPMe"
    like: BatteryName = "lipo"


SETS: Mapping[str, Kind] = {
    "Ecker2015": Kind("NMC pouch", 6.0),
    "NCA_Kim2011": Kind("NCA pouch", 5.0),
    "Mohtat2020": Kind("NMC pouch", 6.0),
    "Ai2020": Kind("LCO pouch", 2.0, model="DFN"),
    "Marquis2019": Kind("LCO pouch", 3.0, cut_off_V=3.2),
    "Chen2020": Kind("NMC 21700", 2.0, model="DFN", like="liion"),
}


class Flight(NamedTuple):
    """When a flight ends [s], whether the cell falls there, its highest voltage charging [V]."""

    end_s: float
    falls: bool
    highest_V: float


class Cell:
    """A cell of PyBaMM, which is full at `upper_V` [V]."""

    def __init__(self, name: str, model: str = "SPMe") -> None:
        os.environ["PYBAMM_DISABLE_TELEMETRY"] = "true"
        import pybamm

        values = pybamm.ParameterValues(name)
        values.set_initial_state(1.0)
        self.upper_V = float(values["Upper voltage cut-off [V]"])
        rated_A = RATES_C[0] * float(values["Nominal cell capacity [A.h]"])
        inputs = {"Current function [A]": "[input]", "Upper voltage cut-off [V]": "[input]"}
        values.update({**inputs, "Lower voltage cut-off [V]": SETS[name].cut_off_V})
        self._solver = pybamm.IDAKLUSolver(rtol=1e-6, atol=1e-6)
        equations = getattr(pybamm.lithium_ion, model)()
        simulation = pybamm.Simulation(equations, parameter_values=values, solver=self._solver)
        simulation.build()
        self._model, self._error = simulation.built_model, pybamm.SolverError
        self._share = 1.0  # Current of the cell over that of the pack
        self._share = rated_A * self.fly([(rated_A, STAGE_S)] * ROUNDS).end_s / PACK_As

    def fly(self, load_A: Load, ceiling_V: float = NO_CEILING_V) -> Flight:
        """Carry a load from full; a stage that charges ends early at the ceiling."""
        state, end_s, highest_V = None, 0.0, 0.0
        for current_A, duration_s in load_A:
            if duration_s <= 0.0:
                continue
            inputs = {"Current function [A]": current_A * self._share}
            inputs["Upper voltage cut-off [V]"] = ceiling_V if current_A < 0.0 else NO_CEILING_V
            try:
                state = self._solver.step(state, self._model, duration_s, inputs=inputs, save=False)
            except self._error as error:  # The voltage is beyond a limit from the beginning.
                if "Maximum voltage" in str(error):
                    continue
                if "Minimum voltage" in str(error):
                    return Flight(end_s, True, highest_V)
                raise
            end_s = float(state.t[-1])
            if "Minimum voltage" in state.termination:
                return Flight(end_s, True, highest_V)
            state.termination = "final time"  # Else no stage would follow the ceiling.
            if current_A < 0.0:
                highest_V = max(highest_V, float(state["Voltage [V]"].entries[-1]))
        return Flight(end_s, False, highest_V)

    def lasts_s(self, load_C: Load) -> float:
        """How long the full cell carries a load that is repeated [s]."""
        return self.fly([*of_pack(load_C)] * ROUNDS).end_s


class Mission(NamedTuple):
    """Currents [A] and durations [s] of a mission with a hover and a rest, for the pack."""

    first: str  # "hover" or "rest"
    legs: Load  # Three
    hover_A: float
    charge_A: float
    deadline_s: float

    def load(self, hover_s: float, rest_s: float) -> Load:
        """Everything that the pack carries, in order."""
        stays = [(self.hover_A, hover_s), (-self.charge_A, rest_s)]
        one, other = stays if self.first == "hover" else stays[::-1]
        return [self.legs[0], one, self.legs[1], other, self.legs[2]]

    def plan(self, wells: Battery) -> tuple[float, float]:
        """The longest hover by some wells, and its rest [s]; NaN if there is none."""
        one, two, three = (Stage(-current_A, duration_s) for current_A, duration_s in self.legs)
        order: Any = ("hover", "rest") if self.first == "hover" else ("rest", "hover")
        hovers = optuav.longest_hovers(
            [one, order[0], two, order[1], three],
            battery=wells,
            deadline_s=self.deadline_s,
            min_soc=0.0,
            hover_current_A=self.hover_A,
            rest_current_A=self.charge_A,
        )
        assert hovers.proved
        return float(hovers.hover_time_s), float(hovers.rest_time_s)

    def longest_s(self, cell: Cell) -> float:
        """The longest hover by a cell [s], by bisection; NaN if it cannot fly the legs.

        The drone rests for as long as the deadline and the cell's upper voltage allow.
        """
        left_s = self.deadline_s - sum(duration_s for _, duration_s in self.legs)

        def holds(hover_s: float) -> bool:
            return not cell.fly(self.load(hover_s, left_s - hover_s), cell.upper_V).falls

        low_s, high_s = 0.0, left_s
        if not holds(low_s) or holds(high_s):
            return high_s if holds(high_s) else math.nan
        while high_s - low_s > SAME_S:
            middle_s = 0.5 * (low_s + high_s)
            low_s, high_s = (middle_s, high_s) if holds(middle_s) else (low_s, middle_s)
        return low_s


def drawn(name: str) -> Iterator[Mission]:
    """Random missions without end, at rates to which a set is trusted.

    Hovering draws 1 C or more, net of the light that shines in half of the missions, and flight as
    much as without light. The deadline is one to two times as long as the charge lasts in hover.
    """
    draw, most_C = np.random.default_rng([SEED, *name.encode()]), SETS[name].most_C
    while True:
        hover_C, charge_C = draw.uniform(1.0, most_C), draw.uniform(0.1, 1.0)
        flight_C = min(hover_C + (charge_C if draw.random() < 0.5 else 0.0), most_C)
        legs_C = [(flight_C, duration_s) for duration_s in draw.uniform(10.0, 90.0, 3).tolist()]
        first = "hover" if draw.random() < 0.7 else "rest"
        deadline_s = draw.uniform(1.0, 2.0) * 3600.0 / hover_C
        yield Mission(first, of_pack(legs_C), PACK_A * hover_C, PACK_A * charge_C, deadline_s)


def of_pack(load_C: Load) -> Load:
    """A load in A from one in C."""
    return [(PACK_A * rate_C, duration_s) for rate_C, duration_s in load_C]


def of_plan(plan: Plan) -> Mission:
    """The mission of a plan with one rest, with its currents in proportion."""
    battery, limits, phases = plan.mission.battery, plan.mission.limits, plan.phases
    share = PACK_As / (battery.capacity_As * battery.packs)
    legs = [(-share * e.current_A, e.duration_s) for e in phases if e.kind == "flight"]
    current_A = {phase.kind: share * phase.current_A for phase in phases}
    return Mission(phases[1].kind, legs, -current_A["hover"], current_A["rest"], limits.deadline_s)


def lifetimes(name: str) -> list[tuple[Load, float]]:
    """Constant loads and loads with pauses [C], and how long a full cell carries them [s]."""
    most_C, cell = SETS[name].most_C, Cell(name, SETS[name].model)
    constant = [[(rate_C, STAGE_S)] for rate_C in RATES_C if rate_C <= most_C]
    pulsed = [[(share * most_C, load_s), (0.0, pause_s)] for share, load_s, pause_s in PULSES]
    return [(load_C, cell.lasts_s(load_C)) for load_C in (*constant, *pulsed)]


def wells_of(name: str, lived: list[tuple[Load, float]]) -> dict[str, Battery]:
    """Batteries by which plans are made; one more entry is one more column of the tables."""
    wells = {str(by): Battery(PACK_As, *shares(by)) for by in ("paper", SETS[name].like)}
    wells |= {"charge only": Battery(PACK_As, *ONE_WELL), "never longer": never_longer(lived)}
    constant = [(load_C, lifetime_s) for load_C, lifetime_s in lived if len(load_C) == 1]
    return {**wells, "never longer, constant loads": never_longer(constant)}


def shares(name: BatteryName) -> tuple[float, float]:
    """ω [-] and k_F [1/s] of wells in the package."""
    return CELLS[name].available_fraction, CELLS[name].flow_rate_per_s


def never_longer(lived: list[tuple[Load, float]]) -> Battery:
    """Wells as their owner fits them to lifetimes."""
    rows = ["load,current_A,duration_s,lifetime_s"]
    for number, (load_C, lifetime_s) in enumerate(lived):
        rows += [f"{number},{amps},{lasts_s},{lifetime_s}" for amps, lasts_s in of_pack(load_C)]
    with TemporaryDirectory() as folder:
        file = Path(folder, "lifetimes.csv")
        file.write_text("\n".join(rows), "utf-8")
        fit = optuav.fit_kibam(file, never_longer=True)
    return Battery(*(value.value for value in fit.values))


def flown(cell: Cell, mission: Mission, hover_s: float, rest_s: float) -> dict[str, Any]:
    """A plan, and what it does to a cell."""
    flight = cell.fly(mission.load(hover_s, rest_s))
    falls_s = flight.end_s if flight.falls else None
    return {"hover_s": hover_s, "rest_s": rest_s, "falls_s": falls_s, "highest_V": flight.highest_V}


def random_missions(name: str, wells: Mapping[str, Battery]) -> Iterator[dict[str, Any]]:
    """Random missions that cell and wells can fly, with plans and the longest hover of the cell."""
    cell = Cell(name)
    for mission in drawn(name):
        longest_s = mission.longest_s(cell)
        plans = {by: mission.plan(battery) for by, battery in wells.items()}
        if not np.isnan([longest_s, *itertools.chain(*plans.values())]).any():
            done = {by: flown(cell, mission, *plan) for by, plan in plans.items()}
            yield {"mission": mission._asdict(), "longest_s": longest_s, "plans": done}


def shipped_missions(name: str) -> Iterator[dict[str, Any]]:
    """Shipped missions: the published optimum, and plans that do not run dry by two wells."""
    cell, keys = Cell(name), ("battery.available_fraction", "battery.flow_rate_per_s")
    for mission in map(optuav.load, ("paper", "paper-table2")):
        lipo = mission.replace(dict(zip(keys, shares("lipo"), strict=True)))
        plans = {"published": optuav.solve(mission, perspective="battery")}
        plans |= {"paper": optuav.solve(mission), "lipo": optuav.solve(lipo)}
        for by, plan in plans.items():
            own = of_plan(plan)
            done = flown(cell, own, plan.hover_time_s, plan.rest_time_s)
            yield {"mission": mission.name, "by": by, "longest_s": own.longest_s(cell), **done}


def measured(name: str, missions: int) -> dict[str, Any]:
    """What a cell does, as plain data."""
    lived = lifetimes(name)
    wells = wells_of(name, lived)
    plain = {by: asdict(battery) for by, battery in wells.items()}
    result = {**SETS[name]._asdict(), "wells": plain, "lifetimes": list[dict[str, Any]]()}
    for load_C, lifetime_s in lived:
        by_s = {by: lifetime(of_pack(load_C), **battery) for by, battery in plain.items()}
        result["lifetimes"].append({"load_C": load_C, "lifetime_s": lifetime_s, "by_s": by_s})
    if SETS[name].like == "lipo":
        result["missions"] = [*itertools.islice(random_missions(name, wells), missions)]
    if SETS[name].most_C >= SHIPPED_C:
        result["shipped"] = [*shipped_missions(name)]
    return result


def written(results: Mapping[str, Any]) -> str:
    """Results to seven digits, with a line for each lifetime and each mission."""
    plain = json.loads(json.dumps(results), parse_float=lambda text: float(f"{float(text):.7g}"))
    deep = re.compile(r"(,?)\n {4,}|\n {3}(?=[]}])")
    return deep.sub(lambda gap: ", " if gap[1] else "", json.dumps(plain, indent=1)) + "\n"


if __name__ == "__main__":
    FILE.write_text(written({name: measured(name, MISSIONS) for name in SETS}), "utf-8")

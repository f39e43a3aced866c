"""Tables made from the code: the commands, which options go together, what the engines take.

A page names a table between two comments; ``python docs/refresh.py`` writes it there.
"""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from functools import partial
from pathlib import Path
from statistics import fmean
from typing import Any

from typer.core import TyperArgument

import optuav
from formulations.formulation import Given
from formulations.parameters import Quantities
from formulations.soc import PAPER, PERSPECTIVES
from optuav.cli.app import COMMANDS, program
from optuav.engines import registry
from optuav.engines.registry import ENGINES, Engine
from optuav.judge.benchmark import Answer, answers
from optuav.mission.benchmark import PERSPECTIVES as BENCHMARK
from optuav.mission.benchmark import recipes
from optuav.modelling import Model
from optuav.modelling.classify import Traits, traits
from optuav.options import ORDERS, TRAJECTORIES
from optuav.solving.question import PROBLEMS, problem_of

NAMED = re.compile(
    r"^(<!-- table (\w+): written by refresh\.py -->\n).*?^(<!-- end of table -->)$",
    re.MULTILINE | re.DOTALL,
)
NONE = "–"

Row = tuple[str, ...]


class Own(optuav.Formulation):
    """A small formulation from outside the package."""

    def declare(self, model: Model, given: Given) -> None:
        """State the longest hover, with or without a rest."""
        hover, rest = given.hover_and_rest(model)
        model.maximise(hover)
        given.keep_deadline(model, "deadline", hover, rest)
        given.keep_charge(model, "state of charge", hover, rest)


OWN = "a class of your own"
NAMES = (*PROBLEMS, "P4", OWN)
"""Problems in the words of the tables."""


# Which options go together


def options() -> Iterator[Row]:
    """Which options each problem takes."""
    yield ("problem", "trajectory", "building", "order")
    yield from merged(merged(_options(), column=1), column=0)


def _options() -> Iterator[Row]:
    for name in NAMES:
        building = "b1" if name == "P4" else None
        ways = [way for way in TRAJECTORIES if accepted(name, trajectory=way, building=building)]
        for way in ways or [None]:
            taken = [
                choice
                for choice in itertools.product((None, "b1"), (None, *ORDERS))
                if accepted(name, trajectory=way, building=choice[0], order=choice[1])
            ]
            yield (
                name,
                way or NONE,
                *(_must(set(choices)) for choices in zip(*taken, strict=True)),
            )


def accepted(name: str, **options: Any) -> bool:
    """Whether `optuav.formulate` takes a problem with some options."""
    chosen = {option: value for option, value in options.items() if value is not None}
    try:
        problem = Own(**chosen) if name == OWN else problem_of(name, **chosen)
        optuav.formulate("paper", problem, perspective="battery")
    except (optuav.InputError, TypeError):
        return False
    return True


def _must(values: Collection[str | None]) -> str:
    """Whether an option with these accepted values must be stated, may be or must not."""
    if None not in values:
        return "required"
    return "free" if len(values) > 1 else NONE


# Which engine takes which model

OURS = [registry.engine(name) for name in ENGINES]


def engines() -> Iterator[Row]:
    """Which engine takes which problem under which perspective, in continuous times or slots."""
    yield ("problem", "perspective", "it is", *(f"`{engine.name}`" for engine in OURS))
    yield from merged(merged(_engines(), column=1), column=0)


def _engines() -> Iterator[Row]:
    for name, perspective in itertools.product((*PROBLEMS, "P4"), PERSPECTIVES):
        problem = problem_of(name, building="b1" if name == "P4" else None)
        program = optuav.formulate("paper", problem, perspective=perspective)
        yield (name, perspective, *_row([traits(part.model) for part in program.parts]))
    for perspective in PAPER:
        joined = optuav.route_choice("paper", perspective=perspective).model
        assert joined is not None
        yield ("P1 by `route_choice`", perspective, *_row([traits(joined)]))


def _row(kinds: Sequence[Traits]) -> Row:
    """What some models are, and which engine takes them all."""
    kind = "linear" if all(one.linear for one in kinds) else "nonlinear, smooth"
    binary = ", binary" if any(one.integer for one in kinds) else ""
    return (kind + binary, *(times(engine, kinds) for engine in OURS))


def times(engine: Engine, models: Sequence[Traits] = ()) -> str:
    """Which times an engine takes in all of some models, or at all."""
    words = {"continuous": False, "slots": True}
    if engine.slots is None:
        del words["continuous"]
    if engine.slots is False:
        del words["slots"]
    taken = [
        word for word, slots in words.items() if not any(engine.obstacle(m, slots) for m in models)
    ]
    return ", ".join(taken) or NONE


PURPOSES = {
    "closed-form": (
        "everyday answers, over thousands of routes",
        "exact, for all routes at once, with the binding constraints",
    ),
    "cvxpy": (
        "a second opinion, binary choices, slots, a solver of your choice",
        "global, with multipliers; binary unknowns and slots by branch and bound",
    ),
    "casadi": (
        "problems that are not linear, such as problems of your own",
        "a local optimum, the best of several starts",
    ),
    "grid": (
        "the paper's Algorithm 1, and checks of the other engines",
        "exhaustive over whole slots: the reference for the others",
    ),
    "bracket": (
        "plans that can be flown: the available well never runs dry",
        "a feasible time and proof that none is longer, through both wells",
    ),
}
"""What an engine is for, and what its answer is worth."""


def models(engine: Engine) -> str:
    """What kind of models an engine takes."""
    if not engine.nonlinear:
        return "linear"
    return "smooth" if {"derivatives", "levelling"} & {*engine.needs} else "any"


def purposes() -> Iterator[Row]:
    """What each engine is for, short enough for a first page."""
    yield ("engine", "use it for", "its answer")
    for engine in OURS:
        yield (f"`{engine.name}`", *PURPOSES[engine.name])


def capabilities() -> Iterator[Row]:
    """What each engine takes."""
    yield ("engine", "models", "unknowns", "binary", "times")
    for engine in OURS:
        most = "any number" if engine.most_unknowns is None else f"at most {engine.most_unknowns}"
        binary = "yes" if engine.integer else NONE
        yield (f"`{engine.name}`", models(engine), most, binary, times(engine))


# What the program can do


def commands() -> Iterator[Row]:
    """Every command, and the first paragraph of its help."""
    yield ("command", "does")
    for name in COMMANDS:
        command = program(name)
        arguments = [
            option.metavar for option in command.params if isinstance(option, TyperArgument)
        ]
        words = " ".join(command.help.partition("\n\n")[0].split()).removesuffix(".")
        yield (f"`{' '.join(['optuav', name, *arguments])}`", words[0].lower() + words[1:])


def options_of(command: str) -> Iterator[Row]:
    """Every argument and option of a command."""
    yield ("option", "meaning", "default")
    for option in program(command).params:
        if isinstance(option, TyperArgument):
            standard = f"`{option.default}`" if isinstance(option.default, str) else NONE
            yield (
                f"`{option.metavar}`",
                option.help,
                "required" if option.required else standard,
            )
            continue
        names = "/".join((option.opts[0], *option.secondary_opts))
        name = " ".join(filter(None, (names, option.metavar)))
        default = option.show_default if isinstance(option.show_default, str) else option.default
        shown = default is not None and default is not False
        if option.secondary_opts:
            shown, default = True, (option.opts if default else option.secondary_opts)[0]
        standard = "required" if option.required else f"`{default}`" if shown else NONE
        yield (f"`{name}`", option.help, standard)


# The paper beside us

NUMBERS = {
    "table2-4-hover": "the printed parameters give longer flights and larger currents",
    "table2-2-hover": "the same",
    "table2-1-hover": "with the printed parameters the charge ends it before the deadline",
    "table2-4-mission": "recovered: fitted; printed: 75.79 s of flight, not 59.35 s",
    "text-voltage-hover": "the printed motor constants give a lower voltage",
    "fig8-optimum": "the buildings' places are not in the paper; b9 and b10 give 951.03 s",
    "fig7-drop-10": "by way of b9; our best roof gives 5.23 %",
    "table2-1-eta2": "contradicts other rows, which leave −0.31 % (−0.27 % at 740.65 s)",
    "table2-4-eta3": "contradicts its own last row, which prints 5.09 % for the same flight",
    "fig9-limit-z-minus": "contradicts the printed 11.57 N, which leaves −4.47 N",
}
"""The most important numbers of the paper, by their names in the ledger."""


def paper() -> Iterator[Row]:
    """Numbers of the paper beside ours."""
    yield ("number", "paper", "here, printed parameters", "here, recovered loads", "why different")
    entries = {entry.statement.name: entry for entry in optuav.ledger([*NUMBERS]).entries}
    for name, why in NUMBERS.items():
        entry = entries[name]
        statement = entry.statement
        ours = (
            None if value is None else entry.figure(value)
            for value in (entry.printed, entry.recovered)
        )
        shown = (
            NONE
            if value is None
            else f"{value}\N{NO-BREAK SPACE}{statement.unit}".replace("-", "−")
            for value in (statement.stated, *ours)
        )
        yield (f"{statement.what} ({statement.place})", *shown, why)


# Beams beside demonstrations

POOR = {
    **{"laser.aperture_m": 0.1, "laser.visibility_km": 10, "laser.jitter_rad": 5e-5},
    **{"laser.turbulence_cn2": 1e-13, "receiver.radius_m": 0.25, "receiver.cell_efficiency": 0.2},
    **{"receiver.optics_efficiency": 0.8, "receiver.dc_efficiency": 0.9},
}
GOOD = {
    **{"laser.aperture_m": 0.3, "laser.visibility_km": 23, "laser.jitter_rad": 5e-6},
    **{"laser.turbulence_cn2": 1e-15, "receiver.radius_m": 0.5, "receiver.cell_efficiency": 0.5},
    **{"receiver.optics_efficiency": 1.0, "receiver.dc_efficiency": 0.95},
}
"""Assumptions on what demonstrations do not publish."""


def light_to_dc(
    distance_m: float, assumed: Mapping[str, float], light_W: float = 1000.0
) -> optuav.LinkBudget:
    """The budget over a distance of a Gaussian beam with some assumptions, without a battery."""
    light = {"laser.beam": "gaussian", "laser.wavelength_nm": 1070, "laser.power_W": light_W}
    light |= {"laser.source_efficiency": 1.0, "battery.charge_current_A": 1e6}
    mission = optuav.load("paper").replace({**light, **assumed})
    return _along(mission, distance_m)


def literature(distance_m: float, light_W: float = 600.0) -> optuav.LinkBudget:
    """The budget over a distance of the constant divergence of Chen and Jiang."""
    light = {"laser.beam": "divergence", "laser.aperture_m": 0.1, "laser.divergence_rad": 3.4e-5}
    light |= {"laser.attenuation_per_km": 1e-3, "receiver.area_m2": 0.004}
    light |= {"battery.charge_current_A": 1e6, "laser.power_W": light_W}
    return _along(optuav.load("paper").replace(light), distance_m)


def _along(mission: optuav.Mission, distance_m: float) -> optuav.LinkBudget:
    x, y, z = mission.laser.position_m if mission.laser else (0.0, 0.0, 0.0)
    return optuav.link_budget(mission, (x + distance_m, y, z))


def demonstrations() -> Iterator[Row]:
    """Published figures of power beaming beside the beams."""
    yield ("demonstration or paper", "published", "beam", "here", "verdict")

    def ends(distance_m: float) -> list[float]:
        return [light_to_dc(distance_m, quality).dc_W / 1000.0 for quality in (POOR, GOOD)]

    (low, high), printed = ends(1000.0), 152.0 / 1035.0
    ntt = "NTT and MHI 2025: 1035 W at 1070 nm, silicon cells, 1 km, strong turbulence"
    verdict = "within" if low <= printed <= high else "missed"
    yield (ntt, "152 W: 14.7 %", "gaussian", f"{100 * low:.1f} to {100 * high:.1f} %", verdict)
    formula = literature(1000.0).dc_W / 600.0
    verdict = f"missed: {formula / printed:.1f} times as much"
    yield ("the same", "14.7 %", "divergence", f"{100 * formula:.1f} %", verdict)
    low, high = ends(325.0)
    darpa = "DARPA POWER 2025: at short range, assumed to be 325 m"
    verdict = "within" if high >= 0.2 else "missed"
    yield (darpa, "above 20 %", "gaussian", f"{100 * low:.1f} to {100 * high:.1f} %", verdict)
    formula = literature(325.0).dc_W / 600.0
    verdict = "within" if formula >= 0.2 else "missed"
    yield ("the same", "above 20 %", "divergence", f"{100 * formula:.1f} %", verdict)
    most, least = (800.0 / quality for quality in ends(8600.0))
    far = "DARPA POWER 2025: 8.6 km for 30 s, light not published"
    needed = f"{least / 1e3:.1f} to {most / 1e3:.0f} kW of light"
    yield (far, "800 W", "gaussian", needed, "open: nothing to compare with")
    reach = literature(0.0).reach_m(168.5)
    chen = ("Chen and Jiang 2026: 168.5 W of 600 W", "in a cell of 1 km", "divergence")
    verdict = "within" if reach >= 1000.0 else "missed: does not reach the rim"
    yield (*chen, f"to {reach:.0f} m", verdict)
    reach = literature(0.0, 500.0).reach_m(100.0)
    covered = 1.0 - math.exp(-6e-7 * math.pi * reach**2)
    lahmeri = ("Lahmeri et al. 2019: 100 W of 500 W", "at least 6 lasers per 10 km²", "divergence")
    here = f"to {reach:.0f} m; 6 cover {100 * covered:.1f} %"
    yield (*lahmeri, here, "open: no share of the area is published")
    most_W = literature(0.0, 10.0).dc_W
    panahi = ("Panahi and Panahi: a load of 100 W of 10 W", "served", "divergence")
    verdict = "within" if most_W >= 100.0 else "missed: a misprint or another unit"
    yield (*panahi, f"{most_W:.0f} W at no distance", verdict)


# Plans on cells

CELLS: Mapping[str, Any] = json.loads(
    (Path(__file__).parents[1] / "benchmarks" / "cells.json").read_text("utf-8")
)


def cells_lifetimes() -> Iterator[Row]:
    """Lifetimes by wells beside those of the cells."""
    yield ("parameter set", "cell", "loads", "model", "paper's wells", "wells of its kind")
    for name, cell in CELLS.items():
        rows, kind = cell["lifetimes"], cell["like"]
        paper, own = (
            span([row["by_s"][by] / row["lifetime_s"] - 1.0 for row in rows])
            for by in ("paper", kind)
        )
        loads = f"{len(rows)}, 0.2 to {cell['most_C']:g} C"
        yield (name, cell["chemistry"], loads, cell["model"], f"{paper} %", f"`{kind}`: {own} %")


def cells_missions() -> Iterator[Row]:
    """Hovers of plans by several wells beside the longest of a cell, and how many plans fall."""
    wells = {"paper": "paper's wells", "charge only": "charge only", "lipo": "`lipo`"}
    wells |= {"never longer": "a fit", "never longer, constant loads": "a fit to constant loads"}
    yield ("cell", *wells.values())
    for name, cell in CELLS.items():
        if missions := cell.get("missions"):
            yield (name, *(flights(missions, by) for by in wells))


def flights(missions: Sequence[Mapping[str, Any]], by: str) -> str:
    """What became of the plans by some wells."""
    plans = [mission["plans"][by] for mission in missions]
    hovers_s = zip(plans, missions, strict=True)
    gaps = [plan["hover_s"] / mission["longest_s"] - 1.0 for plan, mission in hovers_s]
    falls = sum(plan["falls_s"] is not None for plan in plans)
    return f"{percent(fmean(gaps))} % ({span(gaps)}), {falls} of {len(plans)} fall"


def cells_shipped() -> Iterator[Row]:
    """Plans of shipped missions on cells."""
    yield ("mission", "cell", "published optimum", "paper's wells", "`lipo`")
    for mission, name in itertools.product(("paper", "paper-table2"), CELLS):
        plans = {
            row["by"]: row for row in CELLS[name].get("shipped", ()) if row["mission"] == mission
        }
        if plans:
            fell = f"falls at {plans.pop('published')['falls_s']:.1f} s"
            yield (f"`{mission}`", name, fell, *map(beside_longest, plans.values()))


def beside_longest(row: Mapping[str, Any]) -> str:
    """A hover that a cell carries beside its longest."""
    assert row["falls_s"] is None, row
    short = percent(row["hover_s"] / row["longest_s"] - 1.0)
    return f"{row['hover_s']:.1f} s of {row['longest_s']:.1f} s, {short} %"


def span(shares: Sequence[float]) -> str:
    """The least and the largest share."""
    return f"{percent(min(shares))} … {percent(max(shares))}"


def percent(share: float) -> str:
    """A share with its sign."""
    return f"{100.0 * share:+.1f}".replace("-", "−")


# Writing them


def merged(rows: Iterable[Row], column: int) -> Iterator[Row]:
    """Rows, where those that differ in one column only become one with a list in that column."""
    entries: dict[Row, list[str]] = {}
    for row in rows:
        entries.setdefault(row[:column] + row[column + 1 :], []).append(row[column])
    for row, symbols in entries.items():
        yield (*row[:column], ", ".join(dict.fromkeys(symbols)), *row[column:])


def quantities() -> Iterator[Row]:
    """What `given` has in `declare`, with the words of the nomenclature."""
    page = Path(__file__).with_name("nomenclature.md").read_text("utf-8")
    row = re.compile(r"^\| .+? (?<!\\)\| (.*?) \|.*`Quantities\.(\w+)`", re.MULTILINE)
    words = {name: text for text, name in row.findall(page)}
    yield ("in `declare`", "symbol", "unit", "mission key", "meaning")
    for quantity in fields(Quantities):
        if known := quantity.metadata:
            what = words[quantity.name]
            key = f"`{known['key']}`" if known["key"] else NONE
            yield (f"`given.{quantity.name}`", known["symbol"], known["unit"], key, what)


# The benchmark set


def families() -> Iterator[Row]:
    """The families of the benchmark set."""
    yield ("family", "missions", "roofs", "description")
    for family, group in itertools.groupby(recipes().values(), lambda recipe: recipe.family):
        members = [*group]
        roofs = sorted(len(optuav.load(member.name).buildings) for member in members)
        shown = f"{roofs[0]} to {roofs[-1]}" if roofs[0] < roofs[-1] else f"{roofs[0]}"
        yield (family, f"{len(members)}", shown, members[0].about)


def benchmark_set() -> Iterator[Row]:
    """The best known answers to the benchmark set."""
    yield ("mission", "roofs", "problem", *BENCHMARK)
    for name, recipe in recipes().items():
        roofs = len(optuav.load(name).buildings)
        for problem in recipe.problems:
            known_answers = (
                answers().get((name, problem, perspective)) for perspective in BENCHMARK
            )
            yield (name, f"{roofs}", problem, *map(known, known_answers))


def known(answer: Answer | None) -> str:
    """The best known value, and the bound where it is another."""
    if answer is None:
        return NONE
    if answer.hover_s is None:
        return "none"
    bound = f" to {answer.bound_s:.2f}" if answer.status == "feasible" else ""
    return f"{answer.hover_s:.2f}{bound}"


TABLES: Mapping[str, Callable[[], Iterator[Row]]] = {
    "commands": commands,
    **{f"options_of_{name}".replace("-", "_"): partial(options_of, name) for name in COMMANDS},
    "options": options,
    "engines": engines,
    "purposes": purposes,
    "capabilities": capabilities,
    "paper": paper,
    "quantities": quantities,
    "families": families,
    "benchmark_set": benchmark_set,
    "demonstrations": demonstrations,
    "cells_lifetimes": cells_lifetimes,
    "cells_missions": cells_missions,
    "cells_shipped": cells_shipped,
}


def written(text: str) -> str:
    """A page with every table that it names up to date."""

    def table(block: re.Match[str]) -> str:
        head, *rows = TABLES[block[2]]()
        lines = [head, ("---",) * len(head), *rows]
        cells = [[cell.replace("|", r"\|") for cell in line] for line in lines]
        body = "".join(f"| {' | '.join(line)} |\n" for line in cells).replace(" --- ", "---")
        return f"{block[1]}\n{body}\n{block[3]}"

    return NAMED.sub(table, text)

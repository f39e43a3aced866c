"""``optuav show``, ``validate``, ``missions`` and ``new``: missions as files."""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import optuav
from optuav.cli.options import is_plan, mission_of
from optuav.cli.output import NO, check_places, deliver, say
from optuav.errors import Fault, decimal, refuse
from optuav.presentation.blocks import Block, Note, Table
from optuav.presentation.numbers import figure, fixed, percent, typed

if TYPE_CHECKING:
    from optuav.fields import MissionSection
    from optuav.mission import Mission
    from optuav.mission.template import Drone
    from optuav.network.feasibility import BuildingFigures, LinkFigures
    from optuav.options import BatteryName
    from optuav.plan import Plan

UNIT = re.compile(r"\[([^]]+)\]")
_NO_UNITS = ("-", "rotor", "body")
SHEETS = {"regimes": "Datasheet", "rotary-wing": "RotorDatasheet"}
"""Datasheets by the flight model of the mission that is made of them."""
SHIPPED = Path(optuav.__file__).parent / "mission" / "shipped"
"""Names of the shipped missions, see `optuav.shipped`; found here without the mission's schema."""


def show(
    mission: str, settings: list[str] | None = None, as_json: bool = False, plot: Path | None = None
) -> None:
    """Show a mission with units and derived values, or a saved plan (a .json file).

    A plan is simulated again. Exit code 1 if the saved answer is not a feasible plan,
    or if the simulation contradicts the file.
    """
    from optuav.mission.files import label

    check_places(None, plot)
    shown: Plan | Mission
    contradictions = list[Block]()
    if is_plan(mission, ["set"] if settings else []):
        shown = optuav.load_plan(mission)
        if shown:
            verdict = optuav.audit(shown)
            shown = shown.model_copy(update={"flyable": bool(verdict)})
            if verdict.contradicted:
                words = f"The simulation contradicts {label(Path(mission))}."
                contradictions = [Note([words]), *verdict.blocks()]
    else:
        shown = mission_of(mission, settings)
    written = []
    if plot is not None:
        from optuav.plots import save_pictures

        written = save_pictures(shown, plot)
    if isinstance(shown, optuav.Plan):
        blocks = [*shown.blocks(), *contradictions]
        deliver(shown.to_dict, blocks, as_json=as_json, written=written)
    else:
        deliver(partial(_data, shown), _blocks(shown), as_json=as_json, written=written)
    if contradictions or not shown:
        raise typer.Exit(NO)


def _data(mission: Mission) -> dict[str, Any]:
    """A mission with what follows from it, as plain data."""
    from optuav.network.feasibility import building_figures, derived, link_figures

    figures = {
        figure.name: {"value": figure.value, "unit": figure.unit} for figure in derived(mission)
    }
    buildings = [figure._asdict() for figure in building_figures(mission)]
    links = {"links": links} if (links := [x._asdict() for x in link_figures(mission)]) else {}
    return {"mission": mission.to_dict(), "derived": figures, "buildings": buildings, **links}


def _blocks(mission: Mission) -> Iterator[Block]:
    """The mission's tables, and what follows from them: name, value and unit, a line each."""
    from optuav.fields import MissionSection
    from optuav.laser.beam import SpreadingBeam
    from optuav.network.feasibility import building_figures, derived, link_figures

    yield Note([f"{mission.name}  {mission.description}".rstrip()])
    sections = [item for item in vars(mission).items() if isinstance(item[1], MissionSection)]
    tables = {f"[{name}]": [*_settings(section)] for name, section in sections}
    for device in mission.devices:
        tables[f"[[devices]] {device.name}"] = [*_settings(device)]
    tables["derived"] = [(figure.name, figure.text, figure.unit) for figure in derived(mission)]
    parts = ([("", "", ""), (name, "", ""), *lines] for name, lines in tables.items())
    yield Table((), [*chain.from_iterable(parts)][1:], words=3)
    if mission.buildings:
        yield _buildings(building_figures(mission))
    if isinstance(beam := mission.beam, SpreadingBeam) and (links := link_figures(mission)):
        yield _links(links)
        yield Note([beam.eye_warning])


def _settings(section: MissionSection) -> Iterator[tuple[str, str, str]]:
    """Key, value and unit; descriptions of keys have units and names of tables in brackets."""
    for key, value in section.model_dump(exclude_none=True).items():
        units = UNIT.findall(section.descriptions().get(key, ""))
        yield key, _shown(value), next((unit for unit in units if unit not in _NO_UNITS), "")


def _shown(value: object) -> str:
    """A value as a person writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return f"({', '.join(map(_shown, value))})"
    return figure(value) if isinstance(value, float) else str(value)


def _buildings(figures: Iterable[BuildingFigures]) -> Table:
    """A line a building: its place, its light, and the flight time by way of it."""
    heads = ("name", "position m", "footprint m", "received W", "T_fl s rest first", "hover first")
    rows = list[Sequence[str]]()
    for building in figures:
        size = building.footprint_m or ()
        times = building.rest_first_s, building.hover_first_s
        polygon = f"{len(size)} corners" if size and isinstance(size[0], tuple) else ""
        row = (
            building.name,
            " ".join(figure(x) for x in building.position_m),
            polygon or " × ".join(map(_shown, size)),
            fixed(building.received_power_W, 1) if building.laser_sight else "no sight",
            *(fixed(time_s, otherwise="–") for time_s in times),
        )
        rows.append(row)
    return Table(heads, rows, words=3, above="[[buildings]]")


def _links(figures: Iterable[LinkFigures]) -> Table:
    """A line a place: its distance, its share of the light, and what that charges."""
    rows = list[Sequence[str]]()
    for link in figures:
        dark = ("no sight", "–")
        charged = fixed(link.received_power_W, 1), fixed(link.charge_current_A)
        known = fixed(link.distance_m, 1), percent(link.share)
        rows.append((link.name, *known, *(charged if link.laser_sight else dark)))
    heads = ("place", "distance m", "share", "DC power W", "current A")
    return Table(heads, rows, above="beam")


def validate(mission: str, settings: list[str] | None = None, as_json: bool = False) -> None:
    """Check a mission file; warn of values that are valid but cannot be flown."""
    from optuav.network.feasibility import advice

    checked = mission_of(mission, settings)
    warnings = list(advice(checked))
    if not (plan := optuav.solve(checked)):
        reasons = [reason for reason in plan.reasons if reason not in warnings]
        warnings += [f"no plan can be flown: {'; '.join(reasons)}"] if reasons else []
    lines = [f"{checked.name}: every key of the mission is in order"]
    lines += [f"warning: {warning}" for warning in warnings]
    data = {"mission": checked.name, "valid": True, "warnings": warnings}
    deliver(lambda: data, [Note(lines)], as_json=as_json)


def missions(of_the_set: bool = False, as_json: bool = False) -> None:
    """List the shipped missions, or with --set the benchmark set."""
    if of_the_set:
        from optuav.cli.benchmark import list_set

        list_set(as_json=as_json)
        return
    # Each file has a description of its own, so that none needs to be validated.
    rows = [
        {"name": path.stem, "description": tomllib.loads(path.read_text("utf-8"))["description"]}
        for path in sorted(SHIPPED.iterdir(), key=lambda path: path.stem)
    ]
    lines = [("mission", "what it is"), *((row["name"], row["description"]) for row in rows)]
    deliver(lambda: rows, [Table((), lines, words=2)], as_json=as_json)


def new(file: Path, source: str = "paper", **numbers: Any) -> None:
    """Write a mission file that explains every key."""
    from optuav.mission.files import STANDARD, check_place, ending_of, must_be_new, write_text
    from optuav.mission.load import load, must_load
    from optuav.mission.template import template

    ending_of(file, ".toml", "", name="FILE")
    must_be_new(file)
    check_place(file)  # before the questions
    battery: BatteryName | None = None
    if source in SHEETS:
        sheet = _sheet(getattr(optuav, SHEETS[source]), numbers)
        mission, remarks = sheet.mission(), sheet.remarks()
        say(" ".join(sheet.assumptions()))
    else:
        battery = numbers.pop("battery")
        refuse(
            Fault(name, typed(value), f"goes with --from {' or '.join(SHEETS)}")
            for name, value in numbers.items()
            if value is not None
        )
        mission, remarks = load(source), ()
    name = "mission" if file == STANDARD else file.stem
    text = template(mission, name, remarks, file, battery=battery)
    must_load(text, file)
    write_text(file, text)
    if file != STANDARD:
        say(f"wrote {file}; next: optuav validate {file}")


def _sheet(form: type[Drone], stated: Mapping[str, Any]) -> Drone:
    """The datasheet; ask a person at a terminal for missing values."""
    from optuav.mission.template import INSTEAD

    fields = form.model_fields.items()
    answers = {name: value for name, value in stated.items() if value is not None}
    known = {INSTEAD.get(name, name) for name in answers} | {"battery"}
    if "hover_power_W" in answers:
        known.add("cruise_min")  # Without it the hover time, which is not stated
    needed = {name for name, field in fields if field.is_required() or name == "hover_min"}
    for name, field in fields if needed - known and sys.stdin.isatty() else ():
        if name not in known | INSTEAD.keys():
            default = answers["hover_min"] if name == "cruise_min" else field.get_default()
            answers[name] = typer.prompt(
                form.descriptions()[name].rstrip("."),
                default=None if field.is_required() else default,
                value_proc=partial(_answer, form, name),
            )
    return form(**answers)


def _answer(form: type[Drone], name: str, text: Any) -> float:
    """A number that the datasheet takes; the prompt repeats after anything else."""
    from optuav.fields import Range
    from optuav.mission.messages import limits_of

    known = next(limits_of(form, name))
    with suppress(ValueError):
        number = decimal(str(text))
        value = int(number) if number.is_integer() else number
        if isinstance(known, Range) and known.accepts(value):
            return value
    raise typer.BadParameter(known.words)

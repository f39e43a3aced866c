"""Many missions at once: the best plans of all scenarios, as arrays and as a labelled dataset."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from formulations.formulation import Formulation
from formulations.p1 import P1
from formulations.soc import AVAILABLE, PAPER
from optuav.arrays import Floats
from optuav.engines.registry import AUTO
from optuav.errors import Fault, InputError, SolverError, collected, refuse, require
from optuav.mission import Mission, load_all
from optuav.mission.keys import keys_of_missing_tables, numeric_keys, range_of
from optuav.mission.messages import shown
from optuav.network.network import Network
from optuav.network.variants import Variants, as_variants
from optuav.options import Perspective, ProblemName
from optuav.solving.best_plans import CODES, REASONS, STATUSES, BestPlans, best_plans, takes_arrays
from optuav.solving.device_routes import network_for, with_routes
from optuav.solving.promising_buildings import best_plans_or_all, promising_subset
from optuav.solving.question import OF_THE_PAPER, Question, checked_question, perspectives_of
from optuav.solving.solve import formulate, solve
from optuav.status import Status
from optuav.studies.layouts import ROOFS, relocated
from optuav.studies.scenarios import ITINERARIES_AT_ONCE, ROW, Scenarios, check, values_of

if TYPE_CHECKING:
    import xarray

Variables: TypeAlias = dict[str, npt.NDArray[Any]]

LABELS = {
    **{f"{name}_time_s": (f"{name} time", "s") for name in ("hover", "rest", "flight", "mission")},
    **{f"soc_{name}": (f"state of charge at the end, perspective {name}", "1") for name in PAPER},
    "building": ("building of the route, of several rests the first", ""),
    "order": ("order of rest and hover", ""),
    "status": ("status of the answer", ""),
    "reason": ("reason for no plan", ""),
    "proved": ("whether it is certain that no plan is better, or that none exists", ""),
    "objective": ("objective of the problem", "s"),
    "bound": ("bound on the objective, if the answer is not proved", "s"),
}
"""The variables: their meaning, and the units of measured ones."""
MEASURED = tuple(name for name, (_, unit) in LABELS.items() if unit)
CODED = {"building": np.int32, **dict.fromkeys(("order", "status", "reason"), np.int8)}
"""Types of the variables that are numbers of words."""
KINDS: dict[str, type] = {**CODED, "proved": bool}
ORDERS = ("none", "rest-first", "hover-first")
TRIED = 64  # Scenarios that choose the routes
PROVED = np.isin(STATUSES, [Status.OPTIMAL, Status.INFEASIBLE])


class Solved(NamedTuple):
    """The variables of a batch with all labels."""

    labels: Mapping[str, Sequence[object]]  # Perspectives and missions
    keys: Mapping[str, Floats]
    shape: Mapping[str, int]  # Sizes of all dimensions
    values: Variables
    buildings: list[str]  # Names by number; the last one means none
    facts: Mapping[str, str]
    unit: str = "s"  # Unit of the objective

    @property
    def rests_between(self) -> bool:
        """Whether some plans rest between hovers over several devices."""
        return bool((self.values["order"] == ORDERS.index("hover-first") + 1).any())


def batch_arrays(
    mission: Mission | str | Path | Sequence[Mission],
    ranges: Mapping[str, npt.ArrayLike] | None = None,
    problem: Formulation | ProblemName = "P1",
    *,
    perspective: Perspective | Sequence[Perspective] = AVAILABLE,
    paired: bool = False,
) -> dict[str, npt.NDArray[Any]]:
    """Find the best plans of many scenarios of a mission, as arrays.

    Parameters
    ----------
    mission
        A mission, its name or path, or several of these.
    ranges, paired
        Values by key, or of ``"buildings"``, and whether those with the same place belong together;
        `optuav.batch` says more.
    problem, perspective
        The problem, and how charge counts, as for `optuav.solve`; or several of these.

    Returns
    -------
    dict
        The values of every key by name, and the variables of `optuav.batch`. Their axes are one for
        several perspectives, one for several missions or layouts, and one for every key, in this
        order; paired values have a single axis instead of the last two kinds. The words for the
        numbers in `building`, `order`, `status` and `reason` are under the same names with
        ``_words``, as in ``found["reason_words"][found["reason"]]``.

    Raises
    ------
    InputError
        With all faults of the ranges and options.

    Examples
    --------
    >>> import optuav
    >>> arrays = optuav.batch_arrays("paper", {"limits.deadline_s": [60, 900, 1200]})
    >>> arrays["hover_time_s"].round(2).tolist()
    [nan, 591.57, 597.27]
    >>> print(arrays["reason_words"][arrays["reason"]][0])
    the shortest flight takes longer than limits.deadline_s
    """
    solved = solved_batch(mission, ranges, problem, perspective, paired)
    words = {
        f"{name}_words": np.array(choices)
        for name, choices in words_of(solved.buildings, between=solved.rests_between).items()
    }
    return {**solved.keys, **solved.values, **words}


def batch(
    mission: Mission | str | Path | Sequence[Mission],
    ranges: Mapping[str, npt.ArrayLike] | None = None,
    problem: Formulation | ProblemName = "P1",
    *,
    perspective: Perspective | Sequence[Perspective] = AVAILABLE,
    paired: bool = False,
) -> xarray.Dataset:
    """Find the best plans of many scenarios of a mission, as a labelled dataset.

    Parameters
    ----------
    mission
        A mission, the name of a shipped one, or the path of a mission file; or several missions,
        as `optuav.layouts` makes them.
    ranges
        None for the missions as they are, or values by key, each a list or an array of numbers: any
        numeric key of a mission, places and forces by component as ``"link.device_m[0]"``. A new
        value removes what depends on the old one, like `Mission.replace`. One mission also takes
        ``"buildings"``, whole layouts: an array (layout, building, 3) of the positions [m] of all
        its buildings, which keep their names; footprints move with their buildings.
    problem, perspective
        The problem, and how charge counts, as for `optuav.solve`; or several of these.
    paired
        Whether values with the same place belong together, rather than all combinations; of several
        missions or layouts each then has the values of its own place.

    Returns
    -------
    xarray.Dataset
        Its dimensions are ``"perspective"``, ``"mission"`` or ``"layout"`` where there are several,
        and every key, in their order. Missions are numbered from 0, with their names as the
        coordinate ``mission_name``. Paired values have the one dimension ``"scenario"`` instead of
        missions, layouts and keys. Its variables are ``hover_time_s``, ``rest_time_s``,
        ``flight_time_s`` and ``mission_time_s`` [s] of the best plan; ``soc_battery``,
        ``soc_energy`` and ``soc_adjusted``, the state of charge at its end [-]; and as numbers,
        whose words are in the attributes ``flag_meanings`` and ``words``: ``building`` and
        ``order`` of its route (−1 and 0 without a rest; of several rests the first), ``status``,
        and ``reason``, why it has no plan (0 with a plan). ``proved`` is true if it is proved that
        no plan is better, or that none exists. ``objective`` and ``bound`` are as in a `Plan`.
        Without a plan times, charges and objective are NaN. Answers equal those from
        `optuav.solve`, its tie rule included.

    Raises
    ------
    InputError
        With all faults of the ranges and options, or if xarray is missing; `batch_arrays` returns
        the same without it.

    Examples
    --------
    >>> import optuav
    >>> results = optuav.batch(
    ...     "paper",
    ...     {"limits.deadline_s": [600, 1200], "battery.capacity_As": [30_000, 36_000, 42_000]},
    ...     perspective=["battery", "available"],
    ... )
    >>> dict(results.sizes)
    {'perspective': 2, 'limits.deadline_s': 2, 'battery.capacity_As': 3}
    """
    require("xarray", "labelled datasets")
    return labelled(solved_batch(mission, ranges, problem, perspective, paired))


def labelled(found: Solved) -> xarray.Dataset:
    """Return the solved batch as a dataset.

    Its variables and indices are ready made: xarray imports Dask to look at any others.
    """
    import pandas as pd
    import xarray

    dims, unit = tuple(found.shape), {**units(found.keys), ROOFS: "m"}
    words = words_of(found.buildings, between=found.rests_between)
    coordinates = dict[str, Any]()
    rows = next((name for name in ("mission", "layout") if name in dims), ROW)
    for key, labels in {**found.labels, **found.keys}.items():
        first = key if key in dims else rows
        along = (first, "roof", "axis") if key == ROOFS else (first,)
        values, attributes = np.asarray(labels), {"units": unit[key]} if key in unit else {}
        if along != (key,):
            coordinates[key] = xarray.Variable(along, values, attributes, fastpath=True)
        elif values.dtype.kind in "if":
            index = pd.Index(values, name=key)
            ready: Any = xarray.IndexVariable  # Without types
            coordinates[key] = ready(along, index, attributes, fastpath=True)
        else:  # Words
            coordinates[key] = along, values, attributes
    variables = dict[str, Any]()
    for name, values in found.values.items():
        title, measure = LABELS[name]
        measure = found.unit if name in ("objective", "bound") else measure
        more = _flags(name, words[name]) if name in CODED else {"units": measure} if measure else {}
        attributes = {"long_name": title, **more}
        variables[name] = xarray.Variable(dims, values, attributes, fastpath=True)
    return xarray.Dataset(variables, coordinates, {"Conventions": "CF-1.11", **found.facts})


def solved_batch(
    mission: Mission | str | Path | Sequence[Mission],
    ranges: Mapping[str, npt.ArrayLike] | None,
    problem: Formulation | ProblemName = "P1",
    perspective: Perspective | Sequence[Perspective] = AVAILABLE,
    paired: bool = False,
) -> Solved:
    """The best plans of all scenarios of all missions under all perspectives."""
    faults, keys = list[Fault](), dict[str, Floats]()
    wholes, perspectives = load_all(mission, faults), perspectives_of(perspective, faults)
    several = "" if isinstance(mission, Mission | str | Path) else "mission"
    if not isinstance(paired, bool):
        faults.append(Fault("paired", shown(paired), "true or false"))
    if not (wholes or faults):
        faults.append(Fault("mission", shown(mission), "a mission, or several of them"))
    ranges = {} if ranges is None else ranges
    if isinstance(ranges, Mapping) and ROOFS in ranges:
        with collected(faults):
            refuse([Fault(ROOFS, "", "layouts of one mission, not of several")] if several else ())
            wholes = [layout for whole in wholes for layout in relocated(whole, ranges[ROOFS])]
            keys[ROOFS], several = np.array(ranges[ROOFS], dtype=float), "layout"
        ranges = {key: column for key, column in ranges.items() if key != ROOFS}
    values = values_of(ranges, wrong := list[Fault](), paired=paired, missions=wholes)
    if several and paired:
        count = len(next(iter(values.values()), wholes))
        if wholes and count != len(wholes):
            words = f"{len(wholes)} {several}s, {count} values of each key"
            wrong.append(Fault("paired", words, f"one {several} for each value"))
        rows = (
            {key: column[n : n + 1] for key, column in values.items()} for n in range(len(wholes))
        )
        all_scenarios = [*map(Scenarios, wholes, rows)]
    else:
        ranges_of_each = (values, {}) if paired else (None, values)
        all_scenarios = [Scenarios(whole, *ranges_of_each) for whole in wholes]
    questions = list[list[Question]]()
    for scenarios in all_scenarios:
        with collected(faults):
            if wrong:  # Their number is not known, but the keys are
                refuse(keys_of_missing_tables(scenarios.mission, values))
            else:
                check(scenarios)
        questions.append([])
        for name in perspectives:
            with collected(faults):
                questions[-1].append(checked_question(scenarios.mission, problem, name))
    for name in () if wholes else perspectives:
        with collected(faults):
            checked_question(None, problem, name)
    refuse(dict.fromkeys(faults + wrong))
    labels = dict[str, Sequence[object]]()
    facts = {"problem": repr(questions[0][0].problem)}
    if isinstance(perspective, str):
        facts["perspective"] = perspective
    else:
        labels["perspective"] = perspectives
    if several == "mission":
        labels |= {"mission": range(len(wholes)), "mission_name": [whole.name for whole in wholes]}
    else:
        facts["mission"] = wholes[0].name
    shape = {"perspective": len(perspectives)} if "perspective" in labels else {}
    shape |= {ROW if paired else several: len(wholes)} if several else {}
    shape |= {} if several and paired else all_scenarios[0].sizes
    names = [*dict.fromkeys(name for whole in wholes for name in whole.buildings.names)]
    arrays, size = variables(all_scenarios, questions, names), tuple(shape.values())
    reshaped = {name: array.reshape(size) for name, array in arrays.items()}
    unit = "s"
    if type(questions[0][0].problem) not in OF_THE_PAPER:
        parts = formulate(wholes[0], questions[0][0].problem, perspective=perspectives[0]).parts
        unit = parts[0].declared.objective_unit if parts else ""
    return Solved(labels, {**keys, **values}, shape, reshaped, [*names, "none"], facts, unit)


def variables(
    every: Sequence[Scenarios], questions: Sequence[Sequence[Question]], buildings: Sequence[str]
) -> Variables:
    """The variables of the best plans (question, mission, scenario), as many of each mission.

    Buildings are numbered as their names are listed.
    """
    size = len(questions[0]), len(every), every[0].count
    found: Variables = {name: np.empty(size, KINDS.get(name, float)) for name in LABELS}
    numbers = {name: number for number, name in enumerate(buildings)}
    for place, scenarios, asked in _stacked(every, questions):
        # By route: the direct one first, and no plan, −1, last.
        own_numbers = [numbers[name] for name in scenarios.mission.buildings.names]
        last = len(scenarios.mission.served)
        building = np.array([-1, *np.repeat(own_numbers, last + 1), -1])
        orders = [1, *[3] * (last - 1), 2]
        order = np.array([0, *orders * len(own_numbers), 0])
        for first, variants, plans in best_of(scenarios, asked):
            for question, best in enumerate(plans):
                begin = place * every[0].count + first
                columns = {**vars(best), "building": building.take(best.route)}
                columns |= {"order": order.take(best.route), "proved": PROVED.take(best.status)}
                for name, values in found.items():
                    row = values[question].reshape(-1)
                    row[begin : begin + variants.count] = columns[name]
    return found


def _stacked(
    every: Sequence[Scenarios], questions: Sequence[Sequence[Question]]
) -> Iterator[tuple[int, Scenarios, Sequence[Question]]]:
    """Scenarios with the number of their mission, and its questions.

    Missions in a row that differ only in their buildings are one with several towns.
    """
    first = 0
    while first < len(every):
        one, wanted, last = every[first], questions[first], first + 1
        many = one.count * (1 + 2 * len(one.mission.buildings)) > ITINERARIES_AT_ONCE
        if not many and all(_as_arrays(one.mission, question) for question in wanted):
            while last < len(every) and questions[last] == wanted and _alike(one, every[last]):
                last += 1
        if len(group := every[first:last]) > 1:
            rows = [scenarios.rows for scenarios in group if isinstance(scenarios.rows, Mapping)]
            keys = rows[0] if rows else {}
            columns = {key: np.concatenate([row[key] for row in rows]) for key in keys}
            towns = tuple(scenarios.mission.buildings for scenarios in group)
            one = Scenarios(one.mission, columns, one.grid, towns)
        yield first, one, wanted
        first = last


def _as_arrays(mission: Mission, question: Question) -> bool:
    """Return whether scenarios are solved together; a named engine solves each by itself."""
    return question.engine_name == AUTO and takes_arrays(mission, question)


def _alike(one: Scenarios, other: Scenarios) -> bool:
    """Return whether missions differ only in their names and the places of their buildings."""
    mission, other_mission = one.mission, other.mission
    same = {"buildings": mission.buildings, "name": mission.name}
    alike = mission.buildings.names == other_mission.buildings.names
    return alike and other_mission.model_copy(update=same) == mission


def best_of(
    scenarios: Scenarios, questions: Sequence[Question]
) -> Iterator[tuple[int, Variants, list[BestPlans]]]:
    """The best plans of scenarios, some at a time: number of the first, their tables, plans."""
    few, alone = None, len(questions) == 1 and not scenarios.towns
    devices, routes = bool(scenarios.base.devices), scenarios.network
    if devices and all(takes_arrays(scenarios.base, question) for question in questions):
        routes = with_routes(scenarios.network, questions[0])
    elif alone and not devices:
        tried = scenarios.columns(0, TRIED) if scenarios.count > TRIED else {}
        few = promising_subset(scenarios.network, tried, questions[0])
    for first, variants in scenarios.variants(routes if devices else few):
        answers = list[BestPlans]()
        for question in questions:
            if _as_arrays(scenarios.base, question):
                with suppress(SolverError):  # of one scenario: then each is solved by itself
                    if few is None:
                        plans = best_plans(variants, question)
                        answers.append(_by_place(plans, routes) if devices else plans)
                    else:
                        answers.append(
                            best_plans_or_all(variants, scenarios.network.places, question)
                        )
                    continue
            missions = scenarios.missions(first, variants.count)
            singly = (vars(best_alone(one, question)).values() for one in missions)
            answers.append(BestPlans(*map(np.concatenate, zip(*singly, strict=True))))
        yield first, variants, answers


def best_alone(mission: Mission | InputError, question: Question) -> BestPlans:
    """The best plan of a mission; none if it contradicts itself; with several rests, the first.

    The reason for none comes from the perspective battery with one stop, if it has none either.
    """
    best = BestPlans.none(1)

    def without(status: Status, reason: str) -> BestPlans:
        best.status[:], best.reason[:] = STATUSES.index(status), CODES[reason]
        return best

    if isinstance(mission, InputError):
        return without(Status.INFEASIBLE, "contradiction")
    try:
        plan = solve(mission, **vars(question))
    except SolverError:
        return without(Status.UNKNOWN, "unknown")
    if plan.status in (Status.UNBOUNDED, Status.UNKNOWN, Status.ERROR):
        return without(plan.status, plan.status.value)
    if not plan:
        alike = replace(question, problem=P1(), perspective="battery")
        simpler = best_plans(as_variants(network_for(mission, None, alike)), alike)
        names = [*CODES]
        return without(plan.status, names[int(simpler.reason[0]) or CODES["together"]])
    best.status[:], best.reason[:] = STATUSES.index(plan.status), CODES["none"]
    soc = {f"soc_{name}": (plan.soc or {}).get(name, np.nan) for name in PAPER}
    for name in MEASURED:
        value = soc[name] if name in soc else getattr(plan, name)
        getattr(best, name)[:] = value  # NaN for None
    best.route[:] = 0
    hovers = [device.name for device in mission.served]
    stays = plan.route[1:-1]
    if rests := [place for place in stays if place in {*mission.buildings.names}]:
        number, first = mission.buildings.names.index(rests[0]), stays.index(rests[0])
        after = len({*stays[:first]} & {*hovers})
        best.route[:] = 1 + (len(hovers) + 1) * number + after
    return best


def _by_place(plans: BestPlans, network: Network) -> BestPlans:
    """Best plans over several devices, with the routes numbered by building and place of the rest.

    The direct routes are 0, and the numbers of no plan −1, as without an order of devices.
    """
    routes = network.routes
    places = 1 + (routes.devices.shape[1] + 1) * routes.building + routes.rest_after
    number = np.append(np.where(routes.building < 0, 0, places), -1)
    return replace(plans, route=number[plans.route])


def words_of(buildings: list[str], *, between: bool = False) -> dict[str, list[str]]:
    """Words by variable and number; the number −1 means the last building.

    With several devices the UAV may rest between hovers too.
    """
    return {
        "building": buildings,
        "order": [*ORDERS, *["between"] * between],
        "status": [status.value for status in STATUSES],
        "reason": [*REASONS.values()],
    }


def _flags(name: str, words: Sequence[str]) -> dict[str, Any]:
    """Attributes for numbers of words, as CF states them, and the words line by line."""
    numbers = np.arange(len(words), dtype=CODED[name])
    if name == "building":
        numbers[-1] = -1
    short = [*REASONS] if name == "reason" else words
    meanings = " ".join("_".join(word.split()) for word in short)
    return {"flag_values": numbers, "flag_meanings": meanings, "words": "\n".join(words)}


def units(keys: Iterable[str]) -> dict[str, str]:
    """Units of all keys of missions, and of places of devices among some, as CF writes them."""
    ranges = numeric_keys() | {key: x for key in keys if (x := range_of(key)) is not None}
    written = {key: allowed.unit for key, allowed in ranges.items()}
    return {key: "1" if unit == "-" else unit for key, unit in written.items()}

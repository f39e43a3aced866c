"""Constraints of a route in words: at which moment of the flight each holds."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from formulations.soc import LABELS, StepEnd
from optuav.modelling.check import Check
from optuav.modelling.declaration import Constraint
from optuav.modelling.writer import Text
from optuav.network.network import Network
from optuav.network.places import on_landing
from optuav.presentation.numbers import figure, percent_apart
from optuav.solving.assemble import legs_and_stays
from optuav.solving.route_models import RouteModel

ENDS = {
    "flight": "at the end of the flight {} → {}",
    "hover": "after the hover",
    "rest": "after the rest at {1}",
}
"""The end of a phase in words, by its kind, with the places where it starts and ends."""
OVER = "after the hover over {1}"  # The end of a hover over one of several devices
LABELLED = (
    (r"^P\d+(-\w+)?\.\w (?=hover time$)", "range of the "),
    (r"^P\d+(-\w+)?\.\w ", ""),
    (r"^state of charge$", "charge left"),
    (r"^not (?=past full)", "available well not "),
    (r"^not dry", "available well not empty"),
    (r"^bounds of Δ$", "hover time ≥ 0"),
    (r"^bounds of T'$", "rest time ≥ 0"),
)
"""Words in place of parts of the paper's labels."""
OF_CHARGE = ("state of charge", *LABELS)  # Kinds of constraints on charges


def moments(network: Network, part: RouteModel, entry: int) -> dict[str, str]:
    """Return by constraint label the moment when it holds on a route, by places, if it has one."""
    constraints = part.declared.constraints
    steps = {c.label: c.step for c in constraints if c.step is not None}
    flights = {c.label: c.moment.flight for c in constraints if isinstance(c.moment, StepEnd)}
    if not flights:
        return {}
    table, names, ends = network.legs, network.places.names, list[str]()
    landed = [""]
    for legs, stay in legs_and_stays(network, part.routes, part.rests):
        leg = names[table.start[legs[entry]]], names[table.end[legs[entry]]]
        # The declaration has the stages that any of its routes has, bent ways more than straight.
        stages = np.flatnonzero(table.durations_s[:, legs].any(axis=1)).tolist()
        of_flight = "of the flight {} → {}".format(*leg)
        for stage in stages[:-1]:
            ends.append(f"after stage {stage + 1} ({table.stages[stage]}) {of_flight}")
        ends += [ENDS["flight"].format(*leg)] * (len(stages) > 0)
        one = stay != "hover" or not network.mission.devices
        ends += [(ENDS[stay] if one else OVER).format(*leg)] if stay else []
        landed += [on_landing(leg[1], hovers=stay == "hover")] if stay else []
    at_stays = {label: ends[step] for label, step in steps.items()}
    return {
        label: landed[flight] for label, flight in flights.items() if label not in at_stays
    } | at_stays


def words(network: Network, part: RouteModel, entry: int, labels: Sequence[str]) -> list[str]:
    """Labels of constraints with their moments by the places of the route."""
    moment_of = moments(network, part, entry)
    names = {c.label: c.name for c in part.declared.constraints}
    return [
        f"{names[label]} {moment_of[label]}" if label in moment_of else label for label in labels
    ]


def constraint_words(label: str) -> str:
    """The label of a constraint without the paper's number and symbols."""
    for pattern, words in LABELLED:
        label = re.sub(pattern, words, label)
    return label


def limits_share(constraint: Constraint) -> bool:
    """Whether both sides of a constraint are shares of the capacity."""
    return constraint.kind in OF_CHARGE and constraint.unit in ("", "1")


def violation(row: Check) -> str:
    """A comparison that does not hold, in numbers: ``"−117.86 % ≥ 5 %"``; shares in percent."""
    left, right = float(row.left), float(row.right)
    in_percent = limits_share(row.constraint)
    sides = percent_apart(left, right) if in_percent else (figure(left), figure(right))
    return f" {Text.senses[row.sense]} ".join(sides)

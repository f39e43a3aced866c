"""A program in writing: as mathematics, or as a file that other solvers read."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from optuav.engines.export import FILES, need_linear, to_file
from optuav.errors import Fault, InputError, NoPlanError
from optuav.mission.messages import printable, shown
from optuav.network.network import NO_LEG
from optuav.solving import Program
from optuav.solving.dispatch import answer

FORMS = ("text", "latex", *FILES)


def statement(program: Program, form: str = "text") -> str:
    """A program in writing.

    Parameters
    ----------
    program
        From `optuav.formulate`.
    form
        ``"text"`` or ``"latex"``: all its models, parameters that differ between routes given as
        ranges. ``"lp"`` or ``"mps"``: one linear programme with numbers, of several routes the one
        that is best; its name stands in the comment at the top. A solver that reads it finds the
        optimum of the program.

    Raises
    ------
    InputError
        If the form does not exist, or a file is asked for and a constraint is not linear, or times
        are in slots.
    NoPlanError
        If nothing can be flown.
    """
    if form not in FORMS:
        raise InputError([Fault("form", repr(form), f"one of {', '.join(FORMS)}")])
    if not program.parts:
        raise NoPlanError(f"nothing can be flown: {'; '.join(program.reasons)}")
    if form == "text":
        return str(program)
    if form == "latex":
        return program.to_latex()
    for part in program.parts:
        need_linear(part.model)
    if (slot_s := program.question.slot_s) is not None:
        raise InputError([Fault("slot_s", shown(slot_s), "LP and MPS files hold continuous times")])
    solutions = [answer(part.model, len(part.routes), program.question) for part in program.parts]
    chosen = program.best(solutions)
    number, entry = chosen or _shortest(program)
    part = program.parts[number]
    choice = "the best" if chosen else "no route has an answer; that of the shortest flight"
    remarks = list(_remarks(program, number, entry, choice))
    return to_file(part.model, part.model.row(entry), form, remarks)


def _shortest(program: Program) -> tuple[int, int]:
    """Part and entry of the route with the shortest flight."""
    flight_s = [program.network.routes.flight_time_s[p.routes] for p in program.parts]
    number = int(np.argmin([each.min() for each in flight_s]))
    return number, int(flight_s[number].argmin())


def _remarks(program: Program, number: int, entry: int, choice: str) -> Iterator[str]:
    network, asked = program.network, program.question
    legs = network.routes.legs[program.parts[number].routes[entry]]
    legs = legs[legs != NO_LEG]
    places = [network.legs.start[legs[0]], *network.legs.end[legs]]
    route = " -> ".join(printable(network.places.names[place]) for place in places)
    yield f"mission {printable(network.mission.name)}, perspective {asked.perspective}"
    yield f"route {route}"
    count = sum(len(part.routes) for part in program.parts)
    if count > 1:
        yield f"{choice} of {count} routes, each a programme of its own"

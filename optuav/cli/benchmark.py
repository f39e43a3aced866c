"""``optuav check-solutions``, and the benchmark set as ``optuav missions --set`` lists it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

import optuav
from optuav.cli.output import NO, deliver
from optuav.presentation.blocks import Block, Note, Table
from optuav.presentation.numbers import fixed

if TYPE_CHECKING:
    from optuav.judge.benchmark import Answer


def check_solutions(solutions: Path, as_json: bool = False) -> None:
    """Simulate anyone's solutions of the benchmark set, and check each.

    Exit code 1 if one does not hold, 2 if the file cannot be read.
    """
    checked = optuav.check_solutions(solutions)
    deliver(checked.to_dict, checked.blocks(), as_json=as_json)
    if not checked:
        raise typer.Exit(NO)


def list_set(*, as_json: bool) -> None:
    """Print the missions of the set with the best known answers; text has those in `available`."""
    deliver(lambda: [*_data()], _tables(), as_json=as_json)


def _data() -> Iterator[dict[str, Any]]:
    """Every mission with all its answers, as plain data."""
    from optuav.judge.benchmark import answers
    from optuav.mission.benchmark import recipes

    known = {name: [*found] for name, found in groupby(answers().values(), lambda x: x.mission)}
    for name, recipe in recipes().items():
        rows = [{key: x for key, x in asdict(question).items() if x} for question in known[name]]
        about = {"name": name, "family": recipe.family, "about": recipe.about}
        yield about | {"roofs": len(optuav.load(name).buildings), "answers": rows}


def _tables() -> Iterator[Block]:
    """A table for each family."""
    from optuav.judge.benchmark import answers
    from optuav.mission.benchmark import recipes

    yield Note(["Longest hover in seconds, perspective available; --json has all perspectives"])
    for _, of_family in groupby(recipes().values(), lambda each: each.family):
        group = [*of_family]
        rows = list[tuple[str, ...]]()
        for recipe in group:
            roofs = str(len(optuav.load(recipe.name).buildings))
            for problem in recipe.problems:
                answer = answers()[recipe.name, problem, "available"]
                rows.append((recipe.name, problem, roofs, *_cells(answer)))
        heads = ("mission", "problem", "roofs", "best", "bound", "proof")
        above = f"{group[0].family}: {group[0].about}"
        yield Table(heads, rows, words=2, last=1, longest=40, above=above)


def _cells(answer: Answer) -> tuple[str, str, str]:
    """Best known value and bound, and a word on the proof: search, bracket, bound, physics."""
    ends = answer.hover_s, answer.bound_s
    best, bound = (fixed(end, 3) for end in ends)
    by = answer.proof.partition(":")[0].removesuffix("ed")
    by = "search" if answer.engine == "search" else by
    return best, bound, "open" if answer.status == "feasible" else by

"""Which numbers of a model no engine can use, in words that name where they stand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from optuav.errors import Fault, InputError
from optuav.modelling.expression import Leaf, Operand, Variable
from optuav.modelling.model import Model
from optuav.modelling.traversal import evaluate, fold, has_unknowns

OBJECTIVE = "objective"


def refuse_misfits(model: Model, programmes: int) -> None:
    """Refuse arrays with neither one entry nor one a programme.

    Parameters
    ----------
    model
        The declaration.
    programmes
        How many programmes it declares as one.

    Raises
    ------
    InputError
        Naming every constraint, or the objective, that speaks of such an array.
    """
    done: dict[int, Any] = {}
    faults = []
    for label, sides in _stated(model).items():
        found: set[tuple[int, ...]] = set()

        def leaf(node: Leaf, found: set[tuple[int, ...]] = found) -> None:
            if not isinstance(node, Variable):
                found.add(np.shape(node.value))

        def call(
            ufunc: Any, operands: tuple[Any, ...], found: set[tuple[int, ...]] = found
        ) -> None:
            found.update(np.shape(each) for each in operands if isinstance(each, np.ndarray))

        found.update(np.shape(fold(side, leaf, call, done=done)) for side in sides)
        allowed = f"arrays with one entry a programme, here {programmes}"
        misfits = found - {(), (1,), (programmes,)}
        faults += [Fault(label, f"array of shape {each}", allowed) for each in sorted(misfits)]
    if faults:
        raise InputError(faults)


@np.errstate(all="ignore")
def unusable(model: Model, values: Mapping[str, Any]) -> str:
    """Where the numbers of a programme are no numbers: parameters, else labels of constraints.

    Parameters
    ----------
    model
        The declaration.
    values
        Values of its parameters for that programme, by name.
    """
    parameters = [
        f"{name} = {values[name]:g}" for name in model.given if not np.isfinite(values[name])
    ]
    anywhere = {**values, **{each.name: 1.0 for each in model.variables}}
    labels = [
        repr(label)
        for label, sides in _stated(model).items()
        if any(_is_unusable(side, anywhere) for side in sides)
    ]
    return ", ".join(parameters or labels)


def _stated(model: Model) -> dict[str, list[Operand]]:
    """What is sought and the sides of what holds, by label."""
    found: dict[str, list[Operand]] = {OBJECTIVE: [model.objective, *model.preferences]}
    for each in model.constraints:
        found[each.label] = [*each.relation.sides]
    for variable in model.variables:
        found.setdefault(variable.label, []).extend((variable.lower, variable.upper))
    return found


def _is_unusable(side: Operand, values: Mapping[str, Any]) -> bool:
    """Whether a side is no number, or has unknowns and is not finite."""
    value = evaluate(side, values)
    return bool(np.any(np.isnan(value)) or (np.any(np.isinf(value)) and has_unknowns(side)))

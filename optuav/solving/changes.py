"""Changed parameters of a compiled program: which there are, and which values they may take."""

from __future__ import annotations

import reprlib
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from optuav.errors import Fault, InputError
from optuav.mission.messages import nearest, number
from optuav.modelling import Parameter


def refuse(values: Mapping[str, Any], parameters: Mapping[str, Parameter], most: int) -> None:
    """Refuse values that the parameters of a program may not have.

    Those that come from a key of the mission may have what the key may have, the others any finite
    number.

    Parameters
    ----------
    values
        By name.
    parameters
        Of the program, by name.
    most
        How many entries an array has.

    Raises
    ------
    InputError
        With all of them.
    """
    faults = list(_faults(values, parameters, most))
    if faults:
        raise InputError(faults)


def _faults(
    values: Mapping[str, Any], parameters: Mapping[str, Parameter], most: int
) -> Iterator[Fault]:
    for name, value in values.items():
        words = _objection(name, value, parameters, most)
        if words:
            yield Fault(name, reprlib.repr(value), words)


def _objection(name: str, value: Any, parameters: Mapping[str, Parameter], most: int) -> str:
    """What is wrong with a value; empty if nothing is."""
    if name not in parameters:
        known = ", ".join(parameters)
        return f"is no parameter of the program{nearest(name, parameters)}; there are {known}"
    if not _numbers(value, most):
        return "a finite number" + (f", or {most} of them" if most > 1 else "")
    key = parameters[name].key
    allowed = number(key)
    if allowed is None or all(map(allowed.accepts, np.ravel(value).tolist())):
        return ""
    return f"{allowed.words}, as {key}"


def _numbers(value: Any, most: int) -> bool:
    """Whether it is a finite number or as many of them as there are."""
    if isinstance(value, bool):
        return False
    try:
        numbers = np.asarray(value)
    except ValueError:
        return False
    fits = numbers.dtype.kind in "iuf" and numbers.shape in ((), (most,))
    return fits and bool(np.isfinite(numbers).all())

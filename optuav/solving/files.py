"""Programmes with numbers as files that other solvers read."""

from collections.abc import Callable

from optuav.engines import export, pyomo_engine
from optuav.errors import InputError
from optuav.mission.messages import unknown
from optuav.modelling import Model

WRITERS = {
    **dict.fromkeys(export.FILES, export.to_file),
    **dict.fromkeys(pyomo_engine.FILES, pyomo_engine.to_file),
}
"""What writes a format, by its suffix."""


def writer(form: str, *models: Model) -> Callable[..., str]:
    """Return what writes a format; refused if there is none, or it cannot hold some models."""
    if form not in WRITERS:
        raise InputError([unknown("form", form, tuple(WRITERS))])
    for model in models if form in export.FILES else ():
        export.need_linear(model)
    return WRITERS[form]

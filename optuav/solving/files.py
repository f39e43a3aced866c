"""Programmes with numbers as files that other solvers read."""

from collections.abc import Callable, Iterable
from pathlib import Path

from optuav.arrays import Values
from optuav.engines.export import FILES, LINEAR, need_linear, to_file
from optuav.errors import InputError
from optuav.mission.files import check_place, ending_of, write_text
from optuav.mission.messages import of_kind, path_of, unknown
from optuav.modelling import Model

ENDINGS = tuple(f".{form}" for form in FILES)


def writer(stated: str | Path, *models: Model) -> Callable[..., str]:
    """Return what makes the text of a form from a model, values and remarks.

    A path, whose suffix is the form, is written to as well. `InputError` if there is no such form,
    it cannot hold some of the models, or the path cannot be written to.
    """
    form, path = of_kind("form", stated, str | Path, "a form, or the path of a file"), None
    if form not in FILES:
        path = path_of(form, "form")
        if not path.suffix:
            raise InputError([unknown("form", str(form), tuple(FILES))])
        form = ending_of(path, *ENDINGS, name="form").removeprefix(".")
        check_place(path)
    for model in models if form in LINEAR else ():
        need_linear(model)

    def write(model: Model, values: Values, remarks: Iterable[str]) -> str:
        text = to_file(model, values, form, remarks)
        if path is not None:
            write_text(path, text)
        return text

    return write

"""What an answer that counts on the wind is worth in calm air."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from optuav.errors import InputError, NoPlanError
from optuav.mission import Mission
from optuav.network import vehicle
from optuav.presentation.numbers import seconds

Answer = TypeVar("Answer")


def in_calm_air(mission: Mission, ask: Callable[[Mission], Answer]) -> Answer | str | None:
    """The answer in calm air, or why there is none, if hovering counts on the wind; else None."""
    calm = vehicle.in_calm_air(mission)
    try:
        return None if calm is None else ask(calm)
    except (InputError, NoPlanError) as error:
        return str(error)


def with_words(
    answer: Answer | str | None, words: Callable[[Answer], str]
) -> tuple[Answer, str] | tuple[None, str | None]:
    """A figure in calm air and the same in words, which may say why there is none."""
    if answer is None or isinstance(answer, str):
        return None, answer
    return answer, words(answer)


def hover_words(hover_s: float) -> str:
    """A hover time in calm air."""
    return f"{seconds(hover_s)} of hover"


def calm_facts(in_calm_air: str | None) -> Iterator[tuple[str, str]]:
    """Yield what calm air gives, where an answer counts on the wind."""
    if in_calm_air is not None:
        yield "Wind", f"this holds while the wind blows; in calm air: {in_calm_air}"

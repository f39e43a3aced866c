"""What a study shows: a picture, the numbers in it, and what they say."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from optuav.mission import Mission

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True)
class Exhibit:
    """A picture with its data.

    Parameters
    ----------
    name
        Short and unique: name of its files.
    caption
        What is shown, with its place in the paper.
    axes
        One of the axes of the picture.
    records
        The numbers in it, one flat record a row.
    findings
        What they say, in sentences.
    """

    name: str
    caption: str
    axes: Axes
    records: Sequence[dict[str, Any]]
    findings: tuple[str, ...] = ()


@dataclass(frozen=True)
class LeftOut:
    """What a study does not show of a mission.

    Parameters
    ----------
    what
        Which part; empty for the whole study.
    why
        The reason in words.
    """

    what: str
    why: str


@dataclass(frozen=True)
class Study:
    """A figure or table of the paper, made anew for a mission.

    Parameters
    ----------
    name
        Name for ``--only``.
    title
        Heading in the report.
    make
        Its exhibits for a mission, and what of it is left out.
    """

    name: str
    title: str
    make: Callable[[Mission], Iterator[Exhibit | LeftOut]]


OURS = "available"
"""The perspective in which the available well must last."""


def stem(mission: Mission) -> str:
    """The mission's name as a part of names of files."""
    return re.sub(r"[^\w.-]+", "-", mission.name).strip("-.") or "mission"


def heading(mission: Mission) -> str:
    """The mission's name in the title of a picture."""
    from optuav.plots.style import printed

    return printed(mission.name)


def is_papers(mission: Mission) -> bool:
    """Whether a mission is one of the paper's, which the paper's own numbers belong to."""
    return mission.name in ("paper", "paper-table2")


def caption(mission: Mission, words: str, place: str, *details: str) -> str:
    """What is shown, where the paper has it if the mission is the paper's, and for what."""
    of_paper = f" ({place} of the paper)" if is_papers(mission) and place else ""
    return f"{words}{of_paper}: {', '.join((mission.name, *details))}"


def deadline(mission: Mission) -> str:
    """The deadline in words."""
    return f"T_max = {mission.limits.deadline_s:g} s"


def number(value: float, digits: int) -> str:
    """A number in a sentence: a minus for its sign, and none where it rounds to 0."""
    return f"{round(value, digits) + 0.0:.{digits}f}".replace("-", "\N{MINUS SIGN}")


def sentence(words: str) -> str:
    """Words with a capital and a full stop."""
    return f"{words[:1].upper()}{words[1:].removesuffix('.')}."


def percent(share: float | None) -> float | None:
    """A share in percent."""
    return None if share is None else 100.0 * share

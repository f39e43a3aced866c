"""How far an answer to (P2) is from the longest hover, which (P1) asks for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from formulations.p1 import P1
from optuav.mission.network import Network
from optuav.solving.dispatch import answer
from optuav.solving.given import quantities
from optuav.solving.planning import Part
from optuav.solving.question import Question
from optuav.solving.ties import SAME_S


def against_p1(
    asked: Question, worked_out: Network, parts: Sequence[Part], hover_time_s: float
) -> Iterator[str]:
    """Notes on an answer to P2 or P2-tight, in words; none for other problems.

    Parameters
    ----------
    asked, worked_out, parts
        The question, and the models that answered it.
    hover_time_s
        Δ of the answer [s].
    """
    if asked.problem not in ("P2", "P2-tight"):
        return
    if asked.problem == "P2":
        yield "(P2) as printed holds no Δ in its objective: any feasible hover time is as good"
    longest_s = max(_longest_hover_s(asked, worked_out, part) for part in parts)
    if longest_s > hover_time_s + SAME_S:
        yield (
            f"(P1) hovers {longest_s:.2f} s on the same mission, "
            f"{longest_s - hover_time_s:.2f} s longer"
        )


def _longest_hover_s(asked: Question, worked_out: Network, part: Part) -> float:
    rests = any(each.name == "rest_time_s" for each in part.model.variables)
    given = quantities(worked_out, part.routes, rests=rests)
    p1 = P1.model(given, asked.perspective)
    found = answer(p1, len(part.routes), replace(asked, problem="P1")).objective
    return float(np.nanmax(found, initial=-np.inf))
